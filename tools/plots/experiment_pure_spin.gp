# Draws the output of `bristle experiment pure-spin --csv`.
load folder."/experiment_style.gp"
set multiplot layout 2,2 title "A disc turned from rest, and pulled while it spins" font ",17"
set xrange [0:4]
unset key
set title "turned from rest"
set xlabel "way of the rim  [presliding lengths]"
set ylabel "torque / (kinetic friction R)"
plot for [m in present] rows("turn", m) using 3:4 with lines linetype index_of(m) title name(m)
set title "pulled from rest"
set xlabel "displacement  [presliding lengths]"
set ylabel "force / kinetic friction"
plot for [m in present] rows("pull", m) using 3:4 with lines linetype index_of(m) title name(m)
set title "pulled while it spins"
set xlabel "displacement  [presliding lengths]"
set autoscale x
plot for [m in present] rows("spinning", m) using 3:4 with lines linetype index_of(m) title name(m)
unset title
unset border
unset tics
unset xlabel
unset ylabel
set key center center
set yrange [0:1]
plot for [m in present] NaN with lines linetype index_of(m) title name(m)
unset multiplot
