// Measures the library's speed targets, each in a short run of its own. Loops whose ratio is a target run
// alternately.
#include <algorithm>
#include <cstring>
#include <memory>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "bench/hand_scene.hpp"
#include "bench/lanes_scene.hpp"
#include "bench/plain_loops.hpp"
#include "bench/timing.hpp"

#include "tools/libraries/capacity/capacity.hpp"
#include "tools/libraries/capacity/subject.hpp"
#include "tools/libraries/platform/platform.hpp"
#include "tools/libraries/run/paced_clock.hpp"
#include "tools/libraries/scene/snap_law.hpp"

namespace cli {
namespace {

using bristle::Outputs;
using bristle::SnapLength;
using bristle::SnapRule;
using bristle_bench::HandPath;
using bristle_bench::HandScene;

constexpr std::uint64_t in_cache = 14'400;
constexpr std::uint64_t a_million = 1'000'000;
constexpr std::uint64_t out_of_cache = 4'000'000;
constexpr std::uint64_t ten_thousand = 10'000;

class Targets {
 public:
  Targets(const CapacityOptions& options, const Report& report) : options_(options), report_(report) {}

  std::vector<TargetRow> run() {
    in_cache_times();
    rest_and_tremor();
    any_speed();
    hands();
    if (bristle::plain::plain_loops_run_here()) against_plain_loops();
    against_streaming();
    many_patches();
    lanes();
    infinite_steps();
    spinning();
#if BRISTLE_WITH_TBB
    if (std::thread::hardware_concurrency() >= 2) {
      lanes_tick();
      two_threads();
      whole_ticks();
    }
#endif
    return std::move(rows_);
  }

 private:
  std::uint64_t rounds() const { return options_.quick ? 15 : 61; }

  static CapacityCase make(Regime regime, SnapRule rule, Outputs outputs) { return {regime, rule, outputs}; }

  static CapacityCase of_uniform_lengths(CapacityCase what) {
    what.default_material = false;
    return what;
  }

  /// Adds the step time of a case to the list of speed targets, as ns per bristle or us per step.
  void add_time(const char* name, const CapacityCase& what, std::uint64_t bristles, double limit,
                const char* unit, std::string text) {
    report_(name);
    const ComparisonRow row =
        compare({bristle_kernel(what, bristles, options_.isa)}, name, bristles, rounds()).front();
    const bool per_bristle = std::string_view(unit) == "ns";
    const double scale = per_bristle ? 1.0 : 1e-3 * static_cast<double>(bristles);
    rows_.push_back(
        {name, std::move(text), scale * row.ns, limit, false, per_bristle ? "ns per bristle" : "us a step"});
  }

  /// Adds the ratio of the first loop's time to the second's to the list of speed targets.
  void add_ratio(const char* name, Contestant first, Contestant second, std::uint64_t bristles, double limit,
                 bool at_least, std::string text) {
    report_(name);
    const ComparisonRow row = compare({std::move(second), std::move(first)}, name, bristles, rounds()).back();
    rows_.push_back({name, std::move(text), row.ratio, limit, at_least, "x"});
  }

  void in_cache_times() {
    add_time("in_cache/few_snap", make(Regime::presliding, SnapRule::keep, Outputs::end), in_cache, 0.20,
             "ns", "14,400 bristles, keep, end, presliding");
    add_time("in_cache/all_snap", make(Regime::sliding, SnapRule::keep, Outputs::mean), in_cache, 0.55, "ns",
             "14,400 bristles, keep, end + mean, all snap");
    add_time("in_cache/redraw_one_snap", make(Regime::one_snap, SnapRule::redraw, Outputs::mean), in_cache,
             1.0, "ns", "14,400 bristles, redraw, end + mean, one snap");
    add_time("tick/900", make(Regime::presliding, SnapRule::keep, Outputs::end), 900, 0.5, "us",
             "900 bristles, keep, end, presliding; the whole call");
  }

  void rest_and_tremor() {
    const CapacityCase rest = make(Regime::rest, SnapRule::keep, Outputs::end);
    add_time("stuck/no_motion", rest, a_million, 0.2, "us", "a million bristles, no motion");
    CapacityCase within = make(Regime::tremor, SnapRule::keep, Outputs::end);
    within.step = 1e-4;
    add_time("stuck/within_bound", within, a_million, 0.2, "us",
             "a million bristles, to and fro by 0.0001, within the patch's bound");
    const CapacityCase tremor = make(Regime::tremor, SnapRule::keep, Outputs::end);
    CapacityCase eager = tremor;
    eager.eager = true;
    add_ratio("stuck/tremor", settled(tremor), bristle_kernel(eager, a_million, options_.isa), a_million,
              0.01, false,
              "a million bristles, tremor of 0.05 after sliding: time over that of visiting all");
  }

  /// Makes a loop that only copies motions and responses, the least that any caller of a step has to read and
  /// write.
  static Contestant copy_of_messages(std::uint64_t patches) {
    struct Messages {
      explicit Messages(std::uint64_t count) : motions(count), responses(count) {}
      std::vector<bristle::Motion> motions;
      std::vector<bristle::Response> responses;
    };
    auto from = std::make_shared<Messages>(patches), to = std::make_shared<Messages>(patches);
    return {"memcpy of the motions and responses",
            [from, to] {
              const auto copy = [](auto& into, const auto& source) {
                std::memcpy(static_cast<void*>(into.data()), source.data(),
                            source.size() * sizeof source.front());
              };
              copy(to->motions, from->motions);
              copy(to->responses, from->responses);
              return to->responses.back().end[0];
            },
            {}};
  }

  void many_patches() {
    CapacityCase resting = make(Regime::rest, SnapRule::keep, Outputs::end);
    resting.patch_bristles = 100;
    add_ratio(
        "batch/resting", bristle_kernel(resting, a_million, options_.isa), copy_of_messages(ten_thousand),
        ten_thousand, 2.0, false,
        "10,000 patches of 100, each named, at rest: time over memcpy of the same motions and responses");
    CapacityCase sliding = make(Regime::sliding, SnapRule::keep, Outputs::mean);
    sliding.patch_bristles = 100;
    auto hundred = std::make_shared<CapacitySubject>(sliding, 100 * 100, options_.isa);
    Contestant in_turn{"the same patches, 100 at a time",
                       [hundred] {
                         for (std::uint64_t i = 0; i < ten_thousand / 100; ++i) hundred->step();
                         return 0.0;
                       },
                       {}};
    add_ratio("batch/out_of_cache", bristle_kernel(sliding, a_million, options_.isa), std::move(in_turn),
              ten_thousand, 1.6, false,
              "10,000 patches of 100, all snap: time of a patch over that with 100 patches, in cache");
  }

  bristle::BatchOptions batch_options(int threads = 1) const {
    return bristle::BatchOptions{}.with_threads(threads).with_isa(
        options_.isa.empty() ? nullptr : options_.isa.c_str());
  }
  template <class Scene, class... Options>
  static Contestant lane_contestant(const char* name, const Options&... options) {
    auto scene = std::make_shared<Scene>(options...);
    return {name, [scene] { return scene->step(); }, {}};
  }

  /// Compares a group of contacts in lanes with a plain loop of the same physics. Compares contacts at rest,
  /// which are named one by one, with a copy of their motions and responses.
  void lanes() {
    using namespace bristle_bench;
    for (const std::uint32_t springs : {8u, 16u, 32u})
      for (const LanePath path : lane_paths) {
        if (path == LanePath::rest || !bristle::plain::plain_loops_run_here()) continue;
        const char* motion = lane_path_names[static_cast<int>(path)];
        add_ratio(
            fmt::format("lanes/{}/{}", springs, motion).c_str(),
            lane_contestant<LaneGroup>("group", springs, path, batch_options()),
            lane_contestant<LanePlain>("plain loop", springs, path), ten_thousand, 1.6, false,
            fmt::format("a group of 10,000 contacts of {} springs, {}: time over a plain loop of the same "
                        "springs",
                        springs, motion));
      }
    add_ratio("lanes/resting", lane_contestant<LanePatches>("patches", 16u, LanePath::rest, batch_options()),
              copy_of_messages(ten_thousand), ten_thousand, 1.5, false,
              "10,000 contacts of 16 springs, each named, at rest: time over memcpy of the same motions and "
              "responses");
  }

  /// Measures the 99th percentile of the time of a group's steps in a loop of 1 kHz.
  void lanes_tick() {
    using namespace bristle_bench;
    LaneGroup group(16, LanePath::ripple, batch_options(2));
    add_tick("tick/lanes/10000",
             "a group of 10,000 contacts of 16 springs on a bend under a rippling load, two threads", 0.25,
             [&] {
               PacedClock pace(1e-3, 0.0);
               pace.start();
               std::vector<double> ms;
               for (int k = 0; k < (options_.quick ? 200 : 600); ++k) {
                 pace.wait();
                 ms.push_back(1e3 * time_of([&] { group.step(); }, 1));
               }
               return std::pair(quantile(ms, 0.5), quantile(ms, 0.99));
             });
  }

  /// Compares a step of one infinite patch with one of 900 representatives: with few snaps, and in sliding at
  /// the most expensive speed.
  void infinite_steps() {
    const CapacityCase brush = make(Regime::presliding, SnapRule::keep, Outputs::end);
    const auto against_900 = [&](const char* name, const CapacityCase& what) {
      report_(name);
      return compare({bristle_kernel(brush, 900, options_.isa), bristle_kernel(what, 1, options_.isa)}, name,
                     1, rounds())
          .back();
    };
    const ComparisonRow stuck =
        against_900("infinite/sticking", of_uniform_lengths(infinite_case(Regime::tremor)));
    rows_.push_back({"infinite/sticking",
                     "infinite brush of uniform lengths, to and fro by 0.05: time over 900 bristles, keep, "
                     "end, presliding",
                     stuck.ratio, 1.0 / 6.0, false, "x"});
    const auto dearest_slide = [&](const char* name, bool default_material, auto is_meant) {
      ComparisonRow worst;
      CapacityCase dearest;
      for (CapacityCase slide : infinite_sliding()) {
        if (!is_meant(*slide.step)) continue;
        if (!default_material) slide = of_uniform_lengths(slide);
        const ComparisonRow row = against_900(name, slide);
        if (row.ratio.median < worst.ratio.median) continue;
        worst = row;
        dearest = slide;
      }
      rows_.push_back(
          {name,
           fmt::format("infinite brush of {}, dearest slide ({}, {:g} mean snap lengths{} a step): time over "
                       "the same 900",
                       default_material ? "the default material" : "uniform lengths", dearest.motion_name(),
                       *dearest.step, dearest.turn > 0.0 ? fmt::format(" and {:g} rad", dearest.turn) : ""),
           worst.ratio, 1.7, false, "x"});
    };
    for (const bool usual : {false, true}) {
      dearest_slide(usual ? "infinite/default/sliding" : "infinite/sliding", usual,
                    [](double step) { return step <= 1.0; });
      dearest_slide(usual ? "infinite/default/far" : "infinite/far", usual,
                    [](double step) { return step > 1.0; });
    }
  }

  void spinning() {
    add_ratio(
        "spin/sliding", brush_disc(0.5, false, options_.isa), lugre_disc(0.5, false), 1, 0.1, false,
        "disc within 1 % of the limit surface, rim 0.5 lengths a step: time over 21 x 21 LuGre elements");
    add_ratio("spin/sticking", brush_disc(0.003, true, options_.isa), lugre_disc(0.003, true), 1, 0.1, false,
              "the same disc, rim to and fro by 0.003: time over 21 x 21 LuGre elements");
  }

  /// Returns a patch that has trembled for 200 steps. All bristles that the first strokes could snap have
  /// snapped by then.
  Contestant settled(const CapacityCase& what) const {
    Contestant contestant = bristle_kernel(what, a_million, options_.isa);
    for (int i = 0; i < 200; ++i) contestant.step();
    return contestant;
  }

  /// Measures each law of snap lengths at the sliding speed that costs most time.
  void any_speed() {
    const double m = mean_snap_length_m;
    const SnapLength uniform = SnapLength::uniform(0.5 * m, 1.5 * m);
    dearest_speed(SnapRule::keep, "uniform", uniform);
    dearest_speed(SnapRule::redraw, "uniform", uniform);
    dearest_speed(SnapRule::redraw, "normal cv 0.2", SnapLength::normal(m, 0.2 * m));
    dearest_speed(SnapRule::redraw, "lognormal cv 0.1", SnapLength::lognormal(m, 0.1));
    dearest_speed(SnapRule::redraw, "lognormal cv 0.3", SnapLength::lognormal(m, 0.3));
    dearest_speed(SnapRule::redraw, "exponential", SnapLength::exponential(m));
    dearest_speed(SnapRule::redraw, "lognormal cv 1", SnapLength::lognormal(m, 1.0));
  }

  void dearest_speed(SnapRule rule, const char* law_name, const SnapLength& law) {
    const std::string name = fmt::format("any_speed/{}/{}", to_string(rule), law_name);
    ComparisonRow worst;
    double worst_step = 0.0;
    for (const double step : {1.0, 2.0, 3.0, 5.0, 8.0, 12.0, 20.0, 30.0, 100.0, 1e3, 1e4}) {
      report_(fmt::format("{}, {:g}", name, step));
      CapacityCase what = make(Regime::far, rule, Outputs::mean);
      what.step = step;
      what.law = law;
      const ComparisonRow row =
          compare({bristle_kernel(what, in_cache, options_.isa)}, name, in_cache, 7).front();
      if (row.ns.median < worst.ns.median) continue;
      worst = row;
      worst_step = step;
    }
    rows_.push_back(
        {name, fmt::format("14,400 bristles, end + mean, dearest step: {:g} mean snap lengths", worst_step),
         worst.ns, 3.5, false, "ns per bristle"});
  }

  /// Measures the default material on recorded paths of hands. Takes the ratio of its time to that on a
  /// straight path of equal speed. Where path and speed cost most, also takes the ratio to the time of the
  /// rule `keep` on the same path.
  void hands() {
    using bristle::Material;
    const Material usual = Material::from_coefficients({});
    Material keep = Material::from_coefficients(bristle::Coefficients::paper());
    keep.snap_rule = SnapRule::keep;
    const auto scene = [this](const Material& material, const HandPath& path, double mm_per_s) {
      auto made = std::make_shared<HandScene>(material, path, mm_per_s, batch_options());
      return Contestant{path.name, [made] { return static_cast<double>(made->step().bristles_visited); }, {}};
    };
    const auto add = [&](const std::string& name, double limit, const std::string& over, auto is_meant,
                         auto other) {
      TargetRow worst{name, "", {}, limit, false, "x"};
      for (const HandPath& path : bristle_bench::hand_paths)
        for (const double mm_per_s : {1.0, 3.0, 10.0, 30.0, 100.0}) {
          if (!is_meant(path)) continue;
          report_(fmt::format("{}, {}, {:g} mm/s", name, path.name, mm_per_s));
          const ComparisonRow row =
              compare({other(path, mm_per_s), scene(usual, path, mm_per_s)}, name, HandScene::bristles, 7)
                  .back();
          if (row.ratio.median < worst.measured.median) continue;
          worst.measured = row.ratio;
          worst.what = fmt::format(
              "10,000 bristles of the default material, dearest path ({}, {:g} mm/s): time over {}",
              path.name, mm_per_s, over);
        }
      rows_.push_back(worst);
    };
    const auto straight = [&](const HandPath&, double mm_per_s) {
      return scene(usual, bristle_bench::straight_path, mm_per_s);
    };
    const auto kept = [&](const HandPath& path, double mm_per_s) { return scene(keep, path, mm_per_s); };
    add(
        "hand/turn", 2.0, "the straight path", [](const HandPath& p) { return p.turn + p.wander > 0.0; },
        straight);
    add(
        "hand/strokes", 2.0, "the straight path", [](const HandPath& p) { return p.stroke > 0; }, straight);
    add(
        "hand/ripple", 2.0, "the straight path", [](const HandPath& p) { return p.ripple > 0.0; }, straight);
    add(
        "hand/over_keep", 4.0, "keep, the paper's material, on the same path",
        [](const HandPath&) { return true; }, kept);
  }

  /// Adds, for each kind of motion, the ratio of the faster plain loop's time to the library's.
  void against_plain_loops() {
    report_("plain loops");
    CapacityOptions quick = options_;
    quick.quick = true;
    std::vector<TargetRow> rows;
    for (const ComparisonRow& loop : compare_loops(quick)) {
      if (loop.what.rfind("plain arrays", 0) != 0) continue;
      std::string name = fmt::format("plain_loop/{}/{}", loop.regime, loop.bristles);
      std::replace(name.begin(), name.end(), ' ', '_');
      const auto same =
          std::find_if(rows.begin(), rows.end(), [&](const TargetRow& row) { return row.name == name; });
      if (same != rows.end() && same->measured.median <= loop.ratio.median) continue;
      if (same != rows.end()) rows.erase(same);
      rows.push_back({name, fmt::format("the better plain loop ({}): its time over ours", loop.what),
                      loop.ratio, 1.0, true, "x"});
    }
    rows_.insert(rows_.end(), rows.begin(), rows.end());
  }

  void against_streaming() {
    CapacityCase what = make(Regime::presliding, SnapRule::keep, Outputs::end);
    add_ratio("streaming/few_snap", bristle_kernel(what, out_of_cache, options_.isa),
              stream_loop(what, out_of_cache), out_of_cache, 1.3, false,
              "4,000,000 bristles, keep, end, presliding: time over that of streaming the same bytes");
    what.eager = true;
    add_ratio("streaming/few_snap_eager", bristle_kernel(what, out_of_cache, options_.isa),
              stream_loop(what, out_of_cache), out_of_cache, 1.3, false, "the same, every bristle visited");
  }

  /// Adds the speed-up by a second thread to the speed targets: the step time with one thread over that with
  /// two, of steps back to back or `paced`, one a millisecond.
  void add_sharing(std::uint64_t bristles, double limit, bool paced) {
    const std::string name = fmt::format("threads/{}/{}", paced ? "paced" : "back_to_back", bristles);
    report_(name);
    CapacityCase what = make(Regime::sliding, SnapRule::keep, Outputs::mean);
    CapacitySubject one(what, bristles, options_.isa);
    what.threads = 2;
    CapacitySubject two(what, bristles, options_.isa);
    const auto median = [&](CapacitySubject& subject) {
      const auto step = [&] { subject.step(); };
      if (!paced) return bristle_bench::median_time(step, 4, 11, [] {});
      PacedClock pace(1e-3, 0.0);
      pace.start();
      return bristle_bench::median_time(step, 10, 50, [&] { pace.wait(); });
    };
    std::vector<double> ratios;
    for (std::uint64_t round = paced ? rounds() * 3 / 4 : 0; round < rounds(); ++round)
      ratios.push_back(median(one) / median(two));
    rows_.push_back({name,
                     fmt::format("{} bristles, keep, end + mean, all snap, {}: one thread over two", bristles,
                                 paced ? "1 kHz loop" : "back to back"),
                     quartiles(ratios), limit, true, "x"});
  }

  void two_threads() {
    for (const std::uint64_t n : {std::uint64_t{200'000}, a_million}) add_sharing(n, 1.8, false);
    add_sharing(200'000, 1.5, true);
    add_sharing(a_million, 1.8, true);
  }

  /// Adds the 99th percentile of the time of steps that must fit a tick to the speed targets. `times` returns
  /// median and 99th percentile of a run, ms.
  template <class Times>
  void add_tick(const char* name, const char* text, double limit_ms, const Times& times) {
    report_(name);
    std::vector<double> p50, p99;
    for (int round = 0; round < 3; ++round) {
      const auto [median, late] = times();
      p50.push_back(median);
      p99.push_back(late);
    }
    // Takes the best of the runs, because other programs disturbed the others.
    rows_.push_back({name,
                     text,
                     {quantile(p99, 0.0), quantile(p50, 0.0), quantile(p99, 1.0)},
                     limit_ms,
                     false,
                     "ms at p99"});
  }

  /// Measures the 99th percentile of the time of steps that must fit a tick of 1 ms on two cores.
  void whole_ticks() {
    const auto add = [&](const char* name, CapacityCase what, std::uint64_t bristles, const char* text) {
      what.threads = 2;
      CapacitySubject subject(what, bristles, options_.isa);
      add_tick(name, text, 1.0, [&] {
        const StepTimes times = time_steps(subject, options_.quick ? 200 : 600);
        return std::pair(1e3 * times.p50_s, 1e3 * times.p99_s);
      });
    };
    add("tick/all_snap/2000000", make(Regime::sliding, SnapRule::keep, Outputs::mean), 2'000'000,
        "2,000,000 bristles, keep, end + mean, all snap, two threads");
    add("tick/redraw/1200000", make(Regime::one_snap, SnapRule::redraw, Outputs::mean), 1'200'000,
        "1,200,000 bristles, redraw, end + mean, up to two snaps, two threads");
    add("tick/presliding/4000000", make(Regime::presliding, SnapRule::keep, Outputs::end), 4'000'000,
        "4,000,000 bristles, keep, end, presliding, two threads");
    CapacityCase patches = make(Regime::sliding, SnapRule::keep, Outputs::mean);
    patches.patch_bristles = 100;
    add("tick/patches/10000", patches, a_million,
        "10,000 patches of 100, keep, end + mean, all snap, two threads");
    CapacityCase zigzag = of_uniform_lengths(contacts(coarse_resolution, 2));
    zigzag.zigzag = true;
    add("tick/infinite/10000", zigzag, ten_thousand,
        "10,000 infinite patches of uniform lengths within 1 % of the force, zigzag of 0.1 mean snap lengths "
        "a step, two threads");
  }

  const CapacityOptions& options_;
  const Report& report_;
  std::vector<TargetRow> rows_;
};

}  // namespace

std::vector<TargetRow> measure_targets(const CapacityOptions& options, const Report& report) {
  return Targets(options, report).run();
}

}  // namespace cli
