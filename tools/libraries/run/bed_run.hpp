// Runs scenes with beds, which are contacts of elastic bodies on prescribed paths, for `bristle run`
// (tools/scenes/README.md).
#pragma once

#include <string>

#include "tools/libraries/run/run.hpp"

namespace cli {

/// Runs a scene, given by its text, and writes the reports; returns false, without running, if it has no
/// table [[bed]]. Throws UserError.
bool run_bed_scene(const RunOptions& options, const std::string& text);

}  // namespace cli
