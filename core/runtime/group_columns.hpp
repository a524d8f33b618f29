// Steps the contacts of a group (GroupStep) in blocks of sixteen, and moves their numbers between the
// caller's arrays and the kernels.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "bristle/patch_group.hpp"
#include "core/patches/lanes/lane_block.hpp"

namespace bristle::detail {

/// Result of stepping some motions, cells or blocks: bristles visited, patches stepped, and status flags.
struct StepOutcome {
  std::uint64_t visited = 0;
  std::uint32_t stepped = 0;
  Status status = Status::ok;
};

/// Returns the motion of one contact of a group, gathered from the arrays, by the contact's index.
Motion motion_of(const GroupStep& step, std::size_t contact) noexcept;
/// Writes the response of one contact to the caller's arrays. `computed`: outputs that the group's options
/// ask for; arrays of others are left alone.
void write_response(const GroupStep& step, std::size_t contact, Outputs computed,
                    const Response& response) noexcept;

/// Calls visit(contact) for the index of each contact of a group that a step names.
template <class Visit>
void for_each_named(const GroupStep& step, Visit&& visit) {
  if (step.which.has_value())
    for (const std::uint32_t i : *step.which) visit(std::size_t{i});
  else
    for (std::size_t i = 0; i < step.group.size(); ++i) visit(i);
}

/// Memory for motions and responses of contacts of a group that cannot be stepped in blocks but only one by
/// one, as patches.
struct GroupRoom {
  GroupRoom() = default;
  explicit GroupRoom(std::size_t count) : motions(count), responses(count), contacts(count) {}
  std::vector<Motion> motions;
  std::vector<Response> responses;
  std::vector<std::size_t> contacts;  ///< index of each motion's contact
};

/// Arrays and time step of a group's step. Requires that the state of all contacts of the group lies in their
/// blocks (lend()).
struct GroupColumns {
  double dt;
  const GroupStep& step;
  bool stores;  ///< whether the step changes the state; false for a trial

  /// Steps those contacts of a block that the step asks for (LaneBlock::asked).
  void step_block(LaneBlock& block, StepOutcome& outcome) const noexcept;
};

}  // namespace bristle::detail
