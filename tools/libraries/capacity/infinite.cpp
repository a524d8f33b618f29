// Measures the step time of patches of infinitely many bristles (one alone, 100 together, 10,000 together),
// and how many of them meet a deadline.
#include <numbers>

#include <fmt/format.h>

#include "tools/libraries/capacity/capacity.hpp"
#include "tools/libraries/capacity/subject.hpp"

namespace cli {
namespace {

constexpr double right_angle = std::numbers::pi / 2.0;
// Default resolution of the library, in pieces of path per mean snap length.
constexpr double default_resolution = 8.0;

InfiniteRow one_patch(const CapacityCase& what, const CapacityOptions& options) {
  InfiniteRow row;
  row.patches = 1;
  row.ns_per_patch =
      compare({bristle_kernel(what, 1, options.isa)}, "", 1, options.quick ? 15 : 61).front().ns;
  CapacitySubject subject(what, 1, options.isa);
  row.p99_s = time_steps(subject, options.quick ? 20'000 : 200'000).p99_s;
  return row;
}

InfiniteRow many_patches(const CapacityCase& what, std::uint64_t patches, const CapacityOptions& options) {
  CapacitySubject subject(what, patches, options.isa);
  InfiniteRow row;
  row.patches = patches;
  row.p99_s = time_steps(subject, options.quick ? 300 : 1000).p99_s;
  const double to_ns = 1e9 / static_cast<double>(patches);
  std::vector<double> ns;
  for (int i = 0; i < (options.quick ? 15 : 61); ++i) ns.push_back(to_ns * time_steps(subject, 1).p50_s);
  row.ns_per_patch = quartiles(ns);
  return row;
}

}  // namespace

CapacityCase infinite_case(Regime regime, std::optional<double> step) {
  CapacityCase what{regime, bristle::SnapRule::redraw, bristle::Outputs::end};
  what.population = bristle::Population::infinite;
  what.default_material = true;
  what.step = step;
  return what;
}

std::vector<CapacityCase> infinite_sliding() {
  std::vector<CapacityCase> cases;
  for (const bool zigzag : {false, true})
    for (const double step : {0.003, 0.1, 1.0, 2.0, 4.0, 8.0, 100.0}) {
      cases.push_back(infinite_case(Regime::sliding, step));
      cases.back().zigzag = zigzag;
    }
  const auto add = [&](double step, double turn, double ripple, bool either_side = false) {
    cases.push_back(infinite_case(Regime::sliding, step));
    cases.back().turn = turn;
    cases.back().ripple = ripple;
    cases.back().either_side = either_side;
  };
  add(0.1, 0.0, 0.01);
  for (const double turn : {0.01, 0.1})
    for (const double ripple : {0.0, 0.01}) add(0.1, turn, ripple);
  for (const double step : {0.1, 2.0}) {
    add(step, right_angle, 0.0, true);
    add(step, right_angle, 0.0);
  }
  return cases;
}

std::vector<InfiniteRow> measure_infinite(const CapacityOptions& options, const Report& report) {
  std::vector<CapacityCase> cases = {infinite_case(Regime::rest), infinite_case(Regime::tremor)};
  for (const CapacityCase& slide : infinite_sliding())
    if (!options.quick || *slide.step == 0.1 || slide.turn > 0.0 ||
        (!slide.zigzag && (*slide.step == 1.0 || *slide.step == 100.0)))
      cases.push_back(slide);
  std::vector<InfiniteRow> rows;
  for (const CapacityCase& what : cases) {
    report(fmt::format("infinite patches, {}", what.motion_name()));
    const bristle::PatchInfo info = CapacitySubject(what, 1, options.isa).info();
    for (const std::uint64_t patches : {1, 100, 10'000}) {
      if (options.quick && patches > 100) break;
      InfiniteRow row = patches == 1 ? one_patch(what, options) : many_patches(what, patches, options);
      row.what = what;
      row.resolution = info.representatives;
      row.bytes_per_patch = info.memory_bytes;
      rows.push_back(row);
    }
  }
  return rows;
}

CapacityCase contacts(double resolution, int threads) {
  CapacityCase what = infinite_case(Regime::sliding, 0.1);
  what.resolution = resolution;
  what.threads = threads;
  return what;
}

std::vector<CapacityRow> measure_contacts(const CapacityOptions& options, const std::vector<int>& threads,
                                          const Report& report) {
  std::vector<CapacityRow> rows;
  for (const int count : threads) {
    if (options.quick && count != threads.front()) break;
    for (const double resolution : {coarse_resolution, default_resolution}) {
      report(fmt::format("sliding contacts, resolution {:g}, threads: {}", resolution, count));
      CapacityCase corners = contacts(resolution, count), bend = corners;
      corners.turn = right_angle;
      corners.either_side = true;
      bend.turn = bend.ripple = 0.01;
      for (const CapacityCase& what : {corners, bend}) rows.push_back(find_capacity(what, options));
    }
  }
  return rows;
}

}  // namespace cli
