// Writes the force file: one row per step and patch. Columns: tools/scenes/README.md.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <bristle/patch_batch.hpp>

#include "tools/files/output_file.hpp"

namespace cli {

class ForceFile {
 public:
  /// Which of the outputs that some patches compute become columns; empty cells where a patch does not.
  ForceFile(const std::string& path, bool with_mean, bool with_energy);

  void write(double t, const std::string& patch, bristle::Outputs outputs, const bristle::Response& response,
             double load, double bristles, double x, double y);
  /// Throws UserError when the disk is full.
  void finish();

 private:
  void flush();

  OutputFile file_;
  bool with_mean_, with_energy_;
  fmt::memory_buffer buffer_;
};

/// "ok", or the names of the flags joined by '+'.
std::string status_text(bristle::Status status);

}  // namespace cli
