// The infinite brush that fluctuates as n bristles: variance and correlation against closed forms and against
// bristles followed one by one; no noise where nothing snaps; energy; seeds.
#include <catch2/catch.hpp>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "brute_rubbing.hpp"
#include "expect.hpp"
#include "infinite_brush.hpp"
#include "statistics.hpp"

namespace bristle_test::test_fluctuation {

namespace {

const Rubbing paper{0.0, 0.0};
const Rubbing rubbed{0.1, 1.0};  // default values of Coefficients

PatchOptions options_of(std::uint32_t n, std::uint32_t seed = 1) {
  return infinite_options().with_outputs(Outputs::end).with_fluctuation(n).with_seed(seed);
}

/// Mean deflection of the bristles along and across the motion.
struct Deflection {
  double along, across;
};

/// A path of equal steps of `step` mean snap lengths that turns by `turn` rad per mean snap length.
struct Path {
  double step, turn;
  int steps;
};
const Path straight{0.08, 0.0, 30000};
// Chooses a circle wider than the longest bristle: one longer than the diameter would never snap and turn
// with the circle for ever.
const Path circle{0.08, 0.3, 50000};

/// Records the mean deflection of a brush along a path, once the brush has forgotten its start. `move(dx,
/// dy)` takes a step and returns the deflection along x and y.
template <class Move>
std::vector<Deflection> follow(const Path& path, const Move& move) {
  std::vector<Deflection> answers;
  const int before = static_cast<int>(20.0 / path.step);
  double angle = 0.0;
  for (int k = 0; k < before + path.steps; ++k) {
    angle += path.turn * path.step;
    const double ex = std::cos(angle), ey = std::sin(angle);
    const Deflection z = move(path.step * ex, path.step * ey);  // deflection along x and y
    if (k >= before) answers.push_back({z.along * ex + z.across * ey, z.across * ex - z.along * ey});
  }
  return answers;
}

std::vector<Deflection> follow_patch(const Path& path, const Material& material, const PatchOptions& options,
                                     double load = load_n) {
  OnePatch patch(material, options);
  return follow(path, [&](double dx, double dy) {
    const Response r = patch.step(dx * dbar, dy * dbar, load);
    return Deflection{-r.elastic[0] / (load * dbar), -r.elastic[1] / (load * dbar)};
  });
}

std::vector<Deflection> follow_bristles(const Path& path, const SnapLength& law, const Rubbing& r,
                                        std::size_t n, std::uint64_t seed) {
  RubbedBristles brute(
      n, [law](double u) { return law.quantile(u) / dbar; }, r.residual, r.renewal, seed);
  return follow(path, [&](double dx, double dy) {
    brute.step(dx, dy, 0.5 * path.step);
    return Deflection{brute.x(), brute.y()};
  });
}

/// Mean and variance of the deflection over time, and the path (mean snap lengths) after which its
/// correlation has fallen to 1/e.
struct Noise {
  double mean, variance, length;
};
Noise noise_of(const std::vector<Deflection>& answers, double Deflection::*axis, double step) {
  std::vector<double> x;
  for (const Deflection& z : answers) x.push_back(z.*axis);
  const Sample sample = describe(x);
  Noise noise{sample.mean, sample.variance, 0.0};
  double before = 1.0;
  for (std::size_t lag = 1; lag < x.size() / 10; ++lag) {
    double sum = 0.0;
    for (std::size_t i = 0; i + lag < x.size(); ++i) sum += (x[i] - sample.mean) * (x[i + lag] - sample.mean);
    const double now = sum / static_cast<double>(x.size() - lag) / sample.variance;
    if (now < std::exp(-1.0)) {
      noise.length = step * (static_cast<double>(lag) - 1.0 + (before - std::exp(-1.0)) / (before - now));
      break;
    }
    before = now;
  }
  return noise;
}

/// Returns the variance of the deflection z of one bristle in steady sliding. The density of z is S(z) /
/// E[delta], with S(z) the share of snap lengths above z and E[delta] the mean snap length.
double variance_of_one(const SnapLength& law) {
  const double m1 = law.mean() / dbar, m2 = law.moment(2) / (dbar * dbar),
               m3 = law.moment(3) / (dbar * dbar * dbar);
  return m3 / (3.0 * m1) - m2 / (2.0 * m1) * (m2 / (2.0 * m1));
}

// Tolerances. 2400 mean lengths of path hold some 8000 independent deflections, which give their variance to
// 1.6 % and the correlation length to 2 %.
constexpr double of_variance = 0.05;
constexpr double of_length = 0.10;

void compare(const Noise& noise, const Noise& wanted, double n, double of_wanted, const char* what) {
  INFO(what << ", n = " << n);
  expect_near(noise.variance * n, wanted.variance, of_variance * wanted.variance, "n times the variance");
  expect_near(noise.length, wanted.length, of_length * wanted.length, "correlation length");
  // Successive deflections are correlated, so the standard error of their mean is that of 2400 / (2
  // correlation lengths) independent values.
  const double of_mean = std::sqrt(wanted.variance / n * 2.0 * wanted.length / 2400.0);
  expect_near(noise.mean, wanted.mean, 4.0 * of_mean + of_wanted, "mean");
}

}  // namespace

TEST_CASE("The paper's brush fluctuates as n bristles do, by the closed form", "[fluctuation]") {
  for (const SnapLength& law : {lognormal, SnapLength::uniform(0.5 * dbar, 1.5 * dbar)}) {
    INFO(to_string(law.law()));
    Noise wanted =
        noise_of(follow_bristles(straight, law, paper, 100, 11), &Deflection::along, straight.step);
    expect_near(100.0 * wanted.variance, variance_of_one(law), 0.06 * variance_of_one(law), "brute force");
    wanted.variance = variance_of_one(law);
    wanted.mean = kinetic(law);
    // Error of the variance with 8 pieces per mean length (COHORTS.md), allowed beside the sampling error.
    const double of_pieces = law.law() == bristle::SnapLaw::uniform ? 2e-3 : 1e-4;
    for (std::uint32_t n : {100u, 10000u, 1000000u}) {
      const auto answers = follow_patch(straight, with_rubbing(law, paper), options_of(n));
      compare(noise_of(answers, &Deflection::along, straight.step), wanted, n, of_pieces, "straight");
    }
  }
}

TEST_CASE("A brush that is rubbed fluctuates as n bristles do that renew each other", "[fluctuation]") {
  Noise wanted =
      noise_of(follow_bristles(straight, lognormal, rubbed, 200, 12), &Deflection::along, straight.step);
  wanted.variance *= 200.0;
  // Brute force gives more variance than n independent bristles, as bristles renew each other (MODEL.md 26).
  expect_near(wanted.variance, 0.151, 0.006, "brute force");
  wanted.mean = 0.1 + 0.457730;
  for (std::uint32_t n : {100u, 10000u, 1000000u}) {
    const auto answers = follow_patch(straight, with_rubbing(lognormal, rubbed), options_of(n));
    compare(noise_of(answers, &Deflection::along, straight.step), wanted, n, n == 100 ? 3e-3 : 5e-4,
            "straight");
  }
}

TEST_CASE("On a path that turns the force fluctuates along and across it as that of n bristles",
          "[fluctuation]") {
  for (const Rubbing& r : {paper, rubbed}) {
    INFO("renewal " << r.renewal);
    const auto bristles = follow_bristles(circle, lognormal, r, 100, 13);
    for (std::uint32_t n : {100u, 10000u}) {
      const auto answers = follow_patch(circle, with_rubbing(lognormal, r), options_of(n));
      for (double Deflection::*axis : {&Deflection::along, &Deflection::across}) {
        Noise wanted = noise_of(bristles, axis, circle.step);
        wanted.variance *= 100.0;
        const Noise noise = noise_of(answers, axis, circle.step);
        INFO((axis == &Deflection::along ? "along" : "across") << ", n = " << n);
        // Tolerance of n times variance: both its measured and its expected value have sampling errors.
        expect_near(noise.variance * n, wanted.variance, 1.5 * of_variance * wanted.variance,
                    "n times the variance");
        expect_near(noise.length, wanted.length, of_length * wanted.length, "correlation length");
        expect_near(noise.mean, wanted.mean, 0.004, "mean");
      }
    }
  }
}

TEST_CASE("The relative fluctuation goes as the root of the load", "[fluctuation]") {
  for (const Rubbing& r : {paper, rubbed}) {
    const double wanted = r.renewal == 0.0 ? variance_of_one(lognormal) : 0.151;
    for (double share : {0.5, 0.1}) {
      const auto answers =
          follow_patch(straight, with_rubbing(lognormal, r), options_of(1000), share * load_n);
      const Noise noise = noise_of(answers, &Deflection::along, straight.step);
      expect_near(noise.variance * 1000.0 * share, wanted, of_variance * wanted, "n times the variance");
    }
  }
}

TEST_CASE("Those that are left when the load falls are n bristles less at once", "[fluctuation]") {
  // Lets the load fall to a quarter: each of 1000 bristles stays with this probability.
  const double share = 0.25;
  for (const int falls : {1, 8}) {  // a fall at once, or several falls at rest
    OnePatch patch(with_rubbing(lognormal, paper), options_of(1000));
    std::vector<double> answers;
    for (int k = 0; k < 3000; ++k) {
      for (int i = 0; i < 9; ++i) patch.step(0.4 * dbar, 0.0, load_n);
      for (int i = 1; i < falls; ++i) patch.step(0.0, 0.0, std::pow(share, double(i) / falls) * load_n);
      const Response r = patch.step(0.001 * dbar, 0.0, share * load_n);
      answers.push_back(-r.elastic[0] / (share * load_n * dbar));
    }
    const double wanted = variance_of_one(lognormal);
    expect_near(describe(answers).variance * 1000.0 * share, wanted, 2.0 * of_variance * wanted,
                "n times the variance");
  }
}

TEST_CASE("Bristles that came last leave a brush that fluctuates as they came", "[fluctuation]") {
  OnePatch patch(with_rubbing(lognormal, paper), options_of(1000));
  const Response before = patch.step(0.2 * dbar, 0.0, 0.5 * load_n);
  patch.step(0.0, 0.0, load_n);
  const Response after = patch.step(0.0, 0.0, 0.5 * load_n);
  CHECK(after.elastic[0] == Approx(before.elastic[0]).epsilon(1e-12));
}

TEST_CASE("After a long step of an aged brush that fluctuates each bristle is bent to its length",
          "[fluctuation][ageing]") {
  // In steady sliding the longest deflection of a bristle so far (its reach) is its present one.
  OnePatch patch(with_rubbing(lognormal, paper).with_ageing(bristle::Ageing::logarithmic(0.3, 1e-3)),
                 options_of(20));
  for (int k = 0; k < 20; ++k) {
    patch.step(300.0 * dbar, 0.0, load_n);
    const Bristles b = read(patch, 200);
    for (std::size_t i = 0; i < 200; ++i)
      if (b.zx[i] > 0.3 * dbar) expect_near(b.delta[i], b.zx[i], 1e-6 * dbar, "length so far");
  }
}

TEST_CASE("Steps in which the brush forgets all end as n bristles would", "[fluctuation]") {
  for (double step : {9.0, 2000.0}) {
    const Path path{step, 0.0, 10000};
    const auto answers = follow_patch(path, with_rubbing(lognormal, paper), options_of(500));
    const Noise noise = noise_of(answers, &Deflection::along, step);
    const double wanted = variance_of_one(lognormal);
    expect_near(500.0 * noise.variance, wanted, of_variance * wanted, "n times the variance");
    expect_near(noise.mean, kinetic(lognormal), 4.0 * std::sqrt(wanted / 500.0 / 10000.0) + 1e-4, "mean");
    expect_near(noise.length, step * (1.0 - std::exp(-1.0)), 0.05 * step, "no memory from step to step");
  }
}

TEST_CASE("Nothing fluctuates while nothing snaps: at rest, and in a tremor that sticks", "[fluctuation]") {
  for (const Rubbing& r : {paper, rubbed}) {
    Brush noisy(with_rubbing(lognormal, r), infinite_options().with_fluctuation(100));
    Brush other(with_rubbing(lognormal, r), infinite_options().with_fluctuation(100).with_seed(2));
    for (int k = 0; k < 200; ++k) {
      noisy.step(0.05, 0.01);
      other.step(0.05, 0.01);
    }
    // Moves back a little, so that no bristle snaps in the tremor below.
    noisy.step(-0.02);
    other.step(-0.02);
    const double force = noisy.response.elastic[0];
    const double deviation = noisy.x() - other.x();
    CHECK(std::abs(deviation) > 1e-4);
    const std::uint64_t state = noisy.patch.hash();
    bool same = true;
    for (int k = 0; k < 10000; ++k) {
      noisy.step(0.0);
      same = same && noisy.response.elastic[0] == force && noisy.response.snaps == 0 &&
             noisy.response.dissipated == 0.0;
    }
    CHECK(same);
    CHECK(noisy.patch.hash() == state);
    // Both forces change by the same stiffness while both patches stick, so their difference is constant.
    double worst = 0.0;
    for (int k = 0; k < 10000; ++k) {
      const double d = k % 2 == 0 ? -0.004 : 0.004;
      noisy.step(d);
      other.step(d);
      worst = std::max(worst, std::abs(noisy.x() - other.x() - deviation));
    }
    CHECK(worst < 1e-11);
    CHECK(noisy.response.elastic[0] == Approx(force).epsilon(1e-12));
  }
}

TEST_CASE("Before the first bristle snaps a brush that fluctuates is the infinite brush", "[fluctuation]") {
  // Slides by less than the shortest snap length, half the mean, so that nothing snaps and no noise appears.
  const SnapLength law = SnapLength::uniform(0.5 * dbar, 1.5 * dbar);
  Brush noisy(law, infinite_options().with_fluctuation(10));
  Brush smooth(law);
  for (int k = 0; k < 9; ++k) {
    noisy.step(0.05);
    smooth.step(0.05);
    expect(noisy.response.elastic[0] == smooth.response.elastic[0], "the same force");
  }
  for (int k = 0; k < 12; ++k) {
    noisy.step(0.05);
    smooth.step(0.05);
  }
  CHECK(noisy.x() != smooth.x());
}
// The falling load ends among many bristles of nearly equal rank (their order of leaving), so no rank
// separates exactly the mass that must leave.
TEST_CASE("Energy of a brush that fluctuates balances where a load ends among bristles of nearly one rank",
          "[fluctuation]") {
  for (const SnapLength& law : {uniform, SnapLength::exponential(dbar)}) {
    INFO(to_string(law.law()));
    Brush brush(with_rubbing(law, {0.4, 0.0}), infinite_options(8.0).with_fluctuation(100));
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> flat(-1.0, 1.0);
    for (int k = 0; k < 20000; ++k) {
      const double length = std::pow(10.0, 2.0 * flat(random) - 1.0) * (flat(random) > 0.99 ? 20.0 : 1.0);
      const double dx = length * flat(random), dy = length * flat(random), kind = flat(random);
      if (kind > 0.98)
        brush.load = 0.0;
      else if (kind > 0.9)
        brush.load = load_n * std::pow(10.0, -3.0 + 3.5 * std::abs(flat(random)));
      else if (kind > 0.5)
        brush.load = std::max(0.3 * load_n, brush.load) * (1.0 + 0.01 * flat(random));
      brush.step(dx, dy);
      brush.most_negative = std::min(brush.most_negative, brush.response.contact_loss);
    }
    CHECK(brush.imbalance < 1e-10);
    CHECK(brush.most_negative >= 0.0);
  }
}

TEST_CASE("Seeds and keys give independent noise, the same seed the same", "[fluctuation]") {
  const Path path{0.3, 0.0, 10000};
  const Material material = with_rubbing(lognormal, rubbed);
  const auto first = follow_patch(path, material, options_of(1000, 1));
  const auto again = follow_patch(path, material, options_of(1000, 1));
  bool same = true;
  for (std::size_t i = 0; i < first.size(); ++i) same = same && first[i].along == again[i].along;
  CHECK(same);
  const Noise a = noise_of(first, &Deflection::along, path.step);
  for (const PatchOptions& options : {options_of(1000, 2), options_of(1000, 1).with_key(1)}) {
    const auto other = follow_patch(path, material, options);
    const Noise b = noise_of(other, &Deflection::along, path.step);
    double product = 0.0;
    for (std::size_t i = 0; i < first.size(); ++i)
      product += (first[i].along - a.mean) * (other[i].along - b.mean);
    const double correlation =
        product / static_cast<double>(first.size()) / std::sqrt(a.variance * b.variance);
    expect_near(correlation, 0.0, 0.05, "correlation of two seeds");
  }
}

TEST_CASE("A restored brush draws as the one that was saved, whatever seed it was made with",
          "[fluctuation]") {
  OnePatch saved(with_rubbing(lognormal, paper), options_of(100)),
      restored(with_rubbing(lognormal, paper), options_of(100));
  saved.batch.reset(saved.id, 7, 5);
  std::vector<std::byte> state(saved.batch.state_size());
  for (int k = 0; k < 40; ++k) {
    if (k == 20) {
      saved.batch.save_state({state.data(), state.size()});
      restored.batch.restore_state({state.data(), state.size()});
    }
    const double answer = saved.step(0.3 * dbar, 0.0, load_n).elastic[0];
    if (k >= 20) CHECK(restored.step(0.3 * dbar, 0.0, load_n).elastic[0] == answer);
  }
}

TEST_CASE("A brush that fluctuates is reset to a new one, and takes no state of another number",
          "[fluctuation]") {
  const auto slide = [](OnePatch& p) {
    Response response;
    for (int k = 0; k < 200; ++k) response = p.step(0.07 * dbar, 0.02 * dbar, load_n);
    return response.elastic[0];
  };
  for (const Rubbing& r : {paper, rubbed}) {
    OnePatch patch(with_rubbing(lognormal, r), options_of(300, 5)),
        other(with_rubbing(lognormal, r), options_of(301, 5));
    const double once = slide(patch);
    const std::vector<std::byte> state = saved_state(patch.batch);
    patch.batch.reset(patch.id);
    CHECK(slide(patch) == once);
    CHECK(message_of([&] { other.batch.restore_state(state); }) != "(no error)");
  }
}

TEST_CASE("Representatives refuse a fluctuation: they have their own", "[fluctuation]") {
  PatchBatch batch;
  const std::string message = message_of([&] {
    batch.add(with_rubbing(lognormal, paper), PatchOptions{}.with_fluctuation(100).with_bristles(100));
  });
  CHECK(message.find("fluctuation = 100") != std::string::npos);
  CHECK(message.find("Population::infinite") != std::string::npos);
}

}  // namespace bristle_test::test_fluctuation
