// BRISTLE_ASSERT: a broken invariant ends the program with its text in builds with asserts, and costs nothing
// in others.
#include <catch2/catch.hpp>

#include <cstdint>
#include <string>
#include <thread>

#include <sys/wait.h>
#include <unistd.h>
#include <csignal>

#include "core/common/assert.hpp"
#include "core/contacts/key_table.hpp"
#include "core/kernel_table.hpp"
#include "core/runtime/stepping_side.hpp"

namespace bristle_test::test_asserts {

using namespace bristle::detail;

namespace {

struct Death {
  bool aborted;
  std::string text;  ///< text that the process printed on stderr
};

/// Runs `act` in a child process.
template <class Act>
Death run_apart(Act act) {
  int ends[2];
  REQUIRE(pipe(ends) == 0);
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    signal(SIGABRT, SIG_DFL);  // else Catch's handler would report the abort as a failed test
    dup2(ends[1], 2);
    act();
    _exit(0);
  }
  close(ends[1]);
  Death death{};
  char part[256];
  for (ssize_t n; (n = read(ends[0], part, sizeof part)) > 0;)
    death.text.append(part, static_cast<std::size_t>(n));
  close(ends[0]);
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  death.aborted = WIFSIGNALED(status) && WTERMSIG(status) == SIGABRT;
  return death;
}

}  // namespace

#if BRISTLE_ASSERTS

TEST_CASE("A call of the stepping side that begins while another is under way ends the program",
          "[asserts]") {
  SteppingSide side;
  { const SteppingCall one(side); }
  { const SteppingCall after_it(side); }
  { const SteppingCall one(side), within_it(side); }
  const Death death = run_apart([&side] {
    const SteppingCall one(side);
    std::thread([&side] { const SteppingCall meanwhile(side); }).join();
  });
  CHECK(death.aborted);
  CHECK(death.text.find("no_other_call_is_under_way") != std::string::npos);
}

TEST_CASE("A failed assert prints its condition, file and line, and aborts", "[asserts]") {
  const int parts = 3;
  const int line = __LINE__ + 1;
  const Death death = run_apart([] { BRISTLE_ASSERT(parts == 4); });
  CHECK(death.aborted);
  CHECK(death.text.find("test_asserts.cpp:" + std::to_string(line) + ": assert failed: parts == 4") !=
        std::string::npos);
}

TEST_CASE("An assert that holds does nothing", "[asserts]") {
  const Death death = run_apart([] { BRISTLE_ASSERT(2 + 2 == 4); });
  CHECK(!death.aborted);
  CHECK(death.text.empty());
}

TEST_CASE("A key table that is filled beyond half is caught", "[asserts]") {
  const auto fill = [](std::uint32_t keys) {
    KeyTable table(8);
    for (std::uint32_t k = 0; k < keys; ++k) table.insert(k, k);
  };
  CHECK(!run_apart([&] { fill(8); }).aborted);
  const Death death = run_apart([&] { fill(9); });
  CHECK(death.aborted);
  CHECK(death.text.find("key_table.hpp") != std::string::npos);
}

#else

TEST_CASE("Without asserts a condition is not evaluated", "[asserts]") {
  int evaluated = 0;
  const auto holds = [&evaluated] { return ++evaluated > 100; };
  BRISTLE_ASSERT(holds());
  CHECK(evaluated == 0);
}

#endif

}  // namespace bristle_test::test_asserts
