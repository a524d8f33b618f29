#include "tools/libraries/rivals/paper_loop.hpp"

#include <algorithm>
#include <cmath>

namespace rivals {
namespace {

/// Advances a SplitMix64 generator. Returns a number between 0 and 1 of 53 random bits, never 0 or 1.
double share_of(std::uint64_t& state) noexcept {
  std::uint64_t x = state += 0x9E3779B97F4A7C15u;
  x = (x ^ x >> 30) * 0xBF58476D1CE4E5B9u;
  x = (x ^ x >> 27) * 0x94D049BB133111EBu;
  return (static_cast<double>((x ^ x >> 31) >> 11) + 0.5) * 0x1p-53;
}

}  // namespace

PaperLoop::PaperLoop(const bristle::Material& material, std::uint32_t n, double max_load_n,
                     std::uint32_t seed)
    : material_(material),
      weight_(material.bristles_in_contact(max_load_n) / n),
      z_(n),
      delta_(n),
      random_(seed) {
  double share = share_of(random_);
  for (double& delta : delta_) {
    share += 0.6180339887498949;  // one over the golden ratio: any k successive shares are spread evenly
    share -= std::floor(share);
    delta = material_.snap_length.quantile(share);
  }
}

double PaperLoop::sample() noexcept { return material_.snap_length.quantile(share_of(random_)); }

Force PaperLoop::step(Pair displacement, double dt_s, double load_n) noexcept {
  const double touching =
      std::min(material_.bristles_in_contact(load_n) / weight_, static_cast<double>(z_.size()));
  Pair sum;
  for (std::size_t i = 0; i < z_.size(); ++i) {
    const double share = std::clamp(touching - static_cast<double>(i), 0.0, 1.0);
    Pair& z = z_[i];
    if (share == 0.0) {  // bristles out of contact are straight
      z = Pair{};
      continue;
    }
    z = z + displacement;
    if (dot(z, z) > delta_[i] * delta_[i]) {
      z = Pair{};
      ++snaps_;
      if (material_.snap_rule == bristle::SnapRule::redraw) delta_[i] = sample();
    }
    sum = sum + share * z;
  }
  if (touching == 0.0) return {};
  const Pair v = (1.0 / dt_s) * displacement;
  const double damping =
      material_.bristles_in_contact(load_n) * material_.damping_at(length(v)) + material_.viscous_friction;
  const Pair force = -(material_.bristle_stiffness * weight_ * sum + damping * v);
  return {force, force};
}

}  // namespace rivals
