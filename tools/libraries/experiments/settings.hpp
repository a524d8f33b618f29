// The parameters of an experiment (name, unit, default, range), and their values as set by an option or a
// TOML file.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tools/libraries/files/nearest_name.hpp"

namespace cli {

struct Parameter {
  std::string name;
  std::string unit;
  std::string help;
  std::vector<double> numbers;  ///< default value; several for a parameter that is a list
  double min = 0.0, max = 1e9;
  bool is_list = false;
  std::string text;                  ///< default word of a parameter that is a choice of words
  std::vector<std::string> choices;  ///< words allowed for a choice; empty: a number
  bool whole = false;                ///< whether only whole numbers are allowed
};

/// Values of an experiment's parameters in one run. Setting a value checks its range.
class Settings {
 public:
  explicit Settings(std::vector<Parameter> parameters) : parameters_(std::move(parameters)) {}

  /// Sets a parameter from text such as "key=value"; commas separate the values of a list. Throws a UserError
  /// that begins with `prefix` and names what is allowed: the parameters, and `others` that the caller reads
  /// itself.
  void set(std::string_view assignment, const std::string& prefix = "--set", NameList others = {});
  /// Sets a parameter that is a number or a list of numbers. Throws a UserError that names the allowed range.
  void set_numbers(std::string_view name, std::vector<double> numbers);
  /// Sets values from a TOML file: from its table `experiment` or, if it has none, from its top-level keys.
  /// Refuses a table as a typing error unless `is_table_name` says that it is an experiment's name.
  void read_file(const std::string& path, const std::string& experiment,
                 const std::function<bool(std::string_view)>& is_table_name);

  double number(std::string_view name) const;
  const std::vector<double>& numbers(std::string_view name) const;
  const std::string& text(std::string_view name) const;
  const std::vector<Parameter>& parameters() const noexcept { return parameters_; }
  /// Returns a parameter's default as text in the form that the option --set takes, such as "0.1,1,10".
  static std::string value_text(const Parameter& parameter);

 private:
  Parameter& find(std::string_view name, const std::string& where, NameList known = {});
  const Parameter& find(std::string_view name) const;
  static void check(Parameter& parameter, std::vector<double> numbers, const std::string& where);
  static void check(Parameter& parameter, const std::string& text, const std::string& where);

  std::vector<Parameter> parameters_;
};

/// Makes a parameter that is a number from `min` to `max`, both included.
Parameter number_parameter(std::string name, double value, std::string unit, std::string help, double min,
                           double max);
Parameter whole_parameter(std::string name, double value, std::string help, double min, double max);
Parameter list_parameter(std::string name, std::vector<double> values, std::string unit, std::string help,
                         double min, double max);

/// Returns the parameters that every experiment has: load, material and so on. `defaults` replaces default
/// values by name.
std::vector<Parameter> common_parameters(const std::map<std::string, double>& defaults = {});
std::vector<Parameter> operator+(std::vector<Parameter> a, std::vector<Parameter> b);

/// Returns a table of parameters, one per line: name, default, unit, meaning.
std::string parameter_table(const std::vector<Parameter>& parameters);

}  // namespace cli
