// Binds numpy dtypes that have the fields of Motion and Response. The array classes made of them are in
// package/_arrays.py.
#include <cstddef>
#include <limits>

#include "tools/products/python/owned.hpp"

namespace bristle_python {

using bristle::Motion;
using bristle::Response;

// Makes the dtype once, at import, and never frees it. The interpreter ends before static objects are
// destroyed.
const py::dtype& motion_dtype() {
  static const py::dtype& dtype = *new py::dtype(
      py::list(py::make_tuple("id", "displacement", "normal_load", "has_velocity", "velocity")),
      py::list(py::make_tuple("u8", "(2,)f8", "f8", "?", "(2,)f8")),
      py::list(py::make_tuple(offsetof(Motion, id), offsetof(Motion, displacement),
                              offsetof(Motion, normal_load), offsetof(Motion, has_velocity),
                              offsetof(Motion, velocity))),
      sizeof(Motion));
  return dtype;
}

void refuse_overlap(const char* written, const py::array& array, const char* other,
                    const py::array& other_array) {
  const auto begin = [](const py::array& of) { return reinterpret_cast<std::uintptr_t>(of.data()); };
  const auto end = [&](const py::array& of) { return begin(of) + static_cast<std::uintptr_t>(of.nbytes()); };
  if (begin(array) < end(other_array) && begin(other_array) < end(array))
    throw bristle::Error(std::string(written) + ": the array shares memory with " + other +
                         "; a step needs arrays of their own (numpy.copy)");
}

py::array new_responses(py::ssize_t size) { return py::module_::import("bristle").attr("responses")(size); }

py::array new_motions(py::ssize_t size) {
  const py::module_ numpy = py::module_::import("numpy");
  return numpy.attr("zeros")(size, motion_dtype()).attr("view")(numpy.attr("recarray"));
}

void forget_what_was_not_asked_for(Response& response, bristle::Outputs outputs) noexcept {
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  if (!has(outputs, bristle::Outputs::mean)) response.mean[0] = response.mean[1] = none;
  if (!has(outputs, bristle::Outputs::energy))
    response.dissipated = response.contact_loss = response.damper_work = none;
}

void define_arrays(py::module_& module) {
  PYBIND11_NUMPY_DTYPE(Response, id, status, end, elastic, damper, mean, stiffness, damping, force_limit,
                       dissipated, contact_loss, damper_work, snaps);
  module.attr("motion_dtype") = motion_dtype();
  module.attr("response_dtype") = py::dtype::of<Response>();
  const py::object flags = py::module_::import("enum").attr("IntFlag");
  const py::dict values("ok"_a = 0, "unknown_id"_a = 1, "repeated_id"_a = 2, "bad_input"_a = 4,
                        "overload"_a = 8, "no_capacity"_a = 16);
  module.attr("Status") = flags("Status", values, py::arg("module") = "bristle");
}

}  // namespace bristle_python
