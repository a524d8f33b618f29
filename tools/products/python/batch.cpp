// Binds PatchBatch.
#include <memory>
#include <optional>
#include <string>

#include <pybind11/stl.h>

#include "core/c_interface/field_count.hpp"
#include "core/runtime/batch_recipe.hpp"
#include "tools/products/python/batch.hpp"

namespace bristle_python {

using bristle::Motion;
using bristle::Response;

namespace {

/// Returns a numpy array's elements as objects of T, without a copy. Throws bristle::Error, which says how to
/// make such an array, if dtype or layout differ.
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

bristle::StepReport step_arrays(Batch& self, double dt, const py::array& motions,
                                const py::array& responses) {
  const auto in = elements<const Motion>(motions, motion_dtype(), "motions", false);
  const auto out = elements<Response>(responses, response_dtype(), "responses", true);
  if (in.size() != out.size())
    throw bristle::Error("responses: as many as motions are needed: " + std::to_string(in.size()) + ", not " +
                         std::to_string(out.size()));
  const Batch::Turn turn(self);
  const py::gil_scoped_release release;
  return self.batch.step(dt, in, out);
}

Record force_of(Batch& self, std::uint64_t id) {
  const Batch::Turn turn(self);
  Response response = self.batch.force({id});
  forget_what_was_not_asked_for(response, bristle::find_outputs(self.batch, {id}));
  const py::array array = new_responses(1);
  *elements<Response>(array, response_dtype(), "responses", true).data() = response;
  return Record(array[py::int_(0)]);
}

py::dict info_of(Batch& self, std::uint64_t id) {
  const Batch::Turn turn(self);
  const bristle::PatchInfo info = self.batch.info({id});
  static_assert(bristle::detail::field_count<bristle::PatchInfo> == 10, "each field gets a key below");
  py::dict result;
  result["key"] = info.key;
  result["representatives"] = info.representatives;
  result["detail"] = info.detail;
  result["weight"] = info.weight;
  result["active"] = info.active;
  result["normal_load"] = info.normal_load;
  result["max_normal_load"] = info.max_normal_load;
  result["memory_bytes"] = info.memory_bytes;
  result["bytes_per_representative"] = info.bytes_per_representative;
  result["kernel"] = info.kernel;
  return result;
}

py::tuple read_bristles(Batch& self, std::uint64_t id) {
  const Batch::Turn turn(self);
  const std::size_t size = self.batch.info({id}).representatives;
  const auto column = [&] { return py::array_t<double>(static_cast<py::ssize_t>(size)); };
  py::array_t<double> x = column(), y = column(), delta = column();
  self.batch.read_bristles({id}, {x.mutable_data(), size}, {y.mutable_data(), size},
                           {delta.mutable_data(), size});
  return py::make_tuple(x, y, delta);
}

void reset_patches(Batch& self,
                   const py::array_t<std::uint64_t, py::array::c_style | py::array::forcecast>& ids) {
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
            return py::module_::import("bristle").attr("Status")(static_cast<std::uint32_t>(r.status));
          },
          "All responses' flags together: bristle.Status.")
      .def_readonly("patches_stepped", &StepReport::patches_stepped, "Motions that were carried out.")
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
      "go of the interpreter's lock. A batch can be copied and pickled: the other one has the same ids, and "
      "goes on with the same bits. What move() set and force() would tell is not part of it.");
  type.def(py::init([](int threads, std::optional<std::string> isa, int servo_core) {
             return std::make_unique<Batch>(ThreadsAndKernels{threads, std::move(isa), servo_core});
           }),
           py::kw_only(), py::arg("threads") = 1, py::arg("isa") = py::none(), py::arg("servo_core") = -1,
           "threads: that may step, the caller included; 0 = one per core. isa: \"scalar\", \"sse2\", ...; "
           "None = the best here. servo_core: workers keep off this core.")
      .def(
          "add",
          [](Batch& self, const Material& material, const PatchOptions& options) {
            return self.batch.add(material, options).value;
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
          "remove", [](Batch& self, std::uint64_t id) { self.batch.remove({id}); }, py::arg("id"),
          "Raises bristle.Error when there is no such patch.")
      .def(
          "set_material",
          [](Batch& self, std::uint64_t id, const Material& material) {
            self.batch.set_material({id}, material);
          },
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
            const py::gil_scoped_release release;
            self.batch.warm_up();
          },
          "Spends every allocation before the loop.")
      .def("step", &step_arrays, py::arg("dt"), py::arg("motions"), py::arg("responses"),
           "Moves patches over dt (s); responses[i] answers motions[i], in place. Arrays of bristle.motions "
           "and bristle.responses, which no other thread may touch meanwhile. Bad input sets a status, never "
           "raises.")
      .def(
          "step",
          [](Batch& self, double dt) {
            const Batch::Turn turn(self);
            const py::gil_scoped_release release;
            return self.batch.step(dt);
          },
          py::arg("dt"), "Takes what move() set; see force().")
      .def(
          "move",
          [](Batch& self, std::uint64_t id, double dx, double dy, double normal_load) {
            const Batch::Turn turn(self);
            self.batch.move({id}, dx, dy, normal_load);
          },
          py::arg("id"), py::arg("dx"), py::arg("dy"), py::arg("normal_load"),
          "Motion (m) and load (N) for the next step(dt).")
      .def("force", &force_of, py::arg("id"),
           "The response of the last step(dt): a record with the fields of bristle.responses.")
      .def(
          "find_force",
          [](Batch& self, double dt, const py::array& motions, const std::optional<py::array>& responses) {
            const auto in = elements<const Motion>(motions, motion_dtype(), "motions", false);
            const py::array array =
                responses ? *responses : new_responses(static_cast<py::ssize_t>(in.size()));
            const auto out = elements<Response>(array, response_dtype(), "responses", true);
            if (in.size() != out.size()) throw bristle::Error("responses: as many as motions are needed");
            const Batch::Turn turn(self);
            {
              const py::gil_scoped_release release;
              for (std::size_t i = 0; i < in.size(); ++i) {
                out[i] = self.batch.find_force(dt, in[i]);
                forget_what_was_not_asked_for(out[i], bristle::find_outputs(self.batch, in[i].id));
              }
            }
            return array;
          },
          py::arg("dt"), py::arg("motions"), py::arg("responses") = py::none(),
          "The responses to trial motions, each from the state as it is, which does not change.")
      .def("info", &info_of, py::arg("id"),
           "What a patch is and uses now: a dict with the fields of PatchInfo in bristle/patch.hpp. Zeros "
           "for an unknown id.")
      .def(
          "stored_energy",
          [](Batch& self, std::uint64_t id) {
            const Batch::Turn turn(self);
            return self.batch.stored_energy({id});
          },
          py::arg("id"), "Elastic energy of the bristles in contact, J.")
      .def(
          "state_hash",
          [](Batch& self, const std::optional<std::uint64_t>& id) {
            const Batch::Turn turn(self);
            return id ? self.batch.state_hash({*id}) : self.batch.state_hash();
          },
          py::arg("id") = py::none(), "Of one patch, or of all: the same on every machine.")
      .def("read_bristles", &read_bristles, py::arg("id"),
           "Deflections along x and y and snap lengths of all bristles, three arrays in m.")
      .def("save_state", &save_state, "The state of all patches as bytes.")
      .def("restore_state", &restore_state, py::arg("state"),
           "Restores what save_state gave, in a batch with the same patches. Raises bristle.Error, state "
           "unchanged, where it does not fit.")
      .def("__len__",
           [](Batch& self) {
             const Batch::Turn turn(self);
             return self.batch.patch_count();
           })
      .def_property_readonly("threads", [](const Batch& self) { return self.batch.threads(); })
      .def_property_readonly(
          "isa", [](const Batch& self) { return self.batch.isa(); }, "Instruction set in use.");
  type.def(py::pickle(&pickled, &unpickled));
}

}  // namespace bristle_python
