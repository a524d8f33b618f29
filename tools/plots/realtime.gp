# Draws the output of `bristle run --realtime --histograms`: step time, and jitter of the period with a bare sleep
# loop's.
#   gnuplot -e "csv='histograms.csv'; png='realtime.png'; title='1 kHz'; deadline_us=1000" realtime.gp
if (!exists("csv")) { print "realtime.gp: needs csv='FILE'"; exit status 2 }
if (!exists("png")) png = "realtime.png"
if (!exists("title")) title = "Steps against the clock"
if (!exists("deadline_us")) deadline_us = 0

# Merges the file's buckets, which are finer than the eye can tell, to eight bars per octave. Prints low (us), high (us)
# and ticks of each bar.
bars(loop, histogram) = sprintf("< awk -F, '$1 == \"%s\" && $2 == \"%s\" { t = ($3 + $4) / 2; if (t < 0.001) t = 0.001; b = int(8 * log(t) / log(2) + 1000); n[b] += $5 } END { for (b in n) print exp((b - 1000) * log(2) / 8), exp((b - 999) * log(2) / 8), n[b] }' '%s'", loop, histogram, csv)
ticks(loop) = int(system(sprintf("awk -F, '$1 == \"%s\" && $2 == \"step\" { n += $5 } END { print n + 0 }' '%s'", loop, csv)))
if (ticks("bristle") == 0) { print "realtime.gp: no ticks of bristle in ".csv; exit status 2 }

set terminal pngcairo size 1500,1150 font "DejaVu Sans,17" linewidth 1.4
set output png
set border 3 linecolor "#555555"
set tics nomirror
set grid linecolor "#DDDDDD"
set logscale xy
set yrange [0.5:*]
set ylabel "ticks"
set key top right samplen 2
set style fill solid 0.45 border
most = system(sprintf("awk -F, 'NR > 1 && $4 > m { m = $4 } END { print 2 * m }' '%s'", csv))
set xrange [0.02:real(most) > 2 * deadline_us ? real(most) : 2 * deadline_us]
set format x "%g"
if (deadline_us > 0) {
  set arrow 1 from deadline_us, graph 0 to deadline_us, graph 1 nohead linecolor rgb "#000000" dashtype 2
  set label 1 sprintf(" deadline %g us", deadline_us) at deadline_us, graph 0.97 left
}
# Draws the histogram of the bare sleep loop as an outline over the bars of bristle, if that loop ran.
bare = ticks("bare sleep") > 0

set multiplot layout 2,1 title title font ",22" noenhanced
set xlabel "step time  [us]"
plot bars("bristle", "step") using (sqrt($1 * $2)):3:1:2:(0.5):3 with boxxyerror linecolor rgb "#0072B2" notitle
if (deadline_us > 0) {
  unset label 1
  unset arrow 1
}
set xlabel "jitter: time from start to start, less the period  [us]"
command = 'plot bars("bristle", "jitter") using (sqrt($1 * $2)):3:1:2:(0.5):3 with boxxyerror linecolor rgb "#0072B2" title "bristle"'
if (bare) {
  command = command.', bars("bare sleep", "jitter") using (sqrt($1 * $2)):3:1:2:(0.5):3 with boxxyerror fillstyle empty linewidth 1.6 linecolor rgb "#D55E00" title "bare sleep loop, in turns"'
}
eval command
unset multiplot
