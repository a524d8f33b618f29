// Runs a scene for every point of a grid of parameters, for the command `bristle sweep`.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/libraries/sweep/study.hpp"
#include "tools/libraries/sweep/table_file.hpp"

namespace cli {

struct SweepOptions {
  StudyOptions study;
  std::string out;   ///< CSV table to write; empty: none, "-": stdout
  std::string json;  ///< JSON report to write; empty: none, "-": stdout
  int threads = 0;   ///< number of rows run at a time; 0: one per core
  std::string isa;
};

/// Exception that ends a sweep after a stop signal such as Ctrl-C.
struct SweepStopped : std::exception {
  const char* what() const noexcept override { return "stopped"; }
};

/// Function that is called with each finished row, in the form of Study::run_row(), by one thread at a time.
using RowDone = std::function<void(const std::string& row)>;

/// Runs the rows with these indices on several threads of this process, in any order. An exception in one row
/// ends all of them.
void run_rows(const Study& study, const std::vector<std::uint64_t>& indices, int threads,
              const std::string& isa, const RowDone& done, const StepCheck& check = {});

/// Number of rows of a sweep that were refused by their scenes, and why.
struct SweepRefusal {
  std::string text;  ///< number of rows and the reason of the first; empty: none was refused
  bool of_all = false;
};
SweepRefusal sweep_refusal(const SweepRows& rows);

std::string sweep_summary(const SweepRows& rows, const std::string& out);

/// Runs the command `bristle sweep`. Returns its exit code: 0, or 130 after Ctrl-C.
int sweep_command(const SweepOptions& options);

}  // namespace cli
