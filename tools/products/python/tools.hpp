// Declares what scenes, fitting and experiments share in the Python module.
#pragma once

#include <string>
#include <thread>

#include "tools/products/python/module.hpp"

namespace bristle_python {

/// Check for Ctrl-C, so that it can end long work that runs without the interpreter's lock.
class InterruptCheck {
 public:
  explicit InterruptCheck(WithoutLock& unlocked) : unlocked_(unlocked) {}
  /// Throws Python's KeyboardInterrupt if Ctrl-C was pressed. Cheap, because it takes the interpreter's lock
  /// only ten times a second. Does nothing on threads other than the one that made the check.
  void operator()();

 private:
  WithoutLock& unlocked_;
  const std::thread::id thread_ = std::this_thread::get_id();
  double next_ = 0.0;  ///< time of the next check, s by the monotonic clock
};

/// Converts a command's JSON report to Python dicts and lists.
py::object report_of(const std::string& json);

void define_scenes(py::module_& module);
void define_fitting(py::module_& module);
void define_experiments(py::module_& module);
void define_sweep(py::module_& module);

}  // namespace bristle_python
