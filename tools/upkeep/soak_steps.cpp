// Runs a number of random steps of each contact model, to find the longest time that one of them takes.
//
//   bristle_soak_steps MODEL STEPS [FOLDER]       continues to STEPS in all; MODEL `all`: each model in turn
//   bristle_soak_steps MODEL --replay PART STEP   repeats that step, and prints what it was
//
// Steps come in parts of a million, each with a patch of its own, determined by the number of the part.
// FOLDER gets a line of JSON per part; a stopped run resumes after the last of them, and any step can be
// replayed. A step that seems longer than all before it was perhaps interrupted by the machine: its block of
// steps is repeated from a saved state, and the least of its times counts.
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <bristle/bristle.hpp>

#include <nlohmann/json.hpp>

namespace {

using bristle::Material;
using bristle::SnapRule;
using bristle::TimeHistogram;

constexpr std::uint64_t steps_of_part = 1000000;
constexpr std::uint64_t steps_of_block = 500;
constexpr int most_repeats = 30;
constexpr double mean_length = 1e-5;  // mean snap length, m
constexpr std::uint32_t bristles = 100;

struct Model {
  const char* name;
  Material (*change)(Material);
  SnapRule rule;
  bool infinite;
};
Material as_it_is(Material m) { return m; }
Material rubbed(Material m) { return m.with_residual_length(0.1 * mean_length).with_shared_renewal(1.0); }
Material aged(Material m) { return m.with_ageing(bristle::Ageing::logarithmic(0.05, 1e-3)); }
Material aged_and_rubbed(Material m) { return aged(rubbed(m)); }
constexpr Model models[] = {
    {"keep", as_it_is, SnapRule::keep, false},
    {"redraw", as_it_is, SnapRule::redraw, false},
    {"rubbed", rubbed, SnapRule::redraw, false},
    {"aged", aged, SnapRule::redraw, false},
    {"aged-rubbed", aged_and_rubbed, SnapRule::redraw, false},
    {"infinite", as_it_is, SnapRule::redraw, true},
    {"infinite-rubbed", rubbed, SnapRule::redraw, true},
    {"infinite-aged", aged, SnapRule::redraw, true},
};

/// Random numbers by SplitMix64 in plain arithmetic, equal on every machine, so that a step can be replayed
/// anywhere.
struct Random {
  std::uint64_t state;

  std::uint64_t bits() {
    std::uint64_t x = state += 0x9E3779B97F4A7C15u;
    x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9u;
    x = (x ^ (x >> 27)) * 0x94D049BB133111EBu;
    return x ^ (x >> 31);
  }
  double share() { return static_cast<double>(bits() >> 11) * 0x1p-53; }
  unsigned below(unsigned count) { return static_cast<unsigned>((bits() >> 32) * count >> 32); }
  /// Returns a random number from 2^low to 2^high whose logarithm is uniformly distributed over octaves.
  double octaves(int low, int high) {
    return std::ldexp(1.0 + share(), low + static_cast<int>(below(static_cast<unsigned>(high - low))));
  }
};

struct Step {
  double dt;
  bristle::Motion motion;
};

/// Random path of a contact that goes straight, turns, reverses and rests. Displacements are 0, or 1e-6 to
/// 1e6 mean snap lengths. Loads mostly stay constant; otherwise they are 0, or 1e-6 to 1.5 times
/// max_normal_load. Time steps are a microsecond to 17 minutes, mostly a tenth of a millisecond.
class Path {
 public:
  explicit Path(std::uint64_t part) : random{part * 0xD1B54A32D192ED03u + 1} {}

  Step next() {
    const unsigned kind = random.below(16);
    if (kind < 5 || kind == 15) {
      double length2 = 0.0;
      while (!(length2 > 1e-4 && length2 <= 1.0)) {
        for (double& e : direction) e = 2.0 * random.share() - 1.0;
        length2 = direction[0] * direction[0] + direction[1] * direction[1];
      }
      for (double& e : direction) e /= std::sqrt(length2);
    }
    if (kind == 5)
      for (double& e : direction) e = 0.0 - e;
    if (kind < 10) length = mean_length * random.octaves(-20, random.below(8) == 0 ? 20 : 3);
    if (kind == 14 || kind == 15) load = random.below(4) == 0 ? 0.0 : 0.75 * random.octaves(-20, 1);
    if (kind == 11) load = 0.7;
    Step step{1e-4, {}};
    if (random.below(8) == 0) step.dt = random.octaves(-20, 10);
    for (int axis = 0; axis < 2; ++axis)
      step.motion.displacement[axis] = kind == 12 || kind == 13 ? 0.0 : length * direction[axis];
    step.motion.normal_load = load;
    return step;
  }

 private:
  Random random;
  double direction[2] = {1.0, 0.0};
  double length = mean_length;
  double load = 0.7;
};

std::uint64_t now_ns(clockid_t clock) {
  timespec t;
  clock_gettime(clock, &t);
  return static_cast<std::uint64_t>(t.tv_sec) * 1000000000u + static_cast<std::uint64_t>(t.tv_nsec);
}

struct Part {
  std::uint64_t largest_ns = 0, at = 0;
  std::uint64_t blocks_repeated = 0;
  double wall_s = 0.0, cpu_s = 0.0;
  TimeHistogram histogram;
  std::uint64_t hash = 0;
  Step of_largest{};
};

volatile std::sig_atomic_t stopped = 0;

/// Model, part and step in progress. If the program crashes, the signal handler prints them.
struct Progress {
  const char* model;
  std::uint64_t part, step;
} progress{};

/// Patch that is stepped in one part of the soak, with the random path that it follows.
struct Walk {
  bristle::PatchBatch batch;
  bristle::PatchId id;
  Path path;

  Walk(const Model& model, std::uint64_t part) : path(part) {
    Material material;
    material.snap_rule = model.rule;
    material.snap_length = bristle::SnapLength::lognormal(mean_length, 0.3);
    bristle::PatchOptions options;
    options.outputs = bristle::Outputs::all;
    options.max_normal_load = 1.0;
    options.seed = static_cast<std::uint32_t>(part + 1);
    options.bristles = model.infinite ? 0 : bristles;
    options.population = model.infinite ? bristle::Population::infinite : options.population;
    id = batch.add(model.change(material), options);
  }

  std::uint64_t step(Step& step) {
    step = path.next();
    ++progress.step;
    step.motion.id = id;
    bristle::Response response;
    const std::uint64_t start = now_ns(CLOCK_MONOTONIC);
    batch.step(step.dt, {&step.motion, 1}, {&response, 1});
    const std::uint64_t taken = now_ns(CLOCK_MONOTONIC) - start;
    const double sum = response.end[0] + response.end[1] + response.mean[0] + response.mean[1] +
                       response.dissipated + response.contact_loss;
    if (!std::isfinite(sum) || has(response.status, bristle::Status::bad_input))
      throw std::runtime_error("a step that is no step");
    return taken;
  }
};

/// Runs up to `steps` steps of a part. `worst` is the longest step time (ns) of all earlier parts.
Part run_part(const Model& model, std::uint64_t number, std::uint64_t steps, std::uint64_t worst) {
  progress = {model.name, number, 0};
  Walk walk(model, number);
  Part part;
  std::vector<std::byte> state(walk.batch.state_size());
  std::array<std::uint64_t, steps_of_block> least{};
  std::array<Step, steps_of_block> taken{};
  for (std::uint64_t at = 0; at < steps && stopped == 0; at += steps_of_block) {
    const std::uint64_t count = std::min(steps_of_block, steps - at);
    const Path path = walk.path;
    walk.batch.save_state(state);
    const std::uint64_t wall = now_ns(CLOCK_MONOTONIC), cpu = now_ns(CLOCK_THREAD_CPUTIME_ID);
    for (std::uint64_t k = 0; k < count; ++k) {
      least[k] = walk.step(taken[k]);
      part.histogram.record(1e-9 * static_cast<double>(least[k]));
    }
    part.cpu_s += 1e-9 * static_cast<double>(now_ns(CLOCK_THREAD_CPUTIME_ID) - cpu);
    part.wall_s += 1e-9 * static_cast<double>(now_ns(CLOCK_MONOTONIC) - wall);
    const auto last = least.begin() + static_cast<std::ptrdiff_t>(count);
    auto longest = std::max_element(least.begin(), last);
    const std::uint64_t hash = walk.batch.state_hash();
    if (*longest <= worst) continue;
    ++part.blocks_repeated;
    for (int repeat = 0; repeat < most_repeats && worst < *longest; ++repeat) {
      walk.batch.restore_state(state);
      walk.path = path;
      progress.step = at;
      for (std::uint64_t k = 0; k < count; ++k) least[k] = std::min(least[k], walk.step(taken[k]));
      if (walk.batch.state_hash() != hash)
        throw std::runtime_error("a block run again ended in another state");
      longest = std::max_element(least.begin(), last);
    }
    if (*longest <= worst) continue;
    worst = part.largest_ns = *longest;
    part.at = at + static_cast<std::uint64_t>(longest - least.begin());
    part.of_largest = taken[part.at - at];
  }
  part.hash = walk.batch.state_hash();
  return part;
}

void print_step(const Step& step, std::uint64_t ns) {
  std::printf("%.3f us: dt %.17g s, moved %.17g %.17g m, load %.17g N\n", 1e-3 * static_cast<double>(ns),
              step.dt, step.motion.displacement[0], step.motion.displacement[1], step.motion.normal_load);
}

/// Totals over all parts of a long run that the file of a contact model has recorded.
struct Total {
  std::uint64_t parts = 0, largest_ns = 0, largest_part = 0, largest_at = 0;
  double cpu_s = 0.0, wall_s = 0.0;
  std::array<std::uint64_t, TimeHistogram::buckets> counts{};

  void add(const nlohmann::json& line) {
    ++parts;
    cpu_s += line.at("cpu_s").get<double>();
    wall_s += line.at("wall_s").get<double>();
    const auto ns = line.at("largest_ns").get<std::uint64_t>();
    if (ns > largest_ns) {
      largest_ns = ns;
      largest_part = line.at("part").get<std::uint64_t>();
      largest_at = line.at("at_step").get<std::uint64_t>();
    }
    for (const auto& [bucket, count] : line.at("histogram").items())
      counts.at(std::stoul(bucket)) += count.get<std::uint64_t>();
  }
  /// Returns the upper end (ns) of the histogram bucket in which the quantile `share` of step times lies.
  std::uint64_t quantile(double share) const {
    double left = share * static_cast<double>(parts * steps_of_part);
    for (int b = 0; b < TimeHistogram::buckets; ++b)
      if ((left -= static_cast<double>(counts[static_cast<std::size_t>(b)])) <= 0.0)
        return static_cast<std::uint64_t>(1e9 * TimeHistogram().bucket(b).high_s);
    return 0;
  }
  void print(const char* name) const {
    std::printf(
        "%-20s %4llu million steps: p50 %llu, p99 %llu, p99.9999 %llu ns; largest %.1f us (part %llu, step "
        "%llu); CPU %.0f s of %.0f s\n",
        name, static_cast<unsigned long long>(parts), static_cast<unsigned long long>(quantile(0.5)),
        static_cast<unsigned long long>(quantile(0.99)), static_cast<unsigned long long>(quantile(0.999999)),
        1e-3 * static_cast<double>(largest_ns), static_cast<unsigned long long>(largest_part),
        static_cast<unsigned long long>(largest_at), cpu_s, wall_s);
    std::fflush(stdout);
  }
};

nlohmann::json line_of(std::uint64_t number, const Part& part) {
  nlohmann::json histogram = nlohmann::json::object();
  for (int b = 0; b < TimeHistogram::buckets; ++b)
    if (const std::uint32_t count = part.histogram.bucket(b).count; count > 0)
      histogram[std::to_string(b)] = count;
  char hash[20];
  std::snprintf(hash, sizeof hash, "%016llx", static_cast<unsigned long long>(part.hash));
  return {{"part", number},      {"largest_ns", part.largest_ns}, {"at_step", part.at},
          {"cpu_s", part.cpu_s}, {"wall_s", part.wall_s},         {"blocks_repeated", part.blocks_repeated},
          {"state_hash", hash},  {"histogram", histogram}};
}

int soak(const Model& model, std::uint64_t steps, const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  const std::filesystem::path path = folder / (std::string(model.name) + ".jsonl");
  Total total;
  // Length, in bytes, of the file's complete lines. A killed run may leave a partial line behind them.
  std::uintmax_t whole = 0;
  if (std::ifstream file(path); file)
    for (std::string line; std::getline(file, line) && !file.eof(); whole += line.size() + 1)
      total.add(nlohmann::json::parse(line));
  if (std::filesystem::exists(path)) std::filesystem::resize_file(path, whole);
  std::ofstream out(path, std::ios::app);
  while (total.parts * steps_of_part < steps && stopped == 0) {
    const std::uint64_t number = total.parts;
    const Part part = run_part(model, number, steps_of_part, total.largest_ns);
    if (stopped != 0) break;
    const nlohmann::json line = line_of(number, part);
    out << line << '\n' << std::flush;
    if (!out) throw std::runtime_error(path.string() + ": cannot be written");
    if (part.largest_ns > 0) {
      std::printf("%s: part %llu, step %llu, ", model.name, static_cast<unsigned long long>(number),
                  static_cast<unsigned long long>(part.at));
      print_step(part.of_largest, part.largest_ns);
    }
    total.add(line);
  }
  total.print(model.name);
  return stopped != 0 ? 130 : 0;
}

int replay(const Model& model, std::uint64_t number, std::uint64_t at) {
  Walk walk(model, number);
  Step step{};
  // Repeats the whole block of steps up to the wanted one, because the library's state depends on earlier
  // steps.
  const std::uint64_t before = at % steps_of_block;
  for (std::uint64_t k = 0; k < at - before; ++k) walk.step(step);
  std::vector<std::byte> state(walk.batch.state_size());
  walk.batch.save_state(state);
  const Path path = walk.path;
  std::uint64_t least = ~std::uint64_t{0};
  for (int repeat = 0; repeat < 20; ++repeat) {
    walk.batch.restore_state(state);
    walk.path = path;
    for (std::uint64_t k = 0; k < steps_of_block; ++k) {
      Step other;
      const std::uint64_t taken = walk.step(k == before ? step : other);
      if (k == before) least = std::min(least, taken);
    }
  }
  print_step(step, least);
  return 0;
}

extern "C" void stop(int) { stopped = 1; }

extern "C" void say_which(int number) {
  char text[120];
  const int size = std::snprintf(text, sizeof text, "bristle_soak_steps: %s: in part %llu, step %llu\n",
                                 progress.model, static_cast<unsigned long long>(progress.part),
                                 static_cast<unsigned long long>(progress.step - 1));
  if (write(2, text, static_cast<std::size_t>(size)) < 0) _exit(1);
  std::signal(number, SIG_DFL);
  std::raise(number);
}

int usage() {
  std::fprintf(stderr,
               "usage: bristle_soak_steps MODEL|all STEPS [FOLDER] or MODEL --replay PART STEP\n"
               "STEPS in all, e.g. 1e9; FOLDER: soak-output/steps unless given. Models:");
  for (const Model& m : models) std::fprintf(stderr, " %s", m.name);
  std::fprintf(stderr, "\n");
  return 2;
}

int run(int argc, char** argv) {
  if (argc < 3) return usage();
  const std::string name = argv[1];
  std::vector<Model> chosen;
  for (const Model& m : models)
    if (name == m.name || name == "all") chosen.push_back(m);
  if (chosen.empty()) return usage();
  if (std::strcmp(argv[2], "--replay") == 0) {
    if (argc != 5 || chosen.size() != 1) return usage();
    return replay(chosen[0], std::stoull(argv[3]), std::stoull(argv[4]));
  }
  const double steps = std::stod(argv[2]);
  if (!(steps >= 1.0 && steps <= 1e13)) return usage();
  for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, stop);
  for (const int signal : {SIGSEGV, SIGFPE, SIGABRT}) std::signal(signal, say_which);
  for (const Model& model : chosen)
    if (const int code =
            soak(model, static_cast<std::uint64_t>(steps), argc > 3 ? argv[3] : "soak-output/steps");
        code != 0)
      return code;
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bristle_soak_steps: %s\n", error.what());
    return 1;
  }
}
