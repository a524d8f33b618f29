#include "tools/libraries/sweep/journal.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>

#include <fmt/format.h>

#include <bristle/deadline_monitor.hpp>

#include "tools/libraries/files/text_file.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/reports/json_text.hpp"

namespace cli {
namespace {

using Json = nlohmann::json;

constexpr std::size_t most_journal_bytes = std::size_t{1} << 36;

std::string line_of(const std::string& json) { return text_hash(json) + ' ' + json + '\n'; }

/// Returns the JSON in a line of the journal; "" if its hash says that it is incomplete or was changed.
std::string json_of(std::string_view line) {
  if (line.size() < 18 || line[16] != ' ') return {};
  const std::string_view json = line.substr(17);
  return text_hash(json) == line.substr(0, 16) ? std::string(json) : std::string();
}

}  // namespace

SweepRows::SweepRows(const Study& study, const std::string& journal)
    : header_(study.header()), columns_(study.columns()), rows_(study.rows()), path_(journal) {
  if (journal.empty()) return;
  const auto refuse_unless = [&](bool good, const char* what) {
    if (!good) throw UserError(fmt::format("{}: {}: {}", path_, what, std::strerror(errno)));
  };
  refuse_unless(file_.open(journal), "cannot be opened");
  try {
    if (!file_.lock())
      throw UserError(
          fmt::format("{}: another sweep writes it now; wait for its end, or take another --out", journal));
    const std::int64_t size = file_.size();
    if (size > 0) read(read_text_file(journal, most_journal_bytes));
    const auto sound = static_cast<std::int64_t>(sound_bytes_);
    if (sound < size) refuse_unless(file_.cut(sound), "its torn last line cannot be dropped");
    if (sound_bytes_ == 0) write(header_.dump());
    found_ = done_;
    synced_ = bristle::DeadlineMonitor::wall_now();
  } catch (...) {
    close();
    throw;
  }
}

void SweepRows::read(const std::string& text) {
  const std::string ours = line_of(header_.dump());
  if (ours.starts_with(text)) {  // only a header line, perhaps cut short by a kill
    sound_bytes_ = text.size() == ours.size() ? ours.size() : 0;
    return;
  }
  if (!text.starts_with(ours)) {
    const std::string first = json_of(std::string_view(text).substr(0, text.find('\n')));
    Json theirs = first.empty() ? Json() : parse_json(first, path_);
    if (!theirs.is_object() || theirs["schema"] != header_["schema"])
      throw UserError(fmt::format("{}: is no journal of bristle sweep", path_));
    const auto described = [](Json& header) {
      return fmt::format("{}, {}, commit {}", header["scene"].dump(), header["vary"].dump(),
                         header["commit"].dump());
    };
    throw UserError(
        fmt::format("{}: is of another study or build, {}; this one is {}. Take another --out, or "
                    "delete the journal",
                    path_, described(theirs), described(header_)));
  }
  sound_bytes_ = ours.size();
  for (std::size_t end; (end = text.find('\n', sound_bytes_)) != std::string::npos; sound_bytes_ = end + 1) {
    const std::string row = json_of(std::string_view(text).substr(sound_bytes_, end - sound_bytes_));
    if (!row.empty()) take(row);
  }
}

/// Adds a row read from a journal; returns whether it is a new one. Checks its cells, since anyone can write
/// a journal whose hashes are right.
bool SweepRows::take(const std::string& row) {
  const Json cells = parse_json(row, path_);
  if (!cells.is_array() || cells.size() != columns_.size() || !cells[0].is_number_unsigned() ||
      cells[0].get<std::uint64_t>() >= rows_.size() || !(cells.back().is_null() || cells.back().is_string()))
    throw UserError(fmt::format("{}: holds a row that is none of this study", path_));
  std::string& place = rows_[cells[0].get<std::uint64_t>()];
  if (!place.empty()) return false;
  place = row;
  ++done_;
  return true;
}

void SweepRows::add(const std::string& row) {
  if (take(row) && file_.is_open()) write(row);
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

void SweepRows::write(const std::string& json) {
  if (!file_.append(line_of(json)))
    throw UserError(fmt::format("{}: cannot be written: {}", path_, std::strerror(errno)));
  // Forces the journal to disk once a second: a killed process loses nothing, a power failure at most a
  // second.
  const double now = bristle::DeadlineMonitor::wall_now();
  if (now - synced_ < 1.0) return;
  file_.flush();
  synced_ = now;
}

void SweepRows::close() { file_.close(); }

void SweepRows::remove() {
  if (!path_.empty()) platform::remove_file(path_.c_str());
}

}  // namespace cli
