// Example of a haptic servo callback with brush friction, written as for OpenHaptics. A simulated hand
// presses a floor at z = 0, pulls at it without sliding, slides over it, and leaves. Prints forces and the
// times of the callback; exits with 1 when a force or a position is wrong.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <thread>

#include <bristle/bristle.hpp>
#include <bristle/haptic_point.hpp>

#include "simulated_device.hpp"

namespace {

constexpr double floor_stiffness = 600.0;  // N/m
constexpr int run_ticks = 3000;

const bristle::Material fingertip = bristle::Material::from_coefficients(bristle::Coefficients{}
                                                                             .with_kinetic(0.6)
                                                                             .with_peak(0.7)
                                                                             .with_presliding_length(0.5e-3)
                                                                             .with_bristles_per_newton(300)
                                                                             .with_damping_per_newton(0.5)
                                                                             .with_stribeck_velocity(0.05));

struct Sample {
  double x, z;      // true position of the stylus, m
  double force[3];  // N
  double wall;      // N
};

/// State of the servo callback. It is allocated before the servo thread starts, because the callback must not
/// allocate.
struct Servo {
  bristle::PatchBatch batch;
  bristle::Motion motion;
  bristle::Response response;
  bristle::HapticPoint point;
  Sample samples[run_ticks];
  int tick = 0;
};

// begin callback
device::CallbackCode servo_callback(void* user) {
  Servo& servo = *static_cast<Servo*>(user);
  device::begin_frame();  // hdBeginFrame
  double mm[3];
  device::get_doublev(device::current_position, mm);  // hdGetDoublev(HD_CURRENT_POSITION)
  const Eigen::Vector3d position(1e-3 * mm[0], 1e-3 * mm[1], 1e-3 * mm[2]);
  const double wall = floor_stiffness * std::fmax(0.0, -position[2]);

  servo.point.prepare(device::tick, position, Eigen::Vector3d::UnitZ(), wall, servo.motion);
  servo.batch.step(device::tick, {&servo.motion, 1}, {&servo.response, 1});
  const Eigen::Vector3d force = servo.point.finish(servo.response);

  device::set_doublev(device::current_force, force.data());  // hdSetDoublev(HD_CURRENT_FORCE)
  device::end_frame();                                       // hdEndFrame
  servo.samples[servo.tick] = {device::true_position(0),
                               device::true_position(2),
                               {force[0], force[1], force[2]},
                               servo.point.wall_force()};
  return ++servo.tick < run_ticks ? device::callback_continue : device::callback_done;
}
// end callback

/// Sets where the hand aims at time t: down within 0.3 s, at rest until 0.5 s, pulled 1 mm aside until 1 s,
/// 60 mm in the next second, back in the next (with a press too hard for the device in between), and up at
/// the end.
void hand(double t, double (&where)[3]) {
  const auto ramp = [t](double from, double to) {
    return std::fmin(1.0, std::fmax(0.0, (t - from) / (to - from)));
  };
  where[0] = 1e-3 * ramp(0.5, 0.6) + 0.06 * ramp(1.0, 2.0) - 0.03 * ramp(2.1, 2.7);
  where[1] = 0.0;
  where[2] = 0.02 - 0.026 * ramp(0.0, 0.3) - 0.02 * ramp(2.2, 2.4) + 0.06 * ramp(2.8, 3.0);
}

int complain(bool right, const char* what) {
  if (!right) std::printf("not as it should be: %s\n", what);
  return right ? 0 : 1;
}

}  // namespace

int main() {
  static Servo servo;
  double limit = 0.0;
  device::get_doublev(device::nominal_max_force, &limit);  // hdGetDoublev(HD_NOMINAL_MAX_FORCE)
  servo.point = bristle::HapticPoint(bristle::HapticOptions{}
                                         .with_force_limit(limit)
                                         .with_peak_coefficient(fingertip.peak_coefficient())
                                         .with_resolution(device::encoder_count));
  servo.motion.id = servo.batch.add(
      fingertip,
      bristle::PatchOptions{}.with_max_normal_load(limit).with_population(bristle::Population::infinite));
  servo.batch.warm_up();  // makes every allocation before the servo thread starts

  device::set_hand(&hand);
  device::schedule_asynchronous(&servo_callback, &servo);  // hdScheduleAsynchronous
  device::start_scheduler();                               // hdStartScheduler
  while (device::is_scheduled())  // hdWaitForCompletion(handle, HD_WAIT_CHECK_STATUS)
    std::this_thread::sleep_for(std::chrono::milliseconds(50));  // place where a real program draws graphics
  device::stop_scheduler();                                      // hdStopScheduler

  std::printf("  t/s    x/mm     z/mm    Fx/N    Fz/N\n");
  for (int i = 99; i < run_ticks; i += 200) {
    const Sample& s = servo.samples[i];
    std::printf("%5.2f %7.3f %8.3f %7.3f %7.3f\n", 1e-3 * (i + 1), 1e3 * s.x, 1e3 * s.z, s.force[0],
                s.force[2]);
  }
  double largest = 0.0, lean = 0.0, slip = 0.0;
  for (const Sample& s : servo.samples)
    largest = std::fmax(largest, std::hypot(s.force[0], std::hypot(s.force[1], s.force[2])));
  for (int i = 1300; i < 1900; ++i) lean -= servo.samples[i].force[0] / servo.samples[i].wall / 600;
  for (int i = 800; i < 1000; ++i)
    slip = std::fmax(slip, std::fabs(servo.samples[i].x - servo.samples[800].x));
  const bristle::DeadlineMonitor& times = device::servo_times();
  std::printf("largest force %.3f N of %.1f N; friction over wall in sliding %.3f; held still to %.2f um\n",
              largest, limit, lean, 1e6 * slip);
  std::printf("energy taken from the hand %.2f mJ\n", 1e3 * servo.point.taken());
  std::printf("callback: median %.1f us, p99 %.1f us, max %.1f us; over 1 ms: %llu, ours %llu\n",
              1e6 * times.p50(), 1e6 * times.p99(), 1e6 * times.max(),
              static_cast<unsigned long long>(times.misses()),
              static_cast<unsigned long long>(times.misses_ours()));
  return complain(largest <= limit * (1 + 1e-9), "the force is within the device's limit") +
                     complain(lean > 0.57 && lean < 0.63, "friction in sliding is 0.6 of the wall's force") +
                     complain(slip < device::encoder_count, "the pulled stylus stays where it is") +
                     complain(servo.point.taken() > 0.0, "the hand loses energy") >
                 0
             ? 1
             : 0;
}
