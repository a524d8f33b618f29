// Ageing and strengthening with speed as numbers: kinetic friction at a speed, and the conversion of
// coefficients to a material that ages and back. Expected values come from the table data/ageing_steady.csv,
// from quadrature over the deflection of a bristle, and from bristles followed one by one.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "expect.hpp"
#include "reference_table.hpp"
#include "scenes.hpp"

#include <bristle/material.hpp>

namespace bristle_test::test_ageing_law {

using bristle::Ageing;
using bristle::AgeingForm;
using bristle::Coefficients;

namespace {

constexpr double dbar = 8e-6, tau = 0.25;

SnapLength law_of(const std::string& name) {
  if (name == "normal_0.25") return SnapLength::normal(dbar, 0.25 * dbar);
  return reference_law(name, dbar);
}

Material ageing_material(const SnapLength& law, const Ageing& ageing, SnapRule rule = SnapRule::redraw,
                         double kappa = 0.0, double residual_over_mean = 0.0) {
  return reduced_material(law, rule, kappa, residual_over_mean).with_ageing(ageing);
}

/// Returns the growth g of a snap length at an age (both forms of the law), apart from the library's code.
double growth(const Ageing& a, double age_s) {
  return a.form == AgeingForm::saturating ? 1.0 + a.strength * (1.0 - std::exp(-age_s / a.time))
                                          : 1.0 + a.strength * std::log(1.0 + age_s / a.time);
}

/// Returns kinetic friction with SnapRule::redraw, in mean snap lengths: f = int r T dr / int T dr, T = S(r /
/// g(r / v)) exp(-kappa nu r), (1 + kappa) nu int T dr = 1, by Simpson's rule over r and bisection for nu.
double quadrature(const SnapLength& law, const Ageing& ageing, double kappa, double speed) {
  constexpr int n = 12000;
  const double mean = law.mean(), end = 40.0;
  std::vector<double> survival(n + 1);
  for (int i = 0; i <= n; ++i) {
    const double r = end * i / n * mean;
    survival[static_cast<std::size_t>(i)] = law.survival(r / growth(ageing, r / speed));
  }
  const auto moment = [&](int k, double lambda) {
    double sum = 0.0;
    for (int i = 0; i <= n; ++i) {
      const double r = end * i / n, weight = i == 0 || i == n ? 1.0 : i % 2 == 1 ? 4.0 : 2.0;
      sum += weight * survival[static_cast<std::size_t>(i)] * std::exp(-lambda * r) * (k == 0 ? 1.0 : r);
    }
    return sum * end / n / 3.0;
  };
  double low = 0.0, high = kappa == 0.0 ? 0.0 : 10.0;
  for (int i = 0; i < 50 && kappa != 0.0; ++i) {
    const double lambda = 0.5 * (low + high);
    ((1.0 + kappa) * lambda / kappa * moment(0, lambda) < 1.0 ? low : high) = lambda;
  }
  return moment(1, low) / moment(0, low);
}

/// Returns the mean deflection beyond the residual of bristles followed one by one in steady sliding, in mean
/// snap lengths.
double follow(const SnapLength& law, SnapRule rule, const Ageing& ageing, double kappa, double speed) {
  constexpr std::size_t bristles = 6000;
  constexpr double piece = 1.0 / 50;
  std::mt19937_64 random(11);
  std::vector<double> lengths(4096), bend(bristles, 0.0), length(bristles);
  for (std::size_t i = 0; i < lengths.size(); ++i)
    lengths[i] = law.quantile((static_cast<double>(i) + 0.5) / 4096) / law.mean();
  const auto draw = [&] { return lengths[random() >> 52]; };
  for (std::size_t i = 0; i < bristles; ++i) length[i] = lengths[i * 4096 / bristles];
  double sum = 0.0;
  int counted = 0;
  for (int step = 0; step < 1000; ++step) {
    std::size_t snaps = 0;
    std::vector<char> snapped(bristles, 0);
    for (std::size_t i = 0; i < bristles; ++i) {
      const double before = bend[i];
      bend[i] += piece;
      const auto beyond = [&](double r) { return r - length[i] * growth(ageing, r * law.mean() / speed); };
      if (beyond(bend[i]) < 0.0) continue;
      // Finds the position of a bristle's snap within a piece of path by the secant method. The path left
      // bends the bristle again.
      const double from = beyond(before), to = beyond(bend[i]);
      bend[i] = piece * to / (to - from);
      if (rule == SnapRule::redraw) length[i] = draw();
      snapped[i] = 1;
      ++snaps;
    }
    const double chance = 1.0 - std::exp(-kappa * static_cast<double>(snaps) / bristles);
    const auto limit = static_cast<std::uint64_t>(chance * 18446744073709551615.0);
    for (std::size_t i = 0; i < bristles && limit > 0; ++i) {
      if (snapped[i] || random() >= limit) continue;
      bend[i] = 0.5 * piece;
      if (rule == SnapRule::redraw) length[i] = draw();
    }
    if (step < 500) continue;
    for (const double r : bend) sum += r;
    ++counted;
  }
  return sum / bristles / counted;
}

}  // namespace

TEST_CASE("Kinetic friction at a speed is that of the table of contacts that age", "[ageing]") {
  for (const Row& row : read_table("ageing_steady.csv")) {
    const SnapRule rule = row.at("variant") == "keep" ? SnapRule::keep : SnapRule::redraw;
    const Material m =
        ageing_material(law_of(row.at("dist")), Ageing::logarithmic(number(row, "beta"), tau), rule);
    CAPTURE(row.at("dist"), row.at("variant"), row.at("beta"), row.at("v_tau_over_dbar"));
    const double speed = number(row, "v_tau_over_dbar") * dbar / tau;
    CHECK(m.kinetic_coefficient(speed) == Approx(number(row, "f_kinetic_ref")).margin(1e-6));
    CHECK(m.kinetic_coefficient(-speed) == m.kinetic_coefficient(speed));
  }
}

TEST_CASE("Kinetic friction at a speed with shared renewal and residual follows the equations of sliding",
          "[ageing][rubbing]") {
  for (const char* law : {"lognormal_cv0.3", "uniform_0.5_1.5", "exponential", "normal_0.25"}) {
    for (const Ageing& ageing : {Ageing::logarithmic(0.05, tau), Ageing::saturating(0.6, tau)}) {
      for (const double w : {1e-2, 3.0}) {
        const double speed = w * dbar / tau;
        const double expected = quadrature(law_of(law), ageing, 1.0, speed);
        CAPTURE(law, ageing.strength, w);
        // Simpson's rule is inexact at the corners of the uniform law's density, hence a wider tolerance.
        CHECK(ageing_material(law_of(law), ageing, SnapRule::redraw, 1.0, 0.4).kinetic_coefficient(speed) ==
              Approx(0.4 + expected).margin(law == std::string("uniform_0.5_1.5") ? 1e-5 : 1e-6));
      }
    }
  }
}

TEST_CASE("Kinetic friction at a speed with shared renewal follows bristles one by one",
          "[ageing][rubbing]") {
  const SnapLength law = law_of("lognormal_cv0.3");
  const double speed = 0.1 * dbar / tau;
  for (const SnapRule rule : {SnapRule::redraw, SnapRule::keep}) {
    const Ageing ageing = Ageing::logarithmic(0.1, tau);
    CAPTURE(static_cast<int>(rule));
    // Tolerance: 6000 bristles over ten renewals have a statistical error of 2e-3; the order of snaps and
    // renewals within a small piece of path adds some 1e-3.
    CHECK(ageing_material(law, ageing, rule, 1.0).kinetic_coefficient(speed) ==
          Approx(follow(law, rule, ageing, 1.0, speed)).margin(6e-3));
  }
}

TEST_CASE(
    "A single length that ages snaps where it is as long as its age makes it, at any speed and strength",
    "[ageing]") {
  for (const double strength : {1e-3, 0.5, bristle::largest_ageing})
    for (const double t : {bristle::shortest_ageing_time, 1e-4, 1.0, bristle::longest_ageing_time})
      for (const Ageing& ageing : {Ageing::logarithmic(strength, t), Ageing::saturating(strength, t)})
        for (double v = bristle::slowest_sliding; v < 1e3; v *= 100.0) {
          CAPTURE(strength, t, v);
          // Aged length l of a bristle whose fresh length is dbar: its mean deflection in sliding is l / 2.
          const double l =
              2.0 * dbar * ageing_material(SnapLength::single(dbar), ageing).kinetic_coefficient(v);
          REQUIRE(l == Approx(dbar * growth(ageing, l / v)).epsilon(1e-11));
        }
}

TEST_CASE("Friction that ages lies between fast sliding and the limit of slow sliding", "[ageing]") {
  const SnapLength law = law_of("lognormal_cv0.3");
  for (const double kappa : {0.0, 1.0}) {
    const Material slow = ageing_material(law, Ageing::logarithmic(0.02, tau), SnapRule::redraw, kappa, 0.3);
    CHECK(slow.kinetic_coefficient(1e9) == Approx(slow.kinetic_coefficient()).epsilon(1e-9));
    // Sliding at a tenth of the speed raises the friction beyond the residual by nearly beta ln 10 of it, as
    // snap lengths grow by that share.
    const double fast = slow.kinetic_coefficient(1e-4 * dbar / tau),
                 tenth = slow.kinetic_coefficient(1e-5 * dbar / tau);
    const double beyond = slow.kinetic_coefficient() - 0.3;
    CHECK(tenth - fast == Approx(0.02 * std::log(10.0) * beyond).epsilon(0.05));
    // In slow sliding all bristles age fully, so every snap length grows by the same factor, 1.5.
    const Material skin = ageing_material(law, Ageing::saturating(0.5, tau), SnapRule::redraw, kappa, 0.3);
    CHECK(skin.kinetic_coefficient(0.0) ==
          Approx(0.3 + 1.5 * (skin.kinetic_coefficient() - 0.3)).epsilon(1e-9));
    CHECK(skin.peak_coefficient(1e9) == Approx(0.3 + 1.5 * (skin.peak_coefficient() - 0.3)).epsilon(1e-9));
    CHECK(skin.peak_coefficient(0.0) == Approx(skin.peak_coefficient()).epsilon(1e-15));
  }
  const Material still = ageing_material(law, Ageing{});
  CHECK(still.kinetic_coefficient(1e-6) == still.kinetic_coefficient());
  const Material aged = ageing_material(law, Ageing::logarithmic(0.05, tau));
  CHECK(std::isfinite(aged.kinetic_coefficient(0.0)));
  CHECK(names(message_of([&] { aged.kinetic_coefficient(std::nan("")); }), {"speed_m_per_s", "nan"}));
}

TEST_CASE("Strengthening with speed adds a N asinh(v / (2 v*)) to the steady force",
          "[ageing][strengthening]") {
  const Material plain = ageing_material(law_of("uniform_0.5_1.5"), Ageing::logarithmic(0.02, tau));
  const Material m = Material(plain).with_speed_strengthening(0.013, 2e-5);
  for (const double v : {0.0, 1e-12, 1e-6, 3e-5, 1e-2, 5.0, 1e7}) {
    CAPTURE(v);
    const double added = 0.013 * std::asinh(v / 4e-5);
    CHECK(m.steady_force(v, 2.5) - plain.steady_force(v, 2.5) ==
          Approx(2.5 * added).epsilon(1e-9).margin(1e-15));
    CHECK(m.strengthening_at(-v) == Approx(added).epsilon(1e-14));
    CHECK(m.strengthening_damping(v) * v == Approx(added).epsilon(1e-14));
  }
  CHECK(m.strengthening_damping(0.0) == 0.013 / 4e-5);
  CHECK(m.steady_force(1e-3, 0.0) == 0.0);
  CHECK(plain.strengthening_at(1.0) == 0.0);
}

// --------------------------------------------------------------------------------------- coefficients

namespace {

Coefficients coefficients_with(double fall, double kappa, double share) {
  return Coefficients{}
      .with_kinetic(0.35)
      .with_peak(0.40)
      .with_presliding_length(2e-5)
      .with_residual_share(share)
      .with_shared_renewal(kappa)
      .with_fall_per_decade(fall)
      .with_ageing_time(0.02);
}

/// Returns the peak at first loading of freshly renewed bristles at a speed, in mean snap lengths, by the
/// renewal equation of the aged survival function on a grid. kappa = 0, redraw.
double brute_peak(const SnapLength& law, const Ageing& ageing, double speed) {
  constexpr int n = 1600;
  constexpr double h = 3.2 / n;
  std::vector<double> survival(n + 1), f(n + 1, 0.0);
  for (int i = 0; i <= n; ++i) {
    const double r = h * i * law.mean();
    survival[static_cast<std::size_t>(i)] = law.survival(r / growth(ageing, r / speed));
  }
  for (int i = 1; i <= n; ++i) {
    double sum = h * i * survival[static_cast<std::size_t>(i)];
    for (int k = 1; k <= i; ++k) {
      const double share = survival[static_cast<std::size_t>(k - 1)] - survival[static_cast<std::size_t>(k)];
      sum += share * 0.5 *
             (f[static_cast<std::size_t>(i - k)] + (k > 1 ? f[static_cast<std::size_t>(i - k + 1)] : 0.0));
    }
    f[static_cast<std::size_t>(i)] = sum / (1.0 - 0.5 * (survival[0] - survival[1]));
  }
  return *std::max_element(f.begin(), f.end());
}

}  // namespace

TEST_CASE("Coefficients at a speed become a material that has them at that speed", "[ageing][material]") {
  for (const double kappa : {0.0, 1.0}) {
    for (const double share : {0.0, 0.2}) {
      const Coefficients c = coefficients_with(0.06, kappa, share).with_kinetic_speed(3e-3);
      const Material m = Material::from_coefficients(c);
      CAPTURE(kappa, share);
      CHECK(m.kinetic_coefficient(3e-3) == Approx(0.35).epsilon(1e-9));
      // Expects the asked fall of ln mu per decade of speed, found by a difference quotient.
      const double up = m.kinetic_coefficient(3.03e-3), down = m.kinetic_coefficient(3e-3 / 1.01);
      CHECK(-std::log(up / down) / (2.0 * std::log10(1.01)) == Approx(0.06).epsilon(1e-4));
      const Coefficients back = m.coefficients(3e-3);
      CHECK(back.kinetic == Approx(0.35).epsilon(1e-9));
      CHECK(back.peak == Approx(0.40).epsilon(1e-6));
      CHECK(back.fall_per_decade == Approx(0.06).epsilon(1e-7));
      CHECK(back.presliding_length == Approx(2e-5).epsilon(1e-12));
      CHECK(back.residual_share == Approx(share).margin(1e-12));
      const Material again = Material::from_coefficients(back);
      CHECK(again.ageing_strength == Approx(m.ageing_strength).epsilon(1e-6));
      CHECK(again.bristle_stiffness == Approx(m.bristle_stiffness).epsilon(1e-6));
    }
  }
}

TEST_CASE("Coefficients of fast sliding give the strength of ageing to first order", "[ageing][material]") {
  const double ln10 = std::log(10.0);
  const Material m = Material::from_coefficients(coefficients_with(0.05, 0.0, 0.0));
  CHECK(m.ageing_strength == Approx(0.05 / ln10).epsilon(1e-12));
  CHECK(m.kinetic_coefficient() == Approx(0.35).epsilon(1e-12));
  CHECK(m.peak_coefficient() == Approx(0.40).epsilon(1e-6));
  CHECK(m.coefficients().fall_per_decade == Approx(0.05).epsilon(1e-12));
  // With a residual length only the friction beyond the residual ages, so that part must fall by more to give
  // the asked fall of the whole.
  const Material residual = Material::from_coefficients(coefficients_with(0.05, 0.0, 0.2));
  const double of_it =
      residual.residual_length * residual.bristle_stiffness * residual.bristles_in_contact(1.0);
  CHECK(residual.ageing_strength == Approx(0.05 / ln10 * 0.35 / (0.35 - of_it)).epsilon(1e-12));
  // Static friction grows by 2 beta when a rest is e times as long, so growth per decade gives beta.
  const Material rest =
      Material::from_coefficients(coefficients_with(0.0, 0.0, 0.0).with_growth_per_decade(0.08));
  CHECK(rest.ageing_strength == Approx(0.04 / ln10).epsilon(1e-9));
  CHECK(rest.coefficients().fall_per_decade == Approx(0.04).epsilon(1e-9));
  // With equal snap lengths and kappa = 1, bristles in contact have the mean length 1 and the mean deflection
  // 1 / ln 2 - 1, in units of that length.
  const Material single = Material::from_coefficients(coefficients_with(0.0, 1.0, 0.0)
                                                          .with_law(bristle::SnapLaw::single)
                                                          .with_peak(0.35 / (1.0 / std::log(2.0) - 1.0))
                                                          .with_growth_per_decade(0.08));
  CHECK(single.ageing_strength == Approx(0.08 / ln10 * (1.0 / std::log(2.0) - 1.0)).epsilon(1e-9));
}

TEST_CASE("The peak at a speed is that of first loading of bristles that age on the way",
          "[ageing][material]") {
  for (const char* law : {"lognormal_cv0.3", "uniform_0.5_1.5", "normal_0.25"}) {
    for (const double w : {0.01, 1.0}) {
      const Ageing ageing = Ageing::logarithmic(0.05, tau);
      const double speed = w * dbar / tau;
      const Material m = ageing_material(law_of(law), ageing);
      CAPTURE(law, w);
      // The aged snap lengths are approximated by a law of the same family (of the uniform law, by a table),
      // which sets the error of the conversion.
      const std::string name = law;
      const double error = name == "uniform_0.5_1.5" ? 1e-4 : name == "normal_0.25" ? 2e-3 : 3e-4;
      CHECK(m.coefficients(speed).peak == Approx(brute_peak(law_of(law), ageing, speed)).epsilon(error));
    }
  }
  // With a law given as a table each snap length ages by itself, so the conversion is exact.
  std::vector<double> quantiles;
  for (int i = 0; i <= 64; ++i) quantiles.push_back(dbar * (0.5 + i / 64.0));
  const Ageing ageing = Ageing::logarithmic(0.05, tau);
  const SnapLength table = SnapLength::table({quantiles.data(), quantiles.size()});
  CHECK(ageing_material(table, ageing).coefficients(0.01 * dbar / tau).peak ==
        Approx(brute_peak(law_of("uniform_0.5_1.5"), ageing, 0.01 * dbar / tau)).epsilon(1e-4));
}

TEST_CASE("Saturating ageing is given by a fall at a speed", "[ageing][material]") {
  const Coefficients c = coefficients_with(0.1, 1.0, 0.1)
                             .with_ageing_form(AgeingForm::saturating)
                             .with_ageing_time(2.0)
                             .with_kinetic_speed(1e-5);
  const Material m = Material::from_coefficients(c);
  CHECK(m.ageing_form == AgeingForm::saturating);
  CHECK(m.coefficients(1e-5).fall_per_decade == Approx(0.1).epsilon(1e-7));
  // Checks that coefficients(), called without a speed, finds the speed at which friction falls.
  const Coefficients back = m.coefficients();
  CHECK(back.kinetic_speed == Approx(2e-5 / 2.0).epsilon(1e-12));
  CHECK(Material::from_coefficients(back).ageing_strength == Approx(m.ageing_strength).epsilon(1e-6));
}

TEST_CASE("Coefficients without ageing make no material that ages, and cost no digit", "[ageing][material]") {
  const Material plain = Material::from_coefficients(Coefficients{});
  CHECK(plain.ageing_strength == 0.0);
  CHECK(Material::from_coefficients(Coefficients{}.with_kinetic_speed(1e-3)) == plain);
  const Coefficients strong = Coefficients{}.with_speed_strengthening(0.01, 1e-7);
  CHECK(Material::from_coefficients(strong).speed_strengthening == 0.01);
  CHECK(Material::from_coefficients(strong).coefficients().strengthening_speed == 1e-7);
}

TEST_CASE("Coefficients of ageing out of reach name the range", "[ageing][bad_input]") {
  const auto ask = [](const Coefficients& c) { return message_of([&] { Material::from_coefficients(c); }); };
  const Coefficients c = coefficients_with(0.05, 1.0, 0.1);
  CHECK(names(ask(Coefficients(c).with_growth_per_decade(0.1)),
              {"growth_per_decade = 0.1", "give one of the two"}));
  // Refuses such coefficients: at 3 m/s a bristle snaps after 7 us, but ageing takes 20 ms.
  CHECK(names(ask(Coefficients(c).with_kinetic_speed(3.0)),
              {"fall_per_decade = 0.05", "0 to ", "kinetic_speed 3", "ageing_time 0.02"}));
  CHECK(names(ask(Coefficients(c).with_fall_per_decade(5.0)), {"fall_per_decade = 5", "0 to "}));
  CHECK(names(ask(Coefficients(c).with_fall_per_decade(-0.1)), {"fall_per_decade = -0.1"}));
  CHECK(names(ask(Coefficients(c).with_kinetic_speed(-1.0)), {"kinetic_speed = -1"}));
  CHECK(names(ask(Coefficients(c).with_ageing_time(0.0)), {"ageing_time = 0"}));
  CHECK(
      names(ask(Coefficients(c).with_ageing_form(AgeingForm::saturating)), {"kinetic_speed = 0", "above 0"}));
  CHECK(names(ask(Coefficients(c)
                      .with_ageing_form(AgeingForm::saturating)
                      .with_fall_per_decade(0.0)
                      .with_growth_per_decade(0.1)),
              {"growth_per_decade = 0.1", "fall_per_decade"}));
}

}  // namespace bristle_test::test_ageing_law
