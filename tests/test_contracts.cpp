// Things that a program may do beside stepping: fork, unload the library that holds the batch, ask for more
// threads than there are cores, add and remove for ever. And what it must not: step one batch from two
// threads.
#include <catch2/catch.hpp>

#include <dlfcn.h>
#include <malloc.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <string>
#include <thread>
#include <vector>

#include "expect.hpp"
#include "scenes.hpp"

namespace bristle_test::test_contracts {

namespace {

/// Returns a patch so large that its step is shared among threads.
struct Shared {
  PatchBatch batch;
  Motion motion;
  Response response;

  explicit Shared(int threads, std::uint32_t bristles = 400000)
      : batch(BatchOptions{}.with_threads(threads)) {
    motion.id = batch.add(plain_material(SnapLength::uniform(0.5 * dbar, 1.5 * dbar), SnapRule::keep),
                          plain_options(bristles));
    motion.normal_load = bristles;
    motion.displacement[0] = 0.7 * dbar;
  }
  std::uint64_t step(int times) {
    for (int k = 0; k < times; ++k) batch.step(tick, {&motion, 1}, {&response, 1});
    return batch.state_hash();
  }
};

/// Runs `act` in a child process. Returns its exit code, 0 to 100, or more if the child hangs or dies.
template <class Act>
int in_child(Act act) {
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    signal(SIGALRM, SIG_DFL);
    signal(SIGSEGV, SIG_DFL);
    signal(SIGABRT, SIG_DFL);
    alarm(60);
    _exit(act());
  }
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

std::size_t bytes_in_use() {
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

}  // namespace

TEST_CASE("Batches of more threads than there are cores give the bits of one thread",
          "[contracts][threads]") {
  const std::uint64_t expected = Shared(1).step(3);
  for (const int threads : {33, 200}) {
    INFO(threads << " threads");
    CHECK(Shared(threads).step(3) == expected);
  }
  CHECK_THROWS_AS(Shared(1025), bristle::Error);
}

TEST_CASE("A million patches added and removed leave no memory and no id behind", "[contracts][batch]") {
  PatchBatch batch;
  const Material material = plain_material(SnapLength::uniform(0.5 * dbar, 1.5 * dbar), SnapRule::keep);
  const PatchOptions options = plain_options(1);
  std::vector<PatchId> ids(8);
  const auto add_and_remove = [&](int rounds) {
    for (int k = 0; k < rounds; ++k) {
      for (PatchId& id : ids) id = batch.add(material, options);
      // Calls patch_count(), which takes the waiting changes, at the pace of a stepping thread.
      if (k % 16 == 0) batch.patch_count();
      for (const PatchId id : ids) batch.remove(id);
    }
  };
  add_and_remove(1000);
  batch.patch_count();
  const PatchId before = batch.add(material, options);
  batch.remove(before);
  const std::size_t start = bytes_in_use();
  const int rounds = static_cast<int>(test_size(125000));
  add_and_remove(rounds);
  CHECK(batch.patch_count() == 0);
  // Memory in use stays bounded, because a change frees the commands handed over last; the rest are a few
  // commands, patches and slots.
  CHECK(bytes_in_use() < start + 500000);
  // Checks that no id was given twice: the generation in the id's upper half grows when a slot is reused.
  const PatchId after = batch.add(material, options);
  CHECK(static_cast<std::uint32_t>(after.value) < 200);
  CHECK((after.value >> 32) >= (before.value >> 32) + static_cast<std::uint64_t>(rounds) / 200);
  CHECK(batch.info(before).representatives == 0);
  batch.remove(after);
}

namespace {

/// Steps one outline by 600 motions while `meanwhile(pads, stop)` runs on another thread. Returns its
/// responses in bits.
template <class Meanwhile>
std::vector<double> step_outline_while(Meanwhile meanwhile) {
  PatchBatch batch;
  bristle::ExtendedPatches pads(batch);
  const Material material =
      plain_material(SnapLength::uniform(0.5 * dbar, 1.5 * dbar), SnapRule::keep).with_viscous_friction(2.0);
  bristle::ExtendedMotion motion{
      pads.add(material, plain_options(800), bristle::Outline::disc(1e-3, bristle::Pressure::hertz)),
      {0.2 * dbar, 0.0, 1e-4},
      400.0};
  std::atomic<bool> stop{false};
  std::thread other([&] { meanwhile(pads, stop); });
  std::vector<double> bits;
  bristle::ExtendedResponse r;
  std::vector<Motion> cells(pads.cell_count(motion.id));
  std::vector<Response> responses(cells.size());
  for (int k = 0; k < 600; ++k) {
    if (k % 3 > 0) {
      pads.step(tick, {&motion, 1}, {&r, 1});
    } else {  // makes a step's three calls, between which changes are taken
      pads.write_motions({&motion, 1}, cells);
      batch.step(tick, cells, responses);
      pads.read_responses({&motion, 1}, responses, {&r, 1});
    }
    const bristle::ExtendedResponse trial = pads.find_force(tick, motion);
    for (int i = 0; i < 3; ++i) bits.insert(bits.end(), {r.end[i], r.damping[i][i], trial.end[i]});
    // Lets the thread that runs `meanwhile` come to its turn.
    if (k % 50 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  stop = true;
  other.join();
  bits.push_back(static_cast<double>(pads.state_hash(motion.id) % 1000003));
  bits.push_back(static_cast<double>(pads.patch_count()));
  bits.push_back(static_cast<double>(batch.patch_count()) / static_cast<double>(cells.size()));
  return bits;
}

}  // namespace

TEST_CASE("While one thread steps an outline another adds, changes and removes outlines and pools of them",
          "[contracts]") {
  const auto alone = step_outline_while([](bristle::ExtendedPatches&, std::atomic<bool>&) {});
  CHECK(alone.back() == 1.0);
  CHECK(alone[alone.size() - 2] == 1.0);
  std::atomic<int> rounds{0};
  const auto beside = step_outline_while([&](bristle::ExtendedPatches& pads, std::atomic<bool>& stop) {
    const Material one = plain_material(SnapLength::exponential(dbar), SnapRule::redraw);
    const Material two = plain_material(SnapLength::exponential(2.0 * dbar), SnapRule::redraw);
    const bristle::Outline disc = bristle::Outline::disc(1e-3, bristle::Pressure::uniform);
    const bristle::KeyedOptions few = bristle::KeyedOptions{}.with_capacity(3);
    do {
      std::vector<bristle::PatchId> added;
      for (int i = 0; i < 20; ++i) added.push_back(pads.add(one, plain_options(50), disc));
      const bristle::KeyedPatches outlines(pads, one, plain_options(50), disc, few);
      const bristle::KeyedPatches points(pads.batch(), two, plain_options(50), few);
      for (const bristle::PatchId id : added) pads.set_material(id, two);
      for (const bristle::PatchId id : added) pads.remove(id);
      ++rounds;
    } while (!stop || rounds < 3);
  });
  CHECK(alone == beside);
}

TEST_CASE("An outline that was just added is there at once, with all of its cells or none", "[contracts]") {
  PatchBatch batch;
  bristle::ExtendedPatches pads(batch);
  std::atomic<std::uint64_t> newest{0};
  std::atomic<bool> failed{false}, done{false};
  std::thread stepping([&] {
    while (!done) {
      bristle::ExtendedMotion motion;
      motion.id.value = newest;
      motion.normal_load = 10.0;
      motion.displacement[0] = 0.1 * dbar;
      bristle::ExtendedResponse r;
      if (motion.id.value == 0) continue;
      pads.step(tick, {&motion, 1}, {&r, 1});
      if (has(r.status, bristle::Status::unknown_id) || !(r.end[0] < 0.0)) failed = true;
      const std::size_t cells = pads.cell_count(motion.id);
      if (batch.patch_count() % cells != 0) failed = true;
    }
  });
  const Material material = plain_material(SnapLength::uniform(0.5 * dbar, 1.5 * dbar), SnapRule::keep);
  for (int i = 0; i < 300; ++i) {
    newest = pads.add(material, plain_options(100), bristle::Outline::disc(1e-3, bristle::Pressure::uniform))
                 .value;
    std::this_thread::yield();
  }
  done = true;
  stepping.join();
  CHECK_FALSE(failed);
}

// Skips under the thread sanitizer, which supports no threads in the fork of a process with threads, and has
// no suppression for a race of oneTBB in code that was unloaded.
#if !defined(__SANITIZE_THREAD__)

TEST_CASE("A forked process makes batches of its own, whatever its parent has", "[contracts][threads]") {
  Shared parent(3);
  parent.step(2);
  const std::uint64_t expected = Shared(1).step(3);
  CHECK(in_child([&] { return Shared(3).step(3) == expected ? 0 : 1; }) == 0);
  CHECK(parent.step(1) == expected);
}

TEST_CASE("A forked process steps its parent's batch, of one thread or several, with the same bits",
          "[contracts][threads]") {
  const int threads = GENERATE(1, 3);
  Shared parent(threads);
  parent.step(2);
  const std::uint64_t expected = Shared(1).step(5);
  CHECK(in_child([&] { return parent.step(3) == expected ? 0 : 1; }) == 0);
  CHECK(parent.step(3) == expected);
}

// Loads the module (contracts_module.cpp), a shared object with a second copy of this library.
TEST_CASE("The library can be unloaded and loaded again, with and without threads", "[contracts][threads]") {
  std::uint64_t first = 0;
  std::size_t bytes = 0;
  for (int k = 0; k < 12; ++k) {
    void* const module = dlopen(BRISTLE_CONTRACTS_MODULE, RTLD_NOW | RTLD_LOCAL);
    INFO((module == nullptr ? dlerror() : ""));
    REQUIRE(module != nullptr);
    using Exercise = std::uint64_t (*)(int);
    const auto exercise = reinterpret_cast<Exercise>(dlsym(module, "bristle_contracts_exercise"));
    REQUIRE(exercise != nullptr);
    const std::uint64_t hash = exercise(1);
    CHECK(exercise(2) == hash);
    if (k == 0) first = hash;
    CHECK(hash == first);
    CHECK(dlclose(module) == 0);
    if (k == 3) bytes = bytes_in_use();
  }
  CHECK(bytes_in_use() < bytes + 200000);
}

#if BRISTLE_ASSERTS

namespace {

/// Returns the text that a child prints on stderr before it aborts; empty if it does not abort.
template <class Act>
std::string text_of_abort(Act act) {
  int ends[2];
  REQUIRE(pipe(ends) == 0);
  const int end = in_child([&] {
    dup2(ends[1], 2);
    act();
    return 0;
  });
  close(ends[1]);
  std::string text(4096, '\0');
  const ssize_t size = ::read(ends[0], text.data(), text.size());
  close(ends[0]);
  text.resize(size > 0 ? static_cast<std::size_t>(size) : 0);
  return end == 128 + SIGABRT ? text : std::string();
}

}  // namespace

TEST_CASE("Two threads that step, read or add at once end the program with the rule that they break",
          "[contracts][asserts]") {
  const char* const call = GENERATE("step", "read outlines", "add");
  INFO(call);
  const std::string text = text_of_abort([&] {
    Shared scene(1, 2000);
    bristle::ExtendedPatches pads(scene.batch);
    const Material material = plain_material(SnapLength::single(dbar), SnapRule::keep);
    const auto id =
        pads.add(material, plain_options(300), bristle::Outline::disc(1e-3, bristle::Pressure::uniform));
    const auto act = [&] {
      Motion motion = scene.motion;
      Response response;
      for (int k = 0; k < 1000000; ++k) {
        if (call[0] == 's') scene.batch.step(tick, {&motion, 1}, {&response, 1});
        if (call[0] == 'r') pads.info(id);
        if (call[0] == 'a') scene.batch.remove(scene.batch.add(material, plain_options(300)));
      }
    };
    std::thread other(act);
    act();
    other.join();
  });
  CHECK(text.find("thread rule") != std::string::npos);
}

#endif

#endif

}  // namespace bristle_test::test_contracts
