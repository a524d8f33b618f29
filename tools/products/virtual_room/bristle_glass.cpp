#include "tools/products/virtual_room/bristle_glass.hpp"

#include <algorithm>
#include <cmath>

namespace room {

namespace {

constexpr float flash_lasts_s = 0.22f;
// Deflection over snap length above which a bristle that snapped gets no flash in the magnifying glass,
// because it has bent again since.
constexpr float bent_after_flash = 0.25f;

// Gives the hair number i its place in the disc of the magnifying glass. Multiples of the golden angle cover
// the disc evenly.
void place_root(std::size_t i, std::size_t count, float (&root)[2]) {
  const float radius =
      0.86f * BristleGlass::reach * std::sqrt((static_cast<float>(i) + 0.5f) / static_cast<float>(count));
  const float angle = 2.39996323f * static_cast<float>(i);
  root[0] = radius * std::cos(angle);
  root[1] = radius * std::sin(angle);
}

// Sets the lean with which a hair is drawn, by its deflection and the mean snap length (m). Limits it,
// because a hair bent beyond two mean snap lengths would lie on the floor.
void lean(Hair& hair, float zx, float zy, float mean) {
  const float scale = BristleGlass::lean_per_length / mean *
                      std::min(1.0f, 2.2f * mean / std::max(std::hypot(zx, zy), 1e-12f));
  hair.lean[0] = scale * zx;
  hair.lean[1] = scale * zy;
}

float bent(const BristleView& view, std::size_t i) {
  return view.snap_length[i] > 0 ? std::hypot(view.zx[i], view.zy[i]) / view.snap_length[i] : 0.0f;
}

float median(std::vector<float>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

// Finds the bristles that snapped between two pictures: they did not move with the block, whose motion is the
// median of all.
void BristleGlass::find_snaps(const BristleView& now) {
  snaps_ = 0;
  const std::size_t count = hairs_.size();
  if (now.key != before_.key || now.count != before_.count || count == 0) return;
  float displacement[2];
  for (int axis = 0; axis < 2; ++axis) {
    moves_.clear();
    for (std::size_t i = 0; i < count; ++i)
      moves_.push_back(axis == 0 ? now.zx[i] - before_.zx[i] : now.zy[i] - before_.zy[i]);
    displacement[axis] = median(moves_);
  }
  for (std::size_t i = 0; i < count; ++i) {
    const float x = now.zx[i] - before_.zx[i] - displacement[0],
                y = now.zy[i] - before_.zy[i] - displacement[1];
    // Counts a bristle as snapped if its snap length was redrawn. Ageing changes the length too, but by less.
    const bool redrawn =
        std::abs(now.snap_length[i] - before_.snap_length[i]) > grows_ * before_.snap_length[i];
    if (!redrawn && x * x + y * y < 0.04f * now.snap_length[i] * now.snap_length[i]) continue;
    // Lights up a bristle that snapped, unless it has bent again since. In fast sliding all bristles snap
    // between two pictures, and all would flash.
    if (bent(now, i) < bent_after_flash) hairs_[i].flash = 1.0f;
    hairs_[i].age = 0.0f;
    ++snaps_;
  }
}

/// Returns where on the colour scale an age (s) is: from 0 for 10 ms to 1 for 100 s.
static float age_colour(float age_s) {
  return std::clamp((std::log10(std::max(age_s, 1e-6f)) + 2.0f) / 4.0f, 0.0f, 1.0f);
}

void BristleGlass::update(const Snapshot& room, float elapsed) {
  const double simulated = room.time - time_;
  const bool continues =
      simulated >= 0 && room.bristles.key == before_.key && cohorts_ == room.settings.infinite;
  if (!continues) {
    hairs_.clear();
    seen_.clear();
  }
  cohorts_ = room.settings.infinite;
  // Largest relative growth of a snap length by ageing between two pictures. A larger growth means a new snap
  // length.
  grows_ = room.settings.growth_per_decade > 0.0 ? 0.02f : 0.0f;
  const float passed = continues && std::isfinite(simulated) ? static_cast<float>(simulated) : 0.0f;
  if (cohorts_) {
    update_cohorts(room, passed);
  } else {
    // Fades flashes by the simulated time if no time passes for the user: the room pauses and shows another
    // moment.
    update_hairs(room, elapsed > 0.0f ? elapsed : passed, passed);
  }
  for (Hair& hair : hairs_) hair.age_colour = age_colour(hair.age);
  before_ = room.bristles;
  time_ = room.time;
  for (int axis = 0; axis < 2; ++axis) position_[axis] = room.block_position[axis];
}

// Shows the cohorts of an infinite brush as groups of hairs, in proportion to their shares of the bristles.
// (The bristles of a cohort were last straight at one place and bend alike.) A cohort that moved with the
// block since the last picture is taken for the same; any other is new.
void BristleGlass::update_cohorts(const Snapshot& room, float simulated) {
  const BristleView& now = room.bristles;
  const std::size_t count = std::min(now.count, bristles_shown);
  const double mean = std::max(room.presliding_length, 1e-12);
  const float share = 1.0f / static_cast<float>(std::max<std::size_t>(count, 1));
  std::vector<Cohort> found;
  for (std::size_t i = 0; i < count; ++i) {
    if (!std::isfinite(now.zx[i]) || !std::isfinite(now.zy[i])) continue;
    if (i == 0 || found.empty() || now.zx[i] != now.zx[i - 1] || now.zy[i] != now.zy[i - 1])
      found.push_back({0, now.zx[i], now.zy[i], 0});
    found.back().mass += share;
  }
  const double moved[2] = {room.block_position[0] - position_[0], room.block_position[1] - position_[1]};
  const auto near = static_cast<float>(0.003 * mean);
  for (Cohort& cohort : found) {
    for (const Cohort& old : seen_) {
      const float x = old.zx + static_cast<float>(moved[0]) - cohort.zx,
                  y = old.zy + static_cast<float>(moved[1]) - cohort.zy;
      if (std::abs(x) < near && std::abs(y) < near) cohort.age = std::max(cohort.age, old.age + simulated);
    }
  }
  seen_ = found;
  // Draws cohorts side by side in the order of their bending, each as wide as its share of the bristles.
  std::sort(found.begin(), found.end(), [](const Cohort& a, const Cohort& b) { return a.zx < b.zx; });
  hairs_.resize(found.size());
  float from = -0.86f * reach;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const Cohort& cohort = found[i];
    Hair& hair = hairs_[i];
    const float wide = 2 * 0.86f * reach * cohort.mass, x = from + 0.5f * wide;
    from += wide;
    hair.root[0] = x;
    hair.root[1] = 0;
    hair.half[0] = std::max(0.40f * wide, 0.4f * Hair::thin);
    hair.half[1] = 0.8f * std::sqrt(std::max(0.9f * reach * reach - x * x, 0.04f));
    lean(hair, cohort.zx, cohort.zy, static_cast<float>(mean));
    hair.bent = std::hypot(cohort.zx, cohort.zy) / static_cast<float>(mean);
    hair.flash = 0;
    hair.age = cohort.age;
  }
  snaps_ = 0;
}

void BristleGlass::update_hairs(const Snapshot& room, float elapsed, float simulated) {
  const BristleView& now = room.bristles;
  const std::size_t count = std::min(now.count, bristles_shown);
  if (hairs_.size() != count || now.key != before_.key) {
    hairs_.assign(count, Hair{});
    for (std::size_t i = 0; i < count; ++i) place_root(i, count, hairs_[i].root);
  }
  for (Hair& hair : hairs_) {
    hair.flash = std::max(0.0f, hair.flash - elapsed / flash_lasts_s);
    hair.age += simulated;
  }
  find_snaps(now);
  const float mean = static_cast<float>(std::max(room.presliding_length, 1e-12));
  for (std::size_t i = 0; i < count; ++i) {
    lean(hairs_[i], now.zx[i], now.zy[i], mean);
    hairs_[i].bent = bent(now, i);
    if (hairs_[i].bent > 2 * bent_after_flash) hairs_[i].flash = 0.0f;
  }
}

}  // namespace room
