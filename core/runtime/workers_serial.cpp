#include "core/runtime/workers.hpp"

namespace bristle::detail {

struct Workers::Impl {};

Workers::Workers(int) : count_(1) {}
Workers::~Workers() = default;

void Workers::run(int tasks, void (*task)(void*, int), void* context) noexcept {
  for (int i = 0; i < tasks; ++i) task(context, i);
}

void Workers::warm_up() noexcept {}

}  // namespace bristle::detail
