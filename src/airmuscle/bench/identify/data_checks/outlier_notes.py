"""Remark on the suspected outliers that an inspection lists, with the remedies of a fit."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ....core.errors import Hint, HintedText
from ....recording import Recording
from ...segment import Outlier, estimate_sensors, find_outliers
from ..loss import Huber

MIN_DISTANCE = 0.02
"""Minimum distance of an outlier of the force from its neighbours, as a fraction of the maximum force (chosen)."""
MIN_SHARE = 0.002
"""Minimum share of rows with such outliers that a fit reports (chosen)."""
HUBER = 3.0
"""Threshold of the proposed Huber loss, in standard deviations of the sensor."""


def outlier_notes(recordings: Sequence[Recording]) -> list[str]:
    """The remark on outliers of the force; empty where there are few, or where the rows are in no order of time."""
    timed = [run for run in recordings if "time" in run and "force" in run and len(run)]
    if not timed:
        return []
    sensors = estimate_sensors(timed)
    greatest = float(np.nanquantile(np.concatenate([run["force"] for run in timed]), 0.99))
    found = [
        (run, outlier)
        for run in timed
        for outlier in find_outliers(run, {"force": sensors["force"]})
        if abs(outlier.value - outlier.expected) > MIN_DISTANCE * greatest
    ]
    if len(found) < MIN_SHARE * sum(map(len, timed)):
        return []
    files = len({run.origin for run, _ in found})
    examples = "; ".join(_describe(run, outlier) for run, outlier in found[:3])
    return [
        HintedText(
            f"{len(found)} rows of {files} {'file' if files == 1 else 'files'} are suspected outliers of the force, "
            f"which pull the law: {examples}.",
            Hint("To leave them out", "drop_outliers", True, "read"),
            Hint("To reduce their weight", "loss", Huber(_rounded(HUBER * sensors["force"].std))),
        )
    ]


def _describe(run: Recording, outlier: Outlier) -> str:
    return f"{run.origin}, row {outlier.row + 1} ({outlier.value:.4g} N, neighbours {outlier.expected:.4g} N)"


def _rounded(scale: float) -> float:
    """A scale with two significant digits."""
    return float(f"{scale:.2g}")
