#include "tools/products/virtual_room/run.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <thread>

#include <fmt/format.h>

#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/reports/progress.hpp"
#include "tools/libraries/reports/table.hpp"

namespace room {
namespace {

// Largest number of ticks run at once, so that their plot points have room in the exchange.
constexpr std::uint64_t most_ticks_at_once = 1000;

/// Summary of all ticks of a run without a window (highest forces and so on), which is printed as a table.
struct Summary {
  double highest_friction = 0.0, highest_applied = 0.0, highest_device_force = 0.0;  // N, of all ticks

  // Largest displacement of the block along its motion, in either direction, m.
  double farthest = 0.0;
  std::string last_message;

  void take(Exchange& exchange, const DrawFrame& draw) {
    PlotPoint p;
    while (exchange.plot.pop(p)) {
      if (draw.see) draw.see(p);
      highest_friction = std::max(highest_friction, std::fabs(static_cast<double>(p.friction)));
      highest_applied = std::max(highest_applied, std::fabs(static_cast<double>(p.applied)));
      farthest = std::max(farthest, std::fabs(static_cast<double>(p.displacement)));
    }
    if (!exchange.room.refresh()) return;
    const Snapshot& s = exchange.room.latest();
    const double* f = s.device_force;
    highest_device_force = std::max(highest_device_force, std::hypot(f[0], f[1], f[2]));
    if (s.message[0] && last_message != s.message) {
      last_message = s.message;
      std::fprintf(stderr, "bristle-room: %.3f s: %s\n", s.time, s.message);
    }
  }
};

std::string micro(double seconds) { return fmt::format("{:.1f} us", 1e6 * seconds); }
std::string milli(double metres) { return fmt::format("{:.6f} mm", 1e3 * metres); }

void print(const Snapshot& s, const Summary& all, const LoopStatistics& loop, std::uint64_t hash,
           bool virtual_clock) {
  constexpr const char* models[] = {"brush", "lugre", "coulomb"};
  cli::Table table({"<", "", "<"});
  const double* p = s.block_position;
  const double tilt = 2.0 * std::acos(std::min(1.0, std::fabs(s.block_orientation[0])));
  table.add(
      {"friction model", models[static_cast<std::size_t>(s.settings.model)],
       fmt::format("kinetic {:g}, peak {:g}, presliding {:g} m, {} bristles a patch", s.settings.kinetic,
                   s.peak_coefficient, s.settings.presliding_length, s.settings.bristles)});
  table.add({"simulated", fmt::format("{:.3f} s", s.time), fmt::format("{} ticks", loop.ticks)});
  table.add({"block", milli(p[0]), fmt::format("along x; y {}, turned by {:.4f} rad", milli(p[1]), tilt)});
  table.add({"farthest", milli(all.farthest), "along its motion"});
  table.add({"friction", fmt::format("{:.4f} N", all.highest_friction), "highest along the motion"});
  table.add(
      {"applied", fmt::format("{:.4f} N", all.highest_applied), "highest of the tool along the motion"});
  table.add(
      {"hand", fmt::format("{:.4f} N", all.highest_device_force), "highest on the device, of the frames"});
  table.add({"tick", micro(loop.p50),
             fmt::format("p50 of its computing; p99 {}, max {}", micro(loop.p99), micro(loop.max))});
  if (!virtual_clock) {
    table.add({"period", micro(loop.period_p50),
               fmt::format("p50; p99 {}, max {}", micro(loop.period_p99), micro(loop.period_max))});
    table.add({"late", fmt::format("{}", loop.late_ours),
               fmt::format("ticks by our own computing, {} by the machine", loop.late_machine)});
  }
  table.add({"state hash", fmt::format("{:016x}", hash), virtual_clock ? "the same in every run" : ""});
  fmt::print("{}", table.text());
}

void run_virtual(const RunOptions& o, HapticLoop& loop, const DrawFrame& draw, Summary& summary) {
  cli::Progress progress("bristle-room");
  const auto ticks = static_cast<std::uint64_t>(std::llround(o.seconds * loop.rate_hz()));
  long frame = 0;
  for (std::uint64_t done = 0; done < ticks;) {
    const auto next_frame = static_cast<std::uint64_t>(
        std::llround(static_cast<double>(frame + 1) * loop.rate_hz() / o.frames_per_second));
    const std::uint64_t until =
        std::min({ticks, draw.draw_frame ? next_frame : ticks, done + most_ticks_at_once});
    loop.advance(until - done);
    done = until;
    summary.take(loop.exchange(), draw);
    if (draw.draw_frame && done == next_frame) draw.draw_frame(loop.exchange().room.latest(), frame++);
    progress.update(static_cast<double>(done) / static_cast<double>(ticks));
  }
}

void run_real(const RunOptions& o, HapticLoop& loop, const DrawFrame& draw, Summary& summary) {
  cli::Progress progress("bristle-room");
  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  loop.start();
  for (long frame = 0;; ++frame) {
    const std::chrono::duration<double> due(static_cast<double>(frame + 1) / o.frames_per_second);
    std::this_thread::sleep_until(start + due);
    summary.take(loop.exchange(), draw);
    if (draw.draw_frame) draw.draw_frame(loop.exchange().room.latest(), frame);
    progress.update(std::min(1.0, due.count() / o.seconds));
    if (due.count() >= o.seconds) break;
  }
  loop.stop();
  summary.take(loop.exchange(), draw);
}

}  // namespace

void run_headless(const RunOptions& options, HapticLoop& loop, const DrawFrame& draw) {
  if (!(options.seconds > 0.0))
    throw cli::UserError("no duration; give --seconds, or a script whose hand moves");
  Summary summary;
  (options.virtual_clock ? run_virtual : run_real)(options, loop, draw, summary);
  loop.finish_recording();
  print(loop.exchange().room.latest(), summary, loop.statistics(), loop.state_hash(), options.virtual_clock);
}

}  // namespace room
