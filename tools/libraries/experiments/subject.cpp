#include "tools/libraries/experiments/subject.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "tools/libraries/experiments/experiment.hpp"
#include "tools/libraries/scene/snap_law.hpp"

namespace cli {
namespace {

constexpr std::array<std::string_view, 14> names = {
    "coulomb",      "dahl",       "lugre",        "elasto_plastic",  "maxwell_slip",
    "gms",          "rate_state", "brush_redraw", "brush_keep",      "brush_infinite",
    "brush_rubbed", "brush_aged", "brush_slide",  "brush_slide_drop"};

// Returns the damping of the paper's eq. 5; for the ageing brush times `aged_damper`. Damped friction rises
// up to the Stribeck velocity, where that of ageing bristles must fall.
double damping_of(std::string_view model, const Settings& settings) {
  return settings.number("damping") * (model == "brush_aged" ? settings.number("aged_damper") : 1.0);
}

bristle::SnapLength snap_length(const Settings& settings, double mean_m) {
  using bristle::SnapLaw;
  const std::string& law = settings.text("law");
  const SnapLaw family = law == "single"        ? SnapLaw::single
                         : law == "exponential" ? SnapLaw::exponential
                         : law == "lognormal"   ? SnapLaw::lognormal
                                                : SnapLaw::uniform;
  return make_snap_length(family, mean_m, settings.number("cv"));
}

rivals::Rival make_rival(std::string_view model, const Settings& settings) {
  rivals::Rival rival = rivals::make_rival(model, rival_surface(settings));
  if (auto* coulomb = std::get_if<rivals::Coulomb>(&rival)) {
    coulomb->creep_velocity = settings.number("creep_velocity");
  } else if (auto* plastic = std::get_if<rivals::ElastoPlastic>(&rival)) {
    plastic->elastic_share = settings.number("elastic_share");
  } else if (auto* gms = std::get_if<rivals::GeneralisedMaxwellSlip>(&rival)) {
    gms->attraction_rate = settings.number("attraction_rate");
  } else if (auto* rate_state = std::get_if<rivals::RateState>(&rival)) {
    rate_state->direct_effect = settings.number("direct_effect");
    rate_state->state_effect = settings.number("state_effect");
    rate_state->state_length = settings.number("state_length");
    rate_state->reference_speed = settings.number("stribeck_velocity");
  }
  return rival;
}

}  // namespace

rivals::Rival rival_for(std::string_view model, const Settings& settings) {
  return make_rival(model, settings);
}

std::span<const std::string_view> model_names() { return names; }

std::string model_title(std::string_view model) {
  constexpr std::array<std::string_view, names.size()> titles = {"Coulomb",
                                                                 "Dahl",
                                                                 "LuGre",
                                                                 "elasto-plastic",
                                                                 "Maxwell-slip",
                                                                 "GMS",
                                                                 "rate and state",
                                                                 "brush, redraw",
                                                                 "brush, keep",
                                                                 "infinite brush",
                                                                 "rubbed brush (default)",
                                                                 "aged brush",
                                                                 "brush, slide",
                                                                 "brush, slide, drop"};
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i] == model) return std::string(titles[i]);
  }
  for (const Experiment& experiment : experiments())
    for (const auto& [name, title] : experiment.models)
      if (name == model) return title;
  return std::string(model);
}

bool is_brush(std::string_view model) { return model.starts_with("brush"); }

namespace {
bool slides(std::string_view model) { return model.starts_with("brush_slide"); }
constexpr double drop_of_brush = 0.2;
constexpr std::uint32_t strata_of_brush = 64;
}  // namespace

rivals::Surface rival_surface(const Settings& settings) {
  rivals::Surface s;
  s.kinetic_coefficient = settings.number("kinetic");
  s.static_coefficient = settings.number("static");
  s.stiffness = settings.number("stiffness");
  s.damping = settings.number("damping");
  s.viscous_friction = settings.number("viscous");
  s.stribeck_velocity = settings.number("stribeck_velocity");
  return s;
}

bristle::Material brush_material(std::string_view model, const Settings& settings) {
  bristle::Material material;
  const double per_newton = settings.number("bristles_per_newton");
  material.snap_rule = slides(model)           ? bristle::SnapRule::slide
                       : model == "brush_keep" ? bristle::SnapRule::keep
                                               : bristle::SnapRule::redraw;
  if (model == "brush_slide_drop") material.drop = drop_of_brush;
  const double length = settings.number("presliding");
  const bool aged = model == "brush_aged", rubbed = model == "brush_rubbed" || aged;
  const double residual = rubbed ? settings.number("residual") * length : 0.0;
  // Gives the slide rule snap lengths that are uniform from 0, as in Maxwell slip models; other brushes get
  // the law and spread of the settings.
  material.snap_length = model == "brush_slide" ? bristle::SnapLength::uniform(0.0, 2.0 * length)
                                                : snap_length(settings, length - residual);
  material.residual_length = residual;
  material.shared_renewal = rubbed ? settings.number("renewal") : 0.0;
  material.normal_stiffness = 1.0 / (per_newton * material.asperity_height_deviation);
  material.bristle_stiffness = 1.0;
  // Scales the stiffness so that the given kinetic friction holds at speeds at which no bristle ages.
  material.bristle_stiffness = settings.number("kinetic") / material.kinetic_coefficient();
  if (aged) {
    material.with_ageing(
        bristle::Ageing::logarithmic(settings.number("ageing"), settings.number("ageing_time")));
    material.with_speed_strengthening(settings.number("strengthening"),
                                      settings.number("strengthening_speed"));
  }
  material.bristle_damping = damping_of(model, settings) / (per_newton * settings.number("load"));
  material.viscous_friction = settings.number("viscous");
  material.stribeck_velocity = settings.number("stribeck_velocity");
  material.damper_decay = settings.text("decay") == "gaussian" ? bristle::DamperDecay::gaussian
                                                               : bristle::DamperDecay::exponential;
  return material;
}

bristle::PatchOptions brush_options(std::string_view model, const Settings& settings,
                                    double highest_load_over_load) {
  bristle::PatchOptions patch;
  patch.max_normal_load = settings.number("load") * highest_load_over_load;
  patch.bristles = static_cast<std::uint32_t>(
      std::clamp(std::ceil(settings.number("bristles") * highest_load_over_load), 1.0, 6e7));
  patch.axes = 2;
  patch.outputs = bristle::Outputs::mean;
  patch.precision =
      settings.text("precision") == "double" ? bristle::Precision::double_ : bristle::Precision::single;
  if (slides(model)) {
    patch.bristles = strata_of_brush;
  } else if (model != "brush_redraw" && model != "brush_keep") {
    patch.population = bristle::Population::infinite;
    patch.resolution = settings.number("resolution");
  }
  patch.seed = static_cast<std::uint32_t>(settings.number("seed"));
  return patch;
}

Subject::Subject(std::string_view model, const Settings& settings, const Options& options)
    : name_(model), load_(settings.number("load")) {
  damping_ = damping_of(model, settings) + settings.number("viscous");
  if (!is_brush(model)) {
    model_ = make_rival(model, settings);
    stiffness_ = settings.number("stiffness");
    if (model == "coulomb") {
      stiffness_ = 0.0;
      creep_damping_ = settings.number("kinetic") / settings.number("creep_velocity");
    }
    return;
  }
  if (options.joint) {
    stiffness_ = options.joint->stiffness;
    damping_ = options.joint->viscous;
    model_.emplace<Joint>(Joint{bristle::JointFriction(1, {options.joint, 1})}).move(0.0, 1.0, true);
    return;
  }
  const bristle::Material material = brush_material(model, settings);
  stiffness_ = material.bristles_in_contact(load_) * material.bristle_stiffness;
  // Adds the damping that comes from strengthening with speed, taken at zero speed, where it is highest, to
  // give an upper bound.
  damping_ += load_ * material.strengthening_damping(0.0);
  bristle::PatchOptions patch = brush_options(model, settings, options.highest_load_over_load);
  patch.axes = options.axes;
  Brush brush;
  brush.id = brush.batch.add(material, patch);
  brush.batch.warm_up();
  model_ = std::move(brush);
}

bristle::Motion Subject::Brush::motion(rivals::Pair d, double load) const {
  bristle::Motion motion;
  motion.id = id;
  motion.displacement[0] = d.x;
  motion.displacement[1] = d.y;
  motion.normal_load = load;
  return motion;
}

namespace {
rivals::Force force_of(const bristle::Response& r) { return {{r.end[0], r.end[1]}, {r.mean[0], r.mean[1]}}; }
}  // namespace

rivals::Force Subject::Joint::move(double d, double dt_s, bool keep) noexcept {
  const double there = angle + d, speed = d / dt_s;
  rivals::Force force;
  const bristle::JointInput in{{&there, 1}, {&speed, 1}, {&motor, 1}, {&outside, 1}};
  const bristle::JointOutput out{{&force.end.x, 1}, {&force.mean.x, 1}};
  keep ? batch.step(in, out) : batch.find_torque(in, out);
  if (keep) angle = there;
  return force;
}

void Subject::set_torques(double motor, double outside) noexcept {
  if (auto* joint = std::get_if<Joint>(&model_)) {
    joint->motor = motor;
    joint->outside = outside;
  }
}

rivals::Force Subject::step(rivals::Pair d, double dt_s, double load_n) {
  if (auto* rival = std::get_if<rivals::Rival>(&model_)) return rivals::step(*rival, d, dt_s, load_n);
  if (auto* joint = std::get_if<Joint>(&model_)) return joint->move(d.x, dt_s, true);
  Brush& brush = std::get<Brush>(model_);
  const bristle::Motion motion = brush.motion(d, load_n);
  bristle::Response response;
  brush.batch.step(dt_s, {&motion, 1}, {&response, 1});
  return force_of(response);
}

rivals::Force Subject::find_force(rivals::Pair d, double dt_s, double load_n) {
  if (auto* rival = std::get_if<rivals::Rival>(&model_)) return rivals::find_force(*rival, d, dt_s, load_n);
  if (auto* joint = std::get_if<Joint>(&model_)) return joint->move(d.x, dt_s, false);
  Brush& brush = std::get<Brush>(model_);
  return force_of(brush.batch.find_force(dt_s, brush.motion(d, load_n)));
}

double Subject::slope_bound(double dt_s, double load_n) const noexcept {
  const double share = is_brush(name_) ? load_n / load_ : 1.0;
  return 0.5 * share * stiffness_ + (share * damping_ + creep_damping_ * load_n) / dt_s;
}

}  // namespace cli
