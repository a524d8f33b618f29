// Puts the main results of reports into sentences with figures, which commands print first. Functions take a
// JSON report, and throw nlohmann::json::exception if the report lacks a value.
#pragma once

#include <string>

#include "tools/libraries/reports/report_tables.hpp"

namespace cli {

// Answer two questions in words from a report of `bristle accuracy` (schema bristle-accuracy-1): how wrong a
// fast setting is, and which setting to choose.
std::string how_wrong_is_fast(const Json& accuracy);
std::string what_to_choose(const Json& accuracy);
/// Returns the answers of an accuracy report, a line each: which setting to choose, and the error of a fast
/// one.
std::string accuracy_answer(const Json& accuracy);
/// Returns a setting of an accuracy study in words: "13,000 bristles a patch, steps of 1.00 ms, ...".
std::string setting_in_words(const Json& setting);

// Answer in words from a report of `bristle stability` (schema bristle-stability-1) which settings are
// stable.
std::string is_mine_stable(const Json& stability);
std::string stability_answer(const Json& stability);

}  // namespace cli
