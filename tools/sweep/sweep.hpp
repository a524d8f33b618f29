// `bristle sweep`: a scene over a grid or sample of parameters.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/sweep/journal.hpp"
#include "tools/sweep/study.hpp"

namespace cli {

struct SweepOptions {
  StudyOptions study;
  std::vector<std::string> out;      ///< tables, CSV; "-": stdout
  std::string journal;               ///< empty: beside the first table
  std::string json;                  ///< report; empty: none, "-": stdout
  std::optional<std::uint64_t> row;  ///< write the scene of this row, and run nothing
  int threads = 0;                   ///< 0: one per core
  std::string isa;
};

/// Thrown by work that a signal stops.
struct SweepStopped : std::exception {
  const char* what() const noexcept override { return "stopped"; }
};

/// Called with each row as it is done, by one thread at a time.
using RowDone = std::function<void(const std::string& row)>;

/// Runs these rows on threads here, in any order. What a row throws ends all of it.
void run_rows(const Study& study, const std::vector<std::uint64_t>& indices, int threads,
              const std::string& isa, const RowDone& done, const StepCheck& check = {});

std::string sweep_summary(const SweepRows& rows, const std::vector<std::string>& out);

/// Returns the exit code: 0, or 130 after Ctrl-C.
int sweep_command(const SweepOptions& options);

}  // namespace cli
