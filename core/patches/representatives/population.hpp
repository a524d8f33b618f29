// First snap lengths and random states of a patch's representatives. For every k the first k lengths are a
// stratified sample of the law, because the first k bristles are those in contact.
#pragma once

#include <cstdint>
#include <limits>

#include "bristle/patch.hpp"
#include "bristle/span.hpp"
#include "core/materials/kernel_law.hpp"

namespace bristle::detail {

/// Default seed, with which the reference tables were computed: its stratified lengths follow the
/// golden-ratio sequence.
constexpr std::uint32_t plain_seed = 1;

/// Returns u_i in (0, 1), the quantile of the law at which bristle i has its first length. For one seed the
/// first k values are spread over (0, 1) evenly to order 1/k, so bristles in contact, always the first,
/// sample the law well; two seeds give independent values. Sequence: van der Corput with bits scrambled by
/// the seed (core/MODEL.md, section 5); for plain_seed golden ratio.
double stratified_share(std::uint32_t seed, std::uint32_t i) noexcept;

/// Returns the smallest snap length beyond the residual, scaled, that the number type T can handle. A smaller
/// one would be lost in the rounding of residual + length, and divisions by it would fail.
template <class T>
double shortest_beyond_residual(const CompiledMaterial& material) noexcept {
  const double least = 8.0 * static_cast<double>(std::numeric_limits<T>::epsilon()) * material.residual;
  return least > material.shortest ? least : material.shortest;
}

/// Returns the first snap length of bristle i, scaled and beyond the residual: the quantile of the law at
/// stratified_share().
template <class T>
T first_length(const CompiledMaterial& material, std::uint32_t seed, std::uint32_t i) noexcept;

/// Computes the first random state of each bristle from its number and the seed, all different.
void fill_random_states(std::uint32_t seed, Span<std::uint32_t> states) noexcept;

}  // namespace bristle::detail
