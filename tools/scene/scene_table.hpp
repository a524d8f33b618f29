// Reads a scene from a parsed TOML document, in which the caller may have changed keys.
#pragma once

#include <string>

#include <toml++/toml.h>

#include "tools/files/toml_table.hpp"
#include "tools/scene/scene.hpp"

namespace cli {

constexpr std::size_t most_scene_bytes = std::size_t{64} << 20;  ///< bytes of the largest scene file

/// Reads a scene as parse_scene() does. Messages name the file `path`, and the paths of motion files are
/// relative to it. Throws UserError.
Scene scene_of(const toml::table& root, const std::string& path, const SceneLimits& limits = {},
               const ShareDone& progress = {});

/// Reads the table [scene]. Throws UserError.
void read_scene_table(TomlTable table, Scene& scene);

}  // namespace cli
