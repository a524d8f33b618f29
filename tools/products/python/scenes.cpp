// Binds Scene and run_scene(), the Python form of the command `bristle run`, without its pacing.
#include <algorithm>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "tools/libraries/run/run.hpp"
#include "tools/libraries/scene/scene_stepper.hpp"
#include "tools/products/python/tools.hpp"

namespace bristle_python {
template <>
inline constexpr bool is_module_class<cli::Scene> = true;

namespace {

using Path = std::filesystem::path;

struct SceneRun {
  cli::Scene scene;
  cli::RunOptions options;
  cli::RunResult result;
  py::array_t<double> t;  ///< time at the end of each step, s
  py::dict motions, responses;
};

}  // namespace

template <>
inline constexpr bool is_module_class<SceneRun> = true;

namespace {

/// Motions and responses of a patch as arrays with a row per step, and pointers to the row to write next.
struct Recorded {
  py::object motions, responses;
  bristle::Motion* motion_rows;
  bristle::Response* response_rows;
};

template <class T>
T* rows_of(const py::object& array) {
  return static_cast<T*>(py::reinterpret_borrow<py::array>(array).mutable_data());
}

std::vector<Recorded> make_arrays(std::size_t patches, std::uint64_t steps) {
  std::vector<Recorded> arrays;
  for (std::size_t p = 0; p < patches; ++p) {
    const auto size = static_cast<py::ssize_t>(steps);
    const py::object motions = new_motions(size), responses = new_responses(size);
    arrays.push_back(
        {motions, responses, rows_of<bristle::Motion>(motions), rows_of<bristle::Response>(responses)});
  }
  return arrays;
}

/// Runs a scene without the interpreter's lock, so that other Python threads run. Step number `step` writes
/// the row `step` of `arrays`.
cli::RunResult run_recorded(const SceneRun& run, std::vector<Recorded>& arrays,
                            std::vector<std::string>& names) {
  std::size_t step = 0;
  WithoutLock unlocked;
  InterruptCheck interrupted(unlocked);
  return cli::run_scene(run.scene, run.options, [&](const cli::SceneStepper& stepper) {
    if (step == 0) {
      for (std::size_t p = 0; p < arrays.size(); ++p) names.push_back(stepper.copies()[p].name);
    }
    for (std::size_t p = 0; p < arrays.size(); ++p) {
      arrays[p].motion_rows[step] = stepper.motions()[p];
      arrays[p].response_rows[step] = stepper.responses()[p];
      forget_what_was_not_asked_for(arrays[p].response_rows[step],
                                    run.scene.patches[stepper.copies()[p].patch].options.outputs);
    }
    ++step;
    interrupted();
  });
}

SceneRun run(cli::Scene scene, const std::optional<std::uint64_t>& steps, const std::optional<int>& threads,
             const std::optional<std::string>& isa, const std::optional<std::uint32_t>& bristles,
             const std::optional<Path>& trace, double clip_load,
             const std::optional<std::size_t>& out_patches) {
  if (steps && *steps == 0)
    throw bristle::Error("steps is 0; allowed: 1 or more, or None for the scene's duration");
  if (bristles && !(*bristles >= 1 && *bristles <= bristle::max_bristles_per_patch))
    throw bristle::Error("bristles is " + std::to_string(*bristles) + "; allowed: 1 to " +
                         std::to_string(bristle::max_bristles_per_patch));
  if (!(clip_load >= 0.0 && clip_load <= 1e9))
    throw bristle::Error("clip_load is " + std::to_string(clip_load) + " N; allowed: 0 to 1e9");
  if (trace) cli::replace_motion(scene, trace->string(), clip_load);
  if (bristles) cli::set_bristles(scene, *bristles);
  SceneRun run;
  run.scene = std::move(scene);
  run.options.scene = run.scene.file;
  run.options.threads = threads;
  run.options.isa = isa.value_or("");
  run.options.steps = steps ? *steps : cli::step_count(run.scene);
  run.options.quiet = true;
  const std::size_t recorded =
      std::min<std::size_t>(run.scene.patch_count(), out_patches.value_or(run.scene.out_patches));
  std::vector<Recorded> arrays = make_arrays(recorded, *run.options.steps);
  std::vector<std::string> names;
  run.result = run_recorded(run, arrays, names);
  for (std::size_t p = 0; p < names.size(); ++p) {
    run.motions[py::str(names[p])] = arrays[p].motions;
    run.responses[py::str(names[p])] = arrays[p].responses;
  }
  run.t = py::array_t<double>(static_cast<py::ssize_t>(run.result.steps));
  for (std::uint64_t k = 0; k < run.result.steps; ++k)
    run.t.mutable_data()[k] = static_cast<double>(k) * run.scene.dt + run.scene.dt;
  return run;
}

py::dict forces_of(const SceneRun& run) {
  py::dict forces;
  for (const auto& [name, responses] : run.responses) forces[name] = responses[py::str("end")];
  return forces;
}

template <class Named>
std::vector<std::string> names_of(const std::vector<Named>& all) {
  std::vector<std::string> names;
  for (const Named& one : all) names.push_back(one.name);
  return names;
}

constexpr const char* run_doc =
    "Runs the scene from its beginning, as fast as it can, and returns a SceneRun. steps: instead of the "
    "scene's duration. threads, bristles (of each patch): instead of the scene's. isa: None = the best here. "
    "trace: a motion file, CSV t,x,y,load, in place of the scene's motion; its loads from -clip_load (N) to "
    "0 count as 0. out_patches: so many patches are recorded, about 220 bytes a step each; None = as many as "
    "the scene says. Lets go of the interpreter's lock; Ctrl-C ends it. Raises bristle.Error.";

/// Binds run(), which takes its scene or the scene's file as `first` of its arguments.
template <class Owner, class Run, class... First>
void define_run(Owner& owner, const char* name, const Run& run, const First&... first) {
  owner.def(name, run, first..., py::kw_only(), optional("steps"), optional("threads"), optional("isa"),
            optional("bristles"), optional("trace"), py::arg("clip_load") = 0.0, optional("out_patches"),
            run_doc);
}
/// Returns a function for Python that reads the scene from a file and calls run() with it.
template <class... Options>
auto from_file(SceneRun (*run)(cli::Scene, Options...)) {
  return
      [run](const Path& path, Options... options) { return run(cli::read_scene(path.string()), options...); };
}

void define_scene(py::module_& module) {
  using cli::Scene;
  py::class_<Scene> type(module, "Scene",
                         "A scene file: materials, contact patches and what moves them "
                         "(tools/scenes/README.md). Never changes.");
  define_run(type, "run", &run);
  type.def(py::init([](const Path& path) { return cli::read_scene(path.string()); }), py::arg("path"),
           "Reads a scene file, TOML. Raises bristle.Error with file, line and key.")
      .def_readonly("file", &Scene::file, "As it was given.")
      .def_readonly("name", &Scene::name, "Of the scene.")
      .def_readonly("description", &Scene::description, "Empty where the scene has none.")
      .def_readonly("dt", &Scene::dt, "Step, s.")
      .def_property_readonly("steps", &cli::step_count, "That its duration, or its longest trace, holds.")
      .def_property_readonly(
          "patches", [](const Scene& scene) { return names_of(scene.patches); },
          "Names of the [[patch]] entries. One with several copies stands for all: name.0, name.1, ...")
      .def_property_readonly(
          "bodies", [](const Scene& scene) { return names_of(scene.bodies); }, "Names of the bodies.")
      .def_property_readonly(
          "materials",
          [](const Scene& scene) {
            py::dict materials;
            for (const cli::SceneMaterial& m : scene.materials) materials[py::str(m.name)] = m.material;
            return materials;
          },
          "Materials by name.")
      .def("__repr__", [](const Scene& scene) {
        return "<bristle.Scene '" + scene.name + "': " + std::to_string(scene.patch_count()) +
               " patches, dt " + py::cast<std::string>(py::repr(py::float_(scene.dt))) + " s>";
      });
}

void define_scene_run(py::module_& module) {
  py::class_<SceneRun>(module, "SceneRun",
                       "What came out of a scene. print(run) shows what `bristle run` prints.")
      .def_readonly("t", &SceneRun::t, "Time at the end of each step, s.")
      .def_property_readonly(
          "forces", &forces_of,
          "Force on the body at the end of each step, N, by patch: views of shape (steps, 2).")
      .def_readonly("responses", &SceneRun::responses,
                    "By patch, a row a step, with the fields of bristle.responses.")
      .def_readonly(
          "motions", &SceneRun::motions,
          "By patch, a row a step, with the fields of bristle.motions: displacement (m) and load (N).")
      .def_property_readonly(
          "state_hash", [](const SceneRun& r) { return r.result.state_hash; },
          "Of all patches at the end: the same on every machine, f\"{run.state_hash:016x}\" as the command "
          "line prints it.")
      .def_property_readonly(
          "steps", [](const SceneRun& r) { return r.result.steps; }, "Steps done.")
      .def_property_readonly(
          "report",
          [](const SceneRun& r) -> py::dict {
            return report_of(cli::run_json(r.scene, r.options, r.result));
          },
          "Statistics by patch and body, step times, conditions: a dict as `bristle run --json` writes it.")
      .def("__str__", [](const SceneRun& r) { return cli::run_table(r.scene, r.options, r.result); })
      .def("__repr__", [](const SceneRun& r) {
        return "<bristle.SceneRun of '" + r.scene.name + "': " + std::to_string(r.result.steps) + " steps>";
      });
}

}  // namespace

void define_scenes(py::module_& module) {
  define_scene_run(module);
  define_scene(module);
  define_run(module, "run_scene", from_file(&run), py::arg("path"));
}

}  // namespace bristle_python
