// Runs a fuzz target on files and folders of files: the kept corpus in the tests, or a crash that a fuzzer
// found. It can also run the target on random bytes. These find less per run than a fuzzer, but an optimised
// build makes many more runs in the same time.
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "targets.hpp"

namespace {

struct Target {
  const char* name;
  void (*run)(fuzz::Bytes);
};
constexpr Target targets[] = {
    {"scene", fuzz::scene},     {"motion", fuzz::motion},     {"fit", fuzz::fit},
    {"sweep", fuzz::sweep},     {"state", fuzz::state},       {"batch", fuzz::batch},
    {"kernels", fuzz::kernels}, {"cohorts", fuzz::cohorts},   {"rubbing", fuzz::rubbing},
    {"ageing", fuzz::ageing},   {"extended", fuzz::extended}, {"populations", fuzz::populations},
#if BRISTLE_FUZZ_RECORD
    {"record", fuzz::record},
#endif
};

std::vector<std::filesystem::path> files_of(const char* given) {
  if (!std::filesystem::is_directory(given)) return {given};
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(given))
    if (entry.is_regular_file()) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

void run_file(const Target& target, const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error(path.string() + ": cannot be read");
  const std::vector<char> text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  // Copies an input to a buffer of exactly its length, so that a sanitizer detects a read beyond it.
  const std::vector<std::uint8_t> bytes(text.begin(), text.end());
  target.run({bytes.data(), bytes.size()});
}

std::uint64_t run_number = 0;  // number of the current run on random bytes, with which it can be repeated

void say_how_far(const char* what) {
  char text[80];
  const int size = std::snprintf(text, sizeof text, "bristle_fuzz_replay: %s run %llu\n", what,
                                 static_cast<unsigned long long>(run_number));
  if (write(2, text, static_cast<std::size_t>(size)) < 0) _exit(1);
}

extern "C" void say_which(int number) {
  say_how_far("in");
  std::signal(number, SIG_DFL);
  std::raise(number);
}

extern "C" void stop(int) {
  say_how_far("stopped in");
  _exit(0);
}

/// Runs the target on random bytes, runs `from` to `from` + runs - 1: run k uses the generator's seed k.
int run_random(const Target& target, std::uint64_t runs, std::uint64_t from) {
  for (const int signal : {SIGABRT, SIGSEGV, SIGFPE}) std::signal(signal, say_which);
  for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, stop);
  std::vector<std::uint8_t> bytes;
  for (run_number = from; run_number < from + runs; ++run_number) {
    std::mt19937_64 random(run_number);
    bytes.resize(1 + random() % 400);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random() >> 32);
    try {
      target.run({bytes.data(), bytes.size()});
    } catch (const std::exception& error) {
      throw std::runtime_error("run " + std::to_string(run_number) + ": " + error.what());
    }
    const std::uint64_t done = run_number - from + 1;
    if (done % 100000 == 0) {
      std::printf("%s: %llu runs\n", target.name, static_cast<unsigned long long>(done));
      std::fflush(stdout);
    }
  }
  std::printf("%s: %llu runs at random hold\n", target.name, static_cast<unsigned long long>(runs));
  return 0;
}

int run(int argc, char** argv) {
  const auto* target = argc < 3 ? std::end(targets)
                                : std::find_if(std::begin(targets), std::end(targets), [&](const Target& t) {
                                    return std::strcmp(t.name, argv[1]) == 0;
                                  });
  if (target == std::end(targets)) {
    std::fprintf(
        stderr,
        "usage: bristle_fuzz_replay TARGET FILE_OR_FOLDER... or TARGET --random RUNS [FIRST]; targets:");
    for (const Target& t : targets) std::fprintf(stderr, " %s", t.name);
    std::fprintf(stderr, "\n");
    return 2;
  }
  if (std::strcmp(argv[2], "--random") == 0)
    return run_random(*target, argc > 3 ? std::stoull(argv[3]) : 1000, argc > 4 ? std::stoull(argv[4]) : 0);
  std::size_t count = 0;
  for (int i = 2; i < argc; ++i) {
    for (const std::filesystem::path& path : files_of(argv[i])) {
      run_file(*target, path);
      ++count;
    }
  }
  std::printf("%s: %zu inputs hold\n", target->name, count);
  return count > 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bristle_fuzz_replay: %s\n", error.what());
    return 1;
  }
}
