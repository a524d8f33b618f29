#include "core/patches/representatives/population.hpp"

#include <algorithm>

#include "core/random_states.hpp"

namespace bristle::detail {
namespace {

constexpr std::uint64_t reversed_nibble[16] = {0, 8, 4, 12, 2, 10, 6, 14, 1, 9, 5, 13, 3, 11, 7, 15};

/// Converts the upper 52 bits of a number to the middle of one of 2^52 equal cells of (0, 1).
double to_share(std::uint64_t x) noexcept { return (static_cast<double>(x >> 12) + 0.5) * 0x1p-52; }

}  // namespace

double stratified_share(std::uint32_t seed, std::uint32_t i) noexcept {
  // Takes the fractional part of (i + 1) / golden ratio as the share of bristle i. Then the first bristles,
  // however many, cover the law evenly. An integer product that wraps around gives the fractional part.
  if (seed == plain_seed) return to_share(mix64(seed) + (std::uint64_t{i} + 1) * 0x9E3779B97F4A7C15u);
  // Reverses the bits of i to the binary fraction 0.b0 b1 b2 ..., which covers the law evenly too. Then
  // changes each group of four bits by four random bits, which depend on the seed and on the bits before
  // them, so that each seed gives another population.
  std::uint64_t share = 0;
  std::uint64_t random = mix64(mix64(seed) + 0x5DEECE66Du);
  for (int at = 60; at >= 32; at -= 4, i >>= 4) {
    share |= (reversed_nibble[i & 15] ^ (random >> 60)) << at;
    random = mix64(random + ((i & 15) + std::uint64_t{1}) * 0x9E3779B97F4A7C15u);
  }
  return to_share(share | random >> 32);
}

template <class T>
T first_length(const CompiledMaterial& material, std::uint32_t seed, std::uint32_t i) noexcept {
  const double u = stratified_share(seed, i);
  const double scaled = material.material.snap_length.quantile(u) * material.lengths_per_metre;
  const double shortest = shortest_beyond_residual<T>(material);
  return static_cast<T>(material.residual + std::clamp(scaled, shortest, material.longest));
}
template float first_length<float>(const CompiledMaterial&, std::uint32_t, std::uint32_t) noexcept;
template double first_length<double>(const CompiledMaterial&, std::uint32_t, std::uint32_t) noexcept;

void fill_random_states(std::uint32_t seed, Span<std::uint32_t> states) noexcept {
  const auto key = static_cast<std::uint32_t>(mix64(seed + 0x51ED270Bu));
  for (std::size_t i = 0; i < states.size(); ++i) {
    // Mixes the bits by Murmur3's finaliser, which maps different bristle numbers to different states.
    std::uint32_t x = static_cast<std::uint32_t>(i) ^ key;
    x ^= x >> 16;
    x *= 0x85EBCA6Bu;
    x ^= x >> 13;
    x *= 0xC2B2AE35u;
    x ^= x >> 16;
    states[i] = x;
  }
}

}  // namespace bristle::detail
