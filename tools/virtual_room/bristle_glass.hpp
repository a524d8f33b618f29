// Shows bristles in a magnifying glass: which ones are drawn where, how they lean, and which have just
// snapped.
#pragma once

#include <cstddef>
#include <vector>

#include "tools/virtual_room/room_state.hpp"

namespace room {

/// Hair in the glass. For the infinite brush it stands for a cohort (bristles last straight at the same
/// place), drawn as a sheet as thick as the cohort's share of the bristles. Lengths are in hair lengths, in
/// the axes of the patch.
struct Hair {
  float root[2] = {0, 0}, lean[2] = {0, 0};
  float bent = 0;                ///< deflection over snap length of a hair; for a cohort, over the mean snap
                                 ///< length
  float flash = 0;               ///< brightness of a flash: 1 at a snap, then fading
  float half[2] = {thin, thin};  ///< half of the thickness of hair or sheet in x and y
  float age_colour = 0;          ///< place of `age` on the colour scale, 0 to 1, for the renderer
  float age = 0;                 ///< s since the hair was last straight, as far as observed
  static constexpr float thin = 0.030f;
};

/// Follows the bristles from picture to picture and finds snaps.
class BristleGlass {
 public:
  static constexpr float reach = 2.3f;  ///< radius of the floor that is shown, in hair lengths

  /// Lean in hair lengths at a deflection of one mean snap length.
  static constexpr float lean_per_length = 0.8f;

  /// Updates the hairs. `elapsed` is the real time (s) since the last call; 0 in a pause.
  void update(const Snapshot& room, float elapsed);

  const std::vector<Hair>& hairs() const { return hairs_; }
  bool shows_cohorts() const { return cohorts_; }
  bool by_age = false;  ///< whether hairs are coloured by age instead of by bending

  /// Returns an age's place on the colour scale: 0 for 10 ms, 1 for 100 s.
  static float age_colour(float age_s);
  /// Returns the number of hairs seen to snap in the last update.
  std::size_t snaps() const { return snaps_; }

 private:
  /// Cohort in the last picture: share of the bristles, deflection (m), age (s).
  struct Cohort {
    float mass = 0, zx = 0, zy = 0, age = 0;
  };

  void update_hairs(const Snapshot& room, float elapsed, float simulated);
  void update_cohorts(const Snapshot& room, float simulated);
  void find_snaps(const BristleView& now);

  BristleView before_;
  double time_ = 0;           // s, simulated time at which before_ was taken
  double place_[2] = {0, 0};  // m, place of the block when before_ was taken
  bool cohorts_ = false;
  float grows_ = 0;
  std::vector<Cohort> seen_;
  std::vector<Hair> hairs_;
  std::vector<float> moves_;
  std::size_t snaps_ = 0;
};

}  // namespace room
