# Draws the output of `bristle experiment friction-lag --csv`: friction over speed, a panel per frequency (at most
# four).
wanted = "lugre gms rate_state brush_rubbed brush_aged"
load folder."/experiment_style.gp"
omegas = system(sprintf("awk -F, '$1 == \"width\" && !seen[$3]++ && n++ < 4 { printf \"%%s \", $3 }' '%s'", csv))
# Prints the rows of one cycle, and its first row again, which closes the loop.
loop(omega, m) = sprintf("< awk -F, '$1 == \"lag\" && $2 == \"%s\" && $3 == \"%s\" { print; if (!n++) first = $0 } END { print first }' '%s'", m, omega, csv)
set multiplot @four title "Friction lag: one-way sliding whose speed swings" font ",17"
set xlabel "speed  [mm/s]"
set ylabel "friction force, axis not from 0  [N]"
do for [omega in omegas] {
  set title sprintf("%s rad/s", omega)
  if (omega eq word(omegas, words(omegas))) { set key @below }
  plot for [m in few] loop(omega, m) using (1e3 * $4):5 with lines linetype index_of(m) linewidth 1.6 title name(m)
}
unset multiplot
