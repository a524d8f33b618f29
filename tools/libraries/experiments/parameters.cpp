// The parameters that all experiments have, with their ranges and defaults.
#include <cmath>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "tools/libraries/experiments/settings.hpp"
#include "tools/libraries/files/nearest_name.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/scene/snap_law.hpp"

namespace cli {

Parameter& Settings::find(std::string_view name, const std::string& where, NameList known) {
  for (Parameter& p : parameters_) {
    if (p.name == name) return p;
    known.push_back(p.name);
  }
  throw UserError(fmt::format("{}: '{}' is not a parameter{}", where, name, allowed_text(name, known)));
}

const Parameter& Settings::find(std::string_view name) const {
  for (const Parameter& p : parameters_) {
    if (p.name == name) return p;
  }
  throw std::logic_error("experiment without the parameter " + std::string(name));
}

void Settings::check(Parameter& p, std::vector<double> numbers, const std::string& where) {
  if (numbers.empty() || (!p.is_list && numbers.size() != 1))
    throw UserError(fmt::format("{} takes {}", where, p.is_list ? "at least one number" : "one number"));
  if (numbers.size() > 1000) throw UserError(fmt::format("{} takes at most 1000 numbers", where));
  for (const double n : numbers) {
    if (!(n >= p.min && n <= p.max))
      throw UserError(fmt::format("{} is {:g}; allowed: {:g} to {:g}{}{}", where, n, p.min, p.max,
                                  p.unit.empty() ? "" : " ", p.unit));
    if (p.whole && n != std::floor(n)) throw UserError(fmt::format("{} is {:g}; it must be whole", where, n));
  }
  p.numbers = std::move(numbers);
}

void Settings::check(Parameter& p, const std::string& text, const std::string& where) {
  for (const std::string& choice : p.choices) {
    if (choice == text) {
      p.text = text;
      return;
    }
  }
  throw UserError(fmt::format("{} is '{}'{}", where, text, allowed_text(text, p.choices)));
}

void Settings::set_numbers(std::string_view name, std::vector<double> numbers) {
  const std::string where(name);
  check(find(name, where), std::move(numbers), where);
}

double Settings::number(std::string_view name) const { return find(name).numbers.front(); }
const std::vector<double>& Settings::numbers(std::string_view name) const { return find(name).numbers; }
const std::string& Settings::text(std::string_view name) const { return find(name).text; }

Parameter number_parameter(std::string name, double value, std::string unit, std::string help, double min,
                           double max) {
  Parameter p;
  p.name = std::move(name);
  p.unit = std::move(unit);
  p.help = std::move(help);
  p.numbers = {value};
  p.min = min;
  p.max = max;
  return p;
}

Parameter whole_parameter(std::string name, double value, std::string help, double min, double max) {
  Parameter p = number_parameter(std::move(name), value, "", std::move(help), min, max);
  p.whole = true;
  return p;
}

Parameter list_parameter(std::string name, std::vector<double> values, std::string unit, std::string help,
                         double min, double max) {
  Parameter p = number_parameter(std::move(name), 0.0, std::move(unit), std::move(help), min, max);
  p.numbers = std::move(values);
  p.is_list = true;
  return p;
}

std::vector<Parameter> operator+(std::vector<Parameter> a, std::vector<Parameter> b) {
  for (Parameter& p : b) a.push_back(std::move(p));
  return a;
}

std::vector<Parameter> common_parameters(const std::map<std::string, double>& defaults) {
  const auto choice = [](std::string name, std::string value, std::vector<std::string> choices,
                         std::string help) {
    Parameter p;
    p.name = std::move(name);
    p.help = std::move(help);
    p.text = std::move(value);
    p.choices = std::move(choices);
    return p;
  };
  // Default parameters: those of LuGre in Canudas de Wit et al. 1995, and a brush of equal kinetic force,
  // initial stiffness and damping, so that models compare.
  std::vector<Parameter> all = {
      number_parameter("dt", 1e-3, "s", "step; where a motion sets its own steps, their longest", 1e-6, 0.1),
      number_parameter("load", 2.5, "N", "normal load", 1e-6, 1e6),
      number_parameter("kinetic", 0.4, "", "sliding friction over load, all models", 1e-3, 10.0),
      number_parameter("static", 0.6, "", "friction over load at speed 0: lugre, elasto_plastic, gms", 1e-3,
                       20.0),
      number_parameter("stiffness", 1e5, "N/m", "first stiffness of the contact: rivals", 1.0, 1e12),
      number_parameter("damping", 316.22776601683796, "N s/m",
                       "of the bent contact at this load: lugre, elasto_plastic, brush", 0.0, 1e9),
      number_parameter("viscous", 0.4, "N s/m", "lubricant: coulomb, lugre, elasto_plastic, gms, brush", 0.0,
                       1e6),
      number_parameter(
          "stribeck_velocity", 1e-3, "m/s",
          "of the Stribeck curve (lugre, elasto_plastic, gms), of the damper's decay (brush); speed at "
          "which friction is kinetic (rate_state)",
          1e-9, 1e3),
      number_parameter("creep_velocity", 1e-5, "m/s", "full friction from this speed on: coulomb", 1e-9, 1.0),
      number_parameter(
          "elastic_share", 0.9, "",
          "deflection up to which the contact is elastic, of that at the static force: elasto_plastic", 0.0,
          0.99),
      number_parameter("attraction_rate", 100.0, "1/s",
                       "how fast slipping elements follow the Stribeck curve: gms", 1e-3, 1e9),
      number_parameter("direct_effect", 0.02, "", "a, friction over load per e-fold of speed: rate_state",
                       1e-6, 1.0),
      number_parameter("state_effect", 0.04, "", "b, friction over load per e-fold of the state: rate_state",
                       0.0, 1.0),
      number_parameter("state_length", 20e-6, "m", "Dc: rate_state", 1e-9, 1.0),
      number_parameter("presliding", 20e-6, "m",
                       "presliding length, that is residual and mean snap length: brush", 1e-9, 1.0),
      choice("law", "uniform", {"single", "uniform", "lognormal", "exponential"},
             "law of the snap length: brush"),
      number_parameter("cv", 0.28867513459481287, "",
                       "standard deviation of the snap length over its mean (uniform, lognormal): brush", 0.0,
                       widest_redraw_cv),
      number_parameter("residual", bristle::Coefficients{}.residual_share, "",
                       "share of the presliding length that a snap leaves: brush_rubbed, brush_aged", 0.0,
                       0.95),
      number_parameter("renewal", bristle::Coefficients{}.shared_renewal, "",
                       "bristles that a snap renews: brush_rubbed, brush_aged", 0.0,
                       bristle::largest_renewal),
      number_parameter("ageing", 0.05, "", "growth of a snap length per e-fold of its age: brush_aged", 0.0,
                       bristle::largest_ageing),
      number_parameter("ageing_time", 0.01, "s", "age from which on it grows with its logarithm: brush_aged",
                       bristle::shortest_ageing_time, bristle::longest_ageing_time),
      number_parameter("aged_damper", 0.1, "", "share of the brush's damper: brush_aged", 0.0, 1.0),
      number_parameter("strengthening", 0.0, "",
                       "a of a N asinh(v / (2 v*)), friction over load per e-fold of speed: brush_aged", 0.0,
                       1.0),
      number_parameter("strengthening_speed", 1e-6, "m/s", "v*: brush_aged", 1e-12, 1e3),
      choice("precision", BRISTLE_WITH_DOUBLE ? "double" : "single", {"single", "double"},
             "of the deflections: brush"),
      choice("decay", "exponential", {"exponential", "gaussian"}, "decay of the damper with speed: brush"),
      number_parameter("bristles_per_newton", 360.0, "1/N", "physical bristles in contact: brush", 1e-6, 1e9),
      whole_parameter("bristles", 900, "representatives at this load: brush", 1, 4e6),
      number_parameter("resolution", 8.0, "",
                       "pieces of path per mean snap length: brush_infinite, brush_rubbed, brush_aged", 1.0,
                       128.0),
      whole_parameter("seed", 1, "of the random numbers: brush", 0, 4294967295.0),
  };
  for (Parameter& p : all) {
    if (const auto found = defaults.find(p.name); found != defaults.end()) p.numbers = {found->second};
  }
  return all;
}

}  // namespace cli
