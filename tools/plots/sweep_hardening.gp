# Draws how far friction rises with rubbing, from a sweep of tools/libraries/sweep/rubbed.toml (core/guides/GUIDE_RESEARCH.md).
#   gnuplot -e "csv='hardening.csv'; png='hardening.png'" sweep_hardening.gp
if (!exists("csv")) { print "sweep_hardening.gp: needs csv='FILE'"; exit status 2 }
if (!exists("png")) png = "hardening.png"
if (!exists("renewals")) renewals = "0 0.1 0.3 1 3"

set terminal pngcairo size 1100,750 font "DejaVu Sans,15" linewidth 1.6
set output png
set datafile separator comma
set datafile columnheaders
set datafile missing NaN
set border 3 linecolor "#555555"
set tics nomirror
set grid linecolor "#DDDDDD"
set key top left title "shared renewal" samplen 2
set title "Highest friction in the last of 200 rubs, over the peak of first loading" noenhanced
set xlabel "spread of the snap lengths (deviation over mean)"
set ylabel "last rub / first loading"
set arrow from graph 0, first 1 to graph 1, first 1 nohead linecolor "#999999" dashtype 2 back
colours = "#0072B2 #56B4E9 #009E73 #E69F00 #D55E00 #CC79A7"
plot for [i = 1:words(renewals)] csv using "material.skin.snap_length.cv" : \
       (abs(column("material.skin.shared_renewal") - real(word(renewals, i))) < 1e-9 ? \
        column("pad.window_peak") / column("pad.peak_in_theory") : NaN) \
     with linespoints pointtype 7 linecolor rgb word(colours, (i - 1) % 6 + 1) title word(renewals, i)
