// First snap lengths and random states of a patch's representatives. The first k lengths of any patch are a
// stratified (or random) sample of the law.
#pragma once

#include <cstdint>
#include <limits>

#include "bristle/patch.hpp"
#include "bristle/span.hpp"
#include "core/materials/kernel_law.hpp"

namespace bristle::detail {

/// The default seed, that of the reference tables: its stratified lengths follow the golden-ratio sequence.
constexpr std::uint32_t plain_seed = 1;

/// Returns u_i in (0, 1), the share of the law at which bristle i has its first length. For one seed the
/// first k of them are spread over the unit interval to order 1/k, so any active prefix is a stratified
/// sample; for two seeds they are independent. The van der Corput sequence with its bits scrambled by the
/// seed (core/MODEL.md, section 5); for plain_seed the golden-ratio sequence.
double stratified_share(std::uint32_t seed, std::uint32_t i) noexcept;

/// Returns u_i in (0, 1) as independent numbers, a hash of seed and i.
double random_share(std::uint32_t seed, std::uint32_t i) noexcept;

/// Returns the smallest part of a deflection at a snap beyond the residual, scaled, in the number type T. A
/// smaller part would be lost in the rounding of residual + length, and divisions by it would fail.
template <class T>
double shortest_beyond_residual(const CompiledMaterial& material) noexcept {
  const double least = 8.0 * static_cast<double>(std::numeric_limits<T>::epsilon()) * material.residual;
  return least > material.shortest ? least : material.shortest;
}

/// Fills the first snap lengths Q(u_i), scaled, for i = 0 .. size - 1, with stratified or random u_i.
void fill_first_lengths(const CompiledMaterial& material, bool random, std::uint32_t seed,
                        Span<float> lengths);
void fill_first_lengths(const CompiledMaterial& material, bool random, std::uint32_t seed,
                        Span<double> lengths);

/// Fills the first draw state of each bristle, a bijection of its index, keyed by the seed.
void fill_draw_states(std::uint32_t seed, Span<std::uint32_t> states) noexcept;

}  // namespace bristle::detail
