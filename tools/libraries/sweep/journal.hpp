// Rows of a study as they are done, with a journal file that grows by a line per row, so that a killed study
// resumes where it stopped.
//
//   0123456789abcdef {"schema":"bristle-sweep-journal-1","study":...}
//   fedcba9876543210 [17,0.4,...]
//
// Each line begins with the hash of the rest. A torn line is dropped, and its row is run again.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tools/libraries/platform/platform.hpp"
#include "tools/libraries/sweep/study.hpp"

namespace cli {

class SweepRows {
 public:
  /// Opens or begins the journal file; without a file name, rows are kept in memory only. Throws UserError if
  /// the file belongs to another study, or if another process is writing it.
  SweepRows(const Study& study, const std::string& journal);
  ~SweepRows() { close(); }
  SweepRows(const SweepRows&) = delete;
  SweepRows& operator=(const SweepRows&) = delete;

  const nlohmann::json& header() const { return header_; }
  const std::vector<SweepColumn>& columns() const { return columns_; }
  /// Returns the rows by index, as texts in the form of Study::run_row(); the text is empty for a row that is
  /// not done.
  const std::vector<std::string>& rows() const { return rows_; }
  std::uint64_t done() const { return done_; }
  /// Returns how many rows the journal file had when it was opened.
  std::uint64_t found() const { return found_; }
  std::vector<std::uint64_t> missing() const;
  /// Returns the hash of all rows in the order of their index, without measured times, as 16 hexadecimal
  /// digits: equal studies have equal hashes.
  std::string table_hash() const;

  /// Adds a row; counts a repeated one once. Writes only whole lines to the journal, so that a killed process
  /// leaves no partial row. Throws UserError, for instance on a full disk.
  void add(const std::string& row);
  /// Closes the journal file, so that another process may write it; the rows stay in memory.
  void close();
  /// Deletes the journal file, once a table has its rows.
  void remove();

 private:
  void read(const std::string& text);
  void write(const std::string& json);
  bool take(const std::string& row);

  nlohmann::json header_;
  std::vector<SweepColumn> columns_;
  std::vector<std::string> rows_;
  std::uint64_t done_ = 0, found_ = 0;
  std::string path_;
  platform::LockedFile file_;
  std::size_t sound_bytes_ = 0;  ///< bytes of the file up to its last whole line
  double synced_ = 0.0;          ///< s, time when the file was last forced to disk
};

}  // namespace cli
