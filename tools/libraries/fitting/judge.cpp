#include "tools/libraries/fitting/judge.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/fitting/brushes.hpp"
#include "tools/libraries/fitting/least_squares.hpp"
#include "tools/libraries/reports/conditions.hpp"
#include "tools/libraries/reports/progress.hpp"
#include "tools/libraries/reports/table.hpp"
#include "tools/libraries/rivals/rival.hpp"

namespace cli {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Number of samples to which records are thinned to fit rivals: more than for brushes, because LuGre's
// equation needs short steps.
constexpr std::size_t rival_samples = 20000;
// Least number of samples after reversals of the motion with which the report judges reversals.
constexpr std::size_t fewest_after_reversals = 10;
// Ratio of the errors of two models below which they count as equally close.
constexpr double alike = 1.01;

/// Rival friction model as a function of its fitted parameters. The first `logarithms` parameters are fitted
/// as logarithms; the last two are viscous friction and offset, in which the force is linear.
struct RivalModel {
  std::string name;
  int logarithms = 0;
  /// Computes the friction along the path of a record (N, by the body), without viscous friction and offset.
  /// If a matrix is passed, fills its first columns with the derivatives by the logarithms.
  std::function<VectorXd(const VectorXd&, const FitData&, StartState, MatrixXd*)> friction;
  std::function<std::string(const VectorXd&)> describe;
};

/// Returns the friction of a rival model along the path of a record (N, by the body).
VectorXd friction_along(const rivals::Rival& fresh, const FitData& data, StartState start) {
  rivals::Rival rival = fresh;
  if (start != StartState::straight) {  // slides far before the record begins
    const double from = start == StartState::forward ? 10.0 * data.range : -10.0 * data.range;
    for (int i = 0; i < 100; ++i)
      rivals::step(rival, {0.01 * from, 0.0}, 0.1 * data.range / std::max(data.slow, 1e-12),
                   data.load.front());
  }
  VectorXd force(static_cast<Eigen::Index>(data.force.size()));
  Eigen::Index sample = 0;
  double x = data.path.front().x, before = data.path.front().t - data.sample_time;
  for (const PathPoint& point : data.path) {
    if (point.begins) {
      rival = fresh;
      x = point.x;
      before = point.t - data.sample_time;
    }
    const double dt = std::max(point.t - before, 1e-3 * data.sample_time);
    const double end = -rivals::step(rival, {point.x - x, 0.0}, dt, point.load).end.x;
    x = point.x;
    before = point.t;
    if (point.wanted) force[sample++] = end;
  }
  return force;
}

/// Makes a rival model from a function that makes it for some logarithms, at rest. Derivatives are taken by
/// differences.
RivalModel stepped(const char* name, int logarithms,
                   const std::function<rivals::Rival(const VectorXd&)>& make,
                   const std::function<std::string(const VectorXd&)>& describe) {
  const auto friction = [=](const VectorXd& p, const FitData& data, StartState start, MatrixXd* by) {
    const VectorXd force = friction_along(make(p), data, start);
    constexpr double step = 1e-3;
    for (Eigen::Index i = 0; by != nullptr && i < logarithms; ++i) {
      VectorXd q = p;
      q[i] += step;
      by->col(i) = (friction_along(make(q), data, start) - force) / step;
    }
    return force;
  };
  return {name, logarithms, friction, describe};
}

/// Adds viscous friction (coefficient `viscous`, N s/m) and the sensor's offset (N) to a model's elastic
/// force.
VectorXd whole_force(const VectorXd& elastic, const FitData& data, double viscous, double offset) {
  VectorXd force = elastic.array() + offset;
  for (Eigen::Index i = 0; i < force.size(); ++i)
    force[i] += viscous * data.velocity[static_cast<std::size_t>(i)];
  return force;
}

/// Bounds the logarithms of a rival model's parameters, so that its force stays finite.
VectorXd bounded(const VectorXd& logarithms) { return logarithms.cwiseMax(-60.0).cwiseMin(60.0); }

/// Residuals of a rival model, over the rms force, and their derivatives by the parameters.
struct RivalResiduals {
  const RivalModel& model;
  const FitData& data;
  StartState start;
  double speed;  // speed by which the viscous parameter is scaled, m/s

  Eigen::Index values() const { return static_cast<Eigen::Index>(data.force.size()); }
  VectorXd left(const VectorXd& p, MatrixXd* by) const {
    const VectorXd friction = model.friction(bounded(p.head(model.logarithms)), data, start, by);
    VectorXd out = whole_force(friction, data, p[model.logarithms] * data.force_scale / speed,
                               p[model.logarithms + 1] * data.force_scale) -
                   measured_force(data);
    out /= data.force_scale;
    for (double& r : out) {
      if (!std::isfinite(r)) r = 1e6;
    }
    return out;
  }
  void fill(const VectorXd& p, VectorXd& out) const { out = left(p, nullptr); }
  void differentiate(const VectorXd& p, MatrixXd& out) const {
    left(p, &out);
    out.leftCols(model.logarithms) /= data.force_scale;
    // The force is linear in viscous friction and offset.
    out.col(model.logarithms) = Eigen::Map<const VectorXd>(data.velocity.data(), values()) / speed;
    out.col(model.logarithms + 1).setOnes();
    out = out.array().isFinite().select(out, 0.0);
  }
};

struct RivalFit {
  VectorXd parameters;
  StartState start = StartState::straight;
  double sum_of_squares = std::numeric_limits<double>::infinity();
};

RivalFit fit_from(const RivalModel& model, const FitData& data, const VectorXd& guess) {
  RivalFit best;
  const double speed = std::max(data.fast, 1e-12);
  VectorXd residuals(static_cast<Eigen::Index>(data.force.size()));
  StartState start = StartState::straight;
  double least = std::numeric_limits<double>::infinity();
  for (const StartState tried : {StartState::straight, StartState::forward, StartState::backward}) {
    RivalResiduals{model, data, tried, speed}.fill(guess, residuals);
    // Prefers a start with unloaded elements, as the brush starts with straight bristles. Another start has
    // to lower the sum of squares by 2 %.
    const double squares = residuals.squaredNorm() * (tried == StartState::straight ? 0.98 : 1.0);
    if (squares < least) {
      least = squares;
      start = tried;
    }
  }
  const RivalResiduals function{model, data, start, speed};
  VectorXd p = guess;
  minimise({function.values(), [&](const VectorXd& at, VectorXd& out) { function.fill(at, out); },
            [&](const VectorXd& at, MatrixXd& out) { function.differentiate(at, out); }},
           {80, 1e-7, 1e-6, 1.0}, p);
  if (!p.allFinite()) p = guess;
  p.head(model.logarithms) = bounded(p.head(model.logarithms));
  function.fill(p, residuals);
  return {p, start, residuals.squaredNorm()};
}

/// Fits a rival model, beginning at the guesses with the least residuals. A model of few parameters is fitted
/// once more from the best result, with Levenberg-Marquardt's damping reset.
RivalFit best_fit(const RivalModel& model, const FitData& data, std::vector<VectorXd> guesses) {
  constexpr std::size_t most_starts = 6;
  constexpr int few_parameters = 5;  // logarithms up to which a model is fitted once more
  const double speed = std::max(data.fast, 1e-12);
  VectorXd residuals(static_cast<Eigen::Index>(data.force.size()));
  std::vector<std::pair<double, VectorXd>> rated;
  for (VectorXd& guess : guesses) {
    RivalResiduals{model, data, StartState::straight, speed}.fill(guess, residuals);
    rated.emplace_back(residuals.squaredNorm(), std::move(guess));
  }
  std::sort(rated.begin(), rated.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  if (rated.size() > most_starts) rated.resize(most_starts);
  RivalFit best;
  for (const auto& [squares, guess] : rated) {
    if (fit_stopped() && std::isfinite(best.sum_of_squares)) break;
    const RivalFit fit = fit_from(model, data, guess);
    if (fit.sum_of_squares < best.sum_of_squares) best = fit;
  }
  if (!std::isfinite(best.sum_of_squares) || model.logarithms > few_parameters) return best;
  const RivalFit again = fit_from(model, data, best.parameters);
  return again.sum_of_squares < best.sum_of_squares ? again : best;
}

rivals::Surface bare_surface(double kinetic) {
  rivals::Surface s;
  s.kinetic_coefficient = s.static_coefficient = kinetic;
  s.damping = s.viscous_friction = 0.0;
  return s;
}

/// Returns presliding lengths to try, in a geometric series from the resolution of the data to the range of
/// the motion.
std::vector<double> trial_lengths(const FitData& data, int count) {
  const double low = std::max({0.5 * data.quantum, 0.3 * data.finest_move, 1e-4 * data.range}),
               high = data.range;
  std::vector<double> lengths;
  for (int i = 0; i < count; ++i) lengths.push_back(low * std::pow(high / low, (i + 0.5) / count));
  return lengths;
}

RivalModel coulomb_model() {
  return stepped(
      "Coulomb", 2,
      [](const VectorXd& p) -> rivals::Rival {
        return rivals::Coulomb{.surface = bare_surface(std::exp(p[0])), .creep_velocity = std::exp(p[1])};
      },
      [](const VectorXd& p) {
        return fmt::format("kinetic {:.3g}, ramp {:.3g} m/s", std::exp(p[0]), std::exp(p[1]));
      });
}

RivalModel lugre_model(const FitData& data) {
  const double load = data.mean_load;
  return stepped(
      "LuGre", 5,
      [load](const VectorXd& p) -> rivals::Rival {
        rivals::Surface s = bare_surface(std::exp(p[0]));
        s.static_coefficient = std::exp(p[1]);
        s.stribeck_velocity = std::exp(p[2]);
        s.stiffness = std::exp(p[3]) * load;
        s.damping = std::exp(p[4]) * load;
        return rivals::LuGre{.surface = s, .z = {}};
      },
      [load](const VectorXd& p) {
        return fmt::format(
            "kinetic {:.3g}, static {:.3g}, Stribeck {:.3g} m/s, stiffness {:.3g} N/m, damper "
            "{:.3g} N s/m",
            std::exp(p[0]), std::exp(p[1]), std::exp(p[2]), load * std::exp(p[3]), load * std::exp(p[4]));
      });
}

constexpr int elements = rivals::MaxwellSlip::elements;

/// Returns the friction of the Maxwell-slip model on one axis (N, by the body). The parameters are first the
/// logarithms of its elements' stiffnesses (N/m), then those of their slip lengths (m) at the mean load. An
/// element depends on no other one, so that its derivatives follow from its own stretch.
VectorXd maxwell_friction(const VectorXd& p, const FitData& data, StartState start, MatrixXd* by) {
  VectorXd force = VectorXd::Zero(static_cast<Eigen::Index>(data.force.size()));
  for (int i = 0; i < elements; ++i) {
    const double stiffness = std::exp(p[i]), length = std::exp(p[elements + i]);
    double x = data.path.front().x, z = 0.0, by_length = 0.0;  // stretch, and its derivative by the length
    const auto slip = [&](double load) {
      const double share = load / data.mean_load;
      if (std::fabs(z) <= length * share) return;
      by_length = std::copysign(share, z);
      z = length * by_length;
    };
    if (start != StartState::straight) {  // slides far before the record begins
      z = start == StartState::forward ? 1e300 : -1e300;
      slip(data.load.front());
    }
    Eigen::Index sample = 0;
    for (const PathPoint& point : data.path) {
      if (point.begins) {
        x = point.x;
        z = by_length = 0.0;
      }
      slip(point.load);
      z += point.x - x;
      slip(point.load);
      x = point.x;
      if (!point.wanted) continue;
      if (by != nullptr) {
        (*by)(sample, i) = stiffness * z;
        (*by)(sample, elements + i) = stiffness * length * by_length;
      }
      force[sample++] += stiffness * z;
    }
  }
  return force;
}

RivalModel maxwell_model() {
  return {"Maxwell-slip", 2 * elements, maxwell_friction, [](const VectorXd& p) {
            // Describes only elements that have at least a hundredth of the strongest element's force. The
            // data do not determine the slip lengths of the others.
            double strongest = 0.0, low = 1e300, high = 0.0;
            int count = 0;
            const auto limit = [&](int i) { return std::exp(p[i] + p[elements + i]); };
            const auto counts = [&](int i) { return std::exp(p[elements + i]) < 1.0; };
            for (int i = 0; i < elements; ++i) {
              if (counts(i)) strongest = std::max(strongest, limit(i));
            }
            for (int i = 0; i < elements; ++i) {
              if (!counts(i) || limit(i) < 0.01 * strongest) continue;
              low = std::min(low, std::exp(p[elements + i]));
              high = std::max(high, std::exp(p[elements + i]));
              ++count;
            }
            return fmt::format("{} elements that matter slip at {:.3g} to {:.3g} m", count, low, high);
          }};
}

/// Returns a first guess for the Maxwell-slip model: ten fixed slip lengths, with the stiffnesses, viscous
/// friction and offset that nonnegative least squares give.
VectorXd maxwell_guess(const FitData& data, double low, double high) {
  const auto samples = static_cast<Eigen::Index>(data.force.size());
  const double speed = std::max(data.fast, 1e-12);
  VectorXd p = VectorXd::Zero(2 * elements + 2);
  MatrixXd a(samples, elements + 2);
  for (int i = 0; i < elements; ++i)
    p[elements + i] = std::log(low * std::pow(high / low, i / (elements - 1.0)));
  MatrixXd stretches(samples, 2 * elements);  // the stiffnesses are 1 N/m here
  maxwell_friction(p, data, StartState::straight, &stretches);
  a.leftCols(elements) = stretches.leftCols(elements);
  a.col(elements) = Eigen::Map<const VectorXd>(data.velocity.data(), samples) / speed * data.force_scale;
  a.col(elements + 1).setConstant(data.force_scale);
  const VectorXd unit = a.colwise().norm().cwiseMax(1e-300);
  a = a * unit.cwiseInverse().asDiagonal();
  const VectorXd solution =
      solve_nonnegative(a.transpose() * a, a.transpose() * measured_force(data), elements)
          .cwiseQuotient(unit);
  const double weakest = 1e-4 * solution.head(elements).maxCoeff() + 1e-300;
  p.head(elements) = solution.head(elements).cwiseMax(weakest).array().log();
  p.tail(2) = solution.tail(2);
  return p;
}

class Judge {
 public:
  Judge(const FitData& whole, const std::vector<bool>& fitted, double reversal_path)
      : whole_(whole), fitted_(fitted), reversal_path_(reversal_path), paths_(path_since_reversal(whole)) {}

  void add(Judgements& all, const std::string& model, std::size_t parameters, const VectorXd& force,
           const std::string& values) const {
    Judgement j;
    j.model = model;
    j.parameters = static_cast<int>(parameters);
    j.values = values;
    j.fitted = rms(force, [&](std::size_t i) { return fitted_[i]; });
    j.judged.all = rms(force, [&](std::size_t i) { return !fitted_[i]; });
    j.judged.reversal = rms(force, [&](std::size_t i) { return !fitted_[i] && reverses(i); });
    j.judged.sliding = rms(force, [&](std::size_t i) { return !fitted_[i] && !reverses(i); });
    for (std::size_t i = 0; i < paths_.size(); ++i) {
      if (fitted_[i]) continue;
      const double square = std::pow(force[static_cast<Eigen::Index>(i)] - whole_.force[i], 2);
      const unsigned block = block_of(whole_, i);
      j.squares[block] += square;
      if (reverses(i)) j.reversal_squares[block] += square;
    }
    if (!std::isfinite(j.fitted + j.judged.all)) j.failed = "its force is no number on this record";
    all.models.push_back(j);
  }
  void count(Judgements& all) const {
    for (std::size_t i = 0; i < paths_.size(); ++i)
      ++(fitted_[i] ? all.fitted_samples : reverses(i) ? all.reversal_samples : all.sliding_samples);
    all.fitted = reach_of(whole_, fitted_, true);
    all.judged = reach_of(whole_, fitted_, false);
  }

 private:
  bool reverses(std::size_t i) const { return paths_[i] <= reversal_path_; }
  template <class Counts>
  double rms(const VectorXd& force, const Counts& counts) const {
    double squares = 0.0, n = 0.0;
    for (std::size_t i = 0; i < paths_.size(); ++i) {
      if (!counts(i)) continue;
      squares += std::pow(force[static_cast<Eigen::Index>(i)] - whole_.force[i], 2);
      n += 1.0;
    }
    return n > 0.0 ? std::sqrt(squares / n) : std::nan("");
  }

  const FitData& whole_;
  const std::vector<bool>& fitted_;
  double reversal_path_;
  std::vector<double> paths_;
};

std::string brush_values(const FittedBrush& brush) {
  const FitPoint& point = brush.found.point;
  std::string text = brush.options.rule == bristle::SnapRule::slide ? "slide" : "redraw";
  for (const FitParameter p : point.free)
    text +=
        fmt::format("{} {} {:.3g}", text.find(' ') == text.npos ? ":" : ",", fit_name(p), point.values[p]);
  return text;
}

}  // namespace

Judgements judge_rivals(const FitColumns& columns, const FitOptions& options) {
  if (columns.planar())
    throw UserError(columns.name + ": --rivals has one axis; leave out y and fy, or fit without --rivals");
  const FitData whole = prepare_fit_data(columns, options.sign, options.load, options.mass);
  if (options.fit_until && *options.fit_until >= whole.length())
    throw UserError(fmt::format("--fit-until {:g} s: nothing is left to judge; the record ends after {:g} s",
                                *options.fit_until, whole.length()));
  Progress progress("rivals", options.quiet);
  // Fits the brushes without a drift of the sensor, which the rivals do not have, and which would be
  // extrapolated beyond the first seconds.
  FitOptions held = options;
  held.no_drift = true;
  const Choice choice = choose_brush(whole, held, [&](double share) { progress.update(0.7 * share); });
  const std::optional<FitValues>& cut_by = choice.cut_by;
  const FitData moving = without_rests(whole), seen = samples_that_count(moving, moving.samples(), cut_by);
  const auto fitted_in = [&](const FitData& data) {
    return fitted_blocks(data, options.fit_until, choice.other_half);
  };
  const std::vector<bool> fitted = fitted_in(seen);
  const FitData dense = samples_that_count(moving, rival_samples, cut_by),
                train = part_of(dense, fitted_in(dense));
  const std::vector<FittedBrush>& brushes = choice.of_part;
  if (brushes.empty())
    throw UserError(
        fmt::format("{}: {} samples to fit to, {} to judge by; --rivals needs at least {} of each",
                    columns.name, train.samples(), dense.samples() - train.samples(), fewest_to_choose));

  Judgements all;
  all.until = options.fit_until;
  if (choice.other_half) all.held_out_blocks = 15;
  all.presliding_length = brushes.front().found.point.values[fit_length];
  if (cut_by) {
    const std::vector<bool> left_out = around_reversals(whole, *cut_by);
    all.left_out = static_cast<std::size_t>(std::count(left_out.begin(), left_out.end(), true));
  }
  const Judge judge(seen, fitted, 2.0 * all.presliding_length);
  judge.count(all);
  const auto add_failed = [&](const std::string& name, int parameters, const std::string& reason) {
    const double none = std::nan("");
    all.models.push_back({name, parameters, none, {none, none, none}, {}, reason, {}, {}});
  };
  const auto add_rival = [&](const RivalModel& model, const std::vector<VectorXd>& guesses, double done) {
    const RivalFit fit = best_fit(model, train, guesses);
    if (!std::isfinite(fit.sum_of_squares)) {
      add_failed(model.name, model.logarithms + 2,
                 fmt::format("none of {} starts led to a finite force", guesses.size()));
      return;
    }
    const double speed = std::max(train.fast, 1e-12);
    const auto force_on = [&](const FitData& data) {
      return whole_force(model.friction(fit.parameters.head(model.logarithms), data, fit.start, nullptr),
                         data, fit.parameters[model.logarithms] * train.force_scale / speed,
                         fit.parameters[model.logarithms + 1] * train.force_scale);
    };
    judge.add(all, model.name, static_cast<std::size_t>(model.logarithms) + 2, force_on(seen),
              model.describe(fit.parameters));
    if (all.models.back().failed.empty()) {
      const VectorXd force = force_on(whole);
      all.rivals.push_back({model.name, {force.data(), force.data() + force.size()}});
    }
    progress.update(done);
  };

  const double kinetic = train.force_scale / train.mean_load;
  std::vector<VectorXd> guesses;
  for (const double speed : {0.1 * train.slow, train.slow, train.fast})
    guesses.push_back(
        (VectorXd(4) << std::log(kinetic), std::log(std::max(speed, 1e-12)), 0.0, 0.0).finished());
  add_rival(coulomb_model(), guesses, 0.75);

  guesses.clear();
  for (const double length : trial_lengths(train, 14)) {
    // Damping of a bristle over its stiffness, in units of the time in which the motion covers a presliding
    // length.
    for (const double damper : {1e-3, 0.3}) {
      const double time = length / std::max(train.slow, 1e-12);
      for (const double rise : {1.1, 2.0}) {
        for (const double stribeck : {train.slow, train.fast}) {
          VectorXd p(7);
          p << std::log(kinetic), std::log(rise * kinetic), std::log(std::max(stribeck, 1e-12)),
              std::log(kinetic / length), std::log(damper * time * kinetic / length), 0.0, 0.0;
          guesses.push_back(p);
        }
      }
    }
  }
  add_rival(lugre_model(train), guesses, 0.85);

  guesses.clear();
  const std::vector<double> lengths = trial_lengths(train, 12);
  for (const double low : {lengths[0], lengths[3], lengths[5]}) {
    for (const double high : {lengths[7], lengths[9], lengths[11]})
      guesses.push_back(maxwell_guess(train, low, high));
  }
  add_rival(maxwell_model(), guesses, 1.0);
  for (const FittedBrush& brush : brushes)
    judge.add(all, brush.name, brush.found.point.free.size(), force_of(brush, seen, Detail::finish),
              brush_values(brush));
  for (const auto& [name, reason] : choice.failed) add_failed(name, 0, reason);
  return all;
}

namespace {

/// Returns whether a model is as close as the closest one: if their errors are equal as printed, or differ by
/// less than the 95 % interval that their scatter over the judged blocks of time leaves.
bool as_close(const Judgement& model, const Judgement& closest, double Residuals3::*error,
              BlockSquares Judgement::*squares) {
  if (model.judged.*error < alike * (closest.judged.*error)) return true;
  const double count = static_cast<double>((model.*squares).size());
  if (count < 2.0) return false;
  double sum = 0.0, of_squares = 0.0;
  for (const auto& [block, square] : model.*squares) {
    const double more = square - (closest.*squares).at(block);
    sum += more;
    of_squares += more * more;
  }
  const double scatter = std::sqrt((count * of_squares - sum * sum) / (count - 1.0));
  return sum < student_quantile(count - 1.0) * scatter;
}

/// Returns the name of the model with the least error, and the names of those that are as close.
std::string closest_models(const Judgements& all, double Residuals3::*error,
                           BlockSquares Judgement::*squares) {
  const auto counts = [&](const Judgement& j) { return j.failed.empty() && !std::isnan(j.judged.*error); };
  const Judgement* least = nullptr;
  for (const Judgement& j : all.models)
    if (counts(j) && (least == nullptr || j.judged.*error < least->judged.*error)) least = &j;
  if (least == nullptr) return {};
  std::string others;
  for (const Judgement& j : all.models)
    if (&j != least && counts(j) && as_close(j, *least, error, squares))
      others += (others.empty() ? "" : "; ") + j.model;
  return least->model + (others.empty() ? "" : " (" + others + " as close)");
}

}  // namespace

std::string judgement_table(const Judgements& all) {
  std::string text;
  if (!all.within_range())
    text = fmt::format(
        "No verdict: the judged part has paths of {:.3g} mm from a reversal and {:.3g} mm/s, the fitted one "
        "{:.3g} mm and {:.3g} mm/s.",
        1e3 * all.judged.stroke, 1e3 * all.judged.speed, 1e3 * all.fitted.stroke, 1e3 * all.fitted.speed);
  else
    text = fmt::format(
        "Closest to the rest of the record: {}{}.",
        closest_models(all, &Residuals3::all, &Judgement::squares),
        all.left_out > 0
            ? std::string("; the samples do not resolve presliding, by which reversals are judged")
        : all.reversal_samples < fewest_after_reversals
            ? std::string("; too few samples follow a reversal to judge reversals")
            : "; in its reversals: " +
                  closest_models(all, &Residuals3::reversal, &Judgement::reversal_squares));
  for (const Judgement& j : all.models)
    if (!j.failed.empty()) text += fmt::format(" Not fitted: {} ({}).", j.model, j.failed);
  text += fmt::format(
      "\n\nFitted to {} ({} samples), judged on the rest: {} samples within {:.3g} um after a reversal "
      "(reversal, "
      "twice the presliding length), {} beyond (sliding). Paths of up to {:.3g} mm from a reversal, {:.3g} "
      "mm/s. "
      "Residuals in N, rms.{}\n\n",
      all.until ? fmt::format("the first {:g} s", *all.until) : std::string("half of 32 blocks of time"),
      all.fitted_samples, all.reversal_samples, 2e6 * all.presliding_length, all.sliding_samples,
      1e3 * all.fitted.stroke, 1e3 * all.fitted.speed,
      all.left_out > 0 ? fmt::format(" {} samples around reversals count nowhere, as friction there may be "
                                     "anything between its limits.",
                                     all.left_out)
                       : "");
  Table table({"<model", "numbers", "fitted", "judged", "reversal", "sliding"});
  const auto number = [](double value) {
    return std::isnan(value) ? std::string("-") : fmt::format("{:.4g}", value);
  };
  for (const Judgement& j : all.models)
    table.add({j.model, fmt::format("{}", j.parameters), number(j.fitted), number(j.judged.all),
               number(j.judged.reversal), number(j.judged.sliding)});
  text += table.text() + '\n';
  for (const Judgement& j : all.models)
    if (j.failed.empty()) text += fmt::format("{}: {}\n", j.model, j.values);
  if (fit_stopped()) text += fmt::format("\n{}\n", stopped_early);
  return text;
}

std::string judgement_json(const FitColumns& columns, const Judgements& all) {
  nlohmann::ordered_json report;
  report["schema"] = "bristle-fit-rivals-1";
  report["conditions"] = to_json(conditions());
  report["file"] = columns.name;
  if (all.until)
    report["fit_until_s"] = *all.until;
  else
    report["held_out_blocks"] = all.held_out_blocks;
  report["within_range"] = all.within_range();
  report["presliding_length_m"] = all.presliding_length;
  report["samples"] = {{"fitted", all.fitted_samples},
                       {"reversal", all.reversal_samples},
                       {"sliding", all.sliding_samples},
                       {"left_out", all.left_out}};
  for (const Judgement& j : all.models) {
    report["models"].push_back({{"model", j.model},
                                {"parameters", j.parameters},
                                {"fitted_rms_n", j.fitted},
                                {"judged_rms_n", j.judged.all},
                                {"reversal_rms_n", j.judged.reversal},
                                {"sliding_rms_n", j.judged.sliding},
                                {"values", j.values},
                                {"failed", j.failed}});
  }
  return report.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + '\n';
}

}  // namespace cli
