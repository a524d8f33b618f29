// Binds BedMaterial, BedShape and BedBatch, with numpy arrays in and out.
#include <string>
#include <vector>

#include "tools/products/python/keyword_class.hpp"
#include "tools/products/python/owned.hpp"

namespace bristle_python {
/// A Python function that gives a bed's pressure at a point, as a C++ type for signatures.
struct PressureFunction : py::function {
  PYBIND11_OBJECT(PressureFunction, py::function, PyCallable_Check)
};
}  // namespace bristle_python

template <>
struct pybind11::detail::handle_type_name<bristle_python::PressureFunction> {
  static constexpr auto name = const_name("Callable[[float, float], float]");
};

namespace bristle_python {

using bristle::BedBatch;
using bristle::BedMaterial;
using bristle::BedMotion;
using bristle::BedOptions;
using bristle::BedPressure;
using bristle::BedResponse;
using bristle::BedShape;

namespace {

using Beds = Owned<BedBatch>;

/// Motion of a bed as a row of numbers.
struct BedRow {
  using Motion = BedMotion;
  using Response = BedResponse;
  static constexpr py::ssize_t size = 6;
  static constexpr const char* numbers =
      "displacement x, y (m), spin (rad), rolled x, y (m), normal load (N)";
  static BedMotion motion(bristle::BedId id, const double* row) {
    return {id, {row[0], row[1]}, row[2], {row[3], row[4]}, row[5]};
  }
};

py::dict step(Beds& self, const Ids& ids, const Numbers& motions) {
  return step_rows<BedRow>(self, ids, motions, [](BedBatch& beds, auto in, auto out) { beds.step(in, out); });
}

py::dict find_force(Beds& self, const Ids& ids, const Numbers& motions) {
  return step_rows<BedRow>(self, ids, motions, [](BedBatch& beds, auto in, auto out) {
    for (std::size_t i = 0; i < in.size(); ++i) out[i] = beds.find_force(in[i]);
  });
}

py::dict bristles_of(Beds& self, bristle::BedId id) {
  const Beds::Turn turn(self);
  std::vector<bristle::BedBristle> bristles(self.batch.info(id).bristles);
  self.batch.read_bristles(id, {bristles.data(), bristles.size()});
  return columns_of(bristles);
}

py::dict bed_info(Beds& self, bristle::BedId id) {
  const bristle::BedInfo info = in_turn<Beds>(&BedBatch::info)(self, id);
  return py::dict("bristles"_a = info.bristles, "half"_a = py::make_tuple(info.half[0], info.half[1]),
                  "normal_load"_a = info.normal_load, "stiffness"_a = info.stiffness,
                  "longest_deflection"_a = info.longest_deflection, "memory_bytes"_a = info.memory_bytes);
}

double pressure_at(const py::function& pressure, double x, double y) {
  const py::object value = pressure(x, y);
  const double number = PyFloat_AsDouble(value.ptr());
  if (number != -1.0 || PyErr_Occurred() == nullptr) return number;
  PyErr_Clear();
  throw py::type_error("from_pressure(): pressure(x, y) must return a number, not " +
                       py::cast<std::string>(py::repr(value)));
}

/// Returns a bed's material as a call that makes it, and the elasticity to be set afterwards, for copies and
/// pickles.
py::tuple reduced(const py::object& self) {
  py::dict elasticity;
  for (const char* name :
       {"normal_modulus", "shear_modulus", "radius", "flexibility", "slip_stiffness", "presliding"})
    elasticity[name] = self.attr(name);
  return py::make_tuple(py::type::of(self),
                        py::make_tuple(self.attr("static_friction"), self.attr("kinetic_friction")),
                        py::make_tuple(py::none(), elasticity));
}

void define_material(py::module_& module) {
  KeywordClass<BedMaterial> material(
      module, "BedMaterial",
      "Friction and elasticity of a bed: exactly one of elastic moduli, flexibilities, slip "
      "stiffness, presliding displacement.");
  material.listed_fields();
  material.type.def(py::init<double, double>(), py::arg("static_friction"), py::arg("kinetic_friction"))
      .def(py::init<double>(), py::arg("friction"))
      .def("with_elastic", &BedMaterial::with_elastic, py::arg("shear_modulus"), py::arg("poisson"),
           py::arg("radius") = 0.0, "One elastic body on a rigid one; Pa, m.")
      .def("with_elastic_pair", &BedMaterial::with_elastic_pair, py::arg("shear_modulus"), py::arg("poisson"),
           py::arg("radius") = 0.0, "Two alike elastic bodies; 1/radius = 1/R1 + 1/R2.")
      .def("with_flexibility", &BedMaterial::with_flexibility, py::arg("x"), py::arg("y"), py::arg("spin"),
           "Kalker's L1, L2, L3 in m^3/N.")
      .def("with_slip_stiffness", &BedMaterial::with_slip_stiffness, py::arg("x"), py::arg("y"),
           "N per unit slip.")
      .def("with_presliding", &BedMaterial::with_presliding, py::arg("displacement"),
           "m: all of it slides at this displacement, under full load.")
      .def("__reduce__", &reduced);
}

using Row = std::array<double, 4>;  // a bristle of BedShape::list: x, y, stiffness, load

std::vector<Row> cells_of(const BedShape& shape) {
  std::vector<Row> rows;
  for (const bristle::BedCell& cell : shape.list)
    rows.push_back({cell.position[0], cell.position[1], cell.stiffness, cell.load});
  return rows;
}

void set_cells(BedShape& shape, const std::vector<Row>& rows) {
  shape.list.clear();
  for (const Row& row : rows) shape.list.push_back({{row[0], row[1]}, row[2], row[3]});
}

void define_shape(py::module_& module) {
  KeywordClass<BedShape> type(module, "BedShape",
                              "Outline, pressure and grid of a bed, made by its static methods.");
  type.listed_fields()
      .property("bristles", &cells_of, &set_cells, "Of kind \"list\": rows x, y (m), stiffness, load.")
      .done();
  type.type
      .def_static("sphere_row", &BedShape::sphere_row, py::arg("cells") = 32, py::kw_only(),
                  py::arg("radius_of_contact") = 0.0, "Sphere on a plane by dimensional reduction.")
      .def_static("wheel_row", &BedShape::wheel_row, py::arg("half_length"), py::kw_only(),
                  py::arg("pressure") = BedPressure::parabolic, py::arg("cells") = 32,
                  "One row that rolls along x.")
      .def_static("cylinder_row", &BedShape::cylinder_row, py::arg("half_length"), py::kw_only(),
                  py::arg("cells") = 32, "Hertz's cylinder, rolling.")
      .def_static("ellipse", &BedShape::ellipse, py::arg("half_x"), py::arg("half_y"), py::kw_only(),
                  py::arg("pressure") = BedPressure::hertz, py::arg("rings") = 7, py::arg("around") = 0,
                  "around = 0: three times the rings.")
      .def_static("disc", &BedShape::disc, py::arg("radius"), py::kw_only(),
                  py::arg("pressure") = BedPressure::hertz, py::arg("rings") = 7, py::arg("around") = 0)
      .def_static("rectangle", &BedShape::rectangle, py::arg("half_x"), py::arg("half_y"), py::kw_only(),
                  py::arg("pressure") = BedPressure::parabolic, py::arg("nx") = 16, py::arg("ny") = 8)
      .def_static(
          "from_pressure",
          [](double half_x, double half_y, int nx, int ny, const PressureFunction& function) {
            return BedShape::from_pressure(half_x, half_y, nx, ny,
                                           [&](double x, double y) { return pressure_at(function, x, y); });
          },
          py::arg("half_x"), py::arg("half_y"), py::arg("nx"), py::arg("ny"), py::arg("pressure"),
          "pressure(x, y), relative; above 0 inside.")
      .def_static(
          "from_list",
          [](const Numbers& positions, const Numbers& stiffness, const Numbers& load) {
            if (positions.ndim() != 2 || positions.shape(1) != 2 || stiffness.ndim() != 1 ||
                load.ndim() != 1 || stiffness.shape(0) != positions.shape(0) ||
                load.shape(0) != positions.shape(0))
              throw bristle::Error(
                  "BedShape: positions of shape (n, 2) in m, n stiffnesses and n loads are needed");
            std::vector<bristle::BedCell> cells;
            for (py::ssize_t i = 0; i < load.shape(0); ++i)
              cells.push_back({{positions.at(i, 0), positions.at(i, 1)}, stiffness.at(i), load.at(i)});
            return BedShape::from_list(std::move(cells));
          },
          py::arg("positions"), py::arg("stiffness"), py::arg("load"), "Given bristles, relative shares.")
      .def(
          "rolling", [](BedShape shape, int along, int rows) { return shape.rolling(along, rows); },
          py::arg("along"), py::arg("rows"), "A copy whose bristles are carried through the contact.")
      .def(
          "grown", [](BedShape shape, bristle::BedGrowth law) { return shape.grown(law); }, py::arg("law"),
          "A copy whose size follows the load: fixed, cube_root, square_root.");
}

}  // namespace

void define_beds(py::module_& module) {
  PYBIND11_NUMPY_DTYPE(BedResponse, status, force, torque, mean, mean_torque, dissipated, stored, tangent,
                       slipping_share);
  PYBIND11_NUMPY_DTYPE(bristle::BedBristle, position, deflection, stiffness, limit);
  define_material(module);
  define_shape(module);
  py::class_<Beds> type(
      module, "BedBatch",
      "Elastic bodies in contact that slip from the rim, spin and roll. Named by ids (int), stepped "
      "together; step and find_force let go of the interpreter's lock.");
  define_constructor(type, "As PatchBatch.");
  type.def(
          "add",
          [](Beds& self, const BedMaterial& material, const BedShape& shape, double max_normal_load,
             bool all_outputs, double longest_piece) {
            const Beds::Turn turn(self);
            return self.batch.add(material, shape, {max_normal_load, all_outputs, longest_piece});
          },
          py::arg("material"), py::arg("shape"), py::kw_only(), py::arg("max_normal_load"),
          py::arg("all_outputs") = true, py::arg("longest_piece") = BedOptions{}.longest_piece,
          "A new bed, out of contact: its id. Raises bristle.Error.")
      .def("remove", in_turn<Beds>(&BedBatch::remove), py::arg("id"),
           "Raises bristle.Error when there is no such bed.")
      .def(
          "reset",
          [](Beds& self, bristle::BedId id) {
            const Beds::Turn turn(self);
            if (!self.batch.reset(id)) throw bristle::Error("BedBatch.reset: there is no such bed");
          },
          py::arg("id"), "Unbends all bristles and takes the bed out of contact.")
      .def("info", &bed_info, py::arg("id"),
           "A dict: bristles, half widths (m) and load (N) of the last step, stiffness (N/m), longest "
           "deflection (m), memory. Zeros for an unknown id.")
      .def("step", &step, py::arg("ids"), py::arg("motions"),
           "Moves n beds. motions: shape (n, 6): displacement x, y (m), spin (rad), rolled x, y (m), normal "
           "load (N). A dict of arrays: status, force (n, 2), torque, mean (n, 2), mean_torque, dissipated, "
           "stored, tangent (n, 3, 3), slipping_share; on the moving body.")
      .def("find_force", &find_force, py::arg("ids"), py::arg("motions"),
           "The responses to trial motions, each from the state as it is, which does not change.")
      .def("bristles", &bristles_of, py::arg("id"),
           "A dict of arrays: position and deflection (n, 2) in m, stiffness in N/m, limit in m.");
  define_state<bristle::BedId>(type, "id", &BedBatch::bed_count);
}

}  // namespace bristle_python
