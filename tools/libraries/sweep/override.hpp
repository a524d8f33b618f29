// Sets any key of a scene's TOML document by a path such as scene.dt, so that a study can vary every key
// without a list of them.
#pragma once

#include <functional>
#include <string>

#include <toml++/toml.h>

#include "tools/libraries/files/nearest_name.hpp"
#include "tools/libraries/sweep/range.hpp"

namespace cli {

/// Sets a key:
///   scene.dt                     of [scene]
///   material.wood.kinetic        of the [[material]] named wood; patch and body likewise
///   motion.tip.velocity.0        of the [[motion]] of patch tip; the first number of an array
///   material.*.kinetic           of every [[material]]
///   material.kinetic             of the only one
///   material.wood.snap_length.cv of a table within; body.block.force.2.x of a row
/// A key that the table does not have yet is added; the scene reader refuses it later if need be.
/// Throws UserError where the path leads nowhere, with the nearest name.
void set_key(toml::table& root, const std::string& path, const SweepValue& value);

/// Calls `visit` with the file name, which it may change, of each [[motion]] that has the key `file`.
void for_each_motion_file(toml::table& root, const std::function<void(std::string&)>& visit);

/// Returns a TOML document as text without comments and with sorted keys. Equal contents then give equal
/// text, and equal hashes.
std::string canonical_text(const toml::table& root);

}  // namespace cli
