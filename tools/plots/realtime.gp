# Draws the output of `bristle run --realtime --histograms`: step time, and jitter of the period with a bare sleep
# loop's.
#   gnuplot -e "csv='histograms.csv'; png='realtime.png'; title='1 kHz'; deadline_us=1000" realtime.gp
if (!exists("csv")) { print "realtime.gp: needs csv='FILE'"; exit status 2 }
if (!exists("png")) png = "realtime.png"
if (!exists("title")) title = "Steps against the clock"
if (!exists("deadline_us")) deadline_us = 0

set datafile separator comma
set datafile columnheaders
set datafile missing NaN
# Counts the ticks of a loop and finds the longest time.
ticks = bare_ticks = most = 0
count(loop, n) = (ticks = ticks + n * (loop eq "bristle"), bare_ticks = bare_ticks + n * (loop eq "bare sleep"), 0)
stats csv using (most = $4 > most ? $4 : most, strcol(2) eq "step" ? count(strcol(1), $5) : 0) nooutput
if (ticks == 0) { print "realtime.gp: no ticks of bristle in ".csv; exit status 2 }
# Merges the file's buckets, which are finer than the eye can tell, to eight bars per octave: number of the bar of a row,
# and the time (us) where a bar begins.
bar(loop, histogram) = strcol(1) eq loop && strcol(2) eq histogram ? \
  floor(8 * log(column(3) + column(4) > 0.002 ? (column(3) + column(4)) / 2 : 0.001) / log(2)) : NaN
begin(bar) = 2 ** (bar / 8.0)
set table $step
plot csv using (bar("bristle", "step")):5 smooth frequency
set table $jitter
plot csv using (bar("bristle", "jitter")):5 smooth frequency
if (bare_ticks > 0) {
  set table $bare
  plot csv using (bar("bare sleep", "jitter")):5 smooth frequency
}
unset table
set datafile separator whitespace
unset datafile columnheaders

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
set xrange [0.02:2 * (most > deadline_us ? most : deadline_us)]
set format x "%g"
if (deadline_us > 0) {
  set arrow 1 from deadline_us, graph 0 to deadline_us, graph 1 nohead linecolor rgb "#000000" dashtype 2
  set label 1 sprintf(" deadline %g us", deadline_us) at deadline_us, graph 0.97 left
}
set multiplot layout 2,1 title title font ",22" noenhanced
set xlabel "step time  [us]"
plot $step using (begin($1 + 0.5)):2:(begin($1)):(begin($1 + 1)):(0.5):2 with boxxyerror linecolor rgb "#0072B2" notitle
if (deadline_us > 0) {
  unset label 1
  unset arrow 1
}
set xlabel "jitter: time from start to start, less the period  [us]"
# Draws the histogram of the bare sleep loop as an outline over the bars of bristle, if that loop ran.
command = 'plot $jitter using (begin($1 + 0.5)):2:(begin($1)):(begin($1 + 1)):(0.5):2 with boxxyerror linecolor rgb "#0072B2" title "bristle"'
if (bare_ticks > 0) {
  command = command.', $bare using (begin($1 + 0.5)):2:(begin($1)):(begin($1 + 1)):(0.5):2 with boxxyerror fillstyle empty linewidth 1.6 linecolor rgb "#D55E00" title "bare sleep loop, in turns"'
}
eval command
unset multiplot
