#include "fixed_scene.hpp"

#include <bristle/bristle.hpp>
#include <cinttypes>
#include <cstdio>
#include <vector>

namespace page {
namespace {

using namespace bristle;

void add_patches(PatchBatch& batch, std::vector<Motion>& motions) {
  const Material usual = Material::from_coefficients(Coefficients{}.with_kinetic(0.4).with_peak(0.46));
  const Material aged =
      Material::from_coefficients(Coefficients{}.with_growth_per_decade(0.05).with_ageing_time(1e-2));
  const Material paper =
      Material::from_coefficients(Coefficients::paper().with_rule(SnapRule::keep).with_spread(0.5));
  const Material sliding = Material::from_coefficients(Coefficients{}.with_rule(SnapRule::slide));
  const PatchOptions brush = PatchOptions{}.with_max_normal_load(2.0).with_bristles(1500);
  const PatchOptions cohorts = PatchOptions{}.with_max_normal_load(2.0).with_population(Population::infinite);
  for (const Material& material : {usual, aged, paper, sliding}) {
    motions.push_back({batch.add(material, brush)});
    motions.push_back({batch.add(material, PatchOptions(brush).with_precision(Precision::double_))});
    motions.push_back({batch.add(material, PatchOptions(brush).with_axes(1))});
  }
  motions.push_back({batch.add(usual, cohorts)});
  motions.push_back({batch.add(aged, cohorts)});
}

/// Sets a patch's displacement in a step, in quarters of 0.1 um: to and fro along x, sideways along y, and
/// now and then a long way.
void set_motion(int tick, std::size_t patch, Motion& motion) {
  const int phase = tick % 64;
  const int along = phase < 32 ? phase : 48 - phase;
  motion.displacement[0] = 25e-9 * static_cast<double>(along + static_cast<int>(patch));
  const bool one_axis = patch < 12 && patch % 3 == 2;
  motion.displacement[1] = one_axis ? 0.0 : 25e-9 * static_cast<double>(phase % 7 - 3);
  if (tick % 100 == 99) motion.displacement[0] += 64e-6;
  motion.normal_load = 0.25 * static_cast<double>(1 + tick / 40 % 7);
}

}  // namespace

std::string fixed_scene_hash() {
  PatchBatch batch;
  std::vector<Motion> motions;
  add_patches(batch, motions);
  batch.warm_up();
  std::vector<Response> responses(motions.size());
  for (int tick = 0; tick < 400; ++tick) {
    for (std::size_t i = 0; i < motions.size(); ++i) set_motion(tick, i, motions[i]);
    batch.step(1e-3, {motions.data(), motions.size()}, {responses.data(), responses.size()});
  }
  char text[20];
  std::snprintf(text, sizeof text, "%016" PRIx64, batch.state_hash());
  return text;
}

}  // namespace page
