# Draws the output of `bristle experiment stribeck --csv`.
load folder."/experiment_style.gp"
set terminal @term size 1200,520 font "DejaVu Sans,13" linewidth 1.2
set output png
set multiplot @two title "Steady friction against speed" font ",17"
set logscale x
set format x "10^{%T}"
set xlabel "speed  [m/s]"
set ylabel "friction force, axis from 0.9  [N]"
set yrange [0.9:1.6]
set title "lubricated"
plot for [m in present] csv using (at("lubricated", m, $3)):4 with linespoints pointsize 0.6 linetype index_of(m) title name(m)
set title "dry: no damper, no lubricant"
set key @below
plot for [m in present] csv using (at("dry", m, $3)):4 with linespoints pointsize 0.6 linetype index_of(m) title name(m)
unset multiplot
