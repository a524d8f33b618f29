// Steps every kernel on stacks of every alignment that a caller may give. Windows and System V promise 16
// bytes only, so that a kernel that moves 32 or 64 bytes to its stack as aligned must align its frame itself.
#include <catch2/catch.hpp>

#include <cstdint>
#include <vector>

#include "bristle/bed.hpp"
#include "bristle/joint_friction.hpp"
#include "core/common/hashing.hpp"
#include "expect.hpp"
#include "scenes.hpp"
#include "variants.hpp"

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

/// Returns the hash of patches of every variant, beds and joints after a few steps on a stack of this
/// alignment.
std::uint64_t hash_on_stack(std::uintptr_t offset, const char* isa) {
  const BatchOptions how = BatchOptions{}.with_isa(isa).with_threads(1);
  PatchBatch batch(how);
  std::vector<PatchId> ids;
  const std::vector<PatchCase> cases = every_variant_and_few_infinite(70, 12);
  for (const PatchCase& c : cases) ids.push_back(batch.add(c.material, c.options));
  batch.warm_up();

  bristle::BedBatch beds(how);
  std::vector<bristle::BedMotion> bed_motions;
  for (const bool all : {false, true})
    for (const bristle::BedShape& shape :
         {bristle::BedShape::sphere_row(32, 1e-3), bristle::BedShape::wheel_row(1e-2),
          bristle::BedShape::ellipse(2e-3, 1e-3, bristle::BedPressure::hertz)}) {
      bristle::BedOptions options;
      options.max_normal_load = 2.0;
      options.all_outputs = all;
      bristle::BedMotion motion;
      motion.id = beds.add(bristle::BedMaterial(0.5).with_presliding(1e-4), shape, options);
      motion.normal_load = 2.0;
      bed_motions.push_back(motion);
    }

  constexpr std::size_t n = 70;
  bristle::JointMaterial gear;
  gear.stiffness = 300.0;
  gear.kinetic.base = 0.4;
  gear.static_part.base = 0.15;
  gear.stribeck_speed = 0.5;
  bristle::JointOptions joint_options;
  joint_options.gradients = true;
  bristle::JointFriction joints(n, {&gear, 1}, joint_options, how);
  std::vector<double> angle(n), speed(n), motor(n), outside(n), out(6 * n);
  std::vector<double> gradient(bristle::joint_parameters * n);

  std::vector<Motion> motions(cases.size());
  std::vector<Response> responses(cases.size());
  std::vector<bristle::BedResponse> bed_responses(bed_motions.size());
  bristle::detail::Hasher hasher;
  for (int k = 0; k < 8; ++k) {
    for (std::size_t i = 0; i < cases.size(); ++i) {
      motions[i] = scripted_motion(i, k, cases[i].options.axes);
      motions[i].id = ids[i];
    }
    for (bristle::BedMotion& motion : bed_motions) motion.displacement[0] = (k % 3 - 1) * 4e-5;
    for (std::size_t i = 0; i < n; ++i) angle[i] += 1e-4 * static_cast<double>(i % 7) * (k % 3 - 1);
    const std::uintptr_t at = call_on_stack(offset, [&] {
      batch.step(tick, motions, responses);
      beds.step({bed_motions.data(), bed_motions.size()}, {bed_responses.data(), bed_responses.size()});
      const auto row = [&](std::size_t j) { return bristle::Span<double>(out.data() + j * n, n); };
      joints.step({angle, speed, motor, outside},
                  {row(0), row(1), row(2), row(3), row(4), row(5), {}, gradient});
    });
    CHECK(at % 64 == offset);
    for (const double torque : out) hasher.add(torque);
  }
  hasher.add(beds.state_hash());
  for (const PatchId id : ids) hasher.add(batch.state_hash(id));
  return hasher.value();
}

}  // namespace

TEST_CASE("Every kernel steps on a stack of any alignment of 16 bytes", "[kernels]") {
  for (const bristle::IsaInfo& isa : bristle::instruction_sets()) {
    if (!isa.usable) continue;
    INFO(isa.name);
    const std::uint64_t aligned = hash_on_stack(0, isa.name);
    for (const std::uintptr_t offset : {16u, 32u, 48u}) CHECK(hash_on_stack(offset, isa.name) == aligned);
  }
}

#endif

}  // namespace bristle_test::test_stack_alignment
