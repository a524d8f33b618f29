#include "tools/libraries/fitting/joint.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <numeric>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "tools/libraries/files/csv_rows.hpp"
#include "tools/libraries/files/foreign_csv.hpp"
#include "tools/libraries/files/output_file.hpp"
#include "tools/libraries/files/text_file.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/fitting/fit.hpp"
#include "tools/libraries/fitting/least_squares.hpp"
#include "tools/libraries/fitting/solve.hpp"
#include "tools/libraries/reports/conditions.hpp"
#include "tools/libraries/reports/progress.hpp"
#include "tools/libraries/reports/table.hpp"
#include "tools/libraries/rivals/lugre.hpp"

namespace cli {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Unit rate_units[] = {{"rad/s", 1.0}, {"deg/s", 57.29577951308232}, {"rpm", 9.549296585513721}};
/// Units of a temperature. Only differences of temperature matter, and a degree is the same in both units.
constexpr Unit warmth_units[] = {{"degC", 1.0}, {"C", 1.0}, {"K", 1.0}};
constexpr Unit current_units[] = {{"A", 1.0}, {"mA", 1e3}};
enum Column : unsigned {
  column_t,
  column_angle,
  column_speed,
  column_motor,
  column_current,
  column_outside,
  column_temperature,
  column_count
};
constexpr ColumnKind kinds[column_count] = {
    {"t", time_units, most_time},      {"angle", angle_units, 1e6},
    {"speed", rate_units, 1e9},        {"motor", torque_units, most_force},
    {"current", current_units, 1e9},   {"outside", torque_units, most_force},
    {"temperature", warmth_units, 1e4}};

/// Time, s, over which residuals of the torque are averaged. Over less, accelerations from differences are
/// only noise.
constexpr double block_time = 0.01;
constexpr std::size_t least_blocks = 30;
/// Largest number of samples of a log that the command fits as a whole, so that a fit takes a minute at most.
/// Of a longer log it fits pieces.
constexpr std::size_t most_samples = 48000;
/// Number of runs of the brush along a log that a fit takes (1,200 to 1,600 were counted), and that a fit
/// with rivals takes; the time to expect follows from it.
constexpr double usual_runs = 1500.0, runs_with_rivals = 6000.0;
/// Least share of a change of the motor's torque that is taken to move the joint, however much of it friction
/// takes up. Errors are divided by the share, so it must not vanish.
constexpr double least_by_motor = 0.02;
/// Least share of the torques by which the outside torque must vary independently of the motion. With less,
/// the log cannot tell how friction depends on a torque.
constexpr double least_load = 0.05;
/// Least gain in the information criterion, and largest ratio of errors, with which a model of more terms is
/// preferred.
constexpr double clearly_closer = 12.0, least_gain = 0.99;
/// Residual, as a share of the noise that it should have, below which the log contradicts itself: another
/// column follows the motor's torque, and the fitted numbers are no friction.
constexpr double too_close = 0.3;
/// Number of parts of equal duration into which a log of a joint is cut. Every second one is held out, to
/// judge models by it.
constexpr double parts = 24.0;

/// Friction model of a joint, to be computed along a log. All its parameters are positive; the first is the
/// joint's inertia, kg m^2.
struct Model {
  std::string name;
  std::vector<const char*> names, units;
  std::vector<VectorXd> guesses;
  /// Computes the friction torque on the joint, N m, for each interval between samples. If a matrix is
  /// passed, fills it with the derivatives by the parameters.
  std::function<void(const VectorXd&, VectorXd&, MatrixXd*)> friction;
  /// Returns the derivative of the friction torque by the motor's torque in interval k.
  std::function<double(const VectorXd&, std::size_t k)> by_motor = [](const VectorXd&, std::size_t) {
    return 0.0;
  };
  int runs_with_slopes = 1;  ///< number of model runs that friction() with derivatives
                             ///< takes
};

double middle(const std::vector<double>& x, std::size_t k) { return 0.5 * (x[k] + x[k + 1]); }

double mean(const std::vector<double>& x) {
  return std::accumulate(x.begin(), x.end(), 0.0) / static_cast<double>(x.size());
}

/// Returns the speed (rad/s) below which a joint may stick. Friction then balances the torques that act, up
/// to its limit.
double slow_speed(const JointLog& log) {
  return std::max(1e-3 * root_mean_square(log.speed), 3.0 * noise_of(log.speed));
}

/// Returns the change of motor torque between two samples from which on it counts as a jump, whose exact time
/// between the samples is unknown.
double jump_of(const JointLog& log) {
  std::vector<double> change;
  for (std::size_t k = 0; k + 1 < log.t.size(); ++k)
    change.push_back(std::fabs(log.motor[k + 1] - log.motor[k]));
  return std::max(10.0 * quantile_of(change, 0.95),
                  0.02 * std::hypot(root_mean_square(log.motor), root_mean_square(log.outside)));
}

/// Errors of a friction model of a joint: the motor's torque as observed, less the one that inertia, load and
/// friction ask for, one value for each block of a log. Friction may take a share of the motor's torque. The
/// balance of torques is therefore divided by what the motor's torque adds to it, otherwise a large share
/// would scale the errors down. Blocks of the fitted part come first; blocks in which the motor's torque
/// jumps are left out.
class Balance {
 public:
  Balance(const JointLog& log, JointPart part) : log_(log) {
    const std::size_t n = log.t.size() - 1;
    const double start = log.t.front(), length = log.t.back() - start, jump = jump_of(log);
    std::vector<Block> judged;
    Block block;
    bool jumps = false;
    for (std::size_t k = 0; k < n; ++k) {
      jumps = jumps || std::fabs(log.motor[k + 1] - log.motor[k]) > jump;
      if (log.begins(k + 1)) {  // the interval from one log to the next belongs to no block
        block.first = k + 1;
        jumps = false;
        continue;
      }
      block.end = k + 1;
      if (k + 1 < n && !log.begins(k + 2) && log.t[k + 1] - log.t[block.first] < block_time * (1.0 - 1e-9))
        continue;
      const double part_number = std::floor(parts * (log.t[block.first] - start) / length);
      const bool is_fitted =
          part.alternate ? std::fmod(part_number, 2.0) == 0.0 : log.t[block.end] - start <= part.until;
      if (!jumps) (is_fitted ? blocks_ : judged).push_back(block);
      block.first = block.end;
      jumps = false;
    }
    fitted_ = blocks_.size();
    if (fitted_ < least_blocks)
      throw UserError(fmt::format("{}: {} blocks of 10 ms to fit to; a joint needs at least {}", log.name,
                                  fitted_, least_blocks));
    blocks_.insert(blocks_.end(), judged.begin(), judged.end());
    scale_ = std::max(std::hypot(root_mean_square(log.motor), root_mean_square(log.outside)), 1e-300);
    if (log.temperature.empty()) return;
    const auto [low, high] = std::minmax_element(log.temperature.begin(), log.temperature.end());
    degrees_ = *high - *low;
    mean_temperature_ = mean(log.temperature);
  }
  /// Returns the range of the temperature in the log; 0 if temperature was not logged or never changes.
  double degrees() const { return degrees_; }
  Eigen::Index blocks() const { return static_cast<Eigen::Index>(blocks_.size()); }
  Eigen::Index fitted() const { return static_cast<Eigen::Index>(fitted_); }
  double scale() const { return scale_; }

  /// Returns the unbalanced torque (N m) of each block under a friction model, and its derivatives. Two last
  /// numbers beyond the model's own are 1 plus the relative change of dry and of viscous friction over the
  /// temperature's range.
  VectorXd left(const Model& model, const VectorXd& numbers, MatrixXd* by) const {
    const auto intervals = static_cast<Eigen::Index>(log_.t.size()) - 1;
    const auto own = static_cast<Eigen::Index>(model.names.size());
    const bool warms = numbers.size() > own;
    const auto viscous = static_cast<Eigen::Index>(
        std::find(model.names.begin(), model.names.end(), std::string_view("viscous")) - model.names.begin());
    VectorXd friction(intervals);
    MatrixXd friction_by;
    if (by != nullptr) friction_by.resize(intervals, own);
    model.friction(numbers.head(own), friction, by != nullptr ? &friction_by : nullptr);
    VectorXd result(blocks()), moved = numbers.head(own);
    if (by != nullptr) by->resize(blocks(), numbers.size());
    for (Eigen::Index b = 0; b < blocks(); ++b) {
      const auto [first, end] = blocks_[static_cast<std::size_t>(b)];
      const double time = log_.t[end] - log_.t[first];
      const double acceleration = (log_.speed[end] - log_.speed[first]) / time;
      double torque = 0.0, by_motor = 1.0;
      VectorXd slope = VectorXd::Zero(by != nullptr ? numbers.size() : 0), by_motor_slope = slope;
      for (std::size_t k = first; k < end; ++k) {
        const double share = (log_.t[k + 1] - log_.t[k]) / time;
        const auto row = static_cast<Eigen::Index>(k);
        const double speed = middle(log_.speed, k), of_oil = -numbers[viscous] * speed,
                     dry = friction[row] - of_oil;
        const double warmer = warms ? (middle(log_.temperature, k) - mean_temperature_) / degrees_ : 0.0,
                     factor = warms ? 1.0 + (numbers[own] - 1.0) * warmer : 1.0,
                     oil_factor = warms ? 1.0 + (numbers[own + 1] - 1.0) * warmer : 1.0;
        torque +=
            share * (middle(log_.motor, k) + middle(log_.outside, k) + factor * dry + oil_factor * of_oil);
        const double here = model.by_motor(moved, k);
        by_motor += share * factor * here;
        if (by == nullptr) continue;
        slope.head(own) += share * factor * friction_by.row(row).transpose();
        slope[viscous] -= share * (oil_factor - factor) * speed;
        if (warms) {
          slope[own] += share * warmer * dry;
          slope[own + 1] += share * warmer * of_oil;
          by_motor_slope[own] += share * warmer * here;
        }
        for (Eigen::Index i = 2; i < own && here != 0.0; ++i) {
          moved[i] = numbers[i] + 1e-6;
          by_motor_slope[i] += share * factor * (model.by_motor(moved, k) - here) / 1e-6;
          moved[i] = numbers[i];
        }
      }
      const bool floored = by_motor < least_by_motor;
      if (floored) by_motor = least_by_motor;
      const double balance = numbers[0] * acceleration - torque;
      result[b] = balance / by_motor;
      if (by == nullptr) continue;
      by->row(b) = -slope.transpose() / by_motor;
      (*by)(b, 0) += acceleration / by_motor;
      if (!floored) by->row(b) -= balance / (by_motor * by_motor) * by_motor_slope.transpose();
    }
    return result;
  }

 private:
  struct Block {
    std::size_t first = 0, end = 0;  ///< samples of the block: first, and one past the last
  };
  const JointLog& log_;
  std::vector<Block> blocks_;
  std::size_t fitted_ = 0;
  double scale_ = 1.0, degrees_ = 0.0, mean_temperature_ = 0.0;
};

constexpr double no_goal = std::numeric_limits<double>::infinity();

/// Point of a minimisation: the parameters, the errors of the torque in the fitted blocks, and their
/// derivatives.
struct Trial {
  VectorXd numbers, left;
  MatrixXd by;
  double squares() const { return left.squaredNorm(); }
};

/// Fits positive parameters by Levenberg-Marquardt steps. Ends early if steps gain too little to reach the
/// sum of squares `goal`. Adds to `runs` how often the model was run along the log.
Trial minimise(const Balance& balance, const Model& model, const VectorXd& from, int steps, double goal,
               int& runs) {
  const auto at = [&](const VectorXd& p, bool with_slopes) {
    runs += with_slopes ? model.runs_with_slopes : 1;
    Trial trial;
    trial.numbers = p;
    MatrixXd by;
    trial.left = balance.left(model, p, with_slopes ? &by : nullptr).head(balance.fitted());
    if (with_slopes) trial.by = by.topRows(balance.fitted());
    return trial;
  };
  Trial here = at(from, true);
  double damping = 1e-2;
  constexpr double light = 1e-6;       // damping below which it does not hold a step back
  constexpr double too_little = 1e-5;  // gain of a step over the sum of squares, below which the fit ends
  for (int step = 0; step < steps && damping < 1e8 && !(fit_stopped() && step > 0); ++step) {
    MatrixXd a = here.by.transpose() * here.by;
    const double floor = 1e-12 * std::max(a.diagonal().maxCoeff(), 1e-300);
    a.diagonal() = (a.diagonal() * (1.0 + damping)).array() + floor;
    const VectorXd g = here.by.transpose() * here.left;
    // Limits a Levenberg-Marquardt step: no parameter grows more than tenfold, or falls below a thousandth of
    // its first guess.
    const VectorXd most = 10.0 * here.numbers.array().max(0.1 * from.array());
    const VectorXd least = here.numbers.array().min(1e-3 * from.array()).max(1e-9 * from.array());
    const VectorXd side = a * (here.numbers - least) - g;
    const VectorXd next = (least + solve_nonnegative(a, side, side.size())).array().min(most.array());
    const Trial there = at(next, false);
    if (!(there.squares() < here.squares())) {
      damping *= 4.0;
      continue;
    }
    const double gain = here.squares() - there.squares();
    const bool creeps = damping < light && gain * (steps - step) < here.squares() - goal;
    const bool ends = creeps || gain < too_little * here.squares();
    here = at(next, true);
    if (ends) break;
    damping = std::max(0.3 * damping, 1e-9);
  }
  return here;
}

double rms(const VectorXd& x) {
  return x.size() > 0 ? std::sqrt(x.squaredNorm() / static_cast<double>(x.size())) : std::nan("");
}

JointFit fit_model(const Balance& balance, const Model& model, double goal = no_goal) {
  JointFit fit;
  fit.model = model.name;
  Trial best;
  const auto own = static_cast<Eigen::Index>(model.names.size());
  for (const VectorXd& guess : model.guesses) {
    if (fit_stopped() && best.numbers.size() > 0) break;
    VectorXd from = VectorXd::Ones(own + (balance.degrees() > 0.0 ? 2 : 0));
    from.head(own) = guess;
    const Trial trial = minimise(balance, model, from, 12, no_goal, fit.runs);
    if (best.numbers.size() == 0 || trial.squares() < best.squares()) best = trial;
  }
  best = minimise(balance, model, best.numbers, 100, goal, fit.runs);

  const VectorXd p = best.numbers;
  MatrixXd by;
  const VectorXd left = balance.left(model, p, &by);
  const VectorXd fitted = left.head(balance.fitted());
  fit.fitted_rms = rms(fitted);
  fit.judged_rms = rms(left.tail(balance.blocks() - balance.fitted()));

  // Lists in `told` those parameters that affect the torque. The others stay out of the covariance, which
  // would be singular.
  std::vector<Eigen::Index> told;
  const double noise = std::max(fit.fitted_rms, 1e-12 * balance.scale());
  for (Eigen::Index i = 0; i < p.size(); ++i)
    if (by.col(i).head(balance.fitted()).norm() * p[i] > 0.1 * noise) told.push_back(i);
  MatrixXd j(balance.fitted(), static_cast<Eigen::Index>(told.size()));
  for (std::size_t i = 0; i < told.size(); ++i)
    j.col(static_cast<Eigen::Index>(i)) = by.col(told[i]).head(balance.fitted());
  const double correlated = correlated_samples(fitted);
  const double count = static_cast<double>(balance.fitted()) / correlated;
  const auto free = static_cast<double>((p.array() > 0.0).count());
  fit.criterion = count * std::log(std::max(fitted.squaredNorm(), 1e-300)) + 2.0 * free * std::log(count);
  fit.count = count;
  const MatrixXd spread = covariance(j, fitted, correlated);
  const double freedom =
      static_cast<double>(balance.fitted()) / correlated - static_cast<double>(told.size());
  const double quantile = student_quantile(freedom);
  // Adds to each parameter's standard error the effect of a model that is wrong by 0.4 % of the friction. The
  // motion between samples is unknown, so that even without noise friction is known to a few thousandths
  // only.
  const double shape =
      0.004 * rms(by.topRows(balance.fitted()).middleCols(1, own - 1) * p.segment(1, own - 1));
  for (Eigen::Index i = 0; i < p.size(); ++i) {
    JointEstimate e;
    const bool warms = i >= own;
    e.name = i == own ? "dry friction per degree"
             : warms  ? "viscous friction per degree"
                      : model.names[static_cast<std::size_t>(i)];
    e.unit = warms ? "1/K" : model.units[static_cast<std::size_t>(i)];
    e.value = p[i];
    const auto its = std::find(told.begin(), told.end(), i);
    if (its != told.end()) {
      const auto k = static_cast<Eigen::Index>(its - told.begin());
      const double known = shape / rms(j.col(k));
      const double half = std::hypot(quantile * std::sqrt(std::max(spread(k, k), 0.0)), known);
      e.low = std::max(p[i] - half, 0.0);
      e.high = p[i] + half;
      e.determined = half < p[i];
    }
    if (!warms) {
      fit.numbers.push_back(e);
      continue;
    }
    e.determined = its != told.end() && (e.low > 1.0 || e.high < 1.0);
    for (double* end : {&e.value, &e.low, &e.high}) *end = (*end - 1.0) / balance.degrees();
    fit.warming.push_back(e);
  }
  return fit;
}

VectorXd vector_of(std::initializer_list<double> x) {
  return Eigen::Map<const VectorXd>(x.begin(), static_cast<Eigen::Index>(x.size()));
}

/// Makes a model compute the derivatives of its friction by differences, which takes one more run for each
/// parameter.
void use_differences(Model& model) {
  model.runs_with_slopes = 1 + static_cast<int>(model.names.size());
  model.friction = [along = model.friction](const VectorXd& p, VectorXd& friction, MatrixXd* by) {
    along(p, friction, nullptr);
    if (by == nullptr) return;
    VectorXd there(friction.size());
    for (Eigen::Index i = 0; i < p.size(); ++i) {
      VectorXd q = p;
      const double h = 1e-6 * std::max(p[i], 1e-9);
      q[i] += h;
      along(q, there, nullptr);
      by->col(i) = (there - friction) / h;
    }
  };
}

bristle::JointMaterial material_of(const VectorXd& p) {
  bristle::JointMaterial m;
  double numbers[bristle::joint_parameters];
  for (unsigned i = 0; i < bristle::joint_parameters; ++i) {
    const bool has_inverse = i == bristle::joint_stiffness || i == bristle::joint_stribeck_speed;
    const bool is_torque =
        i == bristle::joint_viscous || i == bristle::joint_base || i == bristle::joint_static_base;
    numbers[i] = std::clamp(p[i + 1], has_inverse ? 1e-9 : 0.0, is_torque || has_inverse ? 1e9 : 100.0);
  }
  std::memcpy(&m, numbers, sizeof m);
  return m;
}

/// Makes the brush as a model of a joint's friction. First guesses of its parameters are in proportion to the
/// log's rms torque and rms speed.
Model brush_model(const JointLog& log, double torque, double speed) {
  Model model;
  model.name = "brush";
  model.names = {"inertia",
                 "stiffness",
                 "viscous",
                 "base",
                 "motor driving",
                 "motor driven",
                 "outside driving",
                 "outside driven",
                 "static base",
                 "static motor driving",
                 "static motor driven",
                 "static outside driving",
                 "static outside driven",
                 "stribeck speed"};
  model.units = {"kg m^2", "N m/rad", "N m s/rad", "N m", "", "", "", "", "N m", "", "", "", "", "rad/s"};
  for (const double bends : {1e-4, 1e-3, 1e-2})
    for (const double fall : {0.1, 1.0})  // Stribeck speeds
      model.guesses.push_back(
          vector_of({0.01 * torque / speed, 0.2 * torque / bends, 0.02 * torque / speed, 0.1 * torque, 0.05,
                     0.05, 0.05, 0.05, 0.05 * torque, 0.02, 0.02, 0.02, 0.02, fall * speed}));
  model.by_motor = [&log, slow = slow_speed(log)](const VectorXd& p, std::size_t k) {
    const double motor = middle(log.motor, k), v = middle(log.speed, k);
    if (std::abs(v) <= slow) return 0.0;
    const double falls = std::exp(-(v / p[13]) * (v / p[13]));
    return motor * v > 0.0 ? -(p[4] + falls * p[9]) : p[5] + falls * p[10];
  };
  // Motor torque in the interval before each sample. In an interval in which it jumps, that of the sample
  // before.
  std::vector<double> led = log.motor;
  const double jump = jump_of(log);
  for (std::size_t k = 1; k < led.size(); ++k)
    if (std::fabs(log.motor[k] - log.motor[k - 1]) > jump) led[k] = log.motor[k - 1];
  model.friction = [&log, led](const VectorXd& p, VectorXd& friction, MatrixXd* by) {
    const bristle::JointMaterial m = material_of(p);
    bristle::JointOptions options = joint_fit_options();
    options.gradients = by != nullptr;
    bristle::JointFriction joint(1, {&m, 1}, options);
    double torque_before = 0.0, torque_now = 0.0;
    double before[bristle::joint_parameters], now[bristle::joint_parameters];
    for (std::size_t k = 0; k < log.t.size(); ++k) {
      if (log.begins(k)) joint.reset();
      bristle::JointOutput out{{&torque_now, 1}};
      if (by != nullptr) out.gradient = now;
      joint.step({{&log.angle[k], 1}, {&log.speed[k], 1}, {&led[k], 1}, {&log.outside[k], 1}}, out);
      if (k > 0) {
        const auto row = static_cast<Eigen::Index>(k) - 1;
        friction[row] = 0.5 * (torque_before + torque_now);
        if (by != nullptr) {
          (*by)(row, 0) = 0.0;
          for (int i = 0; i < static_cast<int>(bristle::joint_parameters); ++i)
            (*by)(row, i + 1) = 0.5 * (before[i] + now[i]);
        }
      }
      torque_before = torque_now;
      std::copy(now, now + bristle::joint_parameters, before);
    }
  };
  return model;
}

/// Adds a friction model that stops a slow joint within an interval if its limit of friction, computed by
/// `budget`, allows: Coulomb, Stribeck, and bam (Duclusaud et al. 2025). Parameters: inertia, viscous
/// coefficient, then those of `budget`.
void add_budget(
    std::vector<Model>& models, const JointLog& log, const char* name, std::vector<const char*> names,
    std::vector<VectorXd> guesses,
    const std::function<double(const VectorXd&, double motor, double outside, double speed)>& budget) {
  Model model;
  model.name = name;
  model.names = {"inertia", "viscous"};
  model.names.insert(model.names.end(), names.begin(), names.end());
  model.units.assign(model.names.size(), "");
  model.guesses = std::move(guesses);
  model.by_motor = [&log, budget, slow = slow_speed(log)](const VectorXd& p, std::size_t k) {
    const double motor = middle(log.motor, k), outside = middle(log.outside, k), v = middle(log.speed, k);
    if (std::abs(v) <= slow) return 0.0;
    const double h = 1e-6 * std::max(std::abs(motor), 1e-6);
    const double grows = (budget(p, motor + h, outside, v) - budget(p, motor - h, outside, v)) / (2.0 * h);
    return v > 0.0 ? -grows : grows;
  };
  model.friction = [&log, budget, slow = slow_speed(log)](const VectorXd& p, VectorXd& friction, MatrixXd*) {
    for (std::size_t k = 0; k + 1 < log.t.size(); ++k) {
      const double motor = middle(log.motor, k), outside = middle(log.outside, k),
                   speed = middle(log.speed, k);
      const double most = budget(p, motor, outside, speed) + p[1] * std::abs(speed);
      // Takes the whole limit as friction of a joint that moves. A joint that may stick has only as much as
      // balances the torques.
      const double stops = std::abs(speed) > slow
                               ? -std::copysign(most, speed)
                               : -(motor + outside) - p[0] * log.speed[k] / (log.t[k + 1] - log.t[k]);
      friction[static_cast<Eigen::Index>(k)] = std::clamp(stops, -most, most);
    }
  };
  use_differences(model);
  models.push_back(std::move(model));
}

std::vector<Model> rival_models(const JointLog& log, double torque, double speed) {
  std::vector<Model> models;
  const double inertia = 0.01 * torque / speed, viscous = 0.02 * torque / speed;
  /// Returns Stribeck's factor of friction at the speed v, which is 1 at rest. Parameter i is its speed,
  /// parameter i + 1 its exponent.
  const auto falls = [](const VectorXd& p, Eigen::Index i, double v) {
    return std::exp(-std::pow(std::abs(v) / p[i], std::clamp(p[i + 1], 0.3, 20.0)));
  };
  const auto starts = [&](std::initializer_list<double> others) {
    std::vector<VectorXd> all;
    for (const double fall : {0.1, 1.0}) {
      std::vector<double> p = {inertia, viscous};
      p.insert(p.end(), others);
      p.push_back(fall * speed);
      p.push_back(1.5);
      all.push_back(Eigen::Map<const VectorXd>(p.data(), static_cast<Eigen::Index>(p.size())));
    }
    return all;
  };
  add_budget(models, log, "Coulomb (m1)", {"base"}, {vector_of({inertia, viscous, 0.2 * torque})},
             [](const VectorXd& p, double, double, double) { return p[2]; });
  add_budget(models, log, "Stribeck (m2)", {"base", "static base", "stribeck speed", "exponent"},
             starts({0.2 * torque, 0.05 * torque}),
             [=](const VectorXd& p, double, double, double v) { return p[2] + falls(p, 4, v) * p[3]; });
  add_budget(models, log, "bam m3", {"base", "load"}, {vector_of({inertia, viscous, 0.1 * torque, 0.1})},
             [](const VectorXd& p, double m, double o, double) { return p[2] + p[3] * std::abs(m - o); });
  add_budget(
      models, log, "bam m4", {"base", "load", "static base", "static load", "stribeck speed", "exponent"},
      starts({0.1 * torque, 0.1, 0.05 * torque, 0.05}), [=](const VectorXd& p, double m, double o, double v) {
        const double gear = std::abs(o - m);
        return p[2] + p[3] * gear + falls(p, 6, v) * (p[4] + p[5] * gear);
      });
  const auto m5 = [=](const VectorXd& p, double m, double o, double v, Eigen::Index stribeck) {
    return p[2] + std::abs(p[3] * o - p[4] * m) +
           falls(p, stribeck, v) * (p[5] + std::abs(p[6] * o - p[7] * m));
  };
  add_budget(models, log, "bam m5",
             {"base", "outside", "motor", "static base", "static outside", "static motor", "stribeck speed",
              "exponent"},
             starts({0.1 * torque, 0.1, 0.1, 0.05 * torque, 0.05, 0.05}),
             [=](const VectorXd& p, double m, double o, double v) { return m5(p, m, o, v, 8); });
  add_budget(
      models, log, "bam m6",
      {"base", "outside", "motor", "static base", "static outside", "static motor", "outside squared",
       "motor squared", "stribeck speed", "exponent"},
      starts({0.1 * torque, 0.1, 0.1, 0.05 * torque, 0.05, 0.05, 0.002, 0.002}),
      [=](const VectorXd& p, double m, double o, double v) {
        double squares = 0.0;
        if (m * o < 0.0)
          squares = std::abs(o) < std::abs(m) ? p[8] * o * o : std::abs(o) > std::abs(m) ? p[9] * m * m : 0.0;
        return m5(p, m, o, v, 10) + falls(p, 10, v) * squares;
      });

  Model lugre;
  lugre.name = "LuGre";
  lugre.names = {"inertia", "viscous", "base", "static base", "stribeck speed", "stiffness", "damping"};
  lugre.units.assign(lugre.names.size(), "");
  for (const double bends : {1e-4, 1e-3, 1e-2})
    for (const double fall : {0.1, 1.0})
      lugre.guesses.push_back(vector_of({inertia, viscous, 0.2 * torque, 0.05 * torque, fall * speed,
                                         0.2 * torque / bends, 0.02 * torque / speed}));
  lugre.friction = [&log](const VectorXd& p, VectorXd& friction, MatrixXd*) {
    rivals::LuGre model{{p[2], p[2] + p[3], p[5], p[6], p[1], p[4]}, {}};
    for (std::size_t k = 0; k + 1 < log.t.size(); ++k)
      friction[static_cast<Eigen::Index>(k)] =
          log.begins(k + 1)
              ? 0.0
              : model.step({log.angle[k + 1] - log.angle[k], 0.0}, log.t[k + 1] - log.t[k], 1.0).mean.x;
  };
  use_differences(lugre);
  models.insert(models.begin() + 2, lugre);
  return models;
}

void require_motion(const JointLog& log) {
  if (log.t.size() < 50)
    throw UserError(fmt::format("{}: {} samples; a joint needs at least 50", log.name, log.t.size()));
  if (!(root_mean_square(log.speed) > 0.0)) throw UserError(log.name + ": the joint does not move");
  if (!(root_mean_square(log.motor) + root_mean_square(log.outside) > 0.0))
    throw UserError(log.name + ": no torque acts");
}

/// Returns whether the outside torque varies by itself, beyond a constant and what follows the motion
/// (acceleration, speed, its direction). If it does not, the log cannot tell how friction depends on a
/// torque.
bool varies_by_itself(const JointLog& log, double torque) {
  const auto n = static_cast<Eigen::Index>(log.t.size());
  MatrixXd motion = MatrixXd::Ones(n, 4);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i), a = k > 0 ? k - 1 : 0, b = std::min(k + 1, log.t.size() - 1);
    motion(i, 1) = (log.speed[b] - log.speed[a]) / (log.t[b] - log.t[a]);
    motion(i, 2) = log.speed[k];
    motion(i, 3) = log.speed[k] > 0.0 ? 1.0 : -1.0;
  }
  const Eigen::Map<const VectorXd> outside(log.outside.data(), n);
  return rms(project(motion, outside).left) > least_load * torque;
}

/// Fits the brush of a joint. Its deflection follows the angle of the log or, if that fits better, is too
/// small for the angles to show; the brush is then rigid and stops the joint up to a limit, as bam's models
/// do. Begins with Coulomb's friction, then adds Stribeck's fall, shares of the torques, and both, as far as
/// the log justifies.
JointFit fit_brush(const JointLog& log, const Balance& balance, bool by_differences = false) {
  const double torque = balance.scale(), speed = root_mean_square(log.speed);
  const bool loaded = varies_by_itself(log, torque);
  Model bent = brush_model(log, torque, speed);
  std::vector<Model> rigid;
  std::vector<const char*> names(bent.names.begin() + 3, bent.names.end());
  add_budget(rigid, log, "brush", names, {},
             [slow = slow_speed(log)](const VectorXd& p, double motor, double outside, double v) {
               const bool drives = motor * (std::abs(v) > slow ? v : motor + outside) > 0.0;
               const auto losses = [&](Eigen::Index base) {
                 return p[base] + p[drives ? base + 1 : base + 2] * std::abs(motor) +
                        p[drives ? base + 3 : base + 4] * std::abs(outside);
               };
               return losses(2) + std::exp(-(v / p[12]) * (v / p[12])) * losses(7);
             });
  // Returns whether a set of terms lacks parameter i of the rigid brush: 0 inertia, 1 viscous, 2 base, 3 to 6
  // shares, 7 static base, 8 to 11 static shares. `falls`: the set has Stribeck's fall; `shares`: it has
  // shares of the torques.
  const auto lacks = [](bool falls, bool shares, Eigen::Index i) {
    if (i >= 8 && i <= 11) return !falls || !shares;
    return (i >= 3 && i <= 6 && !shares) || (i == 7 && !falls);
  };
  // Returns the guesses that differ in what a set of terms has. Tries several stiffnesses unless the fit
  // `before` of fewer terms has one.
  const auto starts = [&, guesses = bent.guesses](bool falls, bool shares, bool is_bent,
                                                  const JointFit& before) {
    std::vector<VectorXd> all;
    const std::size_t speeds = 2, used = is_bent && before.numbers.empty() ? guesses.size() : speeds;
    for (std::size_t k = 0; k < used; k += falls ? 1 : speeds) {
      VectorXd guess = guesses[k];
      for (Eigen::Index i = 2; i < 12; ++i)
        if (lacks(falls, shares, i)) guess[i + 1] = 0.0;
      if (is_bent) {
        if (!before.numbers.empty()) guess[1] = before.numbers[1].value;
        all.push_back(guess);
        continue;
      }
      VectorXd stiff(guess.size() - 1);
      stiff << guess.head(1), guess.tail(guess.size() - 2);
      all.push_back(stiff);
    }
    return all;
  };
  if (by_differences) use_differences(bent);
  const auto with_justified_terms = [&](Model& model, bool is_bent, double goal) {
    JointFit best;
    int runs = 0;
    for (const auto& [falls, shares] :
         {std::pair(false, false), {true, false}, {false, true}, {true, true}}) {
      if ((shares && !loaded) || (fit_stopped() && !best.numbers.empty())) continue;
      model.guesses = starts(falls, shares, is_bent, best);
      const JointFit tried = fit_model(balance, model, goal);
      runs += tried.runs;
      if (!best.numbers.empty() && (tried.criterion >= best.criterion - clearly_closer ||
                                    tried.fitted_rms > least_gain * best.fitted_rms))
        continue;
      best = tried;
    }
    best.runs = runs;
    return best;
  };
  JointFit stiff = with_justified_terms(rigid.front(), false, no_goal);
  const double goal = std::pow(stiff.fitted_rms, 2) * static_cast<double>(balance.fitted());
  JointFit fit = with_justified_terms(bent, true, goal);
  fit.rigid = stiff.fitted_rms < fit.fitted_rms;
  if (fit.rigid) {
    JointEstimate stiffness = fit.numbers[1];
    stiffness.determined = false;
    stiff.numbers.insert(stiff.numbers.begin() + 1, stiffness);
    for (std::size_t i = 0; i < stiff.numbers.size(); ++i) stiff.numbers[i].unit = bent.units[i];
    stiff.rigid = true;
    fit = stiff;
  }
  fit.loaded = loaded;
  VectorXd p(bristle::joint_parameters + 1);
  for (std::size_t i = 0; i < fit.numbers.size(); ++i) p[static_cast<Eigen::Index>(i)] = fit.numbers[i].value;
  fit.material = material_of(p);
  return fit;
}

/// Returns warnings about results that the log does not support, each on a line of its own.
std::string joint_warnings(const JointLog& log, const JointFit& fit) {
  std::string text;
  const double dt = (log.t.back() - log.t.front()) / static_cast<double>(log.t.size() - 1);
  const double expected = noise_of(log.motor) / std::sqrt(std::max(block_time / dt, 1.0));
  if (fit.fitted_rms < too_close * expected)
    text += fmt::format(
        "\nWarning: {:.2g} N m is far below the noise of the motor's torque, {:.2g} N m: another column "
        "follows the "
        "motor's torque itself, and these numbers are not friction.\n",
        fit.fitted_rms, expected);
  if (const double play = joint_play(log, fit.numbers.front().value); play > 0.0)
    text += fmt::format(
        "\nWarning: after reversals the joint moves on by {:.3g} rad nearly without friction: play "
        "(backlash), "
        "which no model here has; friction and inertia are those of the whole.\n",
        play);
  if (!fit.loaded)
    text +=
        "\nThe outside torque does not vary by itself: how friction depends on a torque, and on a load, is "
        "not "
        "told.\n";
  return text;
}

std::string fit_text(const JointLog& log, const JointFit& fit) {
  std::string text = fmt::format(
      "{}: {}.\nA row of {} bristles is off by {:.3g} N m rms of {:.3g}; {} samples over {:.4g} s, {} runs "
      "along the log.\n\n",
      log.name, log.understood, joint_fit_options().bristles, fit.fitted_rms,
      std::hypot(root_mean_square(log.motor), root_mean_square(log.outside)), log.t.size(),
      log.t.back() - log.t.front(), fit.runs);
  Table table({"<number", "value", "95 % from", "to", "<unit"});
  std::string untold;
  std::vector<JointEstimate> numbers = fit.numbers;
  numbers.insert(numbers.end(), fit.warming.begin(), fit.warming.end());
  for (const JointEstimate& e : numbers) {
    if (e.determined)
      table.add({e.name, fmt::format("{:.4g}", e.value), fmt::format("{:.4g}", e.low),
                 fmt::format("{:.4g}", e.high), e.unit});
    else
      untold += (untold.empty() ? "" : ", ") + e.name;
  }
  text += table.text() + joint_warnings(log, fit);
  if (!fit.warming.empty())
    text += fmt::format("\nFriction is that at {:.4g} degrees, the mean of the log's temperature.\n",
                        mean(log.temperature));
  if (fit.rigid)
    text += "\nThe angles do not show how far the joint bends while it sticks: its stiffness is not told.\n";
  if (fit_stopped()) text += fmt::format("\n{}\n", stopped_early);
  if (!untold.empty()) text += "\nNot told by this log: " + untold + ".\n";
  return text;
}

std::string judged_text(const std::vector<JointFit>& fits, const JointPart& part) {
  const JointFit& best =
      *std::min_element(fits.begin(), fits.end(),
                        [](const JointFit& a, const JointFit& b) { return a.judged_rms < b.judged_rms; });
  std::string others;  // models whose errors print alike
  for (const JointFit& fit : fits)
    if (&fit != &best && fit.judged_rms < 1.01 * best.judged_rms)
      others += (others.empty() ? "" : ", ") + fit.model;
  std::string text = fmt::format("{} is closest to what it was not fitted to{}. Fitted to {}; N m, rms.\n\n",
                                 best.model, others.empty() ? others : ", with " + others + " as close",
                                 part.alternate ? fmt::format("every second of {} parts of the log", parts)
                                                : fmt::format("the first {:.4g} s", part.until));
  Table table({"<model", "numbers", "fitted", "judged"});
  for (const JointFit& fit : fits)
    table.add({fit.model, fmt::format("{}", fit.numbers.size()), fmt::format("{:.4g}", fit.fitted_rms),
               fmt::format("{:.4g}", fit.judged_rms)});
  return text + table.text();
}

std::string joint_json(const JointLog& log, const std::vector<JointFit>& fits, const JointPart& part) {
  nlohmann::ordered_json report;
  report["schema"] = "bristle-fit-joint-1";
  report["conditions"] = to_json(conditions());
  report["file"] = log.name;
  report["samples"] = log.t.size();
  report["understood"] = log.understood;
  if (part.alternate)
    report["held_out_parts"] = parts / 2.0;
  else
    report["fit_until_s"] = std::min(part.until, log.t.back() - log.t.front());
  for (const JointFit& fit : fits) {
    nlohmann::ordered_json model = {
        {"model", fit.model}, {"runs", fit.runs}, {"fitted_rms_nm", fit.fitted_rms}, {"rigid", fit.rigid}};
    if (!std::isnan(fit.judged_rms)) model["judged_rms_nm"] = fit.judged_rms;
    const auto entry = [](const JointEstimate& e) {
      return nlohmann::ordered_json{{"name", e.name}, {"unit", e.unit}, {"value", e.value},
                                    {"low", e.low},   {"high", e.high}, {"determined", e.determined}};
    };
    for (const JointEstimate& e : fit.numbers) model["numbers"].push_back(entry(e));
    for (const JointEstimate& e : fit.warming) model["numbers"].push_back(entry(e));
    report["models"].push_back(model);
  }
  return report.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + '\n';
}

}  // namespace

bristle::JointOptions joint_fit_options() { return {}; }

JointLog parse_joint_log(std::string_view text, const std::string& name, const FitReading& reading,
                         std::optional<double> torque_constant, std::optional<double> pendulum) {
  constexpr const char* expected = "t,angle,speed,motor,outside";
  std::size_t first_line = 1;
  text = skip_to_header(text, name, expected, first_line);
  const auto has_torque = [&](const std::vector<bool>& present) {
    return present[column_motor] || present[column_current] || present[column_outside] || pendulum;
  };
  const PlainCsv csv =
      plain_csv(text, name, first_line, kinds, column_wishes(kinds, reading.columns, reading.units),
                [&](const std::vector<bool>& present) {
                  return present[column_t] && present[column_angle] && has_torque(present);
                });
  const std::string where_header = fmt::format("{}:{}", name, csv.header_line);
  const std::string_view plain = csv.text;
  const CsvHeader header = read_csv_header(plain.substr(0, plain.find('\n')), where_header, kinds);
  const auto need = [&](bool there, const char* what, const char* ours) {
    if (!there)
      throw UserError(fmt::format("{}: no column {}; expected {}, or your own names: --columns {}=NAME",
                                  where_header, what, expected, ours));
  };
  need(header.present[column_t], "t", "t");
  need(header.present[column_angle], "angle", "angle");
  need(has_torque(header.present), "motor (nor current, nor outside)", "motor");
  if (header.present[column_current] && !header.present[column_motor] && !torque_constant)
    throw UserError(where_header + ": column current: --torque-constant says how much torque an ampere is");
  if (torque_constant && (header.present[column_motor] || !header.present[column_current]))
    throw UserError(
        fmt::format("{}: --torque-constant is for a column current, {}", where_header,
                    header.present[column_motor] ? "and here is column motor" : "and here is none"));
  JointLog log;
  log.name = name;
  log.understood = mapping_text(csv, kinds);
  for (const std::string& other : header.other_columns)
    log.understood += "; column " + other + " is not used";
  log.has_speed = header.present[column_speed];
  log.has_outside = header.present[column_outside] || pendulum.has_value();
  for_csv_rows(plain, name, csv.header_line, header, kinds, [&](const auto& cells, const auto& where) {
    double value[column_count] = {};
    for (unsigned c = 0; c < column_count; ++c)
      if (header.present[c]) value[c] = parse_cell(cells[c], kinds[c], header.per_si[c], where());
    if (!log.t.empty()) require_later(value[column_t], log.t.back(), where());
    log.t.push_back(value[column_t]);
    log.angle.push_back(value[column_angle]);
    log.speed.push_back(value[column_speed]);
    log.motor.push_back(header.present[column_motor] ? value[column_motor]
                                                     : value[column_current] * torque_constant.value_or(0.0));
    if (header.present[column_temperature]) log.temperature.push_back(value[column_temperature]);
    log.outside.push_back(value[column_outside] - pendulum.value_or(0.0) * std::sin(value[column_angle]));
  });
  const std::size_t n = log.t.size();
  if (!log.has_speed && n > 1)
    for (std::size_t k = 0; k < n; ++k) {
      const std::size_t a = k > 0 ? k - 1 : 0, b = std::min(k + 1, n - 1);
      log.speed[k] = (log.angle[b] - log.angle[a]) / (log.t[b] - log.t[a]);
    }
  require_motion(log);
  return log;
}

void append(JointLog& log, const JointLog& more) {
  if (log.t.empty()) {
    log = more;
    return;
  }
  if (log.temperature.empty() || more.temperature.empty())
    log.temperature.clear();
  else
    log.temperature.insert(log.temperature.end(), more.temperature.begin(), more.temperature.end());
  log.parts.push_back(log.t.size());
  const double shift = log.t.back() + 1.0 - more.t.front();
  for (const double t : more.t) log.t.push_back(t + shift);
  for (std::vector<double> JointLog::*column :
       {&JointLog::angle, &JointLog::speed, &JointLog::motor, &JointLog::outside})
    (log.*column).insert((log.*column).end(), (more.*column).begin(), (more.*column).end());
  log.has_speed = log.has_speed && more.has_speed;
  log.has_outside = log.has_outside || more.has_outside;
  log.understood += fmt::format("; and {}: {}", more.name, more.understood);
}

double joint_play(const JointLog& log, double inertia) {
  constexpr double absent = 0.3, present = 0.7;  // friction over the median of the moving joint's friction
  constexpr std::size_t fewest_reversals = 4, fewest_blocks = 3;
  struct Step {
    double angle, speed, friction;
  };
  std::vector<Step> steps;
  for (std::size_t a = 0, b = 1; b < log.t.size(); ++b) {
    if (log.begins(b)) {
      a = b;
      continue;
    }
    const double time = log.t[b] - log.t[a];
    if (time < block_time * (1.0 - 1e-9)) continue;
    double torque = 0.0;
    for (std::size_t k = a; k < b; ++k)
      torque += (log.t[k + 1] - log.t[k]) / time * (middle(log.motor, k) + middle(log.outside, k));
    steps.push_back({log.angle[b], 0.5 * (log.speed[a] + log.speed[b]),
                     torque - inertia * (log.speed[b] - log.speed[a]) / time});
    a = b;
  }
  std::vector<double> sizes, paths;
  for (const Step& s : steps) sizes.push_back(std::fabs(s.friction));
  if (sizes.empty()) return 0.0;
  const double usual = quantile_of(sizes, 0.5);
  for (std::size_t reversal = 1; reversal < steps.size(); ++reversal) {
    if (steps[reversal].speed * steps[reversal - 1].speed >= 0.0) continue;
    const double sign = steps[reversal].speed > 0.0 ? 1.0 : -1.0;
    double path = 0.0, without = 0.0;
    std::size_t blocks = 0;
    for (std::size_t i = reversal; i < steps.size() && sign * steps[i].speed > 0.0; ++i) {
      const double share = sign * steps[i].friction / usual,
                   move = std::fabs(steps[i].angle - steps[i - 1].angle);
      if (share > present) break;
      path += move;
      if (std::fabs(share) > absent) continue;
      without += move;
      ++blocks;
    }
    paths.push_back(blocks >= fewest_blocks && without > 0.6 * path ? without : 0.0);
  }
  return paths.size() < fewest_reversals ? 0.0 : quantile_of(paths, 0.5);
}

JointLog pieces_of(JointLog log, std::size_t most) {
  constexpr std::size_t pieces = 24;
  const std::size_t n = log.t.size(), each = most / pieces;
  if (n <= most) return log;
  std::vector<std::size_t> stay, parts;
  for (std::size_t piece = 0; piece < pieces; ++piece) {
    const std::size_t begin = piece * (n - each) / (pieces - 1);
    for (std::size_t k = begin; k < begin + each; ++k) {
      if (k == begin ? piece > 0 : log.begins(k)) parts.push_back(stay.size());
      stay.push_back(k);
    }
  }
  for (std::vector<double>* column :
       {&log.t, &log.angle, &log.speed, &log.motor, &log.outside, &log.temperature}) {
    if (column->empty()) continue;
    std::vector<double> taken;
    for (const std::size_t k : stay) taken.push_back((*column)[k]);
    *column = std::move(taken);
  }
  log.parts = std::move(parts);
  log.understood += fmt::format("; {} pieces of {} of its {} rows are fitted", pieces, each, n);
  return log;
}

JointFit fit_joint(const JointLog& log, JointPart part, bool by_differences) {
  require_motion(log);
  return fit_brush(log, Balance(log, part), by_differences);
}

std::vector<JointFit> judge_joint(const JointLog& log, JointPart part) {
  require_motion(log);
  const Balance balance(log, part);
  Progress progress("fit");
  std::vector<JointFit> fits;
  const std::vector<Model> models = rival_models(log, balance.scale(), root_mean_square(log.speed));
  for (const Model& model : models) {
    fits.push_back(fit_model(balance, model));
    progress.update(static_cast<double>(fits.size()) / static_cast<double>(models.size() + 1));
  }
  fits.push_back(fit_brush(log, balance));
  return fits;
}

void fit_joint_command(const FitOptions& options) {
  if (options.fit_until && !options.rivals) throw UserError("--fit-until: only with --rivals");
  if (!options.write.empty() || !options.csv.empty() || !options.html.empty() || !options.plot.empty())
    throw UserError("--joint: writes a table and --json only");
  std::vector<FileOption> inputs;
  for (const std::string& data : options.data) inputs.push_back({"DATA", data});
  const bool on_stdout = check_files(inputs, {{"--json", options.json}});
  OutputFile json(options.json);
  stop_fits_on_signals();
  JointLog log;
  for (const std::string& data : options.data)
    append(log, parse_joint_log(read_text_file(data), data, options.reading, options.torque_constant,
                                options.pendulum));
  log = pieces_of(std::move(log), most_samples);
  JointPart part;
  if (options.fit_until) part.until = *options.fit_until;
  if (part.until >= log.t.back() - log.t.front() && options.fit_until)
    throw UserError("--fit-until: nothing is left to judge");
  part.alternate = options.rivals && !options.fit_until;
  announce("fit", options.quiet, [&] {
    const Model brush = brush_model(log, 1.0, 1.0);
    VectorXd friction(static_cast<Eigen::Index>(log.t.size()) - 1);
    const Stopwatch one_run;
    brush.friction(brush.guesses.front(), friction, nullptr);
    return one_run.seconds() * (options.rivals ? runs_with_rivals : usual_runs);
  });
  const std::vector<JointFit> fits =
      options.rivals ? judge_joint(log, part) : std::vector<JointFit>{fit_joint(log, part)};
  if (json) json.write(joint_json(log, fits, part));
  if (!on_stdout)
    print_report((options.rivals ? judged_text(fits, part) + "\n" : "") + fit_text(log, fits.back()));
}

}  // namespace cli
