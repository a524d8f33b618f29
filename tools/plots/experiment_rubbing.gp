# Draws the output of `bristle experiment rubbing --csv`.
wanted = "lugre maxwell_slip brush_redraw brush_keep brush_infinite brush_rubbed"
load folder."/experiment_style.gp"
at_stroke(stroke, m, x) = column(3) == stroke ? at("stroke", m, x) : NaN
set multiplot @four title "Rubbing" font ",17"
set xlabel "cycle"
set ylabel "highest force over kinetic friction"
set title "strokes of 1.5 presliding lengths to either side"
set logscale x
set yrange [0:*]
plot for [m in few] csv using (at_stroke(1.5, m, $4)):5 with linespoints linetype index_of(m) pointsize 0.5 title name(m)
set ylabel "work over that of Coulomb"
set title "the same strokes: work"
plot for [m in few] csv using (at_stroke(1.5, m, $4)):6 with linespoints linetype index_of(m) pointsize 0.5 title name(m)
unset logscale x
set xlabel "time  [s]"
set ylabel "highest force over kinetic friction"
set title "a trembling hand"
plot for [m in few] csv using (at("tremor", m, $4)):5 with lines linetype index_of(m) title name(m)
set xlabel "position  [presliding lengths]"
set ylabel "force over kinetic friction"
set title "back over the place where contact was made"
set autoscale
set yrange [0:*]
set key @below
plot for [m in few] csv using (at("echo", m, $4)):5 with lines linetype index_of(m) title name(m)
unset multiplot
