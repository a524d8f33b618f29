// A folder for files that a test writes, deleted with all its files when the object ends.
#pragma once

#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>

namespace bristle_test {

inline std::string read_file(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

struct TemporaryFolder {
  std::filesystem::path path;

  TemporaryFolder() {
    std::random_device random;
    do path = std::filesystem::temp_directory_path() / ("bristle_test_" + std::to_string(random()));
    while (!std::filesystem::create_directory(path));
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  /// Writes a text to a new file of the folder and returns the file's path.
  std::string write(const std::string& name, const std::string& text) const {
    // Deletes the old file first, because truncating a file that was just written waits for the disk,
    // milliseconds on ext4.
    std::filesystem::remove(path / name);
    std::ofstream(path / name, std::ios::binary) << text;
    return at(name);
  }
  std::string at(const std::string& name) const { return (path / name).string(); }
};

}  // namespace bristle_test
