"""Checks of the data of a static fit: contradictions, outliers, sensor delays and scatter, as notes
with their cause.

They need no law. `check_data` joins them with the checks of `suspicious_values`, for every static
fit.
"""

import dataclasses
import math
from collections.abc import Iterator, Sequence

import numpy as np

from ...core import Hint, HintedText
from ...recording import Recording
from ...recording.columns import displayed
from ...report.chapter import NamedValue
from ..estimation import Huber
from ..inspection import estimate_noise, estimate_sensors, find_outliers, remembered
from .bench_rows import file_list
from .branch_residuals import SensorDelay, delay_notes, find_delay
from .contractions import without_missing_codes
from .contradictions import contradiction_notes, repeatability, two_muscle_notes
from .matched_rows import match_rows
from .misfit import LawMisfit
from .suspicious_values import find_suspicious

MAX_MISFIT = 3.0
MIN_MISFIT = 0.002
"""Residual above which the law does not follow the data: ratio to their scatter, and to the maximum
force, below which it is within the accuracy of load cells (chosen).
"""
MARGIN = 1.645
"""Standard errors of the rms error by which it must exceed this ratio: 5 % of the laws that reach
it exactly exceed it by chance.
"""
MIN_UNREPEATABLE = 0.005
"""Residual above which a difference of repeated runs is named that exceeds the noise by the first
ratio, as a fraction of the maximum force (chosen)."""


@dataclasses.dataclass(frozen=True)
class Scatter:
    """Standard deviations of the force: of noise, and of runs at equal pressure, contraction and
    direction [N]; None where the data do not show them. `branches` is the distance of the branches
    that the residuals follow [N].
    """

    noise: float | None
    repeatability: float | None
    branches: float = 0.0

    def values(self) -> Iterator[NamedValue]:
        """What is known of the scatter, for a report."""
        if self.noise is not None:
            yield NamedValue("noise of the data", self.noise, "N", digits=3)
        if self.repeatability is not None:
            yield NamedValue(
                "difference of repeated runs",
                float(np.sqrt(2.0)) * self.repeatability,
                "N",
                digits=3,
            )
        if self.branches:
            yield NamedValue("distance of the branches", self.branches, "N", digits=3)

    def misfit(self, rmse: float, rows: int, greatest: float, lengths: int = 1) -> LawMisfit | None:
        """The misfit of a law whose residual [N] is greater than the scatter explains, without its
        causes; None of a law that follows the data, or where their scatter is not known. A static
        law follows the middle of two branches.

        rmse      rms error of the law [N], which `rows` of the data determine
        greatest  maximum force of the data [N]
        lengths   number of resting lengths that a law without an effect of the length is fitted to
        """
        known = [each for each in (self.noise, self.repeatability) if each is not None]
        noise = known[0] if known else 0.0
        within = max(noise, 0.5 * self.branches)
        expected = max([*known, within])
        parts = ", ".join(f"{each.name} {each.value:.3g} N" for each in self.values())
        least = rmse * (1.0 - MARGIN / np.sqrt(2.0 * max(rows, 2)))
        if not known or least <= MAX_MISFIT * within or rmse <= MIN_MISFIT * greatest:
            return None
        if least > MAX_MISFIT * expected:
            return LawMisfit(
                f"The rms error, {rmse:.3g} N, is {rmse / expected:.3g} times the scatter of the"
                f" data ({parts}): the law does not follow them. "
                + (f"It is one law for {lengths} resting lengths. " if lengths > 1 else "")
                + "Compare other laws, and check the remarks on contradicting or suspicious data.",
                rmse / expected,
            )
        if rmse <= MIN_UNREPEATABLE * greatest:
            return None
        return LawMisfit(
            f"The rms error, {rmse:.3g} N, is {rmse / within:.3g} times the scatter within a run"
            f" ({parts}), although repeated runs differ by a similar amount.",
            rmse / expected,
        )


@dataclasses.dataclass(frozen=True)
class Remarks:
    """What recordings show, without a law or with a fit to them."""

    notes: tuple[str, ...]
    """Sentences; what contradicts a static characteristic with files and remedy."""
    scatter: Scatter
    delay: SensorDelay | None
    """Delay of the force after the pressure; None without one."""
    misfit: LawMisfit | None = None
    """That the law does not follow the data, with the causes that explain the residuals; its text
    is among the notes."""


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
    found = [
        (run, outlier)
        for run in timed
        for outlier in find_outliers(run, {"force": sensors["force"]})
        if abs(outlier.value - outlier.expected) > MIN_DISTANCE * greatest
    ]
    rows = sum(map(len, timed))
    rms = math.sqrt(sum((outlier.value - outlier.expected) ** 2 for _, outlier in found) / rows)
    if not found or (len(found) < MIN_SHARE * rows and rms < MIN_RMS * greatest):
        return []
    files = {run.origin for run in timed}
    spoilt = {run.origin for run, _ in found}
    examples = "; ".join(
        f"{run.origin}, row {each.row + 1} ({each.value:.4g} N, neighbours {each.expected:.4g} N)"
        for run, each in found[:3]
    )
    return [
        HintedText(
            f"Suspected outliers of the force pull the law: {len(found)} of {rows} rows, in"
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
    held = {
        name: run
        for name, run in at_limit.items()
        if len(run) and np.ptp(run["contraction"]) < HELD
    }
    found = {name: len(run) for name, run in held.items() if np.ptp(run["force"]) > least}
    text = (
        f"The pressure sensor saturates at {limit.upper_limit / 1e3:.4g} kPa, in"
        f" {sum(found.values())} rows of {file_list([*found])}, where the force still changes: the"
        " pressure is greater there, and the law takes the limit for it. Leave these rows out, or"
        " use a sensor of a greater range."
    )
    return [text] if found else []


def _greatest_force(recordings: Sequence[Recording]) -> float:
    return float(np.nanquantile(np.concatenate([run["force"] for run in recordings]), 0.99))


@remembered
def check_data(recordings: Sequence[Recording]) -> Remarks:
    """The checks of recordings, without the rows in which a code stands for a missing value."""
    measured = without_missing_codes([recording for recording in recordings if len(recording)])
    matches = match_rows(measured)
    delay = find_delay(measured)
    contradictions = contradiction_notes(matches)
    if not any(" tells the contradicting rows apart" in note for note in contradictions):
        contradictions += two_muscle_notes(match_rows(measured, by_branch=True))
    found = (
        *contradictions,
        *outlier_notes(measured),
        *saturation_notes(measured),
        *delay_notes(delay),
    )
    scatter = Scatter(force_noise(measured), repeatability(matches))
    return Remarks((*find_suspicious(recordings), *found), scatter, delay)


def force_noise(recordings: Sequence[Recording]) -> float | None:
    """The noise of the force [N]; None where it is not known, as of rows in no order of time."""
    timed = [run["force"] for run in recordings if "time" in run and "force" in run]
    noise = [estimate_noise(force[np.isfinite(force)]) for force in timed]
    return float(np.median(noise)) or None if noise else None


def level_text(name: str, value: float) -> str:
    """The level [SI] of a quantity as text in its unit of display; a contraction near 0 is 0."""
    return displayed(name, 0.0 if name == "contraction" and abs(value) < 5e-5 else value, 3)
