"""A program over the Python module as a type checker sees it: mypy --strict (tools/upkeep/check_package types)."""

import numpy as np
from numpy.typing import NDArray

import bristle


def slide(batch: bristle.PatchBatch, ids: NDArray[np.uint64], step_m: float, load_n: float) -> NDArray[np.float64]:
    motions, responses = bristle.motions(ids, load_n), bristle.responses(len(ids))
    motions.displacement[:, 0] = step_m
    report = batch.step(1e-3, motions, responses)
    if report.status != bristle.Status.ok:
        raise RuntimeError(str(report.status))
    return responses.mean[:, 0]


wood = bristle.Material.from_coefficients(kinetic=0.4, peak=0.46, law="lognormal")
options = bristle.PatchOptions(max_normal_load=2.0, outputs="mean")
patches = bristle.PatchBatch(threads=1)
one: int = patches.add(wood, options)
forces = slide(patches, patches.add_many(3, wood, options), 1e-6, 1.0)
trial = patches.find_force(1e-3, bristle.motions(one, 1.0))
friction: float = float(trial.end[0, 0]) + float(forces.sum())
snap: str = wood.snap_length.law
print(f"{friction:.3f} N, {snap}, {patches.info(one)['representatives']} bristles")
