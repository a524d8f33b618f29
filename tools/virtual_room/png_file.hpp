// A picture as a PNG file.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace room {

/// Three bytes a pixel, from above left, row by row.
struct PixelImage {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};

/// From the frame buffer that is bound for reading.
PixelImage read_pixels(int width, int height);

/// Throws cli::UserError when the file cannot be written.
void write_png(const std::string& file, const PixelImage& image);

}  // namespace room
