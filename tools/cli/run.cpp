#include "tools/cli/run.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include <bristle/error.hpp>
#include <bristle/patch_batch.hpp>

#include "tools/cli/force_file.hpp"
#include "tools/cli/progress.hpp"
#include "tools/cli/text_file.hpp"
#include "tools/cli/user_error.hpp"
#include "tools/cli/waveform.hpp"

namespace cli {
namespace {

// A copy of a [[patch]]: one contact patch of the batch.
struct Copy {
  std::size_t patch = 0;  // index into Scene::patches
  std::string name;
  double delay = 0.0;                 // s
  double cosine = 1.0, sine = 0.0;    // of the turn of its directions
  Position last;                      // of the unturned motion
  double x = 0.0, y = 0.0;            // m, moved so far
  double slid_x = 0.0, slid_y = 0.0;  // m, since it last turned back or lost contact
};

class SceneRun {
 public:
  SceneRun(const Scene& scene, const RunOptions& options);
  RunResult run();

 private:
  void add_patches();
  void add_bodies();
  void prescribe(double t);
  void step(double t);
  void account(double t);
  void account_friction(Copy& copy, PatchResult& result, const bristle::Motion& motion,
                        const bristle::Response& response);
  void finish();

  const Scene& scene_;
  const RunOptions& options_;
  bristle::PatchBatch batch_;
  std::vector<Copy> copies_;
  std::vector<bristle::Motion> motions_;
  std::vector<bristle::Response> responses_;
  std::vector<BodyMotion> bodies_;
  std::optional<ForceFile> force_file_;
  RunResult result_;
};

bristle::PatchBatch make_batch(const Scene& scene, const RunOptions& options) {
  try {
    return bristle::PatchBatch(bristle::BatchOptions{}
                                   .with_threads(options.threads.value_or(scene.threads))
                                   .with_isa(options.isa.empty() ? nullptr : options.isa.c_str()));
  } catch (const bristle::Error& error) {
    throw UserError(error.what());
  }
}

std::uint64_t step_count(const Scene& scene, const RunOptions& options) {
  if (options.steps) return *options.steps;
  const double steps = scene.duration.value_or(scene.trace_length()) / scene.dt;
  if (!(steps < 1e12)) throw UserError(fmt::format("{}: {} steps are too many", scene.file, steps));
  return static_cast<std::uint64_t>(std::max(1.0, std::floor(steps + 0.5)));
}

SceneRun::SceneRun(const Scene& scene, const RunOptions& options)
    : scene_(scene), options_(options), batch_(make_batch(scene, options)) {
  result_.monitor = bristle::DeadlineMonitor(scene.deadline);
  result_.patches.resize(scene.patches.size());
  add_patches();
  add_bodies();
  if (!options.out.empty()) {
    const auto any = [&](bristle::Outputs output) {
      return std::any_of(scene.patches.begin(), scene.patches.end(),
                         [&](const ScenePatch& p) { return has(p.options.outputs, output); });
    };
    force_file_.emplace(options.out, any(bristle::Outputs::mean), any(bristle::Outputs::energy));
    result_.patches_written = std::min<std::size_t>(copies_.size(), scene.out_patches);
  }
  batch_.warm_up();
}

void SceneRun::add_patches() {
  for (std::size_t p = 0; p < scene_.patches.size(); ++p) {
    const ScenePatch& patch = scene_.patches[p];
    for (std::uint32_t i = 0; i < patch.count; ++i) {
      bristle::PatchOptions copy_options = patch.options;
      copy_options.seed += i;
      copy_options.key = copies_.size();
      bristle::Motion motion;
      try {
        motion.id = batch_.add(scene_.materials[patch.material].material, copy_options);
      } catch (const bristle::Error& error) {
        throw UserError(fmt::format("{}: {}", patch.where, error.what()));
      }
      Copy copy;
      copy.patch = p;
      copy.name = patch.count == 1 ? patch.name : fmt::format("{}.{}", patch.name, i);
      if (patch.motion) {
        copy.delay = i * patch.motion->delay_per_copy;
        if (patch.motion->turn_per_copy != 0.0) {
          copy.cosine = cosine_of_turns(i * patch.motion->turn_per_copy);
          copy.sine = sine_of_turns(i * patch.motion->turn_per_copy);
        }
        copy.last = patch.motion->at(0.0);
      }
      copies_.push_back(std::move(copy));
      motions_.push_back(motion);
    }
  }
  responses_.resize(motions_.size());
}

void SceneRun::add_bodies() {
  for (const SceneBody& body : scene_.bodies) {
    std::vector<std::size_t> places;
    for (std::size_t c = 0; c < copies_.size(); ++c) {
      const std::size_t p = copies_[c].patch;
      if (std::count(body.patches.begin(), body.patches.end(), p)) places.push_back(c);
    }
    bodies_.emplace_back(body, std::move(places));
  }
}

// Displacements and loads of all patches that no body carries, over the step from t on.
void SceneRun::prescribe(double t) {
  for (std::size_t c = 0; c < copies_.size(); ++c) {
    Copy& copy = copies_[c];
    const auto& motion = scene_.patches[copy.patch].motion;
    if (!motion) continue;
    const double own_t = std::max(t - copy.delay, 0.0);
    const double own_end = std::max(t + scene_.dt - copy.delay, 0.0);
    const Position next = motion->at(own_end);
    const double dx = next.x - copy.last.x, dy = next.y - copy.last.y;
    copy.last = next;
    motions_[c].displacement[0] = copy.cosine * dx - copy.sine * dy;
    motions_[c].displacement[1] = copy.sine * dx + copy.cosine * dy;
    motions_[c].normal_load = motion->load_over(own_t, own_end - own_t);
  }
}

void SceneRun::step(double t) {
  using bristle::DeadlineMonitor;
  const double cpu = DeadlineMonitor::cpu_now();
  const double wall = DeadlineMonitor::wall_now();
  for (BodyMotion& body : bodies_) body.solve(batch_, t, scene_.dt, motions_);
  batch_.step(scene_.dt, {motions_.data(), motions_.size()}, {responses_.data(), responses_.size()});
  const double wall_time = DeadlineMonitor::wall_now() - wall;
  result_.monitor.record(wall_time, DeadlineMonitor::cpu_now() - cpu);
  for (BodyMotion& body : bodies_) body.finish(scene_.dt, responses_);
}

// Coefficients from the elastic part: dampers and lubricant are no friction of the bristles. A step counts as
// sliding when the patch has come ten mean snap lengths since it last turned back or lost contact.
void SceneRun::account_friction(Copy& copy, PatchResult& result, const bristle::Motion& motion,
                                const bristle::Response& response) {
  const double dx = motion.displacement[0], dy = motion.displacement[1];
  if (!(motion.normal_load > 0.0)) {
    copy.slid_x = copy.slid_y = 0.0;
    return;
  }
  ++result.steps_in_contact;
  if (dx * copy.slid_x + dy * copy.slid_y < 0.0) copy.slid_x = copy.slid_y = 0.0;
  copy.slid_x += dx;
  copy.slid_y += dy;
  const ScenePatch& patch = scene_.patches[copy.patch];
  const double fx = response.elastic[0];
  const double fy = patch.options.axes == 2 ? response.elastic[1] : 0.0;
  const double force = std::sqrt(fx * fx + fy * fy);
  if (motion.normal_load >= 0.1 * patch.options.max_normal_load) {
    result.highest_coefficient = std::max(result.highest_coefficient, force / motion.normal_load);
  }
  const double slid = std::sqrt(copy.slid_x * copy.slid_x + copy.slid_y * copy.slid_y);
  if ((dx != 0.0 || dy != 0.0) &&
      slid > 10.0 * scene_.materials[patch.material].material.snap_length.mean()) {
    result.sliding_force +=
        force;  // not its part along this step: an encoder's steps point all over the place
    result.sliding_load += motion.normal_load;
    ++result.sliding_steps;
  }
}

void SceneRun::account(double t) {
  for (std::size_t c = 0; c < copies_.size(); ++c) {
    Copy& copy = copies_[c];
    PatchResult& result = result_.patches[copy.patch];
    const bristle::Motion& motion = motions_[c];
    const bristle::Response& response = responses_[c];
    const bristle::Outputs outputs = scene_.patches[copy.patch].options.outputs;
    copy.x += motion.displacement[0];
    copy.y += motion.displacement[1];
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
    account_friction(copy, result, motion, response);
    if (c < result_.patches_written) {
      force_file_->write(t, copy.name, outputs, response, motion.normal_load, batch_.info(motion.id).active,
                         copy.x, copy.y);
    }
  }
}

void SceneRun::finish() {
  for (std::size_t c = 0; c < copies_.size(); ++c) {
    PatchResult& result = result_.patches[copies_[c].patch];
    const bristle::PatchInfo info = batch_.info(motions_[c].id);
    if (result.info.bristles == 0) result.info = info;
    result.memory_bytes += info.memory_bytes;
    result.stored += batch_.stored_energy(motions_[c].id);
    result_.bristles += info.bristles;
    result_.memory_bytes += info.memory_bytes;
  }
  for (const BodyMotion& body : bodies_) {
    result_.bodies.push_back({{body.position()[0], body.position()[1]},
                              {body.velocity()[0], body.velocity()[1]},
                              body.highest_speed(),
                              body.statistics()});
  }
  result_.isa = batch_.isa();
  result_.threads = batch_.threads();
  result_.state_hash = batch_.state_hash();
  if (force_file_) force_file_->finish();
}

RunResult SceneRun::run() {
  result_.steps = step_count(scene_, options_);
  const double start = bristle::DeadlineMonitor::wall_now();
  {
    Progress progress("run");
    for (std::uint64_t k = 0; k < result_.steps; ++k) {
      const double t = static_cast<double>(k) * scene_.dt;
      prescribe(t);
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
