// The fields of the structs of parameters, for programs that read, write, show or bind them: name, unit,
// range and one line of text each. The C interface and its structs, the Python classes, the keys of scenes
// and the checks of ranges are made from these lists, so a new field stands in its struct and here.
//
//   bristle::for_each_field<bristle::Material>(
//       [&](const auto& field) { std::cout << field.name << " " << field.about.unit << "\n"; });
#pragma once

#include <tuple>

#include "bristle/config.hpp"
#include "bristle/keyed_patches.hpp"
#include "bristle/material.hpp"
#include "bristle/patch.hpp"
#include "bristle/patch_batch.hpp"
#if BRISTLE_WITH_BEDS
#include "bristle/bed.hpp"
#endif
#if BRISTLE_WITH_JOINTS
#include "bristle/joint_friction.hpp"
#endif

namespace bristle {

/// Names of the values of an enumeration, in their order: in Python, scenes and reports.
inline constexpr const char* snap_law_names[] = {"single",    "uniform",     "normal",
                                                 "lognormal", "exponential", "table"};
inline constexpr const char* snap_rule_names[] = {"redraw", "keep", "slide"};
inline constexpr const char* damper_decay_names[] = {"exponential", "gaussian"};
inline constexpr const char* ageing_form_names[] = {"logarithmic", "saturating"};
inline constexpr const char* outputs_names[] = {"end", "mean", "energy", "all"};
inline constexpr const char* precision_names[] = {"single", "double"};
inline constexpr const char* population_names[] = {"automatic", "representatives", "infinite"};
inline constexpr const char* bed_kind_names[] = {"row", "ellipse", "rectangle", "list"};
inline constexpr const char* bed_pressure_names[] = {"uniform", "parabolic", "hertz"};
inline constexpr const char* bed_growth_names[] = {"fixed", "cube_root", "square_root"};

/// Name, unit, range and text of a field. A range is the field's own: a value within its range can still be
/// refused together with another field's value.
struct AboutField {
  const char* text;       ///< meaning, in one line
  const char* unit = "";  ///< SI unit; empty for pure numbers
  double least = 0.0;     ///< range of a number, both ends allowed
  double most = 0.0;
  const char* const* names = nullptr;  ///< of an enumeration; null for other fields
  unsigned name_count = 0;
  bool or_zero = false;  ///< whether 0, for a number that is not given, is allowed beside the range

  /// Returns the greatest value of an enumeration; 0 for other fields.
  constexpr unsigned last() const { return name_count > 0 ? name_count - 1 : 0; }
};

template <class Owner, class Value>
struct Field {
  const char* name;
  Value Owner::*member;
  AboutField about;
};

namespace detail {

/// Largest stiffness, damping or speed of a material, in its SI unit. The limit is far beyond any use, and
/// products of a few such numbers stay within a double.
constexpr double largest_parameter = 1e15;
constexpr double smallest_positive = 1e-15;
constexpr double largest_residual_share = 0.98;  // beyond it a snap would hardly change a deflection
constexpr double whole_turn = 6.283185307179586;

constexpr AboutField number(const char* unit, double least, double most, const char* text) {
  return {text, unit, least, most, nullptr, 0};
}
constexpr AboutField number_or_zero(const char* unit, double least, double most, const char* text) {
  return {text, unit, least, most, nullptr, 0, true};
}
constexpr AboutField flag(const char* text) { return number("", 0.0, 1.0, text); }
template <unsigned count>
constexpr AboutField one_of(const char* const (&names)[count], const char* text) {
  return {text, "", 0.0, count - 1.0, names, count};
}
constexpr AboutField part(const char* text) { return {text, "", 0.0, 0.0, nullptr, 0}; }

template <class Owner, class Value>
constexpr Field<Owner, Value> field(const char* name, Value Owner::*member, const AboutField& about) {
  return {name, member, about};
}

}  // namespace detail

// Lists the fields of a struct as calls FIELD(name, about), in the order of the C struct that test_c_structs
// writes from them. The lists are macros, so that the C interface can find its fields by name. A range is
// for every number of an array.

#define BRISTLE_FIELDS_OF_Material(FIELD)                                                                   \
  FIELD(bristle_stiffness, number("N/m", 0.0, largest_parameter, "sigma0: one bristle, tangential."))       \
  FIELD(bristle_damping, number("N s/m", 0.0, largest_parameter, "sigma1: damper of one bristle at rest.")) \
  FIELD(viscous_friction, number("N s/m", 0.0, largest_parameter, "sigma2: lubricant term of the patch."))  \
  FIELD(stribeck_velocity, number("m/s", 0.0, largest_parameter, "vs: decay of dampers; 0 = no damper."))   \
  FIELD(normal_stiffness,                                                                                   \
        number("N/m", smallest_positive, largest_parameter, "sigma_perp: one bristle, normal."))            \
  FIELD(asperity_height_deviation,                                                                          \
        number("m", smallest_positive, largest_parameter, "sigma: deviation of the asperities' heights."))  \
  FIELD(snap_length, part("SnapLength: law of the deflection at which a bristle snaps."))                   \
  FIELD(snap_rule, one_of(snap_rule_names, "behaviour of a bristle at its snap length"))                    \
  FIELD(damper_decay, one_of(damper_decay_names, "decay of the dampers with speed"))                        \
  FIELD(residual_length,                                                                                    \
        number("m", 0.0, largest_parameter,                                                                 \
               "A bristle snaps at this plus its snap length, and stays bent by this. At most 64 mean "     \
               "snap lengths."))                                                                            \
  FIELD(shared_renewal, number("", 0.0, largest_renewal, "Bristles that a snap renews in the patch."))      \
  FIELD(ageing_form, one_of(ageing_form_names, "how a snap length grows while a bristle sticks"))           \
  FIELD(ageing_strength, number("", 0.0, largest_ageing, "beta or gain; 0 = no ageing."))                   \
  FIELD(ageing_time, number("s", shortest_ageing_time, longest_ageing_time, "tau."))                        \
  FIELD(speed_strengthening,                                                                                \
        number("", 0.0, largest_parameter, "a: a N asinh(v / (2 v*)) against the motion; 0 = none."))       \
  FIELD(strengthening_speed, number("m/s", smallest_positive, largest_parameter, "v*."))                    \
  FIELD(drop, number("", 0.0, largest_drop,                                                                 \
                     "Snap rule \"slide\": share of its limit that a bristle loses while it slides."))

#define BRISTLE_FIELDS_OF_Coefficients(FIELD)                                                                \
  FIELD(kinetic, number("", 1e-9, 1e6, "Friction over normal load in slow sliding."))                        \
  FIELD(peak, number("", 0.0, 2e6,                                                                           \
                     "Highest friction over normal load at first loading; 0 = what follows from spread."))   \
  FIELD(presliding_length, number("m", 1e-12, 1e3, "Mean deflection at a snap."))                            \
  FIELD(bristles_per_newton, number("1/N", 1e-6, 1e15, "Bristles in contact over normal load."))             \
  FIELD(damping_per_newton, number("s/m", 0.0, largest_parameter, "Tangential damping at rest over load."))  \
  FIELD(viscous_friction, number("N s/m", 0.0, largest_parameter, "Lubricant term of the patch."))           \
  FIELD(stribeck_velocity, number("m/s", 0.0, largest_parameter, "Speed of the dampers' decay."))            \
  FIELD(law,                                                                                                 \
        one_of(snap_law_names, "family of snap lengths; peak / kinetic sets its spread, or spread does"))    \
  FIELD(rule, one_of(snap_rule_names, "behaviour of a bristle at its snap length"))                          \
  FIELD(damper_decay, one_of(damper_decay_names, "decay of the dampers with speed"))                         \
  FIELD(residual_share,                                                                                      \
        number("", 0.0, largest_residual_share, "Share of the presliding length that a snap leaves."))       \
  FIELD(shared_renewal, number("", 0.0, largest_renewal, "Bristles that a snap renews in the patch."))       \
  FIELD(kinetic_speed, number("m/s", 0.0, largest_parameter,                                                 \
                              "Speed at which kinetic and peak apply; 0 = so fast that nothing ages."))      \
  FIELD(fall_per_decade,                                                                                     \
        number("", 0.0, 10.0, "Share of kinetic friction that is lost per decade of speed; 0 = no ageing.")) \
  FIELD(growth_per_decade,                                                                                   \
        number("", 0.0, 10.0, "Instead: growth of static friction per decade of rest, over kinetic."))       \
  FIELD(ageing_time, number("s", shortest_ageing_time, longest_ageing_time, "tau."))                         \
  FIELD(ageing_form, one_of(ageing_form_names, "how a snap length grows while a bristle sticks"))            \
  FIELD(speed_strengthening,                                                                                 \
        number("", 0.0, largest_parameter,                                                                   \
               "a: a N asinh(v / (2 v*)) against the motion; 0 = none. Not part of kinetic."))               \
  FIELD(strengthening_speed, number("m/s", smallest_positive, largest_parameter, "v*."))                     \
  FIELD(spread, number("", 0.0, 3.0,                                                                         \
                       "Standard deviation over mean of the snap length (normal: of the uncut law); 0 = "    \
                       "solved from peak. Beside a peak the two must agree."))                               \
  FIELD(drop, number("", 0.0, largest_drop,                                                                  \
                     "Rule \"slide\": share of its limit that a bristle loses while it slides; 0 = solved "  \
                     "from peak."))

#define BRISTLE_FIELDS_OF_Lay(FIELD)                                                                      \
  FIELD(angle,                                                                                            \
        number("rad", -whole_turn, whole_turn, "From the patch's x axis to the direction \"along\"."))    \
  FIELD(limit_ratio, number("", 0.01, 100.0, "Limit across over along; along it is the material's."))     \
  FIELD(stiffness_ratio, number_or_zero("", 1e-4, 1e4, "Across over along; 0 = limit_ratio squared."))    \
  FIELD(to_over_fro, number("", 0.01, 100.0,                                                              \
                            "Limit of motion along the direction over that against it; other than 1 for " \
                            "rule \"slide\"."))

#define BRISTLE_FIELDS_OF_PatchOptions(FIELD)                                                              \
  FIELD(max_normal_load, number("N", 1e-15, 1e15, "A larger load scales the forces of all bristles."))     \
  FIELD(key, number("", 0.0, 18446744073709551615.0, "The caller's own 64-bit name of the contact."))      \
  FIELD(bristles, number("", 0.0, max_bristles_per_patch,                                                  \
                         "Representatives at max load; 0 = one per bristle, at most 4096."))               \
  FIELD(seed, number("", 0.0, 4294967295.0, "Shifts stratified snap lengths, keys random numbers."))       \
  FIELD(axes, number("", 1.0, 2.0, "Tangential directions."))                                              \
  FIELD(outputs, one_of(outputs_names, "what is computed beside the force at the end of a step"))          \
  FIELD(precision, one_of(precision_names, "of the bristles' state"))                                      \
  FIELD(population, one_of(population_names,                                                               \
                           "automatic: infinite where the law allows it and no number of bristles is "     \
                           "named; infinite: a list of cohorts, without noise"))                           \
  FIELD(resolution, number("", 0.0, 128.0,                                                                 \
                           "Infinite: pieces of path per mean snap length, 1 to 128; 0 = automatic (8).")) \
  FIELD(lay, part("Direction of the surface: a Lay."))

#define BRISTLE_FIELDS_OF_BatchOptions(FIELD)                                                          \
  FIELD(isa, part("Instruction set of the kernels; none = BRISTLE_ISA, or the best of this machine.")) \
  FIELD(threads, number("", 0.0, 1024.0, "Threads that may step, the caller included; 0 = one a core."))

#define BRISTLE_FIELDS_OF_KeyedOptions(FIELD)                                                       \
  FIELD(capacity, number("", 1.0, most_contacts, "Patches, all made at once."))                     \
  FIELD(keep_steps,                                                                                 \
        number("", 0.0, 4294967295.0, "Steps that a key may be missing before its patch returns.")) \
  FIELD(seed_from_key, flag("Whether each key has a seed of its own; if not, that of the patch options."))

#define BRISTLE_FIELDS_OF_MatcherOptions(FIELD)                                                  \
  FIELD(reach, number("m", 1e-12, 1e100, "Largest distance at which a contact is found again.")) \
  FIELD(capacity, number("", 1.0, most_contacts, "Contacts of one step."))                       \
  FIELD(keep_steps,                                                                              \
        number("", 0.0, 4294967295.0, "Steps that a contact may be missing and still be found again."))

#define BRISTLE_FIELDS_OF_BedMaterial(FIELD)                                                    \
  FIELD(static_friction, number("", 1e-6, 100.0, "Coefficient of static friction."))            \
  FIELD(kinetic_friction, number("", 1e-6, 100.0, "Coefficient of kinetic friction."))          \
  FIELD(normal_modulus, number_or_zero("Pa", 1.0, 1e15, "Combined modulus E*."))                \
  FIELD(shear_modulus, number_or_zero("Pa", 1.0, 1e15, "Combined modulus G*."))                 \
  FIELD(radius, number("m", 0.0, 1e6, "Combined radius; 0 where the shape states its size."))   \
  FIELD(flexibility, number_or_zero("m^3/N", 1e-20, 1.0, "Kalker's L1, L2, L3."))               \
  FIELD(slip_stiffness, number_or_zero("N", 1e-9, 1e15, "Force per unit slip, along x and y.")) \
  FIELD(presliding, number_or_zero("m", 1e-12, 1e3, "All of it slides at this displacement."))

#define BRISTLE_FIELDS_OF_BedShape(FIELD)                                                                   \
  FIELD(kind, one_of(bed_kind_names, "outline"))                                                            \
  FIELD(pressure, one_of(bed_pressure_names, "distribution over the contact"))                              \
  FIELD(growth, one_of(bed_growth_names, "growth of the size with the load"))                               \
  FIELD(rolls, flag("Whether the surface moves through the contact."))                                      \
  FIELD(half, number_or_zero("m", 1e-12, 1e3, "Half widths at full load; 0 = from the material's radius.")) \
  FIELD(cells, number("", 0.0, 65536.0, "Bristles along x and rows; rings and cells around."))              \
  FIELD(list, part("Bristles of kind \"list\"."))

#define BRISTLE_FIELDS_OF_BedOptions(FIELD)                                                 \
  FIELD(max_normal_load, number("N", 1e-12, 1e15, "Load at which the shape has its size.")) \
  FIELD(all_outputs, flag("Whether a step computes more than force and torque."))           \
  FIELD(longest_piece, number("", 1e-3, 10.0, "Longest piece of a rolling step, in contact lengths."))

#define BRISTLE_FIELDS_OF_JointLosses(FIELD)                                                        \
  FIELD(base, number("N m", 0.0, 1e9, "Constant part."))                                            \
  FIELD(motor, number("", 0.0, 100.0, "Share of the motor's torque: while driving, while driven.")) \
  FIELD(outside, number("", 0.0, 100.0, "Share of the outside torque: while driving, while driven."))

#define BRISTLE_FIELDS_OF_JointMaterial(FIELD)                          \
  FIELD(stiffness, number("N m/rad", 1e-9, 1e12, "While it sticks."))   \
  FIELD(viscous, number("N m s/rad", 0.0, 1e9, "Viscous friction."))    \
  FIELD(kinetic, part("JointLosses of a sliding joint."))               \
  FIELD(static_part, part("JointLosses in addition, while it sticks.")) \
  FIELD(stribeck_speed, number_or_zero("rad/s", 1e-9, 1e9, "Speed over which the static part fades."))

#define BRISTLE_FIELDS_OF_JointOptions(FIELD)                                              \
  FIELD(spread, number("", 0.0, 3.0, "Coefficient of variation of the bristles' limits.")) \
  FIELD(bristles, number("", 1.0, 64.0, "Bristles of each joint."))                        \
  FIELD(gradients, flag("Whether gradients may be asked for."))

namespace detail {

constexpr double most_contacts = 16777216.0;

template <class Owner>
struct Fields;

#define BRISTLE_FIELD_HERE(name, about) field(#name, &Here::name, about),
#define BRISTLE_FIELDS_HERE(type)                                                         \
  template <>                                                                             \
  struct Fields<type> {                                                                   \
    using Here = type;                                                                    \
    static constexpr auto all = std::tuple{BRISTLE_FIELDS_OF_##type(BRISTLE_FIELD_HERE)}; \
  }
BRISTLE_FIELDS_HERE(Material);
BRISTLE_FIELDS_HERE(Coefficients);
BRISTLE_FIELDS_HERE(Lay);
BRISTLE_FIELDS_HERE(PatchOptions);
BRISTLE_FIELDS_HERE(BatchOptions);
BRISTLE_FIELDS_HERE(KeyedOptions);
BRISTLE_FIELDS_HERE(MatcherOptions);
#if BRISTLE_WITH_BEDS
BRISTLE_FIELDS_HERE(BedMaterial);
BRISTLE_FIELDS_HERE(BedShape);
BRISTLE_FIELDS_HERE(BedOptions);
#endif
#if BRISTLE_WITH_JOINTS
BRISTLE_FIELDS_HERE(JointLosses);
BRISTLE_FIELDS_HERE(JointMaterial);
BRISTLE_FIELDS_HERE(JointOptions);
#endif
#undef BRISTLE_FIELD_HERE
#undef BRISTLE_FIELDS_HERE

}  // namespace detail

/// Calls visit(field) with the Field of each listed member of a struct.
template <class Owner, class Visit>
constexpr void for_each_field(Visit&& visit) {
  std::apply([&](const auto&... field) { (visit(field), ...); }, detail::Fields<Owner>::all);
}

}  // namespace bristle
