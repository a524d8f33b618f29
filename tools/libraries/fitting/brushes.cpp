#include "tools/libraries/fitting/brushes.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include <fmt/format.h>

#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/fitting/least_squares.hpp"
#include "tools/libraries/reports/progress.hpp"
#include "tools/libraries/scene/snap_law.hpp"

namespace cli {
namespace {

using bristle::SnapLaw;
using bristle::SnapRule;

constexpr double blocks = 32.0;
// Number of samples to which a record is thinned to search for a brush.
constexpr std::size_t search_samples = 2000;
// Largest error on held-out blocks, over the error of a simpler brush, with which a brush is preferred to the
// simpler one.
constexpr double clearly_closer = 0.97;
// Largest error on held-out blocks, over the least error of all brushes, with which a brush is fitted to the
// whole record as well.
constexpr double nearly_closest = 1.1;
// Share of the samples below whose highest path and speed a part of the record counts as in range.
constexpr double nearly_all = 0.99;
// Number of runs of a brush along the thinned record that a fit takes, as counted on measured records; the
// time to expect follows from it.
constexpr double usual_runs = 2500.0;
// Number of times that a fit is repeated without the samples at reversals of the motion. Each fit shows
// better which samples to leave out.
constexpr int most_cuts = 2;
// Ratio of the smaller to the larger of two successive moves, below which the motion counts as reversing
// between them.
constexpr double reversing = 0.25;

/// Returns the options of a fit with this snap rule. Throws UserError if an option that the user gave does
/// not go with the rule.
FitOptions with_rule(const FitData& data, const FitOptions& options, SnapRule rule) {
  FitOptions held = options;
  held.rule = rule;
  if (options.law == SnapLaw::single)
    throw UserError("--law: allowed are lognormal, normal, uniform, exponential, free");
  if (options.law == SnapLaw::table && (rule != SnapRule::slide || data.axes == 2))
    throw UserError(data.columns.name + ": --law free is for --rule slide, and for one axis");
  if (rule == SnapRule::keep) throw UserError(data.columns.name + ": rule is keep; allowed: redraw, slide");
  if (rule == SnapRule::redraw) return held;
  if (options.residual.value_or(0.0) != 0.0 || options.renewal.value_or(0.0) != 0.0)
    throw UserError("--residual and --renewal: other values than 0 need --rule redraw");
  held.residual = held.renewal = 0.0;
  return held;
}

}  // namespace

std::vector<double> path_since_reversal(const FitData& data) {
  const double slack = std::max(2.0 * data.quantum, 2e-3 * data.range);
  std::vector<double> paths;
  double reversal = data.path.front().x, extreme = reversal, direction = 0.0;
  for (const PathPoint& point : data.path) {
    if (point.begins) {
      reversal = extreme = point.x;
      direction = 0.0;
    }
    if (direction == 0.0 && std::fabs(point.x - reversal) > slack)
      direction = point.x > reversal ? 1.0 : -1.0;
    if (direction * (point.x - extreme) >= 0.0) {
      extreme = point.x;
    } else if (std::fabs(point.x - extreme) > slack) {
      reversal = extreme;
      extreme = point.x;
      direction = -direction;
    }
    if (point.wanted) paths.push_back(std::fabs(point.x - reversal));
  }
  return paths;
}

Reach reach_of(const FitData& data, const std::vector<bool>& part, bool which) {
  const std::vector<double> path = path_since_reversal(data);
  std::vector<double> paths, speeds;
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (part[i] != which) continue;
    paths.push_back(path[i]);
    speeds.push_back(std::fabs(data.velocity[i]));
  }
  return {quantile_of(std::move(paths), nearly_all), quantile_of(std::move(speeds), nearly_all)};
}

unsigned block_of(const FitData& data, std::size_t sample) {
  const double time = data.columns.t[sample] - data.first_time;
  const double share = data.length() > 0.0 ? std::min(time / data.length(), 1.0 - 1e-12) : 0.0;
  return static_cast<unsigned>(blocks * share);
}

std::vector<bool> fitted_blocks(const FitData& data, std::optional<double> until, bool other_half) {
  std::vector<bool> fitted;
  for (std::size_t i = 0; i < data.samples(); ++i) {
    const unsigned block = block_of(data, i);
    fitted.push_back(until ? data.columns.t[i] - data.first_time <= *until
                           : block == 0 || (std::popcount(block) % 2 == 0) != other_half);
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
  const bool slides = options.choose_rule ? bare : options.rule != SnapRule::redraw;
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

namespace {

/// Fits a brush, which was found on a part of a record, to the whole record.
void fit_to_all(FittedBrush& brush, const FitData& data) {
  if (fit_stopped()) return;
  const bool free_law = brush.options.law == SnapLaw::table;
  if (free_law) brush.options.law = SnapLaw::lognormal;
  Fitter fitter(data, brush.options, Detail::search);
  brush.found = fitter.fit_again(brush.found);
  if (!free_law) return;
  brush.found = fitter.with_free_law(brush.found, brush.options.quantiles);
  brush.options.law = SnapLaw::table;
}

/// Returns the rms error (N) of a fitted brush on the fifths of a record, each predicted from the others.
double error_in_fifths(const FittedBrush& brush, const FitData& data) {
  FitModel model(data, brush.options, Detail::search);
  const Eigen::MatrixXd j = jacobian(model, brush.found.point);
  const Eigen::VectorXd left = model.force(brush.found.point.values) - measured_force(data);
  return std::sqrt(held_out_squares(j, left, data.samples()) / static_cast<double>(left.size()));
}

/// Chooses a brush by the samples of `choice.thin`, as choose_brush() does by those of the whole record.
void choose_by_thin(Choice& choice, const FitOptions& options, const std::function<void(double)>& progress) {
  const FitData& thin = choice.thin;
  std::vector<bool> fitted = fitted_blocks(thin, options.fit_until);
  choice.other_half =
      !options.fit_until && !reach_of(thin, fitted, true).covers(reach_of(thin, fitted, false));
  if (choice.other_half) fitted = fitted_blocks(thin, options.fit_until, true);
  const FitData train = part_of(thin, fitted), remaining = part_of(thin, fitted, false);
  const bool chooses = std::min(train.samples(), remaining.samples()) >= fewest_to_choose;
  choice.failed.clear();
  std::vector<FittedBrush> brushes = fit_brushes(
      chooses ? train : thin, options, Detail::search, [&](double share) { progress(0.7 * share); },
      &choice.failed);
  if (!chooses) {
    choice.brush = brushes.back();
    return;
  }
  choice.of_part = brushes;
  std::vector<double> errors;
  std::string text;
  for (const FittedBrush& brush : brushes) {
    errors.push_back(
        std::sqrt((force_of(brush, remaining, Detail::search) - measured_force(remaining)).squaredNorm() /
                  static_cast<double>(remaining.force.size())));
    text += fmt::format("{}{} {:.3g}", text.empty() ? "" : "; ", brush.name, errors.back());
  }
  const double lowest = *std::min_element(errors.begin(), errors.end());
  FittedBrush* best = nullptr;
  double least = 0.0;
  for (std::size_t i = 0; i < brushes.size(); ++i) {
    if (errors[i] > nearly_closest * lowest) continue;
    fit_to_all(brushes[i], thin);
    const double error = error_in_fifths(brushes[i], thin);
    if (best != nullptr && error >= clearly_closer * least) continue;
    best = &brushes[i];
    least = error;
    progress(0.75);
  }
  if (brushes.size() > 1)
    choice.note = fmt::format(
        "{} is taken of the kinds of brush by their errors on blocks held out (N rms): {}", best->name, text);
  choice.brush = std::move(*best);
}

/// Measures how long (s) the paper's brush takes to run once along a record, on average over presliding
/// lengths, by which that time differs much.
double seconds_of_a_run(const FitData& data) {
  constexpr int tried = 4;
  const FitOptions plain;
  FitModel model(data, plain, Detail::search);
  FitValues values = fit_defaults;
  values[fit_spread] = 0.5;
  model.force(values);  // makes the table of the law
  const double low = model.lowest(fit_length), high = model.highest(fit_length);
  const Stopwatch runs;
  for (int i = 0; i < tried; ++i) {
    values[fit_length] = low * std::pow(high / low, (i + 0.5) / tried);
    model.force(values);
  }
  return runs.seconds() / tried;
}

}  // namespace

std::vector<bool> around_reversals(const FitData& data, const FitValues& fitted) {
  const std::vector<double> x = positions_of(data);
  const std::size_t n = data.samples();
  const Eigen::VectorXd friction = friction_measured(data, fitted);
  const auto moved = [&](std::size_t i) { return x[i] - x[i - 1]; };
  const auto follows = [&](std::size_t i) { return i < n && data.columns.follows(i); };
  std::vector<bool> left_out(n, false), short_of(n, false);
  for (std::size_t i = 0; i < n; ++i) {
    const double before = follows(i) ? moved(i) : 0.0, after = follows(i + 1) ? moved(i + 1) : before;
    const double least = reversing * std::max(std::fabs(before), std::fabs(after));
    left_out[i] = before * after <= 0.0 || std::min(std::fabs(before), std::fabs(after)) <= least;
    short_of[i] = std::fabs(friction[static_cast<Eigen::Index>(i)]) < fitted[fit_kinetic] * data.load[i];
  }
  for (std::size_t i = 1; i < n; ++i)
    if (left_out[i - 1] && short_of[i] && follows(i)) left_out[i] = true;
  for (std::size_t i = n - 1; i > 0; --i)
    if (left_out[i] && short_of[i - 1] && follows(i)) left_out[i - 1] = true;
  return left_out;
}

FitData samples_that_count(const FitData& moving, std::size_t most, const std::optional<FitValues>& cut_by) {
  const FitData thin = thinned(moving, most);
  if (!cut_by) return thin;
  const std::vector<bool> left_out = around_reversals(thin, *cut_by);
  const std::vector<double> x = positions_of(thin);
  FitData cut = part_of(thin, left_out, false);
  // Lets the search try presliding lengths down to half of the shortest move that stays, also where the
  // search sees fewer samples than the last fit.
  if (most < fit_samples) cut.finest_move = samples_that_count(moving, fit_samples, cut_by).finest_move;
  for (std::size_t i = 1; i < x.size(); ++i)
    if (!left_out[i]) cut.finest_move = std::min(cut.finest_move, std::fabs(x[i] - x[i - 1]));
  return cut;
}

Choice choose_brush(const FitData& data, const FitOptions& options,
                    const std::function<void(double)>& progress) {
  Choice choice;
  const FitData moving = without_rests(data);
  double done = 0.0;  // share of the work that is done; each choice takes half of what is left
  const auto choose = [&] {
    choice.thin = samples_that_count(moving, search_samples, choice.cut_by);
    choice.moving = samples_that_count(moving, fit_samples, choice.cut_by);
    const double end = 0.5 * (1.0 + done);
    choose_by_thin(choice, options, [&](double share) { progress(std::lerp(done, end, share)); });
    done = end;
  };
  announce("fit", options.quiet,
           [&] { return usual_runs * seconds_of_a_run(thinned(moving, search_samples)); });
  choose();
  for (int pass = 0; pass < most_cuts; ++pass) {
    const FitPoint found = choice.brush.found.point;
    if (contains(found.free, fit_length) || data.axes == 2 || data.reversals == 0) break;
    const FitData cut = samples_that_count(moving, search_samples, found.values);
    if (2 * cut.samples() < thinned(moving, search_samples).samples()) break;
    choice.cut_by = found.values;
    choose();
    choice.brush.found.notes = {
        "presliding is shorter than the moves between samples: those around reversals are left out, where "
        "friction may be anything between its limits"};
  }
  return choice;
}

}  // namespace cli
