// Reports in words, with their figures: the first lines on a terminal. Each takes a
// JSON report; nlohmann::json::exception where it lacks something.
#pragma once

#include <string>

#include "tools/reports/report_tables.hpp"

namespace cli {

// bristle-accuracy-1
std::string how_wrong_is_fast(const Json& accuracy);
std::string what_to_choose(const Json& accuracy);
std::string what_to_leave_out(const Json& accuracy);
/// The three, a line each.
std::string accuracy_answer(const Json& accuracy);
/// "13,000 bristles a patch, steps of 1.00 ms, ..."
std::string setting_in_words(const Json& setting);

// bristle-stability-1
std::string is_mine_stable(const Json& stability);
std::string stability_answer(const Json& stability);

}  // namespace cli
