// Checks values of command-line options in ways that the library CLI11 lacks.
#pragma once

#include <cstdlib>
#include <string>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

namespace cli {

/// Accepts only numbers within a range. (CLI11's own CLI::Range lets "nan" pass.)
inline CLI::Validator within(double low, double high) {
  const auto check = [low, high](const std::string& text) {
    char* end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    const bool is_number = !text.empty() && *end == 0;
    return is_number && value >= low && value <= high
               ? std::string()
               : fmt::format("Value {} not in range {} to {}", text, low, high);
  };
  return CLI::Validator(check, fmt::format("FLOAT in [{} - {}]", low, high));
}

/// Refuses an empty file name, in every option of `app` and its commands whose value is a file.
inline void refuse_empty_files(CLI::App& app, const char* file_type) {
  for (CLI::Option* option : app.get_options())
    if (option->get_type_name() == file_type)
      option->check([](const std::string& name) {
        return name.empty() ? std::string("a file's name is empty") : std::string();
      });
  for (CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
    refuse_empty_files(*command, file_type);
}

}  // namespace cli
