// The C interface over the C++ one. Motions and responses are the C++ structs themselves: a step copies
// nothing.
#include "bristle/bristle.h"

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <new>
#include <type_traits>
#include <vector>

#include "bristle/bristle.hpp"
#include "bristle/load_shedder.hpp"

using namespace bristle;

// ------------------------------------------------------------------------- layouts shared with C++
#define BRISTLE_SAME_PLACE(c_type, cpp_type, field)                     \
  static_assert(offsetof(c_type, field) == offsetof(cpp_type, field) && \
                    sizeof(c_type::field) == sizeof(cpp_type::field),   \
                #c_type "." #field " must lie where " #cpp_type " has it")
static_assert(sizeof(bristle_motion) == sizeof(Motion) && alignof(bristle_motion) == alignof(Motion));
static_assert(std::is_standard_layout_v<Motion> && std::is_trivially_copyable_v<Motion>);
BRISTLE_SAME_PLACE(bristle_motion, Motion, id);
BRISTLE_SAME_PLACE(bristle_motion, Motion, displacement);
BRISTLE_SAME_PLACE(bristle_motion, Motion, normal_load);
BRISTLE_SAME_PLACE(bristle_motion, Motion, has_velocity);
BRISTLE_SAME_PLACE(bristle_motion, Motion, velocity);
static_assert(sizeof(bristle_response) == sizeof(Response) && alignof(bristle_response) == alignof(Response));
static_assert(std::is_standard_layout_v<Response> && std::is_trivially_copyable_v<Response>);
BRISTLE_SAME_PLACE(bristle_response, Response, id);
BRISTLE_SAME_PLACE(bristle_response, Response, status);
BRISTLE_SAME_PLACE(bristle_response, Response, end);
BRISTLE_SAME_PLACE(bristle_response, Response, elastic);
BRISTLE_SAME_PLACE(bristle_response, Response, damper);
BRISTLE_SAME_PLACE(bristle_response, Response, mean);
BRISTLE_SAME_PLACE(bristle_response, Response, stiffness);
BRISTLE_SAME_PLACE(bristle_response, Response, damping);
BRISTLE_SAME_PLACE(bristle_response, Response, force_limit);
BRISTLE_SAME_PLACE(bristle_response, Response, dissipated);
BRISTLE_SAME_PLACE(bristle_response, Response, contact_loss);
BRISTLE_SAME_PLACE(bristle_response, Response, damper_work);
BRISTLE_SAME_PLACE(bristle_response, Response, snaps);

static_assert(sizeof(bristle_contact_point) == sizeof(ContactPoint) &&
              std::is_standard_layout_v<ContactPoint>);
BRISTLE_SAME_PLACE(bristle_contact_point, ContactPoint, pair);
BRISTLE_SAME_PLACE(bristle_contact_point, ContactPoint, point);
static_assert(sizeof(bristle_detail_decision) == sizeof(DetailDecision) &&
              std::is_standard_layout_v<DetailDecision>);
BRISTLE_SAME_PLACE(bristle_detail_decision, DetailDecision, step);
BRISTLE_SAME_PLACE(bristle_detail_decision, DetailDecision, patch);
BRISTLE_SAME_PLACE(bristle_detail_decision, DetailDecision, bristles);
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
              same_value<BRISTLE_DECAY_GAUSSIAN, DamperDecay::gaussian> &&
              same_value<BRISTLE_OUTPUT_MEAN, Outputs::mean> &&
              same_value<BRISTLE_OUTPUT_ENERGY, Outputs::energy> &&
              same_value<BRISTLE_PRECISION_DOUBLE, Precision::double_> &&
              same_value<BRISTLE_STEP_LITERAL, StepRule::literal> &&
              same_value<BRISTLE_SAMPLING_RANDOM, Sampling::random>);
static_assert(same_value<BRISTLE_STATUS_UNKNOWN_ID, Status::unknown_id> &&
              same_value<BRISTLE_STATUS_REPEATED_ID, Status::repeated_id> &&
              same_value<BRISTLE_STATUS_BAD_INPUT, Status::bad_input> &&
              same_value<BRISTLE_STATUS_OVERLOAD, Status::overload>);

struct bristle_batch {
  explicit bristle_batch(const BatchOptions& options) : batch(options, header_build) {}
  PatchBatch batch;
  // For callers whose structs have other sizes.
  std::vector<Motion> motions;
  std::vector<Response> responses;
};

struct bristle_shedder {
  LoadShedder shedder;
};

struct bristle_keyed {
  KeyedPatches patches;
};

struct bristle_matcher {
  ContactMatcher matcher;
};

struct bristle_monitor {
  DeadlineMonitor monitor;
};

namespace {

// ------------------------------------------------------------------------------------------ failures

thread_local char last_error[512] = "";

bristle_result fail(bristle_result result, const char* text, const char* detail = "") noexcept {
  std::snprintf(last_error, sizeof last_error, "%s%s", text, detail);
  return result;
}

/// A null pointer or a size that is none, found before anything is done.
struct BadArgument {
  const char* text;
  const char* detail;
};

/// Runs a call and turns what it throws into its result.
template <class Call>
bristle_result guarded(Call&& call) noexcept {
  try {
    call();
    return BRISTLE_OK;
  } catch (const BadArgument& e) {
    return fail(BRISTLE_BAD_ARGUMENT, e.text, e.detail);
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

void need(const void* pointer, const char* name) {
  if (pointer == nullptr) throw BadArgument{name, " is null"};
}
void need_columns(const void* in, const void* out, std::size_t count) {
  if (count > 0 && (in == nullptr || out == nullptr)) throw BadArgument{"a column is null", ""};
}

// ------------------------------------------------------------------------- structs of the caller's size

constexpr std::size_t largest_struct = 65536;  // more is memory that nobody initialised

template <class Struct>
std::size_t size_of(const Struct& s, const char* name) {
  if (s.struct_size < sizeof(std::size_t) || s.struct_size > largest_struct)
    throw BadArgument{name, ".struct_size is no size: call its bristle_init_ function first"};
  return std::min(s.struct_size, sizeof(Struct));
}

/// Fields that the caller's struct lacks keep the values they have in `to`.
template <class Struct>
void read_struct(const Struct* from, Struct& to, const char* name) {
  need(from, name);
  std::memcpy(&to, from, size_of(*from, name));
}

template <class Struct>
void write_struct(const Struct& from, Struct* to, const char* name) {
  need(to, name);
  constexpr std::size_t head = sizeof(std::size_t);
  std::memcpy(reinterpret_cast<char*>(to) + head, reinterpret_cast<const char*>(&from) + head,
              size_of(*to, name) - head);
}

/// Writes what `function` makes of each value: all or, where it refuses one, nothing.
template <class Function>
void write_column(const double* in, double* out, std::size_t count, const Function& function) {
  need_columns(in, out, count);
  std::vector<double> values(count);
  for (std::size_t i = 0; i < count; ++i) values[i] = function(in[i]);
  std::copy(values.begin(), values.end(), out);
}

template <class Struct>
bristle_result init_struct(Struct* s, std::size_t struct_size, Struct defaults, const char* name) noexcept {
  return guarded([&] {
    need(s, name);
    if (struct_size < sizeof(std::size_t) || struct_size > largest_struct)
      throw BadArgument{name, ": struct_size is no size"};
    defaults.struct_size = struct_size;
    std::memcpy(s, &defaults, std::min(struct_size, sizeof(Struct)));
  });
}

template <class Enum>
Enum as_enum(std::uint32_t value, Enum last, const char* name) {
  if (value > static_cast<std::uint32_t>(last))
    throw Error(std::string(name) + " = " + std::to_string(value) + "; allowed: 0 to " +
                std::to_string(static_cast<unsigned>(last)));
  return static_cast<Enum>(value);
}

// ------------------------------------------------------------------------------------------ materials

SnapLength to_cpp(const bristle_snap_length& s) {
  switch (as_enum(s.law, SnapLaw::table, "snap_length.law")) {
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

/// The table, if there is one, is that of `s`.
bristle_snap_length to_c(const SnapLength& s) {
  bristle_snap_length c{};
  c.law = static_cast<std::uint32_t>(s.law());
  c.first_parameter = s.first_parameter();
  c.second_parameter = s.second_parameter();
  c.table_size = static_cast<std::uint32_t>(s.table_values().size());
  c.table = c.table_size > 0 ? s.table_values().data() : nullptr;
  return c;
}

bristle_material to_c(const Material& m) {
  bristle_material c{};
  c.bristle_stiffness = m.bristle_stiffness;
  c.bristle_damping = m.bristle_damping;
  c.viscous_friction = m.viscous_friction;
  c.stribeck_velocity = m.stribeck_velocity;
  c.normal_stiffness = m.normal_stiffness;
  c.asperity_height_deviation = m.asperity_height_deviation;
  c.snap_length = to_c(m.snap_length);
  c.snap_rule = static_cast<std::uint32_t>(m.snap_rule);
  c.damper_decay = static_cast<std::uint32_t>(m.damper_decay);
  return c;
}

Material to_cpp(const bristle_material* from) {
  bristle_material c = to_c(Material{});
  read_struct(from, c, "material");
  Material m;
  m.bristle_stiffness = c.bristle_stiffness;
  m.bristle_damping = c.bristle_damping;
  m.viscous_friction = c.viscous_friction;
  m.stribeck_velocity = c.stribeck_velocity;
  m.normal_stiffness = c.normal_stiffness;
  m.asperity_height_deviation = c.asperity_height_deviation;
  m.snap_length = to_cpp(c.snap_length);
  m.snap_rule = as_enum(c.snap_rule, SnapRule::keep, "snap_rule");
  m.damper_decay = as_enum(c.damper_decay, DamperDecay::gaussian, "damper_decay");
  m.validate();
  return m;
}

bristle_coefficients to_c(const Coefficients& k) {
  bristle_coefficients c{};
  c.kinetic = k.kinetic;
  c.peak = k.peak;
  c.presliding_length = k.presliding_length;
  c.bristles_per_newton = k.bristles_per_newton;
  c.damping_per_newton = k.damping_per_newton;
  c.viscous_friction = k.viscous_friction;
  c.stribeck_velocity = k.stribeck_velocity;
  c.law = static_cast<std::uint32_t>(k.law);
  c.snap_rule = static_cast<std::uint32_t>(k.rule);
  c.damper_decay = static_cast<std::uint32_t>(k.damper_decay);
  return c;
}

Coefficients to_cpp(const bristle_coefficients* from) {
  bristle_coefficients c = to_c(Coefficients{});
  read_struct(from, c, "coefficients");
  Coefficients k;
  k.kinetic = c.kinetic;
  k.peak = c.peak;
  k.presliding_length = c.presliding_length;
  k.bristles_per_newton = c.bristles_per_newton;
  k.damping_per_newton = c.damping_per_newton;
  k.viscous_friction = c.viscous_friction;
  k.stribeck_velocity = c.stribeck_velocity;
  k.law = as_enum(c.law, SnapLaw::table, "law");
  k.rule = as_enum(c.snap_rule, SnapRule::keep, "snap_rule");
  k.damper_decay = as_enum(c.damper_decay, DamperDecay::gaussian, "damper_decay");
  return k;
}

// --------------------------------------------------------------------------------------------- batches

bristle_batch_options to_c(const BatchOptions& o) {
  bristle_batch_options c{};
  c.isa = o.isa;
  c.threads = o.threads;
  c.servo_core = o.servo_core;
  c.eager = o.eager ? 1 : 0;
  return c;
}

BatchOptions to_cpp(const bristle_batch_options* from) {
  bristle_batch_options c = to_c(BatchOptions{});
  if (from != nullptr) read_struct(from, c, "batch_options");
  return BatchOptions{}
      .with_isa(c.isa)
      .with_threads(c.threads)
      .with_servo_core(c.servo_core)
      .with_eager(c.eager != 0);
}

bristle_patch_options to_c(const PatchOptions& o) {
  bristle_patch_options c{};
  c.max_normal_load = o.max_normal_load;
  c.key = o.key;
  c.bristles = o.bristles;
  c.seed = o.seed;
  c.axes = o.axes;
  c.outputs = static_cast<std::uint32_t>(o.outputs);
  c.precision = static_cast<std::uint32_t>(o.precision);
  c.step_rule = static_cast<std::uint32_t>(o.step_rule);
  c.sampling = static_cast<std::uint32_t>(o.sampling);
  return c;
}

PatchOptions to_cpp(const bristle_patch_options* from) {
  bristle_patch_options c = to_c(PatchOptions{});
  if (from != nullptr) read_struct(from, c, "patch_options");
  PatchOptions o;
  o.max_normal_load = c.max_normal_load;
  o.key = c.key;
  o.bristles = c.bristles;
  o.seed = c.seed;
  o.axes = c.axes;
  o.outputs = as_enum(c.outputs, Outputs::all, "outputs");
  o.precision = as_enum(c.precision, Precision::double_, "precision");
  o.step_rule = as_enum(c.step_rule, StepRule::literal, "step_rule");
  o.sampling = as_enum(c.sampling, Sampling::random, "sampling");
  return o;
}

bristle_shedder_options to_c(const LoadShedderOptions& o) {
  bristle_shedder_options c{};
  c.budget = o.budget_s;
  c.shed_above = o.shed_above;
  c.shed_to = o.shed_to;
  c.restore_to = o.restore_to;
  c.rate = o.rate_s;
  c.change = o.change_s;
  c.record = o.record;
  c.late_steps = o.late_steps;
  c.wait_steps = o.wait_steps;
  return c;
}

LoadShedderOptions to_cpp(const bristle_shedder_options* from) {
  bristle_shedder_options c = to_c(LoadShedderOptions{});
  if (from != nullptr) read_struct(from, c, "shedder_options");
  LoadShedderOptions o;
  o.budget_s = c.budget;
  o.shed_above = c.shed_above;
  o.shed_to = c.shed_to;
  o.restore_to = c.restore_to;
  o.rate_s = c.rate;
  o.change_s = c.change;
  o.record = static_cast<std::size_t>(c.record);
  o.late_steps = c.late_steps;
  o.wait_steps = c.wait_steps;
  return o;
}

bristle_keyed_options to_c(const KeyedOptions& o) {
  bristle_keyed_options c{};
  c.capacity = o.capacity;
  c.keep_steps = o.keep_steps;
  c.seed_from_key = o.seed_from_key ? 1 : 0;
  return c;
}

KeyedOptions to_cpp(const bristle_keyed_options* from) {
  bristle_keyed_options c = to_c(KeyedOptions{});
  if (from != nullptr) read_struct(from, c, "keyed_options");
  return KeyedOptions{}
      .with_capacity(c.capacity)
      .with_keep_steps(c.keep_steps)
      .with_seed_from_key(c.seed_from_key != 0);
}

bristle_matcher_options to_c(const MatcherOptions& o) {
  bristle_matcher_options c{};
  c.reach = o.reach;
  c.capacity = o.capacity;
  c.keep_steps = o.keep_steps;
  return c;
}

MatcherOptions to_cpp(const bristle_matcher_options* from) {
  bristle_matcher_options c = to_c(MatcherOptions{});
  if (from != nullptr) read_struct(from, c, "matcher_options");
  return MatcherOptions{}.with_capacity(c.capacity).with_reach(c.reach).with_keep_steps(c.keep_steps);
}

// A motion needs its load, a response its end force; what later fields a caller does not have is left out.
constexpr std::size_t least_motion = offsetof(bristle_motion, has_velocity);
constexpr std::size_t least_response = offsetof(bristle_response, elastic);

/// Null when the arrays can be stepped; the refusal else.
const char* refusal_of(const bristle_batch* batch, const void* motions, std::size_t motion_size,
                       const void* responses, std::size_t response_size, std::size_t count) noexcept {
  if (batch == nullptr) return "batch is null";
  if (count == 0) return nullptr;
  if (motions == nullptr) return "motions is null";
  if (responses == nullptr) return "responses is null";
  if (motion_size < least_motion || motion_size > largest_struct)
    return "motion_size must be sizeof(bristle_motion)";
  if (response_size < least_response || response_size > largest_struct)
    return "response_size must be sizeof(bristle_response)";
  return nullptr;
}

template <class To>
void read_element(const void* array, std::size_t size, std::size_t i, To& to) noexcept {
  std::memcpy(&to, static_cast<const char*>(array) + i * size, std::min(size, sizeof(To)));
}
template <class From>
void write_element(const From& from, void* array, std::size_t size, std::size_t i) noexcept {
  std::memcpy(static_cast<char*>(array) + i * size, &from, std::min(size, sizeof(From)));
}

StepReport step_copies(bristle_batch& b, double dt_s, const void* motions, std::size_t motion_size,
                       void* responses, std::size_t response_size, std::size_t count) {
  // Each by its own size: there may have been memory for the first only.
  if (b.motions.size() < count) b.motions.resize(count);
  if (b.responses.size() < count) b.responses.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    b.motions[i] = Motion{};
    read_element(motions, motion_size, i, b.motions[i]);
    read_element(responses, response_size, i, b.responses[i]);  // outputs not computed stay as they are
  }
  const StepReport report = b.batch.step(dt_s, {b.motions.data(), count}, {b.responses.data(), count});
  for (std::size_t i = 0; i < count; ++i) write_element(b.responses[i], responses, response_size, i);
  return report;
}

}  // namespace

extern "C" {

const char* bristle_result_name(bristle_result result) {
  switch (result) {
    case BRISTLE_OK:
      return "BRISTLE_OK";
    case BRISTLE_BAD_ARGUMENT:
      return "BRISTLE_BAD_ARGUMENT";
    case BRISTLE_REFUSED:
      return "BRISTLE_REFUSED";
    case BRISTLE_OUT_OF_MEMORY:
      return "BRISTLE_OUT_OF_MEMORY";
    case BRISTLE_WRONG_BUILD:
      return "BRISTLE_WRONG_BUILD";
    case BRISTLE_FAILED:
      return "BRISTLE_FAILED";
    default:
      return "no result of bristle";
  }
}

const char* bristle_last_error(void) { return last_error; }
const char* bristle_version(void) { return library_version(); }

bristle_result bristle_check_build(uint32_t version_number, uint32_t build_options) {
  return guarded([&] {
           BuildSignature headers = header_build;  // struct sizes travel with the structs
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

bristle_result bristle_init_material(bristle_material* material, size_t struct_size) {
  return init_struct(material, struct_size, to_c(Material{}), "material");
}
bristle_result bristle_init_coefficients(bristle_coefficients* coefficients, size_t struct_size) {
  return init_struct(coefficients, struct_size, to_c(Coefficients{}), "coefficients");
}
bristle_result bristle_init_material_facts(bristle_material_facts* facts, size_t struct_size) {
  return init_struct(facts, struct_size, bristle_material_facts{}, "facts");
}

bristle_result bristle_material_from_coefficients(const bristle_coefficients* coefficients,
                                                  bristle_material* material) {
  return guarded(
      [&] { write_struct(to_c(Material::from_coefficients(to_cpp(coefficients))), material, "material"); });
}

bristle_result bristle_material_to_coefficients(const bristle_material* material,
                                                bristle_coefficients* coefficients) {
  return guarded([&] { write_struct(to_c(to_cpp(material).coefficients()), coefficients, "coefficients"); });
}

bristle_result bristle_material_check(const bristle_material* material) {
  return guarded([&] { to_cpp(material); });
}

bristle_result bristle_material_find_facts(const bristle_material* material, bristle_material_facts* facts) {
  return guarded([&] {
    const Material m = to_cpp(material);
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
  return guarded([&] {
    const Material m = to_cpp(material);
    write_column(speeds, forces, count, [&](double v) { return m.steady_force(v, normal_load_n); });
  });
}

bristle_result bristle_material_damping(const bristle_material* material, const double* speeds,
                                        double* dampings, size_t count) {
  return guarded([&] {
    const Material m = to_cpp(material);
    write_column(speeds, dampings, count, [&](double v) { return m.damping_at(v); });
  });
}

bristle_result bristle_material_virgin_deflection(const bristle_material* material,
                                                  const double* displacements, double* deflections,
                                                  size_t count) {
  return guarded([&] {
    const Material m = to_cpp(material);
    write_column(displacements, deflections, count,
                 [&](double x) { return virgin_deflection(m.snap_length, m.snap_rule, x); });
  });
}

bristle_result bristle_snap_length_quantile(const bristle_snap_length* snap_length, const double* shares,
                                            double* lengths, size_t count) {
  return guarded([&] {
    need(snap_length, "snap_length");
    const SnapLength s = to_cpp(*snap_length);
    write_column(shares, lengths, count, [&](double u) { return s.quantile(u); });
  });
}

bristle_result bristle_snap_length_survival(const bristle_snap_length* snap_length, const double* lengths,
                                            double* shares, size_t count) {
  return guarded([&] {
    need(snap_length, "snap_length");
    const SnapLength s = to_cpp(*snap_length);
    write_column(lengths, shares, count, [&](double x) { return s.survival(x); });
  });
}

bristle_result bristle_snap_length_moment(const bristle_snap_length* snap_length, int32_t k, double* moment,
                                          const double* lengths, double* partial, size_t count) {
  return guarded([&] {
    need(snap_length, "snap_length");
    const SnapLength s = to_cpp(*snap_length);
    const double whole = moment != nullptr ? s.moment(k) : 0.0;
    write_column(lengths, partial, count, [&](double x) { return s.partial_moment(k, x); });
    if (moment != nullptr) *moment = whole;
  });
}

// --- batches

bristle_result bristle_init_batch_options(bristle_batch_options* options, size_t struct_size) {
  return init_struct(options, struct_size, to_c(BatchOptions{}), "batch_options");
}
bristle_result bristle_init_patch_options(bristle_patch_options* options, size_t struct_size) {
  return init_struct(options, struct_size, to_c(PatchOptions{}), "patch_options");
}
bristle_result bristle_init_step_report(bristle_step_report* report, size_t struct_size) {
  return init_struct(report, struct_size, bristle_step_report{}, "report");
}
bristle_result bristle_init_patch_info(bristle_patch_info* info, size_t struct_size) {
  return init_struct(info, struct_size, bristle_patch_info{}, "info");
}

bristle_result bristle_create(const bristle_batch_options* options, bristle_batch** batch) {
  return guarded([&] {
    need(batch, "batch");
    *batch = new bristle_batch(to_cpp(options));
  });
}

void bristle_destroy(bristle_batch* batch) { delete batch; }

bristle_result bristle_add(bristle_batch* batch, const bristle_material* material,
                           const bristle_patch_options* options, bristle_id* id) {
  return guarded([&] {
    need(batch, "batch");
    need(id, "id");
    *id = batch->batch.add(to_cpp(material), to_cpp(options)).value;
  });
}

bristle_result bristle_add_many(bristle_batch* batch, const bristle_material* material,
                                const bristle_patch_options* options, size_t options_size, bristle_id* ids,
                                size_t count) {
  return guarded([&] {
    need(batch, "batch");
    need_columns(options, ids, count);
    if (options_size < sizeof(size_t))
      throw BadArgument{"options_size", " must be sizeof(bristle_patch_options)"};
    const Material m = to_cpp(material);
    std::vector<PatchOptions> all(count);  // looked through before anything is added
    for (size_t i = 0; i < count; ++i)
      all[i] = to_cpp(reinterpret_cast<const bristle_patch_options*>(reinterpret_cast<const char*>(options) +
                                                                     i * options_size));
    std::vector<PatchId> added;
    added.reserve(count);
    try {
      for (const PatchOptions& o : all) added.push_back(batch->batch.add(m, o));
    } catch (...) {
      for (; !added.empty(); added.pop_back()) batch->batch.remove(added.back());
      throw;
    }
    for (size_t i = 0; i < count; ++i) ids[i] = added[i].value;
  });
}

bristle_result bristle_remove(bristle_batch* batch, bristle_id id) {
  return guarded([&] {
    need(batch, "batch");
    batch->batch.remove({id});
  });
}

bristle_result bristle_set_material(bristle_batch* batch, bristle_id id, const bristle_material* material) {
  return guarded([&] {
    need(batch, "batch");
    batch->batch.set_material({id}, to_cpp(material));
  });
}

bristle_result bristle_reset(bristle_batch* batch, bristle_id id, uint32_t seed, uint64_t key) {
  if (batch == nullptr) return fail(BRISTLE_BAD_ARGUMENT, "batch is null");
  if (!batch->batch.reset({id}, seed, key))
    return fail(BRISTLE_REFUSED, "bristle_reset: there is no such patch");
  return BRISTLE_OK;
}

bristle_result bristle_warm_up(bristle_batch* batch) {
  return guarded([&] {
    need(batch, "batch");
    batch->batch.warm_up();
  });
}

bristle_result bristle_step(bristle_batch* batch, double dt_s, const bristle_motion* motions,
                            size_t motion_size, bristle_response* responses, size_t response_size,
                            size_t count, bristle_step_report* report) {
  if (const char* refusal = refusal_of(batch, motions, motion_size, responses, response_size, count))
    return fail(BRISTLE_BAD_ARGUMENT, refusal);
  if (report != nullptr) {  // before the step, which cannot be taken back
    const bristle_result result = guarded([&] { size_of(*report, "report"); });
    if (result != BRISTLE_OK) return result;
  }
  StepReport done;
  if (motion_size == sizeof(Motion) && response_size == sizeof(Response)) {
    done = batch->batch.step(dt_s, {reinterpret_cast<const Motion*>(motions), count},
                             {reinterpret_cast<Response*>(responses), count});
  } else {
    const bristle_result result = guarded(
        [&] { done = step_copies(*batch, dt_s, motions, motion_size, responses, response_size, count); });
    if (result != BRISTLE_OK) return result;
  }
  if (report == nullptr) return BRISTLE_OK;
  bristle_step_report c;
  c.struct_size = sizeof c;
  c.status = static_cast<std::uint32_t>(done.status);
  c.patches_stepped = done.patches_stepped;
  c.tasks = done.tasks;
  c.threads = done.threads;
  c.bristles_visited = done.bristles_visited;
  if (report->struct_size == sizeof c) {
    *report = c;
    return BRISTLE_OK;
  }
  return guarded([&] { write_struct(c, report, "report"); });
}

bristle_result bristle_find_force(bristle_batch* batch, double dt_s, const bristle_motion* motions,
                                  size_t motion_size, bristle_response* responses, size_t response_size,
                                  size_t count) {
  if (const char* refusal = refusal_of(batch, motions, motion_size, responses, response_size, count))
    return fail(BRISTLE_BAD_ARGUMENT, refusal);
  for (size_t i = 0; i < count; ++i) {
    Motion motion;
    read_element(motions, motion_size, i, motion);
    write_element(batch->batch.find_force(dt_s, motion), responses, response_size, i);
  }
  return BRISTLE_OK;
}

bristle_result bristle_find_info(const bristle_batch* batch, bristle_id id, bristle_patch_info* info) {
  return guarded([&] {
    need(batch, "batch");
    const PatchInfo p = batch->batch.info({id});
    if (p.bristles == 0) throw Error("PatchBatch: there is no patch with id " + std::to_string(id));
    bristle_patch_info c{};
    c.key = p.key;
    c.weight = p.weight;
    c.active = p.active;
    c.normal_load = p.normal_load;
    c.memory_bytes = p.memory_bytes;
    c.bristles = p.bristles;
    c.bytes_per_bristle = p.bytes_per_bristle;
    c.kernel = p.kernel;
    c.detail = p.detail;
    write_struct(c, info, "info");
  });
}

double bristle_stored_energy(const bristle_batch* batch, bristle_id id) {
  return batch != nullptr ? batch->batch.stored_energy({id}) : 0.0;
}

uint64_t bristle_state_hash(const bristle_batch* batch, bristle_id id) {
  if (batch == nullptr) return 0;
  return id == 0 ? batch->batch.state_hash() : batch->batch.state_hash({id});
}

size_t bristle_read_bristles(const bristle_batch* batch, bristle_id id, double* zx, double* zy, double* delta,
                             size_t capacity) {
  if (batch == nullptr) return 0;
  const auto column = [&](double* values) { return Span<double>(values, values != nullptr ? capacity : 0); };
  // C++ takes a column of no length for one that is not wanted.
  return std::min(capacity, batch->batch.read_bristles({id}, column(zx), column(zy), column(delta)));
}

size_t bristle_state_size(const bristle_batch* batch) {
  return batch != nullptr ? batch->batch.state_size() : 0;
}

size_t bristle_save_state(const bristle_batch* batch, void* to, size_t size) {
  if (batch == nullptr || to == nullptr) return 0;
  return batch->batch.save_state({static_cast<std::byte*>(to), size});
}

bristle_result bristle_restore_state(bristle_batch* batch, const void* from, size_t size) {
  return guarded([&] {
    need(batch, "batch");
    need(from, "from");
    batch->batch.restore_state({static_cast<const std::byte*>(from), size});
  });
}

bristle_result bristle_save_state_file(const bristle_batch* batch, const char* path, const void* extra,
                                       size_t extra_size) {
  return guarded([&] {
    need(batch, "batch");
    need(path, "path");
    if (extra_size > 0) need(extra, "extra");
    save_state_file(path, batch->batch, {static_cast<const std::byte*>(extra), extra_size});
  });
}

bristle_result bristle_restore_state_file(bristle_batch* batch, const char* path, void* extra,
                                          size_t capacity, size_t* extra_size) {
  return guarded([&] {
    need(batch, "batch");
    need(path, "path");
    const std::vector<std::byte> found =
        restore_state_file(path, batch->batch, std::max(capacity, std::size_t{1} << 20));
    const size_t held = extra != nullptr ? std::min(capacity, found.size()) : 0;
    if (held > 0) std::memcpy(extra, found.data(), held);
    if (extra_size != nullptr) *extra_size = found.size();
  });
}

size_t bristle_patch_count(const bristle_batch* batch) {
  return batch != nullptr ? batch->batch.patch_count() : 0;
}
int32_t bristle_threads(const bristle_batch* batch) { return batch != nullptr ? batch->batch.threads() : 0; }
int32_t bristle_unbound_workers(const bristle_batch* batch) {
  return batch != nullptr ? batch->batch.unbound_workers() : 0;
}
const char* bristle_isa(const bristle_batch* batch) {
  return batch != nullptr ? batch->batch.isa() : nullptr;
}

uint32_t bristle_set_detail(bristle_batch* batch, bristle_id id, uint32_t bristles) {
  return batch != nullptr ? static_cast<std::uint32_t>(batch->batch.set_detail({id}, bristles))
                          : static_cast<std::uint32_t>(BRISTLE_STATUS_UNKNOWN_ID);
}

// --- load shedding

bristle_result bristle_init_shedder_options(bristle_shedder_options* options, size_t struct_size) {
  return init_struct(options, struct_size, to_c(LoadShedderOptions{}), "shedder_options");
}
bristle_result bristle_init_shed_report(bristle_shed_report* report, size_t struct_size) {
  return init_struct(report, struct_size, bristle_shed_report{}, "report");
}

bristle_result bristle_shedder_create(const bristle_shedder_options* options, bristle_shedder** shedder) {
  return guarded([&] {
    need(shedder, "shedder");
    *shedder = new bristle_shedder{LoadShedder(to_cpp(options))};
  });
}

void bristle_shedder_destroy(bristle_shedder* shedder) { delete shedder; }

bristle_result bristle_shedder_add(bristle_shedder* shedder, bristle_id patch, int32_t priority,
                                   uint32_t least_bristles) {
  return guarded([&] {
    need(shedder, "shedder");
    shedder->shedder.add({patch}, priority, least_bristles);
  });
}

void bristle_shedder_remove(bristle_shedder* shedder, bristle_id patch) {
  if (shedder != nullptr) shedder->shedder.remove({patch});
}

int32_t bristle_shedder_before_step(bristle_shedder* shedder, bristle_batch* batch,
                                    const bristle_motion* motions, size_t motion_size, size_t count) {
  if (shedder == nullptr || batch == nullptr || motions == nullptr || motion_size != sizeof(Motion)) return 0;
  return shedder->shedder.before_step(batch->batch, {reinterpret_cast<const Motion*>(motions), count});
}

int32_t bristle_shedder_after_step(bristle_shedder* shedder, bristle_batch* batch,
                                   const bristle_motion* motions, size_t motion_size, size_t count,
                                   double step_time_s, const bristle_step_report* report) {
  if (shedder == nullptr || batch == nullptr || motions == nullptr || motion_size != sizeof(Motion)) return 0;
  if (report == nullptr || report->struct_size < sizeof *report) return 0;
  StepReport done;
  done.status = static_cast<Status>(report->status);
  done.patches_stepped = report->patches_stepped;
  done.tasks = report->tasks;
  done.threads = report->threads;
  done.bristles_visited = report->bristles_visited;
  return shedder->shedder.after_step(batch->batch, {reinterpret_cast<const Motion*>(motions), count},
                                     step_time_s, done);
}

bristle_result bristle_shedder_find_report(const bristle_shedder* shedder, const bristle_batch* batch,
                                           bristle_shed_report* report) {
  return guarded([&] {
    need(shedder, "shedder");
    need(batch, "batch");
    const ShedReport r = shedder->shedder.report(batch->batch);
    bristle_shed_report c{};
    c.bristles = r.bristles;
    c.least_share = r.least_share;
    c.noise_growth = r.noise_growth;
    c.rate = r.rate_s;
    c.late_steps = r.late_steps;
    c.decisions = r.decisions;
    c.decisions_lost = r.decisions_lost;
    c.patches = r.patches;
    write_struct(c, report, "report");
  });
}

size_t bristle_shedder_read_decisions(const bristle_shedder* shedder, bristle_detail_decision* decisions,
                                      size_t capacity) {
  if (shedder == nullptr) return 0;
  const Span<const DetailDecision> all = shedder->shedder.decisions();
  if (decisions != nullptr)
    for (size_t i = 0; i < std::min(capacity, all.size()); ++i)
      decisions[i] = {all[i].step, all[i].patch.value, all[i].bristles, 0};
  return all.size();
}

void bristle_shedder_clear_decisions(bristle_shedder* shedder) {
  if (shedder != nullptr) shedder->shedder.clear_decisions();
}

size_t bristle_apply_decisions(bristle_batch* batch, const bristle_detail_decision* decisions, size_t count,
                               uint64_t step) {
  if (batch == nullptr || decisions == nullptr) return 0;
  return apply_decisions(batch->batch, {reinterpret_cast<const DetailDecision*>(decisions), count}, step);
}

// --- patches by key

bristle_result bristle_init_keyed_options(bristle_keyed_options* options, size_t struct_size) {
  return init_struct(options, struct_size, to_c(KeyedOptions{}), "keyed_options");
}
bristle_result bristle_init_matcher_options(bristle_matcher_options* options, size_t struct_size) {
  return init_struct(options, struct_size, to_c(MatcherOptions{}), "matcher_options");
}

bristle_result bristle_keyed_create(bristle_batch* batch, const bristle_material* material,
                                    const bristle_patch_options* patch, const bristle_keyed_options* options,
                                    bristle_keyed** keyed) {
  return guarded([&] {
    need(batch, "batch");
    need(keyed, "keyed");
    *keyed = new bristle_keyed{KeyedPatches(batch->batch, to_cpp(material), to_cpp(patch), to_cpp(options))};
  });
}

void bristle_keyed_destroy(bristle_keyed* keyed) { delete keyed; }

bristle_result bristle_keyed_find_or_add(bristle_keyed* keyed, const uint64_t* keys, bristle_id* ids,
                                         size_t count) {
  return guarded([&] {
    need(keyed, "keyed");
    need_columns(keys, ids, count);
    for (size_t i = 0; i < count; ++i) ids[i] = keyed->patches.find_or_add(keys[i]).value;
  });
}

bristle_result bristle_keyed_find(const bristle_keyed* keyed, const uint64_t* keys, bristle_id* ids,
                                  size_t count) {
  return guarded([&] {
    need(keyed, "keyed");
    need_columns(keys, ids, count);
    for (size_t i = 0; i < count; ++i) ids[i] = keyed->patches.find(keys[i]).value;
  });
}

uint32_t bristle_keyed_remove(bristle_keyed* keyed, uint64_t key) {
  return keyed != nullptr && keyed->patches.remove(key) ? 1 : 0;
}
void bristle_keyed_clear(bristle_keyed* keyed) {
  if (keyed != nullptr) keyed->patches.clear();
}
uint32_t bristle_keyed_end_step(bristle_keyed* keyed) {
  return keyed != nullptr ? keyed->patches.end_step() : 0;
}
uint32_t bristle_keyed_size(const bristle_keyed* keyed) {
  return keyed != nullptr ? keyed->patches.size() : 0;
}
uint64_t bristle_keyed_refused(const bristle_keyed* keyed) {
  return keyed != nullptr ? keyed->patches.refused() : 0;
}

bristle_result bristle_matcher_create(const bristle_matcher_options* options, bristle_matcher** matcher) {
  return guarded([&] {
    need(matcher, "matcher");
    *matcher = new bristle_matcher{ContactMatcher(to_cpp(options))};
  });
}

void bristle_matcher_destroy(bristle_matcher* matcher) { delete matcher; }

bristle_result bristle_matcher_match(bristle_matcher* matcher, const bristle_contact_point* contacts,
                                     uint64_t* keys, size_t count, size_t* found) {
  return guarded([&] {
    need(matcher, "matcher");
    need_columns(contacts, keys, count);
    const size_t seen =
        matcher->matcher.match({reinterpret_cast<const ContactPoint*>(contacts), count}, {keys, count});
    if (found != nullptr) *found = seen;
  });
}

void bristle_matcher_clear(bristle_matcher* matcher) {
  if (matcher != nullptr) matcher->matcher.clear();
}

// --- deadline monitor

bristle_result bristle_init_monitor_report(bristle_monitor_report* report, size_t struct_size) {
  return init_struct(report, struct_size, bristle_monitor_report{}, "report");
}

bristle_result bristle_monitor_create(double deadline_s, double period_s, bristle_monitor** monitor) {
  return guarded([&] {
    need(monitor, "monitor");
    if (!(deadline_s > 0.0)) throw Error("bristle_monitor_create: the deadline must be above 0 s");
    if (!(period_s >= 0.0)) throw Error("bristle_monitor_create: the period must not be negative");
    *monitor = new bristle_monitor{DeadlineMonitor(deadline_s, period_s)};
  });
}

void bristle_monitor_destroy(bristle_monitor* monitor) { delete monitor; }

void bristle_monitor_record(bristle_monitor* monitor, double wall_s, double cpu_s) {
  if (monitor != nullptr) monitor->monitor.record(wall_s, cpu_s);
}
void bristle_monitor_record_tick(bristle_monitor* monitor, double due_s, double start_s, double end_s,
                                 double cpu_s) {
  if (monitor != nullptr) monitor->monitor.record_tick(Tick{due_s, start_s, end_s, cpu_s});
}
void bristle_monitor_record_skipped(bristle_monitor* monitor, uint64_t ticks) {
  if (monitor != nullptr) monitor->monitor.record_skipped(ticks);
}
void bristle_monitor_pause(bristle_monitor* monitor) {
  if (monitor != nullptr) monitor->monitor.pause();
}
void bristle_monitor_refresh_events(bristle_monitor* monitor) {
  if (monitor != nullptr) monitor->monitor.refresh_events();
}
void bristle_monitor_reset(bristle_monitor* monitor) {
  if (monitor != nullptr) monitor->monitor.reset();
}

bristle_result bristle_monitor_find_report(const bristle_monitor* monitor, bristle_monitor_report* report) {
  return guarded([&] {
    need(monitor, "monitor");
    DeadlineMonitor m;
    if (!monitor->monitor.snapshot(m))
      throw Error("bristle_monitor_find_report: the loop leaves no gap between two ticks to read in");
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
