// Makes and resets an infinite brush, a patch of infinitely many bristles that are stored as cohorts.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/common/range_check.hpp"
#include "core/patches/cohorts/cohorts.hpp"

namespace bristle::detail {
namespace {

constexpr const char* where = "PatchOptions with population infinite";
/// Longest path to steady sliding (RenewalLaw::forget) that is trusted, in mean snap lengths. The search for
/// it goes twice as far.
constexpr double longest_solved = 20.0;

void reset(Patch& p, std::uint32_t seed, std::uint64_t key) noexcept {
  Cohorts& r = cohorts(p);
  r.options.seed = seed;
  r.options.key = key;
  const std::uint32_t capacity = r.capacity;
  static_cast<CohortScalars&>(r) = CohortScalars{};
  r.capacity = capacity;
  clear_cohorts(r);
  if (r.ageing != nullptr) *r.ageing = CohortAgeing{};
  p = make_shared_part(r, *p.model);
  note_cohorts(p);
}

void copy(const Patch& from, Patch& to, std::byte* memory) noexcept {
  const Cohorts& original = cohorts(from);
  std::memcpy(memory, static_cast<const void*>(&original), sizeof original);
  auto& made = *reinterpret_cast<Cohorts*>(memory);
  place_columns(made, column_memory(&made));
  std::memcpy(made.rows, original.rows, original.used_numbers() * sizeof(double));
  for (std::uint32_t i = original.used_numbers() / cohort_columns; i < made.capacity; ++i)
    clear_lane(made.rows, i);
  if (made.ageing != nullptr)
    std::memcpy(static_cast<void*>(made.ageing), static_cast<const void*>(original.ageing),
                sizeof *made.ageing + made.capacity * sizeof(double));
  to = from;
  to.record = &made;
}

void describe(const Patch& p, PatchInfo& info) noexcept {
  const Cohorts& r = cohorts(p);
  info.representatives = r.pieces;
  info.weight = 0.0;
  info.max_normal_load = p.material().material.load_on_bristles(r.zeta_max());
  info.active = r.mass / full_mass * r.pieces;
  info.bytes_per_representative = static_cast<std::uint32_t>(r.bytes / r.pieces);
  info.kernel = kernel_name(p, BristleKind::infinite, 0u, true);
}

constexpr ContactModel cohorts_model = {.name = "cohorts",
                                        .apply_load = &apply_cohort_load,
                                        .advance = &advance_cohorts,
                                        .find_new_bound = &find_cohort_bound,
                                        .reset = &reset,
                                        .take_over = &take_over_cohorts,
                                        .copy = &copy,
                                        .stored_energy = &find_cohort_energy,
                                        .hash = &hash_cohorts,
                                        .describe = &describe,
                                        .read_bristles = &read_cohorts,
                                        .signature = &cohort_signature,
                                        .save = &save_cohorts,
                                        .find_fault = &find_cohort_fault,
                                        .restore = &restore_cohorts};

void check(const Material& material, const PatchOptions& options) {
  if (material.snap_rule != SnapRule::redraw)
    throw Error(std::string(where) +
                ": the material has SnapRule::keep, whose bristles never forget their phases; infinite needs "
                "SnapRule::redraw (or use Population::representatives)");
  const double cv = material.snap_length.cv();
  if (cv < least_cohort_spread)
    refuse(where, "snap_length.cv", cv,
           "at least 0.05: bristles of nearly one length snap in step (or use Population::representatives)");
  if (options.resolution != 0.0)
    require_within(where, "resolution", options.resolution, 1.0, highest_resolution,
                   "pieces per mean snap length; 0 = automatic");
}

/// Returns the length of the shortest step at whose end the mean deflection depends on the step's direction
/// alone: the length h at which square / 2 - kinetic h / 2 + share h^2 is 0; if there is none, that at which
/// this is least.
double find_long_step(double kinetic, double square, double share) noexcept {
  const double lowest = 0.25 * kinetic / share;
  const double root = lowest * lowest - 0.5 * square / share;
  return lowest - (root > 0.0 ? std::sqrt(root) : 0.0);
}

/// Returns the largest number of cohorts of a new patch, in proportion to the pieces of path that the law
/// needs in a mean snap length. Above the default resolution it grows with the square, because merging would
/// otherwise cause larger errors than pieces do. Below, growing with the square would nearly double the error
/// in the same time.
std::uint32_t choose_capacity(const Cohorts& r) noexcept {
  const double finer = r.options.resolution / default_resolution;
  const double pieces = r.law.mean / r.law.piece;
  const double most = std::min<double>(most_cohorts, 256.0 * finer);
  const double wanted = default_cohorts / default_resolution * pieces * std::max(finer, 1.0);
  return (static_cast<std::uint32_t>(std::clamp(wanted, 24.0, most)) + cohort_lanes - 1) / cohort_lanes *
         cohort_lanes;
}

}  // namespace

void set_pieces(Cohorts& r) noexcept {
  const double resolution = r.options.resolution;
  const double mean = r.law.mean;
  // Makes pieces of path shorter if many snap lengths are nearly equal, in the whole law or in a group of
  // lengths. Otherwise many bristles would snap within one piece.
  double share = r.material->survival().finest / resolution;
  // Makes pieces shorter under strong shared renewal, since its effect changes along the length 1 / (kappa x
  // snap rate).
  const double renewals = r.law.renewal * r.law.snap_rate * mean;
  if (renewals > 1.5) share *= 1.5 / renewals;
  r.law.piece = std::min(mean * share, longest_piece_share * r.law.end);
  r.law.slow = 2.0 * mean;
  // Lets pieces grow less under a wide law. Many bristles would snap twice in a long piece.
  r.law.longest_growth = r.material->material.snap_length.cv() > 0.6 ? 1.5 : 4.0;
  // Computes the share of mass below which a cohort is negligible. In steady sliding a cohort begins with the
  // share `share` of the mass; under a wide law it matters until only the share `weak` of that is left.
  r.law.negligible = std::min(0x1p-10 * share * share * share, share * r.material->survival().weak);
  // Sets the path after which a step counts as having forgotten its start. Fine pieces get a longer one: the
  // effect of a turn falls to a tenth along 0.3 of it, and fine pieces tolerate less of that effect. Laws
  // with corners and renewal get none, since under them a turn may be remembered for longer.
  r.forget = 0.0;
  const bool renews = r.law.renewal > 0.0;
  if ((renews && !r.material->survival().smooth) || r.ages()) return;
  const double solved = r.material->renewal().forget * mean;
  const double finer = std::max(resolution / default_resolution, 1.0);
  double forget = solved * (1.0 + 0.25 * std::log2(finer)) + r.law.residual;
  // Takes a longer path without renewal. The longest bristles, if bent against the slide, must unbend and
  // snap; and bristles that a turn has brought into step snap again about a mean length later.
  if (!renews) forget = std::max(forget + mean, 2.0 * (r.law.end + r.law.residual));
  if (solved < longest_solved * mean && forget < r.follow) r.forget = forget;
}

bool allows_cohorts(const Material& material) noexcept {
  return material.snap_rule == SnapRule::redraw && material.snap_length.cv() >= least_cohort_spread;
}

Patch make_cohorts(std::shared_ptr<const CompiledMaterial> material, const PatchOptions& options,
                   const KernelTable& kernels, double zeta_max) {
  check(material->material, options);
  Cohorts made;
  made.kernels = kernels.cohorts;
  const SurvivalTable& table = material->survival();
  made.material = material.get();
  made.options = options;
  if (options.resolution == 0.0) made.options.resolution = default_resolution;
  made.pieces = static_cast<std::uint32_t>(std::ceil(made.options.resolution));
  made.first_seed = options.seed;
  made.endless = true;
  made.full_weight =
      zeta_max > 0.0 ? zeta_max : material->material.bristles_in_contact(options.max_normal_load);
  made.largest_work = static_cast<std::uint32_t>(full_mass / mass_per_count);
  made.law.cells = table.cells.data();
  made.law.end = table.end;
  made.law.sure = table.sure;
  made.law.mean = table.mean;
  // Adds 2 l_r to the paths `forget` and `follow`, because after a reversal bristles first go from one
  // residual deflection to the opposite one.
  const double reversed = 2.0 * material->residual;
  made.law.forget = table.forget + reversed;
  // Moves merged cohorts apart to pairs of Gauss points only if the law's survival function has no corners.
  // In a uniform slide their squared distance has to grow by the factor 1.33; most_apart limits the factor.
  made.law.most_apart = table.smooth ? 1.6 : 1.0;
  made.law.residual = material->residual;
  made.law.renewal = material->material.shared_renewal;
  made.law.snap_rate = material->snap_rate;
  // Follows the cohorts along the shorter path `forget` under shared renewal, where an error of one slide is
  // forgotten by later ones.
  const bool renewed = made.law.renewal * made.law.snap_rate * table.forget > 1.0;
  made.follow = (renewed ? table.forget : table.follow) + reversed;
  // Computes mean deflection and mean square of steady sliding as if without renewal. Renewal lowers both,
  // but they only serve to judge lengths of path.
  const double kinetic = 0.5 * table.square / table.mean;
  const double square = table.cube / (3.0 * table.mean);
  made.memory = square / kinetic;
  made.node_distance = made.memory / 8.0;
  made.per_lag = 1.0 / (0.45 * made.memory);
  made.highest_curve = 1.0 / (16.0 * made.memory);
  made.chord_share = (1.0 + made.law.residual * made.law.snap_rate * (1.0 + made.law.renewal)) / 12.0;
  made.long_step = find_long_step(kinetic, square, 1.0 / 12.0);
  set_pieces(made);
  made.capacity = zeta_max > 0.0 ? options.bristles : choose_capacity(made);
  made.options.bristles = made.capacity;

  Cohorts* r = make_record(std::move(material), made);
  r->glides = !r->ages();
  clear_cohorts(*r);
  if (r->ageing != nullptr) *r->ageing = CohortAgeing{};
  Patch p = make_shared_part(*r, cohorts_model);
  note_cohorts(p);
  return p;
}

}  // namespace bristle::detail
