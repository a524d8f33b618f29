// Runs scenes with beds (contacts of elastic bodies on prescribed paths), for `bristle run`.
// tools/scenes/README.md describes them.
#pragma once

#include <string>

#include "tools/libraries/run/run.hpp"

namespace cli {

/// Runs a scene with beds, given by its text, and writes the reports. Returns false, without running, if the
/// scene has no table [[bed]]. Throws UserError.
bool run_bed_scene(const RunOptions& options, const std::string& text);

}  // namespace cli
