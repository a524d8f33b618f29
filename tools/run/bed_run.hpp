// Runs scenes of beds (tools/scenes/README.md), which are elastic bodies on prescribed paths, for `bristle
// run`.
#pragma once

#include <string>

#include "tools/run/run.hpp"

namespace cli {

/// Runs a scene with this text and writes the reports, if the scene has a [[bed]]; returns false otherwise.
/// Throws UserError.
bool run_bed_scene(const RunOptions& options, const std::string& text);

}  // namespace cli
