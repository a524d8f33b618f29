# Draws `bristle experiment coulomb --csv`.
wanted = "brush_redraw brush_keep"
load folder."/experiment_style.gp"
set multiplot layout 2,2 title "Coulomb's laws" font ",17"
set title "friction against load"
set xlabel "normal load  [N]"
set ylabel "friction force  [N]"
set yrange [0:*]
set key bottom right
plot for [m in present] rows("load", m) using 3:4 with linespoints linetype index_of(m) title name(m)
unset key
set logscale x
set ylabel "friction over load, axis from 0.38"
set yrange [0.38:0.42]
set title "friction over load against load"
plot for [m in present] rows("load", m) using 3:5 with linespoints linetype index_of(m) title name(m)
set title "against the number of simulated bristles"
set xlabel "bristles"
plot for [m in few] rows("bristles", m) using 3:5 with linespoints linetype index_of(m) title name(m)
set title "against the apparent area"
set xlabel "apparent area, relative"
plot for [m in few] rows("area", m) using 3:5 with linespoints linetype index_of(m) title name(m)
unset multiplot
