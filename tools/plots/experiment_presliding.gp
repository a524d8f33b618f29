# Draws the output of `bristle experiment presliding --csv`.
wanted = "lugre maxwell_slip brush_redraw"
load folder."/experiment_style.gp"
keyed = present
set multiplot @four title "Presliding" font ",17"
set xlabel "displacement  [um]"
set ylabel "friction force  [N]"
set title "first pull"
set xrange [0:100]
set yrange [0:1.6]
plot for [m in present] csv using (at("virgin", m, 1e6 * $3)):4 with lines linetype index_of(m) title name(m)
set autoscale
set title "loops of growing width"
plot for [m in few] csv using (at("loops", m, 1e6 * $3)):4 with lines linetype index_of(m) linewidth 1.3 title name(m)
set title "a loop inside a loop: back to 4 um, to 8, to 4, and on"
set xrange [0:12.5]
plot for [m in few] csv using (at("nested", m, 1e6 * $3)):4 with lines linetype index_of(m) linewidth 1.5 title name(m)
set autoscale
set title "pulled to 95 % of the peak and let go: a permanent set"
set xrange [0:60]
set yrange [0:1.6]
set key @below
plot for [m in present] csv using (at("set", m, 1e6 * $3)):4 with lines linetype index_of(m) title name(m)
unset multiplot
