# Draws the output of `bristle experiment velocity-step --csv`: friction over the path after a step up and a step down
# in speed.
wanted = "lugre gms rate_state brush_rubbed brush_aged"
load folder."/experiment_style.gp"
set multiplot @four title "A step in speed: an effect at once, then a path to the new level" font ",17"
um(speed) = sprintf("%g", 1e6 * speed)
seen = ""
stats csv using (strcol(1) eq "step" && words(seen) < 2 ? collect(um($3)) : 0) nooutput
speeds = seen
set xlabel "path after the step  [presliding lengths]"
set ylabel "friction over that before the step"
set xrange [-0.5:6]
after(panel, m, speed, x) = um(column(3)) eq speed ? at(panel, m, x) : NaN
$before << END
path,friction
-0.5,1
0,1
END
do for [speed in speeds] {
  do for [panel in "up down"] {
    set title sprintf("%s %s um/s, the speed %s", panel eq "up" ? "from" : "back to", speed, \
      panel eq "up" ? "grows" : "falls")
    if (panel eq "down" && speed eq word(speeds, words(speeds))) { set key @below }
    plot for [m in few] csv using (after(panel, m, speed, $4)):($5 / $6) with lines linetype index_of(m) title name(m), \
      for [m in few] $before using 1:2 with lines linetype index_of(m) notitle
  }
}
unset multiplot
