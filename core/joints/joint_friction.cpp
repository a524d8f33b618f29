#include "bristle/joint_friction.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <string>
#include <vector>

#include "core/common/check_fields.hpp"
#include "core/common/little_endian.hpp"
#include "core/common/saved_head.hpp"
#include "core/joint_table.hpp"
#include "core/materials/strata.hpp"
#include "core/patches/fields.hpp"
#include "core/runtime/chosen_kernels.hpp"
#include "core/runtime/float_mode.hpp"
#include "core/runtime/sharing.hpp"

namespace bristle {

using namespace detail;

namespace {

constexpr double most_angle = 1e6, most_speed = 1e9, most_torque = 1e12;
constexpr const char* where = "JointFriction";

/// Time of a joint's bristle over that of a patch's bristle (`bristle_bench`, `joints/` and `in_cache/`).
constexpr std::uint64_t joint_bristle_cost = 2;

/// Column of one number for each of 16 joints, the unit in which kernels read and write. Left uninitialised,
/// because a kernel uses only the rows that its variant needs.
struct alignas(64) Column {
  double lane[lane_count];
};

/// Numbers of a material in the order of JointParameter.
using Numbers = double[joint_parameters];

/// Returns, as bits, the features that a joint's material needs (friction by load, static friction), by which
/// a kernel variant is chosen.
std::uint32_t features_of(const Numbers& numbers) {
  std::uint32_t features = 0;
  for (std::uint32_t p = joint_base; p < joint_stribeck_speed; ++p) {
    if (numbers[p] == 0.0) continue;
    for (const std::uint32_t bit : {joint_loaded, joint_drops})
      if (!JointLayout::uses(p, ~bit)) features |= bit;
  }
  return features;
}

std::uint32_t bristles_of(const JointOptions& options) {
  require_fields("JointOptions", options);
  return static_cast<std::uint32_t>(options.bristles);
}

bool is_within(double x, double most) noexcept { return std::fabs(x) <= most; }

/// Calls visit(column, rule) for each saved number of a joint, in the order of saving. The rule is the
/// number's allowed range: a bristle's tip stays between the angles that its joint has had, and its bound
/// leaves ample room.
template <class Visit>
void joint_fields(const JointLayout& layout, Visit&& visit) {
  constexpr FieldRule angle{"angle", -most_angle, most_angle}, tip{"tip", -1e24, 1e24},
      slid{.name = "slid", .least = 0.0, .most = 1.0, .whole = true}, gradient{"gradient", -1e100, 1e100};
  visit(layout.before, angle);
  for (std::uint32_t c = layout.tips; c < layout.columns; ++c)
    visit(c, c < layout.slid ? tip : c < layout.gradients ? slid : gradient);
}

}  // namespace

struct BRISTLE_PRIVATE JointFriction::Impl {
  Impl(std::size_t joints, Span<const JointMaterial> materials, const JointOptions& options,
       const BatchOptions& batch)
      : table(choose_kernels(batch.isa)),
        work(check_threads(batch)),
        count(joints),
        bristles(bristles_of(options)),
        layout(0, 0) {
    if (joints > std::size_t{1} << 28) refuse(where, "joints", static_cast<double>(joints), "0 to 2^28");
    if (materials.empty()) throw Error(std::string(where) + ": a material is needed");
    const FloatModeScope mode;
    std::vector<Column> numbers(materials.size());
    for (std::size_t m = 0; m < materials.size(); ++m) {
      require_fields("JointMaterial", materials[m]);
      Numbers its;
      std::memcpy(its, &materials[m], sizeof its);
      variant |= features_of(its);
      const double speed = its[joint_stribeck_speed];
      its[joint_stribeck_speed] = speed > 0.0 ? 1.0 / (speed * speed) : 0.0;
      std::copy_n(its, +joint_parameters, numbers[m].lane);
      // Sets the speed factor so that the exponential of static friction is 0 in sliding, for a joint without
      // a Stribeck speed.
      numbers[m].lane[joint_parameters] = speed > 0.0 ? 0.0 : 80.0;
    }
    // Computes derivatives, for gradients, also by parameters that are 0 in all materials: a gradient descent
    // may begin at 0.
    if (options.gradients) variant |= joint_gradients | joint_loaded | joint_drops;
    layout = JointLayout(variant, bristles);
    const Strata strata = make_strata(SnapLength::lognormal(1.0, options.spread), bristles);
    share = strata.share;
    length = strata.length;
    patterns = std::max<std::size_t>(
        std::min(blocks(), materials.size() / std::gcd(materials.size(), std::size_t{lane_count})), 1);
    constants.resize(patterns * layout.constants);
    for (std::size_t i = 0; i < patterns * lane_count; ++i) {
      const Column& its = numbers[i % numbers.size()];
      const auto put = [&](std::uint32_t c, double x) {
        constants[i / lane_count * layout.constants + c].lane[i % lane_count] = x;
      };
      for (std::uint32_t p = 0; p < joint_parameters; ++p)
        if (JointLayout::uses(p, variant)) put(layout.parameter[p], its.lane[p]);
      if ((variant & joint_drops) != 0) put(layout.least_decay, its.lane[joint_parameters]);
    }
    columns.resize(blocks() * layout.columns);
    for (std::size_t i = 0; i < blocks() * lane_count; ++i) straighten(i);
    // Sets the angle of the unused lanes behind the last joint to 0. Without an angle they would count as
    // joints before their first step, which send the whole block down a slow path.
    for (std::size_t i = count; i < blocks() * lane_count; ++i) at(i, layout.before) = 0.0;
  }

  const KernelTable& table;
  const JointKernels& kernels = *table.joints;
  SharedWork work;
  const std::size_t count;
  const std::uint32_t bristles;
  std::uint32_t variant = 0;
  JointLayout layout;
  std::vector<double> share, length;
  /// Number of blocks of 16 joints after which the sequence of materials repeats, which is the number of
  /// blocks of constants stored.
  std::size_t patterns = 1;
  std::vector<Column> constants;  ///< columns of material constants for the first `patterns` blocks
  std::vector<Column> columns;    ///< columns of all blocks of 16 joints, one block after the other

  // Input of the step in progress, stored here so that the threads which share the step can read it.
  Span<const double> in[in_writes];  ///< the caller's arrays, by rows of the kernel
  Span<double> out[out_gradient], gradient;
  Span<Status> status;
  bool stores = true;  ///< whether the step changes the state; false for a trial
  std::uint32_t kernel = 0;
  std::atomic<std::uint32_t> bad{0};

  std::size_t blocks() const noexcept { return (count + lane_count - 1) / lane_count; }
  double& at(std::size_t joint, std::uint32_t column) noexcept {
    return columns[joint / lane_count * layout.columns + column].lane[joint % lane_count];
  }
  const double& at(std::size_t joint, std::uint32_t column) const noexcept {
    return const_cast<Impl*>(this)->at(joint, column);
  }

  void straighten(std::size_t joint) noexcept {
    at(joint, layout.before) = std::numeric_limits<double>::quiet_NaN();
    for (std::uint32_t c = layout.tips; c < layout.columns; ++c) at(joint, c) = 0.0;
  }

  /// Copies 16 of the caller's numbers, one per joint, into a column. Joints behind the last one get zeros,
  /// and so do all joints if the caller gave no array.
  void take(Span<const double> from, std::size_t first, std::size_t n, Column& to) const noexcept {
    if (from.empty() || n < lane_count) to = Column{};
    if (!from.empty()) std::copy_n(from.data() + first, n, to.lane);
  }
  void give(Span<double> to, std::size_t first, std::size_t n, const Column& from) const noexcept {
    if (!to.empty()) std::copy_n(from.lane, n, to.data() + first);
  }

  /// Flags of those joints of a block of 16 that need special treatment in a step.
  struct Odd {
    bool bad[lane_count] = {};    ///< whether the joint's input is out of range in this step
    bool fresh[lane_count] = {};  ///< whether this is the joint's first step since reset
  };
  static bool is_good(const Column* input, std::size_t i) noexcept {
    const bool angle = is_within(input[in_angle].lane[i], most_angle);
    const bool speed = is_within(input[in_speed].lane[i], most_speed);
    const bool motor = is_within(input[in_motor].lane[i], most_torque);
    const bool outside = is_within(input[in_outside].lane[i], most_torque);
    return angle & speed & motor & outside;
  }
  /// Prepares the joints that need special treatment. A joint whose input is out of range gets zeros for all
  /// of it, also for the flag in_writes, so that its state does not change. A joint in its first step gets
  /// straight bristles at its angle.
  Odd prepare_odd(std::size_t first, Column* input) noexcept {
    Odd odd;
    for (std::size_t i = 0; i < lane_count; ++i) {
      const double before = at(first + i, layout.before);
      odd.bad[i] = !is_good(input, i);
      odd.fresh[i] = !odd.bad[i] && !(before == before);
      if (odd.bad[i])
        for (std::uint32_t row = 0; row <= in_writes; ++row) input[row].lane[i] = 0.0;
      if (!odd.fresh[i]) continue;
      at(first + i, layout.before) = input[in_angle].lane[i];
      for (std::uint32_t k = 0; k < bristles; ++k) at(first + i, layout.tips + k) = input[in_angle].lane[i];
    }
    return odd;
  }

  /// Steps block b of 16 joints, and returns how many of them had input out of range.
  std::uint32_t step_block(std::size_t b) noexcept {
    const std::size_t first = b * lane_count;
    const std::size_t n = std::min<std::size_t>(count - first, lane_count);
    Column input[joint_inputs], output[joint_outputs];
    for (std::uint32_t row = 0; row < in_writes; ++row) take(in[row], first, n, input[row]);
    std::fill_n(input[in_writes].lane, +lane_count, stores ? 1.0 : 0.0);
    const double* const before = &at(first, layout.before);
    // Counts in 64-bit integers, as wide as a double, so that the compiler vectorises the loop.
    std::int64_t usual = 0;
    for (std::size_t i = 0; i < lane_count; ++i)
      usual += (is_good(input, i) & (before[i] == before[i])) ? 1 : 0;
    const bool has_odd = usual != lane_count;
    Odd odd;
    if (has_odd) odd = prepare_odd(first, input);

    JointStep step;
    step.bristles = bristles;
    step.share = share.data();
    step.length = length.data();
    step.in = input[0].lane;
    step.out = output[0].lane;
    step.constants = constants[b % patterns * layout.constants].lane;
    step.columns = columns[b * layout.columns].lane;
    kernels.step[kernel](step);

    std::uint32_t faults = 0;
    for (std::size_t i = 0; has_odd && i < n; ++i) {
      if (odd.fresh[i] && !stores) straighten(first + i);
      if (!odd.bad[i]) continue;
      ++faults;
      for (Column& row : output) row.lane[i] = 0.0;
    }
    for (std::uint32_t row = 0; row < out_gradient; ++row) give(out[row], first, n, output[row]);
    if (!gradient.empty())
      for (std::uint32_t p = 0; p < joint_parameters; ++p)
        give(gradient, p * count + first, n, output[out_gradient + p]);
    if (!status.empty())
      for (std::size_t i = 0; i < n; ++i) status[first + i] = odd.bad[i] ? Status::bad_input : Status::ok;
    return faults;
  }

  void run(std::size_t first, std::size_t last) noexcept {
    const FloatModeScope mode;
    std::uint32_t faults = 0;
    for (std::size_t b = first; b < last; ++b) faults += step_block(b);
    if (faults != 0) bad.fetch_add(faults, std::memory_order_relaxed);
  }

  StepReport step(const JointInput& input, const JointOutput& output, bool its_stores) noexcept {
    StepReport report;
    const Span<const double> ins[in_writes] = {input.angle, input.speed, input.motor, input.outside};
    const Span<double> outs[out_gradient] = {output.torque,   output.mean,     output.by_angle,
                                             output.by_speed, output.by_motor, output.by_outside};
    const auto fits = [this](const auto& column) { return column.empty() || column.size() == count; };
    const bool keeps_gradients = (variant & joint_gradients) != 0;
    const bool arrays_fit =
        input.angle.size() == count && std::all_of(std::begin(ins), std::end(ins), fits) &&
        std::all_of(std::begin(outs), std::end(outs), fits) && fits(output.status) &&
        (output.gradient.empty() || (output.gradient.size() == joint_parameters * count && keeps_gradients));
    if (!arrays_fit) {
      for (Status& its : output.status) its = Status::bad_input;
      report.status = Status::bad_input;
      return report;
    }
    std::copy_n(ins, +in_writes, in);
    std::copy_n(outs, +out_gradient, out);
    gradient = output.gradient;
    status = output.status;
    stores = its_stores;
    const bool wants_all = std::any_of(std::begin(out) + 1, std::end(out),
                                       [](const Span<double>& column) { return !column.empty(); });
    kernel = variant | (wants_all ? joint_all_outputs : 0u);
    bad.store(0, std::memory_order_relaxed);
    const std::uint64_t cost = lane_count * (bristles + 8u) * joint_bristle_cost;  // of a block
    work.step_items(
        blocks(), blocks() * cost, [cost](std::size_t) { return cost; },
        [this](std::size_t first, std::size_t last) { run(first, last); }, report);
    const std::uint32_t faults = bad.load(std::memory_order_relaxed);
    report.status = faults == 0 ? Status::ok : Status::bad_input;
    report.patches_stepped = static_cast<std::uint32_t>(count) - faults;
    report.bristles_visited = std::uint64_t{report.patches_stepped} * bristles;
    return report;
  }
};

JointFriction::JointFriction(std::size_t joints, Span<const JointMaterial> materials,
                             const JointOptions& options, const BatchOptions& batch)
    : impl_(std::make_unique<Impl>(joints, materials, options, batch)) {}
JointFriction::~JointFriction() = default;
JointFriction::JointFriction(JointFriction&&) noexcept = default;
JointFriction& JointFriction::operator=(JointFriction&&) noexcept = default;

StepReport JointFriction::step(const JointInput& in, const JointOutput& out) noexcept {
  return impl_->step(in, out, true);
}
StepReport JointFriction::find_torque(const JointInput& in, const JointOutput& out) noexcept {
  return impl_->step(in, out, false);
}

void JointFriction::reset() noexcept {
  for (std::size_t i = 0; i < impl_->count; ++i) impl_->straighten(i);
}
bool JointFriction::reset(std::size_t joint) noexcept {
  if (joint >= impl_->count) return false;
  impl_->straighten(joint);
  return true;
}

std::uint64_t JointFriction::state_hash(std::size_t joint) const noexcept {
  if (joint >= impl_->count) return 0;
  const JointLayout& layout = impl_->layout;
  Hasher hasher;
  hasher.add(impl_->at(joint, layout.before));
  for (std::uint32_t c = layout.tips; c < layout.gradients; ++c) hasher.add(impl_->at(joint, c));
  return hasher.value();
}

std::uint64_t JointFriction::state_hash() const noexcept {
  Hasher hasher;
  for (std::size_t i = 0; i < impl_->count; ++i) hasher.add(state_hash(i));
  return hasher.value();
}

std::size_t JointFriction::state_size() const noexcept {
  return saved_head_size + 2 * sizeof(std::uint64_t) + impl_->layout.columns * impl_->count * sizeof(double);
}

std::size_t JointFriction::save_state(Span<std::byte> to) const noexcept {
  const std::size_t bytes = state_size();
  if (to.size() < bytes) return 0;
  const JointLayout& layout = impl_->layout;
  ByteWriter write(to.data() + saved_head_size);
  write(std::uint64_t{impl_->bristles});
  write(std::uint64_t{impl_->variant});
  for (std::size_t i = 0; i < impl_->count; ++i) {
    joint_fields(layout, [&](std::uint32_t c, const FieldRule&) { write(impl_->at(i, c)); });
  }
  seal(SavedKind::joints, impl_->count, {to.data(), bytes});
  return bytes;
}

void JointFriction::restore_state(Span<const std::byte> from) {
  Impl& impl = *impl_;
  const JointLayout& layout = impl.layout;
  const std::uint64_t count = open_sealed(where, SavedKind::joints, from);
  if (from.size() != state_size()) refuse_saved(where, "is of other joints");
  ByteReader head(from.data() + saved_head_size);
  std::uint64_t bristles = 0, variant = 0;
  head(bristles);
  head(variant);
  if (count != impl.count || bristles != impl.bristles || variant != impl.variant)
    refuse_saved(where, "is of other joints");
  // Restores in two passes over the bytes: the first checks all values, the second writes, so that bad data
  // change nothing.
  for (const bool writes : {false, true}) {
    ByteReader read = head;
    for (std::size_t i = 0; i < impl.count; ++i)
      joint_fields(layout, [&](std::uint32_t c, const FieldRule& rule) {
        double x = 0.0;
        read(x);
        // Allows NaN for a joint that has had no step since its reset, and so has no angle.
        const bool is_none = c == layout.before && x != x;
        if (writes)
          impl.at(i, c) = is_none ? std::numeric_limits<double>::quiet_NaN() : x;
        else if (!is_none && !is_allowed(x, rule))
          refuse_saved(where, std::string("has a value that no joint can have (") + rule.name + ")");
      });
  }
}

std::size_t JointFriction::joint_count() const noexcept { return impl_->count; }
std::size_t JointFriction::memory_bytes() const noexcept {
  return sizeof(Impl) + (impl_->columns.size() + impl_->constants.size()) * sizeof(Column);
}
int JointFriction::threads() const noexcept { return impl_->work.workers.count(); }
const char* JointFriction::isa() const noexcept { return impl_->table.name; }

}  // namespace bristle
