// Finds how slowly the swings of the force decay after all bristles began to slide together. How finely a
// path must be cut, and after what length a slide is steady, follow from it.
#pragma once

#include "bristle/snap_length.hpp"

namespace bristle::detail {

/// Decaying wave in the rate of snaps, exp(-decay x) cos(frequency x) over the path x, in inverse mean snap
/// lengths.
struct SlowWave {
  double decay, frequency;
};

/// Finds the most slowly decaying wave of the snap rate. Bristles that began to slide together snap in step
/// at first, and each then has a fresh length, so the rate obeys the renewal equation. Its waves are the
/// roots s = -decay + i frequency, s != 0, of p(s) = 1, where p is the Laplace transform of the density of
/// lengths. Without such a wave returns an infinite decay: then nothing lasts longer than the longest
/// bristles.
///
/// Searches wave lengths down to 1/24 of the mean length; under a law whose longest length is above 16 means,
/// only down to a longer one.
SlowWave find_slow_wave(const SnapLength& law);

/// Returns the longest piece into which a path may be cut, over the length allowed for a smooth law of spread
/// 0.25 or more; at most 1. Laws under which many bristles snap together need shorter pieces. Takes
/// milliseconds under a law given as a table.
double find_finest_piece(const SnapLength& law);

}  // namespace bristle::detail
