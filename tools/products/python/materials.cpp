// Binds SnapLength, Coefficients and Material.
#include <optional>

#include "tools/products/python/keyword_class.hpp"

namespace bristle_python {

using bristle::Coefficients;
using bristle::Material;
using bristle::SnapLaw;
using bristle::SnapLength;

namespace {

using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;

template <class Function>
Doubles map(const Doubles& in, Function&& function) {
  Doubles out(std::vector<py::ssize_t>(in.shape(), in.shape() + in.ndim()));
  for (py::ssize_t i = 0; i < in.size(); ++i) out.mutable_data()[i] = function(in.data()[i]);
  return out;
}

std::string text_of(const SnapLength& law) {
  std::string text = std::string("SnapLength.") + to_string(law.law()) + "(";
  if (law.law() == SnapLaw::table) {
    text += std::to_string(law.table_values().size()) + " quantiles";
  } else {
    text += code_of(py::float_(law.first_parameter()));
    const bool two = law.law() != SnapLaw::single && law.law() != SnapLaw::exponential;
    if (two) text += ", " + code_of(py::float_(law.second_parameter()));
  }
  return text + ")";
}

/// Returns a call of the static method that makes an equal law, by which laws are copied and pickled.
py::tuple reduced(const SnapLength& law) {
  const py::object call = py::module_::import("operator").attr("methodcaller");
  const char* const name = to_string(law.law());
  const double a = law.first_parameter(), b = law.second_parameter();
  const bristle::Span<const double> table = law.table_values();
  const bool one = law.law() == SnapLaw::single || law.law() == SnapLaw::exponential;
  const py::object made = law.law() == SnapLaw::table
                              ? call(name, Doubles(static_cast<py::ssize_t>(table.size()), table.data()))
                          : one ? call(name, a)
                                : call(name, a, b);
  return py::make_tuple(made, py::make_tuple(py::type::of<SnapLength>()));
}

void define_snap_length(py::module_& module) {
  py::class_<SnapLength>(
      module, "SnapLength",
      "The law of the snap length: the deflection at which a bristle lets go. Lengths in m. "
      "Made by its static methods, which raise bristle.Error; never changes.")
      .def_static("single", &SnapLength::single, py::arg("length"), "Every bristle snaps at this length.")
      .def_static("uniform", &SnapLength::uniform, py::arg("min"), py::arg("max"), "Uniform on [min, max].")
      .def_static("normal", &SnapLength::normal, py::arg("mean"), py::arg("deviation"),
                  "Normal, cut at 0; mean and deviation are those of the uncut law.")
      .def_static("lognormal", &SnapLength::lognormal, py::arg("mean"), py::arg("cv"),
                  "Lognormal with the given mean and coefficient of variation, 0 to 3.")
      .def_static("exponential", &SnapLength::exponential, py::arg("mean"), "Exponential.")
      .def_static(
          "table",
          [](const Doubles& quantiles) {
            return SnapLength::table({quantiles.data(), static_cast<std::size_t>(quantiles.size())});
          },
          py::arg("quantiles"), "Quantiles at the probabilities 0, 1/(n-1), ..., 1, ascending; 2 to 257.")
      .def_property_readonly("law", &SnapLength::law, "Name of the law.")
      .def_property_readonly("mean", &SnapLength::mean, "E[delta], m.")
      .def_property_readonly("cv", &SnapLength::cv, "Standard deviation over mean.")
      .def_property_readonly("longest", &SnapLength::longest, "Largest length that is sampled, m.")
      .def("moment", &SnapLength::moment, py::arg("k"), "E[delta^k], m^k, k = 0 to 6.")
      .def(
          "quantile",
          [](const SnapLength& s, const Doubles& u) {
            return map(u, [&](double x) { return s.quantile(x); });
          },
          py::arg("u"), "Length below which a share u of the bristles lies, m. Takes arrays.")
      .def(
          "survival",
          [](const SnapLength& s, const Doubles& x) {
            return map(x, [&](double v) { return s.survival(v); });
          },
          py::arg("x"), "P(delta > x), x in m. Takes arrays.")
      .def("__eq__",
           [](const SnapLength& a, const py::object& b) {
             return py::isinstance<SnapLength>(b) && a == py::cast<const SnapLength&>(b);
           })
      .def("__hash__", [](const SnapLength& s) { return py::hash(py::str(text_of(s))); })
      .def("__reduce__", &reduced)
      .def("__repr__", &text_of);
}

Material material_of(const Coefficients& c) {
  if (c.presliding_length > 1.0 &&
      PyErr_WarnEx(PyExc_UserWarning, "bristle: presliding_length is in m, and more than one of them", 1) < 0)
    throw py::error_already_set();
  return Material::from_coefficients(c);
}

/// Returns the keywords of the constructor with their defaults, for help().
std::string define_coefficients(py::module_& module) {
  KeywordClass<Coefficients> coefficients(
      module, "Coefficients", "What people know of a pair of surfaces. See Material.from_coefficients.");
  coefficients.listed_fields().done();
  coefficients.type
      .def_static("paper", &Coefficients::paper, "The law of the paper: residual_share = shared_renewal = 0.")
      .def_static(
          "typical", [](const std::string& name) { return bristle::typical_coefficients(name.c_str()); },
          py::arg("name"),
          "Coefficients to start from: a name of typical_materials(), e.g. \"wood on wood\".");
  return coefficients.keywords();
}

void define_from_coefficients(py::class_<Material>& type, const std::string& keywords) {
  // Writes the keywords into the signature, which pybind11 itself would show as **kwargs.
  py::options options;
  options.disable_function_signatures();
  const std::string doc = "from_coefficients(coefficients: Optional[bristle.Coefficients] = None, *, " +
                          keywords +
                          ") -> bristle.Material\n\nBristle parameters from Coefficients or their keywords. "
                          "Raises bristle.Error, "
                          "with the reachable range, where the family cannot reach peak / kinetic.";
  type.def_static(
      "from_coefficients",
      [](const std::optional<Coefficients>& coefficients, const py::kwargs& given) {
        if (coefficients && !given.empty())
          throw py::type_error("from_coefficients(): give Coefficients or their keywords, not both");
        return material_of(coefficients ? *coefficients
                                        : py::cast<Coefficients>(py::type::of<Coefficients>()(**given)));
      },
      optional("coefficients"), doc.c_str());
}

void define_material(py::module_& module, const std::string& keywords_of_coefficients) {
  KeywordClass<Material> material(
      module, "Material", "Bristle parameters, SI units. Checked by validate() and by PatchBatch.add.");
  material.listed_fields().done();
  define_from_coefficients(material.type, keywords_of_coefficients);
  material.type
      .def_static(
          "typical",
          [](const std::string& name) { return material_of(bristle::typical_coefficients(name.c_str())); },
          py::arg("name"), "The material of Coefficients.typical(name).")
      .def("coefficients", &Material::coefficients, py::arg("kinetic_speed") = 0.0,
           "The way back: Coefficients of these parameters, at a speed (m/s; 0 = fast).")
      .def("validate", &Material::validate, "Raises bristle.Error naming the first parameter out of range.")
      .def("bristles_in_contact", &Material::bristles_in_contact, py::arg("normal_load"),
           "Bristles that carry this load (N), a real number.")
      .def("kinetic_coefficient", py::overload_cast<>(&Material::kinetic_coefficient, py::const_),
           "Friction over load in slow steady sliding; with ageing in fast sliding, the lowest.")
      .def("kinetic_coefficient", py::overload_cast<double>(&Material::kinetic_coefficient, py::const_),
           py::arg("speed"), "The same at a speed, m/s: with ageing it falls with the speed.")
      .def("peak_coefficient", py::overload_cast<>(&Material::peak_coefficient, py::const_),
           "Highest friction over load at first loading.")
      .def("peak_coefficient", py::overload_cast<double>(&Material::peak_coefficient, py::const_),
           py::arg("held"), "The same of a contact that has held for this time, s, and is loaded fast.")
      .def("strengthening_at", &Material::strengthening_at, py::arg("speed"),
           "Friction over load that strengthening with speed adds. m/s.")
      .def("damping_at", &Material::damping_at, py::arg("speed"), "sigma1(v), N s/m, of one bristle. m/s.")
      .def("steady_force", &Material::steady_force, py::arg("speed"), py::arg("normal_load"),
           "Steady friction at constant speed (m/s) under a load (N): N.");
}

}  // namespace

void define_materials(py::module_& module) {
  define_snap_length(module);
  define_material(module, define_coefficients(module));
  module.def(
      "typical_materials",
      [] {
        py::dict all;
        for (const bristle::TypicalMaterial& typical : bristle::typical_materials())
          all[typical.name] = typical.about;
        return all;
      },
      "Names of pairs of surfaces for Coefficients.typical and Material.typical, and where their numbers "
      "come from.");
  module.def(
      "virgin_deflection",
      [](const SnapLength& law, bristle::SnapRule rule, const Doubles& x_over_mean) {
        return map(x_over_mean, [&](double x) { return bristle::virgin_deflection(law, rule, x); });
      },
      py::arg("law"), py::arg("rule"), py::arg("x_over_mean"),
      "Mean deflection at displacement x from straight bristles, both in units of the mean snap length. "
      "Takes arrays.");
}

}  // namespace bristle_python
