# Draws the output of `bristle_mujoco --csv FILE`: gnuplot -e "csv='FILE'; png='FILE'" tools/plots/mujoco.gp
if (!exists("csv")) { print "mujoco.gp: need csv='FILE'"; exit status 2 }
if (!exists("png")) png = "mujoco.png"
kinds = "'MuJoCo' 'MuJoCo, noslip' 'bristle'"
set linetype 1 linecolor rgb "#E69F00" dashtype 1 linewidth 2
set linetype 2 linecolor rgb "#009E73" dashtype 2 linewidth 2
set linetype 3 linecolor rgb "#0072B2" dashtype 1 linewidth 2.6
rows(scene, k) = sprintf("< awk -F'\"' '$1 == \"%s,\" && $2 == \"%s\" { print substr($3, 2) }' '%s'", scene, word(kinds, k), csv)
set datafile separator comma
set terminal pngcairo size 1200,900 font "DejaVu Sans,13" linewidth 1.2
set output png
set border 3 linecolor "#555555"
set tics nomirror
set grid linecolor "#DDDDDD"
set key top left samplen 2.5 spacing 1.1 noenhanced
set multiplot layout 2,2 title "MuJoCo with its own friction and with bristles" font ",17"
set xlabel "time  [s]"
set ylabel "downwards  [mm]"
set title "capsule of 45 g pinched with 5.9 N"
plot for [k=1:3] rows("pinch_5.9N", k) using 1:(1e3 * $2) with lines linetype k title word(kinds, k)
unset key
set title "box of 200 g held 20 mm off its centre with 30 N, shaken"
set ylabel "turn  [deg]"
plot for [k=1:3] rows("held_off_centre", k) using 1:(57.2958 * $3) every 10 with lines linetype k
set title "block on a slope, tapped for 2 s"
set ylabel "downhill  [mm]"
plot for [k=1:3] rows("tapped_block", k) using 1:(1e3 * $2) with lines linetype k
set title "box pushed off centre for 0.2 s: the way of its centre"
set xlabel "x  [mm]"
set ylabel "y  [mm]"
plot for [k=1:3] rows("pushed_box", k) using (1e3 * $4):(1e3 * $5) with lines linetype k
unset multiplot
