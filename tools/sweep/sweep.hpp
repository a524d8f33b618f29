// Runs a scene over a grid or sample of parameters: the command `bristle sweep`.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/sweep/journal.hpp"
#include "tools/sweep/study.hpp"

namespace cli {

struct SweepOptions {
  StudyOptions study;
  std::vector<std::string> out;      ///< tables to write, CSV; "-": stdout
  std::string journal;               ///< journal file; empty: beside the first table
  std::string json;                  ///< report to write; empty: none, "-": stdout
  std::optional<std::uint64_t> row;  ///< only writes the scene of this row, and runs nothing
  int threads = 0;                   ///< rows at a time; 0: one per core
  std::string isa;
};

/// Exception that a sweep throws when a signal stops it.
struct SweepStopped : std::exception {
  const char* what() const noexcept override { return "stopped"; }
};

/// Function called with each row as it is done, by one thread at a time.
using RowDone = std::function<void(const std::string& row)>;

/// Runs these rows on threads of this process, in any order. An exception in a row ends all of them.
void run_rows(const Study& study, const std::vector<std::uint64_t>& indices, int threads,
              const std::string& isa, const RowDone& done, const StepCheck& check = {});

std::string sweep_summary(const SweepRows& rows, const std::vector<std::string>& out);

/// Runs the subcommand. Returns the exit code: 0, or 130 after Ctrl-C.
int sweep_command(const SweepOptions& options);

}  // namespace cli
