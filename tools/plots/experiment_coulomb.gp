# Draws the output of `bristle experiment coulomb --csv`.
wanted = "brush_redraw brush_keep"
load folder."/experiment_style.gp"
keyed = present
set multiplot @four title "Coulomb's laws" font ",17"
set title "friction against load"
set xlabel "normal load  [N]"
set ylabel "friction force  [N]"
set yrange [0:*]
plot for [m in present] csv using (at("load", m, $3)):4 with linespoints linetype index_of(m) title name(m)
set logscale x
set ylabel "friction over load, from 0.38"
set yrange [0.38:0.42]
set title "friction over load against load"
plot for [m in present] csv using (at("load", m, $3)):5 with linespoints linetype index_of(m) title name(m)
set title "against the number of simulated bristles"
set xlabel "bristles"
plot for [m in few] csv using (at("bristles", m, $3)):5 with linespoints linetype index_of(m) title name(m)
set title "against the apparent area"
set xlabel "apparent area, relative"
set key @below
plot for [m in few] csv using (at("area", m, $3)):5 with linespoints linetype index_of(m) notitle, \
  for [m in keyed] keyentry with linespoints linetype index_of(m) title name(m)
unset multiplot
