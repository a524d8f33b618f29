// What scenes of beds and of joints have in common: parts that each follow a path of their own. Only
// `bristle run` steps them.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "tools/libraries/files/toml_table.hpp"
#include "tools/libraries/files/toml_text.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/reports/conditions.hpp"
#include "tools/libraries/reports/report_tables.hpp"
#include "tools/libraries/run/run.hpp"
#include "tools/libraries/scene/scene_stepper.hpp"
#include "tools/libraries/scene/scene_table.hpp"

namespace cli {

/// Run a scene with beds (contacts of elastic bodies), or with joints, on prescribed paths, given by its
/// text, and write the reports. Return false, without running, if the scene has no table [[bed]], or
/// [[joint]]. Throw UserError. tools/scenes/README.md describes beds, tools/scenes/arm.toml joints.
bool run_bed_scene(const RunOptions& options, const std::string& text);
bool run_joint_scene(const RunOptions& options, const std::string& text);

/// Row of a path: numbers at a time t, s. Between rows they are linear.
template <std::size_t n>
struct PathRow {
  double t = 0.0;
  std::array<double, n> at{};
};

template <std::size_t n>
PathRow<n> row_at(const std::vector<PathRow<n>>& rows, double t) {
  const auto after = std::upper_bound(rows.begin(), rows.end(), t,
                                      [](double time, const PathRow<n>& row) { return time < row.t; });
  if (after == rows.begin()) return rows.front();
  if (after == rows.end()) return rows.back();
  const PathRow<n>&a = *(after - 1), &b = *after;
  PathRow<n> row{t, {}};
  for (std::size_t i = 0; i < n; ++i) row.at[i] = a.at[i] + (t - a.t) / (b.t - a.t) * (b.at[i] - a.at[i]);
  return row;
}

/// Reads the key `path`. `read_row(table, row, first)` reads a row's keys but `t`; the row begins with the
/// values of the last one, which stay for keys that it does not have.
template <std::size_t n, class ReadRow>
std::vector<PathRow<n>> read_path(const TomlTable& parent, const ReadRow& read_row) {
  std::vector<PathRow<n>> rows;
  for (const TomlTable& table : parent.tables("path")) {
    PathRow<n> row = rows.empty() ? PathRow<n>{} : rows.back();
    read_row(table, row, rows.empty());
    row.t = table.number("t", {0.0, 1e6, false, "s"});
    if (!rows.empty() && row.t < rows.back().t) table.fail("t", "comes before the row above");
    rows.push_back(row);
  }
  if (rows.empty()) parent.fail("path", "is missing, or holds no rows");
  return rows;
}

template <class Part>
struct PartScene {
  Scene scene;  ///< scene without its beds or joints, and so without patches
  std::vector<Part> parts;
};

/// Parses a scene that has tables [[kind]]. Returns nothing for a scene without one. Throws UserError with
/// file, line and key.
template <class Part, class ReadPart>
std::optional<PartScene<Part>> parse_part_scene(const std::string& text, const std::string& path,
                                                const char* kind, const ReadPart& read_part) {
  // Searches for the word first. Otherwise most scenes, which lack it, would be parsed twice.
  if (text.find(kind) == std::string::npos) return std::nullopt;
  const toml::table root = parse_toml(text, path);
  if (!root.contains(kind)) return std::nullopt;
  const TomlTable table(path, root, "");
  table.allow({"scene", kind});
  PartScene<Part> result;
  result.scene.file = path;
  if (!table.has("scene")) throw UserError(fmt::format("{}: table [scene] is missing", path));
  read_scene_table(table.table("scene"), result.scene);
  double longest = 0.0;
  for (TomlTable& t : table.tables(kind)) {
    Part part;
    part.name = t.name();
    part.where = t.where();
    read_part(t, part);
    longest = std::max(longest, part.path.back().t);
    if (std::any_of(result.parts.begin(), result.parts.end(),
                    [&](const Part& other) { return other.name == part.name; }))
      t.fail("name", fmt::format("'{}' appears twice", part.name));
    result.parts.push_back(std::move(part));
  }
  if (!result.scene.duration) result.scene.duration = longest;
  return result;
}

/// Refuses options that a scene of parts does not take.
inline void check_part_options(const RunOptions& options, const char* kind) {
  if (options.realtime || !options.trace.empty() || options.bristles || !options.restore_state.empty() ||
      !options.save_state.empty() || !options.plot.empty() || !options.html.empty())
    throw UserError(fmt::format(
        "{}: has [[{}]]: --csv, --json, --steps, --threads and --isa go with it, other options do not",
        options.scene, kind));
}

/// Begins a JSON report on the parts `kind`, such as "beds", with an empty list of them.
inline Json begin_report(const std::string& kind, const Scene& scene, std::uint64_t steps) {
  return {{"schema", "bristle-" + kind + "-1"},
          {"conditions", to_json(conditions())},
          {"scene", {{"name", scene.name}, {"file", scene.file}, {"dt", scene.dt}}},
          {"steps", steps},
          {kind, Json::array()}};
}
/// Ends a report with the state hash of the parts, and how they were stepped.
template <class Batch>
void end_report(Json& report, const Batch& batch) {
  report["state_hash"] = fmt::format("{:016x}", batch.state_hash());
  report["conditions"]["isa"] = batch.isa();
  report["conditions"]["threads"] = batch.threads();
}

}  // namespace cli
