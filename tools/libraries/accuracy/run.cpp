#include "tools/libraries/accuracy/run.hpp"

#include <algorithm>

#include <bristle/deadline_monitor.hpp>

#include "tools/libraries/rivals/paper_loop.hpp"
#include "tools/libraries/scene/scene_stepper.hpp"

namespace cli {
namespace {

using bristle::DeadlineMonitor;

// Number of steps that are timed together in scenes of few patches. Reading the CPU clock after each step
// would cost as much as the step itself.
constexpr std::uint64_t steps_per_chunk = 64;
constexpr std::size_t few_copies = 64;

class RecordedRun {
 public:
  RecordedRun(const Scene& scene, int threads, const std::string& isa, bool keep, std::uint64_t steps,
              bool paper_loop)
      : scene_(scene),
        stepper_(scene,
                 bristle::BatchOptions{}.with_threads(threads).with_isa(isa.empty() ? nullptr : isa.c_str())),
        keep_(keep),
        steps_(std::min(step_count(scene), steps)) {
    copies_ = stepper_.copies().size();
    chunk_ = copies_ > few_copies ? 1 : steps_per_chunk;
    if (paper_loop) make_loops();
    plan_.resize(chunk_ * copies_);
    answers_.resize(chunk_ * copies_);
    if (keep_) prepare_record();
  }

  SettingRun run() {
    for (std::uint64_t first = 0; first < steps_; first += chunk_) {
      const std::uint64_t count = std::min(chunk_, steps_ - first);
      plan(first, count);
      step(first, count);
      if (keep_) record(first, count);
    }
    out_.time.steps = steps_;
    return std::move(out_);
  }

 private:
  void prepare_record() {
    ForceRecord& r = out_.record;
    r.steps = steps_;
    r.copies = copies_;
    bool all_mean = true;
    for (const SceneCopy& copy : stepper_.copies()) {
      r.patch_of.push_back(copy.patch);
      all_mean = all_mean && has(scene_.patches[copy.patch].options.outputs, bristle::Outputs::mean);
    }
    r.end.resize(2 * steps_ * copies_);
    if (all_mean) r.mean.resize(r.end.size());
    if (!scene_.bodies.empty()) r.position.resize(r.end.size());
    r.work_end.resize(copies_);
    if (all_mean) r.work_mean.resize(copies_);
    moved_.resize(2 * copies_);
  }

  double time_of(std::uint64_t step) const { return static_cast<double>(step) * scene_.dt; }

  void plan(std::uint64_t first, std::uint64_t count) {
    for (std::uint64_t i = 0; i < count; ++i) {
      stepper_.prescribe(time_of(first + i));
      if (chunk_ > 1) std::copy(stepper_.motions().begin(), stepper_.motions().end(), at(plan_, i));
    }
  }

  void step(std::uint64_t first, std::uint64_t count) {
    const double cpu = DeadlineMonitor::cpu_now(), wall = DeadlineMonitor::wall_now();
    for (std::uint64_t i = 0; i < count; ++i) {
      if (chunk_ > 1) std::copy_n(at(plan_, i), copies_, stepper_.motions().begin());
      if (loops_.empty())
        stepper_.step(time_of(first + i));
      else
        step_loops();
      if (chunk_ > 1) {
        std::copy(stepper_.responses().begin(), stepper_.responses().end(), at(answers_, i));
        if (!scene_.bodies.empty()) std::copy_n(stepper_.motions().begin(), copies_, at(plan_, i));
      }
    }
    out_.time.cpu_s += DeadlineMonitor::cpu_now() - cpu;
    out_.time.wall_s += DeadlineMonitor::wall_now() - wall;
  }

  void record(std::uint64_t first, std::uint64_t count) {
    for (std::uint64_t i = 0; i < count; ++i) {
      for (std::size_t c = 0; c < copies_; ++c) {
        const bool kept = chunk_ > 1;
        record_one(first + i, c,
                   kept ? *(at(plan_, i) + static_cast<std::ptrdiff_t>(c)) : stepper_.motions()[c],
                   kept ? *(at(answers_, i) + static_cast<std::ptrdiff_t>(c)) : stepper_.responses()[c]);
      }
    }
  }

  // Records the forces on one copy of a patch, rotated from the patch's axes to those of the scene.
  void record_one(std::uint64_t step, std::size_t c, const bristle::Motion& motion,
                  const bristle::Response& response) {
    ForceRecord& r = out_.record;
    const SceneCopy& copy = stepper_.copies()[c];
    const bool planar = scene_.patches[copy.patch].options.axes == 1;
    const std::size_t at = r.at(step, c);
    const auto store = [&](std::vector<double>& to, const double(&own)[2]) {
      const double y = planar ? 0.0 : own[1];
      to[at] = copy.axis[0] * own[0] - copy.axis[1] * y;
      to[at + 1] = copy.axis[1] * own[0] + copy.axis[0] * y;
    };
    const auto work = [&](const double(&force)[2]) {
      return -force[0] * motion.displacement[0] - (planar ? 0.0 : force[1] * motion.displacement[1]);
    };
    store(r.end, response.end);
    r.work_end[c] += work(response.end);
    if (!r.mean.empty()) {
      store(r.mean, response.mean);
      r.work_mean[c] += work(response.mean);
    }
    if (!r.position.empty()) {
      moved_[2 * c] += motion.displacement[0];
      moved_[2 * c + 1] += motion.displacement[1];
      const double moved[2] = {moved_[2 * c], moved_[2 * c + 1]};
      store(r.position, moved);
    }
  }

  void make_loops() {
    for (const SceneCopy& copy : stepper_.copies()) {
      const bristle::PatchOptions& o = scene_.patches[copy.patch].options;
      loops_.emplace_back(scene_.materials[scene_.patches[copy.patch].material].material, o.bristles,
                          o.max_normal_load, o.seed + static_cast<std::uint32_t>(loops_.size()));
    }
  }

  /// Steps the paper's loops, which stand in for the library's patches in this run.
  void step_loops() {
    for (std::size_t c = 0; c < copies_; ++c) {
      const bristle::Motion& motion = stepper_.motions()[c];
      const rivals::Force force =
          loops_[c].step({motion.displacement[0], motion.displacement[1]}, scene_.dt, motion.normal_load);
      bristle::Response& response = stepper_.responses()[c];
      const double own[2] = {force.end.x, force.end.y};
      std::copy_n(own, 2, response.end);
      std::copy_n(own, 2, response.mean);
    }
  }

  template <class T>
  typename std::vector<T>::iterator at(std::vector<T>& rows, std::uint64_t i) const {
    return rows.begin() + static_cast<std::ptrdiff_t>(i * copies_);
  }

  const Scene& scene_;
  SceneStepper stepper_;
  /// The paper's loops, one for each copy of a patch. Empty in a run of the library's own patches.
  std::vector<rivals::PaperLoop> loops_;
  bool keep_;
  std::uint64_t steps_;
  std::uint64_t chunk_ = 1;
  std::size_t copies_ = 0;
  std::vector<bristle::Motion> plan_;
  std::vector<bristle::Response> answers_;
  std::vector<double> moved_;
  SettingRun out_;
};

}  // namespace

Scene apply(const Scene& scene, const Setting& setting, double dt_s, std::uint32_t round) {
  using bristle::Outputs;
  Scene changed = scene;
  if (!changed.duration) changed.duration = changed.trace_length();
  changed.dt = dt_s;
  for (ScenePatch& p : changed.patches) {
    bristle::PatchOptions& o = p.options;
    // Offsets the seeds of each round by a large stride (modulo 2^32). Copies of a patch have successive
    // seeds, so a small stride would use the same seeds again.
    o.seed += round * 0x9E3779B9u;
    if (setting.as_scene) continue;
    const bool energy = has(o.outputs, Outputs::energy);
    o.bristles = setting.bristles;
    o.precision = setting.precision;
    o.population =
        setting.is_infinite() ? bristle::Population::infinite : bristle::Population::representatives;
    o.resolution = setting.resolution;
    o.outputs = setting.mean || p.is_carried() ? Outputs::mean : Outputs::end;
    if (energy) o.outputs = o.outputs | Outputs::energy;
  }
  return changed;
}

Scene cut_copies(const Scene& scene, std::uint32_t most) {
  Scene cut = scene;
  for (ScenePatch& patch : cut.patches) {
    if (!patch.motion || patch.count <= most) continue;
    patch.stride = patch.count / most;
    patch.count = most;
  }
  return cut;
}

SettingRun run_setting(const Scene& scene, int threads, const std::string& isa, bool keep,
                       std::uint64_t steps, bool paper_loop) {
  return RecordedRun(scene, threads, isa, keep, steps, paper_loop).run();
}

}  // namespace cli
