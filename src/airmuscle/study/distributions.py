"""What a number of a plant may be: one of several levels, or distributed."""

from __future__ import annotations

import abc
import dataclasses
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..core.arrays import Array
from ..core.errors import ParameterError
from ..library.location import Location, finite
from .parse import chosen, difference, key, quantity, ratio, whole

MIN_PROBABILITY = 1e-6
"""Part of a distribution that a truncation must leave, so that its ends stay exact to ten digits."""


class Variation(abc.ABC):
    """The values that one number takes, from the least to the greatest."""

    @abc.abstractmethod
    def ppf(self, shares: Array) -> Array:
        """The values (N,) that these shares (N,) of all, in (0, 1), lie below."""

    @property
    @abc.abstractmethod
    def support(self) -> tuple[float, float]:
        """The least and the greatest value; infinite where there is none."""


@dataclasses.dataclass(frozen=True)
class LevelSet(Variation):
    """Given values, each as likely as any other. In a file: a list."""

    values: tuple[float, ...]

    def __post_init__(self) -> None:
        _check_finite(self, *self.values)
        if not self.values:
            raise ParameterError("Levels: the list is empty; give at least one value.")

    def ppf(self, shares: Array) -> Array:
        index = np.floor(shares * len(self.values)).astype(int)
        values: Array = np.array(self.values)[np.minimum(index, len(self.values) - 1)]
        return values

    @property
    def support(self) -> tuple[float, float]:
        return min(self.values), max(self.values)


@dataclasses.dataclass(frozen=True)
class Range:
    """Levels at equal distances, both ends among them."""

    low: float = key(quantity, "first value")
    high: float = key(quantity, "last value")
    count: int = key(whole, "number of values")

    def __post_init__(self) -> None:
        _check_finite(self, self.low, self.high)
        if not 2 <= self.count <= 1_000_000 or self.low == self.high:
            raise ParameterError(
                f"Range: {self.count} values from {self.low:g} to {self.high:g}; it takes two different ends, and 2 to "
                "1000000 values."
            )

    @property
    def levels(self) -> LevelSet:
        """The values themselves."""
        return LevelSet(tuple(np.linspace(self.low, self.high, self.count).tolist()))


class Distribution(Variation):
    """A continuous distribution, computed by scipy.stats."""

    @abc.abstractmethod
    def scipy_distribution(self) -> Any:
        """The frozen distribution of scipy.stats."""

    def ppf(self, shares: Array) -> Array:
        return np.asarray(self.scipy_distribution().ppf(shares), dtype=float)

    @property
    def support(self) -> tuple[float, float]:
        low, high = self.scipy_distribution().support()
        return float(low), float(high)


@dataclasses.dataclass(frozen=True)
class Uniform(Distribution):
    """Every value between two ends is as likely as any other."""

    low: float = key(quantity, "least value")
    high: float = key(quantity, "greatest value")

    def __post_init__(self) -> None:
        _check_finite(self, self.low, self.high)
        _check_order(self, ("low", self.low), ("high", self.high))

    def scipy_distribution(self) -> Any:
        from scipy import stats

        return stats.uniform(self.low, self.high - self.low)


@dataclasses.dataclass(frozen=True)
class Normal(Distribution):
    """The normal distribution; it has no ends, so put it in Truncated where values beyond some bound are impossible."""

    mean: float = key(quantity, "mean")
    std: float = key(difference, "standard deviation")

    def __post_init__(self) -> None:
        _check_finite(self, self.mean, self.std)
        _check_positive(self, "deviation", self.std)

    def scipy_distribution(self) -> Any:
        from scipy import stats

        return stats.norm(self.mean, self.std)


@dataclasses.dataclass(frozen=True)
class LogNormal(Distribution):
    """A value whose natural logarithm is normal: half of all lie below the median."""

    median: float = key(quantity, "median")
    log_std: float = key(ratio, "standard deviation of the natural logarithm; about the relative one")

    def __post_init__(self) -> None:
        _check_finite(self, self.median, self.log_std)
        _check_positive(self, "median", self.median)
        _check_positive(self, "log_deviation", self.log_std)

    def scipy_distribution(self) -> Any:
        from scipy import stats

        return stats.lognorm(self.log_std, scale=self.median)


@dataclasses.dataclass(frozen=True)
class Triangular(Distribution):
    """Likeliest at the mode, and ever less so towards the ends."""

    low: float = key(quantity, "least value")
    mode: float = key(quantity, "likeliest value")
    high: float = key(quantity, "greatest value")

    def __post_init__(self) -> None:
        _check_finite(self, self.low, self.mode, self.high)
        _check_order(self, ("low", self.low), ("high", self.high))
        if not self.low <= self.mode <= self.high:
            raise ParameterError(f"Triangular: mode {self.mode:g} must lie within {self.low:g} to {self.high:g}.")

    def scipy_distribution(self) -> Any:
        from scipy import stats

        return stats.triang((self.mode - self.low) / (self.high - self.low), self.low, self.high - self.low)


def _read_inner(value: Any, unit: str, where: str) -> Distribution:
    found: Distribution = chosen(value, DISTRIBUTIONS[:-1], Location(where, "", Path()), unit)
    return found


@dataclasses.dataclass(frozen=True)
class Truncated(Variation):
    """Another distribution without what lies beyond two ends."""

    inner: Distribution = key(_read_inner, "the distribution that is cut, a table with a model")
    low: float = key(quantity, "least value")
    high: float = key(quantity, "greatest value")

    def __post_init__(self) -> None:
        _check_finite(self, self.low, self.high)
        _check_order(self, ("low", self.low), ("high", self.high))
        if not isinstance(self.inner, Distribution):
            raise ParameterError(f"Truncated: {self.inner!r} is no distribution that can be cut.")
        below, above = self._probability_range()
        if above - below < MIN_PROBABILITY:
            raise ParameterError(
                f"Truncated: only {above - below:.2g} of {self.inner} lies within {self.low:g} to {self.high:g}; at "
                f"least {MIN_PROBABILITY:g} must."
            )

    def _probability_range(self) -> tuple[float, float]:
        below, above = self.inner.scipy_distribution().cdf([self.low, self.high])
        return float(below), float(above)

    def ppf(self, shares: Array) -> Array:
        below, above = self._probability_range()
        return np.clip(self.inner.ppf(below + shares * (above - below)), self.low, self.high)

    @property
    def support(self) -> tuple[float, float]:
        low, high = self.inner.support
        return max(low, self.low), min(high, self.high)


DISTRIBUTIONS = (Uniform, Normal, LogNormal, Triangular, Truncated)


def read_variation(given: Any, unit: str, place: Location) -> Variation:
    """The variation that a list or a table of a study describes."""
    if isinstance(given, list):
        if not given:
            raise ParameterError(f"{place}: the list is empty; give at least one value.")
        return LevelSet(tuple(finite(value, unit, f"{place}[{i}]") for i, value in enumerate(given)))
    if not isinstance(given, Mapping):
        raise ParameterError(
            f'{place} is {given!r}; write a list of values, or a distribution like {{ model = "Uniform", low = ..., '
            "high = ... }."
        )
    found = chosen(given, (Range, *DISTRIBUTIONS), place, unit)
    return found.levels if isinstance(found, Range) else found


def _check_finite(thing: Any, *values: float) -> None:
    if not all(math.isfinite(value) for value in values):
        raise ParameterError(f"{thing}: every number must be finite.")


def _check_positive(thing: Any, name: str, value: float) -> None:
    if not value > 0:
        raise ParameterError(f"{type(thing).__name__}: {name} is {value:g}; it must be greater than zero.")


def _check_order(thing: Any, first: tuple[str, float], second: tuple[str, float]) -> None:
    if not first[1] < second[1]:
        raise ParameterError(
            f"{type(thing).__name__}: {first[0]} is {first[1]:g} and {second[0]} {second[1]:g}; {first[0]} must be the "
            "smaller one."
        )
