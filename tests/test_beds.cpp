// Beds (bed.hpp) against closed forms, the tables of tests/data, and brute force bristle by bristle.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <string>
#include <vector>

#include "bristle/bed.hpp"
#include "bristle/bristle.h"
#include "bristle/error.hpp"
#include "bristle/keyed_beds.hpp"
#include "expect.hpp"
#include "kernels/bed_slide.hpp"
#include "reference_table.hpp"

namespace bristle_test::test_beds {

using namespace bristle;

namespace {

constexpr double pi = 3.141592653589793;

/// A single bed in a batch of its own, with its motion and response.
struct OneBed {
  BedBatch batch;
  BedMotion motion;
  BedResponse out;

  OneBed(const BedMaterial& material, const BedShape& shape, const BedOptions& options, double load = -1.0,
         const BatchOptions& how = {})
      : batch(how) {
    motion.id = batch.add(material, shape, options);
    motion.normal_load = load < 0.0 ? options.max_normal_load : load;
  }
  const BedResponse& step(double dx, double dy = 0.0, double spin = 0.0, double rolled = 0.0) {
    motion.displacement[0] = dx;
    motion.displacement[1] = dy;
    motion.spin = spin;
    motion.rolled[0] = rolled;
    batch.step({&motion, 1}, {&out, 1});
    return out;
  }
};

BedOptions with_load(double newtons, bool all = true, double piece = 0.0625) {
  BedOptions options;
  options.max_normal_load = newtons;
  options.all_outputs = all;
  options.longest_piece = piece;
  return options;
}

double mindlin_error(int cells) {
  double worst = 0.0, before = 0.0;
  std::unique_ptr<OneBed> bed;
  for (const Row& row : read_table("mindlin.csv")) {
    if (number(row, "point") == 0.0) {
      bed = std::make_unique<OneBed>(BedMaterial(0.5).with_presliding(1e-3),
                                     BedShape::sphere_row(cells, 1e-3), with_load(2.0));
      before = 0.0;
    }
    const double at = number(row, "delta_over_delta1");
    bed->motion.normal_load = 2.0 * number(row, "N_over_N1");
    bed->step(1e-3 * (at - before));
    before = at;
    worst = std::max(worst, std::abs(-bed->out.force[0] / 1.0 - number(row, "F_over_muN1")));
  }
  return worst;
}

/// Definition of a bed, in double precision and in tiny steps: the deflection of each bristle grows with the
/// motion of its root and is cut to its limit.
struct Brute {
  struct Bristle {
    double x, y, k, limit, zx = 0.0, zy = 0.0;
  };
  std::vector<Bristle> bristles;
  double force[2], torque, mean[2], mean_torque, dissipated, stored;

  void step(double dx, double dy, double spin, int parts) {
    mean[0] = mean[1] = mean_torque = dissipated = 0.0;
    for (int i = 0; i < parts; ++i)
      for (Bristle& b : bristles) {
        const double zx = b.zx + (dx - spin * b.y) / parts;
        const double zy = b.zy + (dy + spin * b.x) / parts;
        const double norm = std::hypot(zx, zy);
        const double back = norm > b.limit ? b.limit / norm : 1.0;
        if (norm > b.limit) dissipated += b.k * b.limit * (norm - b.limit);
        const double mx = b.k * 0.5 * (b.zx + zx * back) / parts, my = b.k * 0.5 * (b.zy + zy * back) / parts;
        mean[0] -= mx;
        mean[1] -= my;
        mean_torque -= b.x * my - b.y * mx;
        b.zx = zx * back;
        b.zy = zy * back;
      }
    force[0] = force[1] = torque = stored = 0.0;
    for (const Bristle& b : bristles) {
      force[0] -= b.k * b.zx;
      force[1] -= b.k * b.zy;
      torque -= b.k * (b.x * b.zy - b.y * b.zx);
      stored += 0.5 * b.k * (b.zx * b.zx + b.zy * b.zy);
    }
  }
};

/// Returns a random motion of one of many kinds, for a bed that may roll.
BedMotion draw_motion(std::mt19937& random, BedId id, bool rolls, double length, double slip, double load) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  BedMotion m;
  m.id = id;
  const double size = slip * std::pow(10.0, -3.0 * uniform(random));
  m.displacement[0] = size * normal(random);
  m.displacement[1] = size * normal(random);
  if (uniform(random) < 0.5) m.spin = std::clamp(size / length * normal(random), -3.0, 3.0);
  if (rolls && uniform(random) < 0.7)
    m.rolled[0] = length * std::pow(10.0, 1.0 - 4.0 * uniform(random)) * normal(random);
  m.normal_load = load * (uniform(random) < 0.1 ? 0.0 : uniform(random));
  if (uniform(random) < 0.5) m.normal_load = load;
  return m;
}

struct Kind {
  const char* name;
  BedMaterial material;
  BedShape shape;
};
std::vector<Kind> all_kinds() {
  const BedMaterial plain = BedMaterial(0.6).with_presliding(1e-4);
  return {
      {"sphere", plain, BedShape::sphere_row(20, 1e-3)},
      {"disc", plain, BedShape::disc(2e-3, BedPressure::uniform, 4, 9)},
      {"growing ellipse", plain,
       BedShape::ellipse(2e-3, 1e-3, BedPressure::hertz).grown(BedGrowth::cube_root)},
      {"list", plain, BedShape::from_list({{{0, 0}, 1, 1}, {{1e-3, 0}, 2, 1}, {{0, -1e-3}, 1, 3}})},
      {"rectangle", plain, BedShape::rectangle(3e-3, 1e-3, BedPressure::parabolic, 6, 3)},
      {"wheel", plain, BedShape::wheel_row(1e-3)},
      {"cylinder", plain, BedShape::cylinder_row(1e-3, 24)},
      {"rolling ellipse", plain,
       BedShape::ellipse(2e-3, 1e-3, BedPressure::hertz).rolling(12, 7).grown(BedGrowth::cube_root)},
      {"ball", plain, BedShape::disc(1e-3, BedPressure::parabolic).rolling(16, 5)},
      {"with drop", BedMaterial(0.9, 0.6).with_presliding(1e-4), BedShape::wheel_row(1e-3)},
      {"tyre", BedMaterial(0.9, 0.8).with_slip_stiffness(9e4, 5e4),
       BedShape::rectangle(0.1, 0.08, BedPressure::parabolic).rolling(12, 3).grown(BedGrowth::square_root)},
  };
}

}  // namespace

TEST_CASE("A sphere's row follows Cattaneo and Mindlin under held, rising and falling load") {
  CHECK(mindlin_error(32) < 1e-3);
  CHECK(mindlin_error(16) < 2e-3);
  // The discretisation error is of second order: 3.3e-4 with 32 bristles, below a fifth of that with 128.
  CHECK(mindlin_error(128) < 1e-4);
}

TEST_CASE("Two elastic spheres shift under a force as Cattaneo's closed form and the program CONTACT say") {
  // Example `cattaneo` of the program CONTACT: G 200, nu 0.42 in both bodies, a = 1, mu 0.4, N 9.1954; at F =
  // 0.875 mu N it prints a shift of 8.155e-3; theory gives 8.172e-3.
  const double load = 9.1954, limit = 0.4 * load;
  OneBed bed(BedMaterial(0.4).with_elastic_pair(200.0, 0.42), BedShape::sphere_row(64, 1.0), with_load(load));
  double shift = 0.0;
  while (-bed.out.force[0] < 0.875 * limit) {
    bed.step(1e-6);
    shift += 1e-6;
  }
  const double full = 2.0 * 3.0 * limit * (2.0 - 0.42) / (16.0 * 200.0);
  CHECK(shift == Approx(full * (1.0 - std::pow(0.125, 2.0 / 3.0))).epsilon(1e-3));
  CHECK(shift == Approx(8.155e-3).epsilon(3e-3));
}

TEST_CASE("The contact radius of a sphere follows from its moduli and its radius") {
  // Contact radius by Hertz: a^3 = 3 N R / (4 E*); stiffness by Mindlin: 8 G a / (2 - nu).
  const double shear = 1e9, poisson = 0.3, radius = 0.02, load = 5.0;
  OneBed bed(BedMaterial(0.5).with_elastic(shear, poisson, radius), BedShape::sphere_row(), with_load(load));
  bed.step(1e-9);
  const double a = std::cbrt(0.75 * load * radius * (1.0 - poisson) / (2.0 * shear));
  const BedInfo info = bed.batch.info(bed.motion.id);
  CHECK(info.half[0] == Approx(a).epsilon(1e-12));
  CHECK(info.stiffness == Approx(8.0 * shear * a / (2.0 - poisson)).epsilon(1e-12));
  bed.motion.normal_load = load / 8.0;
  bed.step(0.0);
  CHECK(bed.batch.info(bed.motion.id).half[0] == Approx(a / 2.0).epsilon(1e-12));
}

TEST_CASE(
    "The size of a sphere's contact grows with the cube root of its load, a cylinder's with the square "
    "root, up to the full load") {
  for (const auto& [shape, power] : {std::pair{BedShape::sphere_row(16, 2e-3), 1.0 / 3.0},
                                     std::pair{BedShape::cylinder_row(2e-3, 64), 0.5}}) {
    OneBed bed(BedMaterial(0.5).with_presliding(1e-3), shape, with_load(3.0));
    for (double share = 1e-12; share < 1.5; share *= 1.37) {
      bed.motion.normal_load = 3.0 * share;
      bed.step(0.0);
      CHECK(bed.batch.info(bed.motion.id).half[0] ==
            Approx(2e-3 * std::pow(std::min(share, 1.0), power)).epsilon(1e-13));
    }
  }
}

TEST_CASE("A disc that slides and spins lies on the limit surface") {
  for (const Row& row : read_table("spin_limit.csv"))
    for (const auto& [rings, around, tolerance] :
         {std::tuple{7, 0, 0.01}, std::tuple{7, 16, 0.0085}, std::tuple{16, 31, 0.003}}) {
      const bool uniform = row.at("pressure") == "uniform";
      const double radius = 0.01, friction = 0.7, load = 3.0;
      OneBed bed(BedMaterial(friction).with_presliding(1e-8),
                 BedShape::disc(radius, uniform ? BedPressure::uniform : BedPressure::hertz, rings, around),
                 with_load(load, false));
      const double v = number(row, "v_over_omegaR");
      for (int i = 0; i < 60; ++i) bed.step(v * radius * 1e-6, 0.0, 1e-6);
      CAPTURE(row.at("pressure"), v, rings, around);
      const double slack = around == 0 ? 0.011 : tolerance;
      CHECK(std::abs(-bed.out.force[0] / (friction * load) - number(row, "F_over_muN")) < slack);
      CHECK(std::abs(-bed.out.torque / (friction * load * radius) - number(row, "T_over_muNR")) < slack);
    }
}

TEST_CASE("A disc of 7 x 16 cells is within 0.0145 of the limit surface at any centre of rotation") {
  // Closed form of the uniform disc (Farkas, Bartels, Unger, Wolf, 2003), e = v / (omega R) at most 1.
  OneBed bed(BedMaterial(1.0).with_presliding(1e-8), BedShape::disc(0.01, BedPressure::uniform, 7, 16),
             with_load(1.0, false));
  for (double e = 0.01; e < 1.0; e += 0.01) {
    for (int i = 0; i < 60; ++i) bed.step(e * 1e-8, 0.0, 1e-6);
    const double e2 = e * e, first = std::comp_ellint_1(e), second = std::comp_ellint_2(e);
    const double force = 4.0 * ((e2 + 1.0) * second + (e2 - 1.0) * first) / (3.0 * pi * e);
    const double torque = 4.0 * ((4.0 - 2.0 * e2) * second + (e2 - 1.0) * first) / (9.0 * pi);
    CAPTURE(e);
    CHECK(std::abs(-bed.out.force[0] - force) < 0.0145);
    CHECK(std::abs(-bed.out.torque / 0.01 - torque) < 0.0145);
  }
}

TEST_CASE("A disc that spins in place: stiffness while it sticks, 2/3 and 3 pi / 16 when it slides") {
  for (const bool uniform : {true, false}) {
    const double radius = 0.01, friction = 0.7, load = 3.0;
    OneBed bed(BedMaterial(friction).with_presliding(1e-6),
               BedShape::disc(radius, uniform ? BedPressure::uniform : BedPressure::hertz), with_load(load));
    bed.step(0.0, 0.0, 1e-9);
    const double stiffness = bed.batch.info(bed.motion.id).stiffness;
    CHECK(-bed.out.torque / 1e-9 == Approx(stiffness * radius * radius / 2.0).epsilon(1e-5));
    CHECK(bed.out.tangent[2][2] == Approx(stiffness * radius * radius / 2.0).epsilon(1e-5));
    for (int i = 0; i < 100; ++i) bed.step(0.0, 0.0, 1e-5);
    CHECK(-bed.out.torque / (friction * load * radius) ==
          Approx(uniform ? 2.0 / 3.0 : 3.0 * pi / 16.0).epsilon(0.005));
    CHECK(bed.out.slipping_share == Approx(1.0).epsilon(1e-6));
  }
}

TEST_CASE("A tyre rolls at the force and moment of the closed form, for steps of any length") {
  const double a = 0.1, load = 2.0, friction = 0.5;
  for (const bool all : {false, true})
    for (const double step : {0.001, 0.013, 0.1, 0.37, 1.7, 10.0})
      for (const Row& row : read_table("tyre_steady.csv")) {
        OneBed bed(BedMaterial(friction).with_presliding(1e-3), BedShape::wheel_row(a), with_load(load, all));
        const double slip = 1e-3 * number(row, "slip_times_2a_over_l0");
        const double angle = number(row, "direction_deg") * pi / 180.0;
        for (double rolled = 0.0; rolled < 2.0; rolled += step)
          bed.step(slip * step * std::cos(angle), slip * step * std::sin(angle), 0.0, step * 2.0 * a);
        CAPTURE(step, all, row.at("slip_times_2a_over_l0"), row.at("direction_deg"));
        CHECK(std::abs(-bed.out.force[0] / (friction * load) - number(row, "Fx_over_muN")) < 1e-3);
        CHECK(std::abs(-bed.out.force[1] / (friction * load) - number(row, "Fy_over_muN")) < 1e-3);
        CHECK(std::abs(-bed.out.torque / (friction * load * 2.0 * a) - number(row, "Mz_over_muN2a")) < 1e-3);
        // Checks that, when rolling backwards, the other end of the contact is the leading edge.
        if (!all && step > 0.05) {
          OneBed back(BedMaterial(friction).with_presliding(1e-3), BedShape::wheel_row(a),
                      with_load(load, all));
          for (double rolled = 0.0; rolled < 2.0; rolled += step)
            back.step(slip * step * std::cos(angle), slip * step * std::sin(angle), 0.0, -step * 2.0 * a);
          CHECK(std::abs(back.out.force[1] - bed.out.force[1]) < 2e-3 * friction * load);
          CHECK(std::abs(back.out.torque + bed.out.torque) < 2e-3 * friction * load * 2.0 * a);
        }
      }
}

TEST_CASE("A tyre that begins to slip builds its force up over the distance rolled") {
  const double a = 0.1, load = 2.0, friction = 0.5;
  for (const double step : {0.001, 0.01, 0.05, 0.1}) {
    std::unique_ptr<OneBed> bed;
    double slip = 0.0, rolled = 0.0;
    for (const Row& row : read_table("tyre_step.csv")) {
      if (number(row, "slip_times_2a_over_l0") != slip) {
        slip = number(row, "slip_times_2a_over_l0");
        rolled = 0.0;
        bed = std::make_unique<OneBed>(BedMaterial(friction).with_presliding(1e-3), BedShape::wheel_row(a),
                                       with_load(load, false));
        bed->step(0.0, 0.0, 0.0, 0.123);
      }
      while (rolled < number(row, "rolled_over_2a") - 1e-9) {
        const double part = std::min(step, number(row, "rolled_over_2a") - rolled);
        bed->step(0.0, 1e-3 * slip * part, 0.0, part * 2.0 * a);
        rolled += part;
      }
      CAPTURE(step, slip, rolled);
      CHECK(std::abs(-bed->out.force[1] / (friction * load) - number(row, "F_over_muN")) < 1e-3);
    }
  }
}

TEST_CASE("The slip stiffness of a tyre is its force at small slip") {
  for (const bool row : {true, false}) {
    const BedShape shape =
        row ? BedShape::wheel_row(0.1) : BedShape::ellipse(0.1, 0.08, BedPressure::parabolic).rolling(32, 8);
    for (const int axis : {0, 1}) {
      OneBed bed(BedMaterial(1.0).with_slip_stiffness(8e4, 5e4), shape, with_load(4000.0));
      for (int i = 0; i < 30; ++i) bed.step(axis == 0 ? 1e-7 : 0.0, axis == 1 ? 1e-7 : 0.0, 0.0, 0.01);
      CHECK(-bed.out.force[axis] / 1e-5 == Approx(axis == 0 ? 8e4 : 5e4).epsilon(2e-3));
    }
  }
}

TEST_CASE(
    "A rolling ellipse meets the converged simplified theory of Kalker, and CONTACT's within its error") {
  const double a = 8e-3, b = 4e-3, load = 82e3, friction = 0.3, limit = friction * load;
  for (const Row& row : read_table("ellipse_steady.csv")) {
    const bool parabolic = row.at("traction_bound") == "paraboloid";
    OneBed bed(
        BedMaterial(friction).with_flexibility(4.937e-14, 5.152e-14, 4.090e-14),
        BedShape::ellipse(a, b, parabolic ? BedPressure::parabolic : BedPressure::hertz).rolling(32, 16),
        with_load(load, false));
    const double x = number(row, "creep_x"), y = number(row, "creep_y"), spin = number(row, "spin_per_mm");
    const double step = a / 16.0;
    for (int i = 0; i < 70; ++i) bed.step(x * step, y * step, 1e3 * spin * step, step);
    CAPTURE(parabolic, x, y, spin);
    // Kalker's friction opposes the slip with each part over its flexibility, the bed's the slip itself: they
    // differ most where the slip turns round, in pure spin.
    const double slack = x == 0.0 && y == 0.0 ? 5e-3 : 3e-3;
    CHECK(std::abs(bed.out.force[0] / limit - number(row, "Fx_over_muN")) < slack);
    CHECK(std::abs(bed.out.force[1] / limit - number(row, "Fy_over_muN")) < slack);
    CHECK(std::abs(bed.out.torque / (limit * std::sqrt(a * b)) - number(row, "Mz_over_muN_sqrt_ab")) < slack);
    if (y < 0.0) {  // Example `fastsim` of the program CONTACT; its 220 x 220 cells have a first-order error
      CHECK(bed.out.force[1] / limit == Approx(parabolic ? -0.6359 : -0.5956).epsilon(0.012));
      CHECK(bed.out.torque == Approx(parabolic ? -37.98 : -45.30).epsilon(0.02));
    }
  }
}

TEST_CASE("A bed without rolling steps as its bristles do one by one") {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (const bool all : {true, false}) {
    std::vector<BedCell> cells;
    for (int i = 0; i < 21; ++i)
      cells.push_back({{0.01 * uniform(random), 0.01 * uniform(random)},
                       1.5 + uniform(random),
                       i == 0 ? 0.0 : 1.1 + uniform(random)});
    OneBed bed(BedMaterial(0.8).with_presliding(1e-4), BedShape::from_list(cells), with_load(10.0, all));
    std::vector<BedBristle> shown(cells.size());
    bed.step(0.0);
    REQUIRE(bed.batch.read_bristles(bed.motion.id, {shown.data(), shown.size()}) == cells.size());
    Brute brute;
    double limit = 0.0;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      CHECK(shown[i].position[0] == Approx(cells[i].position[0]).epsilon(1e-6));
      if (cells[i].load > 0.0)
        CHECK(shown[i].stiffness / cells[i].stiffness == Approx(shown[1].stiffness / cells[1].stiffness));
      else
        CHECK(shown[i].stiffness == 0.0);  // bristles out of contact have no stiffness
      CHECK(shown[i].stiffness * shown[i].limit ==
            Approx(shown[1].stiffness * shown[1].limit * cells[i].load / cells[1].load).epsilon(1e-5));
      limit += shown[i].stiffness * shown[i].limit;
      brute.bristles.push_back(
          {cells[i].position[0], cells[i].position[1], shown[i].stiffness, shown[i].limit});
    }
    CHECK(limit == Approx(8.0).epsilon(1e-5));
    for (int i = 0; i < 60; ++i) {
      const double size = std::pow(10.0, -6.0 + 2.5 * (1.0 + uniform(random)) / 2.0);
      const double dx = size * uniform(random), dy = size * uniform(random);
      const double spin = i % 3 == 0 ? 0.0 : 100.0 * size * uniform(random);
      bed.step(dx, dy, spin);
      brute.step(dx, dy, spin, 4000);
      CAPTURE(all, i, size);
      for (const int k : {0, 1}) CHECK(std::abs(bed.out.force[k] - brute.force[k]) < 8.0 * 2e-4);
      CHECK(std::abs(bed.out.torque - brute.torque) < 0.08 * 2e-4);
      if (!all) continue;
      for (const int k : {0, 1}) CHECK(std::abs(bed.out.mean[k] - brute.mean[k]) < 8.0 * 2e-4);
      CHECK(std::abs(bed.out.mean_torque - brute.mean_torque) < 0.08 * 2e-4);
      CHECK(bed.out.dissipated == Approx(brute.dissipated).epsilon(2e-3).margin(1e-9));
      CHECK(bed.out.stored == Approx(brute.stored).epsilon(1e-3));
    }
  }
}

TEST_CASE("Mean force and energies of a bed that does not roll balance in every step") {
  std::mt19937 random(3);
  for (const Kind& kind : all_kinds()) {
    OneBed bed(kind.material, kind.shape, with_load(20.0));
    double stored = 0.0;
    for (int i = 0; i < 2000; ++i) {
      BedMotion m = draw_motion(random, bed.motion.id, false, 1e-3, 3e-4, 20.0);
      bed.motion.normal_load = m.normal_load;
      bed.step(m.displacement[0], m.displacement[1], m.spin);
      if (std::string(kind.name) == "sphere") m.spin = 0.0;
      const double work = -(bed.out.mean[0] * m.displacement[0] + bed.out.mean[1] * m.displacement[1] +
                            bed.out.mean_torque * m.spin);
      CAPTURE(kind.name, i);
      const double scale = bed.out.stored + stored + std::abs(work);
      CHECK(std::abs(work - (bed.out.stored - stored) - bed.out.dissipated) < 1e-4 * scale + 1e-15);
      CHECK(bed.out.dissipated >= -1e-6 * scale);
      stored = bed.out.stored;
    }
  }
}

TEST_CASE("Energy is never made, over a million random steps with spin, rolling and load") {
  for (const Kind& kind : all_kinds()) {
    std::mt19937 random(11);
    const double length = kind.shape.half[0] > 0.05 ? 0.1 : 1e-3;
    OneBed bed(kind.material, kind.shape, with_load(20.0));
    double put_in = 0.0, least = 0.0;
    std::uint32_t wrong = 0;
    for (int i = 0; i < 90000; ++i) {
      const BedMotion m = draw_motion(random, bed.motion.id, kind.shape.rolls, length, 3e-4, 20.0);
      bed.batch.step({&m, 1}, {&bed.out, 1});
      wrong += bed.out.status != Status::ok;
      put_in -= bed.out.mean[0] * m.displacement[0] + bed.out.mean[1] * m.displacement[1] +
                bed.out.mean_torque * m.spin;
      least = std::min(least, put_in - bed.out.stored);
    }
    CAPTURE(kind.name, least, put_in);
    CHECK(wrong == 0);
    CHECK(least >= -1e-9 * put_in - 1e-12);
    CHECK(put_in > 0.0);
  }
}

TEST_CASE("No state that steps give is refused, however wild the steps, while its forces are numbers") {
  std::mt19937 random(23);
  std::uniform_real_distribution<double> uniform;
  std::vector<Kind> kinds = all_kinds();
  kinds.push_back({"two cells", BedMaterial(0.8, 0.3).with_presliding(1e-7),
                   BedShape::ellipse(1e-3, 1e-3, BedPressure::parabolic).rolling(2, 1)});
  kinds.push_back({"three flexibilities", BedMaterial(0.5).with_flexibility(1e-12, 3e-12, 2e-13),
                   BedShape::ellipse(2e-3, 1e-3, BedPressure::hertz).rolling(9, 4)});
  kinds.push_back({"stiff sphere", BedMaterial(0.5).with_presliding(1e-9), BedShape::sphere_row(7, 1e-5)});
  for (const Kind& kind : kinds)
    for (const bool all : {true, false}) {
      OneBed bed(kind.material, kind.shape, with_load(20.0, all));
      const auto size_of = [&](double least, double most) {
        return least * std::pow(most / least, uniform(random)) * (uniform(random) < 0.5 ? -1.0 : 1.0);
      };
      for (int run = 0; run < 40; ++run) {
        bed.batch.reset(bed.motion.id);
        const double most = run % 4 == 3 ? 1e5 : std::pow(10.0, -run % 4 - 2.0);
        for (int i = 0; i < 40; ++i) {
          BedMotion m = draw_motion(random, bed.motion.id, kind.shape.rolls, 1e-3, 3e-4, 20.0);
          if (uniform(random) < 0.3) m.displacement[i % 2] = size_of(1e-12, most);
          if (uniform(random) < 0.1) m.spin = size_of(1e-9, 3.2);
          if (kind.shape.rolls && uniform(random) < 0.2) m.rolled[0] = size_of(1e-9, most);
          if (std::string(kind.name) == "ball" && uniform(random) < 0.3) m.rolled[1] = size_of(1e-7, 1e-2);
          if (uniform(random) < 0.1) m.normal_load = std::abs(size_of(1e-15, 1e8));
          bed.batch.step({&m, 1}, {&bed.out, 1});
          CAPTURE(kind.name, all, run, i);
          REQUIRE(std::isfinite(bed.out.force[0] + bed.out.force[1] + bed.out.torque + bed.out.stored));
          const std::vector<std::byte> bytes = saved_state(bed.batch);
          REQUIRE_NOTHROW(bed.batch.restore_state(bytes));
        }
      }
    }
}

TEST_CASE("A car on a slope of 20 % stays where it is, under a load that trembles") {
  // Makes one Newton iteration on the force balance in every millisecond, as a solver does that searches for
  // the position of rest.
  const double load = 4000.0, slope = 0.2 * load;
  const int axis = GENERATE(0, 1);
  OneBed wheel(BedMaterial(0.9).with_slip_stiffness(8e4, 8e4), BedShape::wheel_row(0.07),
               with_load(1.1 * load));
  wheel.motion.normal_load = load;
  wheel.step(0.0, 0.0, 0.0, 1.0);  // rolls the bed, so that it is in the state of a rolling wheel
  double at = 0.0;
  const auto run = [&](int ticks) {
    for (int i = 0; i < ticks; ++i) {
      wheel.motion.normal_load = load * (1.0 + 0.05 * std::sin(0.07 * i));
      const double d = (slope + wheel.out.force[axis]) / std::max(wheel.out.tangent[axis][axis], 1.0);
      axis == 0 ? wheel.step(d) : wheel.step(0.0, d);
      at += d;
    }
  };
  run(20000);  // runs until the load has passed its largest swing
  const double settled = at;
  run(400000);
  CHECK(std::abs(wheel.out.force[axis] + slope) < 1e-3);
  CHECK(std::abs(at - settled) < 1e-9);  // resolution of a deflection in single precision, 6e-8 of 1 mm
  const double halfway = at;
  run(400000);
  CHECK(std::abs(at - halfway) < 1e-10);
}

TEST_CASE("A rising load does not change the force, and contact lost and found is unbent") {
  for (const Kind& kind : all_kinds()) {
    OneBed bed(kind.material, kind.shape, with_load(20.0), 10.0);
    const double slip = 0.3 * bed.batch.info(bed.motion.id).longest_deflection;
    bed.step(0.2 * slip, 0.1 * slip);
    const BedResponse before = bed.out;
    bed.motion.normal_load = 15.0;
    bed.step(0.0);
    CAPTURE(kind.name);
    for (const int k : {0, 1}) CHECK(bed.out.force[k] == Approx(before.force[k]).epsilon(1e-5));
    CHECK(bed.out.dissipated >= 0.0);
    bed.motion.normal_load = 0.0;
    bed.step(0.0);
    CHECK(bed.out.force[0] == 0.0);
    CHECK(bed.out.stored == 0.0);
    CHECK(bed.out.dissipated > 0.0);
    bed.step(5.0 * slip, 0.0);
    bed.motion.normal_load = 20.0;
    bed.step(0.0);
    CHECK(bed.out.force[0] == 0.0);
    CHECK(bed.out.torque == 0.0);
  }
}

TEST_CASE("A wheel that starts, stops and reverses has a force without a jump") {
  OneBed wheel(BedMaterial(0.9).with_slip_stiffness(8e4, 8e4), BedShape::wheel_row(0.07),
               with_load(4000.0, false));
  double before = 0.0, largest = 0.0;
  for (int i = 0; i < 20000; ++i) {
    const double speed = 0.5 * std::sin(1e-3 * i);
    wheel.step(2e-5 * std::cos(1.7e-3 * i), 1e-5 * std::sin(2.3e-3 * i), 0.0, 1e-3 * speed);
    largest = std::max(largest, std::abs(wheel.out.force[0] - before));
    before = wheel.out.force[0];
    REQUIRE(std::abs(before) <= 0.9 * 4000.0 * (1.0 + 1e-5));
  }
  // Bound of the force's change in a step: slip of 2e-5 m changes every deflection by at most that, and
  // bristles that enter or leave contact add their share of the force.
  const double stiffness = wheel.batch.info(wheel.motion.id).stiffness;
  CHECK(largest < 1.1 * (2e-5 * stiffness + 5e-4 / 0.14 * 2.0 * 0.9 * 4000.0));
}

TEST_CASE("Static friction above kinetic: a peak, then the kinetic force") {
  OneBed bed(BedMaterial(0.9, 0.6).with_presliding(1e-4), BedShape::disc(1e-3, BedPressure::uniform),
             with_load(10.0));
  double peak = 0.0;
  for (int i = 0; i < 300; ++i) peak = std::max(peak, -bed.step(1e-6).force[0]);
  CHECK(peak == Approx(9.0).epsilon(0.02));
  CHECK(-bed.out.force[0] == Approx(6.0).epsilon(1e-4));
}

TEST_CASE(
    "Bristles hold their static limit again after a step of rest, named or not, and when the motion turns "
    "back") {
  for (const bool all : {true, false})
    for (const char* how : {"at once", "a step of length zero", "a step that does not name it", "restored"}) {
      INFO(how << (all ? ", all outputs" : ""));
      OneBed bed(BedMaterial(0.9, 0.6).with_presliding(1e-4), BedShape::disc(1e-3, BedPressure::uniform),
                 with_load(10.0, all));
      for (int i = 0; i < 300; ++i) bed.step(1e-6);
      CHECK(-bed.out.force[0] == Approx(6.0).epsilon(1e-4));
      if (how[0] == 'a' && how[2] == 's' && how[7] == 'o') bed.step(0.0);
      if (how[7] == 't' || how[0] == 'r') bed.batch.step({}, {});
      if (how[0] == 'r') {
        std::vector<std::byte> state(bed.batch.state_size());
        bed.batch.save_state({state.data(), state.size()});
        bed.batch.restore_state({state.data(), state.size()});
      }
      double peak = 0.0;
      for (int i = 0; i < 300; ++i) peak = std::max(peak, -bed.step(1e-6).force[0]);
      CHECK(peak == Approx(std::string(how) == "at once" ? 6.0 : 9.0).epsilon(0.02));
      // Moves the bed back by less than the sum of the kinetic and the static limit, so that all bristles
      // still stick, in one step as in many.
      for (const int parts : {1, 20}) {
        OneBed back(BedMaterial(0.9, 0.6).with_presliding(0.9e-4), BedShape::disc(1e-3, BedPressure::uniform),
                    with_load(10.0, all));
        for (int i = 0; i < 300; ++i) back.step(1e-6);
        for (int i = 0; i < parts; ++i) back.step(-1.4e-4 / parts);
        CHECK(back.out.force[0] == Approx(8.0).epsilon(1e-3));
      }
    }
}

TEST_CASE("A bed that slides by a millionth of a limit a step turns, works and dissipates as in long steps") {
  for (const bool all : {true, false})
    for (const double gain : {1.0, 0.6})
      for (const double spin : {0.0, 0.5})
        for (const double size : {0.9e-3, 3e-5, 1e-6}) {
          INFO("gain " << gain << ", spin " << spin << ", steps of " << size << (all ? ", all outputs" : ""));
          const auto run = [&](double step, double& work, double& dissipated) {
            // Takes a wheel's row of uniform pressure, or a rectangle where the bed spins.
            const BedShape shape = spin > 0.0 ? BedShape::rectangle(0.1, 0.05, BedPressure::uniform, 4, 4)
                                              : BedShape::wheel_row(0.1, BedPressure::uniform, 8);
            BedMaterial material(0.8);
            if (spin > 0.0)
              material.with_presliding(1e-3);
            else
              material.with_slip_stiffness(9e4, 9e4 * gain);
            OneBed bed(material, shape, with_load(1000.0, all));
            const double limit = bed.batch.info(bed.motion.id).longest_deflection;
            for (int i = 0; i < 100; ++i) bed.step(0.05 * limit);
            const int steps = static_cast<int>(std::lround(0.12 / step));
            work = dissipated = 0.0;
            for (int i = 0; i < steps; ++i) {
              const double d = 0.12 / steps * limit, turn = spin * d / 0.1;
              bed.step(0.0, d, turn);
              work -= bed.out.mean[1] * d + bed.out.mean_torque * turn;
              dissipated += bed.out.dissipated;
            }
            return bed.out;
          };
          double work = 0.0, dissipated = 0.0, of_long[2];
          if (spin > 0.0 && gain != 1.0) continue;
          const BedResponse out = run(size, work, dissipated), coarse = run(0.003, of_long[0], of_long[1]);
          for (int k = 0; k < 2; ++k) CHECK(std::abs(out.force[k] - coarse.force[k]) < 1e-3 * 800.0);
          CHECK(std::abs(out.torque - coarse.torque) < 1e-3 * 80.0);
          if (!all) continue;
          CHECK(work == Approx(of_long[0]).epsilon(2e-3));
          CHECK(dissipated == Approx(of_long[1]).epsilon(3e-3));
        }
}

/// A bristle whose deflection grows by `gain` times as much along y as along x, in tiny steps of which each
/// takes what its tip slid against its force. Deflections and displacements over the limit.
struct AskewBristle {
  double gain, zx = 0.0, zy = 0.0, mean_x = 0.0, mean_y = 0.0;

  void move(double dx, double dy) {
    const int parts = 2000 + static_cast<int>(1500.0 * std::hypot(dx, gain * dy));
    mean_x = mean_y = 0.0;
    for (int i = 0; i < parts; ++i) {
      const double bx = zx, by = zy;
      zx += dx / parts;
      zy += gain * dy / parts;
      const double over = zx * zx + zy * zy - 1.0;
      if (over > 0.0) {
        const double slid = over / (2.0 * (zx * zx + gain * zy * zy));
        zx -= slid * zx;
        zy -= slid * gain * zy;
      }
      mean_x += 0.5 * (bx + zx) / parts;
      mean_y += 0.5 * (by + zy) / parts;
    }
  }
};

TEST_CASE("Friction opposes slip, also where a bed is stiffer along one axis than along the other") {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> flat(-1.0, 1.0);
  for (const bool all : {true, false})
    for (const double gain : {0.1, 0.2, 0.4, 0.7, 1.5, 2.5, 5.0, 10.0})
      for (const double size : {0.02, 0.3, 3.0, 30.0}) {
        INFO("gain " << gain << ", steps of " << size << (all ? ", all outputs" : ""));
        const double load = 1000.0, mu = 0.8;
        OneBed wheel(BedMaterial(mu).with_slip_stiffness(9e4, 9e4 * gain),
                     BedShape::wheel_row(0.1, BedPressure::uniform, 8), with_load(load, all));
        const double limit = wheel.batch.info(wheel.motion.id).longest_deflection;
        AskewBristle brute{gain};
        double angle = 0.5, work = 0.0, dissipated = 0.0;
        for (int i = 0; i < 60; ++i) {
          angle += i % 10 == 0 ? 2.0 * flat(random) : 0.3 * flat(random);
          const double dx = size * std::cos(angle), dy = size * std::sin(angle);
          wheel.step(dx * limit, dy * limit);
          brute.move(dx, dy);
          CHECK(std::abs(-wheel.out.force[0] / (mu * load) - brute.zx) < 2e-3);
          CHECK(std::abs(-wheel.out.force[1] / (mu * load) - brute.zy) < 2e-3);
          if (!all) continue;
          CHECK(std::abs(-wheel.out.mean[0] / (mu * load) - brute.mean_x) < 2e-3);
          CHECK(std::abs(-wheel.out.mean[1] / (mu * load) - brute.mean_y) < 2e-3);
          work += brute.mean_x * dx + brute.mean_y * dy;
          dissipated += wheel.out.dissipated / (mu * load * limit);
        }
        if (all) CHECK(dissipated + wheel.out.stored / (mu * load * limit) == Approx(work).epsilon(2e-3));
        for (int i = 0; i < 40; ++i) wheel.step(4.0 * limit, 4.0 * limit);
        CHECK(wheel.out.force[1] == Approx(wheel.out.force[0]).epsilon(1e-5));
      }
}

TEST_CASE(
    "A step that slides further than it rolls, or turns its slip, has the mean and the losses of many") {
  for (const double slip : {0.02, 0.3, 2.0, 50.0})
    for (const double turn : {0.0, 2.2, 3.1}) {
      INFO("slip " << slip << " of the rolling, turned by " << turn);
      const double roll = 0.01, load = 4000.0, mu = 0.8;
      double mean[2][2] = {}, dissipated[2] = {}, least = 0.0;
      for (const int parts : {1, 400}) {
        OneBed tyre(BedMaterial(mu).with_slip_stiffness(9e4, 9e4),
                    BedShape::rectangle(0.1, 0.08, BedPressure::parabolic).rolling(16, 4), with_load(load));
        for (int i = 0; i < 40; ++i) tyre.step(0.5 * roll * slip, 0.0, 0.0, 0.5 * roll);
        const int k = parts == 1 ? 0 : 1;
        for (int i = 0; i < parts; ++i) {
          const double d = roll * slip / parts;
          tyre.step(d * std::cos(turn), d * std::sin(turn), 0.0, roll / parts);
          for (int axis = 0; axis < 2; ++axis) mean[k][axis] += tyre.out.mean[axis] / parts;
          dissipated[k] += tyre.out.dissipated;
          least = std::min(least, tyre.out.dissipated);
        }
      }
      const double error = (turn == 0.0 ? 0.003 : 0.015) * mu * load;
      for (int axis = 0; axis < 2; ++axis) CHECK(std::abs(mean[0][axis] - mean[1][axis]) < error);
      CHECK(std::abs(dissipated[0] - dissipated[1]) < error * roll * slip);
      CHECK(least > -1e-6 * mu * load * roll * slip);
    }
}

TEST_CASE(
    "A wheel with static friction: bristles hold the static limit until they slide, afterwards the kinetic "
    "one") {
  // Steady rolling in closed form: slip bends a bristle by slip x t, t the distance from the leading edge, up
  // to the static limit; from there it has the kinetic one. Limits are 4 u (1 - u), u = t / 2a. `unit`:
  // kinetic limit of the deflection at the middle, m.
  const double load = 2.0, kinetic = 0.5, ratio = 1.4, unit = 1e-3;
  for (const double slip : {0.5, 1.0, 2.0, 3.0}) {  // slip times contact length, in `unit`s
    OneBed bed(BedMaterial(ratio * kinetic, kinetic).with_presliding(ratio * unit),
               BedShape::wheel_row(0.1, BedPressure::parabolic, 64), with_load(load, false));
    for (int i = 0; i < 400; ++i) bed.step(0.0, slip * unit / 100.0, 0.0, 0.002);
    double sum = 0.0;
    const int n = 100000;
    bool slides = false;
    for (int i = 0; i < n; ++i) {
      const double u = (i + 0.5) / n, limit = 4.0 * u * (1.0 - u);
      slides = slides || slip * u > ratio * limit;
      sum += (slides ? limit : slip * u) / n;
    }
    CHECK(std::abs(-bed.out.force[1] / (kinetic * load) - 1.5 * sum) < 5e-3);
    for (int i = 0; i < 2; ++i) bed.step(0.0, slip * unit * 10.0, 0.0, 2.0);
    CHECK(std::abs(-bed.out.force[1] / (kinetic * load) - 1.5 * sum) < 5e-3);
  }
}

TEST_CASE("A falling load takes back limits only, also after rolling") {
  OneBed wheel(BedMaterial(0.9).with_presliding(1e-3), BedShape::wheel_row(0.1), with_load(100.0));
  wheel.step(0.0, 2e-4, 0.0, 0.13);
  const double force = wheel.out.force[1];
  CHECK(force < -1.0);
  for (const double load : {95.0, 90.0, 85.0}) {
    wheel.motion.normal_load = load;
    wheel.step(0.0);
    CHECK(wheel.out.force[1] == Approx(force).epsilon(1e-2));  // force of partial slip at the trailing edge
  }
}

TEST_CASE("Above the full load a falling load that limits nothing leaves the force") {
  for (const Kind& kind : all_kinds()) {
    OneBed bed(kind.material, kind.shape, with_load(20.0), 5.0);
    bed.step(0.0);
    const double force = bed.step(1e-7).force[0];
    for (const double load : {25.0, 24.0, 23.0, 22.0, 21.0}) {
      bed.motion.normal_load = load;
      CAPTURE(kind.name, load);
      CHECK(bed.step(0.0).force[0] == Approx(force).epsilon(1e-5));
    }
    CHECK(force < 0.0);
  }
}

TEST_CASE(
    "After the load has fallen by many powers of ten, a bed is within its new limits and slides at them") {
  const BedMaterial material = BedMaterial(0.6).with_presliding(1e-4);
  const BedShape shapes[] = {BedShape::sphere_row(20, 1e-3), BedShape::from_list({{{0, 0}}, {{1e-3, 0}}}),
                             BedShape::wheel_row(1e-3)};
  for (const BedShape& shape : shapes)
    for (const bool all : {true, false})
      for (const double before : {1e3, 1e9, 1e15}) {
        CAPTURE(before, all, static_cast<int>(shape.kind), shape.rolls);
        OneBed bed(material, shape, with_load(2.0, all), before);
        for (const double moved : {1e5, 3e-4, 2e-4}) bed.step(moved);
        bed.motion.normal_load = 1e-3;
        const double limit = 0.6 * 1e-3;
        for (int k = 0; k < 5; ++k)
          CHECK(std::hypot(bed.step(0.0).force[0], bed.out.force[1]) < 1.000002 * limit);
        std::vector<std::byte> state(bed.batch.state_size());
        REQUIRE(bed.batch.save_state(state) == state.size());
        CHECK_NOTHROW(bed.batch.restore_state(state));
        for (int k = 0; k < 5; ++k)
          CHECK(std::hypot(bed.step(1e-9, 1e-9).force[0], bed.out.force[1]) < 1.000002 * limit);
        for (int k = 0; k < 5; ++k) bed.step(0.0, 1e-4);
        CHECK(-bed.out.force[1] == Approx(limit).epsilon(1e-3));
      }
}

TEST_CASE("The tractrix that beds use is the tractrix") {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  double worst = 0.0;
  for (int i = 0; i < 100000; ++i) {
    const double angle = pi / 2.0 * uniform(random), heading = pi * uniform(random);
    const double x = std::pow(10.0, 2.5 * uniform(random));
    const double half = std::tan(angle / 2.0) * std::exp(-x);
    const double end = heading + 2.0 * std::atan(half);
    float ux = static_cast<float>(std::cos(heading + angle)),
          uy = static_cast<float>(std::sin(heading + angle));
    const float dx = static_cast<float>(x * std::cos(heading)),
                dy = static_cast<float>(x * std::sin(heading));
    const detail::Dragged<float> to = detail::drag(dx * dx + dy * dy, 2.0f * (ux * dx + uy * dy), 0.0f);
    ux = ux * to.keep + dx * to.push;
    uy = uy * to.keep + dy * to.push;
    worst = std::max(
        worst, std::hypot(static_cast<double>(ux) - std::cos(end), static_cast<double>(uy) - std::sin(end)));
  }
  CHECK(worst < 2e-6);
}

TEST_CASE("A wheel that was turned where it stands rolls on from its torque") {
  OneBed wheel(BedMaterial(0.9).with_presliding(1e-3), BedShape::wheel_row(0.1, BedPressure::parabolic, 64),
               with_load(100.0));
  for (int i = 0; i < 5; ++i) wheel.step(1e-5, -2e-5, 4e-4);
  const BedResponse turned = wheel.out;
  CHECK(std::abs(turned.torque) > 0.1);
  wheel.step(0.0, 0.0, 0.0, 1e-4);
  CHECK(wheel.out.torque == Approx(turned.torque).epsilon(0.01));
  CHECK(wheel.out.force[0] == Approx(turned.force[0]).epsilon(0.01));
  CHECK(wheel.out.force[1] == Approx(turned.force[1]).epsilon(0.01));
}

TEST_CASE("The tangent is the slope of force and torque while all sticks, off centre and in every column") {
  for (const BedMaterial& material : {BedMaterial(0.8).with_presliding(1e-3)}) {
    OneBed bed(material,
               BedShape::from_list({{{2e-3, 1e-3}, 1, 1}, {{5e-3, -3e-3}, 2, 1}, {{1e-3, 4e-3}, 1, 2}}),
               with_load(10.0));
    bed.step(1e-5, 2e-5, 1e-3);
    const BedResponse at = bed.out;
    CHECK(at.slipping_share == 0.0);
    for (int column = 0; column < 3; ++column) {
      BedMotion m = bed.motion;
      m.displacement[0] = column == 0 ? 1e-5 : 0.0;
      m.displacement[1] = column == 1 ? 1e-5 : 0.0;
      m.spin = column == 2 ? 1e-3 : 0.0;
      const double size = column == 2 ? 1e-3 : 1e-5;
      const BedResponse moved = bed.batch.find_force(m);
      CHECK((at.force[0] - moved.force[0]) / size ==
            Approx(at.tangent[0][column]).epsilon(1e-4).margin(1e-3));
      CHECK((at.force[1] - moved.force[1]) / size ==
            Approx(at.tangent[1][column]).epsilon(1e-4).margin(1e-3));
      CHECK((at.torque - moved.torque) / size == Approx(at.tangent[2][column]).epsilon(1e-4).margin(1e-5));
    }
  }
}

TEST_CASE("A step that rolls reports the mean of the forces on its distance, and takes the load first") {
  OneBed wheel(BedMaterial(0.9).with_presliding(1e-3), BedShape::wheel_row(0.1), with_load(100.0));
  wheel.step(0.0, 1e-5, 0.0, 1e-3);
  CHECK(wheel.out.mean[1] == Approx(0.5 * wheel.out.force[1]).epsilon(1e-6));
  for (int i = 0; i < 300; ++i) wheel.step(0.0, 1e-5, 0.0, 1e-3);
  const double before = wheel.out.force[1];
  wheel.motion.normal_load = 1.0;
  wheel.step(0.0, 0.0, 0.0, 1e-4);
  CHECK(std::abs(before) > 10.0);
  CHECK(std::abs(wheel.out.mean[1]) <= 0.9 * 1.001);
}

TEST_CASE("The presliding displacement is that at which all of it slides") {
  OneBed bed(BedMaterial(0.9, 0.6).with_presliding(1e-4), BedShape::disc(1e-3, BedPressure::uniform),
             with_load(10.0));
  bed.step(0.98e-4);
  CHECK(bed.out.slipping_share == 0.0);
  CHECK(-bed.out.force[0] == Approx(0.98 * 9.0).epsilon(1e-4));
  bed.step(0.04e-4);
  CHECK(bed.out.slipping_share == Approx(1.0));
}

TEST_CASE("A ball rolls alike in every direction") {
  const BedMaterial material = BedMaterial(0.5).with_presliding(1e-5);
  const auto run = [&](double angle) {
    OneBed ball(material, BedShape::disc(1e-3, BedPressure::hertz).rolling(24, 12), with_load(10.0));
    const double c = std::cos(angle), s = std::sin(angle);
    for (int i = 0; i < 40; ++i) {
      const double along = 1e-7, across = 2e-7, rolled = 1e-4;
      ball.motion.rolled[1] = rolled * s;
      ball.step(along * c - across * s, along * s + across * c, 2e-4, rolled * c);
    }
    return std::array<double, 3>{ball.out.force[0] * c + ball.out.force[1] * s,
                                 ball.out.force[1] * c - ball.out.force[0] * s, ball.out.torque * 1e3};
  };
  const auto straight = run(0.0);
  CHECK(std::abs(straight[0]) > 0.1);
  CHECK(std::abs(straight[2]) > 0.05);
  for (const double angle : {0.4, 1.5, 3.0, -2.0}) {
    const auto turned = run(angle);
    for (std::size_t k = 0; k < 3; ++k) CHECK(std::abs(turned[k] - straight[k]) < 2e-4 * 5.0);
  }
  // Checks that rolling back does not turn the rows of bristles by half a turn, so that bent bristles keep
  // their places.
  OneBed ball(material, BedShape::disc(1e-3, BedPressure::hertz).rolling(24, 12), with_load(10.0));
  for (int i = 0; i < 40; ++i) ball.step(0.0, 2e-7, 0.0, 1e-4);
  const double torque = ball.out.torque;
  ball.step(0.0, 0.0, 0.0, -1e-5);
  CHECK(ball.out.torque == Approx(torque).epsilon(0.05));
}

TEST_CASE("A bed cut from a pressure is the bed of that shape") {
  const double radius = 2e-3;
  OneBed cut(
      BedMaterial(0.5).with_presliding(1e-5),
      BedShape::from_pressure(radius, radius, 40, 40,
                              [&](double x, double y) {
                                return std::sqrt(std::max(0.0, 1.0 - (x * x + y * y) / (radius * radius)));
                              }),
      with_load(2.0));
  OneBed disc(BedMaterial(0.5).with_presliding(1e-5), BedShape::disc(radius, BedPressure::hertz, 12, 36),
              with_load(2.0));
  for (int i = 0; i < 40; ++i) {
    cut.step(1e-6, 0.0, 1e-3);
    disc.step(1e-6, 0.0, 1e-3);
    CHECK(std::abs(cut.out.force[0] - disc.out.force[0]) < 0.012);
    CHECK(std::abs(cut.out.torque - disc.out.torque) < 0.012 * radius);
  }
  CHECK_THROWS_AS(BedShape::from_pressure(1.0, 1.0, 4, 4, [](double, double) { return 0.0; }), Error);
}

TEST_CASE("Loads and stiffnesses of a list are relative") {
  // Three bristles at the corners of a right angle, with loads 1 : 2 : 3. Beyond the presliding displacement
  // each holds mu times its share of 20 N, about the centre at zero.
  const double mu = 0.6, load = 20.0;
  for (const double scale : {1e-25, 1e-7, 1.0, 1e9}) {
    const BedShape shape = BedShape::from_list(
        {{{0.0, 0.0}, 1.0, scale}, {{1e-3, 0.0}, 2.0, 2.0 * scale}, {{0.0, -1e-3}, 1.0, 3.0 * scale}});
    OneBed bed(BedMaterial(mu).with_presliding(1e-4), shape, with_load(load));
    for (int k = 0; k < 40; ++k) bed.step(1e-5);
    INFO("scale " << scale);
    CHECK(bed.out.force[0] == Approx(-mu * load).epsilon(1e-6));
    // The torque about the centre is the sum of -y Fx: only the third bristle has a y.
    CHECK(bed.out.torque == Approx(-1e-3 * mu * load * 3.0 / 6.0).epsilon(1e-5));
  }
}

TEST_CASE("Beds refuse what contradicts itself or is out of range, and name it") {
  BedBatch batch;
  const BedMaterial good = BedMaterial(0.5).with_presliding(1e-4);
  const BedShape disc = BedShape::disc(1e-3, BedPressure::hertz);
  const auto text = [&](const BedMaterial& material, const BedShape& shape, const BedOptions& options = {}) {
    return message_of([&] { batch.add(material, shape, options); });
  };
  using Catch::Contains;
  CHECK_THAT(text(BedMaterial(0.5), disc), Contains("no elasticity"));
  CHECK_THAT(text(BedMaterial(0.5).with_presliding(1e-4).with_elastic(1e9, 0.3), disc),
             Contains("more than one"));
  CHECK_THAT(text(BedMaterial(0.4, 0.5).with_presliding(1e-4), disc), Contains("static_friction"));
  CHECK_THAT(text(BedMaterial(0.5, 0.0).with_presliding(1e-4), disc), Contains("kinetic_friction"));
  CHECK_THAT(text(BedMaterial(0.5).with_slip_stiffness(1e4, 1e4), disc), Contains("rolls"));
  CHECK_THAT(text(BedMaterial(0.5).with_flexibility(1e-14, 1e-14, 1e-14), BedShape::wheel_row(1.0)),
             Contains("area"));
  CHECK_THAT(text(BedMaterial(0.5).with_elastic(1e9, 0.3, 0.01), disc), Contains("radius"));
  CHECK_THAT(text(good, BedShape::sphere_row()), Contains("half width"));
  CHECK_THAT(text(good, BedShape::sphere_row(1, 1e-3)), Contains("cells"));
  CHECK_THAT(text(good, BedShape::disc(-1.0, BedPressure::hertz)), Contains("half[0]"));
  CHECK_THAT(text(good, BedShape::from_list({})), Contains("list"));
  CHECK_THAT(text(good, BedShape::from_list({{{0, 0}, 1, 0}})), Contains("load"));
  CHECK_THAT(text(good, BedShape::from_list({{{0, NAN}, 1, 1}})), Contains("position"));
  CHECK_THAT(text(good, disc, with_load(0.0)), Contains("max_normal_load"));
  CHECK_THAT(text(good, disc, with_load(1.0, true, 0.0)), Contains("longest_piece"));
  CHECK_THAT(text(good, BedShape::disc(1e-3, BedPressure::hertz).grown(BedGrowth::square_root)),
             Contains("root"));
  CHECK(batch.bed_count() == 0);

  OneBed bed(good, disc, with_load(1.0));
  bed.motion.normal_load = 2.0;
  for (int i = 0; i < 100; ++i) bed.step(1e-5);
  CHECK(bed.out.status == Status::overload);
  CHECK(-bed.out.force[0] == Approx(1.0).epsilon(1e-4));
  OneBed wheel(good, BedShape::wheel_row(0.1), with_load(1.0));
  wheel.motion.rolled[1] = 1e-3;
  CHECK(wheel.step(0.0).status == Status::bad_input);
  const BedId id = bed.motion.id;
  bed.batch.remove(id);
  CHECK_THROWS_AS(bed.batch.remove(id), Error);
  CHECK(bed.batch.add(good, disc) != id);
  CHECK(bed.step(0.0).status == Status::unknown_id);
}

TEST_CASE("Tiny motions of a bed add up, rolling as well as sliding") {
  OneBed fine(BedMaterial(0.5).with_presliding(1e-3), BedShape::wheel_row(0.1), with_load(1.0, false));
  OneBed coarse(BedMaterial(0.5).with_presliding(1e-3), BedShape::wheel_row(0.1), with_load(1.0, false));
  fine.step(0.0, 0.0, 0.0, 0.05);
  coarse.step(0.0, 0.0, 0.0, 0.05);
  for (int i = 0; i < 400000; ++i) fine.step(0.0, 1e-9, 0.0, 2.5e-7);
  for (int i = 0; i < 100; ++i) coarse.step(0.0, 4e-6, 0.0, 1e-3);
  CHECK(std::abs(fine.out.force[1] - coarse.out.force[1]) < 2e-3 * 0.5);
  OneBed disc(BedMaterial(0.5).with_presliding(1e-3), BedShape::disc(0.1, BedPressure::uniform),
              with_load(1.0, false));
  for (int i = 0; i < 400000; ++i) disc.step(1e-12);
  CHECK(-disc.out.force[0] == Approx(0.5 * 4e-7 / 1e-3).epsilon(1e-3));
}

TEST_CASE("Creep curves beside the program CONTACT: its simplified theory is met, its half-space stated") {
  // Example `tractcurv` of the program CONTACT. The flexibilities are those that it prints, in m^3/N.
  const double a = 6.304e-3, b = 12.61e-3, load = 106.7e3, friction = 0.33, step = a / 16.0;
  int cases = 0;
  for (const Row& row : read_table("contact_program.csv")) {
    if (row.at("example").find("tractcurv") == std::string::npos) continue;
    const bool simplified = row.at("example") == "tractcurv fastsim";
    OneBed bed(BedMaterial(friction).with_flexibility(5.491e-14, 6.773e-14, 4.526e-14),
               BedShape::ellipse(a, b, BedPressure::parabolic).rolling(48, 16), with_load(load, false));
    const double creep = number(row, "x");
    for (int i = 0; i < 60; ++i) bed.step(creep * step, 0.0, 0.0, step);
    const double ours = bed.out.force[0] / (friction * load), theirs = number(row, "value");
    std::printf("%-21s creep %.5f: force over mu N %8.5f, bed %8.5f, difference %8.5f\n",
                row.at("example").c_str(), creep, theirs, ours, ours - theirs);
    CAPTURE(row.at("example"), creep);
    // CONTACT (a program) has 48 x 44 cells of first order; theories of the half-space differ by up to 5 %.
    CHECK(std::abs(ours - theirs) < (simplified ? 0.015 : 0.05));
    ++cases;
  }
  CHECK(cases == 26);
}

TEST_CASE("From Cattaneo to Carter: the creep of a ball that begins to roll under a force, beside CONTACT") {
  // Units of this example are mm and 1e6 Pa, so that forces are in N.
  const double a = 3.5e-3, load = 0.4705, friction = 0.4013, share = 0.657, limit = friction * load;
  // Kalker's creep coefficient of a circular contact at Poisson's ratio 0.28 is 4.2.
  const double flexibility = 8.0 * a / (3.0 * 4.2 * 1e6);
  OneBed bed(BedMaterial(friction).with_flexibility(flexibility, flexibility, flexibility),
             BedShape::ellipse(a, a, BedPressure::parabolic).rolling(29, 16), with_load(load));
  // Finds by Newton's method the displacement at which the bed's force has its prescribed value.
  const auto settle = [&](double rolled) {
    double d = 0.0;
    bed.motion.rolled[0] = rolled;
    for (int i = 0; i < 40; ++i) {
      bed.motion.displacement[0] = d;
      const BedResponse trial = bed.batch.find_force(bed.motion);
      d += (share * limit + trial.force[0]) / std::max(trial.tangent[0][0], 1.0);
    }
    bed.step(d, 0.0, 0.0, rolled);
    CHECK(-bed.out.force[0] == Approx(share * limit).epsilon(1e-4));
    return d;
  };
  const double shift = settle(0.0);
  std::printf("shift at 0.657 mu N: CONTACT 0.01774, bed %.5f\n", 1e3 * shift);
  double creep = 0.0, before = 0.0, largest = 0.0;
  int cases = 0;
  for (const Row& row : read_table("contact_program.csv")) {
    if (row.at("example") != "catt_to_cart") continue;
    creep = settle(1e-3 * (number(row, "x") - before)) / (1e-3 * (number(row, "x") - before));
    before = number(row, "x");
    largest = std::max(largest, creep);
    CHECK(creep == Approx(number(row, "value")).epsilon(0.2));
    ++cases;
    if (cases % 4 == 1)
      std::printf("rolled %5.2f: creep %.3e, bed %.3e\n", before, number(row, "value"), creep);
  }
  CHECK(cases == 56);
  CHECK(creep == Approx(3.101e-3).epsilon(0.1));  // creepage in the steady state, which follows

  // Largest creepage during the transition, in which the bristles bent by the shift leave contact.
  CHECK(largest == Approx(3.403e-3).epsilon(0.12));
}

TEST_CASE("A wheel that is turned where it stands: parking torque over the steering angle, there and back") {
  // Expects that every bristle follows its own arc: T(phi) = sum of r min(k r phi, limit); Masing's rule on
  // return.
  const double a = 0.07, b = 0.08, load = 4000.0, friction = 0.9, presliding = 2e-3;
  OneBed wheel(BedMaterial(friction).with_presliding(presliding),
               BedShape::rectangle(a, b, BedPressure::parabolic).rolling(33, 12), with_load(load));
  const int n = 400;
  const auto torque = [&](double angle) {
    double sum = 0.0;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        const double u = (2.0 * i + 1.0) / n - 1.0, v = (2.0 * j + 1.0) / n - 1.0;
        const double r = std::hypot(a * u, b * v), pressure = 1.5 * (1.0 - u * u);
        // Sums torque over points: a bristle slides once its displacement exceeds `presliding` times the
        // local pressure over the largest pressure.
        sum += r * friction * load * std::min(1.5 * r * angle / presliding, pressure) / (n * n);
      }
    return sum;
  };
  const double most = torque(1.0);
  double angle = 0.0;
  for (int i = 0; i < 60; ++i) {
    wheel.step(0.0, 0.0, 1e-3);
    angle += 1e-3;
    CHECK(std::abs(-wheel.out.torque - torque(angle)) < 0.01 * most);
  }
  CHECK(-wheel.out.torque > 0.9 * most);
  const double turned = torque(angle);
  for (double back = 1e-3; back < 0.1; back += 1e-3) {
    wheel.step(0.0, 0.0, -1e-3);
    CHECK(std::abs(-wheel.out.torque - (turned - 2.0 * torque(0.5 * back))) < 0.02 * most);
  }
  CHECK(std::hypot(wheel.out.force[0], wheel.out.force[1]) < 1e-3 * friction * load);
}

TEST_CASE("A wheel locked and spun slides at its friction, against the slip") {
  const double load = 4000.0, friction = 0.9;
  const BedMaterial material = BedMaterial(friction).with_slip_stiffness(8e4, 8e4);
  OneBed locked(material, BedShape::wheel_row(0.07), with_load(load));
  for (int i = 0; i < 50; ++i) locked.step(0.01, 0.002);
  CHECK(std::hypot(locked.out.force[0], locked.out.force[1]) == Approx(friction * load).epsilon(1e-4));
  CHECK(locked.out.force[1] / locked.out.force[0] == Approx(0.2).epsilon(1e-3));
  CHECK(locked.out.slipping_share == Approx(1.0).epsilon(1e-6));
  OneBed spun(material, BedShape::wheel_row(0.07), with_load(load));
  for (int i = 0; i < 50; ++i) spun.step(-0.01, 0.0, 0.0, 0.01);
  CHECK(spun.out.force[0] == Approx(friction * load).epsilon(1e-3));
}

TEST_CASE("A bed that was dragged far keeps its force in the next small step") {
  for (const bool all : {true, false})
    for (const Kind& kind : all_kinds())
      for (const double far : {2e-3, 0.3, 1e5}) {
        INFO(kind.name << (all ? ", all outputs, " : ", end only, ") << far << " m");
        OneBed bed(kind.material, kind.shape, with_load(5.0, all));
        if (kind.shape.rolls) bed.step(1e-6, 0.0, 0.0, 0.3 * kind.shape.half[0]);
        const double stored = bed.out.stored;
        bed.step(0.6 * far, -0.8 * far);
        const double work = (0.8 * bed.out.mean[1] - 0.6 * bed.out.mean[0]) * far;
        if (kind.material.slip_stiffness[0] == kind.material.slip_stiffness[1])
          CHECK(work == Approx(bed.out.dissipated + bed.out.stored - stored).epsilon(2e-5));
        const double limit = kind.material.kinetic_friction * 5.0;
        const double force[2] = {bed.out.force[0], bed.out.force[1]};
        CHECK(std::hypot(force[0], force[1]) == Approx(limit).epsilon(1e-5));
        bed.step(1e-12);
        for (int k = 0; k < 2; ++k) CHECK(std::abs(bed.out.force[k] - force[k]) < 1e-5 * limit);
      }
  // Load so small that the motion is 1e23 times the limit of the deflections.
  OneBed light(BedMaterial(0.5).with_presliding(1e-12), BedShape::disc(1e-3, BedPressure::uniform),
               with_load(1.0, false), 1e-6);
  light.step(1e5);
  CHECK(light.out.force[0] == Approx(-0.5e-6).epsilon(1e-5));
}

TEST_CASE("Beds by key: a contact keeps its bed while it is seen, and a new one gets a fresh bed") {
  BedBatch batch;
  const BedMaterial material = BedMaterial(0.5).with_presliding(1e-4);
  const BedShape shape = BedShape::disc(1e-3, BedPressure::hertz, 2, 6);
  KeyedBeds keyed(batch, material, shape, with_load(2.0), KeyedOptions{}.with_capacity(2));
  CHECK(batch.bed_count() == 2);
  const auto push = [&](std::uint64_t key, double distance) {
    const BedMotion motion{keyed.find_or_add(key), {distance, 0.0}, 0.0, {0.0, 0.0}, 2.0};
    BedResponse out;
    batch.step({&motion, 1}, {&out, 1});
    return out;
  };
  const BedId first = push(7, 3e-5).id;
  CHECK(keyed.end_step() == 0);
  const BedResponse on = push(7, 0.0), other = push(9, 0.0);
  CHECK(on.id == first);
  CHECK(on.force[0] < 0.0);
  CHECK(other.force[0] == 0.0);
  CHECK(push(11, 0.0).status == Status::no_capacity);
  CHECK(keyed.refused() == 1);
  CHECK(keyed.end_step() == 0);
  CHECK(push(9, 2e-5).force[0] < 0.0);
  std::vector<std::byte> keys(keyed.state_size()), state(batch.state_size());
  REQUIRE(keyed.save_state({keys.data(), keys.size()}) == keys.size());
  batch.save_state({state.data(), state.size()});
  CHECK(keyed.end_step() == 1);  // key 7 was not requested in this step, so its bed is lost
  CHECK(keyed.size() == 1);
  CHECK_FALSE(static_cast<bool>(keyed.find(7)));
  // Checks that the bed of the lost contact serves the new one with straight bristles.
  CHECK(push(12, 0.0).id == first);
  CHECK(batch.info(first).normal_load == 2.0);
  CHECK(push(12, 0.0).force[0] == 0.0);
  batch.restore_state({state.data(), state.size()});
  keyed.restore_state(keys);
  CHECK(keyed.find(7) == first);
  CHECK(push(7, 0.0).force[0] == on.force[0]);
  keys[20] ^= std::byte{1};
  CHECK_THROWS_WITH(keyed.restore_state(keys), Catch::Contains("KeyedBeds"));
  CHECK(keyed.remove(7));
  CHECK_FALSE(keyed.remove(7));
  keyed.clear();
  CHECK(keyed.size() == 0);
  { const KeyedBeds gone = std::move(keyed); }
  CHECK(batch.bed_count() == 0);
  CHECK_THROWS_AS(KeyedBeds(batch, BedMaterial(0.5), shape, with_load(2.0)), Error);
  CHECK(batch.bed_count() == 0);
}

TEST_CASE("The C interface finds beds by key, and refuses in words", "[c]") {
  bristle_bed bed;
  REQUIRE(bristle_init_bed(&bed, sizeof bed) == BRISTLE_OK);
  bed.static_friction = bed.kinetic_friction = 0.9;
  bed.slip_stiffness[0] = bed.slip_stiffness[1] = 9e4;
  bed.kind = BRISTLE_BED_RECTANGLE;
  bed.half[0] = bed.half[1] = 0.1;
  bed.cells[0] = bed.cells[1] = 3;
  bed.max_normal_load = 4000.0;
  bristle_beds* beds = nullptr;
  REQUIRE(bristle_beds_create(nullptr, &beds) == BRISTLE_OK);
  bristle_id id = 0;
  // Checks that the bed is refused, because it has a slip stiffness but `rolls` is not set.
  CHECK(bristle_beds_add(beds, &bed, &id) == BRISTLE_REFUSED);
  CHECK(std::string(bristle_last_error()).find("roll") != std::string::npos);
  bed.rolls = 1;
  REQUIRE(bristle_beds_add(beds, &bed, &id) == BRISTLE_OK);
  CHECK(bristle_beds_restore_state(beds, &bed, 3) == BRISTLE_REFUSED);
  CHECK(bristle_beds_reset(beds, 5) == 0);
  bristle_keyed* keyed = nullptr;
  const std::uint64_t keys[2] = {3, 4};
  bristle_id ids[2] = {}, again[2] = {};
  REQUIRE(bristle_keyed_create_beds(beds, &bed, nullptr, &keyed) == BRISTLE_OK);
  REQUIRE(bristle_keyed_find_or_add(keyed, keys, ids, 2) == BRISTLE_OK);
  CHECK(bristle_keyed_end_step(keyed) == 0);
  CHECK(bristle_keyed_find(keyed, keys, again, 2) == BRISTLE_OK);
  CHECK((again[0] == ids[0] && again[1] == ids[1] && ids[0] != ids[1] && ids[0] != 0));
  CHECK(bristle_keyed_size(keyed) == 2);
  bristle_keyed_destroy(keyed);
  CHECK(bristle_keyed_create_beds(nullptr, &bed, nullptr, &keyed) == BRISTLE_BAD_ARGUMENT);
  CHECK(bristle_beds_step(nullptr, nullptr, nullptr, 0, nullptr) == BRISTLE_BAD_ARGUMENT);
  CHECK(bristle_beds_remove(beds, id) == BRISTLE_OK);
  CHECK(bristle_beds_remove(beds, id) == BRISTLE_REFUSED);
  bristle_beds_destroy(beds);
  bristle_beds_destroy(nullptr);
}

}  // namespace bristle_test::test_beds
