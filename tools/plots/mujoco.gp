# Draws the output of `bristle_mujoco --csv FILE`: gnuplot -e "csv='FILE'; png='FILE'" tools/plots/mujoco.gp
if (!exists("csv")) { print "mujoco.gp: need csv='FILE'"; exit status 2 }
if (!exists("png")) png = "mujoco.png"
kinds = "'MuJoCo' 'MuJoCo, noslip' 'bristle'"
set linetype 1 linecolor rgb "#E69F00" dashtype 1 linewidth 2
set linetype 2 linecolor rgb "#009E73" dashtype 2 linewidth 2
set linetype 3 linecolor rgb "#0072B2" dashtype 1 linewidth 2.6
# Splits lines at quotes, because a quoted cell holds commas; at(c) is column c behind the kind.
set datafile separator '"'
set datafile columnheaders
set datafile missing NaN
cut(s, k) = k == 1 ? s[1:strstrt(s.",", ",") - 1] : cut(s[strstrt(s, ",") + 1:*], k - 1)
# Reads a number; real() wants a point in one with an exponent.
number(s) = strstrt(s, ".") > 0 || strstrt(s, "e") == 0 ? real(s) : real(s[1:strstrt(s, "e") - 1].".0".s[strstrt(s, "e"):*])
at(c) = number(cut(strcol(3), c + 1))
of(scene, k) = strcol(1) eq scene."," && strcol(2) eq word(kinds, k)
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
plot for [k=1:3] csv using (of("pinch_5.9N", k) ? at(1) : NaN):(1e3 * at(2)) with lines linetype k title word(kinds, k)
unset key
set title "box of 200 g held 20 mm off its centre with 30 N, shaken"
set ylabel "turn  [deg]"
plot for [k=1:3] csv using (of("held_off_centre", k) ? at(1) : NaN):(57.2958 * at(3)) every 10 with lines linetype k
set title "block on a slope, tapped for 2 s"
set ylabel "downhill  [mm]"
plot for [k=1:3] csv using (of("tapped_block", k) ? at(1) : NaN):(1e3 * at(2)) with lines linetype k
set title "box pushed off centre for 0.2 s: the path of its centre"
set xlabel "x  [mm]"
set ylabel "y  [mm]"
plot for [k=1:3] csv using (of("pushed_box", k) ? 1e3 * at(4) : NaN):(1e3 * at(5)) with lines linetype k
unset multiplot
