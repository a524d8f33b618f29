// A program with only those commands that tools/demo needs (scenes and a short capacity measurement). It
// compiles in half the time of the whole command line.
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>

#include "tools/libraries/capacity/capacity.hpp"
#include "tools/libraries/files/one_line.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/run/run.hpp"

namespace {

namespace fs = std::filesystem;

/// Prints a heading, and the command of the full program `bristle` that gives the same output.
void announce(const std::string& part, const std::string& command) {
  std::printf("\n== %s\n   bristle %s\n", part.c_str(), command.c_str());
  std::fflush(stdout);
}

void run_scene(const fs::path& scene, const fs::path& output) {
  const std::string name = scene.stem().string();
  cli::RunOptions options;
  options.scene = scene.string();
  options.out = (output / (name + ".csv")).string();
  options.json = (output / (name + ".json")).string();
  announce(name, "run " + options.scene + " --out " + options.out + " --json " + options.json);
  cli::run_command(options);
}

void measure_capacity(const fs::path& output) {
  cli::CapacityOptions options;
  options.quick = true;
  options.json = (output / "capacity.json").string();
  options.csv = (output / "capacity_curves.csv").string();
  announce("capacity", "capacity --quick --json " + options.json + " --csv " + options.csv);
  cli::capacity_command(options);
}

}  // namespace

int main(int argc, char** argv) {
  const bool asks = argc == 2 && (std::string(argv[1]) == "--help" || std::string(argv[1]) == "-h");
  if (argc < 2 || asks) {
    std::fprintf(asks ? stdout : stderr,
                 "usage: bristle-demo FOLDER [SCENE.toml...]; without scenes it measures the capacity\n");
    return asks ? 0 : 2;
  }
  std::string part;
  try {
    for (int i = 2; i < argc; ++i) {
      part = argv[i];
      run_scene(argv[i], argv[1]);
    }
    if (argc == 2) {
      part = "the capacity measurement";
      measure_capacity(argv[1]);
    }
  } catch (const cli::UserError& error) {
    std::fprintf(stderr, "bristle-demo: %s\n", cli::one_line(error.what()).c_str());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bristle-demo: failed in %s: %s\n", part.c_str(), error.what());
    return 1;
  }
  return 0;
}
