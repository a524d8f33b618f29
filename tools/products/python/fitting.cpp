// Binds fit(), the Python form of the command `bristle fit`, for a file or arrays.
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "tools/libraries/files/csv_columns.hpp"
#include "tools/libraries/fitting/fit.hpp"
#include "tools/libraries/reports/text_layout.hpp"
#include "tools/products/python/owned.hpp"
#include "tools/products/python/tools.hpp"

namespace bristle_python {
template <>
inline constexpr bool is_module_class<cli::FitEstimate> = true;

namespace {

using bristle::SnapLaw;
using cli::FitEstimate;
using cli::ForceSign;

/// A measured record, the options of its fit, and the fit's result.
struct Fit {
  cli::FitOptions options;
  cli::FitData data;
  cli::FitResult result;
};

}  // namespace

template <>
inline constexpr bool is_module_class<Fit> = true;

namespace {

/// Options that the fit of a file and of arrays share, as Python gives them.
struct Given {
  const std::string &sign, &law, &rule;
  bristle::DamperDecay damper_decay;
  const std::optional<double>&residual, &renewal;  ///< fixed where given, else fitted
  double mass;  ///< mass that the force sensor accelerates, whose inertial force is in the record
};

void require_between(const char* name, const std::optional<double>& value, double low, double high,
                     const char* unit) {
  if (!value || (*value >= low && *value <= high)) return;
  const auto text = [](double number) { return py::cast<std::string>(py::repr(py::float_(number))); };
  throw bristle::Error(std::string(name) + " is " + text(*value) + "; allowed: " + text(low) + " to " +
                       text(high) + " " + unit);
}

/// Returns the options of a fit, with the facts that the data do not contain.
cli::FitOptions make_options(const Given& given, const std::optional<double>& load,
                             const cli::FitReading& reading) {
  constexpr const char* signs[] = {"auto", "on", "by"};
  constexpr const char* laws[] = {"lognormal", "normal", "uniform", "exponential", "free"};
  constexpr SnapLaw fitted[] = {SnapLaw::lognormal, SnapLaw::normal, SnapLaw::uniform, SnapLaw::exponential,
                                SnapLaw::table};
  require_between("load", load, 1e-9, cli::most_force, "N");
  require_between("residual", given.residual, 0.0, cli::widest_residual, "or None to fit it");
  require_between("renewal", given.renewal, 0.0, cli::most_renewed, "or None to fit it");
  require_between("rate", reading.rate, 1e-9, 1e12, "Hz");
  require_between(reading.disc ? "disc" : "radius", reading.radius, 1e-9, 1e3, "m");
  require_between("mass", given.mass, 0.0, 1e6, "kg");
  require_between("clip_load", reading.clip_load, 0.0, 1e9, "N");
  cli::FitOptions options;
  options.load = load;
  options.residual = given.residual;
  options.renewal = given.renewal;
  options.mass = given.mass;
  options.reading = reading;
  options.sign = static_cast<ForceSign>(index_of(spelled("sign", signs), given.sign));
  options.law = fitted[index_of(spelled("law", laws), given.law)];
  options.choose_rule = given.rule == "auto";
  if (!options.choose_rule)
    options.rule =
        static_cast<bristle::SnapRule>(index_of(spelled("rule", bristle::snap_rule_names), given.rule));
  options.decay = given.damper_decay;
  options.quiet = true;
  return options;
}

using Words = std::map<std::string, std::string>;

/// Fits without the interpreter's lock, because a long record takes seconds and other Python threads should
/// run.
Fit fit_columns(cli::FitColumns columns, cli::FitOptions options) {
  cli::FitData data = cli::prepare_fit_data(std::move(columns), options.sign, options.load, options.mass);
  cli::FitResult result = cli::fit_material(data, options);
  return {std::move(options), std::move(data), std::move(result)};
}

using Files = std::variant<std::filesystem::path, std::vector<std::filesystem::path>>;

Fit fit_files(const Files& files, const std::optional<double>& load, const std::string& sign,
              const std::string& law, const std::string& rule, bristle::DamperDecay damper_decay,
              const std::optional<double>& residual, const std::optional<double>& renewal,
              const Words& columns, const Words& units, const std::optional<double>& rate, double clip_load,
              const std::optional<double>& radius, const std::optional<double>& disc, double mass) {
  if (radius && disc)
    throw bristle::Error("radius and disc together: a ring has the one, a full disc the other");
  cli::FitReading reading;
  reading.rate = rate;
  reading.radius = disc ? disc : radius;
  reading.disc = disc.has_value();
  reading.clip_load = clip_load;
  reading.columns.assign(columns.begin(), columns.end());
  reading.units.assign(units.begin(), units.end());
  cli::FitOptions options =
      make_options({sign, law, rule, damper_decay, residual, renewal, mass}, load, reading);
  if (const auto* const one = std::get_if<std::filesystem::path>(&files)) {
    options.data = {one->string()};
  } else {
    for (const auto& file : std::get<std::vector<std::filesystem::path>>(files))
      options.data.push_back(file.string());
    if (options.data.empty()) throw bristle::Error("file is an empty list; allowed: one file or several");
  }
  const WithoutLock unlocked;
  return fit_columns(cli::read_fit_columns(options.data, options.reading), options);
}

std::vector<double> column_of(const Numbers& array, const char* name) {
  if (array.ndim() != 1) throw bristle::Error(std::string(name) + ": one dimension is needed");
  return {array.data(), array.data() + array.size()};
}

Fit fit_arrays(const Numbers& t, const Numbers& x, const Numbers& force, const Numbers& load,
               const std::string& sign, const std::string& law, const std::string& rule,
               bristle::DamperDecay damper_decay, const std::optional<double>& residual,
               const std::optional<double>& renewal, double mass) {
  cli::FitColumns columns;
  columns.name = "bristle.fit";
  columns.t = column_of(t, "t");
  columns.x = column_of(x, "x");
  columns.force = column_of(force, "force");
  columns.has_x = true;
  columns.has_load = load.ndim() > 0;
  if (columns.has_load) columns.load = column_of(load, "load");
  const cli::FitOptions options =
      make_options({sign, law, rule, damper_decay, residual, renewal, mass},
                   columns.has_load ? std::nullopt : std::optional<double>(*load.data()), {});
  const WithoutLock unlocked;
  cli::check_fit_columns(columns);
  return fit_columns(std::move(columns), options);
}

/// Returns a column of the fit as a read-only array; `owner` holds its memory.
py::array_t<double> column(const py::object& owner, const std::vector<double>& values) {
  py::array_t<double> array(static_cast<py::ssize_t>(values.size()), values.data(), owner);
  array.attr("setflags")(py::arg("write") = false);
  return array;
}

template <class Get>
auto column_property(Get get) {
  return py::cpp_function(
      [get](const py::object& self) { return column(self, get(py::cast<const Fit&>(self))); });
}

py::dict parameters_of(const Fit& fit, bool determined, bool others) {
  py::dict parameters;
  for (std::size_t i = 0; i < cli::fit_report_rows; ++i) {
    const FitEstimate& estimate = cli::report_estimate(fit.result, i);
    if (!cli::concerns(fit.data, fit.result, i)) continue;
    if (estimate.fitted ? determined : others) parameters[cli::fit_name(i)] = estimate;
  }
  return parameters;
}

std::optional<double> if_determined(const FitEstimate& estimate, double value) {
  return estimate.fitted ? std::optional<double>(value) : std::nullopt;
}

std::string text_of(const FitEstimate& estimate) {
  const auto number = [](double value) { return py::cast<std::string>(py::repr(py::float_(value))); };
  return "FitEstimate(value=" + number(estimate.value) +
         (estimate.fitted ? ", low=" + number(estimate.low) + ", high=" + number(estimate.high) + ")"
                          : ", not determined: " + estimate.why + ")");
}

void define_estimate(py::module_& module) {
  py::class_<FitEstimate>(module, "FitEstimate", "A fitted number in SI units.")
      .def_readonly("value", &FitEstimate::value, "The estimate; where not determined, what was assumed.")
      .def_readonly("determined", &FitEstimate::fitted, "Whether the data determine it.")
      .def_property_readonly(
          "low", [](const FitEstimate& e) { return if_determined(e, e.low); },
          "Lower end of the 95 % interval; None where not determined.")
      .def_property_readonly(
          "high", [](const FitEstimate& e) { return if_determined(e, e.high); },
          "Upper end of the 95 % interval; None where not determined.")
      .def_property_readonly(
          "why", [](const FitEstimate& e) { return e.fitted ? std::string() : e.why; },
          "Where not determined: what the data lack.")
      .def("__repr__", &text_of);
}

void define_result(py::module_& module) {
  py::class_<Fit>(module, "FitResult",
                  "A material from measured friction. print(result) shows what `bristle fit` prints.")
      .def_property_readonly(
          "material", [](const Fit& fit) { return fit.result.material; }, "The fitted bristle.Material.")
      .def_property_readonly(
          "parameters", [](const Fit& fit) { return parameters_of(fit, true, true); },
          "FitEstimate by name: kinetic, presliding_length (m), spread, residual_share, shared_renewal, "
          "stage_softening (m/N^2), viscous_friction (N s/m), damping_per_newton (s/m), stribeck_velocity "
          "(m/s), "
          "sensor_delay (s), sensor_offset (N), "
          "sensor_drift (N/s), the same of a second axis, and what follows from them: peak, "
          "stiffness_per_newton (1/m).")
      .def_property_readonly(
          "not_determined", [](const Fit& fit) { return parameters_of(fit, false, true); },
          "Those of parameters that the data do not determine.")
      .def_property_readonly(
          "residual_rms", [](const Fit& fit) { return fit.result.residual_rms; }, "N.")
      .def_property_readonly(
          "explained", [](const Fit& fit) { return fit.result.explained; },
          "Share of the sum of squares of the force.")
      .def_property_readonly(
          "t", column_property([](const Fit& f) -> const auto& { return f.data.columns.t; }), "Samples, s.")
      .def_property_readonly(
          "x", column_property([](const Fit& f) -> const auto& { return f.data.columns.x; }), "Samples, m.")
      .def_property_readonly("load", column_property([](const Fit& f) -> const auto& { return f.data.load; }),
                             "Samples as the fit uses them, N.")
      .def_property_readonly(
          "force", column_property([](const Fit& f) -> const auto& { return f.data.force; }),
          "Samples, N, by the body: positive along the motion. Two axes: all x, then all y.")
      .def_property_readonly("curve",
                             column_property([](const Fit& f) -> const auto& { return f.result.curve; }),
                             "The fit at the samples, N, by the body, sensor offset and drift included.")
      .def_property_readonly(
          "report", [](const Fit& fit) -> py::dict { return report_of(cli::fit_json(fit.data, fit.result)); },
          "All of it but the samples: a dict as `bristle fit --json` writes it.")
      .def_property_readonly(
          "understood", [](const Fit& fit) { return fit.data.columns.understood; },
          "How the data were read, a sentence each.")
      .def("__str__", [](const Fit& fit) { return cli::filled(cli::fit_table(fit.data, fit.result)); });
}

}  // namespace

void define_fitting(py::module_& module) {
  define_estimate(module);
  define_result(module);
  const py::arg_v sign = py::arg("sign") = "auto", law = py::arg("law") = "lognormal",
                  rule = py::arg("rule") = "auto", none_left = optional("residual"),
                  none_renewed = optional("renewal"), mass = py::arg("mass") = 0.0,
                  decay = py::arg("damper_decay") = bristle::DamperDecay::exponential;
  module.def(
      "fit", &fit_files, py::arg("file"), py::kw_only(), optional("load"), sign, law, rule, decay, none_left,
      none_renewed, py::arg("columns") = Words(), py::arg("units") = Words(), optional("rate"),
      py::arg("clip_load") = 0.0, optional("radius"), optional("disc"), mass,
      "A material from measured friction in a CSV file with the columns t,x,load,force "
      "(tools/libraries/fitting/README.md), or in several that are one record. load: N, in place of a "
      "column. columns: the file's names of them ({\"x\": \"Position\", \"force\": \"Fx\"}); units: of "
      "them ({\"x\": \"um\"}). rate: samples per second of a file without time. clip_load: N, loads from "
      "minus this to 0 count as 0. radius: m, at which columns angle and torque act; disc: instead, that of "
      "a full disc. mass: kg that the force sensor accelerates. sign: whose force, \"on\" the body or "
      "\"by\" it; \"auto\" finds it. law: \"lognormal\", \"normal\", \"uniform\", \"exponential\" or, "
      "where bristles slide, \"free\". rule: \"redraw\", \"slide\", or \"auto\" for what predicts better. "
      "residual (a share of the presliding length, 0 to 0.95) and renewal (0 to 8) hold these; None fits "
      "them, residual=0, renewal=0 is the paper's brush; the rule slide has neither. Takes seconds and lets "
      "go of the interpreter's lock. Raises bristle.Error on data that nothing can be learnt from.");
  module.def(
      "fit", &fit_arrays, py::arg("t"), py::arg("x"), py::arg("force"), py::arg("load"), py::kw_only(), sign,
      law, rule, decay, none_left, none_renewed, mass,
      "The same of arrays: times (s), positions (m), forces and loads (N; one number or one a sample).");
}

}  // namespace bristle_python
