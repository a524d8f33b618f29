// What the sources of the Python module share.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <bristle/bristle.hpp>

namespace bristle_python {

namespace py = pybind11;

/// Of numpy arrays over bristle::Motion and bristle::Response: the same bytes, nothing is copied.
const py::dtype& motion_dtype();
const py::dtype& response_dtype();

/// n elements of zeros, as a recarray: columns by name and by attribute, both without a copy.
py::object zeros(const py::dtype& dtype, py::ssize_t size);

void define_materials(py::module_& module);
void define_options(py::module_& module);
void define_arrays(py::module_& module);
void define_batch(py::module_& module);
void define_extended(py::module_& module);
void define_monitor(py::module_& module);
/// Scenes, fitting and experiments where the build has their libraries; else an error that says so.
void define_tools(py::module_& module);

}  // namespace bristle_python
