// Structs of the C interface: sizes that do not agree, values that C++ has not, fields that mirror C++'s.
#include <catch2/catch.hpp>

#include <bristle/bristle.h>

#include <cstddef>
#include <cstring>
#include <string>
#include <vector>

#include "core/c_interface/field_count.hpp"
#include "scenes.hpp"

using namespace bristle;
using namespace bristle_test;

namespace {

/// A batch of the C interface, and a patch in it.
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

TEST_CASE("A program of an older header gets the law of then, or is refused, never another one", "[c]") {
  constexpr std::size_t old_coefficients = offsetof(bristle_coefficients, residual_share);
  constexpr std::size_t old_material = offsetof(bristle_material, residual_length);
  const auto kinetic_of = [](const bristle_material& material) {
    bristle_material_facts facts;
    bristle_init_material_facts(&facts, sizeof facts);
    REQUIRE(bristle_material_find_facts(&material, &facts) == BRISTLE_OK);
    return facts.kinetic_coefficient;
  };
  bristle_coefficients coefficients;
  bristle_material material;
  bristle_init_coefficients(&coefficients, old_coefficients);
  bristle_init_material(&material, old_material);
  REQUIRE(bristle_material_from_coefficients(&coefficients, &material) == BRISTLE_OK);
  CHECK(kinetic_of(material) == Approx(0.4).epsilon(1e-9));
  CHECK(material.struct_size == old_material);

  // A struct of full size keeps the older law too.
  bristle_init_material(&material, sizeof material);
  REQUIRE(bristle_material_from_coefficients(&coefficients, &material) == BRISTLE_OK);
  CHECK(material.residual_length == 0.0);
  CHECK(material.shared_renewal == 0.0);

  // Coefficients of today do not fit into a material of then, unless they say the law of then.
  bristle_init_coefficients(&coefficients, sizeof coefficients);
  bristle_init_material(&material, old_material);
  const bristle_material before = material;
  CHECK(bristle_material_from_coefficients(&coefficients, &material) == BRISTLE_BAD_ARGUMENT);
  CHECK(std::string(bristle_last_error()).find("older header") != std::string::npos);
  CHECK(std::memcmp(&material, &before, old_material) == 0);
  coefficients.residual_share = coefficients.shared_renewal = 0.0;
  REQUIRE(bristle_material_from_coefficients(&coefficients, &material) == BRISTLE_OK);
  CHECK(kinetic_of(material) == Approx(0.4).epsilon(1e-9));
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

#if !BRISTLE_MINIMAL  // an element that ends before `axes` has the default, two
TEST_CASE("Options in an array are read no further than the array's element size", "[c]") {
  CPatch patch(100);
  // Two elements as an older program has them, that end before `bristles`. Behind each stands something else.
  constexpr std::size_t old_size = offsetof(bristle_patch_options, bristles);
  std::vector<unsigned char> array(2 * old_size + sizeof(bristle_patch_options), 0xFF);
  const auto put = [&](std::size_t i, std::size_t struct_size) {
    bristle_patch_options options;
    bristle_init_patch_options(&options, sizeof options);
    options.struct_size = struct_size;
    options.max_normal_load = 0.25 * static_cast<double>(i + 1);
    std::memcpy(array.data() + i * old_size, &options, old_size);
  };
  const auto add = [&](bristle_id* ids) {
    return bristle_add_many(patch.batch, &patch.material,
                            reinterpret_cast<const bristle_patch_options*>(array.data()), old_size, ids, 2);
  };
  bristle_id ids[2] = {7, 8};
  put(0, old_size);
  put(1, sizeof(bristle_patch_options));
  CHECK(add(ids) == BRISTLE_BAD_ARGUMENT);
  CHECK(ids[0] == 7);
  CHECK(ids[1] == 8);
  CHECK(std::string(bristle_last_error()) ==
        "options[1].struct_size = " + std::to_string(sizeof(bristle_patch_options)) +
            ", but options_size = " + std::to_string(old_size) +
            ": give sizeof(bristle_patch_options) for both");
  put(1, old_size);
  if (BRISTLE_MINIMAL) return;  // which has no patch of the default, two axes
  REQUIRE(add(ids) == BRISTLE_OK);
  for (int i = 0; i < 2; ++i) {
    bristle_patch_info info;
    bristle_init_patch_info(&info, sizeof info);
    REQUIRE(bristle_find_info(patch.batch, ids[i], &info) == BRISTLE_OK);
    CHECK(info.max_normal_load == Approx(0.25 * (i + 1)).epsilon(1e-12));
    CHECK(info.bristles == static_cast<std::uint32_t>(0.25 * (i + 1) * 900));  // the default: one each
  }
}
#endif

TEST_CASE("A C program whose structs have other sizes sheds alike", "[c]") {
  struct Longer {
    bristle_motion motion;
    double news[2];
  };
  struct ShorterReport {
    std::size_t struct_size;
    std::uint32_t status, patches_stepped, tasks, threads;
    std::uint64_t bristles_visited;
  };
  CPatch patches[2] = {CPatch(800), CPatch(800)};
  bristle_shedder* shedders[2] = {};
  bristle_shedder_options options;
  bristle_init_shedder_options(&options, sizeof options);
  options.budget = 1e-3;
  options.rate = 2e-6;
  std::int32_t before[2], after[2];
  std::uint32_t details[2];
  for (int i = 0; i < 2; ++i) {
    CPatch& patch = patches[i];
    REQUIRE(bristle_shedder_create(&options, &shedders[i]) == BRISTLE_OK);
    REQUIRE(bristle_shedder_add(shedders[i], patch.motion.id, 0, 64) == BRISTLE_OK);
    const Longer longer{patch.motion, {1.0, 2.0}};
    const bristle_motion* motion = i == 0 ? &patch.motion : &longer.motion;
    const std::size_t size = i == 0 ? sizeof patch.motion : sizeof longer;
    before[i] = bristle_shedder_before_step(shedders[i], patch.batch, motion, size, 1);
    bristle_step_report report;
    bristle_init_step_report(&report, sizeof report);
    patch.step(&report);
    after[i] = bristle_shedder_after_step(shedders[i], patch.batch, motion, size, 1, 4e-3, &report);
    bristle_patch_info info;
    bristle_init_patch_info(&info, sizeof info);
    REQUIRE(bristle_find_info(patch.batch, patch.motion.id, &info) == BRISTLE_OK);
    details[i] = info.detail;
    bristle_shedder_destroy(shedders[i]);
  }
  CHECK(before[0] == 1);
  CHECK(after[0] == 1);
  CHECK(details[0] < 400);
  CHECK(before[1] == before[0]);
  CHECK(after[1] == after[0]);
  CHECK(details[1] == details[0]);
}

TEST_CASE("A C program hears why nothing was shed", "[c]") {
  CPatch patch(100);
  bristle_shedder* shedder = nullptr;
  REQUIRE(bristle_shedder_create(nullptr, &shedder) == BRISTLE_OK);
  CHECK(bristle_shedder_before_step(shedder, patch.batch, &patch.motion, 3, 1) == 0);
  CHECK(std::string(bristle_last_error()) == "motion_size: give sizeof(bristle_motion)");
  CHECK(bristle_shedder_before_step(nullptr, patch.batch, &patch.motion, sizeof patch.motion, 1) == 0);
  CHECK(std::string(bristle_last_error()) == "shedder is null");
  bristle_step_report report{};  // never initialised
  CHECK(bristle_shedder_after_step(shedder, patch.batch, &patch.motion, sizeof patch.motion, 1, 1e-3,
                                   &report) == 0);
  CHECK_THAT(bristle_last_error(),
             Catch::Matchers::StartsWith("report.struct_size = 0; allowed is 8 to 65536: give "
                                         "sizeof(bristle_step_report)"));
  CHECK(bristle_shedder_after_step(shedder, patch.batch, &patch.motion, sizeof patch.motion, 1, 1e-3,
                                   nullptr) == 0);
  CHECK(std::string(bristle_last_error()) == "report is null");
  bristle_shedder_destroy(shedder);
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
  // Whoever adds a field here must add its comparison below.
  static_assert(bristle::detail::field_count<PatchInfo> == 10);
  PatchBatch batch;
  CPatch c(800);
  const Material material =
      Material{}.with_snap_length(SnapLength::uniform(0.5 * dbar, 1.5 * dbar)).with_snap_rule(SnapRule::keep);
  const PatchId id = batch.add(material, PatchOptions{}.with_bristles(800).with_axes(1));
  Motion motion{id, {1.2 * dbar, 0.0}, 0.75};
  Response response;
  batch.step(1e-3, {&motion, 1}, {&response, 1});
  c.step();
  REQUIRE(batch.set_detail(id, 300) == Status::ok);
  REQUIRE(bristle_set_detail(c.batch, c.motion.id, 300) == BRISTLE_STATUS_OK);
  const PatchInfo expected = batch.info(id);
  bristle_patch_info info;
  bristle_init_patch_info(&info, sizeof info);
  REQUIRE(bristle_find_info(c.batch, c.motion.id, &info) == BRISTLE_OK);
  CHECK(info.key == expected.key);
  CHECK(info.bristles == 800);
  CHECK(info.bristles == expected.bristles);
  CHECK(info.detail == 300);
  CHECK(info.detail == expected.detail);
  CHECK(info.weight == expected.weight);
  CHECK(info.active == expected.active);
  CHECK(info.normal_load == 0.75);
  CHECK(info.normal_load == expected.normal_load);
  CHECK(info.max_normal_load == expected.max_normal_load);
  CHECK(info.max_normal_load == Approx(1.0).epsilon(1e-12));
  CHECK(info.memory_bytes == expected.memory_bytes);
  CHECK(info.bytes_per_bristle == expected.bytes_per_bristle);
  CHECK(std::string(info.kernel) == expected.kernel);
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
