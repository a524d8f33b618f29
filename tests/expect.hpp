// Assertions for long loops, which report only failures (a Catch macro costs a microsecond).
#pragma once

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "bristle/error.hpp"

namespace bristle_test {

inline void expect_near(double value, double expected, double tolerance, const char* what) {
  if (!(std::abs(value - expected) <= tolerance)) {
    char numbers[160];
    std::snprintf(numbers, sizeof numbers, " is %.12g, expected %.12g within %.3g; off by %.3g", value,
                  expected, tolerance, value - expected);
    FAIL_CHECK(what << numbers);
  }
}

inline void expect(bool right, const char* what) {
  if (!right) FAIL_CHECK("not so: " << what);
}

/// Returns the text of the error that a call throws; "(no error)" if it throws none.
template <class Exception = bristle::Error, class Call>
std::string message_of(const Call& call) {
  try {
    call();
  } catch (const Exception& error) {
    return error.what();
  }
  return "(no error)";
}

/// Whether a message contains all the given parts. If not, prints the message.
inline bool names(const std::string& message, const std::vector<std::string>& parts) {
  const bool all = std::all_of(parts.begin(), parts.end(), [&](const std::string& part) {
    return message.find(part) != std::string::npos;
  });
  if (!all) UNSCOPED_INFO(message);
  return all;
}

/// Returns the saved state of a batch, of keyed patches or of a contact model, and checks its size.
template <class Model>
std::vector<std::byte> saved_state(const Model& of) {
  std::vector<std::byte> state(of.state_size());
  expect(of.save_state({state.data(), state.size()}) == state.size(), "the whole state is saved");
  return state;
}

/// Returns `n`, or a smaller number of bristles or steps in builds that run slowly; tolerances of a test must
/// follow from the returned number.
inline std::uint32_t test_size(std::uint32_t full) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || !defined(NDEBUG)
  return full / 10 > 0 ? full / 10 : 1;
#else
  return full;
#endif
}

}  // namespace bristle_test
