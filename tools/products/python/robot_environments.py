#!/usr/bin/python3
"""A thousand environments for robot learning: in each a block on sixty-four contacts, pushed and turned over a floor.

    PYTHONPATH=build/release/python tools/products/python/robot_environments.py [ENVIRONMENTS] [STEPS]

All contacts of all environments are patches of one batch: a step is one call, and everything around it is numpy over
environments at a time. Copy PushedBlocks into your own program.
"""

import sys
import time

import numpy as np

import bristle

GRAVITY = 9.81  # m/s^2


class PushedBlocks:
    """Blocks of `side` m and `mass` kg, each on contacts x contacts patches, moved by a force and a torque."""

    def __init__(self, environments=1000, contacts=8, mass=0.5, side=0.08, dt=1e-3, threads=0, material=None):
        self.dt, self.mass = dt, mass
        grid = side * ((np.arange(contacts) + 0.5) / contacts - 0.5)
        self.places = np.stack(np.meshgrid(grid, grid), -1).reshape(-1, 2)  # m, places of the contacts on the block
        self.load = mass * GRAVITY / len(self.places)  # N, load on each contact
        self.inertia = np.diag([mass, mass, mass * side**2 / 6.0])  # kg, kg, kg m^2
        material = material or bristle.Material.from_coefficients(kinetic=0.4, peak=0.46, presliding_length=20e-6)
        # Uses the infinite brush in each contact: it has no noise, and is cheapest where many contacts slide.
        options = bristle.PatchOptions(max_normal_load=2.0 * self.load, population="infinite", resolution=4)
        self.batch = bristle.PatchBatch(threads=threads)
        count = environments * len(self.places)
        self.motions = bristle.motions(self.batch.add_many(count, material, options), self.load)
        self.responses = bristle.responses(count)
        self.batch.warm_up()
        # Makes views of the batch's arrays by environment and contact; a step reads and writes them in place.
        by_environment = (environments, len(self.places))
        self.ids = self.motions.id.reshape(by_environment)
        self.displacement = self.motions.displacement.reshape(*by_environment, 2)
        self.force = self.responses.end.reshape(*by_environment, 2)
        self.elastic = self.responses.elastic.reshape(*by_environment, 2)
        self.stiffness = self.responses.stiffness.reshape(by_environment)
        self.damping = self.responses.damping.reshape(by_environment)
        self.limit = self.responses.force_limit.reshape(by_environment)
        self.pose = np.zeros((environments, 3))  # m, m, rad
        self.velocity = np.zeros((environments, 3))
        self.reset(np.arange(environments))

    def reset(self, which):
        """Resets environments: fresh contacts, at rest at the origin."""
        self.pose[which] = self.velocity[which] = 0.0
        self.batch.reset(self.ids[which])
        # Reads each contact's present force and stiffness, from which the next step predicts the velocity.
        self.displacement[which] = 0.0
        trial = self.batch.find_force(self.dt, self.motions[self._rows(which)])
        self.responses[self._rows(which)] = trial

    def observe(self):
        """Returns pose, velocity, friction (N, N, N m): what a policy may see."""
        return np.hstack([self.pose, self.velocity, self._wrench(self._arms(), self.force)])

    def step(self, push):
        """Steps all blocks under `push`, shape (environments, 3): force N, N and torque N m on each."""
        arms = self._arms()
        velocity = self._predict(arms, push)
        self.displacement[:] = self.dt * self._speeds(arms, velocity)
        report = self.batch.step(self.dt, self.motions, self.responses)
        self.velocity += self.dt * np.linalg.solve(self.inertia, (push + self._wrench(arms, self.force)).T).T
        self.pose += self.dt * velocity
        return report

    # Predicts the velocity under contact forces that are linear where contacts stick, and at their limit where they
    # slide. It is implicit in the velocity, so that contacts of any stiffness are stable at any step.

    def _predict(self, arms, push):
        sticks = np.ones(self.limit.shape, bool)
        slides_with = np.zeros_like(self.elastic)
        for _ in range(3):
            slope = np.where(sticks, self.damping + self.dt * self.stiffness, 0.0)  # N s/m
            held = np.where(sticks[..., None], self.elastic, slides_with)
            known = push + self._wrench(arms, held) + self.velocity @ self.inertia / self.dt
            velocity = np.linalg.solve(self.inertia / self.dt + self._matrix(arms, slope), known[..., None])[..., 0]
            force = self.elastic - (self.damping + self.dt * self.stiffness)[..., None] * self._speeds(arms, velocity)
            size = np.linalg.norm(force, axis=-1)
            sticks = size <= self.limit
            slides_with = force * (self.limit / np.maximum(size, self.limit))[..., None]
        return velocity

    def _rows(self, which):
        return (np.atleast_1d(which)[:, None] * len(self.places) + np.arange(len(self.places))).ravel()

    def _arms(self):
        cosine, sine = np.cos(self.pose[:, 2, None]), np.sin(self.pose[:, 2, None])
        x, y = self.places.T
        return np.stack([cosine * x - sine * y, sine * x + cosine * y], -1)

    @staticmethod
    def _speeds(arms, velocity):
        turning = velocity[:, None, 2:] * np.stack([-arms[..., 1], arms[..., 0]], -1)
        return velocity[:, None, :2] + turning

    @staticmethod
    def _wrench(arms, forces):
        torque = arms[..., 0] * forces[..., 1] - arms[..., 1] * forces[..., 0]
        return np.concatenate([forces.sum(1), torque.sum(1, keepdims=True)], 1)

    @staticmethod
    def _matrix(arms, slope):
        """Returns the force and torque per unit of velocity and spin through contacts of this slope: (environments, 3,
        3)."""
        x, y = arms[..., 0], arms[..., 1]
        matrix = np.zeros((len(arms), 3, 3))
        matrix[:, 0, 0] = matrix[:, 1, 1] = slope.sum(1)
        matrix[:, 0, 2] = matrix[:, 2, 0] = -(slope * y).sum(1)
        matrix[:, 1, 2] = matrix[:, 2, 1] = (slope * x).sum(1)
        matrix[:, 2, 2] = (slope * (x**2 + y**2)).sum(1)
        return matrix


def main(environments=1000, steps=200):
    blocks = PushedBlocks(environments)
    random = np.random.default_rng(1)
    strongest = 1.5 * 0.4 * blocks.mass * GRAVITY  # N, largest push, so that some pushes move the block and some do not
    begun, stepping = time.perf_counter(), 0.0
    for step in range(steps):
        if step % 50 == 0:  # draws new pushes at 20 Hz, as a policy would
            push = np.append(random.uniform(-1.0, 1.0, (environments, 2)) * strongest,
                             random.uniform(-0.02, 0.02, (environments, 1)), 1)
        start = time.perf_counter()
        blocks.step(push)
        stepping += time.perf_counter() - start
        done = np.linalg.norm(blocks.pose[:, :2], axis=1) > 0.02
        if done.any():
            blocks.reset(np.flatnonzero(done))
    seconds = time.perf_counter() - begun
    print(f"{environments} environments of {len(blocks.places)} contacts, {steps} steps of {blocks.dt * 1e3:g} ms: "
          f"{1e3 * stepping / steps:.1f} ms a step, {environments * steps / seconds:,.0f} environment steps a second")
    print(f"farthest {1e3 * np.abs(blocks.pose[:, :2]).max():.1f} mm, friction of all "
          f"{np.linalg.norm(blocks.observe()[:, 6:8], axis=1).mean():.2f} N on average")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:3]))
