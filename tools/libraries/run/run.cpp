#include "tools/libraries/run/run.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <bristle/patch_batch.hpp>

#include "tools/libraries/files/force_file.hpp"
#include "tools/libraries/files/gnuplot.hpp"
#include "tools/libraries/files/one_line.hpp"
#include "tools/libraries/files/output_file.hpp"
#include "tools/libraries/files/text_file.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/reports/html_page.hpp"
#include "tools/libraries/reports/progress.hpp"
#include "tools/libraries/reports/text_layout.hpp"
#include "tools/libraries/run/paced_clock.hpp"
#include "tools/libraries/run/part_scene.hpp"
#include "tools/libraries/run/run_state.hpp"
#include "tools/libraries/scene/scene_memory.hpp"
#include "tools/libraries/scene/scene_stepper.hpp"
#include "tools/libraries/scene/scene_table.hpp"

namespace cli {
namespace {

class SceneRun {
 public:
  SceneRun(const Scene& scene, const RunOptions& options, const StepObserver& observer);
  RunResult run();

 private:
  double time_of(std::uint64_t k) const noexcept {  // time at the start of this run's step k, s
    return static_cast<double>(result_.steps_before + k) * scene_.dt;
  }
  void run_back_to_back();
  void run_paced(const RealtimeOptions& realtime);
  std::uint64_t run_paced_segment(std::uint64_t first, std::uint64_t ticks, PacedClock& clock,
                                  const QueueClock& queue, Progress& progress);
  void step(double t);
  void account(double t);
  void account_friction(std::size_t c, PatchResult& result, const bristle::Motion& motion,
                        const bristle::Response& response);
  void account_first_loading(std::size_t c, PatchResult& result, const bristle::Motion& motion);
  void account_body(std::size_t b, double t);
  void finish();
  std::uint64_t steps_to_do() const;

  const Scene& scene_;
  const RunOptions& options_;
  const StepObserver& observer_;
  SceneStepper stepper_;
  std::vector<CopyPath> copy_paths_;
  std::vector<FirstLoading> first_loadings_;  ///< first loading of each copy
  /// Position where a body last stuck, from which its sliding is measured. It follows a sliding body at a
  /// distance of ten times `length`, the longest mean snap length of its patches.
  struct Hold {
    double position[2], length;
    double breaks;  ///< distance beyond which the body has broken away, m
    Sticking sticking;
  };
  std::vector<Hold> holds_;
  OutputFile state_file_;
  std::vector<std::shared_ptr<ForceFile>> force_files_;
  RunResult result_;
};

SceneRun::SceneRun(const Scene& scene, const RunOptions& options, const StepObserver& observer)
    : scene_(scene),
      options_(options),
      observer_(observer),
      stepper_(scene, batch_options(scene, options), progress_line("set-up", options.quiet)),
      copy_paths_(stepper_.copies().size()),
      first_loadings_(options.restore_state.empty() ? copy_paths_.size() : 0),
      state_file_(options.save_state) {
  result_.monitor = bristle::DeadlineMonitor(scene.deadline);
  result_.patches.resize(scene.patches.size());
  if (!options.restore_state.empty())
    result_.steps_before = restore_run(options.restore_state, stepper_, scene.dt, copy_paths_);
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
    const double(&position)[2] = stepper_.bodies()[b].position();
    holds_.push_back({{position[0], position[1]}, 0.0, 0.0, {}});
    for (const std::size_t p : scene.bodies[b].patches) {
      const bristle::Material& m = scene.materials[scene.patches[p].material].material;
      const double mean = m.snap_length.mean();
      // Friction with a peak is highest within one mean snap length, friction without one after two.
      const bool peaks = m.peak_coefficient() > 1.01 * m.kinetic_coefficient();
      holds_[b].length = std::max(holds_[b].length, mean);
      holds_[b].breaks = std::max(holds_[b].breaks, peaks ? mean : 2.0 * mean);
    }
  }
  for (const std::string& file : {options.out, options.drawn}) {
    if (file.empty()) continue;
    const auto any = [&](bristle::Outputs output) {
      return std::any_of(scene.patches.begin(), scene.patches.end(),
                         [&](const ScenePatch& p) { return has(p.options.outputs, output); });
    };
    force_files_.push_back(
        std::make_shared<ForceFile>(file, any(bristle::Outputs::mean), any(bristle::Outputs::energy)));
    result_.patches_written = std::min<std::size_t>(copy_paths_.size(), scene.out_patches);
  }
}

void SceneRun::step(double t) {
  using bristle::DeadlineMonitor;
  const double cpu = DeadlineMonitor::cpu_now();
  const double wall = DeadlineMonitor::wall_now();
  stepper_.step(t);
  const double wall_time = DeadlineMonitor::wall_now() - wall;
  result_.monitor.record(wall_time, DeadlineMonitor::cpu_now() - cpu);
}

// Adds a step to the sums for friction coefficients. Uses the elastic force alone, since dampers and
// lubricant are not friction of the bristles. A step counts as sliding if the patch has moved ten mean snap
// lengths since it last reversed or lost contact.
void SceneRun::account_friction(std::size_t c, PatchResult& result, const bristle::Motion& motion,
                                const bristle::Response& response) {
  CopyPath& travelled = copy_paths_[c];
  const double dx = motion.displacement[0], dy = motion.displacement[1];
  if (!(motion.normal_load > 0.0)) {
    travelled.slid_x = travelled.slid_y = 0.0;
    return;
  }
  ++result.steps_in_contact;
  if (dx * travelled.slid_x + dy * travelled.slid_y < 0.0) travelled.slid_x = travelled.slid_y = 0.0;
  travelled.slid_x += dx;
  travelled.slid_y += dy;
  const ScenePatch& patch = scene_.patches[stepper_.copies()[c].patch];
  const double fx = response.elastic[0];
  const double fy = patch.options.axes == 2 ? response.elastic[1] : 0.0;
  const double force = std::sqrt(fx * fx + fy * fy);
  if (motion.normal_load >= 0.1 * patch.options.max_normal_load)
    result.highest_coefficient = std::max(result.highest_coefficient, force / motion.normal_load);
  const double slid = std::sqrt(travelled.slid_x * travelled.slid_x + travelled.slid_y * travelled.slid_y);
  if ((dx != 0.0 || dy != 0.0) &&
      slid > 10.0 * scene_.materials[patch.material].material.snap_length.mean()) {
    // Adds the magnitude of the force to the sum. Its component along the step would be noisy if an encoder
    // gave the motion.
    result.sliding_force += force;
    result.sliding_load += motion.normal_load;
    ++result.sliding_steps;
  }
}

void SceneRun::account(double t) {
  for (std::size_t c = 0; c < copy_paths_.size(); ++c) {
    const SceneCopy& copy = stepper_.copies()[c];
    CopyPath& travelled = copy_paths_[c];
    PatchResult& result = result_.patches[copy.patch];
    const bristle::Motion& motion = stepper_.motions()[c];
    const bristle::Response& response = stepper_.responses()[c];
    const bristle::Outputs outputs = scene_.patches[copy.patch].options.outputs;
    travelled.x += motion.displacement[0];
    travelled.y += motion.displacement[1];
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
    if (c < first_loadings_.size()) account_first_loading(c, result, motion);
    if (c < result_.patches_written) {
      for (const auto& file : force_files_)
        file->write(t, copy.name, outputs, response, motion.normal_load,
                    bristles_in_contact(stepper_.batch().info(motion.id)), travelled.x, travelled.y);
    }
  }
  for (std::size_t b = 0; b < holds_.size(); ++b) account_body(b, t);
  if (observer_) observer_(stepper_);
}

void SceneRun::account_first_loading(std::size_t c, PatchResult& result, const bristle::Motion& motion) {
  FirstLoading& first = first_loadings_[c];
  if (!(motion.normal_load > 0.0)) {
    first = {};
    return;
  }
  if (first.over) return;
  const double dx = motion.displacement[0], dy = motion.displacement[1];
  first.least_load =
      first.most_load > 0.0 ? std::min(first.least_load, motion.normal_load) : motion.normal_load;
  first.most_load = std::max(first.most_load, motion.normal_load);
  first.longest_step = std::max(first.longest_step, std::sqrt(dx * dx + dy * dy));
  first.turned = dx * first.x + dy * first.y < 0.0;
  if (!first.turned) {
    first.x += dx;
    first.y += dy;
  }
  const ScenePatch& patch = scene_.patches[stepper_.copies()[c].patch];
  first.over =
      first.turned || first.path() > 2.0 * scene_.materials[patch.material].material.snap_length.mean();
  if (first.path() >= result.first_loading.path()) result.first_loading = first;
}

void SceneRun::account_body(std::size_t b, double t) {
  Hold& hold = holds_[b];
  Sticking& result = hold.sticking;
  const double(&x)[2] = stepper_.bodies()[b].position();
  const double(&v)[2] = stepper_.bodies()[b].velocity();
  const double dx = x[0] - hold.position[0], dy = x[1] - hold.position[1];
  const double distance = std::sqrt(dx * dx + dy * dy), reach = 10.0 * hold.length;
  if (distance <= hold.breaks && !result.broke_away) {
    double applied[2];
    stepper_.bodies()[b].applied_force(t, applied);
    result.time = t;
    result.applied = std::sqrt(applied[0] * applied[0] + applied[1] * applied[1]);
  }
  const bool slides = distance > reach && v[0] * v[0] + v[1] * v[1] > hold.length * hold.length;
  result.broke_away |= slides;
  if (!slides) result.stuck += scene_.dt;
  if (distance <= reach) return;
  hold.position[0] = x[0] - dx * (reach / distance);
  hold.position[1] = x[1] - dy * (reach / distance);
}

void SceneRun::finish() {
  for (std::size_t c = 0; c < copy_paths_.size(); ++c) {
    PatchResult& result = result_.patches[stepper_.copies()[c].patch];
    const bristle::PatchInfo info = stepper_.batch().info(stepper_.motions()[c].id);
    if (result.info.representatives == 0) result.info = info;
    result.memory_bytes += info.memory_bytes;
    result.stored += stepper_.batch().stored_energy(stepper_.motions()[c].id);
    const ScenePatch& patch = scene_.patches[stepper_.copies()[c].patch];
    if (patch.options.population == bristle::Population::infinite)
      ++result_.infinite_patches;
    else
      result_.bristles += info.representatives;
    result_.memory_bytes += info.memory_bytes;
  }
  for (std::size_t b = 0; b < holds_.size(); ++b) {
    const BodyMotion& body = stepper_.bodies()[b];
    result_.bodies.push_back({{body.position()[0], body.position()[1]},
                              {body.velocity()[0], body.velocity()[1]},
                              body.highest_speed(),
                              body.statistics(),
                              holds_[b].sticking});
  }
  result_.isa = stepper_.batch().isa();
  result_.threads = stepper_.batch().threads();
  result_.state_hash = stepper_.batch().state_hash();
  if (!options_.drawn.empty()) {
    result_.drawn = force_files_.back();
    force_files_.pop_back();
    result_.drawn->flush();
  }
  for (const auto& file : force_files_) file->finish();
  if (!state_file_) return;
  try {
    state_file_.write(save_run(stepper_, result_.steps_before + result_.steps, scene_.dt, copy_paths_));
  } catch (const UserError& error) {
    result_.save_failure = error.what();
  }
}

std::uint64_t SceneRun::steps_to_do() const {
  if (options_.steps) return *options_.steps;
  const std::uint64_t all = step_count(scene_);
  if (result_.steps_before >= all)
    throw UserError(
        fmt::format("{}: was saved after {} steps, and the scene has {}; give --steps to continue",
                    options_.restore_state, result_.steps_before, all));
  return all - result_.steps_before;
}

void SceneRun::run_back_to_back() {
  Progress progress("run", options_.quiet);
  // Whether the state is larger than 100 MB. A step may then take a second, so progress is shown after every
  // step.
  const bool large = stepper_.batch().state_size() > 100'000'000;
  for (std::uint64_t k = 0; k < result_.steps; ++k) {
    const double t = time_of(k);
    if (large) progress.show(static_cast<double>(k) / static_cast<double>(result_.steps));
    stepper_.prescribe(t);
    step(t);
    account(t + scene_.dt);
    if (!large && k % 16 == 0) progress.update(static_cast<double>(k) / static_cast<double>(result_.steps));
  }
}

// Runs ticks of the loop that steps in real time. Prepares the motion of a tick before the sleep, so that
// timing starts when the tick is due.
std::uint64_t SceneRun::run_paced_segment(std::uint64_t first, std::uint64_t ticks, PacedClock& clock,
                                          const QueueClock& queue, Progress& progress) {
  using bristle::DeadlineMonitor;
  PacedLoopResult& loop = result_.realtime->ours;
  std::uint64_t k = first;
  loop.monitor.pause();
  loop.monitor.refresh_events();
  double queued_s = queue.now();
  clock.start();
  double end = clock.due_s(), end_cpu = DeadlineMonitor::cpu_now(), step_cpu = 0.0;
  for (; k < first + ticks; ++k) {
    // Detects a tick that is late because of this program's own bookkeeping, though the step before it was in
    // time. Neither the step nor the machine is blamed for it.
    const double busy_s = step_cpu + DeadlineMonitor::cpu_now() - end_cpu;
    const bool held_up = end <= clock.next_due_s() && busy_s > clock.period_s();
    std::uint64_t left_out = clock.wait();
    if (stop_requested()) break;
    if (held_up) {
      const auto by_tool = std::min(left_out, static_cast<std::uint64_t>(busy_s / clock.period_s()));
      result_.realtime->held_up += by_tool;
      left_out -= by_tool;  // counts only the skipped ticks that the machine is to blame for
      loop.monitor.pause();
    }
    if (left_out > 0) loop.monitor.record_skipped(left_out);
    const double t = time_of(k);
    const double cpu = DeadlineMonitor::cpu_now();
    const double start = DeadlineMonitor::wall_now();
    stepper_.step(t);
    end = DeadlineMonitor::wall_now();
    end_cpu = DeadlineMonitor::cpu_now();
    step_cpu = end_cpu - cpu;
    record_tick(loop, {clock.due_s(), start, end, step_cpu}, queue, queued_s);
    account(t + scene_.dt);
    stepper_.prescribe(time_of(k + 1));
    progress.update(static_cast<double>(k) / static_cast<double>(result_.steps));
  }
  return k;
}

void SceneRun::run_paced(const RealtimeOptions& realtime) {
  const RealtimeThread thread(realtime.thread, stepper_.batch().threads() > 1);
  const QueueClock queue;
  RealtimeResult& result =
      result_.realtime.emplace(start_realtime(realtime, scene_.dt, scene_.deadline, thread));
  Progress progress("run --realtime", options_.quiet);
  PacedClock clock(scene_.dt, realtime.busy_wait_s);
  // Alternates the stepping and the bare loop in turns of a second, so that both meet the same conditions. A
  // turn has at least two ticks, because it takes two to enclose a period.
  const std::uint64_t segment = std::clamp<std::uint64_t>(
      result_.steps / 4, 2, static_cast<std::uint64_t>(std::max(std::round(1.0 / scene_.dt), 2.0)));
  std::uint64_t done = 0;
  stepper_.prescribe(time_of(0));
  while (done < result_.steps && !stop_requested()) {
    const std::uint64_t ticks = std::min(segment, result_.steps - done);
    run_segment(result.ours, [&] { done = run_paced_segment(done, ticks, clock, queue, progress); });
    // Gives the bare loop at least two ticks if the stepping loop has two.
    const auto share =
        static_cast<std::uint64_t>(std::ceil(realtime.bare_share * static_cast<double>(ticks)));
    const std::uint64_t bare = std::max(share, std::min<std::uint64_t>(ticks, 2));
    run_segment(result.bare, [&] { run_bare_segment(result.bare, bare, clock, queue); });
  }
  result.stopped = stop_requested();
  result_.steps = done;
  result_.monitor = result.ours.monitor;
}

RunResult SceneRun::run() {
  result_.steps = steps_to_do();
  const double start = bristle::DeadlineMonitor::wall_now();
  if (options_.realtime) {
    run_paced(*options_.realtime);
  } else {
    run_back_to_back();
  }
  // Reports the wall time of the stepping loop alone. The turns of the bare loop are not part of it.
  result_.seconds =
      result_.realtime ? result_.realtime->ours.seconds : bristle::DeadlineMonitor::wall_now() - start;
  finish();
  return std::move(result_);
}

}  // namespace

double FirstLoading::path() const noexcept { return std::sqrt(x * x + y * y); }

double ForceStatistics::rms() const noexcept {
  return count ? std::sqrt(square_sum / static_cast<double>(count)) : 0.0;
}

RunResult run_scene(const Scene& scene, const RunOptions& options, const StepObserver& observer) {
  check_memory(scene);
  return SceneRun(scene, options, observer).run();
}

bristle::BatchOptions batch_options(const Scene& scene, const RunOptions& options) {
  return bristle::BatchOptions{}
      .with_threads(options.threads.value_or(scene.threads))
      .with_isa(options.isa.empty() ? nullptr : options.isa.c_str());
}

void set_rate(Scene& scene, double rate_hz) {
  scene.dt = 1.0 / rate_hz;
  scene.deadline = std::min(scene.deadline, scene.dt);
}

std::vector<std::string> left_out(const ScenePatch& patch, const bristle::Material& material) {
  std::vector<std::string> features;
  const bristle::PatchOptions& o = patch.options;
  const bool infinite = o.population == bristle::Population::infinite;
  if (o.axes == 1) features.emplace_back("second axis");
  if (material.snap_rule == bristle::SnapRule::keep) features.emplace_back("redraw");
  if (infinite) features.emplace_back("noise of single bristles");
  if (!has(o.outputs, bristle::Outputs::mean)) features.emplace_back("mean force");
  if (!has(o.outputs, bristle::Outputs::energy)) features.emplace_back("energy");
  if (o.precision == bristle::Precision::single && !infinite) features.emplace_back("double precision");
  if (material.bristle_damping == 0.0 || material.stribeck_velocity == 0.0) features.emplace_back("dampers");
  if (material.viscous_friction == 0.0) features.emplace_back("lubricant");
  return features;
}

namespace {

/// Draws the forces of a run into a picture. A panel shows the first five presliding lengths if a patch slid.
void draw_forces(const Scene& scene, const RunResult& result, const std::string& script,
                 const std::string& picture, bool vectors, const char* option) {
  double zoom = 0.0;  // um
  for (std::size_t p = 0; p < scene.patches.size(); ++p) {
    const bristle::Material& m = scene.materials[scene.patches[p].material].material;
    const double length = m.residual_length + m.snap_length.mean();
    if (result.patches[p].sliding_steps > 0 && result.patches[p].first_loading.longest_step < 0.5 * length)
      zoom = std::max(zoom, 5e6 * length);
  }
  draw_csv(script, result.drawn->written_path(), picture, vectors,
           fmt::format("title = {}\nzoom = {}\n", gnuplot_string(one_line(scene.name)), zoom), option);
}

}  // namespace

void run_command(const RunOptions& given) {
  RunOptions options = given;
  const std::string text = read_text_file(options.scene, most_scene_bytes);
  if (run_bed_scene(options, text) || run_joint_scene(options, text)) return;
  Scene scene = parse_scene(text, options.scene, options.limits, progress_line("reading", options.quiet));
  if (!options.trace.empty()) replace_motion(scene, options.trace, options.clip_load);
  if (options.bristles) set_bristles(scene, *options.bristles);
  const double scene_dt = scene.dt;
  if (options.realtime) {
    if (options.realtime->rate_hz) set_rate(scene, *options.realtime->rate_hz);
    if (!(scene.dt >= 1e-5 && scene.dt <= 1.0))
      throw UserError(fmt::format(
          "{}: --realtime takes 1 to 100,000 ticks per second, and dt is {} s; give another --rate",
          options.scene, scene.dt));
  }
  const std::string histogram_file = options.realtime ? options.realtime->histograms : std::string();
  if (options.save_state == "-") throw UserError("--save-state -: a state cannot go to stdout; name a file");
  // Allows --save-state to name the file of --restore-state, so that a run can be continued in one file.
  const bool goes_on = options.save_state == options.restore_state;
  std::vector<FileOption> inputs = inputs_of(scene);
  inputs.push_back({"--restore-state", goes_on ? std::string() : options.restore_state});
  check_picture_name("--plot", options.plot);
  const bool on_stdout = check_files(inputs, {{"--json", options.json},
                                              {"--csv", options.out},
                                              {"--plot", options.plot},
                                              {"--html", options.html},
                                              {"--histograms", histogram_file},
                                              {"--save-state", options.save_state}});
  const char* const drawn_by = !options.plot.empty() ? "--plot" : !options.html.empty() ? "--html" : nullptr;
  const std::string script = drawn_by ? find_plot_script("forces.gp", drawn_by) : std::string();
  if (drawn_by) options.drawn = temporary_csv(drawn_by);
  OutputFile json(options.json), histograms(histogram_file), picture(options.plot), html(options.html),
      page_picture(options.html.empty() ? std::string() : options.html + ".png");
  if (options.realtime) stop_on_signals();
  RunResult result = run_scene(scene, options);
  if (result.realtime) result.realtime->scene_dt = scene_dt;
  if (!on_stdout) print_report(run_table(scene, options, result));
  if (json) json.write(run_json(scene, options, result));
  if (histograms) histograms.write(histogram_csv(*result.realtime));
  if (picture) {
    draw_forces(scene, result, script, picture.written_path(), is_vector_picture(options.plot), "--plot");
    picture.finish();
  }
  if (html) {
    draw_forces(scene, result, script, page_picture.written_path(), false, "--html");
    html.write(html_page(scene.name, filled(run_table(scene, options, result)),
                         html_picture(page_picture.written_path())));
  }
  // Throws only after the reports are written. A failure to save the state then does not lose them.
  if (!result.save_failure.empty()) throw UserError(result.save_failure);
}

}  // namespace cli
