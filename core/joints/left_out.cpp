// Stands in for joints in a build with BRISTLE_MINIMAL, which has none.
#include "bristle/error.hpp"
#include "bristle/joint_friction.hpp"

namespace bristle {

struct JointFriction::Impl {};

JointFriction::JointFriction(std::size_t, Span<const JointMaterial>, const JointOptions&,
                             const BatchOptions&) {
  throw Error("JointFriction: left out of this library; build it with BRISTLE_MINIMAL=OFF");
}
JointFriction::~JointFriction() = default;
JointFriction::JointFriction(JointFriction&&) noexcept = default;
JointFriction& JointFriction::operator=(JointFriction&&) noexcept = default;
StepReport JointFriction::step(const JointInput&, const JointOutput&) noexcept { return {}; }
StepReport JointFriction::find_torque(const JointInput&, const JointOutput&) noexcept { return {}; }
void JointFriction::reset() noexcept {}
bool JointFriction::reset(std::size_t) noexcept { return false; }
std::uint64_t JointFriction::state_hash(std::size_t) const noexcept { return 0; }
std::uint64_t JointFriction::state_hash() const noexcept { return 0; }
std::size_t JointFriction::state_size() const noexcept { return 0; }
std::size_t JointFriction::save_state(Span<std::byte>) const noexcept { return 0; }
void JointFriction::restore_state(Span<const std::byte>) {}
std::size_t JointFriction::joint_count() const noexcept { return 0; }
std::size_t JointFriction::memory_bytes() const noexcept { return 0; }
int JointFriction::threads() const noexcept { return 0; }
const char* JointFriction::isa() const noexcept { return ""; }

}  // namespace bristle
