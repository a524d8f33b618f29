// Computes the results in a row of a study, as columns with units.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tools/run/run.hpp"
#include "tools/scene/scene.hpp"

namespace cli {

enum class ColumnType { number, whole, hash, text };

constexpr std::uint64_t most_rows = 10'000'000;  ///< largest number of rows in a study

struct SweepColumn {
  std::string name;
  std::string unit;  ///< unit of the column; empty: a pure number, or a text
  ColumnType type = ColumnType::number;
  /// Whether the column holds a measured time, which differs in every run and is left out of the table's
  /// hash.
  bool measured = false;

  /// Returns the header of the column, such as "tip.fx_mean[N]", in the form of motion files.
  std::string head() const { return unit.empty() ? name : name + '[' + unit + ']'; }
};

nlohmann::json to_json(const SweepColumn& column);

/// Sums over the steps in the time window and over all copies of one [[patch]].
struct WindowSums {
  /// Sum and highest value of elastic force over normal load.
  double coefficient_sum = 0.0, highest_coefficient = 0.0;
  std::uint64_t count = 0;
  /// N^2, of the force errors and of the reference's forces.
  double error_square_sum = 0.0, reference_square_sum = 0.0;
  /// m, path of the patch's first copy along x and y, over the whole run
  double way[2] = {0.0, 0.0};
};

/// Finished run of a row's scene, from which its results are computed.
struct SweepRun {
  const Scene& scene;
  const RunResult& result;
  std::vector<WindowSums> windows;  ///< sums over the time window, by the index of the patch
  double cpu_s = 0.0;
};

/// Result of a row, by name: "state_hash", "tip.kinetic" of the patch `tip`, "block.x" of the body `block`.
struct SweepResult {
  SweepColumn column;
  bool by_default = false;
  /// Computes the result from a run; null if this run has no such result.
  nlohmann::json (*read)(const SweepRun&, std::size_t index) = nullptr;
  std::size_t index = 0;  ///< index of the patch or body that the result belongs to
};

/// Lists all results that the scene can give. `with_error`: the study compares with a reference run.
std::vector<SweepResult> all_results(const Scene& scene, bool with_error, bool with_window);

/// Lists the results that `report` names: by full name, by the name after the dot for all patches, by a patch
/// or body for all of its results, or by "default" or "all". An empty `report` means the default. Throws
/// UserError, which proposes the nearest name.
std::vector<SweepResult> chosen_results(const Scene& scene, const std::vector<std::string>& report,
                                        bool with_error, bool with_window);

}  // namespace cli
