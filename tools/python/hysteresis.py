#!/usr/bin/python3
"""Plots friction against displacement of a patch moved to and fro with growing amplitude.

    PYTHONPATH=build/release/python tools/python/hysteresis.py [PICTURE.png]
"""

import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import bristle

LOAD = 2.0  # N
DT = 1e-3  # s
MEAN_LENGTH = 20e-6  # m, mean snap length of the bristles
AMPLITUDES = np.array([12e-6, 18e-6, 30e-6, 60e-6])  # m
TICKS = 800  # number of steps in a swing to and fro


def loops(surface):
    """Returns displacement (m) and friction (N, against the motion) of two swings at each amplitude, one row per
    amplitude."""
    batch = bristle.PatchBatch()
    ids = batch.add_many(len(AMPLITUDES), surface, bristle.PatchOptions(max_normal_load=LOAD, bristles=20000, axes=1))
    batch.warm_up()
    motions, responses = bristle.motions(ids, normal_load=LOAD), bristle.responses(len(ids))
    x = AMPLITUDES[:, None] * np.sin(2.0 * np.pi * np.arange(2 * TICKS + 1) / TICKS)
    friction = np.zeros_like(x)
    for k in range(1, x.shape[1]):
        motions.displacement[:, 0] = x[:, k] - x[:, k - 1]
        batch.step(DT, motions, responses)  # steps all patches at once and reuses one array
        friction[:, k] = -responses.end[:, 0]
    return x, friction


def main():
    picture = sys.argv[1] if len(sys.argv) > 1 else "hysteresis.png"
    surface = bristle.Material.from_coefficients(kinetic=0.40, peak=0.42, presliding_length=MEAN_LENGTH)
    figure, panel = plt.subplots(figsize=(8.0, 5.2))
    for x, friction, amplitude in zip(*loops(surface), AMPLITUDES):
        panel.plot(1e6 * x, friction, linewidth=1.4, label=f"±{1e6 * amplitude:.0f} µm")
    # Theoretical curve of the first loading of straight bristles.
    far = np.linspace(0.0, AMPLITUDES[-1], 200)
    stiffness = surface.bristles_in_contact(LOAD) * surface.bristle_stiffness
    deflection = MEAN_LENGTH * bristle.virgin_deflection(surface.snap_length, surface.snap_rule, far / MEAN_LENGTH)
    panel.plot(1e6 * far, stiffness * deflection, "k--", linewidth=1.0, label="first loading, theory")
    panel.set(xlabel="displacement  [µm]", ylabel="friction  [N]", title=f"Hysteresis of a patch under {LOAD:g} N")
    panel.grid(color="#DDDDDD")
    for side in ("top", "right"):
        panel.spines[side].set_visible(False)
    panel.legend(frameon=False, fontsize=9, loc="lower right")
    figure.tight_layout()
    figure.savefig(picture, dpi=100)
    print(picture)


if __name__ == "__main__":
    main()
