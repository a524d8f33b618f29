# Draws a force file of `bristle run --csv` (`bristle run --plot` runs this script itself).
#   gnuplot -e "csv='forces.csv'; png='forces.png'; title='block on floor'" forces.gp
# Friction as the body exerts it, along its motion: peaks point up.
# Options: patches='base lid' draws these (default: the first four of the file); zoom=100 adds a panel of the first
# 100 um of motion, where the bristles bend before they slide.
if (!exists("csv")) { print "forces.gp: needs csv='FILE'"; exit status 2 }
if (!exists("png")) png = "forces.png"
if (!exists("title")) title = csv
if (!exists("zoom")) zoom = 0
set datafile separator comma
set datafile columnheaders
set datafile missing NaN
# Collects the different words of a column, in their order in the file, in `seen`.
collect(word) = strstrt(" ".seen, " ".word." ") > 0 ? 0 : (seen = seen.word." ", 0)
seen = ""
if (!exists("patches")) { stats csv using (words(seen) < 4 ? collect(strcol(2)) : 0) nooutput; patches = seen }
n = words(patches)
if (n == 0) { print "forces.gp: no rows in ".csv; exit status 2 }
name(i) = word(patches, i)
# Selects rows by `using`: of(i, x) is x in the rows of one patch, begun(i, x) in those before it is first farther than
# the zoom shows.
of(i, x) = strcol(2) eq name(i) ? x : NaN
far = 0
begun(i, x) = (column(0) == 0 ? (far = 0) : 0, strcol(2) ne name(i) ? NaN : abs(x) > zoom ? (far = 1, NaN) : far ? NaN : x)
# Lists the patches that have a force along y.
seen = ""
stats csv using (column("fy") != 0 ? collect(strcol(2)) : 0) nooutput
has_y(i) = sum [k=1:words(seen)] (word(seen, k) eq name(i))
# Leaves the name of a single patch out of the keys.
label(i, what) = n == 1 ? what : name(i).(what eq "" ? "" : "  ").what
label_x(i) = label(i, has_y(i) ? "x" : "")
label_y(i) = label(i, "y")
y_line(i, y) = sprintf(', csv using (of(%d, column("t"))):(%s) with lines dashtype 3 linecolor rgb colour[%d] title label_y(%d)', i, y, i, i)

# With svg=1 draws vectors, else PNG.
if (!exists("svg")) svg = 0
term = svg ? 'svg dynamic background "white"' : 'pngcairo'
set terminal @term size 1500,1560 font "DejaVu Sans,17" linewidth 1.6
set output png
array colour[4] = ["#0072B2", "#D55E00", "#009E73", "#CC79A7"]  # Okabe and Ito, distinguishable for the colour-blind
load_colour(i) = n == 1 ? "#888888" : colour[i]
set border 3 linecolor "#555555"
set tics nomirror
set grid linecolor "#DDDDDD"
set key outside top right horizontal samplen 2 noenhanced
set lmargin 11
set rmargin 10

set multiplot title title font ",22" noenhanced
set size 1.0, 0.31
set xlabel "time  [s]"
set origin 0.0, 0.64
set ylabel "friction, by the body  [N]"
command = 'plot for [i=1:n] csv using (of(i, column("t"))):(-column("fx")) with lines linecolor rgb colour[i] title label_x(i)'
do for [i=1:n] { if (has_y(i)) { command = command.y_line(i, '-column("fy")') } }
eval command

set origin 0.0, 0.33
set ylabel "position  [mm]"
set y2label "normal load  [N]"
set y2tics
set y2range [0:*]
command = 'plot for [i=1:n] csv using (of(i, column("t"))):"load" axes x1y2 with lines linewidth 0.7 dashtype 4 linecolor rgb load_colour(i) title label(i, "load"), for [i=1:n] csv using (of(i, column("t"))):(1e3 * column("x")) with lines linecolor rgb colour[i] title label_x(i)'
do for [i=1:n] { if (has_y(i)) { command = command.y_line(i, '1e3 * column("y")') } }
eval command
unset y2label
unset y2tics

set origin 0.0, 0.01
set xlabel "position x  [mm]"
set ylabel "friction, by the body, x  [N]"
if (zoom > 0) {
  set rmargin 3
  set size 0.52, 0.31
}
plot for [i=1:n] csv using (of(i, 1e3 * column("x"))):(-column("fx")) with lines linewidth 0.8 linecolor rgb colour[i] title label(i, "")
if (zoom > 0) {
  set origin 0.51, 0.01
  set size 0.49, 0.31
  set lmargin 9
  set xlabel "position x  [um], up to the first slide"
  plot for [i=1:n] csv using (begun(i, 1e6 * column("x"))):(-column("fx")) with lines linecolor rgb colour[i] title label(i, "")
}
unset multiplot
