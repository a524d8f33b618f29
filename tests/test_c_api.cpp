// The C interface: a program in C, compared with the C++ interface.
#include <catch2/catch.hpp>

#include <bristle/bristle.h>

#include <thread>

#include "c_program.h"
#include "expect.hpp"
#include "scenes.hpp"

namespace bristle_test::test_c_api {

using namespace bristle;

TEST_CASE("A C program follows the virgin curve", "[c]") {
  REQUIRE(c_program_follows_the_virgin_curve() == 0);
}
TEST_CASE("A C program reads bristles, saves and restores", "[c]") {
  REQUIRE(c_program_reads_and_restores() == 0);
}
TEST_CASE("A C program hears by code and text why it was refused", "[c]") {
  REQUIRE(c_program_hears_why() == 0);
}
TEST_CASE("A C program that was refused finds its batch and its outputs as they were", "[c]") {
  REQUIRE(c_program_finds_all_as_it_was() == 0);
}
TEST_CASE("A C program goes from coefficients to bristles and back", "[c]") {
  REQUIRE(c_program_goes_to_coefficients_and_back() == 0);
}
TEST_CASE("A C program finds its patches by contact", "[c]") { REQUIRE(c_program_names_contacts() == 0); }
TEST_CASE("A C program moves a group by its arrays", "[c][group]") {
  REQUIRE(c_program_moves_a_group() == 0);
}
TEST_CASE("A C program twists a pad", "[c][extended]") { REQUIRE(c_program_twists_a_pad() == 0); }
TEST_CASE("A C program watches its deadline", "[c]") { REQUIRE(c_program_watches_a_deadline() == 0); }

TEST_CASE("Another thread's failure leaves the last error of this one", "[c]") {
  REQUIRE(bristle_create(nullptr, nullptr) == BRISTLE_BAD_ARGUMENT);
  const std::string mine = bristle_last_error();
  std::string theirs = "unset";
  std::string before = "unset";
  std::thread([&] {
    before = bristle_last_error();
    bristle_material_check(nullptr);
    theirs = bristle_last_error();
  }).join();
  CHECK(before.empty());
  CHECK(theirs == "material is null");
  CHECK(bristle_last_error() == mine);
}

TEST_CASE("The C and the C++ interface give the same bits", "[c]") {
  constexpr std::uint32_t n = 700;
  const SnapLength law = SnapLength::uniform(0.5 * dbar, 1.5 * dbar);
  const Material material =
      plain_material(law, SnapRule::keep).with_bristle_damping(1e-3).with_viscous_friction(0.5);
  const PatchOptions options = plain_options(n, 1, Precision::single, Outputs::end);
  bristle_material c_material;
  bristle_init_material(&c_material, sizeof c_material);
  c_material.bristle_stiffness = material.bristle_stiffness;
  c_material.bristle_damping = material.bristle_damping;
  c_material.viscous_friction = material.viscous_friction;
  c_material.normal_stiffness = material.normal_stiffness;
  c_material.asperity_height_deviation = material.asperity_height_deviation;
  c_material.snap_length = {BRISTLE_LAW_UNIFORM, 0, 0.5 * dbar, 1.5 * dbar, nullptr};
  c_material.snap_rule = BRISTLE_RULE_KEEP;
  bristle_patch_options c_options;
  bristle_init_patch_options(&c_options, sizeof c_options);
  c_options.max_normal_load = options.max_normal_load;
  c_options.bristles = options.bristles;
  c_options.axes = 1;
  PatchBatch fresh;
  const PatchId cpp_id = fresh.add(material, options);
  bristle_batch* c_batch = nullptr;
  REQUIRE(bristle_create(nullptr, &c_batch) == BRISTLE_OK);
  bristle_id c_id = 0;
  REQUIRE(bristle_add(c_batch, &c_material, &c_options, &c_id) == BRISTLE_OK);
  REQUIRE(bristle_warm_up(c_batch) == BRISTLE_OK);
  for (int k = 0; k < 200; ++k) {
    const double d = dbar * ((k * 37) % 100 - 45) / 60.0;
    Motion motion{cpp_id, {d, 0.0}, n * (0.5 + (k % 7) / 14.0)};
    motion.has_velocity = k % 2 == 0;
    motion.velocity[0] = 0.5e-3;
    const Response response = step_one(fresh, motion, 1e-3);
    bristle_motion c_motion{};
    c_motion.id = c_id;
    c_motion.displacement[0] = d;
    c_motion.normal_load = motion.normal_load;
    c_motion.has_velocity = motion.has_velocity ? 1 : 0;
    c_motion.velocity[0] = 0.5e-3;
    bristle_response c_response{};
    REQUIRE(bristle_step(c_batch, 1e-3, &c_motion, sizeof c_motion, &c_response, sizeof c_response, 1,
                         nullptr) == BRISTLE_OK);
    REQUIRE(c_response.end[0] == response.end[0]);
    REQUIRE(c_response.elastic[0] == response.elastic[0]);
    REQUIRE(c_response.damper[0] == response.damper[0]);
  }
  REQUIRE(bristle_state_hash(c_batch, c_id) == fresh.state_hash(cpp_id));
  bristle_destroy(c_batch);
}

TEST_CASE("Headers that do not belong to the library are refused by name", "[build check]") {
  REQUIRE_NOTHROW(check_build());
  const auto text_of = [](BuildSignature headers) {
    return message_of([&] { PatchBatch batch({}, headers); });
  };
  const std::string version = library_version();
  const std::string advice = ": compile with the headers that were installed with the library";
  BuildSignature headers = header_build;
  headers.options ^= 1;
  const char* const here = BRISTLE_WITH_DOUBLE ? "on" : "off";
  const char* const there = BRISTLE_WITH_DOUBLE ? "off" : "on";
  CHECK(text_of(headers) == "bristle: header " + version + " with BRISTLE_WITH_DOUBLE " + there +
                                ", library " + version + " with BRISTLE_WITH_DOUBLE " + here + advice);
  headers = header_build;
  headers.version += 100;
  CHECK_THAT(text_of(headers), Catch::Matchers::Contains("header 0.2.0, library " + version));
  headers = header_build;
  headers.version += 1;  // headers of another patch version must be accepted, as only it differs
  CHECK(text_of(headers) == "(no error)");
  headers = header_build;
  headers.response_bytes += 8;
  CHECK_THAT(
      text_of(headers),
      Catch::Matchers::Contains("a Response of " + std::to_string(sizeof(Response) + 8) + " bytes, library"));
}

}  // namespace bristle_test::test_c_api
