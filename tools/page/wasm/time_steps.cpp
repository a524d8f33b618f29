// Times a step of the page's block with 10,000 bristles, pulled at 10 mm/s, and with the infinite brush.
#include <chrono>
#include <cstdio>

#include "../block.hpp"

int main() {
  using Clock = std::chrono::steady_clock;
  for (const bool infinite : {false, true}) {
    page::Block block;
    page::BlockSettings settings;
    settings.infinite = infinite;
    settings.bristles = infinite ? 0 : 10000;
    settings.coefficients.with_presliding_length(0.5e-3);
    block.set(settings);
    block.grab();
    constexpr int steps = 3000;
    const Clock::time_point begin = Clock::now();
    for (int i = 0; i < steps; ++i) {
      block.move_hand(1e-5 * i);
      block.step();
    }
    const double us = std::chrono::duration<double, std::micro>(Clock::now() - begin).count() / steps;
    std::printf("%s  %-8s  %7.1f us a step, at %.3f mm with %.3f N\n", bristle::PatchBatch().isa(),
                infinite ? "cohorts" : "bristles", us, 1e3 * block.position(), block.response().end[0]);
  }
}
