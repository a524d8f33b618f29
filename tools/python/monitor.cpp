// DeadlineMonitor.
#include "tools/python/module.hpp"

namespace bristle_python {

void define_monitor(py::module_& module) {
  using bristle::DeadlineMonitor;
  py::class_<DeadlineMonitor>(
      module, "DeadlineMonitor",
      "Histogram of step times in constant memory; percentiles are at most 1.6 % high. Seconds.")
      .def(py::init<double>(), py::arg("deadline") = 1e-3)
      .def("record", &DeadlineMonitor::record, py::arg("wall"), py::arg("cpu") = -1.0,
           "One step: wall time and CPU time of the thread; a negative CPU time is one not measured.")
      .def("reset", &DeadlineMonitor::reset)
      .def("percentile", &DeadlineMonitor::percentile, py::arg("share"), "share in [0, 1], e.g. 0.999")
      .def_property_readonly("deadline", &DeadlineMonitor::deadline)
      .def_property_readonly("count", &DeadlineMonitor::count)
      .def_property_readonly("p50", &DeadlineMonitor::p50)
      .def_property_readonly("p99", &DeadlineMonitor::p99)
      .def_property_readonly("p999", &DeadlineMonitor::p999)
      .def_property_readonly("max", &DeadlineMonitor::max, "Exact.")
      .def_property_readonly("mean", &DeadlineMonitor::mean)
      .def_property_readonly("misses", &DeadlineMonitor::misses, "Steps over the deadline.")
      .def_property_readonly("misses_ours", &DeadlineMonitor::misses_ours, "Of these, with CPU time over it.")
      .def_property_readonly("misses_machine", &DeadlineMonitor::misses_machine, "The others.")
      .def_static("wall_now", &DeadlineMonitor::wall_now, "Monotonic clock.")
      .def_static("cpu_now", &DeadlineMonitor::cpu_now, "CPU time of the calling thread.");
}

}  // namespace bristle_python
