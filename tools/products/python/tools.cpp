#include "tools/products/python/tools.hpp"

#include "tools/libraries/files/user_error.hpp"

namespace bristle_python {

void InterruptCheck::operator()() {
  if (std::this_thread::get_id() != thread_) return;
  const double now = bristle::DeadlineMonitor::wall_now();
  if (now < next_) return;
  next_ = now + 0.1;
  unlocked_.with_lock([] {
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  });
}

py::object report_of(const std::string& json) { return py::module_::import("json").attr("loads")(json); }

void define_tools(py::module_& module) {
  // Turns a UserError of the tools into the Python exception bristle.Error.
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      std::rethrow_exception(thrown);
    } catch (const cli::UserError& error) {
      PyErr_SetString(py::module_::import("bristle").attr("Error").ptr(), error.what());
    }
  });
  define_scenes(module);
  define_fitting(module);
  define_experiments(module);
  define_sweep(module);
}

}  // namespace bristle_python
