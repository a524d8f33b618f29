#include "tools/fitting/data.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

#include "tools/files/user_error.hpp"

namespace cli {
namespace {

constexpr std::size_t fewest_samples = 20;
constexpr double to_and_fro = 0.1;              // of the travel goes back
constexpr double steady_load_deviation = 0.02;  // of the mean: a load that rests, measured with noise

double quantile_of(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

[[noreturn]] void refuse(const FitColumns& data, const std::string& why) {
  throw UserError(fmt::format("{}: {}", data.name, why));
}

std::vector<double> differences(const std::vector<double>& values) {
  std::vector<double> result;
  for (std::size_t i = 1; i < values.size(); ++i) result.push_back(values[i] - values[i - 1]);
  return result;
}

// ------------------------------------------------------------------------------------------ position

/// The step of an encoder: the smallest move, if all moves are whole multiples of it and many samples repeat.
double find_quantum(const std::vector<double>& x) {
  double smallest = 0.0;
  std::size_t repeats = 0;
  const double range = *std::max_element(x.begin(), x.end()) - *std::min_element(x.begin(), x.end());
  const std::vector<double> moves = differences(x);
  for (const double d : moves) {
    if (std::fabs(d) <= 1e-12 * range) {
      ++repeats;
    } else if (smallest == 0.0 || std::fabs(d) < smallest) {
      smallest = std::fabs(d);
    }
  }
  if (smallest == 0.0) return 0.0;
  // A mean over single steps: the differences are rounded to the digits of the file.
  double sum = 0.0, steps = 0.0;
  for (const double d : moves) {
    const double count = std::round(std::fabs(d) / smallest);
    if (std::fabs(std::fabs(d) / smallest - count) > 0.05 * std::max(count, 1.0)) return 0.0;
    if (count == 1.0) {
      sum += std::fabs(d);
      steps += 1.0;
    }
  }
  return repeats * 50 > moves.size() ? sum / steps : 0.0;
}

/// Where an encoder creeps up or down by single steps the position is put on the line between the middles of
/// the steps. It moves by half a step at most. Standing still and turning back stay as they are.
std::vector<double> smooth_creep(const std::vector<double>& t, const std::vector<double>& x, double quantum) {
  std::vector<double> smooth = x;
  const std::size_t n = x.size();
  for (std::size_t begin = 0; begin < n;) {
    std::size_t end = begin + 1;
    while (end < n && x[end] == x[begin]) ++end;
    if (begin > 0 && end < n) {
      const double before = (x[begin] - x[begin - 1]) / quantum, after = (x[end] - x[begin]) / quantum;
      if (std::fabs(std::fabs(before) - 1.0) < 0.1 && std::fabs(after - before) < 0.1) {
        const double enters = 0.5 * (t[begin - 1] + t[begin]), leaves = 0.5 * (t[end - 1] + t[end]);
        for (std::size_t i = begin; i < end; ++i) {
          smooth[i] = x[i] + before * quantum * ((t[i] - enters) / (leaves - enters) - 0.5);
        }
      }
    }
    begin = end;
  }
  return smooth;
}

/// Noise of the position, m: of its second differences, by their median, so that motion counts little.
double position_noise(const std::vector<double>& x, double quantum) {
  std::vector<double> bends;
  for (std::size_t i = 2; i < x.size(); ++i) bends.push_back(std::fabs(x[i] - 2.0 * x[i - 1] + x[i - 2]));
  // The median of |a normal number| is 0.6745 deviations; a second difference of noise has sqrt(6) of them.
  return std::max(0.5 * quantum, quantile_of(bends, 0.5) / (0.6745 * 2.449));
}

/// Velocity by differences over as many samples as it takes to leave the noise behind.
std::vector<double> find_velocity(const std::vector<double>& t, const std::vector<double>& x, double noise) {
  constexpr std::size_t widest = 25;
  const std::size_t n = t.size();
  std::vector<double> velocity(n);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t w = 1; w <= widest; ++w) {
      const std::size_t a = i > w ? i - w : 0, b = std::min(i + w, n - 1);
      velocity[i] = (x[b] - x[a]) / (t[b] - t[a]);
      if (std::fabs(x[b] - x[a]) > 20.0 * noise) break;
    }
  }
  return velocity;
}

int count_reversals(const std::vector<double>& x, double slack) {
  int reversals = 0, direction = 0;
  double extreme = x.front();
  for (const double place : x) {
    if (direction == 0) {
      if (std::fabs(place - extreme) > slack) direction = place > extreme ? 1 : -1;
      if (direction) extreme = place;
    } else if (direction * (place - extreme) >= 0.0) {
      extreme = place;
    } else if (std::fabs(place - extreme) > slack) {
      direction = -direction;
      ++reversals;
      extreme = place;
    }
  }
  return reversals;
}

/// Samples, and between them the turning points that the parabola through three samples shows.
std::vector<PathPoint> make_path(const std::vector<double>& t, const std::vector<double>& x,
                                 const std::vector<double>& load, double noise) {
  std::vector<PathPoint> path;
  for (std::size_t i = 0; i < x.size(); ++i) {
    PathPoint turn{0.0, load[i], false};
    double place = 0.0;  // of the turning point, in samples from this one
    if (i > 0 && i + 1 < x.size()) {
      const double a = x[i] - x[i - 1], b = x[i + 1] - x[i];
      const double even = (t[i] - t[i - 1]) / (t[i + 1] - t[i]);
      if (a * b < 0.0 && std::min(std::fabs(a), std::fabs(b)) > 4.0 * noise && even > 0.8 && even < 1.25) {
        place = 0.5 * (a + b) / (a - b);
        turn.x = x[i] + 0.25 * (a + b) * place;
      }
    }
    if (place < 0.0) path.push_back(turn);
    path.push_back({x[i], load[i], true});
    if (place > 0.0) path.push_back(turn);
  }
  return path;
}

// -------------------------------------------------------------------------------------------- force

/// Share of the travel that goes the way that it goes less.
double share_back(const std::vector<double>& x) {
  double forth = 0.0, back = 0.0;
  for (std::size_t i = 1; i < x.size(); ++i) (x[i] > x[i - 1] ? forth : back) += std::fabs(x[i] - x[i - 1]);
  return std::min(forth, back) / (forth + back);
}

/// How the force goes with the motion, -1 to 1: work over the most that it could be. The middle of the force
/// is taken out where the motion goes to and fro, so that an offset of the sensor does no work; a slide of
/// which a few samples go back has its friction on one side.
double relative_work(const FitData& data) {
  const auto& f = data.columns.force;
  const auto& x = data.columns.x;
  const double middle =
      share_back(x) > to_and_fro ? 0.5 * (quantile_of(f, 0.02) + quantile_of(f, 0.98)) : 0.0;
  double work = 0.0, most = 0.0;
  for (std::size_t i = 1; i < x.size(); ++i) {
    const double w = (0.5 * (f[i] + f[i - 1]) - middle) * (x[i] - x[i - 1]);
    work += w;
    most += std::fabs(w);
  }
  return most > 0.0 ? work / most : 0.0;
}

/// The same for small motion, where little is lost: whether the force grows with the displacement.
double relative_stiffness(const FitData& data) {
  const auto& f = data.columns.force;
  const auto& x = data.columns.x;
  const double n = static_cast<double>(x.size());
  const double mx = std::accumulate(x.begin(), x.end(), 0.0) / n,
               mf = std::accumulate(f.begin(), f.end(), 0.0) / n;
  double xf = 0.0, xx = 0.0, ff = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    xf += (x[i] - mx) * (f[i] - mf);
    xx += (x[i] - mx) * (x[i] - mx);
    ff += (f[i] - mf) * (f[i] - mf);
  }
  return xf / std::sqrt(xx * ff);
}

void settle_sign(FitData& data, ForceSign sign) {
  const double work = relative_work(data);
  double direction = std::fabs(work) > 0.15 ? work : relative_stiffness(data);
  if (std::fabs(direction) < 0.15) {
    refuse(data.columns,
           fmt::format("the force does not go with the motion (its work is {:.0f} % of what a force that "
                       "always opposes it would do): this is no friction of x",
                       100.0 * std::fabs(work)));
  }
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
  if (found == ForceSign::on_body) {
    for (double& f : data.force) f = -f;
  }
}

// --------------------------------------------------------------------------------------------- load

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
  if (c.t.size() < fewest_samples) {
    refuse(c, fmt::format("{} data rows; a fit needs at least {}", c.t.size(), fewest_samples));
  }
  const auto [low, high] = std::minmax_element(c.x.begin(), c.x.end());
  if (*low == *high) refuse(c, "no motion: the position never changes");
  const auto [least, most] = std::minmax_element(c.force.begin(), c.force.end());
  if (*least == *most)
    refuse(c, fmt::format("the force is constant ({} N in every row): no friction was measured", *least));
}

/// What lies between two samples that stay: its highest and lowest place, where it goes beyond both of them.
class Between {
 public:
  void add(const PathPoint& point) {
    const PathPoint place{point.x, point.load, false};
    if (count_ == 0 || point.x > high_.x) {
      high_ = place;
      high_at_ = count_;
    }
    if (count_ == 0 || point.x < low_.x) {
      low_ = place;
      low_at_ = count_;
    }
    ++count_;
  }
  /// Puts them before the end and forgets them.
  void close(double slack, const PathPoint& end, std::vector<PathPoint>& path) {
    const double from = path.empty() ? end.x : path.back().x;
    const bool up = count_ > 0 && high_.x > std::max(from, end.x) + slack;
    const bool down = count_ > 0 && low_.x < std::min(from, end.x) - slack;
    const bool high_first = high_at_ < low_at_;
    if (up && high_first) path.push_back(high_);
    if (down) path.push_back(low_);
    if (up && !high_first) path.push_back(high_);
    path.push_back(end);
    count_ = 0;
  }

 private:
  PathPoint high_, low_;
  std::size_t high_at_ = 0, low_at_ = 0, count_ = 0;
};

}  // namespace

FitData thinned(const FitData& data, std::size_t most, std::vector<std::size_t>* kept) {
  const std::size_t every = (data.force.size() + most - 1) / most;
  FitData thin = data;
  thin.columns.t.clear();
  for (std::vector<double>* column : {&thin.columns.x, &thin.columns.v, &thin.columns.load,
                                      &thin.columns.force, &thin.force, &thin.load, &thin.velocity})
    column->clear();
  thin.path.clear();
  Between between;
  std::size_t sample = 0;
  for (const PathPoint& point : data.path) {
    const std::size_t i = sample;
    if (point.wanted) ++sample;
    if (!point.wanted || i % every != 0) {
      between.add(point);
      continue;
    }
    between.close(every > 1 ? 4.0 * data.position_noise : 0.0, point, thin.path);
    thin.columns.t.push_back(data.columns.t[i]);
    thin.columns.x.push_back(data.columns.x[i]);
    thin.columns.force.push_back(data.columns.force[i]);
    thin.force.push_back(data.force[i]);
    thin.load.push_back(data.load[i]);
    thin.velocity.push_back(data.velocity[i]);
    if (kept) kept->push_back(i);
  }
  return thin;
}

FitData prepare_fit_data(FitColumns columns, ForceSign sign, std::optional<double> load) {
  FitData data;
  data.columns = std::move(columns);
  const FitColumns& c = data.columns;
  refuse_hopeless(c);
  settle_load(data, load);

  data.sample_time = quantile_of(differences(c.t), 0.5);
  data.quantum = c.has_x ? find_quantum(c.x) : 0.0;
  const std::vector<double> x = data.quantum > 0.0 ? smooth_creep(c.t, c.x, data.quantum) : c.x;
  const double noise = c.has_x ? position_noise(x, data.quantum) : 0.0;
  data.position_noise = noise;
  const auto [low, high] = std::minmax_element(x.begin(), x.end());
  data.range = *high - *low;
  if (data.range < 4.0 * data.quantum) {
    refuse(c, fmt::format("no motion to speak of: the position takes {:.0f} steps of its encoder ({:.3g} m)",
                          data.range / data.quantum, data.quantum));
  }
  data.velocity = c.v.empty() ? find_velocity(c.t, x, noise) : c.v;
  data.reversals = count_reversals(x, std::max(5.0 * std::min(noise, 0.01 * data.range), 2.0 * data.quantum));
  data.path = make_path(c.t, x, data.load, noise);

  std::vector<double> speeds, moves;
  for (std::size_t i = 1; i < x.size(); ++i) {
    const double move = std::fabs(x[i] - x[i - 1]);
    data.travelled += move;
    if (move > data.quantum) moves.push_back(move);
  }
  const double fastest =
      std::fabs(*std::max_element(data.velocity.begin(), data.velocity.end(),
                                  [](double a, double b) { return std::fabs(a) < std::fabs(b); }));
  for (const double v : data.velocity) {
    if (std::fabs(v) > 1e-3 * fastest) speeds.push_back(std::fabs(v));
  }
  data.slow = quantile_of(speeds, 0.1);
  data.fast = quantile_of(speeds, 0.9);
  data.finest_move = moves.empty() ? data.quantum : quantile_of(moves, 0.1);
  settle_sign(data, sign);
  double squares = 0.0;
  for (const double f : data.force) squares += f * f;
  data.force_scale = std::sqrt(squares / static_cast<double>(data.force.size()));
  return data;
}

}  // namespace cli
