// Binds Outline and ExtendedPatches.
#include <string>

#include "tools/products/python/owned.hpp"

namespace bristle_python {

using bristle::ExtendedMotion;
using bristle::ExtendedPatches;
using bristle::ExtendedResponse;
using bristle::Outline;
using bristle::PatchId;
using bristle::Pressure;

namespace {

Outline outline_of(const Numbers& positions, const Numbers& weights) {
  if (positions.ndim() != 2 || positions.shape(1) != 2 || weights.ndim() != 1 ||
      weights.shape(0) != positions.shape(0))
    throw bristle::Error("Outline: positions of shape (n, 2) in m and n weights are needed");
  Outline outline;
  outline.cells.clear();
  for (py::ssize_t i = 0; i < weights.shape(0); ++i)
    outline.cells.push_back({{positions.at(i, 0), positions.at(i, 1)}, weights.at(i)});
  return outline;
}

struct OwnBatch {
  bristle::PatchBatch own;
};
/// Extended patches that were made without a batch, and therefore own the batch of their cells.
struct PatchesOfOwn : OwnBatch, ExtendedPatches {
  explicit PatchesOfOwn(const bristle::BatchOptions& options)
      : OwnBatch{bristle::PatchBatch(options)}, ExtendedPatches(own) {}
};
using Patches = Owned<PatchesOfOwn>;

/// Motion of an extended patch as a row of numbers.
struct ExtendedRow {
  using Motion = ExtendedMotion;
  using Response = ExtendedResponse;
  static constexpr py::ssize_t size = 4;
  static constexpr const char* numbers = "displacement x, y (m), spin (rad), normal load (N)";
  static ExtendedMotion motion(PatchId id, const double* row) {
    ExtendedMotion motion{id, {row[0], row[1], row[2]}};
    motion.normal_load = row[3];
    return motion;
  }
};

py::dict step(Patches& self, double dt, const Ids& ids, const Numbers& motions) {
  return step_rows<ExtendedRow>(
      self, ids, motions, [dt](ExtendedPatches& patches, auto in, auto out) { patches.step(dt, in, out); });
}

py::dict find_force(Patches& self, double dt, const Ids& ids, const Numbers& motions) {
  return step_rows<ExtendedRow>(self, ids, motions, [dt](ExtendedPatches& patches, auto in, auto out) {
    for (std::size_t i = 0; i < in.size(); ++i) out[i] = patches.find_force(dt, in[i]);
  });
}

py::dict extended_info(Patches& self, PatchId id) {
  const bristle::ExtendedInfo info = in_turn<Patches>(&ExtendedPatches::info)(self, id);
  return py::dict("cells"_a = info.cells, "scale"_a = info.scale,
                  "along"_a = py::make_tuple(info.along[0], info.along[1]),
                  "normal_load"_a = info.normal_load, "max_normal_load"_a = info.max_normal_load,
                  "memory_bytes"_a = info.memory_bytes, "kernel"_a = info.kernel);
}

void define_outline(py::module_& module) {
  PYBIND11_NUMPY_DTYPE(bristle::PatchCell, position, weight);
  py::class_<Outline>(
      module, "Outline",
      "Outline and pressure of a patch with an extent, as cells: a position (m, from the centre) "
      "and a share of the load each. The shares sum to 1. A negative number of cells, or other "
      "numbers that cannot be, raise bristle.Error.")
      .def(py::init(&outline_of), py::arg("positions"), py::arg("weights"), "Any cells.")
      .def_static("disc", &Outline::disc, py::arg("radius"), py::kw_only(),
                  py::arg("pressure") = Pressure::uniform, py::arg("rings") = 3, py::arg("around") = 0,
                  "Rings of cells; around = 0: three times the rings.")
      .def_static("ellipse", &Outline::ellipse, py::arg("half_x"), py::arg("half_y"), py::kw_only(),
                  py::arg("pressure") = Pressure::uniform, py::arg("rings") = 3, py::arg("around") = 0,
                  "Half axes in m.")
      .def_static("rectangle", &Outline::rectangle, py::arg("half_x"), py::arg("half_y"), py::kw_only(),
                  py::arg("pressure") = Pressure::uniform, py::arg("nx") = 5, py::arg("ny") = 5,
                  "Half sides in m; hertz: a cylinder that lies along y.")
      .def_readwrite("full_size_load", &Outline::full_size_load,
                     "N: the load at which the outline has its size, which grows with the cube root of the "
                     "load; 0 = fixed.")
      .def_property_readonly(
          "positions", [](const Outline& outline) { return Numbers(columns_of(outline.cells)["position"]); },
          "Of the cells, m: shape (n, 2), a copy.")
      .def_property_readonly(
          "weights", [](const Outline& outline) { return Numbers(columns_of(outline.cells)["weight"]); },
          "Shares of the load, a copy.")
      .def("__len__", [](const Outline& outline) { return outline.cells.size(); })
      .def("__reduce__", [](const Outline& outline) {
        const py::dict cells = columns_of(outline.cells);
        return py::make_tuple(
            py::type::of<Outline>(), py::make_tuple(cells["position"], cells["weight"]),
            py::make_tuple(py::none(), py::dict("full_size_load"_a = outline.full_size_load)));
      });
}

}  // namespace

void define_extended(py::module_& module) {
  PYBIND11_NUMPY_DTYPE(ExtendedResponse, status, end, elastic, damper, mean, stiffness, damping, force_limit,
                       torque_limit, dissipated, contact_loss, damper_work);
  define_outline(module);
  using bristle::Material;
  using bristle::PatchOptions;
  py::class_<Patches> type(
      module, "ExtendedPatches",
      "Contact patches with an extent: they resist spin, and slide easier while they spin. "
      "Named by ids (int), stepped together. Axes are those of the surface; the outline turns "
      "in them. step and find_force let go of the interpreter's lock.");
  define_constructor(type, "As PatchBatch.");
  type.def(
          "add",
          [](Patches& self, const Material& material, const Outline& outline, const PatchOptions& options) {
            const Patches::Turn turn(self);
            return self.batch.add(material, options, outline);
          },
          py::arg("material"), py::arg("outline"), py::arg("options") = PatchOptions{},
          "A new patch, out of contact: its id. Raises bristle.Error.")
      .def("remove", in_turn<Patches>(&ExtendedPatches::remove), py::arg("id"),
           "Raises bristle.Error when there is no such patch.")
      .def("set_material", in_turn<Patches>(&ExtendedPatches::set_material), py::arg("id"),
           py::arg("material"), "From the next step on; deflections stay.")
      .def(
          "set_scale",
          [](Patches& self, PatchId id, double scale) {
            const Patches::Turn turn(self);
            if (!self.batch.set_scale(id, scale))
              throw bristle::Error("ExtendedPatches: scale = " + std::to_string(scale) + " of id " +
                                   std::to_string(id.value) +
                                   "; allowed is 0 to 1e6, of a patch that is there");
          },
          py::arg("id"), py::arg("scale"), "Size of the outline, in its size as given.")
      .def("step", &step, py::arg("dt"), py::arg("ids"), py::arg("motions"),
           "Moves n patches over dt (s). motions: shape (n, 4): displacement x, y (m), spin (rad), normal "
           "load (N). A dict of arrays: status; end, elastic, damper, mean of shape (n, 3): force (N), then "
           "torque about the centre (N m), on the moving body; stiffness, damping of shape (n, 3, 3); "
           "force_limit, torque_limit, dissipated, contact_loss, damper_work. mean and energies are zero "
           "where PatchOptions.outputs has them not.")
      .def("find_force", &find_force, py::arg("dt"), py::arg("ids"), py::arg("motions"),
           "The responses to trial motions, each from the state as it is, which does not change.")
      .def("info", &extended_info, py::arg("id"), "A dict with the fields of ExtendedInfo.")
      .def("stored_energy", in_turn<Patches>(&ExtendedPatches::stored_energy), py::arg("id"), "J.");
  define_state<PatchId>(type, "id", &ExtendedPatches::patch_count);
}

}  // namespace bristle_python
