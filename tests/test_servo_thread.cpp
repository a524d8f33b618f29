// A step must not allocate, lock or call the system on the servo thread. The tests also check that the watch
// would detect it.
#include <catch2/catch.hpp>

#include <sys/syscall.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <thread>

#include "scenes.hpp"
#include "servo_watch.hpp"

using namespace bristle_test;

namespace {

/// A batch and motions of patches of many kinds: light and heavy, stuck and sliding, some with bad input.
class BusyScene {
 public:
  explicit BusyScene(int threads, std::uint32_t large = 200000)
      : batch_(BatchOptions{}.with_threads(threads)) {
    for (std::uint32_t k = 0; k < 100; ++k) {
      const SnapLength law = k % 3 ? SnapLength::lognormal(dbar, 0.3) : SnapLength::normal(dbar, 0.05 * dbar);
      ids_.push_back(batch_.add(
          plain_material(law, k % 2 ? SnapRule::redraw : SnapRule::keep),
          plain_options(50 + 7 * k, 2, Precision::single, k % 4 ? Outputs::all : Outputs::end).with_seed(k)));
    }
    ids_.push_back(batch_.add(plain_material(uniform, SnapRule::redraw), plain_options(large)));
    batch_.warm_up();
    motions_ = same_motion(ids_, 0.0, 0.0, 40.0);
    motions_.back().normal_load = large;
    responses_.resize(ids_.size());
  }

  /// Makes step k of the watched loop. Counts visited bristles, to notice a step that did nothing.
  long step(int k) noexcept {
    for (std::size_t i = 0; i + 1 < motions_.size(); ++i) {
      motions_[i].displacement[0] = dbar * (k % 7 == 0 ? 30.0 : 0.4);
      motions_[i].displacement[1] = k % 11 == 0 ? NAN : 0.0;
      motions_[i].normal_load = k % 5 == 0 ? 0.0 : 40.0 + k;
    }
    motions_.back().displacement[0] = dbar;
    const auto report = batch_.step(tick, motions_, responses_);
    most_threads_ = std::max(most_threads_, report.threads);
    return static_cast<long>(report.bristles_visited);
  }
  std::uint32_t most_threads() const noexcept { return most_threads_; }
  PatchBatch& batch() noexcept { return batch_; }

 private:
  PatchBatch batch_;
  std::vector<PatchId> ids_;
  std::vector<Motion> motions_;
  std::vector<Response> responses_;
  std::uint32_t most_threads_ = 0;
};

void check_clean(const Sighting& seen) {
  REQUIRE(seen.finished);
  for (const int number : seen.system_calls) {
    INFO("system call " << system_call_name(number));
    CHECK(false);
  }
  CHECK(seen.system_call_count == 0);
  CHECK(seen.counts.allocations == 0);
  CHECK(seen.counts.locks == 0);
  CHECK(seen.counts.exceptions == 0);
}

bool skipped() {
  if (can_watch()) return false;
  std::printf("skipped: this build's malloc and locks cannot be counted\n");
  return true;
}

}  // namespace

TEST_CASE("On one thread no step makes a system call, takes memory or a lock, or throws", "[servo]") {
  if (skipped()) return;
  std::optional<BusyScene> scene;
  const Sighting seen = watch([&] { scene.emplace(1); },
                              [&] {
                                long visited = 0;
                                for (int k = 0; k < 60; ++k) visited += scene->step(k);
                                return visited;
                              });
  check_clean(seen);
  CHECK(seen.value > 200000);
}

TEST_CASE("With workers a step makes no system call but theirs: futex and sched_yield", "[servo]") {
  if (skipped()) return;
  std::optional<BusyScene> scene;
  long visited = 0;
  const Sighting seen = watch([&] { scene.emplace(2); },
                              [&] {
                                for (int k = 0; k < 60; ++k) visited += scene->step(k);
                                return visited > 200000 ? static_cast<long>(scene->most_threads()) : -1;
                              },
                              {SYS_futex, SYS_sched_yield});
  check_clean(seen);
  CHECK(seen.value >= 1);  // number of threads that took part; 1 on one core
}

TEST_CASE("Patches that come, go and change on another thread cost the servo thread nothing of the kind",
          "[servo]") {
  if (skipped()) return;
  std::optional<BusyScene> scene;
  std::thread adder;
  std::atomic<bool> stop{false};
  std::atomic<long> changes{0};
  // The thread that adds patches may allocate memory. Locks and system calls are counted on the servo thread
  // only, exceptions on every thread.
  const Sighting seen = watch(
      [&] {
        scene.emplace(1, 2000);
        adder = std::thread([&] {
          std::vector<PatchId> mine;
          for (std::uint32_t k = 0; !stop; ++k) {
            mine.push_back(scene->batch().add(plain_material(uniform, SnapRule::redraw),
                                              plain_options(20 + k % 300).with_seed(k)));
            scene->batch().set_material(mine[k / 2 % mine.size()], plain_material(uniform, SnapRule::keep));
            if (mine.size() > 400) {
              scene->batch().remove(mine.front());
              mine.erase(mine.begin());
            }
            changes += 2;
          }
        });
        while (changes < 100) std::this_thread::yield();
      },
      [&] {
        const long before = changes;
        long steps = 0;
        // Takes at least 200 steps, until 500 changes were made (the adding thread may wait for a
        // core).
        for (; steps < 200 || (changes < before + 500 && steps < 2000000); ++steps)
          scene->step(static_cast<int>(steps % 1000));
        return static_cast<long>(changes) - before;
      });
  REQUIRE(seen.finished);
  CHECK(seen.system_call_count == 0);
  CHECK(seen.counts.locks == 0);
  CHECK(seen.counts.exceptions == 0);
  CHECK(seen.value >= 500);
}

TEST_CASE("A sleep, an allocation, a lock, a line of output or an exception in a step would be seen",
          "[servo]") {
  if (skipped()) return;
  std::optional<BusyScene> scene;
  const auto watched = [&](auto&& mistake) {
    return watch([&] { scene.emplace(1, 2000); },
                 [&] {
                   for (int k = 0; k < 3; ++k) {
                     scene->step(k);
                     mistake();
                   }
                   return 0L;
                 });
  };
  {
    const Sighting seen = watched([] { std::this_thread::sleep_for(std::chrono::microseconds(1)); });
    REQUIRE(seen.finished);
    if (seen.trapped) CHECK(seen.system_call_count >= 3);
  }
  {
    const Sighting seen = watched([] { std::make_unique<volatile int>(1); });
    REQUIRE(seen.finished);
    CHECK(seen.counts.allocations == 6);
  }
  {
    std::mutex mutex;
    const Sighting seen = watched([&] { std::lock_guard<std::mutex> lock(mutex); });
    REQUIRE(seen.finished);
    // Locking a free mutex makes no system call, so only the count of locks shows it.
    CHECK(seen.system_call_count == 0);
    CHECK(seen.counts.locks == 3);
  }
  {
    const Sighting seen = watched([] {
      std::fputs("late\n", stderr);
      std::fflush(stderr);
    });
    REQUIRE(seen.finished);
    if (seen.trapped) CHECK(seen.system_call_count >= 3);
  }
  {
    const Sighting seen = watched([] {
      try {
        throw std::runtime_error("late");
      } catch (const std::exception&) {
      }
    });
    REQUIRE(seen.finished);
    CHECK(seen.counts.exceptions == 3);
  }
}
