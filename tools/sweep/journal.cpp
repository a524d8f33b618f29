#include "tools/sweep/journal.hpp"

#include <cerrno>
#include <chrono>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <fmt/format.h>

#include "tools/files/text_file.hpp"
#include "tools/files/user_error.hpp"
#include "tools/reports/json_text.hpp"
#include "tools/sweep/results.hpp"
#include "tools/sweep/study.hpp"

namespace cli {
namespace {

using Json = nlohmann::json;

constexpr std::size_t most_journal_bytes = std::size_t{1} << 36;

double seconds_now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::string line_of(const std::string& json) { return text_hash(json) + ' ' + json + '\n'; }

/// JSON of a line; empty where the line is torn.
std::string json_of(std::string_view line) {
  if (line.size() < 18 || line[16] != ' ') return {};
  const std::string_view json = line.substr(17);
  return text_hash(json) == line.substr(0, 16) ? std::string(json) : std::string();
}

/// A row without what was measured.
Json lasting(const std::string& row, const std::vector<SweepColumn>& columns) {
  const Json cells = Json::parse(row);  // was checked when it was added
  Json kept = Json::array();
  for (std::size_t c = 0; c < columns.size() && c < cells.size(); ++c)
    if (!columns[c].measured) kept.push_back(cells[c]);
  return kept;
}

bool has_measured(const std::vector<SweepColumn>& columns) {
  for (const SweepColumn& column : columns)
    if (column.measured) return true;
  return false;
}

void check_header(const Json& header, const std::string& path) {
  const auto is_text = [&header](const char* name) {
    return !header.contains(name) || header[name].is_string();
  };
  bool whole = header.is_object() && header.value("schema", "") == "bristle-sweep-journal-1" &&
               header.contains("study") && header.contains("rows") && header["rows"].is_number_unsigned() &&
               header.contains("columns") && header["columns"].is_array() && is_text("study") &&
               is_text("scene") && is_text("commit");
  if (whole)
    for (const Json& vary : header.value("vary", Json::array())) whole = whole && vary.is_string();
  if (!whole) throw UserError(fmt::format("{}: is no journal of bristle sweep", path));
}

struct Contents {
  SweepRows rows;
  std::size_t sound_bytes = 0;  ///< up to the end of the last whole line
};

/// `header`: of the study that will go on with the journal; null where it is only read.
Contents parse_lines(const std::string& text, const std::string& path, const Json* header) {
  Contents contents;
  bool first = true;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = text.find('\n', at);
    const std::string json =
        end == std::string::npos ? std::string() : json_of(std::string_view(text).substr(at, end - at));
    if (first) {
      if (json.empty()) break;
      contents.rows.header = parse_json(json, path);
      check_header(contents.rows.header, path);
      const auto rows = contents.rows.header["rows"].get<std::uint64_t>();
      if (rows > most_rows) throw UserError(fmt::format("{}: has more than {} rows", path, most_rows));
      contents.rows.rows.resize(rows);
      first = false;
    } else if (!json.empty()) {
      contents.rows.add(json, path);
    }
    if (end == std::string::npos) break;
    contents.sound_bytes = at = end + 1;
  }
  // A first line that was torn is the beginning of ours; anything else is some other file.
  if (first && !(header != nullptr && line_of(header->dump()).starts_with(text)))
    throw UserError(fmt::format("{}: is no journal of bristle sweep", path));
  return contents;
}

/// A line with the right hash was not torn, but may hold anything: the hash says nothing of who wrote it.
Contents parse_journal(const std::string& text, const std::string& path, const Json* header = nullptr) {
  try {
    return parse_lines(text, path, header);
  } catch (const Json::exception&) {
    throw UserError(fmt::format("{}: is no journal of bristle sweep", path));
  }
}

/// Whether a cell is of its column's kind; null is none.
bool fits(const Json& cell, const SweepColumn& column) {
  if (cell.is_null()) return true;
  switch (column.type) {
    case ColumnType::number:
      return cell.is_number();
    case ColumnType::whole:
      return cell.is_number_integer();
    default:
      return cell.is_string();
  }
}

std::string study_text(const Json& header) {
  std::string text =
      fmt::format("{} (scene {}", header["study"].get<std::string>(), header.value("scene", "?"));
  for (const Json& vary : header.value("vary", Json::array())) text += ", " + vary.get<std::string>();
  return text + ")";
}

void check_same_study(const Json& ours, const Json& theirs, const std::string& path) {
  if (ours["study"] == theirs["study"]) {
    if (ours.value("commit", "") != theirs.value("commit", ""))
      print_note(
          fmt::format("bristle: {}: rows of commit {} stand beside those of {}; their bits may differ\n",
                      path, theirs.value("commit", "?"), ours.value("commit", "?")));
    return;
  }
  throw UserError(
      fmt::format("{}: is of another study, {}; this one is {}. Scene, ranges, seeds and results must be the "
                  "same; else take "
                  "another --out, or delete the journal",
                  path, study_text(theirs), study_text(ours)));
}

}  // namespace

std::vector<SweepColumn> columns_of(const Json& header) {
  std::vector<SweepColumn> columns;
  try {
    for (const Json& column : header.at("columns")) columns.push_back(column_of(column));
  } catch (const Json::exception&) {
    throw UserError("a journal's columns cannot be read");
  }
  return columns;
}

void SweepRows::add(std::string row, const std::string& from) {
  const Json cells = parse_json(row, from);
  if (columns_.empty()) columns_ = columns_of(header);
  bool good = cells.is_array() && cells.size() == columns_.size() && cells[0].is_number_unsigned();
  for (std::size_t c = 0; good && c < columns_.size(); ++c) good = fits(cells[c], columns_[c]);
  if (!good) throw UserError(fmt::format("{}: holds a row that does not fit its columns", from));
  const std::uint64_t index = cells[0].get<std::uint64_t>();
  if (index >= rows.size())
    throw UserError(fmt::format("{}: holds row {}, and the study has {}", from, index, rows.size()));
  std::string& place = rows[index];
  if (place.empty()) {
    place = std::move(row);
    ++done;
    return;
  }
  if (place != row && lasting(place, columns_) != lasting(row, columns_))
    throw UserError(
        fmt::format("{}: row {} differs from the same row computed elsewhere: were both computed by the "
                    "same build of bristle?",
                    from, index));
}

std::string SweepRows::table_hash() const {
  const std::vector<SweepColumn> columns = columns_of(header);
  const bool measured = has_measured(columns);
  std::string all;
  for (const std::string& row : rows)
    all += (row.empty() || !measured ? row : lasting(row, columns).dump()) + '\n';
  return text_hash(all);
}

SweepRows read_journal(const std::string& path) {
  SweepRows rows = parse_journal(read_text_file(path, most_journal_bytes), path).rows;
  if (rows.header.is_null()) throw UserError(fmt::format("{}: holds no row yet", path));
  return rows;
}

void add_journal(SweepRows& rows, const std::string& path) {
  SweepRows others = read_journal(path);
  check_same_study(rows.header, others.header, path);
  for (std::string& row : others.rows)
    if (!row.empty()) rows.add(std::move(row), path);
}

Journal::Journal(const std::string& path, const Json& header) : path_(path) {
  file_ = open(path.c_str(), O_RDWR | O_CREAT | O_APPEND | O_NOFOLLOW | O_CLOEXEC, 0666);
  if (file_ < 0) throw UserError(fmt::format("{}: cannot be opened: {}", path, std::strerror(errno)));
  try {
    if (flock(file_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
      throw UserError(
          fmt::format("{}: another sweep writes it now; wait for its end, or take another --out", path));
    const off_t size = lseek(file_, 0, SEEK_END);
    Contents contents;
    if (size > 0) contents = parse_journal(read_text_file(path, most_journal_bytes), path, &header);
    if (static_cast<off_t>(contents.sound_bytes) < size &&
        ftruncate(file_, static_cast<off_t>(contents.sound_bytes)) != 0)
      throw UserError(
          fmt::format("{}: its torn last line cannot be dropped: {}", path, std::strerror(errno)));
    rows_ = std::move(contents.rows);
    if (rows_.header.is_null()) {
      rows_.header = header;
      rows_.rows.assign(header["rows"].get<std::uint64_t>(), {});
      write(header.dump());
    } else {
      check_same_study(header, rows_.header, path);
    }
    found_ = rows_.done;
    synced_ = seconds_now();
  } catch (...) {
    close(file_);
    throw;
  }
}

Journal::~Journal() {
  if (file_ >= 0) close(file_);
}

void Journal::write(const std::string& json) {
  const std::string line = line_of(json);
  for (std::size_t done = 0; done < line.size();) {
    const ssize_t wrote = ::write(file_, line.data() + done, line.size() - done);
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote < 0) throw UserError(fmt::format("{}: cannot be written: {}", path_, std::strerror(errno)));
    done += static_cast<std::size_t>(wrote);
  }
  // A killed process loses nothing that was written; a machine without power at most this second.
  const double now = seconds_now();
  if (now - synced_ < 1.0) return;
  fdatasync(file_);
  synced_ = now;
}

void Journal::add(const std::string& row) {
  const std::uint64_t before = rows_.done;
  rows_.add(row, path_);
  if (rows_.done > before) write(row);
}

void Journal::remove() { unlink(path_.c_str()); }

}  // namespace cli
