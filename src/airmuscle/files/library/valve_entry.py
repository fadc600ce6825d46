"""ValveEntry: a library file of a valve, with sources, provenance and published flows."""

from __future__ import annotations

import dataclasses

from ...core.declaration import model, parameter
from ...core.errors import UnknownNameError, suggestion
from ...core.reference import Reference
from ...physics.pneumatics.gas import REFERENCE_DENSITY, REFERENCE_TEMPERATURE
from ...physics.pneumatics.valve import Orifice
from .entry import Check
from .entry_display import EntryDisplay

PATHS = ("valve", "exhaust")
"""Flow paths through a valve that a file may describe; the first is the default."""


@model
class SwitchingTimes:
    """Published switching times of a valve; a data sheet may state upper limits, such as "10 ms or less"."""

    opening_delay: float = parameter("s", "t_on", "time from the command to open until open", bounds=(0.0, 1.0))
    closing_delay: float = parameter("s", "t_off", "time from the command to close until closed", bounds=(0.0, 1.0))


@dataclasses.dataclass(frozen=True, repr=False)
class ValveEntry(EntryDisplay):
    """Library entry of a valve, all numbers SI; `valve` and `exhaust` are the orifices for use in a circuit.

    `provenance` is the origin of the numbers, `note` states what was published and how it was converted. A check is a
    published volume flow [m3/s at the reference atmosphere] between two absolute pressures [Pa].
    """

    name: str
    title: str
    provenance: str
    valve: Orifice
    exhaust: Orifice | None = None
    switching_times: SwitchingTimes | None = None
    note: str = ""
    warning: str = ""
    checks: tuple[Check, ...] = ()
    references: tuple[Reference, ...] = ()

    def orifice(self, path: str) -> Orifice:
        """Orifice of a flow path, "valve" or "exhaust". Raises UnknownNameError if the entry has no such path."""
        orifice: Orifice | None = getattr(self, path, None) if path in PATHS else None
        if orifice is None:
            available = ", ".join(p for p in PATHS if getattr(self, p) is not None)
            hint = suggestion(str(path), PATHS) if path not in PATHS else ""
            raise UnknownNameError(f"{self.name} has no path '{path}'; it has {available}.{hint}")
        return orifice

    def flow(self, upstream: float, downstream: float) -> float:
        """Volume flow [m3/s at the reference atmosphere] of the open valve at 293.15 K, absolute pressures [Pa]."""
        return float(self.valve.mass_flow(upstream, downstream, 1.0, REFERENCE_TEMPERATURE) / REFERENCE_DENSITY)
