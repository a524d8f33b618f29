// Steps blocks of sixteen contacts between a caller's arrays (GroupStep) and the kernels of contacts in
// lanes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "bristle/patch_group.hpp"
#include "core/patches/lanes/lane_block.hpp"

namespace bristle::detail {

/// Result of stepping some motions, cells or blocks.
struct StepOutcome {
  std::uint64_t visited = 0;
  std::uint32_t stepped = 0;
  Status status = Status::ok;
};

/// Returns the motion of a contact of the group, by its index.
Motion motion_of(const GroupStep& step, std::size_t contact) noexcept;
/// Writes the response of a contact to the arrays. `computed`: outputs of its group.
void write_response(const GroupStep& step, std::size_t contact, Outputs computed,
                    const Response& response) noexcept;

/// Calls visit(contact) for each contact that a step names.
template <class Visit>
void for_each_named(const GroupStep& step, Visit&& visit) {
  if (step.which.has_value())
    for (const std::uint32_t i : *step.which) visit(std::size_t{i});
  else
    for (std::size_t i = 0; i < step.group.size(); ++i) visit(i);
}

/// Memory for motions and responses of those contacts of a group that have to be stepped as patches.
struct GroupRoom {
  GroupRoom() = default;
  explicit GroupRoom(std::size_t count) : motions(count), responses(count), contacts(count) {}
  std::vector<Motion> motions;
  std::vector<Response> responses;
  std::vector<std::size_t> contacts;  ///< index of each motion's contact
};

/// The blocks of a group, for groups whose contacts are all lent to their blocks (lend()).
struct GroupColumns {
  double dt;
  const GroupStep& step;
  bool stores;  ///< whether the step changes the state; false for a trial

  /// Steps the contacts `LaneBlock::asked` of a block.
  void step_block(LaneBlock& block, StepOutcome& outcome) const noexcept;
};

}  // namespace bristle::detail
