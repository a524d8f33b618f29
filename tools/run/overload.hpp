// A run kept within a budget of time per step, or one that repeats the decisions of such a run.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <bristle/load_shedder.hpp>

#include "tools/files/output_file.hpp"
#include "tools/scene/scene_stepper.hpp"

namespace cli {

struct OverloadOptions {
  std::optional<double> budget_us;  ///< in place of the scene's
  std::string record, replay;       ///< decision files; empty: none
};

struct OverloadResult {
  double budget_s = 0.0;  ///< 0: nothing was decided by the clock
  bool replayed = false;
  std::uint64_t decisions = 0;  ///< changes of detail
  std::uint64_t late_steps = 0;
  std::uint64_t most_bristles = 0, bristles = 0;  ///< left out: at worst, and at the end
  double least_share = 1.0;                       ///< of its bristles that a patch had, at worst
  double least_pieces = 1.0;  ///< share of its pieces that an infinite brush had, at worst
  std::uint32_t patches = 0;  ///< with bristles left out at the end
  double rate_s = 0.0;        ///< s per bristle, as learnt
};

/// Between the steps of a run. Without a budget and without a replay it does nothing.
class Overload {
 public:
  /// The stepper must outlive it. Throws UserError.
  Overload(const Scene& scene, const OverloadOptions& options, SceneStepper& stepper);

  bool is_on() const noexcept { return shedder_.has_value() || result_.replayed; }
  void before_step();
  /// `time_s` as CPU time where one thread steps, by the clock on the wall else.
  void after_step(double time_s);
  /// To the record, what was decided since the last call: once a step, outside of what is timed. Throws
  /// UserError.
  void write_decisions();
  OverloadResult finish();

 private:
  void read_decisions(const std::string& path);
  void note_worst(int changed);

  SceneStepper& stepper_;
  std::optional<bristle::LoadShedder> shedder_;
  std::vector<bristle::DetailDecision> replay_;
  std::size_t next_ = 0;
  std::uint64_t step_ = 0;
  std::string record_path_;
  OutputFile record_;
  std::map<std::uint64_t, std::size_t> copy_of_;  ///< by id
  OverloadResult result_;
};

}  // namespace cli
