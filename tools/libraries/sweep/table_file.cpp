#include "tools/libraries/sweep/table_file.hpp"

#include <filesystem>
#include <system_error>
#include <vector>

#include <fmt/format.h>

#include "tools/libraries/files/output_file.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/platform/platform.hpp"
#include "tools/libraries/sweep/results.hpp"

namespace cli {
namespace {

using Json = nlohmann::json;

std::string csv_cell(const Json& cell) {
  if (cell.is_null()) return {};
  if (!cell.is_string()) return cell.dump();
  const std::string text = cell.get<std::string>();
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

}  // namespace

void check_table_file(const std::string& path) {
  if (path == "-") return;
  const std::string ending = platform::path_of(path).extension().string();
  if (ending == ".nc" || ending == ".h5")
    throw UserError(fmt::format(
        "--out {}: tables are CSV; in Python bristle.sweep(...).to_xarray().to_netcdf() writes NetCDF",
        path));
  std::error_code none;  // takes the error for a name that no file can have; opening the file says why
  const std::filesystem::path folder = std::filesystem::absolute(platform::path_of(path)).parent_path();
  if (!std::filesystem::is_directory(folder, none))
    throw UserError(fmt::format("--out {}: there is no folder {}", path, folder.string()));
  if (std::filesystem::is_directory(platform::path_of(path), none))
    throw UserError(fmt::format("--out {}: is a folder", path));
  // Tries to open regular files only, since the reader of a FIFO would take an empty trial for the whole
  // table.
  if (!std::filesystem::exists(platform::path_of(path), none) ||
      std::filesystem::is_regular_file(platform::path_of(path), none))
    OutputFile trial(path);
}

std::string table_csv(const SweepRows& rows) {
  std::string text;
  const std::vector<SweepColumn>& columns = rows.columns();
  for (std::size_t c = 0; c < columns.size(); ++c) text += (c ? "," : "") + csv_cell(columns[c].head());
  text += '\n';
  for (const std::string& row : rows.rows()) {
    if (row.empty()) continue;
    const Json cells = Json::parse(row);
    for (std::size_t c = 0; c < cells.size(); ++c) text += (c ? "," : "") + csv_cell(cells[c]);
    text += '\n';
  }
  return text;
}

void write_table_file(const SweepRows& rows, const std::string& path) {
  OutputFile(path).write(table_csv(rows));
}

}  // namespace cli
