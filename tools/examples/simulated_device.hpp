// A haptic device that exists only in memory. Its interface has the shape of OpenHaptics' HDAPI, so that the
// callback of servo_callback.cpp reads as it would there; each function names the call that it stands for.
// Behind the interface: a stylus of 50 g held by a hand (a spring and a damper towards where the hand aims),
// three encoders, a force that is held for a tick, a servo thread at 1 kHz.
#pragma once

#include <atomic>
#include <chrono>
#include <cmath>
#include <thread>

#include <bristle/bristle.hpp>

namespace device {

enum CallbackCode { callback_done, callback_continue };  // HD_CALLBACK_DONE, HD_CALLBACK_CONTINUE
using Callback = CallbackCode (*)(void* user);           // HDSchedulerCallback

enum Parameter {
  current_position,   // position, three numbers, mm (HD_CURRENT_POSITION)
  current_force,      // force to send to the device, three numbers, N (HD_CURRENT_FORCE)
  nominal_max_force,  // HD_NOMINAL_MAX_FORCE: N
};

constexpr double encoder_count = 23e-6;  // m
constexpr double tick = 1e-3;            // s

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

inline Simulation simulation;

inline void begin_frame() {  // hdBeginFrame(hdGetCurrentDevice())
  for (int a = 0; a < 3; ++a)
    simulation.reading[a] = encoder_count * std::round(simulation.position[a] / encoder_count);
}
inline void end_frame() {}  // hdEndFrame: place where a real device sends the force to its motors

inline void get_doublev(Parameter what, double* values) {  // hdGetDoublev
  if (what == current_position)
    for (int a = 0; a < 3; ++a) values[a] = 1e3 * simulation.reading[a];
  if (what == nominal_max_force) values[0] = 3.3;
}
inline void set_doublev(Parameter what, const double* values) {  // hdSetDoublev
  if (what == current_force)
    for (int a = 0; a < 3; ++a) simulation.force[a] = values[a];
}

/// As hdScheduleAsynchronous with default priority.
inline void schedule_asynchronous(Callback callback, void* user) {
  simulation.callback = callback;
  simulation.user = user;
}
/// As hdStartScheduler: starts the servo thread.
inline void start_scheduler() {
  simulation.running = true;
  simulation.servo = std::thread([] { simulation.serve(); });
}
/// As hdWaitForCompletion(handle, HD_WAIT_CHECK_STATUS): returns whether a callback is scheduled.
inline bool is_scheduled() { return simulation.running; }
/// As hdStopScheduler: waits until the callback has ended.
inline void stop_scheduler() {
  simulation.running = false;
  if (simulation.servo.joinable()) simulation.servo.join();
}

// Functions for tests, which a real device lacks.

/// Sets where the simulated hand aims, m, at a time.
inline void set_hand(void (*where)(double time_s, double (&metres)[3])) { simulation.hand = where; }
/// Returns the position of the stylus without encoder error, m. Call it in the callback, or once the
/// scheduler has stopped.
inline double true_position(int axis) { return simulation.position[axis]; }
/// Returns the run times of the callback. Call it once the scheduler has stopped.
inline const bristle::DeadlineMonitor& servo_times() { return simulation.times; }

}  // namespace device
