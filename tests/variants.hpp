// Patches of every kind, with a scripted motion for each, for tests of equal bits.
#pragma once

#include <cstdint>
#include <random>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "scenes.hpp"

namespace bristle_test {

struct PatchCase {
  std::string name;
  Material material;
  Material later;  ///< material that the patch gets half-way through its motion
  PatchOptions options;
};

/// Returns snap-length laws of every family, some with small and some with large spread.
inline std::vector<SnapLength> all_laws() {
  const double quantiles[] = {0.3 * dbar, 0.6 * dbar, 1.0 * dbar, 1.2 * dbar, 2.0 * dbar};
  return {SnapLength::single(dbar),
          SnapLength::uniform(0.5 * dbar, 1.5 * dbar),
          SnapLength::normal(dbar, 0.1 * dbar),
          SnapLength::lognormal(dbar, 0.3),
          SnapLength::lognormal(dbar, 1.0),
          SnapLength::exponential(dbar),
          SnapLength::table(quantiles)};
}

/// Adds patches of the infinite brush, for every combination of axes, outputs and law that it accepts.
inline void add_infinite_variants(std::vector<PatchCase>& cases) {
  for (int axes : {1, 2}) {
    for (Outputs outputs : {Outputs::end, Outputs::mean, Outputs::energy, Outputs::all}) {
      for (const SnapLength& law : all_laws()) {
        if (law.law() == bristle::SnapLaw::single) continue;
        std::ostringstream name;
        name << axes << " axes, infinite, outputs " << static_cast<int>(outputs) << ", "
             << to_string(law.law());
        const Material material = plain_material(law, SnapRule::redraw)
                                      .with_bristle_stiffness(80.0)
                                      .with_bristle_damping(0.01)
                                      .with_viscous_friction(0.3);
        const Material later = Material(material).with_bristle_stiffness(95.0).with_snap_length(
            law.law() == bristle::SnapLaw::uniform ? SnapLength::uniform(0.3 * dbar, 1.1 * dbar) : law);
        const PatchOptions options = PatchOptions{}
                                         .with_max_normal_load(2.0)
                                         .with_population(bristle::Population::infinite)
                                         .with_axes(axes)
                                         .with_outputs(outputs);
        cases.push_back({name.str(), material, later, options});
        if (law.law() != bristle::SnapLaw::lognormal) continue;
        const auto rubbed = [](Material m) {
          return m.with_residual_length(0.4 * dbar).with_shared_renewal(1.0);
        };
        cases.push_back({name.str() + ", rubbed", rubbed(material), rubbed(later), options});
        cases.push_back({name.str() + ", rubbed later", material, rubbed(material), options});
        using bristle::Ageing;
        const auto aged = [](Material m, const Ageing& ageing) { return m.with_ageing(ageing); };
        const Material skin = aged(rubbed(material), Ageing::saturating(0.4, 3e-3));
        cases.push_back({name.str() + ", ages", aged(material, Ageing::logarithmic(0.05, 1e-6)),
                         aged(later, Ageing::logarithmic(0.05, 1e-6)), options});
        cases.push_back(
            {name.str() + ", ages and is rubbed", skin, aged(skin, Ageing::logarithmic(0.1, 1e-4)), options});
        cases.push_back({name.str() + ", ages no more", skin, rubbed(material), options});
        cases.push_back({name.str() + ", ages later", rubbed(material), skin, options});
      }
    }
  }
}

/// Adds patches of representatives with rubbing (a residual length, shared renewal, or both) to `cases`, for
/// every combination of axes, rule, outputs, precision and law.
inline void add_rubbed_variants(std::vector<PatchCase>& cases, std::uint32_t bristles) {
  std::uint32_t seed = 700;
  for (int axes : {1, 2}) {
    for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
      for (Outputs outputs : {Outputs::end, Outputs::mean, Outputs::energy, Outputs::all}) {
        for (Precision precision : precisions()) {
          unsigned kind = static_cast<unsigned>(axes) + (rule == SnapRule::keep ? 1u : 0u);
          for (const SnapLength& law : all_laws()) {
            ++kind;
            const double residual = kind % 3 == 1 ? 0.0 : 0.4 * dbar;
            // Leaves out renewal for laws with bristles of almost no length, which SnapRule::keep refuses.
            const bool refused = rule == SnapRule::keep && law.survival(dbar / 64.0) < 1.0 - 1e-4;
            const double renewal = kind % 3 == 0 || refused ? 0.0 : 1.5;
            std::ostringstream name;
            name << axes << " axes, " << table_name(rule) << ", outputs " << static_cast<int>(outputs) << ", "
                 << name_of(precision) << (residual > 0.0 ? ", residual" : "")
                 << (renewal > 0.0 ? ", renewal, " : ", ") << to_string(law.law());
            const Material material = plain_material(law, rule)
                                          .with_bristle_stiffness(80.0)
                                          .with_bristle_damping(0.01)
                                          .with_residual_length(residual)
                                          .with_shared_renewal(renewal);
            const Material later = Material(material)
                                       .with_residual_length(kind % 2 ? 0.25 * dbar : 0.0)
                                       .with_shared_renewal(kind % 5 && !refused ? 0.8 : 0.0);
            const PatchOptions options = plain_options(bristles + seed % 7, axes, precision, outputs)
                                             .with_max_normal_load(2.0)
                                             .with_seed(seed);
            ++seed;
            cases.push_back({name.str(), material, later, options});
          }
        }
      }
    }
  }
  for (SnapRule rule : {SnapRule::keep, SnapRule::redraw})
    for (const bool ages : {false, true}) {
      PatchCase large = cases.back();
      large.name = std::string(ages ? "large, rubbed, ageing, " : "large, rubbed, ") + table_name(rule);
      large.options = PatchOptions(large.options).with_bristles(40000).with_outputs(Outputs::all);
      large.material = plain_material(SnapLength::lognormal(dbar, 0.4), rule)
                           .with_residual_length(0.2 * dbar)
                           .with_shared_renewal(1.0);
      if (ages) large.material.with_ageing(bristle::Ageing::saturating(0.4, 3.0 * tick));
      large.later = large.material;
      cases.push_back(large);
    }
}

/// Adds patches of ageing representatives, for every combination of axes, rule, precision and law: both
/// forms, with and without residual and shared renewal; some begin to age half-way, some stop.
inline void add_aged_variants(std::vector<PatchCase>& cases, std::uint32_t bristles) {
  std::uint32_t seed = 1300;
  for (int axes : {1, 2}) {
    for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
      for (Precision precision : precisions()) {
        for (const SnapLength& law : all_laws()) {
          const unsigned kind = seed;
          const bool refused = rule == SnapRule::keep && law.survival(dbar / 64.0) < 1.0 - 1e-4;
          const double renewal = kind % 3 != 0 || refused ? 0.0 : 1.2;
          const bristle::Ageing ageing = kind % 2 ? bristle::Ageing::logarithmic(0.1, 0.3 * tick)
                                                  : bristle::Ageing::saturating(0.7, 20.0 * tick);
          const Material plain = plain_material(law, rule)
                                     .with_bristle_stiffness(80.0)
                                     .with_residual_length(kind % 4 < 2 ? 0.3 * dbar : 0.0)
                                     .with_shared_renewal(renewal);
          const Material aged = Material(plain).with_ageing(ageing);
          const Material other = Material(plain).with_ageing(bristle::Ageing::logarithmic(0.3, 5.0 * tick));
          std::ostringstream name;
          name << axes << " axes, " << table_name(rule) << ", " << name_of(precision)
               << (renewal > 0.0 ? ", ageing, renewal, " : ", ageing, ") << to_string(law.law());
          const PatchOptions options =
              plain_options(bristles + seed % 7, axes, precision, kind % 5 ? Outputs::all : Outputs::end)
                  .with_max_normal_load(2.0)
                  .with_seed(seed);
          cases.push_back({name.str(), kind % 7 == 0 ? plain : aged,
                           kind % 11 == 0  ? plain
                           : kind % 3 == 1 ? other
                                           : aged,
                           options});
          ++seed;
        }
      }
    }
  }
  PatchCase large = cases.back();
  large.name = "large, ageing";
  large.options = PatchOptions(large.options).with_bristles(40000).with_outputs(Outputs::all);
  cases.push_back(large);
}

/// Adds bristles that slide at a limit, for every combination of axes, outputs, precision and law; some with
/// a drop of the limit in sliding, some with limits that grow at rest, some that change to these half-way.
inline void add_slide_variants(std::vector<PatchCase>& cases, std::uint32_t bristles) {
  unsigned kind = 0;
  for (int axes : {1, 2}) {
    for (Outputs outputs : {Outputs::end, Outputs::mean, Outputs::energy, Outputs::all}) {
      for (Precision precision : precisions()) {
        for (const SnapLength& law : all_laws()) {
          ++kind;
          std::ostringstream name;
          name << axes << " axes, slide, outputs " << static_cast<int>(outputs) << ", " << name_of(precision)
               << ", " << to_string(law.law());
          Material material =
              plain_material(law, SnapRule::slide).with_bristle_stiffness(80.0).with_bristle_damping(0.01);
          if (kind % 3 == 1) material.with_drop(0.2);
          if (kind % 5 == 1) material.with_ageing(bristle::Ageing::logarithmic(0.2, 0.3 * tick));
          if (kind % 5 == 3) material.with_ageing(bristle::Ageing::saturating(0.5, 20.0 * tick));
          Material later = Material(material).with_bristle_stiffness(95.0);
          if (kind % 2) later.with_drop(kind % 4 == 1 ? 0.0 : 0.1);
          if (law.law() == bristle::SnapLaw::uniform)
            later.with_snap_length(SnapLength::uniform(0.3 * dbar, 1.1 * dbar));
          const PatchOptions options = plain_options(bristles + kind % 7, axes, precision, outputs)
                                           .with_max_normal_load(2.0)
                                           .with_seed(kind);
          cases.push_back({name.str(), material, later, options});
        }
      }
    }
  }
  for (const double drop : {0.0, 0.2}) {
    PatchCase large = cases.back();
    large.name = "large, slide";
    large.material = large.later = Material(large.material).with_drop(drop);
    large.options.with_bristles(4096).with_outputs(Outputs::all);
    cases.push_back(large);
  }
}

/// Returns patches of every combination of axes, rule, outputs, precision and law; also large
/// ones, split over workers, infinite brushes, patches with rubbing (residual, renewal), and ageing ones.
inline std::vector<PatchCase> every_variant(std::uint32_t bristles) {
  std::vector<PatchCase> cases;
  std::uint32_t seed = 100;
  for (int axes : {1, 2}) {
    for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
      for (Outputs outputs : {Outputs::end, Outputs::mean, Outputs::energy, Outputs::all}) {
        for (Precision precision : precisions()) {
          for (const SnapLength& law : all_laws()) {
            std::ostringstream name;
            name << axes << " axes, " << table_name(rule) << ", outputs " << static_cast<int>(outputs) << ", "
                 << name_of(precision) << ", " << to_string(law.law());
            Material material = plain_material(law, rule)
                                    .with_bristle_stiffness(80.0)
                                    .with_bristle_damping(0.01)
                                    .with_viscous_friction(0.3);
            Material later = Material(material).with_bristle_stiffness(95.0).with_snap_length(
                law.law() == bristle::SnapLaw::uniform ? SnapLength::uniform(0.3 * dbar, 1.1 * dbar) : law);
            const PatchOptions options = plain_options(bristles + seed % 7, axes, precision, outputs)
                                             .with_max_normal_load(2.0)
                                             .with_seed(seed);
            ++seed;
            cases.push_back({name.str(), material, later, options});
          }
        }
      }
    }
  }
  for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
    PatchCase large = cases[0];
    large.name = std::string("large, ") + table_name(rule);
    large.material = plain_material(SnapLength::lognormal(dbar, 0.3), rule);
    large.later = large.material;
    large.options = PatchOptions{}
                        .with_max_normal_load(2.0)
                        .with_bristles(40000)
                        .with_outputs(Outputs::all)
                        .with_seed(seed++);
    cases.push_back(large);
  }
  add_infinite_variants(cases);
  add_rubbed_variants(cases, bristles);
  add_aged_variants(cases, bristles);
  add_slide_variants(cases, bristles);
  return cases;
}

/// Returns every_variant() with only one in `every` of the infinite brushes, which take most of the time.
inline std::vector<PatchCase> every_variant_and_few_infinite(std::uint32_t bristles, int every) {
  std::vector<PatchCase> cases;
  int infinite = 0;
  for (PatchCase& c : every_variant(bristles))
    if (c.options.population != bristle::Population::infinite || infinite++ % every == 0)
      cases.push_back(std::move(c));
  return cases;
}

/// Returns the motion of patch `p` in step `k`, a function of these alone. It sticks, creeps, slides,
/// reverses, jumps; the load varies slightly, jumps, overloads and is lost.
inline Motion scripted_motion(std::size_t p, int k, int axes) {
  std::mt19937_64 random(1000003u * p + static_cast<unsigned>(k));
  const auto flat = [&] {
    return static_cast<double>(random() >> 11) * 0x1p-53;
  };  // random numbers that do not depend on the standard library
  static constexpr double lengths[] = {0.0, 1e-3, 0.05, 0.3, 0.9, 2.5, 7.0, 30.0, 5000.0};
  Motion m;
  const double length = dbar * lengths[random() % 9] * (0.5 + flat());
  const double share = flat();
  m.displacement[0] = (random() % 3 == 0 ? -length : length) * (axes == 1 ? 1.0 : share);
  m.displacement[1] = axes == 1 ? 0.0 : length * (1.0 - share);
  const double loads[] = {0.0, 0.4 + 0.01 * flat(), 1.0, 1.0, 1.5, 1.7 * flat(), 2.0, 3.0};
  m.normal_load = loads[random() % 8];
  m.has_velocity = random() % 5 == 0;
  m.velocity[0] = 1e-3 * flat();
  m.velocity[1] = axes == 1 ? 0.0 : -1e-3 * flat();
  return m;
}

}  // namespace bristle_test
