// Materials, patches and motions from a fuzzer's bytes, and checks of the results of a step.
#pragma once

#include <cmath>
#include <cstring>
#include <vector>

#include <bristle/bristle.hpp>

#include "check.hpp"
#include "core/runtime/visit_all.hpp"
#include "input.hpp"

namespace fuzz {

/// Returns a batch whose steps visit every bristle.
inline bristle::PatchBatch stepped_eagerly(const bristle::BatchOptions& options = {}, bool eager = true) {
  bristle::PatchBatch batch(options);
  if (eager) bristle::detail::visit_all(batch);
  return batch;
}

/// Returns a random snap-length law. Throws bristle::Error if its parameters are out of range.
inline bristle::SnapLength any_law(Input& input) {
  using bristle::SnapLength;
  constexpr double lengths[] = {1e-5, 1e-12, 1e-8, 1e-3, 1.0, 0.0};
  const double scale = lengths[input.choice(6)];
  const double a = std::fabs(input.number(scale)), b = std::fabs(input.number(scale));
  switch (input.choice(6)) {
    case 0:
      return SnapLength::single(a);
    case 1:
      return SnapLength::uniform(a, a + b);
    case 2:
      return SnapLength::normal(a, b);
    case 3:
      return SnapLength::lognormal(a, input.between(0.0, 3.0));
    case 4:
      return SnapLength::exponential(a);
    default: {
      std::vector<double> quantiles(2 + input.choice(6));
      double length = a;
      for (double& q : quantiles) q = length += std::fabs(input.number(scale));
      return SnapLength::table(quantiles);
    }
  }
}

/// Returns a random material, mostly of usual numbers, else of any numbers. Throws bristle::Error if it is
/// refused. Most laws take milliseconds to set up for SnapRule::redraw, so the law is mostly one of a few
/// that a batch remembers.
inline bristle::Material any_material(Input& input) {
  using bristle::SnapLength;
  bristle::Material m;
  const unsigned kind = input.choice(32);
  const SnapLength known[] = {SnapLength::exponential(1e-5), SnapLength::single(1e-5),
                              SnapLength::uniform(5e-6, 15e-6), SnapLength::lognormal(1e-5, 0.15),
                              SnapLength::lognormal(1e-5, 1.0)};
  m.snap_rule = kind >= 12 ? bristle::SnapRule::keep : bristle::SnapRule::redraw;
  m.snap_length = kind >= 20 || kind == 0 ? any_law(input) : known[kind % 5];
  if (m.snap_rule == bristle::SnapRule::redraw && kind != 0) return m;
  if (input.flag()) m.bristle_stiffness = input.number(80.0);
  if (input.flag()) m.bristle_damping = input.number(0.01);
  if (input.flag()) m.viscous_friction = input.number(0.3);
  if (input.flag()) m.stribeck_velocity = input.number(1e-3);
  if (input.flag()) m.normal_stiffness = input.number(1e3);
  if (input.flag()) m.asperity_height_deviation = input.number(1e-6);
  if (input.flag()) m.damper_decay = bristle::DamperDecay::gaussian;
  return m;
}

inline bristle::PatchOptions any_options(Input& input, unsigned most_bristles) {
  bristle::PatchOptions o;
  o.axes =
      input.choice(16) == 15 ? static_cast<int>(input.byte()) - 1 : 1 + static_cast<int>(input.choice(2));
  o.bristles = 1 + static_cast<std::uint32_t>(input.bits(2)) % most_bristles;
  o.outputs = static_cast<bristle::Outputs>(input.choice(4));
  o.precision = input.flag() ? bristle::Precision::double_ : bristle::Precision::single;
  o.seed = input.byte();
  o.max_normal_load = input.choice(8) == 7 ? input.number(1.0) : 1.0;
  return o;
}

/// Returns a random motion with lengths of a tenth of the snap length `scale` to 10,000 times it, loads of
/// the order of 1 N, and sometimes values that no caller should give.
inline bristle::Motion any_motion(Input& input, bristle::PatchId id, int axes, double scale) {
  bristle::Motion m;
  m.id = id;
  constexpr double reach[] = {0.1, 1.0, 10.0, 1e4};
  const double length = scale * reach[input.choice(4)];
  m.displacement[0] = input.number(length);
  if (axes == 2 || input.choice(16) == 15) m.displacement[1] = input.number(length);
  const double load = input.number(0.7);
  m.normal_load = input.choice(16) == 15 ? load : std::fabs(load);
  if (input.choice(4) == 3) {
    m.has_velocity = true;
    m.velocity[0] = input.number(1e-3);
    if (axes == 2) m.velocity[1] = input.number(1e-3);
  }
  return m;
}

inline void check_finite(const bristle::Response& r) {
  for (int axis = 0; axis < 2; ++axis) {
    check(std::isfinite(r.end[axis]) && std::isfinite(r.elastic[axis]) && std::isfinite(r.damper[axis]) &&
              std::isfinite(r.mean[axis]),
          "forces are finite");
  }
  check(std::isfinite(r.stiffness) && r.stiffness >= 0.0, "stiffness is finite and not negative");
  check(std::isfinite(r.damping) && r.damping >= 0.0, "damping is finite and not negative");
  check(std::isfinite(r.force_limit) && r.force_limit >= 0.0, "the force limit is finite and not negative");
  check(std::isfinite(r.dissipated) && r.dissipated >= 0.0, "dissipated is finite and not negative");
  check(std::isfinite(r.contact_loss) && std::isfinite(r.damper_work), "energies are finite");
}

/// Checks that two responses are equal, bit for bit.
inline void check_same(const bristle::Response& a, const bristle::Response& b, const char* what) {
  const auto same = [](double x, double y) { return std::memcmp(&x, &y, sizeof x) == 0; };
  bool all = a.id == b.id && a.status == b.status && a.snaps == b.snaps;
  for (int axis = 0; axis < 2; ++axis)
    all = all && same(a.end[axis], b.end[axis]) && same(a.elastic[axis], b.elastic[axis]) &&
          same(a.damper[axis], b.damper[axis]) && same(a.mean[axis], b.mean[axis]);
  all = all && same(a.stiffness, b.stiffness) && same(a.damping, b.damping) &&
        same(a.force_limit, b.force_limit) && same(a.dissipated, b.dissipated) &&
        same(a.contact_loss, b.contact_loss) && same(a.damper_work, b.damper_work);
  check(all, what);
}

inline std::vector<std::byte> saved_state(const bristle::PatchBatch& batch) {
  std::vector<std::byte> state(batch.state_size());
  check(batch.save_state(state) == state.size(), "save_state writes state_size() bytes");
  return state;
}

}  // namespace fuzz
