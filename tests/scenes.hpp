// Small helpers that make materials, patches and motions, shared by tests and benchmarks. They do not use
// Catch.
#pragma once

#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <bristle/bristle.hpp>

#include "core/runtime/visit_all.hpp"

#ifndef BRISTLE_WITH_DOUBLE
#define BRISTLE_WITH_DOUBLE 1
#endif

namespace bristle_test {

using bristle::BatchOptions;
using bristle::Material;
using bristle::Motion;
using bristle::Outputs;
using bristle::PatchBatch;
using bristle::PatchId;
using bristle::PatchOptions;
using bristle::Precision;
using bristle::Response;
using bristle::SnapLength;
using bristle::SnapRule;
using bristle::Status;

/// Mean snap length of most scenes, m.
constexpr double dbar = 10e-6;
constexpr double tick = 1e-3;  ///< duration of a step, s

/// Snap-length law of most test scenes: uniform.
inline const SnapLength uniform = SnapLength::uniform(0.5 * dbar, 1.5 * dbar);

/// Returns the precisions of this build.
inline std::vector<Precision> precisions() {
  if (BRISTLE_WITH_DOUBLE) return {Precision::single, Precision::double_};
  return {Precision::single};
}

/// Whether the batch steps by the scalar reference code, which visits every bristle and has no vectors.
inline bool is_scalar(const PatchBatch& batch) { return std::string(batch.isa()) == "scalar"; }

/// Returns a material with simple arithmetic: one bristle per newton of load, sigma0 = 1 N/m, no damper. The
/// elastic force is then minus the sum of the deflections in metres.
inline Material plain_material(const SnapLength& law, SnapRule rule) {
  return Material{}
      .with_bristle_stiffness(1.0)
      .with_bristle_damping(0.0)
      .with_viscous_friction(0.0)
      .with_normal_stiffness(1e6)
      .with_asperity_height_deviation(1e-6)
      .with_snap_length(law)
      .with_snap_rule(rule);
}

/// Returns a batch whose steps visit every bristle: the same bits as those of a batch that skips.
inline PatchBatch stepped_eagerly(const BatchOptions& options = {}, bool eager = true) {
  PatchBatch batch(options);
  if (eager) bristle::detail::visit_all(batch);
  return batch;
}

/// Returns options for plain_material: `bristles` representatives of weight 1, all in contact at a load of
/// `bristles` newton.
inline PatchOptions plain_options(std::uint32_t bristles, int axes = 2,
                                  Precision precision = Precision::single, Outputs outputs = Outputs::all) {
  return PatchOptions{}
      .with_max_normal_load(bristles)
      .with_bristles(bristles)
      .with_axes(axes)
      .with_precision(precision)
      .with_outputs(outputs);
}

/// A law of the reference tables: its name there, and the law itself with the mean `mean` (m).
struct NamedLaw {
  const char* name;
  SnapLength law;
};
inline std::vector<NamedLaw> reference_laws(double mean = dbar) {
  return {{"delta", SnapLength::single(mean)},
          {"uniform_0.5_1.5", SnapLength::uniform(0.5 * mean, 1.5 * mean)},
          {"lognormal_cv0.3", SnapLength::lognormal(mean, 0.3)},
          {"exponential", SnapLength::exponential(mean)}};
}

inline SnapLength reference_law(const std::string& name, double mean = dbar) {
  for (const NamedLaw& law : reference_laws(mean))
    if (name == law.name) return law.law;
  throw std::runtime_error("no such law: " + name);
}

/// Returns a material for which friction over load equals the mean deflection over the mean snap length.
inline Material reduced_material(const SnapLength& law, SnapRule rule, double kappa = 0.0,
                                 double residual_over_mean = 0.0) {
  return plain_material(law, rule)
      .with_normal_stiffness(1.0)
      .with_asperity_height_deviation(law.mean())
      .with_shared_renewal(kappa)
      .with_residual_length(residual_over_mean * law.mean());
}

/// Returns the reference tables' name for a snap rule.
inline const char* table_name(SnapRule rule) {
  return rule == SnapRule::slide ? "slide" : rule == SnapRule::keep ? "fixed" : "redraw";
}
inline const char* name_of(Precision precision) {
  return precision == Precision::single ? "single" : "double";
}

/// Steps the only patch of a batch, or the only outline, and returns its response.
template <class Patches, class AnyMotion>
auto step_one(Patches& patches, const AnyMotion& motion, double dt_s = tick) {
  decltype(patches.find_force(dt_s, motion)) response;
  patches.step(dt_s, {&motion, 1}, {&response, 1});
  return response;
}

/// A patch in a batch of its own.
class OnePatch {
 public:
  OnePatch(const Material& material, const PatchOptions& options, const BatchOptions& batch_options = {})
      : OnePatch(material, options, PatchBatch(batch_options)) {}
  OnePatch(const Material& material, const PatchOptions& options, PatchBatch its_batch)
      : batch(std::move(its_batch)), id(batch.add(material, options)) {
    batch.warm_up();
  }

  Response step(double dx_m, double dy_m, double load_n, double dt_s = tick) {
    const Motion motion{id, {dx_m, dy_m}, load_n};
    return step(motion, dt_s);
  }
  Response step(const Motion& motion, double dt_s = tick) {
    Response response;
    report = batch.step(dt_s, {&motion, 1}, {&response, 1});
    return response;
  }
  double energy() const { return batch.stored_energy(id); }
  std::uint64_t hash() const { return batch.state_hash(id); }

  PatchBatch batch;
  PatchId id;
  bristle::StepReport report;
};

/// Deflections and snap lengths of the first bristles of a patch, m.
struct Bristles {
  std::vector<double> zx, zy, delta;
};
inline Bristles read(const PatchBatch& batch, PatchId id, std::size_t count) {
  Bristles b{std::vector<double>(count), std::vector<double>(count), std::vector<double>(count)};
  const std::size_t got = batch.read_bristles(id, b.zx, b.zy, b.delta);
  b.zx.resize(got);
  b.zy.resize(got);
  b.delta.resize(got);
  return b;
}
inline Bristles read(const OnePatch& patch, std::size_t count) { return read(patch.batch, patch.id, count); }

/// Adds `count` patches that differ only in their seeds.
inline std::vector<PatchId> add_patches(PatchBatch& batch, int count, const Material& material,
                                        const PatchOptions& options) {
  std::vector<PatchId> ids;
  ids.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    ids.push_back(
        batch.add(material, PatchOptions(options).with_seed(options.seed + static_cast<std::uint32_t>(i))));
  }
  return ids;
}

/// Returns one motion for each patch, all equal.
inline std::vector<Motion> same_motion(const std::vector<PatchId>& ids, double dx_m, double dy_m,
                                       double load_n) {
  std::vector<Motion> motions(ids.size());
  for (std::size_t i = 0; i < ids.size(); ++i) {
    motions[i].id = ids[i];
    motions[i].displacement[0] = dx_m;
    motions[i].displacement[1] = dy_m;
    motions[i].normal_load = load_n;
  }
  return motions;
}

/// Returns the name of the first field in which two responses differ by a bit; "" if none does.
inline std::string first_difference(const Response& a, const Response& b) {
  const auto differ = [](double x, double y) { return std::memcmp(&x, &y, sizeof x) != 0; };
  if (a.id != b.id) return "id";
  if (a.status != b.status) return "status";
  for (int axis = 0; axis < 2; ++axis) {
    if (differ(a.end[axis], b.end[axis])) return "end";
    if (differ(a.elastic[axis], b.elastic[axis])) return "elastic";
    if (differ(a.damper[axis], b.damper[axis])) return "damper";
    if (differ(a.mean[axis], b.mean[axis])) return "mean";
  }
  if (differ(a.stiffness, b.stiffness)) return "stiffness";
  if (differ(a.damping, b.damping)) return "damping";
  if (differ(a.force_limit, b.force_limit)) return "force_limit";
  if (differ(a.dissipated, b.dissipated)) return "dissipated";
  if (differ(a.contact_loss, b.contact_loss)) return "contact_loss";
  if (differ(a.damper_work, b.damper_work)) return "damper_work";
  if (a.snaps != b.snaps) return "snaps";
  return "";
}

}  // namespace bristle_test
