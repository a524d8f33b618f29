// Checks values of command-line options in ways that the library CLI11 does not offer.
#pragma once

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>

#include "tools/libraries/files/number_text.hpp"

namespace cli {

/// Accepts only numbers within a range, whole ones if the range is. (CLI11's own CLI::Range lets "nan" pass,
/// and reads "-1" as the largest unsigned number.)
template <class T>
CLI::Validator within(T low, T high) {
  const auto check = [low, high](const std::string& text) {
    const std::optional<T> value = number_in<T>(text);
    return value && *value >= low && *value <= high
               ? std::string()
               : fmt::format("'{}'; allowed: {}{} to {}", text,
                             std::is_integral_v<T> ? "whole numbers, " : "", low, high);
  };
  return CLI::Validator(check, fmt::format("NUMBER in [{} to {}]", low, high));
}

/// Accepts only one of these words.
inline CLI::Validator one_of(std::vector<std::string> words) {
  const std::string allowed = fmt::format("{}", fmt::join(words, ", "));
  const auto check = [words = std::move(words), allowed](const std::string& text) {
    const bool known = std::find(words.begin(), words.end(), text) != words.end();
    return known ? std::string() : fmt::format("'{}'; allowed: {}", text, allowed);
  };
  return CLI::Validator(check, fmt::format("{{{}}}", allowed));
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
