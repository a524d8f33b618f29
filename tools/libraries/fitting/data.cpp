#include "tools/libraries/fitting/data.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <fmt/format.h>
#include <Eigen/Cholesky>

#include "tools/libraries/files/user_error.hpp"

namespace cli {
namespace {

constexpr std::size_t fewest_samples = 20;
// Least share of the travel that goes in the less travelled direction, from which on a motion counts as to
// and fro.
constexpr double to_and_fro = 0.1;
// Relative deviation of the normal load up to which the fit takes it as constant.
constexpr double steady_load_deviation = 0.02;

[[noreturn]] void refuse(const FitColumns& data, const std::string& why) {
  throw UserError(fmt::format("{}: {}", data.name, why));
}

/// Returns the differences of successive values. Leaves out the difference from the last row of a file to the
/// first row of the next, which is no motion.
std::vector<double> differences(const FitColumns& c, const std::vector<double>& values) {
  std::vector<double> result;
  for (std::size_t i = 1; i < values.size(); ++i)
    if (c.follows(i)) result.push_back(values[i] - values[i - 1]);
  return result;
}

/// Calls take(begin, end) with the range of samples of each of the files from which the record was joined.
template <class Take>
void for_parts(const FitColumns& c, Take&& take) {
  std::size_t begin = 0;
  for (const std::size_t end : c.parts) {
    take(begin, end);
    begin = end;
  }
  take(begin, c.t.size());
}

std::vector<double> slice(const std::vector<double>& values, std::size_t begin, std::size_t end) {
  return {values.begin() + static_cast<std::ptrdiff_t>(begin),
          values.begin() + static_cast<std::ptrdiff_t>(end)};
}

void append(std::vector<double>& to, const std::vector<double>& more) {
  to.insert(to.end(), more.begin(), more.end());
}

// ------------------------------------------------------------------- functions on measured positions

/// Returns whether the position moves by equal amounts from sample to sample over long stretches, as a
/// programmed stage does. Measured by an encoder, the amounts would change at every other sample by whole
/// counts.
bool runs_evenly(const std::vector<double>& moves, double smallest) {
  std::size_t changes = 0, moving = 0;
  for (std::size_t i = 1; i < moves.size(); ++i) {
    if (moves[i] == 0.0 && moves[i - 1] == 0.0) continue;
    ++moving;
    changes += std::fabs(moves[i] - moves[i - 1]) > 0.5 * smallest ? 1 : 0;
  }
  return 10 * changes < moving;
}

/// Returns the error with which the file's digits round a move between two samples: the least difference
/// between moves of unequal size.
double coarseness(std::vector<double> moves, double smallest) {
  for (double& d : moves) d = std::fabs(d);
  std::sort(moves.begin(), moves.end());
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < moves.size(); ++i) {
    const double step = moves[i] - moves[i - 1];
    if (step > 1e-3 * smallest) least = std::min(least, step);
  }
  return least;
}

struct Encoder {
  double quantum = 0.0;  // length of an encoder's count, m; 0: none found
  bool rounded = false;  // whether the file's digits are too few for the count
};

/// Detects an encoder from positions: every move is a whole multiple of one count (up to the rounding of the
/// file), and many samples repeat the one before.
Encoder find_encoder(const FitColumns& c, const std::vector<double>& x) {
  const double range = *std::max_element(x.begin(), x.end()) - *std::min_element(x.begin(), x.end());
  const std::vector<double> moves = differences(c, x);
  std::vector<double> sizes;
  for (const double d : moves)
    if (std::fabs(d) > 1e-12 * range) sizes.push_back(std::fabs(d));
  if (sizes.empty()) return {};
  std::sort(sizes.begin(), sizes.end());
  const double smallest = sizes.front(), digits = coarseness(moves, smallest);
  if (runs_evenly(moves, smallest)) return {};
  const std::size_t repeats = moves.size() - sizes.size();
  if (repeats * 50 <= moves.size()) return {};
  // Refines the length of an encoder's count, from the smallest moves on. A larger move is a whole multiple
  // of the count; the more moves have been used, the surer it is which multiple.
  const bool many = sizes.size() >= 50;  // many moves are not all near whole counts by chance
  const double slack = many && digits < 0.4 * smallest ? 1.05 * digits : 0.0;
  double sum = 0.0, counts = 0.0, quantum = smallest;
  Encoder encoder;
  for (const double d : sizes) {
    const double count = std::round(d / quantum), off = std::fabs(d - count * quantum);
    const bool exact = off <= 0.05 * count * quantum;
    if (!exact && off > slack) return {};
    encoder.rounded = encoder.rounded || !exact;
    sum += d;
    counts += count;
    quantum = sum / counts;
  }
  encoder.quantum = quantum;
  return encoder;
}

/// Restores the positions of an encoder from a file that rounded them: fits a line from counts to positions,
/// and puts each position on its whole count.
std::vector<double> whole_counts(const std::vector<double>& x, double& quantum) {
  const double first = x.front(), n = static_cast<double>(x.size());
  std::vector<double> counts(x.size(), 0.0);
  double sum = 0.0, squares = 0.0, positions = 0.0, products = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (i > 0) counts[i] = counts[i - 1] + std::round((x[i] - x[i - 1]) / quantum);
    sum += counts[i];
    squares += counts[i] * counts[i];
    positions += x[i] - first;
    products += counts[i] * (x[i] - first);
  }
  quantum = (products - sum * positions / n) / (squares - sum * sum / n);
  const double zero = first + (positions - quantum * sum) / n;
  for (double& count : counts) count = zero + quantum * count;
  return counts;
}

/// Smooths the staircase of an encoder where the body moves by single counts: puts positions on the line
/// between the middles of the steps, at most half a count away. Rests and reversals stay; a step that lasts
/// much longer than its neighbours is a rest.
std::vector<double> smooth_creep(const std::vector<double>& t, const std::vector<double>& x, double quantum) {
  constexpr double rest = 4.0;
  std::vector<double> smooth = x;
  const std::size_t n = x.size();
  std::size_t last = 0;  // number of samples that showed the previous count
  for (std::size_t begin = 0; begin < n;) {
    std::size_t end = begin + 1, next = begin;
    while (end < n && x[end] == x[begin]) ++end;
    for (next = end; next < n && x[next] == x[end];) ++next;
    const auto of_neighbours = static_cast<double>(std::max(last, next - end));
    const bool rests = static_cast<double>(end - begin) > rest * std::max(of_neighbours, 1.0);
    last = end - begin;
    if (begin > 0 && end < n && !rests) {
      const double before = (x[begin] - x[begin - 1]) / quantum, after = (x[end] - x[begin]) / quantum;
      if (std::fabs(std::fabs(before) - 1.0) < 0.1 && std::fabs(after - before) < 0.1) {
        const double enters = 0.5 * (t[begin - 1] + t[begin]), leaves = 0.5 * (t[end - 1] + t[end]);
        for (std::size_t i = begin; i < end; ++i)
          smooth[i] = x[i] + before * quantum * ((t[i] - enters) / (leaves - enters) - 0.5);
      }
    }
    begin = end;
  }
  return smooth;
}

}  // namespace

double quantile_of(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

double root_mean_square(const std::vector<double>& values) {
  double squares = 0.0;
  for (const double value : values) squares += value * value;
  return std::sqrt(squares / static_cast<double>(values.size()));
}

double noise_of(const std::vector<double>& x) {
  std::vector<double> fourth;
  for (std::size_t i = 4; i < x.size(); ++i)
    fourth.push_back(std::fabs(x[i] - 4.0 * x[i - 1] + 6.0 * x[i - 2] - 4.0 * x[i - 3] + x[i - 4]));
  // Converts the median to the standard deviation of the noise. The median of the magnitude of normal noise
  // is 0.6745 standard deviations, and a fourth difference has sqrt(70) times the deviation of one value.
  return quantile_of(fourth, 0.5) / (0.6745 * std::sqrt(70.0));
}

std::vector<double> smoothed_positions(const FitColumns& c, const std::vector<double>& x, double& quantum) {
  const Encoder encoder = find_encoder(c, x);
  quantum = encoder.quantum;
  const std::vector<double> seen = encoder.rounded ? whole_counts(x, quantum) : x;
  if (quantum == 0.0) return seen;
  std::vector<double> smooth;
  for_parts(c, [&](std::size_t begin, std::size_t end) {
    append(smooth, smooth_creep(slice(c.t, begin, end), slice(seen, begin, end), quantum));
  });
  return smooth;
}

namespace {

/// Finds velocities by differences of positions. Each difference spans so many samples that the motion in it
/// exceeds the noise of a position.
std::vector<double> find_velocity(const std::vector<double>& t, const std::vector<double>& x, double noise) {
  constexpr std::size_t widest = 25;
  // Least number of equal samples on either side that makes a rest. Fewer may only be a late count of an
  // encoder.
  constexpr std::size_t rest_window = 6;
  const std::size_t n = t.size();
  std::vector<double> velocity(n);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t w = 1; w <= widest; ++w) {
      const std::size_t a = i > w ? i - w : 0, b = std::min(i + w, n - 1);
      velocity[i] = (x[b] - x[a]) / (t[b] - t[a]);
      // Sets the velocity to zero during rests, up to the samples at which motion stops and starts: the
      // position moves there by noise alone.
      const auto moved = [&](std::size_t by) {
        return std::fabs(x[std::min(i + by, n - 1)] - x[i > by ? i - by : 0]);
      };
      const bool far = moved(w) > 20.0 * noise;
      if ((far || w == widest) && w >= rest_window && moved(w / 2) <= 3.0 * noise) velocity[i] = 0.0;
      if (far) break;
    }
  }
  return velocity;
}

int count_reversals(const std::vector<double>& x, double slack) {
  int reversals = 0, direction = 0;
  double extreme = x.front();
  for (const double position : x) {
    if (direction == 0) {
      if (std::fabs(position - extreme) > slack) direction = position > extreme ? 1 : -1;
      if (direction) extreme = position;
    } else if (direction * (position - extreme) >= 0.0) {
      extreme = position;
    } else if (std::fabs(position - extreme) > slack) {
      direction = -direction;
      ++reversals;
      extreme = position;
    }
  }
  return reversals;
}

/// Returns whether the motion reverses at sample i like a parabola, slower before and faster after the
/// reversal. A stage that reverses suddenly does not; it reverses at the sample, or at an unknown point
/// between two samples.
bool reverses_smoothly(const std::vector<double>& x, std::size_t i) {
  if (i < 2 || i + 2 >= x.size()) return false;
  const double before = x[i - 1] - x[i - 2], a = x[i] - x[i - 1], b = x[i + 1] - x[i],
               after = x[i + 2] - x[i + 1];
  const double bend = 0.25 * (a - b);
  return (before - a) * (bend > 0.0 ? 1.0 : -1.0) > std::fabs(bend) &&
         (b - after) * (bend > 0.0 ? 1.0 : -1.0) > std::fabs(bend);
}

}  // namespace

std::vector<PathPoint> make_path(const std::vector<double>& t, const std::vector<double>& x,
                                 const std::vector<double>& load, double noise) {
  std::vector<PathPoint> path;
  for (std::size_t i = 0; i < x.size(); ++i) {
    PathPoint reversal{0.0, load[i], false, t[i]};
    double position = 0.0;  // point of reversal, in sampling intervals after this sample
    if (i > 0 && i + 1 < x.size()) {
      const double a = x[i] - x[i - 1], b = x[i + 1] - x[i];
      const double even = (t[i] - t[i - 1]) / (t[i + 1] - t[i]);
      if (a * b < 0.0 && std::min(std::fabs(a), std::fabs(b)) > 4.0 * noise && even > 0.8 && even < 1.25 &&
          reverses_smoothly(x, i)) {
        position = 0.5 * (a + b) / (a - b);
        reversal.x = x[i] + 0.25 * (a + b) * position;
        reversal.t = t[i] + position * (position > 0.0 ? t[i + 1] - t[i] : t[i] - t[i - 1]);
      }
    }
    if (position < 0.0) path.push_back(reversal);
    path.push_back({x[i], load[i], true, t[i]});
    if (position > 0.0) path.push_back(reversal);
  }
  return path;
}

namespace {

/// Makes the path of a motion in the plane, from the samples alone. Extra reversals, as on one axis, are
/// not needed: a smooth motion in the plane does not reverse.
std::vector<PathPoint> make_planar_path(const std::vector<double>& t, const std::vector<double>& x,
                                        const std::vector<double>& y, const std::vector<double>& load) {
  std::vector<PathPoint> path;
  for (std::size_t i = 0; i < x.size(); ++i) path.push_back({x[i], load[i], true, t[i], y[i]});
  return path;
}

// ----------------------------------------------------- functions on the measured force and its sign

/// Returns the share of the travelled distance that lies in the less travelled direction.
double share_back(const FitColumns& c, const std::vector<double>& x) {
  double forth = 0.0, back = 0.0;
  for (const double move : differences(c, x)) (move > 0.0 ? forth : back) += std::fabs(move);
  return std::min(forth, back) / std::max(forth + back, 1e-300);
}

/// Measured positions x (m) and forces f (N) along one of the two axes.
struct Axis {
  const std::vector<double>&x, &f;
};
std::vector<Axis> axes_of(const FitColumns& c) {
  if (c.planar()) return {{c.x, c.force}, {c.y, c.force_y}};
  return {{c.x, c.force}};
}

/// Returns the correlation of force and motion, from -1 to 1, by which the sign of the force is recognised:
/// the force's work over the largest possible. In a motion to and fro the mean force is subtracted first, so
/// that an offset of the sensor does no work. In a slide with few samples backwards it stays, because
/// friction has one sign there.
double relative_work(const FitColumns& c) {
  double work = 0.0, most = 0.0;
  for (const auto& [x, f] : axes_of(c)) {
    const double middle =
        share_back(c, x) > to_and_fro ? 0.5 * (quantile_of(f, 0.02) + quantile_of(f, 0.98)) : 0.0;
    for (std::size_t i = 1; i < x.size(); ++i) {
      if (!c.follows(i)) continue;
      const double w = (0.5 * (f[i] + f[i - 1]) - middle) * (x[i] - x[i - 1]);
      work += w;
      most += std::fabs(w);
    }
  }
  return most > 0.0 ? work / most : 0.0;
}

/// Returns the correlation of force and displacement, by which the sign of the force is recognised in motions
/// too small to slide.
double relative_stiffness(const FitColumns& c) {
  double xf = 0.0, xx = 0.0, ff = 0.0;
  for (const auto& [x, f] : axes_of(c)) {
    const double n = static_cast<double>(x.size());
    const double mx = std::accumulate(x.begin(), x.end(), 0.0) / n,
                 mf = std::accumulate(f.begin(), f.end(), 0.0) / n;
    for (std::size_t i = 0; i < x.size(); ++i) {
      xf += (x[i] - mx) * (f[i] - mf);
      xx += (x[i] - mx) * (x[i] - mx);
      ff += (f[i] - mf) * (f[i] - mf);
    }
  }
  return xf / std::sqrt(xx * ff);
}

void settle_sign(FitData& data, ForceSign sign) {
  const double work = relative_work(data.columns);
  double direction = std::fabs(work) > 0.15 ? work : relative_stiffness(data.columns);
  if (std::fabs(direction) < 0.15)
    refuse(data.columns,
           fmt::format("the force does not go with the motion (its work is {:.0f} % of what a force that "
                       "always opposes it would do): this is no friction of x",
                       100.0 * std::fabs(work)));
  const ForceSign found = direction > 0.0 ? ForceSign::by_body : ForceSign::on_body;
  data.sign_found = sign == ForceSign::automatic;
  if (!data.sign_found && sign != found) {
    refuse(
        data.columns,
        fmt::format("the friction has the wrong sign: {}; leave the sign to be found, or give --sign {}",
                    found == ForceSign::by_body ? "as a force on the body it would drive the motion"
                                                : "as a force by the body it would point against its motion",
                    found == ForceSign::by_body ? "by" : "on"));
  }
  data.sign = found;
  data.force = data.columns.force;
  data.force.insert(data.force.end(), data.columns.force_y.begin(), data.columns.force_y.end());
  if (found == ForceSign::on_body) {
    for (double& f : data.force) f = -f;
  }
}

// --------------------------------------------------------------------- functions on the normal load

void settle_load(FitData& data, std::optional<double> given) {
  const FitColumns& c = data.columns;
  if (!given && !c.has_load) refuse(c, "no column load; add one, or give the load in N (--load)");
  data.load = given ? std::vector<double>(c.t.size(), *given) : c.load;
  double sum = 0.0, squares = 0.0;
  for (const double load : data.load) sum += load;
  data.mean_load = sum / static_cast<double>(data.load.size());
  if (data.mean_load == 0.0) refuse(c, "the load is 0 throughout: no contact, no friction");
  for (const double load : data.load) squares += (load - data.mean_load) * (load - data.mean_load);
  const double deviation = std::sqrt(squares / static_cast<double>(data.load.size()));
  const bool lifted = *std::min_element(data.load.begin(), data.load.end()) < 0.5 * data.mean_load;
  data.steady_load = !lifted && deviation < steady_load_deviation * data.mean_load;
  if (data.steady_load) data.load.assign(data.load.size(), data.mean_load);
}

void refuse_hopeless(const FitColumns& c) {
  if (c.t.size() < fewest_samples)
    refuse(c, fmt::format("{} data rows; a fit needs at least {}", c.t.size(), fewest_samples));
  const auto [low, high] = std::minmax_element(c.x.begin(), c.x.end());
  if (*low == *high && !c.planar()) refuse(c, "no motion: the position never changes");
  const auto [least, most] = std::minmax_element(c.force.begin(), c.force.end());
  if (*least == *most && !c.planar())
    refuse(c, fmt::format("the force is constant ({} N in every row): no friction was measured", *least));
}

/// Extreme points of the path between two samples that stay when a record is thinned; the fit needs them
/// because friction reverses there. On one axis they are the highest and the lowest point, if they lie beyond
/// both samples; in the plane, the point farthest from the line between the samples.
class Between {
 public:
  void add(const PathPoint& point) {
    passed_.push_back(point);
    passed_.back().wanted = false;
  }
  /// Appends to the path the extreme points since the last sample, then the sample `end`; starts the next
  /// stretch.
  void close(double slack, const PathPoint& end, unsigned axes, std::vector<PathPoint>& path) {
    const PathPoint from = path.empty() ? end : path.back();
    if (axes == 1)
      put_reversals(slack, from, end, path);
    else
      put_corner(slack, from, end, path);
    path.push_back(end);
    passed_.clear();
  }

 private:
  void put_reversals(double slack, const PathPoint& from, const PathPoint& end,
                     std::vector<PathPoint>& path) const {
    if (passed_.empty()) return;
    const auto [low, high] = std::minmax_element(passed_.begin(), passed_.end(),
                                                 [](const auto& a, const auto& b) { return a.x < b.x; });
    const bool up = high->x > std::max(from.x, end.x) + slack,
               down = low->x < std::min(from.x, end.x) - slack;
    if (up && high < low) path.push_back(*high);
    if (down) path.push_back(*low);
    if (up && !(high < low)) path.push_back(*high);
  }
  void put_corner(double slack, const PathPoint& from, const PathPoint& end,
                  std::vector<PathPoint>& path) const {
    const double dx = end.x - from.x, dy = end.y - from.y, square = std::max(dx * dx + dy * dy, 1e-300);
    double farthest = slack;
    const PathPoint* corner = nullptr;
    for (const PathPoint& p : passed_) {
      const double along = std::clamp(((p.x - from.x) * dx + (p.y - from.y) * dy) / square, 0.0, 1.0);
      const double away = std::hypot(p.x - from.x - along * dx, p.y - from.y - along * dy);
      if (away > farthest) {
        farthest = away;
        corner = &p;
      }
    }
    if (corner) path.push_back(*corner);
  }

  std::vector<PathPoint> passed_;
};

}  // namespace

namespace {

/// Copies the samples with the indices `stay`, in order, from every column of `data` to `part`.
void take_columns(const FitData& data, const std::vector<std::size_t>& stay, FitData& part) {
  const std::size_t n = data.samples();
  const auto take = [&](const std::vector<double>& from, std::vector<double>& to) {
    to.clear();
    for (std::size_t begin = 0; begin < from.size(); begin += n)
      for (const std::size_t i : stay) to.push_back(from[begin + i]);
  };
  take(data.columns.t, part.columns.t);
  take(data.columns.x, part.columns.x);
  take(data.columns.y, part.columns.y);
  take(data.columns.v, part.columns.v);
  take(data.columns.load, part.columns.load);
  take(data.columns.force, part.columns.force);
  take(data.columns.force_y, part.columns.force_y);
  for (std::size_t& begin : part.columns.parts)
    begin = static_cast<std::size_t>(std::lower_bound(stay.begin(), stay.end(), begin) - stay.begin());
  take(data.force, part.force);
  take(data.load, part.load);
  take(data.velocity, part.velocity);
}

/// Returns a record that has only the samples with the indices `stay`, in order, and the reversals of
/// the motion between them.
FitData taken(const FitData& data, const std::vector<std::size_t>& stay) {
  const std::size_t n = data.samples();
  FitData part = data;
  part.path.clear();
  Between between;
  std::size_t sample = 0, next = 0;
  const double slack = stay.size() < n ? 4.0 * data.position_noise : 0.0;
  for (const PathPoint& point : data.path) {
    const std::size_t i = sample;
    if (point.wanted) ++sample;
    if (!point.wanted || next == stay.size() || i != stay[next]) {
      between.add(point);
      continue;
    }
    between.close(slack, point, data.axes, part.path);
    ++next;
  }
  take_columns(data, stay, part);
  return part;
}

/// Returns the distance (m) up to which a change of the measured position is noise, so that the body counts
/// as resting.
double rest_slack(const FitData& data) {
  return std::max(4.0 * std::min(data.position_noise, 1e-3 * data.range), 1e-5 * data.range);
}

}  // namespace

std::vector<double> positions_of(const FitData& data) {
  std::vector<double> x;
  for (const PathPoint& point : data.path)
    if (point.wanted) x.push_back(point.x);
  return x;
}

FitData thinned(const FitData& data, std::size_t most) {
  const std::size_t n = data.samples(), every = (n + most - 1) / most;
  if (every <= 1) return data;
  std::vector<std::size_t> stay;
  for (std::size_t i = 0; i < n; ++i)
    if (i % every == 0 || std::binary_search(data.columns.parts.begin(), data.columns.parts.end(), i))
      stay.push_back(i);
  return taken(data, stay);
}

FitData without_rests(const FitData& data) {
  constexpr std::size_t shortest = 50;  // number of samples of the shortest rest that is thinned out
  const std::size_t n = data.samples();
  const double slack = rest_slack(data);
  std::vector<PathPoint> positions;
  for (const PathPoint& point : data.path)
    if (point.wanted) positions.push_back(point);
  std::vector<std::size_t> stay;
  for (std::size_t begin = 0; begin < n;) {
    std::size_t end = begin + 1;
    while (end < n &&
           std::hypot(positions[end].x - positions[begin].x, positions[end].y - positions[begin].y) <=
               slack &&
           data.load[end] == data.load[begin] && data.columns.follows(end))
      ++end;
    const bool rests = end - begin >= shortest;
    for (std::size_t i = begin, step = 1; i < end; i += step) {
      stay.push_back(i);
      if (rests) step = 1 + (i - begin) / 4;
    }
    if (stay.back() != end - 1) stay.push_back(end - 1);
    begin = end;
  }
  return stay.size() == n ? data : taken(data, stay);
}

FitData with_samples(const FitData& data, const std::vector<std::size_t>& stay) {
  FitData part = data;
  std::size_t next = 0;
  for (PathPoint& point : part.path)
    if (point.wanted) point.wanted = std::binary_search(stay.begin(), stay.end(), next++);
  take_columns(data, stay, part);
  return part;
}

namespace {

/// Returns the ratio of fast to slow speeds in a record. Slow is a speed below which a fifth lies, fast one
/// above which a fifth lies, so that brief reversals do not count. Takes fifths of the samples and of the
/// distance, and returns the larger ratio, because strokes at another speed may show in one of the two only.
double ratio_of(std::vector<double> speeds) {
  constexpr std::size_t fewest = 20;
  constexpr double tail = 0.2;
  if (speeds.size() < fewest) return 1.0;
  std::sort(speeds.begin(), speeds.end());
  std::vector<double> distance(speeds.size());
  std::partial_sum(speeds.begin(), speeds.end(), distance.begin());
  const auto at_share = [&](double share) {
    return speeds[static_cast<std::size_t>(
        std::lower_bound(distance.begin(), distance.end(), share * distance.back()) - distance.begin())];
  };
  return std::max(quantile_of(speeds, 1.0 - tail) / quantile_of(speeds, tail),
                  at_share(1.0 - tail) / at_share(tail));
}

/// Records the speeds at which the body moves.
void describe_motion(FitData& data, const std::vector<double>& speed) {
  const double fastest = *std::max_element(speed.begin(), speed.end());
  std::vector<double> speeds, forth, back;
  for (std::size_t i = 0; i < speed.size(); ++i) {
    if (speed[i] <= 1e-3 * fastest) continue;
    speeds.push_back(speed[i]);
    (data.velocity[i] > 0.0 ? forth : back).push_back(speed[i]);
  }
  data.slow = quantile_of(speeds, 0.1);
  data.fast = quantile_of(speeds, 0.9);
  // Compares speeds within each direction only. Between the directions friction may differ by an offset of
  // the sensor, not by speed.
  data.ratio_of_speeds = data.axes == 1 ? std::max(ratio_of(forth), ratio_of(back)) : ratio_of(speeds);
}

/// Returns the first (`order` 1) or second (2) derivative by time of `values` at every sample, from a
/// parabola through 2 w + 1 samples.
std::vector<double> slope_of(const std::vector<double>& t, const std::vector<double>& values, std::size_t w,
                             int order) {
  const std::size_t n = t.size();
  std::vector<double> result(n, 0.0);
  if (n < 3) return result;
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t begin = std::min(i > w ? i - w : 0, n - 3),
                      end = std::min(std::max(i + w + 1, begin + 3), n);
    Eigen::MatrixXd a(static_cast<Eigen::Index>(end - begin), 3);
    Eigen::VectorXd b(a.rows());
    const double scale = t[end - 1] - t[begin];
    for (std::size_t k = begin; k < end; ++k) {
      const double u = (t[k] - t[i]) / scale;
      a.row(static_cast<Eigen::Index>(k - begin)) << 1.0, u, u * u;
      b[static_cast<Eigen::Index>(k - begin)] = values[k];
    }
    const Eigen::Vector3d p = (a.transpose() * a).ldlt().solve(a.transpose() * b);
    result[i] = order == 1 ? p[1] / scale : 2.0 * p[2] / (scale * scale);
  }
  return result;
}

/// Returns the acceleration (m/s^2), smoothed over the narrowest window, of up to 51 samples, whose noise
/// times the mass is at most a hundredth of `force_scale`. Sets `left` to that noise of the inertia force
/// (N), and `window` to the number of samples in the window.
std::vector<double> acceleration(const FitData& data, const std::vector<double>& x, double mass, double& left,
                                 std::size_t& window) {
  constexpr std::size_t widest = 25;
  const FitColumns& c = data.columns;
  const bool of_speed = !c.v.empty();
  const double dt = quantile_of(differences(c, c.t), 0.5);
  double noise = of_speed ? 0.0 : 0.3 * data.quantum;
  for_parts(c, [&](std::size_t begin, std::size_t end) {
    noise = std::max(noise, noise_of(slice(of_speed ? c.v : x, begin, end)));
  });
  std::size_t w = 1;
  for (;; ++w) {
    // Computes how noise grows in the derivatives: the standard deviations of the second and the first
    // derivative of a parabola through 2 w + 1 samples, for noise 1 and spacing 1.
    const double m = 2.0 * static_cast<double>(w) + 1.0;
    const double bend = std::sqrt(720.0 / (m * (m * m - 1.0) * (m * m - 4.0))),
                 slope = std::sqrt(12.0 / (m * (m * m - 1.0)));
    left = mass * noise * (of_speed ? slope / dt : bend / (dt * dt));
    if (w == widest || left <= 0.01 * data.force_scale) break;
  }
  window = 2 * w + 1;
  std::vector<double> result;
  for_parts(c, [&](std::size_t begin, std::size_t end) {
    const std::vector<double> t = slice(c.t, begin, end);
    append(result,
           of_speed ? slope_of(t, slice(c.v, begin, end), w, 1) : slope_of(t, slice(x, begin, end), w, 2));
  });
  return result;
}

}  // namespace

std::vector<double> acceleration(const FitData& data) {
  // Smooths as for a mass whose inertia in a swing through the range is as large as the force.
  const double mass = data.force_scale * data.range / std::max(2.0 * data.fast * data.fast, 1e-300);
  double left = 0.0;
  std::size_t window = 0;
  return acceleration(data, positions_of(data), mass, left, window);
}

namespace {

/// Subtracts mass times acceleration from the measured force, for a sensor that drives the body and so
/// measures its inertia too.
void take_off_inertia(FitData& data, const std::vector<std::vector<double>>& positions, double mass) {
  const std::size_t n = data.samples();
  double most = 0.0, left = 0.0;
  std::size_t window = 0;
  for (std::size_t axis = 0; axis < positions.size(); ++axis) {
    const std::vector<double> a = acceleration(data, positions[axis], mass, left, window);
    for (std::size_t i = 0; i < n; ++i) {
      data.force[axis * n + i] -= mass * a[i];
      most = std::max(most, std::fabs(mass * a[i]));
    }
  }
  data.columns.understood.push_back(fmt::format(
      "inertia of {:.4g} kg taken off the force: up to {:.3g} N; the {} smoothed by parabolas through {} "
      "samples, as the noise asks{}",
      mass, most, data.columns.v.empty() ? "positions are" : "speed is", window,
      left > 0.02 * data.force_scale ? fmt::format(", of which {:.2g} N may be noise of the motion", left)
                                     : ""));
}

/// Removes rows whose force lies far outside the range of all others, which are errors of the measurement,
/// and names them to the user.
void take_out_wild_rows(FitColumns& c) {
  constexpr double far = 3.0;          // distance from the middle, in widths of the others' range
  constexpr double most_wild = 0.005;  // share of wild rows beyond which they are the record
  if (c.planar() || c.t.size() < fewest_samples) return;
  const double low = quantile_of(c.force, 0.01), high = quantile_of(c.force, 0.99),
               middle = 0.5 * (low + high);
  std::vector<bool> stays;
  std::string named;
  std::size_t wild = 0;
  for (std::size_t i = 0; i < c.t.size(); ++i) {
    stays.push_back(high == low || std::fabs(c.force[i] - middle) <= far * (high - low));
    if (stays.back()) continue;
    if (++wild <= 3) named += fmt::format("{}row {} ({:.4g} N)", wild > 1 ? ", " : "", i + 1, c.force[i]);
  }
  if (wild == 0 || static_cast<double>(wild) > std::max(1.0, most_wild * static_cast<double>(c.t.size())))
    return;
  const auto keep = [&](std::vector<double>& values) {
    std::size_t next = 0;
    std::erase_if(values, [&](double) { return !stays[next++]; });
  };
  for (std::vector<double>* column : {&c.t, &c.x, &c.v, &c.load, &c.force}) keep(*column);
  for (std::size_t& part : c.parts)
    part -= static_cast<std::size_t>(
        std::count(stays.begin(), stays.begin() + static_cast<std::ptrdiff_t>(part), false));
  c.replayable = false;
  c.understood.push_back(fmt::format("outliers left out: {}{}", named,
                                     wild > 3 ? fmt::format(" and {} more", wild - 3) : std::string()));
}

}  // namespace

FitData prepare_fit_data(FitColumns columns, ForceSign sign, std::optional<double> load, double mass) {
  FitData data;
  data.columns = std::move(columns);
  take_out_wild_rows(data.columns);
  const FitColumns& c = data.columns;
  refuse_hopeless(c);
  settle_load(data, load);
  if (load) data.columns.understood.push_back(fmt::format("load of {:.4g} N throughout, as given", *load));
  data.axes = c.planar() ? 2 : 1;
  data.first_time = c.t.front();
  data.last_time = c.t.back();

  data.sample_time = quantile_of(differences(c, c.t), 0.5);
  std::vector<std::vector<double>> positions, velocities;
  double square_range = 0.0;
  for (const Axis& axis : axes_of(c)) {
    double quantum = 0.0;
    const std::vector<double> position = c.has_x ? smoothed_positions(c, axis.x, quantum) : axis.x;
    std::vector<double> velocity;
    // Errors of positions, m: `noise` as it is, `coarse` as far as it affects velocities. Smoothed positions
    // of an encoder err by 0.2 counts, at most by half a count.
    double noise = 0.0, coarse = 0.0, longest = 0.0;
    for_parts(c, [&](std::size_t begin, std::size_t end) {
      const std::vector<double> x = slice(position, begin, end);
      if (c.has_x) {
        noise = std::max({noise, noise_of(x), 0.5 * quantum});
        coarse = std::max({coarse, noise_of(x), 0.2 * quantum});
      }
      const auto [low, high] = std::minmax_element(x.begin(), x.end());
      longest = std::max(longest, *high - *low);
    });
    for_parts(c, [&](std::size_t begin, std::size_t end) {
      append(velocity, c.v.empty()
                           ? find_velocity(slice(c.t, begin, end), slice(position, begin, end), coarse)
                           : slice(c.v, begin, end));
    });
    positions.push_back(position);
    velocities.push_back(std::move(velocity));
    square_range += longest * longest;
    data.quantum = std::max(data.quantum, quantum);
    data.position_noise = std::max(data.position_noise, noise);
  }
  data.range = std::sqrt(square_range);
  if (data.range == 0.0) refuse(c, "no motion: the position never changes within a file");
  if (data.range < 4.0 * data.quantum)
    refuse(c, fmt::format("no motion to speak of: the position takes {:.0f} steps of its encoder ({:.3g} m)",
                          data.range / data.quantum, data.quantum));
  const double noise = data.position_noise;
  const double slack = std::max(5.0 * std::min(noise, 0.01 * data.range), 2.0 * data.quantum);
  for (std::size_t axis = 0; axis < positions.size(); ++axis) {
    append(data.velocity, velocities[axis]);
    int reversals = 0;
    for_parts(c, [&](std::size_t begin, std::size_t end) {
      reversals += count_reversals(slice(positions[axis], begin, end), slack);
    });
    data.reversals = std::max(data.reversals, reversals);
  }
  for_parts(c, [&](std::size_t begin, std::size_t end) {
    const std::vector<double> t = slice(c.t, begin, end), of_load = slice(data.load, begin, end),
                              x = slice(positions[0], begin, end);
    std::vector<PathPoint> path = data.axes == 1
                                      ? make_path(t, x, of_load, noise)
                                      : make_planar_path(t, x, slice(positions[1], begin, end), of_load);
    path.front().begins = begin > 0;
    data.path.insert(data.path.end(), path.begin(), path.end());
  });

  std::vector<double> speed, moves;
  for (std::size_t i = 0; i < c.t.size(); ++i) {
    const auto by = [&](const std::vector<double>& x) { return c.follows(i) ? x[i] - x[i - 1] : 0.0; };
    const double across = data.axes == 2 ? by(positions[1]) : 0.0;
    const double move = std::hypot(by(positions[0]), across);
    data.travelled += move;
    if (move > data.quantum) moves.push_back(move);
    speed.push_back(std::hypot(velocities[0][i], data.axes == 2 ? velocities[1][i] : 0.0));
  }
  describe_motion(data, speed);
  data.finest_move = moves.empty() ? data.quantum : quantile_of(moves, 0.1);
  settle_sign(data, sign);
  data.force_scale = root_mean_square(data.force);
  if (mass > 0.0) {
    take_off_inertia(data, positions, mass);
    data.force_scale = root_mean_square(data.force);
  }
  return data;
}

}  // namespace cli
