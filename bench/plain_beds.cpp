// Implements the loops of plain_beds.hpp. Compiled with flags for this machine alone, as plain_loops.cpp is,
// so it uses no standard containers: the linker might share their inline functions with code for other
// machines.
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
  // Makes the creepages dimensionless. Tractions are in units of the friction bound at the middle, lengths
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

}  // namespace bristle::plain
