// TOML as the command line reads it: bounded, whatever the file holds.
#pragma once

#include <string>

#include <toml++/toml.h>

namespace cli {

/// Throws UserError naming file and line where the text is not TOML, or nests deeper than a file of bristle
/// may.
toml::table parse_toml(const std::string& text, const std::string& path);

}  // namespace cli
