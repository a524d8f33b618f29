// Runs bristle_bench: Google Benchmark with the data needed to judge a figure, which are commit, flags, CPU,
// instruction set, and the state hash of a fixed scene. A speed-up that changes the answer changes the hash.
#include <benchmark/benchmark.h>

#include <cinttypes>
#include <cstdio>
#include <fstream>
#include <string>

#include "measured_scene.hpp"
#include "suites.hpp"

#ifndef BRISTLE_GIT_COMMIT
#define BRISTLE_GIT_COMMIT "unknown"
#endif
#ifndef BRISTLE_BUILD_FLAGS
#define BRISTLE_BUILD_FLAGS "unknown"
#endif

namespace {

using namespace bristle_bench;

std::string cpu_model() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    const auto colon = line.find(": ");
    if (line.rfind("model name", 0) == 0 && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "unknown";
}

std::string usable_instruction_sets() {
  std::string names;
  for (const bristle::IsaInfo& isa : bristle::instruction_sets()) {
    if (isa.usable) names += names.empty() ? isa.name : std::string(" ") + isa.name;
  }
  return names;
}

/// Returns the hash of a short scene that uses every kernel variant of this build: load steps, turns, long
/// and short motions.
std::string scene_hash() {
  PatchBatch batch;
  std::vector<Motion> motions;
  for (SnapRule rule : rules()) {
    for (int axes : axes_counts()) {
      for (Outputs outputs : output_sets()) {
        Motion motion;
        motion.id = batch.add(plain_material(usual_law(), rule),
                              plain_options(900, axes, Precision::single, outputs));
        motions.push_back(motion);
      }
    }
  }
  batch.warm_up();
  std::vector<Response> responses(motions.size());
  const double x[] = {0.3, 1.7, -0.4, 0.01, 12.0, -0.25};
  const double y[] = {0.1, -0.6, 0.9, 0.02, -5.0};
  for (std::size_t step = 0; step < 200; ++step) {
    for (std::size_t i = 0; i < motions.size(); ++i) {
      const bool one_axis = i / output_sets().size() % 2 == 0;
      motions[i].displacement[0] = x[step % 6] * dbar;
      motions[i].displacement[1] = one_axis ? 0.0 : y[step % 5] * dbar;
      motions[i].normal_load = step % 50 < 25 ? 900.0 : 612.5;
    }
    batch.step(tick, motions, responses);
  }
  char text[17];
  std::snprintf(text, sizeof text, "%016" PRIx64, batch.state_hash());
  return text;
}

void add_context() {
  benchmark::AddCustomContext("bristle_version", bristle::library_version());
  benchmark::AddCustomContext("bristle_commit", BRISTLE_GIT_COMMIT);
  benchmark::AddCustomContext("bristle_flags", BRISTLE_BUILD_FLAGS);
  benchmark::AddCustomContext("cpu", cpu_model());
  benchmark::AddCustomContext("isa", PatchBatch().isa());
  benchmark::AddCustomContext("isa_usable", usable_instruction_sets());
  benchmark::AddCustomContext("state_hash", scene_hash());
  benchmark::AddCustomContext(
      "note",
      "a warning that 'the library was built as DEBUG' speaks of Debian's Google Benchmark, "
      "which always says so; bristle's own build type is in bristle_flags");
}

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  try {
    add_context();
    register_kernels();
    register_beds();
    register_cohorts();
    register_joints();
    register_keys();
    register_long_motion();
    register_presliding();
    register_threads();
    benchmark::RunSpecifiedBenchmarks();
  } catch (const bristle::Error& error) {
    std::fprintf(stderr, "bristle_bench: %s\n", error.what());
    return 2;
  }
  benchmark::Shutdown();
  return 0;
}
