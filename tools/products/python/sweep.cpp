// Binds what bristle.sweep (package/_sweep.py) needs of a parameter study: the study, its rows and their
// table.
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "tools/libraries/sweep/sweep.hpp"
#include "tools/products/python/tools.hpp"

namespace bristle_python {
template <>
inline constexpr bool is_module_class<cli::Study> = true;

namespace {

using cli::Study;
using Path = std::filesystem::path;
using Texts = std::vector<std::string>;

std::unique_ptr<Study> make_study(const Path& scene, const Texts& vary, std::uint64_t repeat,
                                  const std::optional<std::uint32_t>& seed, const Texts& set,
                                  const Texts& reference, const Texts& report, const std::string& window,
                                  const std::optional<std::uint64_t>& steps) {
  cli::StudyOptions options;
  options.scene = scene.string();
  options.vary = vary;
  options.repeat = repeat;
  options.seed = seed;
  options.set = set;
  options.reference = reference;
  options.report = report;
  options.window = window;
  options.steps = steps;
  return std::make_unique<Study>(options);
}

std::string run_row(const Study& study, std::uint64_t index, const std::string& isa) {
  const WithoutLock unlocked;
  return study.run_row(index, isa);
}

}  // namespace

template <>
inline constexpr bool is_module_class<cli::SweepRows> = true;

namespace {

using Rows = cli::SweepRows;

void run_on_threads(Rows& rows, const Study& study, int threads, const std::string& isa) {
  const std::vector<std::uint64_t> indices = rows.missing();
  WithoutLock unlocked;
  InterruptCheck interrupted(unlocked);
  cli::run_rows(
      study, indices, threads, isa, [&](const std::string& row) { rows.add(row); }, [&] { interrupted(); });
}

py::object study_columns(const Study& study) { return report_of(study.header().at("columns").dump()); }

}  // namespace

void define_sweep(py::module_& module) {
  py::class_<Study>(module, "_SweepStudy")
      .def(py::init(&make_study), py::arg("scene"), py::arg("vary"), py::kw_only(), py::arg("repeat"),
           py::arg("seed"), py::arg("set"), py::arg("reference"), py::arg("report"), py::arg("window"),
           py::arg("steps"))
      .def_static("from_recipe",
                  [](const std::string& recipe, const Path& folder) {
                    return std::make_unique<Study>(recipe, folder.string());
                  })
      .def("recipe", &Study::recipe)
      .def_property_readonly("hash", &Study::hash)
      .def_property_readonly("rows", &Study::rows)
      .def_property_readonly("columns", &study_columns)
      .def("run_row", &run_row, py::arg("index"), py::arg("isa"));
  py::class_<Rows>(module, "_SweepRows")
      .def(py::init([](const Study& study, const std::string& out) {
        return std::make_unique<Rows>(study, cli::unfinished_table(out));
      }))
      .def("add", &Rows::add)
      .def("remove", &Rows::remove)
      .def("close", &Rows::close)
      .def("missing", &Rows::missing)
      .def("lines", &Rows::rows)
      .def("table_hash", &Rows::table_hash)
      .def("write", &Rows::write)
      .def("refusal",
           [](const Rows& rows) {
             const cli::SweepRefusal refusal = cli::sweep_refusal(rows);
             return py::make_tuple(refusal.text, refusal.of_all);
           })
      .def("summary", [](const Rows& rows) { return cli::sweep_summary(rows, {}); })
      .def("run_on_threads", &run_on_threads);
  module.def("_check_table_file", &cli::check_table_file);
}

}  // namespace bristle_python
