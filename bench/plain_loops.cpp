// Implements the loops of plain_loops.hpp. Compiled with -O3 -march=native -ffast-math (see bench/README.md).
// Uses no standard containers: the linker might share their inline functions with code that must run on any
// machine and round exactly.
#include "plain_loops.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <new>

namespace bristle::plain {

namespace {

constexpr std::size_t cache_line = 64;
// Number of bristles in a chunk. Its four columns are 16 KB, which fit half of a small first-level cache.
constexpr std::size_t chunk = 1024;

void* take(std::size_t bytes) {
  void* memory = ::operator new (bytes, std::align_val_t{cache_line});
  std::memset(memory, 0, bytes);
  return memory;
}

void give_back(void* memory) noexcept { ::operator delete (memory, std::align_val_t{cache_line}); }

/// Returns bristle i's snap length over the mean: evenly spread (stratified) over 0.5 to 1.5.
double first_length(std::size_t i) {
  const double golden = 0.6180339887498949;
  const double position = (static_cast<double>(i) + 0.5) * golden;
  return 0.5 + (position - std::floor(position));
}

}  // namespace

bool plain_loops_run_here() noexcept {
#if defined(__x86_64__)
  bool here = true;
#if defined(__AVX__)
  here = here && __builtin_cpu_supports("avx");
#endif
#if defined(__AVX2__)
  here = here && __builtin_cpu_supports("avx2");
#endif
#if defined(__FMA__)
  here = here && __builtin_cpu_supports("fma");
#endif
#if defined(__AVX512F__)
  here = here && __builtin_cpu_supports("avx512f");
#endif
#if defined(__AVX512VL__)
  here = here && __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw") &&
         __builtin_cpu_supports("avx512dq");
#endif
  return here;
#else
  return true;
#endif
}

// The plain loop over columns.

namespace {

using Columns = PlainLoop::Columns;

// Replaces std::max and std::min, whose inline functions the linker might share with code for other machines.
inline float larger(float a, float b) { return a > b ? a : b; }
inline float smaller(float a, float b) { return a < b ? a : b; }

/// Displacement of a step, m, which all bristles of a plain loop have in common.
struct Path {
  float dx, dy;  // displacement
  float h;       // length of the displacement, m
  float ex, ey;  // unit vector along the displacement of length h; 0 where h is 0
};

/// Sums over bristles of the deflection at the end (m), and (with Mean only) of its integral over the path
/// (m^2).
struct Sums {
  float end_x = 0.0f, end_y = 0.0f, path_x = 0.0f, path_y = 0.0f;
};

/// Source of uniform snap lengths: a hash of the bristle's number and of the number of its sample, by two
/// multiplications.
struct Draw {
  float shortest, width;  // m
  std::uint32_t seed;

  float operator()(std::uint32_t bristle, std::uint32_t number) const {
    std::uint32_t x = ((bristle * 0x9E3779B1u) ^ seed) + number * 0x85EBCA6Bu;
    x ^= x >> 16;
    x *= 0x7FEB352Du;
    x ^= x >> 15;
    x *= 0x846CA68Bu;
    x ^= x >> 16;
    // Converts through a signed integer. No instruction set before AVX-512 converts unsigned ones.
    return shortest + width * 0x1p-24f * static_cast<float>(static_cast<std::int32_t>(x >> 8));
  }
};

/// Returns the distance along the path to a bristle's first snap; 0 if it is bent beyond its snap length
/// already.
template <int Axes>
inline float distance_to_snap(float zx, float zy, float delta, const Path& path) {
  if constexpr (Axes == 1) {
    return larger(delta - zx * path.ex, 0.0f);
  } else {
    const float along = zx * path.ex + zy * path.ey;
    const float across = zx * path.ey - zy * path.ex;
    return larger(std::sqrt(larger(delta * delta - across * across, 0.0f)) - along, 0.0f);
  }
}

/// Adds one bristle to the sums. `z`: its deflection before the step; `t`: its path up to the first snap or
/// the end; `squares`: sum of squared paths between later snaps.
template <int Axes, bool Mean>
inline void add(Sums& sums, float zx, float zy, float t, float squares, float new_zx, float new_zy,
                const Path& path) {
  sums.end_x += new_zx;
  if constexpr (Axes == 2) sums.end_y += new_zy;
  if constexpr (Mean) {
    const float half = 0.5f * (t * t + squares);
    sums.path_x += zx * t + path.ex * half;
    if constexpr (Axes == 2) sums.path_y += zy * t + path.ey * half;
  }
}

// Steps bristles that keep their lengths, in a single loop.
//
// g++ 12 with -O3 -march=native -ffast-math turns the whole loop into 64-byte (zmm) vectors in all four
// variants on an AVX-512 machine (`objdump -dC`, -fopt-info-vec): vrsqrt14ps and vrcp14ps with a Newton step
// for root and quotient, vrndscaleps for floor, masked adds for bristles that do not snap. clang++ 14
// vectorises it as widely. Sums are passed by reference, because clang++ does not vectorise the loop if the
// function returns them.
template <int Axes, bool Mean>
[[gnu::noinline]] void keep_one_loop(const Columns& columns, std::size_t begin, std::size_t end,
                                     const Path& path_in, Sums& out) {
  float* __restrict zx_column = columns.zx;
  float* __restrict zy_column = columns.zy;
  const float* __restrict delta_column = columns.delta;
  const Path path = path_in;
  Sums sums;
  for (std::size_t i = begin; i < end; ++i) {
    const float zx = zx_column[i];
    const float zy = Axes == 2 ? zy_column[i] : 0.0f;
    const float delta = delta_column[i];
    const float tau = distance_to_snap<Axes>(zx, zy, delta, path);
    const bool snaps = tau <= path.h;
    const float t = smaller(tau, path.h);
    // Path that is left to the bristle after its first snap. Without a snap it is 0, so that nothing is added
    // then.
    const float remaining = path.h - t;
    const float more = std::floor(remaining / delta);
    const float r = smaller(larger(remaining - more * delta, 0.0f), delta);
    const float new_zx = snaps ? r * path.ex : zx + path.dx;
    const float new_zy = snaps ? r * path.ey : zy + path.dy;
    zx_column[i] = new_zx;
    if (Axes == 2) zy_column[i] = new_zy;
    add<Axes, Mean>(sums, zx, zy, t, more * delta * delta + r * r, new_zx, new_zy, path);
  }
  out = sums;
}

/// Steps a chunk as keep_one_loop() does, but first tests whether any bristle snaps. If none does, it only
/// adds the displacement.
template <int Axes, bool Mean>
[[gnu::noinline]] void keep_chunk(const Columns& columns, std::size_t begin, std::size_t end,
                                  const Path& path_in, Sums& out) {
  float* __restrict zx_column = columns.zx;
  float* __restrict zy_column = columns.zy;
  const float* __restrict delta_column = columns.delta;
  const Path path = path_in;
  float beyond = -1.0f;  // largest |z + d|^2 - delta^2; positive if any bristle snaps
  Sums sums;             // sums that are valid if no bristle snaps
  for (std::size_t i = begin; i < end; ++i) {
    const float x = zx_column[i] + path.dx;
    const float y = Axes == 2 ? zy_column[i] + path.dy : 0.0f;
    sums.end_x += x;
    sums.end_y += y;
    beyond = larger(beyond, x * x + y * y - delta_column[i] * delta_column[i]);
  }
  if (beyond > 0.0f) return keep_one_loop<Axes, Mean>(columns, begin, end, path, out);
  for (std::size_t i = begin; i < end; ++i) {
    zx_column[i] += path.dx;
    if (Axes == 2) zy_column[i] += path.dy;
  }
  if constexpr (Mean) {
    const float count = static_cast<float>(end - begin);
    sums.path_x = path.h * (sums.end_x - 0.5f * count * path.dx);
    sums.path_y = path.h * (sums.end_y - 0.5f * count * path.dy);
  }
  out = sums;
}

/// Steps bristles that redraw their lengths in the simplest form: one bristle after the other, from snap to
/// snap. The inner loop prevents vectorisation.
template <int Axes, bool Mean>
[[gnu::noinline]] void redraw_one_loop(const Columns& columns, std::size_t begin, std::size_t end,
                                       const Path& path_in, const Draw& draw_in, Sums& out) {
  float* __restrict zx_column = columns.zx;
  float* __restrict zy_column = columns.zy;
  float* __restrict delta_column = columns.delta;
  std::uint32_t* __restrict draws_column = columns.draws;
  const Path path = path_in;
  const Draw draw = draw_in;
  Sums sums;
  for (std::size_t i = begin; i < end; ++i) {
    const float zx = zx_column[i];
    const float zy = Axes == 2 ? zy_column[i] : 0.0f;
    const float tau = distance_to_snap<Axes>(zx, zy, delta_column[i], path);
    float t = path.h;
    float squares = 0.0f;
    float new_zx = zx + path.dx;
    float new_zy = zy + path.dy;
    if (tau <= path.h) {
      const auto bristle = static_cast<std::uint32_t>(i);
      std::uint32_t number = draws_column[i];
      float remaining = path.h - tau;
      float delta = draw(bristle, ++number);
      while (remaining >= delta) {
        squares += delta * delta;
        remaining -= delta;
        delta = draw(bristle, ++number);
      }
      t = tau;
      squares += remaining * remaining;
      new_zx = remaining * path.ex;
      new_zy = remaining * path.ey;
      delta_column[i] = delta;
      draws_column[i] = number;
    }
    zx_column[i] = new_zx;
    if (Axes == 2) zy_column[i] = new_zy;
    add<Axes, Mean>(sums, zx, zy, t, squares, new_zx, new_zy, path);
  }
  out = sums;
}

/// Steps bristles with redraw in rounds over the chunk. In a round each bristle with path left snaps once, so
/// that each loop vectorises (zmm on an AVX-512 machine). There are as many rounds as snaps of the bristle
/// that snaps most. g++ 12 needs 32-bit indices, loads before selects, unconditional stores, and sums apart
/// from selects.
template <int Axes, bool Mean>
[[gnu::noinline]] void redraw_chunk(const Columns& columns, std::size_t begin, std::size_t end,
                                    const Path& path_in, const Draw& draw_in, Sums& out) {
  float* __restrict zx_column = columns.zx + begin;
  float* __restrict zy_column = Axes == 2 ? columns.zy + begin : nullptr;
  float* __restrict delta_column = columns.delta + begin;
  std::uint32_t* __restrict draws_column = columns.draws + begin;
  const Path path = path_in;
  const Draw draw = draw_in;
  const auto count = static_cast<std::uint32_t>(end - begin);
  const auto first = static_cast<std::uint32_t>(begin);
  float remaining[chunk];  // each bristle's path left after its last snap; negative if it does not snap
  float squares[chunk];    // sum of squared lengths of each bristle's passes from snap to snap
  float beyond = -1.0f;
  Sums sums;
  for (std::uint32_t i = 0; i < count; ++i) {
    const float zx = zx_column[i];
    const float zy = Axes == 2 ? zy_column[i] : 0.0f;
    const float left = path.h - distance_to_snap<Axes>(zx, zy, delta_column[i], path);
    remaining[i] = left;
    squares[i] = 0.0f;
    beyond = larger(beyond, left);
    if constexpr (Mean) {
      const float t = path.h - larger(left, 0.0f);
      sums.path_x += zx * t + path.ex * (0.5f * t * t);
      if constexpr (Axes == 2) sums.path_y += zy * t + path.ey * (0.5f * t * t);
    }
  }
  // Repeats passes over the bristles until none snaps. The path left after the first snap is in `remaining`
  // already; every later pass first subtracts the bristle's present snap length from it.
  for (bool first_snap = true; beyond >= 0.0f; first_snap = false) {
    const float pass = first_snap ? 0.0f : 1.0f;
    beyond = -1.0f;
    for (std::uint32_t i = 0; i < count; ++i) {
      const float delta = delta_column[i];
      const std::uint32_t number = draws_column[i];
      const float used = pass * delta;
      const float left = remaining[i] - used;
      const float old_squares = squares[i];
      const float old_remaining = remaining[i];
      const float fresh = draw(first + i, number + 1);
      const bool snaps = left >= 0.0f;
      const float new_remaining = snaps ? left : old_remaining;
      const float new_delta = snaps ? fresh : delta;
      draws_column[i] = snaps ? number + 1 : number;
      delta_column[i] = new_delta;
      remaining[i] = new_remaining;
      squares[i] = snaps ? old_squares + used * used : old_squares;
      beyond = larger(beyond, new_remaining - new_delta);
    }
  }
  float squares_sum = 0.0f;
  for (std::uint32_t i = 0; i < count; ++i) {
    const float r = remaining[i];
    const float stuck_zx = zx_column[i] + path.dx;
    zx_column[i] = r >= 0.0f ? r * path.ex : stuck_zx;
    if constexpr (Axes == 2) {
      const float stuck_zy = zy_column[i] + path.dy;
      zy_column[i] = r >= 0.0f ? r * path.ey : stuck_zy;
    }
    if constexpr (Mean) {
      const float passed = larger(r, 0.0f);
      squares_sum += squares[i] + passed * passed;
    }
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    sums.end_x += zx_column[i];
    if constexpr (Axes == 2) sums.end_y += zy_column[i];
  }
  sums.path_x += 0.5f * path.ex * squares_sum;
  sums.path_y += 0.5f * path.ey * squares_sum;
  out = sums;
}

/// Steps all bristles chunk by chunk. Sums in a chunk are float, because few terms lose little; totals are
/// double.
template <int Axes, Rule R, bool Mean, Style S>
Force step_all(const Columns& columns, const PlainOptions& options, double dx_m, double dy_m) noexcept {
  if (Axes == 1) dy_m = 0.0;
  const double h = std::sqrt(dx_m * dx_m + dy_m * dy_m);
  const double per_h = h > 0.0 ? 1.0 / h : 0.0;
  const Path path = {static_cast<float>(dx_m), static_cast<float>(dy_m), static_cast<float>(h),
                     static_cast<float>(dx_m * per_h), static_cast<float>(dy_m * per_h)};
  [[maybe_unused]] const Draw draw = {static_cast<float>(0.5 * options.mean_snap_length_m),
                                      static_cast<float>(options.mean_snap_length_m), options.seed};
  double end_x = 0.0, end_y = 0.0, path_x = 0.0, path_y = 0.0;
  for (std::size_t begin = 0; begin < options.bristles; begin += chunk) {
    const std::size_t end = begin + chunk < options.bristles ? begin + chunk : options.bristles;
    Sums sums;
    if constexpr (R == Rule::keep && S == Style::one_loop) {
      keep_one_loop<Axes, Mean>(columns, begin, end, path, sums);
    } else if constexpr (R == Rule::keep) {
      keep_chunk<Axes, Mean>(columns, begin, end, path, sums);
    } else if constexpr (S == Style::one_loop) {
      redraw_one_loop<Axes, Mean>(columns, begin, end, path, draw, sums);
    } else {
      redraw_chunk<Axes, Mean>(columns, begin, end, path, draw, sums);
    }
    end_x += static_cast<double>(sums.end_x);
    end_y += static_cast<double>(sums.end_y);
    path_x += static_cast<double>(sums.path_x);
    path_y += static_cast<double>(sums.path_y);
  }
  const double stiffness = options.bristle_stiffness;
  Force force;
  force.end[0] = -stiffness * end_x;
  force.end[1] = -stiffness * end_y;
  if constexpr (Mean) {
    // Takes the end force as the mean force of a step at rest.
    force.mean[0] = h > 0.0 ? -stiffness * path_x * per_h : force.end[0];
    force.mean[1] = h > 0.0 ? -stiffness * path_y * per_h : force.end[1];
  }
  return force;
}

using Step = Force (*)(const Columns&, const PlainOptions&, double, double) noexcept;

template <int Axes, Rule R, bool Mean>
Step find_step(Style style) {
  return style == Style::one_loop ? &step_all<Axes, R, Mean, Style::one_loop>
                                  : &step_all<Axes, R, Mean, Style::chunked>;
}

template <int Axes, Rule R>
Step find_step(bool mean, Style style) {
  return mean ? find_step<Axes, R, true>(style) : find_step<Axes, R, false>(style);
}

template <int Axes>
Step find_step(Rule rule, bool mean, Style style) {
  return rule == Rule::keep ? find_step<Axes, Rule::keep>(mean, style)
                            : find_step<Axes, Rule::redraw>(mean, style);
}

}  // namespace

PlainLoop::PlainLoop(const PlainOptions& options) : options_(options) {
  if (options_.axes != 1) options_.axes = 2;
  const std::size_t n = options_.bristles;
  // Puts an odd number of cache lines between columns. Otherwise equal rows of two columns would compete for
  // the same set of the cache.
  const std::size_t stride = (n + 15) / 32 * 32 + 16;
  memory_ = take(4 * stride * sizeof(float));
  auto* floats = static_cast<float*>(memory_);
  columns_.zx = floats;
  columns_.delta = floats + stride;
  if (options_.axes == 2) columns_.zy = floats + 2 * stride;
  if (options_.rule == Rule::redraw) columns_.draws = static_cast<std::uint32_t*>(memory_) + 3 * stride;
  for (std::size_t i = 0; i < n; ++i)
    columns_.delta[i] = static_cast<float>(options_.mean_snap_length_m * first_length(i));
  step_ = options_.axes == 1 ? find_step<1>(options_.rule, options_.mean, options_.style)
                             : find_step<2>(options_.rule, options_.mean, options_.style);
}

PlainLoop::~PlainLoop() { give_back(memory_); }

void PlainLoop::set(std::size_t i, const Bristle& bristle) noexcept {
  columns_.zx[i] = static_cast<float>(bristle.zx);
  if (columns_.zy != nullptr) columns_.zy[i] = static_cast<float>(bristle.zy);
  columns_.delta[i] = static_cast<float>(bristle.delta);
}

Bristle PlainLoop::get(std::size_t i) const noexcept {
  return {static_cast<double>(columns_.zx[i]),
          columns_.zy != nullptr ? static_cast<double>(columns_.zy[i]) : 0.0,
          static_cast<double>(columns_.delta[i])};
}

// Loop for bristles that slide at their limit.

namespace {

/// Returns exp(-y) for y >= 0, to 1e-7: how far a sliding bristle has turned towards the motion.
inline float shrink(float y) {
  const float x = smaller(y, 80.0f) * 1.44269504f;
  const float k = std::floor(x + 0.5f);
  const float f = k - x;
  const float series =
      1.0f +
      f * (0.693147182f + f * (0.240226462f + f * (0.0555032864f + f * (0.00961835f + f * 0.00133947f))));
  const std::int32_t bits = (127 - static_cast<std::int32_t>(k)) * (1 << 23);
  float scale;
  std::memcpy(&scale, &bits, sizeof scale);
  return series * scale;
}

}  // namespace

LanesLoop::LanesLoop(std::size_t contacts, std::size_t springs, double mean_limit_m)
    : contacts_(contacts),
      springs_(springs),
      mean_m_(mean_limit_m),
      limit_(static_cast<float*>(take(springs * sizeof(float)))),
      springs_xy_(static_cast<float*>(take(2 * contacts * springs * sizeof(float)))) {
  for (std::size_t i = 0; i < springs; ++i) limit_[i] = static_cast<float>(first_length(i));
}

LanesLoop::~LanesLoop() {
  give_back(limit_);
  give_back(springs_xy_);
}

void LanesLoop::step(const double* dx_m, const double* dy_m, const double* load, double* fx,
                     double* fy) noexcept {
  const double per_m = 1.0 / mean_m_;
  for (std::size_t first = 0; first < contacts_; first += lanes) {
    float dx[lanes], dy[lanes], h[lanes], ex[lanes], ey[lanes], sum_x[lanes] = {}, sum_y[lanes] = {};
    for (std::size_t k = 0; k < lanes; ++k) {
      dx[k] = static_cast<float>(dx_m[first + k] * per_m);
      dy[k] = static_cast<float>(dy_m[first + k] * per_m);
      h[k] = std::sqrt(dx[k] * dx[k] + dy[k] * dy[k]);
      const float per_length = 1.0f / larger(h[k], 1e-30f);
      ex[k] = dx[k] * per_length;
      ey[k] = dy[k] * per_length;
    }
    for (std::size_t i = 0; i < springs_; ++i) {
      float* __restrict zx = springs_xy_ + 2 * (first * springs_ + i * lanes);
      float* __restrict zy = zx + lanes;
      const float l = limit_[i], per_l = 1.0f / l;
      for (std::size_t k = 0; k < lanes; ++k) {
        const float along = zx[k] * ex[k] + zy[k] * ey[k];
        const float aside = zx[k] * ey[k] - zy[k] * ex[k];
        const float tau = larger(std::sqrt(larger(l * l - aside * aside, 0.0f)) - along, 0.0f);
        const float p = l + along + tau;
        const float w = aside * shrink(larger(h[k] - tau, 0.0f) * per_l);
        const float scale = l / (p * p + w * w);
        const float new_along = (p * p - w * w) * scale;
        const float new_aside = 2.0f * p * w * scale;
        zx[k] = tau < h[k] ? new_along * ex[k] + new_aside * ey[k] : zx[k] + dx[k];
        zy[k] = tau < h[k] ? new_along * ey[k] - new_aside * ex[k] : zy[k] + dy[k];
        sum_x[k] += zx[k];
        sum_y[k] += zy[k];
      }
    }
    const double unit = -mean_m_ / static_cast<double>(springs_);
    for (std::size_t k = 0; k < lanes; ++k) {
      fx[first + k] = unit * load[first + k] * static_cast<double>(sum_x[k]);
      fy[first + k] = unit * load[first + k] * static_cast<double>(sum_y[k]);
    }
  }
}

// Loop for joints.

JointLoop::JointLoop(std::size_t n, double stiffness, double base, double by_motor)
    : n_(n), stiffness_(stiffness), base_(base), by_motor_(by_motor) {
  tip_ = static_cast<double*>(take(bristles * n * sizeof(double)));
  std::fill(tip_, tip_ + bristles * n, 0.0);
}

JointLoop::~JointLoop() { give_back(tip_); }

void JointLoop::step(const double* angle, const double* motor, double* torque) noexcept {
  const double flexibility = 1.0 / stiffness_, share = stiffness_ / bristles;
  for (std::size_t begin = 0; begin < n_; begin += 512) {
    const std::size_t end = std::min(begin + 512, n_);
    for (std::size_t j = begin; j < end; ++j) torque[j] = 0.0;
    for (std::size_t k = 0; k < bristles; ++k) {
      const double length = (0.5 + (static_cast<double>(k) + 0.5) / bristles) * flexibility;
      double* tip = tip_ + k * n_;
      for (std::size_t j = begin; j < end; ++j) {
        const double limit = (base_ + by_motor_ * std::fabs(motor[j])) * length;
        const double z = std::min(std::max(angle[j] - tip[j], -limit), limit);
        tip[j] = angle[j] - z;
        torque[j] -= share * z;
      }
    }
  }
}

// Loop for the streaming limit.

namespace {

constexpr std::size_t stream_block = 256;

[[gnu::noinline]] float read_block(const float* column, std::size_t count) {
  float sum = 0.0f;
  for (std::size_t i = 0; i < count; ++i) sum += column[i];
  return sum;
}

[[gnu::noinline]] float rewrite_block(float* column, std::size_t count) {
  float sum = 0.0f;
  for (std::size_t i = 0; i < count; ++i) {
    const float value = 1.0f - column[i];  // 1 - x applied twice gives x, so values stay bounded
    column[i] = value;
    sum += value;
  }
  return sum;
}

}  // namespace

StreamLoop::StreamLoop(std::size_t n, int read_columns, int written_columns)
    : n_(n), stride_((n + 15) / 32 * 32 + 16), read_(read_columns), written_(written_columns) {
  memory_ = static_cast<float*>(take(static_cast<std::size_t>(read_columns) * stride_ * sizeof(float)));
}

StreamLoop::~StreamLoop() { give_back(memory_); }

double StreamLoop::step() noexcept {
  double sum = 0.0;
  for (std::size_t begin = 0; begin < n_; begin += stream_block) {
    const std::size_t count = n_ - begin < stream_block ? n_ - begin : stream_block;
    for (int c = 0; c < read_; ++c) {
      float* column = memory_ + static_cast<std::size_t>(c) * stride_ + begin;
      sum += static_cast<double>(c < written_ ? rewrite_block(column, count) : read_block(column, count));
    }
  }
  return sum;
}

std::size_t StreamLoop::bytes() const noexcept {
  return n_ * sizeof(float) * static_cast<std::size_t>(read_ + written_);
}

}  // namespace bristle::plain
