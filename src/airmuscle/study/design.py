"""Which runs a study makes: the design of its experiments.

Every design places its points in the unit cube; a variation turns each coordinate into a value. So one design serves
levels and distributions of any kind.
"""

from __future__ import annotations

import abc
import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from ..core.arrays import Array
from ..core.errors import ParameterError
from .distributions import LevelSet, Variation
from .parse import key, whole

MAX_RUNS = 10_000_000
"""RunSplit of one study whose table fits a usual memory."""
HALF_CELL = 2.0**-31
"""Half the distance of Sobol points of 30 bits; no share is nearer to 0 or 1, where normal values are infinite."""


class Design(abc.ABC):
    """How the points of a study are spread."""

    @abc.abstractmethod
    def run_count(self, variations: Sequence[Variation]) -> int:
        """The number of runs."""

    @abc.abstractmethod
    def _unit_points(self, variations: Sequence[Variation]) -> Array:
        """The points (N, d) in the unit cube."""

    def values(self, variations: Sequence[Variation]) -> Array:
        """What is varied, run by run (N, d). Raises ParameterError for variations that do not go with the design."""
        runs = self.run_count(variations)
        if runs > MAX_RUNS:
            raise ParameterError(f"{type(self).__name__}: {runs:.3g} runs; a study has {MAX_RUNS} at most.")
        shares = np.clip(self._unit_points(variations), HALF_CELL, 1.0 - HALF_CELL)
        return np.column_stack([variation.ppf(shares[:, i]) for i, variation in enumerate(variations)])


@dataclasses.dataclass(frozen=True)
class Grid(Design):
    """Every combination of the levels; the last of what varies changes fastest."""

    def run_count(self, variations: Sequence[Variation]) -> int:
        return math.prod(len(self._levels(variation)) for variation in variations)

    def _levels(self, variation: Variation) -> tuple[float, ...]:
        if not isinstance(variation, LevelSet):
            raise ParameterError(
                f"Grid: {variation} has no levels; give a list or a Range, or take a design that samples, like "
                "LatinHypercube."
            )
        return variation.values

    def _unit_points(self, variations: Sequence[Variation]) -> Array:
        sizes = [len(self._levels(variation)) for variation in variations]
        places = np.unravel_index(np.arange(math.prod(sizes)), sizes)
        return np.column_stack([(place + 0.5) / size for place, size in zip(places, sizes, strict=True)])


@dataclasses.dataclass(frozen=True)
class SampledDesign(Design):
    """A design of `count` points by chance, the same for the same seed."""

    count: int = key(whole, "number of points")
    seed: int = key(whole, "where the generator of random numbers begins", default=0)

    def __post_init__(self) -> None:
        if self.count < 1:
            raise ParameterError(f"{type(self).__name__}: count is {self.count}; at least one point is needed.")

    def run_count(self, variations: Sequence[Variation]) -> int:
        return self.count

    def _check_power_of_two(self) -> None:
        if self.count & (self.count - 1):
            below = 1 << (self.count.bit_length() - 1)
            raise ParameterError(
                f"{type(self).__name__}: count is {self.count}; Sobol points keep their balance for powers of two "
                f"only. Take {below} or {2 * below}."
            )


class MonteCarlo(SampledDesign):
    """Independent points. A study with a greater count begins with the same ones."""

    def _unit_points(self, variations: Sequence[Variation]) -> Array:
        return np.random.default_rng(self.seed).random((self.count, len(variations)))


class LatinHypercube(SampledDesign):
    """Each variable takes each of `count` equal parts of its range once.

    McKay, Beckman, Conover, Technometrics 21 (1979) 239-245.
    """

    def _unit_points(self, variations: Sequence[Variation]) -> Array:
        from scipy.stats import qmc

        sampler = qmc.LatinHypercube(d=len(variations), seed=np.random.default_rng(self.seed))
        return np.asarray(sampler.random(self.count))


class Sobol(SampledDesign):
    """Scrambled Sobol points, which fill the cube evenly; `count` is a power of two. A greater one adds to them."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self._check_power_of_two()

    def _unit_points(self, variations: Sequence[Variation]) -> Array:
        return _sobol_points(len(variations), self.count, self.seed)


class Saltelli(SampledDesign):
    """Points for variance-based sensitivities: `count` base points, a power of two, make count (d + 2) runs.

    Two Sobol samples A and B of d variables; for each base point the runs A, then A with one variable after the other
    taken from B, then B. Saltelli et al., Computer Physics Communications 181 (2010) 259-270.
    """

    def __post_init__(self) -> None:
        super().__post_init__()
        self._check_power_of_two()

    def run_count(self, variations: Sequence[Variation]) -> int:
        return self.count * (len(variations) + 2)

    def _unit_points(self, variations: Sequence[Variation]) -> Array:
        d = len(variations)
        both = _sobol_points(2 * d, self.count, self.seed)
        table = np.repeat(both[:, None, :d], d + 2, axis=1)
        for i in range(d):
            table[:, 1 + i, i] = both[:, d + i]
        table[:, d + 1] = both[:, d:]
        return table.reshape(-1, d)


DESIGNS = (Grid, LatinHypercube, Sobol, MonteCarlo, Saltelli)


def _sobol_points(dimension: int, count: int, seed: int) -> Array:
    from scipy.stats import qmc

    sampler = qmc.Sobol(d=dimension, scramble=True, seed=np.random.default_rng(seed))
    return np.asarray(sampler.random(count)) + HALF_CELL
