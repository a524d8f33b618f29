// Where a run stands, saved and restored: `bristle run --save-state` and `--restore-state`.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/scene/scene_stepper.hpp"

namespace cli {

/// Displacement of a copy.
struct Way {
  double x = 0.0, y = 0.0;            ///< m, moved so far
  double slid_x = 0.0, slid_y = 0.0;  ///< m, since it last turned back or lost contact
};

/// Throws UserError where no state file can be written: what can be known of that before a long run.
void check_place_of_state(const std::string& path);

/// Writes the state of all patches, and with it the time, where bodies are, and the ways: all
/// that the next steps depend on. `steps` were done since the scene's beginning. Throws UserError.
void save_run(const std::string& path, const SceneStepper& stepper, std::uint64_t steps, double dt,
              const std::vector<Way>& ways);

/// Takes it up in a stepper of the same scene; returns the steps done before. Throws UserError where the file
/// is not of such a scene.
std::uint64_t restore_run(const std::string& path, SceneStepper& stepper, double dt, std::vector<Way>& ways);

}  // namespace cli
