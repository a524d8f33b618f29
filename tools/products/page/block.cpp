#include "block.hpp"

namespace page {
namespace {

constexpr double hand_lag_s = 0.04;

}  // namespace

Block::Block() : samples_(remembered) {
  contact_.axes = 1;
  contact_.jacobian << 1.0, 0.0;
  set(settings_);
}

bristle::PatchOptions Block::patch_options(const BlockSettings& settings) const {
  bristle::PatchOptions options;
  options.with_axes(1).with_max_normal_load(settings.normal_load).with_bristles(settings.bristles);
  if (settings.infinite) options.with_population(bristle::Population::infinite);
  return options;
}

void Block::set(const BlockSettings& settings) {
  const bristle::Material material = bristle::Material::from_coefficients(settings.coefficients);
  const double kinetic = material.kinetic_coefficient() * settings.normal_load;
  const double peak = material.peak_coefficient() * settings.normal_load;
  const bool same_patch = patch_ && settings.infinite == settings_.infinite &&
                          settings.coefficients.rule == settings_.coefficients.rule &&
                          settings.bristles == settings_.bristles &&
                          settings.normal_load == settings_.normal_load;
  if (same_patch) {
    batch_.set_material(patch_, material);
  } else {
    const bristle::PatchId patch = batch_.add(material, patch_options(settings));
    if (patch_) batch_.remove(patch_);
    patch_ = patch;
  }
  batch_.warm_up();
  settings_ = settings;
  kinetic_ = kinetic;
  peak_ = peak;
  body_.mass << settings.mass;
  motion_ = {patch_, {0.0, 0.0}, settings.normal_load};
}

void Block::reset() {
  batch_.reset(patch_);
  body_.velocity.setZero();
  position_ = 0.0;
  held_ = false;
  steps_ = 0;
  response_ = {};
}

void Block::grab() {
  held_ = true;
  hand_ = wanted_ = position_;
}

void Block::step() {
  double pull = 0.0;
  if (held_) {
    const double before = hand_;
    hand_ += (wanted_ - hand_) * (step_s / (hand_lag_s + step_s));
    // Computes the force of the spring in the middle of the step, from where its ends (hand and block) are
    // then.
    pull = settings_.spring_stiffness * (0.5 * (before + hand_) - position_ - 0.5 * step_s * velocity());
  }
  const bristle::BodyVector<1> external(pull);
  bristle::predict_displacements<1>(batch_, step_s, body_, external, {&contact_, 1}, {&motion_, 1});
  batch_.step(step_s, {&motion_, 1}, {&response_, 1});
  bristle::apply_end_forces<1>(step_s, body_, external, {&contact_, 1}, {&response_, 1});
  position_ += motion_.displacement[0];
  samples_[steps_ % remembered] = {static_cast<double>(steps_) * step_s, position_, response_.end[0], pull};
  ++steps_;
}

std::size_t Block::read_bends(bristle::Span<double> bends) const {
  return batch_.read_bristles(patch_, bends, {}, {});
}

}  // namespace page
