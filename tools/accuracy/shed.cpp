// What leaving bristles out under overload costs in error and saves in time: the scene with its patches going
// to a share of their bristles and back again and again.
#include <algorithm>
#include <cmath>
#include <vector>

#include <bristle/deadline_monitor.hpp>

#include "tools/accuracy/accuracy.hpp"
#include "tools/reports/quantile.hpp"
#include "tools/scene/scene_stepper.hpp"

namespace cli {
namespace {

constexpr std::uint32_t turns = 16;  // of a run, by and by with few bristles and with all

SettingRun run_shed(const AccuracyStudy& study, const Scene& scene, std::uint32_t divisor, bool keep,
                    std::uint64_t steps) {
  DetailSwitch detail;
  detail.divisor = divisor;
  detail.every = std::max<std::uint64_t>(1, std::min(step_count(scene), steps) / turns);
  SettingRun run = run_setting(scene, 1, study.options.isa, keep, steps, detail);
  study.spend("overload");
  return run;
}

}  // namespace

void try_shedding(AccuracyStudy& study, double seconds) {
  Setting as_scene;
  as_scene.as_scene = true;
  const Scene& scene = study.is_cut ? study.cut : study.scene;
  const double step_s = study.cost.fixed_s + study.cost.bristle_s * study.scene_bristles();
  const auto steps = static_cast<std::uint64_t>(std::max(160.0, 0.3 * seconds / (4.0 * 5.0 * step_s)));
  for (std::uint32_t divisor : {1u, 2u, 4u, 8u}) {
    ShedResult result;
    result.share = 1.0 / divisor;
    std::vector<std::vector<PatchError>> errors;
    for (std::uint32_t round = 0; round < 3; ++round) {
      const SettingRun run =
          run_shed(study, apply(scene, as_scene, study.scene.dt, round), divisor, true, ~std::uint64_t{0});
      errors.push_back(
          compare(run.record, study.fine.mean(), study.result.scene_parts, study.result.own_mean));
    }
    for (std::size_t p = 0; p < errors.front().size(); ++p) {
      const PatchError e = SettingResult::over_runs(errors, p);
      if (e.rms < result.error.rms) continue;
      result.error = e;
    }
    study.result.shedding.push_back(result);
  }
  // Times in turns: what else the machine does then strikes all alike.
  std::vector<std::vector<double>> times(study.result.shedding.size());
  for (int round = 0; round < 5; ++round) {
    for (std::size_t k = 0; k < times.size(); ++k) {
      const auto divisor = static_cast<std::uint32_t>(std::lround(1.0 / study.result.shedding[k].share));
      const RunTime time =
          run_shed(study, apply(scene, as_scene, study.scene.dt, 0), divisor, false, steps).time;
      times[k].push_back(time.cpu_s / static_cast<double>(time.steps) * study.full_over_cut);
    }
  }
  for (std::size_t k = 0; k < times.size(); ++k) study.result.shedding[k].step_s = quantile(times[k], 0.5);
}

}  // namespace cli
