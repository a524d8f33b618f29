#include "bristle/extended_patches.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/common/hashing.hpp"
#include "core/common/little_endian.hpp"
#include "core/common/range_check.hpp"
#include "core/common/saved_head.hpp"
#include "core/contacts/key_table.hpp"
#include "core/materials/turn.hpp"
#include "core/patches/fields.hpp"
#include "core/runtime/batch_access.hpp"
#include "core/runtime/batch_impl.hpp"
#include "core/runtime/float_mode.hpp"
#include "core/runtime/patch_pool.hpp"

namespace bristle {

using namespace detail;

namespace {

constexpr std::size_t most_cells = 65536;
constexpr double largest_scale = 1e6;

/// Rotation and size of an outline as a step leaves them, stored for the next step.
struct Pose {
  Turn turn;           ///< rotation from the axes of the surface to those of the outline
  double scale = 1.0;  ///< factor on the outline's given size, as set by set_scale()
};

/// Sums over the cells from which the outline's matrix of stiffness or damping follows: the sum of k J^T J,
/// with k the stiffness or damping of a cell. J gives the slip of the cell at the position `at`: J (v, omega)
/// = v + omega x at. The sums are stored in the outline's axes at its full size; write() turns and scales
/// them.
struct Slopes {
  double all = 0.0, x = 0.0, y = 0.0, square = 0.0;

  void add(double k, const double (&at)[2]) noexcept {
    all += k;
    x += k * at[0];
    y += k * at[1];
    square += k * (at[0] * at[0] + at[1] * at[1]);
  }
  void write(const Turn& turn, double size, double (&sum)[3][3]) const noexcept {
    const double first[2] = {x * size, y * size};
    double turned[2];
    turn.apply(first, turned);
    sum[0][0] = sum[1][1] = all;
    sum[0][1] = sum[1][0] = 0.0;
    sum[0][2] = sum[2][0] = 0.0 - turned[1];
    sum[1][2] = sum[2][1] = turned[0];
    sum[2][2] = square * (size * size);
  }
};

/// Rotation and size of an outline in the course of one step.
struct Course {
  Turn midway, after;        ///< turn of the outline's axes at mid-step and at the end
  double chord = 0.0;        ///< 2 sin(spin / 2), the displacement of a point at distance 1 m from the centre
  double chord_share = 1.0;  ///< chord over arc of the outline's spin: 2 sin(spin / 2) / spin
  double size = 1.0;
};

struct ExtendedPatch {
  std::uint32_t generation = 0;  ///< number that tells this outline from others in the slot; 0 = free slot
  std::vector<PatchCell> cells;  ///< positions of the cells, in the outline's axes
  std::vector<PatchId> patches;  ///< ids of the cells' patches in the batch
  double full_size_load = 0.0;
  double normal_load = 0.0;
  double max_normal_load = 0.0;
  std::uint32_t seed = 0;
  std::uint64_t key = 0, last_step = 0;
  Outputs outputs = Outputs::end;
  Pose pose;
  Course course;  ///< rotation and size of this outline in the step in progress

  bool is_point() const noexcept {
    return cells.size() == 1 && cells[0].position[0] == 0.0 && cells[0].position[1] == 0.0;
  }
  /// Returns the size of the outline under a load, as a factor of its given size. The size grows with the
  /// load by Hertz's law if the outline has a full_size_load.
  double size_under(double load) const noexcept {
    if (full_size_load == 0.0) return pose.scale;
    if (!(load > 0.0)) return 0.0;
    // Limits the load before it sets the size. A motion that is refused for its load still reports a size.
    const double known = std::min(load, detail::highest_load);
    return pose.scale * detail::exp(detail::log(known / full_size_load) / 3.0);
  }
};

std::uint32_t seed_of_cell(const ExtendedPatch& p, std::uint32_t seed, std::size_t cell) noexcept {
  return p.is_point() ? seed : static_cast<std::uint32_t>(mix_key(mix_key(seed) + cell));
}

constexpr double not_given = std::numeric_limits<double>::quiet_NaN();

bool is_good_spin(double spin) noexcept { return spin >= -pi && spin <= pi; }

/// Returns whether an outline's motion has an allowed spin and total load. (The cells check only their shares
/// of the load.)
bool is_good(const ExtendedMotion& motion) noexcept {
  return is_good_spin(motion.displacement[2]) && !(motion.normal_load > highest_load);
}

/// Computes the rotation of an outline in a step, at its middle and its end. An invalid spin counts as zero
/// here; the cells refuse the motion anyway.
Course course_of(const ExtendedPatch& p, double spin, double load) noexcept {
  Course course;
  course.midway = course.after = p.pose.turn;
  course.size = p.size_under(load);
  if (spin == 0.0 || !is_good_spin(spin)) return course;
  const Turn half = turn_by(0.5 * spin);
  course.midway = normalized(p.pose.turn * half);
  course.after = normalized(course.midway * half);
  course.chord = 2.0 * half.sine;
  course.chord_share = course.chord / spin;
  return course;
}

/// Computes the position of a cell in the axes of the surface.
void find_position(const PatchCell& cell, const Turn& turned_and_grown, double (&at)[2]) noexcept {
  turned_and_grown.apply(cell.position, at);
}
Turn grown(const Turn& turn, double size) noexcept { return {turn.cosine * size, turn.sine * size}; }

/// Computes the velocity (or displacement) of the point `at` of the moving body from the velocity of the
/// outline's centre and the spin.
void move_point(const double (&of_centre)[3], double spin, const double (&at)[2],
                double (&moved)[2]) noexcept {
  moved[0] = of_centre[0];
  moved[1] = of_centre[1];
  if (spin == 0.0) return;
  moved[0] -= spin * at[1];
  moved[1] += spin * at[0];
}

Course course_of(const ExtendedPatch& p, const ExtendedMotion& motion) noexcept {
  return course_of(p, motion.displacement[2], motion.normal_load);
}

void write_cell_motions(const ExtendedPatch& p, const ExtendedMotion& motion, const Course& course,
                        Span<Motion> cells) noexcept {
  const bool good = is_good(motion);
  const Turn midway = grown(course.midway, course.size);
  for (std::size_t k = 0; k < p.cells.size(); ++k) {
    Motion& cell = cells[k];
    cell = Motion{};
    cell.id = p.patches[k];
    cell.normal_load = p.cells[k].weight * motion.normal_load;
    double at[2];
    find_position(p.cells[k], midway, at);
    move_point(motion.displacement, course.chord, at, cell.displacement);
    if (!good) cell.displacement[0] = not_given;
    cell.has_velocity = motion.has_velocity;
    if (motion.has_velocity) move_point(motion.velocity, motion.velocity[2], at, cell.velocity);
  }
}

void add_wrench(const double (&force)[2], const double (&at)[2], double (&sum)[3]) noexcept {
  sum[0] += force[0];
  sum[1] += force[1];
  sum[2] += at[0] * force[1] - at[1] * force[0];
}

/// Adds up the responses of an outline's cells to force and torque, and combines their status flags.
Status sum_up(const ExtendedPatch& p, PatchId id, const Course& course, Span<const Response> cells,
              ExtendedResponse& out) noexcept {
  ExtendedResponse sum;
  sum.id = id;
  Slopes stiffness, damping;
  double arm = 0.0;  // sum over the cells of force limit x distance from the centre, at full size, N m
  const Turn turned_midway = grown(course.midway, course.size), turned = grown(course.after, course.size);
  for (std::size_t k = 0; k < p.cells.size(); ++k) {
    const Response& cell = cells[k];
    const double(&at)[2] = p.cells[k].position;
    double midway[2], after[2];
    find_position(p.cells[k], turned_midway, midway);
    find_position(p.cells[k], turned, after);
    add_wrench(cell.end, after, sum.end);
    add_wrench(cell.elastic, after, sum.elastic);
    add_wrench(cell.damper, after, sum.damper);
    add_wrench(cell.mean, midway, sum.mean);
    stiffness.add(cell.stiffness, at);
    damping.add(cell.damping, at);
    sum.force_limit += cell.force_limit;
    arm += cell.force_limit * std::sqrt(at[0] * at[0] + at[1] * at[1]);
    sum.status = sum.status | cell.status;
    sum.dissipated += cell.dissipated;
    sum.contact_loss += cell.contact_loss;
    sum.damper_work += cell.damper_work;
    sum.snaps += cell.snaps;
  }
  stiffness.write(course.after, course.size, sum.stiffness);
  sum.torque_limit = arm * course.size;
  damping.write(course.after, course.size, sum.damping);
  sum.mean[2] *= course.chord_share;
  if (!has(p.outputs, Outputs::mean)) std::copy_n(out.mean, 3, sum.mean);
  if (!has(p.outputs, Outputs::energy)) {
    sum.dissipated = out.dissipated;
    sum.contact_loss = out.contact_loss;
    sum.damper_work = out.damper_work;
    sum.snaps = out.snaps;
  }
  out = sum;
  return sum.status;
}

Status refuse_motion(PatchId id, Status why, ExtendedResponse& out) noexcept {
  ExtendedResponse refused;
  refused.id = id;
  refused.status = why;
  out = refused;
  return why;
}

/// Returns the options for a cell's patch: those of the outline, with the cell's share of the load and the
/// bristles.
PatchOptions options_of_cell(const ExtendedPatch& p, const PatchOptions& whole, std::size_t cell) {
  PatchOptions options = whole;
  if (p.is_point()) return options;
  const double weight = p.cells[cell].weight;
  options.max_normal_load = weight * whole.max_normal_load;
  if (whole.bristles != 0)
    options.bristles = std::max(1u, static_cast<std::uint32_t>(weight * whole.bristles + 0.5));
  options.seed = seed_of_cell(p, whole.seed, cell);
  return options;
}

/// Returns the material of a cell's patch. Viscous friction does not grow with the load, so each cell gets
/// only a share of it; all other coefficients are the outline's.
Material material_of_cell(const Material& whole, Span<const PatchCell> cells, std::size_t cell) {
  if (whole.viscous_friction == 0.0 || cells.size() == 1) return whole;
  return Material(whole).with_viscous_friction(whole.viscous_friction * cells[cell].weight);
}

void check_outline(const PatchOptions& options, const Outline& outline) {
  constexpr const char* where = "Outline";
  const std::vector<PatchCell>& cells = outline.cells;
  require_within(where, "cells", static_cast<double>(cells.size()), 1, most_cells);
  if (outline.full_size_load != 0.0)
    require_within(where, "full_size_load", outline.full_size_load, 1e-15, 1e15, "N, or 0 for a fixed size");
  double sum = 0.0;
  bool extended = false;
  for (const PatchCell& cell : cells) {
    for (const double x : cell.position) {
      require_within(where, "position", x, -1e3, 1e3, "m");
      extended = extended || x != 0.0;
    }
    require_within(where, "weight", cell.weight, 1e-12, 1.0);
    sum += cell.weight;
  }
  if (!(std::fabs(sum - 1.0) <= 1e-9)) refuse(where, "sum of weights", sum, "1: divide each by their sum");
  if (extended && options.axes != 2)
    refuse("ExtendedPatches", "axes", options.axes, "2 for a patch with an extent");
}

constexpr std::size_t saved_pose = 4 * 4 + 5 * 8;

/// Saved state of an outline as a whole, without the states of its cells. Slot and generation together
/// identify the outline.
struct SavedOutline {
  std::uint32_t slot = 0, generation = 0, cells = 0, seed = 0;
  std::uint64_t key = 0;
  Pose pose;
  double normal_load = 0.0;
};
template <class Outline, class Visit>
void outline_fields(Outline& p, Visit&& visit) noexcept {
  for (auto* number : {&p.slot, &p.generation, &p.cells, &p.seed}) visit(*number);
  visit(p.key);
  for (auto* part : {&p.pose.turn.cosine, &p.pose.turn.sine})
    visit(*part, FieldRule{"turn", -1.0 - 1e-9, 1.0 + 1e-9});
  visit(p.pose.scale, FieldRule{"scale", 0.0, largest_scale});
  visit(p.normal_load, FieldRule{"normal_load", 0.0, highest_load});
}
SavedOutline saved_outline(std::uint32_t slot, const ExtendedPatch& p) noexcept {
  return {slot,   p.generation, static_cast<std::uint32_t>(p.cells.size()), p.seed, p.key,
          p.pose, p.normal_load};
}

/// Working memory of a step, large enough for all cells of all outlines, so that a step does not allocate.
struct Room {
  Room() = default;
  explicit Room(std::size_t cells) : motions(cells), answers(cells) {}

  std::vector<Motion> motions;    ///< motions of the cells, outline after outline
  std::vector<Response> answers;  ///< responses of the cells that move by `motions`
};

/// Data of the outlines that the calls of the stepping thread read and write.
struct Stepped : Room {
  explicit Stepped(PatchBatch& its_batch) : batch(&its_batch) {}

  ExtendedPatch* find(PatchId id) noexcept { return patches.find(id); }

  /// Writes the response of an outline from those of its cells, which were stepped along p.course, and stores
  /// its new angle and load.
  static Status finish(ExtendedPatch& p, const ExtendedMotion& motion, Span<const Response> cells,
                       ExtendedResponse& out) noexcept {
    const Status status = sum_up(p, motion.id, p.course, cells, out);
    if (!was_stepped(status)) return status;
    p.pose.turn = p.course.after;
    p.normal_load = motion.normal_load;
    return status;
  }

  /// Finds the responses of the cells of outline `p`, which begin at index `at` or later, and moves `at` past
  /// them. Skips cells of outlines that were removed since write_motions(). Returns an empty span if there
  /// are none.
  static Span<const Response> find_answers(const ExtendedPatch& p, Span<const Response> cells,
                                           std::size_t& at) noexcept {
    std::size_t first = at;
    while (first < cells.size() && cells[first].id != p.patches[0]) ++first;
    if (first + p.cells.size() > cells.size()) return {};
    at = first + p.cells.size();
    return {cells.data() + first, p.cells.size()};
  }

  PatchBatch* batch;
  SlotTable<ExtendedPatch> patches;
  std::size_t count = 0;
  std::uint64_t step_number = 0;
};

// A command that adds an outline to the data of the stepping thread. It owns all that it needs, because
// ExtendedPatches may be destroyed before the batch executes the command.
struct AddOutline final : Change {
  void apply() noexcept override {
    std::vector<ExtendedPatch>& present = to->patches.at;
    if (outlines.size() > present.size()) {
      std::swap_ranges(present.begin(), present.end(), outlines.begin());
      outlines.swap(present);
    }
    if (room.motions.size() > to->motions.size()) std::swap(room, static_cast<Room&>(*to));
    std::swap(made, present[slot]);
    ++to->count;
  }
  std::shared_ptr<Stepped> to;
  std::uint32_t slot = 0;
  ExtendedPatch made;
  std::vector<ExtendedPatch> outlines;  ///< longer list of outlines that replaces a full one; otherwise empty
  Room room;  ///< working memory that replaces the present one, if that is too small
};

struct RemoveOutline final : Change {
  void apply() noexcept override {
    std::swap(removed, to->patches.at[slot]);
    --to->count;
  }
  std::shared_ptr<Stepped> to;
  std::uint32_t slot = 0;
  ExtendedPatch removed;
};

}  // namespace

/// Data for the calls that add, remove or change outlines, which only the adding thread reads and writes.
struct BRISTLE_PRIVATE ExtendedPatches::Impl {
  struct Record {
    // Cells of the outline and the ids of their patches. Their owner is the ExtendedPatch of the stepping
    // thread; nobody changes them, so the adding thread may read them.
    Span<const PatchCell> cells;
    Span<const PatchId> patches;
    bool alive = false;
  };

  explicit Impl(PatchBatch& its_batch) : batch(&its_batch), stepped(std::make_shared<Stepped>(its_batch)) {}
  ~Impl() {
    const BatchAccess::Changes changes(*batch);
    for (const Record& record : records)
      if (record.alive) remove_cells(record.patches);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void remove_cells(Span<const PatchId> ids) noexcept {
    for (const PatchId id : ids) {
      try {
        batch->remove(id);
      } catch (...) {  // ignored: the cell's patch was already removed, or there is no memory for the command
      }
    }
  }
  Record& demand(PatchId id) {
    const std::uint32_t slot = slot_of(id);
    if (slot >= records.size() || !records[slot].alive || slots.generation(slot) != generation_of(id))
      throw Error("ExtendedPatches: there is no patch with id " + std::to_string(id.value));
    return records[slot];
  }

  /// Call of the stepping thread over the batch, with access to the outlines' data.
  struct Call {
    explicit Call(const Impl& impl) noexcept
        : turn(BatchAccess::inside(*impl.batch)), patches(*impl.stepped) {}
    const BatchAccess::Impl::Call turn;
    Stepped& patches;
  };

  PatchBatch* const batch;
  const std::shared_ptr<Stepped> stepped;
  SlotList slots;
  std::vector<Record> records;  ///< cells and life of each outline, by slot number
  std::size_t cells = 0;  ///< number of cells of all outlines, as the thread that adds outlines counts them
  std::size_t room = 0;   ///< number of cells that the stepping thread's arrays have room for
  std::size_t outlines = 0;  ///< number of outlines that the stepping thread's list has room for
};

ExtendedPatches::ExtendedPatches(PatchBatch& batch) : impl_(std::make_unique<Impl>(batch)) {}
ExtendedPatches::~ExtendedPatches() = default;
ExtendedPatches::ExtendedPatches(ExtendedPatches&&) noexcept = default;
ExtendedPatches& ExtendedPatches::operator=(ExtendedPatches&&) noexcept = default;

PatchId ExtendedPatches::add(const Material& material, const PatchOptions& options, const Outline& outline) {
  check_outline(options, outline);
  Impl& impl = *impl_;
  auto change = std::make_unique<AddOutline>();
  change->to = impl.stepped;
  ExtendedPatch& made = change->made;
  made.cells = outline.cells;
  made.full_size_load = outline.full_size_load;
  made.max_normal_load = options.max_normal_load;
  made.outputs = options.outputs;
  made.seed = options.seed;
  made.key = options.key;
  const std::size_t count = made.cells.size();
  made.patches.reserve(count);
  BatchAccess::Changes changes(*impl.batch);
  if (impl.cells + count > impl.room) change->room = Room(std::max(impl.cells + count, 2 * impl.room));
  const std::size_t room = std::max(impl.room, change->room.motions.size());
  const SlotList::Slot slot = impl.slots.take();
  try {
    impl.records.resize(impl.slots.size());
    if (slot.number >= impl.outlines) change->outlines.resize(std::max<std::size_t>(8, 2 * impl.outlines));
    const std::size_t outlines = std::max(impl.outlines, change->outlines.size());
    const FloatModeScope mode;
    for (std::size_t k = 0; k < count; ++k)
      made.patches.push_back(
          impl.batch->add(material_of_cell(material, made.cells, k), options_of_cell(made, options, k)));
    change->slot = slot.number;
    made.generation = slot.generation;
    const Impl::Record record{{made.cells.data(), count}, {made.patches.data(), count}, true};
    changes.send(std::move(change));
    impl.records[slot.number] = record;
    impl.cells += count;
    impl.room = room;
    impl.outlines = outlines;
    return make_id(slot.number, slot.generation);
  } catch (...) {
    if (change) impl.remove_cells({change->made.patches.data(), change->made.patches.size()});
    impl.slots.give_back(slot.number);
    throw;
  }
}

void ExtendedPatches::remove(PatchId id) {
  Impl& impl = *impl_;
  BatchAccess::Changes changes(*impl.batch);
  Impl::Record& record = impl.demand(id);
  auto change = std::make_unique<RemoveOutline>();
  change->to = impl.stepped;
  change->slot = slot_of(id);
  for (const PatchId cell : record.patches) impl.batch->remove(cell);
  changes.send(std::move(change));
  impl.cells -= record.cells.size();
  record = {};
  impl.slots.give_back(slot_of(id));
}

void ExtendedPatches::set_material(PatchId id, const Material& material) {
  Impl& impl = *impl_;
  BatchAccess::Changes changes(*impl.batch);
  const Impl::Record& record = impl.demand(id);
  for (std::size_t k = 0; k < record.patches.size(); ++k)
    impl.batch->set_material(record.patches[k], material_of_cell(material, record.cells, k));
}

bool ExtendedPatches::set_scale(PatchId id, double scale) noexcept {
  const Impl::Call call(*impl_);
  ExtendedPatch* p = call.patches.find(id);
  if (p == nullptr || !(scale >= 0.0 && scale <= largest_scale)) return false;
  p->pose.scale = scale;
  return true;
}

StepReport ExtendedPatches::step(double dt_s, Span<const ExtendedMotion> in,
                                 Span<ExtendedResponse> out) noexcept {
  const Impl::Call call(*impl_);
  Stepped& impl = call.patches;
  const FloatModeScope mode;
  StepReport report;
  if (in.size() != out.size()) {
    for (ExtendedResponse& response : out) refuse_motion({}, Status::bad_input, response);
    report.status = Status::bad_input;
    return report;
  }
  // Refuses unknown and repeated ids and writes the motions of the cells in a first pass. (There is memory
  // for the cells of each outline only once.) One call then steps all cells, and a second pass writes the
  // responses.
  ++impl.step_number;
  std::size_t queued = 0;
  for (std::size_t i = 0; i < in.size(); ++i) {
    ExtendedPatch* p = impl.find(in[i].id);
    const bool first = p != nullptr && p->last_step != impl.step_number;
    if (!first) {
      const Status why = p == nullptr ? why_missing(in[i].id.value) : Status::repeated_id;
      report.status = report.status | refuse_motion(in[i].id, why, out[i]);
      continue;
    }
    p->last_step = impl.step_number;
    p->course = course_of(*p, in[i]);
    out[i].status = Status::ok;
    write_cell_motions(*p, in[i], p->course, Span<Motion>(impl.motions.data() + queued, p->cells.size()));
    queued += p->cells.size();
  }
  std::fill_n(impl.answers.begin(), queued, Response{});
  const StepReport cells = impl.batch->step(dt_s, Span<const Motion>(impl.motions.data(), queued),
                                            Span<Response>(impl.answers.data(), queued));
  report.tasks = cells.tasks;
  report.threads = cells.threads;
  report.bristles_visited = cells.bristles_visited;
  queued = 0;
  for (std::size_t i = 0; i < in.size(); ++i) {
    if (!was_stepped(out[i].status)) continue;
    ExtendedPatch& p = *impl.find(in[i].id);
    const Status status =
        Stepped::finish(p, in[i], Span<const Response>(impl.answers.data() + queued, p.cells.size()), out[i]);
    queued += p.cells.size();
    report.status = report.status | status;
    if (was_stepped(status)) ++report.patches_stepped;
  }
  return report;
}

ExtendedResponse ExtendedPatches::find_force(double dt_s, const ExtendedMotion& motion) noexcept {
  const Impl::Call call(*impl_);
  Stepped& impl = call.patches;
  const FloatModeScope mode;
  ExtendedResponse out;
  const ExtendedPatch* p = impl.find(motion.id);
  if (p == nullptr) {
    refuse_motion(motion.id, why_missing(motion.id.value), out);
    return out;
  }
  const std::size_t count = p->cells.size();
  const Course course = course_of(*p, motion);
  write_cell_motions(*p, motion, course, Span<Motion>(impl.motions.data(), count));
  for (std::size_t k = 0; k < count; ++k) impl.answers[k] = impl.batch->find_force(dt_s, impl.motions[k]);
  sum_up(*p, motion.id, course, Span<const Response>(impl.answers.data(), count), out);
  return out;
}

std::size_t ExtendedPatches::cell_count(PatchId id) const noexcept {
  const Impl::Call call(*impl_);
  const ExtendedPatch* p = call.patches.find(id);
  return p == nullptr ? 0 : p->cells.size();
}

Span<const PatchId> ExtendedPatches::cell_patches(PatchId id) const noexcept {
  const Impl::Call call(*impl_);
  const ExtendedPatch* p = call.patches.find(id);
  return p == nullptr ? Span<const PatchId>() : Span<const PatchId>(p->patches.data(), p->patches.size());
}

std::size_t ExtendedPatches::read_cells(PatchId id, double spin, double normal_load_n,
                                        Span<PatchCell> out) const noexcept {
  const Impl::Call call(*impl_);
  const ExtendedPatch* p = call.patches.find(id);
  if (p == nullptr || !is_good_spin(spin)) return 0;
  const FloatModeScope mode;
  const Course course = course_of(*p, spin, normal_load_n);
  const std::size_t count = std::min(out.size(), p->cells.size());
  const Turn turned = grown(course.after, course.size);
  for (std::size_t k = 0; k < count; ++k) {
    find_position(p->cells[k], turned, out[k].position);
    out[k].weight = p->cells[k].weight;
  }
  return count;
}

std::size_t ExtendedPatches::write_motions(Span<const ExtendedMotion> in, Span<Motion> cells) const noexcept {
  const Impl::Call call(*impl_);
  const FloatModeScope mode;
  std::size_t at = 0;
  for (const ExtendedMotion& motion : in) {
    const ExtendedPatch* p = call.patches.find(motion.id);
    if (p == nullptr) continue;
    if (at + p->cells.size() > cells.size()) break;
    write_cell_motions(*p, motion, course_of(*p, motion), Span<Motion>(cells.data() + at, p->cells.size()));
    at += p->cells.size();
  }
  // Clears the entries behind the last cell. Otherwise motions that an earlier step left in the caller's
  // array would be stepped again.
  for (std::size_t k = at; k < cells.size(); ++k) cells[k] = Motion{};
  return at;
}

Status ExtendedPatches::read_responses(Span<const ExtendedMotion> in, Span<const Response> cells,
                                       Span<ExtendedResponse> out) noexcept {
  const Impl::Call call(*impl_);
  const FloatModeScope mode;
  Status all = in.size() == out.size() ? Status::ok : Status::bad_input;
  std::size_t at = 0;
  for (std::size_t i = 0; i < std::min(in.size(), out.size()); ++i) {
    ExtendedPatch* p = call.patches.find(in[i].id);
    if (p == nullptr) {
      all = all | refuse_motion(in[i].id, why_missing(in[i].id.value), out[i]);
      continue;
    }
    const Span<const Response> answers = Stepped::find_answers(*p, cells, at);
    p->course = course_of(*p, in[i]);
    all = all | (answers.empty() ? refuse_motion(in[i].id, Status::bad_input, out[i])
                                 : Stepped::finish(*p, in[i], answers, out[i]));
  }
  return all;
}

bool ExtendedPatches::reset(PatchId id) noexcept {
  const Impl::Call call(*impl_);
  const ExtendedPatch* p = call.patches.find(id);
  return p != nullptr && reset(id, p->seed, p->key);
}

bool ExtendedPatches::reset(PatchId id, std::uint32_t seed, std::uint64_t key) noexcept {
  const Impl::Call call(*impl_);
  ExtendedPatch* p = call.patches.find(id);
  if (p == nullptr) return false;
  for (std::size_t k = 0; k < p->patches.size(); ++k)
    call.patches.batch->reset(p->patches[k], seed_of_cell(*p, seed, k), key);
  p->seed = seed;
  p->key = key;
  p->pose = Pose{};
  p->normal_load = 0.0;
  return true;
}

ExtendedInfo ExtendedPatches::info(PatchId id) const noexcept {
  const Impl::Call call(*impl_);
  ExtendedInfo info;
  const ExtendedPatch* p = call.patches.find(id);
  if (p == nullptr) return info;
  info.cells = static_cast<std::uint32_t>(p->cells.size());
  info.scale = p->full_size_load == 0.0 ? p->pose.scale : p->size_under(p->normal_load);
  info.along[0] = p->pose.turn.cosine;
  info.along[1] = p->pose.turn.sine;
  info.normal_load = p->normal_load;
  info.max_normal_load = p->max_normal_load;
  for (const PatchId cell : p->patches) {
    const PatchInfo of_cell = call.patches.batch->info(cell);
    info.memory_bytes += of_cell.memory_bytes + sizeof(PatchCell) + sizeof(PatchId);
    info.kernel = of_cell.kernel;
  }
  return info;
}

double ExtendedPatches::stored_energy(PatchId id) const noexcept {
  const Impl::Call call(*impl_);
  double sum = 0.0;
  for (const PatchId cell : cell_patches(id)) sum += call.patches.batch->stored_energy(cell);
  return sum;
}

std::uint64_t ExtendedPatches::state_hash(PatchId id) const noexcept {
  const Impl::Call call(*impl_);
  const ExtendedPatch* p = call.patches.find(id);
  if (p == nullptr) return 0;
  if (p->is_point()) return call.patches.batch->state_hash(p->patches[0]);
  Hasher hasher;
  for (const PatchId cell : p->patches) hasher.add(call.patches.batch->state_hash(cell));
  hasher.add(p->pose.turn.cosine);
  hasher.add(p->pose.turn.sine);
  hasher.add(p->pose.scale);
  return hasher.value();
}

std::uint64_t ExtendedPatches::state_hash() const noexcept {
  const Impl::Call call(*impl_);
  Hasher hasher;
  call.patches.patches.for_each([&](const ExtendedPatch& p) {
    hasher.add(state_hash(make_id(call.patches.patches.slot(p), p.generation)));
  });
  return hasher.value();
}

std::size_t ExtendedPatches::state_size() const noexcept {
  const Impl::Call call(*impl_);
  return saved_head_size + call.patches.count * saved_pose + call.patches.batch->state_size();
}

std::size_t ExtendedPatches::save_state(Span<std::byte> to) const noexcept {
  const Impl::Call call(*impl_);
  const std::size_t own = saved_head_size + call.patches.count * saved_pose;
  if (to.size() < own) return 0;
  const std::size_t of_batch =
      call.patches.batch->save_state(Span<std::byte>(to.data() + own, to.size() - own));
  if (of_batch == 0) return 0;
  ByteWriter write(to.data() + saved_head_size);
  call.patches.patches.for_each([&](const ExtendedPatch& p) {
    const SavedOutline saved = saved_outline(call.patches.patches.slot(p), p);
    outline_fields(saved, write);
  });
  seal(SavedKind::outlines, call.patches.count, {to.data(), own});
  return own + of_batch;
}

void ExtendedPatches::restore_state(Span<const std::byte> from) {
  constexpr const char* where = "ExtendedPatches";
  const Impl::Call call(*impl_);
  Stepped& impl = call.patches;
  const std::size_t own = saved_head_size + impl.count * saved_pose;
  if (from.size() < own) refuse_saved(where, "is cut short");
  open_sealed(where, SavedKind::outlines, {from.data(), own});
  ByteReader read(from.data() + saved_head_size);
  std::vector<SavedOutline> restored(impl.count);
  std::vector<ExtendedPatch*> present;
  impl.patches.for_each([&present](ExtendedPatch& p) { present.push_back(&p); });
  for (std::size_t i = 0; i < impl.count; ++i) {
    SavedOutline& p = restored[i];
    FieldCheck check{read};
    outline_fields(p, check);
    const SavedOutline now = saved_outline(impl.patches.slot(*present[i]), *present[i]);
    if (p.slot != now.slot || p.generation != now.generation || p.cells != now.cells)
      refuse_saved(where, "is of patches with other outlines, or added in another order");
    const double length = square(p.pose.turn.cosine) + square(p.pose.turn.sine);
    if (check.fault == nullptr && !(magnitude(length - 1.0) <= 1e-9)) check.fault = "turn";
    if (check.fault != nullptr)
      refuse_saved(where, std::string("has a value that no patch can have (") + check.fault + ")");
  }
  impl.batch->restore_state(Span<const std::byte>(from.data() + own, from.size() - own));
  for (std::size_t i = 0; i < impl.count; ++i) {
    ExtendedPatch& p = *present[i];
    p.seed = restored[i].seed;
    p.key = restored[i].key;
    p.pose = restored[i].pose;
    p.normal_load = restored[i].normal_load;
  }
}

std::size_t ExtendedPatches::patch_count() const noexcept { return Impl::Call(*impl_).patches.count; }
PatchBatch& ExtendedPatches::batch() const noexcept { return *impl_->batch; }

}  // namespace bristle
