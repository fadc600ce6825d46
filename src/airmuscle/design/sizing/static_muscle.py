"""Static force of a muscle within its working range: validity range, ratings, supply pressure and
geometry.
"""

import dataclasses
import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ...core import Array, ParameterError, ShortRepr, SolveError
from ...files.library import Entry, own_length, products_of_laws, scale_entry
from ...physics.muscle import LENGTH_BOUNDS, Muscle
from ...physics.muscle.characteristic import Characteristic, ContractionLaw, ForceLaw, PressureLaw
from ...physics.muscle.characteristic.modes import formula_alone

LEAST_DIAMETERS = 3.0
"""Least nominal length over the nominal diameter (chosen). The makers state one range of lengths
for all diameters; a muscle shorter than three diameters is its two end fittings, to which no law of
a cylinder applies."""
OUTLINE_POINTS = 33
"""Contractions at which the diameter is evaluated; linear between them (chosen)."""
BISECTIONS = 80
"""Bisections of the force of a law that is not solved for it; they reach rounding precision."""
TRIAL_RATIO = 1.001
"""Ratio of lengths of the trial that finds whether a law can be scaled (chosen)."""


def product_of(entry: Entry) -> str:
    """The product of a law, or the name of the law."""
    return products_of_laws().get(entry.name) or entry.name


class EndPoint(NamedTuple):
    """End point of a motion for one muscle: gauge pressure [Pa], contraction [1], tension [N], and
    the tension [N] of which the muscle is capable there at its maximum pressure."""

    pressure: float
    contraction: float
    force: float
    capacity: float


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class StaticMuscle(ShortRepr):
    """Static force of an entry, and its working range of gauge pressure [Pa] and contraction
    [1].
    """

    entry: Entry
    pressure_range: tuple[float, float]
    contraction_range: tuple[float, float]

    @functools.cached_property
    def muscle(self) -> Muscle | None:
        """The muscle of the entry; None for a law without a geometry."""
        is_muscle = self.entry.geometry is not None and isinstance(
            self.entry.characteristic, ForceLaw
        )
        return self.entry.muscle if is_muscle else None

    @property
    def max_force(self) -> float:
        """Force that the maker permits [N]; infinity if it is not stated."""
        ratings = self.entry.ratings
        return (
            ratings.max_force
            if ratings is not None and "max_force" in ratings.stated
            else float("inf")
        )

    def force(self, pressure: Any, contraction: Any) -> Any:
        """Static tension [N] at gauge pressure [Pa] and contraction [1]; arrays broadcast."""
        if self.muscle is not None:
            return self.muscle.static_force(pressure, contraction)
        return _solve_for_force(self.entry.characteristic, pressure, contraction)

    def capacity(self, contraction: Any) -> Any:
        """Maximum permitted tension [N] at a contraction [1]: that at the maximum pressure, or that
        of the maker.
        """
        return np.minimum(self.force(self.pressure_range[1], contraction), self.max_force)

    def floor(self, contraction: Any) -> Any:
        """Least tension [N] at a contraction [1]: that at the least pressure, or 0 where the muscle
        is slack.
        """
        return np.maximum(self.force(self.pressure_range[0], contraction), 0.0)

    def end_point(self, contraction: float, force: float) -> EndPoint:
        """The end point with this tension [N] at a contraction [1]. Raises SolveError if no
        pressure gives it.
        """
        from scipy.optimize import brentq

        def residual(pressure: float) -> float:
            return float(self.force(pressure, contraction)) - force

        low, high = self.pressure_range
        capacity = float(self.capacity(contraction))
        if residual(low) >= 0.0:  # within rounding of the least pressure
            return EndPoint(low, contraction, float(self.floor(contraction)), capacity)
        if residual(high) < 0.0:
            raise SolveError(
                f"{self.entry.name}: the force at {high / 1e5:.4g} bar and {100 * contraction:.4g}"
                f" % is {residual(high) + force:.4g} N; {force:.4g} N is needed."
            )
        pressure = float(brentq(residual, low, high, xtol=1e-9, rtol=8.9e-16, maxiter=300))
        return EndPoint(pressure, contraction, float(self.force(pressure, contraction)), capacity)

    def volume(self, pressure: float, contraction: float) -> float | None:
        """Enclosed volume [m3]; None without a geometry."""
        if self.entry.geometry is None:
            return None
        if self.muscle is None:
            return float(self.entry.geometry.volume(contraction))
        return float(
            self.muscle.volume(contraction, self.muscle.steady_state(pressure, contraction))
        )

    def diameter(self, contraction: float) -> float | None:
        """Maximum outer diameter of the enclosed volume [m], without the wall; None without a
        geometry.
        """
        if self.entry.geometry is None:
            return None
        _, radii = self.entry.geometry.outline(contraction)
        return 2.0 * float(np.max(radii))

    def outer_diameter(self, contraction: Array) -> Array:
        """Outer diameter at pressure [m] at contractions (N,), without the wall; 0 without a
        geometry.
        """
        if self.entry.geometry is None:
            return np.zeros(np.shape(contraction))
        return np.interp(contraction, *self._outline)

    @functools.cached_property
    def _outline(self) -> tuple[Array, Array]:
        """Contractions [1] and outer diameters [m], (OUTLINE_POINTS,) each."""
        contractions = np.linspace(*self.contraction_range, OUTLINE_POINTS)
        return contractions, np.array([self.diameter(float(each)) for each in contractions])


def length_range(entry: Entry, max_length: float) -> tuple[float, float]:
    """Least and greatest nominal length [m] for which the law of an entry can be used: from three
    diameters (chosen) up to `max_length`, or the only one for which it holds. Raises ParameterError
    if there are none, with the reason.
    """
    low, high = (
        LENGTH_BOUNDS
        if entry.ratings is None
        else (entry.ratings.min_length, entry.ratings.max_length)
    )
    if entry.ratings is not None:
        low = max(low, LEAST_DIAMETERS * entry.ratings.diameter)
    if (length := own_length(entry)) is not None:
        try:
            scale_entry(
                dataclasses.replace(entry, ratings=None), resting_length=TRIAL_RATIO * length
            )
        except ParameterError:
            low = high = length
    if low > max_length:
        what = "only length" if low == high else "least length"
        raise ParameterError(
            f"its {what} is {1e3 * low:.4g} mm; at most {1e3 * max_length:.4g} mm is allowed"
        )
    return low, min(high, max_length)


def at_length(entry: Entry, length: float) -> Entry:
    """The entry with this resting length [m]; a law in pressure and contraction alone is
    unchanged.
    """
    own = own_length(entry)
    return entry if own is None or own == length else scale_entry(entry, resting_length=length)


def _solve_for_force(law: Characteristic, pressure: Any, contraction: Any) -> Any:
    """Tension [N]; of a law that is not solved for it by bisection, limited to the range of forces
    of the law.
    """
    if not isinstance(law, ContractionLaw | PressureLaw):
        return law.force(pressure, contraction)
    p, eps = np.broadcast_arrays(
        np.asarray(pressure, dtype=float), np.asarray(contraction, dtype=float)
    )
    low, high = (np.full(p.shape, limit) for limit in law.force_range)
    with formula_alone():  # a bisection looks beyond the range
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            above = (
                law.contraction(p, middle) < eps
                if isinstance(law, ContractionLaw)
                else law.pressure(eps, middle) > p
            )
            low = np.where(above, low, middle)
            high = np.where(above, middle, high)
    return 0.5 * (low + high)


def least_sufficient(suffices: Callable[[float], bool], low: float, high: float) -> float:
    """The least length that suffices, between one that does not and one that does, to rounding."""
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if suffices(middle) else (middle, high)
    return high
