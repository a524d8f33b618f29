// Keeps the steps of a run within a time budget by leaving out bristles, or repeats the recorded changes of
// such a run.
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
  std::optional<double> budget_us;  ///< us per step; none: budget of the scene
  std::string record, replay;       ///< files of the changes in bristles; empty: none
};

struct OverloadResult {
  double budget_s = 0.0;  ///< s per step; 0: none, so no bristle was left out for time
  bool replayed = false;
  std::uint64_t decisions = 0;  ///< number of changes in how many bristles a patch uses
  std::uint64_t late_steps = 0;
  std::uint64_t most_bristles = 0, bristles = 0;  ///< number of bristles left out: the highest of the run,
                                                  ///< and that at its end
  double least_share = 1.0;                       ///< least share of its bristles that a patch kept
  double least_pieces = 1.0;                      ///< least share of its pieces that an infinite brush kept
  std::uint32_t patches = 0;                      ///< number of patches that lack bristles at the end of the
                                                  ///< run
  double rate_s = 0.0;                            ///< s per bristle and step, measured during the run
};

/// Leaves out and restores bristles between the steps of a run, to keep within the budget, or as a recorded
/// run did. With neither a budget nor a record it does nothing.
class Overload {
 public:
  /// Starts to control the patches of `stepper`, which must outlive this object. Throws UserError.
  Overload(const Scene& scene, const OverloadOptions& options, SceneStepper& stepper);

  bool is_on() const noexcept { return shedder_.has_value() || result_.replayed; }
  void before_step();
  /// Takes the time that a step took: CPU time if one thread steps, else wall time.
  void after_step(double time_s);
  /// Appends the changes since the last call to the record. Call it once a step, outside the timed part.
  /// Throws UserError.
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
  std::map<std::uint64_t, std::size_t> copy_of_;  ///< index of a patch's copy, by the patch's id
  OverloadResult result_;
};

}  // namespace cli
