"""Result of the inspection of recordings, with its chapter: columns, runs, branches, plateaus and
findings.
"""

import dataclasses
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ...core import (
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    RED,
    Array,
    HintedText,
    legend_below,
    new_figure,
    quantity_text,
)
from ...recording import Recording
from ...recording.columns import display_scale, quantity_of
from ...report.chapter import BY_ROW, Chapter, NamedValue, Plot, Table, TableColumn
from ..readers import CONSTANT_QUANTITIES
from ..reported import Reported, unit_column
from .branches import Branch
from .interval import StaticPoints
from .outliers import Outlier
from .plateaus import Plateau
from .runs import Run
from .sensor import Sampling, Sensor

MAX_FILES = 12
MAX_RUNS = 8
MAX_LISTED = 4
"""Rows of the brief view: files, runs of a file, and branches or outliers (chosen)."""
_PLOTTED = ("pressure", "force", "contraction", "length", "shortening", "position", "temperature")
_COLOURS = {1: BLUE, -1: RED}


@dataclasses.dataclass(frozen=True)
class Finding:
    """A data-quality finding. If it is `serious`, a fit of the recording would fail or mislead."""

    text: str
    serious: bool = False


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Inspection(Reported):
    """Result of the inspection of a recording: sampling, sensors, segments, suspected outliers and
    findings.
    """

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
    """Fraction of the rows in which the branch column of the file agrees; None without such a
    column.
    """
    findings: tuple[Finding, ...]
    static_points: StaticPoints | None = None
    """The levels of a force map without time; None for any other recording."""

    def plot(self) -> Any:
        """Pressure, force and length over time with branches, plateaus, outliers and limits; a
        Matplotlib figure.
        """
        recording = self.recording
        names = [n for n in _PLOTTED if n in recording] or [n for n in recording if n != "time"]
        if "contraction" in names and "length" in names:
            names.remove("length")
        abscissa: Array = (
            recording["time"] if "time" in recording else np.arange(1.0, len(recording) + 1)
        )
        figure, axes = new_figure(
            len(names), 1, height=1.1 + 1.5 * len(names), sharex=True, squeeze=False
        )
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
        """One column: readings coloured by branch, plateaus as bars, outliers as crosses, limits of
        the sensor.
        """
        values = self.recording[name] * factor
        dots = {"linestyle": "none", "marker": ".", "markersize": 2.5}
        if not self.branches:
            axis.plot(abscissa, values, color=BLUE, label="measured", **dots)
        for branch in self.branches:
            rows = branch.interval.rows
            labels = axis.get_legend_handles_labels()[1]
            label = None if branch.name in labels else branch.name
            axis.plot(
                abscissa[rows], values[rows], color=_COLOURS[branch.direction], label=label, **dots
            )
        for i, plateau in enumerate(self.plateaus):
            ends = abscissa[[plateau.interval.start, plateau.interval.stop - 1]]
            level = [plateau.values.get(name, np.nan) * factor] * 2
            axis.plot(ends, level, color=GREEN, linewidth=1.2, label="plateau" if i == 0 else None)
        if (
            self.outliers
        ):  # also in axes without outliers, because the legend is that of the first axis
            outlier_rows = [outlier.row for outlier in self.outliers if outlier.column == name]
            style = {"linestyle": "none", "marker": "x", "markersize": 6, "color": PURPLE}
            axis.plot(
                abscissa[outlier_rows], values[outlier_rows], label="suspected outlier", **style
            )
        sensor = self.sensors.get(name) if values.size else None
        for limit in (sensor.lower_limit * factor, sensor.upper_limit * factor) if sensor else ():
            if np.isfinite(limit):
                axis.axhline(limit, color=ORANGE, linestyle="--", linewidth=1.0)
                axis.annotate(
                    "sensor limit",
                    (0.995, limit),
                    xycoords=("axes fraction", "data"),
                    ha="right",
                    va="bottom",
                    fontsize=7,
                    color=ORANGE,
                )

    def chapter(self) -> Chapter:
        """The description of the recording."""
        recording = self.recording
        sampling = self.sampling
        tables = [
            _column_table(self),
            _run_table(self.runs),
            _branch_table(self),
            _plateau_table(self),
            _outlier_table(self),
        ]
        summary = "The time stands still." if sampling else "The rows have no time."
        if sampling and sampling.sample_time:
            gaps = f", {len(sampling.gaps)} gaps" if sampling.gaps else ""
            regularity = (
                "time stamps repeat"
                if sampling.rounded
                else f"jitter {100 * sampling.jitter:.1f} %"
            )
            summary = (
                f"{sampling.rate:.4g} rows per second over {sampling.duration:.4g} s,"
                f" {regularity}{gaps}."
            )
        return Chapter(
            "inspection",
            f"{recording.origin}: {len(recording)} rows",
            summary,
            values=tuple(_values(self)),
            tables=tuple(table for table in tables if table is not None),
            plots=(
                Plot(
                    "recording",
                    f"{recording.origin}: branches, plateaus, outliers and limits.",
                    self.plot,
                ),
            ),
            problems=tuple(finding.text for finding in self.findings if finding.serious),
            notes=(
                *recording.notes,
                *(finding.text for finding in self.findings if not finding.serious),
            ),
        )


def inspection_chapters(inspections: Sequence[Inspection]) -> list[Chapter]:
    """Return the chapter of each recording; of several, the overview stands first, and the brief
    view has it alone.
    """
    if len(inspections) == 1:
        return [inspections[0].chapter()]
    parts = [
        dataclasses.replace(inspection.chapter().among(suffix=f"-{i}"), brief=False)
        for i, inspection in enumerate(inspections, 1)
    ]
    return [_overview(inspections), *parts]


def _values(inspection: Inspection) -> Iterator[NamedValue]:
    sampling = inspection.sampling
    yield NamedValue("recording", inspection.recording.origin, brief=False)
    yield NamedValue("rows", len(inspection.recording), brief=False)
    for name, value in inspection.recording.constants.items():
        yield NamedValue(name.replace("_", " "), value, *_units(name, value))
    if sampling is not None:
        yield NamedValue("rows per second", sampling.rate, "1/s", brief=False)
        yield NamedValue("duration", sampling.duration, "s", brief=False)
        yield NamedValue("jitter", sampling.jitter, "1", "%", 3, brief=False)
        yield NamedValue(
            "rows before a gap", tuple(gap.row + 1 for gap in sampling.gaps) or None, brief=False
        )
        yield NamedValue(
            "rows with the time of the row before", len(sampling.repeated_rows), brief=False
        )
        yield NamedValue("rows with an earlier time", len(sampling.backward_rows), brief=False)
        rows = sum(len(plateau.interval) for plateau in inspection.plateaus)
        yield NamedValue("plateaus", len(inspection.plateaus), remark=f"with {rows} rows")
        yield NamedValue("quasi-static rows", inspection.quasi_static, "1", "%", 2)
    if inspection.branch_agreement is not None:
        yield NamedValue(
            "agreement with the branch column", inspection.branch_agreement, "1", "%", 3
        )
    remark = "not removed" if inspection.outliers else ""
    yield NamedValue("suspected outliers", len(inspection.outliers), remark=remark)


def _units(name: str, value: Any) -> tuple[str, str]:
    """The SI unit and the displayed unit of a constant; empty for one that is no known quantity."""
    name = CONSTANT_QUANTITIES.get(name, name)
    quantity = quantity_of(name)
    return (
        (quantity.unit, display_scale(name)[1])
        if quantity and isinstance(value, float)
        else ("", "")
    )


def _rows(parts: Sequence[Any]) -> dict[str, list[int]]:
    """The columns of a table with the first and the last row of each part, counted from 1."""
    first = [part.interval.start + 1 for part in parts]
    last = [part.interval.stop for part in parts]
    return {"first row": first, "last row": last}


def _limit_column(limits: Sequence[float | None]) -> TableColumn:
    """The column of limits of sensors, in the brief view where a sensor saturates."""
    finite = [limit if limit is not None and np.isfinite(limit) else None for limit in limits]
    return TableColumn(finite, BY_ROW, brief=any(limit is not None for limit in finite))


def _column_table(inspection: Inspection) -> Table:
    recording = inspection.recording
    names = list(inspection.recording)
    values = [recording[name] for name in names]
    units = [recording.units.get(name, "") for name in names]
    least = [float(readings.min()) if readings.size else None for readings in values]
    greatest = [float(readings.max()) if readings.size else None for readings in values]
    columns: dict[str, Any] = {
        "column": names,
        "unit in file": ["" if unit == "1" else unit for unit in units],
        "min": TableColumn(least, BY_ROW),
        "max": TableColumn(greatest, BY_ROW),
        "unit": unit_column(names),
        **_sensor_columns([inspection.sensors.get(name) for name in names]),
    }
    return Table(
        "columns", "Columns", columns, "Limits: where the sensor saturates.", brief=len(names)
    )


def _sensor_columns(sensors: Sequence[Sensor | None]) -> dict[str, TableColumn]:
    """The properties of the sensors of the columns, as far as they were estimated."""

    def estimates(name: str) -> list[float | None]:
        return [getattr(sensor, name, None) for sensor in sensors]

    return {
        "resolution": _positive_column(estimates("resolution"), 3),
        "noise": _positive_column(estimates("noise"), 2),
        "deviation": dataclasses.replace(_positive_column(estimates("std"), 2), brief=False),
        "lower limit": _limit_column(estimates("lower_limit")),
        "upper limit": _limit_column(estimates("upper_limit")),
    }


def _positive_column(values: Sequence[float | None], digits: int) -> TableColumn:
    return TableColumn([value or None for value in values], BY_ROW, digits=digits)


def _run_table(runs: Sequence[Run]) -> Table:
    names = [run.constant_column or "" for run in runs]
    columns: dict[str, Any] = {
        "run": [run.kind.name for run in runs],
        "constant": names,
        "level": TableColumn([run.constant_value for run in runs], BY_ROW),
        "unit": unit_column(names),
        "swept": [", ".join(run.swept_columns) for run in runs],
        **_rows(runs),
    }
    return Table("runs", "Runs", columns, brief=MAX_RUNS)


def _branch_table(inspection: Inspection) -> Table | None:
    branches = inspection.branches
    columns: dict[str, Any] = {
        "branch": [branch.name for branch in branches],
        "column": TableColumn([branch.column for branch in branches], brief=False),
        **_rows(branches),
        "pressure": TableColumn(
            [(branch.start_pressure, branch.end_pressure) for branch in branches], "Pa", "kPa"
        ),
    }
    title = "Branches" if inspection.sampling else "Branches, if the rows are in order of time"
    return Table("branches", title, columns, brief=MAX_LISTED) if branches else None


def _plateau_table(inspection: Inspection) -> Table | None:
    plateaus = inspection.plateaus
    if not plateaus:
        return None
    columns: dict[str, Any] = {**_rows(plateaus)}
    for name in plateaus[0].values:
        unit = unit_column([name]).values[0]
        shown = display_scale(name)[1].removesuffix("-")
        columns[name] = TableColumn([plateau.values.get(name) for plateau in plateaus], unit, shown)
        errors = [plateau.standard_errors.get(name) for plateau in plateaus]
        columns[f"standard error of {name}"] = TableColumn(errors, unit, shown, digits=2)
    return Table("plateaus", "Plateaus", columns)


def _outlier_table(inspection: Inspection) -> Table | None:
    outliers = inspection.outliers
    columns: dict[str, Any] = {
        "column": [outlier.column for outlier in outliers],
        "row": [outlier.row + 1 for outlier in outliers],
        "value": TableColumn([outlier.value for outlier in outliers], BY_ROW),
        "expected": TableColumn([outlier.expected for outlier in outliers], BY_ROW),
        "unit": unit_column([outlier.column for outlier in outliers]),
        "deviations": TableColumn(
            [outlier.deviations for outlier in outliers], digits=3, brief=False
        ),
    }
    return Table("outliers", "Suspected outliers", columns, brief=MAX_LISTED) if outliers else None


def _overview(inspections: Sequence[Inspection]) -> Chapter:
    """Return the chapter of several files: one row each, and each note once with the files that it
    concerns.
    """
    names = [
        ", ".join(name for name in inspection.recording if name != "time")
        for inspection in inspections
    ]
    problems = []
    notes = []
    for inspection in inspections:
        findings = inspection.findings
        problems.append([finding.text for finding in findings if finding.serious])
        remarks = [finding.text for finding in findings if not finding.serious]
        notes.append([*inspection.recording.notes, *remarks])
    rates = [inspection.sampling and inspection.sampling.rate for inspection in inspections]
    columns: dict[str, Any] = {
        "file": [inspection.recording.origin for inspection in inspections],
        "rows": [len(inspection.recording) for inspection in inspections],
        "rows per second": TableColumn(rates, short="per second"),
        "outliers": [len(inspection.outliers) for inspection in inspections],
        "quantities": TableColumn(names, brief=False),
        "runs": [_describe_runs(inspection.runs) for inspection in inspections],
    }
    return Chapter(
        name="overview",
        title=f"{len(inspections)} recordings",
        summary=f"Columns: {'; '.join(list(dict.fromkeys(names))[:MAX_LISTED])}.",
        values=tuple(_common_constants(inspections)),
        tables=(Table("files", "Recordings", columns, brief=MAX_FILES),),
        problems=_common(problems, inspections),
        notes=_common(notes, inspections),
    )


def _common_constants(inspections: Sequence[Inspection]) -> Iterator[NamedValue]:
    """The constants of all recordings, each with its different values."""
    constants: dict[str, dict[str, None]] = {}
    for inspection in inspections:
        for name, value in inspection.recording.constants.items():
            unit, shown = _units(name, value)
            text = quantity_text(value, unit, shown) if unit else str(value)
            constants.setdefault(name, {})[text] = None
    for name, texts in constants.items():
        listed_texts = list(texts)[:MAX_LISTED]
        if len(texts) > MAX_LISTED:
            listed_texts.append("...")
        yield NamedValue(name.replace("_", " "), "; ".join(listed_texts))


def _describe_runs(runs: Sequence[Run]) -> str | None:
    if not runs:
        return None
    more = f" and {len(runs) - 1} more" if len(runs) > 1 else ""
    first = runs[0]
    if len(first.swept_columns) == 1 and first.constant_column is None:
        return f"only the {first.swept_columns[0]} was measured{more}"
    if first.constant_column is None or first.constant_value is None:
        return f"{first.kind.name}{more}"
    factor, unit = display_scale(first.constant_column)
    return (
        f"{first.kind.name} at {first.constant_column} {first.constant_value * factor:.4g}"
        f" {unit}{more}"
    )


def _common(texts: Sequence[Sequence[str]], inspections: Sequence[Inspection]) -> tuple[str, ...]:
    """Each text once, with the files that it concerns; texts that differ in numbers alone are
    one.
    """
    occurrences: dict[str, list[tuple[str, str]]] = {}
    for inspection, file_texts in zip(inspections, texts, strict=True):
        for text in dict.fromkeys(file_texts):
            occurrences.setdefault(re.sub(r"\d[\d.]*", "#", text), []).append(
                (text, inspection.recording.origin)
            )
    lines = []
    for (text, origin), *further in occurrences.values():
        same = len({further_text for further_text, _ in further} | {text}) == 1
        rest = f" and {len(further)} more" if further else ""
        which = (
            f"{origin}{rest}" if same else f"{origin}; others with other numbers: {len(further)}"
        )
        lines.append(
            text
            if same and len(further) + 1 == len(inspections)
            else HintedText(text, f" ({which})")
        )
    return tuple(lines)
