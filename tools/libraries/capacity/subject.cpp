#include "tools/libraries/capacity/subject.hpp"

#include <algorithm>

#include <bristle/deadline_monitor.hpp>
#include <bristle/error.hpp>

#include "tools/libraries/files/user_error.hpp"

namespace cli {
namespace {

/// Returns the sliding that settles patches before they are timed: 32 mean snap lengths in steps of 1.6,
/// after which deflections have their stationary distribution, then 10 steps of the motion. Infinite patches,
/// whose cohorts change for longer, take 10 mean snap lengths of the motion, in at most 100 steps.
bristle_bench::Settling settling_of(const CapacityCase& what) {
  const double step = what.step_in_lengths();
  const bool longer = what.is_infinite() && step > 0.0;
  return {1.6, 20, longer ? static_cast<int>(std::clamp(10.0 / step, 10.0, 100.0)) : 10};
}

bristle_bench::SteadyScene make_scene(const CapacityCase& what, const std::string& isa) {
  try {
    const auto options =
        bristle::BatchOptions{}.with_threads(what.threads).with_isa(isa.empty() ? nullptr : isa.c_str());
    return {options, capacity_dt_s, settling_of(what), what.eager};
  } catch (const bristle::Error& error) {
    throw UserError(error.what());
  }
}

}  // namespace

CapacitySubject::CapacitySubject(const CapacityCase& what, std::uint64_t bristles, const std::string& isa)
    : scene_(make_scene(what, isa)) {
  const std::uint64_t per_patch = what.is_infinite()    ? 1
                                  : what.patch_bristles ? what.patch_bristles
                                                        : bristles;
  const std::uint64_t patches = std::max<std::uint64_t>(1, bristles / per_patch);
  const auto material = what.default_material
                            ? bristle::Material::from_coefficients(bristle::Coefficients{})
                            : bristle::Material{}
                                  .with_snap_length(what.law.value_or(bristle::SnapLength::uniform(
                                      0.5 * mean_snap_length_m, 1.5 * mean_snap_length_m)))
                                  .with_snap_rule(what.rule);
  for (std::uint64_t i = 0; i < patches; ++i) {
    scene_.add(material,
               bristle::PatchOptions{}
                   .with_max_normal_load(1.0)
                   .with_bristles(static_cast<std::uint32_t>(per_patch))
                   .with_axes(what.axes)
                   .with_outputs(what.outputs)
                   .with_precision(what.precision)
                   .with_population(what.population)
                   .with_resolution(what.resolution)
                   .with_seed(static_cast<std::uint32_t>(i + 1)),
               {what.step_in_lengths(), what.regime == Regime::tremor,
                what.zigzag || what.regime == Regime::turning});
  }
  scene_.vary(what.turn, what.either_side, what.ripple);
  scene_.settle();
}

StepTimes time_steps(CapacitySubject& subject, std::uint64_t steps, std::uint64_t at_least,
                     double deadline_s) {
  bristle::DeadlineMonitor monitor(deadline_s);
  while (monitor.count() < steps && (monitor.count() < at_least || 100 * monitor.misses() <= steps)) {
    const double start = bristle::DeadlineMonitor::wall_now();
    subject.step();
    monitor.record(bristle::DeadlineMonitor::wall_now() - start);
  }
  return {subject.bristles(), monitor.count(), monitor.p50(), monitor.p99(), monitor.p999(), monitor.max()};
}

}  // namespace cli
