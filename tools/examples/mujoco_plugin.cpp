// Friction of bristles as a plugin of MuJoCo 3: a program in C, C++ or Python goes on to call mj_step.
//
//   mj_loadPluginLibrary("libbristle_mujoco_plugin.so");      // or into the plugin folder of `simulate`
//
//   <extension>
//     <plugin plugin="bristle.friction"><instance name="friction">
//       <config key="presliding_length" value="20e-6"/></instance></plugin>
//   </extension>
//   <default><geom condim="1"/></default>                    <!-- MuJoCo's own friction is off -->
//
// Forces are found where MuJoCo asks for passive forces, and the patches step where it advances its state.
#include <algorithm>
#include <cstdlib>
#include <string>

#include <mujoco/mjplugin.h>

#include "mujoco_friction.hpp"

namespace {

using mujoco_example::BristleFriction;

constexpr const char* attributes[] = {
    "presliding_length", "peak_over_kinetic", "damping_per_newton", "max_normal_load", "condim", "contacts"};

/// Returns a number from the plugin configuration in the model, or `otherwise` if it is missing.
double number(const mjModel& model, int instance, const char* attribute, double otherwise) {
  const char* const text = mj_getPluginConfig(&model, instance, attribute);
  if (text == nullptr || *text == 0) return otherwise;  // the key is not given
  char* end = nullptr;
  const double value = std::strtod(text, &end);
  if (*end != 0) throw bristle::Error(std::string(attribute) + " is \"" + text + "\": give a number");
  return value;
}

BristleFriction* make(const mjModel& model, int instance) {
  for (int other = 0; other < model.nplugin; ++other)
    if (other != instance && model.plugin[other] == model.plugin[instance])
      throw bristle::Error("two instances: friction would act twice");
  const auto with_friction = [](int dim) { return dim != 1; };
  if (std::any_of(model.geom_condim, model.geom_condim + model.ngeom, with_friction) ||
      std::any_of(model.pair_dim, model.pair_dim + model.npair, with_friction))
    throw bristle::Error("a geom or pair has MuJoCo's own friction: give all condim 1");
  const auto get = [&](int attribute, double otherwise) {
    return number(model, instance, attributes[attribute], otherwise);
  };
  bristle::Coefficients law;
  const double over_kinetic = get(1, law.peak / law.kinetic);
  law.with_presliding_length(get(0, 20e-6))
      .with_kinetic(1.0)
      .with_peak(over_kinetic)
      .with_damping_per_newton(get(2, 0.5));
  mujoco_example::FrictionOptions options;
  options.patch.with_max_normal_load(get(3, 60.0));
  const int dim = static_cast<int>(get(4, 3.0));
  if (dim != get(4, 3.0) || (dim != 1 && dim != 3 && dim != 4))
    throw bristle::Error("condim is " + std::to_string(get(4, 3.0)) + ": give 1, 3 or 4");
  options.contacts = static_cast<std::uint32_t>(std::clamp(get(5, options.contacts), 1.0, 1048576.0));
  return new BristleFriction(model,
                             {std::vector<int>(static_cast<std::size_t>(model.ngeom), dim),
                              std::vector<int>(static_cast<std::size_t>(model.npair), dim)},
                             law, options);
}

BristleFriction& friction_of(const mjData& data, int instance) {
  return *reinterpret_cast<BristleFriction*>(data.plugin_data[instance]);
}

/// Adds friction to MuJoCo's passive forces. MuJoCo finds these before the bias and actuator forces, which
/// the friction forecast needs, so those are computed here first.
void add_friction(const mjModel* model, mjData* data, int instance, int /*capability*/) {
  mj_referenceConstraint(model, data);
  mj_rne(model, data, 0, data->qfrc_bias);
  mj_fwdActuation(model, data);
  mj_fwdAcceleration(model, data);
  Eigen::Map<Eigen::VectorXd>(data->qfrc_passive, model->nv) +=
      friction_of(*data, instance).find_friction(*model, *data);
}

}  // namespace

mjPLUGIN_LIB_INIT(bristle_friction) {
  mjpPlugin plugin;
  mjp_defaultPlugin(&plugin);
  plugin.name = "bristle.friction";
  plugin.capabilityflags = mjPLUGIN_PASSIVE;
  plugin.nattribute = sizeof attributes / sizeof *attributes;
  plugin.attributes = attributes;
  plugin.nstate = [](const mjModel*, int) { return 0; };
  plugin.init = [](const mjModel* model, mjData* data, int instance) {
    try {
      data->plugin_data[instance] = reinterpret_cast<std::uintptr_t>(make(*model, instance));
      return 0;
    } catch (const std::exception& error) {
      mju_warning("bristle.friction: %s", error.what());
      return -1;
    }
  };
  plugin.destroy = [](mjData* data, int instance) {
    delete &friction_of(*data, instance);
    data->plugin_data[instance] = 0;
  };
  plugin.reset = [](const mjModel*, mjtNum*, void* friction, int) {
    static_cast<BristleFriction*>(friction)->forget_contacts();
  };
  plugin.copy = [](mjData* to, const mjModel*, const mjData* from, int instance) {
    friction_of(*to, instance).restore(friction_of(*from, instance).save());
  };
  plugin.compute = add_friction;
  plugin.advance = [](const mjModel* model, mjData* data, int instance) {
    friction_of(*data, instance).end_step(*model, *data);
  };
  mjp_registerPlugin(&plugin);
}
