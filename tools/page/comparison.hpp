// Runs experiments of `bristle experiment` on the page: the brush beside other friction models.
#pragma once

#include <string>
#include <vector>

namespace page {

/// Curve of one model in one of the page's comparisons, and the number that judges it.
struct Compared {
  std::vector<double> points;  ///< x and y by turns
  double finding = 0.0;        ///< value of the comparison's phenomenon
  bool shown = false;          ///< whether the model shows it, by the experiment's criterion
};

constexpr int comparisons = 3;  ///< drift, rubbing, rolling

/// Returns the names of a comparison's models.
std::vector<std::string> compared_models(int comparison);
Compared compare(int comparison, const std::string& model);

/// Returns the time of a step of 10,000 sliding bristles, us.
double step_microseconds();

}  // namespace page
