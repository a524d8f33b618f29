// Reads a scene from a parsed TOML document, in which the caller may have changed keys.
#pragma once

#include <string>

#include <toml++/toml.h>

#include "tools/libraries/files/toml_table.hpp"
#include "tools/libraries/scene/scene.hpp"

namespace cli {

constexpr std::size_t most_scene_bytes = std::size_t{64} << 20;  ///< limit of a scene file's size, bytes

/// Reads a scene from a parsed document. Messages name the file `path`, to which the paths of motion files
/// are relative. Throws UserError.
Scene scene_of(const toml::table& root, const std::string& path, const SceneLimits& limits = {},
               const ShareDone& progress = {});

/// Reads the keys of the table [scene] into `scene`. Throws UserError.
void read_scene_table(TomlTable table, Scene& scene);

}  // namespace cli
