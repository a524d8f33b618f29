// Implements the loops of plain_beds.hpp. Uses no standard containers, because it is compiled with flags for
// this machine alone, as plain_loops.cpp is.
#include "plain_beds.hpp"

#include <cmath>
#include <cstring>
#include <new>

namespace bristle::plain {

namespace {

float* take(std::size_t numbers) {
  const std::size_t bytes = numbers * sizeof(float);
  void* memory = ::operator new (bytes, std::align_val_t{64});
  std::memset(memory, 0, bytes);
  return static_cast<float*>(memory);
}

void give_back(void* memory) noexcept { ::operator delete (memory, std::align_val_t{64}); }

}  // namespace

DiscLoop::DiscLoop(int across, double radius_m, double limit_m, double force_limit_n)
    : n_(0), radius_m_(radius_m), limit_m_(limit_m), force_limit_n_(force_limit_n) {
  const auto most = static_cast<std::size_t>(across) * static_cast<std::size_t>(across);
  zx_ = take(most);
  zy_ = take(most);
  x_ = take(most);
  y_ = take(most);
  for (int j = 0; j < across; ++j)
    for (int i = 0; i < across; ++i) {
      const float x = static_cast<float>((2.0 * i + 1.0) / across - 1.0);
      const float y = static_cast<float>((2.0 * j + 1.0) / across - 1.0);
      if (x * x + y * y > 1.0f) continue;
      x_[n_] = x;
      y_[n_++] = y;
    }
}

DiscLoop::~DiscLoop() {
  give_back(zx_);
  give_back(zy_);
  give_back(x_);
  give_back(y_);
}

Wrench DiscLoop::step(double dx_m, double dy_m, double spin) noexcept {
  const float dx = static_cast<float>(dx_m / limit_m_), dy = static_cast<float>(dy_m / limit_m_);
  const float turn = static_cast<float>(spin * radius_m_ / limit_m_);
  float sum_x = 0.0f, sum_y = 0.0f, sum_t = 0.0f;
  float* __restrict zx = zx_;
  float* __restrict zy = zy_;
  const float* __restrict px = x_;
  const float* __restrict py = y_;
  for (std::size_t i = 0; i < n_; ++i) {
    const float x = zx[i] + dx - turn * py[i];
    const float y = zy[i] + dy + turn * px[i];
    const float n2 = x * x + y * y;
    const float back = n2 > 1.0f ? 1.0f / std::sqrt(n2) : 1.0f;
    const float end_x = x * back, end_y = y * back;
    zx[i] = end_x;
    zy[i] = end_y;
    sum_x += end_x;
    sum_y += end_y;
    sum_t += px[i] * end_y - py[i] * end_x;
  }
  const double each = -force_limit_n_ / static_cast<double>(n_);
  return {{each * static_cast<double>(sum_x), each * static_cast<double>(sum_y)},
          each * radius_m_ * static_cast<double>(sum_t)};
}

Fastsim::Fastsim(int nx, int ny, double a_m, double b_m, const double (&flexibility)[3], double friction,
                 double load_n)
    : nx_(nx), ny_(ny), a_(a_m), b_(b_m) {
  most_pressure_ = friction * 2.0 * load_n / (3.14159265358979 * a_m * b_m);
  for (int k = 0; k < 3; ++k) flexibility_[k] = flexibility[k];
  const auto columns = static_cast<std::size_t>(ny);
  memory_ = take(4 * columns);
  for (int j = 0; j < ny; ++j) {
    const double y = (2.0 * j + 1.0) / ny - 1.0;
    memory_[j] = static_cast<float>(y);
    memory_[ny + j] = static_cast<float>(std::sqrt(1.0 - y * y));
  }
}

Fastsim::~Fastsim() { give_back(memory_); }

Wrench Fastsim::solve(double creep_x, double creep_y, double spin) noexcept {
  // Makes the creepages dimensionless: tractions are in units of the friction bound at the middle, lengths
  // along the motion in units of the half width a, across in units of b.
  const float ux = static_cast<float>(a_ * creep_x / (flexibility_[0] * most_pressure_));
  const float uy = static_cast<float>(a_ * creep_y / (flexibility_[1] * most_pressure_));
  const float spin_x = static_cast<float>(a_ * b_ * spin / (flexibility_[2] * most_pressure_));
  const float spin_y = static_cast<float>(a_ * a_ * spin / (flexibility_[2] * most_pressure_));
  const float* __restrict y = memory_;
  const float* __restrict half = memory_ + ny_;
  float* __restrict px = memory_ + 2 * ny_;
  float* __restrict py = memory_ + 3 * ny_;
  std::memset(px, 0, 2 * static_cast<std::size_t>(ny_) * sizeof(float));
  const float width = 2.0f / static_cast<float>(nx_);
  float sum_x = 0.0f, sum_y = 0.0f, sum_t = 0.0f;
  for (int i = 0; i < nx_; ++i) {
    const float along = 1.0f - (static_cast<float>(i) + 0.5f) * width;
    for (int j = 0; j < ny_; ++j) {
      const float h = half[j];
      const float cell = width * h, x = along * h;
      const float tx = px[j] - cell * (ux - spin_x * y[j]);
      const float ty = py[j] - cell * (uy + spin_y * x);
      const float bound = h * h - x * x;
      const float n2 = tx * tx + ty * ty;
      const float back = n2 > bound * bound ? bound / std::sqrt(n2) : 1.0f;
      px[j] = tx * back;
      py[j] = ty * back;
      sum_x += cell * px[j];
      sum_y += cell * py[j];
      sum_t += cell * (static_cast<float>(a_) * x * py[j] - static_cast<float>(b_) * y[j] * px[j]);
    }
  }
  const double area = most_pressure_ * a_ * b_ * 2.0 / ny_;
  return {{area * static_cast<double>(sum_x), area * static_cast<double>(sum_y)},
          area * static_cast<double>(sum_t)};
}

HistorySprings::HistorySprings(std::size_t n, double friction, double stiffness_n_m, double load_n)
    : n_(n), friction_(friction), stiffness_(stiffness_n_m), load_(load_n), fx_(take(n)), fy_(take(n)) {}

HistorySprings::~HistorySprings() {
  give_back(fx_);
  give_back(fy_);
}

void HistorySprings::step(const float* dx_m, const float* dy_m, const float* load_n, float* fx_n,
                          float* fy_n) noexcept {
  const float friction = static_cast<float>(friction_), stiffness = static_cast<float>(stiffness_);
  const float over_load = static_cast<float>(1.0 / load_);
  for (std::size_t i = 0; i < n_; ++i) {
    const float k = stiffness * std::cbrt(load_n[i] * over_load);
    const float x = fx_[i] - k * dx_m[i], y = fy_[i] - k * dy_m[i];
    const float limit = friction * load_n[i];
    const float n2 = x * x + y * y;
    const float back = n2 > limit * limit ? limit / std::sqrt(n2) : 1.0f;
    fx_n[i] = fx_[i] = x * back;
    fy_n[i] = fy_[i] = y * back;
  }
}

}  // namespace bristle::plain
