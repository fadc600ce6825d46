"""Designs of experiments: grid, Monte Carlo, Latin hypercube, Sobol and Saltelli.

Each design places its points in the unit cube; the variation of each parameter converts a
coordinate to a value. The same designs therefore serve for levels and for all distributions.
"""

import abc
import dataclasses
import math
from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from ...core import Array, ParameterError
from ...files.library.fields import custom_field
from .distributions import LevelSet, Variation
from .paths import read_count

MAX_RUNS = 10_000_000
"""Maximum number of runs of a study, whose table fits into the memory of a usual computer."""
HALF_CELL = 2.0**-31
"""Half the spacing of Sobol points with 30 bits: the minimum distance of a coordinate from 0 and 1,
where the quantiles of a normal distribution are infinite."""


class Design(abc.ABC):
    """Design of experiments."""

    @abc.abstractmethod
    def run_count(self, variations: Sequence[Variation]) -> int:
        """The number of runs."""

    @abc.abstractmethod
    def _unit_points(self, variations: Sequence[Variation]) -> Array:
        """The points (N, d) in the unit cube."""

    def values(self, variations: Sequence[Variation]) -> Array:
        """The values (N, d) of the varied parameters, one row per run.

        Raises ParameterError for variations that the design does not support.
        """
        runs = self.run_count(variations)
        if runs > MAX_RUNS:
            raise ParameterError(
                f"{type(self).__name__}: {runs:.3g} runs; the maximum is {MAX_RUNS}."
            )
        points = np.clip(self._unit_points(variations), HALF_CELL, 1.0 - HALF_CELL)
        return np.column_stack(
            [variation.ppf(points[:, i]) for i, variation in enumerate(variations)]
        )


@dataclasses.dataclass(frozen=True)
class Grid(Design):
    """Full factorial design: all combinations of the levels; the last parameter changes fastest."""

    def run_count(self, variations: Sequence[Variation]) -> int:
        return math.prod(len(self._levels(variation)) for variation in variations)

    def _levels(self, variation: Variation) -> tuple[float, ...]:
        if not isinstance(variation, LevelSet):
            raise ParameterError(
                f"Grid: {variation} has no levels; give a list or a Range, or use a sampling design"
                " such as LatinHypercube."
            )
        return variation.values

    def _unit_points(self, variations: Sequence[Variation]) -> Array:
        sizes = [len(self._levels(variation)) for variation in variations]
        runs = np.arange(math.prod(sizes))
        indices = np.unravel_index(runs, sizes)
        # the middle of the share of a level
        points = [(index + 0.5) / size for index, size in zip(indices, sizes, strict=True)]
        return np.column_stack(points)


@dataclasses.dataclass(frozen=True)
class SampledDesign(Design):
    """Random design of `count` points, reproducible by its seed."""

    balanced: ClassVar[bool] = False
    """Whether the points are balanced only if their number is a power of two."""
    count: int = custom_field(read_count, "number of points")
    seed: int = custom_field(read_count, "seed of the random number generator", default=0)

    def __post_init__(self) -> None:
        if self.count < 1:
            raise ParameterError(
                f"{type(self).__name__}: count is {self.count}; it must be at least 1."
            )
        if self.balanced and self.count & (self.count - 1):
            below = 1 << (self.count.bit_length() - 1)
            raise ParameterError(
                f"{type(self).__name__}: count is {self.count}; Sobol points are balanced only if"
                f" their number is a power of two. Use {below} or {2 * below}."
            )

    def run_count(self, variations: Sequence[Variation]) -> int:
        return self.count


class MonteCarlo(SampledDesign):
    """Independent random points. With a larger count, the points of the smaller design come
    first.
    """

    def _unit_points(self, variations: Sequence[Variation]) -> Array:
        return np.random.default_rng(self.seed).random((self.count, len(variations)))


class LatinHypercube(SampledDesign):
    """Latin hypercube: each parameter takes each of `count` equiprobable intervals exactly once.

    McKay, Beckman, Conover, Technometrics 21 (1979) 239-245.
    """

    def _unit_points(self, variations: Sequence[Variation]) -> Array:
        from scipy.stats import qmc

        sampler = qmc.LatinHypercube(d=len(variations), seed=np.random.default_rng(self.seed))
        return np.asarray(sampler.random(self.count))


class Sobol(SampledDesign):
    """Scrambled Sobol points, a low-discrepancy sequence; `count` is a power of two. A larger count
    adds points.
    """

    balanced: ClassVar[bool] = True

    def _unit_points(self, variations: Sequence[Variation]) -> Array:
        return _sobol_points(len(variations), self.count, self.seed)


class Saltelli(SampledDesign):
    """Design for variance-based sensitivities: `count` base points, a power of two, give count (d +
    2) runs.

    Two Sobol samples A and B of d parameters. For each base point: the run A, the d runs A with one
    parameter taken from B, and the run B. Saltelli et al., Computer Physics Communications 181
    (2010) 259-270.
    """

    balanced: ClassVar[bool] = True

    def run_count(self, variations: Sequence[Variation]) -> int:
        return self.count * (len(variations) + 2)

    def _unit_points(self, variations: Sequence[Variation]) -> Array:
        d = len(variations)
        both = _sobol_points(2 * d, self.count, self.seed)
        first = both[:, :d]
        second = both[:, d:]
        # rows A, A with one column of B for each parameter, and B of every base point
        table = np.repeat(first[:, None], d + 2, axis=1)
        for i in range(d):
            table[:, 1 + i, i] = second[:, i]
        table[:, d + 1] = second
        return table.reshape(-1, d)


DESIGNS = {cls.__name__: cls for cls in (Grid, LatinHypercube, Sobol, MonteCarlo, Saltelli)}
"""The designs that a study file may name."""


def _sobol_points(dimension: int, count: int, seed: int) -> Array:
    from scipy.stats import qmc

    sampler = qmc.Sobol(d=dimension, scramble=True, seed=np.random.default_rng(seed))
    return np.asarray(sampler.random(count)) + HALF_CELL
