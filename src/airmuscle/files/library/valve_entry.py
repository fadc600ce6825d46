"""Entries of the library that are valves."""

import dataclasses
from functools import partial
from typing import Any, ClassVar

import numpy as np

from ...core import Reference, UnknownNameError, model, parameter, suggestion
from ...core.plotting import LINES, new_figure, relabel_in_display_units
from ...physics.pneumatics import REFERENCE_DENSITY, REFERENCE_TEMPERATURE, Orifice
from .check import Check
from .entry_display import EntryDisplay

PATHS = ("valve", "exhaust")
"""Flow paths through a valve that a file may describe; the first is the default."""
FLOW_SUPPLY = 7e5
"""Absolute pressure [Pa] upstream of a valve in its chart (chosen)."""


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

    def chart(self) -> Any:
        return partial(_plot_flow, self)


def _plot_flow(entry: "ValveEntry") -> Any:
    """Volume flow of an open valve over the downstream pressure, from 7 bar absolute."""
    figure, axes = new_figure(height=2.6)
    downstream = np.linspace(0.0, 1.0, 81)[1:] * FLOW_SUPPLY
    flow = [6e4 * entry.flow(FLOW_SUPPLY, float(p)) for p in downstream]
    axes.plot(downstream / 1e3, flow, color=LINES[0])
    axes.set(
        xlabel="absolute pressure downstream [kPa(a)]",
        ylabel="flow [l/min (ANR)]",
        ylim=(0.0, None),
    )
    axes.set_title(f"fully open, {FLOW_SUPPLY / 1e3:g} kPa absolute upstream", fontsize=9)
    relabel_in_display_units([axes])
    return figure
