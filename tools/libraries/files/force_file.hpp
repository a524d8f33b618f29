// Writes the forces of a scene as CSV, one row per step and patch. The columns are listed in
// tools/scenes/README.md.
#pragma once

#include <limits>
#include <string>

#include <fmt/format.h>

#include <bristle/patch_batch.hpp>

#include "tools/libraries/files/output_file.hpp"

namespace cli {

class ForceFile {
 public:
  /// Opens a force file for writing. `with_mean` and `with_energy` add the columns of mean force and energy;
  /// patches that do not compute them get empty cells.
  ForceFile(const std::string& path, bool with_mean, bool with_energy);

  /// Writes a row. `bristles`: of bristles_in_contact().
  void write(double t, const std::string& patch, bristle::Outputs outputs, const bristle::Response& response,
             double load, double bristles, double x, double y);
  /// Writes what is still buffered, so that a program that reads the file at written_path() sees it. Throws
  /// UserError.
  void flush();
  /// Returns the path of the file while it is being written; the final name exists only after finish().
  const std::string& written_path() const noexcept { return file_.written_path(); }
  /// Writes what is still buffered and gives the force file its final name. Throws UserError when the disk is
  /// full.
  void finish();

 private:
  void empty_buffer();

  OutputFile file_;
  bool with_mean_, with_energy_;
  fmt::memory_buffer buffer_;
};

/// Returns the number of representatives in contact; NaN, which makes an empty cell, for an infinite brush.
inline double bristles_in_contact(const bristle::PatchInfo& info) noexcept {
  return info.weight > 0.0 ? info.active : std::numeric_limits<double>::quiet_NaN();
}

/// Returns a patch's status as text: "ok", or the names of its flags joined by '+'.
std::string status_text(bristle::Status status);

}  // namespace cli
