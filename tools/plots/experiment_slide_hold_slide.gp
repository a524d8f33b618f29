# Draws the output of `bristle experiment slide-hold-slide --csv`: the force of the aged brush and of rate and state
# through each hold, the peak over the hold, and the force during the hold.
load folder."/experiment_style.gp"
set multiplot @four title "Slide, hold, slide: what a contact gains at rest" font ",17"
seen = ""
stats csv using (strcol(1) eq "peak" ? collect(strcol(3)) : 0) nooutput
holds = seen
set ylabel "friction over kinetic friction"
set xlabel "path after the hold  [presliding lengths]"
trace(m, hold, x) = strcol(3) eq hold ? at("trace", m, x) : NaN
set palette defined (0 "#88CCEE", 0.5 "#117733", 1 "#332288")
unset colorbox
set key title "hold  [s]" inside top right samplen 2.5
do for [m in "brush_aged rate_state"] {
  if (is_there(m)) {
    set title name(m).": the peak after each hold"
    plot [0:4] for [i=1:words(holds)] csv using (trace(m, word(holds, i), $5 > 0 ? $5 : NaN)):6 with lines dashtype 1 linewidth 1.8 \
      linecolor palette fraction ((i - 1.0) / (words(holds) - 1.0)) title word(holds, i)
    unset key
  }
}
set key notitle
unset key
set logscale x
set title "the peak over the duration of the hold"
set xlabel "duration of the hold  [s]"
plot for [m in present] csv using (at("peak", m, $3)):6 with linespoints linetype index_of(m) title name(m)
set title "the force while it is held (longest hold)"
set xlabel "time since it stopped  [s]"
set ylabel "friction over kinetic friction"
set yrange [0:*]
longest = word(holds, words(holds))
set key @below
plot for [m in present] csv using (trace(m, longest, $5 == 0 && $4 > 0 ? $4 : NaN)):6 with lines linetype index_of(m) title name(m)
unset multiplot
