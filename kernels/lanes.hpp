// The few vector operations that the kernels use, with identical results on every instruction set. They are
// made from xsimd, or in the instruction set "scalar" from single numbers (one_lane.hpp).
//
// xsimd 8.1 differs between architectures in floor, casts between lane types and integer products, so these
// are defined here. Everything has internal linkage: objects compiled for different instruction sets share no
// symbol.
#pragma once

#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>

#if defined(BRISTLE_KERNEL_ISA)
#include <xsimd/xsimd.hpp>

#include "scalar_lanes.hpp"
#else
#include "one_lane.hpp"
#endif

namespace bristle::detail {
namespace {

#if defined(BRISTLE_KERNEL_ISA)
#if defined(BRISTLE_ISA_AVX512)
using Arch = xsimd::avx512bw;
#elif defined(BRISTLE_ISA_AVX2)
using Arch = xsimd::avx2;
#elif defined(BRISTLE_ISA_SSE2)
using Arch = xsimd::sse2;
#elif defined(BRISTLE_ISA_NEON64)
using Arch = xsimd::neon64;
#else
#error "name an instruction set: BRISTLE_ISA_SSE2, _AVX2, _AVX512 or _NEON64"
#endif

template <class T>
using Lanes = xsimd::batch<T, Arch>;
template <class T>
using Mask = xsimd::batch_bool<T, Arch>;
template <class T>
constexpr std::uint32_t width_of = Lanes<T>::size;

template <class T>
inline Lanes<T> load(const T* from) {
  return Lanes<T>::load_aligned(from);
}
template <class T>
inline Lanes<T> load_any(const T* from) {
  return Lanes<T>::load_unaligned(from);
}
template <class T>
inline void put_lanes(T* to, Lanes<T> x) {
  x.store_aligned(to);
}
template <class T>
inline void put_any(T* to, Lanes<T> x) {
  x.store_unaligned(to);
}

template <class T>
inline Lanes<T> divide(Lanes<T> a, Lanes<T> b) {
  return a / b;
}
template <class T>
inline Lanes<T> root(Lanes<T> a) {
  return xsimd::sqrt(a);
}
#if defined(BRISTLE_ISA_NEON64)
// Divides and takes roots exactly on NEON, where xsimd 8.1 approximates both for float and bits would differ.
template <>
inline Lanes<float> divide(Lanes<float> a, Lanes<float> b) {
  return vdivq_f32(a, b);
}
template <>
inline Lanes<float> root(Lanes<float> a) {
  return vsqrtq_f32(a);
}
#endif

/// Returns a in the lanes where a > 0, and +0 in the others.
template <class T>
inline Lanes<T> positive_part(Lanes<T> a) {
  return xsimd::max(a, Lanes<T>(T(0)));
}

/// Returns the largest whole number not above x, for x >= 0.
template <class T>
inline Lanes<T> whole_part(Lanes<T> x) {
#if defined(BRISTLE_ISA_SSE2)
  const Lanes<T> big(BitsOf<T>::integer_bit);
  const Lanes<T> rounded = (x + big) - big;
  const Lanes<T> down = xsimd::select(rounded > x, rounded - Lanes<T>(T(1)), rounded);
  return xsimd::select(x < big, down, x);
#else
  return xsimd::floor(x);
#endif
}

template <class T>
inline Lanes<T> select_lanes(Mask<T> which, Lanes<T> a, Lanes<T> b) {
  return xsimd::select(which, a, b);
}
template <class T>
inline bool any_lane(Mask<T> which) {
  return xsimd::any(which);
}
#if defined(BRISTLE_ISA_AVX512)
inline Lanes<float> gather_floats(const float* table, Lanes<float> index) {
  return _mm512_i32gather_ps(_mm512_cvttps_epi32(index.data), table, 4);
}
inline Lanes<double> gather_doubles(const double* table, Lanes<double> index) {
  return _mm512_i32gather_pd(_mm512_cvttpd_epi32(index.data), table, 8);
}
#elif defined(BRISTLE_ISA_AVX2)
inline Lanes<float> gather_floats(const float* table, Lanes<float> index) {
  return _mm256_i32gather_ps(table, _mm256_cvttps_epi32(index.data), 4);
}
inline Lanes<double> gather_doubles(const double* table, Lanes<double> index) {
  return _mm256_i32gather_pd(table, _mm256_cvttpd_epi32(index.data), 8);
}
#endif
/// Returns the lanes of a mask as bits, the first lane in the lowest bit.
template <class T>
inline std::uint32_t bits_of_mask(Mask<T> which) {
#if defined(BRISTLE_ISA_AVX512)
  return static_cast<std::uint32_t>(which.data);
#else
  alignas(64) T lane[Lanes<T>::size];
  xsimd::select(which, Lanes<T>(T(1)), Lanes<T>(T(0))).store_aligned(lane);
  std::uint32_t bits = 0;
  for (std::uint32_t i = 0; i < Lanes<T>::size; ++i) bits |= static_cast<std::uint32_t>(lane[i]) << i;
  return bits;
#endif
}
/// Returns the entries of a table at the indices `index`, whole numbers from 0 on.
template <class T>
inline Lanes<T> table_entry(const T* table, Lanes<T> index) {
#if defined(BRISTLE_ISA_AVX512) || defined(BRISTLE_ISA_AVX2)
  if constexpr (sizeof(T) == 4)
    return gather_floats(table, index);
  else
    return gather_doubles(table, index);
#else
  alignas(64) T lane[Lanes<T>::size];
  index.store_aligned(lane);
  for (T& x : lane) x = table[static_cast<std::int32_t>(x)];
  return Lanes<T>::load_aligned(lane);
#endif
}
/// Returns what table_entry() returns, for a table of 32 entries on a boundary of 64 bytes, which it reads
/// into two registers if it fits there.
template <class T>
inline Lanes<T> small_table_entry(const T* table, Lanes<T> index) {
#if defined(BRISTLE_ISA_AVX512)
  if constexpr (sizeof(T) == 4)
    return _mm512_permutex2var_ps(_mm512_load_ps(table), _mm512_cvttps_epi32(index.data),
                                  _mm512_load_ps(table + 16));
#endif
  return table_entry(table, index);
}
template <class T>
inline Lanes<T> magnitude(Lanes<T> a) {
  return xsimd::abs(a);
}
template <class T>
inline Lanes<T> least(Lanes<T> a, Lanes<T> b) {
  return xsimd::min(a, b);
}
template <class T>
inline Lanes<T> most(Lanes<T> a, Lanes<T> b) {
  return xsimd::max(a, b);
}

/// Returns the bits of x as lanes of another type. The template argument of xsimd's bitwise_cast is a batch
/// in xsimd 8, and the type of its lanes in later versions.
template <class To, class From>
inline Lanes<To> same_bits(Lanes<From> x) {
  if constexpr (std::is_same_v<decltype(xsimd::bitwise_cast<To>(x)), To>)
    return xsimd::bitwise_cast<Lanes<To>>(x);
  else
    return xsimd::bitwise_cast<To>(x);
}

template <class T>
using Bits = Lanes<typename BitsOf<T>::Type>;

template <class T>
inline Bits<T> bits_of(Lanes<T> x) {
  return same_bits<typename BitsOf<T>::Type>(x);
}
template <class T>
inline Lanes<T> from_bits(Bits<T> x) {
  return same_bits<T>(x);
}

template <class T>
inline Lanes<T> look_up(const double* table, std::int32_t last, Lanes<T> share) {
  alignas(64) T lane[Lanes<T>::size];
  put_lanes(lane, share);
  for (T& x : lane) x = look_up<T>(table, last, x);
  return load(lane);
}
#endif

// The functions below serve vectors and plain numbers.

/// Returns 2^k for whole numbers k for which 2^k is a normal number.
template <class T, class V>
inline V power_of_two(V k) {
  using B = BitsOf<T>;
  const V biased = k + V(B::integer_bit + static_cast<T>(B::exponent_bias));
  return from_bits<T>(bits_of<T>(biased) << B::mantissa);
}

/// Returns the exponent of a positive normal number x, as a whole number.
template <class T, class V>
inline V exponent_of(V x) {
  using B = BitsOf<T>;
  const V biased = from_bits<T>((bits_of<T>(x) >> B::mantissa) | bits_of<T>(V(B::integer_bit)));
  return biased - V(B::integer_bit + static_cast<T>(B::exponent_bias));
}

/// Returns the mantissa of a positive normal number x, in [1, 2).
template <class T, class V>
inline V mantissa_of(V x) {
  using U = typename BitsOf<T>::Type;
  using Word = decltype(bits_of<T>(x));
  constexpr U low = (U(1) << BitsOf<T>::mantissa) - 1;
  return from_bits<T>((bits_of<T>(x) & Word(low)) | bits_of<T>(V(T(1))));
}

/// Returns the distance of x from the next larger number of its type; 0 for 0.
template <class T, class V>
inline V spacing(V x) {
  using B = BitsOf<T>;
  using U = typename B::Type;
  using Word = decltype(bits_of<T>(x));
  constexpr U exponent = (U(2) * B::exponent_bias + 1) << B::mantissa;
  return from_bits<T>(bits_of<T>(x) & Word(exponent)) * V(std::numeric_limits<T>::epsilon());
}

/// Sum over bristles, kept as one partial sum for each of 16 logical lanes. The 16 lanes are the same on
/// every instruction set, whatever the width of its vectors, and so are the bits of the sum.
template <class T>
struct Row {
  static constexpr std::uint32_t parts = lane_count / width_of<T>;
  Lanes<T> part[parts];

  Row() {
    for (Lanes<T>& x : part) x = Lanes<T>(T(0));
  }
};

/// Returns the sum of all lanes of v, of which those at equal distance are added first.
template <class T>
inline double fold_lanes(Lanes<T> v) {
  alignas(64) T lane[width_of<T>];
  put_lanes<T>(lane, v);
  for (std::uint32_t half = width_of<T> / 2; half > 0; half /= 2)
    for (std::uint32_t i = 0; i < half; ++i) lane[i] += lane[i + half];
  return static_cast<double>(lane[0]);
}
/// Returns the sum of the 16 logical lanes, added in the same order on every instruction set.
template <class T>
inline double tree_sum(Row<T> row) {
  for (std::uint32_t half = Row<T>::parts / 2; half > 0; half /= 2)
    for (std::uint32_t i = 0; i < half; ++i) row.part[i] = row.part[i] + row.part[i + half];
  return fold_lanes<T>(row.part[0]);
}

/// Number type of a loop over many equal items: Lanes<T> is a vector of the instruction set or, in "scalar",
/// one number.
template <class T>
struct Engine {
  using V = Lanes<T>;
  static constexpr std::uint32_t size = width_of<T>;
  static V get(const T* from) { return load<T>(from); }
  static void put(T* to, V x) { put_lanes<T>(to, x); }
  static V get_any(const T* from) { return load_any<T>(from); }
  static void put_any(T* to, V x) { detail::put_any<T>(to, x); }
  struct Sum {
    Row<T> row;
    void add(std::uint32_t part, V x) { row.part[part] = row.part[part] + x; }
    double total() const { return tree_sum<T>(row); }
  };
};

#if defined(BRISTLE_KERNEL_ISA)
inline Bits<float> select_bits(Mask<float> which, Bits<float> a, Bits<float> b) {
#if defined(BRISTLE_ISA_AVX512)
  // Compiles to one masked AVX-512 instruction.
  return xsimd::select(xsimd::batch_bool<std::uint32_t, Arch>(which.data), a, b);
#else
  // Selects integers as if they were floats, which moves their bits unchanged.
  return bits_of<float>(xsimd::select(which, from_bits<float>(a), from_bits<float>(b)));
#endif
}

/// Random states of one vector of bristles. `next` advances the masked lanes and gives every lane a number
/// strictly between 0 and 1: (h + 1/2) 2^-23 with h 23 random bits. The number is exact in float and double,
/// and so is one minus it; both types therefore sample from equal numbers.
template <class T>
struct RandomStates;

template <>
struct RandomStates<float> {
  Bits<float> state;

  RandomStates() = default;
  explicit RandomStates(const std::uint32_t* from) : state(Bits<float>::load_aligned(from)) {}
  void store(std::uint32_t* to) const { state.store_aligned(to); }

  Lanes<float> next(Mask<float> which) {
    state = select_bits(which, state + Bits<float>(random_stride), state);
    Bits<float> x = state;
    x = x ^ (x >> 16);
    x = x * Bits<float>(0x21F0AAADu);
    x = x ^ (x >> 15);
    x = x * Bits<float>(0x735A2D97u);
    const Bits<float> tag = bits_of<float>(Lanes<float>(1.0f));
    const Lanes<float> in_one_two = from_bits<float>((x >> 9) | tag);
    // Subtracts 1 - 2^-24, which float represents exactly, so that the result is (h + 1/2) 2^-23.
    return in_one_two - Lanes<float>(0.999999940395355224609375f);
  }
};

/// Stores a 32-bit random state in the lower half of a 64-bit lane whose upper half is 0, so that shifts and
/// products of 32-bit lanes can be used on it.
template <>
struct RandomStates<double> {
  static constexpr std::size_t size = Lanes<double>::size;
  using Narrow [[gnu::vector_size(4 * size)]] = std::uint32_t;
  using Wide [[gnu::vector_size(8 * size)]] = std::uint64_t;
  Wide state;

  RandomStates() = default;
  explicit RandomStates(const std::uint32_t* from) {
    Narrow narrow;
    std::memcpy(&narrow, from, sizeof narrow);
    state = __builtin_convertvector(narrow, Wide);
  }
  void store(std::uint32_t* to) const {
    const Narrow narrow = __builtin_convertvector(state, Narrow);
    std::memcpy(to, &narrow, sizeof narrow);
  }

  Lanes<double> next(Mask<double> which) {
    constexpr std::uint64_t low = 0xFFFFFFFFu;
    const Lanes<double> chosen = xsimd::select(which, from_wide(Wide{} + low), from_wide(Wide{}));
    state = (state + (to_wide(chosen) & random_stride)) & low;
    Wide x = state ^ (state >> 16);
    x = (x * 0x21F0AAADu) & low;
    x = x ^ (x >> 15);
    x = (x * 0x735A2D97u) & low;
    // Converts the integer h to a number: 2^52 + h, whose bits are read as a double, less 2^52.
    const Lanes<double> h = from_wide((x >> 9) | 0x4330000000000000u) - Lanes<double>(4503599627370496.0);
    return (h + Lanes<double>(0.5)) * Lanes<double>(1.1920928955078125e-07);  // 2^-23
  }

 private:
  static Lanes<double> from_wide(Wide x) {
    Lanes<double> out;
    static_assert(sizeof out == sizeof x);
    std::memcpy(&out, &x, sizeof x);
    return out;
  }
  static Wide to_wide(Lanes<double> x) {
    Wide out;
    std::memcpy(&out, &x, sizeof x);
    return out;
  }
};
#endif

}  // namespace
}  // namespace bristle::detail
