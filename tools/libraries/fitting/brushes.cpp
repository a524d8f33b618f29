#include "tools/libraries/fitting/brushes.hpp"

#include <bit>
#include <cmath>
#include <csignal>

#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/platform/platform.hpp"
#include "tools/libraries/scene/snap_law.hpp"

namespace cli {
namespace {

using bristle::SnapLaw;
using bristle::SnapRule;

constexpr double blocks = 32.0;

volatile std::sig_atomic_t stopped = 0;

/// Handles Ctrl-C. At the first signal the fit ends with the best brush found so far; the second one ends the
/// program.
void stop(int signal) {
  if (stopped != 0) {
    std::signal(signal, SIG_DFL);
    std::raise(signal);
  }
  stopped = 1;
}

/// Returns the options of a fit with this snap rule. Throws UserError if an option that the user gave does
/// not go with the rule.
FitOptions with_rule(const FitData& data, const FitOptions& options, SnapRule rule) {
  FitOptions held = options;
  held.rule = rule;
  if (options.law == SnapLaw::single)
    throw UserError("--law: allowed are lognormal, normal, uniform, exponential, free");
  if (options.law == SnapLaw::table && (rule != SnapRule::slide || data.axes == 2))
    throw UserError(data.columns.name + ": --law free is for --rule slide, and for one axis");
  if (data.axes == 2 && rule == SnapRule::keep)
    throw UserError(data.columns.name + ": --rule keep is for one axis; leave out y and fy");
  if (rule == SnapRule::redraw) return held;
  if (options.residual.value_or(0.0) != 0.0 || options.renewal.value_or(0.0) != 0.0)
    throw UserError("--residual and --renewal: other values than 0 need --rule redraw");
  held.residual = held.renewal = 0.0;
  return held;
}

}  // namespace

void stop_fits_on_signals() { platform::on_stop_signals(&stop); }
bool fit_stopped() noexcept { return stopped != 0; }

std::vector<bool> fitted_blocks(const std::vector<double>& t, std::optional<double> until) {
  std::vector<bool> fitted;
  const double length = t.back() - t.front();
  for (const double time : t) {
    const double share = length > 0.0 ? std::min((time - t.front()) / length, 1.0 - 1e-12) : 0.0;
    const auto block = static_cast<unsigned>(blocks * share);
    fitted.push_back(until ? time - t.front() <= *until : std::popcount(block) % 2 == 0);
  }
  return fitted;
}

FitData part_of(const FitData& data, const std::vector<bool>& fitted, bool which) {
  std::vector<std::size_t> stay;
  for (std::size_t i = 0; i < fitted.size(); ++i)
    if (fitted[i] == which) stay.push_back(i);
  return with_samples(data, stay);
}

std::vector<FittedBrush> fit_brushes(const FitData& data, const FitOptions& options, Detail detail,
                                     const std::function<void(double)>& progress,
                                     std::vector<std::pair<std::string, std::string>>* failed) {
  const bool free_law = options.law == SnapLaw::table;
  const bool redraws = options.choose_rule ? !free_law : options.rule == SnapRule::redraw;
  const bool bare = !options.residual && !options.renewal;
  const bool keeps =
      options.choose_rule ? bare && !free_law && data.axes == 1 : options.rule == SnapRule::keep;
  const bool slides = options.choose_rule ? bare : options.rule == SnapRule::slide;
  std::vector<FittedBrush> all;
  std::string reason;
  const auto attempt = [&](const std::string& name, const auto& fit) {
    if (fit_stopped() && !all.empty()) return;
    try {
      fit();
    } catch (const UserError& refused) {
      reason = refused.what();
      if (failed != nullptr) failed->emplace_back(name, reason);
    }
  };
  // Adds one more brush to the list: the last one with the terms that `extend` finds for it. Adds nothing if
  // it finds none.
  const auto add_with = [&](const char* suffix, Found (Fitter::*extend)(const Found&)) {
    if (fit_stopped() || all.empty()) return;
    FittedBrush more = all.back();
    more.name += suffix;
    more.found = (Fitter(data, more.options, detail).*extend)(all.back().found);
    if (more.found.point.free != all.back().found.point.free) all.push_back(std::move(more));
  };
  const auto add_speed = [&] { add_with(", damped", &Fitter::with_speed_terms); };
  const auto add_stage = [&] { add_with(", stage", &Fitter::add_stage); };
  if (redraws) {
    const char* const name =
        options.residual || options.renewal ? "brush, rubbing held" : "brush, the paper's";
    attempt(name, [&] {
      const FitOptions held = with_rule(data, options, SnapRule::redraw);
      FitOptions plain = held;
      plain.residual = held.residual.value_or(0.0);
      plain.renewal = held.renewal.value_or(0.0);
      all.push_back({name, plain, Fitter(data, plain, detail).search_plain()});
      progress(0.3);
      const Found rubbed = Fitter(data, held, detail).add_rubbing(all.back().found);
      all.back().options = held;
      if (rubbed.point.free.size() > all.back().found.point.free.size())
        all.push_back({"brush, rubbed", held, rubbed});
      add_speed();
      add_stage();
    });
  }
  progress(0.4);
  if (keeps)
    attempt("brush, kept lengths", [&] {
      const FitOptions held = with_rule(data, options, SnapRule::keep);
      all.push_back({"brush, kept lengths", held, Fitter(data, held, detail).search_plain()});
      add_speed();
    });
  progress(0.6);
  if (slides) {
    attempt("brush, slide", [&] {
      FitOptions held = with_rule(data, options, options.choose_rule ? SnapRule::slide : options.rule);
      if (free_law) held.law = SnapLaw::lognormal;  // starts the free law from a lognormal one
      all.push_back({"brush, slide", held, Fitter(data, held, detail).search_plain()});
      add_speed();
      add_stage();
    });
    progress(0.85);
    const bool slid = !all.empty() && all.back().options.rule == SnapRule::slide;
    if (slid && data.axes == 1 && (options.choose_rule || free_law))
      attempt("brush, slide, free law", [&] {
        FittedBrush free = all.back();
        free.name += ", free law";
        free.found = Fitter(data, free.options, detail).with_free_law(free.found, free.options.quantiles);
        free.options.law = SnapLaw::table;
        if (free_law) all.pop_back();
        all.push_back(std::move(free));
      });
  }
  if (all.empty()) throw UserError(reason);
  progress(1.0);
  return all;
}

Eigen::VectorXd force_of(const FittedBrush& brush, const FitData& data, Detail detail) {
  FitModel model(data, brush.options, detail);
  assume(model, brush.found.point);
  return model.force(brush.found.point.values);
}

}  // namespace cli
