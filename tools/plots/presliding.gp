# Draws the output of bench/curves: time of a step against its length in presliding, and the share of bristles that
# are looked at.
#   gnuplot -e "csv='presliding.csv'; png='presliding.png'" presliding.gp
if (!exists("csv")) { print "presliding.gp: needs csv='FILE'"; exit status 2 }
if (!exists("png")) png = "presliding.png"

array case[4] = ["keep skipping", "redraw skipping", "keep eager", "redraw eager"]
array label[4] = ["keep", "redraw", "keep, every bristle visited", "redraw, every bristle visited"]
array colour[4] = ["#0072B2", "#D55E00", "#0072B2", "#D55E00"]
array dash[4] = [1, 1, 3, 3]
array mark[4] = [7, 5, 6, 4]
set datafile separator comma
set datafile missing NaN
of(i, x) = strcol(1) eq case[i] ? x : NaN

set terminal pngcairo size 1500,1250 font "DejaVu Sans,17" linewidth 1.8
set output png
set multiplot layout 2,1 title "Presliding: 262,144 bristles, two axes, end force, single, one way after sliding" font ",20"
set border 3 linecolor "#555555"
set tics nomirror
set grid linecolor "#DDDDDD"
set logscale xy
set format x "10^{%T}"
set xrange [7e-7:1.5]
set lmargin 12
set bmargin 6
set key outside bottom center horizontal Left reverse samplen 3
set ylabel "time of a step  [us]"
set xlabel "length of a step  [mean snap lengths]"
plot for [i=1:4] csv using (of(i, $2)):4 with linespoints pointtype mark[i] pointsize 1.1 dashtype dash[i] linecolor rgb colour[i] title label[i]
set ylabel "share of bristles looked at"
set format y "10^{%T}"
set yrange [*:2]
plot for [i=1:2] csv using (of(i, $2)):5 with linespoints pointtype mark[i] pointsize 1.1 linecolor rgb colour[i] title label[i]
unset multiplot
