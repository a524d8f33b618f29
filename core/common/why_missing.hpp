// Chooses the status of a motion whose patch or bed does not exist.
#pragma once

#include <cstdint>

#include "bristle/patch.hpp"

namespace bristle::detail {

/// Returns why a batch has no patch or bed of this id: no_capacity if its pool was full, unknown_id if it was
/// never added or is removed.
constexpr Status why_missing(std::uint64_t id) noexcept {
  return id == PatchId::no_capacity().value ? Status::no_capacity : Status::unknown_id;
}

}  // namespace bristle::detail
