#include "tools/reports/schema.hpp"

#include <cmath>
#include <cstdint>

#include <fmt/format.h>

#include "tools/files/user_error.hpp"

namespace cli {
namespace {

using Json = nlohmann::ordered_json;

/// Fields of a report and their shapes. A name with a question mark may be missing: in reports of older
/// builds, or where nothing was measured. A list of objects is written as one of them in brackets.
constexpr const char* schema_text = R"json({
"conditions": {"version": "text", "commit": "text", "flags": "text", "cpu": "text", "cores": "count", "isa?": "text",
  "time?": "text"},
"bristle-capacity-1": {
  "quick": "flag", "state_hash?": "text", "deadline_s": "number", "mean_snap_length_m": "figure",
  "snap_length": "text", "note": "text",
  "motions": [{"name": "text", "meaning": "text"}],
  "paper": {"bristles": "number"},
  "targets": [{"name": "text", "what": "text", "measured": "figure", "spread": "pair", "limit": "figure",
    "at_least": "flag", "unit": "text", "met": "flag"}],
  "features": [{"motion": "text", "feature": "text", "kernel": "text", "bytes_per_bristle": "figure",
    "ns_per_bristle": "figure", "time_over_least": "number", "quartiles": "pair"}],
  "comparisons": [{"bristles": "count", "motion": "text", "loop": "text", "ns_per_bristle": "figure",
    "time_over_bristle": "number", "quartiles": "pair"}],
  "capacities": [{"motion": "text", "kernel": "text", "layout": "text", "threads": "count", "bristles": "count",
    "unconfirmed?": "flag", "more_would_fit": "flag",
    "at_capacity": {"ns_per_bristle": "figure", "p50_s": "number", "p99_s": "number", "max_s": "number"},
    "in_cache": {"ns_per_bristle": "figure"}}],
  "infinite?": [{"motion": "text", "step_over_mean_snap_length": "figure", "kernel": "text", "resolution": "figure",
    "patches": "count", "bytes_per_patch": "figure", "ns_per_patch": "figure", "quartiles": "pair"}],
  "contacts?": [{"motion": "text", "step_over_mean_snap_length": "figure", "resolution": "figure",
    "threads": "count", "bristles": "count", "unconfirmed?": "flag", "more_would_fit": "flag",
    "at_capacity": {"ns_per_bristle": "figure", "p50_s": "number", "p99_s": "number", "max_s": "number"}}]},
"bristle-accuracy-1": {
  "quick": "flag", "scene": {"name": "text", "dt_s": "number", "deadline_s": "number"},
  "reference": {"dt_s": "number", "bristles": "count", "runs": "figure", "precision": "text",
    "patches": [{"name": "text", "standard_error": "figure", "rms_to_closed_form?": "figure"}]},
  "settings": [{"as_scene": "flag", "population?": "text", "resolution?": "figure", "bristles": "count_or_null",
    "dt_s": "number", "step_rule": "text", "precision": "text", "sampling": "text", "force": "text",
    "error": {"rms": "figure", "max": "figure", "energy": "figure"}, "scene_step_s": "figure",
    "ns_per_bristle": "figure", "pareto": "flag"}],
  "not_run": "texts",
  "slopes": [{"patch": "text", "against": "text", "slope": "figure", "standard_error": "figure",
    "points": "figure", "theory": "text"}],
  "recommendation": {"wanted_error": "figure", "found": "flag", "least_error": "figure",
    "setting?": {"as_scene": "flag", "population?": "text", "resolution?": "figure", "bristles": "count_or_null",
      "dt_s": "number", "step_rule": "text", "precision": "text", "sampling": "text", "force": "text"},
    "search?": {"error": {"rms": "figure", "max": "figure", "energy": "figure"}, "scene_step_s": "figure"},
    "confirmed?": {"error": {"rms": "figure", "max": "figure", "energy": "figure"}, "scene_step_s": "figure"},
    "as_scene?": {"steps": "count", "p99_s": "number", "max_s": "number", "misses": "count",
      "misses_ours": "count"},
    "share_of_deadline?": "figure", "fragment?": "text"},
  "features": [{"feature": "text", "state": "text", "advice": "text", "saves?": "number", "quartiles?": "pair",
    "error_with?": "figure", "error_without?": "figure"}]},
"bristle-stability-1": {
  "quick": "flag", "k": "figures", "c_or_beta": "figures",
  "maps": [{"scheme": "text", "linear_condition": "text", "agreeing": "count", "fraction_agreeing": "number",
    "why_not": "counts", "cells": [{}]}],
  "varied": [{"scheme": "text", "turned": {"cells": "count", "agreeing": "count"},
    "swinging_load": {"stable_at_all_loads": {"cells": "count", "settle": "count"},
      "stable_at_some": {"cells": "count", "settle": "count"},
      "stable_at_none": {"cells": "count", "settle": "count"}}}],
  "stopping_distances": [{"k": "figure", "way_over_mean_snap_length": "figure", "scheme": "text",
    "ratio": "figure"}],
  "rests": [{"scheme": "text", "seconds": "number", "first_second_m": "figure", "creep_m": "number"}],
  "cases": [{"name": "text", "scheme": "text", "mass_kg": "number", "stiffness_n_per_m": "number",
    "damping_ns_per_m": "number", "dt_s": "number", "mean_snap_length_m": "number",
    "starts": [{"start_velocity_m_per_s": "figure", "verdict": "text", "peak_to_peak_m": "figure"}]}],
  "late_force": [{"force": "text", "device_damping_over_kt": "figure"}]}})json";

template <class Test>
bool all(const Json& values, Test test) {
  for (const Json& value : values)
    if (!test(value)) return false;
  return true;
}

bool is_figure(const Json& value) { return value.is_number() || value.is_null(); }

bool is_count(const Json& value) {
  if (value.is_number_unsigned()) return value.get<std::uint64_t>() <= std::uint64_t{1} << 53;
  if (!value.is_number_float()) return false;  // below 0
  const double number = value.get<double>();
  return number >= 0.0 && number <= 0x1p53 && number == std::floor(number);
}

/// What a value of a report may be; an object's fields are checked for themselves.
struct Shape {
  const char *name, *says;
  bool (*fits)(const Json& value);
};
constexpr Shape shapes[] = {
    {"text", "a text", [](const Json& v) { return v.is_string(); }},
    {"number", "a number", [](const Json& v) { return v.is_number(); }},
    {"figure", "a number or null", is_figure},
    {"count", "a whole number, 0 to 2^53", is_count},
    {"count_or_null", "a whole number, 0 to 2^53, or null",
     [](const Json& v) { return v.is_null() || is_count(v); }},
    {"flag", "true or false", [](const Json& v) { return v.is_boolean(); }},
    {"pair", "a list of two numbers",
     [](const Json& v) { return v.is_array() && v.size() == 2 && all(v, is_figure); }},
    {"figures", "a list of numbers, one at least",
     [](const Json& v) { return v.is_array() && !v.empty() && all(v, is_figure); }},
    {"texts", "a list of texts",
     [](const Json& v) { return v.is_array() && all(v, [](const Json& text) { return text.is_string(); }); }},
    {"counts", "an object of whole numbers, 0 to 2^53",
     [](const Json& v) { return v.is_object() && all(v, is_count); }},
    {"object", "an object", [](const Json& v) { return v.is_object(); }},
    {"list", "a list of objects",
     [](const Json& v) { return v.is_array() && all(v, [](const Json& row) { return row.is_object(); }); }}};

const Shape& shape_of(const Json& wanted) {
  const std::string name = wanted.is_string()   ? wanted.get<std::string>()
                           : wanted.is_object() ? "object"
                                                : "list";
  const Shape* shape = shapes;
  while (name != shape->name) ++shape;
  return *shape;
}

std::string shown(const Json& value) {
  if (value.is_object()) return "an object";
  const std::string text = value.dump(-1, ' ', true);
  return text.size() <= 40 ? text : text.substr(0, 40) + "...";
}

/// Checks the fields of an object at `place`. `start` begins the error: the file and the schema.
void check_fields(const Json& object, const Json& fields, const std::string& place,
                  const std::string& start) {
  for (const auto& [field, wanted] : fields.items()) {
    const std::string name = field.substr(0, field.find('?')), here = place + name;
    const Shape& shape = shape_of(wanted);
    const auto found = object.find(name);
    if (found == object.end() && name != field) continue;
    if (found == object.end() || !shape.fits(*found))
      throw UserError(fmt::format("{}: {} {}; it must be {}", start, here,
                                  found == object.end() ? "is missing" : "is " + shown(*found), shape.says));
    if (wanted.is_object()) check_fields(*found, wanted, here + '.', start);
    if (!wanted.is_array()) continue;
    std::size_t row = 0;
    for (const Json& one : *found) check_fields(one, wanted[0], fmt::format("{}[{}].", here, row++), start);
  }
}

}  // namespace

void check_report(const Json& report, const std::string& schema, const std::string& file) {
  static const Json schemas = Json::parse(schema_text);
  const auto fields = schemas.find(schema);
  if (fields == schemas.end()) return;
  const std::string start = fmt::format("{}: not a complete {} report", file, schema);
  check_fields(report, {{"conditions", schemas["conditions"]}}, "", start);
  check_fields(report, *fields, "", start);
}

}  // namespace cli
