"""Where a plant rests: the static state for given pressures in its muscles."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import NoEquilibrium, NoSolution
from .plant import Plant

PLACES = 401
"""Contractions looked at between the ends of the geometry's reach."""


@dataclasses.dataclass(frozen=True)
class Rest:
    """One equilibrium: its state, and whether the mechanism returns to it at constant pressure."""

    state: dict[str, float]
    stable: bool


def equilibria(plant: Plant, *, pressure: float | tuple[float, ...]) -> tuple[Rest, ...]:
    """Every state at rest for the gauge pressure [Pa] of the muscle (or of each), from the least contraction on.

    Inputs are taken as zero, so a latch is open. Mechanisms of one coordinate, or none, are covered.
    """
    if not plant.mechanism.coordinates:
        return (Rest(plant.state_at(pressure=pressure), True),)
    search = _Search(plant, pressure)
    positions = search.positions()
    pulls = np.array([search.acceleration(x) for x in positions])
    found = []
    for i in np.flatnonzero(np.sign(pulls[:-1]) * np.sign(pulls[1:]) < 0):
        place = search.between(float(positions[i]), float(positions[i + 1]), float(pulls[i]))
        found.append(Rest(search.state(place), bool(pulls[i] > 0)))
    return tuple(found)


def equilibrium(plant: Plant, *, pressure: float | tuple[float, ...]) -> dict[str, float]:
    """The stable state at rest that is nearest to full length, for the gauge pressure [Pa] of the muscle (or of each).

    Raises NoEquilibrium, which names the muscle and the forces, where the plant cannot rest.
    """
    for rest in equilibria(plant, pressure=pressure):
        if rest.stable:
            return rest.state
    raise NoEquilibrium(_Search(plant, pressure).explanation())


class _Search:
    """The unbalanced acceleration of a one-coordinate plant, as a function of its coordinate."""

    def __init__(self, plant: Plant, pressure: float | tuple[float, ...]) -> None:
        from .program.prepared import prepared  # CasADi, which describing a plant does not need

        if len(plant.mechanism.coordinates) > 1:
            raise NoSolution("equilibrium covers mechanisms of one coordinate; start from state_at and let it settle.")
        self.plant, self.pressure = plant, pressure
        self.coordinate = plant.mechanism.coordinates[0].name
        self.inputs = dict.fromkeys(plant.inputs, 0.0)
        self.ready = prepared(plant)
        self.names = [s.name for s in plant.states]
        self.speed = self.names.index(plant.mechanism.coordinates[0].speed)

    def positions(self) -> npt.NDArray[np.float64]:
        """Coordinates that every muscle can take, in rising order."""
        low, high = -np.inf, np.inf
        for i, muscle in enumerate(self.plant.muscles):
            least, greatest = muscle.geometry.contraction_reach
            at_zero, at_one = (self._contraction(x, i) for x in (0.0, 1.0))
            ends = sorted((max(c, -0.5) - at_zero) / (at_one - at_zero) for c in (least, greatest))
            low, high = max(low, ends[0]), min(high, ends[1])
        margin = 1e-9 * (high - low)
        return np.linspace(low + margin, high - margin, PLACES)

    def _contraction(self, x: float, index: int) -> Any:
        lengths = [m.geometry.resting_length for m in self.plant.muscles]
        return self.plant.mechanism.contractions({self.coordinate: x}, lengths)[index]

    def state(self, x: float) -> dict[str, float]:
        """The state at rest at this coordinate."""
        return self.plant.state_at(pressure=self.pressure, **{self.coordinate: x})

    def acceleration(self, x: float) -> float:
        """Acceleration from rest at this coordinate."""
        state = self.state(x)
        return float(self.ready.rates([state[n] for n in self.names], list(self.inputs.values()))[self.speed])

    def between(self, low: float, high: float, at_low: float) -> float:
        """The root between two coordinates, by bisection: SciPy's search would cost the first run a slow import."""
        while low < (middle := (low + high) / 2) < high:
            if self.acceleration(middle) * at_low > 0:
                low = middle
            else:
                high = middle
        return low

    def explanation(self) -> str:
        """Why there is no rest: what each muscle pulls at both ends, and what would balance the load there."""
        positions = self.positions()
        lines = []
        for x in (positions[0], positions[-1]):
            ports = self.plant.ports(self.state(float(x)))
            pulls = ", ".join(
                f"{m.name} pulls {float(port.tension) + 0.0:.6g} N at {round(float(port.pressure) / 1e3, 6):.6g} kPa "
                f"and a contraction of {float(port.contraction):.1%}"
                for m, port in zip(self.plant.muscles, ports, strict=True)
            )
            lines.append(f"{pulls}, and the load accelerates at {self.acceleration(float(x)):+.4g} m/s2")
        needed = self._balancing_tension(float(positions[0]))
        load = f" The load needs a pull of {needed:.6g} N." if np.isfinite(needed) else ""
        return (
            f"{type(self.plant.mechanism).__name__} finds no rest: " + "; ".join(lines) + f".{load} "
            "Change the load, the pressure or the parallel spring."
        )

    def _balancing_tension(self, x: float) -> float:
        """The pull [N] of a single muscle that would hold the load; NaN for several muscles."""
        if len(self.plant.muscles) > 1:
            return float("nan")
        state, mechanism = self.state(x), self.plant.mechanism
        found = []
        for tension in (0.0, 1.0):
            pulls = mechanism.pulls(state, [tension], self.plant.resting_lengths)
            found.append(float(mechanism.acceleration(state, state, pulls, self.inputs)[self.coordinate]))
        return -found[0] / (found[1] - found[0])
