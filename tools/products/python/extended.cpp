// Binds Outline and ExtendedPatches.
#include <string>
#include <vector>

#include "tools/products/python/owned.hpp"

namespace bristle_python {

using bristle::ExtendedMotion;
using bristle::ExtendedPatches;
using bristle::ExtendedResponse;
using bristle::Outline;

namespace {

bristle::Pressure pressure_named(const std::string& name) {
  if (name == "uniform") return bristle::Pressure::uniform;
  if (name == "hertz") return bristle::Pressure::hertz;
  throw bristle::Error("pressure = '" + name + "'; allowed is 'uniform' or 'hertz'");
}

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

Numbers positions_of(const Outline& outline) {
  Numbers positions({static_cast<py::ssize_t>(outline.cells.size()), py::ssize_t{2}});
  auto at = positions.mutable_unchecked<2>();
  for (py::ssize_t i = 0; i < at.shape(0); ++i)
    for (py::ssize_t k = 0; k < 2; ++k) at(i, k) = outline.cells[static_cast<std::size_t>(i)].position[k];
  return positions;
}

Numbers weights_of(const Outline& outline) {
  Numbers weights(static_cast<py::ssize_t>(outline.cells.size()));
  for (std::size_t i = 0; i < outline.cells.size(); ++i) weights.mutable_data()[i] = outline.cells[i].weight;
  return weights;
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

std::vector<ExtendedMotion> read_motions(const Ids& ids, const Numbers& motions) {
  if (ids.ndim() != 1 || motions.ndim() != 2 || motions.shape(0) != ids.shape(0) || motions.shape(1) != 4)
    throw bristle::Error(
        "motions: shape (n, 4) is needed for n ids: displacement x, y (m), spin (rad), normal load (N)");
  std::vector<ExtendedMotion> in(static_cast<std::size_t>(ids.shape(0)));
  for (py::ssize_t i = 0; i < ids.shape(0); ++i) {
    ExtendedMotion& motion = in[static_cast<std::size_t>(i)];
    motion.id = {ids.at(i)};
    for (py::ssize_t k = 0; k < 3; ++k) motion.displacement[k] = motions.at(i, k);
    motion.normal_load = motions.at(i, 3);
  }
  return in;
}

py::dict write_responses(const std::vector<ExtendedResponse>& responses) {
  Columns<ExtendedResponse> to(responses);
  to.add("end", &ExtendedResponse::end);
  to.add("elastic", &ExtendedResponse::elastic);
  to.add("damper", &ExtendedResponse::damper);
  to.add("mean", &ExtendedResponse::mean);
  to.add("stiffness", &ExtendedResponse::stiffness);
  to.add("damping", &ExtendedResponse::damping);
  to.add("force_limit", &ExtendedResponse::force_limit);
  to.add("torque_limit", &ExtendedResponse::torque_limit);
  to.add("dissipated", &ExtendedResponse::dissipated);
  to.add("contact_loss", &ExtendedResponse::contact_loss);
  to.add("damper_work", &ExtendedResponse::damper_work);
  return to.columns;
}

py::dict step(Patches& self, double dt, const Ids& ids, const Numbers& motions) {
  const std::vector<ExtendedMotion> in = read_motions(ids, motions);
  std::vector<ExtendedResponse> out(in.size());
  {
    const Patches::Turn turn(self);
    const WithoutLock unlocked;
    self.batch.step(dt, {in.data(), in.size()}, {out.data(), out.size()});
  }
  return write_responses(out);
}

py::dict find_force(Patches& self, double dt, const Ids& ids, const Numbers& motions) {
  const std::vector<ExtendedMotion> in = read_motions(ids, motions);
  std::vector<ExtendedResponse> out(in.size());
  {
    const Patches::Turn turn(self);
    const WithoutLock unlocked;
    for (std::size_t i = 0; i < in.size(); ++i) out[i] = self.batch.find_force(dt, in[i]);
  }
  return write_responses(out);
}

py::dict info_of(Patches& self, std::uint64_t id) {
  const Patches::Turn turn(self);
  const bristle::ExtendedInfo info = self.batch.info({id});
  py::dict result;
  result["cells"] = info.cells;
  result["scale"] = info.scale;
  result["along"] = py::make_tuple(info.along[0], info.along[1]);
  result["normal_load"] = info.normal_load;
  result["max_normal_load"] = info.max_normal_load;
  result["memory_bytes"] = info.memory_bytes;
  result["kernel"] = info.kernel;
  return result;
}

void define_outline(py::module_& module) {
  py::class_<Outline>(
      module, "Outline",
      "Outline and pressure of a patch with an extent, as cells: a place (m, from the centre) "
      "and a share of the load each. The shares sum to 1. A negative number of cells, or other "
      "numbers that cannot be, raise bristle.Error.")
      .def(py::init(&outline_of), py::arg("positions"), py::arg("weights"), "Any cells.")
      .def_static(
          "disc",
          [](double radius, const std::string& pressure, int rings, int around) {
            return Outline::disc(radius, pressure_named(pressure), rings, around);
          },
          py::arg("radius"), py::kw_only(), py::arg("pressure") = "uniform", py::arg("rings") = 3,
          py::arg("around") = 0, "Rings of cells; around = 0: three times the rings.")
      .def_static(
          "ellipse",
          [](double half_x, double half_y, const std::string& pressure, int rings, int around) {
            return Outline::ellipse(half_x, half_y, pressure_named(pressure), rings, around);
          },
          py::arg("half_x"), py::arg("half_y"), py::kw_only(), py::arg("pressure") = "uniform",
          py::arg("rings") = 3, py::arg("around") = 0, "Half axes in m.")
      .def_static(
          "rectangle",
          [](double half_x, double half_y, const std::string& pressure, int nx, int ny) {
            return Outline::rectangle(half_x, half_y, pressure_named(pressure), nx, ny);
          },
          py::arg("half_x"), py::arg("half_y"), py::kw_only(), py::arg("pressure") = "uniform",
          py::arg("nx") = 5, py::arg("ny") = 5, "Half sides in m; hertz: a cylinder that lies along y.")
      .def_readwrite("full_size_load", &Outline::full_size_load,
                     "N: the load at which the outline has its size, which grows with the cube root of the "
                     "load; 0 = fixed.")
      .def_property_readonly("positions", &positions_of, "Of the cells, m: shape (n, 2), a copy.")
      .def_property_readonly("weights", &weights_of, "Shares of the load, a copy.")
      .def("__len__", [](const Outline& outline) { return outline.cells.size(); })
      .def("__reduce__", [](const Outline& outline) {
        py::dict attributes;
        attributes["full_size_load"] = outline.full_size_load;
        return py::make_tuple(py::type::of<Outline>(),
                              py::make_tuple(positions_of(outline), weights_of(outline)),
                              py::make_tuple(py::none(), attributes));
      });
}

}  // namespace

void define_extended(py::module_& module) {
  define_outline(module);
  using bristle::Material;
  using bristle::PatchOptions;
  py::class_<Patches> type(
      module, "ExtendedPatches",
      "Contact patches with an extent: they resist spin, and slide easier while they spin. "
      "Named by ids (int), stepped together. Axes are those of the surface; the outline turns "
      "in them. step and find_force let go of the interpreter's lock.");
  type.def(py::init([](int threads, const char* isa) {
             return std::make_unique<Patches>(bristle::BatchOptions{}.with_threads(threads).with_isa(isa));
           }),
           py::kw_only(), py::arg("threads") = 1, py::arg("isa") = py::none(), "As PatchBatch.")
      .def(
          "add",
          [](Patches& self, const Material& material, const Outline& outline, const PatchOptions& options) {
            const Patches::Turn turn(self);
            return self.batch.add(material, options, outline).value;
          },
          py::arg("material"), py::arg("outline"), py::arg("options") = PatchOptions{},
          "A new patch, out of contact: its id. Raises bristle.Error.")
      .def(
          "remove",
          [](Patches& self, std::uint64_t id) {
            const Patches::Turn turn(self);
            self.batch.remove({id});
          },
          py::arg("id"), "Raises bristle.Error when there is no such patch.")
      .def(
          "set_material",
          [](Patches& self, std::uint64_t id, const Material& material) {
            const Patches::Turn turn(self);
            self.batch.set_material({id}, material);
          },
          py::arg("id"), py::arg("material"), "From the next step on; deflections stay.")
      .def(
          "set_scale",
          [](Patches& self, std::uint64_t id, double scale) {
            const Patches::Turn turn(self);
            if (!self.batch.set_scale({id}, scale))
              throw bristle::Error("ExtendedPatches: scale = " + std::to_string(scale) + " of id " +
                                   std::to_string(id) + "; allowed is 0 to 1e6, of a patch that is there");
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
      .def("info", &info_of, py::arg("id"), "A dict with the fields of ExtendedInfo.")
      .def(
          "stored_energy",
          [](Patches& self, std::uint64_t id) {
            const Patches::Turn turn(self);
            return self.batch.stored_energy({id});
          },
          py::arg("id"), "J.");
  define_state(
      type, "id", [](std::uint64_t id) { return bristle::PatchId{id}; },
      [](const PatchesOfOwn& patches) { return patches.patch_count(); });
}

}  // namespace bristle_python
