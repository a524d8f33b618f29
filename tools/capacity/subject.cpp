#include "tools/capacity/subject.hpp"

#include <algorithm>

#include <bristle/deadline_monitor.hpp>
#include <bristle/error.hpp>

#include "tools/files/user_error.hpp"

namespace cli {
namespace {

constexpr double sliding_before = 32.0;  // mean snap lengths: the law of the deflections is then steady

bristle::PatchBatch make_batch(const CapacityCase& what, const std::string& isa) {
  try {
    return bristle::PatchBatch(bristle::BatchOptions{}
                                   .with_threads(what.threads)
                                   .with_isa(isa.empty() ? nullptr : isa.c_str())
                                   .with_eager(what.eager)
                                   .with_servo_core(what.servo_core));
  } catch (const bristle::Error& error) {
    throw UserError(error.what());
  }
}

}  // namespace

CapacitySubject::CapacitySubject(const CapacityCase& what, std::uint64_t bristles, const std::string& isa)
    : batch_(make_batch(what, isa)) {
  const std::uint64_t per_patch = what.patch_bristles ? what.patch_bristles : bristles;
  const std::uint64_t patches = std::max<std::uint64_t>(1, bristles / per_patch);
  bristles_ = patches * per_patch;
  const auto material = bristle::Material{}
                            .with_snap_length(what.law.value_or(bristle::SnapLength::uniform(
                                0.5 * mean_snap_length_m, 1.5 * mean_snap_length_m)))
                            .with_snap_rule(what.rule);
  for (std::uint64_t i = 0; i < patches; ++i) {
    bristle::Motion motion;
    motion.normal_load = 1.0;
    motion.id = batch_.add(material, bristle::PatchOptions{}
                                         .with_max_normal_load(1.0)
                                         .with_bristles(static_cast<std::uint32_t>(per_patch))
                                         .with_axes(what.axes)
                                         .with_outputs(what.outputs)
                                         .with_precision(what.precision)
                                         .with_seed(static_cast<std::uint32_t>(i + 1)));
    motions_[0].push_back(motion);
  }
  motions_[1] = motions_[0];
  responses_.resize(motions_[0].size());
  batch_.warm_up();

  // 1.6 a step, so that every bristle starts from its stationary law.
  for (const int turn : {0, 1}) set_displacement(turn, what, 1.6 * mean_snap_length_m);
  for (int i = 0; i < static_cast<int>(sliding_before / 1.6); ++i) step();
  turn_ = 0;
  const double d = what.step.value_or(step_length(what.regime)) * mean_snap_length_m;
  set_displacement(0, what, d);
  set_displacement(1, what, what.regime == Regime::tremor ? -d : d);
  for (int i = 0; i < 10; ++i) step();
}

void CapacitySubject::set_displacement(int turn, const CapacityCase& what, double metres) {
  for (bristle::Motion& motion : motions_[turn]) {
    motion.displacement[0] = what.axes == 2 ? 0.8 * metres : metres;
    motion.displacement[1] = what.axes == 2 ? 0.6 * metres : 0.0;
  }
}

StepTimes time_steps(CapacitySubject& subject, std::uint64_t steps) {
  bristle::DeadlineMonitor monitor;
  for (std::uint64_t i = 0; i < steps; ++i) {
    const double start = bristle::DeadlineMonitor::wall_now();
    subject.step();
    monitor.record(bristle::DeadlineMonitor::wall_now() - start);
  }
  return {subject.bristles(), steps, monitor.p50(), monitor.p99(), monitor.p999(), monitor.max()};
}

}  // namespace cli
