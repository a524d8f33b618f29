#include "core/runtime/group_columns.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "core/patches/patch_step.hpp"

namespace bristle::detail {
namespace {

constexpr std::uint32_t all_lanes = (1u << lane_count) - 1;

std::uint32_t count_of(std::uint32_t lanes) noexcept {
  return lanes == all_lanes ? +lane_count : static_cast<std::uint32_t>(std::popcount(lanes));
}

/// Input of a block of sixteen contacts. Reads the caller's arrays themselves, or a copy padded with zeros
/// where the arrays end within the block.
class BlockInput {
 public:
  BlockInput(const GroupStep& step, std::size_t first)
      : first_(first),
        count_(std::min<std::size_t>(step.group.count - first, lane_count)),
        x(column(step.displacement[0], copies_[0])),
        y(column(step.displacement[1], copies_[1])),
        load(column(step.normal_load, copies_[2])),
        velocity{column(step.velocity[0], copies_[3]), column(step.velocity[1], copies_[4])} {}

 private:
  const std::size_t first_, count_;
  LaneColumn<double> copies_[5];

 public:
  const double *const x, *const y, *const load;
  const double* const velocity[2];

  LaneChecks check(const LaneBlock& b) const noexcept {
    const LaneInput in{{x, y}, load, nullptr, 0.0, 0, false};
    return b.kernels->check(in, velocity, b.load, b.lightest, highest_load);
  }
  /// Returns the lanes, as bits, whose motions change nothing: no displacement, and the load that the lane
  /// already has (`loads`).
  std::uint32_t still(const LaneColumn<double>& loads) const noexcept {
    std::uint32_t bits = 0;
    for (std::uint32_t i = 0; i < lane_count; ++i)
      bits |= (x[i] == 0.0 && y[i] == 0.0 && load[i] == loads.lane[i] ? 1u : 0u) << i;
    return bits;
  }

 private:
  const double* column(Span<const double> from, LaneColumn<double>& copy) const noexcept {
    static constexpr LaneColumn<double> zeros{};
    if (from.empty()) return zeros.lane;
    if (count_ == lane_count) return from.data() + first_;
    copy = {};
    std::copy_n(from.data() + first_, count_, copy.lane);
    return copy.lane;
  }
};

/// Returns the lanes among `lanes`, as bits, whose motions are refused as bad input.
std::uint32_t find_bad(const GroupStep& step, std::size_t first, int axes, std::uint32_t lanes) noexcept {
  std::uint32_t bad = 0;
  for (; lanes != 0; lanes &= lanes - 1) {
    const int lane = std::countr_zero(lanes);
    if (!is_good_motion(axes, motion_of(step, first + static_cast<std::size_t>(lane)))) bad |= 1u << lane;
  }
  return bad;
}

/// Writes the last force again as the answer of lanes whose contacts stay at rest.
void answer_at_rest(const LaneBlock& b, std::uint32_t lanes, LaneAnswers& answers) noexcept {
  for (; lanes != 0; lanes &= lanes - 1) {
    const auto i = static_cast<std::uint32_t>(std::countr_zero(lanes));
    for (int axis = 0; axis < 2; ++axis)
      answers.end[axis].lane[i] = answers.mean[axis].lane[i] = b.force[axis].lane[i];
    answers.stiffness.lane[i] = b.state.stiffness.lane[i] * b.lengths_per_metre;
    answers.dissipated.lane[i] = answers.contact_loss.lane[i] = answers.slid.lane[i] = 0.0;
  }
}

/// Writes the responses of sixteen contacts without dampers to the caller's arrays, from contact `first` on.
/// `may_overload`: whether the load of any of them may be above max_normal_load.
void write_columns(const LaneBlock& b, const double* load, bool may_overload, const LaneAnswers& answers,
                   const LaneColumn<double> (&force)[2], const GroupStep& to, std::size_t first,
                   Status& status) noexcept {
  const CompiledMaterial& m = *b.material;
  const auto write = [first](const auto& column, const auto& value) {
    if (column.empty()) return;
    auto* const at = column.data() + first;
    for (std::uint32_t i = 0; i < lane_count; ++i) at[i] = value(i);
  };
  const auto copy = [&write](const Span<double>& column, const LaneColumn<double>& from) {
    write(column, [&from](std::uint32_t i) { return from.lane[i]; });
  };
  static constexpr LaneColumn<double> zeros{};
  for (int axis = 0; axis < 2; ++axis) {
    const bool moves = axis < b.axes;
    copy(to.end[axis], moves ? force[axis] : zeros);
    copy(to.elastic[axis], moves ? force[axis] : zeros);
    if (has(b.outputs, Outputs::mean)) copy(to.mean[axis], moves ? answers.mean[axis] : zeros);
    copy(to.damper[axis], zeros);
  }
  write(to.stiffness, [&](std::uint32_t i) { return answers.stiffness.lane[i] * b.stiffest; });
  copy(to.damping, zeros);
  write(to.force_limit, [&](std::uint32_t i) { return m.peak_coefficient * load[i] * b.strongest; });
  if (has(b.outputs, Outputs::energy)) {
    copy(to.dissipated, answers.dissipated);
    copy(to.contact_loss, answers.contact_loss);
    copy(to.damper_work, zeros);
    write(to.snaps, [&](std::uint32_t i) { return static_cast<std::uint64_t>(answers.slid.lane[i]); });
  }
  if (!may_overload) {
    write(to.status, [](std::uint32_t) { return Status::ok; });
    return;
  }
  const auto status_of = [&](std::uint32_t i) { return b.overload_status(i, load[i]); };
  for (std::uint32_t i = 0; i < lane_count; ++i) status = status | status_of(i);
  write(to.status, status_of);
}

}  // namespace

Motion motion_of(const GroupStep& s, std::size_t i) noexcept {
  const auto number = [i](Span<const double> column) { return column.empty() ? 0.0 : column[i]; };
  Motion motion;
  motion.id = s.group[i];
  motion.normal_load = s.normal_load[i];
  motion.has_velocity = s.velocity[0].empty() ? 0 : 1;
  for (int axis = 0; axis < 2; ++axis) {
    motion.displacement[axis] = number(s.displacement[axis]);
    motion.velocity[axis] = number(s.velocity[axis]);
  }
  return motion;
}

void write_response(const GroupStep& to, std::size_t i, Outputs computed, const Response& r) noexcept {
  const auto write = [i](const auto& column, const auto& value) {
    if (!column.empty()) column[i] = value;
  };
  for (int axis = 0; axis < 2; ++axis) {
    write(to.end[axis], r.end[axis]);
    write(to.elastic[axis], r.elastic[axis]);
    write(to.damper[axis], r.damper[axis]);
    if (has(computed, Outputs::mean)) write(to.mean[axis], r.mean[axis]);
  }
  write(to.stiffness, r.stiffness);
  write(to.damping, r.damping);
  write(to.force_limit, r.force_limit);
  if (has(computed, Outputs::energy)) {
    write(to.dissipated, r.dissipated);
    write(to.contact_loss, r.contact_loss);
    write(to.damper_work, r.damper_work);
    write(to.snaps, r.snaps);
  }
  write(to.status, r.status);
}

void GroupColumns::step_block(LaneBlock& b, StepOutcome& outcome) const noexcept {
  const std::size_t first = b.first;
  const std::uint32_t asked = std::exchange(b.asked, 0);
  const BlockInput in(step, first);
  const LaneChecks checks = in.check(b);
  // With one axis, a motion along the second axis is bad input as well.
  const bool other_axis = b.axes == 1 && !(step.displacement[1].empty() && step.velocity[1].empty());
  const std::uint32_t bad = checks.any_bad || other_axis ? find_bad(step, first, b.axes, asked) : 0;
  std::uint32_t resting = 0;
  if (checks.any_still && step.velocity[0].empty())
    resting = (checks.all_still ? all_lanes : in.still(b.load)) & b.rests & asked & ~bad;
  const std::uint32_t moving = asked & ~bad & ~resting;
  const bool whole = asked == all_lanes && bad == 0 && !b.damps_at_all();
  const bool direct = whole && stores && moving == all_lanes;
  LaneAnswers answers;
  LaneOutput out = answers.columns();
  if (direct) {
    for (int axis = 0; axis < 2; ++axis) out.end[axis] = b.force[axis].lane;
    if (step.stiffness.empty()) out.stiffness = nullptr;
  }
  if (moving != 0) b.run(b, {{in.x, in.y}, in.load, nullptr, dt, moving, stores, b.ahead()}, out);
  outcome.visited += std::uint64_t{b.springs} * count_of(moving);
  outcome.stepped += count_of(asked & ~bad);
  if (stores) {
    if (direct)
      std::copy_n(in.load, +lane_count, b.load.lane);
    else
      for (std::uint32_t left = moving; left != 0; left &= left - 1) {
        const auto lane = static_cast<std::uint32_t>(std::countr_zero(left));
        note_step(b, lane, in.load[lane], answers);
      }
    b.rests |= moving;
  }
  if (whole) {
    answer_at_rest(b, resting, answers);
    write_columns(b, in.load, checks.any_above, answers, stores ? b.force : answers.end, step, first,
                  outcome.status);
    return;
  }
  for (std::uint32_t left = asked; left != 0; left &= left - 1) {
    const auto lane = static_cast<std::uint32_t>(std::countr_zero(left));
    Response response;
    if ((bad >> lane & 1u) != 0)
      write_refusal(b.outputs, response.status = Status::bad_input, response);
    else if ((resting >> lane & 1u) != 0)
      answer_resting_lane(b, lane, response);
    else
      answer_lane(b, lane, motion_of(step, first + lane), dt, answers, response);
    write_response(step, first + lane, b.outputs, response);
    outcome.status = outcome.status | response.status;
  }
}

}  // namespace bristle::detail
