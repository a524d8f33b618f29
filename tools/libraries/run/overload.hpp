// Keeps the steps of a run within a time budget by leaving out bristles, or repeats what a recorded run left
// out.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <bristle/load_shedder.hpp>

#include "tools/libraries/files/output_file.hpp"
#include "tools/libraries/scene/scene_stepper.hpp"

namespace cli {

struct OverloadOptions {
  std::optional<double> budget_us;  ///< time budget, us per step; none: as in the scene
  std::string record, replay;       ///< file that gets each change of a patch's bristles in use,
                                    ///< and file from which those changes are repeated
};

struct OverloadResult {
  double budget_s = 0.0;  ///< time budget, s per step; 0: none, so that all bristles stayed
  bool replayed = false;
  std::uint64_t decisions = 0;  ///< number of changes of a patch's bristles in use
  std::uint64_t late_steps = 0;
  std::uint64_t most_bristles = 0, bristles = 0;  ///< number of bristles left out: largest of the run, and at
                                                  ///< its end
  double least_share = 1.0;                       ///< least share of bristles in use, over patches and steps
  double least_pieces = 1.0;                      ///< least share of pieces in use, over infinite patches
  std::uint32_t patches = 0;                      ///< number of patches without all their bristles at the
                                                  ///< end
  double rate_s = 0.0;                            ///< time per bristle and step, measured in the run, s
};

/// Leaves out and restores bristles between the steps of a run, either to keep within a time budget or as a
/// recorded run did. Without budget and record it does nothing.
class Overload {
 public:
  /// Starts to control the patches of `stepper`, which must outlive this object. Throws UserError.
  Overload(const Scene& scene, const OverloadOptions& options, SceneStepper& stepper);

  bool is_on() const noexcept { return shedder_.has_value() || result_.replayed; }
  void before_step();
  /// Tells how long a step took, s: CPU time if one thread steps, else wall time.
  void after_step(double time_s);
  /// Appends the changes since its last call to the record file. Call it once per step, outside the timed
  /// part. Throws UserError.
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
