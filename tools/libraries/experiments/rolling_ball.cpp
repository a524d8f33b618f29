// Experiment on a ball that rolls down a slope, rolls on level ground, and is thrown without spin.
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>

#include <bristle/bed.hpp>
#include <bristle/patch_batch.hpp>

#include "tools/libraries/experiments/experiment.hpp"

namespace cli {
namespace {

constexpr double gravity = 9.81;  // m/s^2

/// Friction force on the ball (N), and its decrease per metre of slip (N/m), for an implicit solve.
struct Pull {
  double force = 0.0, slope = 0.0;
};

/// Function for the ground under a ball: from the slip of the surfaces in a step and the rolled distance (m)
/// it gives the friction force. `keeps`: whether the step is made or only tried.
using Ground = std::function<Pull(double slip, double rolled, bool keeps)>;

Ground make_ground(const std::string& model, const Settings& s, double load) {
  const double friction = s.number("friction"), dt = s.number("dt");
  if (model == "coulomb") {
    const double per_slip = friction * load / (s.number("creep_velocity") * dt);
    return [=](double slip, double, bool) {
      const double force = std::clamp(-per_slip * slip, -friction * load, friction * load);
      return Pull{force, std::fabs(force) < friction * load ? per_slip : 0.0};
    };
  }
  if (model == "patch") {
    bristle::Coefficients law;
    law.kinetic = friction;
    law.peak = 1.1 * friction;
    law.presliding_length = s.number("presliding");
    const auto batch = std::make_shared<bristle::PatchBatch>();
    bristle::Motion m;
    m.id = batch->add(bristle::Material::from_coefficients(law),
                      bristle::PatchOptions{}.with_max_normal_load(load));
    m.normal_load = load;
    return [=](double slip, double, bool keeps) mutable {
      m.displacement[0] = slip;
      const auto r = take(*batch, m, keeps, dt);
      return Pull{r.end[0], r.stiffness};
    };
  }
  const auto beds = std::make_shared<bristle::BedBatch>();
  bristle::BedOptions options;
  options.max_normal_load = load;
  bristle::BedMotion m;
  m.id = beds->add(
      bristle::BedMaterial(friction).with_elastic(s.number("shear_modulus"), 0.5, s.number("radius")),
      bristle::BedShape::disc(0.0, bristle::BedPressure::hertz).rolling(16, 6), options);
  m.normal_load = load;
  return [=](double slip, double rolled, bool keeps) mutable {
    m.displacement[0] = slip;
    m.rolled[0] = rolled;
    const auto r = take(*beds, m, keeps);
    return Pull{r.force[0], r.tangent[0][0]};
  };
}

struct Ball {
  double v = 0.0, rim = 0.0;  ///< speed of the ball's centre, and of its surface by spin, m/s
};

/// Rolls a ball for a time (s). Solves friction implicitly, and calls `look` after every step.
void roll(const ExperimentRun& run, double degrees, Ball ball, double time,
          const std::function<void(double, const Ball&)>& look) {
  const Settings& s = run.settings;
  const double mass = s.number("mass"), dt = s.number("dt"), angle = degrees * M_PI / 180.0;
  const Ground ground = make_ground(run.model, s, mass * gravity * std::cos(angle));
  // Change of slip in a step by 1 N of friction (m/N): dt^2 (1/m + R^2 / I), with the ball's moment of
  // inertia I = 2/5 m R^2.
  const double per_force = 3.5 * dt * dt / mass;
  for (long k = 1; k <= std::lround(time / dt); ++k) {
    ball.v += dt * gravity * std::sin(angle);
    const Pull pull = ground(dt * (ball.v - ball.rim), dt * ball.rim, false);
    const double force = pull.force / (1.0 + pull.slope * per_force);
    ball.v += dt * force / mass;
    ball.rim -= 2.5 * dt * force / mass;
    ground(dt * (ball.v - ball.rim), dt * ball.rim, true);
    look(static_cast<double>(k) * dt, ball);
  }
}

void run_rolling_ball(ExperimentRun& run) {
  const Settings& s = run.settings;
  const double degrees = s.number("slope"), speed = s.number("speed"), time = s.number("time");
  Ball middle, last;
  const auto show = [&](const char* panel, double t, const Ball& b) {
    if (std::fmod(t + 1e-9, 0.02) < s.number("dt"))
      run.add(panel, {t, b.v, b.rim, b.v != 0.0 ? (b.v - b.rim) / b.v : 0.0});
  };
  roll(run, degrees, {}, time, [&](double t, const Ball& b) {
    show("slope", t, b);
    if (t <= 0.5 * time) middle = b;
    last = b;
  });
  const double pace = gravity * std::sin(degrees * M_PI / 180.0);
  const double ratio = (last.v - middle.v) / (0.5 * time * pace) * 7.0 / 5.0;
  run.add("rolls_down", ratio, std::fabs(ratio - 1.0) < 0.01);
  const double creep[2] = {(middle.v - middle.rim) / middle.v, (last.v - last.rim) / last.v};
  const double kept = creep[0] > 1e-9 ? creep[1] / creep[0] : 0.0;
  run.add("creeps_by_distance", kept, std::fabs(kept - 1.0) < 0.1);
  roll(run, 0.0, {speed, speed}, time, [&](double, const Ball& b) { last = b; });
  const double lost = 1.0 - last.v / speed;
  run.add("rolls_on", 100.0 * lost, std::fabs(lost) < 1e-5);
  roll(run, 0.0, {speed, 0.0}, time, [&](double t, const Ball& b) {
    show("thrown", t, b);
    last = b;
  });
  const double end = last.v / speed;
  run.add("thrown_rolls", end, std::fabs(end - 5.0 / 7.0) < 0.01);
}

}  // namespace

Experiment rolling_ball_experiment() {
  return {
      "rolling-ball",
      "a rubber ball that rolls down a slope, on the level, and after it was thrown without spin",
      "All three come to roll, and only the bed's surface creeps in proportion to the distance rolled",
      {number_parameter("mass", 0.5, "kg", "of the ball", 1e-6, 1e3),
       number_parameter("radius", 0.05, "m", "of the ball", 1e-4, 10.0),
       number_parameter("friction", 0.6, "", "coefficient", 0.01, 10.0),
       number_parameter("shear_modulus", 1e6, "Pa", "of the rubber: bed", 1e3, 1e12),
       number_parameter("presliding", 1e-4, "m", "presliding length: patch", 1e-9, 1.0),
       number_parameter("creep_velocity", 1e-3, "m/s", "full friction from this slip on: coulomb", 1e-9, 1.0),
       number_parameter("slope", 10.0, "deg", "", 0.1, 60.0),
       number_parameter("speed", 2.0, "m/s", "on the level", 1e-3, 100.0),
       number_parameter("time", 2.0, "s", "of each motion", 0.1, 100.0),
       number_parameter("dt", 2e-4, "s", "time step", 1e-6, 1e-2)},
      {{"rolls_down", "a ball rolls down a slope",
        "without slip its acceleration is 5/7 g sin(slope), whatever the friction (Galileo's inclined plane)",
        "acceleration in the second half, over that", "", "within 1 % of 1"},
       {"creeps_by_distance", "its surface creeps by the distance rolled",
        "a contact that carries a force lags by a share of the distance, the same at any speed (Carter 1926; "
        "Johnson 1958 for balls)",
        "creepage at the end of the slope over that at half the time", "", "0.9 to 1.1"},
       {"rolls_on", "and is not slowed on the level", "friction does no work where nothing slips",
        "speed lost", "%", "below 1e-3"},
       {"thrown_rolls", "a ball thrown without spin comes to roll",
        "at 5/7 of its speed, whatever the friction (Coriolis 1835, billiards)",
        "speed at the end over the first", "", "within 0.01 of 5/7"}},
      {"t[s]", "v[m/s]", "rim[m/s]", "creepage"},
      &run_rolling_ball,
      {{"coulomb", "Coulomb"}, {"patch", "patch, dragged"}, {"bed", "bed"}}};
}

}  // namespace cli
