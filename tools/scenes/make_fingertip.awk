# Makes fingertip.csv: ten seconds of a hand-held tip on a surface, as a 1 kHz haptic device would read it.
#   awk -f make_fingertip.awk > fingertip.csv
# Minimum-jerk strokes (Flash and Hogan 1985) of 10 to 60 mm at up to 150 mm/s, in changing directions and with
# pauses; physiological tremor, 8 to 12 Hz, 50 um rms along each axis; positions quantised to 30 um, as an encoder
# does; load 0.3 to 2.5 N, pressed by hand (slow changes, noise, two lift-offs). Own random numbers, so that any
# awk makes the same motion.

function random() {  # Returns a uniform number on [0, 1) (Park and Miller).
  seed = (seed * 16807) % 2147483647
  return seed / 2147483647
}
function gaussian(  sum, i) {
  sum = 0
  for (i = 0; i < 12; ++i) sum += random()
  return sum - 6
}
function minimum_jerk(s) { return s <= 0 ? 0 : s >= 1 ? 1 : s * s * s * (10 + s * (6 * s - 15)) }
function quantised(value, quantum,  n) {
  n = value / quantum
  return quantum * int(n < 0 ? n - 0.5 : n + 0.5)
}

BEGIN {
  pi = 3.14159265358979
  seed = 20040605
  length_ms = 10000

  # Makes the strokes: start (ms), duration, displacement (um). The mean speed of a stroke is 8/15 of its peak.
  t = 400
  strokes = 0
  while (t < length_ms - 700) {
    mm = 10 + 50 * random()
    peak = 60 + 90 * random()              # mm/s
    duration = 1000 * mm / (peak * 8 / 15) # ms
    if (t + duration > length_ms - 300) break
    # Turns back towards the middle of the work space, within 60 degrees.
    angle = atan2(-end_y, -end_x) + (random() - 0.5) * 2 * pi / 3
    start[strokes] = t; span[strokes] = duration
    move_x[strokes] = 1000 * mm * cos(angle); move_y[strokes] = 1000 * mm * sin(angle)
    end_x += move_x[strokes]; end_y += move_y[strokes]
    strokes++
    t += duration + (random() < 0.3 ? 250 : 40) + 120 * random()
  }

  # Adds tremor: white noise through a resonance at 10 Hz (damping ratio 0.15), scaled to 50 um rms.
  w = 2 * pi * 10 / 1000; damping = 0.15
  for (axis = 0; axis < 2; ++axis) {
    p = v = square = 0
    for (k = -1000; k <= length_ms; ++k) {
      v += -w * w * p - 2 * damping * w * v + gaussian()
      p += v
      if (k >= 0) { tremor[axis, k] = p; square += p * p }
    }
    scale[axis] = 50 / sqrt(square / (length_ms + 1))
  }

  print "# Hand-held tip on a surface; made by make_fingertip.awk, which says how."
  print "t[ms],x[um],y[um],load[mN]"
  slow = noise = 0
  for (k = 0; k <= length_ms; ++k) {
    x = y = 0
    for (i = 0; i < strokes; ++i) {
      share = minimum_jerk((k - start[i]) / span[i])
      x += share * move_x[i]; y += share * move_y[i]
    }
    x += scale[0] * tremor[0, k]; y += scale[1] * tremor[1, k]

    # Adds the load: grip wanders over a second, muscle noise over 20 ms; lifted at 3.6 s and at 7.3 s.
    slow += (gaussian() * 25 - slow) * 0.0015
    noise += (gaussian() * 160 - noise) * 0.05
    load = 1250 + 500 * sin(2 * pi * k / 2700) + 300 * sin(2 * pi * k / 1130 + 1) + 250 * slow + noise
    if (load < 300) load = 300
    if (load > 2500) load = 2500
    if (k > 3600 && k < 3780) load *= lifted(k, 3600, 3780)
    if (k > 7300 && k < 7650) load *= lifted(k, 7300, 7650)
    printf "%d,%d,%d,%d\n", k, quantised(x, 30), quantised(y, 30), load
  }
}

# Falls from 1 to 0 in 30 ms, stays 0, and rises from 0 to 1 in 30 ms.
function lifted(k, from, until) {
  if (k < from + 30) return 1 - minimum_jerk((k - from) / 30)
  if (k > until - 30) return minimum_jerk((k - until + 30) / 30)
  return 0
}
