// Residual length and shared renewal as numbers: steady sliding, virgin curve and peak of a material, and the
// conversion of coefficients to such a material and back. Expected values come from the tables
// data/rubbing_*.csv, closed forms, and bristles followed one by one.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "brute_force.hpp"
#include "core/materials/kernel_law.hpp"
#include "expect.hpp"
#include "reference_table.hpp"
#include "scenes.hpp"

#include <bristle/material.hpp>
#include <bristle/patch_batch.hpp>

namespace bristle_test::test_rubbing_law {

using bristle::Coefficients;
using bristle::SnapLaw;
using bristle::virgin_deflection;

namespace {

Material material_of(const Row& row, double mean) {
  return reduced_material(reference_law(row.at("dist"), mean),
                          row.at("variant") == "fixed" ? SnapRule::keep : SnapRule::redraw,
                          number(row, "kappa"), number(row, "residual_over_dbar"));
}

std::string describe(const Row& row) {
  return row.at("dist") + ", " + row.at("variant") + ", kappa " + row.at("kappa") + ", l_r " +
         row.at("residual_over_dbar");
}

/// Mean deflection and snaps per bristle after a straight path, followed bristle by bristle. Renewals are
/// made after each small piece of the path, which gives an error of first order in the piece, 1e-3 here.
struct Population {
  double deflection, snaps;
};
std::vector<Population> drag(const Quantile& quantile, SnapRule rule, double kappa, double residual,
                             const std::vector<double>& paths, std::uint32_t n) {
  constexpr double piece = 1.0 / 200;
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::vector<double> lengths(8192), bend(n, 0.0), length(n);
  for (std::size_t i = 0; i < lengths.size(); ++i)
    lengths[i] = quantile((static_cast<double>(i) + 0.5) / 8192);
  const auto draw = [&] { return lengths[random() >> 51]; };
  for (std::size_t i = 0; i < n; ++i) length[i] = quantile((static_cast<double>(i) + 0.5) / n);
  std::vector<Population> result;
  double all_snaps = 0.0;
  for (int k = 1; result.size() < paths.size(); ++k) {
    int snaps = 0;
    for (std::size_t i = 0; i < n; ++i) {
      bend[i] += piece;
      while (bend[i] >= residual + length[i]) {
        bend[i] -= length[i];
        if (rule == SnapRule::redraw) length[i] = draw();
        ++snaps;
      }
    }
    all_snaps += snaps;
    const double renewed = 1.0 - std::exp(-kappa * snaps / n);
    for (std::size_t i = 0; i < n && renewed > 0.0; ++i) {
      if (!(bend[i] > residual) || !(uniform(random) < renewed)) continue;
      bend[i] = residual + piece * uniform(random);
      if (rule == SnapRule::redraw) length[i] = draw();
    }
    if (k != std::lround(paths[result.size()] / piece)) continue;
    double sum = 0.0;
    for (double z : bend) sum += z;
    result.push_back({sum / n, all_snaps / n});
  }
  return result;
}

const SnapRule both_rules[] = {SnapRule::redraw, SnapRule::keep};

}  // namespace

TEST_CASE("Virgin curves with residual and shared renewal are those of the table", "[rubbing][virgin]") {
  int checked = 0;
  for (const Row& row : read_table("rubbing_virgin.csv")) {
    INFO(describe(row) << ", x = " << row.at("x_over_dbar"));
    const double f = virgin_deflection(material_of(row, 1e-5), number(row, "x_over_dbar"));
    expect_near(f, number(row, "f"), 1e-5, "mean deflection");
    ++checked;
  }
  CHECK(checked > 1000);
}

TEST_CASE("Kinetic force, snap rate and peak with residual and shared renewal are those of the table",
          "[rubbing]") {
  for (const Row& row : read_table("rubbing_summary.csv")) {
    INFO(describe(row));
    const Material material = material_of(row, 1e-5);
    CHECK(material.kinetic_coefficient() == Approx(number(row, "f_kinetic")).margin(2e-7));
    CHECK(material.snap_rate() * 1e-5 == Approx(number(row, "snap_rate")).margin(2e-7));
    if (!row.at("f_peak").empty())
      CHECK(material.peak_coefficient() == Approx(number(row, "f_peak")).margin(2e-6));
    const auto compiled = bristle::detail::compile_material(material);
    CHECK(compiled->snap_rate * compiled->lengths_per_metre * 1e-5 ==
          Approx(number(row, "snap_rate")).margin(2e-7));
    CHECK(compiled->kinetic * compiled->metres_per_length / 1e-5 ==
          Approx(number(row, "f_kinetic")).margin(2e-7));
    CHECK(material.steady_force(0.0, 3.0) == Approx(3.0 * number(row, "f_kinetic")).epsilon(1e-6));
  }
}

TEST_CASE("Shared renewal in closed form: exponential and single lengths", "[rubbing]") {
  for (double kappa : {1e-6, 0.1, 1.0, 16.0}) {
    for (double residual : {0.0, 0.4, 30.0}) {
      INFO("kappa " << kappa << ", l_r " << residual);
      // Exponential law: with d a length over the mean, the equation E[exp(-lambda d)] = 1 / (1 + kappa) has
      // the solution lambda = kappa. Density of deflections beyond the residual: exp(-(1 + kappa) r).
      const Material memoryless =
          reduced_material(SnapLength::exponential(2e-3), SnapRule::redraw, kappa, residual);
      CHECK(memoryless.snap_rate() * 2e-3 == Approx(1.0).epsilon(1e-9));
      CHECK(memoryless.kinetic_coefficient() == Approx(residual + 1.0 / (1.0 + kappa)).epsilon(1e-9));
      CHECK(virgin_deflection(memoryless, residual + 0.7) ==
            Approx(residual + (1.0 - std::exp(-(1.0 + kappa) * 0.7)) / (1.0 + kappa)).margin(1e-6));
      for (SnapRule rule : both_rules) {
        const Material single = reduced_material(SnapLength::single(2e-3), rule, kappa, residual);
        const double lambda = std::log1p(kappa);
        CHECK(single.snap_rate() * 2e-3 == Approx(lambda / kappa).epsilon(1e-12));
        if (kappa >= 0.1) {
          CHECK(single.kinetic_coefficient() == Approx(residual + 1.0 / lambda - 1.0 / kappa).epsilon(1e-12));
        }
        CHECK(single.peak_coefficient() == Approx(residual + 1.0).epsilon(1e-12));
        CHECK(virgin_deflection(single, residual + 3.25) == Approx(residual + 0.25).epsilon(1e-12));
      }
    }
  }
}

TEST_CASE("Shared renewal that goes to 0 leads to the brush without it", "[rubbing]") {
  const std::vector<double> quantiles{0.4, 0.8, 1.0, 1.1, 1.9};
  for (SnapRule rule : both_rules) {
    for (const SnapLength& law :
         {SnapLength::uniform(0.5, 1.5), SnapLength::normal(1.0, 0.2), SnapLength::lognormal(1.0, 0.3),
          SnapLength::lognormal(1.0, 0.1), SnapLength::lognormal(1.0, 1.0), SnapLength::table(quantiles)}) {
      INFO(to_string(law.law()) << " of cv " << law.cv() << (rule == SnapRule::keep ? ", keep" : ", redraw"));
      const Material without = reduced_material(law, rule, 0.0, 0.3),
                     little = reduced_material(law, rule, 1e-7, 0.3);
      CHECK(little.kinetic_coefficient() == Approx(without.kinetic_coefficient()).margin(1e-6));
      CHECK(little.peak_coefficient() == Approx(without.peak_coefficient()).margin(1e-5));
      CHECK(little.snap_rate() == Approx(without.snap_rate()).epsilon(1e-6));
      for (double x : {0.2, 0.3, 0.9, 1.3, 2.9})
        CHECK(virgin_deflection(little, x) == Approx(virgin_deflection(without, x)).margin(1e-5));
    }
  }
}

TEST_CASE("A shared renewal below what can be counted is none", "[rubbing][extremes]") {
  // Values of kappa so small, below 1e-154, that the square of the inverse overflows.
  for (SnapRule rule : both_rules)
    for (const SnapLength& law :
         {SnapLength::uniform(0.5, 1.5), SnapLength::lognormal(1.0, 0.15), SnapLength::lognormal(1.0, 0.6)})
      for (const double tiny : {5e-324, 2.3e-308, 1e-200, 1e-154, 1e-100, 1e-17}) {
        CAPTURE(tiny, law.cv());
        const Material without = reduced_material(law, rule, 0.0, 0.3),
                       with = reduced_material(law, rule, tiny, 0.3);
        CHECK(with.snap_rate() == Approx(without.snap_rate()).epsilon(1e-12));
        CHECK(with.kinetic_coefficient() == Approx(without.kinetic_coefficient()).epsilon(1e-12));
        CHECK(with.peak_coefficient() == Approx(without.peak_coefficient()).epsilon(1e-6));
        CHECK(virgin_deflection(with, 2.9) == Approx(virgin_deflection(without, 2.9)).epsilon(1e-6));
      }
}

TEST_CASE("A renewal that is an avalanche is refused, whatever the population", "[rubbing][bad_input]") {
  // Law in which a third of the drawn lengths snap at once, and each snap draws five more, its own and four
  // renewed ones. So draws multiply: a step would draw without end, or cut a path into 1e11 pieces.
  const std::vector<double> lengths{1e-12, 1e-12, 15e-6, 20e-6};
  const Material avalanche = reduced_material(SnapLength::table(lengths), SnapRule::redraw, 4.0, 0.0);
  const Material calm = Material(avalanche).with_shared_renewal(0.3);
  for (const auto population : {bristle::Population::representatives, bristle::Population::infinite}) {
    const auto options = PatchOptions{}.with_population(population);
    PatchBatch batch;
    CHECK_THROWS_WITH(batch.add(avalanche, options), Catch::Contains("shared_renewal = 4"));
    const PatchId taken = batch.add(calm, options);
    CHECK_THROWS_WITH(batch.set_material(taken, avalanche), Catch::Contains("shared_renewal = 4"));
  }
}

TEST_CASE("Virgin curves of other laws with shared renewal follow bristles one by one", "[rubbing][virgin]") {
  using namespace bristle_test;
  const std::vector<double> spread{0.3, 0.5, 0.9, 1.1, 2.8};
  const std::vector<double> atoms{0.6, 0.6, 1.0, 1.0, 1.4, 2.0};
  struct Case {
    const char* name;
    SnapLength law;
    Quantile quantile;
    // Additional error: for a law with many bristles of nearly one length 1e-3 plus the length of a piece of
    // path.
    double tolerance;
  };
  const std::uint32_t n = test_size(20000);
  const std::vector<double> paths{0.73, 1.115, 2.37, 4.93};
  for (const Case& c :
       {Case{"normal 0.25", SnapLength::normal(1.0, 0.25), normal_quantile(1.0, 0.25), 0.0},
        Case{"lognormal 0.1", SnapLength::lognormal(1.0, 0.1), lognormal_quantile(1.0, 0.1), 0.0},
        Case{"lognormal 0.8", SnapLength::lognormal(1.0, 0.8), lognormal_quantile(1.0, 0.8), 0.0},
        Case{"uniform 0.1 to 1.9", SnapLength::uniform(0.1, 1.9), uniform_quantile(0.1, 1.9), 0.0},
        Case{"table", SnapLength::table(spread), table_quantile(spread), 0.0},
        Case{"atoms", SnapLength::table(atoms), table_quantile(atoms), 0.004}}) {
    for (SnapRule rule : both_rules) {
      const Material material = reduced_material(c.law, rule, 1.5, 0.2 / c.law.mean());
      const std::vector<Population> brute = drag(c.quantile, rule, 1.5, 0.2, paths, n);
      for (std::size_t i = 0; i < paths.size(); ++i) {
        INFO(c.name << (rule == SnapRule::keep ? ", keep" : ", redraw") << ", x = " << paths[i]);
        expect_near(virgin_deflection(material, paths[i] / c.law.mean()) * c.law.mean(), brute[i].deflection,
                    0.004 + 1.2 / std::sqrt(n) + c.tolerance, "mean deflection");
      }
    }
  }
}

TEST_CASE("Steady sliding with shared renewal follows bristles one by one", "[rubbing]") {
  using namespace bristle_test;
  const std::uint32_t n = test_size(20000);
  for (SnapRule rule : both_rules) {
    for (double kappa : {0.5, 3.0}) {
      INFO((rule == SnapRule::keep ? "keep" : "redraw") << ", kappa " << kappa);
      const Material material = reduced_material(SnapLength::lognormal(1.0, 0.4), rule, kappa, 0.5);
      const std::vector<Population> brute =
          drag(lognormal_quantile(1.0, 0.4), rule, kappa, 0.5, {7.0, 10.0}, n);
      expect_near(material.kinetic_coefficient(), brute[1].deflection, 0.004 + 1.2 / std::sqrt(n), "kinetic");
      expect_near(material.snap_rate(), (brute[1].snaps - brute[0].snaps) / 3.0, 0.005 + 2.0 / std::sqrt(n),
                  "rate");
    }
  }
}

TEST_CASE("Far out a virgin curve with shared renewal is steady sliding, by equations that share nothing",
          "[rubbing][virgin]") {
  const std::vector<double> values{0.3, 0.8, 1.0, 1.1, 1.9};
  for (SnapRule rule : both_rules) {
    for (const SnapLength& law :
         {SnapLength::uniform(0.3, 1.7), SnapLength::normal(1.0, 0.3), SnapLength::lognormal(1.0, 0.4),
          SnapLength::lognormal(1.0, 1.2), SnapLength::table(values)}) {
      INFO(to_string(law.law()) << " of cv " << law.cv() << (rule == SnapRule::keep ? ", keep" : ", redraw"));
      const Material material = reduced_material(law, rule, 2.0, 0.4);
      CHECK(virgin_deflection(material, 20.0) == Approx(material.kinetic_coefficient()).margin(1e-5));
      if (law.law() != SnapLaw::table)
        CHECK(virgin_deflection(material, 1e6) == Approx(material.kinetic_coefficient()).margin(1e-5));
    }
  }
}

TEST_CASE("Before the residual length every bristle sticks", "[rubbing][virgin]") {
  for (SnapRule rule : both_rules) {
    const Material material = reduced_material(SnapLength::lognormal(1e-4, 0.3), rule, 1.0, 0.6);
    for (double x : {0.0, 0.1, 0.6}) {
      CHECK(virgin_deflection(material, x) == x);
      CHECK(virgin_deflection(material, -x) == -x);
    }
    CHECK(virgin_deflection(material, -2.0) == -virgin_deflection(material, 2.0));
  }
}

TEST_CASE("The peak of a curve with shared renewal is its highest point", "[rubbing][virgin]") {
  const std::vector<double> values{0.3, 0.8, 1.0, 1.1, 1.9};
  for (const SnapLength& law :
       {SnapLength::uniform(0.9, 1.1), SnapLength::uniform(0.6, 1.4), SnapLength::uniform(0.3, 1.7),
        SnapLength::uniform(0.05, 1.95), SnapLength::normal(1.0, 0.1), SnapLength::normal(1.0, 0.25),
        SnapLength::lognormal(1.0, 0.05), SnapLength::lognormal(1.0, 0.35), SnapLength::lognormal(1.0, 1.0),
        SnapLength::table(values)}) {
    for (SnapRule rule : both_rules) {
      for (double kappa : {0.3, 2.0}) {
        INFO(to_string(law.law()) << " of cv " << law.cv() << (rule == SnapRule::keep ? ", keep" : ", redraw")
                                  << ", kappa " << kappa);
        const Material material = reduced_material(law, rule, kappa, 0.0);
        double highest = material.kinetic_coefficient();
        for (double x = 0.1; x < 4.0; x += 0.03 + 0.05 * x)
          highest = std::max(highest, virgin_deflection(material, x));
        CHECK(material.peak_coefficient() >= highest - 1e-5);
        CHECK(material.peak_coefficient() <= highest + 0.08);
        // The search is for the highest point between the shortest length of a uniform law and twice that.
        if (law.law() != SnapLaw::uniform || rule == SnapRule::keep) continue;
        const double low = law.first_parameter(), end = std::min(2.0 * low, law.second_parameter());
        double peak = 0.0;
        for (int i = 0; i <= 4000; ++i)
          peak = std::max(peak, virgin_deflection(material, low + (end - low) * i / 4000.0));
        CHECK(material.peak_coefficient() >= peak - 1e-12);
      }
    }
  }
}

TEST_CASE("Coefficients with residual and shared renewal become a material that has them",
          "[rubbing][coefficients]") {
  for (SnapLaw law : {SnapLaw::uniform, SnapLaw::normal, SnapLaw::lognormal}) {
    for (SnapRule rule : both_rules) {
      for (double share : {0.0, 0.1, 0.3, 0.9}) {
        for (double kappa : {0.0, 0.5, 2.0}) {
          // Ratio of peak to kinetic friction that every law reaches: the highest is (l_r + 1) / (l_r + k)
          // with l_r the residual length over dbar and k <= 1/2, with 1/2 for equal lengths.
          const double residual = share / (1.0 - share);
          const double ratio = 1.0 + 0.75 * (0.5 / (residual + 0.5));
          INFO(to_string(law) << (rule == SnapRule::keep ? ", keep" : ", redraw") << ", share " << share
                              << ", kappa " << kappa << ", ratio " << ratio);
          const Coefficients wanted = Coefficients{}
                                          .with_kinetic(0.7)
                                          .with_peak(0.7 * ratio)
                                          .with_presliding_length(3e-4)
                                          .with_law(law)
                                          .with_rule(rule)
                                          .with_residual_share(share)
                                          .with_shared_renewal(kappa);
          const Material material = Material::from_coefficients(wanted);
          CHECK(material.shared_renewal == kappa);
          CHECK(material.residual_length == Approx(share * 3e-4).margin(1e-18));
          CHECK(material.residual_length + material.snap_length.mean() == Approx(3e-4).epsilon(1e-12));
          const Coefficients back = material.coefficients();
          CHECK(back.kinetic == Approx(0.7).epsilon(1e-12));
          CHECK(back.peak == Approx(0.7 * ratio).epsilon(1e-6));
          CHECK(back.presliding_length == Approx(3e-4).epsilon(1e-12));
          CHECK(back.residual_share == Approx(share).margin(1e-12));
          CHECK(back.shared_renewal == kappa);
        }
      }
    }
  }
}

TEST_CASE("Coefficients without both make the material that they made before there were these",
          "[rubbing][coefficients]") {
  const Coefficients paper = Coefficients{}.with_residual_share(0.0).with_shared_renewal(0.0);
  const Material material = Material::from_coefficients(paper);
  CHECK(material.residual_length == 0.0);
  CHECK(material.shared_renewal == 0.0);
  // Spread on record: the conversion must not change by more than its tolerance.
  CHECK(material.snap_length.cv() == Approx(0.29291044799401739).epsilon(1e-9));
  CHECK(material.snap_length.mean() == 10e-6);
}

TEST_CASE("A ratio out of reach names the range with residual and shared renewal",
          "[rubbing][coefficients][bad_input]") {
  const auto ask = [](double ratio, SnapLaw law, SnapRule rule, double share, double kappa) {
    return message_of([=] {
      Material::from_coefficients(Coefficients{}
                                      .with_kinetic(0.5)
                                      .with_peak(0.5 * ratio)
                                      .with_law(law)
                                      .with_rule(rule)
                                      .with_residual_share(share)
                                      .with_shared_renewal(kappa));
    });
  };
  // Highest ratio peak over kinetic, by equal lengths: (l_r + 1) / (l_r + 1 / ln(1 + kappa) - 1 / kappa).
  const double highest = 1.25 / (0.25 + 1.0 / std::log(2.0) - 1.0);
  CHECK(highest == Approx(1.80454).epsilon(1e-5));
  CHECK(names(ask(1.9, SnapLaw::lognormal, SnapRule::redraw, 0.2, 1.0),
              {"peak / kinetic = 1.9", "1 to 1.8045", "law lognormal", "rule redraw", "residual_share 0.2",
               "shared_renewal 1"}));
  CHECK(ask(1.804, SnapLaw::lognormal, SnapRule::redraw, 0.2, 1.0) == "(no error)");
  CHECK(
      names(ask(0.9, SnapLaw::lognormal, SnapRule::keep, 0.2, 1.0), {"peak / kinetic = 0.9", " to 1.8045"}));
  CHECK(names(ask(1.05, SnapLaw::single, SnapRule::redraw, 0.2, 1.0), {"allowed is 1.8045", "no spread"}));
  CHECK(ask(2.2, SnapLaw::lognormal, SnapRule::redraw, 0.0, 1.0) == "(no error)");
  CHECK(names(ask(1.05, SnapLaw::uniform, SnapRule::redraw, 0.2, 1.0),
              {"peak / kinetic = 1.05", "law uniform"}));
  const auto refused = [](const Coefficients& c) {
    return message_of([&] { Material::from_coefficients(c); });
  };
  CHECK(names(refused(Coefficients{}.with_residual_share(0.99)), {"residual_share = 0.99", "0 to 0.98"}));
  CHECK(names(refused(Coefficients{}.with_residual_share(-0.1)), {"residual_share = -0.1"}));
  CHECK(names(refused(Coefficients{}.with_shared_renewal(17.0)), {"shared_renewal = 17", "0 to 16"}));
  CHECK(names(ask(1.2, SnapLaw::exponential, SnapRule::keep, 0.0, 1.0),
              {"shared_renewal = 1", "0 with law exponential and rule keep"}));
}

TEST_CASE("Keep with shared renewal takes no law with bristles near no length", "[rubbing][bad_input]") {
  const auto ask = [](const SnapLength& law, SnapRule rule, double kappa) {
    return message_of([&] { reduced_material(law, rule, kappa, 0.1).validate(); });
  };
  for (const SnapLength& law :
       {SnapLength::exponential(1.0), SnapLength::uniform(0.0, 2.0), SnapLength::normal(1.0, 0.5)}) {
    CHECK(names(ask(law, SnapRule::keep, 0.5), {"shared_renewal = 0.5", "keep", "64th"}));
    CHECK(ask(law, SnapRule::keep, 0.0) == "(no error)");
    CHECK(ask(law, SnapRule::redraw, 0.5) == "(no error)");
  }
  CHECK(ask(SnapLength::uniform(0.1, 1.9), SnapRule::keep, 0.5) == "(no error)");
  CHECK(ask(SnapLength::lognormal(1.0, 1.25), SnapRule::keep, 0.5) == "(no error)");
}

}  // namespace bristle_test::test_rubbing_law
