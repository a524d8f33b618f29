// Example of a soft fingertip on a haptic device of six degrees of freedom: a pad that grows with the load
// presses, twists and slides, and answers with force and torque. Exits with 1 when these are wrong.
#include <cmath>
#include <cstdio>

#include <bristle/bristle.hpp>
#include <bristle/contact_frame.hpp>
#include <bristle/extended_patches.hpp>

struct SoftFinger {
  static constexpr double dt = 1e-3, friction = 0.6, radius = 6e-3, full_load = 2.0;  // s, 1, m at N
  bristle::PatchBatch batch;
  bristle::ExtendedPatches pads{batch};
  bristle::ExtendedMotion motion;
  bristle::ExtendedResponse response;
  bristle::ContactFrame frame{Eigen::Vector3d::UnitZ()};  // of the surface, at rest

  SoftFinger() {
    const auto skin = bristle::Material::from_coefficients(
        bristle::Coefficients{}.with_kinetic(friction).with_peak(0.7).with_presliding_length(0.1e-3 /* m */));
    const auto options = bristle::PatchOptions{}
                             .with_max_normal_load(5.0 /* N */)
                             .with_population(bristle::Population::infinite);
    motion.id = pads.add(
        skin, options,
        bristle::Outline::disc(radius, bristle::Pressure::hertz).grow_with_load(full_load));  // 27 cells
    batch.warm_up();  // nothing allocates after this
  }

  // begin
  // The servo callback. `moved` (m) and `turned` (rad): differences of the device's poses since the last
  // tick, in the world; `load` (N): of the wall. Returns force (N) and torque (N m) for the device.
  bristle::ContactFrame::Wrench tick(const Eigen::Vector3d& moved, const Eigen::Vector3d& turned,
                                     double load) {
    const Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // the surface's normal where it is touched
    frame.carry_with_surface(normal, Eigen::Vector3d::Zero());
    frame.set_displacement(moved, turned, motion);
    motion.normal_load = load;
    pads.step(dt, {&motion, 1}, {&response, 1});
    bristle::ContactFrame::Wrench wrench = frame.spin_wrench(response.end, Eigen::Vector3d::Zero());
    wrench.head<3>() += load * normal;
    return wrench;
  }
  // end
};

int main() {
  SoftFinger finger;
  bristle::ContactFrame::Wrench last;
  const auto run = [&](const char* what, int ticks, double speed, double spin, double load) {
    for (int i = 0; i < ticks; ++i)
      last = finger.tick({speed * SoftFinger::dt, 0, 0}, {0, 0, spin * SoftFinger::dt}, load);
    std::printf("%-34s force %7.3f %6.3f N, torque %7.3f N mm, pad of %.2f mm\n", what, last[0], last[1],
                1e3 * last[5], 1e3 * SoftFinger::radius * finger.pads.info(finger.motion.id).scale);
    return bristle::ContactFrame::Wrench(last);
  };
  bool right = true;
  const auto expect = [&](double value, double expected, double share) {
    right = right && std::abs(value - expected) <= share * std::abs(expected);
  };
  constexpr double pi = 3.141592653589793, slip = SoftFinger::friction * 2.0;
  // Expected torque of a Hertz pad of radius a that spins on the spot under load N: 3 pi / 16 mu N a.
  const double spinning = 3.0 * pi / 16.0 * slip * SoftFinger::radius;

  run("pressed with 2 N", 100, 0.0, 0.0, 2.0);
  // Expects the torque of a Hertz pad that is twisted and sticks: 2/5 K a^2 per radian, K stiffness, a
  // radius.
  expect(run("twisted by half a degree", 100, 0.0, 0.087, 2.0)[5],
         -0.4 * finger.response.stiffness[0][0] * SoftFinger::radius * SoftFinger::radius * 0.0087, 0.01);
  expect(run("twisted on, the pad spins", 900, 0.0, 1.0, 2.0)[5], -spinning, 0.02);
  // Slides and spins with v = omega a, so that the centre moves as fast as the spin moves the rim. Sliding
  // then needs less force.
  const auto both = run("slides at 6 mm/s and still spins", 500, 6e-3, 1.0, 2.0);
  expect(both[0], -0.884 * slip, 0.03);
  expect(both[5], -0.2209 * slip * SoftFinger::radius, 0.05);
  const auto slides = run("slides, spins no more", 900, 6e-3, 0.0, 2.0);
  expect(slides[0], -slip, 0.01);
  right = right && std::abs(slides[5]) < 0.02 * spinning;
  // Expects a torque of 0.25 * 0.63 = 0.16 of the full one at a quarter of the load, since the pad's radius
  // is then 4^(-1/3) = 0.63 of the full one.
  run("0.5 N, slides back", 500, -6e-3, 0.0, 0.5);
  expect(run("0.5 N, spins", 900, 0.0, -1.0, 0.5)[5], spinning * std::pow(0.25, 4.0 / 3.0), 0.02);
  const auto before = last;
  const auto held = run("holds still for a second", 1000, 0.0, 0.0, 0.5);
  right = right && (held - before).norm() < 1e-12;
  run("lifted", 1, 0.0, 0.0, 0.0);
  right = right && last.norm() == 0.0;
  if (!right) std::printf("not as it should be\n");
  return right ? 0 : 1;
}
