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

# Splits lines at quotes, because a quoted cell holds commas: motion, kernel, and all behind it, which at(k) splits again:
# 2 layout, 3 threads, 4 bristles, 6 p99 (us), 9 deadline (us).
set datafile separator '"'
set datafile columnheaders
cut(s, k) = k == 1 ? s[1:strstrt(s.",", ",") - 1] : cut(s[strstrt(s, ",") + 1:*], k - 1)
# Reads a number; real() wants a point in one with an exponent.
number(s) = strstrt(s, ".") > 0 || strstrt(s, "e") == 0 ? real(s) : real(s[1:strstrt(s, "e") - 1].".0".s[strstrt(s, "e"):*])
at(k) = number(cut(strcol(3), k))
set datafile missing NaN
deadline = most_threads = 0
array rows[6]   # rows of a series on one thread
array shared[6] # and on most threads
last = 0
is(i) = strcol(1) eq motion[i]."," && strcol(2) eq kernel[i] && cut(strcol(3), 2) eq "one patch"
# Bristles in the rows of a series, without the closely spaced ones at the end of the search.
series(i, threads) = (column(0) == 0 ? (last = 0) : 0, \
  is(i) && at(3) == threads && at(4) > 1.3 * last ? (last = at(4)) : NaN)
stats csv using (deadline = at(9), most_threads = at(3) > most_threads ? at(3) : most_threads, 0) nooutput
do for [i=1:6] {
  one = most = 0
  stats csv using (one = one + (is(i) && at(3) == 1), most = most + (is(i) && at(3) == most_threads), 0) nooutput
  rows[i] = one
  shared[i] = most
}
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
bristles"us
900"1000
END
# Plots only series that were measured, since gnuplot warns of an empty one.
command = 'plot $paper using 1:2 with points pointtype 5 pointsize 2 linecolor rgb "#000000" title ""'
style(i) = sprintf('with linespoints pointsize 0.9 linecolor rgb "%s"', colour[i])
do for [i=1:6] {
  if (rows[i] > 0) { command = command.sprintf(', csv using (series(%d, 1)):(at(6)) %s pointtype 7 title "%s"', i, style(i), label[i]) }
}
do for [i=1:6] {
  if (most_threads > 1 && shared[i] > 0) {
    # Draws dashed curves in the same colours, without lines in the key.
    command = command.sprintf(', csv using (series(%d, %d)):(at(6)) %s pointtype 6 dashtype 2 notitle', i, most_threads, style(i))
    set label 3 sprintf("dashed: %d threads", most_threads) at graph 0.98, 0.04 right textcolor rgb "#555555"
  }
}
eval command
