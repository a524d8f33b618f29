#include "tools/libraries/stability/pulled.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <bristle/patch_batch.hpp>

#include "tools/libraries/scene/couplings.hpp"

namespace cli {
namespace {

using Complex = std::complex<double>;

/// Life of the bristles with one snap length in steady sliding with ageing: their age (s) at the snap, and
/// the speed (m/s) at which their deflection then gains on the snap length, which grows with age.
struct Life {
  double age, gain;
};

std::vector<Life> lives(const SpringPull& pull) {
  constexpr int bristles = 2000;
  const bristle::Material& m = pull.material;
  const double v = pull.speed_m_per_s;
  std::vector<Life> all;
  for (int i = 0; i < bristles; ++i) {
    const double length = m.snap_length.quantile((i + 0.5) / bristles);
    double age = length / v, last = 0.0;
    // Iterates to the age at which a bristle snaps; the iteration converges from below.
    for (int k = 0; k < 200 && age - last > 1e-15 * age; ++k) {
      last = age;
      age = length * m.ageing_factor(age) / v;
    }
    const double step = 1e-4 * age;
    const double slope = (m.ageing_factor(age + step) - m.ageing_factor(age - step)) / (2.0 * step);
    all.push_back({age, v - length * slope});
  }
  return all;
}

double steady_force(const SpringPull& pull) {
  return pull.load_n * pull.material.kinetic_coefficient(pull.speed_m_per_s);
}

}  // namespace

// Returns the complex stiffness dF/dx of sliding with ageing, by perturbation to first order: x = v t + u
// with u = exp(p t). A bristle born at time s is bent by r = x(t) - x(s), and remains while its fresh snap
// length exceeds r / g(t - s), with g the growth by age. The number of bristles is conserved, which gives the
// change n1 of their birth rate n0, and from it the force. With A = l / v the age at the snap, l the snap
// path, delta the fresh snap length and w = 1 / (v - delta g'(A)):
//
//   H(p) = K / E[A] { E[w (1 - e^(-pA))] v M(p) / B(p) + E[A] - B(p) - v E[w A (1 - e^(-pA))] }
//   B(p) = E[(1 - e^(-pA)) / p],  M(p) = E[((1 - e^(-pA)) / p - A e^(-pA)) / p]
//
// A mass m on a spring, with the contact's damping C = dF/dv, is at the limit of stability at the frequency
// omega where C omega + Im H(i omega) = 0; the critical stiffness is m omega^2 - Re H(i omega).
Complex sliding_stiffness(const SpringPull& pull, Complex p) {
  const double v = pull.speed_m_per_s;
  double number = 0.0;  // mean age of bristles at their snap: 1 / birth rate n0
  Complex kept = 0.0, bent = 0.0, lost = 0.0, lost_bent = 0.0;
  for (const Life& life : lives(pull)) {
    const double a = life.age;
    const Complex faded = std::exp(-p * a), gone = 1.0 - faded;
    number += a;
    kept += gone / p;                    // integral of exp(-p a) over the age a, up to the snap
    bent += (gone / p - a * faded) / p;  // integral of a exp(-p a) over the age a, up to the snap
    lost += gone / life.gain;
    lost_bent += a * gone / life.gain;
  }
  const Complex force = lost * v * bent / kept + number - kept - v * lost_bent;
  return contact_stiffness(pull) * force / number;
}

double contact_stiffness(const SpringPull& pull) {
  return pull.material.bristle_stiffness * pull.material.bristles_in_contact(pull.load_n);
}

double sliding_damping(const SpringPull& pull) {
  const double v = pull.speed_m_per_s, step = 1e-4 * v;
  const bristle::Material& m = pull.material;
  const auto force = [&](double speed) {
    return (m.bristles_in_contact(pull.load_n) * m.damping_at(speed) + m.viscous_friction) * speed +
           pull.load_n * m.strengthening_at(speed);
  };
  return (force(v + step) - force(v - step)) / (2.0 * step);
}

double critical_stiffness(const SpringPull& pull) {
  const double damping = sliding_damping(pull);
  const auto loss = [&](double omega) {
    return damping * omega + sliding_stiffness(pull, {0.0, omega}).imag();
  };
  // Searches, from high to low, the highest frequency (rad/s) at which steady sliding is not damped.
  const double unit = pull.speed_m_per_s / pull.material.snap_length.mean();
  double fast = 300.0 * unit, slow = fast;
  if (!(loss(fast) > 0.0)) return std::numeric_limits<double>::infinity();
  while (loss(slow) > 0.0) {
    fast = slow;
    slow *= 0.9;
    if (slow < 1e-4 * unit) return 0.0;
  }
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (slow + fast);
    (loss(middle) > 0.0 ? fast : slow) = middle;
  }
  return std::max(pull.mass_kg * slow * slow - sliding_stiffness(pull, {0.0, slow}).real(), 0.0);
}

PullResult run_pull(const SpringPull& pull, Scheme scheme, double stiffness, double push, double lengths) {
  const double v = pull.speed_m_per_s, dt = pull.dt_s, dbar = pull.material.snap_length.mean();
  bristle::PatchBatch batch;
  bristle::Motion motion;
  bristle::Response response;
  motion.id = batch.add(pull.material, bristle::PatchOptions{}
                                           .with_max_normal_load(pull.load_n)
                                           .with_axes(1)
                                           .with_population(bristle::Population::infinite)
                                           .with_precision(BRISTLE_WITH_DOUBLE ? bristle::Precision::double_
                                                                               : bristle::Precision::single)
                                           .with_resolution(32.0)
                                           .with_outputs(bristle::Outputs::all));
  batch.warm_up();
  motion.normal_load = pull.load_n;
  const bristle::Span<bristle::Motion> motions(&motion, 1);
  const bristle::Span<bristle::Response> responses(&response, 1);
  for (double x = 0.0; x < 30.0 * dbar; x += v * dt) {
    motion.displacement[0] = v * dt;
    batch.step(dt, motions, responses);
  }

  bristle::MovingBody<1> body;
  body.mass(0, 0) = pull.mass_kg;
  body.velocity[0] = v;
  bristle::BodyContact<1> contact;
  contact.axes = 1;
  const bristle::Span<bristle::BodyContact<1>> contacts(&contact, 1);
  double stretch = (steady_force(pull) - response.damper[0]) / stiffness + push * dbar;

  PullResult result;
  const auto steps = static_cast<long>(lengths * dbar / (v * dt));
  double amplitude[4] = {0.0, 0.0, 0.0, 0.0};
  result.slowest = result.fastest = 1.0;
  result.lowest_force = std::numeric_limits<double>::infinity();
  double energy = 0.5 * pull.mass_kg * body.velocity[0] * body.velocity[0] + batch.stored_energy(motion.id);
  for (long i = 0; i < steps; ++i) {
    // Computes the force of the pulling spring at the middle of the step.
    const double before = body.velocity[0];
    const double force = stiffness * (stretch + 0.5 * dt * (v - before));
    const bristle::BodyVector<1> external = Eigen::Matrix<double, 1, 1>(force);
    if (scheme == Scheme::predictor) {
      predict_displacements<1>(batch, dt, body, external, contacts, motions);
      batch.step(dt, motions, responses);
      apply_end_forces<1>(dt, body, external, contacts, responses);
    } else {
      solve_displacements<1>(batch, dt, body, external, contacts, motions);
      batch.step(dt, motions, responses);
      apply_mean_forces<1>(dt, body, external, contacts, responses);
    }
    stretch += v * dt - motion.displacement[0];
    const double speed = body.velocity[0] / v;
    amplitude[4 * i / steps] = std::max(amplitude[4 * i / steps], std::abs(speed - 1.0));
    result.work += force * motion.displacement[0];
    const double now =
        0.5 * pull.mass_kg * body.velocity[0] * body.velocity[0] + batch.stored_energy(motion.id);
    result.energy_error = std::max(result.energy_error, now - energy - force * motion.displacement[0]);
    energy = now;
    if (2 * i < steps) continue;
    result.slowest = std::min(result.slowest, speed);
    result.fastest = std::max(result.fastest, speed);
    result.highest_force = std::max(result.highest_force, force);
    result.lowest_force = std::min(result.lowest_force, force);
  }
  result.growth = std::log(amplitude[3] / amplitude[1]);
  return result;
}

// Lists slow pulls in two regimes. In creep, inertia is negligible and strengthening with speed opposes the
// fall of friction with speed. In the inertial regime viscous friction opposes it.
std::vector<SpringPull> pulls() {
  const auto material = [](double ageing_time) {
    return bristle::Material::from_coefficients(bristle::Coefficients::paper()
                                                    .with_kinetic(0.4)
                                                    .with_peak(0.46)
                                                    .with_presliding_length(1e-5)
                                                    .with_growth_per_decade(0.1)
                                                    .with_ageing_time(ageing_time));
  };
  SpringPull creep{"creep", material(0.01).with_speed_strengthening(0.005, 1e-8), 10.0, 2e-5, 50.0, 1e-3};
  SpringPull inertial{"inertial", material(1e-4).with_viscous_friction(5.0), 10.0, 5e-3, 2.0, 2e-5};
  return {creep, inertial};
}

// Finds the spring's critical stiffness by simulation: bisects ln(stiffness) to where the growth rate of a
// disturbance changes sign.
PullRow pull_row(const SpringPull& pull, Scheme scheme) {
  PullRow row;
  row.pull = pull;
  row.scheme = scheme;
  row.theory = critical_stiffness(pull);
  constexpr double push = 0.02, lengths = 40.0, range = 0.4;
  double low = std::log(row.theory) - range, high = std::log(row.theory) + range;
  for (int i = 0; i < 6; ++i) {
    const double middle = 0.5 * (low + high);
    (run_pull(pull, scheme, std::exp(middle), push, lengths).growth > 0.0 ? low : high) = middle;
  }
  row.measured = std::exp(0.5 * (low + high));
  row.soft = run_pull(pull, scheme, 0.25 * row.theory, 10.0 * push, 3.0 * lengths);
  return row;
}

}  // namespace cli
