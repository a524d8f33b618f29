// Which threads take part in a step: as many as asked for in a large one, the caller alone in a small one.
#include <catch2/catch.hpp>

#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "bristle/bed.hpp"
#include "bristle/joint_friction.hpp"
#include "core/runtime/sharing.hpp"
#include "core/runtime/workers.hpp"
#include "expect.hpp"
#include "scenes.hpp"

namespace bristle_test::test_threads {

namespace {

#if BRISTLE_WITH_TBB

/// Returns the other threads of this process, by number, with a line of their status in /proc.
std::map<int, std::string> other_threads(const char* key) {
  std::map<int, std::string> found;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/task")) {
    const int thread = std::stoi(entry.path().filename().string());
    if (thread == static_cast<int>(syscall(SYS_gettid))) continue;
    std::ifstream status(entry.path() / "status");
    for (std::string line; std::getline(status, line);)
      if (line.rfind(key, 0) == 0) found[thread] = line.substr(std::strlen(key));
  }
#if defined(__SANITIZE_THREAD__)
  if (!found.empty()) found.erase(found.begin());  // the first thread is the sanitizer's
#endif
  return found;
}

/// Returns the context switches of each other thread, as the system counts them.
std::map<int, std::string> switches() {
  std::map<int, std::string> found = other_threads("voluntary_ctxt_switches:");
  for (const auto& [thread, count] : other_threads("nonvoluntary_ctxt_switches:")) found[thread] += count;
  return found;
}

#endif

}  // namespace

#if BRISTLE_WITH_TBB

TEST_CASE("As many threads as asked for take part where there is work for them", "[threads]") {
  for (int threads : {1, 2, 3, 8}) {
    bristle::detail::Workers workers(threads);
    workers.warm_up();
    struct Seen {
      std::mutex mutex;
      std::set<std::thread::id> threads;
      int done = 0;
    } seen;
    // Makes pieces of work of 3 ms, so that each of eight threads gets some on two cores.
    const auto piece = [](void* context, int) {
      std::this_thread::sleep_for(std::chrono::milliseconds(3));
      Seen& s = *static_cast<Seen*>(context);
      const std::lock_guard<std::mutex> lock(s.mutex);
      s.threads.insert(std::this_thread::get_id());
      ++s.done;
    };
    // Allows many runs, because on a busy machine a thread that was woken may come late.
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(10);
    int runs = 0;
    for (; seen.threads.size() < static_cast<std::size_t>(threads) && std::chrono::steady_clock::now() < end;
         ++runs)
      workers.run(32, piece, &seen);
    INFO(threads << " threads");
    CHECK(seen.threads.size() == static_cast<std::size_t>(threads));
    CHECK(seen.done == 32 * runs);
  }
}

TEST_CASE("What a worker that is held up has not begun, the caller does", "[threads]") {
  // Lets the worker hold its first task until all others are done, so the caller must do these and not wait
  // for the worker.
  constexpr int tasks = 64;
  bristle::detail::Workers workers(2);
  workers.warm_up();
  struct Seen {
    std::thread::id caller = std::this_thread::get_id();
    std::atomic<int> done{0}, held_up{0};
  };
  bool held_up = false;
  for (int attempt = 0; attempt < 200 && !held_up; ++attempt) {
    Seen seen;
    workers.run(
        tasks,
        [](void* self, int) {
          Seen& s = *static_cast<Seen*>(self);
          if (std::this_thread::get_id() != s.caller && s.held_up.exchange(1) == 0) {
            while (s.done < tasks - 1) std::this_thread::yield();
          } else if (s.held_up == 0) {
            // Waits up to 50 us for the worker thread to begin its task.
            const auto start = std::chrono::steady_clock::now();
            while (s.held_up == 0 &&
                   std::chrono::steady_clock::now() - start < std::chrono::microseconds(50)) {
            }
          }
          ++s.done;
        },
        &seen);
    CHECK(seen.done == tasks);
    held_up = seen.held_up == 1;
  }
  CHECK(held_up);
}

TEST_CASE("Each task is done once, whoever takes it", "[threads]") {
  for (const int threads : {1, 2, 3, 8}) {
    bristle::detail::Workers workers(threads);
    for (const int tasks : {0, 1, 2, 3, 7, 8, 9, 64, 511}) {
      std::vector<std::atomic<int>> done(static_cast<std::size_t>(tasks));
      workers.run(
          tasks,
          [](void* self, int k) { ++(*static_cast<decltype(done)*>(self))[static_cast<std::size_t>(k)]; },
          &done);
      INFO(threads << " threads, " << tasks << " tasks");
      CHECK(std::all_of(done.begin(), done.end(), [](const std::atomic<int>& n) { return n == 1; }));
    }
  }
}

TEST_CASE("A small step wakes no worker", "[threads]") {
  PatchBatch batch(BatchOptions{}.with_threads(2));
  const Material material = plain_material(SnapLength::uniform(0.5 * dbar, 1.5 * dbar), SnapRule::redraw);
  // A patch of 900 bristles, as in the paper, and nine small ones, too few to share.
  std::vector<Motion> small;
  for (std::uint32_t size : std::vector<std::uint32_t>{900, 100, 100, 100, 100, 100, 100, 100, 100, 100}) {
    Motion motion{batch.add(material, plain_options(size)), {1.3 * dbar, 0.0}, 1.0 * size};
    small.push_back(motion);
  }
  std::vector<Response> responses(small.size());
  Motion large = small[0];
  large.id = batch.add(material, plain_options(400000));
  large.normal_load = 400000.0;
  batch.warm_up();

  // Waits until no other thread of the process has run on a core for 20 ms.
  const auto wait_for_sleep = [] {
    for (int i = 0; i < 200; ++i) {
      const auto before = switches();
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      if (switches() == before) return true;
    }
    return false;
  };
  Response response;
  const bristle::StepReport shared = batch.step(tick, {&large, 1}, {&response, 1});
  CHECK(shared.tasks > 1);
#if defined(__SANITIZE_THREAD__)
  std::printf("skipped: the thread sanitizer has a thread of its own that never sleeps\n");
  return;
#endif
  // Compares the numbers of context switches up to five times, because on a busy machine a worker on its way
  // to sleep may get a core once more, which counts.
  auto before = switches();
  bool undisturbed = false;
  for (int attempt = 0; attempt < 5 && !undisturbed; ++attempt) {
    REQUIRE(wait_for_sleep());
    before = switches();
    REQUIRE(!before.empty());  // the worker thread of the library exists
    large.displacement[0] = 0.0;
    for (int k = 0; k < 2000; ++k) {
      const bristle::StepReport report = batch.step(tick, small, responses);
      expect(report.tasks == 1 && report.threads == 1, "the calling thread does a small step alone");
      // Checks that a large step whose motion is 0 wakes no worker.
      if (k % 10 == 0) batch.step(tick, {&large, 1}, {&response, 1});
    }
    undisturbed = switches() == before;
  }
  CHECK(undisturbed);
  // Checks that a large step that slides does wake a worker, so that the count of context switches above
  // would have noticed one.
  large.displacement[0] = 1.3 * dbar;
  for (int attempt = 0; attempt < 50 && switches() == before; ++attempt) {
    for (int k = 0; k < 20; ++k) batch.step(tick, {&large, 1}, {&response, 1});
    wait_for_sleep();  // the system counts a switch when a thread goes to sleep
  }
  CHECK(switches() != before);
}

/// Checks that a step of 20,000 to 200,000 bristles (Sharing) is shared only while workers are awake.
void check_middle_step(const char* kind, const std::function<bristle::StepReport()>& step) {
  // Pauses before every step, as a servo loop does between its ticks.
  for (int k = 0; k < 20; ++k) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    expect(step().tasks == 1, (std::string(kind) + ": after a pause the caller steps alone").c_str());
  }
  // Takes 200 steps back to back: the machine may stop the caller between two of them, but not each time.
  int shared = 0;
  for (int k = 0; k < 200; ++k) shared += step().tasks > 1;
  INFO(kind);
  CHECK(shared > 0);
}

TEST_CASE("A step of middle size is shared only while workers are awake", "[threads]") {
  const BatchOptions two = BatchOptions{}.with_threads(2);
  {
    PatchBatch batch(two);
    const Motion motion{batch.add(plain_material(SnapLength::uniform(0.5 * dbar, 1.5 * dbar), SnapRule::keep),
                                  plain_options(100000)),
                        {1.3 * dbar, 0.0},
                        100000.0};
    Response response;
    batch.warm_up();
    check_middle_step("patch", [&] { return batch.step(tick, {&motion, 1}, {&response, 1}); });
  }
  {
    bristle::BedBatch batch(two);
    std::vector<bristle::BedMotion> in(100);
    std::vector<bristle::BedResponse> out(in.size());
    for (bristle::BedMotion& motion : in) {
      motion.id = batch.add(bristle::BedMaterial(0.5).with_presliding(dbar),
                            bristle::BedShape::sphere_row(32, 1e-3), bristle::BedOptions{});
      motion.displacement[0] = 0.1 * dbar;
      motion.normal_load = 0.5;
    }
    check_middle_step("beds", [&] { return batch.step(in, out); });
  }
  {
    bristle::JointMaterial gear;
    gear.stiffness = 1e3;
    gear.kinetic.base = 1.0;
    bristle::JointFriction joints(2000, {&gear, 1}, {}, two);
    std::vector<double> angle(2000), torque(2000);
    check_middle_step("joints", [&] {
      for (double& each : angle) each += 1e-4;
      return joints.step({angle}, {torque});
    });
  }
}

TEST_CASE("A caller that workers held up steps alone for a while, longer each time", "[threads]") {
  bristle::detail::Retreat retreat;
  const auto steps_alone = [&] {
    std::uint32_t count = 0;
    while (!retreat.is_over()) ++count;
    return count;
  };
  // Makes the caller's wait for the last piece of work alternate between 0 and as long as its own work, which
  // must not make it step alone.
  for (int k = 0; k < 100; ++k) {
    CHECK(retreat.is_over());
    retreat.judge(1e-3, k % 2 == 0 ? 0.0 : 1e-3);
  }
  CHECK(steps_alone() == 0);
  for (const std::uint32_t length : {32u, 128u, 512u, 2048u, 8192u, 8192u}) {
    retreat.judge(0.1e-3, 16e-3);
    CHECK(steps_alone() == length);
  }
  for (std::uint32_t k = 0; k < 8192; ++k) retreat.judge(1e-3, 0.0);
  retreat.judge(0.1e-3, 16e-3);
  CHECK(steps_alone() == 32);
}

TEST_CASE("A step whose patches all hold still was done by the calling thread", "[threads]") {
  constexpr std::uint32_t n = 300000;
  OnePatch patch(plain_material(SnapLength::uniform(0.5 * dbar, 1.5 * dbar), SnapRule::keep),
                 plain_options(n), BatchOptions{}.with_threads(2));
  patch.step(0.1 * dbar, 0.0, n);
  for (int k = 0; k < 10; ++k) {
    patch.step(1e-6 * dbar, 0.0, n);  // path shorter than to any snap: no bristle is visited
    CHECK(patch.report.patches_stepped == 1);
    CHECK(patch.report.tasks >= 1);
    CHECK(patch.report.threads >= 1);
  }
}

#endif

}  // namespace bristle_test::test_threads
