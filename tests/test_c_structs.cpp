// Structs of the C interface: refuses sizes that do not agree and values that C++ lacks; fields mirror those
// of C++.
#include <catch2/catch.hpp>

#include <bristle/bristle.h>
#include <bristle/deadline_monitor.hpp>
#include <bristle/fields.hpp>

#include <cctype>
#include <cstddef>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>
#include <type_traits>

#include "c_batch.hpp"
#include "core/c_interface/field_count.hpp"
#include "scenes.hpp"
#include "test_paths.hpp"

namespace bristle_test::test_c_structs {

using namespace bristle;

namespace {

/// A batch of the C interface with one patch.
struct CPatch {
  bristle_batch* batch = nullptr;
  bristle_material material;
  bristle_motion motion{};

  explicit CPatch(std::uint32_t bristles, double damping = 0.0) {
    bristle_init_material(&material, sizeof material);
    material.bristle_damping = damping;
    material.snap_length = {BRISTLE_LAW_UNIFORM, 0, 0.5 * dbar, 1.5 * dbar, nullptr};
    material.snap_rule = BRISTLE_RULE_KEEP;
    bristle_patch_options options;
    bristle_init_patch_options(&options, sizeof options);
    options.bristles = bristles;
    options.axes = 1;
    REQUIRE(bristle_create(nullptr, &batch) == BRISTLE_OK);
    REQUIRE(bristle_add(batch, &material, &options, &motion.id) == BRISTLE_OK);
    REQUIRE(bristle_warm_up(batch) == BRISTLE_OK);
    motion.normal_load = 0.75;
    motion.displacement[0] = 1.2 * dbar;
  }
  ~CPatch() { bristle_destroy(batch); }
  CPatch(const CPatch&) = delete;
  CPatch& operator=(const CPatch&) = delete;

  bristle_response step(bristle_step_report* report = nullptr) {
    bristle_response response{};
    REQUIRE(bristle_step(batch, 1e-3, &motion, sizeof motion, &response, sizeof response, 1, report) ==
            BRISTLE_OK);
    return response;
  }
};

}  // namespace

TEST_CASE("Structs of another header are refused by the size that is right", "[c]") {
  CPatch patch(100);
  const auto check_refused = [](bristle_result result, const char* name, std::size_t given,
                                std::size_t allowed, const char* type) {
    CAPTURE(name);
    CHECK(result == BRISTLE_BAD_ARGUMENT);
    CHECK_THAT(bristle_last_error(), Catch::Matchers::StartsWith(
                                         std::string(name) + " = " + std::to_string(given) + "; allowed is " +
                                         std::to_string(allowed) + ": give sizeof(" + type + ")"));
  };
  const int off[] = {-8, -1, 1, 8};
  for (const int by : off) {
    const auto other = [by](std::size_t size) { return size + static_cast<std::size_t>(by); };
    bristle_material material = patch.material;
    constexpr std::size_t material_size = sizeof material;
    check_refused(bristle_init_material(&material, other(material_size)), "struct_size", other(material_size),
                  material_size, "bristle_material");
    material.struct_size = other(material_size);
    check_refused(bristle_material_check(&material), "material.struct_size", other(material_size),
                  material_size, "bristle_material");
    bristle_patch_info info;
    bristle_init_patch_info(&info, sizeof info);
    info.struct_size = other(sizeof info);
    check_refused(bristle_find_info(patch.batch, patch.motion.id, &info), "info.struct_size",
                  other(sizeof info), sizeof info, "bristle_patch_info");
    bristle_patch_options options[2];
    for (bristle_patch_options& o : options) bristle_init_patch_options(&o, sizeof o);
    constexpr std::size_t options_size = sizeof options[0];
    bristle_id ids[2] = {7, 8};
    check_refused(bristle_add_many(patch.batch, &patch.material, options, other(options_size), ids, 2),
                  "options_size", other(options_size), options_size, "bristle_patch_options");
    options[1].struct_size = other(options_size);
    check_refused(bristle_add_many(patch.batch, &patch.material, options, options_size, ids, 2),
                  "options[1].struct_size", other(options_size), options_size, "bristle_patch_options");
    CHECK(ids[0] == 7);
    CHECK(ids[1] == 8);
    bristle_response response{};
    CHECK(bristle_step(patch.batch, 1e-3, &patch.motion, other(sizeof patch.motion), &response,
                       sizeof response, 1, nullptr) == BRISTLE_BAD_ARGUMENT);
    CHECK(std::string(bristle_last_error()) == "motion_size: give sizeof(bristle_motion)");
    CHECK(bristle_find_force(patch.batch, 1e-3, &patch.motion, sizeof patch.motion, &response,
                             other(sizeof response), 1) == BRISTLE_BAD_ARGUMENT);
    CHECK(std::string(bristle_last_error()) == "response_size: give sizeof(bristle_response)");
    CHECK(response.id == 0);
    CHECK(bristle_patch_count(patch.batch) == 1);
  }
}

TEST_CASE("A step's report is refused by its size before the step, and serves for the next step", "[c]") {
  CBatch patches{{}};
  COutlines outlines(patches);
  CBeds beds{{}};
  JointMaterial gear;
  gear.stiffness = gear.kinetic.base = 1.0;
  CJoints joints(1, {&gear, 1}, {}, {});
  bristle_motion patch = {};
  bristle_extended_motion pad = {};
  bristle_bed_motion bed = {};
  patch.id = patches.add({}, {}).value;
  pad.id = outlines.add({}, {}, {{{{0.0, 0.0}, 1.0}}, 0.0}).value;
  bed.id = beds.add(BedMaterial(0.5).with_presliding(1e-4), BedShape::from_list({{{0.0, 0.0}, 1.0, 1.0}}), {})
               .value;
  patch.normal_load = pad.normal_load = bed.normal_load = 0.5;
  patch.displacement[0] = pad.displacement[0] = 0.3 * dbar;
  bed.displacement[0] = 1e-5;
  double angle = 0.0;
  bristle_joint_step turn;
  bristle_init_joint_step(&turn, sizeof turn);
  turn.angle = &angle;
  struct Stepper {
    const char* name;
    std::function<bristle_result(bristle_step_report*)> step;
    std::function<std::uint64_t()> hash;
  };
  bristle_response of_patch;
  bristle_extended_response of_pad;
  bristle_bed_response of_bed;
  const Stepper steppers[] = {
      {"patches",
       [&](bristle_step_report* report) {
         return bristle_step(patches.get(), 1e-3, &patch, sizeof patch, &of_patch, sizeof of_patch, 1,
                             report);
       },
       [&] { return patches.state_hash(); }},
      {"outlines",
       [&](bristle_step_report* report) {
         return bristle_extended_step(outlines.get(), 1e-3, &pad, &of_pad, 1, report);
       },
       [&] { return outlines.state_hash(); }},
      {"beds",
       [&](bristle_step_report* report) { return bristle_beds_step(beds.get(), &bed, &of_bed, 1, report); },
       [&] { return beds.state_hash(); }},
      {"joints",
       [&](bristle_step_report* report) {
         angle += 0.01;
         return bristle_joints_step(joints.get(), &turn, report);
       },
       [&] { return joints.state_hash(); }}};
  for (const Stepper& s : steppers) {
    INFO(s.name);
    REQUIRE(s.step(nullptr) == BRISTLE_OK);
    const std::uint64_t before = s.hash();
    bristle_step_report report{};  // a report whose struct_size was never set
    CHECK(s.step(&report) == BRISTLE_BAD_ARGUMENT);
    CHECK_THAT(bristle_last_error(), Catch::Matchers::StartsWith("report.struct_size = 0; allowed is "));
    CHECK(s.hash() == before);
    bristle_init_step_report(&report, sizeof report);
    for (int i = 0; i < 2; ++i) {
      REQUIRE(s.step(&report) == BRISTLE_OK);
      CHECK(report.struct_size == sizeof report);
      CHECK(report.patches_stepped == 1);
    }
    CHECK(s.hash() != before);
  }
}

TEST_CASE("The greatest value of a choice in C is taken, and the next one refused", "[c]") {
  bristle_material material;
  bristle_init_material(&material, sizeof material);
  material.ageing_form = BRISTLE_AGEING_SATURATING;
  CHECK(bristle_material_check(&material) == BRISTLE_OK);
  ++material.ageing_form;
  CHECK(bristle_material_check(&material) == BRISTLE_REFUSED);
  CHECK(std::string(bristle_last_error()).find("ageing_form") != std::string::npos);
  bristle_init_material(&material, sizeof material);
  material.damper_decay = BRISTLE_DECAY_GAUSSIAN;
  CHECK(bristle_material_check(&material) == BRISTLE_OK);
  ++material.damper_decay;
  CHECK(bristle_material_check(&material) == BRISTLE_REFUSED);
  CHECK(std::string(bristle_last_error()).find("damper_decay") != std::string::npos);
}

TEST_CASE("Any has_velocity but 0 says that the velocity is given", "[c]") {
  for (const unsigned value : {1u, 2u, 64u, 128u, 254u, 255u}) {
    CPatch one(200, 1e-2), other(200, 1e-2);
    one.motion.velocity[0] = other.motion.velocity[0] = 0.3e-3;
    one.motion.has_velocity = 1;
    other.motion.has_velocity = static_cast<std::uint8_t>(value);
    CHECK(one.step().damper[0] == other.step().damper[0]);
    CPatch without(200, 1e-2);
    CHECK(without.step().damper[0] != other.step().damper[0]);
  }
}

TEST_CASE("A null column is named", "[c]") {
  CPatch patch(100);
  double out[2] = {};
  CHECK(bristle_material_steady_force(&patch.material, 1.0, nullptr, out, 2) == BRISTLE_BAD_ARGUMENT);
  CHECK(std::string(bristle_last_error()) == "speeds is null");
  CHECK(bristle_material_steady_force(&patch.material, 1.0, out, nullptr, 2) == BRISTLE_BAD_ARGUMENT);
  CHECK(std::string(bristle_last_error()) == "forces is null");
}

TEST_CASE("bristle_find_info says what PatchBatch::info says", "[c]") {
  // Fails when PatchInfo gets a new field, as a reminder to add its comparison below.
  static_assert(bristle::detail::field_count<PatchInfo> == 9);
  PatchBatch batch;
  CPatch c(800);
  const Material material =
      Material{}.with_snap_length(SnapLength::uniform(0.5 * dbar, 1.5 * dbar)).with_snap_rule(SnapRule::keep);
  const PatchId id = batch.add(material, PatchOptions{}.with_bristles(800).with_axes(1));
  Motion motion{id, {1.2 * dbar, 0.0}, 0.75};
  step_one(batch, motion, 1e-3);
  c.step();
  const PatchInfo expected = batch.info(id);
  bristle_patch_info info;
  bristle_init_patch_info(&info, sizeof info);
  REQUIRE(bristle_find_info(c.batch, c.motion.id, &info) == BRISTLE_OK);
  CHECK(info.key == expected.key);
  CHECK(info.representatives == 800);
  CHECK(info.representatives == expected.representatives);
  CHECK(info.weight == expected.weight);
  CHECK(info.active == expected.active);
  CHECK(info.normal_load == 0.75);
  CHECK(info.normal_load == expected.normal_load);
  CHECK(info.max_normal_load == expected.max_normal_load);
  CHECK(info.max_normal_load == Approx(1.0).epsilon(1e-12));
  CHECK(info.memory_bytes == expected.memory_bytes);
  CHECK(info.bytes_per_representative == expected.bytes_per_representative);
  CHECK(std::string(info.kernel) == expected.kernel);
}

TEST_CASE("Facts and moments in C are those of C++", "[c]") {
  const SnapLength law = SnapLength::lognormal(dbar, 0.3);
  const Material m = Material{}.with_snap_length(law);
  bristle_material material;
  bristle_init_material(&material, sizeof material);
  material.snap_length = {BRISTLE_LAW_LOGNORMAL, 0, law.first_parameter(), law.second_parameter(), nullptr};
  bristle_material_facts facts;
  bristle_init_material_facts(&facts, sizeof facts);
  REQUIRE(bristle_material_find_facts(&material, &facts) == BRISTLE_OK);
  CHECK(facts.kinetic_coefficient == m.kinetic_coefficient());
  CHECK(facts.peak_coefficient == m.peak_coefficient());
  CHECK(facts.peak_coefficient > facts.kinetic_coefficient);
  CHECK(facts.snap_length_variation == law.cv());
  CHECK(facts.longest_snap_length == law.longest());
  const double lengths[2] = {0.5 * dbar, 1.5 * dbar};
  for (const int k : {1, 2}) {
    double moment = 0.0, partial[2] = {};
    REQUIRE(bristle_snap_length_moment(&material.snap_length, k, &moment, lengths, partial, 2) == BRISTLE_OK);
    CHECK(moment == law.moment(k));
    for (int i = 0; i < 2; ++i) CHECK(partial[i] == law.partial_moment(k, lengths[i]));
  }
}

TEST_CASE("Percentiles of a monitor in C are those of C++", "[c]") {
  DeadlineMonitor expected(1e-3, 1e-3);
  bristle_monitor* monitor = nullptr;
  REQUIRE(bristle_monitor_create(1e-3, 1e-3, &monitor) == BRISTLE_OK);
  for (int i = 0; i < 1000; ++i) {
    const double due = 1e-3 * i, start = due + 1e-7 * (i * i % 97), end = start + 1e-4 + 1e-6 * (i % 37);
    expected.record_tick({due, start, end, 1e-4});
    bristle_monitor_record_tick(monitor, due, start, end, 1e-4);
  }
  bristle_monitor_report report;
  bristle_init_monitor_report(&report, sizeof report);
  REQUIRE(bristle_monitor_find_report(monitor, &report) == BRISTLE_OK);
  const auto& jitter = expected.period_jitter();
  CHECK(report.jitter_p50 == jitter.percentile(0.5));
  CHECK(report.jitter_p99 == jitter.percentile(0.99));
  CHECK(report.jitter_max == jitter.max());
  CHECK(report.p50 == expected.p50());
  CHECK(report.p99 == expected.p99());
  CHECK(report.p999 == expected.p999());
  CHECK(report.mean == expected.mean());
  CHECK(report.period == expected.period());
  CHECK(report.longest_run == expected.longest_run());
  bristle_monitor_destroy(monitor);
}

namespace {

std::string read_header() {
  std::ifstream in(BRISTLE_C_HEADER);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Returns the name in C of a C++ type of a field.
template <class Value>
const char* c_type() {
  if (std::is_same_v<Value, double>) return "double ";
  if (std::is_same_v<Value, const char*>) return "const char* ";
  if (std::is_same_v<Value, SnapLength>) return "bristle_snap_length ";
  if (std::is_same_v<Value, Lay>) return "bristle_lay ";
  if (std::is_same_v<Value, int>) return "int32_t ";
  return sizeof(Value) == 8 ? "uint64_t " : "uint32_t ";
}

/// Writes the C struct that mirrors `Cpp` into the text of the header, in place of the one that stands there.
template <class Cpp>
void write_struct(const std::string& name, std::string& header) {
  std::string text = "typedef struct " + name + " {\n  size_t struct_size;\n";
  for_each_field<Cpp>([&](const auto& field) {
    const AboutField& about = field.about;
    const std::string declared =
        std::string("  ") + c_type<std::remove_cvref_t<decltype(Cpp{}.*field.member)>>() + field.name + ";";
    std::string meaning;
    if (*about.unit != 0) meaning += std::string(about.unit) + ". ";
    for (unsigned i = 0; i < about.name_count; ++i)
      meaning += std::to_string(i) + " " + about.names[i] + (i + 1 < about.name_count ? ", " : ": ");
    meaning += about.text;
    constexpr std::size_t width = 96;
    if (declared.size() + meaning.size() <= width)
      text += declared + " /**< " + meaning + " */\n";
    else
      text += "  /** " + meaning + " */\n" + declared + "\n";
  });
  const std::string end = "} " + name + ";";
  const std::size_t first = header.find("typedef struct " + name + " {"), last = header.find(end);
  REQUIRE(last != std::string::npos);
  header.replace(first, last - first, text);
}

std::string with_all_structs(std::string header) {
  write_struct<Material>("bristle_material", header);
  write_struct<Coefficients>("bristle_coefficients", header);
  write_struct<PatchOptions>("bristle_patch_options", header);
  write_struct<BatchOptions>("bristle_batch_options", header);
  write_struct<KeyedOptions>("bristle_keyed_options", header);
  write_struct<MatcherOptions>("bristle_matcher_options", header);
  write_struct<JointOptions>("bristle_joint_options", header);
  return header;
}

}  // namespace

TEST_CASE("The structs of parameters in bristle.h are those of the lists in fields.hpp", "[c]") {
  // Compares without white space and the stars of comments, which clang-format moves.
  const auto bare = [](std::string text) {
    std::erase_if(text, [](char c) { return c == '*' || std::isspace(static_cast<unsigned char>(c)); });
    return text;
  };
  const std::string header = read_header();
  INFO("run bristle_tests '[.write]' and clang-format bristle.h");
  CHECK((bare(header) == bare(with_all_structs(header))));
}

TEST_CASE("The structs of parameters are written into bristle.h", "[.write]") {
  const std::string header = with_all_structs(read_header());
  std::ofstream(BRISTLE_C_HEADER) << header;
}

TEST_CASE("Fields of a struct are counted", "[c]") {
  struct Empty {};
  struct One {
    int a;
  };
  struct Mixed {
    double a = 1.0;
    const char* b = nullptr;
    bool c = false;
    Status d = Status::ok;
    SnapLength e;
  };
  CHECK(bristle::detail::field_count<Empty> == 0);
  CHECK(bristle::detail::field_count<One> == 1);
  CHECK(bristle::detail::field_count<Mixed> == 5);
}

}  // namespace bristle_test::test_c_structs
