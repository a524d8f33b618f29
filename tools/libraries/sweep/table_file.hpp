// The rows of a parameter study, and the CSV file in which they are stored as they are done.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tools/libraries/platform/platform.hpp"
#include "tools/libraries/sweep/study.hpp"

namespace cli {

/// Checks that a table can be written to this path, and that its name does not ask for NetCDF. Throws
/// UserError.
void check_table_file(const std::string& path);

/// Returns the path of the unfinished table of `out`: "FILE.part". It is empty if `out` is empty, stdout, a
/// device or a FIFO; the rows are then kept in memory only.
std::string unfinished_table(const std::string& out);

/// Rows of a study. Each is appended to an unfinished table when it is done, so that a killed study can be
/// continued. Such a table is CSV below a comment that names its study. Its rows stand in the order in which
/// they were done, and a line that a kill cut short is dropped.
class SweepRows {
 public:
  /// Begins or continues the unfinished table; without a file name, rows are kept in memory only. Throws
  /// UserError if the file is another study's, or if another process is writing it.
  SweepRows(const Study& study, const std::string& unfinished);
  ~SweepRows() { close(); }
  SweepRows(const SweepRows&) = delete;
  SweepRows& operator=(const SweepRows&) = delete;

  const nlohmann::json& header() const { return header_; }
  const std::vector<SweepColumn>& columns() const { return columns_; }
  /// Returns the rows by index, as texts in the form of Study::run_row(). Rows that are not done are empty.
  const std::vector<std::string>& rows() const { return rows_; }
  std::uint64_t done() const { return done_; }
  /// Returns how many rows the unfinished table had when it was opened.
  std::uint64_t found() const { return found_; }
  std::vector<std::uint64_t> missing() const;
  /// Returns the hash of all rows in the order of their index, without measured times, as 16 hexadecimal
  /// digits: equal studies have equal hashes.
  std::string table_hash() const;

  /// Adds a row that is done; a repeated one counts once. Throws UserError, for instance on a full disk.
  void add(const std::string& row);
  /// Closes the unfinished table, so that another process may write it; the rows stay in memory.
  void close();
  /// Deletes the unfinished table, after a finished one with its rows has been written.
  void remove();

  /// Returns the rows as CSV (RFC 4180): a head with units in brackets, as motion files have, and empty cells
  /// for missing results.
  std::string csv() const;
  /// Writes the rows as a CSV file; "-" means stdout. Throws UserError.
  void write(const std::string& path) const;

 private:
  std::string head() const;
  void read(const std::string& text);
  bool take(const nlohmann::json& cells);
  void append(const std::string& text);

  nlohmann::json header_;
  std::vector<SweepColumn> columns_;
  std::vector<std::string> rows_;
  std::uint64_t done_ = 0, found_ = 0;
  std::string path_;
  platform::LockedFile file_;
  std::size_t sound_bytes_ = 0;  ///< bytes of the file up to its last whole row
  double synced_ = 0.0;          ///< time when the file was last forced to disk, s
};

}  // namespace cli
