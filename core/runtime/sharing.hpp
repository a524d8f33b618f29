// When a step is shared among threads, and in what pieces.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdlib>

namespace bristle::detail {

/// Measured by `bristle_bench --benchmark_filter='^threads/'`; see bench/README.md for figures.
struct Sharing {
  /// A step with fewer bristles to visit than this stays on the calling thread. Steps back to back: a worker
  /// that has just worked comes in a microsecond (measured break-even below 20,000 bristles).
  std::uint64_t parallel_from = 20000;
  /// Bristles from which a step is shared after a pause, as between the ticks of a servo loop: a sleeping
  /// worker comes after 30 us, in which the calling thread steps some 100,000 bristles alone (measured
  /// break-even 200,000).
  std::uint64_t parallel_from_paused = 200000;
  /// Workers are taken to sleep this long after the last step, s. They spin for some ten microseconds.
  double awake = 20e-6;
  /// A piece of work is no smaller than this, in bristles.
  std::uint64_t smallest_piece = 8192;
  /// Fixed cost of a patch, in bristles.
  std::uint64_t patch_overhead = 280;
};

/// Returns the values above, or those in BRISTLE_SHARING ("parallel_from,smallest_piece,patch_overhead"), for
/// measuring. Anything else in it is ignored. Bits do not depend on it.
inline Sharing chosen_sharing() noexcept {
  Sharing sharing;
  const char* text = std::getenv("BRISTLE_SHARING");
  if (text == nullptr) return sharing;
  char* end = nullptr;
  const std::uint64_t from = std::strtoull(text, &end, 10);
  if (end == text || *end != ',') return sharing;
  text = end + 1;
  const std::uint64_t piece = std::strtoull(text, &end, 10);
  if (end == text || *end != ',' || piece == 0) return sharing;
  text = end + 1;
  const std::uint64_t patch = std::strtoull(text, &end, 10);
  if (end == text || *end != 0 || patch == 0) return sharing;
  return {from, from, 0.0, piece, patch};
}

/// Pause of sharing after workers have held the caller up. A worker that the system takes off its core within
/// a piece keeps the caller waiting until it is back, up to tens of milliseconds; nobody can do that piece
/// for it. Where this happens, cores are wanted by others, and sharing would lose more than it gains.
class Retreat {
 public:
  /// Whether the pause is over. Call it once for each step that is worth sharing.
  bool is_over() noexcept {
    if (steps_alone_ == 0) return true;
    --steps_alone_;
    return false;
  }
  /// Records a shared step: how long the caller worked and then waited for others, s.
  void judge(double worked, double waited) noexcept {
    if (waited > worked + grace) {
      steps_alone_ = length_;
      length_ = std::min(4 * length_, longest);
      good_ = 0;
    } else if (++good_ >= longest) {
      length_ = first;
    }
  }

  static constexpr std::uint32_t first = 32, longest = 8192;  ///< steps
  /// Longest wait that counts as no harm, s: in an even share nobody waits longer than for the last piece.
  static constexpr double grace = 200e-6;

 private:
  std::uint32_t steps_alone_ = 0;
  std::uint32_t length_ = first;
  std::uint32_t good_ = 0;  ///< steps since the last retreat
};

}  // namespace bristle::detail
