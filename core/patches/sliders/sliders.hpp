// The contact model of bristles that slide at their limit instead of snapping: weighted strata (intervals) of
// the snap-length law (core/MODEL.md, section 30). kernels/slide.hpp moves the bristles.
#pragma once

#include <cstdint>
#include <memory>

#include "bristle/config.hpp"
#include "core/patches/columns.hpp"
#include "core/patches/contact_model.hpp"
#include "core/patches/instantiate.hpp"

namespace bristle::detail {

constexpr std::uint32_t default_sliders = 32;

template <class T>
struct Sliders : PatchRecord {
  std::uint32_t bristles = 0;  ///< n, number of strata into which the law is divided
  std::uint32_t block_count = 0;
  /// Number of bristles that the present stiffness belongs to: those in contact at the highest load since all
  /// bristles were last straight, less those whose stiffness sliding has removed since the load fell. At
  /// least the number in contact, Patch::zeta.
  double stiff_zeta = 0.0;
  const KernelSet<T>* kernels = nullptr;

  SlideBlock* blocks = nullptr;
  T* zx = nullptr;
  T* zy = nullptr;          ///< deflections along y; null if the patch has one axis
  double* since = nullptr;  ///< time of each bristle's last slide, s (SlideView::since)

  T* limit = nullptr;
  T* per_limit = nullptr;  ///< one over each stratum's limit
  T* weight = nullptr;

  template <class Self, class Visit>
  static void columns(Self& r, Visit&& visit) {
    const std::uint32_t rows = padded(r.bristles);
    visit(r.blocks, ColumnRule{"blocks", r.block_count, Filler::block, false});
    visit(r.zx, ColumnRule{"zx", rows, Filler::zero, true});
    visit(r.zy, ColumnRule{"zy", r.options.axes == 2 ? rows : 0, Filler::zero, true});
    visit(r.since, ColumnRule{"since", r.has_times() ? rows : 0, Filler::age, true});
    visit(r.limit, ColumnRule{"limit", rows, Filler::from_seed, false});
    visit(r.per_limit, ColumnRule{"per_limit", rows, Filler::from_seed, false});
    visit(r.weight, ColumnRule{"weight", rows, Filler::from_seed, false});
  }

  static std::uint32_t padded(std::uint32_t count) noexcept {
    return (count + lane_count - 1) / lane_count * lane_count;
  }
  bool has_times() const noexcept {
    return material->material.ageing_strength != 0.0 || material->material.drop != 0.0;
  }
  std::uint32_t rows() const noexcept { return padded(bristles); }
  std::uint32_t active_blocks() const noexcept { return (bristles + block_size - 1) / block_size; }
  double kinetic_share() const noexcept { return 1.0 - material->material.drop; }
};

template <class T>
Sliders<T>& sliders(const Patch& p) noexcept {
  return static_cast<Sliders<T>&>(*p.record);
}
/// Returns the factor by which a fallen load reduces the limits of all bristles; 1 if it has not fallen.
template <class T>
double limit_share(const Patch& p) noexcept {
  const double stiff = sliders<T>(p).stiff_zeta;
  return stiff > p.zeta ? p.zeta / stiff : 1.0;
}
/// Returns twice the elastic energy, J, of a bristle of weight 1 with a deflection of one scaled length.
template <class T>
double joules_per_square(const Sliders<T>& r) noexcept {
  const CompiledMaterial& m = *r.material;
  return m.material.bristle_stiffness * r.stiff_zeta * m.metres_per_length * m.metres_per_length;
}

/// Returns the present deflection of bristle i along an axis, scaled.
template <class T>
double deflection(const Patch& p, std::uint32_t i, int axis) noexcept {
  const Sliders<T>& r = sliders<T>(p);
  const T* z = axis == 0 ? r.zx : r.zy;
  if (z == nullptr) return 0.0;
  return static_cast<double>(z[i]) +
         to_lengths(difference(p.position[axis], r.blocks[i / block_size].position[axis]));
}
/// Returns the deflection along the lay (grain), scaled, that lies in the middle between a bristle's limits;
/// 0 unless the lay resists differently to and fro.
template <class T>
double centre_of(const Patch& p, std::uint32_t i) noexcept {
  const Sliders<T>& r = sliders<T>(p);
  return r.lay.lean * limit_share<T>(p) * static_cast<double>(r.limit[i]);
}
/// Calls `change(i, z)` for every bristle in use and the padding; the function may change the deflection z.
/// Then stores the deflections relative to the patch's present position.
template <class T, class Change>
void rewrite_all(Patch& p, Change&& change) noexcept;
/// Updates sums, unit of force and contact in the patch's shared part, after a change of columns, load or
/// material outside a step.
template <class T>
void note_sliders(Patch& p) noexcept;
template <class T>
double sum_of_squares(const Patch& p) noexcept;

template <class T>
double apply_slider_load(Patch& p, double normal_load_n) noexcept;
template <class T>
void advance_sliders(Patch& p, PatchStep& step, StepSums& sums) noexcept;
template <class T>
std::uint32_t prepare_sliders(Patch& p, PatchStep& step) noexcept;
template <class T>
void run_sliders(const Patch& p, const PatchStep& step, std::uint32_t first, std::uint32_t last,
                 Totals& totals) noexcept;
template <class T>
void finish_sliders(Patch& p, const PatchStep& step, const Totals& totals, StepSums& sums) noexcept;
template <class T>
void take_over_sliders(Patch& to, Patch& from) noexcept;

template <class T>
std::uint64_t hash_sliders(const Patch& p) noexcept;
template <class T>
void save_sliders(const Patch& p, ByteWriter& write) noexcept;
template <class T>
const char* find_slider_fault(const Patch& p, const Patch& contact, ByteReader read) noexcept;
template <class T>
void restore_sliders(Patch& p, std::uint32_t seed, ByteReader read) noexcept;

/// Makes every bristle of a patch straight, as bristles out of contact are.
template <class T>
void straighten(Patch& p) noexcept;

/// Makes a patch of bristles that slide at their limit. Throws bristle::Error.
Patch make_sliders(std::shared_ptr<const CompiledMaterial> material, const PatchOptions& options,
                   const KernelTable& kernels, double weight);

}  // namespace bristle::detail
