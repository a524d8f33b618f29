// Invented states of the virtual room (a block pushed over a floor), for tests of the drawing. The figures
// are plausible, not computed by physics.
#pragma once

#include <cmath>

#include "tools/products/virtual_room/room_state.hpp"

namespace made_up {

/// Returns a state of the room: the block at x on four patches, whose bristles are bent by `bent` mean snap
/// lengths, while the tool pushes it with the force of friction.
inline room::Snapshot room_with_block_at(double x, double friction_n, double bent) {
  room::Snapshot r;
  const room::RoomMeasures measures;
  r.time = 1.0;
  r.kinetic_coefficient = r.settings.kinetic;
  r.peak_coefficient = r.settings.peak;
  r.presliding_length = r.settings.presliding_length;
  r.block_position[0] = x;
  r.block_position[2] = measures.block[2] / 2;
  r.tool[0] = x - measures.block[0] / 2 - measures.tool_radius;
  r.tool[2] = 0.02;
  r.held = true;
  r.device[0] = r.tool[0] + 0.045;
  r.device[2] = 0.05;
  r.applied[0] = friction_n;
  r.friction[0] = -friction_n;
  for (const double side : {-1.0, 1.0}) {
    for (const double end : {-1.0, 1.0}) {
      room::ContactView& c = r.contact[r.contacts++];
      c.key = r.contacts;
      c.point[0] = x + end * 0.94 * measures.block[0] / 2;
      c.point[1] = side * 0.94 * measures.block[1] / 2;
      c.load = 0.25 * 0.25 * 9.81;
      c.friction[0] = -friction_n / 4;
      c.limit = 0.46 * c.load;
    }
  }
  r.bristles.key = 1;
  r.bristles.total = r.settings.bristles;
  r.bristles.count = room::bristles_shown;
  for (std::size_t i = 0; i < r.bristles.count; ++i) {
    const double u = std::fmod(0.5 + 0.6180339887 * static_cast<double>(i), 1.0);
    const double snap = r.presliding_length * (0.6 + 0.8 * u);
    r.bristles.snap_length[i] = static_cast<float>(snap);
    r.bristles.zx[i] = static_cast<float>(std::fmod(bent * r.presliding_length, snap));
  }
  r.bristles_total = 4ull * r.settings.bristles;
  r.loop.ticks = 1000;
  r.loop.p50 = 60e-6;
  r.loop.p99 = 120e-6;
  r.loop.max = 300e-6;
  r.loop.period_p50 = 1.000e-3;
  r.loop.period_p99 = 1.040e-3;
  return r;
}

}  // namespace made_up
