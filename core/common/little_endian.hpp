// Converts numbers to bytes and back, little-endian on every machine, so that saved states can be moved
// between machines.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace bristle::detail {

/// Writes numbers to memory and counts their bytes. Without memory (null) it only counts, which gives the
/// size of a saved state. Ignores the rule (fields.hpp) that may come with a number.
class ByteWriter {
 public:
  explicit ByteWriter(std::byte* to) noexcept : to_(to) {}
  std::size_t bytes() const noexcept { return bytes_; }
  template <class T, class... Rule>
  void operator()(const T& value, const Rule&...) noexcept {
    std::byte* const at = take(sizeof(T));
    if (at == nullptr) return;
    std::array<std::byte, sizeof(T)> bytes;
    std::memcpy(bytes.data(), &value, sizeof(T));
    if constexpr (std::endian::native == std::endian::big) std::reverse(bytes.begin(), bytes.end());
    std::memcpy(at, bytes.data(), sizeof(T));
  }
  template <class T>
  void column(const T* values, std::uint32_t count) noexcept {
    if constexpr (std::endian::native == std::endian::little) {
      if (std::byte* const at = take(count * sizeof(T))) std::memcpy(at, values, count * sizeof(T));
    } else {
      for (std::uint32_t i = 0; i < count; ++i) (*this)(values[i]);
    }
  }
  template <class T>
  void zeros(std::uint32_t count) noexcept {
    if (std::byte* const at = take(count * sizeof(T))) std::memset(at, 0, count * sizeof(T));
  }

 private:
  std::byte* take(std::size_t bytes) noexcept {
    std::byte* const at = to_ == nullptr ? nullptr : to_ + bytes_;
    bytes_ += bytes;
    return at;
  }
  std::byte* to_;
  std::size_t bytes_ = 0;
};

class ByteReader {
 public:
  explicit ByteReader(const std::byte* from) noexcept : at_(from) {}
  void skip(std::size_t bytes) noexcept { at_ += bytes; }
  template <class T, class... Rule>
  void operator()(T& value, const Rule&...) noexcept {
    std::array<std::byte, sizeof(T)> bytes;
    std::memcpy(bytes.data(), at_, sizeof(T));
    if constexpr (std::endian::native == std::endian::big) std::reverse(bytes.begin(), bytes.end());
    std::memcpy(&value, bytes.data(), sizeof(T));
    at_ += sizeof(T);
  }
  template <class T>
  void column(T* values, std::uint32_t count) noexcept {
    if constexpr (std::endian::native == std::endian::little) {
      std::memcpy(values, at_, count * sizeof(T));
      at_ += count * sizeof(T);
    } else {
      for (std::uint32_t i = 0; i < count; ++i) (*this)(values[i]);
    }
  }

 private:
  const std::byte* at_;
};

}  // namespace bristle::detail
