// The rule of a bristle that slides (kernels/slide.hpp), for one bristle: against the table of turns, against
// the definition in tiny steps, and in vectors.
#include <catch2/catch.hpp>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "expect.hpp"
#include "reference_table.hpp"

#if __has_include(<xsimd/xsimd.hpp>)
#if defined(__SSE2__)
#define BRISTLE_ISA_SSE2 1
#define BRISTLE_KERNEL_ISA sse2
#elif defined(__aarch64__)
#define BRISTLE_ISA_NEON64 1
#define BRISTLE_KERNEL_ISA neon64
#endif
#endif
#include "kernels/slide.hpp"

using namespace bristle::detail;
using bristle_test::expect_near;

namespace {

struct Vector {
  double x, y;
};

/// Takes a step of a bristle that slides at the limit it holds.
template <class T, int axes, bool mean, bool energy, class V>
Slid<V> slide(V x, V y, V limit, V ex, V ey, V length) {
  const SlideStart<V> start = slide_start<T, axes>(x, y, ex, ey);
  const V path = least(path_to_slide<T, axes>(start, limit), length);
  return slide_after<T, axes, mean, energy>(start, path, limit, limit, ex, ey, length);
}

/// Moves one bristle by the definition: its tip stays where it touches while the root moves, and is pulled
/// after the root when the deflection exceeds the limit.
struct TinySteps {
  Vector z, integral{0.0, 0.0};
  double dissipated = 0.0;

  TinySteps(Vector start, double limit, Vector d, int steps) : z(start) {
    const double h = std::hypot(d.x, d.y) / steps;
    for (int i = 0; i < steps; ++i) {
      const Vector before = z;
      z = {z.x + d.x / steps, z.y + d.y / steps};
      const double norm = std::hypot(z.x, z.y);
      if (norm > limit) {
        dissipated += limit * (norm - limit);
        z = {z.x * limit / norm, z.y * limit / norm};
      }
      integral.x += 0.5 * h * (before.x + z.x);
      integral.y += 0.5 * h * (before.y + z.y);
    }
  }
};

template <class T>
Slid<T> step(Vector z, double limit, Vector d) {
  const double length = std::hypot(d.x, d.y);
  return slide<T, 2, true, true>(T(z.x), T(z.y), T(limit), T(d.x / length), T(d.y / length), T(length));
}

/// Draws a random deflection within the disc of radius `limit`; one in three is on its edge.
Vector draw_deflection(std::mt19937& random, double limit) {
  std::uniform_real_distribution<double> share(0.0, 1.0);
  const double angle = 2.0 * M_PI * share(random);
  const double r = random() % 3 == 0 ? limit : limit * std::sqrt(share(random));
  return {r * std::cos(angle), r * std::sin(angle)};
}

}  // namespace

TEST_CASE("a bristle that slides turns as the table says") {
  int rows = 0;
  for (const bristle_test::Row& row : bristle_test::read_table("slide_turn.csv")) {
    if (row.at("law") != "single") continue;
    ++rows;
    const double angle = bristle_test::number(row, "angle_deg") * M_PI / 180.0;
    const double y = bristle_test::number(row, "y_over_mean_limit");
    const Slid<double> end = step<double>({1.0, 0.0}, 1.0, {y * std::cos(angle), y * std::sin(angle)});
    expect_near(end.x, bristle_test::number(row, "fx"), 1e-6, "along the old direction");
    expect_near(end.y, bristle_test::number(row, "fy"), 1e-6, "across it");
  }
  CHECK(rows == 15);
}

TEST_CASE("a bristle that slides does what it does in tiny steps") {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  for (int trial = 0; trial < 300; ++trial) {
    const double limit = 0.3 + 2.0 * share(random);
    const Vector z = draw_deflection(random, limit);
    const double length = 4.0 * limit * share(random);
    const double angle = 2.0 * M_PI * share(random);
    const Vector d{length * std::cos(angle), length * std::sin(angle)};
    const TinySteps truth(z, limit, d, 40000);
    const auto compare = [&](const auto& end, double tolerance) {
      expect_near(static_cast<double>(end.x), truth.z.x, tolerance, "x");
      expect_near(static_cast<double>(end.y), truth.z.y, tolerance, "y");
      expect_near(static_cast<double>(end.integral_x), truth.integral.x, 4.0 * tolerance, "integral of x");
      expect_near(static_cast<double>(end.integral_y), truth.integral.y, 4.0 * tolerance, "integral of y");
      expect_near(static_cast<double>(end.dissipated), truth.dissipated, 9.0 * tolerance, "dissipated");
    };
    compare(step<double>(z, limit, d), 3e-4);
    compare(step<float>(z, limit, d), 3e-4);
  }
}

TEST_CASE("a straight slide cut in two is the slide in one, and its energies add up") {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  for (int trial = 0; trial < 20000; ++trial) {
    const double limit = 0.5 + share(random);
    const Vector z = draw_deflection(random, limit);
    const double angle = 2.0 * M_PI * share(random);
    const Vector e{std::cos(angle), std::sin(angle)};
    const double length = 6.0 * share(random) * share(random);
    const double part = length * share(random);
    const auto run = [&](double x, double y, double l) {
      return slide<double, 2, true, true>(x, y, limit, e.x, e.y, l);
    };
    const Slid<double> whole = run(z.x, z.y, length);
    const Slid<double> first = run(z.x, z.y, part);
    const Slid<double> second = run(first.x, first.y, length - part);
    expect_near(second.x, whole.x, 1e-12, "x");
    expect_near(second.y, whole.y, 1e-12, "y");
    expect_near(first.integral_x + second.integral_x, whole.integral_x, 1e-12, "integral of x");
    expect_near(first.integral_y + second.integral_y, whole.integral_y, 1e-12, "integral of y");
    expect_near(first.dissipated + second.dissipated, whole.dissipated, 1e-12, "dissipated");
    const double work = whole.integral_x * e.x + whole.integral_y * e.y;
    const double stored = 0.5 * (whole.x * whole.x + whole.y * whole.y - z.x * z.x - z.y * z.y);
    expect_near(work, stored + whole.dissipated, 1e-12, "work");
    bristle_test::expect(whole.dissipated >= 0.0, "friction takes energy");
    bristle_test::expect(std::hypot(whole.x, whole.y) <= limit * (1.0 + 1e-15), "within the limit");
  }
}

TEST_CASE("a bristle that slides at the ends of what it may meet") {
  const double l = 1.5;
  SECTION("exactly opposed it unloads through zero, and slides at the other side") {
    const Slid<double> end = slide<double, 2, true, true>(l, 0.0, l, -1.0, 0.0, 4.0 * l);
    CHECK(end.path == 2.0 * l);
    CHECK(end.x == -l);
    CHECK(end.y == 0.0);
    CHECK(end.dissipated == Approx(2.0 * l * l).epsilon(1e-15));
    CHECK(slide<double, 2, false, false>(l, 0.0, l, -1.0, 0.0, l).x == 0.0);
  }
  SECTION("far beyond the limit it lies along the motion") {
    const Slid<double> end = slide<double, 2, true, true>(0.0, l, l, 1.0, 0.0, 1e18);
    CHECK(end.x == l);
    CHECK(std::abs(end.y) < 1e-30);
    CHECK(end.integral_x == Approx(l * 1e18).epsilon(1e-15));
    CHECK(end.integral_y == Approx(l * l * M_PI / 2.0).epsilon(1e-15));
    const Slid<float> rough = slide<float, 2, true, true>(0.0f, 1.5f, 1.5f, 1.0f, 0.0f, 1e9f);
    CHECK(rough.x == 1.5f);
    CHECK(rough.integral_y == Approx(l * l * M_PI / 2.0).epsilon(3e-7));
  }
  SECTION("a limit of zero holds nothing, a length of zero moves nothing") {
    const Slid<double> none = slide<double, 2, true, true>(0.0, 0.0, 0.0, 0.6, 0.8, 2.0);
    CHECK(none.x == 0.0);
    CHECK(none.y == 0.0);
    CHECK(none.dissipated == 0.0);
    CHECK(none.integral_x == 0.0);
    const Slid<double> still = slide<double, 2, true, true>(0.3, -0.4, 0.5, 0.0, 0.0, 0.0);
    CHECK(still.x == 0.3);
    CHECK(still.y == -0.4);
    CHECK(still.dissipated == 0.0);
  }
  SECTION("a slide far shorter than the limit keeps its digits") {
    // Checks small paths s after a bend across the motion: the force along grows as s, the force across falls
    // by s^2 / 2 l, with l the limit.
    const float s = 1e-4f;
    const Slid<float> end = slide<float, 2, true, true>(0.6f, 0.8f, 1.0f, 1.0f, 0.0f, s);
    CHECK(end.dissipated == Approx(static_cast<double>(s) * 0.6).epsilon(1e-4));
    CHECK(end.integral_y == Approx(static_cast<double>(s) * 0.8).epsilon(1e-4));
  }
  SECTION("one axis") {
    const Slid<double> end = slide<double, 1, true, true>(1.0, 0.0, l, -1.0, 0.0, 4.0);
    CHECK(end.x == -l);
    CHECK(end.path == 2.5);
    CHECK(end.dissipated == l * 1.5);
    CHECK(end.integral_x == 0.5 * 2.5 * (1.0 - l) - l * 1.5);
    CHECK(slide<double, 1, false, false>(1.0, 0.0, l, 1.0, 0.0, 0.25).x == 1.25);
    CHECK(slide<double, 1, false, false>(l + 1e-9, 0.0, l, 1.0, 0.0, 0.25).path == 0.0);
  }
  SECTION("a bristle that holds more than it slides at drops to that, along itself") {
    const SlideStart<double> start = slide_start<double, 2>(0.0, 0.0, 0.6, 0.8);
    const double path = path_to_slide<double, 2>(start, 2.0);
    const Slid<double> end = slide_after<double, 2, true, true>(start, path, 2.0, l, 0.6, 0.8, 5.0);
    CHECK(end.x == Approx(l * 0.6).epsilon(1e-15));
    CHECK(end.y == Approx(l * 0.8).epsilon(1e-15));
    CHECK(end.dissipated == Approx(l * 3.0 + 0.5 * (4.0 - l * l)).epsilon(1e-15));
  }
}

TEST_CASE("exponential, logarithm and arctangent of a slide are right to a few units in the last place") {
  const auto compare = [](auto one) {
    using T = decltype(one);
    const double few = 4.0 * static_cast<double>(std::numeric_limits<T>::epsilon());
    for (double u = 1e-12; u < 200.0; u *= 1.07) {
      const T y = static_cast<T>(u);
      const double x = std::min(static_cast<double>(y), 80.0);
      const Decay<T> shrunk = decay<T>(y);
      expect_near(static_cast<double>(shrunk.left) / std::exp(-x), 1.0, few * (1.0 + x), "exp(-y)");
      expect_near(static_cast<double>(shrunk.lost) / -std::expm1(-x), 1.0, few, "1 - exp(-y)");
      if (u > 1.0) continue;
      expect_near(static_cast<double>(log_of_one_plus<T>(y, T(1))) / std::log1p(x), 1.0, few, "ln(1 + y)");
      expect_near(static_cast<double>(arc_tangent<T>(y)) / std::atan(x), 1.0, few, "arctan(y)");
      CHECK(arc_tangent<T>(-y) == -arc_tangent<T>(y));
    }
  };
  compare(1.0f);
  compare(1.0);
}

#if defined(BRISTLE_KERNEL_ISA)
namespace {

template <class T, int axes>
void compare_vectors() {
  constexpr int lanes = Lanes<T>::size;
  std::mt19937 random(23);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  for (int trial = 0; trial < 20000; ++trial) {
    alignas(64) T x[lanes], y[lanes], limit[lanes], ex[lanes], ey[lanes], length[lanes];
    for (int k = 0; k < lanes; ++k) {
      const double l = random() % 8 == 0 ? 0.0 : share(random);
      const Vector z = draw_deflection(random, l);
      const double angle = 2.0 * M_PI * share(random);
      x[k] = static_cast<T>(z.x);
      y[k] = static_cast<T>(axes == 1 ? 0.0 : z.y);
      limit[k] = static_cast<T>(l);
      ex[k] = static_cast<T>(axes == 1 ? (angle > M_PI ? 1.0 : -1.0) : std::cos(angle));
      ey[k] = static_cast<T>(axes == 1 ? 0.0 : std::sin(angle));
      length[k] = static_cast<T>(random() % 8 == 0 ? 0.0 : 4.0 * share(random) * share(random));
    }
    const Slid<Lanes<T>> all =
        slide<T, axes, true, true>(load(x), load(y), load(limit), load(ex), load(ey), load(length));
    for (int k = 0; k < lanes; ++k) {
      const Slid<T> one = slide<T, axes, true, true>(x[k], y[k], limit[k], ex[k], ey[k], length[k]);
      const auto same = [&](const Lanes<T>& vector, T number) {
        alignas(64) T lane[lanes];
        vector.store_aligned(lane);
        bristle_test::expect(std::memcmp(&lane[k], &number, sizeof(T)) == 0, "bits of a vector");
      };
      same(all.x, one.x);
      same(all.y, one.y);
      same(all.path, one.path);
      same(all.integral_x, one.integral_x);
      same(all.integral_y, one.integral_y);
      same(all.dissipated, one.dissipated);
    }
  }
}

}  // namespace

TEST_CASE("a vector of bristles that slide, each its own way, has the bits of one after the other") {
  compare_vectors<float, 1>();
  compare_vectors<float, 2>();
  compare_vectors<double, 1>();
  compare_vectors<double, 2>();
}
#endif
