// Experiment: an elastic sphere strikes a rigid plane obliquely, or spinning: tests 4 and 5 of Chung and Ooi
// (Granular Matter 13, 2011).
#include <algorithm>
#include <cmath>

#include <bristle/bed.hpp>

#include "tools/libraries/experiments/experiment.hpp"

namespace cli {
namespace {

struct Sphere {
  std::string model;
  /// Coefficients of friction and restitution (1); normal speed of approach (m/s).
  double friction = 0.0, restitution = 1.0, approach = 0.0;
  double radius = 0.0, mass = 0.0;  ///< radius (m) and mass (kg) of the sphere

  /// Effective moduli E* and G* of the contact between sphere and plane, Pa.
  double normal_modulus = 0.0, shear_modulus = 0.0;
};

Sphere read_sphere(const std::string& model, const Settings& s) {
  Sphere sphere;
  sphere.model = model;
  sphere.friction = s.number("friction");
  sphere.restitution = s.number("restitution");
  sphere.radius = s.number("radius");
  sphere.mass = 4.0 / 3.0 * M_PI * s.number("density") * std::pow(sphere.radius, 3);
  const double poisson = s.number("poisson");
  const auto material =
      bristle::BedMaterial(1.0).with_elastic(0.5 * s.number("modulus") / (1.0 + poisson), poisson);
  sphere.normal_modulus = material.normal_modulus;
  sphere.shear_modulus = material.shear_modulus;
  return sphere;
}

/// Tangential speeds of a sphere (m/s): of its centre, and of its surface by spin. The contact slips by their
/// difference.
struct Speeds {
  double centre = 0.0, rim = 0.0;
  double slip() const { return centre - rim; }
};

/// Returns the sphere's tangential speeds after the impact. The load follows Hertz's law; in the rebound it
/// is multiplied by the square of the coefficient of restitution.
Speeds strike(const Sphere& sphere, Speeds speeds) {
  constexpr int steps = 3000;
  const double law = 4.0 / 3.0 * sphere.normal_modulus * std::sqrt(sphere.radius);
  const double deepest = std::pow(1.25 * sphere.mass * sphere.approach * sphere.approach / law, 0.4);
  const double dt = 2.95 * deepest / sphere.approach / steps;
  const double per_load = 3.5 / sphere.mass * dt;  // change of slip velocity by 1 N of friction in a step,
                                                   // m/s per N
  bristle::BedBatch beds;
  bristle::BedMotion motion;
  bristle::BedOptions options;
  options.max_normal_load = 1.001 * law * std::pow(deepest, 1.5);
  options.all_outputs = false;
  bristle::BedMaterial material(sphere.friction);
  material.normal_modulus = sphere.normal_modulus;
  material.shear_modulus = sphere.shear_modulus;
  material.radius = sphere.radius;
  motion.id = beds.add(material, bristle::BedShape::sphere_row(64), options);
  double depth = 0.0, down = sphere.approach, force = 0.0;
  while (true) {
    depth += dt * down;
    if (depth <= 0.0) return speeds;
    const double share = down < 0.0 ? sphere.restitution * sphere.restitution : 1.0;
    const double load = share * law * depth * std::sqrt(depth), limit = sphere.friction * load;
    down -= dt * load / sphere.mass;
    if (sphere.model == "coulomb") {
      force = std::clamp(-speeds.slip() / per_load, -limit, limit);
    } else if (sphere.model == "history") {
      const double spring = 2.0 * sphere.shear_modulus * std::sqrt(sphere.radius * depth);
      force = std::clamp(force - spring * dt * speeds.slip(), -limit, limit);
    } else {
      motion.displacement[0] = dt * speeds.slip();
      motion.normal_load = load;
      bristle::BedResponse out;
      beds.step({&motion, 1}, {&out, 1});
      force = out.force[0];
    }
    speeds.centre += dt * force / sphere.mass;
    speeds.rim -= 2.5 * dt * force / sphere.mass;
  }
}

void run_oblique_impact(ExperimentRun& run) {
  const Settings& s = run.settings;
  Sphere sphere = read_sphere(run.model, s);
  const double stiffness_ratio = sphere.shear_modulus / sphere.normal_modulus;
  // Scales a slip speed by friction and speed of approach, as Maw, Barber and Fawcett do. An impact that
  // begins with a scaled slip above `slides_from` slides throughout, like one of rigid bodies.
  const auto scaled = [&](double slip) {
    return stiffness_ratio * slip / (sphere.friction * sphere.approach);
  };
  const double slides_from = 7.0 * stiffness_ratio;
  double worst = 0.0, recoil = 0.0, gained = -1.0;
  const auto look = [&](const char* panel, double at, const Speeds& before) {
    const Speeds after = strike(sphere, before);
    const double sign = before.slip() < 0.0 ? -1.0 : 1.0, from = scaled(sign * before.slip());
    const double push = sphere.friction * (1.0 + sphere.restitution) * sphere.approach;
    const double ratio = after.slip() / before.slip();
    run.add(panel, {at, from, sign * scaled(after.slip()), after.centre, after.rim});
    if (from > slides_from)
      worst = std::max({worst, std::fabs(after.centre - before.centre + sign * push) / push,
                        std::fabs(after.rim - before.rim - sign * 2.5 * push) / push});
    recoil = std::min(recoil, sign * scaled(after.slip()));
    gained = std::max(gained, ratio * ratio - 1.0);
  };
  for (const double degrees : s.numbers("angles")) {
    const double angle = degrees * M_PI / 180.0;
    sphere.approach = s.number("speed") * std::cos(angle);
    look("angle", degrees, {s.number("speed") * std::sin(angle), 0.0});
  }
  sphere.approach = s.number("approach");
  for (const double spin : s.numbers("spins")) look("spin", spin, {0.0, -spin * sphere.radius});
  run.add("slides_through", 100.0 * worst, worst < 0.01);
  run.add("recoils", recoil, recoil < -1.0);
  run.add("impact_energy", 100.0 * gained, gained < 1e-3);
}

}  // namespace

Experiment oblique_impact_experiment() {
  return {
      "oblique-impact",
      "an elastic sphere that strikes a plane obliquely, or spinning",
      {number_parameter("radius", 2.5e-3, "m", "of the sphere", 1e-6, 1.0),
       number_parameter("density", 4000.0, "kg/m^3", "", 1.0, 1e5),
       number_parameter("modulus", 380e9, "Pa", "of elasticity; the plane is rigid", 1e6, 1e13),
       number_parameter("poisson", 0.23, "", "", 0.0, 0.5),
       number_parameter("friction", 0.092, "", "coefficient", 0.001, 10.0),
       number_parameter("restitution", 0.98, "", "normal", 0.1, 1.0),
       number_parameter("speed", 3.9, "m/s", "of the oblique impacts (test 4)", 1e-3, 100.0),
       list_parameter("angles", {2, 5, 8, 10, 12, 15, 18, 20, 22, 25, 28, 30, 35, 40, 50, 60, 70, 80}, "deg",
                      "from the normal", 0.1, 89.0),
       number_parameter("approach", 0.2, "m/s", "of the spheres that spin (test 5)", 1e-3, 100.0),
       list_parameter("spins", {1, 3, 5, 8, 12, 16, 20, 25, 30, 40, 60, 80}, "rad/s", "", 1e-3, 1e6)},
      {{"slides_through", "friction's impulse where the contact slides through",
        "its impulse, mu (1 + e) times the normal momentum, turns into speed and spin (Chung and Ooi 2011, "
        "equations of tests 4 and 5)",
        "largest difference of speed and spin from it, over it", "%", "below 1 %"},
       {"recoils", "the contact springs back",
        "the energy stored in it reverses the slip of middling angles (Maw, Barber and Fawcett, Wear 38, "
        "1976; measured by them in 1981)",
        "least scaled slip after the impact", "", "below -1"},
       {"impact_energy", "no impact gains energy", "elastic energy is given back once",
        "largest gain of the energy of slip", "%", "below 0.1 %"}},
      {"angle[deg]_or_spin[rad/s]", "scaled_slip_before", "scaled_slip_after", "v[m/s]", "rim[m/s]"},
      &run_oblique_impact,
      {{"coulomb", "Coulomb"}, {"history", "history spring"}, {"bed", "bed"}}};
}

}  // namespace cli
