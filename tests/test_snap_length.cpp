// The laws of the snap length, and the elementary functions from which they are computed.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "../core/materials/elementary.hpp"
#include "brute_force.hpp"
#include "expect.hpp"

#include <bristle/snap_length.hpp>

namespace bristle_test::test_snap_length {

using bristle::SnapLaw;
using bristle::SnapLength;

namespace {

namespace own = bristle::detail;

constexpr double inf = std::numeric_limits<double>::infinity();
constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();

/// Returns the largest error of a function's values, in units of the last place of the expected ones.
template <class Own, class Libm>
double worst_ulp(const Own& f, const Libm& reference, const std::vector<double>& arguments) {
  double worst = 0.0;
  for (double x : arguments) {
    const double expected = reference(x), value = f(x);
    if (value == expected) continue;
    const double size = std::abs(expected);
    const double ulp = std::nextafter(size, inf) - size;
    const double error = std::abs(value - expected) / ulp;
    if (!(error <= worst)) worst = std::isnan(error) ? inf : error;
  }
  return worst;
}

std::vector<double> spread_evenly(double low, double high, int n) {
  std::vector<double> x;
  for (int i = 0; i <= n; ++i) x.push_back(low + (high - low) * i / n);
  return x;
}

std::vector<double> spread_over_octaves(double low, double high, int n) {
  std::vector<double> x;
  for (int i = 0; i <= n; ++i) x.push_back(low * std::exp((std::log(high) - std::log(low)) * i / n));
  return x;
}

struct Named {
  std::string name;
  SnapLength law;
  Quantile quantile;  // quantile function in closed form, apart from the library
};

std::vector<Named> all_laws() {
  using namespace bristle_test;
  const std::vector<double> table{2e-6, 3e-6, 3e-6, 5e-6, 9e-6, 20e-6, 20e-6};
  const std::vector<double> table_from_zero{0.0, 1e-3, 4e-3};
  return {
      {"single", SnapLength::single(7e-6), single_quantile(7e-6)},
      {"uniform", SnapLength::uniform(5e-6, 15e-6), uniform_quantile(5e-6, 15e-6)},
      {"uniform from 0", SnapLength::uniform(0.0, 2.0), uniform_quantile(0.0, 2.0)},
      {"narrow uniform", SnapLength::uniform(0.999, 1.0), uniform_quantile(0.999, 1.0)},
      {"normal 0.2", SnapLength::normal(1e-3, 2e-4), normal_quantile(1e-3, 2e-4)},
      {"normal 0.5", SnapLength::normal(10e-6, 5e-6), normal_quantile(10e-6, 5e-6)},
      {"normal 1", SnapLength::normal(10e-6, 10e-6), normal_quantile(10e-6, 10e-6)},
      {"narrow normal", SnapLength::normal(1.0, 1e-4), normal_quantile(1.0, 1e-4)},
      {"lognormal 0.05", SnapLength::lognormal(10e-6, 0.05), lognormal_quantile(10e-6, 0.05)},
      {"lognormal 0.3", SnapLength::lognormal(10e-6, 0.3), lognormal_quantile(10e-6, 0.3)},
      {"lognormal 1", SnapLength::lognormal(1e-3, 1.0), lognormal_quantile(1e-3, 1.0)},
      {"exponential", SnapLength::exponential(10e-6), exponential_quantile(10e-6)},
      {"table", SnapLength::table(table), table_quantile(table)},
      {"table from 0", SnapLength::table(table_from_zero), table_quantile(table_from_zero)},
  };
}

/// Returns the integral of g(Q(u)) over u from 0 to `end`, with a quantile function Q apart from the library.
/// Midpoint rule in t, with u = share(t) flat at both ends, where Q may grow without bound.
template <class Function>
double integrate_quantile(const Quantile& quantile, const Function& g, double end = 1.0) {
  constexpr int n = 200000;
  double sum = 0.0;
  for (int i = 0; i < n; ++i) {
    const double t = (i + 0.5) / n;
    const double s = 1.0 - t;
    // `share` is the integral of 140 t^3 (1-t)^3 from 0 to t, and `slope` its derivative.
    const double share = t * t * t * t * (35.0 - 84.0 * t + 70.0 * t * t - 20.0 * t * t * t);
    const double slope = 140.0 * t * t * t * s * s * s;
    if (!(share > 0.0 && share < 1.0)) continue;
    sum += g(quantile(end * share)) * slope;
  }
  return end * sum / n;
}

}  // namespace

TEST_CASE("exp, log, expm1 and log1p are those of libm to two units in the last place", "[elementary]") {
  std::vector<double> exponents = spread_evenly(-708.0, 709.7, 100003);
  for (double x : spread_evenly(-2.0, 2.0, 100003)) exponents.push_back(x);
  for (double x : spread_over_octaves(1e-300, 1.0, 10007)) exponents.insert(exponents.end(), {x, -x});
  CHECK(worst_ulp([](double x) { return own::exp(x); }, [](double x) { return std::exp(x); }, exponents) <=
        2.0);

  std::vector<double> positive = spread_over_octaves(1e-320, 1.7e308, 100003);
  for (double x : spread_evenly(0.5, 2.0, 100003)) positive.push_back(x);
  for (double x : spread_over_octaves(1e-16, 0.1, 10007)) positive.insert(positive.end(), {1.0 + x, 1.0 - x});
  CHECK(worst_ulp([](double x) { return own::log(x); }, [](double x) { return std::log(x); }, positive) <=
        2.0);

  std::vector<double> small = spread_evenly(-0.99, 3.0, 100003);
  for (double x : spread_over_octaves(1e-300, 0.4, 10007)) small.insert(small.end(), {x, -x});
  CHECK(worst_ulp([](double x) { return own::log1p(x); }, [](double x) { return std::log1p(x); }, small) <=
        3.0);
  CHECK(worst_ulp([](double x) { return own::expm1(x); }, [](double x) { return std::expm1(x); }, small) <=
        5.0);
}

TEST_CASE("exp, log, expm1 and log1p answer at the ends of their range as libm does", "[elementary]") {
  for (double x : {0.0, -0.0, 709.8, 1e300, inf, -745.0, -746.0, -1e300, -inf, 710.0}) {
    INFO(x);
    CHECK(own::exp(x) == std::exp(x));
  }
  CHECK(own::exp(709.78271289338397) == Approx(std::exp(709.78271289338397)).epsilon(1e-15));
  CHECK(own::exp(-740.0) == Approx(std::exp(-740.0)).margin(5e-324));
  CHECK(std::isnan(own::exp(nan_value)));
  CHECK(own::log(1.0) == 0.0);
  CHECK(own::log(0.0) == -inf);
  CHECK(own::log(inf) == inf);
  CHECK(std::isnan(own::log(-1.0)));
  CHECK(std::isnan(own::log(nan_value)));
  CHECK(own::log(std::numeric_limits<double>::max()) == std::log(std::numeric_limits<double>::max()));
  CHECK(own::log(std::numeric_limits<double>::denorm_min()) ==
        std::log(std::numeric_limits<double>::denorm_min()));
  for (double x : {inf, -inf, -1000.0}) CHECK(own::expm1(x) == std::expm1(x));
  for (double x : {inf, -1.0, std::numeric_limits<double>::max()}) CHECK(own::log1p(x) == std::log1p(x));
  CHECK(std::isnan(own::log1p(-1.5)));
  CHECK(std::isnan(own::log1p(nan_value)));
}

TEST_CASE("The normal distribution function is erfc, its inverse undoes it, down to 1e-300", "[elementary]") {
  double worst = 0.0;
  for (double z : spread_evenly(-37.0, 9.0, 20011)) {
    // Tolerance in proportion to 1 + z^2, as the argument's rounding gives erfc an error that grows with z^2.
    const double expected = 0.5 * std::erfc(-z / std::sqrt(2.0));
    worst = std::max(worst, std::abs(own::normal_cdf(z) / expected - 1.0) / (1.0 + z * z));
  }
  CHECK(worst <= 1e-15);
  CHECK(own::normal_cdf(0.0) == Approx(0.5).epsilon(1e-15));
  CHECK(own::normal_cdf(-inf) == 0.0);
  CHECK(own::normal_cdf(inf) == 1.0);

  worst = 0.0;
  std::vector<double> shares = spread_over_octaves(1e-300, 0.5, 20011);
  for (double p : spread_evenly(1e-4, 0.5, 20011)) shares.push_back(p);
  for (double p : shares) {
    const double z = own::normal_quantile(p);
    worst = std::max(worst, std::abs(own::normal_cdf(z) / p - 1.0) / (1.0 + z * z));
    if (p > 1e-10) expect_near(own::normal_quantile(1.0 - p), -z, 1e-15 / p + 1e-14, "symmetry");
  }
  CHECK(worst <= 1e-15);
  CHECK(own::normal_quantile(0.5) == 0.0);
  CHECK(own::normal_quantile(0.975) == Approx(1.959963984540054).epsilon(1e-15));
  CHECK(own::normal_quantile(1e-10) == Approx(-6.361340902404056).epsilon(1e-15));
  CHECK(own::normal_quantile(0.0) == -inf);
  CHECK(own::normal_quantile(1.0) == inf);
  CHECK(std::isnan(own::normal_quantile(1.5)));
}

TEST_CASE("Quantiles are those of an independent implementation", "[snap_length]") {
  for (const Named& named : all_laws()) {
    INFO(named.name);
    for (double u : spread_evenly(1e-3, 1.0 - 1e-3, 4999)) {
      expect_near(named.law.quantile(u) / named.law.mean(), named.quantile(u) / named.law.mean(), 1e-12,
                  "quantile");
    }
    for (double u : {1e-9, 1e-6, 1.0 - 1e-6, 1.0 - std::ldexp(1.0, -24)}) {
      const double expected = named.quantile(u);
      expect_near(named.law.quantile(u), expected, 1e-9 * (expected + named.law.mean()), "far quantile");
    }
    CHECK(named.law.quantile(1e-300) >= 0.0);
  }
}

TEST_CASE("Moments are the integrals of the quantile function", "[snap_length]") {
  for (const Named& named : all_laws()) {
    INFO(named.name);
    const double mean = named.law.mean();
    // Leaves out higher moments of a wide lognormal law, which the midpoint sum does not resolve.
    const int most = named.law.cv() > 0.9 && named.law.law() == SnapLaw::lognormal ? 2 : 6;
    for (int k = 0; k <= most; ++k) {
      INFO("k = " << k);
      const double expected =
          integrate_quantile(named.quantile, [&](double q) { return std::pow(q / mean, k); });
      CHECK(named.law.moment(k) / std::pow(mean, k) == Approx(expected).epsilon(k <= 2 ? 1e-6 : 1e-4));
    }
    CHECK(named.law.moment(0) == 1.0);
    CHECK(named.law.moment(1) == Approx(mean).epsilon(1e-15));
    const double variance =
        integrate_quantile(named.quantile, [&](double q) { return std::pow(q / mean - 1.0, 2); });
    CHECK(named.law.cv() == Approx(std::sqrt(variance)).epsilon(1e-5).margin(1e-9));
  }
}

TEST_CASE("Moments have their closed forms to twelve digits", "[snap_length]") {
  const SnapLength uniform = SnapLength::uniform(0.5, 1.5);
  CHECK(uniform.mean() == 1.0);
  CHECK(uniform.moment(2) == Approx(13.0 / 12.0).epsilon(1e-14));
  CHECK(uniform.moment(3) == Approx(1.25).epsilon(1e-14));
  CHECK(uniform.cv() == Approx(std::sqrt(1.0 / 12.0)).epsilon(1e-15));
  const SnapLength lognormal = SnapLength::lognormal(1.0, 0.3);
  CHECK(lognormal.moment(2) == Approx(1.09).epsilon(1e-14));
  CHECK(lognormal.moment(3) == Approx(1.295029).epsilon(1e-14));
  CHECK(lognormal.moment(6) == Approx(std::pow(1.09, 15)).epsilon(1e-13));
  const SnapLength exponential = SnapLength::exponential(2.0);
  CHECK(exponential.moment(6) == Approx(720.0 * 64.0).epsilon(1e-14));
  CHECK(exponential.cv() == 1.0);
  // Expects of a normal law with deviation = mean = 1, cut at 0: mean 1 + phi(1) / Phi(1), E[x^2] = mean + 1.
  const SnapLength normal = SnapLength::normal(1.0, 1.0);
  const double mean = 1.0 + std::exp(-0.5) / std::sqrt(2.0 * M_PI) / (0.5 * std::erfc(-std::sqrt(0.5)));
  CHECK(normal.mean() == Approx(mean).epsilon(1e-14));
  CHECK(normal.moment(2) == Approx(mean + 1.0).epsilon(1e-14));
  CHECK(normal.moment(3) == Approx(mean + 1.0 + 2.0 * mean).epsilon(1e-14));
  CHECK(normal.cv() == Approx(std::sqrt(mean + 1.0 - mean * mean) / mean).epsilon(1e-13));
  // A narrow normal law is not cut at 0. Its spread must not be lost in the difference of squares that gives
  // the variance.
  CHECK(SnapLength::normal(1.0, 1e-9).cv() == Approx(1e-9).epsilon(1e-12));
  CHECK(SnapLength::lognormal(1.0, 1e-9).quantile(0.975) - 1.0 == Approx(1.959963984540054e-9).epsilon(1e-6));
  const std::vector<double> table{1.0, 1.0, 3.0};  // half of the lengths are 1, half uniform on [1, 3]
  CHECK(SnapLength::table(table).mean() == 1.5);
  CHECK(SnapLength::table(table).moment(2) == Approx(0.5 + 0.5 * 13.0 / 3.0).epsilon(1e-15));
}

TEST_CASE("Survival and partial moments are integrals of the quantile function up to x", "[snap_length]") {
  for (const Named& named : all_laws()) {
    if (named.law.law() == SnapLaw::single) continue;
    INFO(named.name);
    const double mean = named.law.mean();
    for (double share : {0.01, 0.2, 0.4, 0.7, 0.95}) {
      const double x = named.quantile(share);
      const bool atom = named.name == "table" && (share == 0.2 || share == 0.95);
      if (atom) continue;  // skips atoms, where the distribution function jumps
      INFO("share " << share);
      CHECK(named.law.survival(x) == Approx(1.0 - share).epsilon(1e-11));
      CHECK(named.law.partial_moment(0, x) == Approx(share).epsilon(1e-10));
      for (int k = 1; k <= 2; ++k) {
        const double expected = integrate_quantile(
            named.quantile, [&](double q) { return std::pow(q / mean, k); }, share);
        CHECK(named.law.partial_moment(k, x) / std::pow(mean, k) == Approx(expected).epsilon(1e-7));
      }
    }
    for (int k = 0; k <= 2; ++k) {
      CHECK(named.law.partial_moment(k, 0.0) == 0.0);
      CHECK(named.law.partial_moment(k, -1.0) == 0.0);
      CHECK(named.law.partial_moment(k, inf) == Approx(named.law.moment(k)).epsilon(1e-14));
      CHECK(named.law.partial_moment(k, 1e4 * mean) == Approx(named.law.moment(k)).epsilon(1e-9));
    }
    CHECK(named.law.survival(-1.0) == 1.0);
    CHECK(named.law.survival(0.0) == 1.0);
    CHECK(named.law.survival(inf) == 0.0);
  }
}

TEST_CASE("Partial moments keep their digits near 0", "[snap_length]") {
  const SnapLength exponential = SnapLength::exponential(1.0);
  CHECK(exponential.partial_moment(0, 1e-9) == Approx(1e-9 - 0.5e-18).epsilon(1e-14));
  CHECK(exponential.partial_moment(1, 1e-6) == Approx(0.5e-12 - 1e-18 / 3.0).epsilon(1e-12));
  CHECK(exponential.partial_moment(2, 1e-6) == Approx(1e-18 / 3.0 - 0.25e-24).epsilon(1e-12));
  CHECK(exponential.partial_moment(2, 2.0) == Approx(2.0 - 10.0 * std::exp(-2.0)).epsilon(1e-13));
  CHECK(exponential.partial_moment(2, 2.1) ==
        Approx(2.0 - (2.0 + 4.2 + 4.41) * std::exp(-2.1)).epsilon(1e-13));
  const SnapLength uniform = SnapLength::uniform(1.0, 2.0);
  CHECK(uniform.partial_moment(2, 1.0 + 1e-9) == Approx(1e-9).epsilon(1e-6));
}

TEST_CASE("An atom counts in survival and partial moment as the strict inequalities say", "[snap_length]") {
  const SnapLength single = SnapLength::single(2.0);
  CHECK(single.survival(2.0) == 0.0);
  CHECK(single.survival(1.9999) == 1.0);
  CHECK(single.partial_moment(1, 2.0) == 0.0);
  CHECK(single.partial_moment(1, 2.0001) == 2.0);
  const std::vector<double> values{1.0, 2.0, 2.0};
  const SnapLength table = SnapLength::table(values);
  CHECK(table.survival(2.0) == 0.0);
  CHECK(table.partial_moment(0, 2.0) == 0.5);
  CHECK(table.partial_moment(0, 2.0001) == 1.0);
}

TEST_CASE("The longest snap length is the bound of the law or its quantile at 1 - 2^-24", "[snap_length]") {
  CHECK(SnapLength::single(2.0).longest() == 2.0);
  CHECK(SnapLength::uniform(1.0, 3.0).longest() == 3.0);
  CHECK(SnapLength::exponential(1.0).longest() == Approx(24.0 * std::log(2.0)).epsilon(1e-14));
  const std::vector<double> values{1.0, 2.0, 5.0};
  CHECK(SnapLength::table(values).longest() == 5.0);
  const double z = 5.3 - (0.5 * std::erfc(5.3 / std::sqrt(2.0)) - std::ldexp(1.0, -24)) *
                             -std::sqrt(2.0 * M_PI) *
                             std::exp(0.5 * 5.3 * 5.3);  // quantile at 1 - 2^-24, by a Newton step from 5.3
  CHECK(SnapLength::normal(1.0, 0.1).longest() == Approx(1.0 + 0.1 * z).epsilon(1e-4));
  // Checks that every length is below 2^10 mean lengths, on which fixed-point sums of deflections rely.
  CHECK(SnapLength::lognormal(1.0, 3.0).longest() < 1024.0);
  CHECK(SnapLength::lognormal(1.0, 3.0).longest() > 900.0);
}

TEST_CASE("Laws without spread become single", "[snap_length]") {
  const std::vector<double> equal{3.0, 3.0, 3.0};
  for (const SnapLength& law : {SnapLength::uniform(3.0, 3.0), SnapLength::normal(3.0, 0.0),
                                SnapLength::lognormal(3.0, 0.0), SnapLength::table(equal)}) {
    CHECK(law == SnapLength::single(3.0));
    CHECK(law.law() == SnapLaw::single);
    CHECK(law.cv() == 0.0);
  }
}

TEST_CASE("Laws compare by what defines them", "[snap_length]") {
  CHECK(SnapLength() == SnapLength::uniform(5e-6, 15e-6));
  CHECK(SnapLength::uniform(1.0, 2.0) != SnapLength::uniform(1.0, 2.1));
  CHECK(SnapLength::uniform(1.0, 2.0) != SnapLength::normal(2.0, 1.0));
  CHECK(SnapLength::exponential(1.0) != SnapLength::single(1.0));
  const std::vector<double> a{1.0, 2.0, 4.0}, b{1.0, 3.0, 4.0};
  CHECK(SnapLength::table(a) == SnapLength::table(a));
  CHECK(SnapLength::table(a) != SnapLength::table(b));
  CHECK(SnapLength::table(a).table_values().size() == 3);
  CHECK(SnapLength::table(a).table_values()[1] == 2.0);
  CHECK(SnapLength::normal(3.0, 0.5).first_parameter() == 3.0);
  CHECK(SnapLength::normal(3.0, 0.5).second_parameter() == 0.5);
  CHECK(std::string(to_string(SnapLaw::lognormal)) == "lognormal");
  CHECK(std::string(to_string(SnapLaw::table)) == "table");
}

TEST_CASE("Bad parameters of a law are refused by name, value and range", "[snap_length][bad_input]") {
  const auto refuses = [](const std::function<void()>& call, const std::vector<std::string>& parts) {
    return names(message_of(call), parts);
  };
  for (double bad : {0.0, -1.0, 1e-310, 0.99e-12, 1.001e3, 1e300, inf, -inf, nan_value}) {
    INFO(bad);
    CHECK(refuses([=] { SnapLength::single(bad); }, {"single", "length_m", "1e-12 to 1000 m"}));
    CHECK(refuses([=] { SnapLength::uniform(0.0, bad); }, {"uniform", "max_m", "1e-12 to 1000 m"}));
    CHECK(refuses([=] { SnapLength::normal(bad, 0.0); }, {"normal", "mean_m", "1e-12 to 1000 m"}));
    CHECK(refuses([=] { SnapLength::lognormal(bad, 0.1); }, {"lognormal", "mean_m", "1e-12 to 1000 m"}));
    CHECK(refuses([=] { SnapLength::exponential(bad); }, {"exponential", "mean_m", "1e-12 to 1000 m"}));
    const std::vector<double> values{0.0, bad};
    CHECK(refuses([=] { SnapLength::table(values); }, {"table", "quantiles_m[1]", "1000"}));
  }
  CHECK(refuses([] { SnapLength::single(-0.25); }, {"length_m = -0.25;"}));
  CHECK(refuses([] { SnapLength::uniform(-1e-6, 1e-3); }, {"min_m = -1e-06", "0 to 0.001"}));
  CHECK(refuses([] { SnapLength::uniform(2e-3, 1e-3); }, {"min_m = 0.002", "0 to 0.001"}));
  CHECK(refuses([] { SnapLength::uniform(nan_value, 1e-3); }, {"min_m = nan"}));
  CHECK(refuses([] { SnapLength::normal(1.0, 1.01); }, {"deviation_m = 1.01", "0 to 1"}));
  CHECK(refuses([] { SnapLength::normal(1.0, -0.1); }, {"deviation_m = -0.1"}));
  CHECK(refuses([] { SnapLength::lognormal(1.0, 3.5); }, {"cv = 3.5", "0 to 3"}));
  CHECK(refuses([] { SnapLength::lognormal(1.0, nan_value); }, {"cv = nan", "0 to 3"}));
  const std::vector<double> one{1.0}, falling{1.0, 3.0, 2.0}, negative{-1.0, 2.0},
      share_of_zeros{0.0, 0.0, 1.0};
  const std::vector<double> many(258, 1.0);
  CHECK(refuses([&] { SnapLength::table(one); }, {"number of quantiles_m = 1", "2 to 257"}));
  CHECK(refuses([&] { SnapLength::table(many); }, {"number of quantiles_m = 258", "2 to 257"}));
  CHECK(refuses([&] { SnapLength::table(falling); }, {"quantiles_m[2] = 2", "3 to 1000 m, ascending"}));
  CHECK(refuses([&] { SnapLength::table(negative); }, {"quantiles_m[0] = -1"}));
  CHECK(refuses([&] { SnapLength::table(share_of_zeros); }, {"quantiles_m[1] = 0", "1e-12"}));
  std::vector<double> far(257, 1e-6);
  far.back() = 1.0;  // one long length: the mean is 1/512 of it, which is allowed
  CHECK(SnapLength::table(far).longest() == 1.0);
  std::vector<double> farther(257, 1e-9);
  CHECK(SnapLength::table(farther).law() == SnapLaw::single);
  CHECK(refuses([] { SnapLength().quantile(0.0); }, {"u = 0", "above 0 and below 1"}));
  CHECK(refuses([] { SnapLength().quantile(1.0); }, {"u = 1", "above 0 and below 1"}));
  CHECK(refuses([] { SnapLength().moment(7); }, {"k = 7", "0 to 6"}));
  CHECK(refuses([] { SnapLength().partial_moment(3, 1.0); }, {"k = 3", "0 to 2"}));
  CHECK(SnapLength::table(std::vector<double>(257, 1e-12)).mean() == 1e-12);
  CHECK(SnapLength::single(1e-12).mean() == 1e-12);
  CHECK(SnapLength::single(1e3).mean() == 1e3);
}

}  // namespace bristle_test::test_snap_length
