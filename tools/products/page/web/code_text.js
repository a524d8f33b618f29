// Writes the text of a C++ program that makes the same contact as the page's settings.
'use strict';

function codeText(s) {
  const number = (value) => String(Number(value.toPrecision(4)));
  const rule = s.contact === 'slide' ? '.with_rule(bristle::SnapRule::slide)'
    : `.with_residual_share(${number(s.residual)}).with_shared_renewal(${number(s.renewal)})`;
  const growth = s.growth > 0 ? `\n      .with_growth_per_decade(${number(s.growth)})` : '';
  const population = s.contact === 'cohorts' ? '.with_population(bristle::Population::infinite)' : `.with_bristles(${s.bristles})`;
  return `#include <bristle/bristle.hpp>
#include <cstdio>

int main() {
  const auto surfaces = bristle::Material::from_coefficients(bristle::Coefficients{}
      .with_kinetic(${number(s.kinetic)}).with_peak(${number(s.kinetic * (1 + s.peak))})
      .with_presliding_length(${number(s.length)} /* m */)
      ${rule}${growth}
      .with_damping_per_newton(${number(dampingPerNewton(s))} /* s/m */).with_stribeck_velocity(0.02 /* m/s */));

  bristle::PatchBatch batch;
  const bristle::PatchId block = batch.add(surfaces, bristle::PatchOptions{}
      .with_max_normal_load(${number(s.normalLoad)} /* N */).with_axes(1)
      ${population});
  batch.warm_up();  // allocates all memory before the loop

  for (int tick = 1; tick <= 1000; ++tick) {  // steps at 1 kHz, moving at 4 mm/s
    const bristle::Motion in{block, {4e-6, 0.0} /* m */, ${number(s.normalLoad)} /* N */};
    bristle::Response out;
    batch.step(1e-3 /* s */, {&in, 1}, {&out, 1});
    if (tick % 50 == 0) std::printf("%7.3f mm  %6.3f N\\n", 4e-3 * tick, out.end[0]);
  }
}
`;
}
