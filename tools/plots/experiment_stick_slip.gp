# Draws the output of `bristle experiment stick-slip --csv`.
wanted = "lugre rate_state brush_redraw brush_rubbed brush_aged"
load folder."/experiment_style.gp"
set multiplot @four title "Stick-slip: a mass on a spring pulled at constant speed" font ",17"
set xlabel "time  [s]"
set ylabel "spring force  [N]"
set title "spring force, lubricated"
set yrange [0:*]
plot for [m in few] csv using (at("pull", m, $3)):4 with lines linetype index_of(m) linewidth 1.2 title name(m)
set title "spring force, without lubricant"
plot for [m in few] csv using (at("dry", m, $3)):4 with lines linetype index_of(m) linewidth 1.2 title name(m)
set title "position, lubricated"
set ylabel "position  [m]"
plot for [m in few] csv using (at("pull", m, $3)):5 with lines linetype index_of(m) linewidth 1.5 title name(m)
set title "speed, lubricated"
set ylabel "speed  [m/s]"
set yrange [-0.02:*]
set key @below
plot for [m in few] csv using (at("pull", m, $3)):6 with lines linetype index_of(m) linewidth 1.5 title name(m)
unset multiplot
