// Parameters of an experiment: names, units, defaults and ranges, set by option or TOML file.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace cli {

struct Parameter {
  std::string name;
  std::string unit;
  std::string help;
  std::vector<double> numbers;  ///< default: one number, or as many as a list has
  double min = 0.0, max = 1e9;
  bool is_list = false;
  std::string text;                  ///< default of a choice
  std::vector<std::string> choices;  ///< not empty: a choice, no number
  bool whole = false;                ///< whole numbers only
};

/// The values of one run. Setting a value checks its range.
class Settings {
 public:
  explicit Settings(std::vector<Parameter> parameters) : parameters_(std::move(parameters)) {}

  /// "key=value"; lists with commas. Throws UserError that begins with `prefix` and names what is allowed.
  void set(std::string_view assignment, const std::string& prefix = "--set");
  /// Keys of a TOML file, at its top or, where there is one, in the table called `experiment`.
  /// `is_table_name` distinguishes experiments from typing errors.
  void read_file(const std::string& path, const std::string& experiment,
                 const std::function<bool(std::string_view)>& is_table_name);

  double number(std::string_view name) const;
  const std::vector<double>& numbers(std::string_view name) const;
  const std::string& text(std::string_view name) const;
  const std::vector<Parameter>& parameters() const noexcept { return parameters_; }
  /// As an option takes it: "0.1,1,10".
  static std::string value_text(const Parameter& parameter);

 private:
  Parameter& find(std::string_view name, const std::string& where);
  const Parameter& find(std::string_view name) const;
  static void check(Parameter& parameter, std::vector<double> numbers, const std::string& where);
  static void check(Parameter& parameter, const std::string& text, const std::string& where);

  std::vector<Parameter> parameters_;
};

/// A number. Ranges are inclusive.
Parameter number_parameter(std::string name, double value, std::string unit, std::string help, double min,
                           double max);
Parameter whole_parameter(std::string name, double value, std::string help, double min, double max);
Parameter list_parameter(std::string name, std::vector<double> values, std::string unit, std::string help,
                         double min, double max);

/// Parameters that every experiment has: load, materials and their parameters. Changed defaults by name.
std::vector<Parameter> common_parameters(const std::map<std::string, double>& defaults = {});
std::vector<Parameter> operator+(std::vector<Parameter> a, std::vector<Parameter> b);

/// One line per parameter: name, default, unit, meaning.
std::string parameter_table(const std::vector<Parameter>& parameters);

}  // namespace cli
