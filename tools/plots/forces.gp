# Draws a force file of `bristle run --out`.
#   gnuplot -e "csv='forces.csv'; png='forces.png'; title='block on floor'" forces.gp
# Friction as the body exerts it, along its motion: peaks point up.
# Options: patches='base lid' draws these (default: the first four of the file); zoom=100 adds a panel of the first
# 100 um of motion, where the bristles bend before they slide.
if (!exists("csv")) { print "forces.gp: needs csv='FILE'"; exit status 2 }
if (!exists("png")) png = "forces.png"
if (!exists("title")) title = csv
if (!exists("zoom")) zoom = 0
if (!exists("patches")) patches = system(sprintf("awk -F, 'NR > 1 && !seen[$2]++ && n++ < 4 { print $2 }' '%s'", csv))
n = words(patches)
if (n == 0) { print "forces.gp: no rows in ".csv; exit status 2 }
name(i) = word(patches, i)
# Selects the rows of one patch by awk, which every system has. Patch names hold no commas.
rows(i) = sprintf("< awk -F, 'NR == 1 || $2 == \"%s\"' '%s'", name(i), csv)
first_rows(i) = sprintf("< awk -F, 'NR == 1 { for (c = 1; c <= NF; ++c) if ($c == \"x\") x = c; print } NR > 1 && $2 == \"%s\" { if ($x > %g || -$x > %g) exit; print }' '%s'", name(i), 1e-6 * zoom, 1e-6 * zoom, csv)
# Lists the patches that have a force along y.
with_y = system(sprintf("awk -F, 'NR > 1 && $4 != 0 && !seen[$2]++ { print $2 }' '%s'", csv))
has_y(i) = sum [k=1:words(with_y)] (word(with_y, k) eq name(i))
any_y = words(with_y) > 0
# Leaves the name of a single patch out of the keys.
label(i, what) = n == 1 ? what : name(i).(what eq "" ? "" : "  ").what
label_x(i) = label(i, has_y(i) ? "x" : "")
label_y(i) = has_y(i) ? label(i, "y") : ""
y_style(i) = has_y(i) ? 1 : NaN

set terminal pngcairo size 1500,1560 font "DejaVu Sans,17" linewidth 1.6
set output png
set datafile separator comma
set datafile columnheaders
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
plot for [i=1:n] rows(i) using "t":(-column("fx")) with lines linecolor rgb colour[i] title label_x(i), \
     for [i=1:n] rows(i) using "t":(-y_style(i) * column("fy")) with lines dashtype 3 linecolor rgb colour[i] title label_y(i)

set origin 0.0, 0.33
set ylabel "position  [mm]"
set y2label "normal load  [N]"
set y2tics
set y2range [0:*]
plot for [i=1:n] rows(i) using "t":"load" axes x1y2 with lines linewidth 0.7 dashtype 4 linecolor rgb load_colour(i) title label(i, "load"), \
     for [i=1:n] rows(i) using "t":(1e3 * column("x")) with lines linecolor rgb colour[i] title label_x(i), \
     for [i=1:n] rows(i) using "t":(1e3 * y_style(i) * column("y")) with lines dashtype 3 linecolor rgb colour[i] title label_y(i)
unset y2label
unset y2tics

set origin 0.0, 0.01
set xlabel "position x  [mm]"
set ylabel "friction, by the body, x  [N]"
if (zoom > 0) {
  set rmargin 3
  set size 0.52, 0.31
}
plot for [i=1:n] rows(i) using (1e3 * column("x")):(-column("fx")) with lines linewidth 0.8 linecolor rgb colour[i] title label(i, "")
if (zoom > 0) {
  set origin 0.51, 0.01
  set size 0.49, 0.31
  set lmargin 9
  set xlabel "position x  [um], up to the first slide"
  plot for [i=1:n] first_rows(i) using (1e6 * column("x")):(-column("fx")) with lines linecolor rgb colour[i] title label(i, "")
}
unset multiplot
