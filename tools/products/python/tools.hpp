// Declares what scenes, fitting and experiments share in the Python module.
#pragma once

#include <string>

#include "tools/products/python/module.hpp"

namespace bristle_python {

/// Check for Ctrl-C, which ends long work that runs without the interpreter's lock.
class InterruptCheck {
 public:
  /// Throws Python's KeyboardInterrupt if Ctrl-C was pressed. Cheap, since it takes the interpreter's lock
  /// only ten times a second.
  void operator()();

 private:
  double next_ = 0.0;  ///< time of the next check, s by the monotonic clock
};

/// Returns a command's JSON report as Python dicts and lists.
py::object report_of(const std::string& json);

void define_scenes(py::module_& module);
void define_fitting(py::module_& module);
void define_experiments(py::module_& module);
void define_sweep(py::module_& module);

}  // namespace bristle_python
