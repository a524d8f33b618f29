// Writes pictures and films as PNG files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace room {

/// Image of three bytes per pixel, row by row from the upper left.
struct PixelImage {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};

/// Reads a rectangle, given by its lower left corner, of the frame buffer that is bound for reading.
PixelImage read_pixels(int width, int height, int left = 0, int bottom = 0);

/// Returns the image at half its size: a pixel is the mean of four.
PixelImage halve(const PixelImage& image);

/// Writes a PNG file. Throws cli::UserError when it cannot be written.
void write_png(const std::string& file, const PixelImage& image);

/// Film that grows picture by picture, in memory.
class Film {
 public:
  /// Appends a picture. Leaves it out if its size is not that of the first picture.
  void add(const PixelImage& image);
  std::size_t pictures() const { return pixels_.size(); }
  /// Returns the film as an animated PNG, which repeats endlessly. Needs a picture.
  std::string as_png(int pictures_per_second) const;

 private:
  int width_ = 0, height_ = 0;
  std::string header_;               // data of the chunk IHDR
  std::vector<std::string> pixels_;  // compressed pixels of each picture
};

}  // namespace room
