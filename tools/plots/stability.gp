# Draws the output of `bristle stability --csv`: for each scheme the verdict of the simulation over k and c, and the
# limit of linear theory as a line.
#   gnuplot -e "csv='stability.csv'; png='stability.png'" stability.gp
if (!exists("csv")) { print "stability.gp: needs csv='FILE'"; exit status 2 }
if (!exists("png")) png = "stability.png"

array scheme[9] = [0, 1, 2, 6, 7, 8, 9, 3, 4]
array name[9] = ["explicit Euler", "semi-implicit, end force", "semi-implicit, mean force", \
  "zero-order hold, true velocity", "zero-order hold, backward difference", \
  "device, damping b, encoder", "device, damping b, mean force", \
  "coupling, clipped predictor", "coupling, midpoint solve"]
# Colours that the colour-blind can tell apart, and that differ in lightness in print.
settles = "#A6D8F5"; grows = "#F0E442"; rings = "#D55E00"; runs = "#333333"

set datafile separator comma
set datafile columnheaders
set datafile missing NaN
cell(s, verdict, unbounded) = strcol(1) eq "cell" && column(2) == s && column(6) == verdict && column(7) == unbounded ? column(3) : 1e-9
limit(s) = strcol(1) eq "limit" && column(2) == s ? column(3) : 1e-9
# Sets the size of a cell to the spacing of the grid.
seen = ""
collect(word) = strstrt(" ".seen, " ".word." ") > 0 ? 0 : (seen = seen.word." ", 0)
stats csv using (strcol(1) eq "cell" && $2 == 0 ? collect(strcol(3)) : 0) nooutput
columns = words(seen)
size = 1.75 * 25.0 / columns

set terminal pngcairo size 1800,1800 font "DejaVu Sans,17" linewidth 1.5
set output png
set multiplot layout 3,3 margins screen 0.06,0.98,0.09,0.93 spacing screen 0.08,0.08 title "A mass on one patch in closed loop: simulation (colour) and the limit of linear theory (line)" font ",22"
set logscale xy
set format xy "10^{%T}"
set xrange [8e-4:1.3e2]
set yrange [8e-4:1.3e1]
set border 3 linecolor "#555555"
set tics nomirror
set xlabel "k = K T^2/m  [1]"
do for [i=1:9] {
  set title name[i] font ",18"
  set ylabel (scheme[i] >= 8 ? "{/Symbol b} = b T/m  [1]" : "c = C T/m  [1]")
  if (i == 9) { set key at screen 0.5,0.005 center bottom vertical maxrows 1 samplen 1 } else { unset key }
  plot csv using (cell(scheme[i], 0, 0)):4 with points pointtype 5 pointsize size linecolor rgb settles title "settles", \
       csv using (cell(scheme[i], 1, 0)):4 with points pointtype 5 pointsize size linecolor rgb grows title "grows", \
       csv using (cell(scheme[i], 2, 0)):4 with points pointtype 5 pointsize size linecolor rgb rings title "rings", \
       csv using (cell(scheme[i], 1, 1)):4 with points pointtype 5 pointsize size linecolor rgb runs title "grows without bound", \
       csv using (limit(scheme[i])):4 with points pointtype 7 pointsize 0.45 linecolor rgb "#000000" title "linear limit"
}
unset multiplot
