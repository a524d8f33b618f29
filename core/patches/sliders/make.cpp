// Makes and resets a patch of bristles that slide at their limit.
#include <algorithm>

#include "core/common/hashing.hpp"
#include "core/common/range_check.hpp"
#include "core/materials/strata.hpp"
#include "core/patches/sliders/sliders.hpp"

namespace bristle::detail {
namespace {

/// Makes the patch's shared part, with the number of cache lines of the record to prefetch, at most 40.
template <class T>
Patch shared_part(Sliders<T>& r, const ContactModel& model) noexcept {
  Patch p = make_shared_part(r, model);
  p.fetched_lines = static_cast<std::uint8_t>(std::min<std::size_t>(r.bytes / 64, 40));
  return p;
}

template <class T>
void reset(Patch& p, std::uint32_t seed, std::uint64_t key) noexcept {
  Sliders<T>& r = sliders<T>(p);
  r.options.seed = seed;
  r.options.key = key;
  p = shared_part(r, *p.model);
  straighten<T>(p);
  note_sliders<T>(p);
}

template <class T>
double stored_energy(const Patch& p) noexcept {
  return 0.5 * joules_per_square<T>(sliders<T>(p)) * sum_of_squares<T>(p);
}

template <class T>
void describe(const Patch& p, PatchInfo& info) noexcept {
  const Sliders<T>& r = sliders<T>(p);
  info.representatives = r.bristles;
  info.weight = r.full_weight;
  info.max_normal_load = p.material().material.load_on_bristles(r.full_weight * r.bristles);
  info.active = p.zeta > 0.0 ? r.bristles : 0.0;
  info.bytes_per_representative =
      static_cast<std::uint32_t>(sizeof(T) * (p.axes + 5u) + (r.since != nullptr ? sizeof(double) : 0));
  info.kernel = kernel_name(p, BristleKind::slide, r.since != nullptr ? 1u : 0u, sizeof(T) == sizeof(double));
}

template <class T>
void read_bristles(const Patch& p, std::size_t count, Span<double> zx, Span<double> zy,
                   Span<double> delta) noexcept {
  const Sliders<T>& r = sliders<T>(p);
  const double metres = p.material().metres_per_length;
  for (std::size_t k = 0; k < count; ++k) {
    const auto i = static_cast<std::uint32_t>(k);
    const bool in = p.zeta > 0.0;
    if (!zx.empty()) zx[k] = in ? (deflection<T>(p, i, 0) + centre_of<T>(p, i)) * metres : 0.0;
    if (!zy.empty()) zy[k] = in ? deflection<T>(p, i, 1) * metres : 0.0;
    if (!delta.empty()) delta[k] = static_cast<double>(r.limit[i]) * limit_share<T>(p) * metres;
  }
}

template <class T>
std::uint64_t signature(const Patch& p) noexcept;

template <class T>
constexpr SharedStep shared_step = {
    .prepare = &prepare_sliders<T>, .run = &run_sliders<T>, .finish = &finish_sliders<T>};

template <class T>
constexpr ContactModel sliders_model = {
    .name = sizeof(T) == sizeof(double) ? "sliders, double" : "sliders, single",
    .apply_load = &apply_slider_load<T>,
    .advance = &advance_sliders<T>,
    .shared = &shared_step<T>,
    .reset = &reset<T>,
    .take_over = &take_over_sliders<T>,
    .copy = &copy_record<Sliders<T>>,
    .stored_energy = &stored_energy<T>,
    .hash = &hash_sliders<T>,
    .describe = &describe<T>,
    .read_bristles = &read_bristles<T>,
    .signature = &signature<T>,
    .save = &save_sliders<T>,
    .find_fault = &find_slider_fault<T>,
    .restore = &restore_sliders<T>};

template <class T>
std::uint64_t signature(const Patch& p) noexcept {
  const Sliders<T>& r = sliders<T>(p);
  Hasher hasher;
  hasher.add(p.material().hash);
  hasher.add(r.full_weight);
  hasher.add(r.options.max_normal_load);
  hasher.add(std::uint64_t{r.bristles});
  hasher.add(static_cast<std::uint64_t>(p.axes) << 8 | static_cast<std::uint64_t>(p.outputs));
  return hasher.value();
}

template <class T>
Patch make_typed(std::shared_ptr<const CompiledMaterial> material, const PatchOptions& options,
                 const KernelSet<T>& kernels, double weight) {
  Sliders<T> made;
  made.material = material.get();
  made.options = options;
  made.bristles = options.bristles == 0 ? default_sliders : options.bristles;
  made.options.bristles = made.bristles;
  made.first_seed = options.seed;
  made.full_weight =
      weight > 0.0 ? weight : material->material.bristles_in_contact(options.max_normal_load) / made.bristles;
  made.block_count = (made.bristles + block_size - 1) / block_size;
  made.kernels = &kernels;
  const std::shared_ptr<const Strata> strata = material->strata(made.bristles);

  Sliders<T>* r = make_record(std::move(material), made);
  constexpr T least_limit = T(1e-15);
  const double mean = r->material->material.snap_length.mean() * r->material->lengths_per_metre;
  for (std::uint32_t i = 0; i < Sliders<T>::padded(r->bristles); ++i) {
    const std::uint32_t from = std::min(i, r->bristles - 1);
    r->limit[i] = static_cast<T>(strata->length[from] * mean);
    r->per_limit[i] = T(1) / std::max(r->limit[i], least_limit);
    r->weight[i] = i < r->bristles ? static_cast<T>(strata->share[i]) : T(0);
  }
  Patch p = shared_part(*r, sliders_model<T>);
  p.strata = true;
  straighten<T>(p);
  note_sliders<T>(p);
  return p;
}

}  // namespace

Patch make_sliders(std::shared_ptr<const CompiledMaterial> material, const PatchOptions& options,
                   const KernelTable& kernels, double weight) {
  if (options.population == Population::infinite)
    throw Error(
        "PatchOptions: population = infinite: the material has SnapRule::slide, whose bristles are strata of "
        "its law already: take Population::representatives (32 are within 0.05 % of infinitely many)");
  if (options.compared.literal)
    throw Error("PatchOptions: the literal rule is the paper's loop of snaps; SnapRule::slide has none");
#if BRISTLE_WITH_DOUBLE
  if (options.precision == Precision::double_)
    return make_typed<double>(std::move(material), options, kernels.f64, weight);
#endif
  return make_typed<float>(std::move(material), options, kernels.f32, weight);
}

}  // namespace bristle::detail
