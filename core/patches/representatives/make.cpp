// Makes a patch of representatives, out of contact, and resets it to that state.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <new>
#include <type_traits>

#include "core/common/assert.hpp"
#include "core/common/range_check.hpp"
#include "core/patches/representatives/population.hpp"
#include "core/patches/representatives/representatives.hpp"

namespace bristle::detail {
namespace {

template <class T>
constexpr SharedStep shared_step = {.prepare = &prepare<T>, .run = &run_blocks<T>, .finish = &finish<T>};

template <class T>
constexpr ContactModel representatives_model = {
    .name = sizeof(T) == sizeof(double) ? "representatives, double" : "representatives, single",
    .apply_load = &apply_load<T>,
    .step_bristles = &step_bristles<T>,
    .shared = &shared_step<T>,
    .reset = &reset<T>,
    .take_over = &take_over<T>,
    .copy = &copy_patch<T>,
    .stored_energy = &find_stored_energy<T>,
    .hash = &hash_patch<T>,
    .describe = &describe<T>,
    .read_bristles = &read_bristles<T>,
    .signature = &signature<T>,
    .save = &save<T>,
    .find_fault = &find_fault<T>,
    .restore = &restore<T>};

/// Returns the shortest first snap length in block b, scaled and rounded down. Straight bristles of the block
/// cannot snap on a shorter path.
template <class T>
float shortest_first(const Representatives<T>& r, std::uint32_t b) noexcept {
  const std::uint32_t end = std::min((b + 1) * block_size, r.bristles);
  const T least = *std::min_element(r.first + b * block_size, r.first + end);
  return static_cast<float>(least) * (1.0f - 1e-6f);
}

/// Returns the index of the kernel variant for a patch. With shared renewal it is a variant with energies,
/// because only these count snaps, which cause the renewals.
int find_variant(const PatchOptions& options, bool redraws, bool residual, bool renews, bool ages) noexcept {
  if (ages) return aged_variant_index(options.axes, redraws);
  return variant_index(options.axes, redraws, has(options.outputs, Outputs::mean),
                       renews || has(options.outputs, Outputs::energy), residual);
}

/// Takes the patch out of contact: every bristle becomes straight and has no weight.
template <class T>
void leave_contact(Patch& p) noexcept {
  const Representatives<T>& r = representatives<T>(p);
  for (std::uint32_t b = 0; b < r.block_count; ++b) enter_block<T>(p, b);
  forget_upper_bounds<T>(p);
}

template <class T>
Patch make_typed(std::shared_ptr<const CompiledMaterial> material, const PatchOptions& options,
                 const KernelSet<T>& kernels, double weight) {
  Representatives<T> made;
  made.material = material.get();
  made.options = options;
  const double zeta_max = made.material->material.bristles_in_contact(options.max_normal_load);
  made.bristles = options.bristles;
  if (made.bristles == 0)
    made.bristles = static_cast<std::uint32_t>(std::clamp(std::ceil(zeta_max), 1.0, 4096.0));
  made.options.bristles = made.bristles;
  made.first_seed = options.seed;
  made.full_weight = weight > 0.0 ? weight : zeta_max / made.bristles;
  made.variant = find_variant(options, made.redraws(), material->residual > 0.0, made.renews(), made.ages());
  made.kernels = &kernels;
  BRISTLE_ASSERT(kernels.step[made.variant] != nullptr);
  made.block_count = (made.padded() + block_size - 1) / block_size;
  made.group_count = (made.block_count + blocks_per_group - 1) / blocks_per_group;

  Representatives<T>* r = make_record(std::move(material), made);
  if (r->shared != nullptr) {
    new (r->shared) SharedRenewal{};
    plan_pieces(*r);
  }
  if (r->aged != nullptr) {
    new (r->aged) AgedSliding{};
    begin_ageing(*r);
  }
  r->find_lengths();
  fill_first(*r);
  fill_columns(*r);
  Patch p = make_shared_part(*r, representatives_model<T>);
  p.renews = r->renews();
  leave_contact<T>(p);
  note_count<T>(p);
  return p;
}

}  // namespace

template <class T>
void fill_first(Representatives<T>& r) noexcept {
  for (std::uint32_t i = 0; i < r.padded(); ++i) r.first[i] = first_length<T>(*r.material, r.options.seed, i);
  for (std::uint32_t b = 0; b < r.block_count; ++b) r.blocks[b].shortest = shortest_first(r, b);
}

template <class T>
void fill_columns(Representatives<T>& r) noexcept {
  Representatives<T>::columns(r, [&r](auto* column, const ColumnRule& rule) {
    if (rule.count == 0) return;
    if (rule.filler == Filler::zero || rule.filler == Filler::age)
      std::fill_n(column, rule.count, std::remove_pointer_t<decltype(column)>{});
    if constexpr (std::is_same_v<decltype(column), T*>) {
      if (rule.filler == Filler::first_length) std::memcpy(column, r.first, rule.count * sizeof *column);
    } else if constexpr (std::is_same_v<decltype(column), std::uint32_t*>) {
      if (rule.filler == Filler::random_state)
        fill_random_states(r.options.seed, Span<std::uint32_t>(column, rule.count));
    }
  });
}

template <class T>
void change_seed(Representatives<T>& r, std::uint32_t seed) noexcept {
  if (r.options.seed == seed) return;
  r.options.seed = seed;
  fill_first(r);
}

template <class T>
void reset(Patch& p, std::uint32_t seed, std::uint64_t key) noexcept {
  Representatives<T>& r = representatives<T>(p);
  static_cast<RepresentativeCount&>(r) = RepresentativeCount{};
  if (r.shared != nullptr) static_cast<RenewalState&>(*r.shared) = RenewalState{};
  r.options.key = key;
  change_seed(r, seed);
  fill_columns(r);
  p = make_shared_part(r, *p.model);
  p.renews = r.renews();
  leave_contact<T>(p);
  note_count<T>(p);
}

template <class T>
void copy_patch(const Patch& from, Patch& to, std::byte* memory) noexcept {
  copy_record<Representatives<T>>(from, to, memory);
  representatives<T>(to).find_lengths();
}

template <class T>
void describe(const Patch& p, PatchInfo& info) noexcept {
  const Representatives<T>& r = representatives<T>(p);
  info.representatives = r.bristles;
  info.weight = r.full_weight;
  info.max_normal_load = p.material().material.load_on_bristles(r.full_weight * r.bristles);
  info.active = r.active;
  std::size_t bytes = 0;
  Representatives<T>::columns(r, [&bytes](const auto* column, const ColumnRule& rule) {
    if (rule.count > 0 && (is_saved(rule.filler) || rule.filler == Filler::from_seed))
      bytes += sizeof *column;
  });
  info.bytes_per_representative = static_cast<std::uint32_t>(bytes);
  const unsigned features =
      (p.material().residual > 0.0 ? 1u : 0u) | (r.renews() ? 2u : 0u) | (r.ages() ? 4u : 0u);
  info.kernel = kernel_name(p, r.redraws() ? BristleKind::redraw : BristleKind::keep, features,
                            sizeof(T) == sizeof(double));
}

Patch make_representatives(std::shared_ptr<const CompiledMaterial> material, const PatchOptions& options,
                           const KernelTable& kernels, double weight) {
  material->material.validate_for_representatives();
  material->make_sampling_tables();
#if BRISTLE_WITH_DOUBLE
  if (options.precision == Precision::double_)
    return make_typed<double>(std::move(material), options, kernels.f64, weight);
#endif
  return make_typed<float>(std::move(material), options, kernels.f32, weight);
}

BRISTLE_INSTANTIATE(fill_first, fill_columns, change_seed, reset, copy_patch, describe)

}  // namespace bristle::detail
