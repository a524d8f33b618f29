// Changes the material of a patch of representatives while it is in use (core/MODEL.md, section 6).
#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/materials/quantile_map.hpp"
#include "core/patches/representatives/population.hpp"
#include "core/patches/representatives/representatives.hpp"
#include "core/random_states.hpp"

namespace bristle::detail {
namespace {

/// Returns the deflection at which a bristle with the snap length `length_m` (m) snaps, residual included, in
/// scaled units.
template <class T>
T limit_of(const CompiledMaterial& material, double length_m) noexcept {
  const double scaled = length_m * material.lengths_per_metre;
  return static_cast<T>(material.residual +
                        std::clamp(scaled, shortest_beyond_residual<T>(material), material.longest));
}

/// Copies the state of the bristles in contact to a patch of another material: lengths in its unit, snap
/// lengths at equal quantile of its law, and random states unchanged.
template <class T>
void take_over_columns(Representatives<T>& to, const Representatives<T>& from) noexcept {
  // Ratio of the old to the new unit of length, a power of two, so that conversion is exact.
  const double ratio = from.material->metres_per_length * to.material->lengths_per_metre;
  const SnapLength& law = to.material->material.snap_length;
  const SnapLength& old_law = from.material->material.snap_length;
  const bool same_lengths = law == old_law && to.material->residual == from.material->residual;
  const bool both_redraw = to.redraws() && from.redraws();
  const std::uint32_t contact = from.in_contact();
  const double age_ratio = from.ages() && to.ages()
                               ? from.material->material.ageing_time / to.material->material.ageing_time
                               : 0.0;
  const auto take = [&](auto* column, const auto* old, const ColumnRule& rule) {
    using Entry = std::remove_pointer_t<decltype(column)>;
    if (rule.count == 0) return;
    if constexpr (std::is_same_v<Entry, T>) {
      if (rule.filler == Filler::zero)
        for (std::uint32_t i = 0; i < contact; ++i)
          column[i] = static_cast<T>(static_cast<double>(old[i]) * ratio);
      // Keeps each bristle's age in seconds. Ages begin at 0 if the old material did not age.
      if (rule.filler == Filler::age && age_ratio > 0.0)
        for (std::uint32_t i = 0; i < contact; ++i)
          column[i] = static_cast<T>(std::min(static_cast<double>(old[i]) * age_ratio, oldest_bristle));
      if (rule.filler == Filler::first_length && both_redraw && !same_lengths) {
        const QuantileMap of_equal_quantile(old_law, law);
        const double less = static_cast<double>(static_cast<T>(from.material->residual));
        for (std::uint32_t i = 0; i < contact; ++i) {
          const double before = (static_cast<double>(old[i]) - less) * from.material->metres_per_length;
          column[i] =
              limit_of<T>(*to.material, of_equal_quantile(before, stratified_share(from.options.seed, i)));
        }
        return;
      }
    }
    if (both_redraw && (rule.filler == Filler::random_state || rule.filler == Filler::first_length))
      std::memcpy(column, old,
                  (rule.filler == Filler::random_state ? from.bristles : contact) * sizeof(Entry));
  };
  // Pairs the columns of the old and the new record, which list them in the same order.
  const void* columns_of_from[16];
  int count = 0;
  Representatives<T>::columns(
      from, [&](const auto* column, const ColumnRule&) { columns_of_from[count++] = column; });
  count = 0;
  Representatives<T>::columns(to, [&](auto* column, const ColumnRule& rule) {
    take(column, static_cast<decltype(column)>(const_cast<void*>(columns_of_from[count++])), rule);
  });
}

/// Lets bristles snap that are bent beyond their new snap length; if they redraw, they sample another length.
/// The patch does not move, so they slip along their own deflection.
template <class T>
void snap_beyond(Patch& p) noexcept {
  const Representatives<T>& r = representatives<T>(p);
  const double joules = joules_per_square<T>(p);
  const double left = p.material().residual;
  for (std::uint32_t i = 0; i < r.in_contact(); ++i) {
    const auto x = static_cast<double>(r.zx[i]);
    const double y = r.zy == nullptr ? 0.0 : static_cast<double>(r.zy[i]);
    const double limit = limit_now(r, i);
    if (x * x + y * y > limit * limit) {
      const double w = i < r.whole ? 1.0 : r.fraction;
      const double share = left / std::sqrt(x * x + y * y);
      r.zx[i] = static_cast<T>(x * share + 0.0);  // adds 0.0 to avoid a negative zero
      if (r.zy != nullptr) r.zy[i] = static_cast<T>(y * share + 0.0);
      if (r.age != nullptr) r.age[i] = T(0);
      if (r.redraws()) {
        r.random[i] += random_stride;
        r.delta[i] = limit_of<T>(
            p.material(), p.material().material.snap_length.quantile(share_of<double>(mix(r.random[i]))));
      }
      p.pending_dissipated += joules * w * (x * x + r.lay.energy * y * y - left * left);
      ++p.pending_snaps;
    }
  }
}

}  // namespace

template <class T>
void take_over(Patch& to, Patch& from) noexcept {
  Representatives<T>& r = representatives<T>(to);
  const Representatives<T>& old = representatives<T>(from);
  // Makes the new patch with the seed of the last reset, which may differ from the seed in the options.
  if (r.options.seed != old.options.seed) {
    change_seed(r, old.options.seed);
    fill_columns(r);
  }
  for (std::uint32_t b = 0; b < old.active_blocks(); ++b) rewrite_block<T>(from, b);
  to.overload = from.overload;
  static_cast<RepresentativeCount&>(r) = old;
  if (r.shared != nullptr) {
    if (old.shared != nullptr) static_cast<RenewalState&>(*r.shared) = *old.shared;
    r.shared->end_slide();
  }
  take_over_columns(r, old);
  for (std::uint32_t b = 0; r.since != nullptr && b < r.block_count; ++b) r.since[b] = time_of(to);
  snap_beyond<T>(to);
  for (std::uint32_t b = 0; b < r.active_blocks(); ++b) {
    r.blocks[b].zero = 0;
    rewrite_block<T>(to, b);
    if (b < r.full_blocks()) book_block<T>(to, b, +1);
  }
  // Applies the present load again, because under the new material it may bring another number of bristles
  // into contact.
  to.pending_loss += apply_load<T>(to, from.normal_load);
}

BRISTLE_INSTANTIATE(take_over)

}  // namespace bristle::detail
