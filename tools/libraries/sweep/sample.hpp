// Chooses the points that a sampled study visits within the ranges of its varied keys.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace cli {

enum class SweepSampling { grid, latin, sobol };

/// Returns 64 random bits from a seed and two counters, by the finaliser of SplitMix64 (Steele, Lea and Flood
/// 2014). All random numbers of a sweep come from it, so that each depends only on its place in the study.
std::uint64_t counted_bits(std::uint64_t seed, std::uint64_t stream, std::uint64_t index) noexcept;

/// Returns points of a Latin hypercube in [0, 1) (McKay, Beckman and Conover 1979), one after the other: of
/// the `points` equal intervals of each dimension, every one holds one point. Sorting counted_bits() shuffles
/// the intervals.
std::vector<double> latin_points(std::size_t dimensions, std::uint64_t points, std::uint64_t seed);

/// Returns points of the Sobol sequence of Boost.Random (Bratley and Fox, TOMS 659) with its first point (0,
/// 0, ...), so that the first 2^k points are a net. A seed other than 0 shifts all points by the same digits.
/// Throws UserError if the build has no Boost.
std::vector<double> sobol_points(std::size_t dimensions, std::uint64_t points, std::uint64_t seed);

}  // namespace cli
