// The C interface (bristle/bristle.h), made over the C++ one. C motions and responses have the layout of the
// C++ structs, so a step copies nothing.
#include "bristle/bristle.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdio>
#include <iterator>
#include <new>
#include <stdexcept>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <variant>
#include <vector>

#include "bristle/bristle.hpp"
#include "bristle/fields.hpp"
#include "core/c_interface/field_count.hpp"
#include "core/common/range_check.hpp"

using namespace bristle;

// ------------------------------------------------------------------------- layouts shared with C++
/// C++ struct that lies in memory as a C struct does.
template <class C>
struct SameLayout;
/// Returns the caller's array as one of the C++ structs with the same layout.
template <class C>
auto as_cpp(C* array, std::size_t count) noexcept {
  using Cpp = typename SameLayout<std::remove_const_t<C>>::Cpp;
  using Entry = std::conditional_t<std::is_const_v<C>, const Cpp, Cpp>;
  return Span<Entry>(reinterpret_cast<Entry*>(array), count);
}

#define BRISTLE_SAME(field) \
  (offsetof(C, field) == offsetof(Cpp, field) && sizeof(C::field) == sizeof(Cpp::field))
#define BRISTLE_SAME_LAYOUT(c_type, cpp_type, offsets)                                                     \
  template <>                                                                                              \
  struct SameLayout<c_type> {                                                                              \
    using Cpp = cpp_type;                                                                                  \
  };                                                                                                       \
  static_assert(                                                                                           \
      [] {                                                                                                 \
        using C = c_type;                                                                                  \
        using Cpp = cpp_type;                                                                              \
        return sizeof(C) == sizeof(Cpp) && alignof(C) == alignof(Cpp) && std::is_standard_layout_v<Cpp> && \
               std::is_trivially_copyable_v<Cpp> && (offsets);                                             \
      }(),                                                                                                 \
      #c_type " must lie as " #cpp_type " does")
BRISTLE_SAME_LAYOUT(bristle_motion, Motion,
                    BRISTLE_SAME(id) && BRISTLE_SAME(displacement) && BRISTLE_SAME(normal_load) &&
                        BRISTLE_SAME(has_velocity) && BRISTLE_SAME(velocity));
BRISTLE_SAME_LAYOUT(bristle_response, Response,
                    BRISTLE_SAME(id) && BRISTLE_SAME(status) && BRISTLE_SAME(end) && BRISTLE_SAME(elastic) &&
                        BRISTLE_SAME(damper) && BRISTLE_SAME(mean) && BRISTLE_SAME(stiffness) &&
                        BRISTLE_SAME(damping) && BRISTLE_SAME(force_limit) && BRISTLE_SAME(dissipated) &&
                        BRISTLE_SAME(contact_loss) && BRISTLE_SAME(damper_work) && BRISTLE_SAME(snaps));
BRISTLE_SAME_LAYOUT(bristle_contact_point, ContactPoint, BRISTLE_SAME(pair) && BRISTLE_SAME(point));
#if BRISTLE_WITH_BEDS
BRISTLE_SAME_LAYOUT(bristle_bed_cell, BedCell,
                    BRISTLE_SAME(position) && BRISTLE_SAME(stiffness) && BRISTLE_SAME(load));
BRISTLE_SAME_LAYOUT(bristle_bed_motion, BedMotion,
                    BRISTLE_SAME(id) && BRISTLE_SAME(displacement) && BRISTLE_SAME(spin) &&
                        BRISTLE_SAME(rolled) && BRISTLE_SAME(normal_load));
BRISTLE_SAME_LAYOUT(bristle_bed_response, BedResponse,
                    BRISTLE_SAME(id) && BRISTLE_SAME(status) && BRISTLE_SAME(force) && BRISTLE_SAME(torque) &&
                        BRISTLE_SAME(mean) && BRISTLE_SAME(mean_torque) && BRISTLE_SAME(dissipated) &&
                        BRISTLE_SAME(stored) && BRISTLE_SAME(tangent) && BRISTLE_SAME(slipping_share));
#endif
#if BRISTLE_WITH_JOINTS
BRISTLE_SAME_LAYOUT(bristle_joint_material, JointMaterial,
                    BRISTLE_SAME(stiffness) && BRISTLE_SAME(viscous) && BRISTLE_SAME(stribeck_speed) &&
                        offsetof(C, base) == offsetof(Cpp, kinetic) &&
                        offsetof(C, static_base) == offsetof(Cpp, static_part) &&
                        sizeof(C) == BRISTLE_JOINT_PARAMETERS * sizeof(double) &&
                        +BRISTLE_JOINT_PARAMETERS == +joint_parameters);
#endif
#if BRISTLE_WITH_OUTLINES
BRISTLE_SAME_LAYOUT(bristle_cell, PatchCell, BRISTLE_SAME(position) && BRISTLE_SAME(weight));
BRISTLE_SAME_LAYOUT(bristle_extended_motion, ExtendedMotion,
                    BRISTLE_SAME(id) && BRISTLE_SAME(displacement) && BRISTLE_SAME(normal_load) &&
                        BRISTLE_SAME(has_velocity) && BRISTLE_SAME(velocity));
BRISTLE_SAME_LAYOUT(bristle_extended_response, ExtendedResponse,
                    BRISTLE_SAME(id) && BRISTLE_SAME(status) && BRISTLE_SAME(end) && BRISTLE_SAME(elastic) &&
                        BRISTLE_SAME(damper) && BRISTLE_SAME(mean) && BRISTLE_SAME(stiffness) &&
                        BRISTLE_SAME(damping) && BRISTLE_SAME(force_limit) && BRISTLE_SAME(torque_limit) &&
                        BRISTLE_SAME(dissipated) && BRISTLE_SAME(contact_loss) && BRISTLE_SAME(damper_work) &&
                        BRISTLE_SAME(snaps));
#endif
static_assert(BRISTLE_NO_CONTACT_KEY == no_contact_key);

template <auto c_value, auto cpp_value>
constexpr bool same_value = static_cast<unsigned>(c_value) == static_cast<unsigned>(cpp_value);
static_assert(same_value<BRISTLE_LAW_TABLE, SnapLaw::table> &&
              same_value<BRISTLE_LAW_SINGLE, SnapLaw::single> &&
              same_value<BRISTLE_LAW_UNIFORM, SnapLaw::uniform> &&
              same_value<BRISTLE_LAW_NORMAL, SnapLaw::normal> &&
              same_value<BRISTLE_LAW_LOGNORMAL, SnapLaw::lognormal> &&
              same_value<BRISTLE_LAW_EXPONENTIAL, SnapLaw::exponential>);
static_assert(same_value<BRISTLE_RULE_KEEP, SnapRule::keep> &&
              same_value<BRISTLE_RULE_SLIDE, SnapRule::slide> &&
              same_value<BRISTLE_DECAY_GAUSSIAN, DamperDecay::gaussian> &&
              same_value<BRISTLE_OUTPUT_MEAN, Outputs::mean> &&
              same_value<BRISTLE_OUTPUT_ENERGY, Outputs::energy> &&
              same_value<BRISTLE_PRECISION_DOUBLE, Precision::double_>);
static_assert(same_value<BRISTLE_POPULATION_AUTOMATIC, Population::automatic> &&
              same_value<BRISTLE_POPULATION_REPRESENTATIVES, Population::representatives> &&
              same_value<BRISTLE_POPULATION_INFINITE, Population::infinite>);
#if BRISTLE_WITH_OUTLINES
static_assert(same_value<BRISTLE_PRESSURE_UNIFORM, Pressure::uniform> &&
              same_value<BRISTLE_PRESSURE_HERTZ, Pressure::hertz>);
#endif
static_assert(same_value<BRISTLE_STATUS_UNKNOWN_ID, Status::unknown_id> &&
              same_value<BRISTLE_STATUS_REPEATED_ID, Status::repeated_id> &&
              same_value<BRISTLE_STATUS_BAD_INPUT, Status::bad_input> &&
              same_value<BRISTLE_STATUS_OVERLOAD, Status::overload> &&
              same_value<BRISTLE_STATUS_NO_CAPACITY, Status::no_capacity>);
static_assert(BRISTLE_ID_NO_CAPACITY == PatchId::no_capacity().value);
#if BRISTLE_WITH_BEDS
static_assert(BRISTLE_ID_NO_CAPACITY == BedId::no_capacity().value);
#endif

/// The C++ object that a handle of the C interface stands for.
template <class Part>
struct Handle {
  Part it;
};
struct bristle_batch : Handle<PatchBatch> {};
#if BRISTLE_WITH_OUTLINES
struct bristle_extended : Handle<ExtendedPatches> {};
#endif
#if BRISTLE_WITH_BEDS
struct bristle_beds : Handle<BedBatch> {};
#endif
#if BRISTLE_WITH_JOINTS
struct bristle_joints : Handle<JointFriction> {};
#endif
struct bristle_matcher : Handle<ContactMatcher> {};
struct bristle_monitor : Handle<DeadlineMonitor> {};

/// Pool found by key, of patches or of beds: both are behind one kind of handle in C.
struct bristle_keyed {
#if BRISTLE_WITH_BEDS
  std::variant<KeyedPatches, KeyedBeds> pool;
#else
  std::variant<KeyedPatches> pool;
#endif
  KeyedPool& it = std::visit([](KeyedPool& either) -> KeyedPool& { return either; }, pool);
};

namespace {

// ------------------------------------------------------------------------------------------ failures

thread_local char last_error[512] = "";

bristle_result fail(bristle_result result, const char* text) noexcept {
  std::snprintf(last_error, sizeof last_error, "%s", text);
  return result;
}

/// Error in the arguments themselves: a null pointer or a struct of the wrong size. Thrown before anything is
/// done.
struct BadArgument : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Runs a call of the C interface. Turns an exception into an error code, and its text into
/// bristle_last_error(), because C has no exceptions.
template <class Call>
bristle_result guarded(Call&& call) noexcept {
  try {
    call();
    return BRISTLE_OK;
  } catch (const BadArgument& e) {
    return fail(BRISTLE_BAD_ARGUMENT, e.what());
  } catch (const Error& e) {
    return fail(BRISTLE_REFUSED, e.what());
  } catch (const std::bad_alloc&) {
    return fail(BRISTLE_OUT_OF_MEMORY, "out of memory");
  } catch (const std::exception& e) {
    return fail(BRISTLE_FAILED, e.what());
  } catch (...) {
    return fail(BRISTLE_FAILED, "unknown failure");
  }
}

[[noreturn]] void refuse_patch(const char* where, bristle_id id) {
  throw Error(std::string(where) + ": there is no patch with id " + std::to_string(id));
}

void need(const void* pointer, const char* name) {
  if (pointer == nullptr) throw BadArgument(std::string(name) + " is null");
}

/// Defines the three functions prefix_state_size, prefix_save_state and prefix_restore_state for a kind of
/// handle.
#define BRISTLE_STATE_CALLS(prefix, handle)                                                        \
  size_t prefix##_state_size(const bristle_##handle* handle) {                                     \
    return handle != nullptr ? handle->it.state_size() : 0;                                        \
  }                                                                                                \
  size_t prefix##_save_state(const bristle_##handle* handle, void* to, size_t size) {              \
    if (handle == nullptr || to == nullptr) return 0;                                              \
    return handle->it.save_state({static_cast<std::byte*>(to), size});                             \
  }                                                                                                \
  bristle_result prefix##_restore_state(bristle_##handle* handle, const void* from, size_t size) { \
    return with(handle, #handle, [&](auto& it) {                                                   \
      need(from, "from");                                                                          \
      it.restore_state({static_cast<const std::byte*>(from), size});                               \
    });                                                                                            \
  }

/// Runs call(object) with the C++ object behind a handle. `name`: name of the handle, for the error if it is
/// null.
template <class Handle, class Call>
bristle_result with(Handle* handle, const char* name, const Call& call) noexcept {
  return guarded([&] {
    need(handle, name);
    call(handle->it);
  });
}

/// Makes the C++ object by make() and stores a handle to it in `handle`. `name`: name of the handle, for the
/// error if it is null.
template <class Handle, class Make>
bristle_result create(Handle** handle, const char* name, const Make& make) {
  return guarded([&] {
    need(handle, name);
    *handle = new Handle{{make()}};
  });
}

/// Returns the state hash of the patch or bed `id`, or of all of them if `id` is 0; 0 for a null handle.
template <class Handle>
uint64_t hash_of(const Handle* handle, bristle_id id) {
  if (handle == nullptr) return 0;
  return id == 0 ? handle->it.state_hash() : handle->it.state_hash({id});
}

void need_columns(const void* in, const char* in_name, const void* out, const char* out_name,
                  std::size_t count) {
  if (count > 0 && (in == nullptr || out == nullptr))
    throw BadArgument(std::string(in == nullptr ? in_name : out_name) + " is null");
}

// ------------------------------------------------------------------------ structs that mirror C++ ones

/// Field of a C struct, paired with the field of the C++ struct from which it is copied.
template <class C, class CField, class Cpp, class CppField>
struct FieldPair {
  CField C::*c;
  CppField Cpp::*cpp;
  const char* name;
  std::uint32_t last;  ///< greatest value of an enumeration; 0 for other fields
};
template <class C, class CField, class Cpp, class CppField>
constexpr auto field(CField C::*c, CppField Cpp::*cpp, const char* name, std::uint32_t last = 0) {
  return FieldPair<C, CField, Cpp, CppField>{c, cpp, name, last};
}

/// Returns the greatest value that an enumeration among the fields of a C++ struct may have; 0 for fields
/// that are no enumeration.
template <class Cpp>
constexpr std::uint32_t last_of(std::string_view name) {
  std::uint32_t last = 0;
  for_each_field<Cpp>([&](const auto& listed) {
    if (name == listed.name) last = listed.about.last();
  });
  return last;
}

template <class C>
struct Mirror;

/// Counts the numbers of a list of pairs: each field once, but every number of an array.
template <class... Pairs>
constexpr std::size_t count_numbers(const std::tuple<Pairs...>&) {
  const auto numbers = []<class C, class CField, class Cpp, class CppField>(
                           std::type_identity<FieldPair<C, CField, Cpp, CppField>>) {
    return std::max<std::size_t>(std::extent_v<CppField>, 1);
  };
  return (numbers(std::type_identity<Pairs>{}) + ...);
}

/// Pairs fields of a C struct with those of a C++ struct that it mirrors, so that one loop converts in either
/// direction. Counts the pairs, so that the compiler refuses a forgotten one.
#define BRISTLE_MIRROR_PART(part, c_type, cpp_type, ...)                            \
  template <>                                                                       \
  struct part {                                                                     \
    using C = c_type;                                                               \
    using Cpp = cpp_type;                                                           \
    static constexpr const char* name = #c_type;                                    \
    static constexpr auto fields = std::tuple{__VA_ARGS__};                         \
    static constexpr std::size_t count = count_numbers(fields);                     \
    static_assert(std::is_aggregate_v<Cpp> ? detail::field_count<Cpp> == count      \
                                           : sizeof(Cpp) == count * sizeof(double), \
                  "a field of " #cpp_type " is missing in " #c_type);               \
  }
/// Refuses a field of a C struct that no list names. `unused`: number of its reserved fields.
#define BRISTLE_ALL_NAMED(c_type, count, unused)                       \
  static_assert(detail::field_count<c_type> == 1 + (count) + (unused), \
                "a field of " #c_type " is missing in its list: struct_size, these, " #unused " reserved")
#define BRISTLE_MIRROR(c_type, cpp_type, unused, ...)                 \
  BRISTLE_MIRROR_PART(Mirror<c_type>, c_type, cpp_type, __VA_ARGS__); \
  BRISTLE_ALL_NAMED(c_type, Mirror<c_type>::count, unused)
/// Pairs the fields of structs that bristle/fields.hpp lists.
#define BRISTLE_MIRROR_FIELDS(c_type, cpp_type) \
  BRISTLE_MIRROR(c_type, cpp_type, 0, BRISTLE_FIELDS_OF_##cpp_type(BRISTLE_LISTED))
#define BRISTLE_FIELD(c_name) field(&C::c_name, &Cpp::c_name, #c_name)
#define BRISTLE_CHOICE(c_name, last) \
  field(&C::c_name, &Cpp::c_name, #c_name, static_cast<std::uint32_t>(last))
#define BRISTLE_LISTED(c_name, about) BRISTLE_CHOICE(c_name, last_of<Cpp>(#c_name)),

BRISTLE_MIRROR_FIELDS(bristle_material, Material);
BRISTLE_MIRROR_FIELDS(bristle_coefficients, Coefficients);
BRISTLE_MIRROR_FIELDS(bristle_patch_options, PatchOptions);
BRISTLE_MIRROR_FIELDS(bristle_batch_options, BatchOptions);
BRISTLE_MIRROR_FIELDS(bristle_keyed_options, KeyedOptions);
BRISTLE_MIRROR_FIELDS(bristle_matcher_options, MatcherOptions);
#if BRISTLE_WITH_JOINTS
BRISTLE_MIRROR_FIELDS(bristle_joint_options, JointOptions);
#endif
#if BRISTLE_WITH_BEDS
/// A bristle_bed has the fields of three C++ structs.
template <class Part>
struct BedMirror;
BRISTLE_MIRROR_PART(BedMirror<BedMaterial>, bristle_bed, BedMaterial,
                    BRISTLE_FIELDS_OF_BedMaterial(BRISTLE_LISTED));
BRISTLE_MIRROR_PART(BedMirror<BedShape>, bristle_bed, BedShape, BRISTLE_FIELDS_OF_BedShape(BRISTLE_LISTED));
BRISTLE_MIRROR_PART(BedMirror<BedOptions>, bristle_bed, BedOptions,
                    BRISTLE_FIELDS_OF_BedOptions(BRISTLE_LISTED));
BRISTLE_ALL_NAMED(bristle_bed,
                  BedMirror<BedMaterial>::count + BedMirror<BedShape>::count + BedMirror<BedOptions>::count,
                  2);
#endif
BRISTLE_MIRROR(bristle_step_report, StepReport, 0, BRISTLE_CHOICE(status, Status{0xFFFFFFFFu}),
               BRISTLE_FIELD(patches_stepped), BRISTLE_FIELD(tasks), BRISTLE_FIELD(threads),
               BRISTLE_FIELD(bristles_visited));
BRISTLE_MIRROR(bristle_patch_info, PatchInfo, 0, BRISTLE_FIELD(key), BRISTLE_FIELD(weight),
               BRISTLE_FIELD(active), BRISTLE_FIELD(normal_load), BRISTLE_FIELD(memory_bytes),
               BRISTLE_FIELD(representatives), BRISTLE_FIELD(bytes_per_representative), BRISTLE_FIELD(kernel),
               BRISTLE_FIELD(max_normal_load));

template <class C>
constexpr const char* name_of = Mirror<C>::name;
template <>
constexpr const char* name_of<bristle_material_facts> = "bristle_material_facts";
template <>
constexpr const char* name_of<bristle_monitor_report> = "bristle_monitor_report";
template <>
constexpr const char* name_of<bristle_bed> = "bristle_bed";
template <>
constexpr const char* name_of<bristle_joint_step> = "bristle_joint_step";
template <>
constexpr const char* name_of<bristle_group_step> = "bristle_group_step";

// ------------------------------------------------------------------------- structs of the caller

/// Refuses a struct of the caller whose size differs from the library's, because the program was compiled
/// with another version of the header.
template <class Struct>
void check_size(std::size_t size, const char* name, const char* field = "", const char* advice = "") {
  if (size == sizeof(Struct)) return;  // builds no text: [step] functions that succeed do not allocate
  throw BadArgument(std::string(name) + field + " = " + std::to_string(size) + "; allowed is " +
                    std::to_string(sizeof(Struct)) + ": give sizeof(" + name_of<Struct> + ")" + advice);
}
template <class Struct>
void check_size(const Struct& s, const char* name) {
  check_size<Struct>(s.struct_size, name, ".struct_size", ", or call its bristle_init_ function first");
}

template <class Struct>
void write_struct(Struct from, Struct* to, const char* name) {
  need(to, name);
  check_size(*to, name);
  from.struct_size = sizeof from;
  *to = from;
}

/// Writes function(value) for each value of `in` to `out`. Writes nothing if the function throws for one.
template <class Function>
void write_column(const double* in, const char* in_name, double* out, const char* out_name, std::size_t count,
                  const Function& function) {
  need_columns(in, in_name, out, out_name, count);
  std::vector<double> values(count);
  for (std::size_t i = 0; i < count; ++i) values[i] = function(in[i]);
  std::copy(values.begin(), values.end(), out);
}

template <class Struct>
bristle_result init_struct(Struct* s, std::size_t struct_size, Struct defaults, const char* name) noexcept {
  return guarded([&] {
    need(s, name);
    check_size<Struct>(struct_size, "struct_size");
    defaults.struct_size = struct_size;
    *s = defaults;
  });
}

/// Defines bristle_init_KIND, by which a C program fills a struct with its defaults. `name`: name of the
/// struct in errors.
#define BRISTLE_INIT(kind, name, defaults)                                       \
  bristle_result bristle_init_##kind(bristle_##kind* kind, size_t struct_size) { \
    return init_struct(kind, struct_size, defaults, #name);                      \
  }

SnapLength to_cpp(const bristle_snap_length& s) {
  if (s.law > static_cast<std::uint32_t>(SnapLaw::table))
    detail::refuse("bristle_snap_length", "law", s.law, "0 to 5");
  switch (static_cast<SnapLaw>(s.law)) {
    case SnapLaw::single:
      return SnapLength::single(s.first_parameter);
    case SnapLaw::uniform:
      return SnapLength::uniform(s.first_parameter, s.second_parameter);
    case SnapLaw::normal:
      return SnapLength::normal(s.first_parameter, s.second_parameter);
    case SnapLaw::lognormal:
      return SnapLength::lognormal(s.first_parameter, s.second_parameter);
    case SnapLaw::exponential:
      return SnapLength::exponential(s.first_parameter);
    case SnapLaw::table:
      break;
  }
  need(s.table, "snap_length.table");
  return SnapLength::table({s.table, s.table_size});
}

Lay to_cpp(const bristle_lay& l) { return {l.angle, l.limit_ratio, l.stiffness_ratio, l.to_over_fro}; }
bristle_lay to_c(const Lay& l) { return {l.angle, l.limit_ratio, l.stiffness_ratio, l.to_over_fro}; }

/// Converts a snap-length law to C. A table of quantiles is not copied: the C struct points into `s`, which
/// must live longer.
bristle_snap_length to_c(const SnapLength& s) {
  bristle_snap_length c{};
  c.law = static_cast<std::uint32_t>(s.law());
  c.first_parameter = s.first_parameter();
  c.second_parameter = s.second_parameter();
  c.table_size = static_cast<std::uint32_t>(s.table_values().size());
  c.table = c.table_size > 0 ? s.table_values().data() : nullptr;
  return c;
}

/// Copies the fields of a C++ struct to the C struct that mirrors it. A quantile table of a snap-length law
/// is not copied, the C struct points into `cpp`, which must live longer; nor is the list of a bed's shape.
template <class Pairs, class C, class Cpp>
void copy_to_c(const Cpp& cpp, C& c) {
  const auto copy = [&](const auto& f) {
    using CField = std::remove_reference_t<decltype(c.*f.c)>;
    if constexpr (std::is_same_v<CField, bristle_snap_length> || std::is_same_v<CField, bristle_lay>)
      c.*f.c = to_c(cpp.*f.cpp);
    else if constexpr (std::is_array_v<CField>)
      std::copy(std::begin(cpp.*f.cpp), std::end(cpp.*f.cpp), c.*f.c);
    else if constexpr (!std::is_same_v<CField, const bristle_bed_cell*>)
      c.*f.c = static_cast<CField>(cpp.*f.cpp);
  };
  std::apply([&](const auto&... f) { (copy(f), ...); }, Pairs::fields);
}
template <class C>
C to_c(const typename Mirror<C>::Cpp& cpp) {
  C c{};
  copy_to_c<Mirror<C>>(cpp, c);
  return c;
}

/// Copies the fields of a C struct to the C++ struct that it mirrors, but for the list of a bed's shape.
/// Throws Error for a value that an enumeration lacks.
template <class Pairs, class C, class Cpp>
void copy_to_cpp(const C& c, Cpp& cpp) {
  const auto copy = [&](const auto& f) {
    using CppField = std::remove_reference_t<decltype(cpp.*f.cpp)>;
    using CField = std::remove_cvref_t<decltype(c.*f.c)>;
    if constexpr (std::is_enum_v<CppField>) {
      if (c.*f.c > f.last) detail::refuse(Pairs::name, f.name, c.*f.c, "0 to " + std::to_string(f.last));
      cpp.*f.cpp = static_cast<CppField>(c.*f.c);
    } else if constexpr (std::is_same_v<CppField, SnapLength> || std::is_same_v<CppField, Lay>) {
      cpp.*f.cpp = to_cpp(c.*f.c);
    } else if constexpr (std::is_same_v<CppField, bool>) {
      cpp.*f.cpp = c.*f.c != 0;
    } else if constexpr (std::is_array_v<CppField>) {
      std::copy(std::begin(c.*f.c), std::end(c.*f.c), cpp.*f.cpp);
    } else if constexpr (!std::is_same_v<CField, const bristle_bed_cell*>) {
      cpp.*f.cpp = static_cast<CppField>(c.*f.c);
    }
  };
  std::apply([&](const auto&... f) { (copy(f), ...); }, Pairs::fields);
}
template <class C>
typename Mirror<C>::Cpp to_cpp(const C& c) {
  typename Mirror<C>::Cpp cpp;
  copy_to_cpp<Mirror<C>>(c, cpp);
  return cpp;
}

PatchGroup to_cpp(const bristle_group& group) { return {{group.first}, group.count}; }
GroupStep to_cpp(const bristle_group_step& c) {
  const auto span = [&](auto* column) { return Span(column, column != nullptr ? c.group.count : 0); };
  GroupStep step;
  step.group = to_cpp(c.group);
  for (int axis = 0; axis < 2; ++axis) {
    step.displacement[axis] = span(c.displacement[axis]);
    step.velocity[axis] = span(c.velocity[axis]);
    step.end[axis] = span(c.end[axis]);
    step.elastic[axis] = span(c.elastic[axis]);
    step.damper[axis] = span(c.damper[axis]);
    step.mean[axis] = span(c.mean[axis]);
  }
  step.normal_load = span(c.normal_load);
  if (c.which != nullptr) step.which = Span(c.which, c.which_count);
  step.stiffness = span(c.stiffness);
  step.damping = span(c.damping);
  step.force_limit = span(c.force_limit);
  step.dissipated = span(c.dissipated);
  step.contact_loss = span(c.contact_loss);
  step.damper_work = span(c.damper_work);
  step.snaps = span(c.snaps);
  step.status = span(reinterpret_cast<Status*>(c.status));
  return step;
}

/// Checks a struct that the caller passed for null and size, and converts it to C++. `name`: name of the
/// struct in errors.
template <class C>
typename Mirror<C>::Cpp read_cpp(const C* from, const char* name) {
  need(from, name);
  check_size(*from, name);
  return to_cpp(*from);
}
/// Converts options that the caller passed to C++; a null pointer stands for the defaults.
template <class C>
typename Mirror<C>::Cpp read_options(const C* from, const char* name) {
  return from != nullptr ? read_cpp(from, name) : typename Mirror<C>::Cpp{};
}

/// Makes a step and writes its report for the caller. Checks the size of `report` before the step, because a
/// step cannot be undone.
template <class Step>
void report_step(bristle_step_report* report, const Step& step) {
  if (report != nullptr) check_size(*report, "report");
  const StepReport done = step();
  if (report != nullptr) write_struct(to_c<bristle_step_report>(done), report, "report");
}

/// Steps the object behind a handle: step(object, motions, responses) takes the caller's arrays as C++ ones.
template <class Handle, class Motion, class Response, class Step>
bristle_result step_all(Handle* handle, const char* name, const Motion* motions, Response* responses,
                        std::size_t count, bristle_step_report* report, const Step& step) noexcept {
  return with(handle, name, [&](auto& it) {
    need_columns(motions, "motions", responses, "responses", count);
    report_step(report, [&] { return step(it, as_cpp(motions, count), as_cpp(responses, count)); });
  });
}

/// Writes the response of find_force(object, motion) for each motion, which leaves the state of patches or
/// beds unchanged.
template <class Handle, class Motion, class Response, class Try>
bristle_result try_all(Handle* handle, const char* name, const Motion* motions, Response* responses,
                       std::size_t count, const Try& find_force) noexcept {
  return with(handle, name, [&](auto& it) {
    need_columns(motions, "motions", responses, "responses", count);
    const auto out = as_cpp(responses, count);
    for (std::size_t i = 0; i < count; ++i) out[i] = find_force(it, as_cpp(motions, count)[i]);
  });
}

Material read_material(const bristle_material* from) {
  const Material m = read_cpp(from, "material");
  m.validate();
  return m;
}

/// Checks a material and writes function(material, value) for each value of `in` to `out`.
template <class Function>
bristle_result write_of_material(const bristle_material* material, const double* in, const char* in_name,
                                 double* out, const char* out_name, std::size_t count,
                                 const Function& function) noexcept {
  return guarded([&] {
    const Material m = read_material(material);
    write_column(in, in_name, out, out_name, count, [&](double x) { return function(m, x); });
  });
}

/// Returns why the caller's structs cannot be stepped, whose sizes come with the call; null if they can.
const char* fault_of_sizes(std::size_t motion_size, std::size_t response_size, std::size_t count) noexcept {
  if (count == 0) return nullptr;
  if (motion_size != sizeof(Motion)) return "motion_size: give sizeof(bristle_motion)";
  return response_size != sizeof(Response) ? "response_size: give sizeof(bristle_response)" : nullptr;
}

#if BRISTLE_WITH_OUTLINES
Pressure read_pressure(std::uint32_t pressure) {
  if (pressure > BRISTLE_PRESSURE_HERTZ) detail::refuse("bristle_pressure", "pressure", pressure, "0 or 1");
  return static_cast<Pressure>(pressure);
}

void write_cells(const Outline& outline, bristle_cell* cells, std::size_t capacity, std::size_t* count) {
  need(count, "count");
  if (capacity > 0) need(cells, "cells");
  *count = outline.cells.size();
  std::copy_n(reinterpret_cast<const bristle_cell*>(outline.cells.data()), std::min(capacity, *count), cells);
}
#endif

}  // namespace

extern "C" {

const char* bristle_result_name(bristle_result result) {
  static const char* const names[] = {"BRISTLE_OK",          "BRISTLE_BAD_ARGUMENT",
                                      "BRISTLE_REFUSED",     "BRISTLE_OUT_OF_MEMORY",
                                      "BRISTLE_WRONG_BUILD", "BRISTLE_FAILED"};
  static_assert(std::size(names) == BRISTLE_FAILED + 1);
  return static_cast<std::uint32_t>(result) < std::size(names) ? names[result] : "not a bristle_result";
}

const char* bristle_last_error(void) { return last_error; }
const char* bristle_version(void) { return library_version(); }

bristle_result bristle_check_build(uint32_t version_number, uint32_t build_options) {
  return guarded([&] {
           // Checks version and options of the library only. The sizes of structs need no check here: each C
           // struct gives its size, which every call checks.
           BuildSignature headers = header_build;
           headers.version = version_number;
           headers.options = build_options;
           check_build(headers);
         }) == BRISTLE_OK
             ? BRISTLE_OK
             : BRISTLE_WRONG_BUILD;
}

size_t bristle_instruction_set_count(void) { return instruction_sets().size(); }

const char* bristle_instruction_set(size_t index, uint32_t* usable) {
  if (index >= instruction_sets().size()) return nullptr;
  if (usable != nullptr) *usable = instruction_sets()[index].usable ? 1 : 0;
  return instruction_sets()[index].name;
}

// --- materials

BRISTLE_INIT(material, material, to_c<bristle_material>(Material{}))
BRISTLE_INIT(coefficients, coefficients, to_c<bristle_coefficients>(Coefficients{}))
BRISTLE_INIT(material_facts, facts, bristle_material_facts{})

const char* bristle_typical_name(size_t index) {
  const Span<const TypicalMaterial> all = typical_materials();
  return index < all.size() ? all[index].name : nullptr;
}

bristle_result bristle_typical_coefficients(const char* name, bristle_coefficients* coefficients) {
  return guarded([&] {
    need(name, "name");
    write_struct(to_c<bristle_coefficients>(typical_coefficients(name)), coefficients, "coefficients");
  });
}

bristle_result bristle_material_from_coefficients(const bristle_coefficients* coefficients,
                                                  bristle_material* material) {
  return guarded([&] {
    const Material made = Material::from_coefficients(read_cpp(coefficients, "coefficients"));
    write_struct(to_c<bristle_material>(made), material, "material");
  });
}

bristle_result bristle_material_to_coefficients(const bristle_material* material,
                                                bristle_coefficients* coefficients) {
  return guarded([&] {
    const double speed = read_cpp(coefficients, "coefficients").kinetic_speed;
    write_struct(to_c<bristle_coefficients>(read_material(material).coefficients(speed)), coefficients,
                 "coefficients");
  });
}

bristle_result bristle_material_check(const bristle_material* material) {
  return guarded([&] { read_material(material); });
}

bristle_result bristle_material_find_facts(const bristle_material* material, bristle_material_facts* facts) {
  return guarded([&] {
    const Material m = read_material(material);
    bristle_material_facts c{};
    c.kinetic_coefficient = m.kinetic_coefficient();
    c.peak_coefficient = m.peak_coefficient();
    c.bristles_per_newton = m.bristles_in_contact(1.0);
    c.mean_snap_length = m.snap_length.mean();
    c.snap_length_variation = m.snap_length.cv();
    c.longest_snap_length = m.snap_length.longest();
    write_struct(c, facts, "facts");
  });
}

bristle_result bristle_material_steady_force(const bristle_material* material, double normal_load_n,
                                             const double* speeds, double* forces, size_t count) {
  return write_of_material(material, speeds, "speeds", forces, "forces", count,
                           [&](const Material& m, double v) { return m.steady_force(v, normal_load_n); });
}

bristle_result bristle_material_kinetic_at(const bristle_material* material, const double* speeds,
                                           double* coefficients, size_t count) {
  return write_of_material(material, speeds, "speeds", coefficients, "coefficients", count,
                           [&](const Material& m, double v) { return m.kinetic_coefficient(v); });
}

bristle_result bristle_material_damping(const bristle_material* material, const double* speeds,
                                        double* dampings, size_t count) {
  return write_of_material(material, speeds, "speeds", dampings, "dampings", count,
                           [&](const Material& m, double v) { return m.damping_at(v); });
}

bristle_result bristle_material_virgin_deflection(const bristle_material* material,
                                                  const double* displacements, double* deflections,
                                                  size_t count) {
  return write_of_material(material, displacements, "displacements", deflections, "deflections", count,
                           [&](const Material& m, double x) { return virgin_deflection(m, x); });
}

bristle_result bristle_snap_length_quantile(const bristle_snap_length* snap_length, const double* shares,
                                            double* lengths, size_t count) {
  return guarded([&] {
    need(snap_length, "snap_length");
    const SnapLength s = to_cpp(*snap_length);
    write_column(shares, "shares", lengths, "lengths", count, [&](double u) { return s.quantile(u); });
  });
}

bristle_result bristle_snap_length_survival(const bristle_snap_length* snap_length, const double* lengths,
                                            double* shares, size_t count) {
  return guarded([&] {
    need(snap_length, "snap_length");
    const SnapLength s = to_cpp(*snap_length);
    write_column(lengths, "lengths", shares, "shares", count, [&](double x) { return s.survival(x); });
  });
}

bristle_result bristle_snap_length_moment(const bristle_snap_length* snap_length, int32_t k, double* moment,
                                          const double* lengths, double* partial, size_t count) {
  return guarded([&] {
    need(snap_length, "snap_length");
    const SnapLength s = to_cpp(*snap_length);
    const double whole = moment != nullptr ? s.moment(k) : 0.0;
    write_column(lengths, "lengths", partial, "partial", count,
                 [&](double x) { return s.partial_moment(k, x); });
    if (moment != nullptr) *moment = whole;
  });
}

// --- batches

BRISTLE_INIT(batch_options, batch_options, to_c<bristle_batch_options>(BatchOptions{}))
BRISTLE_INIT(patch_options, patch_options, to_c<bristle_patch_options>(PatchOptions{}))
BRISTLE_INIT(step_report, report, bristle_step_report{})
BRISTLE_INIT(group_step, step, bristle_group_step{})
BRISTLE_INIT(patch_info, info, bristle_patch_info{})

bristle_result bristle_create(const bristle_batch_options* options, bristle_batch** batch) {
  return create(batch, "batch", [&] { return PatchBatch(read_options(options, "options"), header_build); });
}

void bristle_destroy(bristle_batch* batch) { delete batch; }

bristle_result bristle_add(bristle_batch* batch, const bristle_material* material,
                           const bristle_patch_options* options, bristle_id* id) {
  return with(batch, "batch", [&](auto& it) {
    need(id, "id");
    *id = it.add(read_material(material), read_options(options, "options")).value;
  });
}

bristle_result bristle_add_many(bristle_batch* batch, const bristle_material* material,
                                const bristle_patch_options* options, size_t options_size, bristle_id* ids,
                                size_t count) {
  return with(batch, "batch", [&](auto& it) {
    need_columns(options, "options", ids, "ids", count);
    if (count > 0) check_size<bristle_patch_options>(options_size, "options_size");
    const Material m = read_material(material);
    // Converts all options before it adds a patch, so that a wrong struct is refused before anything has
    // changed.
    std::vector<PatchOptions> all(count);
    for (size_t i = 0; i < count; ++i)
      all[i] = read_cpp(options + i, ("options[" + std::to_string(i) + "]").c_str());
    std::vector<PatchId> added;
    added.reserve(count);
    try {
      for (const PatchOptions& o : all) added.push_back(it.add(m, o));
    } catch (...) {
      for (; !added.empty(); added.pop_back()) it.remove(added.back());
      throw;
    }
    for (size_t i = 0; i < count; ++i) ids[i] = added[i].value;
  });
}

bristle_result bristle_remove(bristle_batch* batch, bristle_id id) {
  return with(batch, "batch", [&](auto& it) { it.remove({id}); });
}

bristle_result bristle_set_material(bristle_batch* batch, bristle_id id, const bristle_material* material) {
  return with(batch, "batch", [&](auto& it) { it.set_material({id}, read_material(material)); });
}

bristle_result bristle_add_group(bristle_batch* batch, const bristle_material* material,
                                 const bristle_patch_options* options, size_t count, bristle_group* group) {
  return with(batch, "batch", [&](auto& it) {
    need(group, "group");
    const PatchGroup added = it.add_group(read_material(material), read_options(options, "options"), count);
    *group = {added.first.value, added.count};
  });
}

bristle_result bristle_remove_group(bristle_batch* batch, bristle_group group) {
  return with(batch, "batch", [&](auto& it) { it.remove(to_cpp(group)); });
}

bristle_result bristle_set_group_material(bristle_batch* batch, bristle_group group,
                                          const bristle_material* material) {
  return with(batch, "batch", [&](auto& it) { it.set_material(to_cpp(group), read_material(material)); });
}

bristle_result bristle_step_groups(bristle_batch* batch, double dt_s, const bristle_group_step* groups,
                                   size_t group_count, const bristle_motion* motions, size_t motion_size,
                                   bristle_response* responses, size_t response_size, size_t count,
                                   bristle_step_report* report) {
  if (const char* fault = fault_of_sizes(motion_size, response_size, count))
    return fail(BRISTLE_BAD_ARGUMENT, fault);
  const auto step = [&](auto& it, auto in, auto out) {
    if (group_count > BRISTLE_MOST_GROUPS) throw Error("bristle_step_groups: too many groups in one call");
    if (group_count > 0) need(groups, "groups");
    std::array<GroupStep, BRISTLE_MOST_GROUPS> steps;
    for (size_t i = 0; i < group_count; ++i) {
      check_size(groups[i], "groups");
      steps[i] = to_cpp(groups[i]);
    }
    return it.step(dt_s, in, out, {steps.data(), group_count});
  };
  return step_all(batch, "batch", motions, responses, count, report, step);
}

bristle_result bristle_find_group_force(bristle_batch* batch, double dt_s, const bristle_group_step* step,
                                        bristle_step_report* report) {
  return with(batch, "batch", [&](auto& it) {
    need(step, "step");
    check_size(*step, "step");
    report_step(report, [&] { return it.find_force(dt_s, to_cpp(*step)); });
  });
}

bristle_result bristle_reset(bristle_batch* batch, bristle_id id, uint32_t seed, uint64_t key) {
  return with(batch, "batch", [&](auto& it) {
    if (!it.reset({id}, seed, key)) refuse_patch("bristle_reset", id);
  });
}

bristle_result bristle_warm_up(bristle_batch* batch) {
  return with(batch, "batch", [&](auto& it) { it.warm_up(); });
}

bristle_result bristle_step(bristle_batch* batch, double dt_s, const bristle_motion* motions,
                            size_t motion_size, bristle_response* responses, size_t response_size,
                            size_t count, bristle_step_report* report) {
  if (const char* fault = fault_of_sizes(motion_size, response_size, count))
    return fail(BRISTLE_BAD_ARGUMENT, fault);
  return step_all(batch, "batch", motions, responses, count, report,
                  [&](auto& it, auto in, auto out) { return it.step(dt_s, in, out); });
}

bristle_result bristle_find_force(bristle_batch* batch, double dt_s, const bristle_motion* motions,
                                  size_t motion_size, bristle_response* responses, size_t response_size,
                                  size_t count) {
  if (const char* fault = fault_of_sizes(motion_size, response_size, count))
    return fail(BRISTLE_BAD_ARGUMENT, fault);
  return try_all(batch, "batch", motions, responses, count,
                 [&](auto& it, const auto& motion) { return it.find_force(dt_s, motion); });
}

bristle_result bristle_find_info(const bristle_batch* batch, bristle_id id, bristle_patch_info* info) {
  return with(batch, "batch", [&](auto& it) {
    const PatchInfo p = it.info({id});
    if (p.representatives == 0) refuse_patch("bristle_find_info", id);
    write_struct(to_c<bristle_patch_info>(p), info, "info");
  });
}

double bristle_stored_energy(const bristle_batch* batch, bristle_id id) {
  return batch != nullptr ? batch->it.stored_energy({id}) : 0.0;
}

uint64_t bristle_state_hash(const bristle_batch* batch, bristle_id id) { return hash_of(batch, id); }

size_t bristle_read_bristles(const bristle_batch* batch, bristle_id id, double* zx, double* zy, double* delta,
                             size_t capacity) {
  if (batch == nullptr) return 0;
  const auto column = [&](double* values) { return Span<double>(values, values != nullptr ? capacity : 0); };
  // Passes an empty column where the caller gave a null pointer; read_bristles() then leaves that column out.
  return std::min(capacity, batch->it.read_bristles({id}, column(zx), column(zy), column(delta)));
}

BRISTLE_STATE_CALLS(bristle, batch)

size_t bristle_patch_count(const bristle_batch* batch) {
  return batch != nullptr ? batch->it.patch_count() : 0;
}
int32_t bristle_threads(const bristle_batch* batch) { return batch != nullptr ? batch->it.threads() : 0; }
const char* bristle_isa(const bristle_batch* batch) { return batch != nullptr ? batch->it.isa() : nullptr; }

// --- patches with an extent

#if BRISTLE_WITH_OUTLINES
bristle_result bristle_ellipse_cells(double half_x, double half_y, uint32_t pressure, int32_t rings,
                                     int32_t around, bristle_cell* cells, size_t capacity, size_t* count) {
  return guarded([&] {
    write_cells(Outline::ellipse(half_x, half_y, read_pressure(pressure), rings, around), cells, capacity,
                count);
  });
}

bristle_result bristle_rectangle_cells(double half_x, double half_y, uint32_t pressure, int32_t nx,
                                       int32_t ny, bristle_cell* cells, size_t capacity, size_t* count) {
  return guarded([&] {
    write_cells(Outline::rectangle(half_x, half_y, read_pressure(pressure), nx, ny), cells, capacity, count);
  });
}
#endif

}  // extern "C"

#if BRISTLE_WITH_BEDS
namespace {

bristle_bed default_bed() noexcept {
  bristle_bed bed{};
  copy_to_c<BedMirror<BedMaterial>>(BedMaterial{}, bed);
  copy_to_c<BedMirror<BedShape>>(BedShape{}, bed);
  copy_to_c<BedMirror<BedOptions>>(BedOptions{}, bed);
  return bed;
}

struct GivenBed {
  BedMaterial material;
  BedShape shape;
  BedOptions options;
};

GivenBed read_bed(const bristle_bed* bed) {
  need(bed, "bed");
  check_size(*bed, "bed");
  GivenBed read;
  copy_to_cpp<BedMirror<BedMaterial>>(*bed, read.material);
  copy_to_cpp<BedMirror<BedShape>>(*bed, read.shape);
  copy_to_cpp<BedMirror<BedOptions>>(*bed, read.options);
  if (bed->list_count > 0) {
    need(bed->list, "bed.list");
    const auto list = as_cpp(bed->list, bed->list_count);
    read.shape.list.assign(list.begin(), list.end());
  }
  return read;
}

}  // namespace

extern "C" {

BRISTLE_INIT(bed, bed, default_bed())

bristle_result bristle_beds_create(const bristle_batch_options* options, bristle_beds** beds) {
  return create(beds, "beds", [&] { return BedBatch(read_options(options, "options")); });
}

void bristle_beds_destroy(bristle_beds* beds) { delete beds; }

bristle_result bristle_beds_add(bristle_beds* beds, const bristle_bed* bed, bristle_id* id) {
  return with(beds, "beds", [&](auto& it) {
    need(id, "id");
    const GivenBed given = read_bed(bed);
    *id = it.add(given.material, given.shape, given.options).value;
  });
}

uint32_t bristle_beds_reset(bristle_beds* beds, bristle_id id) {
  return beds != nullptr && beds->it.reset({id}) ? 1 : 0;
}

bristle_result bristle_beds_remove(bristle_beds* beds, bristle_id id) {
  return with(beds, "beds", [&](auto& it) { it.remove({id}); });
}

bristle_result bristle_beds_step(bristle_beds* beds, const bristle_bed_motion* motions,
                                 bristle_bed_response* responses, size_t count, bristle_step_report* report) {
  return step_all(beds, "beds", motions, responses, count, report,
                  [](auto& it, auto in, auto out) { return it.step(in, out); });
}

bristle_result bristle_beds_find_force(bristle_beds* beds, const bristle_bed_motion* motions,
                                       bristle_bed_response* responses, size_t count) {
  return try_all(beds, "beds", motions, responses, count,
                 [](auto& it, const auto& motion) { return it.find_force(motion); });
}

uint64_t bristle_beds_state_hash(const bristle_beds* beds, bristle_id id) { return hash_of(beds, id); }

BRISTLE_STATE_CALLS(bristle_beds, beds)

}  // extern "C"
#endif

#if BRISTLE_WITH_JOINTS
extern "C" {

BRISTLE_INIT(joint_options, options, to_c<bristle_joint_options>({}))
BRISTLE_INIT(joint_step, step, bristle_joint_step{})

bristle_result bristle_joints_create(size_t count, const bristle_joint_material* materials,
                                     size_t material_count, const bristle_joint_options* options,
                                     const bristle_batch_options* batch, bristle_joints** joints) {
  return create(joints, "joints", [&] {
    need(materials, "materials");
    return JointFriction(count, as_cpp(materials, material_count), read_options(options, "options"),
                         read_options(batch, "batch"));
  });
}

void bristle_joints_destroy(bristle_joints* joints) { delete joints; }

}  // extern "C"

namespace {

bristle_result step_joints(bristle_joints* joints, const bristle_joint_step* step,
                           bristle_step_report* report,
                           StepReport (JointFriction::*go)(const JointInput&, const JointOutput&) noexcept) {
  return with(joints, "joints", [&](auto& it) {
    need(step, "step");
    check_size(*step, "step");
    need(step->angle, "step.angle");
    const std::size_t n = it.joint_count();
    const auto in = [n](const double* column) {
      return Span<const double>(column, column != nullptr ? n : 0);
    };
    const auto out = [n](double* column, std::size_t rows = 1) {
      return Span<double>(column, column != nullptr ? rows * n : 0);
    };
    report_step(report, [&] {
      const StepReport done =
          (it.*go)({in(step->angle), in(step->speed), in(step->motor), in(step->outside)},
                   {out(step->torque),
                    out(step->mean),
                    out(step->by_angle),
                    out(step->by_speed),
                    out(step->by_motor),
                    out(step->by_outside),
                    {reinterpret_cast<Status*>(step->status), step->status != nullptr ? n : 0},
                    out(step->gradient, joint_parameters)});
      if (done.tasks == 0) throw Error("step.gradient needs bristle_joint_options.gradients");
      return done;
    });
  });
}

}  // namespace

extern "C" {

bristle_result bristle_joints_step(bristle_joints* joints, const bristle_joint_step* step,
                                   bristle_step_report* report) {
  return step_joints(joints, step, report, &JointFriction::step);
}
bristle_result bristle_joints_find_torque(bristle_joints* joints, const bristle_joint_step* step,
                                          bristle_step_report* report) {
  return step_joints(joints, step, report, &JointFriction::find_torque);
}

bristle_result bristle_joints_reset(bristle_joints* joints) {
  return with(joints, "joints", [&](auto& it) { it.reset(); });
}
bristle_result bristle_joints_reset_one(bristle_joints* joints, size_t joint) {
  return with(joints, "joints", [&](auto& it) {
    if (!it.reset(joint)) throw Error("bristle_joints_reset_one: there is no joint " + std::to_string(joint));
  });
}

uint64_t bristle_joints_state_hash(const bristle_joints* joints) {
  return joints != nullptr ? joints->it.state_hash() : 0;
}
BRISTLE_STATE_CALLS(bristle_joints, joints)

}  // extern "C"
#endif

extern "C" {

#if BRISTLE_WITH_OUTLINES
bristle_result bristle_extended_create(bristle_batch* batch, bristle_extended** extended) {
  return create(extended, "extended", [&] {
    need(batch, "batch");
    return ExtendedPatches(batch->it);
  });
}

void bristle_extended_destroy(bristle_extended* extended) { delete extended; }

bristle_result bristle_extended_add(bristle_extended* extended, const bristle_material* material,
                                    const bristle_patch_options* options, const bristle_cell* cells,
                                    size_t count, double full_size_load, bristle_id* id) {
  return with(extended, "extended", [&](auto& it) {
    need(id, "id");
    if (count > 0) need(cells, "cells");
    Outline outline;
    outline.cells.assign(as_cpp(cells, count).begin(), as_cpp(cells, count).end());
    outline.full_size_load = full_size_load;
    *id = it.add(read_material(material), read_options(options, "options"), outline).value;
  });
}

bristle_result bristle_extended_remove(bristle_extended* extended, bristle_id id) {
  return with(extended, "extended", [&](auto& it) { it.remove({id}); });
}

bristle_result bristle_extended_set_material(bristle_extended* extended, bristle_id id,
                                             const bristle_material* material) {
  return with(extended, "extended", [&](auto& it) { it.set_material({id}, read_material(material)); });
}

bristle_result bristle_extended_set_scale(bristle_extended* extended, bristle_id id, double scale) {
  return with(extended, "extended", [&](auto& it) {
    if (it.set_scale({id}, scale)) return;
    if (it.cell_count({id}) == 0) refuse_patch("bristle_extended_set_scale", id);
    detail::refuse("bristle_extended_set_scale", "scale", scale, "0 to 1e6");
  });
}

bristle_result bristle_extended_step(bristle_extended* extended, double dt_s,
                                     const bristle_extended_motion* motions,
                                     bristle_extended_response* responses, size_t count,
                                     bristle_step_report* report) {
  return step_all(extended, "extended", motions, responses, count, report,
                  [&](auto& it, auto in, auto out) { return it.step(dt_s, in, out); });
}

bristle_result bristle_extended_find_force(bristle_extended* extended, double dt_s,
                                           const bristle_extended_motion* motions,
                                           bristle_extended_response* responses, size_t count) {
  return try_all(extended, "extended", motions, responses, count,
                 [&](auto& it, const auto& motion) { return it.find_force(dt_s, motion); });
}

uint64_t bristle_extended_state_hash(const bristle_extended* extended, bristle_id id) {
  return hash_of(extended, id);
}

BRISTLE_STATE_CALLS(bristle_extended, extended)
#endif

// --- patches by key

BRISTLE_INIT(keyed_options, keyed_options, to_c<bristle_keyed_options>(KeyedOptions{}))
BRISTLE_INIT(matcher_options, matcher_options, to_c<bristle_matcher_options>(MatcherOptions{}))

bristle_result bristle_keyed_create(bristle_batch* batch, const bristle_material* material,
                                    const bristle_patch_options* patch, const bristle_keyed_options* options,
                                    bristle_keyed** keyed) {
  return create(keyed, "keyed", [&] {
    need(batch, "batch");
    return KeyedPatches(batch->it, read_material(material), read_options(patch, "patch"),
                        read_options(options, "options"));
  });
}

#if BRISTLE_WITH_BEDS
bristle_result bristle_keyed_create_beds(bristle_beds* beds, const bristle_bed* bed,
                                         const bristle_keyed_options* options, bristle_keyed** keyed) {
  return create(keyed, "keyed", [&] {
    need(beds, "beds");
    const GivenBed given = read_bed(bed);
    return KeyedBeds(beds->it, given.material, given.shape, given.options, read_options(options, "options"));
  });
}

#endif

void bristle_keyed_destroy(bristle_keyed* keyed) { delete keyed; }

bristle_result bristle_keyed_reserve(bristle_keyed* keyed, uint32_t capacity) {
  return with(keyed, "keyed", [&](KeyedPool& it) { it.reserve(capacity); });
}

bristle_result bristle_keyed_find_or_add(bristle_keyed* keyed, const uint64_t* keys, bristle_id* ids,
                                         size_t count) {
  return with(keyed, "keyed", [&](KeyedPool&) {
    need_columns(keys, "keys", ids, "ids", count);
    const auto find = [&](auto& pool) {
      for (size_t i = 0; i < count; ++i) ids[i] = pool.find_or_add(keys[i]).value;
    };
    std::visit(find, keyed->pool);
  });
}

bristle_result bristle_keyed_find(const bristle_keyed* keyed, const uint64_t* keys, bristle_id* ids,
                                  size_t count) {
  return with(keyed, "keyed", [&](KeyedPool&) {
    need_columns(keys, "keys", ids, "ids", count);
    const auto find = [&](const auto& pool) {
      for (size_t i = 0; i < count; ++i) ids[i] = pool.find(keys[i]).value;
    };
    std::visit(find, keyed->pool);
  });
}

uint32_t bristle_keyed_remove(bristle_keyed* keyed, uint64_t key) {
  return keyed != nullptr && keyed->it.remove(key) ? 1 : 0;
}
void bristle_keyed_clear(bristle_keyed* keyed) {
  if (keyed != nullptr) keyed->it.clear();
}
uint32_t bristle_keyed_end_step(bristle_keyed* keyed) { return keyed != nullptr ? keyed->it.end_step() : 0; }
uint32_t bristle_keyed_size(const bristle_keyed* keyed) { return keyed != nullptr ? keyed->it.size() : 0; }
size_t bristle_keyed_groups(const bristle_keyed* keyed, bristle_group* groups, size_t count) {
  const auto* patches = keyed != nullptr ? std::get_if<KeyedPatches>(&keyed->pool) : nullptr;
  if (patches == nullptr) return 0;
  const Span<const PatchGroup> its = patches->groups();
  for (size_t i = 0; groups != nullptr && i < std::min(count, its.size()); ++i)
    groups[i] = {its[i].first.value, its[i].count};
  return its.size();
}
uint64_t bristle_keyed_refused(const bristle_keyed* keyed) {
  return keyed != nullptr ? keyed->it.refused() : 0;
}

BRISTLE_STATE_CALLS(bristle_keyed, keyed)

bristle_result bristle_matcher_create(const bristle_matcher_options* options, bristle_matcher** matcher) {
  return create(matcher, "matcher", [&] { return ContactMatcher(read_options(options, "options")); });
}

void bristle_matcher_destroy(bristle_matcher* matcher) { delete matcher; }

bristle_result bristle_matcher_reserve(bristle_matcher* matcher, uint32_t capacity) {
  return with(matcher, "matcher", [&](auto& it) { it.reserve(capacity); });
}

bristle_result bristle_matcher_match(bristle_matcher* matcher, const bristle_contact_point* contacts,
                                     uint64_t* keys, size_t count, size_t* found) {
  return with(matcher, "matcher", [&](auto& it) {
    need_columns(contacts, "contacts", keys, "keys", count);
    const size_t seen = it.match(as_cpp(contacts, count), {keys, count});
    if (found != nullptr) *found = seen;
  });
}

void bristle_matcher_clear(bristle_matcher* matcher) {
  if (matcher != nullptr) matcher->it.clear();
}

BRISTLE_STATE_CALLS(bristle_matcher, matcher)

// --- deadline monitor

BRISTLE_INIT(monitor_report, report, bristle_monitor_report{})

bristle_result bristle_monitor_create(double deadline_s, double period_s, bristle_monitor** monitor) {
  return create(monitor, "monitor", [&] {
    const char* const where = "bristle_monitor_create";
    if (!(deadline_s > 0.0)) detail::refuse(where, "deadline_s", deadline_s, "above 0 s");
    if (!(period_s >= 0.0)) detail::refuse(where, "period_s", period_s, "0 (no period) or above, s");
    return DeadlineMonitor(deadline_s, period_s);
  });
}

void bristle_monitor_destroy(bristle_monitor* monitor) { delete monitor; }

void bristle_monitor_record(bristle_monitor* monitor, double wall_s, double cpu_s) {
  if (monitor != nullptr) monitor->it.record(wall_s, cpu_s);
}
void bristle_monitor_record_tick(bristle_monitor* monitor, double due_s, double start_s, double end_s,
                                 double cpu_s) {
  if (monitor != nullptr) monitor->it.record_tick(Tick{due_s, start_s, end_s, cpu_s});
}
void bristle_monitor_record_skipped(bristle_monitor* monitor, uint64_t ticks) {
  if (monitor != nullptr) monitor->it.record_skipped(ticks);
}
void bristle_monitor_pause(bristle_monitor* monitor) {
  if (monitor != nullptr) monitor->it.pause();
}
void bristle_monitor_refresh_events(bristle_monitor* monitor) {
  if (monitor != nullptr) monitor->it.refresh_events();
}
void bristle_monitor_reset(bristle_monitor* monitor) {
  if (monitor != nullptr) monitor->it.reset();
}

bristle_result bristle_monitor_find_report(const bristle_monitor* monitor, bristle_monitor_report* report) {
  return guarded([&] {
    need(monitor, "monitor");
    DeadlineMonitor m;
    if (!monitor->it.snapshot(m))
      throw Error(
          "bristle_monitor_find_report: the monitor was written to all the time: its ticks follow each other "
          "without a pause; try again");
    bristle_monitor_report c{};
    c.deadline = m.deadline();
    c.period = m.period();
    c.p50 = m.p50();
    c.p99 = m.p99();
    c.p999 = m.p999();
    c.max = m.max();
    c.mean = m.mean();
    c.jitter_p50 = m.period_jitter().percentile(0.5);
    c.jitter_p99 = m.period_jitter().percentile(0.99);
    c.jitter_max = m.period_jitter().max();
    c.count = m.count();
    c.misses = m.misses();
    c.misses_ours = m.misses_ours();
    c.skipped = m.skipped();
    c.longest_run = m.longest_run();
    c.involuntary_switches = m.late_events().involuntary_switches;
    c.minor_faults = m.late_events().minor_faults;
    c.major_faults = m.late_events().major_faults;
    write_struct(c, report, "report");
  });
}

double bristle_wall_now(void) { return DeadlineMonitor::wall_now(); }
double bristle_cpu_now(void) { return DeadlineMonitor::cpu_now(); }

}  // extern "C"
