// The rows of a study as they are done, and a file that grows by a line a row, so that a study that was
// killed goes on where it was.
//
//   0123456789abcdef {"schema":"bristle-sweep-journal-1","study":...}
//   fedcba9876543210 [17,0.4,...]
//
// Each line begins with the hash of the rest. A line that was torn is dropped, and its row is run again.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tools/sweep/study.hpp"

namespace cli {

class SweepRows {
 public:
  /// Takes up the journal or begins it; an empty name keeps rows in memory alone. Throws UserError where the
  /// file is of another study, or where another process writes it.
  SweepRows(const Study& study, const std::string& journal);
  ~SweepRows() { close(); }
  SweepRows(const SweepRows&) = delete;
  SweepRows& operator=(const SweepRows&) = delete;

  const nlohmann::json& header() const { return header_; }
  const std::vector<SweepColumn>& columns() const { return columns_; }
  /// By index, as Study::run_row gives them; empty where a row is not done.
  const std::vector<std::string>& rows() const { return rows_; }
  std::uint64_t done() const { return done_; }
  std::uint64_t found() const { return found_; }  ///< rows that were in the journal when it was opened
  std::vector<std::uint64_t> missing() const;
  /// Hash of all rows in the order of their index, measured times left out, as 16 hexadecimal digits.
  std::string table_hash() const;

  /// Adds a row; a repeated one counts once. One write to the journal, so that a killed process leaves whole
  /// lines. Throws UserError, on a full disk for instance.
  void add(const std::string& row);
  /// Lets others write the journal; the rows stay.
  void close();
  /// Removes the journal: its rows are in a table now.
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
  int file_ = -1;
  std::size_t sound_bytes_ = 0;  ///< of the journal, up to the end of the last whole line
  double synced_ = 0.0;          ///< s
};

}  // namespace cli
