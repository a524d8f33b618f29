// `bristle run` of a scene of beds (tools/scenes/README.md): elastic bodies on prescribed paths.
#pragma once

#include <string>

#include "tools/run/run.hpp"

namespace cli {

/// Runs a scene with this text if it has a [[bed]], and reports; false for another scene. Throws UserError.
bool run_bed_scene(const RunOptions& options, const std::string& text);

}  // namespace cli
