// The magnifying glass: which bristles are shown where, how they lean, and which have just snapped.
#pragma once

#include <cstddef>
#include <vector>

#include "tools/virtual_room/room_state.hpp"

namespace room {

/// One hair in the glass. Lengths in hairs, axes of the patch.
struct Hair {
  float root[2] = {0, 0}, lean[2] = {0, 0};
  float bent = 0;   ///< deflection over snap length
  float flash = 0;  ///< 1 when it snaps, fading
};

/// Follows the bristles from picture to picture.
class BristleGlass {
 public:
  static constexpr float reach = 2.3f;            ///< radius of the floor shown, hairs
  static constexpr float lean_per_length = 0.8f;  ///< hairs, for a deflection of the mean snap length

  /// `elapsed`: s of a person's time since the last call; 0 while nothing moves.
  void update(const Snapshot& room, float elapsed);

  const std::vector<Hair>& hairs() const { return hairs_; }
  /// Snaps seen among the hairs since the last update.
  std::size_t snaps() const { return snaps_; }

 private:
  void find_snaps(const BristleView& now);

  BristleView before_;
  std::vector<Hair> hairs_;
  std::vector<float> moves_;
  std::size_t snaps_ = 0;
};

}  // namespace room
