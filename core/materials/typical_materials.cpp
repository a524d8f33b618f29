#include "bristle/typical_materials.hpp"

#include <cstring>
#include <string>

#include "bristle/error.hpp"

namespace bristle {

namespace {

Coefficients pair(double kinetic, double peak, double presliding_length, double bristles_per_newton,
                  double damping_per_newton = 0.0) {
  return Coefficients{}
      .with_kinetic(kinetic)
      .with_peak(peak)
      .with_presliding_length(presliding_length)
      .with_bristles_per_newton(bristles_per_newton)
      .with_damping_per_newton(damping_per_newton);
}

}  // namespace

Span<const TypicalMaterial> typical_materials() {
  static constexpr const char* document = "core/guides/MATERIALS.md names the source";
  static const TypicalMaterial all[] = {
      {"steel on steel, dry", document, pair(0.3, 0.6, 10e-6, 900)},
      {"steel on steel, oiled", document, pair(0.03, 0.05, 10e-6, 900)},
      {"metal on wood", document, pair(0.3, 0.5, 50e-6, 300)},
      {"wood on wood", document, pair(0.3, 0.5, 100e-6, 300)},
      {"rubber on dry concrete", document, pair(0.7, 1.0, 1e-3, 100, 1)},
      {"rubber on wet concrete", document, pair(0.5, 0.7, 1e-3, 100, 1)},
      {"shoe on wood", document, pair(0.7, 0.9, 1e-3, 100, 1)},
      {"fingertip on glass", document, pair(0.8, 0.9, 0.8e-3, 300, 0.5)},
      {"ice on ice", document, pair(0.03, 0.06, 20e-6, 300)},
      {"steel on ice", document, pair(0.02, 0.04, 20e-6, 300)},
      {"paper on paper", document, pair(0.3, 0.4, 100e-6, 300)},
      {"PTFE on steel", document, pair(0.04, 0.04, 50e-6, 300)},
      {"room wood",
       "wood on wood, dry: 0.40; presliding enlarged to 1 mm; at rest it grows by 5 % per decade",
       pair(0.40, 0.40 * 1.15, 1e-3, 900).with_growth_per_decade(0.05).with_ageing_time(0.1)},
      {"room rubber",
       "rubber on a smooth floor: 0.90; long, damped presliding of 4 mm; at rest it grows by 6 % per decade",
       pair(0.90, 0.90 * 1.30, 4e-3, 900, 1.5)
           .with_stribeck_velocity(5e-2)
           .with_growth_per_decade(0.06)
           .with_ageing_time(0.1)},
      {"room ice", "ice near freezing: 0.03, with a film of water",
       pair(0.03, 0.03 * 1.40, 0.3e-3, 900)
           .with_viscous_friction(0.20)
           .with_stribeck_velocity(1e-2)
           .with_ageing_time(0.1)},
      {"room paper", "900 bristles that keep their snap lengths, the number of Zhang and Phillips (2004)",
       pair(0.40, 0.40 * 1.50, 2e-3, 900, 0.5)
           .with_rule(SnapRule::keep)
           .with_residual_share(0.0)
           .with_shared_renewal(0.0)
           .with_stribeck_velocity(1e-2)
           .with_ageing_time(0.1)}};
  return all;
}

Coefficients typical_coefficients(const char* name) {
  std::string names;
  for (const TypicalMaterial& typical : typical_materials()) {
    if (name != nullptr && std::strcmp(name, typical.name) == 0) return typical.coefficients;
    names.append(names.empty() ? "\"" : ", \"").append(typical.name).append("\"");
  }
  throw Error("typical_coefficients: there is no \"" + std::string(name != nullptr ? name : "") +
              "\"; the names are " + names);
}

}  // namespace bristle
