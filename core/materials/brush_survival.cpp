#include "core/materials/brush_survival.hpp"

#include "core/materials/slow_wave.hpp"

namespace bristle::detail {
namespace {

/// Share of the snap lengths below the first cell, unless the law has a longest one: kernels take S as 1
/// there.
constexpr double left_out = 1e-4;
/// Share of the force of steady sliding that bristles bear beyond the last cell.
constexpr double force_left_out = 1e-5;
/// Error of S, integrated over the deflection and over the mean snap length, up to which few cells do.
constexpr double most_error = 2e-4;
/// Longest length of a cell, in mean snap lengths.
constexpr double farthest_end = 2048.0;

bool has_longest(const SnapLength& law) {
  return law.law() == SnapLaw::uniform || law.law() == SnapLaw::table || law.law() == SnapLaw::single;
}

/// Returns the share of the force of steady sliding that would be lost if all bristles snapped at the
/// deflection x, m, at the latest. The force is in proportion to the integral of x S(x), E[delta^2] / 2.
double force_beyond(const SnapLength& law, double x) {
  const double square = law.moment(2);
  return std::max(square - law.partial_moment(2, x) - x * x * law.survival(x), 0.0) / square;
}
/// Returns the deflection, m, beyond which bristles bear this share of the force.
double find_tail(const SnapLength& law, double share) {
  double low = 0.0, high = has_longest(law) ? law.longest() : farthest_end * law.mean();
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (force_beyond(law, middle) > share ? low : high) = middle;
  }
  return high;
}

/// Returns the path, in mean snap lengths, along which the force swings after bristles began to slide
/// together. The swings of smooth laws fall as exp(-2 pi^2 cv^2 x / mean) or faster and are followed to 1e-4;
/// slower ones of laws with jumps of density or with atoms, to 6e-6. Groups of equal lengths swing for ever,
/// so there is a limit.
double find_waves(const SnapLength& law) {
  if (!has_longest(law)) return std::min(0.45 / (law.cv() * law.cv()), 32.0);
  return std::min(12.0 / find_slow_wave(law).decay, 100.0);
}

/// Layout of cells: where a cell begins.
struct Layout {
  std::uint32_t cells;
  double per_octave;  ///< BrushSurvival::per_octave
  double low, high;

  /// Returns the length of the range over that of the first cell, less one, or the number of equal cells.
  double per_range() const {
    return per_octave == 0.0 ? cells : std::ldexp(1.0, static_cast<int>(cells / per_octave)) - 1.0;
  }
  double begin(double cell) const {
    if (per_octave == 0.0) return low + (high - low) * (cell / cells);
    const double octave = std::floor(cell / per_octave), in_octave = cell / per_octave - octave;
    const double y = std::ldexp(1.0 + in_octave, static_cast<int>(octave));
    return low + (high - low) * ((y - 1.0) / per_range());
  }
};

/// Coefficients of the cells of a layout, and the mean error of S over a mean snap length.
struct Fit {
  Layout layout;
  std::vector<double> c0, c1, c2;
  double error = 0.0;
};
Fit fit_cells(const SnapLength& law, double per_metre, const Layout& layout) {
  Fit fit{layout, {}, {}, {}};
  const auto at = [&](double cell) {
    if (cell == 0.0) return 1.0;
    return cell == layout.cells ? 0.0 : law.survival(layout.begin(cell) / per_metre);
  };
  // Integral of S from 0 to x, m.
  const auto integral = [&](double x) { return x * law.survival(x) + law.partial_moment(1, x); };
  double first = 1.0, before = integral(layout.low / per_metre);
  for (std::uint32_t k = 0; k < layout.cells; ++k) {
    const double start = layout.begin(k) / per_metre, end = layout.begin(k + 1.0) / per_metre;
    const double last = std::min(at(k + 1.0), first), after = integral(end);
    const double mean = (after - before) / (end - start), fall = first - last;
    // S is first - fall f - bend f (1 - f), with the mean of the law; it never rises.
    const double bend = std::clamp(3.0 * (first + last) - 6.0 * mean, -fall, fall);
    fit.c0.push_back(first);
    fit.c1.push_back(-fall - bend);
    fit.c2.push_back(bend);
    for (const double f : {0.2, 0.5, 0.8}) {
      const double here = first - fall * f - bend * f * (1.0 - f);
      fit.error +=
          std::abs(here - law.survival(start + f * (end - start))) * (end - start) / (3.0 * law.mean());
    }
    first = last;
    before = after;
  }
  return fit;
}

/// Fits the cells: few if they are good enough, otherwise the best of more. Laws given as tables, with up to
/// 256 corners and with atoms, get most.
Fit fit_cells(const SnapLength& law, double per_metre) {
  const bool ends = has_longest(law);
  const double low = law.quantile(ends ? 1e-9 : left_out) * per_metre;
  const double high = (ends ? law.longest() : find_tail(law, force_left_out)) * per_metre;
  Fit best = fit_cells(law, per_metre, {few_brush_cells, 0.0, low, high});
  const std::uint32_t many = law.law() == SnapLaw::table ? 1024 : 128;
  for (const std::uint32_t cells : {few_brush_cells, many}) {
    if (best.error < most_error) return best;
    for (const std::uint32_t octaves : {0u, 2u, 4u, 8u, 16u}) {
      const double per_octave = octaves == 0 ? 0.0 : static_cast<double>(cells / octaves);
      Fit trial = fit_cells(law, per_metre, {cells, per_octave, low, high});
      if (trial.error < best.error) best = std::move(trial);
    }
  }
  return best;
}

template <class T>
std::vector<LaneColumn<T>> in_columns(const Fit& fit) {
  const std::size_t each = (fit.layout.cells + lane_count - 1) / lane_count;
  std::vector<LaneColumn<T>> out(3 * each);
  const std::vector<double>* const numbers[] = {&fit.c0, &fit.c1, &fit.c2};
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t k = 0; k < fit.layout.cells; ++k)
      out[c * each + k / lane_count].lane[k % lane_count] = static_cast<T>((*numbers[c])[k]);
  return out;
}

}  // namespace

BrushCells::BrushCells(const SnapLength& law, double per_metre) {
  const Fit fit = fit_cells(law, per_metre);
  float_ = in_columns<float>(fit);
  double_ = in_columns<double>(fit);
  low_ = fit.layout.low;
  high_ = fit.layout.high;
  per_length_ = fit.layout.per_range() / (high_ - low_);
  per_octave_ = fit.layout.per_octave;
  cells_ = fit.layout.cells;
  finest = find_finest_piece(law);
  waves = find_waves(law) * law.mean() * per_metre;
  weak = law.survival(find_tail(law, 1e-3));
}

const BrushCells& CompiledMaterial::brush_cells() const {
  std::call_once(brush_cells_made_, [this] {
    brush_cells_ = std::make_shared<const BrushCells>(material.snap_length, lengths_per_metre);
  });
  return *brush_cells_;
}

namespace {

/// Returns the usual length of a piece over the mean snap length. Pieces are shorter if many bristles snap
/// together, and under strong shared renewal, whose effect changes along the length 1 / (kappa x snap rate).
double find_piece_share(const CompiledMaterial& material, double resolution) {
  const SnapLength& lengths = material.material.snap_length;
  const BrushCells& cells = material.brush_cells();
  const double mean = lengths.mean() * material.lengths_per_metre;
  const double renewals = material.material.shared_renewal * material.snap_rate * mean;
  const double share = cells.finest / resolution * (renewals > 1.5 ? 1.5 / renewals : 1.0);
  return std::min(share, 0.6 * cells.view<double>().high / mean);
}

}  // namespace

std::uint32_t choose_cohorts(const CompiledMaterial& material, double resolution) {
  const double mean = material.material.snap_length.mean() * material.lengths_per_metre;
  const double longest = material.brush_cells().view<double>().high / mean;
  const double covered = 1.25 * longest / find_piece_share(material, resolution);
  const double wanted = std::max(12.0 * resolution, std::min(covered, 32.0 * resolution));
  return std::clamp(static_cast<std::uint32_t>(std::ceil(wanted)), 24u, most_cohorts);
}

template <class T>
void fill_brush_law(const CompiledMaterial& material, double resolution, BrushLaw<T>& law,
                    BrushSurvival<T>& survival) {
  const SnapLength& lengths = material.material.snap_length;
  const double per_metre = material.lengths_per_metre, mean = lengths.mean() * per_metre;
  const BrushCells& cells = material.brush_cells();
  survival = cells.view<T>();
  law.survival = &survival;
  law.residual = material.residual;
  law.renewal = material.material.shared_renewal;

  const double share = find_piece_share(material, resolution);
  law.piece = mean * share;
  // Lets pieces grow in the middle of a step. Narrow laws tolerate it only far from its ends, because many
  // bristles would snap in one piece; wide ones and those with renewal, because many would snap twice or be
  // renewed.
  const bool tolerant = lengths.cv() >= 0.25 && lengths.cv() <= 0.6 && law.renewal == 0.0;
  law.slow = (tolerant ? 0.25 : 2.0) * mean;
  law.growth = lengths.cv() > 0.6 ? 1.5 : 2.0;
  // Moves cohorts apart only under laws without jumps of density. In a uniform slide their squared distance
  // has to grow by the factor 1.33.
  law.most_apart = has_longest(lengths) ? 1.0 : 1.6;
  // A cohort ends when its share is below 1e-6 of the load, with pieces of 1/8 mean length: with shorter
  // pieces its share, and the error that its end may cause, fall with their square. Under a wide law few long
  // bristles bear much of the force, so cohorts end later.
  law.least_share = std::min(1e-6 * (8.0 * share) * (8.0 * share), share * cells.weak);
  // A straight path is steady once the longest bristles, if bent against it, have unbent and snapped, and
  // once bristles that began it together have come out of step. Less would be enough for one path, but
  // errors of strokes to and fro add up.
  const double high = static_cast<double>(survival.high);
  law.forget = 2.0 * law.residual + std::max(2.0 * high, high + cells.waves);
}

template void fill_brush_law(const CompiledMaterial&, double, BrushLaw<float>&, BrushSurvival<float>&);
template void fill_brush_law(const CompiledMaterial&, double, BrushLaw<double>&, BrushSurvival<double>&);

}  // namespace bristle::detail
