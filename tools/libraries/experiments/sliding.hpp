// Slides a friction model straight at constant speed, in steps of a given length.
#pragma once

#include <algorithm>
#include <cmath>

#include "tools/libraries/experiments/subject.hpp"

namespace cli {

/// Slides a friction model by `path` m at `speed` m/s, in steps of about `step` m. Calls look(x, friction)
/// after each step with the distance so far (m) and the friction at the step's end (N, > 0: resists). Returns
/// the mean friction over the last quarter.
template <class Look>
double slide(Subject& subject, double path, double speed, double step, double load, const Look& look) {
  const long steps = std::max(4L, std::lround(path / step));
  const double each = path / static_cast<double>(steps);
  double sum = 0.0;
  for (long k = 1; k <= steps; ++k) {
    const rivals::Force f = subject.step({each, 0.0}, each / speed, load);
    if (k > steps - steps / 4) sum -= f.mean.x;
    look(each * static_cast<double>(k), -f.end.x);
  }
  return sum / static_cast<double>(steps / 4);
}

inline double slide(Subject& subject, double path, double speed, double step, double load) {
  return slide(subject, path, speed, step, load, [](double, double) {});
}

}  // namespace cli
