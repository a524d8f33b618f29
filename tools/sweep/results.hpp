// Results of a row of a study: columns with units.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tools/run/run.hpp"
#include "tools/scene/scene.hpp"

namespace cli {

enum class ColumnType { number, whole, hash, text };

constexpr std::uint64_t most_rows = 10'000'000;  ///< of a study

struct SweepColumn {
  std::string name;
  std::string unit;  ///< empty: a pure number, or a text
  ColumnType type = ColumnType::number;
  bool measured = false;  ///< a time: another in every run, and no part of the table's hash

  /// "tip.fx_mean[N]", as the heads of motion files are.
  std::string head() const { return unit.empty() ? name : name + '[' + unit + ']'; }
};

nlohmann::json to_json(const SweepColumn& column);

/// Of one [[patch]], over the steps in the window and all its copies.
struct WindowSums {
  double coefficient_sum = 0.0, highest_coefficient = 0.0;  ///< elastic force over load
  std::uint64_t count = 0;
  double error_square_sum = 0.0, reference_square_sum = 0.0;  ///< of end forces, N^2
  double way[2] = {0.0, 0.0};                                 ///< m, of the first copy, over the whole run
};

/// A run, and what a row reads of it.
struct SweepRun {
  const Scene& scene;
  const RunResult& result;
  std::vector<WindowSums> windows;  ///< by patch
  double cpu_s = 0.0;
};

/// A result by name: "state_hash", "tip.kinetic" of a patch, "block.x" of a body.
struct SweepResult {
  SweepColumn column;
  bool by_default = false;
  nlohmann::json (*read)(const SweepRun&, std::size_t index) = nullptr;  ///< null where there is none
  std::size_t index = 0;                                                 ///< of the patch or body
};

/// All results of the scene. `with_error`: the study has a reference.
std::vector<SweepResult> all_results(const Scene& scene, bool with_error, bool with_window);

/// Results that `report` chooses: a full name, the name after the dot for all patches, a patch or body for
/// all of it, "default", "all". Nothing chosen: the default. Throws UserError with the nearest name.
std::vector<SweepResult> chosen_results(const Scene& scene, const std::vector<std::string>& report,
                                        bool with_error, bool with_window);

}  // namespace cli
