"""All that can be told of a recording before anything is fitted."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

from ..recording import Recording
from .branches import Branch, branch_column_agreement, find_branches
from .findings import Finding, collect_findings
from .outliers import Outlier, find_outliers
from .plateaus import Plateau, find_plateaus
from .quasi_static import quasi_static_rows
from .runs import Run, find_runs
from .sampling import Sampling, analyse_sampling
from .sensor import Sensor, estimate_sensors


@dataclasses.dataclass(frozen=True, eq=False)
class Inspection:
    """What a recording holds: its sampling, sensors, runs, branches, plateaus, suspected glitches, and findings."""

    recording: Recording
    sampling: Sampling | None
    sensors: Mapping[str, Sensor]
    runs: tuple[Run, ...]
    branches: tuple[Branch, ...]
    plateaus: tuple[Plateau, ...]
    outliers: tuple[Outlier, ...]
    quasi_static: float
    """The part of the rows that is quasi-static."""
    branch_agreement: float | None
    """The part of the rows on which the file's own branch column says the same; None without one."""
    findings: tuple[Finding, ...]

    def plot(self) -> Any:
        """Pressure, force and length over time with branches, plateaus, glitches and cut-offs; a Matplotlib figure."""
        from .plot import plot_inspection

        return plot_inspection(self)


def inspect(recording: Recording, sensed: Mapping[str, Sensor] | None = None) -> Inspection:
    """What a recording holds. `sensed` are the sensors of the rig, where several recordings show them better."""
    known = {**estimate_sensors(recording), **{n: s for n, s in (sensed or {}).items() if n in recording.columns}}
    timing = analyse_sampling(recording)
    found = find_runs(recording, known)
    ordered = timing is None or not (timing.repeats or timing.backward)
    turned = find_branches(recording, known.get("pressure"))
    return Inspection(
        recording,
        timing,
        known,
        found,
        turned,
        find_plateaus(recording, known) if ordered else (),
        find_outliers(recording, known),
        float(quasi_static_rows(recording, known).mean()) if len(recording) else 0.0,
        branch_column_agreement(recording, turned) if turned else None,
        collect_findings(recording, timing, known, found),
    )


def inspect_all(recordings: Sequence[Recording]) -> tuple[Inspection, ...]:
    """The inspections of recordings from one rig, whose sensors are estimated together."""
    together = estimate_sensors(recordings)
    return tuple(inspect(recording, together) for recording in recordings)
