# Draws the output of `bristle experiment creep-curve --csv`.
load folder."/experiment_style.gp"
models = "coulomb_wheel slip_formula lugre_tyre fastsim bed"
titles = "'Coulomb wheel' 'slip formula' 'LuGre tyre' 'FASTSIM' 'bed'"
set linetype 5 linecolor rgb "#0072B2" dashtype 1 linewidth 3.0 pointtype 7
set multiplot @four title "A wheel that rolls and creeps sideways" font ",17"
set title "force"
set xlabel "creepage  [of that at which all slips]"
set ylabel "force / friction"
set xrange [0:1.5]
set yrange [0:1.1]
plot for [m in present] csv using (at("curve", m, $3)):4 with lines linetype index_of(m) title name(m)
set title "aligning moment"
set ylabel "moment / (friction half length)"
set yrange [-0.06:0.14]
plot for [m in present] csv using (at("curve", m, $3)):5 with lines linetype index_of(m) title name(m)
set title "tractions: bed (lines), FASTSIM (points); at the bound it slips"
set xlabel "place  [half lengths; it rolls to the right]"
set ylabel "traction / highest bound"
set xrange [-1:1]
set yrange [0:1.35]
shown = "0.1 0.3 0.6"
colours = "#009E73 #E69F00 #D55E00"
set key top center horizontal maxrows 2 samplen 2
plot 1 - x**2 with lines linecolor rgb "black" dashtype 2 title "bound", \
  for [i=1:3] csv using (at("traction_".word(shown, i), "bed", $3)):4 with lines linewidth 2.4 dashtype 1 linecolor rgb word(colours, i) \
    title "creepage ".word(shown, i), \
  for [i=1:3] csv using (at("traction_".word(shown, i), "fastsim", $3)):4 with points pointtype 6 pointsize 0.7 linecolor rgb word(colours, i) notitle
unset key
set title "where the bed sticks (blue) and slips (red)"
set ylabel "creepage  [of that at which all slips]"
set yrange [0:1.05]
set key @below
# The panel of a creepage is traction_CREEPAGE.
creepage(panel) = panel[1:9] eq "traction_" ? real(panel[10:*]) : NaN
plot csv using (strcol(2) eq "bed" ? $3 : NaN):(creepage(strcol(1))):($4 > 0.999 * $5 ? 0xD55E00 : 0x0072B2) with points pointtype 5 pointsize 0.9 linecolor rgb variable notitle, \
  for [m in present] NaN with lines linetype index_of(m) title name(m)
unset multiplot
