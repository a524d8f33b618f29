// The elasto-plastic model: LuGre whose bristle is purely elastic up to a break-away deflection.
//
//   dz/dt = v - alpha(z, v) |v| z / zss(v)        F = sigma0 z + sigma1 dz/dt + sigma2 v
//   alpha = 0 where z and v oppose or |z| <= zba;  1 where |z| >= zss;
//           (1 + sin(pi (|z| - (zss + zba)/2) / (zss - zba))) / 2 between
//
// F is friction, z the deflection, v the velocity, sigma0, sigma1 and sigma2 stiffness, damping and viscous
// coefficient; zba and zss are the deflections at break-away and in steady sliding.
//
// Source: Dupont, Hayward, Armstrong, Altpeter, Single state elastoplastic friction models, IEEE TAC 47(5),
// 2002. zba is a share of the deflection Fs / sigma0 (but below zss(v) at every speed). Elastic parts of a
// step are exact straight lines. In the plastic band alpha is frozen over pieces of path along which |z| grows
// by at most a sixteenth of the band, each an exact exponential cut at zss; once alpha is 1 up to rounding, the rest is one exponential. A
// step is stable at every length, at bounded cost. In the plane z is a vector, and "oppose" means z . v < 0
// (our extension). At forces below zba sigma0 the model neither drifts nor has hysteresis.
#pragma once

#include "tools/libraries/rivals/pair.hpp"

namespace rivals {

struct ElastoPlastic {
  Surface surface;
  double elastic_share = 0.9;  ///< break-away deflection zba over Fs / sigma0, 0 to 1
  Pair z;                      ///< deflection of the bristle, m

  Force step(Pair displacement, double dt_s, double load_n) noexcept;
};

}  // namespace rivals
