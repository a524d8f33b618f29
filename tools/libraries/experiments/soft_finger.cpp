// Experiment on a soft finger that is dragged: its rim slips first. Also moves it in small loops, and lowers
// the load.
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>

#include <bristle/bed.hpp>
#include <bristle/extended_patches.hpp>
#include <bristle/patch_batch.hpp>

#include "tools/libraries/experiments/experiment.hpp"

namespace cli {
namespace {

constexpr double dt = 1e-3;  // time step, s; no model in this experiment depends on time

/// Function from displacement (m) and load (N) to the force against the displacement (N). `keeps`: whether it
/// changes the contact's state.
using Contact = std::function<double(double displacement, double load, bool keeps)>;

Contact make_contact(const std::string& model, const Settings& s) {
  const double friction = s.number("friction"), load = s.number("load"), path = s.number("presliding");
  if (model == "dahl") {
    return [=, force = 0.0](double d, double pressed, bool keeps) mutable {
      const double limit = friction * pressed, end = d < 0.0 ? -limit : limit;
      const double next =
          end + (force - end) * std::exp(-1.5 * friction * load / path * std::fabs(d) / limit);
      if (keeps) force = next;
      return next;
    };
  }
  if (model == "bed") {
    const auto beds = std::make_shared<bristle::BedBatch>();
    bristle::BedOptions options;
    options.max_normal_load = load;
    bristle::BedMotion m;
    m.id = beds->add(bristle::BedMaterial(friction).with_presliding(path),
                     bristle::BedShape::sphere_row(256, s.number("radius")), options);
    return [=](double d, double pressed, bool keeps) mutable {
      m.displacement[0] = d;
      m.normal_load = pressed;
      const auto r = take(*beds, m, keeps);
      return -r.force[0];
    };
  }
  const auto material = bristle::Material::from_coefficients(
      bristle::Coefficients{}.with_kinetic(friction).with_peak(1.1 * friction).with_presliding_length(path));
  const auto options = bristle::PatchOptions{}.with_max_normal_load(load);
  if (model == "patch") {
    const auto batch = std::make_shared<bristle::PatchBatch>();
    bristle::Motion m;
    m.id = batch->add(material, options);
    return [=](double d, double pressed, bool keeps) mutable {
      m.displacement[0] = d;
      m.normal_load = pressed;
      const auto r = take(*batch, m, keeps, dt);
      return -r.end[0];
    };
  }
  struct Pads {
    bristle::PatchBatch batch;
    bristle::ExtendedPatches pads{batch};
  };
  const auto outline = std::make_shared<Pads>();
  bristle::ExtendedMotion m;
  m.id = outline->pads.add(
      material, options,
      bristle::Outline::disc(s.number("radius"), bristle::Pressure::hertz).grow_with_load(load));
  return [=](double d, double pressed, bool keeps) mutable {
    m.displacement[0] = d;
    m.normal_load = pressed;
    const auto r = take(outline->pads, m, keeps, dt);
    return -r.end[0];
  };
}

/// Soft finger in contact, with its displacement (m) and the force against it (N).
struct Finger {
  Contact contact;
  double step, load;
  double x = 0.0, force = 0.0;

  void move(double d) {
    x += d;
    force = contact(d, load, true);
  }
  /// Moves the finger until the force against it is `wanted` (N), with a shortened last step. Calls `look`
  /// after each step.
  void pull_to(
      double wanted, const std::function<void()>& look = [] {}) {
    const double sign = wanted > force ? 1.0 : -1.0;
    for (int k = 0; k < 100000 && sign * (wanted - force) > 0.0; ++k) {
      double high = step;
      if (sign * (contact(sign * step, load, false) - wanted) > 0.0) {
        double low = 0.0;
        for (int i = 0; i < 50; ++i) {
          const double middle = 0.5 * (low + high);
          (sign * (contact(sign * middle, load, false) - wanted) > 0.0 ? high : low) = middle;
        }
      }
      move(sign * high);
      look();
    }
  }
};

/// Closed forms of a first pull up to the share t of sliding friction. bent(): displacement over presliding
/// length; integral(): its integral over t; loss(): energy lost in a loop to both sides, by Masing's rule,
/// over friction times presliding length.
double bent(double t) { return 1.0 - std::pow(1.0 - t, 2.0 / 3.0); }
double integral(double t) { return t - 0.6 * (1.0 - std::pow(1.0 - t, 5.0 / 3.0)); }
double loss(double t) { return 8.0 * (t * bent(t) - integral(t)) - 4.0 * t * bent(t); }

double lost_in_loop(ExperimentRun& run, Finger finger, double most, double share) {
  const double path = run.number("presliding");
  double work = 0.0;
  for (const double side : {1.0, -1.0, 1.0}) {  // after the first pull, counts the work of the loop alone
    if (side < 0.0) work = 0.0;
    double x = finger.x, force = finger.force;
    finger.pull_to(side * share * most, [&] {
      work += 0.5 * (force + finger.force) * (finger.x - x);
      x = finger.x;
      force = finger.force;
      if (share == 0.5) run.add("loop", {x / path, force / most});
    });
  }
  return work / (most * path);
}

void run_soft_finger(ExperimentRun& run) {
  const Settings& s = run.settings;
  const double load = s.number("load"), most = s.number("friction") * load, path = s.number("presliding");
  const auto make = [&] { return Finger{make_contact(run.model, s), 1e-3 * path, load}; };

  Finger pulled = make();
  double first = 0.0, half = 0.0;
  for (int k = 0; k < 1200; ++k) {
    const double before = pulled.force;
    pulled.move(pulled.step);
    const double slope = (pulled.force - before) / pulled.step;
    if (k == 0) first = slope;
    if (before < 0.5 * most) half = slope;
    if (k % 10 == 0) run.add("stiffness", {0.5 * (before + pulled.force) / most, slope / first});
  }
  const double ratio = half / first;
  run.add("rim_slips", ratio, std::fabs(ratio - std::cbrt(0.5)) < 0.02);
  run.progress(0.4);

  const double wide = lost_in_loop(run, make(), most, 0.5), narrow = lost_in_loop(run, make(), most, 0.25);
  // Takes losses below this number as rounding errors of single precision.
  const bool loses = std::min(wide, narrow) > 1e-5;
  const double power = loses ? std::log2(wide / narrow) : 0.0;
  run.add("loops_lose", power, std::fabs(power - std::log2(loss(0.5) / loss(0.25))) < 0.1);
  run.progress(0.8);

  Finger eased = make();
  eased.pull_to(0.5 * most);
  const double before = eased.x;
  for (int k = 1; k <= 20; ++k) {
    eased.load = load * (1.0 - 0.01 * k);
    eased.force = eased.contact(0.0, eased.load, true);
    eased.pull_to(0.5 * most);
  }
  const double moved = eased.x / before, theory = std::pow(0.8, 2.0 / 3.0) * bent(0.5 / 0.8) / bent(0.5);
  run.add("eased_rim_slips", moved, std::fabs(moved - theory) < 0.02);
}

}  // namespace

Experiment soft_finger_experiment() {
  return {
      "soft-finger",
      "an elastic fingertip, dragged below its friction, slips from its rim",
      "The bed slips from its rim inwards, and slips on when the finger presses less",
      {number_parameter("load", 5.0, "N", "normal load", 1e-6, 1e6),
       number_parameter("friction", 0.8, "", "coefficient", 0.01, 10.0),
       number_parameter("radius", 6e-3, "m", "of the contact", 1e-6, 1.0),
       number_parameter("presliding", 1.5e-3, "m", "displacement at which all of it slides", 1e-9, 1.0)},
      {{"rim_slips", "it slips from its rim inwards",
        "at a force T the circle that sticks has (1 - T / (mu N))^(1/3) of the radius, and the contact that "
        "share of its first stiffness (Cattaneo 1938; Mindlin 1949)",
        "stiffness at half of its friction, over the first", "", "within 0.02 of 0.794"},
       {"loops_lose", "small loops lose little",
        "friction of the rim loses nearly with the cube of the force (Mindlin et al. 1952; Johnson 1955)",
        "power of the force by which the loss grows, from a quarter to half of its friction", "",
        "within 0.1 of 3.34"},
       {"eased_rim_slips", "under a held force its rim slips on when it presses less",
        "limits fall first where they are least, and a held force moves it on (Mindlin and Deresiewicz 1953)",
        "displacement after a fifth of the load is taken away, over that before; half of its friction", "",
        "within 0.02 of 1.118"}},
      {"force_or_x", "stiffness_or_force"},
      &run_soft_finger,
      {{"dahl", "Dahl"}, {"patch", "patch, dragged"}, {"outline", "outline of patches"}, {"bed", "bed"}}};
}

}  // namespace cli
