// Writes pictures as PNG files and films as animated PNG.
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

/// Reads a rectangle, given by its lower left corner, from OpenGL's current frame buffer for reading.
PixelImage read_pixels(int width, int height, int left = 0, int bottom = 0);

/// Returns the image at half its width and height; a pixel is the mean of four.
PixelImage halve(const PixelImage& image);

/// Writes an image as a PNG file. Throws cli::UserError if it cannot be written.
void write_png(const std::string& file, const PixelImage& image);

/// Film kept in memory, to which pictures are added.
class Film {
 public:
  /// Appends a picture to the film; ignores one that differs in size from the first.
  void add(const PixelImage& image);
  std::size_t pictures() const { return pixels_.size(); }
  /// Returns the film as an animated PNG that repeats endlessly. The film must have a picture.
  std::string as_png(int pictures_per_second) const;

 private:
  int width_ = 0, height_ = 0;
  std::string header_;               // data of the PNG chunk IHDR, for all pictures
  std::vector<std::string> pixels_;  // compressed pixels of each of the pictures
};

}  // namespace room
