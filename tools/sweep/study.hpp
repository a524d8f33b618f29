// Parameter study: a scene, keys that vary, and the results of each row. A row depends only on the study and
// its index, not on the machine, the time, or other rows.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <toml++/toml.h>
#include <nlohmann/json.hpp>

#include "tools/sweep/range.hpp"
#include "tools/sweep/results.hpp"
#include "tools/sweep/sample.hpp"

namespace cli {

struct StudyOptions {
  std::string scene;              ///< file
  std::vector<std::string> vary;  ///< KEY=RANGE
  SweepSampling sampling = SweepSampling::grid;
  std::uint64_t points = 0;  ///< points of a sample; a grid has its own number
  std::uint64_t repeat = 1;  ///< rows at each point, each with its own seeds
  /// For the rows' seeds and the sample; without it and without repeats the scene's seeds are used.
  std::optional<std::uint32_t> seed;
  std::vector<std::string> set;        ///< KEY=VALUE, set in every row
  std::vector<std::string> reference;  ///< KEY=VALUE for a second run of each row, with which forces are
                                       ///< compared
  std::vector<std::string> report;     ///< results to report: sweep/results.hpp
  std::string window;                  ///< "FROM:UNTIL", s; empty: the whole run
  std::optional<std::uint64_t> steps;
};

/// Check called after every step of a row; an exception ends the row.
using StepCheck = std::function<void()>;

class Study {
 public:
  /// Reads the scene and every file that it names. Throws UserError, also for keys that the scene does not
  /// have.
  explicit Study(const StudyOptions& options);
  /// Makes a study from recipe(), perhaps on another machine. Files are written into `folder`, which must
  /// exist.
  Study(const std::string& recipe, const std::string& folder);

  /// Returns all that another process needs (options, scene and files) as JSON.
  std::string recipe() const;

  const std::string& scene_name() const { return scene_name_; }
  std::uint64_t rows() const { return points_ * options_.repeat; }
  std::uint64_t points() const { return points_; }
  /// Returns the hash of scene, files, ranges, seeds and results, as 16 hexadecimal digits.
  const std::string& hash() const { return hash_; }
  const std::vector<SweepColumn>& columns() const { return columns_; }
  const std::vector<VariedKey>& varied() const { return varied_; }
  const StudyOptions& options() const { return options_; }
  /// Returns the first line of a journal, which also holds a table's attributes.
  nlohmann::json header() const;

  /// Returns a row as JSON, an array with a cell for each column. A scene that its values make impossible
  /// gives a row too: the last cell says why. Throws UserError if this machine cannot run it (memory), and
  /// what `check` throws. Safe from several threads at once.
  std::string run_row(std::uint64_t index, const std::string& isa = {}, const StepCheck& check = {}) const;

  /// Returns the files that were read.
  std::vector<FileOption> inputs() const;

  /// Returns the scene of a row as a scene file that `bristle run` accepts.
  std::string scene_text(std::uint64_t index) const;

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
  std::string scene_file_;  ///< name without the folder
  std::string scene_text_;
  std::map<std::string, std::string> files_;   ///< text by the name in the scene
  std::map<std::string, std::string> paths_;   ///< path by the name in the scene
  std::map<std::string, std::string> stamps_;  ///< modification time and size at reading, by path
  std::string scene_name_;
  std::vector<VariedKey> varied_, set_, reference_;
  double window_from_ = 0.0, window_until_ = 1e300;  ///< s
  std::uint64_t points_ = 0;
  std::vector<double> shares_;  ///< coordinates of a sample's points, point by point
  std::vector<SweepResult> results_;
  std::vector<SweepColumn> columns_;
  std::string hash_;
};

/// Returns the FNV-1a hash as 16 hexadecimal digits.
std::string text_hash(std::string_view text);

}  // namespace cli
