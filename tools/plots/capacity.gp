# Draws the output of `bristle capacity --csv`: step time (p99) against bristles, with the deadline and the paper's 900.
#   gnuplot -e "csv='capacity.csv'; png='capacity.png'" capacity.gp
if (!exists("csv")) { print "capacity.gp: needs csv='FILE'"; exit status 2 }
if (!exists("png")) png = "capacity.png"
if (!exists("title")) title = "Step time against bristles, one patch, two axes, single precision"

array motion[6] = ["rest", "presliding", "all snap", "one snap", "one snap", "far"]
usual = "default material, 2 axes, redraw, end, single"
array kernel[6] = ["2 axes, keep, end, single", "2 axes, keep, end, single", "2 axes, keep, end, single", "2 axes, redraw, end + mean, single", usual, usual]
array label[6] = ["at rest", "presliding, keep", "all snap, keep", "one snap, redraw, mean force", "one snap, default material", "100 lengths, default material"]
array colour[6] = ["#009E73", "#56B4E9", "#0072B2", "#D55E00", "#E69F00", "#CC79A7"]  # Okabe and Ito, distinguishable for
                                                                                      # the colour-blind

# Splits lines at quotes, because a quoted cell holds commas. Prints bristles and p99 (us) of each row, without the
# closely spaced rows at the end of the search.
series(i, threads) = sprintf("awk -F'\"' 'NR > 1 { n = split($3, c, \",\"); if ($1 == \"%s,\" && $2 == \"%s\" && c[2] == \"one patch\" && c[3] == %d && c[4] > 1.3 * last) { print c[4], c[6]; last = c[4] } }' '%s'", motion[i], kernel[i], threads, csv)
deadline = real(system(sprintf("awk -F, 'NR == 2 { print $NF }' '%s'", csv)))
most_threads = int(system(sprintf("awk -F'\"' 'NR > 1 { split($3, c, \",\"); if (c[3] > m) m = c[3] } END { print m }' '%s'", csv)))
there(i, threads) = int(system(series(i, threads)." | wc -l")) > 0

set terminal pngcairo size 1500,1150 font "DejaVu Sans,17" linewidth 1.8
set output png
set title title font ",20" noenhanced
set border 3 linecolor "#555555"
set tics nomirror
set grid linecolor "#DDDDDD"
set logscale xy
set format x "10^{%T}"
set xlabel "bristles, log scale\n " # an empty line between the label and the key
set ylabel "step time, p99, log scale  [us]"
set xrange [500:3e7]
set yrange [*:5e3]
set key outside bottom center horizontal Left reverse samplen 3 maxcolumns 2
set arrow 1 from 500, deadline to 3e7, deadline nohead linecolor rgb "#555555" dashtype 2
set label 1 sprintf("deadline %g us", deadline) at 560, deadline * 1.35 left textcolor rgb "#555555"
set label 2 "the paper: 900 in 1 ms (1 GHz, 2004)" at 1150, 640 textcolor rgb "#000000"
$paper << END
900 1000
END
# Plots only series that were measured, since gnuplot warns of an empty one.
command = 'plot $paper using 1:2 with points pointtype 5 pointsize 2 linecolor rgb "#000000" title ""'
style(i) = sprintf('using 1:2 with linespoints pointsize 0.9 linecolor rgb "%s"', colour[i])
do for [i=1:6] {
  if (there(i, 1)) {
    command = command.sprintf(', "< ".series(%d, 1) %s pointtype 7 title "%s"', i, style(i), label[i])
  }
}
do for [i=1:6] {
  if (most_threads > 1 && there(i, most_threads)) {
    # Draws dashed curves in the same colours, without lines in the key.
    command = command.sprintf(', "< ".series(%d, %d) %s pointtype 6 dashtype 2 notitle', i, most_threads, style(i))
    set label 3 sprintf("dashed: %d threads", most_threads) at graph 0.98, 0.04 right textcolor rgb "#555555"
  }
}
eval command
