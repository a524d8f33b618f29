#include "population.hpp"

#include <algorithm>

namespace bristle::detail {
namespace {

std::uint64_t mix64(std::uint64_t x) noexcept {
  x ^= x >> 30;
  x *= 0xBF58476D1CE4E5B9u;
  x ^= x >> 27;
  x *= 0x94D049BB133111EBu;
  x ^= x >> 31;
  return x;
}

template <class T>
void fill(const CompiledMaterial& material, std::uint32_t seed, Span<T> lengths) {
  const SnapLength& law = material.material.snap_length;
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    const double u = stratified_share(seed, static_cast<std::uint32_t>(i));
    const double scaled = law.quantile(u) * material.lengths_per_metre;
    lengths[i] = static_cast<T>(std::clamp(scaled, material.shortest, material.longest));
  }
}

}  // namespace

double stratified_share(std::uint32_t seed, std::uint32_t i) noexcept {
  // 2^64 / golden ratio; wrapping is the fractional part.
  const std::uint64_t x = mix64(seed) + (std::uint64_t{i} + 1) * 0x9E3779B97F4A7C15u;
  return (static_cast<double>(x >> 12) + 0.5) * 0x1p-52;
}

void fill_first_lengths(const CompiledMaterial& material, std::uint32_t seed, Span<float> lengths) {
  fill(material, seed, lengths);
}
void fill_first_lengths(const CompiledMaterial& material, std::uint32_t seed, Span<double> lengths) {
  fill(material, seed, lengths);
}

void fill_draw_states(std::uint32_t seed, Span<std::uint32_t> states) noexcept {
  const auto key = static_cast<std::uint32_t>(mix64(seed + 0x51ED270Bu));
  for (std::size_t i = 0; i < states.size(); ++i) {
    // Murmur3's finaliser: a bijection of 32 bits.
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
