# Draws the force over the displacement of tools/scenes/three_populations.toml.
#   bristle run tools/scenes/three_populations.toml --out forces.csv
#   gnuplot -e "csv='forces.csv'; png='three_populations.png'" three_populations.gp
if (!exists("csv")) { print "three_populations.gp: needs csv='FILE'"; exit status 2 }
if (!exists("png")) png = "three_populations.png"
set terminal pngcairo size 1200,560 font "DejaVu Sans,13" linewidth 1.2
set output png
set datafile separator comma
set datafile columnheaders
set datafile missing NaN
x(name) = strcol(2) eq name ? 1e6 * column("x") : NaN
set border 3 linecolor "#555555"
set tics nomirror
set grid linecolor "#DDDDDD"
set key center right samplen 2.5 noenhanced
set title "Pulled 100 um, back, and again: one law, three populations"
set xlabel "displacement  [um]"
set ylabel "friction over normal load"
# Plots the friction that the body exerts, so that the first pull is above zero.
plot csv using (x("bristles_300")):(-column("fx") / column("load")) with lines linecolor rgb "#D55E00" title "300 bristles", \
     csv using (x("bristles_3000")):(-column("fx") / column("load")) with lines linecolor rgb "#56B4E9" title "3,000 bristles", \
     csv using (x("infinite")):(-column("fx") / column("load")) with lines linecolor rgb "#000000" linewidth 1.6 title "infinite brush"
