// The interface between a patch and its contact model: a second, very small model goes through the batch as
// the brush does.
#include <cmath>
#include <vector>

#include <catch2/catch.hpp>

#include "core/common/hashing.hpp"
#include "core/patches/columns.hpp"
#include "core/patches/lanes/brush_block.hpp"
#include "core/patches/lanes/slide_block.hpp"
#include "core/patches/patch_step.hpp"
#include "core/patches/representatives/representatives.hpp"
#include "core/patches/saved_state.hpp"
#include "core/runtime/batch_access.hpp"
#include "core/runtime/command_list.hpp"
#include "core/runtime/patch_pool.hpp"
#include "expect.hpp"
#include "scenes.hpp"

namespace bristle_test::test_contact_model {

namespace {

using namespace bristle::detail;
using bristle::Span;

/// Contact model of one elastic bristle along x that slides when bent beyond the mean snap length: Coulomb
/// friction with an elastic beginning.
struct Coulomb : PatchRecord {
  /// Deflection (scaled length) at the last position at which a kernel moved the patch; with this model
  /// always the present position.
  double* bent = nullptr;

  template <class Self, class Visit>
  static void columns(Self& r, Visit&& visit) {
    visit(r.bent, ColumnRule{"bent", 1, Filler::zero, true});
  }
};

Coulomb& coulomb(const Patch& p) { return static_cast<Coulomb&>(*p.record); }

double limit_of(const Patch& p) { return dbar * p.lengths_per_metre; }

/// Copies to the part of a patch that all models share: the bristle's deflection, its weight, and the bound
/// within which the patch may move without a call of the model.
void note(Patch& p) noexcept {
  const auto& m = p.material();
  p.part = p.zeta > 0.0 ? 1.0 : 0.0;
  p.part_sum[0] = std::llrint(coulomb(p).bent[0] * fixed_per_length);
  p.part_position[0] = p.position[0];
  p.newtons_per_unit = p.zeta * m.material.bristle_stiffness * m.metres_per_length * length_per_fixed;
  note_bound(p, {{p.position[0], p.position[1]}, limit_of(p) - std::abs(coulomb(p).bent[0])});
  p.record->largest_work = 1;
}

double apply_coulomb_load(Patch& p, double normal_load_n) noexcept {
  // Adds to the deflection the motion within the bound, for which the batch did not call the model.
  coulomb(p).bent[0] += to_lengths(difference(p.position[0], p.part_position[0]));
  p.normal_load = normal_load_n;
  p.zeta = p.material().material.bristles_in_contact(normal_load_n);
  note(p);
  note_contact(p);
  return 0.0;
}

void step_coulomb(Patch& p, PatchStep& step, StepSums& sums) noexcept {
  const double reached = coulomb(p).bent[0] + to_lengths(difference(step.kernel.to[0], p.part_position[0])) +
                         (step.kernel.snaps_all ? step.scaled[0] : 0.0);
  const double bent = std::clamp(reached, -limit_of(p), limit_of(p));
  sums.end[0] = bent * fixed_per_length;
  sums.visited = 1;
  if (!step.kernel.stores) return;
  p.position[0] = step.kernel.to[0];
  p.position[1] = step.kernel.to[1];
  coulomb(p).bent[0] = bent;
  note(p);
}

void reset_coulomb(Patch& p, std::uint32_t seed, std::uint64_t key) noexcept {
  p.record->options.seed = seed;
  p.record->options.key = key;
  coulomb(p).bent[0] = 0.0;
  p.part_position[0] = p.position[0];
  apply_coulomb_load(p, 0.0);
}

const ContactModel coulomb_model = [] {
  ContactModel m{};
  m.name = "coulomb";
  m.apply_load = &apply_coulomb_load;
  m.step_bristles = &step_coulomb;
  m.reset = &reset_coulomb;
  m.copy = &bristle::detail::copy_record<Coulomb>;
  m.stored_energy = [](const Patch&) noexcept { return 0.0; };
  m.hash = [](const Patch& p) noexcept {
    Hasher hasher;
    hasher.add(deflection_sum(p, 0));
    return hasher.value();
  };
  m.describe = [](const Patch&, bristle::PatchInfo& info) noexcept { info.kernel = "coulomb"; };
  m.read_bristles = [](const Patch&, std::size_t, Span<double>, Span<double>, Span<double>) noexcept {};
  m.signature = [](const Patch& p) noexcept { return p.material().hash; };
  m.save = [](const Patch& p, ByteWriter& write) noexcept { write(deflection_sum(p, 0)); };
  m.find_fault = [](const Patch&, const Patch&, ByteReader read) noexcept -> const char* {
    double bent = 0.0;
    read(bent);
    return std::abs(bent) < 1e3 ? nullptr : "bent";
  };
  m.restore = [](Patch& p, std::uint32_t, ByteReader read) noexcept {
    read(coulomb(p).bent[0]);
    note(p);
    note_contact(p);
  };
  return m;
}();

PatchId add_coulomb(PatchBatch& batch, double load) {
  const auto material = compile_material(plain_material(uniform, SnapRule::keep));
  Coulomb made;
  made.material = material.get();
  made.options = PatchOptions{}.with_axes(1).with_max_normal_load(load);
  Coulomb* record = make_record(material, made);
  Patch p = make_shared_part(*record, coulomb_model);
  note(p);
  note_contact(p);
  return BatchAccess::add(batch, p);
}

/// Returns the elastic force after a move. Under plain_material it is the load (N) times the deflection (m),
/// for the load is the number of bristles.
double force_after(PatchBatch& batch, PatchId id, double dx, double load) {
  const Response out = step_one(batch, Motion{id, {dx, 0.0}, load});
  REQUIRE(out.status == Status::ok);
  return out.end[0];
}

}  // namespace

TEST_CASE("Ranges of saved whole numbers are exact where a double is not", "[state]") {
  const FieldRule rule{"path", -0x1p62, 0x1p62};
  const std::int64_t farthest = std::int64_t{1} << 62;
  CHECK(is_allowed(farthest, rule));
  CHECK(is_allowed(-farthest, rule));
  CHECK_FALSE(is_allowed(farthest + 1, rule));  // rounds to the same double
  CHECK_FALSE(is_allowed(-farthest - 1, rule));
  CHECK_FALSE(is_allowed(std::nan(""), rule));
}

TEST_CASE("A second contact model is stepped, tried, saved and restored by the batch", "[contact model]") {
  PatchBatch batch;
  const PatchId id = add_coulomb(batch, 3.0);
  // Patch of bristles in the same batch, whose steps the second model must not disturb.
  const PatchId brush = batch.add(plain_material(uniform, SnapRule::keep), plain_options(40, 1));
  CHECK(batch.patch_count() == 2);
  CHECK(std::string(batch.info(id).kernel) == "coulomb");
  CHECK(force_after(batch, id, 0.0, 3.0) == 0.0);
  CHECK(force_after(batch, id, 0.4 * dbar, 3.0) == Approx(-3.0 * 0.4 * dbar));
  CHECK(force_after(batch, id, 0.0, 3.0) == Approx(-3.0 * 0.4 * dbar));
  CHECK(force_after(batch, brush, 0.2 * dbar, 40.0) == Approx(-40.0 * 0.2 * dbar).epsilon(1e-5));

  // Checks that a trial step, under the present load or another, changes nothing.
  Motion trial;
  trial.id = id;
  trial.displacement[0] = 5.0 * dbar;
  for (const double load : {3.0, 2.0}) {
    trial.normal_load = load;
    CHECK(batch.find_force(tick, trial).end[0] == Approx(-load * dbar));
  }
  std::vector<std::byte> saved = saved_state(batch);
  const std::uint64_t hash = batch.state_hash();

  CHECK(force_after(batch, id, 2.0 * dbar, 3.0) == Approx(-3.0 * dbar));
  CHECK(force_after(batch, id, -0.5 * dbar, 3.0) == Approx(-3.0 * 0.5 * dbar));
  CHECK(force_after(batch, id, -1e6 * dbar, 3.0) == Approx(3.0 * dbar));
  CHECK(batch.state_hash() != hash);
  batch.restore_state(saved);
  CHECK(batch.state_hash() == hash);
  CHECK(force_after(batch, id, 0.1 * dbar, 3.0) == Approx(-3.0 * 0.5 * dbar));
  REQUIRE(batch.reset(id));
  CHECK(force_after(batch, id, 0.1 * dbar, 3.0) == Approx(-3.0 * 0.1 * dbar));
  batch.remove(id);
  CHECK(batch.patch_count() == 1);
}

TEST_CASE("A state of one contact model is refused by a patch of another", "[contact model]") {
  PatchBatch coulombs, brushes;
  add_coulomb(coulombs, 3.0);
  brushes.add(plain_material(uniform, SnapRule::keep), plain_options(3, 1));
  const std::vector<std::byte> saved = saved_state(coulombs);
  CHECK_THROWS_WITH(brushes.restore_state(saved), Catch::Contains("another material or other options"));
}

TEST_CASE("A slot that has had its last generation is not used again", "[contact model]") {
  SlotList slots;
  const SlotList::Slot first = slots.take();
  CHECK(first.number == 0);
  CHECK(first.generation == 1);
  slots.give_back(0);
  CHECK(slots.take().generation == 2);
  slots.set_generation(0, SlotList::last_generation - 1);
  slots.give_back(0);
  const SlotList::Slot last = slots.take();
  CHECK(last.number == 0);
  CHECK(last.generation == SlotList::last_generation);
  slots.give_back(0);
  const SlotList::Slot other = slots.take();
  CHECK(other.number == 1);
  CHECK(other.generation == 1);
}

TEST_CASE("Taking changes ends with those handed over before, however fast more arrive", "[contact model]") {
  CommandList commands;
  for (int i = 0; i < 3; ++i) commands.push(std::make_unique<Command>());
  const std::uint64_t last = commands.pushed();
  int taken = 0;
  while (commands.take(last) != nullptr) {
    ++taken;
    commands.push(std::make_unique<Command>());  // hands over a change, as a fast thread would
    REQUIRE(taken <= 3);
  }
  CHECK(taken == 3);
  CHECK(commands.take(commands.pushed()) != nullptr);
}

TEST_CASE("Every slot lies in one place of one chunk", "[contact model]") {
  std::uint32_t slot = 0;
  for (int chunk = 0; chunk < 12; ++chunk) {
    CHECK(PatchPool::first_of(chunk) == slot);
    CHECK(PatchPool::chunk_of(slot) == chunk);
    slot += PatchPool::slots_of(chunk);
    CHECK(PatchPool::chunk_of(slot - 1) == chunk);
  }
}

TEST_CASE("A state that no patch can be in is found, whichever model it is of", "[model]") {
  const SnapLength law = SnapLength::lognormal(dbar, 0.3);
  const auto noticed = [&](SnapRule rule, bristle::Population population, auto corrupt) {
    const auto options = PatchOptions{}.with_population(population).with_axes(2).with_max_normal_load(10.0);
    int count = 0;
    const KernelEntry* kernels = kernel_entries(&count);
    while (!kernels->usable()) ++kernels;
    Patch p = make_patch(compile_material(plain_material(law, rule)), options, *kernels->table);
    const auto lanes = std::make_shared<LanePool>();
    if (p.in_lane) {
      p.model->take_lane(p, *lanes);
      enter_lane(p);
    }
    std::vector<std::byte> room(saved_size_of(p));
    Motion motion;
    Response response;
    for (int k = 0; k < 40; ++k) {
      motion.displacement[k % 2] = 0.3 * dbar;
      motion.normal_load = 7.3 + 0.1 * (k % 7);
      if (p.in_lane)
        step_lane(p, motion, tick, true, response);
      else
        step_patch(p, motion, tick, response);
      if (find_present_fault(p, room.data()) != nullptr) return std::string("a false alarm");
    }
    corrupt(p);
    const char* fault = find_present_fault(p, room.data());
    release(p.record);
    return std::string(fault == nullptr ? "nothing" : fault);
  };
  using bristle::Population;
  const auto of_bristles = [&](auto corrupt) {
    return noticed(SnapRule::redraw, Population::representatives, corrupt);
  };
  const auto of_cohorts = [&](auto corrupt) {
    return noticed(SnapRule::redraw, Population::infinite, corrupt);
  };
  const auto of_sliders = [&](auto corrupt) {
    return noticed(SnapRule::slide, Population::representatives, corrupt);
  };
  CHECK(of_bristles([](Patch&) {}) == "nothing");
  CHECK(of_bristles([](Patch& p) { representatives<float>(p).zx[0] = 1e4f; }) == "a deflection");
  CHECK(of_bristles([](Patch& p) { representatives<float>(p).delta[0] = 0.0f; }) == "a snap length");
  CHECK(of_bristles([](Patch& p) { representatives<float>(p).whole += 1; }) == "whole");
  CHECK(of_bristles([](Patch& p) { p.zeta *= 1.001; }) == "zeta");
  CHECK(of_cohorts([](Patch&) {}) == "nothing");
  const auto columns = [](Patch& p) -> BrushColumns<float>& {
    return static_cast<BrushBlock<float>&>(*lane_of(p).block).columns;
  };
  CHECK(of_cohorts([&](Patch& p) { columns(p).fresh[0].lane[0] *= 1.5f; }) == "the shares");
  CHECK(of_cohorts([&](Patch& p) { columns(p).fresh[0].lane[0] = -1.0f; }) == "a cohort's share");
  CHECK(of_cohorts([&](Patch& p) { columns(p).x[0].lane[0] += 10.0f; }) == "a cohort's position");
  CHECK(of_cohorts([&](Patch& p) { columns(p).moment[0]->lane[0] += 0.5f; }) == "the moment");
  CHECK(of_sliders([](Patch&) {}) == "nothing");
  const auto state = [](Patch& p) -> LaneState& { return lane_of(p).block->state; };
  CHECK(of_sliders([&](Patch& p) { state(p).base[0].lane[0] = 1e4; }) == "the sum");
  CHECK(of_sliders([&](Patch& p) { state(p).phase.lane[0] = 1.5; }) == "phase");
  CHECK(of_sliders([&](Patch& p) { state(p).stiffness.lane[0] *= 0.5; }) == "stiffness");
  CHECK(of_sliders([](Patch& p) {
          static_cast<SlideBlock<float>&>(*lane_of(p).block).columns.x[31].lane[0] = 1e4f;
        }) == "a deflection");
}

}  // namespace bristle_test::test_contact_model
