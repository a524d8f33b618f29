# Draws the output of `bristle experiment drift --csv`: the paper's Fig. 2, and the block on the slope.
wanted = "lugre elasto_plastic brush_redraw"
load folder."/experiment_style.gp"
keyed = present
set multiplot @four title "Motion drift: a block under a wavering force below break-away" font ",17"
set title "(a) applied force"
set xlabel "time  [s]"
set ylabel "applied force  [N]"
plot csv using (at("fig2", word(present, 1), $3)):4 with lines linecolor rgb "#000000" dashtype 1 linewidth 1.6
set title "(b) friction against presliding displacement"
set xlabel "presliding displacement  [10 um]"
set ylabel "friction force  [N]"
plot for [m in few] csv using (at("fig2", m, 1e5 * $6)):5 with lines linetype index_of(m) title name(m)
set title "displacement over time"
set xlabel "time  [s]"
set ylabel "displacement  [um]"
set yrange [0:80]
plot for [m in present] csv using (at("fig2", m, $3)):(1e6 * $6) with lines linetype index_of(m) title name(m)
set title "shaken a little on a slope"
set yrange [0:40]
set key @below
plot for [m in present] csv using (at("slope", m, $3)):(1e6 * $6) with lines linetype index_of(m) title name(m), \
  for [m in few] keyentry with lines linetype index_of(m) title (strstrt(" ".present, " ".m." ") > 0 ? "" : name(m))
unset multiplot
