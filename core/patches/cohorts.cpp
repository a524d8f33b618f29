#include "core/patches/cohorts.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <new>

#include "core/common/hashing.hpp"
#include "core/common/range_check.hpp"

namespace bristle::detail {
namespace {

constexpr double farthest_base = 16.0;   // scaled: from the base, before it follows the patch
constexpr double straight = 0x1p-12;     // sine of the angle within which a slide counts as straight
constexpr double highest_energy = 1e300;

double& cohort(CohortPatch& p, std::uint32_t i, CohortColumn column) noexcept {
  return p.rows[i / cohort_lanes * cohort_row + column * cohort_lanes + i % cohort_lanes];
}
double cohort(const double* rows, std::uint32_t i, CohortColumn column) noexcept {
  return rows[i / cohort_lanes * cohort_row + column * cohort_lanes + i % cohort_lanes];
}
double mass_of(const double* rows, std::uint32_t i) noexcept {
  return std::floor(cohort(rows, i, cohort_fresh) * cohort(rows, i, cohort_left));
}
/// u of a cohort of whole mass m: floor(u S) is m again, half a unit from the next.
double fresh_mass(double mass, double left) noexcept { return (mass + 0.5) / left; }

void clear_lane(double* rows, std::uint32_t i) noexcept {
  double* const lane = rows + i / cohort_lanes * cohort_row + i % cohort_lanes;
  for (std::uint32_t c = 0; c < cohort_columns; ++c) lane[c * cohort_lanes] = 0.0;
  lane[cohort_reach * cohort_lanes] = unused_reach;
}

void clear_rows(CohortPatch& p) noexcept {
  for (std::uint32_t i = 0; i < p.capacity; ++i) clear_lane(p.rows.get(), i);
  p.count = 0;
  p.open[0] = p.open[1] = no_cohort;
  p.moment[0] = p.moment[1] = 0.0;
  p.slack = -1.0;
}

/// The last cohort takes the place of cohort i.
void remove_cohort(CohortPatch& p, std::uint32_t i) noexcept {
  const std::uint32_t last = --p.count;
  for (std::uint32_t& open : p.open)
    if (open == i)
      open = no_cohort;
    else if (open == last)
      open = i;
  if (i != last)
    for (std::uint32_t c = 0; c < cohort_columns; ++c) {
      const auto column = static_cast<CohortColumn>(c);
      cohort(p, i, column) = cohort(p, last, column);
    }
  clear_lane(p.rows.get(), last);
}

double to_lengths(std::int64_t fixed) noexcept { return static_cast<double>(fixed) * length_per_fixed; }
std::int64_t to_fixed(double lengths) noexcept { return std::llrint(lengths * fixed_per_length); }
std::int64_t wrapped_difference(std::int64_t to, std::int64_t from) noexcept {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(to) - static_cast<std::uint64_t>(from));
}
std::int64_t wrapped_sum(std::int64_t a, std::int64_t b) noexcept {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) + static_cast<std::uint64_t>(b));
}

/// Where the patch is, from the base.
double place(const CohortState& s, int axis) noexcept {
  return to_lengths(wrapped_difference(s.position[axis], s.base[axis]));
}

double newtons_per_unit(const CohortPatch& p) noexcept {
  return p.material->material.bristle_stiffness * p.material->metres_per_length * p.overload /
         p.units_per_bristle();
}
/// Of a unit of mass x length^2.
double joules_per_unit(const CohortPatch& p) noexcept {
  return 0.5 * newtons_per_unit(p) * p.material->metres_per_length;
}

double squares_of(const CohortPatch& p, std::uint32_t i) noexcept {
  const double zx = place(p, 0) - cohort(p.rows.get(), i, cohort_x);
  const double zy = place(p, 1) - cohort(p.rows.get(), i, cohort_y);
  return zx * zx + zy * zy;
}

double all_squares(const CohortPatch& p) noexcept {
  double sum = 0.0;
  for (std::uint32_t i = 0; i < p.count; ++i) sum += mass_of(p.rows.get(), i) * squares_of(p, i);
  return sum;
}

void find_moment(CohortPatch& p) noexcept {
  double x = 0.0;
  double y = 0.0;
  for (std::uint32_t i = 0; i < p.count; ++i) {
    const double mass = mass_of(p.rows.get(), i);
    x += mass * cohort(p.rows.get(), i, cohort_x);
    y += mass * cohort(p.rows.get(), i, cohort_y);
  }
  p.moment[0] = x;
  p.moment[1] = y;
}

/// The rank above which exactly `wanted` of the mass lies: Newton on a sum that is piecewise linear, between
/// bounds that close in.
double find_cut(const CohortPatch& p, double first, double wanted) noexcept {
  double low = 0.0;
  double high = p.mass;
  double cut = std::clamp(first, low, high);
  for (int i = 0; i < 100; ++i) {
    double mass, density;
    p.kernels->mass_above(p, p.rows.get(), cut, &mass, &density);
    const double excess = mass - wanted;
    if (std::abs(excess) < 0.5) break;
    (excess > 0.0 ? low : high) = cut;
    double next = density > 0.0 ? cut + excess / density : low;
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    if (next == cut) break;
    cut = next;
  }
  return cut;
}

/// What cohort i keeps when all above the rank `cut` leaves, and its new ranks below `all`.
double cut_cohort(CohortPatch& p, std::uint32_t i, double cut, double all) noexcept {
  double& low = cohort(p, i, cohort_low);
  double& high = cohort(p, i, cohort_high);
  const double mass = mass_of(p.rows.get(), i);
  double kept = mass;
  if (high > cut) {
    kept = std::floor(mass * std::clamp((cut - low) / (high - low), 0.0, 1.0) + 0.5);
    high = std::max(cut, low);
  }
  // Ranks end where the load does.
  if (high > all) {
    low = std::max(0.0, low - (high - all));
    high = all;
  }
  if (high - low < 0.5) low = std::max(0.0, high - 0.5);
  return kept;
}

/// Load falls: the last in are the first out. Returns mass x |z|^2 of what leaves.
double shed(CohortPatch& p, double mass_now) noexcept {
  if (mass_now == 0.0) {
    const double squares = all_squares(p);
    clear_rows(p);
    p.mass = 0.0;
    return squares;
  }
  const double wanted = p.mass - mass_now;
  const double cut = find_cut(p, mass_now, wanted);
  double kept_sum = 0.0;
  std::uint32_t largest = 0;
  double most_kept = -1.0;
  double squares = all_squares(p);
  for (std::uint32_t i = 0; i < p.count; ++i) {
    const double kept = cut_cohort(p, i, cut, mass_now);
    kept_sum += kept;
    if (kept > most_kept) {
      most_kept = kept;
      largest = i;
    }
    cohort(p, i, cohort_fresh) = kept > 0.0 ? fresh_mass(kept, cohort(p, i, cohort_left)) : 0.0;
  }
  // Each was rounded: what is missing or too much, a few units, is made up by the largest.
  cohort(p, largest, cohort_fresh) =
      fresh_mass(most_kept + (mass_now - kept_sum), cohort(p, largest, cohort_left));
  for (std::uint32_t i = p.count; i-- > 0;)
    if (cohort(p, i, cohort_fresh) == 0.0) remove_cohort(p, i);
  p.mass = mass_now;
  find_moment(p);
  return squares - all_squares(p);
}

/// Load rises: bristles come into contact straight. Returns mass x |z|^2 that joining loses.
double admit(CohortPatch& p, double mass_now) noexcept {
  const double at[2] = {place(p, 0), place(p, 1)};
  const double entered = mass_now - p.mass;
  const double low = p.mass;
  p.mass = mass_now;
  const double dx = at[0] - p.begin[1][0];
  const double dy = at[1] - p.begin[1][1];
  double lost = 0.0;
  const bool joins = p.open[1] != no_cohort && dx * dx + dy * dy <= p.law.piece * p.law.piece;
  if (!joins && p.count == p.capacity) lost += p.kernels->make_room(p.law, p, p.rows.get(), at);
  lost += p.kernels->enter(p.law, p, p.rows.get(), at, entered, low, mass_now, joins);
  for (int axis = 0; axis < 2; ++axis) p.moment[axis] += entered * at[axis];
  return lost;
}

/// Load above the highest rises: the same bristles carry it, and no force changes at rest.
void scale_deflections(CohortPatch& p, double factor) noexcept {
  const double at[2] = {place(p, 0), place(p, 1)};
  for (std::uint32_t i = 0; i < p.count; ++i) {
    double& x = cohort(p, i, cohort_x);
    double& y = cohort(p, i, cohort_y);
    x = at[0] - (at[0] - x) * factor;
    y = at[1] - (at[1] - y) * factor;
  }
  p.slack = -1.0;
  find_moment(p);
}

/// Places count from near the patch again.
void follow(CohortPatch& p) noexcept {
  for (int axis = 0; axis < 2; ++axis) {
    const double now = place(p, axis);
    if (std::abs(now) <= farthest_base) continue;
    const double shift = std::floor(now);
    p.base[axis] = wrapped_sum(p.base[axis], to_fixed(shift));
    p.moment[axis] -= shift * p.mass;
    for (auto& begin : p.begin) begin[axis] -= shift;
    for (std::uint32_t i = 0; i < p.count; ++i) cohort(p, i, axis == 0 ? cohort_x : cohort_y) -= shift;
  }
}

/// One step between its parts.
struct CohortStep {
  CohortMove move{};
  std::int64_t to[2];       ///< position at the end, fixed point
  double length = 0.0;      ///< scaled, of the whole step
  double carried = 0.0;     ///< of which the patch is carried along as it stands
  double displacement[2];   ///< m
  double velocity[2];       ///< m/s
  double contact_loss = 0.0;
};

CohortStep begin_step(const CohortPatch& p, CohortState& s, const Motion& motion, double dt_s) noexcept {
  CohortStep step;
  // Clamped so that squares and sums stay finite: no snap length is near.
  constexpr double farthest = 1e150;
  double d[2];
  double largest = 0.0;
  for (int axis = 0; axis < 2; ++axis) {
    step.displacement[axis] = motion.displacement[axis];
    const double v =
        motion.has_velocity ? motion.velocity[axis] : motion.displacement[axis] / std::max(dt_s, 1e-300);
    step.velocity[axis] = std::clamp(v, -1e150, 1e150);
    step.to[axis] = s.position[axis];
    step.move.from[axis] = step.move.to[axis] = place(s, axis);
    d[axis] = std::clamp(motion.displacement[axis] * p.material->lengths_per_metre, -farthest, farthest);
    largest = std::max(largest, std::abs(d[axis]));
  }
  if (largest == 0.0) return step;
  if (largest <= far_length)
    for (double& x : d) x = to_lengths(to_fixed(x));  // what the position can hold
  step.length = std::sqrt(d[0] * d[0] + d[1] * d[1]);
  if (step.length == 0.0) return step;
  double* const e = step.move.direction;
  for (int axis = 0; axis < 2; ++axis) e[axis] = d[axis] / step.length;

  // A straight slide that has forgotten its beginning is carried along.
  const bool goes_on = std::abs(e[0] * s.direction[1] - e[1] * s.direction[0]) <= straight &&
                       e[0] * s.direction[0] + e[1] * s.direction[1] > 0.0;
  if (!goes_on) {
    s.run = 0.0;
    s.direction[0] = e[0];
    s.direction[1] = e[1];
  }
  const double followed = std::min(step.length, std::max(p.law.forget - s.run, 0.0));
  step.carried = step.length - followed;
  s.run = std::min(s.run + step.length, p.law.forget);
  step.move.length = followed;
  if (followed == 0.0) return step;
  for (int axis = 0; axis < 2; ++axis) {
    const double part = step.carried > 0.0 ? e[axis] * followed : d[axis];
    step.to[axis] = wrapped_sum(s.position[axis], to_fixed(part));
    step.move.to[axis] = to_lengths(wrapped_difference(step.to[axis], s.base[axis]));
  }
  return step;
}

bool holds_still(const CohortState& s, const CohortStep& step) noexcept {
  const double x = to_lengths(wrapped_difference(step.to[0], s.anchor[0]));
  const double y = to_lengths(wrapped_difference(step.to[1], s.anchor[1]));
  const double slack = s.slack - 0x1p-40;  // more than what rounding does to a deflection
  return slack > 0.0 && x * x + y * y < slack * slack;
}

void run_step(const CohortPatch& p, CohortState& s, double* rows, const CohortStep& step,
              CohortTotals& t) noexcept {
  if (step.move.length > 0.0 && s.mass > 0.0) {
    if (!p.skips || !holds_still(s, step)) {
      p.kernels->move[p.options.axes - 1](p.law, s, rows, step.move, t);
      for (int axis = 0; axis < 2; ++axis) s.anchor[axis] = step.to[axis];
    }
    if (t.pieces == 0) {
      // Nothing snapped. (Path that is only carried along counts when all of it is slid.)
      s.run = 0.0;
      for (int axis = 0; axis < 2; ++axis)
        t.integral[axis] = step.move.length * (s.mass * ((step.move.from[axis] + step.move.to[axis]) * 0.5) -
                                               s.moment[axis]);
    }
  }
  for (int axis = 0; axis < 2; ++axis) s.position[axis] = step.to[axis];
  if (step.carried > 0.0) {
    for (int axis = 0; axis < 2; ++axis) {
      const double carried = step.carried * (s.mass * step.move.to[axis] - s.moment[axis]);
      t.integral[axis] += carried;
      t.lost += 2.0 * carried * step.move.direction[axis];
    }
    t.snapped += s.mass * std::min(step.carried, 1e15) / p.law.mean;
  }
}

/// Damper and lubricant of the whole patch, N s/m.
double find_damping(const CohortPatch& p, const CohortStep& step) noexcept {
  const Material& m = p.material->material;
  if (p.normal_load <= 0.0) return 0.0;
  if (m.bristle_damping == 0.0) return m.viscous_friction;
  const double speed = std::sqrt(step.velocity[0] * step.velocity[0] + step.velocity[1] * step.velocity[1]);
  return p.zeta * m.damping_at(speed) + m.viscous_friction;
}

void write_response(const CohortPatch& p, const CohortState& s, const CohortStep& step, const CohortTotals& t,
                    Response& out) noexcept {
  const bool mean = has(p.options.outputs, Outputs::mean);
  const double newtons = newtons_per_unit(p);
  const double damping = find_damping(p, step);
  out.status = p.overload > 1.0 ? Status::overload : Status::ok;
  double work = 0.0;
  for (int axis = 0; axis < 2; ++axis) {
    // 0 - x: no negative zero for a patch at rest.
    const double sum = s.mass * step.move.to[axis] - s.moment[axis];
    out.damper[axis] = 0.0 - damping * step.velocity[axis];
    out.elastic[axis] = 0.0 - newtons * sum;
    out.end[axis] = out.elastic[axis] + out.damper[axis];
    if (mean)
      out.mean[axis] = step.length > 0.0 ? 0.0 - newtons * (t.integral[axis] / step.length) + out.damper[axis]
                                         : out.end[axis];
    work -= std::clamp(out.damper[axis] * step.displacement[axis], -highest_energy, highest_energy);
  }
  out.stiffness = p.zeta * p.material->material.bristle_stiffness;
  out.damping = damping;
  out.force_limit = p.material->peak_coefficient * p.normal_load;
  if (has(p.options.outputs, Outputs::energy)) {
    out.dissipated = std::min(joules_per_unit(p) * t.lost, highest_energy) + p.pending_dissipated;
    out.contact_loss = step.contact_loss + p.pending_loss;
    out.damper_work = work;
    out.snaps = static_cast<std::uint64_t>(
        std::min(t.snapped / p.units_per_bristle() + p.pending_snaps, 9e18));
  }
}

}  // namespace

void CohortPatch::Free::operator()(double* memory) const noexcept {
  ::operator delete[](memory, std::align_val_t{64});
}

std::shared_ptr<const CohortBrush> make_cohort_brush(const CompiledMaterial& material) {
  const SnapLength& law = material.material.snap_length;
  if (material.material.snap_rule != SnapRule::redraw)
    throw Error(
        "PatchOptions: population = infinite needs SnapRule::redraw; with SnapRule::keep bristles never forget "
        "their phases: use population = representatives");
  if (law.cv() < least_cohort_spread)
    refuse("PatchOptions: population = infinite", "snap_length.cv", law.cv(),
           "at least 0.05; bristles of nearly one length snap in step: use population = representatives");
  auto brush = std::make_shared<CohortBrush>();
  brush->table = make_survival_table(law, material.lengths_per_metre);
  brush->cv = law.cv();
  return brush;
}

void set_resolution(CohortPatch& p, double resolution) noexcept {
  p.resolution = resolution;
  // Laws narrower than most need finer pieces: what snaps in one step of theirs is a larger share.
  const double mean = p.brush->table.mean;
  p.law.piece = mean / resolution * std::min(1.0, p.brush->cv / 0.25);
  p.law.slow = 2.0 * mean;
  const double share = p.law.piece / mean;
  p.law.negligible = 0x1p-12 * share * share * share;
}

std::unique_ptr<CohortPatch> make_cohorts(std::shared_ptr<const CompiledMaterial> material,
                                          std::shared_ptr<const CohortBrush> brush,
                                          const PatchOptions& options, const CohortKernels& kernels,
                                          double resolution, std::uint32_t cohorts) {
  constexpr const char* where = "PatchOptions";
  require_within(where, "max_normal_load", options.max_normal_load, 1e-15, 1e15, "N");
  if (options.axes != 1 && options.axes != 2) refuse(where, "axes", options.axes, "1 or 2");
  if (options.step_rule != StepRule::exact)
    throw Error("PatchOptions: population = infinite has no StepRule::literal; use StepRule::exact, or "
                "population = representatives");
  if (resolution == 0.0) resolution = default_resolution;
  require_within(where, "resolution", resolution, 1.0, 256.0, "pieces per mean snap length, 0 = automatic");
  if (cohorts != 0 && (cohorts < 8 || cohorts > most_cohorts))
    refuse(where, "cohorts", cohorts, "0 (automatic) or 8 to 512");
  auto patch = std::make_unique<CohortPatch>();
  CohortPatch& p = *patch;
  p.options = options;
  p.material = std::move(material);
  p.brush = std::move(brush);
  p.kernels = &kernels;
  p.zeta_max = p.material->material.bristles_in_contact(options.max_normal_load);
  const SurvivalTable& table = p.brush->table;
  p.law.cells = table.cells.data();
  p.law.end = table.end;
  p.law.sure = table.sure;
  p.law.mean = table.mean;
  p.law.forget = table.forget;
  set_resolution(p, resolution);
  if (cohorts == 0)
    cohorts = std::max(default_cohorts, static_cast<std::uint32_t>(std::min(4.0 / p.law.piece, 256.0)));
  p.capacity = (cohorts + cohort_lanes - 1) / cohort_lanes * cohort_lanes;
  p.rows.reset(static_cast<double*>(::operator new[](p.row_numbers() * sizeof(double), std::align_val_t{64})));
  clear_rows(p);
  return patch;
}

void reset_cohorts(CohortPatch& p) noexcept {
  CohortContact fresh;
  fresh.capacity = p.capacity;
  fresh.zeta_max = p.zeta_max;
  static_cast<CohortContact&>(p) = fresh;
  clear_rows(p);
}

double apply_cohort_load(CohortPatch& p, double normal_load_n) noexcept {
  if (normal_load_n == p.normal_load) return 0.0;
  p.normal_load = normal_load_n;
  p.zeta = p.material->material.bristles_in_contact(normal_load_n);
  // The maximum itself is no overload, whatever rounding made of it.
  const double overload = p.zeta > p.zeta_max * (1.0 + 1e-14) ? p.zeta / p.zeta_max : 1.0;
  const double mass = std::floor(std::min(p.zeta / p.zeta_max, 1.0) * full_mass + 0.5);
  double loss = 0.0;
  const double joules = joules_per_unit(p);
  if (mass < p.mass)
    loss = joules * shed(p, mass);
  else if (mass > p.mass)
    loss = joules * admit(p, mass);
  if (overload != p.overload) {
    const double before = joules * all_squares(p);
    if (overload > p.overload) scale_deflections(p, p.overload / overload);
    p.overload = overload;
    loss += before - joules_per_unit(p) * all_squares(p);
  }
  p.run = 0.0;
  return loss;
}

void step_cohorts(CohortPatch& p, const Motion& motion, double dt_s, Response& out) noexcept {
  const double loss = apply_cohort_load(p, motion.normal_load);
  CohortStep step = begin_step(p, p, motion, dt_s);
  step.contact_loss = loss;
  CohortTotals totals{};
  run_step(p, p, p.rows.get(), step, totals);
  write_response(p, p, step, totals, out);
  p.pending_dissipated = p.pending_loss = 0.0;
  // Whole bristles are reported, the rest stays.
  const double snaps = totals.snapped / p.units_per_bristle() + p.pending_snaps;
  p.pending_snaps = snaps - std::floor(snaps);
  follow(p);
}

void find_cohorts(const CohortPatch& p, const Motion& motion, double dt_s, Response& out) noexcept {
  CohortState s = p;
  const CohortStep step = begin_step(p, s, motion, dt_s);
  CohortTotals totals{};
  if (p.skips && holds_still(s, step)) {
    run_step(p, s, nullptr, step, totals);
  } else {
    alignas(64) double rows[most_cohorts / cohort_lanes * cohort_row];
    const std::size_t numbers = std::min(p.used_numbers() + cohort_row, p.row_numbers());
    std::memcpy(rows, p.rows.get(), numbers * sizeof(double));
    run_step(p, s, rows, step, totals);
  }
  write_response(p, s, step, totals, out);
}

double find_stored_energy(const CohortPatch& p) noexcept { return joules_per_unit(p) * all_squares(p); }

double count_mass(const CohortPatch& p) noexcept {
  double sum = 0.0;
  for (std::uint32_t i = 0; i < p.count; ++i) sum += mass_of(p.rows.get(), i);
  return sum;
}

std::uint64_t hash_cohorts(const CohortPatch& p) noexcept {
  Hasher hasher;
  for (int axis = 0; axis < 2; ++axis) {
    hasher.add(static_cast<std::uint64_t>(p.position[axis]));
    hasher.add(static_cast<std::uint64_t>(p.base[axis]));
    for (double x : {p.moment[axis], p.direction[axis], p.begin[0][axis], p.begin[1][axis]}) hasher.add(x);
    hasher.add(std::uint64_t{p.open[axis]});
  }
  for (double x : {p.mass, p.run, p.normal_load, p.overload}) hasher.add(x);
  for (std::uint32_t i = 0; i < p.count; ++i)
    for (std::uint32_t c = 0; c < cohort_columns; ++c)
      hasher.add(cohort(p.rows.get(), i, static_cast<CohortColumn>(c)));
  return hasher.value();
}

void copy_cohorts(const CohortPatch& from, CohortPatch& to) noexcept {
  const std::uint32_t capacity = to.capacity;
  static_cast<CohortContact&>(to) = from;
  to.capacity = capacity;
  for (std::uint32_t i = 0; i < capacity; ++i) clear_lane(to.rows.get(), i);
  std::memcpy(to.rows.get(), from.rows.get(), from.used_numbers() * sizeof(double));
}

void take_over(CohortPatch& to, const CohortPatch& from) noexcept {
  const double ratio = from.material->metres_per_length * to.material->lengths_per_metre;  // power of two
  copy_cohorts(from, to);
  const bool same_law = to.material->material.snap_length == from.material->material.snap_length;
  if (same_law) {
    // The load may now mean another number of bristles.
    const double load = from.normal_load;
    to.normal_load = -1.0;
    to.pending_loss += apply_cohort_load(to, load);
    return;
  }
  // Fresh lengths of the new law: bristles beyond theirs snap at once, straight where the patch is.
  for (int axis = 0; axis < 2; ++axis) to.base[axis] = to.position[axis];
  double snapped = 0.0;
  double squares = 0.0;
  const double at[2] = {place(from, 0), place(from, 1)};
  for (std::uint32_t i = 0; i < to.count; ++i) {
    const double mass = mass_of(to.rows.get(), i);
    double& x = cohort(to, i, cohort_x);
    double& y = cohort(to, i, cohort_y);
    x = (x - at[0]) * ratio;
    y = (y - at[1]) * ratio;
    const double square = x * x + y * y;
    cohort(to, i, cohort_fresh) = mass + 0.5;
    const double kept = to.kernels->renew(to.law, to.rows.get(), i, std::sqrt(square));
    snapped += mass - kept;
    squares += (mass - kept) * square;
  }
  to.open[0] = to.open[1] = no_cohort;
  for (std::uint32_t i = to.count; i-- > 0;)
    if (cohort(to, i, cohort_fresh) == 0.0) remove_cohort(to, i);
  to.slack = -1.0;
  to.run = 0.0;
  to.pending_dissipated += joules_per_unit(to) * squares;
  to.pending_snaps += snapped / to.units_per_bristle();
  if (snapped > 0.0) {
    const double here[2] = {0.0, 0.0};
    if (to.count == to.capacity)
      to.pending_dissipated += joules_per_unit(to) * to.kernels->make_room(to.law, to, to.rows.get(), here);
    to.kernels->enter(to.law, to, to.rows.get(), here, snapped, 0.0, to.mass, false);
    to.open[1] = no_cohort;
  }
  find_moment(to);
  const double load = from.normal_load;
  to.normal_load = -1.0;
  to.pending_loss += apply_cohort_load(to, load);
}

}  // namespace bristle::detail
