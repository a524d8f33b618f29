// Parses TOML within fixed limits, so that no file can exhaust memory or stack.
#pragma once

#include <string>

#include <toml++/toml.h>

namespace cli {

/// Parses TOML. Throws a UserError naming file and line if the text is not TOML, or is nested deeper than the
/// files of this library.
toml::table parse_toml(const std::string& text, const std::string& path);

}  // namespace cli
