# Draws the output of `bristle experiment slide-hold-slide --csv`: the force of the aged brush and of rate and state
# through each hold, the peak over the hold, and the force during the hold.
load folder."/experiment_style.gp"
set multiplot @four title "Slide, hold, slide: what a contact gains at rest" font ",17"
holds = system(sprintf("awk -F, '$1 == \"peak\" && !seen[$3]++ { printf \"%%s \", $3 }' '%s'", csv))
set ylabel "friction over kinetic friction"
set xlabel "way after the hold  [presliding lengths]"
after(m, hold) = sprintf("< awk -F, '$1 == \"trace\" && $2 == \"%s\" && $3 == %s && $5 > 0' '%s'", m, hold, csv)
set palette defined (0 "#88CCEE", 0.5 "#117733", 1 "#332288")
unset colorbox
set key title "hold  [s]" inside top right samplen 2.5
do for [m in "brush_aged rate_state"] {
  if (is_there(m)) {
    set title name(m).": the peak after each hold"
    plot [0:4] for [i=1:words(holds)] after(m, word(holds, i)) using 5:6 with lines dashtype 1 linewidth 1.8 \
      linecolor palette fraction ((i - 1.0) / (words(holds) - 1.0)) title word(holds, i)
    unset key
  }
}
set key notitle
unset key
set logscale x
set title "the peak over the duration of the hold"
set xlabel "duration of the hold  [s]"
plot for [m in present] rows("peak", m) using 3:6 with linespoints linetype index_of(m) title name(m)
set title "the force while it is held (longest hold)"
set xlabel "time since it stopped  [s]"
set ylabel "friction over kinetic friction"
set yrange [0:*]
longest = word(holds, words(holds))
held(m) = sprintf("< awk -F, '$1 == \"trace\" && $2 == \"%s\" && $3 == %s && $5 == 0 && $4 > 0' '%s'", m, longest, csv)
set key @below
plot for [m in present] held(m) using 4:6 with lines linetype index_of(m) title name(m)
unset multiplot
