#include "tools/libraries/fitting/rebuilt_motion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "tools/libraries/files/user_error.hpp"

namespace cli {
namespace {

// Share of the forces' sum that may have the rarer sign in a motion that counts as one-way.
constexpr double beyond_most = 0.1;
// Relative tolerance of a stroke's duration: how much shorter it may be than stroke over speed, and how much
// longer before the excess counts as a rest.
constexpr double stroke_tolerance = 0.05;

bool goes_both_ways(const std::vector<double>& force) {
  double up = 0.0, down = 0.0;
  for (const double f : force) (f > 0.0 ? up : down) += std::fabs(f);
  return std::min(up, down) > beyond_most * (up + down);
}

/// Returns the force of a motion to and fro, scaled so that its two plateaus are at -1 and 1.
std::vector<double> between_plateaus(std::vector<double> force) {
  std::vector<double> sorted = force;
  std::sort(sorted.begin(), sorted.end());
  const std::size_t tail = sorted.size() / 50;
  const double low = sorted[tail], high = sorted[sorted.size() - 1 - tail];
  for (double& f : force) f = (2.0 * f - low - high) / (high - low);
  return force;
}

/// Crossings of the force from one plateau to the other, in a motion to and fro.
struct Crossings {
  std::vector<double> t;          // times at which the force is halfway between the plateaus, s
  std::vector<int> sign;          // signs of the plateaus that the force goes to
  std::optional<double> loading;  // time at which a record that begins unloaded first has half the force of a
                                  // plateau, s
};

Crossings find_crossings(const std::vector<double>& t, const std::vector<double>& force) {
  Crossings found;
  int side = 0;
  std::size_t last = 0;  // index of the last row whose force was on a plateau
  for (std::size_t i = 0; i < force.size(); ++i) {
    const int reached = force[i] > 0.5 ? 1 : force[i] < -0.5 ? -1 : 0;
    if (reached != 0 && reached != side) {
      if (side != 0) {
        // Fits a line through all rows between the plateaus, which averages their noise.
        const double n = static_cast<double>(i - last + 1);
        double time = 0.0, level = 0.0, square = 0.0, product = 0.0;
        for (std::size_t k = last; k <= i; ++k) {
          time += (t[k] - t[i]) / n;
          level += force[k] / n;
        }
        for (std::size_t k = last; k <= i; ++k) {
          square += (t[k] - t[i] - time) * (t[k] - t[i] - time);
          product += (t[k] - t[i] - time) * (force[k] - level);
        }
        found.t.push_back(t[i] + time - level * square / product);
        found.sign.push_back(reached);
      } else if (i > 0) {
        found.loading = t[i] - (t[i] - t[i - 1]) * (force[i] - 0.5 * reached) / (force[i] - force[i - 1]);
      }
      side = reached;
    }
    if (reached != 0) last = i;
  }
  return found;
}

/// Returns the time (s) from a turn of the motion to the crossing of the force. The force, averaged over
/// strokes, is level until the turn, then bends: a line followed by a parabola is fitted to find the turn.
double find_lag(const std::vector<double>& t, const std::vector<double>& force, const Crossings& crossings) {
  // Times from half of the old plateau to the crossing, one per stroke; `rise` becomes their median.
  std::vector<double> rises;
  for (std::size_t k = 0; k < crossings.t.size(); ++k) {
    std::size_t i =
        static_cast<std::size_t>(std::lower_bound(t.begin(), t.end(), crossings.t[k]) - t.begin());
    while (i > 0 && force[i] * crossings.sign[k] > -0.5) --i;
    rises.push_back(crossings.t[k] - t[i]);
  }
  std::nth_element(rises.begin(), rises.begin() + static_cast<std::ptrdiff_t>(rises.size() / 2), rises.end());
  const double rise = rises[rises.size() / 2];

  std::vector<std::pair<double, double>> near;  // for all strokes: time after the crossing over `rise`, and
                                                // scaled force
  for (std::size_t k = 0; k < crossings.t.size(); ++k) {
    const double from = crossings.t[k] - 6.0 * rise, to = crossings.t[k] + 0.2 * rise;
    for (auto i = std::lower_bound(t.begin(), t.end(), from); i != t.end() && *i < to; ++i)
      near.emplace_back((*i - crossings.t[k]) / rise,
                        force[static_cast<std::size_t>(i - t.begin())] * crossings.sign[k]);
  }
  double best = 0.0, least = std::numeric_limits<double>::infinity();
  for (double turn = -5.0; turn < -1.0; turn += 0.01) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Identity() * 1e-12;
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    double squares = 0.0;
    for (const auto& [after, f] : near) {
      const double bent = std::max(after - turn, 0.0);
      const Eigen::Vector3d row(1.0, bent, bent * bent);
      normal += row * row.transpose();
      right += f * row;
      squares += f * f;
    }
    const double left = squares - right.dot(normal.ldlt().solve(right));
    if (left < least) {
      least = left;
      best = turn;
    }
  }
  return -best * rise;
}

/// Interpolates values, given at the times `t`, linearly at the times `at`. An empty column stays empty.
std::vector<double> interpolated(const std::vector<double>& t, const std::vector<double>& values,
                                 const std::vector<double>& at) {
  std::vector<double> result;
  std::size_t i = 1;
  for (const double time : at) {
    if (values.empty()) break;
    while (i + 1 < t.size() && t[i] < time) ++i;
    result.push_back(values[i - 1] + (values[i] - values[i - 1]) * (time - t[i - 1]) / (t[i] - t[i - 1]));
  }
  return result;
}

std::string in_mm(double length) { return fmt::format("{:.4g} mm", 1e3 * length); }

}  // namespace

void rebuild_slide(FitColumns& data, double speed) {
  for (const double t : data.t) data.x.push_back(speed * (t - data.t.front()));
  data.v.assign(data.t.size(), speed);
  if (goes_both_ways(data.force))
    throw UserError(data.name +
                    ": the force has both signs, and --speed alone is of a motion one way: give "
                    "--stroke, the length of strokes to and fro, or a column x or v");
  data.understood.push_back(
      fmt::format("position rebuilt from a speed of {:.4g} mm/s, one way", 1e3 * speed));
}

void rebuild_strokes(FitColumns& data, double speed, double stroke) {
  const std::vector<double> force = between_plateaus(data.force);
  const Crossings crossings = find_crossings(data.t, force);
  if (!goes_both_ways(data.force) || crossings.t.size() < 2)
    throw UserError(data.name + ": the force does not turn twice, and --stroke is of strokes to and fro");
  const double fast = std::fabs(speed), takes = stroke / fast;
  std::vector<double> lasts;
  for (std::size_t k = 1; k < crossings.t.size(); ++k) lasts.push_back(crossings.t[k] - crossings.t[k - 1]);
  std::sort(lasts.begin(), lasts.end());
  if (lasts.front() < (1.0 - stroke_tolerance) * takes || lasts[lasts.size() / 2] > 2.0 * takes)
    throw UserError(
        fmt::format("{}: the force turns after {:.4g} to {:.4g} s, and --stroke {} at --speed {}/s takes "
                    "{:.4g} s (a rest at its end may take as long again)",
                    data.name, lasts.front(), lasts.back(), in_mm(stroke), in_mm(fast), takes));

  // Times at which strokes start, and how long each moves (s). A record that begins within a stroke moves
  // from its first row.
  const double lag = find_lag(data.t, force, crossings);
  std::vector<double> starts{crossings.loading ? *crossings.loading - 0.5 * lag : data.t.front()}, moves;
  for (const double t : crossings.t) starts.push_back(t - lag);
  for (std::size_t k = 0; k < starts.size(); ++k) {
    const double until = (k + 1 < starts.size() ? starts[k + 1] : data.t.back()) - starts[k];
    moves.push_back(until > (1.0 + stroke_tolerance) * takes ? takes : std::max(until, 0.0));
  }
  std::size_t k = 0, rested = 0;
  double place = 0.0, velocity = speed;
  for (const double t : data.t) {
    for (; k + 1 < starts.size() && t >= starts[k + 1]; ++k, velocity = -velocity) {
      place += velocity * moves[k];
      data.turns.push_back({place, 0.0, false, starts[k] + moves[k]});
    }
    const double since = t - starts[k];
    const bool rests = since < 0.0 || since > moves[k];
    rested += rests ? 1 : 0;
    data.x.push_back(place + velocity * std::clamp(since, 0.0, moves[k]));
    data.v.push_back(rests ? 0.0 : velocity);
  }
  data.understood.push_back(
      fmt::format("position rebuilt from strokes of {} at {}/s: {} turns, each {:.3g} s before the force "
                  "changes its sign; at rest in {:.0f} % of the rows",
                  in_mm(stroke), in_mm(fast), crossings.t.size(), lag,
                  100.0 * static_cast<double>(rested) / static_cast<double>(data.t.size())));
}

void merge_motion(FitColumns& data, const FitColumns& motion, double clock) {
  if (motion.planar()) throw UserError(motion.name + ": --position: a record in the plane is one file");
  std::vector<double> t = motion.t;
  for (double& time : t) time += clock;
  if (data.t.empty()) throw UserError(data.name + ": no data rows");
  if (t.size() < 2)
    throw UserError(fmt::format("{}: data rows: {}; --position needs two or more", motion.name, t.size()));
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < data.t.size(); ++i)
    if (data.t[i] >= t.front() && data.t[i] <= t.back()) kept.push_back(i);
  if (kept.empty())
    throw UserError(
        fmt::format("{}: its rows, from {:.6g} to {:.6g} s, and those of {}, from {:.6g} to {:.6g} s, have "
                    "no time in common; --clock SECONDS is added to the latter",
                    data.name, data.t.front(), data.t.back(), motion.name, t.front(), t.back()));
  const std::size_t left_out = data.t.size() - kept.size();
  const auto keep = [&](std::vector<double>& column) {
    for (std::size_t i = 0; i < kept.size() && !column.empty(); ++i) column[i] = column[kept[i]];
    if (!column.empty()) column.resize(kept.size());
  };
  for (std::vector<double>* const column : {&data.t, &data.load, &data.force}) keep(*column);
  for (WrittenColumn& column : data.written) keep(column.values);

  std::vector<double> x = motion.x;
  double noise = 0.0;
  if (motion.has_x) {
    x = smoothed_positions(motion, motion.x, data.quantum);
    noise = position_noise(x, 0.2 * data.quantum);
  }
  std::vector<double> times, places;  // times (s) and positions (m) of the motion's rows and turning points
  for (const PathPoint& point : make_path(t, x, std::vector<double>(t.size()), noise)) {
    times.push_back(point.t);
    places.push_back(point.x);
  }
  data.x = interpolated(times, places, data.t);
  data.v = interpolated(t, motion.v, data.t);
  if (!data.has_load) data.load = interpolated(t, motion.load, data.t);
  data.has_load = data.has_load || motion.has_load;
  data.has_x = motion.has_x;
  data.disc = data.disc || motion.disc;
  data.written.push_back({motion.written[1].header, interpolated(t, motion.written[1].values, data.t)});
  // Keeps as turning points those positions of the motion that lie beyond the rows around them.
  std::size_t k = 0;
  for (std::size_t i = 1; i < data.t.size(); ++i) {
    const auto [least, most] = std::minmax(data.x[i - 1], data.x[i]);
    while (times[k] <= data.t[i - 1]) ++k;
    std::size_t low = k, high = k;
    for (; times[k] < data.t[i]; ++k) {
      if (places[k] < places[low]) low = k;
      if (places[k] > places[high]) high = k;
    }
    for (const std::size_t turn : {std::min(low, high), std::max(low, high)})
      if (turn < k && (places[turn] < least - 4.0 * noise || places[turn] > most + 4.0 * noise))
        data.turns.push_back({places[turn], 0.0, false, times[turn]});
  }
  data.understood.push_back(fmt::format("motion of {}: {}", motion.name, motion.understood.front()));
  data.understood.push_back(fmt::format(
      "{} rows of the motion from {:.6g} to {:.6g} s, interpolated to the rows of the force{}", t.size(),
      t.front(), t.back(),
      left_out > 0 ? fmt::format(", of which {} outside of these times are left out", left_out) : ""));
}

}  // namespace cli
