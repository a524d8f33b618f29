// Example of a servo loop that records how late its ticks are. Prints how many were late, and by whose fault;
// exits with 1 when the counts do not add up.
#include <chrono>
#include <cstdio>
#include <functional>
#include <thread>

#include <bristle/bristle.hpp>
#include <bristle/deadline_monitor.hpp>

// begin
using bristle::DeadlineMonitor;

DeadlineMonitor servo_loop(double period_s, int ticks, const std::function<void()>& callback) {
  DeadlineMonitor monitor(period_s, period_s);  // deadline, period
  bristle::Tick tick;
  tick.due_s = DeadlineMonitor::wall_now();
  for (int i = 0; i < ticks; ++i) {
    tick.due_s += period_s;
    std::this_thread::sleep_for(std::chrono::duration<double>(tick.due_s - DeadlineMonitor::wall_now()));
    tick.start_s = DeadlineMonitor::wall_now();
    const double cpu = DeadlineMonitor::cpu_now();
    callback();
    tick.end_s = DeadlineMonitor::wall_now();
    tick.cpu_s = DeadlineMonitor::cpu_now() - cpu;
    monitor.record_tick(tick);
  }
  return monitor;  // misses_ours(), misses_machine(), p99(), worst()
}
// end

int main() {
  const auto skin =
      bristle::Material::from_coefficients(bristle::Coefficients{}.with_kinetic(0.6).with_peak(0.7));
  bristle::PatchBatch batch;
  const bristle::Motion motion{batch.add(skin, {}), {1e-6, 0.0} /* m */, 1.0 /* N */};
  batch.warm_up();
  bristle::Response response;
  const DeadlineMonitor monitor = servo_loop(1e-3 /* s */, 1000, [&] {
    batch.step(1e-3, {&motion, 1}, {&response, 1});
  });
  const auto ours = monitor.misses_ours(), machine = monitor.misses_machine();
  std::printf("p99 %.1f us; of %d ticks late by this program %d, by the machine %d\n", 1e6 * monitor.p99(),
              static_cast<int>(monitor.count()), static_cast<int>(ours), static_cast<int>(machine));
  return monitor.count() == 1000 && monitor.misses() == ours + machine ? 0 : 1;
}
