// The references for spinning patches (bristles one by one, renewal theory, the tables) agree with each
// other. For bristles that are long beside the disc the tables spin_long_*.csv are made here.
#include <catch2/catch.hpp>

#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include <bristle/extended_patches.hpp>

#include "brute_spin.hpp"
#include "expect.hpp"
#include "reference_table.hpp"
#include "scenes.hpp"

namespace bristle_test::test_spin_truth {

namespace {

// For lengths delta uniform on 0.5 to 1.5 and SnapRule::redraw, in mean lengths: the share of lengths above
// l, and the mean deflection in sliding.
double uniform_survival(double l) { return l < 0.5 ? 1.0 : l > 1.5 ? 0.0 : 1.5 - l; }
constexpr double uniform_kinetic = 13.0 / 24.0;

BrutePressure pressure_of(const Row& row) {
  return row.at("pressure") == "hertz" ? BrutePressure::hertz : BrutePressure::even;
}
double mean_arm(BrutePressure pressure) {
  return pressure == BrutePressure::even ? 2.0 / 3.0 : 3.0 * M_PI / 16.0;
}

struct Turned {
  std::vector<double> s, torque;
};
// Returns the rows of a reference table of discs that turn from rest, by angle, without the peak's row.
Turned turned_rows(const std::string& table, const std::string& pressure, const std::string& length) {
  Turned rows;
  for (const Row& row : read_table(table)) {
    if (row.at("dist") != "uniform_0.5_1.5" || row.at("pressure") != pressure) continue;
    if (!length.empty() && row.at("dbar_over_R") != length) continue;
    if (row.at("s=phi*R/dbar").rfind("peak", 0) == 0) continue;
    rows.s.push_back(number(row, "s=phi*R/dbar"));
    rows.torque.push_back(number(row, "T_over_T_kinetic"));
  }
  REQUIRE(rows.s.size() > 10);
  return rows;
}

// Turns a disc from rest, bristle by bristle. Returns the torque over the kinetic torque.
std::vector<double> brute_turn(const std::vector<double>& s, double length, BrutePressure pressure,
                               std::size_t points, std::size_t bristles) {
  BruteSpin disc(points, bristles, 1.0, pressure, uniform_quantile(0.5 * length, 1.5 * length), 7);
  std::vector<double> torque;
  double at = 0.0;
  for (const double turn : s) {
    disc.move(0.0, 0.0, (turn - at) * length, std::max(1, static_cast<int>(std::lround((turn - at) * 20.0))));
    at = turn;
    torque.push_back(disc.deflection().torque / (uniform_kinetic * length * mean_arm(pressure)));
  }
  return torque;
}

// Slides and spins a disc until it has forgotten its beginning, then as far again. Returns the means over the
// second part of force along and across, over mu N, and torque over mu N R. In each part the fastest point
// moves by `path` mean lengths.
SpinDeflection brute_slide(double eps, double length, BrutePressure pressure, std::size_t points,
                           std::size_t bristles, int path, std::uint64_t seed) {
  BruteSpin disc(points, bristles, 1.0, pressure, uniform_quantile(0.5 * length, 1.5 * length), seed);
  const double step = 0.5 * length, slide = step * eps / (1.0 + eps), turn = step / (1.0 + eps);
  const int steps = 2 * path;
  SpinDeflection mean;
  for (int k = -steps; k < steps; ++k) {
    disc.move(slide, 0.0, turn, 8);
    if (k < 0) continue;
    const SpinDeflection d = disc.deflection();
    const double share = 1.0 / (steps * uniform_kinetic * length);
    mean.x += share * d.x;
    mean.y += share * d.y;
    mean.torque += share * d.torque;
  }
  return mean;
}

}  // namespace

TEST_CASE("Turned from rest with short bristles, brute force and renewal theory give the table",
          "[spin][truth]") {
  for (const char* pressure : {"uniform", "hertz"}) {
    INFO(pressure);
    const Turned table = turned_rows("spin_virgin.csv", pressure, "");
    const BrutePressure p = std::string(pressure) == "hertz" ? BrutePressure::hertz : BrutePressure::even;
    const std::vector<double> renewal =
        turned_from_rest(table.s, 1e-4, p, uniform_survival, uniform_kinetic, 100, 50);
    const std::vector<double> brute = brute_turn(table.s, 1e-4, p, 1000, 100);
    for (std::size_t i = 0; i < table.s.size(); ++i) {
      INFO("s = " << table.s[i]);
      CHECK(renewal[i] == Approx(table.torque[i]).margin(2e-4));
      CHECK(brute[i] == Approx(table.torque[i]).margin(5e-3));
      if (table.s[i] <= 1.0) CHECK(brute[i] == Approx(table.torque[i]).margin(6e-4));
    }
  }
}

TEST_CASE("Turned from rest with long bristles, brute force and renewal theory agree", "[spin][truth]") {
  for (const char* pressure : {"uniform", "hertz"}) {
    const Turned table = turned_rows("spin_long_virgin.csv", pressure, "0.3");
    INFO(pressure);
    const BrutePressure p = std::string(pressure) == "hertz" ? BrutePressure::hertz : BrutePressure::even;
    const std::vector<double> renewal =
        turned_from_rest(table.s, 0.3, p, uniform_survival, uniform_kinetic, 100, 50);
    const std::vector<double> brute = brute_turn(table.s, 0.3, p, 1000, 100);
    for (std::size_t i = 0; i < table.s.size(); ++i) {
      INFO("s = " << table.s[i]);
      CHECK(renewal[i] == Approx(table.torque[i]).margin(2e-4));
      CHECK(brute[i] == Approx(table.torque[i]).margin(5e-3));
    }
    // Checks that long bristles have a lower peak torque than short ones (1.067 for Hertz's pressure, 1.085
    // for uniform pressure).
    CHECK(*std::max_element(table.torque.begin(), table.torque.end()) <
          0.99 * (p == BrutePressure::hertz ? 1.06726 : 1.08521));
  }
}

TEST_CASE("Sliding and spinning with short bristles, brute force gives the limit surface", "[spin][truth]") {
  for (const Row& row : read_table("spin_limit.csv")) {
    const double eps = number(row, "v_over_omegaR");
    if (eps != 0.1 && eps != 0.5 && eps != 1.0 && eps != 2.0) continue;
    INFO(row.at("pressure") << ", eps " << eps);
    const SpinDeflection f = brute_slide(eps, 1e-3, pressure_of(row), 500, 20, 20, 3);
    CHECK(f.x == Approx(number(row, "F_over_muN")).margin(3e-3));
    CHECK(f.y == Approx(0.0).margin(5e-3));
    CHECK(f.torque == Approx(number(row, "T_over_muNR")).margin(3e-3));
  }
}

TEST_CASE("Sliding and spinning with long bristles, brute force gives its table again", "[spin][truth]") {
  for (const Row& row : read_table("spin_long_steady.csv")) {
    const double eps = number(row, "v_over_omegaR"), length = number(row, "dbar_over_R");
    INFO(row.at("pressure") << ", eps " << eps << ", dbar/R " << length);
    const SpinDeflection f = brute_slide(eps, length, pressure_of(row), 300, 10, 20, 99);
    CHECK(f.x == Approx(number(row, "F_over_muN")).margin(8e-3));
    CHECK(f.y == Approx(number(row, "aside_over_muN")).margin(8e-3));
    CHECK(f.torque == Approx(number(row, "T_over_muNR")).margin(8e-3));
  }
}

namespace {

// A disc of the infinite brush with lengths uniform on 0.5 to 1.5. Its radius is dbar over `length`.
// Arguments are in radii, results in the units of BruteSpin.
class PatchDisc {
 public:
  PatchDisc(double length, BrutePressure pressure, int rings) : radius_(dbar / length), patches_(batch_) {
    const PatchOptions options = PatchOptions{}.with_max_normal_load(load_n).with_axes(2).with_population(
        bristle::Population::infinite);
    const bristle::Pressure p =
        pressure == BrutePressure::hertz ? bristle::Pressure::hertz : bristle::Pressure::uniform;
    motion_.id = patches_.add(plain_material(bristle_test::uniform, SnapRule::redraw), options,
                              bristle::Outline::disc(radius_, p, rings));
    motion_.normal_load = load_n;
  }

  SpinDeflection move(double dx, double dy, double angle) {
    motion_.displacement[0] = dx * radius_;
    motion_.displacement[1] = dy * radius_;
    motion_.displacement[2] = angle;
    const bristle::ExtendedResponse r = step_one(patches_, motion_);
    // Unit of forces: one bristle of 1 N/m per newton of load, bent by the radius.
    const double unit = load_n * radius_;
    return {-r.end[0] / unit, -r.end[1] / unit, -r.end[2] / (unit * radius_)};
  }

 private:
  static constexpr double load_n = 1000.0;
  double radius_;
  PatchBatch batch_;
  bristle::ExtendedPatches patches_;
  bristle::ExtendedMotion motion_;
};

}  // namespace

TEST_CASE("A patch with an extent and long bristles turns from rest as the table says", "[spin][extended]") {
  for (const std::string& length : {std::string("0.1"), std::string("0.3")}) {
    for (const char* pressure : {"uniform", "hertz"}) {
      const Turned table = turned_rows("spin_long_virgin.csv", pressure, length);
      const BrutePressure p = std::string(pressure) == "hertz" ? BrutePressure::hertz : BrutePressure::even;
      const double dbar_over_r = std::stod(length);
      PatchDisc disc(dbar_over_r, p, 12);
      double at = 0.0;
      for (std::size_t i = 0; i < table.s.size(); ++i) {
        const int pieces = std::max(1, static_cast<int>(std::lround((table.s[i] - at) * 20.0)));
        SpinDeflection d;
        for (int k = 0; k < pieces; ++k) d = disc.move(0.0, 0.0, (table.s[i] - at) * dbar_over_r / pieces);
        at = table.s[i];
        INFO(pressure << ", dbar/R " << length << ", s = " << at);
        CHECK(d.torque / (uniform_kinetic * dbar_over_r * mean_arm(p)) ==
              Approx(table.torque[i]).margin(0.01));
      }
    }
  }
}

TEST_CASE("A patch with an extent and long bristles slides and spins as brute force does",
          "[spin][extended]") {
  for (const Row& row : read_table("spin_long_steady.csv")) {
    const double eps = number(row, "v_over_omegaR"), length = number(row, "dbar_over_R");
    PatchDisc disc(length, pressure_of(row), 8);
    const double step = 0.5 * length;
    constexpr int steps = 160;
    SpinDeflection mean;
    for (int k = -steps; k < steps; ++k) {
      const SpinDeflection d = disc.move(step * eps / (1.0 + eps), 0.0, step / (1.0 + eps));
      if (k < 0) continue;
      const double share = 1.0 / (steps * uniform_kinetic * length);
      mean.x += share * d.x;
      mean.y += share * d.y;
      mean.torque += share * d.torque;
    }
    INFO(row.at("pressure") << ", eps " << eps << ", dbar/R " << length);
    CHECK(mean.x == Approx(number(row, "F_over_muN")).margin(0.01));
    CHECK(mean.y == Approx(number(row, "aside_over_muN")).margin(0.01));
    CHECK(mean.torque == Approx(number(row, "T_over_muNR")).margin(0.01));
  }
}

// Prints the tables: bristle_tests '[.spin-table]' (two minutes).
TEST_CASE("Tables of a disc with long bristles", "[.spin-table]") {
  const std::vector<double> s = {0.1, 0.25, 0.5,  0.75, 1.0, 1.1, 1.2, 1.25, 1.3,
                                 1.4, 1.5,  1.75, 2.0,  2.5, 3.0, 4.0, 6.0,  10.0};
  std::puts(
      "# A disc turned from rest, its bristles not short beside its radius (dbar_over_R): torque over that "
      "of short bristles in\n# steady spin. Renewal theory on 400 rings, 200 steps a mean snap length "
      "(tests/brute_spin.hpp, turned_from_rest); with half\n# of both the largest change is 5e-5. Bristles "
      "one by one agree within their noise.\ndist,pressure,dbar_over_R,s=phi*R/dbar,T_over_T_kinetic");
  for (const BrutePressure pressure : {BrutePressure::even, BrutePressure::hertz}) {
    const char* name = pressure == BrutePressure::hertz ? "hertz" : "uniform";
    for (const double length : {0.1, 0.3}) {
      const std::vector<double> torque =
          turned_from_rest(s, length, pressure, uniform_survival, uniform_kinetic, 400, 200);
      for (std::size_t i = 0; i < s.size(); ++i)
        std::printf("uniform_0.5_1.5,%s,%g,%g,%.5f\n", name, length, s[i], torque[i]);
    }
  }
  std::puts(
      "# A disc that slides along x and spins counter-clockwise for good, its bristles not short beside its "
      "radius (dbar_over_R),\n# law uniform_0.5_1.5, redraw: mean deflection along x, aside along y (the "
      "force on the disc is the other way) and\n# torque, over those of kinetic friction. 1000 points with "
      "40 bristles each, 8 seeds, mean over a path of 100 mean snap\n# lengths of the fastest point after as "
      "long a beginning (tests/brute_spin.hpp); error: the standard error of the mean\n# over the seeds, the "
      "largest of the three. The points themselves add up to 0.001 at eps <= "
      "0.1.\npressure,dbar_over_R,v_over_omegaR,F_over_muN,aside_over_muN,T_over_muNR,error");
  for (const BrutePressure pressure : {BrutePressure::even, BrutePressure::hertz}) {
    for (const double length : {0.1, 0.3}) {
      for (const double eps : {0.1, 0.25, 0.5, 1.0, 2.0}) {
        constexpr int seeds = 8;
        std::array<double, 3> sum{}, squares{};
        for (int seed = 1; seed <= seeds; ++seed) {
          const SpinDeflection f =
              brute_slide(eps, length, pressure, 1000, 40, 100, static_cast<std::uint64_t>(seed));
          const std::array<double, 3> values = {f.x, f.y, f.torque};
          for (std::size_t i = 0; i < 3; ++i) {
            sum[i] += values[i] / seeds;
            squares[i] += values[i] * values[i] / seeds;
          }
        }
        double error = 0.0;
        for (std::size_t i = 0; i < 3; ++i)
          error = std::max(error, std::sqrt(std::max(squares[i] - sum[i] * sum[i], 0.0) / (seeds - 1)));
        std::printf("%s,%g,%g,%.4f,%.4f,%.4f,%.4f\n", pressure == BrutePressure::hertz ? "hertz" : "uniform",
                    length, eps, sum[0], sum[1], sum[2], error);
        std::fflush(stdout);
      }
    }
  }
}

}  // namespace bristle_test::test_spin_truth
