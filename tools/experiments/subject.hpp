// A friction model under test: a rival or the brush, moved and asked in the same way.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <variant>

#include <bristle/joint_friction.hpp>
#include <bristle/patch_batch.hpp>

#include "tools/experiments/settings.hpp"
#include "tools/rivals/rival.hpp"

namespace cli {

class Subject {
 public:
  struct Options {
    int axes = 1;
    double highest_load_over_load = 1.0;            ///< the brush has room for so much
    const bristle::JointMaterial* joint = nullptr;  ///< a joint of it stands for the brush: N m and rad
  };

  /// `model` is one of model_names(). Throws bristle::Error.
  Subject(std::string_view model, const Settings& settings, const Options& options);
  Subject(std::string_view model, const Settings& settings) : Subject(model, settings, Options{}) {}

  /// Force on the moving body, N. `displacement` (m) is done in dt_s at constant velocity.
  rivals::Force step(rivals::Pair displacement, double dt_s, double load_n);
  /// Returns the force that step() would give; changes nothing.
  rivals::Force find_force(rivals::Pair displacement, double dt_s, double load_n);

  /// Torques of a joint's next steps, N m. Contacts take no notice.
  void set_torques(double motor, double outside) noexcept;

  const std::string& name() const noexcept { return name_; }
  /// At least -d(mean force)/d(displacement) of a step, but for falling branches, N/m.
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
  double stiffness_ = 0.0, damping_ = 0.0, load_ = 1.0;  // at load_; the brush's grow with the load
  double creep_damping_ = 0.0;
};

bool is_brush(std::string_view model);
/// The brush's material for these settings. Throws bristle::Error.
bristle::Material brush_material(std::string_view model, const Settings& settings);
/// Options of a patch of that brush, two axes. Throws nothing: PatchBatch::add does.
bristle::PatchOptions brush_options(std::string_view model, const Settings& settings,
                                    double highest_load_over_load = 1.0);
rivals::Surface rival_surface(const Settings& settings);
/// The rival with these settings, at rest.
rivals::Rival rival_for(std::string_view model, const Settings& settings);

}  // namespace cli
