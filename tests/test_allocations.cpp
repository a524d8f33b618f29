// Checks that after warm_up() a step allocates no memory, on any thread.
#include <catch2/catch.hpp>

#include <bristle/bristle.h>

#include <array>
#include <cstdio>
#include <map>
#include <new>
#include <string>

#if BRISTLE_HAS_EIGEN
#include <bristle/contact_frame.hpp>
#include <bristle/haptic_point.hpp>
#endif

#include "scenes.hpp"
#include "servo_watch.hpp"
#include "tools/libraries/scene/couplings.hpp"

using namespace bristle_test;

namespace {

/// Adds every kind of patch: small ones by the hundred and one large.
std::vector<PatchId> many_patches(PatchBatch& batch) {
  std::vector<PatchId> ids;
  for (std::uint32_t k = 0; k < 300; ++k) {
    const Material material =
        plain_material(k % 3 ? SnapLength::lognormal(dbar, 0.3) : SnapLength::normal(dbar, 0.05 * dbar),
                       k % 2 ? SnapRule::redraw : SnapRule::keep);
    ids.push_back(batch.add(
        material,
        plain_options(50 + 7 * k, 2, Precision::single, k % 4 ? Outputs::all : Outputs::end).with_seed(k)));
  }
  ids.push_back(batch.add(plain_material(SnapLength::uniform(0.5 * dbar, 1.5 * dbar), SnapRule::redraw),
                          plain_options(200000)));
  return ids;
}

}  // namespace

TEST_CASE("After warm_up no step allocates or frees memory, on any thread", "[allocations]") {
  if (!can_watch()) {
    std::printf("skipped: this build's malloc cannot be counted\n");
    return;
  }
  {
    const long before = counts_so_far().allocations;
    void* volatile probe = ::operator new(100);  // volatile keeps the compiler from removing the allocation
    ::operator delete(probe);
    REQUIRE(counts_so_far().allocations - before == 2);  // checks that the counter of allocations works
  }
  for (int threads : {1, 2}) {
    INFO(threads << " threads");
    PatchBatch batch(BatchOptions{}.with_threads(threads));
    const std::vector<PatchId> ids = many_patches(batch);
    batch.warm_up();
    std::vector<Motion> motions = same_motion(ids, 0.0, 0.0, 40.0);
    std::vector<Response> responses(ids.size());
    bristle::LoadShedder shedder(
        bristle::LoadShedderOptions{}.with_budget(1e-4).with_wait_steps(2).with_record(16));
    for (PatchId id : ids) shedder.add(id, static_cast<int>(id.value % 3));
    std::vector<std::byte> state(batch.state_size());
    std::vector<double> column(100);
    std::map<std::string, long> counted;
    const auto count = [&](const char* what, auto&& call) {
      long& sum = counted[what];
      const long before = counts_so_far().allocations;
      call();
      sum += counts_so_far().allocations - before;
    };
    for (int k = 0; k < 60; ++k) {
      for (std::size_t i = 0; i < motions.size(); ++i) {
        motions[i].displacement[0] = dbar * (k % 7 == 0 ? 30.0 : 0.4);
        motions[i].normal_load = k % 5 == 0 ? 0.0 : 40.0 + k;
        motions[i].displacement[1] = k % 11 == 0 ? NAN : 0.0;
      }
      bristle::StepReport report;
      count("LoadShedder before", [&] { shedder.before_step(batch, motions); });
      count("step", [&] { report = batch.step(tick, motions, responses); });
      count("LoadShedder after", [&] { shedder.after_step(batch, motions, k < 30 ? 1e-3 : 1e-7, report); });
      count("LoadShedder report", [&] { shedder.report(batch); });
      count("set_detail", [&] { batch.set_detail(ids[2], k % 2 ? 20 : 60); });
      count("find_force", [&] { batch.find_force(tick, motions[static_cast<std::size_t>(k)]); });
      count("move", [&] { batch.move(ids[1], 1e-6, 0.0, 30.0); });
      count("step of moves", [&] { batch.step(tick); });
      count("force", [&] { batch.force(ids[1]); });
      count("state_hash", [&] { batch.state_hash(); });
      count("stored_energy", [&] { batch.stored_energy(ids[3]); });
      count("info", [&] { batch.info(ids[3]); });
      count("read_bristles", [&] { batch.read_bristles(ids[3], column, {}, {}); });
      count("save_state", [&] { batch.save_state(state); });
    }
    CHECK(shedder.report(batch).decisions > 16);  // whether the load shedder decided anything, else it was
                                                  // not tested
    for (const auto& [what, number] : counted) {
      INFO(what);
      CHECK(number == 0);
    }
  }
}

TEST_CASE("A step of the C interface allocates nothing", "[allocations][c]") {
  if (!can_watch()) return;
  bristle_batch* batch = nullptr;
  REQUIRE(bristle_create(nullptr, &batch) == BRISTLE_OK);
  bristle_material material;
  bristle_init_material(&material, sizeof material);
  bristle_motion motions[3] = {};
  bristle_response responses[3] = {};
  for (bristle_motion& motion : motions) {
    REQUIRE(bristle_add(batch, &material, nullptr, &motion.id) == BRISTLE_OK);
    motion.normal_load = 0.5;
  }
  bristle_step_report report;
  bristle_init_step_report(&report, sizeof report);
  REQUIRE(bristle_warm_up(batch) == BRISTLE_OK);
  const long before = counts_so_far().allocations;
  std::uint32_t stepped = 0;
  for (int k = 0; k < 100; ++k) {
    for (bristle_motion& motion : motions) motion.displacement[0] = k % 3 == 0 ? 20e-6 : -1e-6;
    bristle_step(batch, tick, motions, sizeof motions[0], responses, sizeof responses[0], 3, &report);
    stepped += report.patches_stepped;
    bristle_find_force(batch, tick, motions, sizeof motions[0], responses, sizeof responses[0], 3);
  }
  CHECK(counts_so_far().allocations - before == 0);
  CHECK(stepped == 300);
  bristle_destroy(batch);
}

TEST_CASE("Contacts that come and go by key allocate nothing", "[allocations][keys]") {
  if (!can_watch()) return;
  PatchBatch batch;
  bristle::KeyedPatches patches(batch, plain_material(SnapLength::lognormal(dbar, 0.3), SnapRule::redraw),
                                plain_options(40),
                                bristle::KeyedOptions{}.with_capacity(100).with_keep_steps(1));
  bristle::ContactMatcher matcher(bristle::MatcherOptions{}.with_capacity(60).with_keep_steps(1));
  batch.warm_up();
  std::vector<bristle::ContactPoint> points(70);  // more points than the matcher has room for, which get no
                                                  // key
  std::vector<std::uint64_t> keys(points.size());
  std::vector<Motion> motions(points.size());
  std::vector<Response> responses(points.size());
  std::vector<bristle::KeyedPatches::Entry> entries(100);
  const long before = counts_so_far().allocations;
  for (std::size_t k = 0; k < 200; ++k) {
    for (std::size_t i = 0; i < points.size(); ++i)
      points[i] = {i / 5, {0.01 * static_cast<double>(i * (k / 10)), 0.0, 0.0}};
    matcher.match(points, keys);
    for (std::size_t i = 0; i < points.size(); ++i)
      motions[i] = {patches.find_or_add(keys[i] + 7 * (k / 3)), {1e-6, 0.0}, 30.0};
    batch.step(tick, motions, responses);
    if (k % 20 == 0) batch.reset(patches.find(keys[3]), 5, 6);
    patches.read_entries(entries);
    patches.end_step();
  }
  patches.clear();
  CHECK(counts_so_far().allocations - before == 0);
}

#if BRISTLE_HAS_EIGEN
TEST_CASE("A contact frame and a haptic point allocate nothing", "[allocations][frame][haptic]") {
  if (!can_watch()) return;
  PatchBatch batch;
  Motion motion;
  Response response;
  motion.id = batch.add(Material{}, PatchOptions{}.with_bristles(200));
  batch.warm_up();
  const long before = counts_so_far().allocations;
  bristle::ContactFrame frame(Eigen::Vector3d(1, 2, 3));
  bristle::HapticPoint point(bristle::HapticOptions{}.with_force_limit(1.0).with_resolution(1e-5));
  Eigen::Vector3d sum(0, 0, 0);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d normal(std::sin(0.1 * i), 0.3, std::cos(0.1 * i));
    frame.carry(normal, 0.1 * normal, Eigen::Vector3d::Zero());
    sum += frame.force(response.end);
    point.prepare(tick, 1e-6 * i * normal, normal, 0.5, motion);
    batch.step(tick, {&motion, 1}, {&response, 1});
    sum += point.finish(response);
  }
  CHECK(counts_so_far().allocations - before == 0);
  CHECK(sum.norm() > 0.0);
}

TEST_CASE("Coupling a rigid body to its patches allocates nothing", "[allocations][coupling]") {
  if (!can_watch()) return;
  PatchBatch batch;
  constexpr std::size_t feet_count = 9;  // nine feet: more contacts than the body has velocities
  std::array<Motion, feet_count> motions;
  std::array<Response, feet_count> responses;
  std::array<bristle::BodyContact<6>, feet_count> feet;
  for (std::size_t i = 0; i < feet_count; ++i) {
    motions[i].id = batch.add(Material{}, PatchOptions{}.with_bristles(200).with_outputs(Outputs::mean));
    motions[i].normal_load = 0.5;
    feet[i] = bristle::rigid_contact(i, {0.01 * static_cast<double>(i), 0.02, -0.01}, {1, 0, 0}, {0, 1, 0});
  }
  batch.warm_up();
  auto body = bristle::rigid_body(0.25, Eigen::Vector3d(1e-4, 2e-4, 3e-4).asDiagonal());
  const bristle::BodyVector<6> force = Eigen::Matrix<double, 6, 1>::Constant(0.3);
  const long before = counts_so_far().allocations;
  for (int i = 0; i < 200; ++i) {
    if (i % 2) {
      bristle::predict_displacements(batch, tick, body, force, feet, motions);
      batch.step(tick, motions, responses);
      bristle::apply_end_forces(tick, body, force, feet, responses);
    } else {
      bristle::solve_displacements(batch, tick, body, force, feet, motions);
      batch.step(tick, motions, responses);
      bristle::apply_mean_forces(tick, body, force, feet, responses);
    }
  }
  CHECK(counts_so_far().allocations - before == 0);
  CHECK(body.velocity.norm() > 0.0);
}
#endif
