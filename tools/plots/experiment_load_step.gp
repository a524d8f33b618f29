# Draws the output of `bristle experiment load-step --csv`.
load folder."/experiment_style.gp"
set terminal @term size 1200,520 font "DejaVu Sans,13" linewidth 1.2
set output png
set multiplot @two title "The load jumps while the contact slides" font ",17"
set xlabel "displacement after the jump  [presliding lengths]"
set ylabel "friction force  [N]"
set yrange [0:*]
set title "load up"
plot for [m in present] csv using (at("up", m, $3)):4 with lines linetype index_of(m) title name(m)
set title "load down"
set key @below
plot for [m in present] csv using (at("down", m, $3)):4 with lines linetype index_of(m) title name(m)
unset multiplot
