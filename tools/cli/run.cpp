#include "tools/cli/run.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include <bristle/patch_batch.hpp>

#include "tools/cli/force_file.hpp"
#include "tools/cli/progress.hpp"
#include "tools/cli/scene_stepper.hpp"
#include "tools/cli/text_file.hpp"
#include "tools/cli/user_error.hpp"

namespace cli {
namespace {

// How far a copy has come.
struct Way {
  double x = 0.0, y = 0.0;            // m, moved so far
  double slid_x = 0.0, slid_y = 0.0;  // m, since it last turned back or lost contact
};

class SceneRun {
 public:
  SceneRun(const Scene& scene, const RunOptions& options);
  RunResult run();

 private:
  void step(double t);
  void account(double t);
  void account_friction(std::size_t c, PatchResult& result, const bristle::Motion& motion,
                        const bristle::Response& response);
  void finish();

  const Scene& scene_;
  const RunOptions& options_;
  SceneStepper stepper_;
  Overload overload_;
  std::vector<Way> ways_;
  std::optional<ForceFile> force_file_;
  RunResult result_;
};

bristle::BatchOptions batch_options(const Scene& scene, const RunOptions& options) {
  return bristle::BatchOptions{}
      .with_threads(options.threads.value_or(scene.threads))
      .with_isa(options.isa.empty() ? nullptr : options.isa.c_str());
}

SceneRun::SceneRun(const Scene& scene, const RunOptions& options)
    : scene_(scene),
      options_(options),
      stepper_(scene, batch_options(scene, options)),
      overload_(scene, options.overload, stepper_),
      ways_(stepper_.copies().size()) {
  result_.monitor = bristle::DeadlineMonitor(scene.deadline);
  result_.patches.resize(scene.patches.size());
  if (!options.out.empty()) {
    const auto any = [&](bristle::Outputs output) {
      return std::any_of(scene.patches.begin(), scene.patches.end(),
                         [&](const ScenePatch& p) { return has(p.options.outputs, output); });
    };
    force_file_.emplace(options.out, any(bristle::Outputs::mean), any(bristle::Outputs::energy));
    result_.patches_written = std::min<std::size_t>(ways_.size(), scene.out_patches);
  }
}

void SceneRun::step(double t) {
  using bristle::DeadlineMonitor;
  const double cpu = DeadlineMonitor::cpu_now();
  const double wall = DeadlineMonitor::wall_now();
  overload_.before_step();
  stepper_.step(t);
  if (overload_.is_on())
    overload_.after_step(stepper_.batch().threads() == 1 ? DeadlineMonitor::cpu_now() - cpu
                                                         : DeadlineMonitor::wall_now() - wall);
  const double wall_time = DeadlineMonitor::wall_now() - wall;
  result_.monitor.record(wall_time, DeadlineMonitor::cpu_now() - cpu);
}

// Coefficients from the elastic part: dampers and lubricant are no friction of the bristles. A step counts as
// sliding when the patch has come ten mean snap lengths since it last turned back or lost contact.
void SceneRun::account_friction(std::size_t c, PatchResult& result, const bristle::Motion& motion,
                                const bristle::Response& response) {
  Way& way = ways_[c];
  const double dx = motion.displacement[0], dy = motion.displacement[1];
  if (!(motion.normal_load > 0.0)) {
    way.slid_x = way.slid_y = 0.0;
    return;
  }
  ++result.steps_in_contact;
  if (dx * way.slid_x + dy * way.slid_y < 0.0) way.slid_x = way.slid_y = 0.0;
  way.slid_x += dx;
  way.slid_y += dy;
  const ScenePatch& patch = scene_.patches[stepper_.copies()[c].patch];
  const double fx = response.elastic[0];
  const double fy = patch.options.axes == 2 ? response.elastic[1] : 0.0;
  const double force = std::sqrt(fx * fx + fy * fy);
  if (motion.normal_load >= 0.1 * patch.options.max_normal_load) {
    result.highest_coefficient = std::max(result.highest_coefficient, force / motion.normal_load);
  }
  const double slid = std::sqrt(way.slid_x * way.slid_x + way.slid_y * way.slid_y);
  if ((dx != 0.0 || dy != 0.0) &&
      slid > 10.0 * scene_.materials[patch.material].material.snap_length.mean()) {
    result.sliding_force +=
        force;  // not its part along this step: an encoder's steps point all over the place
    result.sliding_load += motion.normal_load;
    ++result.sliding_steps;
  }
}

void SceneRun::account(double t) {
  for (std::size_t c = 0; c < ways_.size(); ++c) {
    const SceneCopy& copy = stepper_.copies()[c];
    Way& way = ways_[c];
    PatchResult& result = result_.patches[copy.patch];
    const bristle::Motion& motion = stepper_.motions()[c];
    const bristle::Response& response = stepper_.responses()[c];
    const bristle::Outputs outputs = scene_.patches[copy.patch].options.outputs;
    way.x += motion.displacement[0];
    way.y += motion.displacement[1];
    result.overload_steps += has(response.status, bristle::Status::overload);
    result.bad_steps += has(response.status, bristle::Status::bad_input);
    result.load.add(motion.normal_load);
    for (int axis = 0; axis < 2; ++axis) {
      result.force[axis].add(response.end[axis]);
      if (has(outputs, bristle::Outputs::mean)) {
        result.mean_force[axis].add(response.mean[axis]);
        result.work -= response.mean[axis] * motion.displacement[axis];
      }
    }
    if (has(outputs, bristle::Outputs::energy)) {
      result.snaps += response.snaps;
      result.dissipated += response.dissipated;
      result.contact_loss += response.contact_loss;
      result.damper_work += response.damper_work;
    }
    account_friction(c, result, motion, response);
    if (c < result_.patches_written) {
      force_file_->write(t, copy.name, outputs, response, motion.normal_load,
                         stepper_.batch().info(motion.id).active, way.x, way.y);
    }
  }
}

void SceneRun::finish() {
  for (std::size_t c = 0; c < ways_.size(); ++c) {
    PatchResult& result = result_.patches[stepper_.copies()[c].patch];
    const bristle::PatchInfo info = stepper_.batch().info(stepper_.motions()[c].id);
    if (result.info.bristles == 0) result.info = info;
    result.memory_bytes += info.memory_bytes;
    result.stored += stepper_.batch().stored_energy(stepper_.motions()[c].id);
    result_.bristles += info.bristles;
    result_.memory_bytes += info.memory_bytes;
  }
  for (const BodyMotion& body : stepper_.bodies()) {
    result_.bodies.push_back({{body.position()[0], body.position()[1]},
                              {body.velocity()[0], body.velocity()[1]},
                              body.highest_speed(),
                              body.statistics()});
  }
  if (overload_.is_on()) result_.overload = overload_.finish();
  result_.isa = stepper_.batch().isa();
  result_.threads = stepper_.batch().threads();
  result_.state_hash = stepper_.batch().state_hash();
  if (force_file_) force_file_->finish();
}

RunResult SceneRun::run() {
  result_.steps = options_.steps.value_or(step_count(scene_));
  const double start = bristle::DeadlineMonitor::wall_now();
  {
    Progress progress("run");
    for (std::uint64_t k = 0; k < result_.steps; ++k) {
      const double t = static_cast<double>(k) * scene_.dt;
      stepper_.prescribe(t);
      step(t);
      account(t + scene_.dt);
      if (k % 16 == 0) progress.update(static_cast<double>(k) / static_cast<double>(result_.steps));
    }
  }
  result_.seconds = bristle::DeadlineMonitor::wall_now() - start;
  finish();
  return std::move(result_);
}

}  // namespace

double ForceStatistics::rms() const noexcept {
  return count ? std::sqrt(square_sum / static_cast<double>(count)) : 0.0;
}

RunResult run_scene(const Scene& scene, const RunOptions& options) { return SceneRun(scene, options).run(); }

std::vector<std::string> left_out(const ScenePatch& patch, const bristle::Material& material) {
  std::vector<std::string> features;
  const bristle::PatchOptions& o = patch.options;
  if (o.axes == 1) features.emplace_back("second axis");
  if (material.snap_rule == bristle::SnapRule::keep) features.emplace_back("redraw");
  if (!has(o.outputs, bristle::Outputs::mean)) features.emplace_back("mean force");
  if (!has(o.outputs, bristle::Outputs::energy)) features.emplace_back("energy");
  if (o.precision == bristle::Precision::single) features.emplace_back("double precision");
  if (material.bristle_damping == 0.0 || material.stribeck_velocity == 0.0) features.emplace_back("dampers");
  if (material.viscous_friction == 0.0) features.emplace_back("lubricant");
  if (o.step_rule == bristle::StepRule::literal) features.emplace_back("exact events");
  return features;
}

void run_command(const RunOptions& options) {
  Scene scene = read_scene(options.scene);
  if (!options.trace.empty()) replace_motion(scene, options.trace);
  if (options.json == "-" && options.out == "-")
    throw UserError("--json - and --out -: only one can have stdout");
  // Opened before the run: a path that cannot be written must not cost the result.
  std::optional<FilePointer> json;
  if (!options.json.empty()) json.emplace(open_for_writing(options.json));
  const RunResult result = run_scene(scene, options);
  if (options.json != "-" && options.out != "-") {
    write_text(stdout, run_table(scene, options, result), "standard output");
  }
  if (json) write_text(json->get(), run_json(scene, options, result), options.json);
}

}  // namespace cli
