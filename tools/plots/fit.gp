# Draws a fit over the data, from what `bristle fit --csv` writes (`bristle fit --plot` runs this script itself).
#   gnuplot -e "csv='fit.csv'; png='fit.png'; title='sled'" fit.gp
if (!exists("csv")) { print "fit.gp: needs csv='FILE'"; exit status 2 }
if (!exists("png")) png = "fit.png"
if (!exists("title")) title = csv

# Names the columns of other models' forces, as `bristle fit --rivals` writes them: "Coulomb LuGre".
if (!exists("rivals")) rivals = ""
array colour[3] = ["#009E73", "#E69F00", "#CC79A7"]

# With svg=1 draws vectors, else PNG.
if (!exists("svg")) svg = 0
term = svg ? 'svg dynamic background "white"' : 'pngcairo'
set terminal @term size 1500,1300 font "DejaVu Sans,17" linewidth 1.6
set output png
set datafile separator comma
set datafile columnheaders
set border 3 linecolor "#555555"
set tics nomirror
set grid linecolor "#DDDDDD"
set key outside top right horizontal samplen 2 noenhanced
set lmargin 11
set rmargin 3
stats csv using "x" nooutput
scale = STATS_max - STATS_min < 1e-3 ? 1e6 : 1e3
unit = scale == 1e6 ? "um" : "mm"
# Uses thin points if there are many data.
dots = STATS_records > 3000 ? 0.25 : 0.5

# Clips other models that go far beyond the measured force.
if (rivals ne "") {
  stats csv using "force" nooutput
  span = STATS_max - STATS_min
  set yrange [STATS_min - 0.4 * span:STATS_max + 0.4 * span]
}
set multiplot title title font ",22" noenhanced
set size 1.0, 0.42
set origin 0.0, 0.53
set xlabel "position  [".unit."]".(rivals eq "" ? "" : "     (other models: fitted to the first part of the record)")
set ylabel "friction, by the body  [N]"
plot csv using (scale * column("x")):"force" with points pointtype 7 pointsize dots linecolor rgb "#999999" title "measured", \
     for [i=1:words(rivals)] csv using (scale * column("x")):word(rivals, i) with lines linewidth 0.7 \
         linecolor rgb colour[i] title word(rivals, i), \
     csv using (scale * column("x")):"fit" with lines linecolor rgb "#0072B2" title "fit"
set size 1.0, 0.31
set origin 0.0, 0.22
set xlabel "time  [s]"
plot csv using "t":"force" with points pointtype 7 pointsize dots linecolor rgb "#999999" title "measured", \
     for [i=1:words(rivals)] csv using "t":word(rivals, i) with lines linewidth 0.6 linecolor rgb colour[i] notitle, \
     csv using "t":"fit" with lines linewidth 0.8 linecolor rgb "#0072B2" title "fit"
set size 1.0, 0.22
set origin 0.0, 0.0
set ylabel "measured - fit  [N]"
set autoscale y
plot csv using "t":"residual" with points pointtype 7 pointsize dots linecolor rgb "#D55E00" notitle
unset multiplot
