// After warm_up a step allocates nothing, on any thread. An executable of its own: it counts every call of
// malloc.
//
// glibc has no hooks any more: malloc and its kin are defined here over glibc's own entry points, and
// operator new ends up in them. Sanitizers bring their own malloc: there the test says that it was skipped.
#include <catch2/catch.hpp>

#include <array>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <new>
#include <string>

#if BRISTLE_HAS_EIGEN
#include <bristle/coupling.hpp>
#endif

#include "scenes.hpp"
#if BRISTLE_HAS_ROOM
#include "tools/virtual_room/hand_motion.hpp"
#include "tools/virtual_room/haptic_loop.hpp"
#endif

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define BRISTLE_COUNTS_ALLOCATIONS 1
#else
#define BRISTLE_COUNTS_ALLOCATIONS 0
#endif

namespace {
std::atomic<long> calls{0};
}

#if BRISTLE_COUNTS_ALLOCATIONS
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void __libc_free(void*);

void* malloc(std::size_t size) {
  calls.fetch_add(1, std::memory_order_relaxed);
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  calls.fetch_add(1, std::memory_order_relaxed);
  return __libc_calloc(count, size);
}
void* realloc(void* block, std::size_t size) {
  calls.fetch_add(1, std::memory_order_relaxed);
  return __libc_realloc(block, size);
}
void* memalign(std::size_t alignment, std::size_t size) {
  calls.fetch_add(1, std::memory_order_relaxed);
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) { return memalign(alignment, size); }
int posix_memalign(void** block, std::size_t alignment, std::size_t size) {
  *block = memalign(alignment, size);
  return *block ? 0 : 12;  // ENOMEM
}
void free(void* block) {
  if (block) calls.fetch_add(1, std::memory_order_relaxed);
  __libc_free(block);
}
}
#endif

using namespace bristle_test;

namespace {

/// Every kind of patch, small ones by the hundred and one large.
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
  if (!BRISTLE_COUNTS_ALLOCATIONS) {
    std::printf("skipped: this build's malloc cannot be counted\n");
    return;
  }
  {
    const long before = calls;
    void* volatile probe = ::operator new(100);  // volatile: or the compiler leaves the pair out
    ::operator delete(probe);
    REQUIRE(calls - before == 2);  // the counter counts
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
    std::map<std::string, long> counted;
    const auto count = [&](const char* what, auto&& call) {
      long& sum = counted[what];
      const long before = calls;
      call();
      sum += calls - before;
    };
    for (int k = 0; k < 60; ++k) {
      for (std::size_t i = 0; i < motions.size(); ++i) {
        motions[i].displacement[0] = dbar * (k % 7 == 0 ? 30.0 : 0.4);
        motions[i].normal_load = k % 5 == 0 ? 0.0 : 40.0 + k;
        motions[i].displacement[1] = k % 11 == 0 ? NAN : 0.0;
      }
      count("step", [&] { batch.step(tick, motions, responses); });
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
    for (const auto& [what, number] : counted) {
      INFO(what);
      CHECK(number == 0);
    }
  }
}

#if BRISTLE_HAS_EIGEN
TEST_CASE("Coupling a rigid body to its patches allocates nothing", "[allocations][coupling]") {
  if (!BRISTLE_COUNTS_ALLOCATIONS) return;
  PatchBatch batch;
  constexpr std::size_t feet_count = 9;  // more contacts than velocities
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
  const long before = calls;
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
  CHECK(calls - before == 0);
  CHECK(body.velocity.norm() > 0.0);
}
#endif

#if BRISTLE_HAS_ROOM
TEST_CASE("A tick of the virtual room allocates nothing, whatever the block touches", "[allocations][room]") {
  if (!BRISTLE_COUNTS_ALLOCATIONS) return;
  const auto at = [](double t, double x, double y, double z) {
    return room::HandRow{t, {true, {x, y, z}, {0, 0, -1.0}}};
  };
  // Along the floor, off centre, along the end wall, and over the top.
  const room::HandMotion hand{{at(0.0, -0.07, 0.02, 0.03), at(1.0, 0.19, 0.03, 0.05), at(1.5, 0.1, 0.1, 0.1),
                               at(2.0, 0.22, -0.1, 0.04), at(2.5, 0.28, -0.18, 0.02)}};
  for (const room::FrictionModel model :
       {room::FrictionModel::brush, room::FrictionModel::lugre, room::FrictionModel::coulomb}) {
    INFO("model " << static_cast<int>(model));
    room::LoopOptions options;
    options.settings.model = model;
    options.settings.bristles = 256;
    options.settings.kinetic = 0.8;
    options.settings.peak = 0.9;
    room::HapticLoop loop(options, std::make_unique<room::PlayedHand>("script", hand));
    loop.advance(1);
    const long before = calls;
    loop.advance(3000);
    CHECK(calls - before == 0);
    loop.exchange().room.refresh();
    CHECK(loop.exchange().room.latest().block_position[0] > 0.1);
  }
}
#endif
