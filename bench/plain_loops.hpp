// Loops that bristle is compared with: a plain structure-of-arrays loop left to the compiler, and the time
// it takes to stream the same bytes.
//
// Compiled with every flag that helps a plain loop (-O3 -march=native -ffast-math), for the machine it is
// built on: call plain_loops_run_here() before anything else in a program that may be copied elsewhere. One
// thread per object. Set-up throws std::bad_alloc; step never throws and allocates nothing.
#pragma once

#include <cstddef>
#include <cstdint>

namespace bristle::plain {

/// Returns whether this machine has the instructions that the loops were compiled for. If not, calling them
/// would crash.
bool plain_loops_run_here() noexcept;

/// Elastic force of the bristles on the moving body, N: at the end of the step, and its mean (0 unless
/// computed).
struct Force {
  double end[2] = {0.0, 0.0};
  double mean[2] = {0.0, 0.0};
};

/// State of one bristle, which tests read with `get` and write with `set`; lengths in m.
struct Bristle {
  double zx = 0.0, zy = 0.0, delta = 0.0;
};

enum class Rule : unsigned char { keep, redraw };

/// Style in which the loop over the bristles is written.
enum class Style : unsigned char {
  one_loop,  ///< all work of a bristle in one loop body, as one writes it first

  /// Chunks of 1024 bristles, as one writes after a day with a profiler. A cheap pass adds their deflections
  /// and tests whether any snaps; `redraw` takes rounds over the chunk, in each of which a bristle snaps at
  /// most once, so that it vectorises too.
  chunked
};

struct PlainOptions {
  std::size_t bristles = 900;
  double mean_snap_length_m = 10e-6;  ///< mean, m; lengths are uniform on 0.5 to 1.5 of it
  double bristle_stiffness = 1.0;     ///< N/m
  int axes = 2;                       ///< number of tangential axes, 1 (x only) or 2
  Rule rule = Rule::keep;
  bool mean = false;  ///< whether to compute the step's mean force beside the end force
  Style style = Style::one_loop;
  std::uint32_t seed = 1;
};

/// Plain loop with the same exact physics as bristle's kernels: every snap inside the step counts, and the
/// path left after it is carried on. It is a structure of float arrays, with loops for the compiler's
/// auto-vectoriser. It has no vector code, does not promise equal bits, and handles only finite input and
/// steps up to some 1e3 mean snap lengths, beyond which float loses the phase.
class PlainLoop {
 public:
  /// Makes bristles at rest. Axes other than 1 or 2 count as 2.
  explicit PlainLoop(const PlainOptions& options);
  ~PlainLoop();
  PlainLoop(const PlainLoop&) = delete;
  PlainLoop& operator=(const PlainLoop&) = delete;

  /// Moves the body by (dx, dy) and returns the force; dy is ignored with one axis.
  Force step(double dx_m, double dy_m) noexcept { return step_(columns_, options_, dx_m, dy_m); }

  const PlainOptions& options() const noexcept { return options_; }
  std::size_t size() const noexcept { return options_.bristles; }
  void set(std::size_t i, const Bristle& bristle) noexcept;
  Bristle get(std::size_t i) const noexcept;

  struct Columns {
    float* zx = nullptr;
    float* zy = nullptr;  ///< deflection on the second axis, if there is one
    float* delta = nullptr;
    std::uint32_t* draws = nullptr;  ///< number of draws of each bristle, for redraw only
  };

 private:
  using Step = Force (*)(const Columns&, const PlainOptions&, double, double) noexcept;
  PlainOptions options_;
  Columns columns_;
  void* memory_;
  Step step_;
};

/// Plain loop for contacts whose bristles slide at their limit (SnapRule::slide), sixteen at a time: two
/// axes, single precision, end force, equal weights, a polynomial for exp. Limits are uniform on 0.5 to 1.5
/// means. A load only scales the force; the loop does not follow its changes.
class LanesLoop {
 public:
  static constexpr std::size_t lanes = 16;

  LanesLoop(std::size_t contacts, std::size_t springs, double mean_limit_m);  ///< contacts: a multiple of 16
  ~LanesLoop();
  LanesLoop(const LanesLoop&) = delete;
  LanesLoop& operator=(const LanesLoop&) = delete;

  /// Moves every contact by its own displacement, m. Fills the force for a stiffness of 1 N/m per newton of
  /// load.
  void step(const double* dx, const double* dy, const double* load, double* fx, double* fy) noexcept;

 private:
  std::size_t contacts_, springs_;
  double mean_m_;
  float* limit_;  ///< limit of each spring, in units of the mean limit
  /// Deflections: for each block of 16 contacts and each spring 16 along x, then 16 along y.
  float* springs_xy_;
};

/// Plain loop for joints of 8 bristles that slide at load-dependent limits: a clamp for each bristle, in
/// double precision. Limits are evenly spread on 0.5 to 1.5 of base + by_motor |motor|.
class JointLoop {
 public:
  JointLoop(std::size_t n, double stiffness, double base, double by_motor);
  ~JointLoop();
  JointLoop(const JointLoop&) = delete;
  JointLoop& operator=(const JointLoop&) = delete;

  void step(const double* angle, const double* motor, double* torque) noexcept;

 private:
  static constexpr std::size_t bristles = 8;
  std::size_t n_;
  double stiffness_, base_, by_motor_;
  double* tip_;  ///< deflections: for each of the 8 bristles a column with all joints
};

/// Streaming limit, the time that memory alone takes: reads `read_columns` float columns of n and writes the
/// first `written_columns` of them back, in chunks of 256 like bristle's blocks, with almost no computation.
/// (A step with two axes and keep reads 3 columns, and writes 2 where bristles snap.)
class StreamLoop {
 public:
  StreamLoop(std::size_t n, int read_columns, int written_columns);
  ~StreamLoop();
  StreamLoop(const StreamLoop&) = delete;
  StreamLoop& operator=(const StreamLoop&) = delete;

  /// Runs one pass over the columns. The returned value has no meaning; use it, so that the compiler does not
  /// remove the pass.
  double step() noexcept;
  std::size_t size() const noexcept { return n_; }
  /// Returns the number of bytes that one pass reads and writes.
  std::size_t bytes() const noexcept;

 private:
  float* memory_;
  std::size_t n_, stride_;
  int read_, written_;
};

}  // namespace bristle::plain
