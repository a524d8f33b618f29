// Input and output of a step of one contact patch.
#pragma once

#include <cmath>
#include <cstdint>

#include "bristle/export.hpp"
#include "bristle/set_field.hpp"
#include "bristle/span.hpp"

namespace bristle {

/// Id of a patch in one batch; 0 = none. No later patch gets the id of a removed one, so an old id is
/// refused.
struct PatchId {
  std::uint64_t value = 0;
  /// Id that a full pool (KeyedPatches) gives a new contact: a motion with it gets Status::no_capacity and
  /// zero force.
  static constexpr PatchId no_capacity() noexcept { return {~std::uint64_t{0}}; }
  /// Returns whether the id can name a patch: it is neither 0 nor no_capacity().
  explicit operator bool() const noexcept { return value != 0 && value != no_capacity().value; }
  friend bool operator==(PatchId a, PatchId b) noexcept { return a.value == b.value; }
  friend bool operator!=(PatchId a, PatchId b) noexcept { return a.value != b.value; }
};

enum class Precision : unsigned char { single, double_ };

/// Kind of population that stands for the bristles of a patch.
enum class Population : unsigned char {
  /// `infinite` where the law allows it and no number of bristles is asked for, otherwise `representatives`.
  /// The default.
  automatic,
  representatives,  ///< n bristles, each with its deflection and snap length
  /// Infinitely many bristles, stored as a list of cohorts: no noise. Needs SnapRule::redraw.
  infinite
};

/// Results computed in addition to the force at the end of a step. Combine with |.
enum class Outputs : unsigned char {
  end = 0,     ///< force at the end of the step: always computed
  mean = 1,    ///< force averaged over the step, exactly
  energy = 2,  ///< the energies `dissipated`, `contact_loss` and `damper_work`, and the number of snaps
  all = 3
};
constexpr Outputs operator|(Outputs a, Outputs b) noexcept {
  return static_cast<Outputs>(static_cast<unsigned>(a) | static_cast<unsigned>(b));
}
constexpr bool has(Outputs set, Outputs wanted) noexcept {
  return (static_cast<unsigned>(set) & static_cast<unsigned>(wanted)) == static_cast<unsigned>(wanted);
}

/// Value of a number in PatchOptions or BatchOptions that leaves the choice of the number to the library.
constexpr std::uint32_t automatic = 0;

/// Direction (lay) of a surface that resists differently along and across it, and to and fro: machined
/// grooves, fabric, hair, skis, scales. The limit of the elastic force is an ellipse with its centre at or
/// beside zero. With all ratios 1 results are, to the bit, those without a lay. Dampers, lubricant and
/// strengthening with speed do not depend on the direction.
///
/// In steady sliding the force is the one on that ellipse that dissipates most (the ellipse's normal there is
/// the direction of motion) if stiffness_ratio is limit_ratio squared. With another ratio it is another point
/// of the ellipse, and every slide still takes energy. Equations: core/MODEL.md, section 33.
struct Lay {
  double angle = 0.0;  ///< rad, -2 pi to 2 pi, from the patch's x axis to the direction "along"
  /// Force limit across the direction over that along it, 0.01 to 100; the material gives the limit along.
  double limit_ratio = 1.0;

  /// Stiffness of a bristle across the direction over its stiffness along it, 1e-4 to 1e4; 0 means
  /// limit_ratio squared, with which the force in steady sliding is the one that dissipates most.
  /// Population::infinite and materials with a residual length refuse any other value.
  double stiffness_ratio = 0.0;
  /// Force limit for motion along the direction over that against it, 0.01 to 100; the material gives their
  /// mean. Motion across is then pushed along, too, because the ellipse of limits is moved off zero. A ratio
  /// other than 1 needs SnapRule::slide without drop and ageing, and stiffness_ratio 0.
  double to_over_fro = 1.0;

  Lay& with_angle(double radians) { return detail::set(*this, angle, radians); }
  Lay& with_limit_ratio(double across_over_along) {
    return detail::set(*this, limit_ratio, across_over_along);
  }
  Lay& with_stiffness_ratio(double across_over_along) {
    return detail::set(*this, stiffness_ratio, across_over_along);
  }
  Lay& with_to_over_fro(double ratio) { return detail::set(*this, to_over_fro, ratio); }
  friend BRISTLE_API bool operator==(const Lay& x, const Lay& y) noexcept;
};

/// Options of a patch's simulation. Outputs that are not requested are neither computed nor stored.
struct PatchOptions {
  /// Load at which all bristles are in contact, N, > 0. A larger load scales the force of every
  /// representative; an infinite brush or SnapRule::slide only reports it (Status::overload).
  double max_normal_load = 1.0;

  /// Number of representative bristles, all in contact at max_normal_load; automatic: one per physical
  /// bristle, at most 4096. With any other number Population::automatic chooses representatives.
  /// SnapRule::slide: strata of the snap-length law, all in contact under every load; automatic: 32; more
  /// than 4096 count as 4096.
  std::uint32_t bristles = automatic;
  int axes = 2;  ///< 1 or 2 tangential directions; with 1, displacement[1] must be 0
  Outputs outputs = Outputs::end;
  Precision precision = Precision::single;
  std::uint32_t seed = 1;  ///< seed of random snap lengths; patches with different seeds are independent
  /// The caller's key of the contact, which together with `seed` determines the random renewals.
  std::uint64_t key = 0;
  Population population = Population::automatic;

  /// Population::infinite: accuracy, as the number of pieces of path per mean snap length, 1 to 128;
  /// automatic: 8. The number of cohorts is twelve times that, 24 to 384. Time and memory grow with both, and
  /// in sliding the error falls with the square of the resolution. With 8, under a load that changes at
  /// random, the rms error is below 2 % (lognormal, cv 0.3) or 6 % (cv 1): test_random_laws.
  double resolution = automatic;
  Lay lay;  ///< direction of the surface, in the patch's axes (for an outline in those of the surface); fixed

  PatchOptions& with_max_normal_load(double newtons) { return detail::set(*this, max_normal_load, newtons); }
  PatchOptions& with_bristles(std::uint32_t count) { return detail::set(*this, bristles, count); }
  PatchOptions& with_axes(int count) { return detail::set(*this, axes, count); }
  PatchOptions& with_outputs(Outputs set) { return detail::set(*this, outputs, set); }
  PatchOptions& with_precision(Precision value) { return detail::set(*this, precision, value); }
  PatchOptions& with_seed(std::uint32_t value) { return detail::set(*this, seed, value); }
  PatchOptions& with_population(Population value) { return detail::set(*this, population, value); }
  PatchOptions& with_resolution(double pieces) { return detail::set(*this, resolution, pieces); }
  PatchOptions& with_lay(const Lay& value) { return detail::set(*this, lay, value); }
  PatchOptions& with_key(std::uint64_t value) { return detail::set(*this, key, value); }
};

/// Largest number of representative bristles of one patch.
constexpr std::uint32_t max_bristles_per_patch = 1u << 26;

/// Input of one patch for one step. NaN, infinity, a negative load or one above 1e15 N set
/// Status::bad_input.
struct Motion {
  PatchId id;
  /// Displacement of the moving body over the step, m; small ones add up without loss.
  double displacement[2] = {0.0, 0.0};
  double normal_load = 0.0;         ///< normal load over the whole step, N, 0 to 1e15
  std::uint8_t has_velocity = 0;    ///< whether `velocity` is given (not 0); if not, it is displacement / dt
  double velocity[2] = {0.0, 0.0};  ///< slip velocity, for Response::damper, damping and damper_work, m/s
};

/// Status of a response, a set of flags. `ok` means that the motion was executed as requested.
enum class Status : std::uint32_t {
  ok = 0,
  unknown_id = 1,   ///< no such patch (never added, or removed); nothing changed
  repeated_id = 2,  ///< patch named twice in one step: the first motion counted, this one changed nothing
  /// NaN, infinity, load not within 0 to 1e15 N, dt <= 0 (or denormal), or motion on an axis that the patch
  /// lacks. The patch keeps its state and the force is zero.
  bad_input = 4,
  overload = 8,     ///< load above max_normal_load
  no_capacity = 16  ///< the pool had no patch left for this contact (KeyedOptions::capacity): force zero
};
constexpr Status operator|(Status a, Status b) noexcept {
  return static_cast<Status>(static_cast<std::uint32_t>(a) | static_cast<std::uint32_t>(b));
}
constexpr bool has(Status set, Status wanted) noexcept {
  return (static_cast<std::uint32_t>(set) & static_cast<std::uint32_t>(wanted)) != 0;
}
/// Whether the motion of a response with this status was executed.
constexpr bool was_stepped(Status status) noexcept {
  return !has(status, Status::unknown_id | Status::repeated_id | Status::bad_input | Status::no_capacity);
}

/// Output of one patch for one step: forces in N ON the moving body. Output fields that the patch's options
/// do not ask for are not written.
struct Response {
  PatchId id;
  Status status = Status::ok;
  double end[2] = {0.0, 0.0};      ///< force at the end of the step, N: elastic + damper
  double elastic[2] = {0.0, 0.0};  ///< part of `end` from bent bristles, N
  double damper[2] = {0.0, 0.0};   ///< part of `end` and `mean` from dampers, lubricant, strengthening, N
  double mean[2] = {0.0, 0.0};     ///< force averaged over the step (Outputs::mean), N
  /// Fall of the force per displacement while bristles stick, zeta sigma0, N/m; with bristles that slide or
  /// snap, an upper bound. With a lay, that of its stiffest direction.
  double stiffness = 0.0;
  /// Force over speed of dampers, lubricant and strengthening with speed (the secant, not the slope at that
  /// speed), N s/m; never negative.
  double damping = 0.0;

  /// Upper bound of the elastic force at first loading under this load, N, as implicit solvers need it: the
  /// highest force of that loading, or, with SnapRule::slide, the force of all bristles at their static
  /// limits, which a drop keeps first loading from reaching. With ageing all bristles count as if stuck for
  /// as long as the oldest can have been; with a lay the bound is that of its strongest direction.
  double force_limit = 0.0;
  double dissipated = 0.0;  ///< energy lost by snaps, renewals and slides, J (Outputs::energy)
  /// Elastic energy lost with bristles that lost contact because the load fell, or weight, J
  /// (Outputs::energy).
  double contact_loss = 0.0;
  /// Energy taken by the force `damper`, J; negative if the given velocity opposes the displacement
  /// (Outputs::energy).
  double damper_work = 0.0;
  /// An infinite brush counts the snaps of the physical bristles that it stands for; representatives count
  /// their own.
  std::uint64_t snaps = 0;  ///< number of snaps (Outputs::energy), an estimate where a jump skips a path
};
/// Returns whether a response has a force but no mean force: its patch computes none (Outputs::mean).
inline bool lacks_mean(const Response& r) noexcept {
  const auto is_zero = [](const double(&force)[2]) {
    return !(std::fabs(force[0]) + std::fabs(force[1]) > 0.0);
  };
  return is_zero(r.mean) && !is_zero(r.elastic);
}

/// Present state and memory use of a patch. See PatchBatch::info.
struct PatchInfo {
  std::uint64_t key = 0;
  /// Number of representatives; Population::infinite: the resolution, rounded up.
  std::uint32_t representatives = 0;
  double weight = 0.0;             ///< w, physical bristles per representative; Population::infinite: 0
  double active = 0.0;             ///< number of representatives in contact, not always whole
  double normal_load = 0.0;        ///< load of the last step, N
  double max_normal_load = 0.0;    ///< load from which all representatives are in contact, N
  std::uint64_t memory_bytes = 0;  ///< bytes of this patch's state
  std::uint32_t bytes_per_representative = 0;
  const char* kernel = "";  ///< variant in use, e.g. "2 axes, redraw, end + mean, single"; lives for ever
};

}  // namespace bristle
