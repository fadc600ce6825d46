"""Outliers of the force, and a pressure sensor at its limit."""

import math
from collections.abc import Sequence

import numpy as np

from ...core import Hint, HintedText
from ...recording import Recording
from ...recording.columns import displayed
from ..estimation import Huber
from ..inspection import estimate_sensors, find_outliers
from .bench_rows import file_list

MIN_DISTANCE = 0.02
"""Minimum distance of an outlier of the force from its neighbours, as a fraction of the maximum
force (chosen).
"""
MIN_SHARE = 0.002
MIN_RMS = 0.005
"""Minimum share of rows with such outliers that a fit reports, or of their part of the rms error,
as a fraction of the maximum force (chosen)."""
HELD = 0.005
"""Range of the contraction at a held length (chosen)."""
HUBER = 3.0
"""Threshold of the proposed Huber loss, in standard deviations of the sensor."""


def outlier_notes(recordings: Sequence[Recording]) -> list[str]:
    """The remark on outliers of the force; empty where there are few, or where the rows are in no
    order of time.
    """
    timed = [run for run in recordings if "time" in run and "force" in run and len(run)]
    if not timed:
        return []
    sensors = estimate_sensors(timed)
    greatest = _greatest_force(timed)
    outliers = [
        (run, outlier)
        for run in timed
        for outlier in find_outliers(run, {"force": sensors["force"]})
        if abs(outlier.value - outlier.expected) > MIN_DISTANCE * greatest
    ]
    rows = sum(map(len, timed))
    rms = math.sqrt(sum((outlier.value - outlier.expected) ** 2 for _, outlier in outliers) / rows)
    if not outliers or (len(outliers) < MIN_SHARE * rows and rms < MIN_RMS * greatest):
        return []
    files = {run.origin for run in timed}
    spoilt = {run.origin for run, _ in outliers}
    examples = "; ".join(
        f"{run.origin}, row {outlier.row + 1} ({outlier.value:.4g} N, neighbours"
        f" {outlier.expected:.4g} N)"
        for run, outlier in outliers[:3]
    )
    return [
        HintedText(
            f"Suspected outliers of the force pull the law: {len(outliers)} of {rows} rows, in"
            f" {len(spoilt)} of {len(files)} files, which alone give an rms error of {rms:.2g} N"
            f" ({examples}).",
            Hint("To leave them out", "drop_outliers", True, "ColumnMapping"),
            Hint(
                "To reduce their weight",
                "loss",
                Huber(float(f"{HUBER * sensors['force'].std:.2g}")),
            ),
        )
    ]


def saturation_notes(recordings: Sequence[Recording]) -> list[str]:
    """The remark on a pressure sensor at its upper limit, while the force at constant length still
    changes.
    """
    runs = [
        run
        for run in recordings
        if all(name in run for name in ("time", "pressure", "contraction", "force"))
    ]
    if not runs:
        return []
    limit = estimate_sensors(
        [Recording({"pressure": run["pressure"]}, run.origin) for run in runs]
    )["pressure"]
    least = MIN_DISTANCE * _greatest_force(runs)
    at_limit = {
        run.origin: run.rows(run["pressure"] >= limit.upper_limit - limit.tolerance) for run in runs
    }
    saturated = {
        name: run
        for name, run in at_limit.items()
        if len(run) and np.ptp(run["contraction"]) < HELD
    }
    rows_of = {name: len(run) for name, run in saturated.items() if np.ptp(run["force"]) > least}
    text = (
        f"The pressure sensor saturates at {limit.upper_limit / 1e3:.4g} kPa, in"
        f" {sum(rows_of.values())} rows of {file_list([*rows_of])}, where the force still changes:"
        " the pressure is greater there, and the law takes the limit for it. Leave these rows out,"
        " or use a sensor of a greater range."
    )
    return [text] if rows_of else []


def _greatest_force(recordings: Sequence[Recording]) -> float:
    return float(np.nanquantile(np.concatenate([run["force"] for run in recordings]), 0.99))


def level_text(name: str, value: float) -> str:
    """The level [SI] of a quantity as text in its unit of display; a contraction near 0 is 0."""
    return displayed(name, 0.0 if name == "contraction" and abs(value) < 5e-5 else value, 3)
