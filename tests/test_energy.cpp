// Energy balance: work in = change of stored energy + losses (snaps, contacts, dampers), in every step.
#include <catch2/catch.hpp>

#include <cmath>
#include <random>

#include "expect.hpp"
#include "scenes.hpp"
#include "variants.hpp"

namespace bristle_test::test_energy {

namespace {

struct LawCase {
  const char* name;
  SnapLength law;
};
std::vector<LawCase> laws() {
  const double quantiles[] = {0.2 * dbar, 0.7 * dbar, 0.8 * dbar, 1.1 * dbar, 2.4 * dbar};
  return {{"single", SnapLength::single(dbar)},
          {"normal, cv 0.05", SnapLength::normal(dbar, 0.05 * dbar)},
          {"uniform", SnapLength::uniform(0.5 * dbar, 1.5 * dbar)},
          {"lognormal, cv 0.3", SnapLength::lognormal(dbar, 0.3)},
          {"lognormal, cv 1", SnapLength::lognormal(dbar, 1.0)},
          {"exponential", SnapLength::exponential(dbar)},
          {"table", SnapLength::table(quantiles)}};
}

/// Tolerance for rounding in the balance of one step, J: `relative` of the energies involved, plus the errors
/// of fixed point. A displacement is rounded to 2^-44 of a length near the mean (times the force), the sum of
/// deflections of each block also to 2^-44 (times the path), its sum of delta^2 to 2^-50 of the longest
/// square that it may hold.
///
/// Returns the relative tolerance. Double: 1e-12. Float: 1e-6 = 16 x 2^-24, because a bristle's deflection,
/// step mean and loss each have errors of a few 2^-24, and errors of a block may add up.
constexpr double balance_bound(Precision precision) { return precision == Precision::double_ ? 1e-12 : 1e-6; }

struct Balance {
  double work = 0.0;      ///< work of the elastic part of the mean force, J
  double stored = 0.0;    ///< change of the stored energy, J
  double lost = 0.0;      ///< energy lost in snaps and contacts, J
  double involved = 0.0;  ///< sum of the absolute values of these energies, J
  double tolerance = 0.0;
  double residual() const { return work - stored - lost; }
};

/// Returns the energy balance of the step that gave r, for a patch of n bristles.
Balance balance_of(const Response& r, double before, double after, double dx, double dy, Precision precision,
                   std::uint32_t n, double stiffness_of_one, double longest) {
  Balance b;
  const double fx = r.mean[0] - r.damper[0];
  const double fy = r.mean[1] - r.damper[1];
  b.work = -fx * dx - fy * dy;
  b.stored = after - before;
  b.lost = r.dissipated + r.contact_loss;
  b.involved = before + after + std::abs(r.dissipated) + std::abs(r.contact_loss) + std::abs(b.work);
  const double blocks = std::ceil(n / 256.0);
  const double path = std::hypot(dx, dy);
  const double grain = 0x1p-44 * 2.0 * dbar;
  // Stiffness of one representative, which is higher while the load exceeds max_normal_load.
  const double one = std::max(stiffness_of_one, r.stiffness / n);
  // Allows for the digits lost in taking the damper's share out of the mean force.
  const double digits = 0x1p-52 * (std::abs(r.damper[0] * dx) + std::abs(r.damper[1] * dy));
  b.tolerance = balance_bound(precision) * b.involved + (std::abs(fx) + std::abs(fy)) * grain +
                blocks * one * (grain * path + 0x1p-50 * (path + 2.0 * longest) * longest) + digits;
  return b;
}

/// A random walk with steps of every size: tiny, presliding, a few snaps, so long that the kernel jumps over
/// snaps. The load varies slightly, changes at random, or becomes 0.
class RandomWalk {
 public:
  RandomWalk(int axes, double max_load, unsigned seed) : axes_(axes), max_load_(max_load), random_(seed) {}

  void next(double& dx, double& dy, double& load) {
    static constexpr double lengths[] = {0.0, 1e-12, 1e-6, 0.01,  0.3,    1.0,
                                         3.0, 10.0,  40.0, 100.0, 3000.0, 1e5};
    const double length = dbar * lengths[random_() % 12] * (0.5 + flat_(random_));
    if (random_() % 4 == 0) angle_ = 2.0 * M_PI * flat_(random_);
    if (axes_ == 1) {
      dx = random_() % 3 == 0 ? -length : length;
      dy = 0.0;
    } else {
      dx = length * std::cos(angle_);
      dy = length * std::sin(angle_);
    }
    switch (random_() % 6) {
      case 0:
        load_ = max_load_ * flat_(random_);
        break;
      case 1:
        load_ = std::min(max_load_, std::max(0.0, load_ + 0.01 * max_load_ * (flat_(random_) - 0.5)));
        break;
      case 2:
        load_ = random_() % 8 == 0 ? 0.0 : max_load_;
        break;
      case 3:
        load_ = random_() % 8 == 0 ? 1.7 * max_load_ : load_;
        break;
      default:
        break;
    }
    load = load_;
  }

 private:
  int axes_;
  double max_load_;
  double load_ = 0.0;
  double angle_ = 0.0;
  std::mt19937_64 random_;
  std::uniform_real_distribution<double> flat_{0.0, 1.0};
};

/// Walks a patch and checks its energy balance in every step. `seed`: of the walk.
void check_walk(const PatchCase& c, unsigned seed, int steps) {
  INFO(c.name << ", walk " << seed);
  const bool infinite = c.options.population == bristle::Population::infinite;
  const bool ages = c.material.ageing_strength > 0.0, slides = c.material.snap_rule == SnapRule::slide;
  // Whether energy is lost only with a counted snap. A renewal loses energy without a snap, and a sliding
  // bristle is counted as a snap before it loses any.
  const bool snaps_alone = !infinite && !slides && c.material.shared_renewal == 0.0;
  const Precision precision = c.options.precision;
  // In double a snap's position is known to 1e-12; ages and slides are less exact. So is an infinite brush in
  // single precision, which knows the positions of its cohorts to 2^-24.
  const double digits = precision == Precision::double_ ? (ages || slides ? 10.0 : 1.0)
                        : infinite                      ? 100.0
                                                        : 1.0;
  const std::uint32_t n = infinite ? 530 : c.options.bristles;
  const double most = c.options.max_normal_load;
  OnePatch patch(c.material, c.options);
  RandomWalk walk(c.options.axes, most, seed);
  std::mt19937_64 random(7);
  int failures = 0;
  double taken = 0.0, slack = 0.0;  // work done on the patch so far, and what rounding may have added
  for (int k = 0; k < steps && failures < 3; ++k) {
    double dx, dy, load;
    walk.next(dx, dy, load);
    const double dt = ages ? tick * std::ldexp(1.0, static_cast<int>(random() % 14) - 7) : tick;
    const double before = patch.energy();
    const Response r = patch.step(dx, dy, load, dt);
    const double after = patch.energy();
    Balance b = balance_of(r, before, after, dx, dy, precision, n, c.material.bristle_stiffness * most / n,
                           c.material.snap_length.longest());
    b.tolerance *= digits;
    // The stored energy of an infinite brush may be off by 1e-5 of itself, and be corrected in a step that
    // does no work.
    const double least = infinite ? -1e-5 * (before + after) : 0.0;
    if (!(std::abs(b.residual()) <= b.tolerance)) {
      ++failures;
      FAIL_CHECK("step " << k << ": work " << b.work << " J, stored " << before << " to " << after
                         << " J, snaps " << r.dissipated << " J, contact loss " << r.contact_loss
                         << " J: residual " << b.residual() / b.involved << " of the energies involved; load "
                         << load << " N, step " << std::hypot(dx, dy) / dbar << " mean lengths");
    }
    if (!(r.dissipated >= least) || (snaps_alone && (r.snaps > 0) != (r.dissipated > 0.0))) {
      ++failures;
      FAIL_CHECK("step " << k << ": " << r.snaps << " snaps dissipated " << r.dissipated << " J; load "
                         << load << " N, step " << std::hypot(dx, dy) / dbar << " mean lengths");
    }
    expect(r.contact_loss >= -b.tolerance, "contact loss is a loss");
    expect(r.damper_work >= 0.0, "dampers take energy");
    // Checks passivity: a patch gives out no more energy than it took, and the stored energy is part of
    // what it took.
    taken += b.work;
    slack += b.tolerance;
    expect(taken >= after - slack, "the work taken so far covers the energy stored");
  }
}

}  // namespace

TEST_CASE("The energy balance with the mean force holds in every step of every kind of patch", "[energy]") {
  const int steps = static_cast<int>(test_size(240));
  for (const PatchCase& c : every_variant(530)) {  // 530 bristles fill two blocks and part of a third
    if (c.options.outputs != Outputs::all || c.options.bristles > 1000) continue;
    // Takes more walks for springs that slide: some errors need a slide after a load that falls far.
    const unsigned last = c.material.snap_rule == SnapRule::slide ? 12 : 5;
    for (unsigned seed = 5; seed <= last; ++seed) check_walk(c, seed, steps);
  }
}

TEST_CASE("The end force dissipates over the step that produced it, for any motion and rule", "[energy]") {
  const int steps = static_cast<int>(test_size(800));
  for (Precision precision : precisions()) {
    for (const LawCase& law : laws()) {
      for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
        for (int axes : {1, 2}) {
          for (std::uint32_t n : {1u, 530u}) {
            INFO(name_of(precision) << ", " << law.name << ", " << table_name(rule) << ", axes " << axes
                                    << ", " << n << " bristles");
            OnePatch patch(plain_material(law.law, rule), plain_options(n, axes, precision));
            RandomWalk walk(axes, n, 9);
            double taken = 0.0, slack = 0.0;
            for (int k = 0; k < steps; ++k) {
              double dx, dy, load;
              walk.next(dx, dy, load);
              const double before = patch.energy();
              const Response r = patch.step(dx, dy, load);
              const double after = patch.energy();
              const Balance b = balance_of(r, before, after, dx, dy, precision, n, 1.0, law.law.longest());
              const double work = -r.elastic[0] * dx - r.elastic[1] * dy;
              const double tolerance = b.tolerance + balance_bound(precision) * std::abs(work);
              expect(work - b.stored - r.contact_loss >= -tolerance,
                     "work of the end force covers the energy stored and what left");
              taken += work;
              slack += tolerance;
              expect(taken >= after - slack, "the work taken so far covers the energy stored");
            }
          }
        }
      }
    }
  }
}

TEST_CASE("Against the mean force the end force takes more where a bristle sticks, and less where it snaps",
          "[energy]") {
  OnePatch patch(plain_material(SnapLength::single(dbar), SnapRule::keep),
                 plain_options(1, 1, Precision::single));
  patch.step(0.0, 0.0, 1.0);
  // On a spring of 1 N/m bent by 0.9 dbar, end force times path is 0.81 dbar^2, twice the stored energy.
  Response r = patch.step(0.9 * dbar, 0.0, 1.0);
  CHECK(-r.elastic[0] == Approx(0.9 * dbar).epsilon(1e-6));
  CHECK(-r.mean[0] == Approx(0.45 * dbar).epsilon(1e-6));
  // The bristle snaps at dbar and ends bent by 0.1. Work of the end force: 0.02 dbar^2; of the mean force:
  // 0.095 dbar^2 up to the snap and 0.005 dbar^2 after it.
  r = patch.step(0.2 * dbar, 0.0, 1.0);
  CHECK(-r.elastic[0] * 0.2 == Approx(0.02 * dbar).epsilon(1e-5));
  CHECK(-r.mean[0] * 0.2 == Approx(0.1 * dbar).epsilon(1e-5));
  // After the snap only 0.005 dbar^2 is stored, of 0.405 dbar^2 before it.
  CHECK(patch.energy() == Approx(0.005 * dbar * dbar).epsilon(1e-5));
}

TEST_CASE("The balance holds for one bristle, where nothing averages out", "[energy]") {
  for (Precision precision : precisions()) {
    for (const LawCase& law : laws()) {
      for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
        for (int axes : {1, 2}) {
          INFO(name_of(precision) << ", " << law.name << ", " << table_name(rule) << ", axes " << axes);
          OnePatch patch(plain_material(law.law, rule), plain_options(1, axes, precision));
          std::mt19937_64 random(2);
          std::uniform_real_distribution<double> flat(-1.0, 1.0);
          patch.step(0.0, 0.0, 1.0);
          for (int k = 0; k < 1000; ++k) {
            const double scale = k % 10 == 0 ? 8.0 * dbar : 0.7 * dbar;
            const double dx = scale * flat(random);
            const double dy = axes == 2 ? scale * flat(random) : 0.0;
            const double before = patch.energy();
            const Response r = patch.step(dx, dy, 1.0);
            const Balance b =
                balance_of(r, before, patch.energy(), dx, dy, precision, 1, 1.0, law.law.longest());
            expect_near(b.work, b.stored + b.lost, b.tolerance, "work");
          }
        }
      }
    }
  }
}

TEST_CASE("Damper work is positive by default and negative when the given velocity opposes the motion",
          "[energy]") {
  const Material material = Material{}.with_bristle_damping(0.1).with_viscous_friction(0.4);
  OnePatch patch(material, PatchOptions{}.with_outputs(Outputs::all));
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> flat(-1.0, 1.0);
  for (int k = 0; k < 200; ++k) {
    const double dx = 1e-5 * flat(random);
    const double dy = 1e-5 * flat(random);
    const Response r = patch.step(dx, dy, 0.7);
    CHECK(r.damper_work > 0.0);
    CHECK(r.damper_work == Approx(-r.damper[0] * dx - r.damper[1] * dy).epsilon(1e-12));
    CHECK(r.damper_work == Approx(r.damping * (dx * dx + dy * dy) / tick).epsilon(1e-12));

    Motion against;
    against.id = patch.id;
    against.displacement[0] = dx;
    against.displacement[1] = dy;
    against.normal_load = 0.7;
    against.has_velocity = true;
    against.velocity[0] = -dx / tick;
    against.velocity[1] = -dy / tick;
    const Response opposed = patch.step(against);
    CHECK(opposed.damper_work < 0.0);
    CHECK(opposed.damping > 0.0);
  }
}

TEST_CASE("The mean force at rest is the end force, and the mean of a stick is the middle of its ends",
          "[energy]") {
  for (Precision precision : precisions()) {
    OnePatch patch(plain_material(SnapLength::uniform(0.5 * dbar, 1.5 * dbar), SnapRule::redraw),
                   plain_options(530, 2, precision));
    for (int k = 0; k < 10; ++k) patch.step(0.41 * dbar, 0.13 * dbar, 530.0);
    const Response rest = patch.step(0.0, 0.0, 530.0);
    CHECK(rest.mean[0] == rest.end[0]);
    CHECK(rest.mean[1] == rest.end[1]);
    CHECK(rest.dissipated == 0.0);
    const Response back = patch.step(-0.05 * dbar, 0.0, 530.0);
    REQUIRE(back.snaps == 0);
    CHECK(back.mean[0] == Approx(0.5 * (rest.end[0] + back.end[0])).epsilon(1e-12));
    CHECK(back.mean[1] == Approx(0.5 * (rest.end[1] + back.end[1])).epsilon(1e-12));
  }
}

}  // namespace bristle_test::test_energy
