// How many representatives stand for a patch, changed while it is in contact.
#pragma once

#include <cstdint>

namespace bristle::detail {

struct PatchState;

/// The patch goes on with `bristles` representatives, 1 to its n, under the same elastic force; nothing
/// snaps. The energy that leaves is booked with the next step (where the patch computes energy).
void change_detail(PatchState& patch, std::uint32_t bristles) noexcept;

}  // namespace bristle::detail
