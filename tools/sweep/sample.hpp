// Chooses points in the ranges of the varied keys, which a study visits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace cli {

enum class SweepSampling { grid, latin, sobol };

/// Returns 64 random bits from a seed and counters, by the finaliser of SplitMix64 (Steele, Lea and Flood
/// 2014). All random numbers of a sweep come from here, so each depends only on its place in the study.
std::uint64_t counted_bits(std::uint64_t seed, std::uint64_t stream, std::uint64_t index) noexcept;

/// Returns points of a Latin hypercube in [0, 1) (McKay, Beckman and Conover 1979), point by point: in every
/// dimension each of `points` equal intervals holds one point. The intervals are shuffled by sorting
/// counted_bits().
std::vector<double> latin_points(std::size_t dimensions, std::uint64_t points, std::uint64_t seed);

/// Returns the Sobol sequence of Boost.Random (Bratley and Fox, TOMS 659) with its first point (0, 0, ...),
/// so that the first 2^k points are a net. A seed other than 0 shifts all digits of a dimension alike. Throws
/// UserError if the build has no Boost.
std::vector<double> sobol_points(std::size_t dimensions, std::uint64_t points, std::uint64_t seed);

}  // namespace cli
