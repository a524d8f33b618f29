// A scene from a TOML document that is in memory: a caller may change any key of it before it is read.
#pragma once

#include <string>

#include <toml++/toml.h>

#include "tools/scene/scene.hpp"

namespace cli {

/// As parse_scene. `path`: named in messages, and traces are relative to it. Throws UserError.
Scene scene_of(const toml::table& root, const std::string& path, const SceneLimits& limits = {},
               const ShareDone& progress = {});

}  // namespace cli
