// Shared by the sources of the Python module.
#pragma once

#include <atomic>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <bristle/bristle.hpp>

namespace bristle_python {

namespace py = pybind11;

/// Of numpy arrays over bristle::Motion and bristle::Response: the same bytes, nothing is copied.
const py::dtype& motion_dtype();
const py::dtype& response_dtype();

/// Arrays of so many: recarrays, columns by name and by attribute, both without a copy.
py::object new_motions(py::ssize_t size);
py::object new_responses(py::ssize_t size);
/// Sets outputs that the patch was not asked for to NaN, as in a new array.
void forget_what_was_not_asked_for(bristle::Response& response, bristle::Outputs outputs) noexcept;

/// For the time of a call: what only one Python thread at a time may use, as a step lets go of the
/// interpreter's lock. Throws bristle::Error with `refusal` where another thread is at it.
class OneThread {
 public:
  OneThread(std::atomic<bool>& busy, const char* refusal) : busy_(busy) {
    if (busy_.exchange(true)) throw bristle::Error(refusal);
  }
  ~OneThread() { busy_.store(false); }
  OneThread(const OneThread&) = delete;
  OneThread& operator=(const OneThread&) = delete;

 private:
  std::atomic<bool>& busy_;
};

void define_materials(py::module_& module);
void define_options(py::module_& module);
void define_arrays(py::module_& module);
void define_batch(py::module_& module);
void define_beds(py::module_& module);
void define_extended(py::module_& module);
void define_monitor(py::module_& module);
/// Scenes, fitting and experiments where the build has their libraries; else an error that says so.
void define_tools(py::module_& module);

}  // namespace bristle_python
