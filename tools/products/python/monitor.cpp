// Binds DeadlineMonitor.
#include "tools/products/python/owned.hpp"

namespace bristle_python {

using bristle::DeadlineMonitor;

namespace {

py::dict events_of(const bristle::ThreadEvents& events) {
  return py::dict("involuntary_switches"_a = events.involuntary_switches,
                  "other_switches"_a = events.other_switches, "minor_faults"_a = events.minor_faults,
                  "major_faults"_a = events.major_faults);
}

py::dict worst_of(const DeadlineMonitor& monitor) {
  const DeadlineMonitor::WorstTick worst = monitor.worst();
  return py::dict("number"_a = worst.number, "end_after_due"_a = worst.end_after_due,
                  "started_late"_a = worst.started_late, "step"_a = worst.step, "cpu"_a = worst.cpu,
                  "late"_a = worst.late, "events"_a = events_of(worst.events));
}

DeadlineMonitor snapshot_of(const DeadlineMonitor& monitor) {
  DeadlineMonitor copy;
  if (!monitor.snapshot(copy))
    throw bristle::Error("DeadlineMonitor.snapshot: the loop leaves no gap between two ticks to read in");
  return copy;
}

}  // namespace

void define_monitor(py::module_& module) {
  py::class_<DeadlineMonitor>(
      module, "DeadlineMonitor",
      "Step times and periods of a loop against its deadline, in constant memory; percentiles are at most "
      "1.6 % high. Seconds. A period of 0: ticks have none.")
      .def(py::init<double, double>(), py::arg("deadline") = 1e-3, py::arg("period") = 0.0)
      .def("record", &DeadlineMonitor::record, py::arg("wall"), py::arg("cpu") = -1.0,
           "One step that was due when it started: wall time and CPU time of the thread; a negative CPU time "
           "is one not measured.")
      .def(
          "record_tick",
          [](DeadlineMonitor& self, double due, double start, double end, double cpu) {
            self.record_tick({due, start, end, cpu});
          },
          py::arg("due"), py::arg("start"), py::arg("end"), py::arg("cpu") = -1.0,
          "One tick of a loop with a period: when it was due, started and ended (times of wall_now), and CPU "
          "time.")
      .def("record_skipped", &DeadlineMonitor::record_skipped, py::arg("ticks"),
           "Ticks of the grid that were left out; they count in the longest run.")
      .def("pause", &DeadlineMonitor::pause, "The loop paused: the time to the next tick is not a period.")
      .def("refresh_events", &DeadlineMonitor::refresh_events,
           "Events of a late tick count from here on. A microsecond, on the thread that steps.")
      .def("reset", &DeadlineMonitor::reset, "Forgets what it saw.")
      .def("snapshot", &snapshot_of, "A copy that holds all numbers of one moment. Raises bristle.Error.")
      .def("percentile", &DeadlineMonitor::percentile, py::arg("share"), "share in [0, 1], e.g. 0.999")
      .def_property_readonly("deadline", &DeadlineMonitor::deadline)
      .def_property_readonly("period", &DeadlineMonitor::period)
      .def_property_readonly("count", &DeadlineMonitor::count)
      .def_property_readonly("p50", &DeadlineMonitor::p50)
      .def_property_readonly("p99", &DeadlineMonitor::p99)
      .def_property_readonly("p999", &DeadlineMonitor::p999)
      .def_property_readonly("max", &DeadlineMonitor::max, "Exact.")
      .def_property_readonly("mean", &DeadlineMonitor::mean)
      .def_property_readonly(
          "jitter_p50", [](const DeadlineMonitor& m) { return m.period_jitter().percentile(0.5); },
          "Of |time from start to start - period|.")
      .def_property_readonly("jitter_p99",
                             [](const DeadlineMonitor& m) { return m.period_jitter().percentile(0.99); })
      .def_property_readonly(
          "jitter_max", [](const DeadlineMonitor& m) { return m.period_jitter().max(); }, "Exact.")
      .def_property_readonly("misses", &DeadlineMonitor::misses, "Steps over the deadline.")
      .def_property_readonly("misses_ours", &DeadlineMonitor::misses_ours,
                             "Of these, with CPU time over it or not measured.")
      .def_property_readonly("misses_machine", &DeadlineMonitor::misses_machine, "The others.")
      .def_property_readonly("skipped", &DeadlineMonitor::skipped, "Ticks left out.")
      .def_property_readonly("longest_run", &DeadlineMonitor::longest_run,
                             "Most ticks in a row that were late or left out.")
      .def_property_readonly(
          "late_events", [](const DeadlineMonitor& m) { return events_of(m.late_events()); },
          "What the system counted in late ticks: a dict.")
      .def_property_readonly("worst", &worst_of, "The tick that ended the longest after it was due: a dict.")
      .def_static("wall_now", &DeadlineMonitor::wall_now, "Monotonic clock.")
      .def_static("cpu_now", &DeadlineMonitor::cpu_now, "CPU time of the calling thread.");
}

}  // namespace bristle_python
