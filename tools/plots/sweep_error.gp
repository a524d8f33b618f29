# Draws error against time over materials, from two sweeps of tools/libraries/sweep/stroked.toml: representatives and the infinite
# brush (core/guides/GUIDE_RESEARCH.md). Colours are materials, by their ratio of peak to kinetic friction.
#   gnuplot -e "bristles='bristles.csv'; infinite='infinite.csv'; png='error.png'" sweep_error.gp
if (!exists("bristles") || !exists("infinite")) {
  print "sweep_error.gp: needs bristles='FILE' and infinite='FILE'"; exit status 2
}
if (!exists("png")) png = "error.png"
if (!exists("peaks")) peaks = "0.42 0.46 0.6"

set terminal pngcairo size 1100,750 font "DejaVu Sans,15" linewidth 1.6
set output png
set datafile separator comma
set datafile columnheaders
set border 3 linecolor "#555555"
set tics nomirror
set grid linecolor "#DDDDDD"
set key top right samplen 1
set logscale xy
set xlabel "median time of a step  [us]"
set ylabel "error of the force, rms, share of the force"
set format y "%g"
colours = "#0072B2 #009E73 #D55E00 #CC79A7"
at(peak, name) = abs(column("material.skin.peak") - real(peak)) < 1e-9 ? column(name) : NaN
plot for [i = 1:words(peaks)] bristles using (1e6 * column("time.step_p50[s]")):(at(word(peaks, i), "tip.error")) \
       with points pointtype 6 linecolor rgb word(colours, i) \
       title sprintf("bristles, peak / kinetic %.2f", word(peaks, i) / 0.4), \
     for [i = 1:words(peaks)] infinite using (1e6 * column("time.step_p50[s]")):(at(word(peaks, i), "tip.error")) \
       with points pointtype 7 linecolor rgb word(colours, i) \
       title sprintf("infinite brush, peak / kinetic %.2f", word(peaks, i) / 0.4)
