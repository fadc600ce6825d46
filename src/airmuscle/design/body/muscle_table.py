"""Table of the static force of a muscle over nominal length, pressure and contraction, as smooth
functions with their derivatives.
"""

import dataclasses
from typing import Any, NamedTuple

import numpy as np

from ...core import AirmuscleError, Array, ParameterError
from ...files.library import Entry
from ..sizing import SizingConditions, StaticMuscle, working_muscle
from ..sizing.static_muscle import at_length, length_range
from .route_muscle import FITTING_DIAMETERS

LENGTHS = 7
"""Lengths of the table of a law that depends on its length; linear between them (chosen)."""
PRESSURES = 25
CONTRACTIONS = 49
"""Points of the bicubic splines of the force (chosen)."""
LONGEST = 2.0
"""Greatest nominal length [m] of the table (chosen)."""
SAME = 1e-9
"""Relative difference of forces up to which a law does not depend on its length."""


class ForceValues(NamedTuple):
    """Forces [N] and their derivatives by length, pressure and contraction, (N,) each."""

    force: Array
    by_length: Array
    by_pressure: Array
    by_contraction: Array


@dataclasses.dataclass(frozen=True, eq=False)
class MuscleTable:
    """Static force of a muscle of the library.

    name         of its entry
    lengths      nominal lengths [m] (G,), one where the force does not depend on it
    pressure     gauge pressures [Pa] (P,)
    contraction  contractions [1] (E,), from the least to the greatest of all lengths
    force        forces [N] (G, P, E)
    max_force    permitted force [N]
    fittings     length of both end fittings [m] (chosen)
    length_range least and greatest nominal length [m]
    """

    name: str
    lengths: Array
    pressure: Array
    contraction: Array
    force: Array
    max_force: float
    fittings: float
    length_range: tuple[float, float]


class ForceSplines:
    """Splines of a table."""

    def __init__(self, table: MuscleTable) -> None:
        from scipy.interpolate import RectBivariateSpline

        self.table = table
        self._splines: list[Any] = [
            RectBivariateSpline(table.pressure, table.contraction, force) for force in table.force
        ]

    def at(self, length: float, pressure: float, contraction: Array) -> ForceValues:
        """Forces at a length [m], a pressure [Pa] and contractions [1] (N,), linear in the
        contraction beyond its range, and at most the permitted one.
        """
        table = self.table
        if len(table.lengths) == 1:
            values = self._of(0, pressure, contraction)
        else:
            place = int(np.clip(np.searchsorted(table.lengths, length) - 1, 0, LENGTHS - 2))
            span = table.lengths[place + 1] - table.lengths[place]
            part = (length - table.lengths[place]) / span
            low = self._of(place, pressure, contraction)
            high = self._of(place + 1, pressure, contraction)
            values = ForceValues(
                (1.0 - part) * low.force + part * high.force,
                (high.force - low.force) / span,
                (1.0 - part) * low.by_pressure + part * high.by_pressure,
                (1.0 - part) * low.by_contraction + part * high.by_contraction,
            )
        free = np.asarray(values.force < table.max_force, float)
        return ForceValues(
            np.minimum(values.force, table.max_force),
            free * values.by_length,
            free * values.by_pressure,
            free * values.by_contraction,
        )

    def _of(self, number: int, pressure: float, contraction: Array) -> ForceValues:
        """The values of one length."""
        spline = self._splines[number]
        first = self.table.contraction[0]
        last = self.table.contraction[-1]
        inside = np.clip(contraction, first, last)
        p = np.full(inside.shape, pressure)
        slope = spline.ev(p, inside, dy=1)
        beyond = contraction - inside
        force = spline.ev(p, inside) + slope * beyond
        by_length = np.zeros(force.shape)
        by_pressure = spline.ev(p, inside, dx=1)
        return ForceValues(force, by_length, by_pressure, slope)


def muscle_table(entry: Entry, conditions: SizingConditions) -> MuscleTable:
    """The table of a library entry. Raises ParameterError if it has no working range."""
    diameter = entry.ratings.diameter if entry.ratings else 0.0
    longest = min(LONGEST, conditions.max_length)
    low, high = length_range(entry, longest)
    lengths = np.geomspace(low, high, LENGTHS) if high > low else np.array([low])
    muscles = [working_muscle(at_length(entry, float(length)), conditions) for length in lengths]
    contraction = np.linspace(
        max(0.0, *(muscle.contraction_range[0] for muscle in muscles)),
        min(muscle.contraction_range[1] for muscle in muscles),
        CONTRACTIONS,
    )
    pressure = np.linspace(*muscles[0].pressure_range, PRESSURES)
    force = np.array([_forces(muscle, pressure, contraction) for muscle in muscles])
    if not np.isfinite(force).all():
        raise ParameterError(f"{entry.name}: its law gives no force over its whole working range")
    if np.allclose(force, force[:1], rtol=SAME, atol=SAME * float(np.abs(force).max())):
        lengths = lengths[:1]
        force = force[:1]
    return MuscleTable(
        entry.name,
        lengths,
        pressure,
        contraction,
        force,
        muscles[0].max_force,
        2.0 * FITTING_DIAMETERS * diameter,
        (low, high),
    )


def _forces(muscle: StaticMuscle, pressure: Array, contraction: Array) -> Array:
    mesh = np.meshgrid(pressure, contraction, indexing="ij")
    return np.asarray(muscle.force(*mesh), float)


def muscle_tables(
    entries: tuple[Entry, ...], conditions: SizingConditions
) -> tuple[dict[str, MuscleTable], dict[str, str]]:
    """The tables by name, and the reasons of the entries that have none."""
    tables = {}
    refused = {}
    for entry in entries:
        try:
            tables[entry.name] = muscle_table(entry, conditions)
        except AirmuscleError as error:
            refused[entry.name] = str(error)
    return tables, refused
