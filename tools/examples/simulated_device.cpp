#include "simulated_device.hpp"

#include <atomic>
#include <chrono>
#include <cmath>
#include <thread>

namespace device {
namespace {

constexpr double mass = 0.05;             // kg
constexpr double own_damping = 1.5;       // damping of the mechanism, N s/m
constexpr double hand_stiffness = 400.0;  // N/m
constexpr double hand_damping = 4.0;      // N s/m
constexpr int pieces = 20;                // number of integration steps in a tick of the servo loop

struct Simulation {
  double position[3] = {0.0, 0.0, 0.02}, velocity[3] = {}, force[3] = {}, reading[3] = {};
  double time = 0.0;
  void (*hand)(double, double (&)[3]) = nullptr;
  Callback callback = nullptr;
  void* user = nullptr;
  std::atomic<bool> running{false};
  std::thread servo;
  bristle::DeadlineMonitor times{tick};

  /// Integrates the motion of stylus and hand over a tick. The force set by the callback stays the same
  /// during the tick, as a device holds it.
  void move() {
    const double h = tick / pieces;
    for (int i = 0; i < pieces; ++i) {
      double wanted[3] = {0.0, 0.0, 0.02};
      if (hand != nullptr) hand(time, wanted);
      for (int a = 0; a < 3; ++a) {
        const double pull = hand_stiffness * (wanted[a] - position[a]) -
                            (hand_damping + own_damping) * velocity[a] + force[a];
        velocity[a] += h / mass * pull;
        position[a] += h * velocity[a];
      }
      time += h;
    }
  }

  void serve() {
    using Clock = std::chrono::steady_clock;
    auto next = Clock::now();
    bool more = true;
    while (running && more) {
      const double wall = times.wall_now(), cpu = times.cpu_now();
      more = callback(user) == callback_continue;
      times.record(times.wall_now() - wall, times.cpu_now() - cpu);
      move();
      next += std::chrono::microseconds(1000);
      // Continues from the present time after a delay. Catching up by a burst of ticks would not be
      // realistic.
      if (next < Clock::now()) next = Clock::now();
      std::this_thread::sleep_until(next);
    }
    running = false;
  }
};

Simulation& simulation() {
  static Simulation one;
  return one;
}

}  // namespace

void begin_frame() {
  Simulation& s = simulation();
  for (int a = 0; a < 3; ++a) s.reading[a] = encoder_count * std::round(s.position[a] / encoder_count);
}

void end_frame() {}  // place where a real device sends the force to its motors

void get_doublev(Parameter what, double* values) {
  if (what == current_position)
    for (int a = 0; a < 3; ++a) values[a] = 1e3 * simulation().reading[a];
  if (what == nominal_max_force) values[0] = 3.3;
}

void set_doublev(Parameter what, const double* values) {
  if (what == current_force)
    for (int a = 0; a < 3; ++a) simulation().force[a] = values[a];
}

void schedule_asynchronous(Callback callback, void* user) {
  simulation().callback = callback;
  simulation().user = user;
}

void start_scheduler() {
  Simulation& s = simulation();
  s.running = true;
  s.servo = std::thread([&s] { s.serve(); });
}

bool is_scheduled() { return simulation().running; }

void stop_scheduler() {
  simulation().running = false;
  if (simulation().servo.joinable()) simulation().servo.join();
}

void set_hand(void (*where)(double, double (&)[3])) { simulation().hand = where; }
double true_position(int axis) { return simulation().position[axis]; }
const bristle::DeadlineMonitor& servo_times() { return simulation().times; }

}  // namespace device
