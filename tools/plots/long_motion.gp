# Draws the output of bench/curves: cost per bristle against the length of a step, for keep and redraw.
#   gnuplot -e "csv='long_motion.csv'; png='long_motion.png'" long_motion.gp
if (!exists("csv")) { print "long_motion.gp: needs csv='FILE'"; exit status 2 }
if (!exists("png")) png = "long_motion.png"

array case[7] = ["keep uniform", "redraw uniform", "redraw normal cv0.2", "redraw lognormal cv0.1", "redraw lognormal cv0.3", "redraw exponential", "redraw lognormal cv1"]
array label[7] = ["keep, uniform", "redraw, uniform", "redraw, normal, cv 0.2", "redraw, lognormal, cv 0.1", "redraw, lognormal, cv 0.3", "redraw, exponential", "redraw, lognormal, cv 1"]
array colour[7] = ["#000000", "#0072B2", "#56B4E9", "#009E73", "#E69F00", "#CC79A7", "#D55E00"]
set datafile separator comma
set datafile missing NaN
of(i, x) = strcol(1) eq case[i] ? x : NaN
array rows[7]
do for [i=1:7] {
  n = 0
  stats csv using (n = n + (strcol(1) eq case[i]), 0) nooutput
  rows[i] = n
}

set terminal pngcairo size 1500,1000 font "DejaVu Sans,17" linewidth 1.8
set output png
set title "Cost of a step against its length: 4096 bristles, two axes, end and mean force, single" font ",20"
set border 3 linecolor "#555555"
set tics nomirror
set grid linecolor "#DDDDDD"
set logscale xy
set format x "10^{%T}"
set xlabel "length of a step  [mean snap lengths]"
set bmargin 8
set ylabel "time per bristle and step  [ns]"
set xrange [5e-7:2e4]
set yrange [*:300]
set key outside bottom center horizontal Left reverse samplen 3 maxcolumns 3
set arrow 1 from 5e-7, 3.5 to 2e4, 3.5 nohead linecolor rgb "#555555" dashtype 2
set label 1 "3.5 ns" at 7e-7, 4.2 left textcolor rgb "#555555"
command = ""
do for [i=1:7] {
  if (rows[i] > 0) {
    command = command.(strlen(command) ? ', ' : 'plot ').sprintf('csv using (of(%d, $2)):3 with linespoints pointtype %d pointsize 1.1 linecolor rgb "%s" title "%s"', i, 4 + i, colour[i], label[i])
  }
}
eval command
