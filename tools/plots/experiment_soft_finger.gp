# Draws `bristle experiment soft-finger --csv`.
load folder."/experiment_style.gp"
models = "dahl patch outline bed"
titles = "'Dahl' 'patch, dragged' 'outline of patches' 'bed'"
set linetype 1 linecolor rgb "#888888" dashtype 3 linewidth 2.4
set linetype 2 linecolor rgb "#E69F00" dashtype (12,7) linewidth 2.4
set linetype 3 linecolor rgb "#AA3377" dashtype 4 linewidth 2.4
set linetype 4 linecolor rgb "#0072B2" dashtype 1 linewidth 2.6
set multiplot layout 1,2 margins screen 0.075,0.98,0.13,0.86 spacing screen 0.085 title "A soft finger that is dragged" font ",17"
set title "stiffness over the first: the radius that sticks (black: Mindlin)"
set xlabel "force / friction"
set ylabel "stiffness / first stiffness"
set xrange [0:1.12]
set yrange [0:1.05]
plot for [m in present] csv using (at("stiffness", m, $3)):($4 > 0 ? $4 : NaN) with lines linetype index_of(m) notitle, \
  (x < 1 ? (1 - x) ** (1.0 / 3) : NaN) with lines linecolor rgb "#000000" dashtype 3 linewidth 1.4 notitle
set autoscale
set key @below
set title "loops of half of the friction"
set xlabel "displacement / presliding"
set ylabel "force / friction"
plot for [m in present] csv using (at("loop", m, $3)):4 with lines linetype index_of(m) title name(m)
unset multiplot
