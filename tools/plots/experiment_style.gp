# Sets the common style of the pictures of `bristle experiment`. Loaded by experiment_*.gp, which get csv='FILE' (of
# --csv), png='FILE' and folder='...' (where this file is).
if (!exists("csv")) { print "experiment plots: need csv='FILE'"; exit status 2 }
models = "coulomb dahl lugre elasto_plastic maxwell_slip gms rate_state brush_redraw brush_keep brush_infinite brush_rubbed brush_aged brush_slide brush_slide_drop"
titles = "'Coulomb' 'Dahl' 'LuGre' 'elasto-plastic' 'Maxwell-slip' 'GMS' 'rate and state' 'brush, redraw' 'brush, keep' 'infinite brush' 'rubbed brush (default)' 'aged brush' 'brush, slide' 'brush, slide, drop'"
index_of(m) = sum [k=1:words(models)] (word(models, k) eq m ? k : 0)
name(m) = word(titles, index_of(m))
# Colours of Okabe and Ito, distinguishable for the colour-blind. The brush is drawn thick.
set linetype 1 linecolor rgb "#888888" dashtype 3 linewidth 1.4 pointtype 4
set linetype 2 linecolor rgb "#E69F00" dashtype (12,7) linewidth 1.4 pointtype 6
set linetype 3 linecolor rgb "#D55E00" dashtype 1 linewidth 1.4 pointtype 8
set linetype 4 linecolor rgb "#9467BD" dashtype 4 linewidth 1.4 pointtype 10
set linetype 5 linecolor rgb "#009E73" dashtype 5 linewidth 1.4 pointtype 12
set linetype 6 linecolor rgb "#000000" dashtype 2 linewidth 1.4 pointtype 2
set linetype 7 linecolor rgb "#B8860B" dashtype 1 linewidth 1.8 pointtype 3
set linetype 8 linecolor rgb "#0072B2" dashtype 1 linewidth 2.6 pointtype 7
set linetype 9 linecolor rgb "#56B4E9" dashtype 1 linewidth 2.6 pointtype 5
set linetype 10 linecolor rgb "#332288" dashtype 1 linewidth 2.6 pointtype 9
set linetype 11 linecolor rgb "#AA3377" dashtype 1 linewidth 2.6 pointtype 11
set linetype 12 linecolor rgb "#117733" dashtype 1 linewidth 3.2 pointtype 13
set linetype 13 linecolor rgb "#CC6677" dashtype 1 linewidth 2.6 pointtype 14
set linetype 14 linecolor rgb "#661100" dashtype (12,7) linewidth 2.6 pointtype 15
# Selects rows by `using`, whatever the name of the file holds: at(...) is x in the rows of a panel and a model.
set datafile separator comma
set datafile columnheaders
set datafile missing NaN
at(panel, m, x) = strcol(1) eq panel && strcol(2) eq m ? x : NaN
# Collects the different words of a column, in their order in the file, in `seen`.
collect(word) = strstrt(" ".seen, " ".word." ") > 0 ? 0 : (seen = seen.word." ", 0)
seen = ""
stats csv using (collect(strcol(2))) nooutput
present = seen
# Draws one friction model of each kind if there are more than seven, because twelve curves hide each other. The option
# --models names others.
all_present = present
if (words(all_present) > 7) {
  kinds = "coulomb lugre maxwell_slip rate_state brush_redraw brush_rubbed brush_aged brush_slide brush_slide_drop"
  kept = ""
  do for [m in kinds] { if (strstrt(" ".all_present, " ".m." ") > 0) { kept = kept.m." " } }
  present = kept
}
is_there(m) = strstrt(" ".all_present, " ".m." ") > 0
# Draws those models that the script wants and the file holds; if it holds none of them, the file's first model.
if (!exists("wanted")) wanted = present
few = ""
do for [m in wanted] { if (is_there(m)) { few = few.m." " } }
if (words(few) == 0) few = word(present, 1)
# With svg=1 draws vectors, else PNG.
if (!exists("svg")) svg = 0
term = svg ? 'svg dynamic background "white"' : 'pngcairo'
set terminal @term size 1200,1000 font "DejaVu Sans,13" linewidth 1.2
set output png
set border 3 linecolor "#555555"
set tics nomirror
set grid linecolor "#DDDDDD"
# Draws the key once, below all panels, by `set key @below` before the last plot.
keyed = few
below = "at screen 0.5,0.0 center bottom vertical maxrows (words(keyed) + 3) / 4 samplen 2.5 spacing 1.1 noenhanced"
four = "layout 2,2 margins screen 0.1,0.97,0.16,0.91 spacing screen 0.1,0.12"
two = "layout 1,2 margins screen 0.1,0.97,0.3,0.83 spacing screen 0.1"
unset key
