// Runs the program `bristle` with a command line, as a shell does.
#pragma once

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cstdio>
#include <sstream>
#include <string>
#include <vector>

#include <sys/wait.h>

#include "temporary_folder.hpp"
#include "test_paths.hpp"

namespace bristle_test {

struct Outcome {
  int code = -1;
  std::string out, err;
};

/// Checks that a command prints no line of more than 80 characters, unless its arguments ask for long lines
/// or for a file on the standard output (`-`).
inline void check_width(const std::string& arguments, const std::string& out) {
  for (const char* long_lines : {"--wide", " -", "completion"})
    if ((arguments + ' ').find(long_lines + std::string(long_lines[0] == ' ' ? " " : "")) !=
        std::string::npos)
      return;
  std::istringstream lines(out);
  for (std::string line; std::getline(lines, line);) {
    // Bytes 10xxxxxx continue a character of UTF-8.
    const auto characters =
        std::count_if(line.begin(), line.end(), [](char c) { return (c & 0xC0) != 0x80; });
    if (characters > 80)
      FAIL_CHECK("bristle " << arguments << " prints a line of " << characters << ": " << line);
  }
}

/// Runs a command, whose lines must fit 80 characters. `environment`: variables that are set before the
/// command, in the syntax of a shell.
inline Outcome run_cli(const TemporaryFolder& folder, const std::string& arguments,
                       const std::string& environment = "") {
  const std::string command =
      environment + " '" BRISTLE_CLI "' " + arguments + " 2> '" + folder.at("stderr") + "'";
  Outcome outcome;
  std::FILE* pipe = popen(command.c_str(), "r");
  REQUIRE(pipe != nullptr);
  std::array<char, 4096> block;
  while (const std::size_t got = std::fread(block.data(), 1, block.size(), pipe))
    outcome.out.append(block.data(), got);
  const int status = pclose(pipe);
  outcome.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  outcome.err = read_file(folder.at("stderr"));
  check_width(arguments, outcome.out);
  return outcome;
}

/// Returns the cells of a CSV text without quotes, the header first.
inline std::vector<std::vector<std::string>> csv_rows(const std::string& text) {
  std::vector<std::vector<std::string>> rows;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    rows.emplace_back();
    std::size_t begin = 0;
    for (std::size_t comma; (comma = line.find(',', begin)) != std::string::npos; begin = comma + 1)
      rows.back().push_back(line.substr(begin, comma - begin));
    rows.back().push_back(line.substr(begin));
  }
  return rows;
}

}  // namespace bristle_test
