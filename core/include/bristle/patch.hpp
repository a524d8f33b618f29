// Input and output of a step of one contact patch.
#pragma once

#include <cstdint>

#include "bristle/set_field.hpp"
#include "bristle/span.hpp"

namespace bristle {

/// Names a patch of one batch. Slot and generation: a removed id never names a later patch. 0 = none.
struct PatchId {
  std::uint64_t value = 0;
  /// Id that a full pool (KeyedPatches) gives a new contact: a motion with it gets Status::no_capacity.
  static constexpr PatchId no_capacity() noexcept { return {~std::uint64_t{0}}; }
  /// Whether the id can name a patch: not 0 and not no_capacity().
  explicit operator bool() const noexcept { return value != 0 && value != no_capacity().value; }
  friend bool operator==(PatchId a, PatchId b) noexcept { return a.value == b.value; }
  friend bool operator!=(PatchId a, PatchId b) noexcept { return a.value != b.value; }
};

enum class Precision : unsigned char { single, double_ };

namespace detail {
/// Modes kept for comparison by tests and studies. Not part of the interface.
struct ComparisonModes {
  bool literal = false;  ///< the paper's loop: z += v dt; if |z| > delta then z = 0. Loses the overshoot
  bool random_lengths = false;  ///< first snap lengths drawn one by one: error of order n^-1/2
};
}  // namespace detail

/// Kind of population that stands for the bristles of a patch.
enum class Population : unsigned char {
  automatic,        ///< `infinite` where the law allows it and no number of bristles is asked for, else
                    ///< `representatives`. The default.
  representatives,  ///< n bristles, each with its deflection and snap length
  infinite          ///< infinitely many: a list of cohorts, without noise and seed. Needs SnapRule::redraw;
                    ///< computes in double whatever `precision` says
};

/// Results computed in addition to the force at the end of a step. Combine with |.
enum class Outputs : unsigned char {
  end = 0,     ///< force at the end of the step: always computed
  mean = 1,    ///< force averaged over the step, exactly
  energy = 2,  ///< the outputs dissipated, contact_loss, damper_work and snaps
  all = 3
};
constexpr Outputs operator|(Outputs a, Outputs b) noexcept {
  return static_cast<Outputs>(static_cast<unsigned>(a) | static_cast<unsigned>(b));
}
constexpr bool has(Outputs set, Outputs wanted) noexcept {
  return (static_cast<unsigned>(set) & static_cast<unsigned>(wanted)) == static_cast<unsigned>(wanted);
}

/// Value of `bristles`, `cohorts` and `resolution` that lets the library choose.
constexpr std::uint32_t automatic = 0;

/// Direction of a surface that resists differently along and across it, and to and fro: a machined lay,
/// fabric, hair, skis, scales. The limit of the elastic force is an ellipse with its centre at or beside
/// zero. All ratios 1 are no lay, to the bit. Dampers, lubricant and strengthening with speed know no
/// direction.
///
/// In steady sliding the force dissipates most (it is the point of the limit curve whose normal is the
/// motion) while stiffness_ratio is limit_ratio squared; with another ratio it is another point of the curve,
/// and every slide still takes energy. Equations: core/MODEL.md, section 33.
struct Lay {
  double angle = 0.0;        ///< rad, -2 pi to 2 pi, from the patch's x axis to the direction "along"
  double limit_ratio = 1.0;  ///< limit of the force across over the limit along, 0.01 to 100; the limit along
                             ///< is the material's

  /// Stiffness of a bristle across over along, 1e-4 to 1e4; 0 = limit_ratio squared. Another ratio needs
  /// representatives and a material without residual.
  double stiffness_ratio = 0.0;
  /// Limit of motion along the direction over that against it, 0.01 to 100; their mean is the material's.
  /// Motion across is then pushed along, too: the ellipse is moved, not cut. Other than 1 it needs
  /// SnapRule::slide without drop and ageing, and stiffness_ratio 0.
  double to_over_fro = 1.0;

  Lay& with_angle(double radians) { return detail::set(*this, angle, radians); }
  Lay& with_limit_ratio(double across_over_along) {
    return detail::set(*this, limit_ratio, across_over_along);
  }
  Lay& with_stiffness_ratio(double across_over_along) {
    return detail::set(*this, stiffness_ratio, across_over_along);
  }
  Lay& with_to_over_fro(double ratio) { return detail::set(*this, to_over_fro, ratio); }
  friend bool operator==(const Lay& x, const Lay& y) noexcept {
    return x.angle == y.angle && x.limit_ratio == y.limit_ratio && x.stiffness_ratio == y.stiffness_ratio &&
           x.to_over_fro == y.to_over_fro;
  }
};

/// Options of a patch's simulation. Outputs that are not requested are neither computed nor stored.
struct PatchOptions {
  double max_normal_load = 1.0;  ///< N, > 0, load at which zeta_max bristles are in contact; a larger load
                                 ///< scales the forces of all

  /// n, representatives at max load; automatic: one per physical bristle, at most 4096. Population::automatic
  /// reads any other number as a request for representatives. SnapRule::slide: strata of the law, all in
  /// contact under every load; automatic: 32.
  std::uint32_t bristles = automatic;
  int axes = 2;  ///< 1 or 2 tangential directions; 1 uses displacement[0] only
  Outputs outputs = Outputs::end;
  Precision precision = Precision::single;
  std::uint32_t seed = 1;  ///< seed of lengths and draws: patches that differ in it are independent
  std::uint64_t key = 0;   ///< name that the caller gives the contact (a body pair and a point)
  Population population = Population::automatic;
  std::uint32_t cohorts = automatic;  ///< Population::infinite: largest number of cohorts of the patch, 8 to
                                      ///< 512

  /// Population::infinite: pieces of path per mean snap length, 1 to 128; automatic: 8. Time grows with it.
  /// In sliding the error falls with its square until cohorts merge. Under a load that changes at random the
  /// error stays at 0.5 % of the force (lognormal, cv 0.3) to 3 % (cv 1).
  double resolution = automatic;
  std::uint32_t fluctuation = 0;  ///< Population::infinite: the force fluctuates as that of this many
                                  ///< bristles, keyed by `seed`; 0 = no noise
  Lay lay;                        ///< direction of the surface, in the patch's axes (for an outline in those
                                  ///< of the surface); fixed
  detail::ComparisonModes compared;

  PatchOptions& with_max_normal_load(double newtons) { return detail::set(*this, max_normal_load, newtons); }
  PatchOptions& with_bristles(std::uint32_t count) { return detail::set(*this, bristles, count); }
  PatchOptions& with_axes(int count) { return detail::set(*this, axes, count); }
  PatchOptions& with_outputs(Outputs set) { return detail::set(*this, outputs, set); }
  PatchOptions& with_precision(Precision value) { return detail::set(*this, precision, value); }
  PatchOptions& with_seed(std::uint32_t value) { return detail::set(*this, seed, value); }
  PatchOptions& with_population(Population value) { return detail::set(*this, population, value); }
  PatchOptions& with_cohorts(std::uint32_t count) { return detail::set(*this, cohorts, count); }
  PatchOptions& with_resolution(double pieces) { return detail::set(*this, resolution, pieces); }
  PatchOptions& with_fluctuation(std::uint32_t bristles_) {
    return detail::set(*this, fluctuation, bristles_);
  }
  PatchOptions& with_lay(const Lay& value) { return detail::set(*this, lay, value); }
  PatchOptions& with_key(std::uint64_t value) { return detail::set(*this, key, value); }
};

/// Largest number of representative bristles of one patch.
constexpr std::uint32_t max_bristles_per_patch = 1u << 26;

/// Input of one patch for one step. NaN, infinity, a negative load or one above 1e15 N set
/// Status::bad_input.
struct Motion {
  PatchId id;
  double displacement[2] = {0.0, 0.0};  ///< m, displacement of the moving body over the step; small ones add
                                        ///< up without loss
  double normal_load = 0.0;             ///< N, normal load over the whole step, 0 to 1e15
  std::uint8_t has_velocity = 0;        ///< whether `velocity` is given (not 0); else it is displacement / dt
  double velocity[2] = {0.0, 0.0};      ///< m/s, slip velocity, for the damper and viscous terms only
};

/// Status of a response, a set of flags. `ok` means that the motion was carried out as requested.
enum class Status : std::uint32_t {
  ok = 0,
  unknown_id = 1,   ///< no such patch (never added, or removed); nothing changed
  repeated_id = 2,  ///< patch named twice in one step: the first motion counted, this one changed nothing
  bad_input = 4,    ///< NaN, infinity, negative load, dt <= 0 (or denormal) or motion on an axis the patch
                    ///< lacks: state kept, force zero
  overload = 8,     ///< load above max_normal_load: forces of all bristles scaled
  no_capacity = 16  ///< the pool had no patch left for this contact (KeyedOptions::capacity): force zero
};
constexpr Status operator|(Status a, Status b) noexcept {
  return static_cast<Status>(static_cast<std::uint32_t>(a) | static_cast<std::uint32_t>(b));
}
constexpr bool has(Status set, Status wanted) noexcept {
  return (static_cast<std::uint32_t>(set) & static_cast<std::uint32_t>(wanted)) != 0;
}
/// Whether the motion of a response with this status was carried out.
constexpr bool was_stepped(Status status) noexcept {
  return !has(status, Status::unknown_id | Status::repeated_id | Status::bad_input | Status::no_capacity);
}

/// Output of one patch for one step: forces in N ON the moving body. Output fields that the patch does not
/// compute are not written.
struct Response {
  PatchId id;
  Status status = Status::ok;
  double end[2] = {0.0, 0.0};      ///< N, force at the end of the step: elastic + damper
  double elastic[2] = {0.0, 0.0};  ///< N, part of `end` from bent bristles
  double damper[2] = {0.0, 0.0};   ///< N, part of `end` and of `mean` from dampers and lubricant
  double mean[2] = {0.0, 0.0};     ///< N, force averaged over the step (Outputs::mean)
  double stiffness = 0.0;  ///< N/m, zeta sigma0: F(d + e) ~ F - stiffness e in sticking; an upper bound,
                           ///< of the stiffest direction of a lay
  double damping = 0.0;    ///< N s/m, zeta sigma1(v) + sigma2, and where friction strengthens with speed
                           ///< a N asinh(v / (2 v*)) / v: the secant, never negative

  /// N, highest elastic force at first loading under this load. With ageing it assumes that all bristles have
  /// held as long as the oldest can have; with a lay it is that of its strongest direction.
  double force_limit = 0.0;
  double dissipated = 0.0;    ///< J, lost in snaps in this step (Outputs::energy)
  double contact_loss = 0.0;  ///< J, energy of bristles that lost contact (Outputs::energy)
  double damper_work = 0.0;   ///< J, taken by dampers and lubricant; negative if the given velocity
                              ///< opposes the displacement (Outputs::energy)
  std::uint64_t snaps = 0;    ///< number of representatives' snaps (Outputs::energy); an estimate where they
                              ///< jump
};

/// Present state and memory use of a patch. See PatchBatch::info.
struct PatchInfo {
  std::uint64_t key = 0;
  std::uint32_t representatives = 0;  ///< n, allocated; Population::infinite: the resolution, rounded up
  std::uint32_t detail = 0;           ///< representatives in use, at most n: see PatchBatch::set_detail
  double weight = 0.0;                ///< w = zeta_max / detail, physical bristles per representative
  double active = 0.0;                ///< representatives in contact, a real number
  double normal_load = 0.0;           ///< N, load of the last step
  double max_normal_load = 0.0;       ///< N, load from which all representatives are in contact
  std::uint64_t memory_bytes = 0;     ///< bytes of this patch's state
  std::uint32_t bytes_per_representative = 0;
  const char* kernel = "";  ///< variant in use, e.g. "2 axes, redraw, end + mean, single"; lives for ever
};

}  // namespace bristle
