# Draws the output of `bristle experiment limit-surface --csv`.
load folder."/experiment_style.gp"
set multiplot @four title "A disc that slides and spins" font ",17"
set xlabel "velocity of the centre / (omega R)"
set logscale x
set xrange [0.04:6]
set title "force over that of sliding alone"
set ylabel "force / friction"
plot for [m in present] csv using (at("limit", m, $3 > 0 ? $3 : NaN)):4 with lines linetype index_of(m) title name(m), \
  csv using (at("limit", word(present, 1), $3 > 0 ? $3 : NaN)):7 with points pointtype 1 linecolor rgb "black" title "closed form"
set title "torque"
set ylabel "torque / (friction R)"
plot for [m in present] csv using (at("limit", m, $3 > 0 ? $3 : NaN)):6 with lines linetype index_of(m) title name(m), \
  csv using (at("limit", word(present, 1), $3 > 0 ? $3 : NaN)):8 with points pointtype 1 linecolor rgb "black" notitle
unset logscale
set xrange [0:1.02]
set title "the limit surface"
set xlabel "force / friction"
set ylabel "torque / (friction R)"
plot for [m in present] csv using (at("limit", m, $4)):6 with lines linetype index_of(m) title name(m), \
  csv using (at("limit", word(present, 1), $7)):8 with points pointtype 1 linecolor rgb "black" notitle
set logscale x
set xrange [0.04:6]
set title "force aside"
set xlabel "velocity of the centre / (omega R)"
set ylabel "force at a right angle / friction"
set key @below
plot for [m in present] csv using (at("limit", m, $3 > 0 ? $3 : NaN)):5 with lines linetype index_of(m) title name(m), \
  keyentry with points pointtype 1 linecolor rgb "black" title "closed form"
unset multiplot
