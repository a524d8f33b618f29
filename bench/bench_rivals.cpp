// Compares bristle, in one run, with what it replaces (the loop of the paper by Zhang and Phillips, and plain
// loops), and with the time that it takes to stream the same bytes.
#include "bench/plain_loops.hpp"
#include "measured_scene.hpp"
#include "suites.hpp"

namespace bristle_bench {

namespace {

/// Adds a benchmark of a plain loop, which the motions of bristle's patch bring into the same regime.
template <class Loop, class Make>
void add_loop_benchmark(const std::string& name, const Regime& regime, double bytes_per_bristle, Make make) {
  add_benchmark(name, [=](benchmark::State& state) {
    const double x = usual_axes == 1 ? 1.0 : 0.8;
    const double y = usual_axes == 1 ? 0.0 : 0.6;
    bool back = false;
    const auto move = [&](Loop& loop, double step, bool across = false) {
      benchmark::DoNotOptimize(loop.step(step * (across ? y : x) * dbar, step * (across ? -x : y) * dbar));
      benchmark::ClobberMemory();
    };
    const auto next = [&](Loop& loop) {
      move(loop, back && regime.there_and_back ? -regime.step : regime.step, back && regime.zigzag);
      back = (regime.there_and_back || regime.zigzag) && !back;
    };
    Loop& loop = keep_while_named<Loop>(name, [&] {
      auto made = make();
      bring_to_steady_state(
          usual_settling, [&] { move(*made, usual_settling.slide); }, [&] { next(*made); });
      return made;
    });
    measure(state, loop.size(), bytes_per_bristle, [&] { next(loop); });
    state.SetLabel(regime.motion);
  });
}

void add_stream_benchmark(const std::string& name, std::uint32_t n, int read, int written) {
  using bristle::plain::StreamLoop;
  add_benchmark(name, [=](benchmark::State& state) {
    auto& loop =
        keep_while_named<StreamLoop>(name, [&] { return std::make_shared<StreamLoop>(n, read, written); });
    measure(state, n, static_cast<double>(loop.bytes()) / n, [&] { benchmark::DoNotOptimize(loop.step()); });
    state.SetLabel("streams what a step must read and write");
  });
}

void register_group(const Regime& regime, SnapRule rule, bool mean, std::uint32_t n) {
  using namespace bristle::plain;
  const std::string group = std::string("rivals/") + regime.name + '/' + name_of(rule) +
                            (mean ? "_mean" : "_end") + '/' + std::to_string(n) + '/';
  const double bytes = least_bytes(regime, rule, usual_axes, Precision::single);

  OnePatchCase ours;
  ours.regime = regime;
  ours.rule = rule;
  ours.outputs = mean ? Outputs::mean : Outputs::end;
  ours.bristles = n;
  add_one_patch_benchmark(group + "bristle", ours);

  for (Style style : {Style::one_loop, Style::chunked}) {
    PlainOptions options;
    options.bristles = n;
    options.mean_snap_length_m = dbar;
    options.axes = usual_axes;
    options.rule = rule == SnapRule::keep ? Rule::keep : Rule::redraw;
    options.mean = mean;
    options.style = style;
    add_loop_benchmark<PlainLoop>(group + (style == Style::one_loop ? "plain" : "plain_chunked"), regime,
                                  bytes, [=] { return std::make_shared<PlainLoop>(options); });
  }

  if (rule == SnapRule::keep && !mean) {
    // Adds the paper's loop, which resets a bristle beyond its length: less work, and a wrong force.
    add_loop_benchmark<PaperLoop<double, 3>>(group + "paper_double3", regime, 0.0, [=] {
      return std::make_shared<PaperLoop<double, 3>>(n, dbar, 1.0, 0.1);
    });
    add_loop_benchmark<PaperLoop<float, 2>>(group + "paper_float2", regime, 0.0, [=] {
      return std::make_shared<PaperLoop<float, 2>>(n, dbar, 1.0, 0.1);
    });
  }

  // Streams as many columns as bristle does in this regime. It reads deflections and snap lengths, and writes
  // deflections where bristles snap; with redraw, where all snap, also snap lengths and draw numbers.
  const bool snaps = !regime.there_and_back;
  const bool draws = rule == SnapRule::redraw && regime.step > 0.1;
  const int read = usual_axes + 1 + (draws ? 1 : 0);
  const int written = !snaps ? 0 : draws ? read : usual_axes;
  add_stream_benchmark(group + "stream", n, read, written);
}

/// Registers bristles that slide at their limit (SnapRule::slide), beside bristles that all snap
/// (SnapRule::keep), and beside a plain loop.
void register_slide(bool zigzag) {
  if (BRISTLE_MINIMAL) return;
  constexpr std::uint32_t n = 14400;
  Regime regime = all_snap;
  regime.zigzag = zigzag;
  regime.motion = zigzag ? "1.5 dbar a step in zigzag" : "1.5 dbar a step one way";
  const std::string group = std::string("rivals/all_slide/") + (zigzag ? "zigzag" : "straight") + '/';
  OnePatchCase ours;
  ours.regime = regime;
  ours.bristles = n;
  for (const int axes : {2, 1})
    for (const Outputs outputs : {Outputs::end, Outputs::mean})
      for (const SnapRule rule : {SnapRule::keep, SnapRule::slide}) {
        if (zigzag && axes == 1) continue;
        ours.axes = axes;
        ours.outputs = outputs;
        ours.rule = rule;
        add_one_patch_benchmark(group + (rule == SnapRule::keep ? "keep" : "bristle") +
                                    (outputs == Outputs::mean ? "_mean" : "") +
                                    (axes == 1 ? "_one_axis" : ""),
                                ours);
      }
  add_loop_benchmark<bristle::plain::SlideLoop>(
      group + "plain", regime, 0.0, [n] { return std::make_shared<bristle::plain::SlideLoop>(n, dbar); });
}

}  // namespace

void register_rivals() {
  if (!bristle::plain::plain_loops_run_here()) return;
  for (bool zigzag : {false, true}) register_slide(zigzag);
  for (const Regime& regime : {stick, presliding, two_snaps, all_snap}) {
    for (SnapRule rule : rules()) {
      for (bool mean : {false, true}) {
        if (mean && BRISTLE_MINIMAL) continue;
        for (std::uint32_t n : {900u, 4096u, 262144u, 2000000u}) register_group(regime, rule, mean, n);
      }
    }
  }
}

}  // namespace bristle_bench
