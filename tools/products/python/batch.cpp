// Binds PatchBatch.
#include <optional>
#include <string>

#include <pybind11/stl.h>

#include "core/c_interface/field_count.hpp"
#include "core/runtime/patch_outputs.hpp"
#include "tools/products/python/batch.hpp"

namespace bristle_python {

using bristle::Motion;
using bristle::PatchBatch;
using bristle::PatchId;
using bristle::Response;

namespace {

/// Returns the elements of a numpy array as objects of T, without a copy. If dtype or layout differ, throws
/// bristle::Error, which says how to make such an array.
template <class T>
bristle::Span<T> elements(const py::array& array, const py::dtype& dtype, const char* name, bool written) {
  if (!array.dtype().equal(dtype))
    throw bristle::Error(std::string(name) + ": make it with bristle." + name +
                         "(...); its dtype is bristle." + (written ? "response" : "motion") + "_dtype");
  if (array.ndim() != 1 || (array.size() > 1 && array.strides(0) != static_cast<py::ssize_t>(sizeof(T))))
    throw bristle::Error(std::string(name) +
                         ": one dimension without gaps is needed (numpy.ascontiguousarray)");
  if (reinterpret_cast<std::uintptr_t>(array.data()) % alignof(T) != 0)
    throw bristle::Error(std::string(name) +
                         ": the array is not aligned (numpy.require(a, requirements='A'))");
  if (written && !array.writeable()) throw bristle::Error(std::string(name) + ": the array is read-only");
  return {static_cast<T*>(const_cast<void*>(array.data())), static_cast<std::size_t>(array.size())};
}

/// Motions and responses of one step, which lie in the caller's arrays.
struct Step {
  bristle::Span<const Motion> in;
  bristle::Span<Response> out;
  Step(const py::array& motions, const py::array& responses)
      : in(elements<const Motion>(motions, motion_dtype(), "motions", false)),
        out(elements<Response>(responses, py::dtype::of<Response>(), "responses", true)) {
    if (in.size() != out.size())
      throw bristle::Error("responses: as many as motions are needed: " + std::to_string(in.size()) +
                           ", not " + std::to_string(out.size()));
    refuse_overlap("responses", responses, "motions", motions);
  }
};

bristle::StepReport step_arrays(Batch& self, double dt, const py::array& motions,
                                const py::array& responses) {
  const Step step(motions, responses);
  const Batch::Turn turn(self);
  const WithoutLock unlocked;
  return self.batch.step(dt, step.in, step.out);
}

ResponseArray try_arrays(Batch& self, double dt, const py::array& motions,
                         const std::optional<py::array>& responses) {
  const py::array array = responses ? *responses : new_responses(motions.size());
  const Step step(motions, array);
  const Batch::Turn turn(self);
  {
    const WithoutLock unlocked;
    for (std::size_t i = 0; i < step.in.size(); ++i) {
      step.out[i] = self.batch.find_force(dt, step.in[i]);
      forget_what_was_not_asked_for(step.out[i], bristle::find_outputs(self.batch, step.in[i].id));
    }
  }
  return ResponseArray(array);
}

py::dict patch_info(Batch& self, PatchId id) {
  const bristle::PatchInfo info = in_turn<Batch>(&PatchBatch::info)(self, id);
  static_assert(bristle::detail::field_count<bristle::PatchInfo> == 9, "each field has a key below");
  return py::dict("key"_a = info.key, "representatives"_a = info.representatives, "weight"_a = info.weight,
                  "active"_a = info.active, "normal_load"_a = info.normal_load,
                  "max_normal_load"_a = info.max_normal_load, "memory_bytes"_a = info.memory_bytes,
                  "bytes_per_representative"_a = info.bytes_per_representative, "kernel"_a = info.kernel);
}

py::tuple read_bristles(Batch& self, PatchId id) {
  const Batch::Turn turn(self);
  const std::size_t size = self.batch.info(id).representatives;
  const auto column = [&] { return py::array_t<double>(static_cast<py::ssize_t>(size)); };
  py::array_t<double> x = column(), y = column(), delta = column();
  self.batch.read_bristles(id, {x.mutable_data(), size}, {y.mutable_data(), size},
                           {delta.mutable_data(), size});
  return py::make_tuple(x, y, delta);
}

void reset_patches(Batch& self, const Ids& ids) {
  const Batch::Turn turn(self);
  for (py::ssize_t i = 0; i < ids.size(); ++i)
    if (!self.batch.reset({ids.data()[i]}))
      throw bristle::Error("reset: there is no patch with id " + std::to_string(ids.data()[i]));
}

void define_report(py::module_& module) {
  using bristle::StepReport;
  py::class_<StepReport>(module, "StepReport", "What a step did as a whole.")
      .def_property_readonly(
          "status",
          [](const StepReport& r) {
            return StatusFlags(
                py::module_::import("bristle").attr("Status")(static_cast<std::uint32_t>(r.status)));
          },
          "All responses' flags together: bristle.Status.")
      .def_readonly("patches_stepped", &StepReport::patches_stepped, "Motions that were executed.")
      .def_readonly("tasks", &StepReport::tasks,
                    "Pieces that the step was cut into: 1 = not shared, 0 = refused.")
      .def_readonly("threads", &StepReport::threads, "Threads that took a piece of work.")
      .def_readonly("bristles_visited", &StepReport::bristles_visited, "Bristles that a kernel looked at.")
      .def("__repr__", [](const StepReport& r) {
        return "StepReport(status=" + std::to_string(static_cast<std::uint32_t>(r.status)) +
               ", patches_stepped=" + std::to_string(r.patches_stepped) +
               ", tasks=" + std::to_string(r.tasks) + ", threads=" + std::to_string(r.threads) +
               ", bristles_visited=" + std::to_string(r.bristles_visited) + ")";
      });
}

}  // namespace

void define_batch(py::module_& module) {
  define_report(module);
  using bristle::Material;
  using bristle::PatchOptions;
  py::class_<Batch> type(
      module, "PatchBatch",
      "Contact patches stepped together. Patches are named by ids (int). One thread steps and reads; "
      "another one may add, remove and change materials meanwhile: the change takes effect at the next "
      "step. A second thread that steps gets bristle.Error. step, find_force and warm_up let "
      "go of the interpreter's lock. save_state and restore_state carry on with the same bits elsewhere.");
  define_constructor(type,
                     "threads: that may step, the caller included; 0 = one per core. isa: \"scalar\", "
                     "\"sse2\", ...; None = the best here.");
  type.def(
          "add",
          [](Batch& self, const Material& material, const PatchOptions& options) {
            return self.batch.add(material, options);
          },
          py::arg("material"), py::arg("options") = PatchOptions{},
          "A new patch, out of contact, deflections zero: its id. Raises bristle.Error.")
      .def(
          "add_many",
          [](Batch& self, py::ssize_t count, const Material& material, PatchOptions options) {
            py::array_t<std::uint64_t> ids(count);
            for (py::ssize_t i = 0; i < count; ++i) {
              ids.mutable_data()[i] = self.batch.add(material, options).value;
              ++options.seed;
            }
            return ids;
          },
          py::arg("count"), py::arg("material"), py::arg("options") = PatchOptions{},
          "`count` patches with the seeds options.seed, options.seed + 1, ...: an array of ids.")
      .def(
          "remove", [](Batch& self, PatchId id) { self.batch.remove(id); }, py::arg("id"),
          "Raises bristle.Error when there is no such patch.")
      .def(
          "set_material",
          [](Batch& self, PatchId id, const Material& material) { self.batch.set_material(id, material); },
          py::arg("id"), py::arg("material"), "Changes the material from the next step on; deflections stay.")
      .def(
          "reset", &reset_patches, py::arg("ids"),
          "Returns patches (an id or an array of ids) to the state in which they were added: out of contact, "
          "deflections zero, the same seed. Raises bristle.Error where one is none; those before it are "
          "reset.")
      .def(
          "warm_up",
          [](Batch& self) {
            const Batch::Turn turn(self);
            const WithoutLock unlocked;
            self.batch.warm_up();
          },
          "Spends every allocation before the loop.")
      .def("step", &step_arrays, py::arg("dt"), py::arg("motions"), py::arg("responses"),
           "Moves patches over dt (s); responses[i] answers motions[i], in place. Arrays of bristle.motions "
           "and bristle.responses, which no other thread may touch meanwhile. Bad input sets a status, never "
           "raises.")
      .def("find_force", &try_arrays, py::arg("dt"), py::arg("motions"), optional("responses"),
           "The responses to trial motions, each from the state as it is, which does not change.")
      .def("info", &patch_info, py::arg("id"),
           "What a patch is and uses now: a dict with the fields of PatchInfo in bristle/patch.hpp. Zeros "
           "for an unknown id.")
      .def("stored_energy", in_turn<Batch>(&PatchBatch::stored_energy), py::arg("id"),
           "Elastic energy of the bristles in contact, J.")
      .def("read_bristles", &read_bristles, py::arg("id"),
           "Deflections along x and y and snap lengths of all bristles, three arrays in m.")
      .def_property_readonly("threads", [](const Batch& self) { return self.batch.threads(); })
      .def_property_readonly(
          "isa", [](const Batch& self) { return self.batch.isa(); }, "Instruction set in use.");
  define_groups(module, type);
  define_state<PatchId>(type, "id", &PatchBatch::patch_count);
}

}  // namespace bristle_python
