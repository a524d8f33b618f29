// The magnifying glass: which bristles are shown where, how they lean, and which have just snapped.
#pragma once

#include <cstddef>
#include <vector>

#include "tools/virtual_room/room_state.hpp"

namespace room {

/// One hair in the glass, or one cohort of the infinite brush: a sheet, as thick as its mass, of all the
/// bristles that were last straight at one place. Lengths in hairs, axes of the patch.
struct Hair {
  float root[2] = {0, 0}, lean[2] = {0, 0};
  float bent = 0;                ///< deflection over snap length, of a cohort over the mean one
  float flash = 0;               ///< 1 when it snaps, fading
  float half[2] = {thin, thin};  ///< half its thickness, in x and y
  float age_colour = 0;          ///< of `age`, for the renderer
  float age = 0;                 ///< s since it was last straight, as far as was seen
  static constexpr float thin = 0.030f;
};

/// Follows the bristles from picture to picture.
class BristleGlass {
 public:
  static constexpr float reach = 2.3f;            ///< radius of the floor shown, hairs
  static constexpr float lean_per_length = 0.8f;  ///< hairs, for a deflection of the mean snap length

  /// `elapsed`: s of a person's time since the last call; 0 while nothing moves.
  void update(const Snapshot& room, float elapsed);

  const std::vector<Hair>& hairs() const { return hairs_; }
  bool shows_cohorts() const { return cohorts_; }
  bool by_age = false;  ///< colour by age instead of by bending
  /// 0 to 1 on the scale of colours: 10 ms to 100 s.
  static float age_colour(float age_s);
  /// Snaps seen among the hairs since the last update.
  std::size_t snaps() const { return snaps_; }

 private:
  /// A cohort as it was seen: share of the bristles, deflection (m).
  struct Cohort {
    float mass = 0, zx = 0, zy = 0, age = 0;
  };

  void update_hairs(const Snapshot& room, float elapsed, float simulated);
  void update_cohorts(const Snapshot& room, float simulated);
  void find_snaps(const BristleView& now);

  BristleView before_;
  double time_ = 0;           // s, simulated, of before_
  double place_[2] = {0, 0};  // m, of the block
  bool cohorts_ = false;
  float grows_ = 0;
  std::vector<Cohort> seen_;
  std::vector<Hair> hairs_;
  std::vector<float> moves_;
  std::size_t snaps_ = 0;
};

}  // namespace room
