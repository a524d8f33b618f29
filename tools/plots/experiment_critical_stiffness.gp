# Draws the output of `bristle experiment critical-stiffness --csv`: the critical stiffness over the speed of the pull,
# by two methods; the response to a step in speed from which theory starts; a small disturbance on springs a little
# softer and a little stiffer.
load folder."/experiment_style.gp"
um(speed) = system(sprintf("awk 'BEGIN { printf \"%%g um/s\", 1e6 * %s }'", speed))
set multiplot @four title "Critical stiffness: which spring makes a slow pull stick and slip" font ",17"
set title "critical stiffness: bisection (symbols), linear theory (lines)"
set xlabel "speed of the pull  [um/s]"
set ylabel "stiffness  [N/m]"
set logscale xy
some = ""
do for [m in present] {
  if (int(system(sprintf("awk -F, '$1 == \"bisection\" && $2 == \"%s\" && $4 > 0 { n++ } END { print n + 0 }' '%s'", m, csv))) > 0) { some = some.m." " }
}
if (words(some) == 0) some = word(present, 1)
plot for [m in some] rows("theory", m) using (1e6 * $3):($4 > 0 ? $4 : NaN) with lines linetype index_of(m) notitle, \
  for [m in some] rows("bisection", m) using (1e6 * $3):($4 > 0 ? $4 : NaN) with points linetype index_of(m) pointsize 1.8 title name(m)
unset logscale
middle = system(sprintf("awk -F, '$1 == \"bisection\" && !seen[$3]++ { s[++n] = $3 } END { print s[int(n / 2) + 1] }' '%s'", csv))
set title "friction after a small step in speed, at ".um(middle)
set xlabel "way after the step  [presliding lengths]"
set ylabel "over kinetic friction, per e-fold"
set xrange [0:6]
set yrange [-0.1:0.1]
at_middle(panel, m) = sprintf("< awk -F, '$1 == \"%s\" && $2 == \"%s\" && $3 == %s' '%s'", panel, m, middle, csv)
plot for [m in some] at_middle("response", m) using 5:6 with lines linetype index_of(m) title name(m)
set autoscale y
set xlabel "way of the pull  [presliding lengths]"
set ylabel "disturbance over friction"
set xrange [0:40]
set yrange [-0.004:0.004]
shown = ""
do for [m in "rate_state brush_aged"] { if (is_there(m)) { shown = shown.m." " } }
if (words(shown) == 0) shown = word(present, 1)
do for [panel in "soft stiff"] {
  set title sprintf("a disturbance, spring %s times the critical one", panel eq "soft" ? "0.9" : "1.1")
  if (panel eq "stiff") { keyed = some; set key @below }
  plot for [m in shown] at_middle(panel, m) using 5:6 with lines linetype index_of(m) notitle, \
    for [m in some] keyentry with linespoints linetype index_of(m) pointsize 1.8 title name(m)
}
unset multiplot
