// Runs experiments of `bristle experiment` in the interactive page: the brush beside other friction models.
#pragma once

#include <string>
#include <vector>

namespace page {

/// Result of one friction model in one of the page's comparisons: its curve, and the number that decides
/// whether it shows the phenomenon.
struct Compared {
  std::vector<double> points;  ///< points of the curve: x, y, x, y, ...
  double finding = 0.0;        ///< measured value that decides the comparison
  bool shown = false;          ///< whether the model shows the phenomenon, by the experiment's criterion
};

constexpr int comparisons = 3;  ///< number of comparisons of models: drift, rubbing, rolling

/// Returns the names of the friction models that a comparison of the page shows.
std::vector<std::string> compared_models(int comparison);
Compared compare(int comparison, const std::string& model);

/// Returns the measured time of a step of 10,000 sliding bristles, us.
double step_microseconds();

}  // namespace page
