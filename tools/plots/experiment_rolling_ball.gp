# Draws the output of `bristle experiment rolling-ball --csv`.
load folder."/experiment_style.gp"
models = "coulomb patch bed"
titles = "'Coulomb' 'patch, dragged' 'bed'"
set linetype 2 linecolor rgb "#E69F00" dashtype (12,7) linewidth 2.4 pointtype 6
set linetype 3 linecolor rgb "#0072B2" dashtype 1 linewidth 2.6 pointtype 7
set multiplot layout 1,2 margins screen 0.085,0.97,0.14,0.87 spacing screen 0.1 title "A rubber ball that rolls" font ",17"
set title "down a slope of 10 degrees: how much its surface lags"
set xlabel "time  [s]"
set ylabel "creepage, (v - omega R) / v"
set logscale y
set yrange [1e-6:1e-1]
set format y "10^{%T}"
plot for [m in present] csv using (at("slope", m, $3)):(abs($6)) with lines linetype index_of(m) title name(m)
unset logscale y
set format y "%g"
set title "thrown without spin: v (lines) and omega R (points)"
set ylabel "speed  [m/s]"
set yrange [0:2.1]
set xrange [0:0.5]
set key @below
plot for [m in present] csv using (at("thrown", m, $3)):4 with lines linetype index_of(m) title name(m), \
  for [m in present] csv using (at("thrown", m, $3)):5 with points linetype index_of(m) pointsize 0.6 notitle, \
  10.0 / 7.0 with lines dashtype 2 linecolor rgb "black" notitle
unset multiplot
