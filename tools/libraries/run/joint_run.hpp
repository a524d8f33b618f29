// Runs scenes with joints on prescribed paths, for `bristle run`. tools/scenes/arm.toml describes them.
#pragma once

#include <string>

#include "tools/libraries/run/run.hpp"

namespace cli {

/// Runs a scene with joints, given by its text, and writes the reports. Returns false, without running, if
/// the scene has no table [[joint]]. Throws UserError.
bool run_joint_scene(const RunOptions& options, const std::string& text);

}  // namespace cli
