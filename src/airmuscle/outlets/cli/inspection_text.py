"""Text of an inspection: the table of columns, and one line per property or finding."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ...bench.readers.constants import CONSTANT_QUANTITIES
from ...bench.segment import Inspection, Run, Sampling
from ...recording.display_units import display_scale
from ...report.formatting import MISSING
from .option_hints import in_options

COLUMNS = ("column", "unit in file", "min", "max", "unit", "resolution", "noise", "saturated at")
FILES = ("file", "rows", "rows per second", "outliers", "quantities", "runs")
MAX_ITEMS = 8
"""Items of a list that are printed; JSON contains all."""


def column_rows(inspection: Inspection) -> Iterator[tuple[str, ...]]:
    """Rows of the table of columns, in display units."""
    recording = inspection.recording
    for name in recording:
        factor, unit = display_scale(name)
        values, sensor = recording[name] * factor, inspection.sensors.get(name)
        limits = (sensor.lower_limit, sensor.upper_limit) if sensor else ()
        yield (
            name,
            unit_in_file if (unit_in_file := recording.units.get(name, "")) != "1" else "",
            f"{values.min():.4g}",
            f"{values.max():.4g}",
            unit if unit != "-" else "",
            f"{sensor.resolution * factor:.3g}" if sensor and sensor.resolution else MISSING,
            f"{sensor.noise * factor:.2g}" if sensor and sensor.noise else MISSING,
            ", ".join(f"{limit * factor:.4g}" for limit in limits if np.isfinite(limit)) or MISSING,
        )


def summary(inspection: Inspection) -> Iterator[str]:
    """Constants, sampling, runs, branches, plateaus, outliers, notes and findings, one line each."""
    yield from _constants(inspection)
    if inspection.sampling:
        yield f"sampling: {_describe_sampling(inspection.sampling)}"
    yield f"runs: {_shorten([_describe_run(run) for run in inspection.runs])}"
    if inspection.branches:
        order = "" if inspection.sampling else " (if the rows are in order of time)"
        yield f"branches{order}: {_shorten([_with_rows(b.name, b) for b in inspection.branches])}"
    if inspection.branch_agreement is not None:
        yield f"agreement with the branch column of the file: {100 * inspection.branch_agreement:.1f} % of the rows"
    if inspection.sampling:
        count = sum(len(plateau.interval) for plateau in inspection.plateaus)
        share = f"{100 * inspection.quasi_static:.0f} % of all rows are quasi-static"
        yield f"plateaus: {len(inspection.plateaus)} with {count} rows; {share}"
    if inspection.outliers:
        outliers = _shorten(list(map(str, inspection.outliers)))
        yield f"suspected outliers: {len(inspection.outliers)}, not removed: {outliers}"
    yield from _remarks(inspection)


def _constants(inspection: Inspection) -> Iterator[str]:
    for name, value in inspection.recording.constants.items():
        factor, unit = display_scale(CONSTANT_QUANTITIES.get(name, ""))
        yield f"{name}: {value * factor:.4g} {unit}" if isinstance(value, float) and unit else f"{name}: {value}"


def _remarks(inspection: Inspection) -> Iterator[str]:
    yield from (f"note: {note}" for note in inspection.recording.notes)
    for finding in inspection.findings:
        label = "PROBLEM" if finding.serious else "note"
        yield f"{label}: {in_options(finding.text, 'inspect')}"


def file_row(inspection: Inspection) -> tuple[str, ...]:
    """The row of a file in the table of many files: its runs are the first and the number of the others."""
    sampling, runs = inspection.sampling, inspection.runs
    more = f" and {len(runs) - 1} more" if len(runs) > 1 else ""
    return (
        inspection.recording.origin,
        str(len(inspection.recording)),
        f"{sampling.rate:.4g}" if sampling else MISSING,
        str(len(inspection.outliers)),
        ", ".join(name for name in inspection.recording if name != "time"),
        f"{_describe_run(runs[0]).partition(', rows')[0]}{more}" if runs else MISSING,
    )


def common_lines(inspections: Sequence[Inspection]) -> Iterator[str]:
    """The constants of many files with their values, and each note or finding once, with the number of its files."""
    constants: dict[str, list[str]] = {}
    remarks: dict[str, list[tuple[str, str]]] = {}
    for inspection in inspections:
        for line in _constants(inspection):
            constants.setdefault(line.partition(": ")[0], []).append(line.partition(": ")[2])
        for remark in dict.fromkeys(_remarks(inspection)):
            remarks.setdefault(re.sub(r"\d[\d.]*", "#", remark), []).append((remark, inspection.recording.origin))
    for name, values in constants.items():
        yield f"{name}: {_shorten(list(dict.fromkeys(values)))}"
    for found in remarks.values():
        (remark, origin), others = found[0], len(found) - 1
        same = len({text for text, _ in found}) == 1
        rest = f" and {others} more" if others else ""
        which = f"{origin}{rest}" if same else f"{origin}; others with other numbers: {others}"
        yield remark if same and len(found) == len(inspections) else f"{remark} ({which})"


def _shorten(items: list[str]) -> str:
    rest = [f"... {len(items) - MAX_ITEMS} more"] if len(items) > MAX_ITEMS else []
    return "; ".join([*items[:MAX_ITEMS], *rest])


def _with_rows(text: str, part: Any) -> str:
    return f"{text}, rows {part.interval.start + 1} to {part.interval.stop}"


def _describe_sampling(sampling: Sampling) -> str:
    gaps = f", {len(sampling.gaps)} gaps" if sampling.gaps else ""
    regularity = "time stamps repeat" if sampling.rounded else f"jitter {100 * sampling.jitter:.1f} %"
    return f"{sampling.rate:.4g} rows per second over {sampling.duration:.4g} s, {regularity}{gaps}"


def _describe_run(run: Run) -> str:
    if len(run.swept_columns) == 1 and run.constant_column is None:
        return _with_rows(f"only the {run.swept_columns[0]} was measured", run)
    if run.constant_column is None or run.constant_value is None:
        return _with_rows(run.kind.name, run)
    factor, unit = display_scale(run.constant_column)
    return _with_rows(f"{run.kind.name} at {run.constant_column} {run.constant_value * factor:.4g} {unit}", run)
