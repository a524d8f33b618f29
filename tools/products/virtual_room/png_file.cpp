#include "tools/products/virtual_room/png_file.hpp"

#include <epoxy/gl.h>
#include <stb_image_write.h>

#include <algorithm>
#include <cstddef>

#include "tools/libraries/files/user_error.hpp"

namespace room {

PixelImage read_pixels(int width, int height) {
  PixelImage image{width, height, {}};
  const std::size_t row = 3 * static_cast<std::size_t>(width);
  image.rgb.resize(row * static_cast<std::size_t>(height));
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width, height, GL_RGB, GL_UNSIGNED_BYTE, image.rgb.data());
  // Reverses the order of the rows, because OpenGL's begin at the bottom.
  for (std::size_t y = 0; y < static_cast<std::size_t>(height) / 2; ++y) {
    const auto upper = image.rgb.begin() + static_cast<std::ptrdiff_t>(y * row);
    const auto lower = image.rgb.end() - static_cast<std::ptrdiff_t>((y + 1) * row);
    std::swap_ranges(upper, upper + static_cast<std::ptrdiff_t>(row), lower);
  }
  return image;
}

void write_png(const std::string& file, const PixelImage& image) {
  if (!stbi_write_png(file.c_str(), image.width, image.height, 3, image.rgb.data(), 3 * image.width))
    throw cli::UserError("cannot write the picture " + file);
}

}  // namespace room
