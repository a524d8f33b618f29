// Shared by the tests of `bristle fit`: a fit of a record, what it refuses, whether it found the truth.
#pragma once

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <string>

#include "tools/files/user_error.hpp"
#include "tools/fitting/fit.hpp"

namespace bristle_test {

struct Fitted {
  cli::FitData data;
  cli::FitResult result;
  const cli::FitEstimate& operator[](cli::FitParameter p) const { return result.estimates[p]; }
};

inline Fitted fit(const std::string& csv, cli::FitOptions options = {}) {
  Fitted fitted;
  fitted.data = cli::prepare_fit_data(cli::parse_fit_columns(csv, "data.csv", options.reading), options.sign,
                                      options.load);
  fitted.result = cli::fit_material(fitted.data, options);
  return fitted;
}

inline std::string refusal(const std::string& csv, const cli::FitOptions& options = {}) {
  try {
    fit(csv, options);
  } catch (const cli::UserError& error) {
    return error.what();
  }
  return {};
}

/// The interval holds the truth with room: a half-width is two standard errors, and one in 16 is outside;
/// five standard errors are 2.5 half-widths, beyond which a fixed seed would have to be very unlucky.
inline void check_recovered(const cli::FitEstimate& estimate, double truth, double most_width) {
  CAPTURE(estimate.value, estimate.low, estimate.high, truth);
  REQUIRE(estimate.fitted);
  CHECK(estimate.low < estimate.value);
  CHECK(estimate.value < estimate.high);
  CHECK(std::abs(estimate.value - truth) <=
        2.5 * std::max(estimate.high - estimate.value, estimate.value - estimate.low));
  CHECK(estimate.high - estimate.low <= 2.0 * most_width);  // a wide interval would hold anything
}

}  // namespace bristle_test
