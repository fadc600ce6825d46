"""Inspection: sampling, sensors, runs, branches, plateaus and data quality of a recording, before any fit."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

from ...core.short_repr import ShortRepr
from ...recording.recording import Recording
from .branches import Branch, branch_column_agreement, find_branches
from .findings import Finding, check_swept, collect_findings
from .outliers import Outlier, find_outliers
from .plateaus import Plateau, find_plateaus
from .plot import plot_segments
from .quasi_static import quasi_static_rows
from .runs import AT_REST, Run, find_runs
from .sampling import Sampling, analyse_sampling
from .sensor import Sensor, estimate_sensors
from .static_points import StaticPoints, find_static_points


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Inspection(ShortRepr):
    """Result of the inspection of a recording: sampling, sensors, segments, suspected outliers and findings."""

    recording: Recording
    sampling: Sampling | None
    sensors: Mapping[str, Sensor]
    runs: tuple[Run, ...]
    branches: tuple[Branch, ...]
    plateaus: tuple[Plateau, ...]
    outliers: tuple[Outlier, ...]
    quasi_static: float
    """Fraction of the rows that is quasi-static."""
    branch_agreement: float | None
    """Fraction of the rows in which the branch column of the file agrees; None without such a column."""
    findings: tuple[Finding, ...]
    static_points: StaticPoints | None = None
    """The levels of a force map without time; None for any other recording."""

    def plot(self) -> Any:
        """Pressure, force and length over time with branches, plateaus, outliers and limits; a Matplotlib figure."""
        return plot_segments(self.recording, self.sensors, self.branches, self.plateaus, self.outliers)


def inspect(recording: Recording, shared_sensors: Mapping[str, Sensor] | None = None) -> Inspection:
    """Inspect a recording. `shared_sensors`, estimated from several recordings of the test rig, take precedence."""
    shared = {name: sensor for name, sensor in (shared_sensors or {}).items() if name in recording.columns}
    sensors = {**estimate_sensors(recording), **shared}
    sampling = analyse_sampling(recording)
    runs = find_runs(recording, sensors)
    ordered = sampling is None or not (sampling.repeated_rows or sampling.backward_rows)
    points = find_static_points(recording)
    branches = () if points else find_branches(recording, sensors.get("pressure"), runs=runs)
    return Inspection(
        recording,
        sampling,
        sensors,
        runs,
        branches,
        find_plateaus(recording, sensors) if ordered else (),
        find_outliers(recording, sensors),
        float(quasi_static_rows(recording, sensors).mean()) if len(recording) else 0.0,
        branch_column_agreement(recording, branches) if branches else None,
        collect_findings(recording, sampling, sensors, runs),
        points,
    )


def inspect_all(recordings: Sequence[Recording]) -> tuple[Inspection, ...]:
    """Inspect recordings from one test rig, whose sensors are estimated jointly."""
    sensors = estimate_sensors(recordings)
    return tuple(inspect(recording, sensors) for recording in recordings)


def check_contents(recordings: Sequence[Recording]) -> None:
    """Raise ColumnError where a recording contradicts its file, or where a single recording contains no variation."""
    sensors = estimate_sensors(recordings) if recordings else {}
    for recording in recordings:
        runs = find_runs(recording, {name: s for name, s in sensors.items() if name in recording.columns})
        if len(recordings) == 1 or all(run.kind != AT_REST for run in runs):
            check_swept(recording, runs)
