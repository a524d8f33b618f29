// Reads pictures back from OpenGL and writes them as PNG files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace room {

/// Image of three bytes (RGB) per pixel, in rows from the upper left.
struct PixelImage {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};

/// Reads a picture of this size from OpenGL's current frame buffer for reading.
PixelImage read_pixels(int width, int height);

/// Writes an image as a PNG file. Throws cli::UserError if it cannot be written.
void write_png(const std::string& file, const PixelImage& image);

}  // namespace room
