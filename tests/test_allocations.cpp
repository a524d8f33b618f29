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

#include "c_batch.hpp"
#include "scenes.hpp"
#include "servo_watch.hpp"
#include "tools/libraries/scene/couplings.hpp"

using namespace bristle_test;

namespace {

/// Counts the allocations made in calls, by the name of each.
struct CountedCalls {
  std::map<std::string, long> allocations;

  template <class Call>
  void operator()(const char* what, Call&& call) {
    const long before = counts_so_far().allocations;
    call();
    allocations[what] += counts_so_far().allocations - before;
  }
  void check_none() const {
    for (const auto& [what, number] : allocations) {
      INFO(what);
      CHECK(number == 0);
    }
  }
};

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
    std::vector<std::byte> state(batch.state_size());
    std::vector<double> column(100);
    CountedCalls count;
    for (int k = 0; k < 60; ++k) {
      for (std::size_t i = 0; i < motions.size(); ++i) {
        motions[i].displacement[0] = dbar * (k % 7 == 0 ? 30.0 : 0.4);
        motions[i].normal_load = k % 5 == 0 ? 0.0 : 40.0 + k;
        motions[i].displacement[1] = k % 11 == 0 ? NAN : 0.0;
      }
      count("step", [&] { batch.step(tick, motions, responses); });
      count("find_force", [&] { batch.find_force(tick, motions[static_cast<std::size_t>(k)]); });
      count("state_hash", [&] { batch.state_hash(); });
      count("stored_energy", [&] { batch.stored_energy(ids[3]); });
      count("info", [&] { batch.info(ids[3]); });
      count("read_bristles", [&] { batch.read_bristles(ids[3], column, {}, {}); });
      count("save_state", [&] { batch.save_state(state); });
    }
    count.check_none();
  }
}

TEST_CASE("No call of the C interface between two steps allocates", "[allocations][c]") {
  if (!can_watch()) return;
  CBatch patches{{}};
  COutlines outlines(patches);
  CBeds of_beds{{}};
  bristle::JointMaterial gear;
  gear.stiffness = 300.0;
  gear.kinetic.base = 0.4;
  bristle::JointOptions with_gradients;
  with_gradients.gradients = true;
  CJoints of_joints(2, {&gear, 1}, with_gradients, {});
  bristle_batch* const batch = patches.get();
  bristle_extended* const pads = outlines.get();
  bristle_beds* const beds = of_beds.get();
  bristle_joints* const joints = of_joints.get();
  bristle_keyed* keyed = nullptr;
  bristle_matcher* matcher = nullptr;
  bristle_monitor* monitor = nullptr;
  const bristle_material material = c_struct(Material{});
  bristle_joint_step at_joints;
  bristle_step_report report;
  bristle_patch_info info;
  bristle_monitor_report times;
  REQUIRE(bristle_init_joint_step(&at_joints, sizeof at_joints) == BRISTLE_OK);
  REQUIRE(bristle_init_step_report(&report, sizeof report) == BRISTLE_OK);
  REQUIRE(bristle_init_patch_info(&info, sizeof info) == BRISTLE_OK);
  REQUIRE(bristle_init_monitor_report(&times, sizeof times) == BRISTLE_OK);
  bristle_motion motion = {};
  bristle_extended_motion pad_motion = {};
  bristle_bed_motion bed_motion = {};
  motion.id = patches.add({}, {}).value;
  pad_motion.id = outlines.add({}, {}, {{{{1e-4, 0.0}, 0.5}, {{-1e-4, 0.0}, 0.5}}, 0.0}).value;
  bed_motion.id = of_beds
                      .add(bristle::BedMaterial(0.5).with_presliding(1e-4),
                           bristle::BedShape::rectangle(1e-3, 1e-3, bristle::BedPressure::uniform, 4, 4), {})
                      .value;
  REQUIRE(bristle_keyed_create(batch, &material, nullptr, nullptr, &keyed) == BRISTLE_OK);
  REQUIRE(bristle_matcher_create(nullptr, &matcher) == BRISTLE_OK);
  REQUIRE(bristle_monitor_create(1e-3, 1e-3, &monitor) == BRISTLE_OK);
  bristle_group_step at_group;
  REQUIRE(bristle_init_group_step(&at_group, sizeof at_group) == BRISTLE_OK);
  REQUIRE(bristle_add_group(batch, &material, nullptr, 3, &at_group.group) == BRISTLE_OK);
  const double group_moved[3] = {1e-6, 2e-6, -1e-6}, group_load[3] = {0.3, 0.4, 0.5};
  double group_force[3];
  at_group.displacement[0] = at_group.displacement[1] = group_moved;
  at_group.normal_load = group_load;
  at_group.end[0] = group_force;
  REQUIRE(bristle_warm_up(batch) == BRISTLE_OK);
  motion.normal_load = pad_motion.normal_load = bed_motion.normal_load = 0.5;
  double angle[2] = {}, torque[2], gradient[2 * bristle::joint_parameters], column[8];
  at_joints.angle = angle;
  at_joints.torque = torque;
  at_joints.gradient = gradient;
  std::vector<std::byte> state(bristle_extended_state_size(pads) + bristle_keyed_state_size(keyed) +
                               bristle_beds_state_size(beds) + bristle_joints_state_size(joints));

  CountedCalls count;
  bristle_response response;
  bristle_extended_response pad_response;
  bristle_bed_response bed_response;
  for (int k = 0; k < 40; ++k) {
    const double moved = k % 3 == 0 ? 20e-6 : -1e-6;
    motion.displacement[0] = pad_motion.displacement[1] = bed_motion.displacement[0] = moved;
    pad_motion.displacement[2] = 1e-3;
    angle[0] = 1e-3 * k;
    const bristle_contact_point point = {7, {1e-5 * k, 0.0, 0.0}};
    std::uint64_t key = 0;
    bristle_id id = 0;
    count("bristle_step",
          [&] { bristle_step(batch, tick, &motion, sizeof motion, &response, sizeof response, 1, &report); });
    count("bristle_find_force",
          [&] { bristle_find_force(batch, tick, &motion, sizeof motion, &response, sizeof response, 1); });
    count("bristle_find_group_force", [&] { bristle_find_group_force(batch, tick, &at_group, &report); });
    count("bristle_step_groups", [&] {
      bristle_step_groups(batch, tick, &at_group, 1, nullptr, sizeof motion, nullptr, sizeof response, 0,
                          &report);
    });
    CHECK(report.patches_stepped == 3);
    if (k % 10 == 9) count("bristle_reset", [&] { bristle_reset(batch, motion.id, 3, 4); });
    count("bristle_find_info", [&] { bristle_find_info(batch, motion.id, &info); });
    count("bristle_stored_energy", [&] { bristle_stored_energy(batch, motion.id); });
    count("bristle_state_hash", [&] { bristle_state_hash(batch, 0); });
    count("bristle_read_bristles",
          [&] { bristle_read_bristles(batch, motion.id, column, nullptr, nullptr, 8); });
    count("bristle_extended_step",
          [&] { bristle_extended_step(pads, tick, &pad_motion, &pad_response, 1, &report); });
    count("bristle_extended_find_force",
          [&] { bristle_extended_find_force(pads, tick, &pad_motion, &pad_response, 1); });
    count("bristle_extended_set_scale",
          [&] { bristle_extended_set_scale(pads, pad_motion.id, 1.0 + 0.01 * k); });
    count("bristle_extended_save_state",
          [&] { bristle_extended_save_state(pads, state.data(), state.size()); });
    count("bristle_matcher_match", [&] { bristle_matcher_match(matcher, &point, &key, 1, nullptr); });
    count("bristle_keyed_find_or_add", [&] { bristle_keyed_find_or_add(keyed, &key, &id, 1); });
    count("bristle_keyed_find", [&] { bristle_keyed_find(keyed, &key, &id, 1); });
    bristle_group group{};
    count("bristle_keyed_groups", [&] { bristle_keyed_groups(keyed, &group, 1); });
    CHECK(group.count == 1024);
    count("bristle_keyed_end_step", [&] { bristle_keyed_end_step(keyed); });
    count("bristle_keyed_save_state", [&] { bristle_keyed_save_state(keyed, state.data(), state.size()); });
    count("bristle_beds_step", [&] { bristle_beds_step(beds, &bed_motion, &bed_response, 1, &report); });
    count("bristle_beds_find_force", [&] { bristle_beds_find_force(beds, &bed_motion, &bed_response, 1); });
    count("bristle_beds_save_state", [&] { bristle_beds_save_state(beds, state.data(), state.size()); });
    count("bristle_joints_step", [&] { bristle_joints_step(joints, &at_joints, &report); });
    count("bristle_joints_find_torque", [&] { bristle_joints_find_torque(joints, &at_joints, &report); });
    count("bristle_joints_save_state",
          [&] { bristle_joints_save_state(joints, state.data(), state.size()); });
    count("bristle_monitor_record", [&] { bristle_monitor_record(monitor, 1e-4, 1e-4); });
    count("bristle_monitor_record_tick",
          [&] { bristle_monitor_record_tick(monitor, 1e-3 * k, 1e-3 * k, 1e-3 * k + 1e-4, 1e-4); });
    count("bristle_monitor_find_report", [&] { bristle_monitor_find_report(monitor, &times); });
    CHECK(report.patches_stepped == 2);  // the two joints: every step before succeeded
    CHECK(response.status == BRISTLE_STATUS_OK);
    CHECK(pad_response.status == BRISTLE_STATUS_OK);
    CHECK(bed_response.status == BRISTLE_STATUS_OK);
    CHECK(id != 0);
  }
  count.check_none();
  bristle_monitor_destroy(monitor);
  bristle_matcher_destroy(matcher);
  bristle_keyed_destroy(keyed);
}

TEST_CASE("Contacts that come and go by key allocate nothing", "[allocations][keys]") {
  if (!can_watch()) return;
  PatchBatch batch;
  bristle::KeyedPatches patches(batch, plain_material(SnapLength::lognormal(dbar, 0.3), SnapRule::redraw),
                                plain_options(40),
                                bristle::KeyedOptions{}.with_capacity(100).with_keep_steps(1));
  bristle::ContactMatcher matcher(bristle::MatcherOptions{}.with_capacity(60).with_keep_steps(1));
  batch.warm_up();
  // More points than the matcher has room for, which get no key.
  std::vector<bristle::ContactPoint> points(70);
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
