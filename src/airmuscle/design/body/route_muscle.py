"""Muscles on one route: product, length, number side by side, tackle and tendon, such that every
pose keeps them within their contraction and above the demanded tension.
"""

import dataclasses
from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ...core import AirmuscleError, Array, ShortRepr, SolveError
from ...files.library import Entry
from ..sizing import SizingConditions, StaticMuscle, working_muscle
from ..sizing.static_muscle import at_length, length_range, product_of
from .sweep import RouteSweep

FITTING_DIAMETERS = 2.5
"""Length of an end fitting over the nominal diameter of a muscle (chosen)."""
TACKLES = (1, 2)
"""Ratios of the motion of the route to that of the muscle: direct, and a movable pulley."""
BISECTIONS = 14
"""Bisections of the length, to 1/16 000 of its range (chosen)."""
NO_DEMAND = 1e-3
"""Tension [N] below which a pose demands nothing (chosen)."""
CONTRADICTION = 0.2
"""Part by which the forces of two laws of a product may differ without being named."""


class RouteDemand(NamedTuple):
    """Lengths of a route [m] and the tensions [N] that are demanded of it, (N,) each."""

    length: Array
    tension: Array


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class RouteMuscle(ShortRepr):
    """Muscles that serve a route.

    muscle       one of them at its length, with its working range
    length       nominal length [m]
    count        number side by side
    tackle       motion of the route over that of the muscle
    tendon       length [m] of the tendon that fills the rest of the route
    fittings     length of both end fittings [m] (chosen)
    contraction  least and greatest contraction over all poses [1]
    reserve      least capacity over the demand, minus 1; infinite without a demand
    other_laws   capacity by other laws of the product over that by the law used, minus 1, at the
                 pose of the least reserve, by name
    """

    sweep: RouteSweep
    muscle: StaticMuscle
    length: float
    count: int
    tackle: int
    tendon: float
    fittings: float
    contraction: tuple[float, float]
    reserve: float
    other_laws: Mapping[str, float]

    @property
    def name(self) -> str:
        """Name of the route."""
        return self.sweep.route.name

    @property
    def product(self) -> str:
        """The product of the muscle, or its law."""
        return product_of(self.muscle.entry)

    @property
    def contradictions(self) -> Mapping[str, float]:
        """The other laws whose force differs by more than a fifth."""
        return {name: part for name, part in self.other_laws.items() if abs(part) > CONTRADICTION}

    @property
    def volume(self) -> float:
        """Nominal volume of all muscles of the route [m3], a measure of the air of a cycle."""
        diameter = self.muscle.entry.ratings.diameter if self.muscle.entry.ratings else 0.0
        return float(self.count * self.length * 0.25 * np.pi * diameter**2)

    def contraction_at(self, length: Array) -> Array:
        """Contraction [1] for lengths of the route [m]."""
        taken = (self.sweep.longest.length - np.asarray(length)) / (self.tackle * self.length)
        return np.asarray(self.contraction[0] + taken)

    def tension(self, pressure: Array | float, length: Array) -> Array:
        """Tension [N] in the route at gauge pressures [Pa] and lengths of the route [m]."""
        force = self.muscle.force(pressure, self.contraction_at(length))
        return np.asarray(self.count / self.tackle * np.maximum(force, 0.0))

    def floor(self, length: Array) -> Array:
        """Least tension [N] in the route, at the least working pressure."""
        contraction = self.contraction_at(length)
        return np.asarray(self.count / self.tackle * self.muscle.floor(contraction))

    def capacity(self, length: Array) -> Array:
        """Greatest permitted tension [N] in the route."""
        contraction = self.contraction_at(length)
        return np.asarray(self.count / self.tackle * self.muscle.capacity(contraction))


class UnservedRoute(NamedTuple):
    """A route that no muscle serves: the reason of the muscle that comes nearest, and what would
    serve.
    """

    sweep: RouteSweep
    reason: str


Criterion = Callable[[RouteMuscle], float]


def by_volume(choice: RouteMuscle) -> float:
    """Nominal volume of the muscles, a measure of their air."""
    return choice.volume


def by_number(choice: RouteMuscle) -> float:
    """Number of muscles; of equal numbers the smaller volume."""
    return choice.count + choice.volume


def by_total_length(choice: RouteMuscle) -> float:
    """Length of all muscles."""
    return choice.count * choice.length


CRITERIA: Mapping[str, Criterion] = MappingProxyType(
    {"air": by_volume, "number": by_number, "length": by_total_length}
)
"""What a fit-out makes least, by name: the air of a cycle, measured by the nominal volume, the
number of muscles, or their length."""


def choose_for_route(
    sweep: RouteSweep,
    demand: RouteDemand,
    laws: Mapping[str, tuple[Entry, ...]],
    conditions: SizingConditions,
    criterion: Criterion,
) -> RouteMuscle | UnservedRoute:
    """The muscles of least cost that serve a route; with a tackle only where none do without.

    laws  laws of each product, the one to use first
    """
    choices: list[RouteMuscle] = []
    shortfalls: list[_Shortfall] = []
    for entries in laws.values():
        for choice in _choices(sweep, demand, entries[0], conditions):
            if isinstance(choice, RouteMuscle):
                choices.append(choice)
            else:
                shortfalls.append(choice)
    if not choices:
        nearest = max(shortfalls, key=lambda item: item.reached, default=None)
        reason = nearest.reason if nearest else "no muscle can work at this supply"
        return UnservedRoute(sweep, reason)
    direct = [choice for choice in choices if choice.tackle == 1]
    best = min(direct or choices, key=lambda choice: (criterion(choice), choice.product))
    others = laws[best.product][1:]
    return dataclasses.replace(best, other_laws=_other_laws(best, demand, others, conditions))


class _Shortfall(NamedTuple):
    """Why a muscle does not serve a route, and the part of the need that it reaches."""

    reached: float
    reason: str


def _choices(
    sweep: RouteSweep, demand: RouteDemand, entry: Entry, conditions: SizingConditions
) -> Iterator[RouteMuscle | _Shortfall]:
    """For each tackle the numbers of a muscle that serve a route, or why the greatest does not."""
    for tackle in TACKLES:
        failed: _Shortfall | None = None
        for count in range(conditions.min_count, conditions.max_count + 1):
            search = _LengthSearch(sweep, demand, entry, conditions, count, tackle)
            try:
                choice = search.shortest()
            except AirmuscleError as error:
                failed = _Shortfall(-1.0, f"{entry.name}: {error}")
                continue
            if isinstance(choice, RouteMuscle):
                yield choice
                failed = None
            else:
                failed = choice
        if failed is not None:
            yield failed


@dataclasses.dataclass(frozen=True)
class _LengthSearch:
    """Search of the shortest muscles of a kind that serve a route."""

    sweep: RouteSweep
    demand: RouteDemand
    entry: Entry
    conditions: SizingConditions
    count: int
    tackle: int

    def shortest(self) -> RouteMuscle | _Shortfall:
        """The shortest muscles, or why none serve."""
        longest = self.sweep.longest.length
        diameter = self.entry.ratings.diameter if self.entry.ratings is not None else 0.0
        fittings = 2.0 * FITTING_DIAMETERS * diameter
        muscle = working_muscle(self.entry, self.conditions)
        first = max(muscle.contraction_range[0], 0.0)
        least, greatest = length_range(self.entry, self.conditions.max_length)
        high = min(greatest, (longest - fittings) / (1.0 - first))
        travel = self.sweep.stroke / self.tackle
        low = max(least, travel / (muscle.contraction_range[1] - first))
        if low > high:
            return self._too_short(muscle, first, low, high, least)
        choice = self._choice(high, fittings)
        if not self._suffices(choice):
            return self._too_weak(choice)
        if self._suffices(self._choice(low, fittings)):
            return self._choice(low, fittings)
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            if self._suffices(self._choice(middle, fittings)):
                high = middle
            else:
                low = middle
        return self._choice(high, fittings)

    def _choice(self, length: float, fittings: float) -> RouteMuscle:
        """The muscles of a length, mounted at the least contraction in the longest pose."""
        muscle = working_muscle(at_length(self.entry, length), self.conditions)
        first = max(muscle.contraction_range[0], 0.0)
        last = first + self.sweep.stroke / (self.tackle * length)
        tendon = self.sweep.longest.length - fittings - (1.0 - first) * length
        choice = RouteMuscle(
            self.sweep,
            muscle,
            length,
            self.count,
            self.tackle,
            tendon,
            fittings,
            (first, last),
            np.inf,
            {},
        )
        return dataclasses.replace(choice, reserve=least_reserve(choice, self.demand))

    def _suffices(self, choice: RouteMuscle) -> bool:
        is_within = choice.contraction[1] <= choice.muscle.contraction_range[1] * (1.0 + 1e-9)
        return is_within and choice.reserve >= self.conditions.safety_factor - 1.0

    def _too_short(
        self, muscle: StaticMuscle, first: float, low: float, high: float, least: float
    ) -> _Shortfall:
        """The reason where no length lies between the stroke and the room."""
        longest = 1e3 * self.sweep.longest.length
        if high < least:
            text = (
                f"{self.entry.name}: {longest:.4g} mm leave no room for its least length,"
                f" {1e3 * least:.4g} mm, and fittings (chosen); lengthen the route"
            )
            return _Shortfall(-1.0, text)
        usable = (muscle.contraction_range[1] - first) * high * self.tackle
        text = (
            f"{self.entry.name} with tackle {self.tackle}:1 takes up {1e3 * usable:.4g} mm with the"
            f" greatest length of {1e3 * high:.4g} mm that the route has room for; its stroke is"
            f" {1e3 * self.sweep.stroke:.4g} mm. A lever of {usable / self.sweep.stroke:.3g} of the"
            " present one would serve, or a longer route"
        )
        return _Shortfall(0.5 * usable / self.sweep.stroke, text)

    def _too_weak(self, choice: RouteMuscle) -> _Shortfall:
        """The reason where the longest muscles do not give the demand."""
        factor = self.conditions.safety_factor
        reached = (1.0 + choice.reserve) / factor
        need = self.demand.tension
        row = int(np.argmax(need / np.maximum(choice.capacity(self.demand.length), 1e-9)))
        text = (
            f"{choice.count} x {self.entry.name} with tackle {self.tackle}:1 give"
            f" {float(choice.capacity(self.demand.length)[row]):.4g} N where"
            f" {factor * float(need[row]):.4g} N are needed (demand times {factor:.3g}). A lever of"
            f" {1.0 / max(reached, 1e-3):.3g} times the present one would serve if the stroke"
            " allowed it, or more muscles"
        )
        return _Shortfall(reached, text)


def least_reserve(choice: RouteMuscle, demand: RouteDemand) -> float:
    """Least capacity over the demand, minus 1; infinite without a demand."""
    is_demanded = demand.tension > NO_DEMAND
    if not is_demanded.any():
        return np.inf
    capacity = choice.capacity(demand.length[is_demanded])
    return float(np.min(capacity / demand.tension[is_demanded])) - 1.0


def _other_laws(
    choice: RouteMuscle,
    demand: RouteDemand,
    entries: tuple[Entry, ...],
    conditions: SizingConditions,
) -> Mapping[str, float]:
    """Difference of the capacity by other laws at the pose of the least reserve, by name; laws that
    do not reach its contraction are left out.
    """
    capacity = choice.capacity(demand.length)
    row = int(np.argmax(demand.tension / np.maximum(capacity, 1e-9)))
    differences = {}
    for entry in entries:
        try:
            muscle = working_muscle(at_length(entry, choice.length), conditions)
        except AirmuscleError:
            continue
        contraction = float(choice.contraction_at(demand.length)[row])
        if not muscle.contraction_range[0] <= contraction <= muscle.contraction_range[1]:
            continue
        force = float(muscle.capacity(contraction)) * choice.count / choice.tackle
        differences[entry.name] = force / max(float(capacity[row]), 1e-9) - 1.0
    return differences


def check_served(unserved: tuple[UnservedRoute, ...]) -> None:
    """Raise SolveError with the reasons of all routes that no muscle serves."""
    if unserved:
        reasons = "; ".join(f"{item.sweep.route.name}: {item.reason}" for item in unserved)
        raise SolveError(f"no muscle serves {len(unserved)} of the routes: {reasons}.")
