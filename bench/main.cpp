// Runs bristle_bench: Google Benchmark with the data needed to judge a figure, which are commit, flags, CPU,
// instruction set, and the state hash of a fixed scene. A speed-up that changes the answer changes the hash.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cinttypes>
#include <cstdio>
#include <fstream>
#include <map>
#include <memory>
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

/// Reporter that passes everything on to another reporter, and at the end prints how much faster shared steps
/// were.
class WithShares : public benchmark::BenchmarkReporter {
 public:
  explicit WithShares(std::unique_ptr<BenchmarkReporter> inner) : inner_(std::move(inner)) {}

  bool ReportContext(const Context& context) override { return inner_->ReportContext(context); }
  void ReportRuns(const std::vector<Run>& runs) override {
    inner_->ReportRuns(runs);
    for (const Run& run : runs) {
      const std::string& name = run.run_name.function_name;
      const auto slash = name.rfind('/');
      if (run.run_type != Run::RT_Iteration || run.error_occurred) continue;
      if (name.rfind("threads/share/", 0) != 0) continue;
      auto& shared = shares_[name.substr(14, slash - 14)];
      for (const char* key : {"p50_us", "p99_us"}) {
        const double time = run.counters.at(key);
        const auto [entry, fresh] = shared.try_emplace(name.substr(slash + 1) + key, time);
        // Keeps the shortest time among the repetitions of a benchmark, which the machine disturbed least.
        if (!fresh) entry->second = std::min(entry->second, time);
      }
    }
  }
  void Finalize() override {
    inner_->Finalize();
    print_shares();
  }

 private:
  void print_shares() const {
    if (shares_.empty()) return;
    std::fprintf(stderr, "\nTime of the step alone over that of the shared one (above 1: sharing pays)\n");
    std::fprintf(stderr, "%-28s %12s %12s\n", "pacing/bristles", "p50", "p99");
    for (const auto& [name, times] : shares_) {
      std::fprintf(stderr, "%-28s", name.c_str());
      for (const char* key : {"p50_us", "p99_us"}) {
        const auto alone = times.find(std::string("alone") + key);
        const auto shared = times.find(std::string("shared") + key);
        if (alone == times.end() || shared == times.end()) {
          std::fprintf(stderr, " %12s", "-");
        } else {
          std::fprintf(stderr, " %12.2f", alone->second / shared->second);
        }
      }
      std::fprintf(stderr, "\n");
    }
  }

  std::unique_ptr<BenchmarkReporter> inner_;
  std::map<std::string, std::map<std::string, double>> shares_;
};

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
    register_lanes();
    register_long_motion();
    register_presliding();
    register_threads();
    WithShares reporter{
        std::unique_ptr<benchmark::BenchmarkReporter>(benchmark::CreateDefaultDisplayReporter())};
    benchmark::RunSpecifiedBenchmarks(&reporter);
  } catch (const bristle::Error& error) {
    std::fprintf(stderr, "bristle_bench: %s\n", error.what());
    return 2;
  }
  benchmark::Shutdown();
  return 0;
}
