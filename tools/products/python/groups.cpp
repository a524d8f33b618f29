// Binds groups of a PatchBatch. They read and write numpy arrays in place.
#include "tools/products/python/batch.hpp"

namespace bristle_python {

using bristle::GroupStep;
using bristle::PatchGroup;

namespace {

using Indices = py::array_t<std::uint32_t, py::array::c_style | py::array::forcecast>;

/// Splits an array of two rows, one per axis, with a number for each contact, into the rows that a step
/// takes.
template <class T>
void put_rows(bristle::Span<T> (&rows)[2], bristle::Span<T> array, std::size_t count) {
  if (array.empty()) return;
  for (std::size_t axis = 0; axis < 2; ++axis) rows[axis] = {array.data() + axis * count, count};
}

/// Moves the contacts of a group, or computes the answers to a trial motion. Returns the array `end`.
template <bool is_trial>
py::array step(Batch& self, double dt, const PatchGroup& group, const Numbers& displacement,
               const Numbers& normal_load, const std::optional<Numbers>& velocity,
               const std::optional<Indices>& which, Room end, const Room& elastic, const Room& damper,
               const Room& mean, const Room& stiffness, const Room& damping, const Room& force_limit,
               const Room& dissipated, const Room& contact_loss, const Room& damper_work, const Room& snaps,
               const Room& status) {
  const std::size_t n = group.size();
  Arrays arrays;
  GroupStep step;
  step.group = group;
  put_rows(step.displacement, numbers_in(arrays, &displacement, 2 * n, "displacement"), n);
  step.normal_load = numbers_in(arrays, &normal_load, n, "normal_load");
  put_rows(step.velocity, numbers_in(arrays, pointer(velocity), 2 * n, "velocity"), n);
  if (which) {
    step.which = bristle::Span(which->data(), static_cast<std::size_t>(which->size()));
    for (const std::uint32_t i : *step.which)
      if (i >= n) throw bristle::Error("which: the group has no contact " + std::to_string(i));
  }
  if (!end) {
    Numbers made({std::size_t{2}, n});
    std::fill_n(made.mutable_data(), 2 * n, 0.0);
    end = made;
  }
  put_rows(step.end, room_of<double>(arrays, end, 2 * n, "end"), n);
  put_rows(step.elastic, room_of<double>(arrays, elastic, 2 * n, "elastic"), n);
  put_rows(step.damper, room_of<double>(arrays, damper, 2 * n, "damper"), n);
  put_rows(step.mean, room_of<double>(arrays, mean, 2 * n, "mean"), n);
  step.stiffness = room_of<double>(arrays, stiffness, n, "stiffness");
  step.damping = room_of<double>(arrays, damping, n, "damping");
  step.force_limit = room_of<double>(arrays, force_limit, n, "force_limit");
  step.dissipated = room_of<double>(arrays, dissipated, n, "dissipated");
  step.contact_loss = room_of<double>(arrays, contact_loss, n, "contact_loss");
  step.damper_work = room_of<double>(arrays, damper_work, n, "damper_work");
  step.snaps = room_of<std::uint64_t>(arrays, snaps, n, "snaps");
  step.status = room_of<bristle::Status>(arrays, status, n, "status");
  const Batch::Turn turn(self);
  const bristle::StepReport report =
      step_columns(n, [&] { return is_trial ? self.batch.find_force(dt, step) : self.batch.step(dt, step); });
  if (has(report.status, bristle::Status::unknown_id))
    throw bristle::Error("group: it has been removed, or belongs to another batch");
  return *end;
}

}  // namespace

void define_groups(py::module_& module, py::class_<Batch>& batch) {
  py::class_<PatchGroup>(
      module, "PatchGroup",
      "Contacts that PatchBatch.add_group added together. group[i] is the id of contact i, "
      "for all methods that take one.")
      .def("__len__", &PatchGroup::size)
      .def(
          "__getitem__",
          [](const PatchGroup& group, std::size_t i) {
            if (i >= group.size()) throw py::index_error("the group has no such contact");
            return group[i].value;
          },
          py::arg("contact"))
      .def("__repr__", [](const PatchGroup& group) {
        return "<bristle.PatchGroup of " + std::to_string(group.size()) + " contacts>";
      });
  batch
      .def(
          "add_group",
          [](Batch& self, std::size_t count, const bristle::Material& material,
             const bristle::PatchOptions& options) { return self.batch.add_group(material, options, count); },
          py::arg("count"), py::arg("material"), py::arg("options") = bristle::PatchOptions{},
          "`count` contacts to be moved together by step_group, with the seeds options.seed, options.seed + "
          "1, ... and keys likewise. Raises bristle.Error.")
      .def(
          "remove_group", [](Batch& self, const PatchGroup& group) { self.batch.remove(group); },
          py::arg("group"), "Raises bristle.Error when there is no such group.")
      .def(
          "set_group_material",
          [](Batch& self, const PatchGroup& group, const bristle::Material& material) {
            self.batch.set_material(group, material);
          },
          py::arg("group"), py::arg("material"),
          "Changes the material from the next step on; deflections stay.");
  const auto define_step = [&](const char* name, const auto& function, const char* doc) {
    batch.def(name, function, py::arg("dt"), py::arg("group"), py::arg("displacement"),
              py::arg("normal_load"), py::kw_only(), optional("velocity"), optional("which"), optional("end"),
              optional("elastic"), optional("damper"), optional("mean"), optional("stiffness"),
              optional("damping"), optional("force_limit"), optional("dissipated"), optional("contact_loss"),
              optional("damper_work"), optional("snaps"), optional("status"), doc);
  };
  define_step(
      "step_group", &step<false>,
      "Moves the contacts of a group over dt (s) by displacement (m, two rows: along x, along y) under "
      "normal_load (N). which: indices of those that move; None is all, and the numbers of others are "
      "neither read nor written. Returns the forces at the end (N, two rows). The keyword arrays are "
      "written in place: end, elastic, damper, mean (two rows), the other columns of bristle.responses, "
      "snaps (uint64), status (uint32). A step of one group is a step of the batch: time passes for "
      "all contacts that age.");
  define_step("find_group_force", &step<true>, "As step_group, without changing the state.");
}

}  // namespace bristle_python
