// The representatives of a patch: first snap lengths whose every prefix is stratified (or random), and draw
// keys.
#pragma once

#include <cstdint>
#include <limits>

#include "bristle/patch.hpp"
#include "bristle/span.hpp"
#include "core/materials/kernel_law.hpp"

namespace bristle::detail {

/// The default seed, that of the reference tables: its stratified lengths follow the golden-ratio sequence.
constexpr std::uint32_t plain_seed = 1;

/// u_i in (0, 1): those of one seed are spread, any first k of them to order 1/k over the unit interval, so
/// any active prefix is a stratified sample. Those of two seeds are independent: the van der Corput sequence,
/// its bits scrambled with the seed (core/MODEL.md, section 5). plain_seed: the golden-ratio sequence.
double stratified_share(std::uint32_t seed, std::uint32_t i) noexcept;

/// u_i in (0, 1): independent numbers, a hash of seed and i.
double random_share(std::uint32_t seed, std::uint32_t i) noexcept;

/// Least that a snap length in T may be beyond the residual, scaled: what the residual would swallow is no
/// length to divide by.
template <class T>
double shortest_beyond_residual(const CompiledMaterial& material) noexcept {
  const double least = 8.0 * static_cast<double>(std::numeric_limits<T>::epsilon()) * material.residual;
  return least > material.shortest ? least : material.shortest;
}

/// Fills the first snap lengths Q(u_i), scaled, for i = 0 .. size - 1, of either u.
void fill_first_lengths(const CompiledMaterial& material, bool random, std::uint32_t seed,
                        Span<float> lengths);
void fill_first_lengths(const CompiledMaterial& material, bool random, std::uint32_t seed,
                        Span<double> lengths);

/// Fills the first draw state of each bristle: a bijection of its index, keyed by the seed.
void fill_draw_states(std::uint32_t seed, Span<std::uint32_t> states) noexcept;

}  // namespace bristle::detail
