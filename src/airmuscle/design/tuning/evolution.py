"""EvolutionStrategy: covariance matrix adaptation (CMA-ES) in the unit cube, a generation at a time."""

from __future__ import annotations

import math

import numpy as np

from ...core.arrays import Array
from ...core.reference import Reference

HANSEN2016 = Reference(
    key="hansen-2016",
    authors="Hansen, N.",
    title="The CMA evolution strategy: a tutorial",
    where="arXiv:1604.00772",
    year=2016,
    note="rank-one and rank-mu update, cumulative step-size adaptation and the default constants",
)
FIRST_WIDTH = 0.25
"""Standard deviation of the first generation, in parts of the range (chosen)."""


class EvolutionStrategy:
    """Covariance matrix adaptation from a first mean (D,); points outside the unit cube are moved to its surface.

    A generation x_i = m + s N(0, C) is ranked. The mean m is the weighted mean of its better half; the covariance C
    follows the steps that led to them (rank mu) and the path of the mean (rank one), the step size s the length of that
    path. Only ranks count, so that a discontinuous objective, or one with failed runs, is permitted. Reference: Hansen
    (2016).
    """

    def __init__(self, mean: Array, random: np.random.Generator) -> None:
        d = mean.size
        self.mean, self._random, self._step, self._covariance = mean.copy(), random, FIRST_WIDTH, np.eye(d)
        self.size = max(8, 4 + int(3 * math.log(d)))
        parents = self.size // 2
        weights = math.log(parents + 0.5) - np.log(np.arange(1, parents + 1))
        self._weights = weights / weights.sum()
        self._mass = mass = 1.0 / float(np.sum(self._weights**2))
        self._path_rate = (4 + mass / d) / (d + 4 + 2 * mass / d)
        self._step_rate = (mass + 2) / (d + mass + 5)
        self._rank_one = 2 / ((d + 1.3) ** 2 + mass)
        self._rank_mu = min(1 - self._rank_one, 2 * (mass - 2 + 1 / mass) / ((d + 2) ** 2 + mass))
        self._damping = 1 + 2 * max(0.0, math.sqrt((mass - 1) / (d + 1)) - 1) + self._step_rate
        self._usual = math.sqrt(d) * (1 - 1 / (4 * d) + 1 / (21 * d * d))
        self._path, self._step_path, self._generations = np.zeros(d), np.zeros(d), 0

    @property
    def width(self) -> float:
        """The largest standard deviation of the present distribution."""
        return self._step * float(np.sqrt(np.linalg.eigvalsh(self._covariance)[-1]))

    def ask(self) -> Array:
        """The points (S, D) of the next generation."""
        values, axes = np.linalg.eigh(self._covariance)
        normal = self._random.standard_normal((self.size, self.mean.size))
        points: Array = self.mean + self._step * (normal * np.sqrt(values)) @ axes.T
        return np.clip(points, 0.0, 1.0)

    def tell(self, points: Array, values: Array) -> None:
        """Adapt the distribution to the values (S,) of a generation (S, D); smaller is better."""
        d, mass = self.mean.size, self._mass
        steps = (points[np.argsort(values)[: self._weights.size]] - self.mean) / self._step
        move = self._weights @ steps
        self.mean, self._generations = self.mean + self._step * move, self._generations + 1
        eigenvalues, axes = np.linalg.eigh(self._covariance)
        whitened = axes @ ((axes.T @ move) / np.sqrt(eigenvalues))
        rate = self._step_rate
        self._step_path = (1 - rate) * self._step_path + math.sqrt(rate * (2 - rate) * mass) * whitened
        length = float(np.linalg.norm(self._step_path))
        settled = math.sqrt(1 - (1 - rate) ** (2 * self._generations))
        short = 1.0 if length / settled < (1.4 + 2 / (d + 1)) * self._usual else 0.0
        rate = self._path_rate
        self._path = (1 - rate) * self._path + short * math.sqrt(rate * (2 - rate) * mass) * move
        old = (1 - self._rank_one - self._rank_mu + (1 - short) * self._rank_one * rate * (2 - rate)) * self._covariance
        self._covariance = (
            old
            + self._rank_one * np.outer(self._path, self._path)
            + self._rank_mu * ((steps.T * self._weights) @ steps)
            + 1e-14 * np.eye(d)
        )
        self._step *= math.exp(self._step_rate / self._damping * (length / self._usual - 1))
