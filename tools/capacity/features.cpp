// Measures the cost of each kernel feature, interleaved with the least kernel that there is.
#include <iterator>

#include "tools/capacity/capacity.hpp"
#include "tools/capacity/subject.hpp"

namespace cli {
namespace {

using bristle::Outputs;
using bristle::Precision;
using bristle::SnapRule;

constexpr std::uint64_t bristles = 14'400;

struct Feature {
  const char* name;
  CapacityCase what;
};

std::vector<Feature> features(Regime regime) {
  const CapacityCase least{regime, SnapRule::keep, Outputs::end, 1};
  std::vector<Feature> all;
  const auto add = [&](const char* name) -> CapacityCase& {
    return all.emplace_back(Feature{name, least}).what;
  };
  add("none");
#if !BRISTLE_MINIMAL
  add("second axis").axes = 2;
  add("redraw").rule = SnapRule::redraw;
  add("mean force").outputs = Outputs::mean;
  add("energy").outputs = Outputs::energy;
#if BRISTLE_WITH_DOUBLE
  add("double precision").precision = Precision::double_;
#endif
  CapacityCase& all_of_them = add("all of them");
  all_of_them.axes = 2;
  all_of_them.rule = SnapRule::redraw;
  all_of_them.outputs = Outputs::all;
#if BRISTLE_WITH_DOUBLE
  all_of_them.precision = Precision::double_;
#endif
#endif
  return all;
}

}  // namespace

std::vector<FeatureRow> measure_features(const CapacityOptions& options, const Report& report) {
  std::vector<FeatureRow> rows;
  for (const Regime regime : {Regime::presliding, Regime::one_snap, Regime::sliding}) {
    report(std::string("features, ") + to_string(regime));
    const std::vector<Feature> all = features(regime);
    std::vector<Contestant> contestants;
    for (const Feature& feature : all)
      contestants.push_back(bristle_kernel(feature.what, bristles, options.isa));
    const std::vector<ComparisonRow> times =
        compare(std::move(contestants), to_string(regime), bristles, options.quick ? 15 : 61);
    for (std::size_t i = 0; i < all.size(); ++i) {
      const CapacitySubject small(all[i].what, 256, options.isa);
      rows.push_back({to_string(regime), all[i].name, all[i].what.kernel_name(),
                      small.info().bytes_per_bristle, times[i].ns_per_bristle, times[i].ratio,
                      times[i].ratio_low, times[i].ratio_high});
    }
  }
  return rows;
}

}  // namespace cli
