#include <cmath>
#include <string>

#include "check.hpp"
#include "targets.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/products/virtual_room/script.hpp"

namespace fuzz {

void record(Bytes bytes) {
  const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  try {
    // Replaces a fuzzed script's folder by one that does not exist, so that files it names are never read.
    const room::Script script = room::parse_script(text, "/nowhere/record.toml", room::RoomMeasures{});
    check(script.seconds >= 0.0 && std::isfinite(script.seconds), "a recording has a length");
    double before = 0.0;
    for (const room::Change& change : script.changes) {
      check(change.t >= before, "changes come in the order of time");
      before = change.t;
    }
    // Checks that a script's settings, written to a file and read again, give an identical file.
    const std::string again = "[settings]\n" + room::settings_as_toml(script.settings);
    const room::Script twin = room::parse_script(again, "/nowhere/record.toml", room::RoomMeasures{});
    check("[settings]\n" + room::settings_as_toml(twin.settings) == again,
          "settings survive being written and read");
  } catch (const cli::UserError& error) {
    check(*error.what() != 0, "a refusal says why");
  }
}

}  // namespace fuzz
