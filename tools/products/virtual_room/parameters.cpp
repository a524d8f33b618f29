#include "tools/products/virtual_room/parameters.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace room {
namespace {

using bristle::SnapRule;

// Loads (N) for which the patches of floor, walls and tool are made. Up to this load more bristles come into
// contact; a greater load only raises the force of each.
constexpr double floor_load = 2.5, wall_load = 5.0, tool_load = 10.0;
// Largest number of bristles in a patch of the walls or the roof. These are rarely touched, and more bristles
// would only take memory.
constexpr std::uint32_t most_wall_bristles = 16384;

constexpr double least_peak_over_kinetic = 1.001;

bristle::PatchOptions options_of(const Settings& s, std::size_t patch) {
  const bool floor = patch < 4, tool = patch == tool_patch;
  return bristle::PatchOptions{}
      .with_max_normal_load(floor  ? floor_load
                            : tool ? tool_load
                                   : wall_load)
      .with_bristles(bristles_of(s, patch))
      .with_population(s.infinite ? bristle::Population::infinite : bristle::Population::representatives)
      .with_lay(bristle::Lay{}.with_to_over_fro(floor ? s.nap : 1.0))
      // Asks for the output energy on the floor, because it counts the snaps that the plots show.
      .with_outputs(floor ? bristle::Outputs::energy : bristle::Outputs::end)
      .with_seed(static_cast<std::uint32_t>(patch + 1))
      .with_key(patch);
}

// Returns the surface for rival models, which have one bristle: stiffness and damping of the brush under the
// resting load of one corner of the block. There LuGre's own damper is half critical, as in its source.
rivals::Surface surface_of(const Settings& s, const bristle::Material& material) {
  const double load = 0.25 * (s.mass * gravity + s.extra_load);
  rivals::Surface surface;
  surface.kinetic_coefficient = s.kinetic;
  surface.static_coefficient = s.peak;
  surface.stiffness = std::max(material.bristles_in_contact(load) * material.bristle_stiffness, 1.0);
  surface.damping = std::sqrt(surface.stiffness * 0.25 * s.mass) + s.damping_per_newton * load;
  surface.viscous_friction = s.viscous_friction;
  surface.stribeck_velocity = std::max(s.stribeck_velocity, 1e-6);
  return surface;
}

bool same_material(const Settings& a, const Settings& b) {
  return static_cast<const SurfaceSettings&>(a) == b && a.nap == b.nap && a.pad_friction == b.pad_friction;
}

Settings with_tool_friction(const Settings& settings) {
  if (settings.pad_friction == 0.0) return settings;
  Settings s = settings;
  s.peak *= s.pad_friction / s.kinetic;
  s.kinetic = s.pad_friction;
  return s;
}

}  // namespace

std::uint32_t bristles_of(const Settings& s, std::size_t patch) noexcept {
  return patch < 4 || patch == tool_patch ? s.bristles : std::min(s.bristles, most_wall_bristles);
}

Settings checked_settings(const Settings& wanted, const Settings& before, std::string& message) {
  Settings s = wanted;
  message.clear();
  const auto say = [&](const std::string& text) {
    if (message.empty()) message = text;
  };
  for (const SettingRange& range : setting_ranges) {
    double& value = s.*range.member;
    if (!std::isfinite(value)) {
      value = before.*range.member;
      say(fmt::format("{} is not a number: {:g} stays", range.name, value));
    } else if (value < range.min || value > range.max) {
      const double given = value;
      value = std::clamp(value, range.min, range.max);
      say(fmt::format("{} {:g} is out of range: {:g} taken", range.name, given, value));
    }
  }
  if (static_cast<unsigned>(s.model) > static_cast<unsigned>(FrictionModel::coulomb)) s.model = before.model;
  if (static_cast<unsigned>(s.compare) > static_cast<unsigned>(Comparison::ratchet))
    s.compare = before.compare;
  if (s.bristles < fewest_bristles || s.bristles > most_bristles) {
    const std::uint32_t given = s.bristles;
    s.bristles = std::clamp(given, fewest_bristles, most_bristles);
    say(fmt::format("bristles {} is out of range: {} taken", given, s.bristles));
  }
  if (s.peak < least_peak_over_kinetic * s.kinetic) {
    s.peak = least_peak_over_kinetic * s.kinetic;
    if (wanted.peak < s.kinetic) say(fmt::format("peak is below kinetic: {:g} taken", s.peak));
  }
  // Keeps the choice that the user made last if two settings exclude each other (nap, snap rule).
  if (s.nap != 1.0 && s.rule != SnapRule::slide) {
    if (s.nap == before.nap) {
      s.nap = 1.0;
      say("a nap is for bristles that slide: nap 1 taken");
    } else {
      s.rule = SnapRule::slide;
      say("a nap is for bristles that slide: rule slide taken");
    }
  }
  if (s.rule != SnapRule::redraw && s.infinite) {
    if (before.infinite) {
      s.infinite = false;
      say("rules keep and slide are for a number of bristles: representatives taken");
    } else {
      s.rule = SnapRule::redraw;
      s.nap = 1.0;
      say("infinitely many bristles are replaced at each snap: rule redraw taken");
    }
  }
  if (same_material(s, before)) return s;
  try {
    (void)material_of(s);
    (void)tool_material_of(s);
  } catch (const bristle::Error& error) {
    say(error.what());
    static_cast<SurfaceSettings&>(s) = before;
    s.nap = before.nap;
    s.pad_friction = before.pad_friction;
    if (s.rule != SnapRule::redraw) s.infinite = false;
  }
  return s;
}

bristle::Material material_of(const Settings& s) {
  bristle::Coefficients surface = s;
  if (s.nap != 1.0) {
    surface.peak = surface.kinetic;
    surface.growth_per_decade = 0.0;
  }
  return bristle::Material::from_coefficients(surface);
}

bristle::Material tool_material_of(const Settings& s) { return material_of(with_tool_friction(s)); }

Parameters PatchMaker::make(const Settings& wanted, bool anew) {
  Parameters next = now_;
  next.settings = checked_settings(wanted, now_.settings, message_);
  const bool same = now_.patches[0] && same_material(next.settings, now_.settings);
  const bristle::Material material = same ? material_ : material_of(next.settings);
  const bristle::Material of_tool = same ? tool_material_ : tool_material_of(next.settings);
  next.new_patches = anew || !now_.patches[0] || next.settings.bristles != now_.settings.bristles ||
                     next.settings.infinite != now_.settings.infinite ||
                     next.settings.model != now_.settings.model || next.settings.nap != now_.settings.nap ||
                     next.settings.rule != now_.settings.rule ||
                     (next.settings.pad_radius > 0.0) != (now_.settings.pad_radius > 0.0);
  if (next.new_patches) {
    Made made = add_patches(next.settings, material, of_tool);
    old_ = std::move(made_);  // old patches stay in use if add_patches() throws
    made_ = std::move(made);
    next.patches = made_.ids;
    next.pad = made_.pad.get();
    next.pad_id = made_.pad_id;
  } else {
    for (std::size_t p = 0; p < patch_count; ++p) {
      const bristle::Material& wants = p == tool_patch ? of_tool : material;
      const bristle::Material& has = p == tool_patch ? tool_material_ : material_;
      if (wants != has && made_.ids[p]) batch_.set_material(made_.ids[p], wants);
    }
    // Changes the material of the tool's pad while the haptic thread steps it. This is safe: that thread
    // reads only constant parts of the pad (weights, ids), and a batch accepts materials from another thread.
    if (of_tool != tool_material_ && made_.pad) made_.pad->set_material(made_.pad_id, of_tool);
  }
  material_ = material;
  tool_material_ = of_tool;
  next.surface = surface_of(next.settings, material);
  next.tool_surface = surface_of(with_tool_friction(next.settings), of_tool);
  if (!same) {
    next.kinetic_coefficient = material.kinetic_coefficient();
    next.peak_coefficient = material.peak_coefficient();
  }
  next.presliding_length = material.snap_length.mean() + material.residual_length;
  next.bristle_stiffness = material.bristle_stiffness;
  next.stiffness_per_newton = material.bristle_stiffness * material.bristles_in_contact(1.0);
  return now_ = next;
}

PatchMaker::Made PatchMaker::add_patches(const Settings& settings, const bristle::Material& material,
                                         const bristle::Material& of_tool) {
  Made added;
  const bool has_pad = settings.pad_radius > 0.0;
  try {
    for (std::size_t p = 0; p < patch_count; ++p) {
      if (p == tool_patch && has_pad) continue;
      added.ids[p] = batch_.add(p == tool_patch ? of_tool : material, options_of(settings, p));
    }
    if (has_pad) {
      // Makes the tool's pad as a disc of radius 1 m. The haptic thread scales it, because the radius may
      // change while the tool presses.
      added.pad = std::make_unique<bristle::ExtendedPatches>(batch_);
      added.pad_id = added.pad->add(of_tool, options_of(settings, tool_patch),
                                    bristle::Outline::disc(1.0, bristle::Pressure::uniform, pad_rings));
    }
  } catch (...) {
    remove(added);
    throw;
  }
  return added;
}

void PatchMaker::remove(Made& made) {
  for (const bristle::PatchId& id : made.ids) {
    if (id) batch_.remove(id);
  }
  made = {};
}

void PatchMaker::remove_old() { remove(old_); }

}  // namespace room
