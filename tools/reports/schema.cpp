#include "tools/reports/schema.hpp"

#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "tools/files/user_error.hpp"

namespace cli {
namespace {

using Json = nlohmann::ordered_json;

/// Types that a value of a report may have.
enum class Shape : unsigned char {
  text,
  number,
  figure,         ///< a number, or null where it is not finite
  count,          ///< a whole number from 0 to 2^53
  count_or_null,  ///< null where there is nothing to count
  flag,
  pair,     ///< two figures
  figures,  ///< a list of at least one figure
  texts,    ///< a list
  counts,   ///< an object of counts under any names
  object,
  list  ///< of objects
};

struct Field {
  const char* name;
  Shape shape;
  std::vector<Field> fields = {};  ///< of an object, or of every object of a list
  bool optional = false;  ///< may be missing: in reports of older builds, or where nothing was measured
};
constexpr bool optional = true;

// ------------------------------------------------------------------------------------------- schemas

const std::vector<Field> conditions = {{"version", Shape::text},
                                       {"commit", Shape::text},
                                       {"flags", Shape::text},
                                       {"cpu", Shape::text},
                                       {"cores", Shape::count},
                                       {"isa", Shape::text, {}, optional},
                                       {"time", Shape::text, {}, optional}};

const std::vector<Field> times = {{"ns_per_bristle", Shape::figure},
                                  {"p50_s", Shape::number},
                                  {"p99_s", Shape::number},
                                  {"max_s", Shape::number}};

const std::vector<Field> capacity = {
    {"conditions", Shape::object, conditions},
    {"quick", Shape::flag},
    {"state_hash", Shape::text, {}, optional},
    {"deadline_s", Shape::number},
    {"mean_snap_length_m", Shape::figure},
    {"snap_length", Shape::text},
    {"note", Shape::text},
    {"motions", Shape::list, {{"name", Shape::text}, {"meaning", Shape::text}}},
    {"paper", Shape::object, {{"bristles", Shape::number}}},
    {"targets",
     Shape::list,
     {{"name", Shape::text},
      {"what", Shape::text},
      {"measured", Shape::figure},
      {"spread", Shape::pair},
      {"limit", Shape::figure},
      {"at_least", Shape::flag},
      {"unit", Shape::text},
      {"met", Shape::flag}}},
    {"features",
     Shape::list,
     {{"motion", Shape::text},
      {"feature", Shape::text},
      {"kernel", Shape::text},
      {"bytes_per_bristle", Shape::figure},
      {"ns_per_bristle", Shape::figure},
      {"time_over_least", Shape::number},
      {"quartiles", Shape::pair}}},
    {"comparisons",
     Shape::list,
     {{"bristles", Shape::count},
      {"motion", Shape::text},
      {"loop", Shape::text},
      {"ns_per_bristle", Shape::figure},
      {"time_over_bristle", Shape::number},
      {"quartiles", Shape::pair}}},
    {"capacities",
     Shape::list,
     {{"motion", Shape::text},
      {"kernel", Shape::text},
      {"layout", Shape::text},
      {"threads", Shape::count},
      {"bristles", Shape::count},
      {"unconfirmed", Shape::flag, {}, optional},
      {"more_would_fit", Shape::flag},
      {"at_capacity", Shape::object, times},
      {"in_cache", Shape::object, {{"ns_per_bristle", Shape::figure}}}}},
    {"infinite",
     Shape::list,
     {{"motion", Shape::text},
      {"step_over_mean_snap_length", Shape::figure},
      {"kernel", Shape::text},
      {"resolution", Shape::figure},
      {"patches", Shape::count},
      {"bytes_per_patch", Shape::figure},
      {"ns_per_patch", Shape::figure},
      {"quartiles", Shape::pair}},
     optional},
    {"contacts",
     Shape::list,
     {{"motion", Shape::text},
      {"step_over_mean_snap_length", Shape::figure},
      {"resolution", Shape::figure},
      {"threads", Shape::count},
      {"bristles", Shape::count},
      {"unconfirmed", Shape::flag, {}, optional},
      {"more_would_fit", Shape::flag},
      {"at_capacity", Shape::object, times}},
     optional}};

const std::vector<Field> errors = {{"rms", Shape::figure}, {"max", Shape::figure}, {"energy", Shape::figure}};

/// A setting, and more about it.
std::vector<Field> setting(std::vector<Field> more) {
  std::vector<Field> fields = {{"as_scene", Shape::flag},
                               {"population", Shape::text, {}, optional},
                               {"resolution", Shape::figure, {}, optional},
                               {"bristles", Shape::count_or_null},
                               {"dt_s", Shape::number},
                               {"step_rule", Shape::text},
                               {"precision", Shape::text},
                               {"sampling", Shape::text},
                               {"force", Shape::text}};
  fields.insert(fields.end(), more.begin(), more.end());
  return fields;
}

const std::vector<Field> run_of_setting = {{"error", Shape::object, errors}, {"scene_step_s", Shape::figure}};

const std::vector<Field> accuracy = {
    {"conditions", Shape::object, conditions},
    {"quick", Shape::flag},
    {"scene", Shape::object, {{"name", Shape::text}, {"dt_s", Shape::number}, {"deadline_s", Shape::number}}},
    {"reference",
     Shape::object,
     {{"dt_s", Shape::number},
      {"bristles", Shape::count},
      {"runs", Shape::figure},
      {"precision", Shape::text},
      {"patches",
       Shape::list,
       {{"name", Shape::text},
        {"standard_error", Shape::figure},
        {"rms_to_closed_form", Shape::figure, {}, optional}}}}},
    {"settings", Shape::list,
     setting({{"error", Shape::object, errors},
              {"scene_step_s", Shape::figure},
              {"ns_per_bristle", Shape::figure},
              {"pareto", Shape::flag}})},
    {"not_run", Shape::texts},
    {"slopes",
     Shape::list,
     {{"patch", Shape::text},
      {"against", Shape::text},
      {"slope", Shape::figure},
      {"standard_error", Shape::figure},
      {"points", Shape::figure},
      {"theory", Shape::text}}},
    {"recommendation",
     Shape::object,
     {{"wanted_error", Shape::figure},
      {"found", Shape::flag},
      {"least_error", Shape::figure},
      {"setting", Shape::object, setting({}), optional},
      {"search", Shape::object, run_of_setting, optional},
      {"confirmed", Shape::object, run_of_setting, optional},
      {"as_scene",
       Shape::object,
       {{"steps", Shape::count},
        {"p99_s", Shape::number},
        {"max_s", Shape::number},
        {"misses", Shape::count},
        {"misses_ours", Shape::count}},
       optional},
      {"share_of_deadline", Shape::figure, {}, optional},
      {"fragment", Shape::text, {}, optional}}},
    {"features",
     Shape::list,
     {{"feature", Shape::text},
      {"state", Shape::text},
      {"advice", Shape::text},
      {"saves", Shape::number, {}, optional},
      {"quartiles", Shape::pair, {}, optional},
      {"error_with", Shape::figure, {}, optional},
      {"error_without", Shape::figure, {}, optional}}}};

const std::vector<Field> settled = {{"cells", Shape::count}, {"settle", Shape::count}};

const std::vector<Field> stability = {
    {"conditions", Shape::object, conditions},
    {"quick", Shape::flag},
    {"k", Shape::figures},
    {"c_or_beta", Shape::figures},
    {"maps",
     Shape::list,
     {{"scheme", Shape::text},
      {"linear_condition", Shape::text},
      {"agreeing", Shape::count},
      {"fraction_agreeing", Shape::number},
      {"why_not", Shape::counts},
      {"cells", Shape::list}}},
    {"varied",
     Shape::list,
     {{"scheme", Shape::text},
      {"turned", Shape::object, {{"cells", Shape::count}, {"agreeing", Shape::count}}},
      {"swinging_load",
       Shape::object,
       {{"stable_at_all_loads", Shape::object, settled},
        {"stable_at_some", Shape::object, settled},
        {"stable_at_none", Shape::object, settled}}}}},
    {"stopping_distances",
     Shape::list,
     {{"k", Shape::figure},
      {"way_over_mean_snap_length", Shape::figure},
      {"scheme", Shape::text},
      {"ratio", Shape::figure}}},
    {"rests",
     Shape::list,
     {{"scheme", Shape::text},
      {"seconds", Shape::number},
      {"first_second_m", Shape::figure},
      {"creep_m", Shape::number}}},
    {"cases",
     Shape::list,
     {{"name", Shape::text},
      {"scheme", Shape::text},
      {"mass_kg", Shape::number},
      {"stiffness_n_per_m", Shape::number},
      {"damping_ns_per_m", Shape::number},
      {"dt_s", Shape::number},
      {"mean_snap_length_m", Shape::number},
      {"starts",
       Shape::list,
       {{"start_velocity_m_per_s", Shape::figure},
        {"verdict", Shape::text},
        {"peak_to_peak_m", Shape::figure}}}}},
    {"late_force", Shape::list, {{"force", Shape::text}, {"device_damping_over_kt", Shape::figure}}}};

// --------------------------------------------------------------------------------------------- check

const char* name_of(Shape shape) noexcept {
  switch (shape) {
    case Shape::text:
      return "a text";
    case Shape::number:
      return "a number";
    case Shape::figure:
      return "a number or null";
    case Shape::count:
      return "a whole number, 0 to 2^53";
    case Shape::count_or_null:
      return "a whole number, 0 to 2^53, or null";
    case Shape::flag:
      return "true or false";
    case Shape::pair:
      return "a list of two numbers";
    case Shape::figures:
      return "a list of numbers, one at least";
    case Shape::texts:
      return "a list of texts";
    case Shape::counts:
      return "an object of whole numbers, 0 to 2^53";
    case Shape::object:
      return "an object";
    case Shape::list:
      return "a list of objects";
  }
  return "";
}

bool is_figure(const Json& value) { return value.is_number() || value.is_null(); }

bool is_count(const Json& value) {
  if (value.is_number_unsigned()) return value.get<std::uint64_t>() <= std::uint64_t{1} << 53;
  if (value.is_number_integer()) return false;  // below 0
  if (!value.is_number_float()) return false;
  const double number = value.get<double>();
  return number >= 0.0 && number <= 0x1p53 && number == std::floor(number);
}

template <class Test>
bool all(const Json& values, Test test) {
  for (const Json& value : values)
    if (!test(value)) return false;
  return true;
}

/// Of the value alone, not of what is in an object.
bool has_shape(const Json& value, Shape shape) {
  switch (shape) {
    case Shape::text:
      return value.is_string();
    case Shape::number:
      return value.is_number();
    case Shape::figure:
      return is_figure(value);
    case Shape::count:
      return is_count(value);
    case Shape::count_or_null:
      return value.is_null() || is_count(value);
    case Shape::flag:
      return value.is_boolean();
    case Shape::pair:
      return value.is_array() && value.size() == 2 && all(value, is_figure);
    case Shape::figures:
      return value.is_array() && !value.empty() && all(value, is_figure);
    case Shape::texts:
      return value.is_array() && all(value, [](const Json& text) { return text.is_string(); });
    case Shape::counts:
      return value.is_object() && all(value, is_count);
    case Shape::object:
      return value.is_object();
    case Shape::list:
      return value.is_array() && all(value, [](const Json& row) { return row.is_object(); });
  }
  return false;
}

class Checker {
 public:
  Checker(const std::string& file, const std::string& schema) : file_(file), schema_(schema) {}

  void check(const Json& object, const std::vector<Field>& fields, const std::string& place) const {
    for (const Field& field : fields) {
      const std::string here = place.empty() ? field.name : place + '.' + field.name;
      const auto found = object.find(field.name);
      if (found != object.end())
        check(*found, field, here);
      else if (!field.optional)
        fail(here, "is missing", field.shape);
    }
  }

 private:
  void check(const Json& value, const Field& field, const std::string& here) const {
    if (!has_shape(value, field.shape)) fail(here, "is " + shown(value), field.shape);
    if (field.shape == Shape::object) check(value, field.fields, here);
    if (field.shape != Shape::list) return;
    std::size_t row = 0;
    for (const Json& object : value) check(object, field.fields, fmt::format("{}[{}]", here, row++));
  }
  static std::string shown(const Json& value) {
    if (value.is_object()) return "an object";
    const std::string text = value.dump(-1, ' ', true);
    return text.size() <= 40 ? text : text.substr(0, 40) + "...";
  }
  [[noreturn]] void fail(const std::string& here, const std::string& what, Shape wanted) const {
    throw UserError(fmt::format("{}: not a complete {} report: {} {}; it must be {}", file_, schema_, here,
                                what, name_of(wanted)));
  }

  const std::string &file_, &schema_;
};

const std::vector<std::pair<std::string, const std::vector<Field>*>> schemas = {
    {"bristle-capacity-1", &capacity},
    {"bristle-accuracy-1", &accuracy},
    {"bristle-stability-1", &stability}};

}  // namespace

void check_report(const Json& report, const std::string& schema, const std::string& file) {
  for (const auto& [name, fields] : schemas)
    if (name == schema) Checker(file, schema).check(report, *fields, "");
}

}  // namespace cli
