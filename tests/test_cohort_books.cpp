// Invariants of the infinite brush's cohorts under any motion: mass (number of bristles) to the last unit,
// first moment, reach (bound of deflection), order of coming into contact, energy. Reads a patch's columns.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>
#include <vector>

#include "core/materials/kernel_law.hpp"
#include "core/patches/cohorts/cohorts.hpp"
#include "core/runtime/batch_access.hpp"
#include "expect.hpp"
#include "infinite_brush.hpp"
#include "scenes.hpp"

namespace bristle_test::test_cohort_books {

using namespace bristle::detail;

namespace {

const KernelTable& table_of(const std::string& isa) {
  int count = 0;
  const KernelEntry* entries = kernel_entries(&count);
  while (isa != entries->table->name) ++entries;
  return *entries->table;
}

/// A patch in a batch, with access to the columns of its cohorts.
struct OpenBrush {
  OpenBrush(const SnapLength& law, double resolution, std::uint32_t capacity) {
    const auto material = compile_material(plain_material(law, SnapRule::redraw));
    const Patch made = make_cohorts(material, infinite_options(resolution).with_bristles(capacity),
                                    table_of(batch.isa()), material->material.bristles_in_contact(load_n));
    rows = static_cast<Cohorts*>(made.record);
    id = BatchAccess::add(batch, made);
  }
  Response step(double dx, double dy, double load) {
    return step_one(batch, Motion{id, {dx * dbar, dy * dbar}, load});
  }

  PatchBatch batch;
  PatchId id;
  const Cohorts* rows;
};

/// Mass, moments and ranks (order of entering contact) of a patch, summed over its cohorts one by one.
struct Books {
  double mass = 0.0, x = 0.0, reach = 0.0, rank = 0.0, spread = 0.0;
};
Books read_books(const CohortState& s, const double* rows) {
  Books b;
  for (std::uint32_t i = 0; i < s.count; ++i) {
    const double m = mass_of(rows, i);
    b.mass += m;
    b.x += m * entry(rows, i, cohort_x);
    b.spread += m * (std::pow(entry(rows, i, cohort_x), 2) + std::pow(entry(rows, i, cohort_y), 2));
    b.reach += m * entry(rows, i, cohort_reach);
    b.rank += m * 0.5 * (entry(rows, i, cohort_low) + entry(rows, i, cohort_high));
  }
  return b;
}

/// A random walk under random loads. Three of four steps are short. The load is kept, varied by 1 %, set at
/// random, 0, or above the highest.
struct WildPath {
  double dx = 0.0, dy = 0.0, load = load_n;
  std::mt19937_64 generator{77};
  std::uniform_real_distribution<double> flat{-1.0, 1.0};

  void next() {
    const double stroke = std::pow(10.0, 2.0 * flat(generator) - 1.0) * (flat(generator) > 0.99 ? 20.0 : 1.0);
    dx = stroke * flat(generator);
    dy = stroke * flat(generator);
    const double kind = flat(generator);
    if (kind > 0.98)
      load = 0.0;
    else if (kind > 0.9)
      load = load_n * std::pow(10.0, -3.0 + 3.5 * std::abs(flat(generator)));
    else if (kind > 0.5)
      load = std::max(0.3 * load_n, load) * (1.0 + 0.01 * flat(generator));
  }
};

/// Returns in how many steps the mass of the cohorts differed from that of the load by a unit or
/// more.
long count_mass_errors(const SnapLength& law, double resolution, std::uint32_t capacity, long steps,
                       unsigned seed, long& full) {
  OpenBrush brush(law, resolution, capacity);
  WildPath path;
  path.generator.seed(seed);
  long errors = 0;
  for (long i = 0; i < steps; ++i) {
    path.next();
    brush.step(path.dx, path.dy, path.load);
    const double wanted = std::floor(std::min(path.load / load_n, 1.0) * full_mass + 0.5);
    double mass = 0.0;
    for (std::uint32_t k = 0; k < brush.rows->count; ++k) mass += mass_of(brush.rows->rows, k);
    if (mass != wanted || brush.rows->mass != wanted) ++errors;
    if (brush.rows->count == brush.rows->capacity) ++full;
  }
  return errors;
}

}  // namespace

TEST_CASE("The mass of an infinite brush is that of its load, to the last unit, after every step",
          "[cohorts][mass]") {
  const long steps = bristle_test::test_size(250000);
  for (const SnapLength& law : {SnapLength::lognormal(dbar, 0.3), SnapLength::exponential(dbar)})
    for (std::uint32_t capacity : {8u, 24u}) {
      long full = 0;
      INFO(to_string(law.law()) << ", " << capacity << " cohorts");
      CHECK(count_mass_errors(law, 4.0, capacity, steps, capacity, full) == 0);
      CHECK(full > steps / 100);  // whether cohorts were merged, else nothing was tested
    }
}

TEST_CASE("The mass of an infinite brush after very many steps", "[.long]") {
  const char* wanted = std::getenv("BRISTLE_STEPS");
  const long steps = wanted != nullptr ? std::atol(wanted) : 100000000;
  long full = 0;
  CHECK(count_mass_errors(SnapLength::lognormal(dbar, 0.3), 4.0, 16, steps, 1, full) == 0);
  WARN(steps << " steps, full in " << full);
}

TEST_CASE("Merging keeps mass, first moment, mean reach and mean rank, and returns the energy it loses",
          "[cohorts][mass]") {
  for (const auto& isa : bristle::instruction_sets()) {
    if (!isa.usable) continue;
    const CohortKernels& kernels = *table_of(isa.name).cohorts;
    OpenBrush brush(SnapLength::lognormal(dbar, 0.3), 8.0, 24);
    WildPath path;
    int merged = 0;
    for (int i = 0; i < 2000; ++i) {
      path.next();
      brush.step(path.dx, path.dy, path.load);
      const Cohorts& r = *brush.rows;
      if (r.count < 12) continue;
      CohortState s = r;
      alignas(64) double rows[most_cohorts * cohort_columns];
      std::copy(r.rows, r.rows + r.used_numbers(), rows);
      // Places lie far within every reach (largest deflection so far), so no merged cohort is bent further
      // than its parts' mean reach R.
      double at[2] = {0.0, 0.0};
      double least_reach = 1e9, farthest = 0.0;
      for (std::uint32_t k = 0; k < s.count; ++k)
        least_reach = std::min(least_reach, entry(rows, k, cohort_reach));
      for (int axis = 0; axis < 2; ++axis) at[axis] = r.moment[axis] / r.mass;
      for (std::uint32_t k = 0; k < s.count; ++k)
        farthest = std::max(farthest,
                            std::hypot(entry(rows, k, cohort_x) - at[0], entry(rows, k, cohort_y) - at[1]));
      const bool within = farthest <= least_reach;
      const Books before = read_books(s, rows);
      const double lost = kernels.make_room[0](r.law, s, rows, at, {});
      const Books after = read_books(s, rows);
      REQUIRE(s.count < r.count);
      REQUIRE(after.mass == before.mass);
      REQUIRE(std::abs(after.x - before.x) <= 1e-12 * before.mass * (1.0 + std::abs(before.x / before.mass)));
      // The elastic energy lost by merging cohorts is the sum of mass x squared place before, less that
      // after, whatever the origin of places.
      REQUIRE(lost >= 0.0);
      // Merging an open cohort (still receiving bristles) gives up the spread of places that it stores.
      const double of_places = lost - (r.spread - s.spread);
      REQUIRE(s.spread >= 0.0);
      REQUIRE(std::abs(before.spread - after.spread - of_places) <= 1e-12 * (before.spread + r.spread));
      REQUIRE(after.reach >= before.reach * (1.0 - 1e-12));
      if (within) REQUIRE(after.reach <= before.reach * (1.0 + 1e-12));
      // Ranks (order of coming into contact) stay in [0, mass): intervals of merged cohorts are cut there,
      // which changes the mean rank a little.
      REQUIRE(std::abs(after.rank - before.rank) <= 0.03 * before.mass * r.mass);
      ++merged;
    }
    INFO(isa.name);
    CHECK(merged > 500);
  }
}

TEST_CASE("Merging keeps the mean strength of bristles of different age", "[cohorts][mass][ageing]") {
  using bristle::Ageing;
  for (const Ageing& ageing : {Ageing::logarithmic(0.1, 1e-3), Ageing::saturating(0.5, 0.1)}) {
    const Material material =
        plain_material(SnapLength::lognormal(dbar, 0.3), SnapRule::redraw).with_ageing(ageing);
    for (const auto& isa : bristle::instruction_sets()) {
      if (!isa.usable) continue;
      const CohortKernels& kernels = *table_of(isa.name).cohorts;
      OpenBrush brush(SnapLength::lognormal(dbar, 0.3), 8.0, 24);
      WildPath path;
      int merged = 0;
      for (int i = 0; i < 300; ++i) {
        path.next();
        brush.step(path.dx, path.dy, path.load);
        CohortState s = *brush.rows;
        if (s.count < 12) continue;
        alignas(64) double rows[most_cohorts * cohort_columns];
        alignas(64) double births[most_cohorts];
        std::copy(brush.rows->rows, brush.rows->rows + brush.rows->used_numbers(), rows);
        for (std::uint32_t k = 0; k < s.count; ++k) births[k] = std::pow(0.3, k % 9);
        const double at[2] = {s.moment[0] / s.mass, s.moment[1] / s.mass};
        const CohortTimes times{
            births,          1.0 + 1e-3,        0.0,
            ageing.strength, 1.0 / ageing.time, ageing.form == bristle::AgeingForm::saturating ? 1u : 0u};
        const auto strength = [&] {
          double sum = 0.0;
          for (std::uint32_t k = 0; k < s.count; ++k)
            sum += mass_of(rows, k) * material.ageing_factor(times.now - births[k]);
          return sum / s.mass;
        };
        const double before = strength();
        kernels.make_room[1](brush.rows->law, s, rows, at, times);
        REQUIRE(s.count < brush.rows->count);
        REQUIRE(strength() == Approx(before).epsilon(1e-12));
        ++merged;
      }
      INFO(isa.name);
      CHECK(merged > 100);
    }
  }
}

TEST_CASE("The sum of deflections that an infinite brush carries is that of its cohorts", "[cohorts][mass]") {
  OpenBrush brush(SnapLength::lognormal(dbar, 0.3), 4.0, 16);
  WildPath path;
  double worst = 0.0;
  for (int i = 0; i < 20000; ++i) {
    path.next();
    brush.step(path.dx, path.dy, path.load);
    const Cohorts& r = *brush.rows;
    const Books b = read_books(r, r.rows);
    worst = std::max(worst, std::abs(r.moment[0] - b.x) / (full_mass * 16.0));
  }
  CHECK(worst < 1e-13);
}

TEST_CASE("Bristles that came into contact last leave an infinite brush first", "[cohorts][mass][load]") {
  OpenBrush brush(SnapLength::lognormal(dbar, 0.3), 8.0, 48);
  // Shares of the load: 0.6 is bent by 0.2 mean lengths, 0.3 by 0.1, and 0.1 is straight; force is their sum.
  // A share of 5e-8 of the law is shorter than 0.2.
  const auto force = [](const Response& r) { return -r.elastic[0] / (load_n * dbar); };
  brush.step(0.0, 0.0, 0.6 * load_n);
  brush.step(0.1, 0.0, 0.6 * load_n);
  brush.step(0.0, 0.0, 0.9 * load_n);
  brush.step(0.1, 0.0, 0.9 * load_n);
  CHECK(force(brush.step(0.0, 0.0, 1.0 * load_n)) == Approx(0.6 * 0.2 + 0.3 * 0.1).epsilon(1e-7));
  CHECK(force(brush.step(0.0, 0.0, 0.9 * load_n)) == Approx(0.6 * 0.2 + 0.3 * 0.1).epsilon(1e-7));
  CHECK(force(brush.step(0.0, 0.0, 0.7 * load_n)) == Approx(0.6 * 0.2 + 0.1 * 0.1).epsilon(1e-7));
  CHECK(force(brush.step(0.0, 0.0, 0.4 * load_n)) == Approx(0.4 * 0.2).epsilon(1e-7));
  CHECK(force(brush.step(0.0, 0.0, 0.0)) == 0.0);
}

TEST_CASE(
    "What a rise of the load at rest brought in leaves with the fall, after any slide and any fall before",
    "[cohorts][mass][load]") {
  // Load changes at rest keep the force: bristles that enter are straight, and are the first to leave again.
  for (const double fallen : {1.0, 0.6})
    for (const double way : {0.3, 0.9, 2.3, 40.0}) {
      INFO("slides of " << way << ", a fall to " << fallen);
      Brush brush(SnapLength::lognormal(dbar, 0.3), infinite_options(4.0));
      brush.load = 0.5 * load_n;
      for (int k = 0; k < 7; ++k) brush.step(k % 3 == 2 ? -way : way, 0.1 * k * way);
      brush.load *= fallen;
      brush.step(0.0);
      brush.step(0.4 * way, 0.2);
      const double before[2] = {brush.response.elastic[0], brush.response.elastic[1]};
      const double least = brush.load;
      for (const double more : {1.3, 1.9}) {
        brush.load = more * least;
        brush.step(0.0);
        for (int axis = 0; axis < 2; ++axis) CHECK(brush.response.elastic[axis] == Approx(before[axis]));
      }
      brush.load = least;
      brush.step(0.0);
      for (int axis = 0; axis < 2; ++axis)
        CHECK(brush.response.elastic[axis] == Approx(before[axis]).margin(1e-6 * load_n * dbar));
    }
}

TEST_CASE("A restored state does not hold by the bound of the state before", "[cohorts][state]") {
  // Brings both patches to one position, one bent by 0.45 mean lengths, the other set down there, so that 0.3
  // more makes no bristle of the uniform law snap in the latter.
  const SnapLength law = SnapLength::uniform(0.5 * dbar, 1.5 * dbar);
  Brush brush(law), other(law);
  for (Brush* b : {&brush, &other}) {
    b->step(0.0);
    b->step(0.45);
  }
  const std::vector<std::byte> state = saved_state(brush.patch.batch);
  brush.load = 0.0;
  brush.step(0.0);
  brush.load = load_n;
  brush.step(0.0);
  brush.step(0.01);
  brush.step(-0.01);
  brush.patch.batch.restore_state(state);
  brush.step(0.3);
  other.step(0.3);
  CHECK(brush.response.snaps > 0);
  CHECK(brush.response.snaps == other.response.snaps);
  CHECK(brush.x() == other.x());
}

}  // namespace bristle_test::test_cohort_books
