# Draws the output of `bristle accuracy --csv`: error of the force against time per scene step.
#   gnuplot -e "csv='accuracy.csv'; png='accuracy.png'; title='fingertip'" accuracy.gp
if (!exists("csv")) { print "accuracy.gp: needs csv='FILE'"; exit status 2 }
if (!exists("png")) png = "accuracy.png"
if (!exists("title")) title = csv

# Numbers of the columns: 2 dt, 3 rule, 4 precision, 6 as the scene, 7 usable, 8 Pareto, 9 recommended, 10
# error, 11 its standard error, 18 time of a scene step, 21 deadline, 22 error of the reference, 23 population. Rows are
# selected by awk, which every system has.
pick(condition) = sprintf("awk -F, 'NR > 1 && (%s) { print $18, 100 * $10, 100 * $11 }' '%s'", condition, csv)
there(condition) = int(system(pick(condition)." | wc -l")) > 0
cell(what, row) = real(system(sprintf("awk -F, 'NR == %d { print %s }' '%s'", row, what, csv)))
deadline = cell("$21", 2)
floor_error = 100 * cell("$22", 2)
least_x = real(system(sprintf("awk -F, 'NR > 1 && (!m || $18 < m) { m = $18 } END { print m }' '%s'", csv)))
most_x = real(system(sprintf("awk -F, 'NR > 1 && $18 > m { m = $18 } END { print m }' '%s'", csv)))
least_y = 100 * real(system(sprintf("awk -F, 'NR > 1 && (!m || $10 < m) { m = $10 } END { print m }' '%s'", csv)))
most_x = most_x > deadline ? most_x : deadline
x1 = 0.6 * least_x
x2 = 2.5 * most_x
y1 = 0.5 * (least_y < floor_error ? least_y : floor_error)
y2 = 200

array condition[6]
array name[6]
# Colours of Okabe and Ito.
array colour[6] = ["#0072B2", "#56B4E9", "#009E73", "#D55E00", "#000000", "#E69F00"]
array mark[6] = [7, 6, 8, 2, 5, 9]
plain = "!$9 && !$6 && $3 == \"exact\" && $23 != \"infinite\""
condition[1] = plain." && $7 && $4 == \"single\""
name[1] = "exact, single"
condition[2] = plain." && !$7 && $4 == \"single\""
name[2] = "  longer steps, or the other force"
condition[3] = plain." && $4 == \"double\""
name[3] = "double precision"
condition[4] = "!$9 && !$6 && $3 == \"paper\""
name[4] = "the paper's loop"
condition[5] = "$6 && !$9"
name[5] = "the scene as it is"
condition[6] = "!$9 && !$6 && $23 == \"infinite\""
name[6] = "infinite brush, resolution 2 to 32"

set terminal pngcairo size 1500,1150 font "DejaVu Sans,17" linewidth 1.8
set output png
set title title font ",20" noenhanced
set border 3 linecolor "#555555"
set tics nomirror
set grid linecolor "#DDDDDD"
set logscale xy
set xrange [x1:x2]
set yrange [y1:y2]
set format x "%g"
set format y "%g"
set xlabel "CPU time per step of the scene, one thread  [us]"
set ylabel "error of the force, rms over rms of the force  [%]"
set bmargin 8
set key outside bottom center horizontal Left reverse samplen 3 maxcolumns 2 font ",15"
set object 1 rectangle from x1, 7 to x2, 10 fillcolor rgb "#EEDD88" fillstyle solid 0.6 noborder behind
set label 1 "people tell forces apart from 7 to 10 % on" at 0.93 * deadline, 8.35 right textcolor rgb "#665500"
set arrow 1 from deadline, y1 to deadline, y2 nohead linecolor rgb "#555555" dashtype 2
set label 2 sprintf("deadline %g us", deadline) at 0.93 * deadline, 0.65 * y2 right textcolor rgb "#555555"
set arrow 2 from x1, floor_error to x2, floor_error nohead linecolor rgb "#999999" dashtype 3
set label 3 "error of the reference itself" at 0.9 * x2, 0.85 * floor_error right textcolor rgb "#777777"

# Plots only series that were measured, since gnuplot warns of an empty one.
command = 'plot "< ".pick("$8") using 1:2 with lines linewidth 2.5 linecolor rgb "#0072B2" title "front: best of what the scene can take"'
do for [i=1:6] {
  if (there(condition[i])) {
    command = command.sprintf(', "< ".pick(condition[%d]) using 1:2:3 with yerrorbars pointtype %d pointsize 1.3 linewidth 0.8 linecolor rgb "%s" title "%s"', i, mark[i], colour[i], name[i])
  }
}
if (there("$9")) {
  command = command.', "< ".pick("$9") using 1:2 with points pointtype 6 pointsize 4 linewidth 2.5 linecolor rgb "#D55E00" title "recommended, run again"'
}
eval command
