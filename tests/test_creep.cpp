// Contacts hold their place: chatter at rest, slow creep, long runs, a held object.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <random>

#include "expect.hpp"
#include "scenes.hpp"
#include "statistics.hpp"

namespace bristle_test::test_creep {

TEST_CASE("Slow creep is not lost to rounding", "[creep]") {
  // Creeps in steps so small that a stored float of a third of a snap length, the deflection, would not
  // change: below 2^-26 of it.
  for (Precision precision : precisions()) {
    for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
      for (int axes : {1, 2}) {
        INFO(name_of(precision) << ", " << table_name(rule) << ", axes " << axes);
        OnePatch patch(plain_material(uniform, rule), plain_options(600, axes, precision));
        patch.step(0.0, 0.0, 600.0);
        patch.step(0.3 * dbar, 0.0, 600.0);
        const double d = 1e-9 * dbar;
        Response r;
        for (int k = 0; k < 100000; ++k) r = patch.step(d, axes == 2 ? -d : 0.0, 600.0);
        // Tolerance: a step is rounded to 2^-44 scaled lengths (5.7e-14), 1e5 steps to 6e-9 at most.
        const double tolerance = 600.0 * dbar * (precision == Precision::single ? 1e-7 : 1.2e-8);
        expect_near(-r.elastic[0], 600.0 * (0.3 * dbar + 1e5 * d), tolerance, "force");
        expect_near(r.elastic[1], axes == 2 ? 600.0 * 1e5 * d : 0.0, tolerance, "force aside");
      }
    }
  }
}

TEST_CASE("A creep far below the resolution of positions counts in full", "[creep]") {
  // Moves in steps below the resolution. Positions are multiples of 2^-44 scaled lengths, 4.3e-19 m here.
  // With each step rounded alone, steps of 1e-18 m would be 14 % short and steps of 1e-19 m nothing.
  for (const double d : {1e-18, 1e-19, 3e-17}) {
    for (const int axes : {1, 2}) {
      INFO("steps of " << d << " m, axes " << axes);
      OnePatch patch(plain_material(uniform, SnapRule::redraw), plain_options(1, axes));
      patch.step(0.0, 0.0, 1.0);
      constexpr int steps = 100000;
      Response r;
      for (int k = 0; k < steps; ++k) r = patch.step(d, axes == 2 ? -0.3 * d : 0.0, 1.0);
      // Allows half a position unit (2^-44 scaled lengths) for the remainder not yet carried, and rounding.
      const double tolerance = 2.2e-19 + 1e-10 * steps * d;
      expect_near(-r.elastic[0], steps * d, tolerance, "force");
      expect_near(r.elastic[1], axes == 2 ? 0.3 * steps * d : 0.0, tolerance, "force aside");
      // Moves back by as many steps, and checks that no displacement was lost.
      for (int k = 0; k < steps; ++k) r = patch.step(-d, axes == 2 ? 0.3 * d : 0.0, 1.0);
      expect_near(r.elastic[0], 0.0, tolerance, "force at the start again");
    }
  }
}

TEST_CASE("What rounding left over of a creep is state: saved, part of the hash, forgotten by a reset",
          "[creep][state]") {
  const auto make = [] { return OnePatch(plain_material(uniform, SnapRule::redraw), plain_options(300, 2)); };
  OnePatch crept = make(), fresh = make();
  for (OnePatch* patch : {&crept, &fresh}) patch->step(0.3 * dbar, 0.0, 300.0);
  const std::uint64_t before = crept.hash();
  REQUIRE(fresh.hash() == before);
  crept.step(1.7e-19, 0.0, 300.0);  // 0.4 of a position unit: only the remainder changes
  CHECK(crept.hash() != before);
  // Checks that a trial step includes the remainder of the position and leaves it unchanged.
  Motion trial{crept.id, {1.7e-19, 0.0}, 300.0};
  const std::uint64_t hash = crept.hash();
  for (int k = 0; k < 5; ++k) crept.batch.find_force(1e-3, trial);
  CHECK(crept.hash() == hash);
  fresh.batch.restore_state(saved_state(crept.batch));
  CHECK(fresh.hash() == hash);
  for (OnePatch* patch : {&crept, &fresh})
    patch->step(1.7e-19, 0.0, 300.0);  // remainders of two steps add up to a change of position
  CHECK(fresh.hash() == crept.hash());
  CHECK(crept.step(0.0, 0.0, 300.0).elastic[0] == Approx(-300.0 * (0.3 * dbar + 4.3e-19)).epsilon(1e-6));
  CHECK(crept.batch.reset(crept.id));
  CHECK(fresh.batch.reset(fresh.id));
  OnePatch anew = make();
  for (OnePatch* patch : {&crept, &anew}) patch->step(1.7e-19, 0.0, 300.0);
  CHECK(crept.hash() == anew.hash());
}

TEST_CASE("A million counts of encoder chatter at rest leave no drift", "[creep]") {
  const auto steps = static_cast<int>(test_size(1000000));
  std::mt19937_64 random(7);
  std::vector<bool> up(4096);  // random directions of encoder counts, not alternating
  for (std::size_t k = 0; k < up.size(); ++k) up[k] = (random() & 1u) != 0;
  for (Precision precision : precisions()) {
    for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
      for (int axes : {1, 2}) {
        for (double count : {0.3e-6, 2.7e-6, 30e-6}) {  // motion by an encoder count, m; below to above dbar
          INFO(name_of(precision) << ", " << table_name(rule) << ", axes " << axes << ", count of " << count
                                  << " m");
          const double length = count > dbar ? 10.0 * dbar : dbar;
          OnePatch patch(plain_material(SnapLength::uniform(0.5 * length, 1.5 * length), rule),
                         plain_options(600, axes, precision));
          for (int k = 0; k < 12; ++k) patch.step(0.43 * length, axes == 2 ? 0.1 * length : 0.0, 600.0);
          // In the first counts to and fro, bristles near their snap length snap; in later ones none does.
          for (int k = 0; k < 20; ++k) {
            patch.step(count, 0.0, 600.0);
            patch.step(-count, 0.0, 600.0);
          }
          const std::uint64_t hash = patch.hash();
          double force[2] = {patch.step(0.0, 0.0, 600.0).elastic[0],
                             patch.step(count, 0.0, 600.0).elastic[0]};
          int wrong = 0;
          bool at = true;
          // For counts of other sizes a tenth of the steps is enough.
          const int these = count == 2.7e-6 ? steps : steps / 10;
          for (int k = 0; k < these; ++k) {
            const bool to = up[static_cast<std::size_t>(k) % up.size()];
            const Response r = patch.step(to == at ? 0.0 : to ? count : -count, 0.0, 600.0);
            at = to;
            wrong += r.elastic[0] != force[at ? 1 : 0] || r.snaps != 0;
          }
          CHECK(wrong == 0);
          if (at) patch.step(-count, 0.0, 600.0);
          CHECK(patch.hash() == hash);
        }
      }
    }
  }
}

TEST_CASE("A long run never loses its way", "[creep]") {
  // Slides to and fro for a million ticks, by an amount that is no binary fraction: positions are fixed
  // point, so the net displacement of a period is exactly zero and the force returns.
  OnePatch patch(plain_material(uniform, SnapRule::keep), plain_options(100, 1));
  patch.step(0.0, 0.0, 100.0);
  for (int k = 0; k < 20; ++k) patch.step(0.9 * dbar, 0.0, 100.0);
  double first = 0.0;
  const int periods = static_cast<int>(test_size(100000));
  for (int k = 0; k < periods; ++k) {
    for (double d : {0.013, 0.0171, -0.013, -0.0171}) patch.step(d * dbar, 0.0, 100.0);
    const double force = patch.step(0.0, 0.0, 100.0).elastic[0];
    if (k == 3) first = force;
    if (k > 3) expect(force == first, "the force comes back");
  }
}

namespace {

/// A capsule held between two pads, hanging by its own weight: midpoint rule, with the displacement solved by
/// find_force. All motion lies along one line, (0.6, 0.8) if the pads have two axes.
class HeldCapsule {
 public:
  static constexpr double mass = 0.045;   // kg
  static constexpr double weight = 0.44;  // N

  HeldCapsule(SnapRule rule, int axes, Precision precision, double damping_per_newton)
      : along_{axes == 2 ? 0.6 : 1.0, axes == 2 ? 0.8 : 0.0},
        rubber_(Material::from_coefficients(bristle::Coefficients{}
                                                .with_kinetic(0.7)
                                                .with_peak(0.8)
                                                .with_rule(rule)
                                                .with_presliding_length(dbar)
                                                .with_damping_per_newton(damping_per_newton)
                                                .with_stribeck_velocity(1e-3))) {
    ids_ = add_patches(batch_, 2, rubber_,
                       plain_options(600, axes, precision, Outputs::mean).with_max_normal_load(60.0));
  }

  double position() const { return position_; }  ///< m, downwards
  double stiffness_at(double grip_n) const {     ///< stiffness of one pad, N/m
    return rubber_.bristles_in_contact(grip_n) * rubber_.bristle_stiffness;
  }
  int most_evaluations() const { return most_evaluations_; }

  void step(double grip_n) {
    // Solves d = T (v0 + v1) / 2 and weight + friction(d) = m (v1 - v0) / T. The equation's residual falls
    // with d by no more than `slope`.
    double slope = 2.0 * mass / (tick * tick);
    double d = tick * velocity_;
    double residual = find_residual(d, grip_n);
    slope += 0.5 * stiffness_ + damping_ / tick;
    int evaluations = 1;
    while (std::abs(residual) > 1e-13 * weight && evaluations < 60) {
      const double next = d + residual / slope;
      if (next == d) break;
      const double after = find_residual(next, grip_n);
      const double seen = (residual - after) / (next - d);
      if (seen > 0.0) slope = seen;
      if (std::abs(after) >= std::abs(residual) && evaluations > 8)
        break;  // ends the search at rounding errors of the force
      d = next;
      residual = after;
      ++evaluations;
    }
    most_evaluations_ = std::max(most_evaluations_, evaluations);
    std::vector<Motion> motions = same_motion(ids_, d * along_[0], d * along_[1], grip_n);
    Response responses[2];
    batch_.step(tick, motions, responses);
    velocity_ += tick / mass * (weight + friction(responses[0]) + friction(responses[1]));
    position_ += d;
  }

 private:
  double friction(const Response& r) const { return r.mean[0] * along_[0] + r.mean[1] * along_[1]; }

  double find_residual(double d, double grip_n) {
    const std::vector<Motion> motions = same_motion(ids_, d * along_[0], d * along_[1], grip_n);
    double sum = weight - 2.0 * mass / tick * (d / tick - velocity_);
    stiffness_ = damping_ = 0.0;
    for (const Motion& m : motions) {
      const Response r = batch_.find_force(tick, m);
      sum += friction(r);
      stiffness_ += r.stiffness;
      damping_ += r.damping;
    }
    return sum;
  }

  double along_[2];
  Material rubber_;
  PatchBatch batch_;
  std::vector<PatchId> ids_;
  double position_ = 0.0, velocity_ = 0.0;
  double stiffness_ = 0.0, damping_ = 0.0;
  int most_evaluations_ = 0;
};

struct Grip {
  const char* name;
  bool changes;
  std::function<double(int)> load;  ///< load of each pad in step k, N
};

/// Returns the loads of the grip to test. Each has its least load, mostly 12 N, within the first second, when
/// the deflection is largest.
std::vector<Grip> grips() {
  return {{"12 N", false, [](int) { return 12.0; }},
          {"60 N", false, [](int) { return 60.0; }},
          {"12 to 60 N, four times a second", true,
           [](int k) { return 36.0 - 24.0 * std::cos(M_PI * k / 125.0); }},
          {"12 and 60 N in turn, every step", true, [](int k) { return k % 2 == 0 ? 12.0 : 60.0; }},
          {"12, 13, ... 60 N at random, every step", true,
           [](int k) { return 12.0 + std::floor(49.0 * std::fmod(0.6180339887498949 * (k + 1), 1.0)); }}};
}

/// Mean depths, m, at which the capsule hangs: over half a second from second `from` on, and at the end.
struct Depth {
  double early = 0.0, late = 0.0;
};
Depth hold(HeldCapsule& capsule, const Grip& grip, int from, int steps) {
  Depth depth;
  for (int k = 0; k < steps; ++k) {
    capsule.step(grip.load(k));
    if (k >= from && k < from + 500) depth.early += capsule.position() / 500.0;
    if (k >= steps - 500) depth.late += capsule.position() / 500.0;
  }
  return depth;
}

}  // namespace

TEST_CASE("A capsule of 45 g held between two pads does not creep, whatever the grip does from 12 to 60 N",
          "[creep]") {
  constexpr double damping_per_newton = 20.0;  // damping of both pads per newton of load, s/m
  constexpr int steps = 1600;
  for (Precision precision : precisions()) {
    for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
      for (int axes : {1, 2}) {
        for (const Grip& grip : grips()) {
          INFO(name_of(precision) << ", " << table_name(rule) << ", axes " << axes << ", " << grip.name);
          HeldCapsule capsule(rule, axes, precision, damping_per_newton);
          const Depth depth = hold(capsule, grip, 600, steps);
          // The capsule's weight hangs on the bristles that stay in contact at the least grip, bent by a
          // hundredth of a snap length; the other bristles leave contact bent and return straight.
          const double least = grip.load(0) > 59.0 && !grip.changes ? 60.0 : 12.0;
          const double hangs = HeldCapsule::weight / (2.0 * capsule.stiffness_at(least));
          // Depth by which the capsule sinks while the first bristles bend.
          const double settling = 1e-4 * hangs;
          CHECK(std::abs(depth.late - hangs) < settling);
          // Each change of load rewrites the block of bristles in which contact ends, which rounds float
          // deflections to 2^-24. Positions are always rounded to 2^-44 of a length near the mean.
          const double rounding = precision == Precision::single && grip.changes ? 0x1p-24 * hangs : 0.0;
          const double grain = 0x1p-44 * 2.0 * dbar;
          CHECK(std::abs(depth.late - depth.early) < steps * (rounding + grain));
          CHECK(capsule.most_evaluations() <= 30);
        }
      }
    }
  }
}

TEST_CASE("A held capsule hangs still for an hour", "[.soak]") {
  for (Precision precision : precisions()) {
    for (const Grip& grip : {grips()[0], grips()[3]}) {
      HeldCapsule capsule(SnapRule::redraw, 1, precision, 20.0);
      const Depth depth = hold(capsule, grip, 1000, 3600000);
      std::printf("%s, grip %s: hangs %.6e m deep, sinks by %.2e m in an hour\n", name_of(precision),
                  grip.name, depth.late, depth.late - depth.early);
      std::fflush(stdout);
      CHECK(std::abs(depth.late - depth.early) < 3.6e6 * 0x1p-24 * depth.late);
    }
  }
}

namespace {

/// Returns the mean friction over each tenth of a long slide, over the kinetic friction.
std::vector<double> slide_long(SnapRule rule, int axes, Precision precision, std::uint32_t n,
                               std::int64_t steps) {
  OnePatch patch(plain_material(uniform, rule), plain_options(n, axes, precision, Outputs::mean));
  patch.step(0.0, 0.0, n);
  const double path = 0.29 * dbar;  // path of each step, m

  // With two axes the path is a circle: each step turns by 1e-3 rad.
  const double turn_cos = axes == 2 ? std::cos(1e-3) : 1.0;
  const double turn_sin = axes == 2 ? std::sin(1e-3) : 0.0;
  double x = 1.0, y = 0.0;
  for (int k = 0; k < 2000; ++k) patch.step(path, 0.0, n);
  const double kinetic = n * dbar * (rule == SnapRule::keep ? 0.5 : (1.0 + 1.0 / 12.0) / 2.0);
  std::vector<double> means;
  for (int tenth = 0; tenth < 10; ++tenth) {
    double sum = 0.0;
    for (std::int64_t k = 0; k < steps / 10; ++k) {
      const double turned = x * turn_cos - y * turn_sin;
      y = x * turn_sin + y * turn_cos;
      x = turned;
      if (k % 1000 == 0) {
        const double length = std::sqrt(x * x + y * y);
        x /= length;
        y /= length;
      }
      const Response r = patch.step(path * x, path * y, n);
      sum -= r.mean[0] * x + r.mean[1] * y;
    }
    means.push_back(sum / (static_cast<double>(steps / 10) * kinetic));
  }
  return means;
}

/// Compares the mean friction of every tenth of the slide with that of the first. Returns the largest
/// relative deviation.
double check_long_slide(SnapRule rule, int axes, Precision precision, std::int64_t steps) {
  constexpr std::uint32_t n = 300;
  const std::vector<double> means = slide_long(rule, axes, precision, n, steps);
  // Sampling error. SnapRule::keep: a bristle's mean over a path H has an error of delta / (4 H).
  // SnapRule::redraw: the energies delta^2/2 of the snaps are rewards of a renewal process with the relative
  // deviation sqrt(Var(delta^2/2 - mu delta)) / mu = 0.254 over the root of their number. `path`: a tenth of
  // the slide, mean lengths.
  const double path = 0.29 * static_cast<double>(steps) / 10.0;
  const double sampling =
      rule == SnapRule::keep ? 1.5 / path : sigmas * std::sqrt(2.0) * 0.254 / std::sqrt(n * path);
  double worst = 0.0;
  for (double mean : means) worst = std::max(worst, std::abs(mean / means[0] - 1.0));
  CHECK(worst < std::max(1e-4, sampling));
  // A straight slide's mean friction is the kinetic friction in closed form; under SnapRule::keep, over 300
  // mean lengths, with an error of 1/300.
  if (axes == 1) CHECK(std::abs(means[0] - 1.0) < (rule == SnapRule::keep ? 3e-3 : sampling) + 1e-4);
  return worst;
}

}  // namespace

TEST_CASE("The mean force of a long slide is that of its start", "[creep]") {
  for (Precision precision : precisions())
    for (SnapRule rule : {SnapRule::keep, SnapRule::redraw})
      for (int axes : {1, 2}) {
        INFO(name_of(precision) << ", " << table_name(rule) << ", axes " << axes);
        check_long_slide(rule, axes, precision, test_size(100000));
      }
}

TEST_CASE("After ten hours at 1 kHz the mean force is within 1e-4 of the start", "[.soak]") {
  for (Precision precision : precisions())
    for (SnapRule rule : {SnapRule::keep, SnapRule::redraw})
      for (int axes : {1, 2}) {
        const double worst = check_long_slide(rule, axes, precision, 36000000);
        std::printf("%s, %s, axes %d: 3.6e7 steps, no hour's mean force farther than %.2e from the first\n",
                    name_of(precision), table_name(rule), axes, worst);
        std::fflush(stdout);
      }
}

}  // namespace bristle_test::test_creep
