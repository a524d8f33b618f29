#include "tools/libraries/accuracy/accuracy.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <bristle/deadline_monitor.hpp>
#include <bristle/error.hpp>
#include <bristle/patch_batch.hpp>

#include "tools/libraries/files/output_file.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/reports/numbers.hpp"
#include "tools/libraries/reports/progress.hpp"
#include "tools/libraries/reports/text_layout.hpp"
#include "tools/libraries/scene/scene_stepper.hpp"

namespace cli {
namespace {

bool uses_mean(const Scene& scene) {
  return !scene.bodies.empty() ||
         std::all_of(scene.patches.begin(), scene.patches.end(),
                     [](const ScenePatch& p) { return has(p.options.outputs, bristle::Outputs::mean); });
}

// Refuses a study whose scene is too long: throws if ten runs of the whole scene, the least that a study
// needs, exceed its time (`seconds`).
void check_size(const AccuracyStudy& study, double seconds) {
  Setting as_scene;
  as_scene.as_scene = true;
  as_scene.parts = study.result.scene_parts;
  const double once = study.predict(as_scene);
  if (10.0 * once > seconds)
    throw UserError(
        fmt::format("{}: one run takes about {}, and a study needs ten at least; allow more with "
                    "--seconds {:.0f}, or shorten the scene's duration",
                    study.scene.file, time_text(once), std::ceil(12.0 * once)));
}

void check_record(const AccuracyStudy& study) {
  const double rows = static_cast<double>(step_count(study.cut)) * study.result.scene_parts *
                      static_cast<double>(study.cut.patch_count());
  // Bytes of memory for the recorded forces. A row (a step of one patch) has two forces and a position, of
  // two numbers each. Seven records exist at once: three references, two pairs, one run, one copy.
  const double bytes = rows * 6.0 * 8.0 * 7.0;
  if (bytes > 4e9)
    throw UserError(
        fmt::format("{}: {} steps of {} patches are too many to compare; shorten the scene's duration",
                    study.scene.file, step_count(study.cut), study.cut.patch_count()));
}

std::string isa_of(const AccuracyOptions& options) {
  try {
    return bristle::PatchBatch(
               bristle::BatchOptions{}.with_isa(options.isa.empty() ? nullptr : options.isa.c_str()))
        .isa();
  } catch (const bristle::Error& error) {
    throw UserError(error.what());
  }
}

}  // namespace

AccuracyResult study_accuracy(const Scene& scene, const AccuracyOptions& options) {
  const double start = bristle::DeadlineMonitor::wall_now();
  const AccuracyBudget seconds = budget(options);
  const double all = seconds.reference + seconds.ladder + seconds.confirm;
  Progress progress("accuracy");
  AccuracyStudy study(options, scene);
  study.spend = [&](const char* what) {
    const double spent = bristle::DeadlineMonitor::wall_now() - start;
    progress.update(
        std::min(spent / all, 0.99),
        fmt::format("{}, {} left", what, time_text(std::max(0.0, std::ceil(all - spent)))).c_str());
  };
  AccuracyResult& r = study.result;
  r.isa = isa_of(options);
  r.copies = scene.patch_count();
  r.copies_compared = study.cut.patch_count();
  study.is_cut = r.copies_compared < r.copies;
  study.full_over_cut = static_cast<double>(r.copies) / static_cast<double>(r.copies_compared);
  r.scene_parts = options.quick ? 2 : 10;
  r.reference_dt_s = scene.dt / r.scene_parts;
  r.own_mean = uses_mean(scene);
  check_record(study);

  make_reference(study, seconds.reference);
  check_size(study, all);
  run_ladder(study, seconds.ladder);
  find_slopes(study);
  mark_front(study);
  recommend(study, seconds.confirm);
  compare_populations(r);
  r.seconds = bristle::DeadlineMonitor::wall_now() - start;
  return std::move(study.result);
}

void accuracy_command(const AccuracyOptions& options) {
  const Scene scene = read_scene(options.scene);
  const bool on_stdout = check_files(inputs_of(scene), {{"--json", options.json}, {"--csv", options.csv}});
  OutputFile json(options.json), csv(options.csv);
  const AccuracyResult result = study_accuracy(scene, options);
  if (!on_stdout) print_report(accuracy_table(scene, options, result));
  if (json) json.write(accuracy_json(scene, options, result));
  if (csv) csv.write(accuracy_csv(scene, result));
  const Recommendation& best = result.recommendation;
  if (!best.found && options.error) {
    throw UserError(fmt::format(
        "--error {:.3g}%: no setting tried meets it with other seeds too; the least error in the search is "
        "{:.3g} %{}",
        100.0 * best.wanted, 100.0 * best.least_error,
        result.not_run.empty() ? "" : " (--seconds with more time tries more bristles)"));
  }
}

}  // namespace cli
