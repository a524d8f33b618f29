# Draws the output of `bristle experiment oblique-impact --csv`.
load folder."/experiment_style.gp"
models = "coulomb history bed"
titles = "'Coulomb' 'history spring' 'bed'"
set linetype 2 linecolor rgb "#E69F00" dashtype (12,7) linewidth 2.4 pointtype 6
set linetype 3 linecolor rgb "#0072B2" dashtype 1 linewidth 2.6 pointtype 7
set multiplot layout 1,2 margins screen 0.085,0.97,0.14,0.87 spacing screen 0.1 title "A sphere that strikes a plane obliquely, or spinning" font ",17"
set title "slip of the contact before and after, scaled"
set xlabel "before"
set ylabel "after"
set xrange [0:8]
plot for [m in present] rows("angle", m) using 4:5 with lines linetype index_of(m) title name(m), \
  for [m in present] rows("spin", m) using 4:5 with points linetype index_of(m) pointsize 0.9 notitle, \
  0 with lines linecolor rgb "black" linewidth 0.7 notitle
set title "speed (lines) and spin (points) after an oblique impact"
set xlabel "angle from the normal  [degrees]"
set ylabel "v, omega R  [m/s]"
set xrange [0:85]
set key @below
plot for [m in present] rows("angle", m) using 3:6 with lines linetype index_of(m) title name(m), \
  for [m in present] rows("angle", m) using 3:7 with points linetype index_of(m) pointsize 0.9 notitle
unset multiplot
