// Computes the results that a row of a parameter study reports. Each result is a column with a unit.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tools/libraries/run/run.hpp"
#include "tools/libraries/scene/scene.hpp"

namespace cli {

enum class ColumnType { number, whole, hash, text };

constexpr std::uint64_t most_rows = 10'000'000;  ///< limit of the number of rows in a study

struct SweepColumn {
  std::string name;
  std::string unit;  ///< unit of the values; empty: a pure number or a text
  ColumnType type = ColumnType::number;
  /// Whether the values are measured times. They differ in every run, so they are left out of the table's
  /// hash.
  bool measured = false;

  /// Returns the column's header with its unit, such as "tip.fx_mean[N]".
  std::string head() const { return unit.empty() ? name : name + '[' + unit + ']'; }
};

nlohmann::json to_json(const SweepColumn& column);

/// Sums for one patch of the scene, over all its copies and over the steps in the study's time window.
struct WindowSums {
  /// Sum and highest value of elastic force over normal load. The sum is over `count` steps of copies.
  double coefficient_sum = 0.0, highest_coefficient = 0.0;
  std::uint64_t count = 0;
  /// Sums of squares of the force's error, and of the reference run's force, N^2.
  double error_square_sum = 0.0, reference_square_sum = 0.0;
  /// Path of the patch's first copy along x and y, over the whole run, m.
  double path[2] = {0.0, 0.0};

  /// Adds path, coefficients and error to the results of the patch.
  void write(nlohmann::ordered_json& patch) const;
};

/// Result that a row can report: "state_hash", "tip.kinetic" (of patch `tip`), "block.x" (body `block`).
struct SweepResult {
  SweepColumn column;
  bool by_default = false;
  std::string pointer;  ///< JSON pointer to the value in the run's results

  /// Reads the result from the results of a run. It is JSON null if the run does not have it.
  nlohmann::json read(const nlohmann::ordered_json& run) const;
};

/// Lists all results that the scene can give. With `with_error` they include those that compare with a
/// reference run.
std::vector<SweepResult> all_results(const Scene& scene, bool with_error, bool with_window);

/// Lists the results that the user asks for in `report`: by full name, by the name after the dot (for all
/// patches), by a patch or body (all its results), or by "default" or "all". An empty `report` means
/// "default". Throws a UserError that proposes the nearest name.
std::vector<SweepResult> chosen_results(const Scene& scene, const std::vector<std::string>& report,
                                        bool with_error, bool with_window);

}  // namespace cli
