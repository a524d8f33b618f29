// Rows of a study as they are done: a file that grows by a line a row, so that a study that was killed goes
// on where it was.
//
//   0123456789abcdef {"schema":"bristle-sweep-journal-1","study":...}
//   fedcba9876543210 [17,0.4,...]
//
// Each line begins with the hash of the rest. A line that was torn is dropped, and its row is run again.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tools/sweep/results.hpp"

namespace cli {

/// Rows that one or several journals hold.
struct SweepRows {
  nlohmann::json header;
  std::vector<std::string> rows;  ///< by index, as Study::run_row gives them; empty: not done
  std::uint64_t done = 0;

  /// Adds a row; a repeated one counts once. Throws UserError where both differ, measured times apart.
  void add(std::string row, const std::string& from);
  /// Hash of all rows in the order of their index, measured times left out, as 16 hexadecimal digits.
  std::string table_hash() const;

 private:
  std::vector<SweepColumn> columns_;  ///< of the header, once a row was added
};

/// The header's columns. Throws UserError where it is damaged.
std::vector<SweepColumn> columns_of(const nlohmann::json& header);

/// A journal that nobody writes. Throws UserError.
SweepRows read_journal(const std::string& path);
/// Adds the rows of another journal of the same study. Throws UserError.
void add_journal(SweepRows& rows, const std::string& path);

/// A journal that this process writes.
class Journal {
 public:
  /// Opens or begins it. Throws UserError where it is of another study, or where another process writes it.
  Journal(const std::string& path, const nlohmann::json& header);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  const SweepRows& rows() const { return rows_; }
  std::uint64_t found() const { return found_; }  ///< rows that were there when it was opened
  const std::string& path() const { return path_; }
  /// One write, so that a killed process leaves whole lines. Throws UserError, on a full disk for instance.
  void add(const std::string& row);
  /// Rows are all in a table now.
  void remove();

 private:
  void write(const std::string& json);

  std::string path_;
  int file_ = -1;
  SweepRows rows_;
  std::uint64_t found_ = 0;
  double synced_ = 0.0;  ///< s
};

/// The rows of a study: in a journal, or only in memory where its path is empty.
class KeptRows {
 public:
  /// Throws UserError as Journal does.
  KeptRows(const std::string& journal, const nlohmann::json& header) {
    if (!journal.empty()) {
      journal_.emplace(journal, header);
      return;
    }
    rows_.header = header;
    rows_.rows.resize(header.at("rows").get<std::size_t>());
  }
  const SweepRows& rows() const { return journal_ ? journal_->rows() : rows_; }
  void add(const std::string& row) { journal_ ? journal_->add(row) : rows_.add(row, "sweep"); }
  std::uint64_t found() const { return journal_ ? journal_->found() : 0; }
  void remove() {
    if (journal_) journal_->remove();
  }
  /// Lets others write the journal; the rows stay.
  void close() {
    if (!journal_) return;
    rows_ = journal_->rows();
    journal_.reset();
  }

 private:
  std::optional<Journal> journal_;
  SweepRows rows_;
};

}  // namespace cli
