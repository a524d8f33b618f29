# Draws the output of `bristle accuracy --csv`: error of the force against time per scene step.
#   gnuplot -e "csv='accuracy.csv'; png='accuracy.png'; title='fingertip'" accuracy.gp
if (!exists("csv")) { print "accuracy.gp: needs csv='FILE'"; exit status 2 }
if (!exists("png")) png = "accuracy.png"
if (!exists("title")) title = csv

# Numbers of the columns: 3 rule, 4 precision, 6 as the scene, 7 usable, 8 Pareto, 9 recommended, 10 error, 11 its
# standard error, 18 time of a scene step, 21 deadline, 22 error of the reference, 23 population.
set datafile separator comma
set datafile columnheaders
set datafile missing NaN
least_x = least_y = most_x = 0
note(x, y) = (least_x = least_x > 0 && least_x < x ? least_x : x, least_y = least_y > 0 && least_y < y ? least_y : y, \
  most_x = x > most_x ? x : most_x, 0)
stats csv using (deadline = $21, floor_error = 100 * $22, note($18, 100 * $10)) nooutput
most_x = most_x > deadline ? most_x : deadline
x1 = 0.6 * least_x
x2 = 2.5 * most_x
y1 = 0.5 * (least_y < floor_error ? least_y : floor_error)
y2 = 200

array name[6]
# Colours of Okabe and Ito.
array colour[6] = ["#0072B2", "#56B4E9", "#009E73", "#D55E00", "#000000", "#E69F00"]
array mark[6] = [7, 6, 8, 2, 5, 9]
name[1] = "exact, single"
name[2] = "  longer steps, or the other force"
name[3] = "double precision"
name[4] = "the paper's loop"
name[5] = "the scene as it is"
name[6] = "infinite brush, resolution 2 to 32"
# Series of a row: 0, none, 1 to 6 as above.
exact(precision, usable) = precision eq "double" ? 3 : usable > 0 ? 1 : 2
series(rule, precision, usable, population) = column(9) > 0 ? 0 : column(6) > 0 ? 5 : population eq "infinite" ? 6 : \
  rule eq "exact" ? exact(precision, usable) : rule eq "paper" ? 4 : 0
of_row = "series(strcol(3), strcol(4), $7, strcol(23))"
array rows[6]
do for [i=1:6] {
  n = recommended = 0
  stats csv using (recommended = recommended + $9, n = n + (@of_row == i), 0) nooutput
  rows[i] = n
}

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
command = 'plot csv using ($8 > 0 ? $18 : NaN):(100 * $10) with lines linewidth 2.5 linecolor rgb "#0072B2" title "front: best of what the scene can take"'
do for [i=1:6] {
  if (rows[i] > 0) {
    command = command.sprintf(', csv using ('.of_row.' == %d ? $18 : NaN):(100 * $10):(100 * $11) with yerrorbars pointtype %d pointsize 1.3 linewidth 0.8 linecolor rgb "%s" title "%s"', i, mark[i], colour[i], name[i])
  }
}
if (recommended > 0) {
  command = command.', csv using ($9 > 0 ? $18 : NaN):(100 * $10) with points pointtype 6 pointsize 4 linewidth 2.5 linecolor rgb "#D55E00" title "recommended, run again"'
}
eval command
