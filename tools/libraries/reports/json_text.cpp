#include "tools/libraries/reports/json_text.hpp"

#include <fmt/format.h>

#include "tools/libraries/files/user_error.hpp"

namespace cli {

nlohmann::json parse_json(const std::string& text, const std::string& what) {
  using Json = nlohmann::json;
  static constexpr int most_levels = 64;
  const auto check_depth = [&what](int depth, Json::parse_event_t, Json&) {
    if (depth > most_levels)
      throw UserError(fmt::format("{}: is nested deeper than {} levels", what, most_levels));
    return true;
  };
  try {
    return Json::parse(text, check_depth);
  } catch (const Json::parse_error& error) {
    throw UserError(fmt::format("{}: not JSON (byte {})", what, error.byte));
  } catch (const Json::exception&) {
    throw UserError(fmt::format("{}: is JSON with a number or text that cannot be read", what));
  }
}

}  // namespace cli
