// A 64-bit hash of the numbers of a state or a material. The bits and the order of the numbers enter it;
// padding bytes do not.
#pragma once

#include <cstdint>
#include <cstring>

namespace bristle::detail {

class Hasher {
 public:
  void add(std::uint64_t x) noexcept {
    hash_ = (hash_ ^ x) * 0x9FB21C651E98DF25u;
    hash_ ^= hash_ >> 29;
  }
  void add(double x) noexcept {
    std::uint64_t bits;
    std::memcpy(&bits, &x, sizeof bits);
    add(bits);
  }
  void add(float x) noexcept {
    std::uint32_t bits;
    std::memcpy(&bits, &x, sizeof bits);
    add(std::uint64_t{bits});
  }
  std::uint64_t value() const noexcept { return hash_; }

 private:
  std::uint64_t hash_ = 0x6A09E667F3BCC909u;
};

}  // namespace bristle::detail
