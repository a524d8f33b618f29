// Stands in for the infinite brush (infinitely many bristles) in the minimal build, which has none.
#include "bristle/error.hpp"
#include "core/patches/cohorts/cohorts.hpp"

namespace bristle::detail {

bool allows_cohorts(const Material&) noexcept { return false; }

Patch make_cohorts(std::shared_ptr<const CompiledMaterial>, const PatchOptions&, const KernelTable&, double) {
  throw Error(
      "PatchOptions: population = infinite is left out of this build of bristle; use "
      "Population::representatives or build it with BRISTLE_MINIMAL=OFF");
}

}  // namespace bristle::detail
