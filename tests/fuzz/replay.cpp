// Runs a target on files and folders of files: the kept corpus in the tests, a crash that a fuzzer found.
#include <algorithm>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

#include "targets.hpp"

namespace {

struct Target {
  const char* name;
  void (*run)(fuzz::Bytes);
};
constexpr Target targets[] = {
    {"scene", fuzz::scene},
    {"motion", fuzz::motion},
    {"fit", fuzz::fit},
    {"state", fuzz::state},
    {"batch", fuzz::batch},
    {"kernels", fuzz::kernels},
    {"cohorts", fuzz::cohorts},
    {"rubbing", fuzz::rubbing},
    {"ageing", fuzz::ageing},
    {"extended", fuzz::extended},
    {"populations", fuzz::populations},
#if BRISTLE_FUZZ_RECORD
    {"record", fuzz::record},
#endif
};

std::vector<std::filesystem::path> files_of(const char* place) {
  if (!std::filesystem::is_directory(place)) return {place};
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(place))
    if (entry.is_regular_file()) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

void run_file(const Target& target, const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error(path.string() + ": cannot be read");
  const std::vector<char> text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  // Exactly as long as the input, so that a sanitizer sees a byte too far.
  const std::vector<std::uint8_t> bytes(text.begin(), text.end());
  target.run({bytes.data(), bytes.size()});
}

int run(int argc, char** argv) {
  const auto* target = argc < 3 ? std::end(targets)
                                : std::find_if(std::begin(targets), std::end(targets), [&](const Target& t) {
                                    return std::strcmp(t.name, argv[1]) == 0;
                                  });
  if (target == std::end(targets)) {
    std::fprintf(stderr, "usage: bristle_fuzz_replay TARGET FILE_OR_FOLDER...; targets:");
    for (const Target& t : targets) std::fprintf(stderr, " %s", t.name);
    std::fprintf(stderr, "\n");
    return 2;
  }
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
