# Draws the output of `bristle experiment held-corner --csv`.
load folder."/experiment_style.gp"
set title "A plate held at one corner, under a moment that wavers below that of sliding" font ",17"
set xlabel "time  [s]"
set ylabel "way of the plate's edge  [um]"
set key @below
set bmargin at screen 0.17
plot for [m in present] rows("hold", m) using 3:5 with lines linetype index_of(m) title name(m)
