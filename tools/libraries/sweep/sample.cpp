#include "tools/libraries/sweep/sample.hpp"

#include <algorithm>
#include <numeric>

#include <fmt/format.h>

#if BRISTLE_HAS_BOOST_SOBOL
#include <boost/random/sobol.hpp>
#endif

#include "tools/libraries/files/user_error.hpp"

namespace cli {
namespace {

std::uint64_t mixed(std::uint64_t z) noexcept {
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

double unit(std::uint64_t bits) noexcept { return static_cast<double>(bits >> 11) * 0x1p-53; }

}  // namespace

std::uint64_t counted_bits(std::uint64_t seed, std::uint64_t stream, std::uint64_t index) noexcept {
  constexpr std::uint64_t golden = 0x9e3779b97f4a7c15u;
  return mixed(mixed(mixed(seed + golden) + stream + golden) + index + golden);
}

std::vector<double> latin_points(std::size_t dimensions, std::uint64_t points, std::uint64_t seed) {
  std::vector<double> shares(dimensions * points);
  std::vector<std::uint64_t> order(points), keys(points);
  for (std::size_t d = 0; d < dimensions; ++d) {
    for (std::uint64_t i = 0; i < points; ++i) keys[i] = counted_bits(seed, 2 * d, i);
    std::iota(order.begin(), order.end(), std::uint64_t{0});
    std::sort(order.begin(), order.end(), [&](std::uint64_t a, std::uint64_t b) {
      return keys[a] != keys[b] ? keys[a] < keys[b] : a < b;
    });
    for (std::uint64_t part = 0; part < points; ++part) {
      const double inside = unit(counted_bits(seed, 2 * d + 1, part));
      shares[order[part] * dimensions + d] =
          std::min((static_cast<double>(part) + inside) / static_cast<double>(points), 1.0 - 0x1p-53);
    }
  }
  return shares;
}

#if BRISTLE_HAS_BOOST_SOBOL

std::vector<double> sobol_points(std::size_t dimensions, std::uint64_t points, std::uint64_t seed) {
  constexpr std::size_t most = boost::random::default_sobol_table::max_dimension;
  if (dimensions > most)
    throw UserError(fmt::format("--sample sobol: {} keys vary; allowed: at most {}", dimensions, most));
  std::vector<double> shares(dimensions * points);
  std::vector<std::uint64_t> shift(dimensions, 0);
  for (std::size_t d = 0; d < dimensions && seed != 0; ++d) shift[d] = counted_bits(seed, d, 0);
  boost::random::sobol sequence(dimensions);
  for (std::uint64_t i = 0; i < points; ++i)
    for (std::size_t d = 0; d < dimensions; ++d) {
      // Adds the first point (0, 0, ...) of the Sobol sequence, which Boost's implementation leaves out.
      const std::uint64_t digits = i == 0 ? 0 : sequence();
      shares[i * dimensions + d] = unit(digits ^ shift[d]);
    }
  return shares;
}

#else

std::vector<double> sobol_points(std::size_t, std::uint64_t, std::uint64_t) {
  throw UserError(
      "--sample sobol needs Boost.Random, which this build was made without: install libboost-dev and build "
      "again, or take --sample latin");
}

#endif

}  // namespace cli
