#include <cmath>
#include <string_view>

#include "check.hpp"
#include "targets.hpp"
#include "tools/libraries/files/motion_file.hpp"
#include "tools/libraries/files/user_error.hpp"

namespace fuzz {

void motion(Bytes bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  try {
    const cli::MotionFile file = cli::parse_motion_file(text, "motion.csv");
    check(file.rows.size() >= 2, "a motion has two rows");
    for (std::size_t i = 0; i < file.rows.size(); ++i) {
      const cli::MotionRow& row = file.rows[i];
      check(std::isfinite(row.t) && std::isfinite(row.load) && row.load >= 0.0, "time and load are sound");
      check(i == 0 || row.t > file.rows[i - 1].t, "time goes on");
      check(std::isfinite(row.x) && std::isfinite(row.y), "positions are finite");
    }
  } catch (const cli::UserError& error) {
    check(*error.what() != 0, "a refusal says why");
  }
}

}  // namespace fuzz
