#include "tools/sweep/journal.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <fmt/format.h>

#include <bristle/deadline_monitor.hpp>

#include "tools/files/text_file.hpp"
#include "tools/files/user_error.hpp"
#include "tools/reports/json_text.hpp"

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
  file_ = open(journal.c_str(), O_RDWR | O_CREAT | O_APPEND | O_NOFOLLOW | O_CLOEXEC, 0666);
  refuse_unless(file_ >= 0, "cannot be opened");
  try {
    if (flock(file_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
      throw UserError(
          fmt::format("{}: another sweep writes it now; wait for its end, or take another --out", journal));
    const off_t size = lseek(file_, 0, SEEK_END);
    if (size > 0) read(read_text_file(journal, most_journal_bytes));
    if (static_cast<off_t>(sound_bytes_) < size)
      refuse_unless(ftruncate(file_, static_cast<off_t>(sound_bytes_)) == 0,
                    "its torn last line cannot be dropped");
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
  if (take(row) && file_ >= 0) write(row);
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
  const std::string line = line_of(json);
  for (std::size_t done = 0; done < line.size();) {
    const ssize_t wrote = ::write(file_, line.data() + done, line.size() - done);
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote < 0) throw UserError(fmt::format("{}: cannot be written: {}", path_, std::strerror(errno)));
    done += static_cast<std::size_t>(wrote);
  }
  // Forces the journal to disk once a second: a killed process loses nothing, and a power failure at most a
  // second of rows.
  const double now = bristle::DeadlineMonitor::wall_now();
  if (now - synced_ < 1.0) return;
  fdatasync(file_);
  synced_ = now;
}

void SweepRows::close() {
  if (file_ >= 0) ::close(file_);
  file_ = -1;
}

void SweepRows::remove() {
  if (!path_.empty()) unlink(path_.c_str());
}

}  // namespace cli
