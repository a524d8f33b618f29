# Draws `bristle experiment held-corner --csv`.
load folder."/experiment_style.gp"
set title "A plate held at one corner, under a moment that wavers below that of sliding" font ",17"
set xlabel "time  [s]"
set ylabel "way of the plate's edge  [um]"
set key top left
plot for [m in present] rows("hold", m) using 3:5 with lines linetype index_of(m) title name(m)
