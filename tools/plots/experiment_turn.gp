# Draws the output of `bristle experiment turn --csv`: turns by 90 and 180 degrees.
load folder."/experiment_style.gp"
set multiplot @four title "A turn out of steady sliding" font ",17"
set xlabel "displacement after the turn  [presliding lengths]"
set ylabel "along it / kinetic friction"
set title "90 degrees: along the new direction"
plot for [m in present] rows("turn", m) using 4:($3 == 90 ? $5 : NaN) with lines linetype index_of(m) title name(m)
set title "90 degrees: across it, what is left of the old one"
set ylabel "across / kinetic friction"
plot for [m in present] rows("turn", m) using 4:($3 == 90 ? -$6 : NaN) with lines linetype index_of(m) title name(m)
set title "180 degrees"
set ylabel "along it / kinetic friction"
plot for [m in present] rows("turn", m) using 4:($3 == 180 ? $5 : NaN) with lines linetype index_of(m) title name(m)
set title "90 degrees: the end of the force vector"
set xlabel "along it / kinetic friction"
set ylabel "across / kinetic friction"
set key @below
plot for [m in present] rows("turn", m) using ($3 == 90 ? $5 : NaN):(-$6) with lines linetype index_of(m) title name(m)
unset multiplot
