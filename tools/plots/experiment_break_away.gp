# Draws the output of `bristle experiment break-away --csv`.
load folder."/experiment_style.gp"
set multiplot layout 2,2 title "Break-away: the highest friction of a block under a growing force" font ",17"
set ylabel "break-away friction, axis not from 0  [N]"
set logscale x
set title "against the rate of the force"
set xlabel "force rate  [N/s]"
set yrange [*:*]
unset key
plot for [m in present] csv using (at("rate", m, $3)):6 with linespoints linetype index_of(m) title name(m)
set title "against the load"
set xlabel "normal load  [N]"
set logscale y
set autoscale y
set ylabel "break-away friction, log scale  [N]"
plot for [m in present] csv using (at("load", m, $4)):6 with linespoints linetype index_of(m) title name(m)
unset logscale y
set title "against the time at rest"
set xlabel "time at rest  [s]"
set ylabel "break-away friction, axis not from 0  [N]"
set yrange [*:*]
unset key
plot for [m in present] csv using (at("rest", m, $5)):6 with linespoints linetype index_of(m) title name(m)
# Draws an empty plot, whose place the key takes.
unset logscale
unset title
unset xlabel
unset ylabel
unset tics
unset border
unset grid
set xrange [0:1]
set yrange [0:1]
set key center center
plot for [m in present] NaN with linespoints linetype index_of(m) title name(m)
unset multiplot
