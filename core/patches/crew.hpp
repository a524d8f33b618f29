// The threads among which a contact model may divide the preparation of one large patch's step.
#pragma once

#include <algorithm>
#include <cstdint>

namespace bristle::detail {

struct Crew {
  /// Calls task(of, k) once for each k from 0 to tasks - 1, on any thread; returns when all calls have ended.
  void (*run)(void* workers, int tasks, void (*task)(void* of, int k), void* of) noexcept;
  void* workers;
  std::uint32_t threads;
  std::uint32_t pieces;  ///< number of ranges into which work is best divided: enough of them to balance the
                         ///< threads, and none too small
};

/// Adds the count of one range to the count over all ranges.
inline void add_totals(std::uint64_t& sum, std::uint64_t part) noexcept { sum += part; }

/// Calls work(first, last, totals) for ranges that together are [0, count) and begin at multiples of `step`.
/// The crew's field `ranges` limits their number; without a crew one range runs on this thread. Returns the
/// sum of the totals, which must not depend on the order of adding.
template <class Totals, class Work>
Totals share_out(const Crew* crew, std::uint32_t Crew::*ranges, std::uint32_t count, std::uint32_t step,
                 const Work& work) noexcept {
  constexpr std::uint32_t most_ranges = 64;
  struct Shared {
    const Work& work;
    Totals* totals;
    std::uint32_t count, step, steps, parts;

    std::uint32_t begin_of(std::uint32_t part) const { return std::min(steps * part / parts * step, count); }
    static void run(void* of, int k) {
      const Shared& shared = *static_cast<const Shared*>(of);
      const auto part = static_cast<std::uint32_t>(k);
      Totals own{};  // sums of one range, on its thread's stack: threads share no cache line
      shared.work(shared.begin_of(part), shared.begin_of(part + 1), own);
      shared.totals[part] = own;
    }
  };
  const std::uint32_t steps = (count + step - 1) / step;
  const std::uint32_t parts = crew == nullptr ? 1 : std::min({crew->*ranges, steps, most_ranges});
  Totals sum{};
  if (parts <= 1) {
    work(0, count, sum);
    return sum;
  }
  Totals totals[most_ranges];
  Shared shared{work, totals, count, step, steps, parts};
  crew->run(crew->workers, static_cast<int>(parts), &Shared::run, &shared);
  for (std::uint32_t k = 0; k < parts; ++k) add_totals(sum, totals[k]);
  return sum;
}

}  // namespace bristle::detail
