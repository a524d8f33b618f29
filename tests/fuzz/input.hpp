// Choices and numbers from a fuzzer's bytes. After the last byte zeros are read, so that every input is
// complete.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>

#include "targets.hpp"

namespace fuzz {

class Input {
 public:
  explicit Input(Bytes bytes) : bytes_(bytes) {}

  bool empty() const { return at_ >= bytes_.size(); }
  std::uint8_t byte() { return empty() ? std::uint8_t{0} : bytes_[at_++]; }
  unsigned choice(unsigned count) { return byte() % count; }
  bool flag() { return (byte() & 1) != 0; }
  std::uint64_t bits(int bytes) {
    std::uint64_t value = 0;
    for (int i = 0; i < bytes; ++i) value = value << 8 | byte();
    return value;
  }

  /// Returns a number between low and high, one of 65536 evenly spaced ones.
  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(bits(2)) / 65535.0;
  }

  /// Returns a number of the order of `scale`, or sometimes any double, also infinite or NaN.
  double number(double scale) {
    const unsigned kind = choice(16);
    if (kind < 10) return scale * between(-2.0, 2.0);
    constexpr double odd[] = {0.0,
                              -0.0,
                              std::numeric_limits<double>::quiet_NaN(),
                              std::numeric_limits<double>::infinity(),
                              -std::numeric_limits<double>::infinity(),
                              std::numeric_limits<double>::denorm_min(),
                              std::numeric_limits<double>::min(),
                              std::numeric_limits<double>::max(),
                              std::numeric_limits<double>::lowest(),
                              1e-300,
                              1e15,
                              -1.0};
    switch (kind) {
      case 10:
        return odd[choice(sizeof odd / sizeof odd[0])];
      case 11: {
        const std::uint64_t raw = bits(8);
        double value;
        std::memcpy(&value, &raw, sizeof value);
        return value;
      }
      case 12:
        return scale * between(-1e4, 1e4);
      case 13:
        return scale * between(-1e-4, 1e-4);
      case 14:
        return scale * between(-1e12, 1e12);
      default:
        return 0.0;
    }
  }

 private:
  Bytes bytes_;
  std::size_t at_ = 0;
};

}  // namespace fuzz
