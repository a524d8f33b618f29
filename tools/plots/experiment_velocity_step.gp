# Draws the output of `bristle experiment velocity-step --csv`: friction over the path after a step up and a step down
# in speed.
wanted = "lugre gms rate_state brush_rubbed brush_aged"
load folder."/experiment_style.gp"
um(speed) = system(sprintf("awk 'BEGIN { printf \"%%g um/s\", 1e6 * %s }'", speed))
set multiplot @four title "A step in speed: an effect at once, then a way to the new level" font ",17"
speeds = system(sprintf("awk -F, '$1 == \"step\" && !seen[$3]++ && n++ < 2 { printf \"%%s \", $3 }' '%s'", csv))
set xlabel "way after the step  [presliding lengths]"
set ylabel "friction over that before the step"
set xrange [-0.5:6]
at(panel, m, speed) = sprintf("< awk -F, 'BEGIN { print \"x,-0.5,1\"; print \"x,0,1\" } $1 == \"%s\" && $2 == \"%s\" && $3 == %s { print \"x,\" $4 \",\" $5 / $6 }' '%s'", panel, m, speed, csv)
do for [speed in speeds] {
  do for [panel in "up down"] {
    set title sprintf("%s %s, the speed %s", panel eq "up" ? "from" : "back to", um(speed), \
      panel eq "up" ? "grows" : "falls")
    if (panel eq "down" && speed eq word(speeds, words(speeds))) { set key @below }
    plot for [m in few] at(panel, m, speed) using 2:3 with lines linetype index_of(m) title name(m)
  }
}
unset multiplot
