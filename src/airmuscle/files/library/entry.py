"""Entry: a library file of a muscle or a law, with sources, provenance and checks."""

from __future__ import annotations

import dataclasses
import warnings

from ...core.errors import AirmuscleWarning, UnknownNameError
from ...core.reference import Reference
from ...physics.muscle import CreepElements, Damper, Muscle, Ratings, SeriesElement, Spring, Stop, Wall
from ...physics.muscle.characteristic.base import Characteristic, ForceLaw
from ...physics.muscle.characteristic.validity_range import ValidityRange
from ...physics.muscle.friction.base import Friction
from ...physics.muscle.geometry.base import Geometry
from .entry_display import EntryDisplay
from .stated_band import StatedBand
from .uncertainty import ParameterUncertainty

OPTIONAL_PARTS = ("spring", "damper", "friction", "wall", "series", "stop", "creep")
"""Optional elements of a muscle, as fields of an entry and tables of its file."""

MISSING_GEOMETRY = (
    "a [geometry], from which a plant takes the enclosed volume: give airmuscle fit or campaign --braid 'radius=10 mm, "
    "angle=24.4 deg' (from the outer diameter at rest and at full contraction) and the resting length, or write the "
    "table [geometry] in the file or in [plant.muscle]"
)
"""Geometry that a law needs to be a muscle, and the ways to give and to measure it."""


@dataclasses.dataclass(frozen=True)
class Check:
    """Published value that an entry must reproduce: `quantity` under `conditions` within a tolerance, all SI."""

    quantity: str
    conditions: tuple[tuple[str, float], ...]
    equals: float
    tolerance: float
    source: str


@dataclasses.dataclass(frozen=True, repr=False)
class Entry(EntryDisplay):
    """Library entry of a muscle or a law, all numbers SI; `muscle` is the Muscle for use in a plant.

    `provenance` is the origin of the numbers (printed, measured, secondary source, fitted, chosen), `warning` a
    restriction of use, which is issued when the entry is loaded, `validity_range` the range of the measurements or the
    publication, `uncertainty` the standard errors and correlations of fitted parameters, if the file states them,
    `error_band` the 95 % band of the predicted quantity, `ratings` the values that the maker of the muscle permits, if
    known.
    """

    name: str
    title: str
    provenance: str
    characteristic: Characteristic
    geometry: Geometry | None = None
    spring: Spring | None = None
    damper: Damper | None = None
    friction: Friction | None = None
    wall: Wall | None = None
    series: SeriesElement | None = None
    stop: Stop | None = None
    creep: CreepElements | None = None
    note: str = ""
    warning: str = ""
    validity_range: ValidityRange | None = None
    ratings: Ratings | None = None
    checks: tuple[Check, ...] = ()
    references: tuple[Reference, ...] = ()
    uncertainty: ParameterUncertainty | None = None
    error_band: StatedBand | None = None

    @property
    def muscle(self) -> Muscle:
        """Muscle with the elements of the entry. Raises UnknownNameError if the entry is a law without a geometry, or
        a law that is not solved for the force."""
        if not isinstance(self.characteristic, ForceLaw) or self.geometry is None:
            missing = MISSING_GEOMETRY if self.geometry is None else "a law solved for the force: see as_force_law"
            raise UnknownNameError(f"{self.name} is a characteristic, not a muscle; it lacks {missing}.")
        parts = {part: getattr(self, part) for part in OPTIONAL_PARTS if getattr(self, part) is not None}
        return Muscle(
            self.characteristic, self.geometry, validity_range=self.validity_range, ratings=self.ratings, **parts
        )


def issue_warning(name: str, warning: str, stacklevel: int) -> None:
    """Issue the warning of an entry, if it has one, as an AirmuscleWarning; `stacklevel` counts from the caller."""
    if warning:
        warnings.warn(f"{name}: {warning}", AirmuscleWarning, stacklevel=stacklevel + 1)
