// The C interface: a program in C, compared with the C++ interface.
#include <catch2/catch.hpp>

#include <bristle/bristle.h>

#include <thread>

#include "c_program.h"
#include "expect.hpp"
#include "scenes.hpp"

namespace bristle_test::test_c_api {

using namespace bristle;

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
TEST_CASE("A C program asks what it runs on", "[c]") { REQUIRE(c_program_asks_what_it_runs_on() == 0); }
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
