#include "tools/libraries/stability/loop.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>

#include <bristle/patch_batch.hpp>

#include "tools/libraries/scene/couplings.hpp"
#include "tools/libraries/scene/snap_law.hpp"

namespace cli {
namespace {

constexpr double zeta = 1000.0;  // number of bristles in contact at the largest load, 1 N
// Amplitude, in mean snap lengths, below which the mass counts as at rest.
constexpr double rest_amplitude = 1e-7;
// Amplitude, in mean snap lengths, above which the motion counts as growing without bound.
constexpr double bound_amplitude = 1e5;
// Ratio of the energy in the last quarter of a run to that in the third quarter above which snapping counts
// as lasting.
constexpr double lasting_energy = 0.8;

// Peak-to-peak motion, in mean snap lengths, above which snapping counts as lasting. It is the length of the
// shortest bristle, since lengths are uniform from 0.5 to 1.5.
constexpr double lasting_amplitude = 0.5;
constexpr double quanta_at_rest = 4.0;  // motion in encoder counts, below which the mass rests

// Exact motion of a mass in a step during which the force is held: change of position x and velocity v per
// unit of initial velocity and per unit of force.
struct Hold {
  double x_of_v, x_of_f, v_of_v, v_of_f;
};
Hold hold_of(double mass, double device_damping, double dt) {
  const double a = device_damping * dt / mass;
  if (a < 1e-9) return {dt, 0.5 * dt * dt / mass, 1.0, dt / mass};
  const double fall = -std::expm1(-a);  // 1 - exp(-a), a: damping exponent of a step
  const double x_of_v = dt * fall / a;
  return {x_of_v, (dt - x_of_v) / device_damping, 1.0 - fall, fall / device_damping};
}

// State of the mass along one axis of the closed loop.
struct Axis {
  double x = 0.0, v = 0.0;
  double last_d = 0.0;
  double force = 0.0;  // force on the mass in the next step, N
};

// Advances the mass by one step along an axis, for an explicit scheme. Returns its displacement and sets v to
// its velocity at the end of the step.
double advance(Scheme scheme, const Hold& hold, double mass, double dt, Axis& a) {
  const double v0 = a.v;
  if (scheme == Scheme::explicit_euler) {
    a.v += dt / mass * a.force;
    return dt * v0;
  }
  if (scheme == Scheme::semi_implicit || scheme == Scheme::semi_implicit_mean) {
    a.v += dt / mass * a.force;
    return dt * a.v;
  }
  a.v = hold.v_of_v * v0 + hold.v_of_f * a.force;
  return hold.x_of_v * v0 + hold.x_of_f * a.force;
}

bool damper_sees_true_velocity(Scheme scheme) {
  return scheme == Scheme::explicit_euler || scheme == Scheme::hold;
}

// Returns the matrix of one step of the loop with a linear spring and damper in place of the patch, over
// (position, velocity times T, last displacement), for dimensionless stiffness k, damping c and device
// damping beta.
Eigen::Matrix3d linear_loop(Scheme scheme, double k, double c, double beta) {
  const Hold hold = hold_of(1.0, beta, 1.0);
  Eigen::Matrix3d matrix;
  for (int column = 0; column < 3; ++column) {
    const Eigen::Vector3d unit = Eigen::Vector3d::Unit(column);
    Axis a{unit[0], unit[1], unit[2], 0.0};
    const double deflection = uses_mean(scheme) ? a.x - 0.5 * a.last_d : a.x;
    const double velocity = damper_sees_true_velocity(scheme) ? a.v : a.last_d;
    a.force = -k * deflection - c * velocity;
    const double d = advance(scheme, hold, 1.0, 1.0, a);
    matrix.col(column) << a.x + d, a.v, d;
  }
  return matrix;
}

// Returns the largest magnitude of an eigenvalue. Takes matrices of dynamic size, because a solver for each
// fixed size would double the time to compile.
double spectral_radius(const Eigen::MatrixXd& matrix) {
  return Eigen::EigenSolver<Eigen::MatrixXd>(matrix, false).eigenvalues().cwiseAbs().maxCoeff();
}

class Loop {
 public:
  explicit Loop(const LoopSetup& setup);
  LoopResult run();

 private:
  struct Quarter {
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    double fastest = 0.0;
    std::uint64_t snaps = 0;
    double peak_to_peak() const { return std::max(high[0] - low[0], high[1] - low[1]); }
  };
  void slide_in();
  void step(double load);
  void step_explicitly();
  void step_implicitly();
  void displace(int axis, double d);
  double next_load(std::uint64_t i) const;
  double energy(const Quarter& q) const;
  Verdict judge(const Quarter& before, const Quarter& last) const;

  const LoopSetup s_;
  bristle::PatchBatch batch_;
  bristle::Motion motion_;
  bristle::Response response_;
  Hold hold_;
  Axis axis_[2];
  bristle::MovingBody<2> body_;
  bristle::BodyContact<2> contact_;
};

Loop::Loop(const LoopSetup& setup) : s_(setup), hold_(hold_of(s_.mass_kg, s_.device_damping, s_.dt_s)) {
  const double dbar = s_.mean_snap_length;
  const auto material = bristle::Material{}
                            .with_bristle_stiffness(s_.stiffness / zeta)
                            .with_bristle_damping(s_.damping / zeta)
                            .with_stribeck_velocity(s_.stribeck_velocity)
                            .with_normal_stiffness(1e6 / zeta)
                            .with_asperity_height_deviation(1e-6)
                            .with_snap_length(bristle::SnapLength::uniform(0.5 * dbar, 1.5 * dbar))
                            .with_snap_rule(s_.rule);
  const auto outputs =
      uses_mean(s_.scheme) ? bristle::Outputs::mean | bristle::Outputs::energy : bristle::Outputs::energy;
  motion_.id = batch_.add(material, bristle::PatchOptions{}
                                        .with_max_normal_load(1.0)
                                        .with_bristles(s_.bristles)
                                        .with_population(s_.population)
                                        .with_axes(s_.axes)
                                        .with_outputs(outputs)
                                        .with_precision(BRISTLE_WITH_DOUBLE ? bristle::Precision::double_
                                                                            : bristle::Precision::single));
  batch_.warm_up();
  body_.mass *= s_.mass_kg;
  contact_.axes = s_.axes;
  slide_in();
  // Begins the run as if the mass had arrived with the start velocity in the step before.
  axis_[0].v = s_.start_velocity;
  axis_[0].last_d = s_.dt_s * s_.start_velocity;
  axis_[0].force =
      response_.elastic[0] - material.damping_at(std::fabs(s_.start_velocity)) * zeta * s_.start_velocity;
}

// Slides thirty mean snap lengths before the run, in steps of which no whole number makes a snap length.
void Loop::slide_in() {
  motion_.normal_load = next_load(0);
  if (!s_.sliding) return;
  for (int i = 0; i < 400; ++i) {
    motion_.displacement[0] = 0.0731 * s_.mean_snap_length;
    batch_.step(s_.dt_s, {&motion_, 1}, {&response_, 1});
  }
}

double Loop::next_load(std::uint64_t i) const {
  if (s_.smallest_load == 1.0) return 1.0;
  const double phase = static_cast<double>(i % s_.load_period) / static_cast<double>(s_.load_period);
  return s_.smallest_load + (1.0 - s_.smallest_load) * (0.5 + 0.5 * std::cos(2.0 * M_PI * phase));
}

void Loop::displace(int axis, double d) {
  const double before = axis_[axis].x;
  axis_[axis].x += d;
  axis_[axis].last_d = d;
  const double q = s_.quantum_m;
  // Computes the displacement that an encoder would report: positions rounded to counts, then subtracted.
  motion_.displacement[axis] =
      q > 0.0 ? q * (std::nearbyint(axis_[axis].x / q) - std::nearbyint(before / q)) : d;
}

void Loop::step_explicitly() {
  for (int a = 0; a < s_.axes; ++a) {
    displace(a, advance(s_.scheme, hold_, s_.mass_kg, s_.dt_s, axis_[a]));
    motion_.has_velocity = damper_sees_true_velocity(s_.scheme);
    motion_.velocity[a] = axis_[a].v;
  }
  batch_.step(s_.dt_s, {&motion_, 1}, {&response_, 1});
  const auto& force = uses_mean(s_.scheme) ? response_.mean : response_.end;
  for (int a = 0; a < s_.axes; ++a) axis_[a].force = force[a];
}

void Loop::step_implicitly() {
  const bristle::BodyVector<2> none = Eigen::Vector2d::Zero();
  const bristle::Span<bristle::BodyContact<2>> contacts(&contact_, 1);
  const bristle::Span<bristle::Motion> motions(&motion_, 1);
  const bristle::Span<const bristle::Response> responses(&response_, 1);
  for (int a = 0; a < 2; ++a) body_.velocity[a] = axis_[a].v;
  if (s_.scheme == Scheme::predictor) {
    predict_displacements<2>(batch_, s_.dt_s, body_, none, contacts, motions);
  } else if (s_.scheme == Scheme::midpoint) {
    solve_displacements<2>(batch_, s_.dt_s, body_, none, contacts, motions);
  } else {
    // Lets the spring act beyond its limit, without clipping it. This is the fault that the scheme is to
    // show.
    bristle::LinearFriction always_on(response_, s_.dt_s, motion_.normal_load);
    always_on.limited = false;
    const Eigen::Matrix2d mobility = Eigen::Matrix2d::Identity() / s_.mass_kg;
    const Eigen::Vector2d v(axis_[0].v, axis_[1].v);
    const Eigen::Vector2d impulse = always_on.impulse(motion_.normal_load * s_.dt_s, s_.dt_s, mobility, v);
    for (int a = 0; a < s_.axes; ++a)
      motion_.displacement[a] = s_.dt_s * (axis_[a].v + impulse[a] / s_.mass_kg);
  }
  batch_.step(s_.dt_s, motions, {&response_, 1});
  if (s_.scheme == Scheme::predictor) {
    apply_end_forces<2>(s_.dt_s, body_, none, contacts, responses);
  } else if (s_.scheme == Scheme::midpoint) {
    apply_mean_forces<2>(s_.dt_s, body_, none, contacts, responses);
  }
  for (int a = 0; a < s_.axes; ++a) {
    axis_[a].x += motion_.displacement[a];
    axis_[a].v = s_.scheme == Scheme::linear_always ? motion_.displacement[a] / s_.dt_s : body_.velocity[a];
  }
}

void Loop::step(double load) {
  motion_.normal_load = load;
  if (is_implicit(s_.scheme)) {
    step_implicitly();
  } else {
    step_explicitly();
  }
}

// Returns the energy (J) of the mass on a spring as stiff as all sticking bristles together, from the highest
// speed and half the peak-to-peak motion in one quarter of the run.
double Loop::energy(const Quarter& q) const {
  const double amplitude = 0.5 * q.peak_to_peak();
  return 0.5 * s_.mass_kg * q.fastest * q.fastest + 0.5 * s_.stiffness * amplitude * amplitude;
}

Verdict Loop::judge(const Quarter& before, const Quarter& last) const {
  if (s_.quantum_m > 0.0 && last.peak_to_peak() <= quanta_at_rest * s_.quantum_m) return Verdict::settles;
  const double ratio = energy(last) / energy(before);
  if (last.snaps > 0) {
    const bool lasts =
        ratio > lasting_energy || last.peak_to_peak() > lasting_amplitude * s_.mean_snap_length;
    return lasts ? Verdict::rings : Verdict::settles;
  }
  return ratio > 1.0 ? Verdict::grows : Verdict::settles;
}

LoopResult Loop::run() {
  LoopResult result;
  const std::uint64_t length = std::max<std::uint64_t>(s_.steps / 4, 1);
  const double rest = rest_amplitude * s_.mean_snap_length, bound = bound_amplitude * s_.mean_snap_length;
  Quarter quarters[4];
  for (int q = 0; q < 4; ++q) {
    Quarter& now = quarters[q];
    if (q == 1 && s_.turn && s_.axes == 2) axis_[1].v += s_.start_velocity;
    // Lowest and highest position (m) and highest speed (m/s) in this quarter of the run.
    double low = INFINITY, high = -INFINITY, fastest = 0.0;
    for (std::uint64_t i = 0; i < length; ++i) {
      step(next_load(static_cast<std::uint64_t>(q) * length + i));
      now.snaps += response_.snaps;
      const double speed = std::hypot(axis_[0].v, axis_[1].v);
      for (int a = 0; a < s_.axes; ++a) {
        now.low[a] = std::min(now.low[a], axis_[a].x);
        now.high[a] = std::max(now.high[a], axis_[a].x);
        low = std::min(low, axis_[a].x);
        high = std::max(high, axis_[a].x);
      }
      now.fastest = std::max(now.fastest, speed);
      fastest = std::max(fastest, speed);
      result.distance_m = std::max(result.distance_m, axis_[0].x);
      if (!(speed * s_.dt_s < bound)) {
        result.unbounded = true;
        result.verdict = Verdict::grows;
        result.highest_speed = speed;
        result.peak_to_peak_m = now.peak_to_peak();
        return result;
      }
      if (s_.stop_early && s_.axes == 1 && i % 100 == 99) {
        if (high - low < rest && fastest * s_.dt_s < rest) return result;
        low = INFINITY, high = -INFINITY, fastest = 0.0;
      }
    }
  }
  result.peak_to_peak_m = quarters[3].peak_to_peak();
  result.highest_speed = quarters[3].fastest;
  result.energy_ratio = energy(quarters[3]) / energy(quarters[2]);
  const bool still = result.peak_to_peak_m < rest && result.highest_speed * s_.dt_s < rest;
  result.verdict = still ? Verdict::settles : judge(quarters[2], quarters[3]);
  return result;
}

}  // namespace

namespace {

struct SchemeText {
  const char *name, *linear_condition;
};
/// Names and linear stability conditions of the integration schemes, in the order of Scheme.
constexpr SchemeText schemes[] = {{"explicit Euler", "k < c < 2 + k/2"},
                                  {"semi-implicit, end", "k + 2c < 4"},
                                  {"semi-implicit, mean", "k < 2c and c < 2"},
                                  {"coupling, predictor", "always"},
                                  {"coupling, midpoint", "always"},
                                  {"linear solve, always on", "always"},
                                  {"hold, true velocity", "k < 2c and c < 2"},
                                  {"hold, difference", "k < 2c(2-c)/(2+c)"},
                                  {"device, end, encoder", "about k < 2 beta"},
                                  {"device, mean", "about k < beta"}};

}  // namespace

const char* to_string(Scheme scheme) noexcept { return schemes[static_cast<int>(scheme)].name; }

const char* linear_condition(Scheme scheme) noexcept {
  return schemes[static_cast<int>(scheme)].linear_condition;
}

const char* to_string(Verdict verdict) noexcept {
  return verdict == Verdict::settles ? "settles" : verdict == Verdict::grows ? "grows" : "rings";
}

double linear_radius(Scheme scheme, double k, double c, double beta) {
  return spectral_radius(linear_loop(scheme, k, c, beta));
}

double sliding_radius(Scheme scheme, double c, double beta) {
  return spectral_radius(linear_loop(scheme, 0.0, c, beta).bottomRightCorner<2, 2>());
}

bool linearly_stable(Scheme scheme, double k, double c, double beta) {
  return is_implicit(scheme) || linear_radius(scheme, k, c, beta) < 1.0;
}

double LoopSetup::kinetic_n() const noexcept {
  return kinetic_bend(rule, std::sqrt(1.0 / 12.0)) * stiffness * mean_snap_length;
}

LoopResult run_loop(const LoopSetup& setup) { return Loop(setup).run(); }

}  // namespace cli
