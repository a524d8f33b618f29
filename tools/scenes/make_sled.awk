# Makes sled.csv: a sled of 200 g of load on a surface, as a tribometer would record it, for `bristle fit`.
#   awk -f make_sled.awk > sled.csv
# A brush written for this file alone: 1800 bristles, lognormal snap lengths of mean 15 um and deviation 6 um, redrawn
# at each snap; kinetic coefficient 0.35; a lubricant of 60 N s/m. Four seconds of growing presliding loops, then
# strokes of growing length and speed. Sensors: force with 10 mN of noise, an offset of 30 mN and a drift of 2 mN/s;
# an encoder of 0.5 um; 100 samples a second. Own random numbers, so that any awk makes the same file.

function random() {  # uniform on (0, 1): Park and Miller
  seed = (seed * 16807) % 2147483647
  return seed / 2147483647
}
function gaussian() { return sqrt(-2 * log(random())) * cos(2 * pi * random()) }  # Box and Muller
function snap_length() { return mean * exp(s * gaussian() - s * s / 2) }
function quantised(value, quantum,  n) {
  n = value / quantum
  return quantum * int(n < 0 ? n - 0.5 : n + 0.5)
}
function position(t) {  # um
  if (t < 4) return 13 * t / 4 * sin(2 * pi * t)
  return 350 * sin(2 * pi * 0.5 * (t - 4)) * ((t - 4) / 8) ^ 1.5
}

BEGIN {
  pi = 3.14159265358979
  seed = 20040605
  bristles = 1800; mean = 15; cv = 0.4; kinetic = 0.35; load = 2; viscous = 60e-6 # N s/um
  s = sqrt(log(1 + cv * cv))
  for (i = 0; i < bristles; ++i) delta[i] = snap_length()
  print "# Sled on a surface, made by make_sled.awk, which says how."
  print "t[ms],x[um],load[N],force[mN]"
  for (k = 0; k <= 1200; ++k) {
    t = k / 100
    move = position(t) - x
    x += move
    e = move < 0 ? -1 : 1
    sum = 0
    for (i = 0; i < bristles; ++i) {
      along = e * z[i] + e * move
      while (along > delta[i]) {
        along -= delta[i]
        delta[i] = snap_length()
      }
      z[i] = e * along
      sum += z[i]
    }
    velocity = (position(t + 1e-4) - position(t - 1e-4)) / 2e-4
    force = kinetic * load * (sum / bristles) / (0.5 * mean * (1 + cv * cv)) + viscous * velocity
    force += 0.010 * gaussian() + 0.030 + 0.002 * (t - 6)
    printf "%d,%.1f,%g,%.1f\n", 10 * k, quantised(x, 0.5), load, 1000 * force
  }
}
