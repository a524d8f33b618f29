#include "core/materials/kernel_law.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/common/assert.hpp"
#include "core/common/hashing.hpp"
#include "core/common/range_check.hpp"
#include "core/materials/elementary.hpp"
#include "core/materials/virgin_curve.hpp"

namespace bristle::detail {
namespace {

// Coefficient of variation below which all snap lengths count as equal; redrawing a length then changes
// nothing, and SnapRule::redraw is computed as SnapRule::keep.
constexpr double negligible_cv = 1e-6;
// A probability, 2^-25, below all those at which a snap length is sampled. Sampled probabilities are (h +
// 1/2) 2^-23, h = 0, 1, 2, ..., of which the smallest is 2^-24.
constexpr double smallest_share = 1.0 / 33554432.0;  // 2^-25
// Shortest scaled snap length, 2^-40. A shorter one would make numbers or quotients in single precision
// infinite.
constexpr double shortest_scaled = 1.0 / 1099511627776.0;
constexpr int biased_knots = 1024;
// Largest number of renewals of a bristle along a mean snap length. Each takes time, so this limits the time
// of a step.
constexpr double most_renewals = 1000.0;

/// Finds the path after which sliding is steady, in mean snap lengths: from there on the mean deflection of
/// bristles that were straight at first stays within 1e-3 of its final value. Solves the renewal equation on
/// a grid (core/MODEL.md, "Jumps").
double find_stationary_path(const SnapLength& law) {
  constexpr int per_mean = 48;
  // Longest path that the search returns, in mean lengths. Some laws take longer to settle, but a longer grid
  // would cost too much.
  constexpr int reach = 40;
  constexpr int n = per_mean * reach;
  const double h = law.mean() / per_mean;
  const double steady = law.moment(2) / (2.0 * law.mean()) / law.mean();
  // share[k] = P((k-1) h < delta <= k h): the share of snap lengths in cell k of width h.
  std::vector<double> share(static_cast<std::size_t>(n) + 1);
  double before = 1.0;
  for (int k = 1; k <= n; ++k) {
    const double now = law.survival(k * h);
    share[static_cast<std::size_t>(k)] = before - now;
    before = now;
  }
  // Solves the renewal equation f(x) = x S(x) + sum of share x f(x - delta) for the mean deflection f at the
  // path x. Inside a cell f is taken as linear.
  std::vector<double> f(static_cast<std::size_t>(n) + 1, 0.0);
  int last_off = 0;
  for (int j = 1; j <= n; ++j) {
    double sum = law.survival(j * h) * j / per_mean;
    for (int k = 2; k <= j; ++k)
      sum += share[static_cast<std::size_t>(k)] * 0.5 *
             (f[static_cast<std::size_t>(j - k)] + f[static_cast<std::size_t>(j - k + 1)]);
    sum += share[1] * 0.5 * f[static_cast<std::size_t>(j - 1)];
    f[static_cast<std::size_t>(j)] = sum / (1.0 - 0.5 * share[1]);
    if (std::abs(f[static_cast<std::size_t>(j)] - steady) > 1e-3 * steady) last_off = j;
  }
  return static_cast<double>(last_off + 1) / per_mean;
}

void fill_renewal_constants(const SnapLength& length, double per_metre, KernelLaw& law) {
  double m[6];
  double factor = 1.0;
  for (int k = 0; k <= 5; ++k, factor *= per_metre) m[k] = length.moment(k) * factor;
  fill_jump_sums(m, law);
  const double cv = length.cv();
  if (cv < 0.2) {
    fill_narrow_jumps(m, cv, law);
  } else {
    // Lets jumps over many snaps begin after a short path for the exponential law. This law has no memory, so
    // jumps are exact over any distance, and from 0.3 mean lengths on they cost less than sampling snap by
    // snap.
    const bool memoryless = length.law() == SnapLaw::exponential;
    law.jump_from = (memoryless ? 0.3 : find_stationary_path(length)) * m[1];
    law.stationary_from = law.jump_from;
  }
}

/// Table of quantiles of the law times `scale`, with a straight line in each cell, from which the kernels
/// sample lengths (kernels/cells.hpp).
class CellTable {
 public:
  CellTable(const SnapLength& the_law, double the_scale, double the_shortest, double the_longest)
      : law(the_law), scale(the_scale), shortest(the_shortest), longest(the_longest) {
    for (int side = 0; side < 2; ++side)
      for (int cell = 0; cell < half; ++cell) lines[side * half + cell] = find_line(side, cell);
    match_tail();
  }

  std::vector<double> write() const {
    std::vector<double> table(3 * size);
    for (std::size_t at = 0; at < size; ++at) {
      const double wide[2] = {lines[at].a, lines[at].b};
      const float narrow[2] = {static_cast<float>(wide[0]), static_cast<float>(wide[1])};
      std::memcpy(&table[at], narrow, sizeof narrow);
      std::memcpy(&table[size + 2 * at], wide, sizeof wide);
    }
    return table;
  }

 private:
  static constexpr int octaves = 23, per_octave = 16, half = octaves * per_octave;
  static constexpr std::size_t size = 2 * half;
  struct Line {
    double a = 0.0, b = 0.0;
  };

  const SnapLength& law;
  const double scale, shortest, longest;
  Line lines[size];

  double quantile(double u) const { return std::clamp(scale * law.quantile(u), shortest, longest); }

  /// Returns the line that stands for the law in a cell: it has the law's mean and variance there, by Gauss's
  /// rule of four points.
  Line find_line(int side, int cell) const {
    constexpr double point[4] = {-0.8611363115940526, -0.3399810435848563, 0.3399810435848563,
                                 0.8611363115940526};
    constexpr double weight[4] = {0.17392742256872692, 0.32607257743127305, 0.32607257743127305,
                                  0.17392742256872692};
    const double octave = std::ldexp(1.0, cell / per_octave - octaves - 1);
    const auto at = [&](double w) { return quantile(side == 0 ? w : 1.0 - w); };
    if (cell == 0) return {at(octave), 0.0};  // a constant, because only one length of cell 0 is sampled
    const double width = octave / per_octave, middle = octave + (cell % per_octave + 0.5) * width;
    double length[4];
    double mean = 0.0, variance = 0.0;
    for (int k = 0; k < 4; ++k) mean += weight[k] * (length[k] = at(middle + 0.5 * width * point[k]));
    for (int k = 0; k < 4; ++k) variance += weight[k] * square(length[k] - mean);
    const double slope = (side == 0 ? 1.0 : -1.0) * std::sqrt(12.0 * variance) / width;
    return {mean - slope * middle, slope};
  }

  /// Shifts the longest lengths of the table (quantiles above 1 - 2^-16 except the last) in two groups, so
  /// that the table's mean and mean square equal those of the law. Without the shift, lengths too rare to be
  /// sampled would be missing from both.
  void match_tail() {
    constexpr double step = 1.0 / 8388608.0;  // distance between two probabilities that can be sampled
    constexpr int shares = 128, outer = 8;
    const double from = law.quantile(1.0 - shares * step);
    double lack[3], sum[2] = {0.0, 0.0};
    for (int k = 1; k <= 2; ++k)
      lack[k] = (law.moment(k) - law.partial_moment(k, from)) * (k == 1 ? scale : scale * scale) / step;
    for (int n = 0; n < shares; ++n) {
      const double length = length_at((n + 0.5) * step);
      lack[1] -= length;
      lack[2] -= length * length;
      if (n > 0) sum[n < outer ? 0 : 1] += length;
    }
    const double count[2] = {outer - 1, shares - outer};
    double more[2] = {0.0, 0.0};
    for (int i = 0; i < 20; ++i) {
      const double squares = 0.5 * (lack[2] - count[0] * square(more[0]) - count[1] * square(more[1]));
      more[0] = (squares * count[1] - lack[1] * sum[1]) / (sum[0] * count[1] - sum[1] * count[0]);
      more[1] = (lack[1] - count[0] * more[0]) / count[1];
    }
    const double room = longest - length_at(1.5 * step);
    const double most = 0.5 * from * scale;
    if (!(more[0] < room && magnitude(more[0]) < most && magnitude(more[1]) < most))
      // Leaves the longest lengths of a very wide law as they are: the correction would be more than half of
      // their length, or exceed the law's longest length.
      return;
    for (int cell = 1; cell < 8 * per_octave; ++cell) {
      const double w =
          std::ldexp(1.0 + (cell % per_octave) / double{per_octave}, cell / per_octave - octaves - 1);
      lines[half + cell].a += more[w < outer * step ? 0 : 1];
    }
  }
  /// Returns the quantile at the probability 1 - w, the length that a share w of the law exceeds. Takes w,
  /// not 1 - w, so that small shares keep their digits.
  double length_at(double w) const {
    int exponent = 0;
    const double mantissa = std::frexp(w, &exponent);  // mantissa is in [1/2, 1)
    const int cell =
        (exponent + octaves) * per_octave + static_cast<int>((2.0 * mantissa - 1.0) * per_octave);
    return lines[half + cell].a + lines[half + cell].b * w;
  }
};

/// Returns quantiles of the length-biased law (it favours lengths in proportion to themselves) at the
/// probabilities k / biased_knots, for laws without a closed form. At a random point of a path, the bristles'
/// lengths follow this law.
std::vector<double> biased_quantiles(const SnapLength& length, double per_metre) {
  std::vector<double> knots(biased_knots + 1);
  const double total = length.mean();
  const double lowest = length.law() == SnapLaw::table ? length.table_values()[0] : 0.0;
  knots[0] = lowest * per_metre;
  knots[biased_knots] = length.longest() * per_metre;
  double low = lowest;
  for (int k = 1; k < biased_knots; ++k) {
    const double wanted = total * k / biased_knots;
    double high = length.longest();
    for (int i = 0; i < 60 && high - low > 1e-14 * high; ++i) {
      const double middle = 0.5 * (low + high);
      (length.partial_moment(1, middle) < wanted ? low : high) = middle;
    }
    knots[static_cast<std::size_t>(k)] = low * per_metre;
  }
  return knots;
}

[[maybe_unused]] bool ascends(const std::vector<double>& quantiles) {
  return std::is_sorted(quantiles.begin(), quantiles.end());
}

void assert_law(const CompiledMaterial& c) {
  const KernelLaw& law = c.law;
  BRISTLE_ASSERT(0.0 < law.shortest && law.shortest < law.mean && law.mean < law.longest);
  // Is true of every law, because lengths are scaled by a power of two near their mean.
  BRISTLE_ASSERT(0.7 < law.mean && law.mean < 1.42);
  BRISTLE_ASSERT(law.kind != law_table || ascends(c.table));
  BRISTLE_ASSERT(law.kind == law_lognormal || ascends(c.biased_table));
  BRISTLE_ASSERT(law.jump_from > 0.0 && law.stationary_from >= law.jump_from);
  BRISTLE_ASSERT(law.square_mean >= law.mean * law.mean * (1.0 - 1e-12));
  BRISTLE_ASSERT(law.squares_per_length > 0.0 && law.variance_per_length > -1e-12);
  BRISTLE_ASSERT(law.square_residual >= 0.0);
  static_cast<void>(law);
}

/// Replaces negative zeros by positive ones. A batch stores one of several materials that compare equal, and
/// -0 equals 0, so both must give equal hashes and bits.
void make_zeros_positive(Material& m) noexcept {
  for (double* x : {&m.bristle_stiffness, &m.bristle_damping, &m.viscous_friction, &m.stribeck_velocity,
                    &m.residual_length, &m.shared_renewal, &m.ageing_strength, &m.speed_strengthening})
    *x += 0.0;
}

/// Hashes the parameters of a material after make_zeros_positive(). Adding 0.0 makes negative zeros in the
/// snap-length law positive, too.
std::uint64_t hash_material(const Material& m) {
  Hasher hasher;
  for (double x :
       {m.bristle_stiffness, m.bristle_damping, m.viscous_friction, m.stribeck_velocity, m.normal_stiffness,
        m.asperity_height_deviation, m.snap_length.first_parameter(), m.snap_length.second_parameter()})
    hasher.add(x + 0.0);
  for (double x : m.snap_length.table_values()) hasher.add(x + 0.0);
  hasher.add(static_cast<std::uint64_t>(m.snap_length.law()) | static_cast<std::uint64_t>(m.snap_rule) << 8 |
             static_cast<std::uint64_t>(m.damper_decay) << 16);
  // Leaves parameters that the material does not use out of the hash. The hash of the paper's brush, by which
  // its saved states are checked, then stays the same when parameters are added to the library.
  if (m.residual_length != 0.0 || m.shared_renewal != 0.0) {
    hasher.add(m.residual_length);
    hasher.add(m.shared_renewal);
  }
  if (m.ageing_strength != 0.0) {
    hasher.add(std::uint64_t{0xA6E} | static_cast<std::uint64_t>(m.ageing_form) << 16);
    hasher.add(m.ageing_strength);
    hasher.add(m.ageing_time);
  }
  if (m.drop != 0.0) {
    hasher.add(std::uint64_t{0xD209});
    hasher.add(m.drop);
  }
  if (m.speed_strengthening != 0.0) {
    hasher.add(std::uint64_t{0x5EED});
    hasher.add(m.speed_strengthening);
    hasher.add(m.strengthening_speed);
  }
  return hasher.value();
}

}  // namespace

double spread_share(int k) noexcept { return crowded_share((k + 0.5) / spread_size); }

double spread_weight(int k) noexcept {
  const double t = (k + 0.5) / spread_size;
  return 30.0 * t * t * (1.0 - t) * (1.0 - t) / spread_size;
}

void fill_jump_sums(const double (&m)[6], KernelLaw& law) noexcept {
  const double variance = std::max(m[2] - m[1] * m[1], 0.0);
  law.mean = m[1];
  law.inverse_mean = 1.0 / m[1];
  law.count_offset = variance / (m[1] * m[1]);

  // Computes mean and variance of the sum of delta^2 over the snaps within a distance D after a snap;
  // energies follow from it. Both are linear in D and follow from the moments of Y = delta^2 - c delta, c =
  // m2 / m1 (core/MODEL.md, "Jumps").
  const double c = m[2] / m[1];
  const double y2 = m[4] - 2.0 * c * m[3] + c * c * m[2];
  const double dy = m[3] - c * m[2];
  const double dy2 = m[5] - 2.0 * c * m[4] + c * c * m[3];
  law.squares_per_length = c;
  law.squares_offset = -dy / m[1];
  law.variance_per_length = y2 / m[1];
  law.variance_offset = (dy / m[1]) * (dy / m[1]) - (dy2 - law.variance_per_length * m[2]) / m[1];

  // Computes the constants by which a bristle jumps over k snaps at once.
  law.deviation = std::sqrt(variance);
  law.square_mean = m[2];
}

void fill_narrow_jumps(const double (&m)[6], double cv, KernelLaw& law) noexcept {
  const double variance = std::max(m[2] - m[1] * m[1], 0.0);
  const double third = m[3] - 3.0 * m[1] * variance - m[1] * m[1] * m[1];
  const double fourth = m[4] - 4.0 * m[1] * m[3] + 6.0 * m[1] * m[1] * m[2] - 3.0 * m[1] * m[1] * m[1] * m[1];
  // Takes the sum of lengths as normally distributed at a spread of 2e-3 or less. The differences of higher
  // moments would have errors of 1e-16 / cv^4 there.
  if (cv > 2e-3) {
    law.skewness = third / (variance * law.deviation);
    law.kurtosis = fourth / (variance * variance) - 3.0;
  }
  law.square_slope = cv > 1e-5 ? (m[3] - m[2] * m[1]) / variance : 2.0 * m[1];
  law.square_residual =
      cv > 2e-3 ? std::max(m[4] - m[2] * m[2] - law.square_slope * law.square_slope * variance, 0.0) : 0.0;
  // Finds the shortest path on which bristles may jump. On it a jump has at least 3 snaps, and exceeds the
  // path only three times in a million.
  double from = 3.0 * m[1];
  for (int i = 0; i < 20; ++i) from = 3.0 * m[1] + 4.5 * law.deviation * std::sqrt(from * law.inverse_mean);
  law.jump_from = from;
  law.stationary_from = std::max(0.5 / (cv * cv), 16.0) * m[1];
}

std::shared_ptr<const CompiledMaterial> compile_material(const Material& material) {
  material.validate();
  auto compiled = std::make_shared<CompiledMaterial>();
  CompiledMaterial& c = *compiled;
  c.material = material;
  make_zeros_positive(c.material);
  const SnapLength& length = material.snap_length;

  int exponent = 0;
  const double mantissa = std::frexp(length.mean(), &exponent);  // mantissa is in [0.5, 1)
  c.metres_per_length = std::ldexp(1.0, mantissa < 0.7071067811865476 ? exponent - 1 : exponent);
  const double per_metre = 1.0 / c.metres_per_length;
  c.lengths_per_metre = per_metre;
  c.longest = length.longest() * per_metre;
  c.shortest = shortest_scaled;
  c.residual = material.residual_length * per_metre;
  c.snap_rate = material.snap_rate() * c.metres_per_length;
  const double renewals = material.shared_renewal * c.snap_rate * length.mean() * per_metre;
  if (renewals > most_renewals)
    refuse("Material", "shared_renewal", material.shared_renewal,
           "less: with so many bristles of next to no length each snap renews others that snap at once, and "
           "nearly no friction is left (or make the lengths longer)");
  const double kinetic = material.snap_rule == SnapRule::slide
                             ? 1.0 - material.drop
                             : kinetic_deflection(length, material.snap_rule, material.shared_renewal);
  c.kinetic = c.residual + kinetic * length.mean() * per_metre;
  c.single_length = length.law() == SnapLaw::single;
  c.redraw = material.snap_rule == SnapRule::redraw && length.cv() > negligible_cv;
  // Counts every bristle at its static limit for the force limit if the rule has a drop. After rests between
  // short slides all bristles may reach it at once, more than in first loading.
  c.peak_coefficient = material.snap_rule == SnapRule::slide
                           ? material.kinetic_coefficient() / (1.0 - material.drop)
                           : material.peak_coefficient();
  c.hash = hash_material(c.material);
  // Is always true, because every law limits the ratio of its longest to its mean length.
  BRISTLE_ASSERT(c.longest <= longest_scaled_length);
  if (material.ageing_strength != 0.0)
    for (int k = 0; k < spread_size; ++k)
      c.spread.push_back(std::clamp(length.quantile(spread_share(k)) * per_metre, c.shortest, c.longest));
  return compiled;
}

std::shared_ptr<const Strata> CompiledMaterial::strata(std::uint32_t n) const {
  const std::lock_guard lock(strata_lock_);
  std::shared_ptr<const Strata>& made = strata_[n];
  if (made == nullptr) made = std::make_shared<const Strata>(make_strata(material.snap_length, n));
  return made;
}

void CompiledMaterial::make_sampling_tables() const {
  // Makes no tables for wider laws. Only Population::infinite takes those
  // (Material::validate_for_representatives), and it samples no lengths.
  if (!redraw || material.snap_length.cv() > widest_redraw_cv) return;
  std::call_once(sampling_made_, [this] { fill_sampling_tables(); });
}

void CompiledMaterial::fill_sampling_tables() const {
  const SnapLength& length = material.snap_length;
  const double per_metre = lengths_per_metre;
  law.shortest = shortest;
  law.longest = longest;
  const double first = length.first_parameter();
  const double second = length.second_parameter();
  switch (length.law()) {
    case SnapLaw::uniform:
      law.kind = law_uniform;
      law.location = first * per_metre;
      law.scale = (second - first) * per_metre;
      law.biased_location = law.location * law.location;
      law.biased_scale = second * per_metre * second * per_metre - law.biased_location;
      // Keeps sampled lengths above 0. A bristle of length 0 would snap without end.
      law.shortest = std::max(law.location, smallest_share * law.scale);
      break;
    case SnapLaw::normal:
      law.kind = law_normal;
      table = CellTable(length, per_metre, shortest, longest).write();
      break;
    case SnapLaw::lognormal: {
      law.kind = law_lognormal;
      table = CellTable(length, per_metre, shortest, longest).write();
      // Gives the length-biased law in closed form: lognormal lengths picked in proportion to their length
      // have a lognormal law of equal cv, whose mean is 1 + cv^2 times as large.
      const SnapLength biased = SnapLength::lognormal(1.0, second);
      const double mean = first * per_metre * (1.0 + second * second);
      biased_table = CellTable(biased, mean, shortest, longest).write();
      break;
    }
    case SnapLaw::exponential:
      law.kind = law_exponential;
      law.location = first * per_metre;
      law.biased_location = law.location;
      break;
    case SnapLaw::single:
    case SnapLaw::table:
      law.kind = law_table;
      for (double x : length.table_values()) table.push_back(x * per_metre);
      law.table_last = static_cast<std::int32_t>(table.size()) - 1;
      break;
  }
  if (law.kind == law_normal || law.kind == law_table) {
    biased_table = biased_quantiles(length, per_metre);
    law.biased_last = biased_knots;
  }
  law.table = table.data();
  law.biased_table = biased_table.data();
  fill_renewal_constants(length, per_metre, law);
  assert_law(*this);
}

}  // namespace bristle::detail
