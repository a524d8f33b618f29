// Keeps a run within a time budget per step, or replays the decisions of such a run.
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
  std::optional<double> budget_us;  ///< us, time budget in place of the scene's
  std::string record, replay;       ///< files of decisions; empty: none
};

struct OverloadResult {
  double budget_s = 0.0;  ///< s, time budget; 0: the clock decided nothing
  bool replayed = false;
  std::uint64_t decisions = 0;  ///< number of changes of detail
  std::uint64_t late_steps = 0;
  std::uint64_t most_bristles = 0, bristles = 0;  ///< bristles left out: most, and at the end
  double least_share = 1.0;                       ///< least share of its bristles that a patch had
  double least_pieces = 1.0;                      ///< least share of its pieces that an infinite brush had
  std::uint32_t patches = 0;                      ///< patches with bristles left out at the end
  double rate_s = 0.0;                            ///< s per bristle, as measured during the run
};

/// Controller of the load, called between the steps of a run. Without a budget and a replay it does nothing.
class Overload {
 public:
  /// Starts the control of `stepper`, which must outlive this. Throws UserError.
  Overload(const Scene& scene, const OverloadOptions& options, SceneStepper& stepper);

  bool is_on() const noexcept { return shedder_.has_value() || result_.replayed; }
  void before_step();
  /// Takes the time of a step: CPU time if one thread steps, else wall time.
  void after_step(double time_s);
  /// Writes the decisions since the last call to the record. Call it once a step, outside the timing. Throws
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
  std::map<std::uint64_t, std::size_t> copy_of_;  ///< index of a copy by its patch id
  OverloadResult result_;
};

}  // namespace cli
