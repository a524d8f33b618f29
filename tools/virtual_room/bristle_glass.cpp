#include "tools/virtual_room/bristle_glass.hpp"

#include <algorithm>
#include <cmath>

namespace room {

namespace {

constexpr float flash_lasts_s = 0.22f;
constexpr float bent_after_flash = 0.25f;  // of the snap length

// The golden angle spreads any number of points evenly over a disc.
void place_root(std::size_t i, std::size_t count, float (&root)[2]) {
  const float radius =
      0.86f * BristleGlass::reach * std::sqrt((static_cast<float>(i) + 0.5f) / static_cast<float>(count));
  const float angle = 2.39996323f * static_cast<float>(i);
  root[0] = radius * std::cos(angle);
  root[1] = radius * std::sin(angle);
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

// All bristles that do not snap move by the same displacement: the median. Who moved otherwise has snapped.
void BristleGlass::find_snaps(const BristleView& now) {
  snaps_ = 0;
  const std::size_t count = hairs_.size();
  if (now.key != before_.key || now.count != before_.count || count == 0) return;
  float displacement[2];
  for (int axis = 0; axis < 2; ++axis) {
    moves_.clear();
    for (std::size_t i = 0; i < count; ++i) {
      moves_.push_back(axis == 0 ? now.zx[i] - before_.zx[i] : now.zy[i] - before_.zy[i]);
    }
    displacement[axis] = median(moves_);
  }
  for (std::size_t i = 0; i < count; ++i) {
    const float x = now.zx[i] - before_.zx[i] - displacement[0],
                y = now.zy[i] - before_.zy[i] - displacement[1];
    const bool redrawn = now.snap_length[i] != before_.snap_length[i];
    if (!redrawn && x * x + y * y < 0.04f * now.snap_length[i] * now.snap_length[i]) continue;
    // One that has bent again since is no news: in fast sliding all snap between two pictures.
    if (bent(now, i) < bent_after_flash) hairs_[i].flash = 1.0f;
    ++snaps_;
  }
}

void BristleGlass::update(const Snapshot& room, float elapsed) {
  const BristleView& now = room.bristles;
  const std::size_t count = std::min(now.count, bristles_shown);
  if (hairs_.size() != count || now.key != before_.key) {
    hairs_.assign(count, Hair{});
    for (std::size_t i = 0; i < count; ++i) place_root(i, count, hairs_[i].root);
  }
  for (Hair& hair : hairs_) hair.flash = std::max(0.0f, hair.flash - elapsed / flash_lasts_s);
  find_snaps(now);
  const float mean = static_cast<float>(std::max(room.presliding_length, 1e-12));
  for (std::size_t i = 0; i < count; ++i) {
    const float z = std::hypot(now.zx[i], now.zy[i]);
    // Hairs longer bent than two mean lengths would lie on the floor.
    const float scale = lean_per_length / mean * std::min(1.0f, 2.2f * mean / std::max(z, 1e-12f));
    hairs_[i].lean[0] = scale * now.zx[i];
    hairs_[i].lean[1] = scale * now.zy[i];
    hairs_[i].bent = bent(now, i);
    if (hairs_[i].bent > 2 * bent_after_flash) hairs_[i].flash = 0.0f;
  }
  before_ = now;
}

}  // namespace room
