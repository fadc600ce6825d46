"""Entries of the library: muscles and laws, valves, products and plants, with sources, provenance
and verified checks.

The fields of an entry are the keys of its file, see build.py, docs/guides/muscle-file.md and
docs/guides/valves.md.
"""

import dataclasses
import math
import warnings
from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

from ...core import ABSOLUTE, Reference, check_field_types, model, parameter
from ...core.errors import (
    AirmuscleWarning,
    ParameterError,
    UnknownNameError,
    check_known,
    suggestion,
)
from ...physics import Characteristic, ForceLaw, Friction, Geometry, Plant, ValidityRange
from ...physics.muscle import (
    CreepElements,
    Damper,
    Muscle,
    Ratings,
    SeriesElement,
    Spring,
    Stop,
    Wall,
)
from ...physics.muscle.characteristic.calls import with_stated_range
from ...physics.pneumatics import REFERENCE_DENSITY, REFERENCE_TEMPERATURE, Orifice
from ...report.chapter import Table
from .entry_display import CHECK_UNITS, EntryDisplay
from .files import entries_of_product
from .uncertainty import ParameterUncertainty, StatedBand

OPTIONAL_PARTS = ("spring", "damper", "friction", "wall", "series", "stop", "creep")
"""Optional elements of a muscle, as fields of an entry and tables of its file."""

MISSING_GEOMETRY = (
    "a [geometry], from which a plant takes the enclosed volume: give airmuscle fit or campaign"
    " --braid 'radius=10 mm, angle=24.4 deg' (from the outer diameter at rest and at full"
    " contraction) and the resting length, or write the table [geometry] in the file or in"
    " [plant.muscle]"
)
"""Geometry that a law needs to be a muscle, and the ways to give and to measure it."""
PATHS = ("valve", "exhaust")
"""Flow paths through a valve that a file may describe; the first is the default."""
MAKERS_TABLE = "maker's table"
MEASURED = "measurement"
GEOMETRIC = "geometric model"
EVIDENCE = (MAKERS_TABLE, MEASURED, GEOMETRIC)
"""Words for what a law rests on, the strongest first: values that the maker of the product states,
measured points, or a shape of the muscle without measured points."""
CONDITIONS = {
    "pressure": ("Pa", ("contraction", "force")),
    "contraction": ("1", ("pressure", "force")),
    "force": ("N", ("pressure", "contraction")),
    "volume": ("m3", ("contraction",)),
    "flow": ("m3/s", ("upstream", "downstream")),
}
"""Quantities of a check, each with its unit and the quantities on which it depends; a flow is that
of a valve.
"""


@dataclasses.dataclass(frozen=True)
class Check:
    """Published value that an entry must reproduce within a tolerance: a quantity at given values
    of others, all SI.

    A volume flow is [m3/s at the reference atmosphere] between two absolute pressures [Pa].
    """

    quantity: str
    source: str
    equals: float = parameter("1", "x", "published value")
    tolerance: float = parameter("1", "dx", "permitted deviation")
    pressure: float | None = parameter("Pa", "p", "gauge pressure", default=None)
    contraction: float | None = parameter("1", "eps", "contraction", default=None)
    force: float | None = parameter("N", "F", "force", default=None)
    upstream: float | None = parameter(
        ABSOLUTE, "p_1", "absolute pressure upstream of a valve", default=None
    )
    downstream: float | None = parameter(
        ABSOLUTE, "p_2", "absolute pressure downstream of a valve", default=None
    )

    def __post_init__(self) -> None:
        check_field_types(self)
        _, required = _conditions_of(self.quantity)
        if tuple(name for name, _ in self.conditions) != required:
            raise ParameterError(
                f"a check of the {self.quantity} requires {' and '.join(required)}, and no other."
            )
        for name, value in (
            ("equals", self.equals),
            ("tolerance", self.tolerance),
            *self.conditions,
        ):
            if not math.isfinite(value) or (name == "tolerance" and value < 0.0):
                must = "not be negative" if math.isfinite(value) else "be finite"
                raise ParameterError(f"{name} is {value:g}; it must {must}.")

    @property
    def conditions(self) -> tuple[tuple[str, float], ...]:
        """The quantities on which the checked one depends, with their values."""
        return tuple(
            (name, getattr(self, name)) for name in CHECK_UNITS if getattr(self, name) is not None
        )

    @staticmethod
    def units_of_table(table: Mapping[str, Any]) -> dict[str, str]:
        """The units of the numbers of a table that depend on its quantity."""
        return dict.fromkeys(("equals", "tolerance"), _conditions_of(table.get("quantity"))[0])


def _conditions_of(quantity: Any) -> tuple[str, tuple[str, ...]]:
    """The unit of a checked quantity, and the quantities on which it depends. Raises
    ParameterError.
    """
    check_known("there is no check of the quantity", str(quantity), CONDITIONS)
    return CONDITIONS[quantity]


@dataclasses.dataclass(frozen=True, repr=False)
class Entry(EntryDisplay):
    """Library entry of a muscle or a law, all numbers SI; `muscle` is the Muscle for use in a
    plant.

    `evidence` is what the law rests on, a word of EVIDENCE, or empty where it is not stated.
    `validity_range` is the range of the measurements or the publication, `uncertainty` the standard
    errors and correlations of fitted parameters, if the file states them, `error_band` the 95 %
    band of the predicted quantity, `ratings` the values that the maker of the muscle permits, if
    known.
    """

    characteristic: Characteristic
    geometry: Geometry | None = None
    spring: Spring | None = None
    damper: Damper | None = None
    friction: Friction | None = None
    wall: Wall | None = None
    series: SeriesElement | None = None
    stop: Stop | None = None
    creep: CreepElements | None = None
    validity_range: ValidityRange | None = None
    ratings: Ratings | None = None
    checks: tuple[Check, ...] = dataclasses.field(default=(), metadata={"key": "check"})
    references: tuple[Reference, ...] = dataclasses.field(default=(), metadata={"key": "reference"})
    uncertainty: ParameterUncertainty | None = None
    error_band: StatedBand | None = None
    evidence: str = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.evidence:
            check_known("evidence: there is no", self.evidence, EVIDENCE)
        permitted = None if self.ratings is None else self.ratings.max_force
        law = with_stated_range(self.characteristic, self.validity_range, permitted)
        object.__setattr__(self, "characteristic", law)

    @property
    def muscle(self) -> Muscle:
        """Muscle with the elements of the entry. Raises UnknownNameError if the entry is a law
        without a geometry, or a law that is not solved for the force."""
        if not isinstance(self.characteristic, ForceLaw) or self.geometry is None:
            missing = (
                MISSING_GEOMETRY
                if self.geometry is None
                else "a law solved for the force: see as_force_law"
            )
            raise UnknownNameError(
                f"{self.name} is a characteristic, not a muscle; it lacks {missing}."
            )
        names = (*OPTIONAL_PARTS, "validity_range", "ratings")
        parts = {name: part for name in names if (part := getattr(self, name)) is not None}
        return Muscle(self.characteristic, self.geometry, **parts)


@model
class SwitchingTimes:
    """Published switching times of a valve; a data sheet may state upper limits, such as "10 ms or
    less".
    """

    from_file: ClassVar[bool] = False

    opening_delay: float = parameter(
        "s", "t_on", "time from the command to open until open", bounds=(0.0, 1.0)
    )
    closing_delay: float = parameter(
        "s", "t_off", "time from the command to close until closed", bounds=(0.0, 1.0)
    )


@dataclasses.dataclass(frozen=True, repr=False)
class ValveEntry(EntryDisplay):
    """Library entry of a valve, all numbers SI; `valve` and `exhaust` are the orifices for use in a
    circuit.
    """

    valve: Orifice
    exhaust: Orifice | None = None
    switching_times: SwitchingTimes | None = None
    checks: tuple[Check, ...] = dataclasses.field(default=(), metadata={"key": "check"})
    references: tuple[Reference, ...] = dataclasses.field(default=(), metadata={"key": "reference"})

    def orifice(self, path: str) -> Orifice:
        """Orifice of a flow path, "valve" or "exhaust". Raises UnknownNameError if the entry has no
        such path.
        """
        orifice: Orifice | None = getattr(self, path, None) if path in PATHS else None
        if orifice is None:
            available = ", ".join(p for p in PATHS if getattr(self, p) is not None)
            hint = suggestion(str(path), PATHS) if path not in PATHS else ""
            raise UnknownNameError(f"{self.name} has no path '{path}'; it has {available}.{hint}")
        return orifice

    def flow(self, upstream: float, downstream: float) -> float:
        """Volume flow [m3/s at the reference atmosphere] of the open valve at 293.15 K, absolute
        pressures [Pa].
        """
        return float(
            self.valve.mass_flow(upstream, downstream, 1.0, REFERENCE_TEMPERATURE)
            / REFERENCE_DENSITY
        )


@dataclasses.dataclass(frozen=True, repr=False)
class ProductEntry(EntryDisplay):
    """Library entry of a commercial muscle: the values that its maker permits [SI], with provenance
    and sources.

    It has no characteristic; the file of a muscle or a law that was measured on this product refers
    to it, `product = "festo-dmsp-20"`, or has a table [ratings] of its own.
    """

    ratings: Ratings
    references: tuple[Reference, ...] = dataclasses.field(default=(), metadata={"key": "reference"})

    def _tables(self) -> Iterator[Table]:
        """The permitted ranges, and the muscles and laws that were measured on the product."""
        rows = list(self.ratings.ranges())
        columns = {"permitted": [row.quantity for row in rows], "range": list(map(str, rows))}
        yield Table("permitted", "Permitted ranges", columns)
        laws = entries_of_product(self.name)
        yield Table(
            "laws", "Muscles and laws of this product", {"law": list(laws)}, brief=len(laws)
        )

    def _remarks(self) -> Iterator[str]:
        if not entries_of_product(self.name):
            yield "No law of it is published; fit one to measurements."


@dataclasses.dataclass(frozen=True, repr=False)
class PlantEntry(EntryDisplay):
    """Plant of the library, all numbers SI; its file has the tables of a scenario, and the source
    of each number.

    `sources` are pairs of a path in the file, such as mechanism.radius, and the source of the
    numbers under it: "chosen" if no publication states them.
    """

    plant: Plant
    sources: tuple[tuple[str, str], ...] = ()
    references: tuple[Reference, ...] = dataclasses.field(default=(), metadata={"key": "reference"})

    def _chart(self) -> Any:
        return self.plant._card().draw


AnyEntry = Entry | ValveEntry | ProductEntry | PlantEntry


def issue_warning(name: str, warning: str, stacklevel: int) -> None:
    """Issue the warning of an entry, if it has one, as an AirmuscleWarning; `stacklevel` counts
    from the caller; the functions of a room are called by one frame more (core/stubs.py)."""
    if warning:
        warnings.warn(f"{name}: {warning}", AirmuscleWarning, stacklevel=stacklevel + 1)


@dataclasses.dataclass(frozen=True)
class CheckResult:
    """A check of a library entry with the value computed by the model."""

    check: Check
    computed: float

    @property
    def passes(self) -> bool:
        """Whether the computed value is within the tolerance; False for NaN."""
        return abs(self.computed - self.check.equals) <= self.check.tolerance

    def __str__(self) -> str:
        check = self.check
        conditions = ", ".join(f"{name} {value:.4g}" for name, value in check.conditions)
        relation = "within" if self.passes else "NOT within"
        return (
            f"{check.quantity} at {conditions}: computed {self.computed:.4g}, {relation} "
            f"{check.equals:.4g} ± {check.tolerance:.4g} ({check.source})"
        )


def verify(entry: Entry) -> tuple[CheckResult, ...]:
    """Results of all checks of a library entry. Raises SolveError if the model has no solution."""
    results = []
    for check in entry.checks:
        model: Any = entry.geometry if check.quantity == "volume" else entry.characteristic
        if model is None:
            raise ParameterError(
                f"{entry.name}: a check of the volume requires a [geometry] in the file."
            )
        results.append(
            CheckResult(check, float(getattr(model, check.quantity)(**dict(check.conditions))))
        )
    return tuple(results)
