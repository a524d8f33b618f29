#include "core/patches/lanes/lane_block.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/common/assert.hpp"
#include "core/common/hashing.hpp"

namespace bristle::detail {

void fill_block(LaneBlock& b, const LaneRecord& like) {
  const CompiledMaterial& m = *like.material;
  b.kernels = like.kernels->lanes;
  b.material = head_of(*const_cast<LaneRecord*>(&like)).material;
  b.lengths_per_metre = m.lengths_per_metre;
  b.stiffest = like.lay.stiffest;
  b.strongest = like.lay.strongest;
  b.springs = like.springs();
  b.axes = like.options.axes;
  b.outputs = like.options.outputs;
  b.ages = m.material.ageing_strength != 0.0 || m.material.drop != 0.0;
  b.damps = damps(m.material);
}

void assign_lane(Patch& p, LanePool& pool, LanePool::Block (*make)(const LaneRecord&)) {
  LaneRecord& r = lane_of(p);
  Hasher kind;
  kind.add(p.material().hash);
  kind.add(static_cast<std::uint64_t>(reinterpret_cast<std::uintptr_t>(p.model)));
  kind.add(std::uint64_t{r.springs()} << 16 | static_cast<std::uint64_t>(r.options.axes) << 8 |
           static_cast<std::uint64_t>(r.options.outputs));
  kind.add(r.options.resolution);
  r.lay.add_to(kind);
  kind.add(std::uint64_t{r.group});
  pool.take(r, kind.value(), make);
}

namespace {

/// Makes the part of a patch in a lane that all contact models share.
Patch make_part(LaneRecord& r, const ContactModel& model) noexcept {
  Patch p = make_shared_part(r, model);
  p.in_lane = true;
  p.newtons_per_unit = 1.0;
  note_contact(p);
  return p;
}

}  // namespace

Patch make_lane_patch(std::shared_ptr<const CompiledMaterial> material, LaneRecord& made,
                      const KernelTable& kernels, double weight, const ContactModel& model) {
  const Material& m = material->material;
  made.material = material.get();
  made.first_seed = made.options.seed;
  made.largest_work = made.springs();
  made.full_weight =
      weight > 0.0 ? weight : m.bristles_in_contact(made.options.max_normal_load) / made.springs();
  made.kernels = &kernels;
  return make_part(*make_record(std::move(material), made), model);
}

void reset_lane(Patch& p, std::uint32_t seed, std::uint64_t key) noexcept {
  LaneRecord& r = lane_of(p);
  r.options.seed = seed;
  r.options.key = key;
  r.times_from = 0;
  p = make_part(r, *p.model);
  clear_lane(*r.block, r.lane);
}

std::uint64_t signature_of_lane(const Patch& p) noexcept {
  const LaneRecord& r = lane_of(p);
  Hasher hasher;
  hasher.add(p.material().hash);
  hasher.add(r.full_weight);
  hasher.add(r.options.max_normal_load);
  hasher.add(std::uint64_t{r.springs()});
  hasher.add(static_cast<std::uint64_t>(p.axes) << 8 | static_cast<std::uint64_t>(p.outputs));
  return hasher.value();
}

void save_rest(const Patch& p, ByteWriter& write) noexcept {
  const double rests = p.rests ? 1.0 : 0.0;
  rest_fields(p.elastic, rests, write);
}

void restore_rest(Patch& p, std::uint32_t seed, ByteReader& read) noexcept {
  p.record->options.seed = seed;
  note_contact(p);
  double rests = 0.0;
  rest_fields(p.elastic, rests, read);
  p.rests = rests != 0.0;
}

const char* find_rest_fault(const Patch& p, const Patch& contact, double largest, ByteReader& read) noexcept {
  double elastic[2], rests = 0.0;
  rest_fields(elastic, rests, read);
  const double excess = contact.zeta / (p.record->full_weight * lane_of(p).springs());
  if (contact.overload != (is_overloaded(excess) ? excess : 1.0)) return "overload";
  for (const double force : elastic)
    if (!within(force, -largest, largest)) return "the force";
  return rests == 0.0 || rests == 1.0 ? nullptr : "rest";
}

void set_load(Patch& p, double normal_load_n) noexcept {
  const PatchRecord& r = *p.record;
  p.normal_load = normal_load_n;
  p.zeta = p.material().material.bristles_in_contact(normal_load_n);
  const double excess = p.zeta / (r.full_weight * r.options.bristles);
  p.overload = is_overloaded(excess) ? excess : 1.0;
  note_contact(p);
}

void clear_lane(LaneBlock& b, std::uint32_t lane) noexcept {
  BRISTLE_ASSERT(b.motions.named == 0);  // a step has answered all that it named
  for (LaneColumn<double>& base : b.state.base) base.lane[lane] = 0.0;
  b.state.stiffness.lane[lane] = b.state.phase.lane[lane] = 0.0;
  b.clear(b, lane);
}

void enter_lane(Patch& p) noexcept {
  const LaneRecord& r = lane_of(p);
  LaneBlock& b = *r.block;
  b.patch[r.lane] = &p;
  b.full.lane[r.lane] = r.full_weight * r.options.bristles;
  b.light.lane[r.lane] = r.material->material.load_on_bristles(b.full.lane[r.lane]) * (1.0 - 1e-9);
  b.lightest = std::min(b.lightest, b.light.lane[r.lane]);
  b.lent &= ~(1u << r.lane);
  clear_lane(b, r.lane);
}

bool lend(const Patch& p) noexcept {
  const LaneRecord& r = lane_of(p);
  LaneBlock& b = *r.block;
  const std::uint32_t bit = 1u << r.lane;
  if ((b.lent & bit) != 0) return true;
  if (p.ages || p.pending_dissipated != 0.0 || p.pending_loss != 0.0 || p.pending_snaps != 0) return false;
  b.load.lane[r.lane] = p.normal_load;
  for (int axis = 0; axis < 2; ++axis) b.force[axis].lane[r.lane] = p.elastic[axis];
  b.rests = p.rests ? b.rests | bit : b.rests & ~bit;
  b.lent |= bit;
  return true;
}

void settle(Patch& p) noexcept {
  const LaneRecord& r = lane_of(p);
  LaneBlock& b = *r.block;
  const std::uint32_t bit = 1u << r.lane;
  if ((b.lent & bit) == 0) return;
  if (b.load.lane[r.lane] != p.normal_load) set_load(p, b.load.lane[r.lane]);
  for (int axis = 0; axis < 2; ++axis) p.elastic[axis] = b.force[axis].lane[r.lane];
  p.rests = (b.rests & bit) != 0;
  if (p.rests) p.stiffness = b.stiffness(r.lane);
  b.lent &= ~bit;
}

namespace {

/// Writes those fields of a response that depend on the load alone: status, damping, force limit.
void answer_load(const LaneBlock& b, std::uint32_t lane, double load, double damping,
                 Response& out) noexcept {
  out.status = b.overload_status(lane, load);
  out.damping = damping;
  out.force_limit = b.material->peak_coefficient * load * b.strongest;
}
/// Returns the damping of a contact at a velocity, N s/m.
double damping_of_lane(const LaneBlock& b, double load, const double (&velocity)[2]) noexcept {
  const Material& m = b.material->material;
  const double speed = b.damps ? std::sqrt(velocity[0] * velocity[0] + velocity[1] * velocity[1]) : 0.0;
  return damping_of(m, b.damps, m.bristles_in_contact(load), load, speed);
}

}  // namespace

void answer_resting_lane(const LaneBlock& b, std::uint32_t lane, Response& out) noexcept {
  const double load = b.load.lane[lane];
  answer_load(b, lane, load, b.damps_at_all() ? damping_of_lane(b, load, {0.0, 0.0}) : 0.0, out);
  write_still(b.outputs, {b.force[0].lane[lane], b.force[1].lane[lane]}, out);
  out.stiffness = b.stiffness(lane);
}

void answer_lane(const LaneBlock& b, std::uint32_t lane, const Motion& motion, double dt_s,
                 const LaneAnswers& answers, Response& out) noexcept {
  double velocity[2] = {0.0, 0.0}, damping = 0.0, work = 0.0;
  if (b.damps_at_all()) {
    find_velocity(motion, dt_s, velocity);
    damping = damping_of_lane(b, motion.normal_load, velocity);
  }
  answer_load(b, lane, motion.normal_load, damping, out);
  for (int axis = 0; axis < 2; ++axis) {
    const bool moves = axis < b.axes;
    out.damper[axis] = 0.0 - damping * velocity[axis];
    out.elastic[axis] = moves ? answers.end[axis].lane[lane] : 0.0;
    out.end[axis] = out.elastic[axis] + out.damper[axis];
    if (has(b.outputs, Outputs::mean))
      out.mean[axis] = (moves ? answers.mean[axis].lane[lane] : 0.0) + out.damper[axis];
    work -= std::clamp(out.damper[axis] * motion.displacement[axis], -highest_energy, highest_energy);
  }
  out.stiffness = answers.stiffness.lane[lane] * b.stiffest;
  if (has(b.outputs, Outputs::energy)) {
    out.dissipated = answers.dissipated.lane[lane];
    out.contact_loss = answers.contact_loss.lane[lane];
    out.damper_work = work;
    out.snaps = static_cast<std::uint64_t>(answers.slid.lane[lane]);
  }
}

/// Owner of a lane in a block. It is freed with the patch's record, which frees the lane for another contact.
struct LanePool::Lease {
  std::shared_ptr<LanePool> pool;
  LaneBlock* block;
  std::uint32_t lane;

  Lease(std::shared_ptr<LanePool> of, LaneBlock* in, std::uint32_t at)
      : pool(std::move(of)), block(in), lane(at) {}
  Lease(const Lease&) = delete;
  Lease& operator=(const Lease&) = delete;
  ~Lease() { pool->give_back(*block, lane); }
};

void LanePool::take(LaneRecord& record, std::uint64_t kind, Block (*make)(const LaneRecord&)) {
  Kind& its = kinds_[kind];
  std::vector<LaneBlock*>& open = its.open;
  if (open.empty()) {
    Block made = make(record);
    made->kind = kind;
    open.reserve(its.blocks + 1);  // reserves memory here, so that give_back() cannot fail
    LaneBlock* const block = made.get();
    blocks_.emplace(block, std::move(made));
    ++its.blocks;
    open.push_back(block);
  }
  LaneBlock& block = *open.back();
  const auto lane = static_cast<std::uint32_t>(std::countr_zero(block.free));
  head_of(record).lease = std::make_shared<Lease>(shared_from_this(), &block, lane);
  block.free &= ~(1u << lane);
  if (block.free == 0) open.pop_back();
  record.block = &block;
  record.lane = lane;
}

void LanePool::give_back(LaneBlock& block, std::uint32_t lane) noexcept {
  const auto found = kinds_.find(block.kind);
  std::vector<LaneBlock*>& open = found->second.open;
  if (block.free == 0) open.push_back(&block);
  block.free |= 1u << lane;
  if (block.free != (1u << lane_count) - 1) return;
  open.erase(std::find(open.begin(), open.end(), &block));
  blocks_.erase(&block);
  if (--found->second.blocks == 0) kinds_.erase(found);
}

}  // namespace bristle::detail
