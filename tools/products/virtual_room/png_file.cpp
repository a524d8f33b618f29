#include "tools/products/virtual_room/png_file.hpp"

#include <epoxy/gl.h>
#include <stb_image_write.h>

#include <algorithm>
#include <cstddef>

#include "tools/libraries/files/user_error.hpp"

namespace room {

namespace {

std::string big_endian(std::uint32_t value, int bytes = 4) {
  std::string text;
  for (int i = bytes - 1; i >= 0; --i) text += static_cast<char>((value >> (8 * i)) & 0xffu);
  return text;
}

std::uint32_t number_at(const std::string& png, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(png.at(at + i));
  return value;
}

// Returns a chunk of a PNG file: length, name, data, and the CRC-32 of name and data.
std::string chunk(const char* name, const std::string& data) {
  const std::string checked = name + data;
  std::uint32_t crc = ~0u;
  for (const char c : checked) {
    crc ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (crc & 1u ? 0xEDB88320u : 0u);
  }
  return big_endian(static_cast<std::uint32_t>(data.size())) + checked + big_endian(~crc);
}

}  // namespace

PixelImage read_pixels(int width, int height, int left, int bottom) {
  PixelImage image{width, height, {}};
  const std::size_t row = 3 * static_cast<std::size_t>(width);
  image.rgb.resize(row * static_cast<std::size_t>(height));
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(left, bottom, width, height, GL_RGB, GL_UNSIGNED_BYTE, image.rgb.data());
  // Reverses the order of rows, since OpenGL's begin at the bottom.
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

PixelImage halve(const PixelImage& image) {
  PixelImage half{image.width / 2, image.height / 2, {}};
  const std::size_t row = 3 * static_cast<std::size_t>(image.width);
  for (std::size_t y = 0; y < static_cast<std::size_t>(half.height); ++y) {
    for (std::size_t x = 0; x < 3 * static_cast<std::size_t>(half.width); ++x) {
      const std::size_t at = 2 * y * row + 6 * (x / 3) + x % 3;
      const auto& from = image.rgb;
      half.rgb.push_back(
          static_cast<std::uint8_t>((from[at] + from[at + 3] + from[at + row] + from[at + row + 3] + 2) / 4));
    }
  }
  return half;
}

void Film::add(const PixelImage& image) {
  if (pixels_.empty()) {
    width_ = image.width;
    height_ = image.height;
  }
  if (image.width != width_ || image.height != height_) return;
  std::string png;
  const auto append = [](void* to, void* from, int size) {
    static_cast<std::string*>(to)->append(static_cast<const char*>(from), static_cast<std::size_t>(size));
  };
  stbi_write_png_to_func(append, &png, width_, height_, 3, image.rgb.data(), 3 * width_);
  // Copies the data of the chunks IHDR and IDAT out of a PNG file: after a signature of 8 bytes, each chunk
  // has 8 bytes before its data and 4 behind it.
  constexpr std::size_t header_at = 16, pixels_at = 41;
  header_ = png.substr(header_at, number_at(png, header_at - 8));
  pixels_.push_back(png.substr(pixels_at, number_at(png, pixels_at - 8)));
}

std::string Film::as_png(int pictures_per_second) const {
  std::string film = "\x89PNG\r\n\x1a\n" + chunk("IHDR", header_) +
                     chunk("acTL", big_endian(static_cast<std::uint32_t>(pixels_.size())) + big_endian(0));
  std::uint32_t number = 0;
  for (const std::string& pixels : pixels_) {
    film +=
        chunk("fcTL", big_endian(number++) + header_.substr(0, 8) + big_endian(0) + big_endian(0) +
                          big_endian(1, 2) + big_endian(static_cast<std::uint32_t>(pictures_per_second), 2) +
                          big_endian(0, 2));
    film += number == 1 ? chunk("IDAT", pixels) : chunk("fdAT", big_endian(number++) + pixels);
  }
  return film + chunk("IEND", "");
}

}  // namespace room
