// Rows through a Dask cluster: Python's distributed schedules them, this process keeps the journal.
#pragma once

#include <string>
#include <vector>

#include "tools/sweep/sweep.hpp"

namespace cli {

/// Starts `python3 -m bristle.sweep`, which hands the rows to the scheduler at `address` and prints them as
/// they come. BRISTLE_PYTHON names another interpreter; a module built beside this program is found. Throws
/// UserError where it ends early, SweepStopped after a signal.
void run_rows_by_dask(const Study& study, const std::vector<std::uint64_t>& indices,
                      const std::string& address, const std::string& isa, const RowDone& done);

}  // namespace cli
