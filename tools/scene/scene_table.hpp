// A scene from a TOML document that is in memory: a caller may change any key of it before it is read.
#pragma once

#include <string>

#include <toml++/toml.h>

#include "tools/files/toml_table.hpp"
#include "tools/scene/scene.hpp"

namespace cli {

constexpr std::size_t most_scene_bytes = std::size_t{64} << 20;  ///< of a file

/// As parse_scene. `path`: named in messages, and traces are relative to it. Throws UserError.
Scene scene_of(const toml::table& root, const std::string& path, const SceneLimits& limits = {},
               const ShareDone& progress = {});

/// Fills what [scene] says. Throws UserError.
void read_scene_table(TomlTable table, Scene& scene);

}  // namespace cli
