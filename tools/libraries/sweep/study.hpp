// Parameter study: a scene, keys that vary, and the results of each row (one run). A row depends only on the
// study and its index, not on the machine, the time, or other rows.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <toml++/toml.h>
#include <nlohmann/json.hpp>

#include "tools/libraries/sweep/range.hpp"
#include "tools/libraries/sweep/results.hpp"

namespace cli {

struct StudyOptions {
  std::string scene;              ///< name of the scene file
  std::vector<std::string> vary;  ///< keys that vary, each as KEY=RANGE
  std::uint64_t repeat = 1;       ///< number of rows at each point, which differ in their seeds

  /// Seed from which the seeds of the rows' scenes follow. Without a seed, and without repeats, rows keep the
  /// scene's own.
  std::optional<std::uint32_t> seed;
  std::vector<std::string> set;  ///< settings that hold in every row, each as KEY=VALUE

  /// Settings that make a reference run for each row. The forces of the row are compared with the forces of
  /// that run.
  std::vector<std::string> reference;
  std::vector<std::string> report;  ///< names of the results to report (results.hpp)
  std::string window;               ///< time window of results, "FROM:UNTIL" in s; empty: all
  std::optional<std::uint64_t> steps;
};

/// Function that is called after every step of a row. An exception that it throws ends the row.
using StepCheck = std::function<void()>;

class Study {
 public:
  /// Reads the scene and every file that it names. Throws UserError, also for varied keys that the scene does
  /// not have.
  explicit Study(const StudyOptions& options);
  /// Makes the study that recipe() describes, perhaps on another machine. Writes its motion files into
  /// `folder`, which must exist.
  Study(const std::string& recipe, const std::string& folder);

  /// Returns as JSON all that another process needs to run rows of the study: options, scene and files.
  std::string recipe() const;

  std::uint64_t rows() const { return points_ * options_.repeat; }
  std::uint64_t points() const { return points_; }
  /// Returns the hash of scene, motion files, ranges, seeds and result names, as 16 hexadecimal digits.
  const std::string& hash() const { return hash_; }
  const std::vector<SweepColumn>& columns() const { return columns_; }
  const std::vector<VariedKey>& varied() const { return varied_; }
  const StudyOptions& options() const { return options_; }
  /// Returns a description of the study, which stands in the first line of an unfinished table and in
  /// reports.
  nlohmann::json header() const;

  /// Runs a row. Returns it as a JSON array with a cell for each column; if the row's values make its scene
  /// impossible, the last cell says why. Throws UserError if this machine cannot run it (memory), and
  /// whatever `check` throws. May be called from several threads at once.
  std::string run_row(std::uint64_t index, const std::string& isa = {}, const StepCheck& check = {}) const;

  /// Lists the files that the study read, which outputs must not overwrite.
  std::vector<FileOption> inputs() const;

 private:
  void prepare();
  void find_points();
  void check_keys() const;
  void collect_files();
  std::string study_hash() const;
  std::vector<SweepValue> values_of(std::uint64_t index) const;
  std::optional<std::uint32_t> seed_of(std::uint64_t index) const;
  toml::table document() const;
  void set_values(toml::table& root, const std::vector<SweepValue>& values) const;
  void set_seeds(toml::table& root, std::uint32_t seed) const;
  toml::table row_document(std::uint64_t index, bool reference) const;
  Scene scene_from(toml::table root) const;
  std::vector<nlohmann::json> results_of(std::uint64_t index, const std::string& isa,
                                         const StepCheck& check) const;
  void check_files() const;
  std::string without_paths(std::string message) const;

  StudyOptions options_;
  std::string scene_file_;  ///< name of the scene's file without its folder
  std::string scene_text_;
  std::map<std::string, std::string> files_;   ///< text of each motion file, by its name in the scene
  std::map<std::string, std::string> paths_;   ///< path of each motion file, by its name in the scene
  std::map<std::string, std::string> stamps_;  ///< time and size of each file when read, by path
  std::string scene_name_;
  std::vector<VariedKey> varied_, set_, reference_;
  /// Time window in which results are taken, s: beginning and end.
  double window_from_ = 0.0, window_until_ = 1e300;
  std::uint64_t points_ = 0;
  std::vector<SweepResult> results_;
  std::vector<SweepColumn> columns_;
  std::string hash_;
};

/// Returns the 64-bit FNV-1a hash of a text, as 16 hexadecimal digits.
std::string text_hash(std::string_view text);

}  // namespace cli
