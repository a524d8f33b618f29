#include <memory>
#include <vector>

#include "brushes.hpp"
#include "targets.hpp"

namespace fuzz {
namespace {

using bristle::ExtendedMotion;
using bristle::ExtendedResponse;
using bristle::Outline;
using bristle::PatchId;

struct Twin {
  bristle::PatchBatch batch;
  bristle::ExtendedPatches patches;
  explicit Twin(bristle::PatchBatch its_batch) : batch(std::move(its_batch)), patches(batch) {}
};

std::vector<std::unique_ptr<Twin>> make_twins() {
  std::vector<std::unique_ptr<Twin>> twins;
  for (const bristle::IsaInfo& isa : bristle::instruction_sets())
    if (isa.usable)
      twins.push_back(
          std::make_unique<Twin>(bristle::PatchBatch(bristle::BatchOptions{}.with_isa(isa.name))));
  twins.push_back(std::make_unique<Twin>(stepped_eagerly()));
  return twins;
}

/// Returns a random outline of a patch. Throws bristle::Error if it is refused.
Outline any_outline(Input& input) {
  const auto pressure = input.flag() ? bristle::Pressure::hertz : bristle::Pressure::uniform;
  constexpr double sizes[] = {1e-4, 1e-5, 1e-3, 0.0};
  const double size = sizes[input.choice(4)];
  Outline outline;
  switch (input.choice(8)) {
    case 0:
    case 1:
    case 2:
      outline = Outline::ellipse(size, size * input.between(0.1, 1.0), pressure,
                                 1 + static_cast<int>(input.choice(3)), static_cast<int>(input.choice(7)));
      break;
    case 3:
    case 4:
      outline =
          Outline::rectangle(size, size * input.between(0.0, 1.0), pressure,
                             1 + static_cast<int>(input.choice(4)), 1 + static_cast<int>(input.choice(4)));
      break;
    case 5:
      break;  // leaves the default outline, a point without extent
    default: {
      outline.cells.resize(1 + input.choice(6));
      double sum = 0.0;
      for (bristle::PatchCell& cell : outline.cells) {
        cell.position[0] = input.number(size);
        cell.position[1] = input.number(size);
        sum += cell.weight = 0.01 + input.between(0.0, 1.0);
      }
      for (bristle::PatchCell& cell : outline.cells) cell.weight /= sum;
      if (input.choice(8) == 7) outline.cells[0].weight = input.number(1.0);
    }
  }
  if (input.choice(4) == 3) outline.grow_with_load(std::fabs(input.number(1.0)));
  return outline;
}

ExtendedMotion any_spin(Input& input, PatchId id, double scale) {
  ExtendedMotion m;
  const bristle::Motion flat = any_motion(input, {}, 2, scale);
  m.id = id;
  m.normal_load = flat.normal_load;
  m.has_velocity = flat.has_velocity;
  for (int axis = 0; axis < 2; ++axis) {
    m.displacement[axis] = flat.displacement[axis];
    m.velocity[axis] = flat.velocity[axis];
  }
  constexpr double turns[] = {0.0, 0.01, 0.3, 3.0};
  m.displacement[2] = input.number(turns[input.choice(4)]);
  if (m.has_velocity) m.velocity[2] = input.number(1.0);
  return m;
}

void check_sound(const ExtendedResponse& r) {
  for (int i = 0; i < 3; ++i) {
    check(std::isfinite(r.end[i]) && std::isfinite(r.elastic[i]) && std::isfinite(r.damper[i]) &&
              std::isfinite(r.mean[i]),
          "forces and torques are finite");
    for (int k = 0; k < 3; ++k) check(r.stiffness[i][k] == r.stiffness[k][i], "the stiffness is symmetric");
    check(r.stiffness[i][i] >= 0.0 && r.damping[i][i] >= 0.0, "stiffness and damping are not negative");
  }
  check(r.force_limit >= 0.0 && r.torque_limit >= 0.0, "limits are not negative");
}

void check_alike(const ExtendedResponse& a, const ExtendedResponse& b) {
  const auto same = [](const auto& x, const auto& y) { return std::memcmp(&x, &y, sizeof x) == 0; };
  check(a.status == b.status && same(a.end, b.end) && same(a.elastic, b.elastic) &&
            same(a.damper, b.damper) && same(a.mean, b.mean) && same(a.stiffness, b.stiffness) &&
            same(a.damping, b.damping) && same(a.force_limit, b.force_limit) &&
            same(a.torque_limit, b.torque_limit) && same(a.dissipated, b.dissipated) &&
            same(a.contact_loss, b.contact_loss) && a.snaps == b.snaps,
        "instruction sets answer alike");
}

}  // namespace

void extended(Bytes bytes) {
  static std::vector<std::unique_ptr<Twin>> twins = make_twins();
  Input input(bytes);
  bristle::Material material;
  bristle::PatchOptions options;
  Outline outline;
  std::vector<PatchId> ids;
  try {
    const Brush brush = input.choice(4) == 3 ? Brush::aged : Brush::rubbed;
    material = any_brush(input, brush);
    options = any_brush_options(input, 400, input.flag());
    if (input.choice(16) != 15) options.axes = 2;
    outline = any_outline(input);
  } catch (const bristle::Error&) {  // skips input whose law or outline the library refuses
    return;
  }
  trace(material, options);
  for (const auto& twin : twins) {
    try {
      ids.push_back(twin->patches.add(material, options, outline));
    } catch (const bristle::Error& error) {
      check(*error.what() != 0 && ids.empty(),
            "what one instruction set refuses they all refuse, and say why");
      check(twin->batch.patch_count() == 0, "what was refused leaves no cell");
    }
  }
  if (ids.empty()) return;
  check(ids.size() == twins.size(), "what one instruction set takes they all take");
  const double scale = material.snap_length.mean();
  for (int k = 0; k < 16 && !input.empty(); ++k) {
    const unsigned kind = input.choice(16);
    if (traces()) std::fprintf(stderr, "kind %u\n", kind);
    if (kind == 15) {
      const double size = input.number(1.0);
      for (std::size_t t = 0; t < twins.size(); ++t) twins[t]->patches.set_scale(ids[t], size);
      continue;
    }
    if (kind == 14) {
      std::vector<std::byte> state(twins[0]->patches.state_size());
      check(twins[0]->patches.save_state(state) == state.size(), "save_state writes state_size() bytes");
      try {
        twins[0]->patches.restore_state(state);
      } catch (const bristle::Error& error) {
        check(false, error.what());
      }
      continue;
    }
    const ExtendedMotion motion = any_spin(input, {}, scale);
    const bool trial = input.choice(8) == 7;
    const double before = twins[0]->patches.stored_energy(ids[0]);
    ExtendedResponse first;
    for (std::size_t t = 0; t < twins.size(); ++t) {
      ExtendedMotion own = motion;
      own.id = ids[t];
      ExtendedResponse response;
      if (trial)
        response = twins[t]->patches.find_force(1e-3, own);
      else
        twins[t]->patches.step(1e-3, {&own, 1}, {&response, 1});
      if (traces())
        std::fprintf(stderr,
                     "twin %zu moved %g %g turned %g load %g: elastic %.17g %.17g torque %.17g hash %llx\n",
                     t, own.displacement[0], own.displacement[1], own.displacement[2], own.normal_load,
                     response.elastic[0], response.elastic[1], response.elastic[2],
                     static_cast<unsigned long long>(twins[t]->batch.state_hash()));
      check_sound(response);
      if (t == 0) first = response;
      check_alike(first, response);
    }
    if (trial || options.max_normal_load != 1.0 || !(motion.normal_load > 1e-5) ||
        has(first.status, bristle::Status::bad_input))
      continue;
    if (options.outputs != bristle::Outputs::all) continue;
    double work = 0.0, path = 0.0;
    for (int i = 0; i < 3; ++i) work -= first.mean[i] * motion.displacement[i];
    for (int i = 0; i < 2; ++i) path += std::fabs(motion.displacement[i]);
    if (path > 1e3 * scale) continue;
    const double after = twins[0]->patches.stored_energy(ids[0]);
    const double off = before + work - first.damper_work - first.dissipated - first.contact_loss - after;
    const double size = before + after + std::fabs(work) + first.dissipated + std::fabs(first.contact_loss) +
                        std::fabs(first.damper_work);
    check(std::fabs(off) <= 1e-3 * size + 1e-22, "work and turning are stored or lost");
  }
  for (std::size_t t = 0; t < twins.size(); ++t)
    check(twins[t]->batch.state_hash() == twins[0]->batch.state_hash(), "all end in the same state");
  for (std::size_t t = 0; t < twins.size(); ++t) {
    twins[t]->patches.remove(ids[t]);
    check(twins[t]->batch.patch_count() == 0, "a removed patch takes its cells along");
  }
}

}  // namespace fuzz
