// Files that a test writes, in a folder of its own that is gone at the end.
#pragma once

#include <filesystem>
#include <fstream>
#include <random>
#include <string>

namespace bristle_test {

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

  /// The path of a new file with this text.
  std::string write(const std::string& name, const std::string& text) const {
    // A new file each time: to truncate one that was just written waits for the disk, milliseconds on ext4.
    std::filesystem::remove(path / name);
    std::ofstream(path / name, std::ios::binary) << text;
    return at(name);
  }
  std::string at(const std::string& name) const { return (path / name).string(); }
};

}  // namespace bristle_test
