// Declares the compiled solvers of coupling.hpp, for bodies of one, two and six velocities. Each is compiled
// once, in one of two sources: programs that only step scenes need not link the second.
#pragma once

#include <bristle/coupling.hpp>

#define BRISTLE_MIDPOINT_COUPLING(linkage, Dof)                                                         \
  linkage template SolveReport solve_displacements<Dof>(                                                \
      PatchBatch&, double, const MovingBody<Dof>&, const Given<BodyVector<Dof>>&,                       \
      Given<Span<BodyContact<Dof>>>, Span<Motion>) noexcept;                                            \
  linkage template void apply_mean_forces<Dof>(double, MovingBody<Dof>&, const Given<BodyVector<Dof>>&, \
                                               Given<Span<const BodyContact<Dof>>>,                     \
                                               Span<const Response>) noexcept;
#define BRISTLE_PREDICTED_COUPLING(linkage, Dof)                                                       \
  linkage template BodyVector<Dof> predict_displacements<Dof>(                                         \
      PatchBatch&, double, const MovingBody<Dof>&, const Given<BodyVector<Dof>>&,                      \
      Given<Span<BodyContact<Dof>>>, Span<Motion>) noexcept;                                           \
  linkage template void apply_end_forces<Dof>(double, MovingBody<Dof>&, const Given<BodyVector<Dof>>&, \
                                              Given<Span<const BodyContact<Dof>>>,                     \
                                              Span<const Response>) noexcept;
#define BRISTLE_SCENE_COUPLINGS(linkage) \
  BRISTLE_MIDPOINT_COUPLING(linkage, 1)  \
  BRISTLE_MIDPOINT_COUPLING(linkage, 2)
#define BRISTLE_OTHER_COUPLINGS(linkage) \
  BRISTLE_PREDICTED_COUPLING(linkage, 1) \
  BRISTLE_PREDICTED_COUPLING(linkage, 2) \
  BRISTLE_PREDICTED_COUPLING(linkage, 6) \
  BRISTLE_MIDPOINT_COUPLING(linkage, 6)

namespace bristle {
BRISTLE_SCENE_COUPLINGS(extern)
BRISTLE_OTHER_COUPLINGS(extern)
}  // namespace bristle
