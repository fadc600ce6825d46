"""Interface between a plant and its equilibria, and the pressure of the air enclosed in a muscle at rest."""

import abc
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ...core import Array, System, Value, Values
from ..mechanism import Mechanism
from ..muscle import Muscle
from ..pneumatics.gas import Ambient, Gas, absolute_pressure, gauge_pressure


class StaticPlant(System):
    """A system of muscles that act on a mechanism; its only implementation is the Plant, which imports this package."""

    mechanism: Mechanism
    gas: Gas
    ambient: Ambient

    @property
    @abc.abstractmethod
    def muscles(self) -> tuple[Muscle, ...]:
        """The muscles, one or more."""

    @property
    @abc.abstractmethod
    def prefixes(self) -> tuple[str, ...]:
        """Prefixes of the names of each muscle's quantities."""

    @property
    @abc.abstractmethod
    def resting_lengths(self) -> list[Value]:
        """Resting length [m] of each muscle."""

    @abc.abstractmethod
    def muscle_states(self, state: Values) -> tuple[Any, ...]:
        """Every muscle at a state."""

    @abc.abstractmethod
    def state_at(self, *, pressure: float | str | Sequence[float | str], **values: float | str) -> dict[str, float]:
        """A state by the gauge pressure of each muscle, and by states by name."""

    @abc.abstractmethod
    def settle_muscles(self, pressures: Sequence[Value], state: Values) -> tuple[dict[str, Value], list[Value]]:
        """`state` with the muscles' own states in steady state, and the volume [m3] of each muscle."""

    @abc.abstractmethod
    def fill_muscles(self, pressures: Sequence[Value], volumes: Sequence[Value], state: Values) -> dict[str, Value]:
        """`state` with air at these gauge pressures [Pa] in these volumes [m3], and circuits settled."""


MAX_PRESSURE = 1e8
"""Maximum absolute pressure [Pa] of the search."""
_TOLERANCE = 1e-13
"""Relative error of the air mass at which the search ends."""


def shut_air_pressure(plant: StaticPlant, muscle: Muscle, air_mass: float, contraction: Array) -> Array:
    """Gauge pressure [Pa] of a mass of air [kg] in a muscle at rest, wall and series spring in steady state.

    Contractions are arrays that broadcast with the parameters of the plant; NaN if the pressure would exceed
    1000 bar.
    """

    def excess(x: Array) -> Array:
        """Logarithm of the ratio of the air mass at the absolute pressure exp(x) to the given air mass."""
        p = gauge_pressure(np.exp(x), plant.ambient)
        own = muscle.steady_state(p, contraction)
        volume = muscle.volume(muscle.inner_contraction(contraction, own), own)
        held: Any = np.asarray(plant.gas.state_at(np.exp(x), volume, plant.ambient)["air_mass"])
        return np.where(held > 0, np.log(np.where(held > 0, held, 1.0) / air_mass), -np.inf)

    with np.errstate(all="ignore"):
        start = np.log(np.asarray(absolute_pressure(0.0, plant.ambient), dtype=float))
        x = _secant(excess, start + np.zeros_like(excess(start)))
        if np.isnan(x).any():
            x = np.where(np.isnan(x), _bisection(excess, x.shape), x)
        return np.asarray(gauge_pressure(np.exp(x), plant.ambient))


def _secant(excess: Callable[[Array], Array], a: Array) -> Array:
    """The root of every element by the secant method; NaN if it fails. For a rigid wall and a polytropic process it is
    exact."""
    at_a = excess(a)
    b = a - at_a
    root, lost = np.full(a.shape, np.nan), np.zeros(a.shape, dtype=bool)
    for _ in range(20):
        at_b = np.where(np.isfinite(b) & (b < math.log(MAX_PRESSURE)), excess(b), np.nan)
        open_ = np.isnan(root) & ~lost
        lost |= open_ & ~np.isfinite(at_b)
        root = np.where(open_ & ~lost & ((np.abs(at_b) < _TOLERANCE) | (at_b == at_a)), b, root)
        if (lost | np.isfinite(root)).all():
            break
        a, b, at_a = b, b - at_b * (b - a) / (at_b - at_a), at_b
    return root


def _bisection(excess: Callable[[Array], Array], shape: tuple[int, ...]) -> Array:
    """The root of every element between 1 Pa and the maximum pressure, by bisection; NaN if there is none."""
    low, high = np.zeros(shape), np.full(shape, math.log(MAX_PRESSURE))
    possible = (excess(low) < 0.0) & (excess(high) > 0.0)
    while True:
        middle = 0.5 * (low + high)
        if not ((low < middle) & (middle < high)).any():
            return np.where(possible, low, np.nan)
        below = excess(middle) < 0.0
        low, high = np.where(below, middle, low), np.where(below, high, middle)
