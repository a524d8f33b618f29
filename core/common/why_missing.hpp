// Chooses the status of a motion whose patch or bed does not exist.
#pragma once

#include <cstdint>

#include "bristle/patch.hpp"

namespace bristle::detail {

/// Returns why no patch or bed has this id: no_capacity for the id that a full pool returns (KeyedPatches),
/// unknown_id for an id that was never added or is removed.
constexpr Status why_missing(std::uint64_t id) noexcept {
  return id == PatchId::no_capacity().value ? Status::no_capacity : Status::unknown_id;
}

}  // namespace bristle::detail
