// `bristle fit` of the plainest records: Coulomb's friction with presliding below what the samples show,
// outliers, few rows, strokes that grow.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "tests/fit_helpers.hpp"
#include "tools/libraries/fitting/brushes.hpp"
#include "tools/libraries/fitting/judge.hpp"

namespace bristle_test::test_fit_plain {

using Catch::Matchers::Contains;

namespace {

/// Returns a record under a constant load: friction that has the sign of the speed (smoothed over `smooth`,
/// m/s) and grows with it, with noise.
std::string coulomb(int rows, double dt, double load, double kinetic, double viscous, double smooth,
                    double noise, const std::function<double(double)>& position) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal(0.0, noise);
  std::string csv = "t,x,load,force\n";
  for (int i = 0; i < rows; ++i) {
    const double t = i * dt, v = (position(t + dt) - position(t - dt)) / (2.0 * dt);
    csv += fmt::format("{:.9g},{:.9g},{},{:.9g}\n", t, position(t), load,
                       kinetic * load * std::tanh(v / smooth) + viscous * v + normal(random));
  }
  return csv;
}

}  // namespace

TEST_CASE("Friction without presliding in the samples: kinetic and viscous, no peak", "[fit]") {
  const auto position = [](double t) {
    const double hertz = t < 10.0 ? 0.2 : t < 20.0 ? 0.5 : 1.0;
    return 5e-3 * std::sin(2.0 * M_PI * hertz * t);
  };
  for (const auto& [rows, dt, smooth] : {std::tuple(3000, 0.01, 1e-9), std::tuple(1500, 0.02, 1e-6)}) {
    CAPTURE(rows);
    const Fitted fitted = fit(coulomb(rows, dt, 2.5, 0.25, 8.0, smooth, 0.01, position), any_brush());
    check_recovered(fitted[cli::fit_kinetic], 0.25, 0.005);
    check_recovered(fitted[cli::fit_viscous], 8.0, 1.0);
    CHECK_FALSE(fitted[cli::fit_length].fitted);
    CHECK_FALSE(fitted.result.peak.fitted);
    CHECK_THAT(cli::fit_table(fitted.data, fitted.result), !Contains("peak"));
    CHECK(fitted.result.residual_rms < 0.03);
  }
}

TEST_CASE("What few rows cannot tell is held at what fits; an outlier is named", "[fit]") {
  const auto position = [](double t) { return 1e-3 * std::sin(2.0 * M_PI * 0.3 * t); };
  const std::string whole = coulomb(600, 0.01, 2.0, 0.3, 0.0, 1e-5, 0.005, position);
  const Fitted thin = fit(coulomb(100, 0.06, 2.0, 0.3, 0.0, 1e-5, 0.005, position), any_brush());
  CHECK(thin[cli::fit_kinetic].value == Approx(0.3).epsilon(0.03));
  std::string spiked = whole;
  const std::size_t begin = spiked.find('\n') + 1, end = spiked.find('\n', begin);
  spiked.replace(begin, end - begin, "0,0,2,40");
  const Fitted fitted = fit(spiked, any_brush());
  CHECK(fitted.data.samples() == 599);
  CHECK_THAT(cli::fit_table(fitted.data, fitted.result), Contains("row 1 (40 N)"));
  for (const Fitted& f : {fit(whole, any_brush()), fitted})
    CHECK(f[cli::fit_kinetic].value == Approx(0.3).epsilon(0.02));
}

TEST_CASE("A coefficient that no material has is doubted, and the load's unit with it", "[fit]") {
  const auto position = [](double t) { return 1e-3 * std::sin(2.0 * M_PI * 0.3 * t); };
  for (const auto& [load, kinetic, doubted] :
       {std::tuple(2.0, 0.3, false), {2000.0, 0.0003, true}, {0.2, 2.9, true}, {1.0, 2.9, false}}) {
    CAPTURE(load, kinetic);
    const Fitted fitted =
        fit(coulomb(600, 0.01, load, kinetic, 0.0, 1e-5, 0.005 * load * kinetic, position), any_brush());
    CHECK(fitted[cli::fit_kinetic].value == Approx(kinetic).epsilon(0.02));
    const std::string table = cli::fit_table(fitted.data, fitted.result);
    CHECK((table.find("is unusual") != table.npos) == doubted);
    if (doubted) CHECK_THAT(table, Contains("unit of the load"));
  }
}

TEST_CASE("Friction that falls short of its limit around reversals does not pass for a lubricant", "[fit]") {
  const auto position = [](double t) {
    return (t < 4.0 ? 20e-6 : t < 8.0 ? 200e-6 : 2e-3) * std::sin(2.0 * M_PI * 0.5 * t);
  };
  const Fitted fitted = fit(coulomb(6000, 0.002, 2.5, 0.3, 0.0, 1e-5, 0.01, position), any_brush());
  check_recovered(fitted[cli::fit_kinetic], 0.3, 0.005);
  CHECK(fitted[cli::fit_damping].value == 0.0);
  CHECK_FALSE(fitted[cli::fit_length].fitted);
  CHECK(fitted.result.residual_rms < 0.02);
}

TEST_CASE("Rivals of strokes that grow are fitted and judged over the whole range", "[fit]") {
  const auto position = [](double t) {
    return (t < 4.0 ? 20e-6 : t < 8.0 ? 200e-6 : 2e-3) * std::sin(2.0 * M_PI * 0.5 * t);
  };
  const std::string csv = coulomb(6000, 0.002, 2.5, 0.3, 0.0, 1e-5, 0.01, position);
  cli::FitOptions options = any_brush();
  const cli::FitColumns columns = cli::parse_fit_columns(csv, "data.csv");
  const cli::Judgements all = cli::judge_rivals(columns, options);
  CHECK(all.within_range());
  CHECK(all.fitted_samples + all.reversal_samples + all.sliding_samples + all.left_out == 6000);
  CHECK(all.fitted_samples > 2300);
  CHECK(all.fitted_samples < 3000);
  CHECK(all.fitted.stroke == Approx(4e-3).epsilon(0.02));
  CHECK(all.judged.stroke == Approx(4e-3).epsilon(0.02));
  CHECK(all.fitted.speed == Approx(2e-3 * M_PI).epsilon(0.02));
  CHECK(all.judged.speed == Approx(2e-3 * M_PI).epsilon(0.02));
  for (const cli::Judgement& j : all.models) CHECK(j.judged.all < 2.0 * j.fitted);
  options.fit_until = 4.0;  // strokes of a hundredth of what follows
  options.choose_rule = false;
  const cli::Judgements beyond = cli::judge_rivals(columns, options);
  CHECK_FALSE(beyond.within_range());
  CHECK(beyond.fitted.stroke == Approx(40e-6).epsilon(0.05));
  CHECK(beyond.judged.stroke == Approx(4e-3).epsilon(0.02));
  CHECK(beyond.fitted.speed == Approx(20e-6 * M_PI).epsilon(0.05));
  CHECK(beyond.judged.speed == Approx(2e-3 * M_PI).epsilon(0.02));
}

TEST_CASE("Rivals are fitted to and judged by the samples that a plain fit uses", "[fit]") {
  // Ten seconds at 500 Hz of strokes that grow from 4 to 20 mm, positions to a micrometre.
  const auto position = [](double t) {
    return 1e-6 * std::round(1e6 * 0.02 * (0.2 + 0.08 * t) * std::sin(M_PI * t));
  };
  const auto speed = [](double t) {
    return 0.02 * ((0.2 + 0.08 * t) * M_PI * std::cos(M_PI * t) + 0.08 * std::sin(M_PI * t));
  };
  std::mt19937 random(2);
  std::normal_distribution<double> noise(0.0, 0.02);
  std::string csv = "t,x,load,force\n";
  for (int i = 0; i <= 5000; ++i) {
    const double t = 0.002 * i, v = speed(t);
    csv +=
        fmt::format("{},{:.6f},5,{:.4f}\n", t, position(t), (v > 0.0 ? 1.4 : -1.4) + 4.0 * v + noise(random));
  }
  const Fitted plain = fit(csv, any_brush());
  CHECK(plain[cli::fit_kinetic].value == Approx(0.28).epsilon(0.01));
  const auto left_out = std::count(plain.result.left_out.begin(), plain.result.left_out.end(), true);
  CHECK(left_out > 10);
  CHECK(left_out < 200);
  // The residual of a sample that was left out is nan in the table from which pictures are drawn.
  const std::string table = cli::fit_csv(plain.data, plain.result);
  std::ptrdiff_t without = 0;
  for (std::size_t at = table.find(",nan"); at != table.npos; at = table.find(",nan", at + 1)) ++without;
  CHECK(without == left_out);

  const cli::Judgements all = cli::judge_rivals(cli::parse_fit_columns(csv, "data.csv"), any_brush());
  CHECK(static_cast<std::ptrdiff_t>(all.left_out) == left_out);
  CHECK(all.fitted_samples + all.reversal_samples + all.sliding_samples + all.left_out == 5001);
  for (const cli::Judgement& j : all.models) {
    CAPTURE(j.model, j.values, j.judged.all);
    CHECK(j.judged.all < 2.0 * 0.02);
    if (!j.model.starts_with("brush")) continue;
    const std::size_t at = j.values.find("kinetic ");
    REQUIRE(at != j.values.npos);
    CHECK(std::stod(j.values.substr(at + 8)) == Approx(0.28).epsilon(0.05));
  }
  for (const cli::ModelForce& rival : all.rivals) CHECK(rival.force.size() == 5001);
  CHECK_THAT(cli::judgement_table(all), Contains("do not resolve presliding") &&
                                            Contains(fmt::format("{} samples around reversals", left_out)));
}

TEST_CASE("A mass that was not given is asked for, a mass that is not there is not", "[fit]") {
  const double mass = 0.4, w = 2.0 * M_PI;
  const auto position = [&](double t) { return 0.01 * (1.0 + 0.05 * t) * std::sin(w * t); };
  std::mt19937 random(4);
  std::normal_distribution<double> noise(0.0, 0.02);
  const auto record = [&](double moved) {
    std::string csv = "t,x,load,force\n";
    for (int i = 0; i < 3000; ++i) {
      const double t = 0.002 * i, h = 1e-4;
      const double v = (position(t + h) - position(t - h)) / (2.0 * h),
                   a = (position(t + h) - 2.0 * position(t) + position(t - h)) / (h * h);
      csv += fmt::format("{},{:.7f},5,{:.5f}\n", t, position(t),
                         (v > 0.0 ? 1.4 : -1.4) + 4.0 * v + moved * a + noise(random));
    }
    return csv;
  };
  const auto notes = [&](double moved, double given) {
    cli::FitOptions options = any_brush();
    options.mass = given;
    const cli::FitData data = cli::prepare_fit_data(cli::parse_fit_columns(record(moved), "data.csv"),
                                                    options.sign, options.load, options.mass);
    std::string all;
    for (const std::string& note : cli::fit_material(data, options).notes) all += note + '\n';
    return all;
  };
  CHECK_THAT(notes(mass, 0.0), Contains("go with the acceleration"));
  CHECK_THAT(notes(mass, mass), !Contains("go with the acceleration"));
  CHECK_THAT(notes(0.0, 0.0), !Contains("go with the acceleration"));
}

TEST_CASE("A force that follows the position over centimetres is named as a spring's", "[fit]") {
  std::string csv = "t,x,load,force\n";
  for (int i = 0; i < 600; ++i) {
    const double t = 0.01 * i, turn = 2.0 * M_PI * 0.3 * t;
    csv += fmt::format("{},{},2,{}\n", t, -0.033 * std::cos(turn), std::cos(turn) > 0.0 ? 0.6 : -0.6);
  }
  const Fitted fitted = fit(csv, any_brush());
  CHECK_FALSE(fitted[cli::fit_kinetic].fitted);
  CHECK_THAT(cli::fit_table(fitted.data, fitted.result), Contains("a spring, or columns"));
}

TEST_CASE("A smooth motion reverses between its samples, and its curvature is no noise", "[fit]") {
  // Swings of 0.4 mm, sampled 40 times each: a sample is up to 1.2 um short of the reversal.
  const auto position = [](double t) { return 0.4e-3 * std::sin(2.0 * M_PI * 1.25 * t + 0.05); };
  const cli::FitData data = cli::prepare_fit_data(
      cli::parse_fit_columns(coulomb(400, 0.02, 2.0, 0.3, 0.0, 1e-6, 0.005, position), "data.csv"),
      cli::ForceSign::automatic, {});
  CHECK(data.position_noise < 1e-7);
  double farthest = 0.0;
  int reversals = 0;
  for (const cli::PathPoint& point : data.path) {
    farthest = std::max(farthest, std::fabs(point.x));
    if (point.wanted) continue;
    ++reversals;
    CHECK(std::fabs(point.x) == Approx(0.4e-3).epsilon(1e-4));
  }
  CHECK(reversals >= 18);  // of 20
}

TEST_CASE("The progress of a fit never falls, also where it is repeated without samples at reversals",
          "[fit]") {
  const auto position = [](double t) { return 5e-3 * std::sin(2.0 * M_PI * 0.5 * t); };
  const cli::FitData data = cli::prepare_fit_data(
      cli::parse_fit_columns(coulomb(300, 0.02, 2.5, 0.25, 8.0, 1e-6, 0.01, position), "data.csv"),
      cli::ForceSign::automatic, {});
  double last = 0.0;
  const cli::Choice choice = cli::choose_brush(data, any_brush(), [&](double share) {
    CHECK(share >= last);
    last = share;
  });
  CHECK(choice.cut_by.has_value());
  CHECK(last > 0.5);
  CHECK(last <= 1.0);
}

TEST_CASE("Parts of a record keep its time, and each file begins with a reversal", "[fit]") {
  const auto position = [](double t) { return 1e-3 * std::sin(2.0 * M_PI * 0.3 * t); };
  const auto columns = [&](const char* name) {
    return cli::parse_fit_columns(coulomb(500, 0.01, 2.0, 0.3, 0.0, 1e-9, 0.005, position), name);
  };
  const cli::FitData data = cli::prepare_fit_data(cli::join_fit_columns({columns("a.csv"), columns("b.csv")}),
                                                  cli::ForceSign::automatic, {});
  const std::vector<bool> fitted = cli::fitted_blocks(data, {});
  const cli::FitData rest = cli::part_of(data, fitted, false), thin = cli::thinned(data, 250);
  CHECK(rest.columns.t.front() >
        data.columns.t.front());  // the first block of the Thue-Morse order is fitted
  CHECK(rest.middle_time() == data.middle_time());
  const std::vector<bool> of_thin = cli::fitted_blocks(thin, {});
  for (std::size_t i = 0; i < thin.samples(); ++i)
    for (std::size_t k = 0; k < data.samples(); ++k)
      if (data.columns.t[k] == thin.columns.t[i]) CHECK(of_thin[i] == fitted[k]);
  // Blocks 0 1 2 3 4 5 6 7 of the order are fitted, not, not, fitted, not, fitted, fitted, not.
  for (const auto& [block, is] :
       {std::pair(0, true), {1, false}, {2, false}, {3, true}, {4, false}, {7, false}})
    CHECK(fitted[static_cast<std::size_t>((block + 0.5) / 32.0 * 1000.0)] == is);
  const std::vector<bool> other = cli::fitted_blocks(data, {}, true);
  for (std::size_t i = 0; i < data.samples(); ++i)
    CHECK(other[i] == (!fitted[i] || cli::block_of(data, i) == 0));  // the start is fitted by both halves

  cli::FitValues values = cli::fit_defaults;
  values[cli::fit_kinetic] = 0.3;
  const std::vector<bool> reversals = cli::around_reversals(data, values);
  CHECK(reversals[0]);
  CHECK(reversals[500]);  // the jump from one file to the next is no motion
  CHECK(std::count(reversals.begin(), reversals.end(), true) < 60);
  CHECK(cli::samples_that_count(data, 1000, values).finest_move > 1e-7);
}

}  // namespace bristle_test::test_fit_plain
