"""Inspection: sampling, sensors, runs, branches, plateaus and data quality of a recording, before any fit."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...core import BLUE, GREEN, ORANGE, PURPLE, RED, Array, ShortRepr, legend_below, new_figure
from ...recording.columns import display_scale
from ...recording.recording import Recording
from .branches import Branch, branch_column_agreement, find_branches
from .findings import Finding, check_swept, collect_findings
from .interval import StaticPoints, find_static_points
from .outliers import Outlier, find_outliers
from .plateaus import Plateau, find_plateaus, quasi_static_rows
from .runs import AT_REST, Run, find_runs
from .sensor import Sampling, Sensor, analyse_sampling, estimate_sensors


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
        recording = self.recording
        names = [n for n in _PLOTTED if n in recording] or [n for n in recording if n != "time"]
        if "contraction" in names and "length" in names:
            names.remove("length")
        abscissa: Array = recording["time"] if "time" in recording else np.arange(1.0, len(recording) + 1)
        figure, axes = new_figure(len(names), 1, height=1.1 + 1.5 * len(names), sharex=True, squeeze=False)
        for axis, name in zip(axes[:, 0], names, strict=True):
            factor, unit = display_scale(name)
            self._draw(axis, name, abscissa, factor)
            axis.set_ylabel(f"{name}\n[{unit}]")
        axes[-1, 0].set_xlabel("time [s]" if "time" in recording else "row")
        figure.align_ylabels()
        figure.suptitle(recording.origin, fontsize=9)
        legend_below(figure, axes[0, 0], columns=4)
        return figure

    def _draw(self, axis: Any, name: str, abscissa: Array, factor: float) -> None:
        """One column: readings coloured by branch, plateaus as bars, outliers as crosses, limits of the sensor."""
        values = self.recording[name] * factor
        _draw_readings(axis, self.branches, abscissa, values)
        for i, plateau in enumerate(self.plateaus):
            ends = abscissa[[plateau.interval.start, plateau.interval.stop - 1]]
            level = [plateau.values.get(name, np.nan) * factor] * 2
            axis.plot(ends, level, color=GREEN, linewidth=1.2, label="plateau" if i == 0 else None)
        if self.outliers:  # also in axes without outliers, because the legend is that of the first axis
            rows = [outlier.row for outlier in self.outliers if outlier.column == name]
            style = {"linestyle": "none", "marker": "x", "markersize": 6, "color": PURPLE}
            axis.plot(abscissa[rows], values[rows], label="suspected outlier", **style)
        if name in self.sensors and values.size:
            _draw_limits(axis, self.sensors[name], factor)


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


_PLOTTED = ("pressure", "force", "contraction", "length", "shortening", "position", "temperature")
_COLOURS = {1: BLUE, -1: RED}


def _draw_readings(axis: Any, branches: Sequence[Branch], abscissa: Array, values: Array) -> None:
    dots = {"linestyle": "none", "marker": ".", "markersize": 2.5}
    if not branches:
        axis.plot(abscissa, values, color=BLUE, label="measured", **dots)
    for branch in branches:
        rows = branch.interval.rows
        colour, label = _COLOURS[branch.direction], branch.name
        labels = axis.get_legend_handles_labels()[1]
        axis.plot(abscissa[rows], values[rows], color=colour, label=None if label in labels else label, **dots)


def _draw_limits(axis: Any, sensor: Sensor, factor: float) -> None:
    for limit in (sensor.lower_limit, sensor.upper_limit):
        if np.isfinite(limit):
            axis.axhline(limit * factor, color=ORANGE, linestyle="--", linewidth=1.0)
            axis.annotate("sensor limit", (0.995, limit * factor), xycoords=("axes fraction", "data"), ha="right",
                          va="bottom", fontsize=7, color=ORANGE)  # fmt: skip
