// Patches with a lay (struct Lay): closed forms, normality and brute force, energy, refused lays.
#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <random>

#include <bristle/bristle.h>

#include "core/materials/strata.hpp"
#include "expect.hpp"
#include "scenes.hpp"

namespace bristle_test::test_lay {

using bristle::Ageing;
using bristle::Lay;
using bristle::Population;

namespace {

/// Load, N: with plain_material three bristles of 1 N/m, so that the kinetic friction is 3 dbar newtons
constexpr double load = 3.0;
const SnapLength law = SnapLength::lognormal(dbar, 0.3);

struct Kind {
  std::string name;
  Material material;
  PatchOptions options;
};

PatchOptions counted(std::uint32_t bristles, Precision precision) {
  return plain_options(bristles, 2, precision).with_max_normal_load(load);
}

Kind sliding(Precision precision, double drop = 0.0) {
  return {"slide", plain_material(law, SnapRule::slide).with_drop(drop), counted(32, precision)};
}

/// Returns patches of every rule and population that accept different friction along and across the lay.
std::vector<Kind> kinds() {
  const Material redraw = plain_material(law, SnapRule::redraw), keep = plain_material(law, SnapRule::keep);
  const Material rubbed = Material(redraw).with_residual_length(0.4 * dbar).with_shared_renewal(1.0);
  const Material aged = Material(rubbed).with_ageing(Ageing::logarithmic(0.05, 1e-4));
  const PatchOptions endless =
      plain_options(1).with_max_normal_load(load).with_bristles(0).with_population(Population::infinite);
  std::vector<Kind> all = {{"infinite", redraw, endless},
                           {"infinite, rubbed", rubbed, endless},
                           {"infinite, aged", aged, endless}};
  for (const Precision precision : precisions()) {
    const std::string name = std::string(", ") + name_of(precision);
    all.push_back({"redraw" + name, redraw, counted(200, precision)});
    all.push_back({"rubbed" + name, rubbed, counted(200, precision)});
    all.push_back({"aged" + name, aged, counted(200, precision)});
    all.push_back({"keep" + name, keep, counted(200, precision)});
    all.push_back(sliding(precision));
    all.push_back(sliding(precision, 0.3));
  }
  return all;
}

/// Returns motions along a winding path under a varying load, in the axes of the patch.
struct Winding {
  std::mt19937 random{7};
  double angle = 0.4;
  Motion next(PatchId id, double length = 0.3 * dbar, bool wavers = true) {
    std::uniform_real_distribution<double> flat(-1.0, 1.0);
    angle += random() % 30 == 0 ? 3.0 * flat(random) : 0.2 * flat(random);
    const double h = length * (1.0 + flat(random)), share = 0.7 + 0.3 * flat(random);
    return {id, {h * std::cos(angle), h * std::sin(angle)}, load * (wavers ? share : 1.0)};
  }
};

Motion moved(PatchId id, double x, double y) { return {id, {x, y}, load}; }

/// Returns a motion with its displacement turned by `angle` rad.
Motion turned(Motion motion, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  const double x = motion.displacement[0], y = motion.displacement[1];
  motion.displacement[0] = c * x - s * y;
  motion.displacement[1] = s * x + c * y;
  return motion;
}

/// Returns the force that bends the bristles, opposite to friction, over the kinetic friction at `share` of
/// the load.
std::array<double, 2> pull(const Response& out, double share = 1.0) {
  return {-out.elastic[0] / (share * load * dbar), -out.elastic[1] / (share * load * dbar)};
}

double work_on(const Motion& motion, const Response& out) {
  return -out.mean[0] * motion.displacement[0] - out.mean[1] * motion.displacement[1];
}

/// Returns the friction against sliding along e, at `angle`: the largest F . e over the forces F of a limit
/// curve, an ellipse with half axes 1 along and `ratio` across and its centre at (lean, 0).
double highest_loss(double ratio, double lean, double angle) {
  return lean * std::cos(angle) + std::hypot(std::cos(angle), ratio * std::sin(angle));
}

double lean_of(double to_over_fro) { return (to_over_fro - 1.0) / (to_over_fro + 1.0); }

}  // namespace

TEST_CASE("a lay of ratios 1 has the bits of none", "[lay]") {
  for (const Kind& kind : kinds())
    for (const double stiffness : {0.0, 1.0}) {
      CAPTURE(kind.name, stiffness);
      OnePatch plain(kind.material, kind.options);
      OnePatch laid(kind.material, PatchOptions(kind.options).with_lay(Lay{0.7, 1.0, stiffness, 1.0}));
      Winding path;
      for (int k = 0; k < 100; ++k) {
        const Motion motion = path.next(plain.id);
        const Response a = plain.step(motion), b = laid.step(motion);
        expect(std::memcmp(a.end, b.end, sizeof a.end) == 0 && a.dissipated == b.dissipated, "equal bits");
      }
      CHECK(plain.hash() == laid.hash());
      laid.batch.restore_state(saved_state(plain.batch));
      CHECK(plain.batch.info(plain.id).memory_bytes == laid.batch.info(laid.id).memory_bytes);
    }
}

TEST_CASE("a lay scales displacement and force across by its limit ratio", "[lay]") {
  for (const Kind& kind : kinds())
    for (const double ratio : {2.5, 0.3}) {
      CAPTURE(kind.name, ratio);
      OnePatch plain(kind.material, kind.options);
      OnePatch laid(kind.material, PatchOptions(kind.options).with_lay(Lay{}.with_limit_ratio(ratio)));
      OnePatch other(kind.material, PatchOptions(kind.options).with_lay(Lay{}.with_limit_ratio(1.1 * ratio)));
      CHECK(laid.hash() != other.hash());
      Winding path;
      for (int k = 0; k < 200; ++k) {
        const Motion motion = path.next(plain.id);
        Motion stretched = motion;
        stretched.displacement[1] = ratio * motion.displacement[1];
        const Response a = plain.step(stretched), b = laid.step(motion);
        const double most = 1e-15 * load * dbar;
        expect_near(b.elastic[0], a.elastic[0], most, "along");
        expect_near(b.elastic[1], ratio * a.elastic[1], most, "across");
        expect_near(b.mean[0], a.mean[0], most, "mean along");
        expect_near(b.mean[1], ratio * a.mean[1], most, "mean across");
        expect_near(b.dissipated, a.dissipated, 0.0, "dissipated");
        expect_near(b.force_limit, std::max(ratio, 1.0) * a.force_limit, 1e-12 * load * dbar, "force limit");
        expect_near(b.stiffness, std::max(ratio * ratio, 1.0) * a.stiffness, 1e-12 * load, "stiffness");
        expect(kind.name != "slide" || std::hypot(b.elastic[0], b.elastic[1]) <= b.force_limit * (1.0 + 1e-3),
               "no force beyond the limit");
      }
      CHECK(laid.energy() == plain.energy());
      CHECK(laid.hash() != plain.hash());
    }
}

TEST_CASE("a rotated lay with a rotated motion gives the rotated force", "[lay]") {
  std::vector<std::pair<Kind, Lay>> cases;
  for (const Kind& kind : kinds()) cases.emplace_back(kind, Lay{}.with_limit_ratio(1.8));
  cases.emplace_back(sliding(Precision::double_), Lay{0.0, 1.8, 1.3, 1.0});
  cases.emplace_back(sliding(Precision::double_), Lay{0.0, 0.6, 0.0, 3.0});
  for (auto [kind, lay] : cases) {
    if (kind.options.precision == Precision::single && kind.options.bristles > 0) continue;
    CAPTURE(kind.name);
    lay.angle = -0.4;
    OnePatch first(kind.material, PatchOptions(kind.options).with_lay(lay));
    constexpr double by = 2.1;
    lay.angle += by;
    OnePatch second(kind.material, PatchOptions(kind.options).with_lay(lay));
    Winding path;
    for (int k = 0; k < 300; ++k) {
      const Motion motion = path.next(first.id);
      const Response a = first.step(motion), b = second.step(turned(motion, by));
      const Motion force = turned(moved(first.id, a.end[0], a.end[1]), by);
      const Motion mean = turned(moved(first.id, a.mean[0], a.mean[1]), by);
      const double most = 1e-12 * load * dbar;
      for (int axis = 0; axis < 2; ++axis) {
        expect_near(b.end[axis], force.displacement[axis], most, "force");
        expect_near(b.mean[axis], mean.displacement[axis], most, "mean");
      }
      expect_near(b.dissipated, a.dissipated, 1e-12 * load * dbar * dbar, "dissipated");
    }
  }
}

TEST_CASE("the steady force of a lay dissipates most over its limit curve", "[lay]") {
  for (const double ratio : {0.4, 1.0, 3.0})
    for (const double to_over_fro : {1.0, 4.0, 0.5})
      for (const double angle : {0.0, 0.3, 1.2, M_PI / 2, 2.5, M_PI, -1.0}) {
        constexpr double of_lay = 0.8;
        CAPTURE(ratio, to_over_fro, angle);
        Kind kind = sliding(Precision::double_);
        const Lay lay = Lay{}.with_angle(of_lay).with_limit_ratio(ratio).with_to_over_fro(to_over_fro);
        OnePatch patch(kind.material, kind.options.with_lay(lay));
        const double c = std::cos(of_lay + angle), s = std::sin(of_lay + angle);
        const double far = 300.0 * dbar;
        const auto f = pull(patch.step(far * c, far * s, load));
        const double lean = lean_of(to_over_fro);
        CHECK(f[0] * c + f[1] * s == Approx(highest_loss(ratio, lean, angle)).epsilon(1e-6));
        // Checks that the force is on the limit curve, an ellipse around (lean, 0) in the axes of the lay.
        const double along = std::cos(of_lay) * f[0] + std::sin(of_lay) * f[1] - lean;
        const double across = std::cos(of_lay) * f[1] - std::sin(of_lay) * f[0];
        CHECK(std::hypot(along, across / ratio) == Approx(1.0).epsilon(1e-6));
      }
}

TEST_CASE("another stiffness ratio leaves the limit curve and moves the steady force along it", "[lay]") {
  constexpr double ratio = 2.0, stiffness = 1.5;
  Kind kind = sliding(Precision::double_);
  kind.options.with_lay(Lay{}.with_limit_ratio(ratio).with_stiffness_ratio(stiffness));
  OnePatch push(kind.material, kind.options);
  // Checks that far within the limits the force is stiffness times displacement.
  const Response held = push.step(0.03 * dbar, 0.05 * dbar, load);
  CHECK(held.elastic[0] == Approx(-load * 0.03 * dbar).epsilon(1e-9));
  CHECK(held.elastic[1] == Approx(-load * stiffness * 0.05 * dbar).epsilon(1e-9));
  CHECK(held.stiffness == Approx(load * stiffness).epsilon(1e-12));
  for (const double angle : {0.0, 0.7, M_PI / 2, 2.0}) {
    OnePatch patch(kind.material, kind.options);
    const auto f = pull(patch.step(300.0 * dbar * std::cos(angle), 300.0 * dbar * std::sin(angle), load));
    // In a long slide the deflection is parallel to the motion if each component is divided by its limit:
    // dbar along the lay, dbar ratio / stiffness across.
    const double x = std::cos(angle), y = std::sin(angle) * stiffness / ratio;
    CHECK(f[0] == Approx(x / std::hypot(x, y)).margin(1e-6));
    CHECK(f[1] == Approx(ratio * y / std::hypot(x, y)).margin(1e-6));
    CHECK(f[0] * std::cos(angle) + f[1] * std::sin(angle) <= highest_loss(ratio, 0.0, angle) + 1e-6);
  }
}

TEST_CASE("first loading to and fro of a lay that leans is the closed form", "[lay]") {
  for (const Precision precision : precisions())
    for (const int axes : {1, 2})
      for (const double to_over_fro : {3.0, 0.25})
        for (const double sign : {1.0, -1.0})
          for (const double x : {0.2, 0.8, 1.1, 3.0}) {
            Kind kind = sliding(precision);
            OnePatch patch(kind.material,
                           kind.options.with_axes(axes).with_lay(Lay{}.with_to_over_fro(to_over_fro)));
            CHECK(std::abs(pull(patch.step(0.0, 0.0, load))[0]) < 1e-7);
            const double share = 1.0 + sign * lean_of(to_over_fro);
            // Closed form E[min(x, share l)], with x the path and l the limit of a bristle, both over dbar.
            const double end = x / share * dbar;
            const double expected =
                share * (law.partial_moment(1, end) / dbar + x / share * law.survival(end));
            CHECK(pull(patch.step(sign * x * dbar, 0.0, load))[0] == Approx(sign * expected).margin(6e-4));
          }
}

namespace {

/// Independent model of bristles that slide on a surface with a lay, one by one, in tiny steps and in metres.
/// A bristle beyond its limit slips along the normal of the limit curve.
struct Brute {
  bristle::detail::Strata strata = bristle::detail::make_strata(law, 32);
  std::vector<std::array<double, 2>> z = std::vector<std::array<double, 2>>(32);
  double ratio = 1.0, lean = 0.0, dissipated = 0.0;

  void move(double dx, double dy) {
    const int steps = 1 + static_cast<int>(std::hypot(dx, dy) / 1e-4);
    const double stiff = ratio * ratio;
    for (int k = 0; k < steps; ++k)
      for (std::size_t i = 0; i < z.size(); ++i) {
        z[i][0] += dx / steps;
        z[i][1] += dy / steps;
        const double limit = strata.length[i];
        // Returns how far the force is beyond the limit curve after a slip along the normal at f.
        const auto beyond = [&](double slip) {
          const double f[2] = {z[i][0], stiff * z[i][1]};
          const double n[2] = {f[0] - lean * limit, f[1] / (ratio * ratio)};
          const double g[2] = {f[0] - slip * n[0] - lean * limit, f[1] - slip * stiff * n[1]};
          return std::hypot(g[0], g[1] / ratio) - limit;
        };
        if (!(beyond(0.0) > 0.0)) continue;
        double low = 0.0, high = 0.5;
        for (int turn = 0; turn < 50; ++turn)
          (beyond(0.5 * (low + high)) > 0.0 ? low : high) = 0.5 * (low + high);
        const double n[2] = {z[i][0] - lean * limit, stiff * z[i][1] / (ratio * ratio)};
        const double before = z[i][0] * z[i][0] + stiff * z[i][1] * z[i][1];
        for (std::size_t axis = 0; axis < 2; ++axis) z[i][axis] -= low * n[axis];
        const double after = z[i][0] * z[i][0] + stiff * z[i][1] * z[i][1];
        dissipated += strata.share[i] * 0.5 * (before - after);
      }
  }
  std::array<double, 2> pull() const {
    std::array<double, 2> sum{};
    for (std::size_t i = 0; i < z.size(); ++i) {
      sum[0] += strata.share[i] * z[i][0];
      sum[1] += strata.share[i] * ratio * ratio * z[i][1];
    }
    return sum;
  }
};

}  // namespace

TEST_CASE("bristles with a lay follow a winding path as they do in tiny steps by the normal", "[lay]") {
  for (const Lay& lay : {Lay{}.with_limit_ratio(2.0), Lay{}.with_limit_ratio(0.5).with_to_over_fro(3.0)}) {
    Kind kind = sliding(Precision::double_);
    OnePatch patch(kind.material, kind.options.with_lay(lay));
    Brute brute;
    brute.ratio = lay.limit_ratio;
    brute.lean = lean_of(lay.to_over_fro);
    Winding path;
    double dissipated = 0.0;
    for (int k = 0; k < 40; ++k) {
      const Motion motion = path.next(patch.id, 0.3 * dbar, false);
      const Response out = patch.step(motion);
      brute.move(motion.displacement[0] / dbar, motion.displacement[1] / dbar);
      const auto f = pull(out), expected = brute.pull();
      expect_near(f[0], expected[0], 5e-4, "along");
      expect_near(f[1], expected[1], 5e-4, "across");
      dissipated += out.dissipated / (load * dbar * dbar);
    }
    CHECK(dissipated > 3.0);
    CHECK(dissipated == Approx(brute.dissipated).epsilon(1e-3));
  }
}

TEST_CASE("energy of patches with a lay balances at every step, and none comes from sliding", "[lay]") {
  std::vector<std::pair<Kind, Lay>> cases;
  for (const Kind& kind : kinds()) {
    cases.emplace_back(kind, Lay{0.5, 1.8, 0.0, 1.0});
    const bool endless = kind.options.population == Population::infinite;
    if (!endless && kind.material.residual_length == 0.0)
      for (const double stiffness : {0.7, 9.0}) cases.emplace_back(kind, Lay{0.5, 1.8, stiffness, 1.0});
    if (kind.name == "slide" && kind.material.drop == 0.0)
      for (const double to_over_fro : {5.0, 0.3}) cases.emplace_back(kind, Lay{0.5, 1.8, 0.0, to_over_fro});
  }
  for (const auto& [kind, lay] : cases)
    for (const bool wavers : {false, true}) {
      CAPTURE(kind.name, lay.stiffness_ratio, lay.to_over_fro, wavers);
      OnePatch patch(kind.material, PatchOptions(kind.options).with_lay(lay));
      const bool rough = kind.options.precision == Precision::single;
      const double scale = load * dbar * dbar * (rough ? 3e-6 : 1e-12);
      Winding path;
      double stored = 0.0, dissipated = 0.0;
      for (int k = 0; k < 300; ++k) {
        const Motion motion = path.next(patch.id, 0.2 * dbar, wavers);
        const Response out = patch.step(motion);
        const double now = patch.energy();
        expect_near(work_on(motion, out), now - stored + out.dissipated + out.contact_loss, scale, "work");
        expect(out.dissipated >= 0.0, "a loss");
        dissipated += out.dissipated;
        stored = now;
      }
      CHECK(dissipated > 5.0 * load * dbar * dbar);
    }
}

TEST_CASE("the stored energy of a stuck patch with a lay is half the work of its force", "[lay]") {
  // Closed form: while nothing snaps or slides the force is linear in the displacement.
  for (const Kind& kind : kinds()) {
    const bool endless = kind.options.population == Population::infinite;
    for (const double stiffness : {0.0, 0.7, 9.0}) {
      if (stiffness != 0.0 && (endless || kind.material.residual_length != 0.0)) continue;
      for (const double angle : {0.0, 0.5, 1.9, 4.0}) {
        CAPTURE(kind.name, stiffness, angle);
        OnePatch patch(kind.material, PatchOptions(kind.options).with_lay(Lay{0.5, 1.8, stiffness, 1.0}));
        const double d[2] = {0.02 * dbar * std::cos(angle), 0.02 * dbar * std::sin(angle)};
        const Response out = patch.step(d[0], d[1], load);
        const double half_work = -0.5 * (out.end[0] * d[0] + out.end[1] * d[1]);
        CHECK(half_work > 0.0);
        CHECK(patch.energy() == Approx(half_work).epsilon(1e-5));
      }
    }
  }
}

TEST_CASE("a load that changes at rest leaves the force of a lay that leans", "[lay]") {
  Kind kind = sliding(Precision::double_);
  OnePatch patch(kind.material, kind.options.with_lay(Lay{0.3, 0.7, 0.0, 4.0}));
  patch.step(0.4 * dbar, -0.3 * dbar, 0.2 * load);
  const Response before = patch.step(0.0, 0.0, 0.2 * load);
  for (const double share : {0.21, 0.6, 1.0, 0.9}) {
    const Response out = patch.step(0.0, 0.0, share * load);
    for (int axis = 0; axis < 2; ++axis) CHECK(out.end[axis] == Approx(before.end[axis]).epsilon(1e-12));
  }
  CHECK(patch.step(0.0, 0.0, 0.0).end[0] == 0.0);
  CHECK(patch.energy() == 0.0);
  // Checks that a patch that comes into contact again has no force, whatever the lean of its limit curve.
  const Response born = patch.step(0.0, 0.0, load);
  CHECK(std::abs(born.end[0]) < 1e-14 * load * dbar);
  CHECK(std::abs(born.end[1]) < 1e-14 * load * dbar);
}

TEST_CASE("a patch with a lay is given another material at rest, and refuses a state of another lay",
          "[lay]") {
  std::vector<std::pair<Kind, Lay>> cases;
  for (const Precision precision : precisions())
    for (const double drop : {0.0, 0.3})
      cases.emplace_back(sliding(precision, drop), Lay{0.5, 1.8, 0.0, 1.0});
  cases.emplace_back(sliding(Precision::double_), Lay{0.5, 1.8, 1.2, 1.0});
  cases.emplace_back(sliding(Precision::double_), Lay{0.5, 1.8, 0.0, 3.0});
  for (const auto& [kind, lay] : cases) {
    CAPTURE(kind.name, lay.stiffness_ratio, lay.to_over_fro);
    const PatchOptions options = PatchOptions(kind.options).with_lay(lay);
    OnePatch patch(kind.material, options);
    OnePatch another(kind.material, PatchOptions(options).with_lay(Lay(lay).with_angle(0.6)));
    Winding path;
    for (int k = 0; k < 30; ++k) patch.step(path.next(patch.id));
    CHECK_THROWS_WITH(another.batch.restore_state(saved_state(patch.batch)), Catch::Contains("options"));
    CHECK(patch.batch.ages(patch.id));  // with ageing the limit at rest exceeds that of sliding

    // The force stays, and losses balance the change of stored energy.
    const Motion rest = moved(patch.id, 0.0, 0.0);
    const Response before = patch.step(rest);
    const double stored = patch.energy();
    const double few = (kind.options.precision == Precision::single ? 1e-5 : 1e-11) * load * dbar;
    patch.batch.set_material(
        patch.id, Material(kind.material).with_snap_length(SnapLength::lognormal(2.0 * dbar, 0.3)));
    const Response after = patch.step(rest);
    for (int axis = 0; axis < 2; ++axis) expect_near(after.end[axis], before.end[axis], few, "material");
    if (kind.material.drop == 0.0)
      expect_near(patch.energy() + after.dissipated + after.contact_loss, stored, few * dbar, "energy");
  }
}

TEST_CASE("bristles with a lay are read in the axes of the patch", "[lay]") {
  for (const Lay& lay : {Lay{0.5, 1.8, 0.0, 1.0}, Lay{0.5, 1.8, 0.6, 1.0}, Lay{0.5, 1.8, 0.0, 3.0}}) {
    Kind kind = sliding(Precision::double_);
    OnePatch patch(kind.material, kind.options.with_lay(lay));
    patch.step(0.05 * dbar, 0.03 * dbar, load);  // step so short that no bristle slides
    Bristles all = read(patch.batch, patch.id, 32);
    for (std::size_t i = 0; i < 32; ++i) {
      expect_near(all.zx[i], 0.05 * dbar, 1e-13 * dbar, "x");
      expect_near(all.zy[i], 0.03 * dbar, 1e-13 * dbar, "y");
    }
    CHECK(patch.batch.read_bristles(patch.id, all.zx, {}, all.delta) == 0);
    CHECK(patch.batch.read_bristles(patch.id, {}, {}, all.delta) == 32);
  }
}

TEST_CASE("an outline has the lay of the surface, however it is turned", "[lay]") {
  constexpr double ratio = 0.4, of_lay = 0.6;
  const double radius = 100.0 * dbar;
  Kind kind = sliding(Precision::double_);
  for (const double to_over_fro : {1.0, 3.0}) {
    kind.options.with_bristles(0).with_lay(Lay{of_lay, ratio, 0.0, to_over_fro});  // 32 bristles in each cell
    PatchBatch batch;
    bristle::ExtendedPatches pads(batch);
    const PatchId id =
        pads.add(kind.material, kind.options, bristle::Outline::disc(radius, bristle::Pressure::uniform, 8));
    OnePatch point(kind.material, kind.options);
    bristle::ExtendedMotion motion;
    motion.id = id;
    motion.normal_load = load;
    bristle::ExtendedResponse out;
    double stored = 0.0;
    const auto step = [&] {
      pads.step(tick, {&motion, 1}, {&out, 1});
      double work = 0.0;
      for (int i = 0; i < 3; ++i) work -= out.mean[i] * motion.displacement[i];
      const double now = pads.stored_energy(id);
      expect_near(work, now - stored + out.dissipated + out.contact_loss, 1e-11 * load * dbar * radius,
                  "work");
      stored = now;
    };
    Winding path;
    for (int k = 0; k < 20; ++k) {
      const Motion of_point = path.next(point.id, 0.4 * dbar, false);
      std::copy_n(of_point.displacement, 2, motion.displacement);
      step();
      const Response expected = point.step(of_point);
      for (int axis = 0; axis < 2; ++axis)
        expect_near(out.end[axis], expected.end[axis], 1e-11 * load * dbar, "force");
      expect_near(out.end[2], 0.0, 1e-11 * load * dbar * radius, "torque");
    }
    // In pure spin each point of the ring resists by the largest F . e for its direction of motion e (F:
    // forces of the limit curve), so the torque is the mean over all directions.
    motion.displacement[0] = motion.displacement[1] = 0.0;
    motion.displacement[2] = 0.02;
    for (int k = 0; k < 100; ++k) step();
    double mean = 0.0;
    for (int k = 0; k < 1000; ++k)
      mean += highest_loss(ratio, lean_of(to_over_fro), 2.0 * M_PI * k / 1000) / 1000;
    CHECK(-out.mean[2] / (load * dbar * radius) == Approx(2.0 / 3.0 * mean).epsilon(0.01));
  }
}

TEST_CASE("dampers know no direction, and forces at rest are those of the last step", "[lay]") {
  Kind kind = sliding(Precision::double_);
  kind.material.with_viscous_friction(0.02).with_bristle_damping(0.01);
  OnePatch patch(kind.material, kind.options.with_lay(Lay{0.9, 3.0, 0.0, 1.0}));
  const Response out = patch.step(3.0 * dbar, 4.0 * dbar, load);
  const double speed = 5.0 * dbar / tick;
  const double damping = 0.02 + load * 0.01 * std::exp(-speed / 1e-3);
  CHECK(out.damper[0] == Approx(-damping * 0.6 * speed).epsilon(1e-9));
  CHECK(out.damper[1] == Approx(-damping * 0.8 * speed).epsilon(1e-9));
  CHECK(out.damper_work == Approx(damping * speed * 5.0 * dbar).epsilon(1e-9));
  const Response rest = patch.step(0.0, 0.0, load);
  for (int axis = 0; axis < 2; ++axis) {
    CHECK(rest.end[axis] == out.elastic[axis]);
    CHECK(out.elastic[axis] != 0.0);
  }
}

TEST_CASE("a lay that a patch cannot have is refused by name", "[lay]") {
  PatchBatch batch;
  const Kind slide = sliding(Precision::single);
  const Material redraw = plain_material(law, SnapRule::redraw);
  const auto message = [&](const Material& material, const Lay& lay, PatchOptions options = {}) {
    return message_of([&] { batch.add(material, options.with_lay(lay)); });
  };
  const PatchOptions one = PatchOptions{}.with_axes(1);
  CHECK(names(message(slide.material, Lay{0, 2, 0, 1}, one), {"axes = 1"}));
  CHECK(names(message(slide.material, Lay{0.1, 1, 0, 2}, one), {"axes = 1"}));
  CHECK(message(slide.material, Lay{0, 1, 0, 2}, one) == "(no error)");
  CHECK(names(message(redraw, Lay{0, 2, 1, 1}), {"lay.stiffness_ratio = 1", "infinite"}));
  const PatchOptions some = PatchOptions{}.with_bristles(10);
  CHECK(names(message(Material(redraw).with_residual_length(1e-7), Lay{0, 2, 1, 1}, some),
              {"lay.stiffness_ratio = 1", "residual_length"}));
  CHECK(message(redraw, Lay{0, 2, 1, 1}, some) == "(no error)");
  for (const Material& material :
       {redraw, plain_material(law, SnapRule::keep), Material(slide.material).with_drop(0.1),
        Material(slide.material).with_ageing(Ageing::logarithmic(0.1, 1.0))})
    CHECK(names(message(material, Lay{0, 1, 0, 2}), {"lay.to_over_fro = 2", "SnapRule::slide"}));
  CHECK(names(message(slide.material, Lay{0, 2, 1, 2}), {"lay.to_over_fro = 2", "stiffness_ratio"}));
  const PatchId id = batch.add(slide.material, PatchOptions{}.with_lay(Lay{0, 1, 0, 2}));
  CHECK(names(message_of([&] { batch.set_material(id, Material(slide.material).with_drop(0.1)); }),
              {"lay.to_over_fro", "drop"}));
}

}  // namespace bristle_test::test_lay
