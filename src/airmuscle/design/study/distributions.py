"""Parameter distributions and level sets."""

import abc
import dataclasses
import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from ...core import Array, ParameterError, abridged
from ...files.library import Location, TableReader, custom_field, read_finite_number
from ...files.scenario.values import Number
from .paths import read_count, read_difference

MIN_PROBABILITY = 1e-6
"""Minimum probability of the range of a truncated distribution, so that its bounds are exact to ten
digits.
"""
MAX_LISTED_LEVELS = 6
"""Maximum number of levels that are listed; of more levels, only range and number are printed."""


class Variation(abc.ABC):
    """The values that one parameter takes in a study."""

    positive: ClassVar[tuple[str, ...]] = ()
    """Fields that must be positive."""

    def __post_init__(self) -> None:
        numbers = {
            name: value for name, value in vars(self).items() if isinstance(value, float | int)
        }
        _check_finite(self, *numbers.values())
        for name in self.positive:
            if not numbers[name] > 0:
                raise ParameterError(
                    f"{type(self).__name__}: {name} is {numbers[name]:g}; it must be positive."
                )
        low = numbers.get("low", 0.0)
        high = numbers.get("high", 1.0)
        if not low < high:
            raise ParameterError(
                f"{type(self).__name__}: low is {low:g} and high is {high:g}; low must be below"
                " high."
            )

    @abc.abstractmethod
    def ppf(self, probabilities: Array) -> Array:
        """The quantiles (N,) at probabilities (N,) in (0, 1): the inverse of the cumulative
        distribution function.
        """

    @property
    @abc.abstractmethod
    def support(self) -> tuple[float, float]:
        """The minimum and the maximum value; infinite if unbounded."""


@dataclasses.dataclass(frozen=True)
class LevelSet(Variation):
    """Discrete values with equal probability. In a study file: a list."""

    values: tuple[float, ...]

    def __post_init__(self) -> None:
        _check_finite(self, *self.values)
        if not self.values:
            raise ParameterError("LevelSet: the list is empty; give at least one value.")

    def ppf(self, probabilities: Array) -> Array:
        index = np.floor(probabilities * len(self.values)).astype(int)
        return np.asarray(np.array(self.values)[np.minimum(index, len(self.values) - 1)])

    @property
    def support(self) -> tuple[float, float]:
        return min(self.values), max(self.values)

    def __str__(self) -> str:
        """The values; of many only their number and range."""
        if len(self.values) <= MAX_LISTED_LEVELS:
            return ", ".join(f"{value:.4g}" for value in self.values)
        low, high = self.support
        return f"{len(self.values)} values from {low:.4g} to {high:.4g}"


@dataclasses.dataclass(frozen=True)
class Range:
    """Equidistant levels, including both ends."""

    low: float = custom_field(read_finite_number, "first value")
    high: float = custom_field(read_finite_number, "last value")
    count: int = custom_field(read_count, "number of values")

    def __post_init__(self) -> None:
        _check_finite(self, self.low, self.high)
        if not 2 <= self.count <= 1_000_000 or self.low == self.high:
            raise ParameterError(
                f"Range: {self.count} values from {self.low:g} to {self.high:g}; two different ends"
                " and 2 to 1000000 values are required."
            )

    @property
    def levels(self) -> LevelSet:
        """The values as a LevelSet."""
        return LevelSet(tuple(np.linspace(self.low, self.high, self.count).tolist()))


class Distribution(Variation):
    """A continuous probability distribution, of functions of `scipy.special`: `scipy.stats` takes
    long to import.
    """

    @abc.abstractmethod
    def cdf(self, values: Array) -> Array:
        """The cumulative distribution function (N,) at values (N,)."""

    @property
    def support(self) -> tuple[float, float]:
        low, high = self.ppf(np.array([0.0, 1.0])).tolist()
        return low, high


@dataclasses.dataclass(frozen=True)
class Uniform(Distribution):
    """Uniform distribution between two bounds."""

    low: float = custom_field(read_finite_number, "lower bound")
    high: float = custom_field(read_finite_number, "upper bound")

    def ppf(self, probabilities: Array) -> Array:
        return probabilities * (self.high - self.low) + self.low

    def cdf(self, values: Array) -> Array:
        return np.clip((values - self.low) / (self.high - self.low), 0.0, 1.0)


@dataclasses.dataclass(frozen=True)
class Normal(Distribution):
    """Normal distribution. It is unbounded: use Truncated if values beyond a bound are
    impossible.
    """

    positive: ClassVar[tuple[str, ...]] = ("std",)
    mean: float = custom_field(read_finite_number, "mean")
    std: float = custom_field(read_difference, "standard deviation")

    def ppf(self, probabilities: Array) -> Array:
        from scipy import special

        return np.asarray(special.ndtri(probabilities) * self.std + self.mean)

    def cdf(self, values: Array) -> Array:
        from scipy import special

        return np.asarray(special.ndtr((values - self.mean) / self.std))


@dataclasses.dataclass(frozen=True)
class LogNormal(Distribution):
    """Log-normal distribution: the natural logarithm of the value is normally distributed."""

    positive: ClassVar[tuple[str, ...]] = ("median", "log_std")
    median: float = custom_field(read_finite_number, "median")
    log_std: float = custom_field(
        Number("1"),
        "standard deviation of the natural logarithm; approximately the relative standard"
        " deviation",
    )

    def ppf(self, probabilities: Array) -> Array:
        return np.exp(Normal(0.0, self.log_std).ppf(probabilities)) * self.median

    def cdf(self, values: Array) -> Array:
        with np.errstate(divide="ignore"):
            return Normal(0.0, self.log_std).cdf(np.log(np.maximum(values / self.median, 0.0)))


@dataclasses.dataclass(frozen=True)
class Triangular(Distribution):
    """Triangular distribution with a mode between two bounds."""

    low: float = custom_field(read_finite_number, "lower bound")
    mode: float = custom_field(read_finite_number, "mode")
    high: float = custom_field(read_finite_number, "upper bound")

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.low <= self.mode <= self.high:
            raise ParameterError(
                f"Triangular: mode is {self.mode:g}; allowed range: {self.low:g} to {self.high:g}."
            )

    def ppf(self, probabilities: Array) -> Array:
        q = probabilities
        c = (self.mode - self.low) / (self.high - self.low)
        unit = np.where(q < c, np.sqrt(c * q), 1.0 - np.sqrt((1.0 - c) * (1.0 - q)))
        return unit * (self.high - self.low) + self.low

    def cdf(self, values: Array) -> Array:
        width = self.high - self.low
        c = (self.mode - self.low) / width
        share = (values - self.low) / width
        x = np.clip(share, 0.0, 1.0)
        with np.errstate(divide="ignore", invalid="ignore"):  # of the branch that is not taken
            rising = x * x / c
            falling = (x * x - 2.0 * x + c) / (c - 1.0)
        # exactly 1 at the end, also where the mode is there
        below_high = np.where(x < 1.0, falling, 1.0)
        return np.where(x < c, rising, below_high)


def _read_inner(value: Any, unit: str, where: Location) -> Distribution:
    inner: Distribution = TableReader(classes=DISTRIBUTIONS, known=unit).build(value, where)
    return inner


@dataclasses.dataclass(frozen=True)
class Truncated(Variation):
    """A distribution truncated to the range between two bounds."""

    inner: Distribution = custom_field(
        _read_inner, "the distribution to be truncated, a table with a model"
    )
    low: float = custom_field(read_finite_number, "lower bound")
    high: float = custom_field(read_finite_number, "upper bound")

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.inner, Distribution):
            raise ParameterError(
                f"Truncated: {self.inner!r} is not a continuous distribution; only these are"
                " allowed."
            )
        below, above = self._probability_range()
        if above - below < MIN_PROBABILITY:
            raise ParameterError(
                f"Truncated: the probability of {self.low:g} to {self.high:g} in {self.inner} is"
                f" {above - below:.2g}; it must be at least {MIN_PROBABILITY:g}."
            )

    def _probability_range(self) -> tuple[float, float]:
        below, above = self.inner.cdf(np.array([self.low, self.high])).tolist()
        return below, above

    def ppf(self, probabilities: Array) -> Array:
        below, above = self._probability_range()
        return np.clip(self.inner.ppf(below + probabilities * (above - below)), self.low, self.high)

    @property
    def support(self) -> tuple[float, float]:
        low, high = self.inner.support
        return max(low, self.low), min(high, self.high)


DISTRIBUTIONS: dict[str, type[Any]] = {
    cls.__name__: cls for cls in (Uniform, Normal, LogNormal, Triangular)
}
"""The continuous distributions that may be truncated."""
VARIATIONS: dict[str, type[Any]] = {"Range": Range, **DISTRIBUTIONS, "Truncated": Truncated}
"""The variations that a study file may name."""


def read_variation(value: Any, unit: str, location: Location) -> Variation:
    """The variation in a list or table of a study file. Raises ParameterError, UnitError or
    UnknownNameError.
    """
    if isinstance(value, list):
        if not value:
            raise ParameterError(f"{location}: the list is empty; give at least one value.")
        return LevelSet(
            tuple(
                read_finite_number(item, unit, f"{location}[{i}]") for i, item in enumerate(value)
            )
        )
    if not isinstance(value, Mapping):
        raise ParameterError(
            f"{location} is {abridged(value)}; write a list of values, or a distribution such as {{"
            ' model = "Uniform", low = ..., high = ... }.'
        )
    variation = TableReader(classes=VARIATIONS, known=unit).build(value, location)
    return variation.levels if isinstance(variation, Range) else variation


def _check_finite(variation: Any, *values: float) -> None:
    if not all(math.isfinite(value) for value in values):
        raise ParameterError(f"{variation!r}: all values must be finite.")
