// Measures what each feature of a scene (such as ageing or double precision) costs in time and gains in
// accuracy, by alternate runs with and without the feature.
#include <algorithm>

#include <bristle/deadline_monitor.hpp>
#include <bristle/error.hpp>

#include "tools/libraries/accuracy/accuracy.hpp"
#include "tools/libraries/reports/conditions.hpp"
#include "tools/libraries/reports/quantile.hpp"
#include "tools/libraries/scene/scene_stepper.hpp"
#include "tools/libraries/scene/snap_law.hpp"

namespace cli {
namespace {

using bristle::Outputs;
using bristle::Precision;
using bristle::SnapRule;

constexpr double fair_rise = 1.1;  // ratio of errors without and with a feature that counts as equal

struct Trial {
  Trial(const char* its_feature, bool is_used, const Scene& scene)
      : feature(its_feature), used(is_used), with(scene), without(scene) {}

  std::string feature;
  bool used = false;    ///< whether the scene, as given, uses the feature
  std::string needed;   ///< reason why the feature cannot be left out; empty if it can
  Scene with, without;  ///< scenes with and without the feature, with all copies of patches, for timing
  bool mean_with = false, mean_without = false;  ///< whether forces are compared as means over a step
  int threads_with = 1, threads_without = 1;
  bool wall = false;  ///< whether wall times are compared, because the feature (threads) saves no CPU time
  std::string note;
};

template <class Change>
Scene changed(const Scene& scene, Change change) {
  Scene copy = scene;
  for (ScenePatch& patch : copy.patches) change(patch);
  return copy;
}

template <class Test>
bool any_patch(const Scene& scene, Test test) {
  return std::any_of(scene.patches.begin(), scene.patches.end(), test);
}

bool is_infinite(const ScenePatch& patch) {
  return patch.options.population == bristle::Population::infinite;
}

Outputs without(Outputs set, Outputs left_out) {
  return static_cast<Outputs>(static_cast<unsigned>(set) & ~static_cast<unsigned>(left_out));
}

bool body_stays_on_x(const SceneBody& body) {
  return body.velocity[1] == 0.0 &&
         std::all_of(body.force.begin(), body.force.end(),
                     [](const ForceRow& f) { return f.force[1] == 0.0; }) &&
         std::all_of(body.force_sines.begin(), body.force_sines.end(),
                     [](const ForceSine& f) { return f.amplitude[1] == 0.0; });
}

Trial axis_trial(const Scene& scene) {
  Trial t("second axis", any_patch(scene, [](const ScenePatch& p) { return p.options.axes == 2; }), scene);
  bool turned = false, dropped = false;
  for (std::size_t i = 0; i < scene.patches.size(); ++i) {
    const ScenePatch& p = scene.patches[i];
    bool straight = p.options.axes == 1;
    if (p.motion) {
      double line[2];
      straight = straight || p.motion->stays_on_line(line);
      turned = turned || (p.options.axes == 2 && straight && p.motion->moves_along_y());
    }
    for (SceneBody& body : t.without.bodies) {
      if (!std::count(body.patches.begin(), body.patches.end(), i)) continue;
      straight = straight || body_stays_on_x(body);
      if (straight) body.axes = 1;
    }
    dropped = dropped || (p.options.axes == 2 && straight);
    if (straight) t.without.patches[i].options.axes = 1;
    t.with.patches[i].options.axes = 2;
    if (!straight) t.with.patches[i].options.axes = p.options.axes;
  }
  for (SceneBody& body : t.with.bodies) body.axes = t.with.patches[body.patches.front()].options.axes;
  if (t.used && !dropped) t.needed = "the motion bends";
  if (turned) t.note = "if the caller turns each patch's axis along its motion; a scene file cannot";
  return t;
}

// Returns the material with snap rule `rule`. If the scene gives friction coefficients, they are the same
// under the new rule.
SceneMaterial with_rule(const SceneMaterial& from, SnapRule rule) {
  SceneMaterial to = from;
  if (to.coefficients) {
    to.coefficients->rule = rule;
    if (rule != SnapRule::slide) to.coefficients->drop = 0.0;
    try {
      const bristle::DamperDecay decay = to.material.damper_decay;
      to.material = bristle::Material::from_coefficients(*to.coefficients).with_damper_decay(decay);
      return to;
    } catch (const bristle::Error&) {
      to.coefficients.reset();  // keeps the bristles if no material of the rule has these coefficients
    }
  }
  to.material.snap_rule = rule;
  if (rule != SnapRule::slide) to.material.drop = 0.0;
  return to;
}

Trial redraw_trial(const Scene& scene) {
  Trial t("redraw", false, scene);
  for (std::size_t m = 0; m < scene.materials.size(); ++m) {
    const bool redraw = scene.materials[m].material.snap_rule == SnapRule::redraw;
    t.used = t.used || redraw;
    if (redraw) t.without.materials[m] = with_rule(scene.materials[m], SnapRule::keep);
  }
  if (!t.used) {
    for (SceneMaterial& m : t.with.materials) {
      if (m.material.snap_length.cv() <= widest_redraw_cv) m = with_rule(m, SnapRule::redraw);
    }
  }
  t.note = any_patch(scene,
                     [&](const ScenePatch& p) {
                       return scene.materials[p.material].material.snap_rule == SnapRule::slide;
                     })
               ? "redraw is another model: a bristle snaps at its length"
               : "keep is another model: every bristle keeps its own length";
  if (any_patch(scene, [](const ScenePatch& p) { return is_infinite(p); }))
    t.needed = "the infinite brush takes no other rule";
  return t;
}

Trial mean_trial(const Scene& scene, bool own_mean) {
  Trial t("mean force",
          any_patch(scene, [](const ScenePatch& p) { return has(p.options.outputs, Outputs::mean); }), scene);
  if (t.used && !any_patch(scene, [](const ScenePatch& p) {
        return !p.is_carried() && has(p.options.outputs, Outputs::mean);
      })) {
    t.needed = "the body's equation of motion is solved with it";
  }
  t.with = changed(scene, [&](ScenePatch& p) {
    if (!t.used || p.is_carried()) p.options.outputs = p.options.outputs | Outputs::mean;
  });
  t.without = changed(scene, [](ScenePatch& p) {
    if (!p.is_carried()) p.options.outputs = without(p.options.outputs, Outputs::mean);
  });
  t.mean_with = t.used ? own_mean : true;
  t.note = "errors: of the mean with it, of the force at the end of a step without";
  return t;
}

Trial energy_trial(const Scene& scene) {
  Trial t("energy",
          any_patch(scene, [](const ScenePatch& p) { return has(p.options.outputs, Outputs::energy); }),
          scene);
  const bool used = t.used;
  t.with = changed(scene, [used](ScenePatch& p) {
    if (!used) p.options.outputs = p.options.outputs | Outputs::energy;
  });
  t.without =
      changed(scene, [](ScenePatch& p) { p.options.outputs = without(p.options.outputs, Outputs::energy); });
  return t;
}

Trial viscous_trial(const Scene& scene) {
  Trial t("viscous term", false, scene);
  for (const SceneMaterial& m : scene.materials) t.used = t.used || m.material.viscous_friction > 0.0;
  for (SceneMaterial& m : t.without.materials) m.material.viscous_friction = 0.0;
  // Adds a viscous term to time it; 1e-12 does not change forces, and its run time is that of any size.
  if (!t.used) {
    for (SceneMaterial& m : t.with.materials) m.material.viscous_friction = 1e-12;
  }
  return t;
}

Trial double_trial(const Scene& scene) {
  Trial t("double precision",
          any_patch(scene, [](const ScenePatch& p) { return p.options.precision == Precision::double_; }),
          scene);
  if (!any_patch(scene, [](const ScenePatch& p) { return !is_infinite(p); })) {
    t.used = true;
    t.needed = "the infinite brush has no other";
  }
  const bool used = t.used;
  t.with = changed(scene, [used](ScenePatch& p) {
    if (!used) p.options.precision = Precision::double_;
  });
  t.without = changed(scene, [](ScenePatch& p) { p.options.precision = Precision::single; });
  return t;
}

Trial threads_trial(const Scene& scene) {
  Trial t("threads", scene.threads != 1, scene);
  t.threads_with = scene.threads != 1 ? scene.threads : 0;
  t.wall = true;
  t.note = "time by the clock on the wall";
  return t;
}

double time_of(const Scene& scene, int threads, bool wall, std::uint64_t steps, const AccuracyStudy& study) {
  const RunTime time = run_setting(scene, threads, study.options.isa, false, steps).time;
  study.spend("features");
  return (wall ? time.wall_s : time.cpu_s) / static_cast<double>(time.steps);
}

double error_of(const AccuracyStudy& study, const Scene& scene, bool mean) {
  const Scene cut = study.is_cut ? cut_copies(scene, compared_copies) : scene;
  std::vector<std::vector<PatchError>> errors;
  for (std::uint32_t round = 0; round < 3; ++round) {
    Setting as_scene;
    as_scene.as_scene = true;
    SettingRun run = run_setting(apply(cut, as_scene, study.scene.dt, round), 1, study.options.isa, true);
    study.spend("features");
    errors.push_back(compare(run.record, study.fine.mean(), study.result.scene_parts, mean));
  }
  double most = 0.0;
  for (std::size_t p = 0; p < errors.front().size(); ++p)
    most = std::max(most, SettingResult::over_runs(errors, p).rms);
  return most;
}

std::string advice(const Trial& t, const FeatureResult& f, double floor) {
  const bool same_error = f.error_without <= std::max(fair_rise * f.error_with, f.error_with + floor);
  if (f.state == "needed") return "keep: " + t.needed;
  if (f.feature == "threads") {
    if (!t.used) return f.saves < -0.25 && f.saves_high < -0.1 ? "several would be faster" : "leave them out";
    return f.saves > -0.1 || f.saves_high > 0.0 ? "leave out: they gain less than 10 %"
                                                : "keep: one alone is slower";
  }
  if (!t.used) return same_error ? "stay without it" : "without it the error is larger";
  if (!same_error) return "keep: the error rises";
  if (f.feature == "energy" || f.feature == "mean force")
    return f.saves > 0.02 ? "leave out unless it is read" : "costs next to nothing";
  if (f.saves > 0.02) return "leave out";
  return f.saves < -0.02 ? "keep: without it the scene is slower" : "costs next to nothing";
}

FeatureResult run_trial(const Trial& t, const AccuracyStudy& study, double seconds) {
  FeatureResult f;
  f.feature = t.feature;
  f.state = !t.used ? "left out already" : t.needed.empty() ? "used" : "needed";
  if (t.needed.empty()) {
    // Alternates runs with and without a feature many times, so that other programs slow both alike.
    const double step_s = study.cost.fixed_s + study.cost.bristle_s * study.scene_bristles();
    const auto all = step_count(study.scene);
    const double turn_steps = 0.3 * seconds / (2.0 * 9.0 * step_s * study.full_over_cut);
    const auto steps = static_cast<std::uint64_t>(std::clamp(turn_steps, 10.0, static_cast<double>(all)));
    std::vector<double> ratios;
    const double until = bristle::DeadlineMonitor::wall_now() + 0.6 * seconds;
    for (int round = 0; round < 9; ++round) {
      if (round >= 3 && bristle::DeadlineMonitor::wall_now() > until) break;
      double with_s = 0.0, without_s = 0.0;
      for (int turn = 0; turn < 2; ++turn) {
        if ((turn + round) % 2 == 0) {
          with_s = time_of(t.with, t.threads_with, t.wall, steps, study);
        } else {
          without_s = time_of(t.without, t.threads_without, t.wall, steps, study);
        }
      }
      ratios.push_back(without_s / with_s);
    }
    f.measured = true;
    f.saves = 1.0 - quantile(ratios, 0.5);
    f.saves_low = 1.0 - quantile(ratios, 0.75);
    f.saves_high = 1.0 - quantile(ratios, 0.25);
    f.error_with = error_of(study, t.with, t.mean_with);
    // Reuses the error with threads as the error without: their number does not change the forces.
    f.error_without = t.feature == "threads" ? f.error_with : error_of(study, t.without, t.mean_without);
  }
  double floor = 0.0;
  for (const double value : study.result.floor) floor = std::max(floor, value);
  f.advice = advice(t, f, floor) + (t.note.empty() || f.state == "needed" ? "" : " (" + t.note + ")");
  return f;
}

}  // namespace

void try_features(AccuracyStudy& study, double seconds) {
  Scene scene = study.scene;
  if (!scene.duration) scene.duration = scene.trace_length();
  const bool mean = study.result.own_mean;
  std::vector<Trial> trials;
  trials.push_back(axis_trial(scene));
  trials.push_back(redraw_trial(scene));
  trials.push_back(mean_trial(scene, mean));
  trials.push_back(energy_trial(scene));
  trials.push_back(viscous_trial(scene));
  if (BRISTLE_WITH_DOUBLE) trials.push_back(double_trial(scene));
  trials.push_back(threads_trial(scene));
  for (Trial& t : trials) {
    if (t.feature != "mean force") t.mean_with = t.mean_without = mean;
    study.result.features.push_back(run_trial(t, study, seconds / static_cast<double>(trials.size())));
  }
}

}  // namespace cli
