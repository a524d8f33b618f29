// The infinite brush whose bristles grow stronger while they hold: against the reference tables, quadrature,
// and brute force in small steps. Also that an age does not depend on how a motion is cut into steps, which
// patches a step names, trials, and copies.
#include <catch2/catch.hpp>

#include <array>
#include <cmath>
#include <initializer_list>
#include <map>
#include <string>
#include <vector>

#include "brute_rubbing.hpp"
#include "expect.hpp"
#include "infinite_brush.hpp"
#include "reference_table.hpp"

namespace bristle_test::test_cohort_ageing {

using bristle::Ageing;

namespace {

constexpr double tau = 1.0;  ///< s

// --------------------------------------------------------------------- a patch that ages, in reduced units

/// A patch that moves along (0.6, 0.8), in reduced units: mean snap lengths, s, forces over load.
struct AgedBrush : Brush {
  using Brush::Brush;

  double step(double length, double seconds) { return step(0.6 * length, 0.8 * length, seconds); }
  double step(double dx, double dy, double seconds) {
    Brush::step(dx, dy, seconds);
    return force();
  }
  /// Slides the patch in steps of `piece` mean snap lengths, at a constant speed.
  double slide(double length, double speed, double piece = 0.1) {
    const int n = static_cast<int>(std::ceil(length / piece - 1e-9));
    for (int i = 0; i < n; ++i) step(length / n, length / n / speed);
    return force();
  }
  void hold(double seconds) { step(0.0, 0.0, seconds); }
  double force() const { return 0.6 * x() + 0.8 * y(); }
};

Material aged(const SnapLength& law, const Ageing& ageing) {
  return plain_material(law, SnapRule::redraw).with_ageing(ageing);
}
Material aged(const SnapLength& law, double beta) { return aged(law, Ageing::logarithmic(beta, tau)); }

/// Returns the growth g of a snap length at an age, written independently of the library.
double growth(const Ageing& a, double age) {
  if (a.form == bristle::AgeingForm::saturating) return 1.0 + a.strength * (1.0 - std::exp(-age / a.time));
  return 1.0 + a.strength * std::log1p(age / a.time);
}

// ------------------------------------------------------- comparison with the reference tables of tests/data

AgedBrush brush_of(const Row& row, double resolution) {
  return AgedBrush(aged(reference_law(row.at("dist")), number(row, "beta")), infinite_options(resolution));
}

/// Largest error for each law, by its name, at one resolution.
using Errors = std::map<std::string, double>;
void note(Errors& errors, const Row& row, double error) {
  double& largest = errors[row.at("dist")];
  largest = std::max(largest, std::abs(error));
}

/// Returns the errors of steady sliding, by law: in small steps, and after one step of 1000 mean lengths.
Errors steady_errors(double resolution) {
  Errors errors;
  for (const Row& row : read_table("ageing_steady.csv")) {
    if (row.at("variant") != "redraw") continue;
    const double speed = number(row, "v_tau_over_dbar");
    const double expected = number(row, "f_kinetic_ref");
    AgedBrush brush = brush_of(row, resolution);
    brush.slide(24.0, speed, 0.2);
    for (int i = 0; i < 4; ++i) note(errors, row, brush.slide(0.1137, speed, 0.1137) / expected - 1.0);
    note(errors, row, brush.step(1000.0, 1000.0 / speed) / expected - 1.0);
    note(errors, row, brush.slide(1.0, speed) / expected - 1.0);
  }
  return errors;
}

/// Returns the relative errors of the peak force after a hold, by law. `brief`: only rows with a hold of tau,
/// which the table has to 1.4e-3 only.
Errors hold_errors(double resolution, bool brief) {
  Errors errors;
  for (const Row& row : read_table("ageing_hold.csv")) {
    const double hold = number(row, "hold_over_tau");
    if (hold == 0.0 || (hold == 1.0) != brief) continue;
    const double speed = number(row, "v_tau_over_dbar");
    AgedBrush brush = brush_of(row, resolution);
    brush.slide(16.0, speed, 0.2);
    brush.hold(hold * tau);
    double peak = 0.0;
    double x = 0.0;
    const double beyond = 1.15 * number(row, "x_peak_over_dbar") + 0.03;
    for (const double step = 1.0 / 256; x < beyond; x += step)
      peak = std::max(peak, brush.step(step, step / speed));
    note(errors, row, peak / number(row, "kinetic") / number(row, "peak_over_kinetic") - 1.0);
  }
  return errors;
}

Errors speed_jump_errors(double resolution) {
  Errors errors;
  const std::vector<Row> rows = read_table("ageing_velocity_step.csv");
  for (std::size_t i = 0; i < rows.size();) {
    AgedBrush brush = brush_of(rows[i], resolution);
    brush.slide(20.0, number(rows[i], "v1_tau_over_dbar"));
    double x = 0.0;
    do {
      const double to = number(rows[i], "x_after_step_over_dbar");
      if (to > x) brush.slide(to - x, number(rows[i], "v2_tau_over_dbar"));
      x = to;
      note(errors, rows[i], brush.force() - number(rows[i], "f"));
      ++i;
    } while (i < rows.size() && number(rows[i], "x_after_step_over_dbar") > 0.0);
  }
  return errors;
}

/// Returns the errors of force under a speed that swings about its mean: at the mean speed while speeding up
/// and slowing down, and of the least and the largest force.
Errors lag_errors(double resolution) {
  Errors errors;
  for (const Row& row : read_table("ageing_lag.csv")) {
    const double speed = number(row, "v0_tau_over_dbar");
    const double omega = number(row, "Omega_dbar_over_v0") * speed;
    const double period = 2.0 * M_PI / omega;
    const int steps = 2 * std::max(24, static_cast<int>(std::ceil(0.5 * period * speed / 0.1)));
    const int periods = std::max(2, static_cast<int>(std::ceil(14.0 / (speed * period))));
    const auto position = [&](double t) { return speed * (t + 0.9 / omega * (1.0 - std::cos(omega * t))); };
    AgedBrush brush = brush_of(row, resolution);
    double least = 10.0, largest = 0.0;
    for (int k = 1; k <= steps * periods; ++k) {
      const double from = period * (k - 1) / steps, to = period * k / steps;
      const double f = brush.step(position(to) - position(from), to - from);
      if (k <= steps * (periods - 1)) continue;
      least = std::min(least, f);
      largest = std::max(largest, f);
      if (2 * k == steps * (2 * periods - 1)) note(errors, row, f - number(row, "f_at_v0_decelerating"));
      if (k == steps * periods) note(errors, row, f - number(row, "f_at_v0_accelerating"));
    }
    note(errors, row, least - number(row, "f_min"));
    note(errors, row, largest - number(row, "f_max"));
  }
  return errors;
}

void require_below(const Errors& errors, double of_lognormal, double of_uniform, const char* what) {
  INFO(what << ": lognormal " << errors.at("lognormal_cv0.3") << ", uniform "
            << errors.at("uniform_0.5_1.5"));
  CHECK(errors.at("lognormal_cv0.3") < of_lognormal);
  CHECK(errors.at("uniform_0.5_1.5") < of_uniform);
}

// ---------------------------------------------------------------------------------------------- quadrature

/// Returns kinetic friction in mean snap lengths, f(v) = int r S dr / int S dr, where S is the survival
/// function at r / g(r / v).
double steady_force(const SnapLength& law, const Ageing& ageing, double speed) {
  double mass = 0.0, moment = 0.0;
  const double h = 1e-4;
  for (double r = 0.5 * h; r < 16.0; r += h) {
    const double left = law.survival(r / growth(ageing, r / speed) * dbar);
    mass += left;
    moment += left * r;
  }
  return moment / mass;
}

/// A piece of motion (slide, turn, hold or creep): displacement in mean snap lengths, duration in s.
struct Leg {
  double dx, dy, seconds;
};
const Leg journey[] = {{2.0, 0.0, 2.0},   {0.0, 0.0, 30.0},  {0.4, 0.0, 0.04},  {0.5, 0.3, 0.5},
                       {0.0, 0.0, 3.0},   {-0.6, 0.5, 0.2},  {-1.0, 0.0, 20.0}, {0.2, -0.9, 0.01},
                       {0.0, 0.0, 300.0}, {0.3, -0.3, 0.03}, {0.6, 0.4, 5.0}};

}  // namespace

TEST_CASE("An infinite brush that ages follows the tables of sliding, of jumps and of swings in speed",
          "[cohorts][ageing][physics]") {
  const double limits[3][3][2] = {{{5e-4, 4.5e-3}, {2.5e-4, 1.5e-3}, {2e-4, 2.5e-3}},
                                  {{1.2e-4, 1.2e-3}, {6e-5, 4e-4}, {6e-5, 5e-4}},
                                  {{5e-5, 3e-4}, {4e-5, 2e-4}, {5e-5, 2e-4}}};
  for (int k = 0; k < 3; ++k) {
    const double resolution = 8 << k;
    INFO("resolution " << resolution);
    require_below(steady_errors(resolution), limits[k][0][0], limits[k][0][1], "steady sliding");
    require_below(speed_jump_errors(resolution), limits[k][1][0], limits[k][1][1], "jump in speed");
    require_below(lag_errors(resolution), limits[k][2][0], limits[k][2][1], "lag");
  }
}

TEST_CASE("An infinite brush that ages has the peaks of the table after a hold",
          "[cohorts][ageing][physics]") {
  require_below(hold_errors(8.0, false), 8e-4, 2e-3, "8 pieces");
  require_below(hold_errors(16.0, false), 4e-4, 9e-4, "16 pieces");
  require_below(hold_errors(32.0, false), 2e-4, 4e-4, "32 pieces");
  require_below(hold_errors(16.0, true), 1.5e-3, 1.5e-3, "16 pieces, a hold of tau");
}

TEST_CASE("The error of an infinite brush that ages falls with the square of its resolution",
          "[cohorts][ageing][physics]") {
  // A path of slides, holds and turns in long steps that the brush cuts into pieces; each leg is made in one
  // to three steps. Under the exponential law bristles snap twice in a piece. (Lognormal 0.3 begins with so
  // small an error that its order says little.)
  for (const SnapLength& law : {uniform, SnapLength::exponential(dbar), SnapLength::lognormal(dbar, 1.0)}) {
    const auto run = [&](double resolution) {
      std::vector<double> forces;
      for (const int cuts : {1, 2, 3}) {
        AgedBrush brush(aged(law, Ageing::logarithmic(0.1, 0.1)), infinite_options(resolution));
        for (const Leg& leg : journey) {
          for (int i = 0; i < cuts; ++i) brush.step(leg.dx / cuts, leg.dy / cuts, leg.seconds / cuts);
          forces.push_back(brush.x());
          forces.push_back(brush.y());
        }
      }
      return forces;
    };
    const auto apart = [](const std::vector<double>& a, const std::vector<double>& b) {
      double sum = 0.0;
      for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
      return std::sqrt(sum / static_cast<double>(a.size()));
    };
    const std::vector<double> truth = run(64.0);
    const double coarse = apart(run(4.0), truth), fine = apart(run(32.0), truth);
    INFO(to_string(law.law()) << ": " << coarse << ", " << fine);
    CHECK(std::log2(coarse / fine) / 3.0 > 1.75);
    CHECK(fine < 3e-5);
  }
}

TEST_CASE("An infinite brush that ages follows brute force through holds and turns",
          "[cohorts][ageing][physics]") {
  const std::size_t bristles = test_size(15000);
  const double tolerance = 3.5 * 0.35 / std::sqrt(static_cast<double>(bristles)) + 2e-3;
  for (const Ageing& ageing : {Ageing::logarithmic(0.1, 0.1), Ageing::saturating(0.5, 2.0)}) {
    for (const double renewal : {0.0, 1.0}) {
      const double residual = 0.3 * renewal;
      AgedBrush brush(
          aged(lognormal, ageing).with_residual_length(residual * dbar).with_shared_renewal(renewal));
      RubbedBristles truth(bristles, lognormal_quantile(1.0, 0.3), residual, renewal, 11,
                           [&](double age) { return growth(ageing, age); });
      brush.hold(1e-3);  // a step that only brings the bristles into contact
      for (const Leg& leg : journey) {
        for (int i = 0; i < 5; ++i) brush.step(0.2 * leg.dx, 0.2 * leg.dy, 0.2 * leg.seconds);
        truth.step(leg.dx, leg.dy, 0.02, leg.seconds);
        INFO("form " << static_cast<int>(ageing.form) << ", renewal " << renewal << ", leg " << leg.dx << ", "
                     << leg.dy);
        expect_near(brush.x(), truth.x(), tolerance, "mean deflection along x");
        expect_near(brush.y(), truth.y(), tolerance, "mean deflection along y");
      }
      CHECK(brush.imbalance < 1e-12);
    }
  }
}

TEST_CASE("A brush that ages at once is one of longer snap lengths", "[cohorts][ageing][physics]") {
  // Lets ageing saturate at once, with g = 2, so that bristles must behave as if twice as long, also those
  // that snap twice within one piece of a step.
  const Ageing at_once = Ageing::saturating(1.0, bristle::shortest_ageing_time);
  const SnapLength short_laws[] = {SnapLength::exponential(dbar), SnapLength::lognormal(dbar, 1.0),
                                   lognormal};
  const SnapLength long_laws[] = {SnapLength::exponential(2.0 * dbar), SnapLength::lognormal(2.0 * dbar, 1.0),
                                  SnapLength::lognormal(2.0 * dbar, 0.3)};
  for (int law = 0; law < 3; ++law) {
    for (const double renewal : {0.0, 1.0}) {
      const auto rubbed = [&](const Material& m) {
        return Material(m).with_residual_length(0.4 * renewal * dbar).with_shared_renewal(renewal);
      };
      AgedBrush brush(rubbed(aged(short_laws[law], at_once)), infinite_options(8.0));
      AgedBrush longer(rubbed(plain_material(long_laws[law], SnapRule::redraw)), infinite_options(16.0));
      for (const Leg& leg : journey) {
        for (int i = 0; i < 4; ++i) {
          // Leaves out rests, after which newborn bristles begin a cohort of their own.
          const double seconds = std::hypot(leg.dx, leg.dy) + 1e-3;
          brush.step(0.5 * leg.dx, 0.5 * leg.dy, seconds);
          longer.step(0.5 * leg.dx, 0.5 * leg.dy, seconds);
        }
        INFO(to_string(short_laws[law].law()) << ", renewal " << renewal);
        expect_near(brush.x(), longer.x(), 5e-4, "mean deflection along x");
        expect_near(brush.y(), longer.y(), 5e-4, "mean deflection along y");
      }
    }
  }
}

TEST_CASE("A step of 1e3 to 1e5 lengths leaves the friction of its own speed", "[cohorts][ageing][physics]") {
  const Ageing ageing = Ageing::logarithmic(0.05, 1e-3);
  for (const SnapLength& law : {lognormal, uniform, SnapLength::exponential(dbar)}) {
    AgedBrush brush(aged(law, ageing));
    brush.hold(1e5);
    double speed = 3e2;
    for (const double length : {1e3, 1e4, 1e5, 3e3}) {
      speed *= 7.0;
      const double f = brush.step(length, length / speed);
      INFO(to_string(law.law()) << ", " << length << " lengths");
      CHECK(f == Approx(steady_force(law, ageing, speed)).epsilon(3.5e-3));
      // Slides on at a hundredth of the speed in short steps, because the steady state that was computed for
      // the old speed must not be used at the new one.
      CHECK(brush.slide(12.0, 0.01 * speed) ==
            Approx(steady_force(law, ageing, 0.01 * speed)).epsilon(3.5e-3));
    }
    // Work, energy lost and number of snaps of one long step must agree with the sums over small steps.
    AgedBrush far(aged(law, ageing)), near(aged(law, ageing));
    for (AgedBrush* b : {&far, &near}) b->slide(1.0, 10.0);
    far.step(60.0, 6.0);
    double mean = 0.0, snaps = 0.0, lost = 0.0;
    for (int i = 0; i < 600; ++i) {
      near.step(0.1, 0.01);
      mean += near.response.mean[0] / 600.0;
      snaps += static_cast<double>(near.response.snaps);
      lost += near.response.dissipated;
    }
    // Under the uniform law, whose survival function has corners, small steps are less accurate.
    const double limit = law.law() == bristle::SnapLaw::lognormal ? 1e-3 : 5e-3;
    CHECK(far.response.mean[0] == Approx(mean).epsilon(limit));
    CHECK(far.response.dissipated == Approx(lost).epsilon(limit));
    CHECK(static_cast<double>(far.response.snaps) == Approx(snaps).epsilon(5e-3));
    CHECK(far.imbalance < 1e-12);
  }
  // With shared renewal a long step is solved in pieces until the brush has forgotten its start.
  const Material rubbed = aged(lognormal, ageing).with_residual_length(0.1 * dbar).with_shared_renewal(1.0);
  AgedBrush far(rubbed), near(rubbed);
  far.hold(1.0);
  near.hold(1.0);
  const double f = far.step(1e4, 1e3);
  far.step(1e4, 1e3);
  near.slide(40.0, 10.0);
  double snaps = 0.0;
  for (int i = 0; i < 100; ++i) {
    // Alternates between two speeds, so that the steady state is computed in every step.
    near.step(i % 2 ? 0.11 : 0.09, 0.01);
    snaps += static_cast<double>(near.response.snaps);
  }
  CHECK(f == Approx(near.force()).epsilon(2e-3));
  CHECK(static_cast<double>(far.response.snaps) / 1e4 == Approx(snaps / 10.0).epsilon(5e-3));
  CHECK(far.imbalance < 1e-12);
}

TEST_CASE("The mean force of one long step is that of bristles which ageing has doubled",
          "[cohorts][ageing][physics]") {
  // Ageing saturates at once, so that moments of the aged length are those of a doubled one. From straight
  // bristles the path integral of the mean deflection is m2 / 2 until the first snaps, after the path m1, and
  // f = m2 / (2 m1) times the rest of the path less the renewal process's transient, m3 / (3 m1) - f^2.
  const Ageing at_once = Ageing::saturating(1.0, bristle::shortest_ageing_time);
  for (const SnapLength& law :
       {uniform, SnapLength::uniform(0.0, 2.0 * dbar), SnapLength::exponential(dbar)}) {
    const auto moment = [&](int k) { return law.moment(k) * std::pow(2.0 / dbar, k); };
    const double m1 = moment(1), m2 = moment(2), f = m2 / (2.0 * m1);
    for (const double path : {80.0, 160.0}) {
      AgedBrush brush(aged(law, at_once), infinite_options(16.0));
      brush.step(path, 0.0, 1.0);
      INFO(to_string(law.law()) << ", " << path << " lengths");
      const double integral = 0.5 * m2 + f * (path - m1) + f * f - moment(3) / (3.0 * m1);
      CHECK(-brush.response.mean[0] / (load_n * dbar) == Approx(integral / path).epsilon(2e-4));
    }
  }
}

TEST_CASE("A long step back is a slide of its own, with the friction of its speed the other way",
          "[cohorts][ageing][physics]") {
  const Ageing ageing = Ageing::logarithmic(0.05, 1e-3);
  const double speed = 2e3;
  for (const SnapLength& law : {lognormal, uniform}) {
    INFO(to_string(law.law()));
    const double f = steady_force(law, ageing, speed);
    AgedBrush brush(aged(law, ageing));
    brush.hold(1.0);
    for (const double length : {1e3, -60.0, -1e3, 60.0})
      CHECK(brush.step(length, std::abs(length) / speed) == Approx(std::copysign(f, length)).epsilon(3.5e-3));
    CHECK(brush.imbalance < 1e-12);
  }
}

TEST_CASE("A patch that nobody names ages by the clock of its batch", "[cohorts][ageing]") {
  // Lets three patches rest: one in the motions of every step of the rest, one in the last, one in none.
  const Material material = aged(lognormal, 0.1);
  PatchBatch batch;
  const std::vector<PatchId> ids = add_patches(batch, 3, material, infinite_options());
  const auto move = [&](std::initializer_list<int> who, double length, double seconds) {
    std::vector<Motion> in;
    for (int i : who) {
      Motion m{ids[static_cast<std::size_t>(i)], {length * dbar, 0.0}, load_n};
      in.push_back(m);
    }
    std::vector<Response> out(in.size());
    batch.step(seconds, in, out);
    return out;
  };
  for (int i = 0; i < 50; ++i) move({0, 1, 2}, 0.1, 0.1);
  for (int i = 0; i < 99; ++i) move({0}, 0.0, 0.5);
  move({0, 1}, 0.0, 0.5);
  const std::vector<Response> out = move({0, 1, 2}, 0.15, 0.15);
  for (int i : {1, 2}) CHECK(out[static_cast<std::size_t>(i)].end[0] == out[0].end[0]);
  for (int i : {1, 2}) CHECK(batch.state_hash(ids[static_cast<std::size_t>(i)]) == batch.state_hash(ids[0]));
  // Checks that a patch that moved instead of resting has aged less and is weaker.
  AgedBrush restless(material);
  for (int i = 0; i < 51; ++i) restless.step(0.1, 0.0, 0.1);
  restless.step(0.05, 0.0, 0.05);
  CHECK(-out[0].end[0] / (load_n * dbar) > restless.x() + 0.02);
}

TEST_CASE("What an infinite brush that ages is does not depend on when it was made", "[cohorts][ageing]") {
  PatchBatch batch;
  const Material material = aged(lognormal, Ageing::logarithmic(0.05, 1e-6));
  const auto live = [&](PatchId id) {
    std::vector<std::uint64_t> hashes;
    for (int i = 0; i < 40; ++i) {
      step_one(
          batch,
          Motion{id, {(i % 7 == 0 ? 0.0 : i % 3 - 1.0) * 0.7 * dbar, 0.0}, load_n * (i % 5 == 0 ? 0.7 : 1.0)},
          1e-3 * (i % 4 + 1));
      hashes.push_back(batch.state_hash(id));
    }
    return hashes;
  };
  const PatchId first = batch.add(material, infinite_options());
  // Patch that stays out of contact while the other patch is stepped and rests; its state must not change.
  const PatchId idle = batch.add(material, infinite_options());
  const std::vector<std::uint64_t> hashes = live(first);
  for (int i = 0; i < 10; ++i) batch.step(3e4, {}, {});
  CHECK(live(batch.add(material, infinite_options())) == hashes);
  CHECK(live(idle) == hashes);
  batch.reset(first);
  CHECK(live(first) == hashes);
}

TEST_CASE("Ages keep their digits after a million seconds", "[cohorts][ageing]") {
  // Bristles reach an age of 1e12 tau (tau = 1 us), until a slide of 5,000 mean lengths replaces them all.
  const Material material = aged(lognormal, Ageing::logarithmic(0.1, 1e-6));
  AgedBrush old(material), young(material);
  for (int i = 0; i < 20; ++i) {
    old.step(0.13, 0.05, 1e-5);
    old.hold(5e4);
  }
  for (AgedBrush* b : {&old, &young}) {
    b->step(5000.0, 5000.0 / 1e5);
    b->hold(1e-5);
    b->slide(0.4, 1e5, 0.05);
  }
  // Times of births are doubles, which keep 1e-10 s after a million seconds: 1e-4 of this ageing time.
  CHECK(old.force() == Approx(young.force()).margin(1e-4));
  CHECK(old.force() > 1.05 * young.slide(5.0, 1e5));
}

TEST_CASE("Bristles that come into contact are young, and leave first", "[cohorts][ageing][load]") {
  // Without shared renewal bristles are independent, so a patch of which half rested and half entered contact
  // afterwards must equal two patches.
  const Material material = aged(lognormal, 0.1);
  AgedBrush both(material), rested(material), fresh(material);
  for (AgedBrush* b : {&both, &rested, &fresh}) b->load = 0.5 * load_n;
  both.hold(1e4);
  rested.hold(1e4);
  both.load = load_n;
  fresh.hold(1e-3);
  both.hold(1e-3);
  rested.hold(1e-3);
  for (int i = 0; i < 60; ++i) {
    for (AgedBrush* b : {&both, &rested, &fresh}) b->step(0.05, 0.05);
    expect_near(both.force(), 0.5 * (rested.force() + fresh.force()), 1e-3, "mean deflection");
    if (i != 24) continue;
    // After 1.25 mean lengths many bristles of `fresh` (no rest) have snapped, but few of
    // `rested`.
    CHECK(rested.force() > 1.3 * fresh.force());
    AgedBrush less(material), same(material);
    for (AgedBrush* b : {&less, &same}) {
      b->load = 0.5 * load_n;
      b->hold(1e4);
    }
    less.load = load_n;
    less.hold(1e-3);
    less.load = 0.5 * load_n;
    less.slide(1.25, 1.0);
    same.hold(1e-3);
    same.slide(1.25, 1.0);
    CHECK(less.force() == Approx(same.force()).margin(1e-9));
  }
  CHECK(both.imbalance < 1e-12);
}

TEST_CASE("Ageing of an infinite brush is switched on, off and over live", "[cohorts][ageing][material]") {
  const Material plain = plain_material(lognormal, SnapRule::redraw);
  const Material strong = aged(lognormal, 0.1);
  // Switches ageing off. Bristles that held only by their age slip at once; then the patch must slide as one
  // that never aged.
  AgedBrush brush(strong);
  brush.slide(10.0, 1.0);
  brush.hold(1e4);
  brush.slide(0.5, 1.0);
  const double before = brush.force();
  const double stored = brush.patch.energy();
  brush.patch.batch.set_material(brush.patch.id, plain);
  brush.hold(1.0);
  CHECK(before > 0.95);
  CHECK(brush.force() < 0.8 * before);
  CHECK(brush.response.snaps > 100);
  CHECK(brush.response.dissipated > 0.0);
  CHECK(brush.response.dissipated + brush.patch.energy() == Approx(stored).epsilon(1e-9));
  CHECK(brush.slide(16.0, 1.0) == Approx(kinetic(lognormal)).margin(5e-4));
  // Switches ageing on: ages begin at the change. Nothing slips, and the resting patch grows stronger from
  // then on.
  const double same = brush.force();
  brush.hold(1e6);
  brush.patch.batch.set_material(brush.patch.id, strong);
  brush.hold(1e-9);
  CHECK(brush.force() == Approx(same).epsilon(1e-12));
  CHECK(brush.response.snaps == 0);
  AgedBrush begun(strong);
  CHECK(brush.slide(0.02, 1.0, 0.005) < same + 0.019);
  CHECK(brush.slide(16.0, 1.0) ==
        Approx(steady_force(lognormal, Ageing::logarithmic(0.1, tau), 1.0)).margin(5e-4));
  // Doubles the strength of ageing; bristles keep their ages, so they only get stronger and none slips.
  brush.hold(100.0);
  const double held = brush.force();
  brush.patch.batch.set_material(brush.patch.id, aged(lognormal, 0.2));
  brush.hold(1e-9);
  CHECK(brush.force() == Approx(held).epsilon(1e-12));
  CHECK(brush.response.snaps == 0);
  CHECK(brush.slide(20.0, 1.0) ==
        Approx(steady_force(lognormal, Ageing::logarithmic(0.2, tau), 1.0)).margin(5e-4));
}

TEST_CASE("A live change of the time of ageing alone lets slip what that time no longer holds",
          "[cohorts][ageing][material]") {
  AgedBrush brush(aged(lognormal, 0.1));
  brush.hold(1e4);
  brush.slide(1.2, 1.0);
  const double stored = brush.patch.energy();
  Material slower = aged(lognormal, 0.1);
  slower.ageing_time = 1e9;
  brush.patch.batch.set_material(brush.patch.id, slower);
  brush.hold(1e-9);
  CHECK(brush.response.snaps > 100);
  CHECK(brush.response.dissipated + brush.patch.energy() == Approx(stored).epsilon(1e-9));
}

TEST_CASE("Lengths that are shown have grown with age", "[cohorts][ageing]") {
  AgedBrush brush(aged(lognormal, 0.1));
  brush.step(0.4, 0.0, 0.4);
  const double before = read(brush.patch, 1).delta[0];
  // All that is known of a cohort's bristles is that their lengths exceed the deflection, which is shown.
  CHECK(before == Approx(0.4 * dbar).epsilon(1e-6));
  brush.hold(99.6);
  CHECK(read(brush.patch, 1).delta[0] ==
        Approx(before * (1.0 + 0.1 * std::log(101.0)) / (1.0 + 0.1 * std::log(1.4))).epsilon(1e-9));
}

TEST_CASE("Cohorts that a falling load empties take no age from those that stay", "[cohorts][ageing][load]") {
  // Layers of bristles differ in age and position. Each bristle left after the load falls must equal one from
  // before the fall, in deflection and in aged length (length x g).
  const Material material = aged(lognormal, 0.3);
  constexpr std::size_t shown = 20000;
  const auto bristles_of = [&](const AgedBrush& b) { return read(b.patch, shown); };
  for (const double kept : {0.3, 0.5, 0.75, 0.9}) {
    AgedBrush brush(material);
    double load = 0.2;
    for (int k = 0; k < 8; ++k) {
      brush.load = load * load_n;
      load = std::min(load + 0.1, 1.0);
      brush.hold(std::pow(10.0, 3.0 - k));
      brush.slide(0.25, 100.0, 0.05);
    }
    const Bristles before = bristles_of(brush);
    brush.load = kept * load_n * brush.load / load_n;
    brush.step(0.0, 0.0, 1e-12);
    const Bristles after = bristles_of(brush);
    double farthest = 0.0;
    for (std::size_t i = 0; i < shown; i += 37) {
      double nearest = 1e300;
      for (std::size_t j = 0; j < shown; ++j)
        nearest = std::min(nearest,
                           std::abs(after.zx[i] - before.zx[j]) + std::abs(after.delta[i] - before.delta[j]));
      farthest = std::max(farthest, nearest / dbar);
    }
    INFO("share of the load " << kept);
    CHECK(farthest < 1e-6);
  }
}

TEST_CASE("Steps after a rest do not feel the base from which ages count", "[cohorts][ageing]") {
  // The time from which ages are counted moves on once 2^20 ageing times have passed since contact. Rests
  // just below and just above that must give equal forces.
  constexpr double time = 1e-3, speed = 1e5;
  const Material material = aged(lognormal, Ageing::logarithmic(1.0, time));
  for (const double long_step : {0.0, 4.0, 10.0, 15.0, 20.0, 30.0, 60.0}) {
    double force[2];
    for (const int longer : {0, 1}) {
      AgedBrush brush(material);
      brush.hold(0x1p20 * time * (longer ? 1.001 : 0.999));
      brush.slide(0.1, speed, 0.05);
      brush.step(9.0, 9.0 / speed);  // a step in which the weakest bristles snap
      if (long_step > 0.0) brush.step(long_step, long_step / speed);
      force[longer] = brush.slide(0.2, speed, 0.05);
    }
    // Snap lengths have grown fifteenfold; the growth after the two rests differs by ln(1.001 / 0.999).
    INFO("a step of " << long_step);
    CHECK(force[1] == Approx(force[0]).epsilon(2e-3));
  }
}

}  // namespace bristle_test::test_cohort_ageing
