// Searches the largest number of bristles for which the 99th percentile of step time is within a deadline.
#include <algorithm>
#include <memory>

#include "tools/libraries/capacity/capacity.hpp"
#include "tools/libraries/capacity/subject.hpp"

namespace cli {
namespace {

constexpr std::uint64_t papers_bristles = 900;
constexpr std::uint64_t in_cache_bristles = 16 * papers_bristles;
// Largest number of bristles that is tried (some 200 MB). If it fits, the report says that more may.
constexpr std::uint64_t most_bristles = 1ull << 24;

std::uint64_t probe_steps(const CapacityOptions& options) { return options.quick ? 100 : 300; }

class Search {
 public:
  Search(const CapacityCase& what, const CapacityOptions& options, const MeasureSteps& measure)
      : options_(options), measure_(measure) {
    row_.what = what;
  }

  CapacityRow run() {
    grow();
    if (fits_ > 0) {
      if (!row_.capped) narrow();
      confirm();
    }
    std::sort(row_.curve.begin(), row_.curve.end(), [](auto& a, auto& b) { return a.bristles < b.bristles; });
    return row_;
  }

 private:
  std::uint64_t confirming_steps() const { return options_.quick ? 500 : 2000; }
  // Returns the precision of the search: it ends when the smallest number that fails is at most this many
  // times the largest that fits.
  double resolution() const { return options_.quick ? 1.1 : 1.02; }

  // Rounds a number of bristles down to whole patches, at least one.
  std::uint64_t whole(double bristles) const {
    const std::uint64_t n = static_cast<std::uint64_t>(bristles);
    const std::uint64_t unit = row_.what.patch_bristles ? row_.what.patch_bristles : 1;
    return std::max(unit, n / unit * unit);
  }

  bool fits(const StepTimes& times) const { return times.p99_s <= options_.deadline_s; }

  // Repeats a measurement whose 99th percentile misses the deadline although its median is well inside. Other
  // programs cause such outliers.
  StepTimes measure_with_patience(std::uint64_t bristles, std::uint64_t steps, int tries) const {
    StepTimes best = measure_(bristles, steps);
    for (int i = 1; i < tries && !fits(best) && best.p50_s < 0.9 * options_.deadline_s; ++i) {
      const StepTimes again = measure_(bristles, steps);
      if (again.p99_s < best.p99_s) best = again;
    }
    return best;
  }

  bool probe(std::uint64_t bristles) {
    const StepTimes times = measure_with_patience(bristles, probe_steps(options_), options_.quick ? 2 : 4);
    row_.curve.push_back(times);
    if (bristles == whole(static_cast<double>(in_cache_bristles))) row_.in_cache = times;
    if (fits(times) && bristles > fits_) {
      fits_ = bristles;
      fits_p99_s_ = times.p99_s;
    } else if (!fits(times) && (too_many_ == 0 || bristles < too_many_)) {
      too_many_ = bristles;
      too_many_p99_s_ = times.p99_s;
    }
    return fits(times);
  }

  void grow() {
    std::uint64_t n = whole(papers_bristles);
    while (probe(n)) {
      if (n == most_bristles) {
        row_.capped = true;
        return;
      }
      // Tries four times as many bristles, so that the points of the curve are well spaced, but no more than
      // twice the number that is expected to fit.
      const double per_bristle = row_.curve.back().p99_s / static_cast<double>(n);
      const double should_fit = options_.deadline_s / per_bristle;
      const double next =
          std::max(1.25 * static_cast<double>(n), std::min(4.0 * static_cast<double>(n), 2.0 * should_fit));
      n = std::min(whole(next), most_bristles);
    }
  }

  void narrow() {
    for (int i = 0; i < 12 && static_cast<double>(too_many_) > resolution() * static_cast<double>(fits_);
         ++i) {
      // Tries the number at which the line through the two times next to the deadline meets it, because step
      // time grows almost in proportion to the number of bristles. Moves each end of the interval by at least
      // a tenth of it, so that the search ends.
      const double low = static_cast<double>(fits_), high = static_cast<double>(too_many_);
      const double along = (options_.deadline_s - fits_p99_s_) / (too_many_p99_s_ - fits_p99_s_);
      const std::uint64_t next = whole(low + std::clamp(along, 0.1, 0.9) * (high - low));
      if (next <= fits_ || next >= too_many_) return;
      probe(next);
    }
  }

  // Confirms the number of bristles found by a longer run, since a 99th percentile of few steps is noisy.
  // Lowers the number until a run meets the deadline.
  void confirm() {
    for (int i = 0; i < (options_.quick ? 6 : 20); ++i) {
      row_.fits = measure_with_patience(fits_, confirming_steps(), 2);
      if (fits(row_.fits)) return;
      fits_ = whole(0.95 * static_cast<double>(fits_));
      row_.capped = false;
    }
    row_.unconfirmed = true;  // only short runs met the deadline, as other programs disturb the machine
  }

  const CapacityOptions& options_;
  const MeasureSteps& measure_;
  CapacityRow row_;
  std::uint64_t fits_ = 0;      // largest number of bristles that met the deadline so far
  std::uint64_t too_many_ = 0;  // smallest number of bristles that missed the deadline so far; 0: none
  double fits_p99_s_ = 0.0;     // 99th percentile of step time with `fits_` bristles, s
  double too_many_p99_s_ = 0.0;
};

}  // namespace

CapacityRow find_capacity(const CapacityCase& what, const CapacityOptions& options) {
  std::unique_ptr<CapacitySubject> subject;
  return find_capacity(what, options, [&](std::uint64_t bristles, std::uint64_t steps) {
    if (!subject || subject->bristles() != bristles) {
      subject.reset();  // frees the memory of one number of bristles before it takes that of the next
      subject = std::make_unique<CapacitySubject>(what, bristles, options.isa);
    }
    return time_steps(*subject, steps, probe_steps(options), options.deadline_s);
  });
}

CapacityRow find_capacity(const CapacityCase& what, const CapacityOptions& options,
                          const MeasureSteps& measure) {
  return Search(what, options, measure).run();
}

}  // namespace cli
