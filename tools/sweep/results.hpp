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

constexpr std::uint64_t most_rows = 10'000'000;  ///< most rows of a study

struct SweepColumn {
  std::string name;
  std::string unit;  ///< empty for a pure number or a text
  ColumnType type = ColumnType::number;
  /// Whether it is a measured time, which differs in every run and is left out of the table's hash.
  bool measured = false;

  /// Returns the column head, such as "tip.fx_mean[N]", in the form of motion files.
  std::string head() const { return unit.empty() ? name : name + '[' + unit + ']'; }
};

nlohmann::json to_json(const SweepColumn& column);

/// Sums of one [[patch]] over the steps in the window and all its copies.
struct WindowSums {
  /// Sum and highest value of elastic force over load.
  double coefficient_sum = 0.0, highest_coefficient = 0.0;
  std::uint64_t count = 0;
  double error_square_sum = 0.0, reference_square_sum = 0.0;  ///< N^2, sums of squares of end forces
  /// m, path of the first copy over the whole run
  double way[2] = {0.0, 0.0};
};

/// Run of a row, from which results are read.
struct SweepRun {
  const Scene& scene;
  const RunResult& result;
  std::vector<WindowSums> windows;  ///< sums by patch
  double cpu_s = 0.0;
};

/// Result by name: "state_hash", "tip.kinetic" of a patch, "block.x" of a body.
struct SweepResult {
  SweepColumn column;
  bool by_default = false;
  /// Returns null if the row has no such result.
  nlohmann::json (*read)(const SweepRun&, std::size_t index) = nullptr;
  std::size_t index = 0;  ///< index of the patch or body
};

/// Lists all results of the scene. `with_error`: the study has a reference.
std::vector<SweepResult> all_results(const Scene& scene, bool with_error, bool with_window);

/// Lists the results that `report` names: a full name, the name after the dot for all patches, a patch or
/// body for all of its results, "default", "all". An empty `report` means the default. Throws UserError with
/// the nearest name.
std::vector<SweepResult> chosen_results(const Scene& scene, const std::vector<std::string>& report,
                                        bool with_error, bool with_window);

}  // namespace cli
