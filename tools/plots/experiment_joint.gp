# Draws the output of `bristle experiment joint --csv`.
wanted = "coulomb lugre maxwell_slip brush_rubbed brush_slide brush_slide_drop"
load folder."/experiment_style.gp"
name(m) = m eq "brush_slide" ? "joint" : m eq "brush_slide_drop" ? "joint, static part" : word(titles, index_of(m))
set multiplot @four title "A geared joint: lifted, let down, turned back, held" font ",17"
set xlabel "weight / rated weight"
set ylabel "friction / friction of lifting it"
set yrange [0:2]
set title "driving: the motor lifts"
plot for [m in few] csv using (at("drive", m, $3)):4 with linespoints linetype index_of(m) title name(m)
set title "driven: the weight comes down"
plot for [m in few] csv using (at("drive", m, $3)):5 with linespoints linetype index_of(m) title name(m)
set title "turned back under the rated weight"
set xlabel "angle after the turn  [presliding lengths]"
set yrange [*:*]
plot for [m in few] csv using (at("reverse", m, $3)):4 with lines linetype index_of(m) title name(m)
set title "held, shaken between 0.2 and 0.8 of its friction"
set xlabel "cycle"
set ylabel "angle  [presliding lengths]"
set yrange [0:3]
set key @below
plot for [m in few] csv using (at("hold", m, $3)):5 with lines linetype index_of(m) title name(m)
unset multiplot
