# Draws the output of `bristle experiment coin --csv`.
load folder."/experiment_style.gp"
# Adds a blank line between two throws, so that no line joins them.
throws(m) = sprintf("< awk -F, '$1 == \"coin\" && $2 == \"%s\" { if (last != \"\" && $3 != last) print \"\"; last = $3; print }' '%s'", m, csv)
set multiplot @two title "A coin that slides and spins until it rests" font ",17"
set title "speeds"
set xlabel "time  [s]"
set ylabel "speed of the centre (lines) and of the rim's spin (points)  [m/s]"
set yrange [0:*]
plot for [m in present] throws(m) using 4:5 with lines linetype index_of(m) title name(m), \
  for [m in present] throws(m) using 4:6 every 4 with points linetype index_of(m) pointsize 0.6 notitle
set title "their ratio, which tends to 0.653"
set xlabel "what is left of the speed  [m/s]"
set ylabel "v / (omega R)"
set autoscale y
set logscale x
set xrange [*:*] reverse
set key @below
plot for [m in present] throws(m) using ($5 + $6):7 with lines linetype index_of(m) title name(m), \
  0.653 with lines dashtype 2 linecolor rgb "black" notitle
unset multiplot
