// A loop against the clock: its time grid, the cost of a late tick, and the command line's report on it. The
// results do not depend on how fast or how busy the machine is.
#include <catch2/catch.hpp>

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <map>
#include <sstream>
#include <string>
#include <utility>

#include <nlohmann/json.hpp>

#include "command_line.hpp"
#include "scenes.hpp"
#include "shared_core.hpp"
#include "temporary_folder.hpp"
#include "test_paths.hpp"
#include "tools/libraries/run/paced_clock.hpp"
#include "tools/libraries/run/realtime.hpp"
#include "tools/libraries/run/run.hpp"

namespace bristle_test::test_realtime {

using bristle::DeadlineMonitor;
using nlohmann::json;

namespace {

const std::string stroke = std::string(BRISTLE_SCENES) + "/stroke.toml";

int run_shell(const std::string& command) {
  const int status = std::system(command.c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

json paced_report(const TemporaryFolder& folder, const std::string& options) {
  const std::string file = folder.at("report.json");
  INFO(options);
  REQUIRE(run_shell("'" BRISTLE_CLI "' run '" + stroke + "' --realtime " + options + " --json '" + file +
                    "' > '" + folder.at("out") + "'") == 0);
  return json::parse(read_file(file));
}

}  // namespace

TEST_CASE("A paced clock keeps to its grid, never starts early, and leaves out what has passed",
          "[realtime]") {
  constexpr double period = 2e-3;
  for (double busy_wait : {0.0, 1e-3}) {
    cli::PacedClock clock(period, busy_wait);
    clock.start();
    const double start = clock.due_s();
    // Rounding of times, s: the clock's nanosecond, and the resolution of a double for the time since the
    // machine started.
    const double rounding = 2e-9 + 4.0 * std::numeric_limits<double>::epsilon() * start;
    std::uint64_t points = 0;
    for (int k = 0; k < 40; ++k) {
      const double called = DeadlineMonitor::wall_now();
      const bool overran = k % 8 == 3;
      if (overran) {
        while (DeadlineMonitor::wall_now() < clock.due_s() + 3.4 * period) {
        }
      }
      const std::uint64_t left_out = clock.wait();
      points += 1 + left_out;
      if (overran) CHECK(left_out >= 3);
      // Checks that the next due time is on the time grid, whatever number of ticks was left out.
      CHECK(std::fabs(clock.due_s() - start - static_cast<double>(points) * period) < rounding);
      CHECK(DeadlineMonitor::wall_now() >= clock.due_s() - rounding);
      CHECK(clock.due_s() > called - rounding);  // wait() was called before the due time
    }
  }
}

TEST_CASE("A paced run gives the bits of the same steps back to back, whatever was left out", "[realtime]") {
  cli::Scene scene = cli::read_scene(stroke);
  cli::set_bristles(scene, 3000);
  for (double rate : {2000.0, 50000.0}) {
    cli::RunOptions options;
    options.steps = 300;
    cli::set_rate(scene, rate);
    CHECK(scene.dt == 1.0 / rate);
    CHECK(scene.deadline == scene.dt);
    const cli::RunResult expected = cli::run_scene(scene, options);
    options.realtime.emplace();
    const cli::RunResult paced = cli::run_scene(scene, options);
    CHECK(paced.state_hash == expected.state_hash);
    REQUIRE(paced.realtime);
    CHECK(paced.monitor.count() == 300);
    CHECK(paced.realtime->bare.monitor.count() == 300);
    // Each of four segments of 75 ticks has 74 periods, of which one is left out if the program's own
    // accounting took too long in it.
    CHECK(paced.monitor.period_jitter().count() <= 4 * 74);
    CHECK(paced.realtime->bare.monitor.period_jitter().count() == 4 * 74);
    CHECK(paced.seconds == paced.realtime->ours.seconds);  // the bare loop's time is not included
    CHECK(paced.seconds >= 299.0 / rate - 4.0 / rate);     // each tick starts when due or later
  }
}

TEST_CASE("Steps longer than the period are all late, and cost whole periods instead of a burst",
          "[realtime]") {
  cli::Scene scene = cli::read_scene(stroke);
  cli::set_bristles(scene, 300000);
  cli::set_rate(scene, 100000.0);  // 10 us, too short for 300,000 bristles that slide
  cli::RunOptions options;
  options.steps = 200;
  options.realtime.emplace();
  // Expects that ticks stepped and ticks left out together span the loop's time, because late ticks are not
  // made up for. The machine may stop the loop at a segment's start or end, which this time includes, hence
  // five tries.
  bool spanned = false;
  for (int attempt = 0; attempt < 5 && !spanned; ++attempt) {
    const cli::RunResult result = cli::run_scene(scene, options);
    const DeadlineMonitor& m = result.monitor;
    REQUIRE(m.p50() > 1e-5);
    CHECK(m.misses() > 150);
    CHECK(m.skipped() > m.misses());
    CHECK(m.longest_run() > 100);
    CHECK(m.worst().late);
    CHECK(cli::worst_tick_text(result.realtime->ours, 1).find("after it was due") != std::string::npos);
    const double seconds = result.realtime->ours.seconds;
    const double on_grid = static_cast<double>(m.count() + m.skipped() + result.realtime->held_up) * scene.dt;
    CHECK(on_grid <= seconds + 4.0 * scene.dt);
    spanned = on_grid >= 0.8 * seconds - 5e-3;
  }
  CHECK(spanned);
}

TEST_CASE("The worst tick is told by what was counted in it", "[realtime]") {
  const auto text = [](const bristle::Tick& tick, double queued_s, double stolen_s, int threads = 1) {
    cli::PacedLoopResult loop;
    loop.monitor = DeadlineMonitor(1e-3, 1e-3);
    loop.monitor.record_tick(bristle::Tick{1.0, 1.0, 1.0001, 0.0001});
    loop.monitor.record_tick(tick);
    loop.queued_worst_s = queued_s;
    loop.stolen_worst_s = stolen_s;
    return cli::worst_tick_text(loop, threads);
  };
  const auto has = [](const std::string& all, const char* part) {
    return all.find(part) != std::string::npos;
  };
  CHECK(has(text({2.0, 2.0, 2.0025, 2.4e-3}, 0.0, 0.0), "used more CPU time than the deadline"));
  // If the system counts an event while the test sleeps, such as a page fault, the report names that event.
  // So the test tries up to 100 times for a tick without one.
  std::string woken;
  for (int k = 0; k < 100 && !has(woken, "an interrupt"); ++k)
    woken = text({2.0, 2.0015, 2.0017, 0.2e-3}, 0.0, 0.0);
  CHECK(has(woken, "the machine: woken late"));
  const std::string queued = text({2.0, 2.0015, 2.0017, 0.2e-3}, 1.4e-3, 0.01);
  CHECK(has(queued, "ready for 1.40 ms while others had the core"));
  CHECK(has(queued, "the hypervisor took 10.0 ms"));
  CHECK(has(text({2.0, 2.0, 2.0017, 0.2e-3}, 0.0, 0.0), "off the CPU or waiting for 1.50 ms"));
  CHECK(has(text({2.0, 2.0, 2.0002, 0.2e-3}, 0.0, 0.0), "in time"));
}

TEST_CASE("A thread that shares its core is told how long it was queued", "[realtime]") {
  const SharedCore shared;
  const cli::QueueClock queue;
  const double start = DeadlineMonitor::wall_now(), queued = queue.now(), cpu = DeadlineMonitor::cpu_now();
  while (DeadlineMonitor::wall_now() - start < 0.1) {
  }
  const double waited = queue.now() - queued, wall = DeadlineMonitor::wall_now() - start;
  const double worked = DeadlineMonitor::cpu_now() - cpu;
  if (queue.now() == 0.0) {
    WARN("this system does not tell how long a thread was queued");
    return;
  }
  CHECK(waited > 0.0);
  CHECK(waited + worked <= wall * 1.05 + 0.01);
}

TEST_CASE("run --realtime reports both loops, its histograms, and what was refused", "[realtime][cli]") {
  const TemporaryFolder folder;
  const json report = paced_report(
      folder,
      "--rate 2000 --bristles 5000 --steps 200 --core 1023 --fifo 5 --busy-wait 100 --mlock --histograms '" +
          folder.at("h.csv") + "'");
  CHECK(report["bristles"] == 5000);
  CHECK(report["scene"]["dt"] == 1.0 / 2000);
  CHECK(report["deadline"]["deadline_s"] == 1.0 / 2000);
  const json& realtime = report["realtime"];
  CHECK(realtime["rate_hz"] == 2000.0);
  CHECK(realtime["scene_dt"] == 1e-3);
  CHECK(realtime["busy_wait_s"] == Approx(1e-4));
  CHECK(realtime["stopped"] == false);
  // The system refuses a request for core 1023 on every machine; other requests may succeed by the user's
  // rights.
  CHECK(realtime["core"].is_null());
  std::string refused;
  for (const json& line : realtime["refused"]) refused += line.get<std::string>() + '\n';
  CHECK(refused.find("core 1023: ") != std::string::npos);
  CHECK(realtime["fifo_priority"].is_null() == (refused.find("SCHED_FIFO 5: ") != std::string::npos));
  CHECK(realtime["locked_memory"] == (refused.find("locked memory: ") == std::string::npos));
  const std::string text = read_file(folder.at("out"));
  CHECK(text.find("refused     core 1023: ") != std::string::npos);
  std::map<std::string, std::uint64_t> ticks;
  std::istringstream lines(read_file(folder.at("h.csv")));
  std::string line;
  std::getline(lines, line);
  CHECK(line == "loop,histogram,low_us,high_us,count");
  while (std::getline(lines, line)) {
    const std::size_t second = line.find(',', line.find(',') + 1);
    ticks[line.substr(0, second)] += std::strtoull(line.c_str() + line.rfind(',') + 1, nullptr, 10);
  }
  for (const char* loop : {"bristle", "bare_sleep"}) {
    const json& l = realtime[loop];
    INFO(loop);
    CHECK(l["ticks"] == 200);
    CHECK(l["misses"] == l["misses_ours"].get<int>() + l["misses_machine"].get<int>());
    const std::string name = loop[1] == 'r' ? "bristle" : "bare sleep";
    CHECK(ticks[name + ",step"] == 200);
    CHECK(ticks[name + ",jitter"] <= 4 * 49);
    CHECK(ticks[name + ",jitter"] > 0);
    for (const char* times : {"step_time", "period_jitter"}) {
      CHECK(l[times]["p50_s"] <= l[times]["p99_s"]);
      CHECK(l[times]["p99_s"] <= l[times]["p999_s"]);
      CHECK(l[times]["p999_s"] <= l[times]["max_s"]);
    }
    CHECK(l["worst_tick"]["cause"].get<std::string>().find("after it was due") != std::string::npos);
  }
  CHECK(realtime["bristle"]["step_time"]["p50_s"] == report["step_time"]["p50_s"]);
}

TEST_CASE("run --realtime gives the bare sleep loop the share of ticks it is asked for", "[realtime][cli]") {
  const TemporaryFolder folder;
  const json realtime =
      paced_report(folder, "--rate 2000 --bristles 100 --steps 200 --bare-share 0.1")["realtime"];
  CHECK(realtime["bristle"]["ticks"] == 200);
  CHECK(realtime["bare_sleep"]["ticks"] == 20);  // of each of four segments of 50 ticks, a tenth
}

#if BRISTLE_WITH_TBB
TEST_CASE("A loop that waits for workers is no SCHED_FIFO", "[realtime][cli]") {
  const TemporaryFolder folder;
  REQUIRE(run_shell("'" BRISTLE_CLI "' run '" + stroke +
                    "' --realtime --bristles 1000 --steps 20 --threads 2 --fifo 5 > '" + folder.at("out") +
                    "'") == 0);
  CHECK(read_file(folder.at("out")).find("SCHED_FIFO 5: not asked for with several threads") !=
        std::string::npos);
}
#endif

TEST_CASE("A paced run of few ticks has a period to tell of, one of a single tick has none", "[realtime]") {
  cli::Scene scene = cli::read_scene(stroke);
  cli::set_bristles(scene, 100);
  for (const auto& [steps, periods] : {std::pair{4, 2}, std::pair{2, 1}, std::pair{1, 0}}) {
    cli::RunOptions options;
    options.steps = static_cast<std::uint64_t>(steps);
    options.realtime.emplace();
    const cli::RunResult result = cli::run_scene(scene, options);
    CHECK(static_cast<int>(result.realtime->bare.monitor.period_jitter().count()) == periods);
  }
}

TEST_CASE("An interrupt ends a paced run with its report", "[realtime][cli]") {
  const TemporaryFolder folder;
  const std::string file = folder.at("report.json");
  for (const char* signal : {"INT", "TERM"}) {
    // Sends a signal after a time. If the program was not ready, it ends; the test tries a longer time.
    int status = -1;
    for (const char* seconds : {"0.5", "2", "8"}) {
      status = run_shell(std::string("timeout --foreground --preserve-status -s ") + signal + ' ' + seconds +
                         " '" BRISTLE_CLI "' run '" + stroke +
                         "' --realtime --bristles 1000 --steps 1000000 --json '" + file + "' > '" +
                         folder.at("out") + "'");
      if (status == 0) break;
    }
    REQUIRE(status == 0);
    const json report = json::parse(read_file(file));
    CHECK(report["realtime"]["stopped"] == true);
    CHECK(report["steps"] < 1000000);
    CHECK(report["steps"] == report["realtime"]["bristle"]["ticks"]);
    CHECK(read_file(folder.at("out")).find("stopped     by a signal") != std::string::npos);
  }
}

TEST_CASE("A second interrupt ends the program when the first is half a second old", "[realtime]") {
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {  // the child ends by _exit(), without assertions, which belong to the parent's test
    cli::stop_on_signals();
    if (cli::stop_requested()) _exit(1);
    for (int i = 0; i < 5; ++i) raise(i % 2 ? SIGTERM : SIGINT);
    if (!cli::stop_requested()) _exit(2);
    usleep(600'000);
    raise(SIGTERM);
    usleep(2'000'000);  // waits: the thread sanitizer delivers signals late
    _exit(3);
  }
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  INFO(status);
  REQUIRE(WIFSIGNALED(status));
  CHECK(WTERMSIG(status) == SIGTERM);
}

TEST_CASE("Options of a paced run that make no sense are refused in one line", "[realtime][cli][bad input]") {
  const TemporaryFolder folder;
  const struct {
    const char* options;
    const char* message;
  } cases[] = {
      {"--rate 1000", "--rate requires --realtime"},
      {"--fifo 5", "--fifo requires --realtime"},
      {"--histograms -", "--histograms requires --realtime"},
      {"--realtime --rate 0.5", "--rate: '0.5'; allowed"},
      {"--realtime --rate nan", "--rate: 'nan'; allowed"},
      {"--realtime --busy-wait nan", "--busy-wait: 'nan'; allowed"},
      {"--realtime --bare-share 0", "--bare-share: '0'; allowed"},
      {"--bare-share 0.1", "--bare-share requires --realtime"},
      {"--realtime --fifo 100", "--fifo: '100'; allowed"},
      {"--realtime --histograms - --json -", "only one can have stdout"},
      {"--bristles 0", "--bristles: '0'; allowed"},
  };
  for (const auto& c : cases) {
    INFO(c.options);
    CHECK(run_shell("'" BRISTLE_CLI "' run '" + stroke + "' " + c.options + " > '" + folder.at("out") +
                    "' 2> '" + folder.at("err") + "'") == 2);
    const std::string message = read_file(folder.at("err"));
    CHECK_THAT(message, Catch::Matchers::Contains(c.message));
    CHECK(std::count(message.begin(), message.end(), '\n') == 1);
    CHECK(read_file(folder.at("out")).empty());
  }
  // Without --rate the servo loop takes the rate of the scene.
  std::string fast = read_file(stroke);
  fast.replace(fast.find("dt = 1e-3"), 9, "dt = 1e-10");
  const std::string command = "'" BRISTLE_CLI "' run '" + folder.write("fast.toml", fast) + "' --realtime";
  CHECK(run_shell(command + " 2> '" + folder.at("err") + "'") == 2);
  CHECK_THAT(read_file(folder.at("err")),
             Catch::Matchers::Contains("dt is 1e-10 s") && Catch::Matchers::Contains("give another --rate"));
  CHECK(run_shell(command + " --rate 100000 --steps 3 > '" + folder.at("out") + "'") == 0);
}

}  // namespace bristle_test::test_realtime
