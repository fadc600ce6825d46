"""What a library file describes: a muscle or a law with its sources, its trust and its checks."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

from ..characteristic.base import Characteristic, ForceLaw
from ..characteristic.validity_range import ValidityRange
from ..core.errors import UnknownNameError
from ..core.reference import Reference
from ..geometry.base import Geometry

if TYPE_CHECKING:
    from ..friction.base import Friction
    from ..muscle import CreepElements, Damper, Muscle, SeriesElement, Spring, Stop, Wall

OPTIONAL_PARTS = ("spring", "damper", "friction", "wall", "series", "stop", "creep")
"""Parts that a muscle may do without, as fields of an entry and tables of its file."""


@dataclasses.dataclass(frozen=True)
class Check:
    """A published number that the entry must give: `quantity` at the `given` values, within a tolerance."""

    quantity: str
    conditions: tuple[tuple[str, float], ...]
    equals: float
    tolerance: float
    source: str


@dataclasses.dataclass(frozen=True)
class Entry:
    """One library file: a muscle or a law as it was read, all numbers SI.

    `provenance` says how the numbers came here (printed, measured, second hand, fitted, chosen), `warning` what a user
    must know before using it, and `validity_range` where the entry was measured or printed, when the file says so.
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
    checks: tuple[Check, ...] = ()
    references: tuple[Reference, ...] = ()

    @property
    def muscle(self) -> Muscle:
        """The muscle made of the entry's parts. Raises UnknownName where parts are missing."""
        from ..muscle import Muscle

        if not isinstance(self.characteristic, ForceLaw) or self.geometry is None:
            lack = (
                "a [geometry], which its file or [plant.muscle] can give"
                if self.geometry is None
                else "a law solved for the force: see as_force_law"
            )
            raise UnknownNameError(f"{self.name} is a characteristic, not yet a muscle; it lacks {lack}.")
        given = {part: getattr(self, part) for part in OPTIONAL_PARTS if getattr(self, part) is not None}
        return Muscle(self.characteristic, self.geometry, validity_range=self.validity_range, **given)
