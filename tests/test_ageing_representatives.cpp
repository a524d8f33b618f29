// Representatives that age: a bristle snaps at residual + delta0 g(age). Expected values come from the
// reference tables (closed forms and cohorts), and from a brute force of bristles one by one in small steps.
#include <catch2/catch.hpp>

#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <vector>

#include "brute_ageing.hpp"
#include "expect.hpp"
#include "reference_table.hpp"
#include "scenes.hpp"

namespace bristle_test::test_ageing_representatives {

using bristle::Ageing;

namespace {

constexpr double tau = 0.01;  ///< s
constexpr double sigmas = 4.5;

SnapRule rule_named(const std::string& name) { return name == "keep" ? SnapRule::keep : SnapRule::redraw; }

Material ageing_material(const Row& row) {
  return plain_material(reference_law(row.at("dist")), rule_named(row.at("variant")))
      .with_ageing(Ageing::logarithmic(number(row, "beta"), tau));
}

/// A patch of bristles that age. Deflections are in mean snap lengths, speeds in mean snap lengths per tau.
class AgeingBrush {
 public:
  AgeingBrush(const Material& material, std::uint32_t n, Precision precision = Precision::single,
              int axes = 1, std::uint32_t seed = 1)
      : bristles_(n), patch_(material, plain_options(n, axes, precision).with_seed(seed)) {}

  /// Moves the patch along x. Returns the mean deflection at the end of the step.
  double slide(double length, double speed) {
    const Response r = patch_.step(length * dbar, 0.0, bristles_, length / speed * tau);
    return deflection(r.elastic[0]);
  }
  /// Moves the patch along x. Returns the mean deflection averaged over the step.
  double mean_over(double length, double speed) {
    return deflection(patch_.step(length * dbar, 0.0, bristles_, length / speed * tau).mean[0]);
  }
  /// Moves the patch along x in steps of at most `piece`. Returns the mean deflection at the end.
  double slide_in_pieces(double length, double speed, double piece) {
    const int steps = std::max(1, static_cast<int>(std::ceil(length / piece - 1e-9)));
    double end = 0.0;
    for (int k = 0; k < steps; ++k) end = slide(length / steps, speed);
    return end;
  }
  /// Lets time pass in a step that leaves out the patch, which rests.
  void wait(double taus) { patch_.batch.step(taus * tau, {}, {}); }

  double deflection(double force) const { return -force / (bristles_ * dbar); }
  /// Returns the present sampling error of the mean deflection, from the spread of the bristles.
  double error() const {
    const Bristles b = read(patch_, static_cast<std::size_t>(bristles_));
    double sum = 0.0, squares = 0.0;
    for (const double z : b.zx) {
      sum += z / dbar;
      squares += z / dbar * (z / dbar);
    }
    const double n = bristles_;
    return std::sqrt((squares / n - sum / n * (sum / n)) / n);
  }
  double load() const { return bristles_; }
  OnePatch& patch() { return patch_; }

 private:
  double bristles_;
  OnePatch patch_;
};

/// Returns the growth g of a snap length with its age in tau.
std::function<double(double)> growth(bool saturating, double strength) {
  return [=](double age) { return 1.0 + strength * (saturating ? 1.0 - std::exp(-age) : std::log1p(age)); };
}

}  // namespace

TEST_CASE("steady sliding of bristles that age is that of the tables, at every speed", "[ageing]") {
  for (const Row& row : read_table("ageing_steady.csv")) {
    const double speed = number(row, "v_tau_over_dbar");
    const double expected = number(row, "f_kinetic_ref");
    const Material material = ageing_material(row);
    const std::uint32_t n = test_size(2000);
    INFO(row.at("dist") << " " << row.at("variant") << " beta " << row.at("beta") << " speed " << speed);
    AgeingBrush brush(material, n);
    if (rule_named(row.at("variant")) == SnapRule::keep) {
      // With kept lengths each bristle's deflection averages half its own aged length over many snaps, so the
      // error left is that of the mean of the bristles' lengths.
      brush.slide(50.37, speed);
      expect_near(brush.mean_over(200.0, speed), expected, 2e-3, "keep");
      continue;
    }
    brush.slide_in_pieces(8.0, speed, 0.9);
    double sum = 0.0;
    constexpr int steps = 16;
    for (int k = 0; k < steps; ++k) sum += brush.mean_over(1.3, speed);
    // Statistical error: one bristle's deflection has a standard deviation of some 0.36 (mean lengths), and
    // is independent after one path between snaps.
    const double distances = n * steps * 1.3 / (2.0 * expected);
    expect_near(sum / steps, expected, sigmas * 0.36 / std::sqrt(distances), "redraw, one by one");
    const double many = brush.mean_over(300.0, speed);
    expect_near(many, expected, sigmas * 0.36 / std::sqrt(n * 300.0 / (2.0 * expected)) + 1e-4,
                "redraw, in law");
    double end = 0.0;
    for (int k = 0; k < steps; ++k) end += brush.slide(60.0, speed);
    expect_near(end / steps, expected, sigmas * 0.36 / std::sqrt(double(n * steps)),
                "redraw, end of long steps");
  }
}

TEST_CASE("after a hold the peak of bristles that age is that of the table, whoever names the patch",
          "[ageing]") {
  const std::uint32_t n = test_size(20000);
  for (const Row& row : read_table("ageing_hold.csv")) {
    const double speed = number(row, "v_tau_over_dbar");
    const double hold = number(row, "hold_over_tau");
    const double position = number(row, "x_peak_over_dbar");
    INFO(row.at("dist") << " beta " << row.at("beta") << " speed " << speed << " hold " << hold);
    AgeingBrush brush(ageing_material(row), n);
    const double kinetic = number(row, "kinetic");
    double peak = brush.slide_in_pieces(8.0, speed, 0.9);
    brush.wait(hold);
    if (position > 0.0) peak = brush.slide_in_pieces(position, speed, 0.06);
    expect_near(peak / kinetic, number(row, "peak_over_kinetic"), sigmas * brush.error() / kinetic,
                "peak over kinetic");
  }
}

TEST_CASE("after a jump in speed the force of bristles that age is that of the table", "[ageing]") {
  const std::uint32_t n = test_size(20000);
  double at = 0.0;
  std::unique_ptr<AgeingBrush> brush;
  for (const Row& row : read_table("ageing_velocity_step.csv")) {
    const double x = number(row, "x_after_step_over_dbar");
    const double speed = number(row, "v2_tau_over_dbar");
    INFO(row.at("dist") << " beta " << row.at("beta") << " to speed " << speed << ", after " << x);
    if (x == 0.0) {
      brush = std::make_unique<AgeingBrush>(ageing_material(row), n);
      at = 0.0;
      const double before = brush->slide_in_pieces(8.3, number(row, "v1_tau_over_dbar"), 0.9);
      expect_near(before, number(row, "f"), sigmas * brush->error(), "before the jump");
      continue;
    }
    const double after = brush->slide_in_pieces(x - at, speed, 0.7);
    expect_near(after, number(row, "f"), sigmas * brush->error(), "after the jump");
    at = x;
  }
}

TEST_CASE("in double precision two halves of a step are the step, bristle by bristle, with ageing",
          "[ageing]") {
  if (!BRISTLE_WITH_DOUBLE) return;
  for (const SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
    for (const bool saturating : {false, true}) {
      const Material material =
          plain_material(SnapLength::lognormal(dbar, 0.5), rule)
              .with_residual_length(0.3 * dbar)
              .with_ageing(saturating ? Ageing::saturating(0.7, tau) : Ageing::logarithmic(0.3, tau));
      const std::uint32_t n = 400;
      AgeingBrush whole(material, n, Precision::double_, 2), halves(material, n, Precision::double_, 2);
      std::mt19937_64 random(5);
      std::uniform_real_distribution<double> flat(0.0, 1.0);
      for (int k = 0; k < 40; ++k) {
        const double angle = 6.3 * flat(random), length = dbar * (k % 5 == 0 ? 2.5 : 0.6) * flat(random);
        const double dt = tau * std::exp(8.0 * (flat(random) - 0.5));
        const double x = length * std::cos(angle), y = length * std::sin(angle);
        whole.patch().step(x, y, n, dt);
        halves.patch().step(0.5 * x, 0.5 * y, n, 0.5 * dt);
        halves.patch().step(0.5 * x, 0.5 * y, n, 0.5 * dt);
        const Bristles a = read(whole.patch(), n), b = read(halves.patch(), n);
        int apart = 0;
        double farthest = 0.0;
        for (std::size_t i = 0; i < n; ++i) {
          const double off = std::hypot(a.zx[i] - b.zx[i], a.zy[i] - b.zy[i]) / dbar;
          if (off > 1e-6)
            ++apart;
          else
            farthest = std::max(farthest, off);
        }
        INFO(table_name(rule) << (saturating ? ", saturating" : ", logarithmic") << ", step " << k);
        expect(apart == 0, "every bristle is where it would be");
        expect_near(farthest, 0.0, 1e-9, "farthest apart, lengths");
      }
    }
  }
}
TEST_CASE("a long rest visits no bristle and ages them all", "[ageing]") {
  const std::uint32_t n = test_size(3000);
  const Material material =
      plain_material(uniform, SnapRule::redraw).with_ageing(Ageing::logarithmic(0.1, tau));
  AgeingBrush named(material, n), alone(material, n);
  named.slide_in_pieces(5.0, 1.0, 0.4);
  alone.slide_in_pieces(5.0, 1.0, 0.4);
  for (int k = 0; k < 1000; ++k) {
    named.patch().step(0.0, 0.0, n, 0.1 * tau);
    if (named.patch().report.bristles_visited != 0) FAIL("a patch at rest was visited");
  }
  alone.wait(100.0);
  const double rested = named.slide(0.2, 1.0);
  expect_near(alone.slide(0.2, 1.0), rested, 1e-7, "rest in many steps or in none");
  AgeingBrush fresh(material, n);
  fresh.slide_in_pieces(5.0, 1.0, 0.4);
  expect(rested > fresh.slide(0.2, 1.0) + 0.05, "what rested holds more");
}

TEST_CASE("bristles that age snap where they reach their limit, however slow, fast, old or tough",
          "[ageing]") {
  constexpr std::uint32_t n = 40;
  const Precision precision = precisions().back();
  std::mt19937_64 random(12);
  std::uniform_real_distribution<double> flat(0.0, 1.0);
  for (int k = 0; k < 60; ++k) {
    const bool saturating = k % 2 == 1;
    const int axes = k % 4 < 2 ? 1 : 2;
    const double strength = k % 3 == 0 ? 1.0 : flat(random);
    const double residual = k % 5 == 0 ? 0.0 : flat(random);
    const Material material =
        plain_material(SnapLength::lognormal(dbar, 0.5), SnapRule::keep)
            .with_residual_length(residual * dbar)
            .with_ageing(saturating ? Ageing::saturating(strength, tau) : Ageing::logarithmic(strength, tau));
    AgeingBrush brush(material, n, precision, axes);
    AgedBristles brute(n, single_quantile(1.0), growth(saturating, strength), 1, residual, true);
    std::vector<double> lengths = read(brush.patch(), n).delta;
    for (double& length : lengths) length /= dbar;
    brute.set_lengths(lengths);
    brush.patch().step(0.0, 0.0, n, tau);  // more bristles come into contact at this step's beginning
    brute.wait(1.0);
    for (int step = 0; step < 12; ++step) {
      const double angle = axes == 1 ? (step % 3 == 2 ? M_PI : 0.0) : 6.3 * flat(random);
      const double length = 2.0 * flat(random) * flat(random);
      // Sets a random speed: as dbar / tau is 1 mm/s, 1e-6 to 1e4 of it are 1e-9 to 10 m/s.
      const double speed = 1e-6 * std::pow(1e10, flat(random));
      const double wait = step % 4 == 0 ? std::pow(1e9, flat(random)) : 0.0;
      const double ex = std::cos(angle), ey = axes == 1 ? 0.0 : std::sin(angle);
      brush.wait(wait);
      brute.wait(wait);
      brush.patch().step(length * ex * dbar, length * ey * dbar, n, length / speed * tau);
      brute.step(length * ex, length * ey, length / speed);
      const Bristles b = read(brush.patch(), n);
      INFO((saturating ? "saturating " : "logarithmic ")
           << strength << ", " << axes << " axes, step " << step << " of " << length << " at " << speed);
      double farthest = 0.0;
      for (std::size_t i = 0; i < n; ++i)
        farthest = std::max(farthest, std::hypot(b.zx[i] / dbar - brute.x(i), b.zy[i] / dbar - brute.y(i)));
      expect_near(farthest, 0.0, precision == Precision::double_ ? 1e-8 : 1e-3, "farthest from one by one");
    }
  }
}

TEST_CASE("bristles that age and are renewed slide alike in short and in long steps", "[ageing]") {
  // Steady sliding in theory: the path l between snaps solves l = d g(l / v) for a lognormal fresh length d;
  // renewals come at the rate lambda per path.
  constexpr double beta = 0.1, kappa = 1.0, residual = 0.3;
  const std::uint32_t n = test_size(4000);
  for (const SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
    for (const double speed : {0.02, 3.0}) {
      std::vector<double> distances;
      const Quantile quantile = lognormal_quantile(1.0, 0.3);
      for (int k = 0; k < 2000; ++k) {
        const double d = quantile((k + 0.5) / 2000.0);
        double l = d;
        for (int i = 0; i < 200; ++i) l = d * (1.0 + beta * std::log1p(l / speed));
        distances.push_back(l);
      }
      double low = 1e-3, high = 10.0;
      for (int i = 0; i < 60; ++i) {
        const double lambda = 0.5 * (low + high);
        double sum = 0.0;
        for (const double l : distances)
          sum += rule == SnapRule::redraw ? std::exp(-lambda * l) : 1.0 / std::expm1(lambda * l);
        const double target = rule == SnapRule::redraw ? 1.0 / (1.0 + kappa) : 1.0 / kappa;
        (sum / 2000.0 > target ? low : high) = lambda;
      }
      double bend = 0.0, count = 0.0, ratio = 0.0;
      for (const double l : distances) {
        const double w1 = -std::expm1(-low * l) / low;
        const double w2 = (1.0 - (1.0 + low * l) * std::exp(-low * l)) / (low * low);
        bend += w2;
        count += w1;
        ratio += w2 / w1 / 2000.0;
      }
      const double expected = residual + (rule == SnapRule::redraw ? bend / count : ratio);
      const Material material = plain_material(SnapLength::lognormal(dbar, 0.3), rule)
                                    .with_residual_length(residual * dbar)
                                    .with_shared_renewal(kappa)
                                    .with_ageing(Ageing::logarithmic(beta, tau));
      for (const double piece : {0.1, 1.0, 30.0}) {
        INFO(table_name(rule) << ", speed " << speed << ", steps of " << piece);
        AgeingBrush brush(material, n);
        brush.slide_in_pieces(25.0, speed, std::min(piece, 1.0));
        const int steps = piece < 0.5 ? 60 : 20;
        double sum = 0.0, end = 0.0;
        for (int k = 0; k < steps; ++k) {
          sum += brush.mean_over(piece, speed) / steps;
          end = brush.slide(piece, speed);
        }
        const double independent = std::max(2.0 * steps * std::min(piece, 1.0), 1.0);
        expect_near(sum, expected, sigmas * 0.5 / std::sqrt(n * independent) + 1e-3, "mean");
        expect_near(end, expected, sigmas * 0.5 / std::sqrt(double(n)) + 2e-3, "end");
        // Checks that a patch that slid steadily, and then rested, returns to the same steady sliding.
        brush.wait(1e6);
        const double after_rest = brush.slide(30.0, speed);
        expect_near(after_rest, expected, sigmas * 0.5 / std::sqrt(double(n)) + 2e-3, "after a rest");
      }
    }
  }
}

TEST_CASE("a long step of bristles that age ends as many short ones do", "[ageing]") {
  // Starts with straight bristles, which snap in phase at first. One path is shorter than those that a step
  // computes by a jump over many snaps, the other longer.
  struct Case {
    const char* name;
    SnapLength law;
    Ageing ageing;
    std::vector<double> distances;
  };
  const Case cases[] = {
      {"narrow lognormal",
       SnapLength::lognormal(dbar, 0.21),
       Ageing::logarithmic(1.0, tau),
       {2.0, 4.0, 12.0}},
      {"lognormal", SnapLength::lognormal(dbar, 0.3), Ageing::logarithmic(0.05, tau), {2.0, 3.0, 5.3}},
      {"lognormal, ageing much",
       SnapLength::lognormal(dbar, 0.3),
       Ageing::saturating(1.0, tau),
       {2.0, 3.0, 6.0}},
      {"uniform", uniform, Ageing::logarithmic(0.3, tau), {2.0, 3.0, 8.0}},
      {"wide lognormal", SnapLength::lognormal(dbar, 0.8), Ageing::logarithmic(0.3, tau), {3.0, 8.0, 32.0}},
      {"exponential", SnapLength::exponential(dbar), Ageing::saturating(0.5, tau), {2.0, 5.0, 21.0}}};
  const std::uint32_t n = test_size(100000);
  for (const Case& c : cases) {
    INFO(c.name);
    const Material material = plain_material(c.law, SnapRule::redraw).with_ageing(c.ageing);
    for (const double path : c.distances) {
      INFO("path " << path);
      AgeingBrush once(material, n), often(material, n, Precision::single, 1, 2);
      const Response step = once.patch().step(path * dbar, 0.0, n, 0.5 * path * tau);
      const double end = once.deflection(step.elastic[0]);
      double expected = 0.0, dissipated = 0.0;
      const int pieces = static_cast<int>(2.0 * path);
      for (int k = 0; k < pieces; ++k) {
        const double piece = path / pieces;
        const Response r = often.patch().step(piece * dbar, 0.0, n, 0.5 * piece * tau);
        expected = often.deflection(r.elastic[0]);
        dissipated += r.dissipated;
      }
      const double error = std::hypot(once.error(), often.error());
      expect_near(end, expected, 1e-3 * expected + sigmas * error, "mean deflection");
      // Tolerance: the energy that one bristle loses on this path has a standard deviation below its mean.
      expect_near(step.dissipated / dissipated, 1.0, 2e-3 + sigmas * std::sqrt(2.0 / static_cast<double>(n)),
                  "energy of the snaps, over many steps'");
    }
    // Kernels step each bristle in double precision where the path exceeds 2^60 mean lengths.
    AgeingBrush far(material, n), near(material, n, Precision::single, 1, 2);
    const double end = far.slide(1.9e18, 2.0), expected = near.slide(1e3, 2.0);
    expect_near(end, expected, sigmas * std::hypot(far.error(), near.error()), "steady sliding");
  }
}

TEST_CASE("bristles that enter are born at the beginning of the step, those that stay go on ageing",
          "[ageing]") {
  const std::uint32_t n = 1000;
  const SnapLength single = SnapLength::uniform(0.999 * dbar, 1.001 * dbar);
  const Material material = plain_material(single, SnapRule::keep).with_ageing(Ageing::logarithmic(0.5, tau));
  OnePatch patch(material, plain_options(n, 1));
  patch.step(0.0, 0.0, 500.0, tau);
  patch.batch.step(99.0 * tau, {}, {});
  // Half of 1000 bristles have age 100, half are new (in tau). Within this step the new ones age by 1, so
  // they stick up to 1 + ln(2) / 2 mean lengths, the old ones up to 3.3.
  const auto force = [&](double length, double taus) {
    return -patch.step(length * dbar, 0.0, n, taus * tau).elastic[0] / dbar;
  };
  expect_near(force(1.3, 1.0), 1300.0, 1e-2, "all hold");
  const double all = force(0.2, 1e-3);
  expect(all < 0.5 * 1500.0 + 0.5 * 300.0, "the young have snapped, the old not");
  expect(all > 0.5 * 1500.0, "the old have not snapped");
  // Half the load takes the young bristles out of contact; the full load brings them in again, straight and
  // of age 0.
  patch.step(0.0, 0.0, 500.0, tau);
  patch.step(0.0, 0.0, n, 1e-6 * tau);
  const double old_and_new = force(1.05, 1e-6);
  expect_near(old_and_new, 500.0 * (1.5 + 1.05) + 500.0 * 0.05, 500.0 * 2e-3, "the new ones had no age");
}

TEST_CASE("a material may begin to age, age otherwise and cease to while it slides", "[ageing]") {
  const std::uint32_t n = 700;
  const Material plain = plain_material(SnapLength::uniform(0.99 * dbar, 1.01 * dbar), SnapRule::redraw);
  const Material ages = Material(plain).with_ageing(Ageing::logarithmic(0.5, tau));
  for (const Precision precision : precisions()) {
    OnePatch patch(plain, plain_options(n, 2, precision));
    patch.step(0.9 * dbar, 0.0, n, tau);
    patch.batch.step(1e3 * tau, {}, {});
    patch.batch.set_material(patch.id, ages);
    patch.step(0.0, 0.0, n, 1e-9 * tau);
    const auto bend = [&](double length, double taus) {
      return -patch.step(length * dbar, 0.0, n, taus * tau).elastic[0] / (n * dbar);
    };
    // Checks that ages begin at the change of material, whatever happened before: all bristles snap at their
    // fresh lengths.
    expect(bend(0.15, 1e-6) < 0.1, "no age from before the change");
    patch.batch.step(1e3 * tau, {}, {});
    expect_near(bend(2.0, 1e-6), 2.05, 0.03, "ages count from the snap: up to 1 + ln(1001) / 2");
    // Bristles keep their ages in seconds, so in units of the new, longer ageing time the ages are smaller.
    patch.batch.set_material(patch.id, Material(plain).with_ageing(Ageing::logarithmic(0.5, 1e3 * tau)));
    const Response slipped = patch.step(0.0, 0.0, n, 1e-9 * tau);
    // The aged snap length under the new law, ln(1 + 1) / 2 + 1 = 1.35, is below the present deflection.
    expect(slipped.snaps == n, "beyond the limit of their age all slip");
    patch.batch.set_material(patch.id, ages);
    patch.step(1.2 * dbar, 0.0, n, tau);
    patch.batch.set_material(patch.id, plain);
    const Response fell = patch.step(0.0, 0.0, n, tau);
    expect_near(fell.elastic[0], 0.0, 1e-12, "lengths fall back");
    expect(fell.snaps == n, "and what is beyond them slips");
  }
}

TEST_CASE("the rest of a patch that ages is over after a slide in any direction", "[ageing]") {
  // A bristle moves with the patch over at most twice its aged length (1.5 mean lengths x g) before it snaps.
  // After 18 lengths the oldest has been stuck for less than 0.05 s, and the force limit shows it.
  const Material material =
      plain_material(uniform, SnapRule::redraw).with_ageing(bristle::Ageing::logarithmic(0.1, 1.0));
  const double first = plain_material(uniform, SnapRule::redraw).peak_coefficient() * 200.0;
  const double half = std::sqrt(0.5);
  for (const PatchOptions& options :
       {plain_options(200),
        PatchOptions{}.with_population(bristle::Population::infinite).with_max_normal_load(200.0)})
    for (const auto& direction : {std::array{1.0, 0.0}, std::array{0.0, 1.0}, std::array{0.0, -1.0},
                                  std::array{half, -half}, std::array{-half, half}, std::array{0.6, 0.8}}) {
      OnePatch patch(material, options);
      patch.step(0.0, 0.0, 200.0, 100.0);
      const Response rested = patch.step(0.0, 0.0, 200.0, tick);
      CHECK(rested.force_limit == Approx(first * (1.0 + 0.1 * std::log1p(100.0 + tick))).epsilon(1e-6));
      Response r;
      for (int k = 0; k < 60; ++k)
        r = patch.step(0.3 * dbar * direction[0], 0.3 * dbar * direction[1], 200.0);
      INFO("direction " << direction[0] << ", " << direction[1]);
      CHECK(r.force_limit >= first);
      CHECK(r.force_limit < first * (1.0 + 0.1 * std::log1p(0.05)));
    }
}

TEST_CASE("a material changed after a rest begins the count of the slide that ends the rest", "[ageing]") {
  // Moves by half of the path after which bristles have forgotten a rest, rests, changes the material, moves
  // the whole path: afterwards bristles are at most as old as the change.
  const bristle::Ageing ageing = bristle::Ageing::saturating(0.5, 1000.0);
  const Material material = plain_material(uniform, SnapRule::redraw).with_ageing(ageing);
  const double first = plain_material(uniform, SnapRule::redraw).peak_coefficient() * 200.0;
  for (const PatchOptions& options :
       {plain_options(200),
        PatchOptions{}.with_population(bristle::Population::infinite).with_max_normal_load(200.0)}) {
    OnePatch patch(material, options);
    patch.step(0.0, 0.0, 200.0, tick);
    patch.step(1.5 * dbar, 0.0, 200.0, 1.0);
    patch.step(0.0, 0.0, 200.0, 1000.0);
    patch.batch.set_material(patch.id, Material(material).with_viscous_friction(1e-9));
    patch.step(2.0 * dbar, 0.0, 200.0, 1.0);
    patch.step(2.5 * dbar, 0.0, 200.0, 1.0);
    const Response r = patch.step(0.0, 0.0, 200.0, 1.0);
    CHECK(r.force_limit == Approx(first * (1.0 + 0.5 * (1.0 - std::exp(-3.0 / 1000.0)))).epsilon(1e-6));
  }
}

}  // namespace bristle_test::test_ageing_representatives
