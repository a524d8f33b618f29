// Random snap lengths of laws whose quantile function is expensive: a piecewise linear table replaces it.
//
// The table is entered with a random share u of the law. Cells are narrow near the ends 0 and 1, where the
// quantile is steep: with w the distance of u from the nearer end, each octave of w has sixteen cells,
// separately for the two halves of the law. In a cell the length is a + b w. core/materials/kernel_law.cpp
// chooses a and b so that each cell has the mean and variance of the law.
//
// A table of n cells stores n pairs of floats, each pair in the space of a double, then n pairs of doubles.
#pragma once

#include <cstring>

#include "core/kernel_table.hpp"

#include "bundle.hpp"

namespace bristle::detail {
namespace {

// Number of table cells for half of the law, for distances w of a share from its nearer end of 2^-24 to 1/2.
constexpr std::uint32_t cells_of_half = 23 * 16;
constexpr std::uint32_t cells_of_law = 2 * cells_of_half;

template <class T>
struct CellBits;
template <>
struct CellBits<float> {
  /// Shift to the right that leaves the exponent and four bits of the mantissa, which together number the
  /// cell.
  static constexpr int shift = 19;
  static constexpr std::uint32_t first = (127 - 24) * 16;
};
template <>
struct CellBits<double> {
  static constexpr int shift = 48;
  static constexpr std::uint64_t first = (1023 - 24) * 16;
};

/// Returns the snap length below which `share` of the law lies (0 < share < 1, in steps of 2^-24), from the
/// table.
template <class T>
inline T length_of_cell(const double* table, T share) {
  const T other = T(1) - share;
  const T w = least(share, other);
  const auto at = static_cast<std::size_t>((bits_of(w) >> CellBits<T>::shift) - CellBits<T>::first +
                                           (share > other ? cells_of_half : 0u));
  T line[2];
  std::memcpy(line, sizeof(T) == 4 ? table + at : table + cells_of_law + 2 * at, sizeof line);
  return line[0] + line[1] * w;
}

#if defined(BRISTLE_KERNEL_ISA)
/// Coefficients a and b of the table's lines for a vector of shares: the length is a + b w, with w the
/// distance of a share from its nearer end.
template <class T>
struct CellLines {
  Lanes<T> a, b;
};

// Builds vectors from single loads. Gather instructions are slower on many processors.
typedef double Pairs [[gnu::vector_size(4 * width_of<float>)]];
typedef float HalfLines [[gnu::vector_size(4 * width_of<float>)]];
typedef double Numbers [[gnu::vector_size(8 * width_of<double>)]];

inline CellLines<float> read_lines(const double* table, const std::uint32_t* at) {
  const auto p = [&](std::size_t k) { return table[at[k]]; };
#if defined(BRISTLE_ISA_AVX512)
  const auto low = (HalfLines)(Pairs{p(0), p(1), p(2), p(3), p(4), p(5), p(6), p(7)});
  const auto high = (HalfLines)(Pairs{p(8), p(9), p(10), p(11), p(12), p(13), p(14), p(15)});
  const HalfLines a =
      __builtin_shufflevector(low, high, 0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
  const HalfLines b =
      __builtin_shufflevector(low, high, 1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31);
#elif defined(BRISTLE_ISA_AVX2)
  // Orders the pairs so that the shuffles below stay within 128-bit halves, which is faster.
  const auto low = (HalfLines)(Pairs{p(0), p(1), p(4), p(5)});
  const auto high = (HalfLines)(Pairs{p(2), p(3), p(6), p(7)});
  const HalfLines a = __builtin_shufflevector(low, high, 0, 2, 8, 10, 4, 6, 12, 14);
  const HalfLines b = __builtin_shufflevector(low, high, 1, 3, 9, 11, 5, 7, 13, 15);
#else
  const auto low = (HalfLines)(Pairs{p(0), p(1)});
  const auto high = (HalfLines)(Pairs{p(2), p(3)});
  const HalfLines a = __builtin_shufflevector(low, high, 0, 2, 4, 6);
  const HalfLines b = __builtin_shufflevector(low, high, 1, 3, 5, 7);
#endif
  CellLines<float> lines;
  std::memcpy(&lines.a, &a, sizeof a);
  std::memcpy(&lines.b, &b, sizeof b);
  return lines;
}
inline CellLines<double> read_lines(const double* table, const std::uint64_t* at) {
  const auto p = [&](std::size_t k) { return table[cells_of_law + 2 * at[k]]; };
  const auto q = [&](std::size_t k) { return table[cells_of_law + 2 * at[k] + 1]; };
#if defined(BRISTLE_ISA_AVX512)
  const Numbers a = {p(0), p(1), p(2), p(3), p(4), p(5), p(6), p(7)};
  const Numbers b = {q(0), q(1), q(2), q(3), q(4), q(5), q(6), q(7)};
#elif defined(BRISTLE_ISA_AVX2)
  const Numbers a = {p(0), p(1), p(2), p(3)};
  const Numbers b = {q(0), q(1), q(2), q(3)};
#else
  const Numbers a = {p(0), p(1)};
  const Numbers b = {q(0), q(1)};
#endif
  CellLines<double> lines;
  std::memcpy(&lines.a, &a, sizeof a);
  std::memcpy(&lines.b, &b, sizeof b);
  return lines;
}

template <class T>
inline Lanes<T> length_of_cell(const double* table, Lanes<T> share) {
  using Bit = typename BitsOf<T>::Type;
  const Lanes<T> other = Lanes<T>(T(1)) - share;
  const Lanes<T> w = least(share, other);
  const Lanes<T> side =
      select_lanes(share > other, from_bits<T>(Bits<T>(Bit(cells_of_half))), Lanes<T>(T(0)));
  alignas(64) Bit at[width_of<T>];
  put_lanes(at, (bits_of<T>(w) >> CellBits<T>::shift) - Bits<T>(CellBits<T>::first) + bits_of<T>(side));
  const CellLines<T> lines = read_lines(table, at);
  return lines.a + lines.b * w;
}
#endif

template <class T>
inline Bundle<T> length_of_cell(const double* table, Bundle<T> share) {
  for (Lanes<T>& x : share.v) x = length_of_cell<T>(table, x);
  return share;
}

}  // namespace
}  // namespace bristle::detail
