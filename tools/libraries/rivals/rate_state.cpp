#include "tools/libraries/rivals/rate_state.hpp"

#include <algorithm>
#include <array>

namespace rivals {
namespace {

// Unknowns of the equations: the scaled spring force u = sigma0 z / (a N), the state psi, and the integral of
// u over time.
using Vector = std::array<double, 5>;
enum State : std::size_t { u_x, u_y, psi_, sum_x, sum_y };

struct Equations {
  double v0, mu0_over_a, b_over_a, length;
  double per_metre;  // change of the scaled spring force u per metre of spring stretch
  Pair v;            // velocity of the body, m/s

  struct Slip {
    double over_u, slope, speed;  // slider's speed V over |u|, its derivative by |u|, V itself
  };

  Slip slip(double u, double psi) const noexcept {
    const double c = mu0_over_a + b_over_a * psi;
    const double forward = 0.5 * std::exp(u - c), back = 0.5 * std::exp(-u - c);
    Slip s;
    s.speed = 2.0 * v0 * (forward - back);
    s.slope = 2.0 * v0 * (forward + back);
    s.over_u = u > 1e-4 ? s.speed / u : 2.0 * v0 * std::exp(-c) * (1.0 + u * u / 6.0);
    return s;
  }

  Vector rates(const Vector& q) const noexcept {
    const Pair u{q[u_x], q[u_y]};
    const Slip s = slip(rivals::length(u), q[psi_]);
    return {per_metre * (v.x - s.over_u * u.x), per_metre * (v.y - s.over_u * u.y),
            (v0 * std::exp(-q[psi_]) - s.speed) / length, u.x, u.y};
  }
};

// Factorised matrix 1/(gamma h) - J of the equations for u and psi. The time integrals need no row: they
// depend on u alone, and nothing depends on them.
class Matrix {
 public:
  Matrix(const Equations& eq, const Vector& q, double diagonal) noexcept : diagonal_(diagonal) {
    const Pair u{q[u_x], q[u_y]};
    const double size = length(u);
    const Equations::Slip s = eq.slip(size, q[psi_]);
    const Pair e = size > 0.0 ? (1.0 / size) * u : Pair{1.0, 0.0};
    const double along = s.slope - s.over_u;
    const double aged = eq.b_over_a * s.speed;  // derivative of the slider's speed by the state, -dV/dpsi
    m_ = {{{diagonal + eq.per_metre * (s.over_u + along * e.x * e.x), eq.per_metre * along * e.x * e.y,
            -eq.per_metre * aged * e.x},
           {eq.per_metre * along * e.x * e.y, diagonal + eq.per_metre * (s.over_u + along * e.y * e.y),
            -eq.per_metre * aged * e.y},
           {s.slope * e.x / eq.length, s.slope * e.y / eq.length,
            diagonal + (eq.v0 * std::exp(-q[psi_]) - aged) / eq.length}}};
    factorise();
  }

  Vector solve(Vector r) const noexcept {
    for (std::size_t k = 0; k < 3; ++k) {
      std::swap(r[k], r[pivot_[k]]);
      for (std::size_t i = k + 1; i < 3; ++i) r[i] -= m_[i][k] * r[k];
    }
    for (std::size_t k = 3; k-- > 0;) {
      for (std::size_t j = k + 1; j < 3; ++j) r[k] -= m_[k][j] * r[j];
      r[k] /= m_[k][k];
    }
    r[sum_x] = (r[sum_x] + r[u_x]) / diagonal_;
    r[sum_y] = (r[sum_y] + r[u_y]) / diagonal_;
    return r;
  }

 private:
  void factorise() noexcept {
    for (std::size_t k = 0; k < 3; ++k) {
      std::size_t p = k;
      for (std::size_t i = k + 1; i < 3; ++i) {
        if (std::fabs(m_[i][k]) > std::fabs(m_[p][k])) p = i;
      }
      pivot_[k] = p;
      std::swap(m_[k], m_[p]);
      for (std::size_t i = k + 1; i < 3; ++i) {
        m_[i][k] /= m_[k][k];
        for (std::size_t j = k + 1; j < 3; ++j) m_[i][j] -= m_[i][k] * m_[k][j];
      }
    }
  }

  double diagonal_;
  std::array<std::array<double, 3>, 3> m_{};
  std::array<std::size_t, 3> pivot_{};
};

// Coefficients of the Rodas4 method. Stage i starts at the old state plus the earlier stages times a_, and is
// driven by the earlier stages times c_ / h. The last two stages are corrections; the very last one is the
// error estimate.
constexpr double gamma_ = 0.25;
constexpr double a_[4][4] = {{1.544},
                             {0.9466785280815826, 0.2557011698983284},
                             {3.314825187068521, 2.896124015972201, 0.9986419139977817},
                             {1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950}};
constexpr double c_[5][5] = {
    {-5.6688},
    {-2.430093356833875, -0.2063599157091915},
    {-0.1073529058151375, -9.594562251023355, -20.47028614809616},
    {7.496443313967647, -10.24680431464352, -33.99990352819905, 11.70890893206160},
    {8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136, -6.058818238834054}};

// Advances the unknowns by a piece of h seconds of the step. Returns the estimated error of u and psi, by
// which the length of pieces is chosen.
double piece(const Equations& eq, Vector& q, double h) noexcept {
  const Matrix matrix(eq, q, 1.0 / (gamma_ * h));
  std::array<Vector, 6> k;
  Vector stage = q;
  for (std::size_t i = 0; i < 6; ++i) {
    if (i >= 1 && i <= 4) {
      stage = q;
      for (std::size_t j = 0; j < i; ++j) {
        for (std::size_t n = 0; n < 5; ++n) stage[n] += a_[i - 1][j] * k[j][n];
      }
    } else if (i == 5) {
      for (std::size_t n = 0; n < 5; ++n) stage[n] += k[4][n];
    }
    Vector r = eq.rates(stage);
    for (std::size_t j = 0; j < i; ++j) {
      for (std::size_t n = 0; n < 5; ++n) r[n] += c_[i - 1][j] / h * k[j][n];
    }
    k[i] = matrix.solve(r);
  }
  for (std::size_t n = 0; n < 5; ++n) q[n] = stage[n] + k[5][n];
  return std::max({std::fabs(k[5][u_x]), std::fabs(k[5][u_y]), std::fabs(k[5][psi_])});
}

void integrate(const Equations& eq, Vector& q, double dt) noexcept {
  // Largest number of pieces of a step. A slider that runs away on a soft spring needs some thousand.
  constexpr int most_pieces = 100'000;
  double left = dt, h = dt;
  for (int n = 0; n < most_pieces && left > 0.0; ++n) {
    h = std::min(h, left);
    Vector tried = q;
    const double error = piece(eq, tried, h) / RateState::tolerance;
    const bool finite = std::isfinite(error);
    if (finite && error <= 1.0) {
      q = tried;
      left -= h;
    }
    h *= finite ? std::clamp(0.9 * std::pow(std::max(error, 1e-12), -0.25), 0.1, 6.0) : 0.01;
  }
}

// Lets the slider slip at once, with its state worn off over Dc without healing, if it would be faster than
// e^60 v0. A load that falls at rest can leave a force so far above the law's that the speed would overflow.
void slip_at_once(const Equations& eq, Vector& q) noexcept {
  const double u = std::hypot(q[u_x], q[u_y]);
  const double excess = u - eq.mu0_over_a - eq.b_over_a * q[psi_] - 60.0;
  if (!(excess > 0.0)) return;
  const double per_slip = eq.per_metre - eq.b_over_a / eq.length;
  const double slip = per_slip > 0.0 ? std::min(excess / per_slip, u / eq.per_metre) : u / eq.per_metre;
  q[u_x] *= 1.0 - slip * eq.per_metre / u;
  q[u_y] *= 1.0 - slip * eq.per_metre / u;
  q[psi_] -= slip / eq.length;
}

}  // namespace

Force RateState::step(Pair displacement, double dt_s, double load_n) noexcept {
  if (!(load_n > 0.0)) {
    z = {};
    psi = 0.0;
    return {};
  }
  // Stretch of the spring, m, that belongs to a scaled force u of 1.
  const double unit = direct_effect * load_n / surface.stiffness;
  const Equations eq{.v0 = reference_speed,
                     .mu0_over_a = surface.kinetic_coefficient / direct_effect,
                     .b_over_a = state_effect / direct_effect,
                     .length = state_length,
                     .per_metre = 1.0 / unit,
                     .v = (1.0 / dt_s) * displacement};
  Vector q{z.x / unit, z.y / unit, psi, 0.0, 0.0};
  slip_at_once(eq, q);
  integrate(eq, q, dt_s);
  z = unit * Pair{q[u_x], q[u_y]};
  psi = q[psi_];
  return {-surface.stiffness * z, -(surface.stiffness * unit / dt_s) * Pair{q[sum_x], q[sum_y]}};
}

}  // namespace rivals
