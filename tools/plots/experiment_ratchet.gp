# Draws the output of `bristle experiment ratchet --csv`.
load folder."/experiment_style.gp"
models = "ellipse scaled brush nap"
titles = "'MuJoCo cone' 'Bullet cone' 'brush, elliptic' 'brush, to and fro'"
set linetype 1 linecolor rgb "#888888" dashtype 3 linewidth 2.4 pointtype 4
set linetype 2 linecolor rgb "#E69F00" dashtype (12,7) linewidth 2.4 pointtype 6
set linetype 3 linecolor rgb "#0072B2" dashtype 1 linewidth 2.6 pointtype 7
set linetype 4 linecolor rgb "#AA3377" dashtype 1 linewidth 2.6 pointtype 5
set multiplot layout 2,1 margins screen 0.085,0.97,0.13,0.9 spacing screen 0.13 title "A block on velvet" font ",17"
set title "friction in steady sliding; points: slip at 45 degrees"
set xlabel "along the lay / load"
set ylabel "across it / load"
set size ratio -1
plot for [m in present] rows("limit", m) using 4:5 with lines linetype index_of(m) title name(m), \
  for [m in present] rows("limit", m) using ($3 > 43.9 && $3 < 46.1 ? $4 : NaN):5 with points linetype index_of(m) pointsize 1.6 notitle
set size noratio
set title "shaken by a force of mean 0"
set xlabel "time  [s]"
set ylabel "place  [mm]"
set key @below
plot for [m in present] rows("shaken", m) using 3:5 with lines linetype index_of(m) title name(m)
unset multiplot
