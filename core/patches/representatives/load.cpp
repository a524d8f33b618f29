// Changes the load of a patch of representatives. Bristles come into contact or leave it; the last to come
// are the first to leave (core/MODEL.md, section 5).
#include <algorithm>
#include <cmath>

#include "core/common/assert.hpp"
#include "core/patches/representatives/representatives.hpp"

namespace bristle::detail {
namespace {

template <class T>
void scale_bristle(Representatives<T>& r, std::uint32_t i, double factor) noexcept {
  r.zx[i] = static_cast<T>(static_cast<double>(r.zx[i]) * factor);
  if (r.zy != nullptr) r.zy[i] = static_cast<T>(static_cast<double>(r.zy[i]) * factor);
}

/// Takes the bristles that came last out of contact when the load falls, and returns their energy, J. The
/// bristle that is then the last counts only in part.
template <class T>
double shed_contacts(Patch& p, const ContactCount& now, bool energy) noexcept {
  Representatives<T>& r = representatives<T>(p);
  const std::uint32_t old_blocks = r.active_blocks();
  const std::uint32_t old_full = r.full_blocks();
  const std::uint32_t old_contact = r.in_contact();
  const std::uint32_t edge = now.whole / block_size;  // number of the block in which the contact ends
  double squares = 0.0;
  if (energy)
    for (std::uint32_t b = edge; b < old_blocks; ++b) squares += block_squares<T>(p, b);
  for (std::uint32_t b = edge; b < old_full; ++b) book_block<T>(p, b, -1);

  // Rewrites the block at the patch's position before its bristles change, so that its displacement is 0.
  if (edge < old_blocks) rewrite_block<T>(p, edge);
  r.whole = now.whole;
  r.fraction = now.fraction;
  const bool edge_stays = r.in_contact() > edge * block_size;
  for (std::uint32_t b = edge_stays ? edge + 1 : edge; b < old_blocks; ++b) enter_block<T>(p, b);
  if (edge_stays) {
    forget_bristles(r, r.in_contact(), std::min(old_contact, (edge + 1) * block_size));
    rewrite_block<T>(p, edge);
    if (energy) squares -= block_squares<T>(p, edge);
  }
  return squares;
}

/// Adds straight bristles when the load rises. The bristle that counted only in part straightens as its
/// weight grows, so that the force does not jump.
template <class T>
double admit_contacts(Patch& p, const ContactCount& now, bool energy) noexcept {
  Representatives<T>& r = representatives<T>(p);
  const std::uint32_t old_blocks = r.active_blocks();
  const std::uint32_t old_full = r.full_blocks();
  const bool had_tail = r.has_tail();
  double squares = 0.0;
  if (had_tail) {
    rewrite_block<T>(p, old_full);
    if (energy) squares = block_squares<T>(p, old_full);
    if (r.fraction > 0.0) scale_bristle(r, r.whole, r.fraction / (now.whole > r.whole ? 1.0 : now.fraction));
  }
  r.whole = now.whole;
  r.fraction = now.fraction;
  if (had_tail) {
    rewrite_block<T>(p, old_full);
    if (energy) squares -= block_squares<T>(p, old_full);
  }
  for (std::uint32_t b = old_blocks; b < r.active_blocks(); ++b) enter_block<T>(p, b);
  for (std::uint32_t b = old_full; b < r.full_blocks(); ++b) book_block<T>(p, b, +1);
  return squares;
}

/// Scales deflections down when the load rises above the maximum, or further above it: each bristle then
/// bears more, but the force of a patch at rest must stay.
template <class T>
void scale_all(Patch& p, double factor) noexcept {
  Representatives<T>& r = representatives<T>(p);
  const std::uint32_t blocks = r.active_blocks();
  for (std::uint32_t b = 0; b < blocks; ++b) {
    const bool full = b < r.full_blocks();
    if (full) book_block<T>(p, b, -1);
    rewrite_block<T>(p, b);
    const std::uint32_t end = std::min((b + 1) * block_size, r.in_contact());
    for (std::uint32_t i = b * block_size; i < end; ++i) scale_bristle(r, i, factor);
    rewrite_block<T>(p, b);
    if (full) book_block<T>(p, b, +1);
  }
}

}  // namespace

ContactCount count_contacts(double zeta, double weight, std::uint32_t bristles) noexcept {
  double active = zeta / weight;
  const double all = bristles;
  double overload = 1.0;
  // Keeps rounding from making the maximum load itself an overload.
  if (active > all * (1.0 + 1e-14)) overload = active / all;
  active = std::min(active, all);
  const double whole = std::floor(active);
  double fraction = active - whole;
  if (fraction < 1e-30) fraction = 0.0;  // drops a fraction too small for a weight in float
  return {active, overload, fraction, static_cast<std::uint32_t>(whole)};
}

template <class T>
double apply_load(Patch& p, double normal_load_n) noexcept {
  Representatives<T>& r = representatives<T>(p);
  const bool energy = has(p.outputs, Outputs::energy);
  p.normal_load = normal_load_n;
  p.zeta = p.material().material.bristles_in_contact(normal_load_n);
  const ContactCount now = count_contacts(p.zeta, r.full_weight, r.bristles);

  if (now.active != r.active || now.overload != p.overload) forget_upper_bounds<T>(p);
  const double joules = joules_per_square<T>(p);
  const double active = r.active;
  const std::uint32_t whole = r.whole;
  double loss = 0.0;
  if (now.active < r.active)
    loss = joules * shed_contacts<T>(p, now, energy);
  else if (now.active > r.active)
    loss = joules * admit_contacts<T>(p, now, energy);
  r.active = now.active;
  if (r.shared != nullptr) {
    note_young(r, active, whole);
    if (now.overload != p.overload || now.active == 0.0) r.shared->end_slide();
  }
  if (now.overload != p.overload) {
    const double before = energy ? joules_per_square<T>(p) * all_squares<T>(p) : 0.0;
    if (now.overload > p.overload) scale_all<T>(p, p.overload / now.overload);
    p.overload = now.overload;
    if (energy) loss += before - joules_per_square<T>(p) * all_squares<T>(p);
  }
  note_count<T>(p);
  BRISTLE_ASSERT(r.in_contact() <= r.bristles);
  BRISTLE_ASSERT(r.fraction >= 0.0 && r.fraction < 1.0 && p.overload >= 1.0);
  return loss;
}

BRISTLE_INSTANTIATE(apply_load)

}  // namespace bristle::detail
