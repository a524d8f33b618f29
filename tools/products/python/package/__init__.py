"""Brush-model friction: patches of elastic bristles that stick, bend and snap, stepped by SIMD kernels.

SI units. Forces act on the moving body: friction against a motion towards +x is negative.

    import bristle

    wood = bristle.Material.from_coefficients(kinetic=0.40, peak=0.46, presliding_length=20e-6)  # m
    batch = bristle.PatchBatch()
    ids = batch.add_many(10, wood, bristle.PatchOptions(max_normal_load=2.0))  # N
    motions, responses = bristle.motions(ids, normal_load=1.0), bristle.responses(len(ids))
    for tick in range(100):
        motions.displacement[:, 0] = 2e-6  # m, over the step
        batch.step(1e-3, motions, responses)  # s
        responses.check()  # a load that was forgotten, a patch that was removed
    print(responses.end[:, 0])  # N: about -0.4
"""

try:
    import numpy as _numpy
except ImportError as _error:
    raise ImportError("bristle needs numpy, which this Python does not have: pip install numpy, or on Debian "
                      "apt install python3-numpy") from _error

from . import _bristle
from ._bristle import *
from ._bristle import __version__
from ._arrays import Response, Responses, motions, responses
from . import _words as _words

if hasattr(_bristle, "_SweepStudy"):
    from ._sweep import SweepTable, sweep


def __getattr__(name):
    """Explains why this build lacks a name that others have."""
    if name in ("Scene", "SceneRun", "run_scene", "FitEstimate", "FitResult", "fit", "experiment", "sweep", "SweepTable"):
        raise AttributeError(f"bristle.{name} is not in this build of the module: build it with BRISTLE_BUILD_TOOLS=ON "
                             "and the packages of the command line (CMake names those that are missing)")
    raise AttributeError(f"module 'bristle' has no attribute '{name}'")
