// Runs scenes of beds (tools/scenes/README.md), which are elastic bodies on prescribed paths, for `bristle
// run`.
#pragma once

#include <string>

#include "tools/run/run.hpp"

namespace cli {

/// Runs a scene with this text if it has a [[bed]], and reports; returns false for another scene. Throws
/// UserError.
bool run_bed_scene(const RunOptions& options, const std::string& text);

}  // namespace cli
