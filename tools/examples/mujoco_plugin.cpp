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
// The plugin's state vector holds the bristles after every step, so mj_getState, mj_setState and mj_copyData
// carry them. Force and torque sensors are computed anew with friction.
#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include <mujoco/mjplugin.h>

#include "mujoco_friction.hpp"

namespace {

using mujoco_example::BristleFriction;

constexpr const char* name = "bristle.friction";
constexpr const char* attributes[] = {
    "presliding_length", "peak_over_kinetic", "damping_per_newton", "max_normal_load", "condim", "contacts"};
constexpr double default_contacts = 64.0;

/// Returns a number from the plugin's configuration in the model, or `otherwise` if the model does not give
/// it.
double number(const mjModel& model, int instance, int attribute, double otherwise) {
  const char* const text = mj_getPluginConfig(&model, instance, attributes[attribute]);
  if (text == nullptr || *text == 0) return otherwise;  // the key is not given
  char* end = nullptr;
  const double value = std::strtod(text, &end);
  if (*end != 0)
    throw bristle::Error(std::string(attributes[attribute]) + " is \"" + text + "\": give a number");
  return value;
}

/// Returns the number of contacts for which the plugin's state vector in MuJoCo has room; 0 if it keeps no
/// bristles.
std::uint32_t contacts_in_state(const mjModel& model, int instance) {
  const double contacts = number(model, instance, 5, default_contacts);
  if (!(contacts >= 0.0 && contacts <= 65536.0))
    throw bristle::Error("contacts is " + std::to_string(contacts) + ": give 0 to 65536");
  return static_cast<std::uint32_t>(contacts);
}

/// Makes the friction of a plugin instance, at first with room for this number of contacts.
std::unique_ptr<BristleFriction> make(const mjModel& model, int instance, std::uint32_t contacts) {
  const auto get = [&](int attribute, double otherwise) {
    return number(model, instance, attribute, otherwise);
  };
  bristle::Coefficients law;
  const double over_kinetic = get(1, law.peak / law.kinetic);
  law.with_presliding_length(get(0, 20e-6))
      .with_kinetic(1.0)
      .with_peak(over_kinetic)
      .with_damping_per_newton(get(2, 0.5));
  mujoco_example::FrictionOptions options;
  options.patch.with_max_normal_load(get(3, 60.0));
  options.contacts = contacts;
  const int dim = static_cast<int>(get(4, 3.0));
  if (dim != get(4, 3.0) || (dim != 1 && dim != 3 && dim != 4))
    throw bristle::Error("condim is " + std::to_string(get(4, 3.0)) + ": give 1, 3 or 4");
  return std::make_unique<BristleFriction>(
      model,
      mujoco_example::ContactDims{std::vector<int>(static_cast<std::size_t>(model.ngeom), dim),
                                  std::vector<int>(static_cast<std::size_t>(model.npair), dim)},
      law, options);
}

void check(const mjModel& model, int instance) {
  for (int other = 0; other < model.nplugin; ++other)
    if (other != instance && model.plugin[other] == model.plugin[instance])
      throw bristle::Error("two instances: friction would act twice");
  const auto with_friction = [](int dim) { return dim != 1; };
  if (std::any_of(model.geom_condim, model.geom_condim + model.ngeom, with_friction) ||
      std::any_of(model.pair_dim, model.pair_dim + model.npair, with_friction))
    throw bristle::Error("a geom or pair has MuJoCo's own friction: give all condim 1");
}

/// Friction of one mjData, and the state vector in which MuJoCo keeps it: the number of bytes, 0 for straight
/// bristles and -1 if they had no room, and six bytes in each further number. These numbers lie between 1 and
/// 1.0625, so that none is a NaN, which would differ from its own copy.
class Instance {
 public:
  Instance(const mjModel& model, int instance) : instance_(instance) { start_anew(model); }

  void reset(const mjModel& model, mjtNum* state) {
    friction_->forget_contacts();
    written_.assign(1, 0.0);
    std::fill_n(state, model.plugin_statenum[instance_], 0.0);
  }

  BristleFriction& friction() { return *friction_; }

  /// Takes over the bristles from MuJoCo's state vector, if a program has changed it since advance() wrote
  /// it.
  void read(const mjModel& model, const mjData& data) {
    if (model.plugin_statenum[instance_] == 0) return;
    const mjtNum* const state = data.plugin_state + model.plugin_stateadr[instance_];
    if (std::memcmp(state, written_.data(), written_.size() * sizeof(mjtNum)) == 0) return;
    const double size = *state;
    written_.assign(1, size);
    if (!(size > 0.0) || size > 6.0 * (model.plugin_statenum[instance_] - 1)) {
      if (size != 0.0) warn("the state vector has no bristles: every contact starts with straight ones");
      return friction_->forget_contacts();
    }
    bytes_.resize(static_cast<std::size_t>(size));
    const std::size_t numbers = fill_up();
    used_ = std::max(used_, 1 + numbers);
    written_.assign(state, state + 1 + numbers);
    for (std::size_t k = 0; k < numbers; ++k) std::memcpy(&bytes_[6 * k], &written_[k + 1], 6);
    bytes_.resize(static_cast<std::size_t>(size));
    restore(model);
  }

  void copy(const mjModel& model, const Instance& from) {
    from.friction_->save(bytes_);
    restore(model);
    written_ = from.written_;
  }

  void compute(const mjModel& model, const mjData& data) {
    read(model, data);
    is_computed_ = true;
  }

  /// Ends a step, and writes the bristles into the state vector.
  void advance(const mjModel& model, mjData& data) {
    if (!is_computed_) warn("MuJoCo computes no passive forces, so contacts have no friction");
    is_computed_ = false;
    friction_->end_step(model, data);
    const auto room = static_cast<std::size_t>(model.plugin_statenum[instance_]);
    if (room == 0) return;
    friction_->save(bytes_);
    written_.assign(1, static_cast<double>(bytes_.size()));
    const std::size_t numbers = fill_up();
    if (1 + numbers > room) {
      written_[0] = -1.0;
      warn(
          "more contacts than the state vector has room for: mj_setState will find no bristles. Raise the "
          "key contacts");
    } else {
      written_.resize(1 + numbers, 1.0);
      for (std::size_t k = 0; k < numbers; ++k) std::memcpy(&written_[k + 1], &bytes_[6 * k], 6);
    }
    mjtNum* const state = data.plugin_state + model.plugin_stateadr[instance_];
    std::copy(written_.begin(), written_.end(), state);
    if (used_ > written_.size()) std::fill(state + written_.size(), state + used_, 0.0);
    used_ = written_.size();
  }

 private:
  /// Appends zeros until the bytes fill whole numbers, and returns how many these are.
  std::size_t fill_up() {
    const std::size_t numbers = (bytes_.size() + 5) / 6;
    bytes_.resize(6 * numbers);
    return numbers;
  }
  void start_anew(const mjModel& model) {
    const std::uint32_t most = contacts_in_state(model, instance_);
    friction_ = make(model, instance_, most == 0 ? 64 : std::min(most, std::uint32_t{4}));
  }
  void restore(const mjModel& model) {
    try {
      if (BristleFriction::capacity_of(bytes_) < friction_->points().capacity()) start_anew(model);
      friction_->restore(bytes_);
    } catch (const bristle::Error& error) {
      warn(error.what());
    }
  }
  void warn(const char* text) {
    if (!has_warned_) mju_warning("%s: %s", name, text);
    has_warned_ = true;
  }

  int instance_;
  std::unique_ptr<BristleFriction> friction_;
  std::vector<mjtNum> written_ = {0.0};
  std::size_t used_ = 0;  // length of the state vector that may differ from 0
  BristleFriction::State bytes_;
  bool is_computed_ = false, has_warned_ = false;
};

Instance& instance_of(const mjData& data, int instance) {
  return *reinterpret_cast<Instance*>(data.plugin_data[instance]);
}

/// Adds friction to MuJoCo's passive forces, and to its sensors when it asks for those. MuJoCo finds passive
/// forces before the bias and actuator forces, which the friction forecast needs, so those are computed here
/// first.
void compute(const mjModel* model, mjData* data, int instance, int capability) {
  Instance& of = instance_of(*data, instance);
  if (capability == mjPLUGIN_SENSOR) return of.friction().correct_sensors(*model, *data);
  of.compute(*model, *data);
  mj_referenceConstraint(model, data);
  mj_rne(model, data, 0, data->qfrc_bias);
  mj_fwdActuation(model, data);
  mj_fwdAcceleration(model, data);
  Eigen::Map<Eigen::VectorXd>(data->qfrc_passive, model->nv) += of.friction().find_friction(*model, *data);
}

/// Returns the length of the plugin's state vector, in MuJoCo's numbers.
int state_length(const mjModel* model, int instance) {
  try {
    const std::uint32_t contacts = contacts_in_state(*model, instance);
    if (contacts == 0) return 0;
    std::uint32_t room = 4;  // grows by doubling
    while (room < contacts) room *= 2;
    return static_cast<int>(2 + make(*model, instance, room)->largest_state() / 6);
  } catch (const std::exception&) {
    return 0;  // init() reports the error
  }
}

}  // namespace

/// Writes the force of contact `id` in the form of mj_contactForce, with the friction of the bristles.
extern "C" __attribute__((visibility("default"))) void bristle_contact_force(const mjModel* model,
                                                                             const mjData* data, int id,
                                                                             mjtNum* force) {
  mjtNum found[6] = {};
  for (int i = 0; i < model->nplugin; ++i)
    if (mjp_getPluginAtSlot(model->plugin[i])->compute == compute)
      instance_of(*data, i).friction().contact_force(*model, *data, id, found);
  std::copy_n(found, 6, force);
}

mjPLUGIN_LIB_INIT(bristle_friction) {
  mjpPlugin plugin;
  mjp_defaultPlugin(&plugin);
  plugin.name = name;
  plugin.capabilityflags = mjPLUGIN_PASSIVE | mjPLUGIN_SENSOR;
  plugin.needstage = mjSTAGE_ACC;
  plugin.nattribute = sizeof attributes / sizeof *attributes;
  plugin.attributes = attributes;
  plugin.nstate = state_length;
  plugin.nsensordata = [](const mjModel*, int, int) { return 0; };
  plugin.init = [](const mjModel* model, mjData* data, int instance) {
    try {
      check(*model, instance);
      data->plugin_data[instance] = reinterpret_cast<std::uintptr_t>(new Instance(*model, instance));
      return 0;
    } catch (const std::exception& error) {
      mju_warning("%s: %s", name, error.what());
      return -1;
    }
  };
  plugin.destroy = [](mjData* data, int instance) {
    delete &instance_of(*data, instance);
    data->plugin_data[instance] = 0;
  };
  plugin.reset = [](const mjModel* model, mjtNum* state, void* instance, int) {
    static_cast<Instance*>(instance)->reset(*model, state);
  };
  plugin.copy = [](mjData* to, const mjModel* model, const mjData* from, int instance) {
    instance_of(*to, instance).copy(*model, instance_of(*from, instance));
  };
  plugin.compute = compute;
  plugin.advance = [](const mjModel* model, mjData* data, int instance) {
    instance_of(*data, instance).advance(*model, *data);
  };
  mjp_registerPlugin(&plugin);
}
