// Binds numpy dtypes that have the fields of Motion and Response. The array classes made of them are in
// package/_arrays.py.
#include <cstddef>
#include <limits>
#include <type_traits>

#include "tools/products/python/module.hpp"

namespace bristle_python {

using bristle::Motion;
using bristle::Response;

namespace {

static_assert(std::is_standard_layout_v<Motion> && std::is_trivially_copyable_v<Motion>);
static_assert(std::is_standard_layout_v<Response> && std::is_trivially_copyable_v<Response>);

class DtypeBuilder {
 public:
  DtypeBuilder& add(const char* name, const char* format, std::size_t offset) {
    names_.append(name);
    formats_.append(format);
    offsets_.append(offset);
    return *this;
  }
  py::dtype build(std::size_t size) const {
    return py::dtype(names_, formats_, offsets_, static_cast<py::ssize_t>(size));
  }

 private:
  py::list names_, formats_, offsets_;
};

}  // namespace

// Makes the dtype once, at import, and never frees it. The interpreter ends before static objects are
// destroyed.
const py::dtype& motion_dtype() {
  static const py::dtype& dtype =
      *new py::dtype(DtypeBuilder()
                         .add("id", "u8", offsetof(Motion, id))
                         .add("displacement", "(2,)f8", offsetof(Motion, displacement))
                         .add("normal_load", "f8", offsetof(Motion, normal_load))
                         .add("has_velocity", "?", offsetof(Motion, has_velocity))
                         .add("velocity", "(2,)f8", offsetof(Motion, velocity))
                         .build(sizeof(Motion)));
  return dtype;
}

const py::dtype& response_dtype() {
  static const py::dtype& dtype =
      *new py::dtype(DtypeBuilder()
                         .add("id", "u8", offsetof(Response, id))
                         .add("status", "u4", offsetof(Response, status))
                         .add("end", "(2,)f8", offsetof(Response, end))
                         .add("elastic", "(2,)f8", offsetof(Response, elastic))
                         .add("damper", "(2,)f8", offsetof(Response, damper))
                         .add("mean", "(2,)f8", offsetof(Response, mean))
                         .add("stiffness", "f8", offsetof(Response, stiffness))
                         .add("damping", "f8", offsetof(Response, damping))
                         .add("force_limit", "f8", offsetof(Response, force_limit))
                         .add("dissipated", "f8", offsetof(Response, dissipated))
                         .add("contact_loss", "f8", offsetof(Response, contact_loss))
                         .add("damper_work", "f8", offsetof(Response, damper_work))
                         .add("snaps", "u8", offsetof(Response, snaps))
                         .build(sizeof(Response)));
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
  module.attr("motion_dtype") = motion_dtype();
  module.attr("response_dtype") = response_dtype();
  const py::object flags = py::module_::import("enum").attr("IntFlag");
  py::dict values;
  values["ok"] = 0;
  values["unknown_id"] = 1;
  values["repeated_id"] = 2;
  values["bad_input"] = 4;
  values["overload"] = 8;
  values["no_capacity"] = 16;
  module.attr("Status") = flags("Status", values, py::arg("module") = "bristle");
}

}  // namespace bristle_python
