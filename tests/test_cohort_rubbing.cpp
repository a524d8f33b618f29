// The infinite brush with residual and shared renewal: against closed forms and brute force in small steps,
// and its purpose, contacts that do not harden when they are rubbed.
#include <catch2/catch.hpp>

#include <cmath>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "brute_pieces.hpp"
#include "brute_rubbing.hpp"
#include "expect.hpp"
#include "infinite_brush.hpp"
#include "reference_table.hpp"

namespace bristle_test::test_cohort_rubbing {

namespace {

const Rubbing settings[] = {{0.0, 1.0}, {0.4, 0.0}, {0.4, 1.0}, {0.25, 2.0}, {0.0, 8.0}};

/// Steady sliding in closed form: f = l_r + int r T dr / int T dr, T = S(r) exp(-kappa nu r); (1 + kappa) nu
/// int S exp(-kappa nu r) dr = 1.
struct Steady {
  double deflection, snap_rate;
};
Steady steady(const SnapLength& law, const Rubbing& rubbing) {
  const double end = law.longest() / dbar, h = end / 20000;
  const auto moment = [&](int power, double rate) {
    double sum = 0.0;
    for (double r = 0.5 * h; r < end; r += h)
      sum += std::pow(r, power) * law.survival(r * dbar) * std::exp(-rubbing.renewal * rate * r) * h;
    return sum;
  };
  double low = 0.0, high = 1.0;
  for (int i = 0; i < 40; ++i) {
    const double rate = 0.5 * (low + high);
    ((1.0 + rubbing.renewal) * rate * moment(0, rate) < 1.0 ? low : high) = rate;
  }
  return {rubbing.residual + moment(1, low) / moment(0, low), low};
}

/// Highest force and work of a cycle to and fro by `stroke`, which begins in the middle; each half cycle has
/// 60 steps.
struct Cycle {
  double highest, work;
};
Cycle rub(Brush& brush, double stroke) {
  Cycle cycle{0.0, 0.0};
  for (int i = 0; i < 120; ++i) {
    const double step = (i < 30 || i >= 90 ? 1.0 : -1.0) * stroke / 30.0;
    brush.step(step);
    cycle.highest = std::max(cycle.highest, std::abs(brush.x()));
    cycle.work -= brush.response.mean[0] / (brush.load * dbar) * step;
  }
  return cycle;
}

/// Rows of a reference table for one law and rubbing, all for redraw, the rule of the infinite brush.
struct TableCase {
  NamedLaw law;
  Rubbing rubbing;
  std::vector<Row> rows;
};
std::vector<TableCase> table_cases(const char* file) {
  std::vector<TableCase> cases;
  for (const Row& row : read_table(file)) {
    if (row.at("variant") != std::string("redraw")) continue;
    const Rubbing r{number(row, "residual_over_dbar"), number(row, "kappa")};
    if (cases.empty() || cases.back().law.name != row.at("dist") ||
        cases.back().rubbing.residual != r.residual || cases.back().rubbing.renewal != r.renewal) {
      const std::vector<NamedLaw> laws = reference_laws();
      const auto law =
          std::find_if(laws.begin(), laws.end(), [&](const NamedLaw& l) { return l.name == row.at("dist"); });
      REQUIRE(law != laws.end());
      cases.push_back({*law, r, {}});
    }
    cases.back().rows.push_back(row);
  }
  return cases;
}

Brush make_brush(const TableCase& c, double resolution) {
  return Brush(with_rubbing(c.law.law, c.rubbing), infinite_options(resolution));
}
void slide_far(Brush& brush, double ex = 1.0, double ey = 0.0) {
  for (int k = 0; k < 60; ++k) brush.step(0.83 * ex, 0.83 * ey);
}

/// Largest errors against the reference tables, in mean snap lengths, by law, at one resolution.
using Errors = std::map<std::string, double>;
void note(Errors& errors, const char* law, double error) {
  errors[law] = std::max(errors[law], std::abs(error));
}

Errors virgin_errors(double resolution) {
  Errors errors;
  for (const TableCase& c : table_cases("rubbing_virgin.csv")) {
    Brush brush = make_brush(c, resolution);
    double x = 0.0;
    for (const Row& row : c.rows) {
      const double to = number(row, "x_over_dbar");
      brush.step((to - x) * 0.6, (to - x) * 0.8);
      x = to;
      note(errors, c.law.name, brush.x() * 0.6 + brush.y() * 0.8 - number(row, "f"));
    }
  }
  return errors;
}

Errors reversal_errors(double resolution) {
  Errors errors;
  for (const TableCase& c : table_cases("rubbing_reversal.csv")) {
    Brush brush = make_brush(c, resolution);
    slide_far(brush);
    double y = 0.0;
    for (const Row& row : c.rows) {
      const double to = number(row, "y_over_dbar");
      brush.step(y - to);
      y = to;
      note(errors, c.law.name, brush.x() - number(row, "f"));
    }
  }
  return errors;
}

Errors turn_errors(double resolution) {
  Errors errors;
  for (const TableCase& c : table_cases("rubbing_turn.csv")) {
    Brush brush = make_brush(c, resolution);
    slide_far(brush, 0.8, 0.6);
    double y = 0.0;
    for (const Row& row : c.rows) {
      const double to = number(row, "y_over_dbar");
      brush.step((y - to) * 0.6, (to - y) * 0.8);
      y = to;
      // The table's f_parallel is the force along the present motion, f_perp along the slide before it.
      note(errors, c.law.name, brush.x() * 0.8 + brush.y() * 0.6 - number(row, "f_perp"));
      note(errors, c.law.name, brush.y() * 0.8 - brush.x() * 0.6 - number(row, "f_parallel"));
    }
  }
  return errors;
}

Errors errors_of_load(double resolution, const char* column, bool halves) {
  Errors errors;
  for (const TableCase& c : table_cases("rubbing_load.csv")) {
    Brush brush = make_brush(c, resolution);
    brush.load = 0.5 * load_n;
    slide_far(brush);
    brush.load = load_n;
    double y = 0.0;
    for (const Row& row : c.rows) {
      const double to = number(row, "y_over_dbar");
      brush.step(to - y);
      y = to;
      if (halves && y == 0.75) {
        brush.load = 0.5 * load_n;
        brush.step(0.0);
      }
      note(errors, c.law.name, brush.x() * brush.load / (0.5 * load_n) - number(row, column));
    }
  }
  return errors;
}
Errors load_errors(double resolution) { return errors_of_load(resolution, "F_doubled", false); }

}  // namespace

TEST_CASE("After a reversal nothing snaps before the patch has come back by twice a large residual",
          "[cohorts][rubbing]") {
  // All bristles were left bent by 20 (the residual) and then by less than 1.5 more, so on the way back they
  // are straight after a path of 20 to 21.5, and snap from 40.5 on.
  const SnapLength law = SnapLength::uniform(0.5 * dbar, 1.5 * dbar);
  for (const double renewal : {0.0, 1.0, 8.0}) {
    INFO("renewal " << renewal);
    const Rubbing rubbing{20.0, renewal};
    const Steady sliding = steady(law, rubbing);
    Brush brush(with_rubbing(law, rubbing), infinite_options());
    for (int i = 0; i < 20; ++i) brush.step(10.0);
    CHECK(brush.x() == Approx(sliding.deflection).epsilon(2e-3));
    const double slid = brush.x();
    // Takes two steps: one longer than the path after which straight bristles have forgotten their start,
    // then a short one.
    double path = 0.0;
    for (const double step : {30.0, 10.0}) {
      brush.step(-step);
      path += step;
      CHECK(brush.x() == Approx(slid - path).margin(1e-5));
      CHECK(brush.response.dissipated == 0.0);
    }
    for (int i = 0; i < 5; ++i) {
      brush.step(-10.0);
      CHECK(brush.response.dissipated > 0.0);
    }
    CHECK(brush.x() == Approx(-sliding.deflection).epsilon(2e-3));
    // Slides the whole path in one step: the loss must be the work of the mean force less the energy stored.
    brush.step(9000.0);
    CHECK(brush.x() == Approx(sliding.deflection).epsilon(2e-3));
    CHECK(brush.imbalance < 1e-12);
    CHECK(brush.most_negative >= 0.0);
  }
}

TEST_CASE("A rubbed infinite brush follows the tables with second order", "[cohorts][rubbing][physics]") {
  const auto check = [](const char* what, Errors (*errors)(double)) {
    const Errors at[] = {errors(8.0), errors(16.0), errors(32.0)};
    CHECK(at[0].size() == 3);
    for (const auto& law : at[0]) {
      const double e[] = {law.second, at[1].at(law.first), at[2].at(law.first)};
      INFO(what << ", " << law.first << ": " << e[0] << ", " << e[1] << ", " << e[2]);
      CHECK(e[0] < 7e-3);
      CHECK(e[1] < 2e-3);
      CHECK(e[2] < 8e-4);
    }
  };
  check("virgin", virgin_errors);
  check("reversal", reversal_errors);
  check("turn", turn_errors);
  check("load", load_errors);
  // A cohort stores its bristles' order of entering contact by mean and variance only, which leaves an error
  // at every resolution.
  for (const auto& law : errors_of_load(16.0, "F_doubled_then_halved", true)) {
    INFO("halved again, " << law.first << ": " << law.second);
    CHECK(law.second < 0.02);
  }
}

TEST_CASE("A rubbed infinite brush slides with the force of the closed form", "[cohorts][rubbing][physics]") {
  for (const SnapLength& law : {lognormal, uniform, SnapLength::exponential(dbar)}) {
    for (const Rubbing& r : settings) {
      const Steady expected = steady(law, r);
      INFO(to_string(law.law()) << ", residual " << r.residual << ", renewal " << r.renewal << ": "
                                << expected.deflection << ", snaps " << expected.snap_rate);
      double error[2];
      int k = 0;
      for (double resolution : {8.0, 32.0}) {
        Brush brush(with_rubbing(law, r), infinite_options(resolution));
        double mean = 0.0, snaps = 0.0;
        const int steps = 400;
        for (int i = 0; i < steps; ++i) brush.step(0.024, 0.007);
        for (int i = 0; i < steps; ++i) {
          brush.step(0.024, 0.007);
          mean -= (brush.response.mean[0] * 0.96 + brush.response.mean[1] * 0.28) / (load_n * dbar) / steps;
          snaps += static_cast<double>(brush.response.snaps) / load_n / (steps * 0.025);
        }
        error[k++] = std::abs(mean - expected.deflection);
        CHECK(snaps == Approx(expected.snap_rate).epsilon(0.015 * 8.0 / resolution));
        CHECK(brush.imbalance < 1e-12);
      }
      CHECK(error[0] < 4e-3);
      CHECK(error[1] < 3e-4);
    }
  }
  // Mean deflection in steady sliding, in mean snap lengths, of a lognormal law of cv 0.3 with shared renewal
  // 1; a simulation of one snap after the other gave 0.457.
  CHECK(steady(lognormal, {0.0, 1.0}).deflection == Approx(0.45773).margin(1e-5));
}

TEST_CASE("A rubbed infinite brush follows brute force around corners", "[cohorts][rubbing][physics]") {
  const std::size_t bristles = test_size(60000);
  for (const Rubbing& r : {Rubbing{0.0, 1.0}, Rubbing{0.4, 0.0}, Rubbing{0.4, 1.5}}) {
    RubbedBristles truth(bristles, lognormal_quantile(1.0, 0.3), r.residual, r.renewal, 3);
    Brush brush(with_rubbing(lognormal, r), infinite_options(16.0));
    std::mt19937 generator(9);
    std::uniform_real_distribution<double> flat(-1.0, 1.0);
    double squares = 0.0;
    const int steps = 40;
    for (int i = 0; i < steps; ++i) {
      // Turns by up to half a circle, or goes back on its own path.
      const double angle = i % 8 < 4 ? 0.4 : 2.5 * flat(generator);
      const double length = i % 3 == 0 ? 0.2 : 0.5, sign = i % 5 == 4 ? -1.0 : 1.0;
      const double dx = sign * length * std::cos(angle), dy = sign * length * std::sin(angle);
      brush.step(dx, dy);
      truth.step(dx, dy, 0.01);
      squares += (std::pow(brush.x() - truth.x(), 2) + std::pow(brush.y() - truth.y(), 2)) / steps;
    }
    INFO("residual " << r.residual << ", renewal " << r.renewal << ": rms " << std::sqrt(squares));
    // Allows the noise of the brute force's bristles (0.3 each), plus the error of both models' steps.
    CHECK(std::sqrt(squares) < 0.6 / std::sqrt(static_cast<double>(bristles)) + 1.5e-3);
    CHECK(brush.imbalance < 1e-12);
    CHECK(brush.most_negative >= 0.0);
  }
}

TEST_CASE("Round random right angles few pieces stay within 1.5 % of brute force",
          "[cohorts][rubbing][physics]") {
  const std::size_t bristles = test_size(60000);
  const Rubbing rubbed{0.1, 1.0};
  const double kinetic = steady(lognormal, rubbed).deflection;
  const double noise = 0.3 / std::sqrt(static_cast<double>(bristles));
  RubbedBristles truth(bristles, lognormal_quantile(1.0, 0.3), rubbed.residual, rubbed.renewal, 3);
  Brush coarse(with_rubbing(lognormal, rubbed), infinite_options(4.0));
  Brush usual(with_rubbing(lognormal, rubbed), infinite_options());
  std::mt19937 generator(9);
  double heading = 0.0, coarse_squares = 0.0, usual_squares = 0.0;
  const int steps = 300;
  for (int i = 0; i < steps; ++i) {
    heading += (generator() & 1) != 0 ? 1.5707963267948966 : -1.5707963267948966;
    const double dx = 0.1 * std::cos(heading), dy = 0.1 * std::sin(heading);
    truth.step(dx, dy, 0.02);
    for (Brush* brush : {&coarse, &usual}) brush->step(dx, dy);
    coarse_squares += std::pow(coarse.x() - truth.x(), 2) + std::pow(coarse.y() - truth.y(), 2);
    usual_squares += std::pow(usual.x() - truth.x(), 2) + std::pow(usual.y() - truth.y(), 2);
  }
  INFO("rms over kinetic friction: " << std::sqrt(coarse_squares / steps) / kinetic << ", "
                                     << std::sqrt(usual_squares / steps) / kinetic);
  CHECK(std::sqrt(coarse_squares / steps) < 0.015 * kinetic + noise);
  CHECK(std::sqrt(usual_squares / steps) < 0.005 * kinetic + noise);
}

TEST_CASE("Long moves in any direction follow every piece of their path, with equal bits everywhere",
          "[cohorts][rubbing][physics][determinism]") {
  constexpr int parts = 250;  // number of pieces of a move in the independent model
  for (const SnapLength& law : {uniform, lognormal, SnapLength::exponential(dbar)})
    for (const Rubbing& r : {Rubbing{0.0, 0.0}, Rubbing{0.1, 1.0}, Rubbing{0.4, 2.0}}) {
      INFO(to_string(law.law()) << ", residual " << r.residual << ", renewal " << r.renewal);
      std::vector<double> quantiles;
      for (int i = 0; i <= 4000; ++i)
        quantiles.push_back(law.quantile(std::min(std::max(i / 4000.0, 1e-6), 1.0 - 1e-6)) / dbar);
      std::vector<Brush> brushes;
      for (const double resolution : {8.0, 16.0})
        for (const bristle::IsaInfo& isa : bristle::instruction_sets())
          if (isa.usable)
            brushes.emplace_back(with_rubbing(law, r), infinite_options(resolution),
                                 BatchOptions{}.with_isa(isa.name));
      SmallPieces truth(quantiles, r.residual, r.renewal);
      std::mt19937 random(5);
      for (int i = 0; i < 8; ++i) {
        // Makes moves of 7 to 26 pieces at resolution 8, from integers, as every library draws them alike.
        const double angle = static_cast<double>(random()) * 0x1p-32 * 6.283185307179586;
        const double length = 0.8 + 2.4 * (static_cast<double>(random()) * 0x1p-32);
        const double dx = length * std::cos(angle), dy = length * std::sin(angle);
        double mean[2] = {0.0, 0.0};
        for (int k = 0; k < parts; ++k) {
          const double before[2] = {truth.x(), truth.y()};
          truth.step(dx / parts, dy / parts, 1.0);
          mean[0] += (before[0] + truth.x()) / (2 * parts);
          mean[1] += (before[1] + truth.y()) / (2 * parts);
        }
        for (std::size_t k = 0; k < brushes.size(); ++k) {
          Brush& brush = brushes[k];
          brush.step(dx, dy);
          const std::size_t first = k < brushes.size() / 2 ? 0 : brushes.size() / 2;
          REQUIRE(brush.patch.hash() == brushes[first].patch.hash());
          REQUIRE(brush.response.dissipated == brushes[first].response.dissipated);
          const double limit = first == 0 ? 0.0045 : 0.0015;
          expect_near(brush.x(), truth.x(), limit, "deflection along x");
          expect_near(brush.y(), truth.y(), limit, "deflection along y");
          for (int axis = 0; axis < 2; ++axis)
            expect_near(-brush.response.mean[axis] / (load_n * dbar), mean[axis], limit, "mean deflection");
          CHECK(brush.imbalance < 1e-12);
          CHECK(brush.most_negative >= 0.0);
        }
      }
    }
}

TEST_CASE("A rubbed contact does not harden; the paper's does", "[cohorts][rubbing][physics]") {
  for (const Rubbing& r : {Rubbing{0.0, 0.0}, Rubbing{0.0, 1.0}, Rubbing{0.4, 1.0}}) {
    for (double share : {0.2, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 5.0}) {
      Brush brush(with_rubbing(lognormal, r), infinite_options(0.0, 1));
      const double stroke = share * (1.0 + r.residual);
      double first = 0.0, highest = 0.0, tenth = 0.0, last = 0.0;
      for (int k = 1; k <= 1000; ++k) {
        const Cycle cycle = rub(brush, stroke);
        if (k == 1) first = cycle.highest;
        if (k == 10) tenth = cycle.work;
        highest = std::max(highest, cycle.highest);
        last = cycle.work;
      }
      INFO("residual " << r.residual << ", renewal " << r.renewal << ", stroke " << share << ": " << first
                       << ", " << highest / first << ", " << last / tenth);
      if (r.renewal == 0.0) {
        if (share == 1.5) {
          CHECK(highest > 2.0 * first);
          CHECK(last < 0.05 * tenth);
        }
        continue;
      }
      CHECK(highest < 1.25 * first);
      if (share >= 1.5) CHECK(last == Approx(tenth).epsilon(0.01));
      CHECK(brush.imbalance < 1e-11);
    }
  }
}

TEST_CASE("Where nothing snaps nothing is renewed, and no force drifts", "[cohorts][rubbing][creep]") {
  Brush brush(with_rubbing(lognormal, {0.4, 2.0}));
  for (int i = 0; i < 100; ++i) brush.step(0.05, 0.01);
  brush.step(-0.3, -0.06);
  const double force = brush.response.elastic[0];
  for (int i = 0; i < 100000; ++i) {
    brush.step(i % 2 == 0 ? 0.1 : -0.1);
    expect(brush.response.dissipated == 0.0 && brush.response.snaps == 0, "nothing slips");
  }
  CHECK(brush.response.elastic[0] == Approx(force).epsilon(1e-12));
}

TEST_CASE("A rubbed infinite brush ends a long step in steady sliding, whatever results are asked for",
          "[cohorts][rubbing][step]") {
  for (const SnapLength& law : {lognormal, uniform, SnapLength::exponential(dbar)}) {
    for (const Rubbing& r : settings) {
      if (r.renewal == 0.0) continue;
      INFO(to_string(law.law()) << ", residual " << r.residual << ", renewal " << r.renewal);
      Brush all(with_rubbing(law, r), infinite_options());
      OnePatch end(with_rubbing(law, r), PatchOptions(infinite_options()).with_outputs(Outputs::end));
      const double expected = steady(law, r).deflection;
      // Under the uniform law, with corners, cohorts stay at their mean positions, with a second-order error.
      const double allowed = law.law() == bristle::SnapLaw::uniform ? 5e-3 : 2e-3;
      for (const auto& [x, y] : {std::pair{1.3, 0.4}, {0.0, 40.0}, {-60.0, 0.0}}) {
        all.step(x, y);
        const Response response = end.step(x * dbar, y * dbar, load_n);
        for (int axis = 0; axis < 2; ++axis) CHECK(response.elastic[axis] == all.response.elastic[axis]);
        const double length = std::hypot(x, y);
        if (length < 30.0) continue;
        CHECK((all.x() * x + all.y() * y) / length == Approx(expected).epsilon(allowed));
        CHECK((all.x() * y - all.y() * x) / length == Approx(0.0).margin(1e-9));
      }
      CHECK(all.imbalance < 1e-11);
      CHECK(all.most_negative >= 0.0);
    }
  }
}

TEST_CASE("A rubbed infinite brush forgets a turn after the path that is solved, as fine pieces do",
          "[cohorts][rubbing][step]") {
  // After a far step the memory of a turn must be below the error of pieces of 1/8 mean length: 1.5e-3 for
  // the default law, 1e-3 for the exponential.
  const auto error_of = [](const Material& material, double length, double turn) {
    const auto options = [](double resolution) {
      return PatchOptions(infinite_options(resolution)).with_outputs(Outputs::end);
    };
    Brush coarse(material, options(8.0)), fine(material, options(64.0));
    double angle = 0.3, largest = 0.0;
    for (int i = 0; i < 12; ++i) {
      angle += i % 2 == 0 ? turn : -turn;
      for (Brush* brush : {&coarse, &fine})
        brush->response =
            brush->patch.step(length * dbar * std::cos(angle), length * dbar * std::sin(angle), load_n);
      if (i > 2) largest = std::max(largest, std::hypot(coarse.x() - fine.x(), coarse.y() - fine.y()));
    }
    return largest;
  };
  const Material usual = with_rubbing(SnapLength::lognormal(dbar, 0.3113), {1.0 / 9.0, 1.0});
  const double kinetic_of_usual = steady(SnapLength::lognormal(dbar, 0.3113), {1.0 / 9.0, 1.0}).deflection;
  for (const auto& [length, turn] : {std::pair{3.9, M_PI / 2}, {4.5, M_PI / 2}, {5.2, M_PI}, {5.2, 2.5}}) {
    INFO(length << " lengths, turned by " << turn);
    CHECK(error_of(usual, length, turn) < 1.5e-3 * kinetic_of_usual);
  }
}

TEST_CASE(
    "The default material slides within 2e-3 of its friction, and turns within 4e-3, in steps of any length",
    "[cohorts][rubbing][physics]") {
  const Material usual = Material::from_coefficients(
      bristle::Coefficients{}.with_kinetic(0.4).with_peak(0.46).with_presliding_length(1e-3));
  const double friction = usual.kinetic_coefficient() * load_n;
  for (const double length : {0.05, 0.1, 0.31, 0.77, 1.45, 2.2, 3.1, 5.0}) {
    INFO("steps of " << length);
    OnePatch straight(usual, infinite_options());
    Response out;
    for (int i = 0; i < 20 + static_cast<int>(30.0 / length); ++i)
      out = straight.step(length * 1e-3, 0.0, load_n);
    CHECK(-out.elastic[0] == Approx(friction).epsilon(2e-3));
    for (const double turn : {M_PI / 2.0, 2.5, M_PI}) {
      OnePatch coarse(usual, infinite_options()), fine(usual, infinite_options(64.0));
      for (int i = 0; i < 14; ++i) {
        const double angle = i % 2 == 0 ? 0.3 : 0.3 + turn;
        const double d[2] = {length * 1e-3 * std::cos(angle), length * 1e-3 * std::sin(angle)};
        const Response a = coarse.step(d[0], d[1], load_n), b = fine.step(d[0], d[1], load_n);
        if (i > 2)
          CHECK(std::hypot(a.elastic[0] - b.elastic[0], a.elastic[1] - b.elastic[1]) < 4e-3 * friction);
      }
    }
  }
}

TEST_CASE("Residual and renewal of a sliding infinite brush change live", "[cohorts][rubbing][material]") {
  Brush brush(lognormal, infinite_options(32.0));
  const auto slide = [&] {
    for (int i = 0; i < 1000; ++i) brush.step(0.02);
    return brush.x();
  };
  for (const Rubbing& r : {Rubbing{0.4, 0.0}, Rubbing{0.4, 1.0}, Rubbing{0.0, 1.0}, Rubbing{0.0, 0.0}}) {
    const double stored = brush.patch.energy();
    brush.patch.batch.set_material(brush.patch.id, with_rubbing(lognormal, r));
    const Response rest = brush.patch.step(0.0, 0.0, load_n);
    CHECK(rest.dissipated == Approx(stored - brush.patch.energy()).epsilon(1e-9).margin(1e-15));
    CHECK(rest.dissipated >= 0.0);
    INFO("residual " << r.residual << ", renewal " << r.renewal);
    CHECK(slide() == Approx(steady(lognormal, r).deflection).epsilon(2e-3));
  }
}

}  // namespace bristle_test::test_cohort_rubbing
