// Helpers of the tests of `bristle fit`: they fit a record, check what it refuses, and check whether it found
// the true values.
#pragma once

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <string>

#include "expect.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/fitting/fit.hpp"

namespace bristle_test {

struct Fitted {
  cli::FitData data;
  cli::FitResult result;
  const cli::FitEstimate& operator[](cli::FitParameter p) const { return result.estimates[p]; }
};

/// Returns options that leave the choice of the brush to the fit, as the command does.
inline cli::FitOptions any_brush() {
  cli::FitOptions options;
  options.choose_rule = options.quiet = true;
  return options;
}

inline Fitted fit(const std::string& csv, cli::FitOptions options = {}) {
  Fitted fitted;
  fitted.data = cli::prepare_fit_data(cli::parse_fit_columns(csv, "data.csv", options.reading), options.sign,
                                      options.load);
  fitted.result = cli::fit_material(fitted.data, options);
  return fitted;
}

inline std::string refusal(const std::string& csv, const cli::FitOptions& options = {}) {
  return message_of<cli::UserError>([&] { fit(csv, options); });
}

/// Checks that a 95 % interval, widened by a margin, holds the true value. A half-width is two standard
/// errors, so the plain interval misses one true value in 16; the margin makes it five standard errors (2.5
/// half-widths), which a fixed seed exceeds only by very bad luck.
inline void check_recovered(const cli::FitEstimate& estimate, double truth, double most_width) {
  CAPTURE(estimate.value, estimate.low, estimate.high, truth);
  REQUIRE(estimate.fitted);
  CHECK(estimate.low < estimate.value);
  CHECK(estimate.value < estimate.high);
  CHECK(std::abs(estimate.value - truth) <=
        2.5 * std::max(estimate.high - estimate.value, estimate.value - estimate.low));
  CHECK(estimate.high - estimate.low <= 2.0 * most_width);  // limits the interval's width, because an
                                                            // interval wide enough contains any value
}

}  // namespace bristle_test
