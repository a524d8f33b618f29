// Shows bristles in a magnifying glass: where hairs are drawn, how they lean, and which bristles have just
// snapped.
#pragma once

#include <cstddef>
#include <vector>

#include "tools/products/virtual_room/room_state.hpp"

namespace room {

/// Hair in the magnifying glass, which shows a bristle. For the infinite brush it shows a cohort (bristles
/// last straight at one place) as a sheet, as thick as its share of the bristles. Lengths are in hair
/// lengths, along the patch's axes.
struct Hair {
  float root[2] = {0, 0}, lean[2] = {0, 0};
  /// Deflection of a bristle over its snap length; for a cohort, over the mean snap length.
  float bent = 0;
  float flash = 0;               ///< brightness of a flash: 1 at a snap, then fading to 0
  float half[2] = {thin, thin};  ///< half thickness of hair or sheet along x and y
  float age_colour = 0;          ///< place of `age` on the renderer's colour scale, 0 to 1
  float age = 0;                 ///< time since the bristle was seen straight, s
  static constexpr float thin = 0.030f;
};

/// Magnifying glass that shows bristles: follows them from picture to picture and finds those that snapped.
class BristleGlass {
 public:
  static constexpr float reach = 2.3f;  ///< radius of the shown floor, in hair lengths

  /// Lean with which a hair is drawn, in hair lengths, at a deflection of one mean snap length.
  static constexpr float lean_per_length = 0.8f;

  /// Updates the hairs for a new picture. `elapsed` is the real time (s) since the last call; 0 while the
  /// room pauses.
  void update(const Snapshot& room, float elapsed);

  const std::vector<Hair>& hairs() const { return hairs_; }
  bool shows_cohorts() const { return cohorts_; }
  bool by_age = false;  ///< whether hairs have colours by age, not by bending

  /// Returns how many of the shown bristles were seen to snap in the last update.
  std::size_t snaps() const { return snaps_; }

 private:
  /// Cohort of the infinite brush as it was in the last picture: share of the bristles, deflection (m), age
  /// (s).
  struct Cohort {
    float mass = 0, zx = 0, zy = 0, age = 0;
  };

  void update_hairs(const Snapshot& room, float elapsed, float simulated);
  void update_cohorts(const Snapshot& room, float simulated);
  void find_snaps(const BristleView& now);

  BristleView before_;
  double time_ = 0;              // simulated time of the sample before_, s
  double position_[2] = {0, 0};  // position of the block in the sample before_, m
  bool cohorts_ = false;
  float grows_ = 0;
  std::vector<Cohort> seen_;
  std::vector<Hair> hairs_;
  std::vector<float> moves_;
  std::size_t snaps_ = 0;
};

}  // namespace room
