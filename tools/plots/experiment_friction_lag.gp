# Draws the output of `bristle experiment friction-lag --csv`: friction over speed, a panel per frequency (at most
# four).
wanted = "lugre gms rate_state brush_rubbed brush_aged"
load folder."/experiment_style.gp"
seen = ""
stats csv using (strcol(1) eq "width" && words(seen) < 4 ? collect(strcol(3)) : 0) nooutput
omegas = seen
# x in the rows of one cycle.
cycle(omega, m, x) = strcol(3) eq omega ? at("lag", m, x) : NaN
set multiplot @four title "Friction lag: one-way sliding whose speed swings" font ",17"
set xlabel "speed  [mm/s]"
set ylabel "friction force, axis not from 0  [N]"
do for [omega in omegas] {
  set title sprintf("%s rad/s", omega)
  if (omega eq word(omegas, words(omegas))) { set key @below }
  plot for [m in few] csv using (cycle(omega, m, 1e3 * $4)):5 with lines linetype index_of(m) linewidth 1.6 title name(m)
}
unset multiplot
