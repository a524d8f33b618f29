// Explains why a model shows a phenomenon or does not, from the model's equations and for the default
// parameters.
#include <sstream>
#include <vector>

#include "tools/libraries/experiments/experiment.hpp"
#include "tools/libraries/experiments/reasons_text.hpp"  // made by CMake from reasons.txt

namespace cli {
namespace {

/// Entry of the file reasons.txt. Below each phenomenon it lists models that show it (+) or do not (-), and
/// why. Names of models that begin with brush_ are written without that beginning.
struct Reason {
  std::string phenomenon, text;  ///< `text` has the form "MODEL MODEL: why"
  bool shown;
};

std::vector<Reason> read_reasons() {
  std::vector<Reason> all;
  std::string phenomenon;
  std::istringstream lines(reasons_text);
  for (std::string line; std::getline(lines, line);) {
    if (line[0] == ' ')  // an indented line continues the entry above it
      all.back().text += line;
    else if (line[0] == '+' || line[0] == '-')
      all.push_back({phenomenon, line.substr(1), line[0] == '+'});
    else
      phenomenon = line;
  }
  return all;
}

}  // namespace

std::string reason_of(std::string_view phenomenon, std::string_view model, bool shown) {
  static const std::vector<Reason> reasons = read_reasons();
  const std::string name = ' ' + std::string(model.starts_with("brush_") ? model.substr(6) : model) + ' ';
  for (const Reason& r : reasons) {
    const std::size_t colon = r.text.find(": ");
    const std::string models = ' ' + r.text.substr(0, colon) + ' ';
    if (r.phenomenon == phenomenon && r.shown == shown && models.find(name) != std::string::npos)
      return r.text.substr(colon + 2);
  }
  return "";
}

}  // namespace cli
