#include "tools/libraries/sweep/table_file.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>

#include <fmt/format.h>

#include <bristle/deadline_monitor.hpp>

#include "tools/libraries/files/output_file.hpp"
#include "tools/libraries/files/text_file.hpp"
#include "tools/libraries/files/user_error.hpp"

namespace cli {
namespace {

using Json = nlohmann::json;

constexpr std::size_t most_table_bytes = std::size_t{1} << 36;
constexpr std::string_view comment_begin = "# unfinished table of bristle sweep: study ";

std::string csv_cell(const Json& cell) {
  if (cell.is_null()) return {};
  if (!cell.is_string()) return cell.dump();
  const std::string text = cell.get<std::string>();
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

std::string csv_row(const Json& cells) {
  std::string text;
  for (std::size_t c = 0; c < cells.size(); ++c) text += (c ? "," : "") + csv_cell(cells[c]);
  return text + '\n';
}

/// Reads the CSV row that begins at `at` and moves `at` behind its line end. Returns false, and leaves `at`,
/// if the row has no end. Cells in quotes may contain commas and line ends.
bool read_csv_row(std::string_view text, std::size_t& at, std::vector<std::string>& cells) {
  cells.assign(1, {});
  bool quoted = false;
  for (std::size_t i = at; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '"' && quoted && i + 1 < text.size() && text[i + 1] == '"') {
      cells.back() += c;
      ++i;
    } else if (c == '"') {
      quoted = !quoted;
    } else if (c == ',' && !quoted) {
      cells.emplace_back();
    } else if (c == '\n' && !quoted) {
      at = i + 1;
      return true;
    } else {
      cells.back() += c;
    }
  }
  return false;
}

/// Converts a cell of the table back to the value that Study::run_row() gave. The value is `discarded` if the
/// cell has none.
Json value_of(const std::string& cell, ColumnType type) {
  if (cell.empty()) return nullptr;
  if (type == ColumnType::hash || type == ColumnType::text) return cell;
  const Json value = Json::parse(cell, nullptr, false);
  const bool fits = type == ColumnType::whole ? value.is_number_integer() : value.is_number();
  return fits ? value : Json(Json::value_t::discarded);
}

}  // namespace

void check_table_file(const std::string& path) {
  if (path.empty() || path == "-") return;
  const std::string ending = std::filesystem::path(path).extension().string();
  if (ending == ".nc" || ending == ".h5")
    throw UserError(fmt::format(
        "--out {}: tables are CSV; in Python bristle.sweep(...).to_xarray().to_netcdf() writes NetCDF",
        path));
  std::error_code none;  // ignored error for a name that no file can have; opening the file says why
  const std::filesystem::path folder =
      std::filesystem::absolute(std::filesystem::path(path), none).parent_path();
  if (!std::filesystem::is_directory(folder, none))
    throw UserError(fmt::format("--out {}: there is no folder {}", path, folder.string()));
  if (std::filesystem::is_directory(std::filesystem::path(path), none))
    throw UserError(fmt::format("--out {}: is a folder", path));
  // Tries to open the table only if it is a regular file. The reader of a FIFO would take an empty trial for
  // the whole table.
  if (!unfinished_table(path).empty()) OutputFile trial(path);
}

std::string unfinished_table(const std::string& out) {
  if (out.empty() || out == "-" || platform::kind_of(out) == platform::Kind::other) return {};
  return out + ".part";
}

SweepRows::SweepRows(const Study& study, const std::string& unfinished)
    : header_(study.header()), columns_(study.columns()), rows_(study.rows()), path_(unfinished) {
  if (path_.empty()) return;
  const auto refuse_unless = [&](bool good, const char* what) {
    if (!good) throw UserError(fmt::format("{}: {}: {}", path_, what, std::strerror(errno)));
  };
  refuse_unless(file_.open(path_), "cannot be opened");
  try {
    if (!file_.lock())
      throw UserError(
          fmt::format("{}: another sweep writes it now; wait for its end, or take another --out", path_));
    const std::int64_t size = file_.size();
    if (size > 0) read(read_text_file(path_, most_table_bytes));
    const auto sound = static_cast<std::int64_t>(sound_bytes_);
    if (sound < size) refuse_unless(file_.cut(sound), "its torn last line cannot be dropped");
    if (sound_bytes_ == 0) append(head());
    found_ = done_;
    synced_ = bristle::DeadlineMonitor::wall_now();
  } catch (...) {
    close();
    throw;
  }
}

/// Returns the head of an unfinished table: the comment that names study and build, and the names of the
/// columns.
std::string SweepRows::head() const {
  Json names = Json::array();
  for (const SweepColumn& column : columns_) names.push_back(column.head());
  return fmt::format("{}{}, commit {}\n", comment_begin, header_["study"].get<std::string>(),
                     header_["commit"].get<std::string>()) +
         csv_row(names);
}

void SweepRows::read(const std::string& text) {
  const std::string ours = head();
  if (ours.starts_with(text) && text.size() < ours.size()) return;  // a kill cut the head short
  if (!text.starts_with(ours)) {
    if (!text.starts_with(comment_begin))
      throw UserError(fmt::format("{}: is no unfinished table of bristle sweep; move it away", path_));
    throw UserError(
        fmt::format("{}: is the unfinished table of another study or build; this one is study {}, commit {}. "
                    "Take another --out, or delete it",
                    path_, header_["study"].get<std::string>(), header_["commit"].get<std::string>()));
  }
  sound_bytes_ = ours.size();
  std::vector<std::string> texts;
  while (read_csv_row(text, sound_bytes_, texts)) {
    Json cells = Json::array();
    for (std::size_t c = 0; c < std::min(texts.size(), columns_.size()); ++c)
      cells.push_back(value_of(texts[c], columns_[c].type));
    const bool sound =
        texts.size() == columns_.size() && cells[0].is_number_unsigned() &&
        cells[0].get<std::uint64_t>() < rows_.size() &&
        std::none_of(cells.begin(), cells.end(), [](const Json& c) { return c.is_discarded(); });
    if (!sound)
      throw UserError(fmt::format(
          "{}:{}: is no row of this study; delete the file to begin again", path_,
          std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(sound_bytes_), '\n')));
    take(cells);
  }
}

/// Stores a row unless it is there already; returns whether it was new.
bool SweepRows::take(const Json& cells) {
  std::string& place = rows_[cells[0].get<std::uint64_t>()];
  if (!place.empty()) return false;
  place = cells.dump(-1, ' ', false, Json::error_handler_t::replace);
  ++done_;
  return true;
}

void SweepRows::add(const std::string& row) {
  const Json cells = Json::parse(row);
  if (take(cells) && file_.is_open()) append(csv_row(cells));
}

std::vector<std::uint64_t> SweepRows::missing() const {
  std::vector<std::uint64_t> indices;
  for (std::uint64_t i = 0; i < rows_.size(); ++i)
    if (rows_[i].empty()) indices.push_back(i);
  return indices;
}

std::string SweepRows::table_hash() const {
  const bool measured =
      std::any_of(columns_.begin(), columns_.end(), [](const SweepColumn& c) { return c.measured; });
  const auto lasting = [&](const std::string& row) {
    const Json cells = Json::parse(row);
    Json kept = Json::array();
    for (std::size_t c = 0; c < columns_.size(); ++c)
      if (!columns_[c].measured) kept.push_back(cells[c]);
    return kept.dump();
  };
  std::string all;
  for (const std::string& row : rows_) all += (row.empty() || !measured ? row : lasting(row)) + '\n';
  return text_hash(all);
}

void SweepRows::append(const std::string& text) {
  if (!file_.append(text))
    throw UserError(fmt::format("{}: cannot be written: {}", path_, std::strerror(errno)));
  // Forces the rows to the disk once a second. A killed process then loses nothing, and a power failure costs
  // at most the rows of a second.
  const double now = bristle::DeadlineMonitor::wall_now();
  if (now - synced_ < 1.0) return;
  file_.flush();
  synced_ = now;
}

void SweepRows::close() { file_.close(); }

void SweepRows::remove() {
  if (!path_.empty()) platform::remove_file(path_.c_str());
}

std::string SweepRows::csv() const {
  const std::string with_comment = head();
  std::string text = with_comment.substr(with_comment.find('\n') + 1);
  for (const std::string& row : rows_)
    if (!row.empty()) text += csv_row(Json::parse(row));
  return text;
}

void SweepRows::write(const std::string& path) const { OutputFile(path).write(csv()); }

}  // namespace cli
