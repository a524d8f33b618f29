#include "tools/virtual_room/haptic_loop.hpp"

namespace room {

struct HapticLoop::Impl {
  explicit Impl(const LoopOptions& o) : options(o) {}
  LoopOptions options;
  Exchange exchange;
};

HapticLoop::HapticLoop(const LoopOptions& options, std::unique_ptr<Device>)
    : impl_(std::make_unique<Impl>(options)) {}
HapticLoop::~HapticLoop() { stop(); }
void HapticLoop::start() {}
void HapticLoop::stop() {}
void HapticLoop::advance(std::uint64_t) {}
Exchange& HapticLoop::exchange() noexcept { return impl_->exchange; }
double HapticLoop::rate_hz() const noexcept { return impl_->options.rate_hz; }
std::uint64_t HapticLoop::state_hash() const noexcept { return 0; }

}  // namespace room
