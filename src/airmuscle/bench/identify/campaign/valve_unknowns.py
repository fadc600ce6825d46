"""Unknowns of the fill and the discharge valve: those that the records show, and what is supposed of the others."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from ..dynamic import DynamicFit
from ..result import Estimate
from .record import CampaignRecord

FILL, DISCHARGE = "circuit.fill", "circuit.discharge"
SUPPLY = "circuit.supply.pressure"
CONDUCTANCE, RATIO = "conductance", "critical_ratio"
MAX_RATIO_ERROR = 0.1
"""Standard error of a critical ratio from which it counts as not determined (chosen)."""


@dataclasses.dataclass(frozen=True)
class ValveUnknowns:
    """The valves that the steps of the records show, and the reason for a common critical ratio, empty without one."""

    fill: bool
    discharge: bool
    common_ratio: str = ""

    @classmethod
    def of(cls, records: Sequence[CampaignRecord], common_ratio: str = "") -> ValveUnknowns:
        """The valves through which the air of these records flows."""
        changes = [step.change for record in records for step in record.steps]
        return cls(any(change > 0 for change in changes), any(change < 0 for change in changes), common_ratio)

    @property
    def both(self) -> bool:
        """Whether the records show both valves."""
        return self.fill and self.discharge

    def paths(self, name: str) -> list[str | tuple[str, ...]]:
        """The paths of a parameter of the valves: one for each valve, or a pair with one common value."""
        paths = [f"{valve}.{name}" for valve in (FILL, DISCHARGE)]
        if self.both and not (name == RATIO and self.common_ratio):
            return [*paths]
        return [tuple(paths if self.fill else paths[::-1])]

    @property
    def shared(self) -> list[str | tuple[str, ...]]:
        """The paths of critical ratios and, with a fill, of the supply pressure."""
        return [*self.paths(RATIO), *([SUPPLY] if self.fill else [])]

    @property
    def supposed(self) -> list[str]:
        """What is supposed of the valves, as sentences."""
        if self.common_ratio:
            return [f"{self.common_ratio} Both valves are supposed to have the same critical ratio."]
        if self.both:
            return []
        missing, shown = ("discharge", "fill") if self.fill else ("fill", "discharge")
        return [f"No record is a {missing}: the {missing} valve is supposed to be equal to the {shown} valve."]


def poor_ratios(fit: DynamicFit) -> str:
    """The critical ratios that a fit does not determine, as a sentence; empty if there are none."""
    poor = [e for e in fit.estimates if e.name.endswith(RATIO) and (e.on_bound or not e.stderr <= MAX_RATIO_ERROR)]
    if not poor:
        return ""
    parts = [f"{estimate.name.split('.')[1]} valve ({_reason(estimate)})" for estimate in poor]
    return f"The records do not determine the critical ratio of the {' and the '.join(parts)}."


def _reason(estimate: Estimate) -> str:
    if estimate.on_bound:
        return f"on its bound, {estimate.value:.3g}"
    return f"standard error {estimate.stderr:.2g}" if np.isfinite(estimate.stderr) else "it has no effect on them"
