"""Report chapters: the inspection of recordings, each with its columns, runs, branches, plateaus and findings."""

import dataclasses
import re
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ...core import HintedText, quantity_text
from ...recording.columns import display_scale, quantity_of
from ...report.chapter import BY_ROW, Chapter, NamedValue, Plot, Table, TableColumn
from ..readers.constants import CONSTANT_QUANTITIES
from ..reported import unit_column
from .inspection import Inspection
from .runs import Run

MAX_FILES, MAX_RUNS, MAX_LISTED = 12, 8, 4
"""Rows of the brief view: files, runs of a file, and branches or outliers (chosen)."""


def inspection_chapters(inspections: Sequence[Inspection]) -> list[Chapter]:
    """Return the chapter of each recording; of several, the overview stands first, and the brief view has it alone."""
    if len(inspections) == 1:
        return [inspection_chapter(inspections[0])]
    parts = [dataclasses.replace(inspection_chapter(each).among(suffix=f"-{i}"), brief=False)
             for i, each in enumerate(inspections, 1)]  # fmt: skip
    return [_overview(inspections), *parts]


def inspection_chapter(inspection: Inspection) -> Chapter:
    """Return the chapter of one recording."""
    recording, sampling = inspection.recording, inspection.sampling
    tables = [_column_table(inspection), _run_table(inspection.runs), _branch_table(inspection),
              _plateau_table(inspection), _outlier_table(inspection)]  # fmt: skip
    summary = "The rows have no time."
    if sampling:
        gaps = f", {len(sampling.gaps)} gaps" if sampling.gaps else ""
        regularity = "time stamps repeat" if sampling.rounded else f"jitter {100 * sampling.jitter:.1f} %"
        summary = f"{sampling.rate:.4g} rows per second over {sampling.duration:.4g} s, {regularity}{gaps}."
    return Chapter(
        name="inspection",
        title=f"{recording.origin}: {len(recording)} rows",
        summary=summary,
        values=tuple(_values(inspection)),
        tables=tuple(table for table in tables if table is not None),
        plots=(Plot("recording", f"{recording.origin}: branches, plateaus, outliers and limits.", inspection.plot),),
        problems=tuple(each.text for each in inspection.findings if each.serious),
        notes=(*recording.notes, *(each.text for each in inspection.findings if not each.serious)),
    )


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
        yield NamedValue("rows before a gap", tuple(gap.row + 1 for gap in sampling.gaps) or None, brief=False)
        yield NamedValue("rows with the time of the row before", len(sampling.repeated_rows), brief=False)
        yield NamedValue("rows with an earlier time", len(sampling.backward_rows), brief=False)
        rows = sum(len(plateau.interval) for plateau in inspection.plateaus)
        yield NamedValue("plateaus", len(inspection.plateaus), remark=f"with {rows} rows")
        yield NamedValue("quasi-static rows", inspection.quasi_static, "1", "%", 2)
    if inspection.branch_agreement is not None:
        yield NamedValue("agreement with the branch column", inspection.branch_agreement, "1", "%", 3)
    yield NamedValue(
        "suspected outliers", len(inspection.outliers), remark="not removed" if inspection.outliers else ""
    )


def _units(name: str, value: Any) -> tuple[str, str]:
    """The SI unit and the displayed unit of a constant; empty for one that is no known quantity."""
    name = CONSTANT_QUANTITIES.get(name, name)
    quantity = quantity_of(name)
    return (quantity.unit, display_scale(name)[1]) if quantity and isinstance(value, float) else ("", "")


def _rows(parts: Sequence[Any]) -> dict[str, list[int]]:
    """The columns of a table with the first and the last row of each part, counted from 1."""
    return {
        "first row": [each.interval.start + 1 for each in parts],
        "last row": [each.interval.stop for each in parts],
    }


def _column_table(inspection: Inspection) -> Table:
    recording, names = inspection.recording, list(inspection.recording)
    values, sensors = [recording[name] for name in names], [inspection.sensors.get(name) for name in names]
    limits = {end: [limit if s and np.isfinite(limit := getattr(s, f"{end}_limit")) else None for s in sensors]
              for end in ("lower", "upper")}  # fmt: skip
    columns: dict[str, Any] = {
        "column": names,
        "unit in file": [unit if (unit := recording.units.get(name, "")) != "1" else "" for name in names],
        "min": TableColumn([float(each.min()) if each.size else None for each in values], BY_ROW),
        "max": TableColumn([float(each.max()) if each.size else None for each in values], BY_ROW),
        "unit": unit_column(names),
        "resolution": TableColumn([(s and s.resolution) or None for s in sensors], BY_ROW, digits=3),
        "noise": TableColumn([(s and s.noise) or None for s in sensors], BY_ROW, digits=2),
        "deviation": TableColumn([(s and s.std) or None for s in sensors], BY_ROW, digits=2, brief=False),
        **{f"{end} limit": TableColumn(values, BY_ROW, brief=any(v is not None for v in values))
           for end, values in limits.items()},
    }  # fmt: skip
    return Table("columns", "Columns", columns, "Limits: where the sensor saturates.", brief=len(names))


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
        "branch": [each.name for each in branches],
        "column": TableColumn([each.column for each in branches], brief=False),
        **_rows(branches),
        "pressure": TableColumn([(each.start_pressure, each.end_pressure) for each in branches], "Pa", "kPa"),
    }
    title = "Branches" if inspection.sampling else "Branches, if the rows are in order of time"
    return Table("branches", title, columns, brief=MAX_LISTED) if branches else None


def _plateau_table(inspection: Inspection) -> Table | None:
    plateaus = inspection.plateaus
    if not plateaus:
        return None
    columns: dict[str, Any] = {**_rows(plateaus)}
    for name in plateaus[0].values:
        unit, shown = unit_column([name]).values[0], display_scale(name)[1].removesuffix("-")
        columns[name] = TableColumn([each.values.get(name) for each in plateaus], unit, shown)
        errors = [each.standard_errors.get(name) for each in plateaus]
        columns[f"standard error of {name}"] = TableColumn(errors, unit, shown, digits=2)
    return Table("plateaus", "Plateaus", columns)


def _outlier_table(inspection: Inspection) -> Table | None:
    found = inspection.outliers
    columns: dict[str, Any] = {
        "column": [each.column for each in found],
        "row": [each.row + 1 for each in found],
        "value": TableColumn([each.value for each in found], BY_ROW),
        "expected": TableColumn([each.expected for each in found], BY_ROW),
        "unit": unit_column([each.column for each in found]),
        "deviations": TableColumn([each.deviations for each in found], digits=3, brief=False),
    }
    return Table("outliers", "Suspected outliers", columns, brief=MAX_LISTED) if found else None


def _overview(inspections: Sequence[Inspection]) -> Chapter:
    """Return the chapter of several files: one row each, and each note once with the files that it concerns."""
    constants: dict[str, dict[str, None]] = {}
    for each in inspections:
        for name, value in each.recording.constants.items():
            unit, shown = _units(name, value)
            text = quantity_text(value, unit, shown) if unit else str(value)
            constants.setdefault(name, {})[text] = None
    values = []
    for name, texts in constants.items():
        some = [*list(texts)[:MAX_LISTED], *(["..."] if len(texts) > MAX_LISTED else [])]
        values.append(NamedValue(name.replace("_", " "), "; ".join(some)))
    names = [", ".join(name for name in each.recording if name != "time") for each in inspections]
    rates = [each.sampling and each.sampling.rate for each in inspections]
    columns: dict[str, Any] = {
        "file": [each.recording.origin for each in inspections],
        "rows": [len(each.recording) for each in inspections],
        "rows per second": TableColumn(rates, short="per second"),
        "outliers": [len(each.outliers) for each in inspections],
        "quantities": TableColumn(names, brief=False),
        "runs": [_describe_runs(each.runs) for each in inspections],
    }
    return Chapter(
        name="overview",
        title=f"{len(inspections)} recordings",
        summary=f"Columns: {'; '.join(list(dict.fromkeys(names))[:MAX_LISTED])}.",
        values=tuple(values),
        tables=(Table("files", "Recordings", columns, brief=MAX_FILES),),
        problems=_common([[f.text for f in each.findings if f.serious] for each in inspections], inspections),
        notes=_common([[*each.recording.notes, *(f.text for f in each.findings if not f.serious)]
                       for each in inspections], inspections),
    )  # fmt: skip


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
    return f"{first.kind.name} at {first.constant_column} {first.constant_value * factor:.4g} {unit}{more}"


def _common(texts: Sequence[Sequence[str]], inspections: Sequence[Inspection]) -> tuple[str, ...]:
    """Each text once, with the files that it concerns; texts that differ in numbers alone are one."""
    found: dict[str, list[tuple[str, str]]] = {}
    for each, own in zip(inspections, texts, strict=True):
        for text in dict.fromkeys(own):
            found.setdefault(re.sub(r"\d[\d.]*", "#", text), []).append((text, each.recording.origin))
    lines = []
    for (text, origin), *others in found.values():
        same = len({other for other, _ in others} | {text}) == 1
        rest = f" and {len(others)} more" if others else ""
        which = f"{origin}{rest}" if same else f"{origin}; others with other numbers: {len(others)}"
        lines.append(text if same and len(others) + 1 == len(inspections) else HintedText(text, f" ({which})"))
    return tuple(lines)
