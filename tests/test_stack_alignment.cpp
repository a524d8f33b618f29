// Steps every kernel on stacks of every alignment that a caller may give. Windows and System V promise 16
// bytes only, so that a kernel that moves 32 or 64 bytes to its stack as aligned must align its frame itself.
#include <catch2/catch.hpp>

#include <cstdint>
#include <vector>

#include "contract_kinds.hpp"

namespace bristle_test::test_stack_alignment {

#if defined(__x86_64__)

namespace {

/// Calls function(argument) with a stack pointer that is `offset`, a multiple of 16, modulo 64 before the
/// call. Returns that stack pointer.
[[gnu::noinline]] std::uintptr_t call_on_stack(std::uintptr_t offset, void (*function)(void*),
                                               void* argument) {
  // Lowers the stack by more than a red zone. The argument goes into the first register of both conventions,
  // and the 32 bytes above the call are those that Windows gives a function.
  void* second = argument;
  std::uintptr_t at = 0;
  asm volatile(
      "mov %%rsp, %%rbx\n\t"
      "sub $512, %%rsp\n\t"
      "and $-64, %%rsp\n\t"
      "sub %[offset], %%rsp\n\t"
      "call *%[function]\n\t"
      "mov %%rsp, %[at]\n\t"
      "mov %%rbx, %%rsp"
      : "+D"(argument), "+c"(second), [at] "=&a"(at)
      : [offset] "r"((64 - offset) % 64), [function] "r"(function)
      : "rbx", "rdx", "rsi", "r8", "r9", "r10", "r11", "xmm0", "xmm1", "xmm2", "xmm3", "xmm4", "xmm5", "xmm6",
        "xmm7", "xmm8", "xmm9", "xmm10", "xmm11", "xmm12", "xmm13", "xmm14", "xmm15", "cc", "memory");
  return at;
}

template <class Function>
std::uintptr_t call_on_stack(std::uintptr_t offset, Function&& function) {
  return call_on_stack(
      offset, [](void* it) { (*static_cast<Function*>(it))(); }, &function);
}

}  // namespace

TEST_CASE("Every kernel steps on a stack of any alignment of 16 bytes", "[kernels]") {
  std::vector<contract::Kind> kinds = contract::all_kinds();
  kinds.push_back(contract::variants(70));
  for (const contract::Kind& kind : kinds)
    for (const bristle::IsaInfo& isa : bristle::instruction_sets()) {
      if (!isa.usable) continue;
      INFO(isa.name << ", " << kind.name);
      const auto subject = kind.make({BatchOptions{}.with_isa(isa.name).with_threads(1)});
      for (int k = 5; k < 12; ++k) {
        const std::vector<std::byte> before = subject->save();
        contract::Answers aligned, answers;
        for (const std::uintptr_t offset : {0u, 16u, 32u, 48u}) {
          subject->restore(before);
          CHECK(call_on_stack(offset, [&] { answers = subject->step(k); }) % 64 == offset);
          if (offset == 0) aligned = answers;
          CHECK((answers == aligned));
        }
      }
    }
}

#endif

}  // namespace bristle_test::test_stack_alignment
