#include "bristle/load_shedder.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <vector>

#include "bristle/error.hpp"
#include "core/common/assert.hpp"
#include "core/common/range_check.hpp"
#include "core/runtime/batch_access.hpp"
#include "core/runtime/sharing.hpp"

namespace bristle {

using namespace detail;

namespace {

/// Share of the time budget below which a step is too short to learn the time per bristle from it.
constexpr double least_timed_share = 0.05;
/// Largest share of a patch's bristles in use that is restored at once, and smallest share worth restoring.
constexpr double largest_gift = 1.0 / 8.0;
constexpr double smallest_gift = 1.0 / 64.0;
/// Number of waits (between restorations) within which a restored share must not be shed again; if it is,
/// restoring it was a mistake.
constexpr std::uint64_t regret_waits = 4;
/// Number of waits without a mistaken restoration after which the wait between restorations is halved. With
/// fewer waits the mistake would recur at once.
constexpr std::uint64_t calm_waits = 16;
constexpr std::uint64_t longest_wait = 64;  ///< longest wait, in multiples of the first one

/// Number of cohorts that a step visits for each piece (PatchOptions::resolution) of an infinite brush, for
/// lognormal lengths of spread 0.3 and uniform lengths.
constexpr double cohorts_per_piece = 2.0;
/// Least number of pieces that an infinite brush keeps, whatever its `least_bristles`: with 1 or 2 pieces it
/// creates energy under renewal.
constexpr std::uint32_t fewest_pieces = 4;

bool is_infinite(const PatchInfo& info) noexcept { return info.weight == 0.0; }

/// Returns the least number of representatives, or of pieces of an infinite brush, for a patch that was added
/// with `least_bristles`.
std::uint32_t find_floor(const PatchInfo& info, std::uint32_t least_bristles) noexcept {
  if (!is_infinite(info)) return std::min(least_bristles, info.representatives);
  const std::uint32_t half = std::max((info.representatives + 1) / 2, fewest_pieces);
  return std::min(std::clamp(least_bristles, fewest_pieces, half), info.representatives);
}

}  // namespace

struct BRISTLE_PRIVATE LoadShedder::Impl {
  struct Entry {
    PatchId id;
    int priority = 0;
    std::uint32_t least_bristles = 1;
    // Filled by each survey of the motions of a step:
    std::uint32_t least = 1;
    std::uint64_t survey = 0;
    double active = 0.0;  ///< bristles or cohorts that a step of the patch may visit; 0 if the patch does not
                          ///< move
    bool infinite = false;
    bool glides = false;  ///< whether the patch is in a steady slide that visits no cohort
    std::uint32_t detail = 0, bristles = 0, wanted = 0;
  };

  LoadShedderOptions options;
  std::vector<Entry> entries;                                    ///< entries of the patches, sorted by
                                                                 ///< priority, lowest first
  std::unordered_map<std::uint32_t, std::size_t> entry_of_slot;  ///< index in `entries` by slot; a map,
                                                                 ///< because an id may name any slot
  std::vector<DetailDecision> record;
  double patch_overhead = static_cast<double>(Sharing{}.patch_overhead);
  double rate = 0.0;       ///< estimated time per visited bristle, s; 0 = not yet known
  double last_rate = 0.0;  ///< time per bristle, s, in the last step that was long enough to learn from

  // Costs found by the last survey, in visits to a bristle: of patches, representatives and cohorts.
  double fixed = 0.0, of_bristles = 0.0, of_cohorts = 0.0;
  double looked_at =
      1.0;  ///< share of `of_cohorts` that a step visits; patches that glide or stick visit none
  std::uint64_t surveyed = ~std::uint64_t{0};  ///< number of the step whose cost before_step estimated
  std::uint64_t steps = 0, surveys = 0, late = 0, decided = 0, lost = 0;
  std::uint64_t last_gift = 0;  ///< number of the step of the last restoration; 0 = none, or already counted
                                ///< as a mistake
  std::uint64_t last_change = 0, wait = 0;
  std::uint64_t last_wait_change = 0;
  int late_in_row = 0;

  Entry* find(PatchId id) noexcept {
    const auto found = entry_of_slot.find(static_cast<std::uint32_t>(id.value));
    if (found == entry_of_slot.end()) return nullptr;
    BRISTLE_ASSERT(found->second < entries.size());
    Entry& entry = entries[found->second];
    return entry.id == id ? &entry : nullptr;
  }

  /// Updates `entry_of_slot` for the entries from `first` on, which have moved.
  void index_entries(std::size_t first) noexcept {
    for (std::size_t i = first; i < entries.size(); ++i)
      entry_of_slot.find(static_cast<std::uint32_t>(entries[i].id.value))->second = i;
  }

  /// Erases the entry in the slot of `id`, if there is one.
  void erase(PatchId id) noexcept {
    const auto found = entry_of_slot.find(static_cast<std::uint32_t>(id.value));
    if (found == entry_of_slot.end()) return;
    const std::size_t at = found->second;
    entry_of_slot.erase(found);
    entries.erase(entries.begin() + static_cast<std::ptrdiff_t>(at));
    index_entries(at);
  }

  /// Estimates the cost of all motions, assuming that every bristle of a moving patch is visited.
  void survey(const PatchBatch& batch, Span<const Motion> in) noexcept {
    ++surveys;
    fixed = of_bristles = of_cohorts = 0.0;
    for (const Motion& motion : in) {
      const PatchInfo info = batch.info(motion.id);
      if (info.representatives == 0) continue;
      fixed += patch_overhead;
      const bool moves = motion.displacement[0] != 0.0 || motion.displacement[1] != 0.0;
      const double share = std::min(motion.normal_load / info.max_normal_load, 1.0);
      const double visited = is_infinite(info) ? cohorts_per_piece * info.detail : share * info.detail;
      const double active = moves && share > 0.0 ? visited : 0.0;
      const bool glides = is_infinite(info) && BatchAccess::glides(batch, motion.id);
      if (!glides) (is_infinite(info) ? of_cohorts : of_bristles) += active;
      Entry* entry = find(motion.id);
      if (entry == nullptr) continue;
      entry->survey = surveys;
      entry->active = active;
      entry->infinite = is_infinite(info);
      entry->glides = glides;
      entry->detail = entry->wanted = info.detail;
      entry->bristles = info.representatives;
      entry->least = find_floor(info, entry->least_bristles);
    }
  }
  double units() const noexcept { return fixed + of_bristles + looked_at * of_cohorts; }

  /// Updates `looked_at` from a step's number of visits, in which representatives count too. Includes the
  /// cohorts of a glide that ended in the step, and none of one that began.
  void note_visits(const PatchBatch& batch, std::uint64_t visits) noexcept {
    for (Entry& entry : entries) {
      if (!is_here(entry) || !entry.infinite || BatchAccess::glides(batch, entry.id) == entry.glides)
        continue;
      of_cohorts += entry.glides ? entry.active : -entry.active;
      entry.glides = !entry.glides;
    }
    if (of_cohorts > 0.0) looked_at = std::min(static_cast<double>(visits) / of_cohorts, 1.0);
  }

  bool is_here(const Entry& entry) const noexcept { return entry.survey == surveys && entry.active > 0.0; }

  /// Updates the estimated time per bristle from a step. The estimate rises only after two slow steps in a
  /// row, because one may have been disturbed. The estimate falls slowly, so that the first load after a
  /// quiet second does not make a step late.
  void learn(double time_s, const StepReport& report) noexcept {
    const double units =
        static_cast<double>(report.bristles_visited) + patch_overhead * report.patches_stepped;
    if (report.bristles_visited == 0) return;
    const double seen = time_s / units;
    if (last_rate == 0.0) {
      last_rate = seen;
      return;
    }
    const double least_timed = least_timed_share * options.budget_s;
    if (rate > 0.0 && units * rate < least_timed && time_s < least_timed) return;
    const double sure = std::min(seen, last_rate);
    last_rate = seen;
    if (sure > rate) rate = sure;
    if (seen < rate) rate += (seen - rate) / 256.0;
  }

  void decide(PatchBatch& batch, Entry& entry) noexcept {
    BRISTLE_ASSERT(entry.wanted >= 1 && entry.wanted <= entry.bristles);
    BRISTLE_ASSERT(entry.wanted > entry.detail || entry.wanted >= entry.least);
    batch.set_detail(entry.id, entry.wanted);
    entry.active *= static_cast<double>(entry.wanted) / entry.detail;
    entry.detail = entry.wanted;
    ++decided;
    last_change = steps;
    if (record.size() < record.capacity())
      record.push_back({steps, entry.id, entry.wanted});
    else
      ++lost;
  }

  /// Sheds `excess` bristles from moving patches: lowest priority first, equal shares within a priority.
  int shed(PatchBatch& batch, double excess) noexcept {
    for (std::size_t first = 0, last = 0; first < entries.size() && excess > 0.0; first = last) {
      while (last < entries.size() && entries[last].priority == entries[first].priority) ++last;
      // Repeats, because patches at their least number of bristles leave the shedding to other patches.
      for (int round = 0; round < 8 && excess > 0.5; ++round) {
        double can = 0.0;
        for (std::size_t i = first; i < last; ++i)
          if (is_here(entries[i]) && entries[i].wanted > entries[i].least) can += contact(entries[i]);
        if (can <= 0.0) break;
        const double keep = std::max(1.0 - excess / can, 0.0);
        for (std::size_t i = first; i < last; ++i) {
          Entry& entry = entries[i];
          if (!is_here(entry) || entry.glides || entry.wanted <= entry.least) continue;
          const double before = contact(entry);
          const double wanted = std::floor(keep * entry.wanted);
          entry.wanted = std::max(entry.least, static_cast<std::uint32_t>(wanted));
          excess -= before - contact(entry);
        }
      }
    }
    int changed = 0;
    for (Entry& entry : entries) {
      if (!is_here(entry) || entry.wanted == entry.detail) continue;
      decide(batch, entry);
      ++changed;
    }
    if (changed > 0 && last_gift != 0 && steps - last_gift < regret_waits * wait) {
      change_wait(2 * wait);
      last_gift = 0;  // counts a mistake once, however many steps correct it
    }
    return changed;
  }

  void change_wait(std::uint64_t to) noexcept {
    const auto shortest = static_cast<std::uint64_t>(options.wait_steps);
    BRISTLE_ASSERT(shortest >= 1);
    wait = std::clamp(to, shortest, longest_wait * shortest);
    last_wait_change = steps;
  }

  /// Returns how many bristles or cohorts a step would visit in a patch with `wanted` bristles or pieces.
  double contact(const Entry& entry) const noexcept {
    if (entry.glides) return 0.0;
    return entry.active * (entry.infinite ? looked_at : 1.0) * entry.wanted / entry.detail;
  }

  /// Restores bristles of one patch: the one with the least share among those of the highest priority.
  int give(PatchBatch& batch, double units) noexcept {
    Entry* chosen = nullptr;
    const auto share = [](const Entry& e) { return static_cast<double>(e.detail) / e.bristles; };
    for (Entry& entry : entries) {
      if (!is_here(entry) || entry.detail >= entry.bristles) continue;
      if (chosen == nullptr || entry.priority > chosen->priority || share(entry) < share(*chosen))
        chosen = &entry;
    }
    if (chosen == nullptr) return 0;
    // Time left for restored bristles. Each costs change_s once, and `rate` in this and every later step.
    const double room = options.restore_to * options.budget_s - rate * units;
    const double most = room / (rate + options.change_s) / chosen->active * chosen->detail;
    const double lacking = chosen->bristles - chosen->detail;
    const double gift = std::min({most, largest_gift * chosen->detail + 1.0, lacking});
    if (gift < 1.0 || gift < std::min(smallest_gift * chosen->detail, lacking)) return 0;
    chosen->wanted = chosen->detail + static_cast<std::uint32_t>(gift);
    decide(batch, *chosen);
    // Shortens the wait between restorations after many without a mistake.
    if (steps - last_wait_change >= calm_waits * wait) change_wait(wait / 2);
    last_gift = steps;
    return 1;
  }
};

LoadShedder::LoadShedder(const LoadShedderOptions& options) : impl_(std::make_unique<Impl>()) {
  constexpr const char* where = "LoadShedderOptions";
  require_within(where, "budget_s", options.budget_s, 1e-9, 1e3, "s");
  require_within(where, "shed_above", options.shed_above, 0.01, 1.0, "");
  require_within(where, "shed_to", options.shed_to, 0.01, options.shed_above, "");
  require_within(where, "restore_to", options.restore_to, 0.01, options.shed_above, "");
  if (options.late_steps < 1) refuse(where, "late_steps", options.late_steps, "1 or more");
  if (options.wait_steps < 1) refuse(where, "wait_steps", options.wait_steps, "1 or more");
  require_within(where, "rate_s", options.rate_s, 0.0, 1.0, "s");
  require_within(where, "change_s", options.change_s, 0.0, 1.0, "s");
  constexpr std::size_t most_recorded = std::size_t{1} << 26;
  if (options.record > most_recorded)
    refuse(where, "record", static_cast<double>(options.record), "0 to 67108864");
  impl_->options = options;
  impl_->rate = impl_->last_rate = options.rate_s;
  impl_->wait = static_cast<std::uint64_t>(options.wait_steps);
  impl_->record.reserve(options.record);
}

LoadShedder::~LoadShedder() = default;
LoadShedder::LoadShedder(LoadShedder&&) noexcept = default;
LoadShedder& LoadShedder::operator=(LoadShedder&&) noexcept = default;

void LoadShedder::add(PatchId patch, int priority, std::uint32_t least_bristles) {
  if (!patch) throw Error("LoadShedder: ids 0 and no_capacity() name no patch");
  if (least_bristles == 0) refuse("LoadShedder", "least_bristles", least_bristles, "1 or more");
  Impl& impl = *impl_;
  impl.erase(patch);                              // erases also the entry of a removed patch in whose
                                                  // slot `patch` now is
  impl.entries.reserve(impl.entries.size() + 1);  // reserves first, so that nothing can fail after the state
                                                  // has changed
  impl.entry_of_slot.emplace(static_cast<std::uint32_t>(patch.value), 0);
  Impl::Entry entry;
  entry.id = patch;
  entry.priority = priority;
  entry.least_bristles = least_bristles;
  const auto at = std::upper_bound(impl.entries.begin(), impl.entries.end(), priority,
                                   [](int p, const Impl::Entry& e) { return p < e.priority; });
  const auto first = static_cast<std::size_t>(at - impl.entries.begin());
  impl.entries.insert(at, entry);
  impl.index_entries(first);
  BRISTLE_ASSERT(std::is_sorted(impl.entries.begin(), impl.entries.end(),
                                [](const auto& x, const auto& y) { return x.priority < y.priority; }));
}

void LoadShedder::remove(PatchId patch) noexcept {
  if (impl_->find(patch) != nullptr) impl_->erase(patch);
}

int LoadShedder::before_step(PatchBatch& batch, Span<const Motion> in) noexcept {
  Impl& impl = *impl_;
  if (impl.rate <= 0.0 || impl.entries.empty()) return 0;
  impl.survey(batch, in);
  impl.surveyed = impl.steps;
  const double units = impl.units();
  const double budget = impl.options.budget_s;
  if (!(impl.rate * units > impl.options.shed_above * budget)) return 0;
  return impl.shed(batch, units - impl.options.shed_to * budget / impl.rate);
}

int LoadShedder::after_step(PatchBatch& batch, Span<const Motion> in, double step_time_s,
                            const StepReport& report) noexcept {
  Impl& impl = *impl_;
  if (impl.surveyed == impl.steps) impl.note_visits(batch, report.bristles_visited);
  ++impl.steps;
  if (!(step_time_s > 0.0) || !std::isfinite(step_time_s)) return 0;
  const double budget = impl.options.budget_s;
  if (step_time_s > budget) ++impl.late;
  impl.learn(step_time_s, report);
  if (step_time_s > impl.options.shed_above * budget) {
    if (++impl.late_in_row < impl.options.late_steps) return 0;
    double keep = impl.options.shed_to * budget / step_time_s;
    // Sheds at most half in the first step of a row that sheds, since a disturbance may be the cause.
    if (impl.late_in_row == impl.options.late_steps) keep = std::max(keep, 0.5);
    impl.survey(batch, in);
    impl.note_visits(batch, report.bristles_visited);
    return impl.shed(batch, (1.0 - keep) * impl.units());
  }
  impl.late_in_row = 0;
  if (impl.decided == 0 || impl.rate <= 0.0 || impl.steps - impl.last_change < impl.wait) return 0;
  impl.survey(batch, in);
  const int given = impl.give(batch, impl.units());
  // Begins another whole wait if nothing could be restored.
  if (given == 0) impl.last_change = impl.steps;
  return given;
}

Span<const DetailDecision> LoadShedder::decisions() const noexcept {
  return {impl_->record.data(), impl_->record.size()};
}
void LoadShedder::clear_decisions() noexcept { impl_->record.clear(); }
std::uint64_t LoadShedder::steps() const noexcept { return impl_->steps; }

ShedReport LoadShedder::report(const PatchBatch& batch) const noexcept {
  ShedReport report;
  // Smallest share of its bristles that any patch uses at present; for infinite brushes, of its pieces.
  double of_bristles = 1.0, of_pieces = 1.0;
  for (const Impl::Entry& entry : impl_->entries) {
    const PatchInfo info = batch.info(entry.id);
    if (info.representatives == 0) continue;
    if (info.detail <= find_floor(info, entry.least_bristles)) ++report.at_least;
    if (info.detail >= info.representatives) continue;
    ++report.patches;
    report.bristles += info.representatives - info.detail;
    double& least = is_infinite(info) ? of_pieces : of_bristles;
    least = std::min(least, static_cast<double>(info.detail) / info.representatives);
  }
  report.least_share = std::min(of_bristles, of_pieces);
  report.noise_growth = 1.0 / std::sqrt(of_bristles);
  report.error_growth = 1.0 / (of_pieces * of_pieces);
  report.rate_s = impl_->rate;
  report.late_steps = impl_->late;
  report.decisions = impl_->decided;
  report.decisions_lost = impl_->lost;
  return report;
}

std::size_t apply_decisions(PatchBatch& batch, Span<const DetailDecision> decisions,
                            std::uint64_t step) noexcept {
  std::size_t count = 0;
  for (; count < decisions.size() && decisions[count].step <= step; ++count)
    batch.set_detail(decisions[count].patch, decisions[count].bristles);
  return count;
}

double sliding_noise(const Material& material, double active) noexcept {
  if (material.snap_rule == SnapRule::slide) return 0.0;
  const SnapLength& law = material.snap_length;
  const double m1 = law.moment(1), m2 = law.moment(2), m3 = law.moment(3);
  const double one = material.snap_rule == SnapRule::keep
                         ? std::sqrt(m2 / 12.0) / (0.5 * m1)
                         : std::sqrt(m3 / (3.0 * m1) - m2 * m2 / (4.0 * m1 * m1)) / (0.5 * m2 / m1);
  return one / std::sqrt(active);
}

}  // namespace bristle
