// Writes pictures as PNG files.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace room {

/// Image of three bytes per pixel, row by row from the upper left.
struct PixelImage {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};

/// Reads the frame buffer that is bound for reading.
PixelImage read_pixels(int width, int height);

/// Writes a PNG file. Throws cli::UserError when it cannot be written.
void write_png(const std::string& file, const PixelImage& image);

}  // namespace room
