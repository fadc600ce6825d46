"""An inspection in words: the table of columns, and a line for each thing seen."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from ..recording.segment import Inspection, Outlier, Run, Sampling

COLUMNS = ("column", "written in", "min", "max", "unit", "resolution", "noise", "cut off at")
SHOWN = 8
"""Rows of a list that are printed; JSON has them all."""


def column_rows(seen: Inspection) -> Iterator[tuple[str, ...]]:
    """The table of columns, in units that people read."""
    recording = seen.recording
    for name in recording:
        factor, unit = _scale(name)
        values, sensor = recording[name] * factor, seen.sensors.get(name)
        ends = (
            [f"{end * factor:.4g}" for end in (sensor.lower_limit, sensor.upper_limit) if np.isfinite(end)]
            if sensor
            else []
        )
        yield (
            name,
            recording.units.get(name, ""),
            f"{values.min():.5g}",
            f"{values.max():.5g}",
            unit,
            f"{sensor.resolution * factor:.3g}" if sensor and sensor.resolution else "",
            f"{sensor.noise * factor:.2g}" if sensor and sensor.noise else "",
            ", ".join(ends),
        )


def summary(seen: Inspection) -> Iterator[str]:
    """Constants, sampling, runs, branches, plateaus, glitches, notes and findings, a line each."""
    for name, value in seen.recording.constants.items():
        factor, unit = _scale("length" if name == "resting_length" else "pressure" if name == "ambient" else "")
        yield f"{name}: {value * factor:.6g} {unit}" if isinstance(value, float) and unit else f"{name}: {value}"
    if seen.sampling:
        yield f"sampling: {_of_sampling(seen.sampling)}"
    yield f"runs: {_cut([_of_run(seen, run) for run in seen.runs])}"
    if seen.branches:
        order = "" if seen.sampling else ", if the order of the rows is their history"
        yield f"branches{order}: {_cut([_rows(b.name, b) for b in seen.branches])}"
    if seen.branch_agreement is not None:
        yield f"branches agree with the file's own column in {seen.branch_agreement:.1%} of the rows"
    if seen.sampling:
        held = sum(len(plateau.interval) for plateau in seen.plateaus)
        yield f"plateaus: {len(seen.plateaus)} with {held} rows; quasi-static are {seen.quasi_static:.0%} of all rows"
    if seen.outliers:
        yield f"suspected glitches: {len(seen.outliers)}, kept: {_cut([_of_outlier(o) for o in seen.outliers])}"
    yield from (f"note: {note}" for note in seen.recording.notes)
    yield from (f"{'PROBLEM' if finding.serious else 'note'}: {finding.text}" for finding in seen.findings)


def _scale(name: str) -> tuple[float, str]:
    from ..recording.display_units import display_scale

    return display_scale(name)


def _cut(parts: list[str]) -> str:
    more = [f"... {len(parts) - SHOWN} more"] if len(parts) > SHOWN else []
    return "; ".join([*parts[:SHOWN], *more])


def _rows(text: str, part: Any) -> str:
    return f"{text}, rows {part.interval.start + 1} to {part.interval.stop}"


def _of_sampling(timing: Sampling) -> str:
    gaps = f", {len(timing.gaps)} gaps" if timing.gaps else ""
    return f"{timing.rate:.4g} rows per second over {timing.duration:.4g} s, jitter {timing.jitter:.1%}{gaps}"


def _of_run(seen: Inspection, run: Run) -> str:
    if len(run.swept_columns) == 1 and run.constant_column is None:
        return _rows(f"only the {run.swept_columns[0]} was measured", run)
    if run.constant_column is None or run.constant_value is None:
        return _rows(run.kind.name, run)
    factor, unit = _scale(run.constant_column)
    return _rows(f"{run.kind.name} at {run.constant_column} {run.constant_value * factor:.4g} {unit}", run)


def _of_outlier(outlier: Outlier) -> str:
    factor, unit = _scale(outlier.column)
    said = f"{outlier.value * factor:.4g} {unit} between {outlier.expected * factor:.4g} {unit}"
    return f"{outlier.column} in row {outlier.row + 1} ({said})"
