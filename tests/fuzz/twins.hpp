// One patch in several batches that must give equal responses: one for each instruction set of this machine,
// and one that visits every bristle.
#pragma once

#include <optional>
#include <vector>

#include "brushes.hpp"

namespace fuzz {

class Twins {
 public:
  Twins() { begin(); }

  /// Whether the batches' clock stands still, as it does after 300 million years, when a step is below its
  /// rounding. A bristle that snaps then has no age, however long the step.
  bool clock_stands() const { return lived_ > 1e16; }

  /// Adds the patch under test to all batches. Returns false if all of them refuse it.
  bool add(const bristle::Material& material, const bristle::PatchOptions& options) {
    if (clock_stands()) begin();
    ids.clear();
    try {
      for (bristle::PatchBatch& batch : batches) ids.push_back(batch.add(material, options));
    } catch (const bristle::Error& error) {
      check(*error.what() != 0, "a refusal says why");
      check(ids.empty(), "what one instruction set refuses they all refuse");
      return false;
    }
    return true;
  }

  void remove() {
    for (std::size_t b = 0; b < batches.size(); ++b) {
      batches[b].remove(ids[b]);
      check(batches[b].patch_count() == 0, "a removed patch is gone");
    }
  }

  /// Takes a step in every batch, or a trial step that changes nothing, and returns the common response.
  bristle::Response step(double dt, const bristle::Motion& motion, bool trial) {
    bristle::Response first;
    if (!trial && dt > 0.0) lived_ += dt;
    for (std::size_t b = 0; b < batches.size(); ++b) {
      bristle::Motion own = motion;
      own.id = ids[b];
      bristle::Response response;
      if (trial)
        response = batches[b].find_force(dt, own);
      else
        batches[b].step(dt, {&own, 1}, {&response, 1});
      if (traces()) std::fprintf(stderr, "%s ", batches[b].isa());
      trace(dt, motion, response, batches[b].stored_energy(ids[b]));
      check_finite(response);
      response.id = ids[0];
      if (b == 0) first = response;
      check_same(first, response, "instruction sets answer alike");
    }
    return first;
  }

  /// Gives the patch another material in every batch. Returns false if all batches refuse it.
  bool set_material(const bristle::Material& material) {
    std::size_t done = 0;
    try {
      for (std::size_t b = 0; b < batches.size(); ++b, ++done) batches[b].set_material(ids[b], material);
    } catch (const bristle::Error&) {
      check(done == 0, "a material that one refuses they all refuse");
    }
    return done > 0;
  }

  /// Saves each batch and restores the state in the next, in a ring; the bytes must be equal everywhere.
  void hand_on() {
    std::vector<std::vector<std::byte>> states;
    for (const bristle::PatchBatch& batch : batches) states.push_back(saved_state(batch));
    for (std::size_t b = 0; b < batches.size(); ++b) {
      const std::uint64_t before = batches[b].state_hash(ids[b]);
      // Ids are equal in all batches: each patch is the first of its batch, after equally many removals.
      try {
        batches[b].restore_state(states[(b + 1) % batches.size()]);
      } catch (const bristle::Error& error) {
        check(false, error.what());
      }
      check(batches[b].state_hash(ids[b]) == before, "a state restored is the same");
    }
  }

  void check_alike() const {
    const std::uint64_t hash = batches[0].state_hash(ids[0]);
    for (std::size_t b = 0; b < batches.size(); ++b)
      check(batches[b].state_hash(ids[b]) == hash, "instruction sets end in the same state");
  }

  double stored() const { return batches[0].stored_energy(ids[0]); }

 private:
  void begin() {
    batches.clear();
    lived_ = 0.0;
    for (const bristle::IsaInfo& isa : bristle::instruction_sets())
      if (isa.usable) batches.emplace_back(bristle::BatchOptions{}.with_isa(isa.name));
    batches.emplace_back(stepped_eagerly());
  }

  std::vector<bristle::PatchBatch> batches;
  std::vector<bristle::PatchId> ids;
  double lived_ = 0.0;  // time of all steps so far, s, a lower bound of the batches' clock
};

/// Adds a patch of this material and these options and moves it as the rest of the input says. Checks that
/// each step whose outputs tell it stores or loses all the work put in.
inline void walk(Twins& twins, Input& input, const bristle::Material& material,
                 const bristle::PatchOptions& options, Brush brush) {
  trace(material, options);
  if (!twins.add(material, options)) return;
  bool changed = false;  // whether a change of material has lost energy that only the next step reports
  const double scale = material.snap_length.mean();
  for (int k = 0; k < 24 && !input.empty(); ++k) {
    switch (input.choice(16)) {
      case 14:
        if (traces()) std::fprintf(stderr, "saved and restored\n");
        twins.hand_on();
        continue;
      case 15: {
        bristle::Material other = material;
        other.bristle_stiffness *= 2.0;
        const unsigned choice = input.choice(5);
        if (input.flag()) rub(input, other, choice);
        if (input.flag() && brush == Brush::aged) let_age(input, other, choice);
        trace(other, options);
        changed = twins.set_material(other) || changed;
        continue;
      }
      default:
        break;
    }
    const bristle::Motion motion = any_motion(input, {}, options.axes, scale);
    const double dt = brush == Brush::aged ? any_span(input) : 1e-3;
    const bool trial = input.choice(8) == 7;
    const double before = twins.stored();
    const bristle::Response r = twins.step(dt, motion, trial);
    // Leaves out loads that are a small part of one bristle: a bristle stands for many newtons, so the patch
    // cannot represent such loads.
    const bool balances = !changed && !twins.clock_stands() && options.max_normal_load == 1.0 &&
                          motion.normal_load > 1e-6 && options.outputs == bristle::Outputs::all;
    if (trial || has(r.status, bristle::Status::bad_input)) continue;
    changed = false;
    if (!balances) continue;
    double work = 0.0, path = 0.0;
    for (int axis = 0; axis < 2; ++axis) {
      work -= r.mean[axis] * motion.displacement[axis];
      path += std::fabs(motion.displacement[axis]);
    }
    if (path > 1e3 * scale) continue;  // beyond this path rounding of the work exceeds the stored energy
    const double after = twins.stored();
    const double off = before + work - r.damper_work - r.dissipated - r.contact_loss - after;
    const double size = before + after + std::fabs(work) + r.dissipated + std::fabs(r.contact_loss) +
                        std::fabs(r.damper_work);
    // Tolerance of the energy balance, for positions rounded to 2^-44 of a scaled length, and for the higher
    // stiffness above the maximum load.
    const double rounding = std::fabs(r.elastic[0]) + std::fabs(r.elastic[1]);
    check(std::fabs(off) <= 1e-3 * size + rounding * 0x1p-42 * scale + 1e-25, "work is stored or lost");
  }
  twins.check_alike();
  twins.remove();
}

/// Makes a patch with the features `brush` from the first bytes and moves it by the rest. `infinite`: whether
/// it is an infinite brush; if not set, the input decides.
inline void walk_any(Twins& twins, Bytes bytes, Brush brush, std::optional<bool> infinite) {
  Input input(bytes);
  bristle::Material material;
  bristle::PatchOptions options;
  try {
    material = any_brush(input, brush);
    options = any_brush_options(input, 600, infinite ? *infinite : input.flag());
  } catch (const bristle::Error&) {  // the library refuses the random law, which is no fault
    return;
  }
  walk(twins, input, material, options, brush);
}

}  // namespace fuzz
