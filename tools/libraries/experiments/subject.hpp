// A friction model under test, a brush or a rival, behind one interface.
#pragma once

#include <string>
#include <string_view>
#include <variant>

#include <bristle/joint_friction.hpp>
#include <bristle/patch_batch.hpp>

#include "tools/libraries/experiments/settings.hpp"
#include "tools/libraries/rivals/rival.hpp"

namespace cli {

class Subject {
 public:
  struct Options {
    int axes = 1;
    /// Highest normal load of the experiment over its default load. The brush allocates bristles for it.
    double highest_load_over_load = 1.0;
    /// Material of a geared joint. If it is set, the brush is a joint, with torques in N m and angles in rad.
    const bristle::JointMaterial* joint = nullptr;
  };

  /// Makes the friction model of this name, one of model_names(). Throws bristle::Error.
  Subject(std::string_view model, const Settings& settings, const Options& options);
  Subject(std::string_view model, const Settings& settings) : Subject(model, settings, Options{}) {}

  /// Moves the body by `displacement` (m) in dt_s at constant velocity. Returns the friction force on it, N.
  rivals::Force step(rivals::Pair displacement, double dt_s, double load_n);
  /// Returns the force that step() with these arguments would give, without changing the model.
  rivals::Force find_force(rivals::Pair displacement, double dt_s, double load_n);

  /// Sets the torques (N m) of motor and load in a joint's next steps. No effect on other contacts.
  void set_torques(double motor, double outside) noexcept;

  const std::string& name() const noexcept { return name_; }
  /// Returns an upper bound of the stiffness, -d(mean force)/d(displacement), N/m, for solvers: half the
  /// contact's stiffness, plus damping over the time step.
  double slope_bound(double dt_s, double load_n) const noexcept;

 private:
  struct Brush {
    bristle::PatchBatch batch;
    bristle::PatchId id;
    bristle::Motion motion(rivals::Pair d, double load) const;
  };

  struct Joint {
    bristle::JointFriction batch;
    double angle = 0.0, motor = 0.0, outside = 0.0;
    rivals::Force move(double d, double dt_s, bool keep) noexcept;
  };

  std::string name_;
  std::variant<rivals::Rival, Brush, Joint> model_;
  // Stiffness (N/m) and damping (N s/m) under the load load_ (N). Those of a brush grow with the load.
  double stiffness_ = 0.0, damping_ = 0.0, load_ = 1.0;
  double creep_damping_ = 0.0;
};

bool is_brush(std::string_view model);
/// Returns the material of the brush `model` for these settings. Throws bristle::Error.
bristle::Material brush_material(std::string_view model, const Settings& settings);
/// Returns patch options for this brush on two axes. Does not check them; PatchBatch::add
/// does.
bristle::PatchOptions brush_options(std::string_view model, const Settings& settings,
                                    double highest_load_over_load = 1.0);
rivals::Surface rival_surface(const Settings& settings);
/// Returns the rival friction model of this name with these settings, at rest.
rivals::Rival rival_for(std::string_view model, const Settings& settings);

}  // namespace cli
