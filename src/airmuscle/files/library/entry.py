"""Entries of the library that are muscles or laws.

The fields of an entry are the keys of its file, see build.py, docs/guides/muscle-file.md and
docs/guides/valves.md. What most entries lack is imported where a file states it.
"""

import dataclasses
import warnings
from functools import partial
from typing import Any

from ...core import Reference, leaves
from ...core.errors import AirmuscleWarning, UnknownNameError, check_known
from ...physics import muscle as parts
from ...physics.muscle.characteristic.base import Characteristic, ForceLaw
from ...physics.muscle.characteristic.calls import with_stated_range
from ...physics.muscle.characteristic.validity_range import ValidityRange
from ...physics.muscle.geometry.base import Geometry
from .. import library
from .check import Check
from .entry_display import EntryDisplay

OPTIONAL_PARTS = ("spring", "damper", "friction", "wall", "series", "stop", "creep")
"""Optional elements of a muscle, as fields of an entry and tables of its file."""

MISSING_GEOMETRY = (
    "a [geometry], from which a plant takes the enclosed volume: give airmuscle fit or campaign"
    " --braid 'radius=10 mm, angle=24.4 deg' (from the outer diameter at rest and at full"
    " contraction) and the resting length, or write the table [geometry] in the file or in"
    " [plant.muscle]"
)
"""Geometry that a law needs to be a muscle, and the ways to give and to measure it."""
MAKERS_TABLE = "maker's table"
MEASURED = "measurement"
GEOMETRIC = "geometric model"
EVIDENCE = (MAKERS_TABLE, MEASURED, GEOMETRIC)
"""Words for what a law rests on, the strongest first: values that the maker of the product states,
measured points, or a shape of the muscle without measured points."""


@dataclasses.dataclass(frozen=True, repr=False)
class Entry(EntryDisplay):
    """Library entry of a muscle or a law, all numbers SI; `muscle` is the Muscle for use in a
    plant.

    `evidence` is what the law rests on, a word of EVIDENCE, or empty where it is not stated.
    `validity_range` is the range of the measurements or the publication, `uncertainty` the standard
    errors and correlations of fitted parameters, if the file states them, `error_band` the 95 %
    band of the predicted quantity, `ratings` the values that the maker of the muscle permits, if
    known. `measured_by` is who measured, `submitted_by` who contributed the entry; empty where it
    is not stated.
    """

    characteristic: Characteristic
    geometry: Geometry | None = None
    spring: "parts.Spring | None" = None
    damper: "parts.Damper | None" = None
    friction: "parts.friction.Friction | None" = None
    wall: "parts.Wall | None" = None
    series: "parts.SeriesElement | None" = None
    stop: "parts.Stop | None" = None
    creep: "parts.CreepElements | None" = None
    validity_range: ValidityRange | None = None
    ratings: "parts.Ratings | None" = None
    checks: tuple[Check, ...] = dataclasses.field(default=(), metadata={"key": "check"})
    references: tuple[Reference, ...] = dataclasses.field(default=(), metadata={"key": "reference"})
    uncertainty: "library.ParameterUncertainty | None" = None
    error_band: "library.StatedBand | None" = None
    evidence: str = ""
    measured_by: str = ""
    submitted_by: str = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.evidence:
            check_known("evidence: there is no", self.evidence, EVIDENCE)
        permitted = None if self.ratings is None else self.ratings.max_force
        law = with_stated_range(self.characteristic, self.validity_range, permitted)
        object.__setattr__(self, "characteristic", law)

    @property
    def muscle(self) -> "parts.Muscle":
        """Muscle with the elements of the entry. Raises UnknownNameError if the entry is a law
        without a geometry, or a law that is not solved for the force."""
        law, geometry = self.check_is_muscle()
        names = (*OPTIONAL_PARTS, "validity_range", "ratings")
        given = {name: part for name in names if (part := getattr(self, name)) is not None}
        return parts.Muscle(law, geometry, **given)

    def check_is_muscle(self) -> tuple[ForceLaw, Geometry]:
        """Law and geometry of the muscle. Raises UnknownNameError as `muscle`."""
        if not isinstance(self.characteristic, ForceLaw) or self.geometry is None:
            missing = (
                MISSING_GEOMETRY
                if self.geometry is None
                else "a law solved for the force: see as_force_law"
            )
            raise UnknownNameError(
                f"{self.name} is a characteristic, not a muscle; it lacks {missing}."
            )
        return self.characteristic, self.geometry

    def chart(self) -> Any:
        name = type(self.characteristic).__name__
        return partial(parts.plot_isobars, self.characteristic, name, self.validity_range)


def own_length(entry: Entry) -> float | None:
    """Resting length [m] of the law or geometry of an entry; None if it has none."""
    parts = (part for part in (entry.characteristic, entry.geometry) if part is not None)
    return next((length for part in parts for length in resting_lengths_in(part).values()), None)


def resting_lengths_in(thing: Any) -> dict[str, float]:
    """The resting lengths [m] in a model, by path."""
    return {
        leaf.path: float(leaf.value)
        for leaf in leaves(thing)
        if leaf.declared.name == "resting_length"
    }


def issue_warning(name: str, warning: str, stacklevel: int) -> None:
    """Issue the warning of an entry, if it has one, as an AirmuscleWarning; `stacklevel` counts
    from the caller; the functions of a room are called by one frame more (core/stubs.py)."""
    if warning:
        warnings.warn(f"{name}: {warning}", AirmuscleWarning, stacklevel=stacklevel + 1)
