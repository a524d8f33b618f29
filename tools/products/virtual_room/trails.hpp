// Records the paths of the blocks' centres since the scene began, for drawing.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "tools/products/virtual_room/compared.hpp"
#include "tools/products/virtual_room/renderer.hpp"
#include "tools/products/virtual_room/room_state.hpp"

namespace room {

class Trails {
 public:
  static constexpr std::size_t blocks = 1 + most_compared;
  static constexpr float spacing = 0.004f;  ///< distance between stored points of a path, m

  /// Limit of a path's points; beyond it the oldest are removed, except the first.
  static constexpr std::size_t most = 200;

  /// Adds the blocks' places in a picture. Clears all paths if the scene begins again, or if a carriage moves
  /// the blocks.
  void update(const Snapshot& room) {
    const bool again = room.time < time_ || room.settings.compare != scene_;
    time_ = room.time;
    scene_ = room.settings.compare;
    if (again || scene_of(scene_).driven) {
      for (auto& way : ways_) way.clear();
      if (scene_of(scene_).driven) return;
    }
    take(0, to_vector(room.block_position), 0.0f);
    for (std::size_t i = 0; i < most_compared; ++i) {
      if (i < room.compared)
        take(i + 1, to_vector(room.beside[i].position), aside_of(i));
      else
        ways_[i + 1].clear();
    }
  }
  /// Returns the path of a block's centre (m, room axes), shifted to where the block is drawn.
  const std::vector<Eigen::Vector3f>& way(std::size_t block) const { return ways_[block]; }

 private:
  void take(std::size_t block, Eigen::Vector3f at, float aside) {
    at.y() += aside;
    at.z() = 0.0f;
    auto& way = ways_[block];
    if (!at.allFinite()) return;
    if (!way.empty() && (at - way.back()).norm() < spacing) return;
    if (way.size() == most) way.erase(way.begin() + 1);
    way.push_back(at);
  }

  std::array<std::vector<Eigen::Vector3f>, blocks> ways_;
  double time_ = 0.0;
  Comparison scene_ = Comparison::none;
};

}  // namespace room
