// Runs the program `bristle` with a command line, as a shell does.
#pragma once

#include <catch2/catch.hpp>

#include <array>
#include <cstdio>
#include <string>

#include <sys/wait.h>

#include "temporary_folder.hpp"
#include "test_paths.hpp"

namespace bristle_test {

struct Outcome {
  int code = -1;
  std::string out, err;
};

/// Runs a command. `environment`: variables that are set before the command, in the syntax of a shell.
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
  return outcome;
}

}  // namespace bristle_test
