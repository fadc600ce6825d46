"""Bands of the prediction error of a static law, from levels and lengths that were left out of its fit."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from ....core.arrays import Array
from ....core.errors import AirmuscleError
from ....recording import Recording
from ..compared_points import FORCE_MARGIN, force_residuals
from ..fit_points import FitPoints
from ..result import Fit
from ..static_fit import refit
from .record import CampaignRecord, RecordKind

LEVEL = 0.95
"""Share of further rows within the band."""
LEVEL_TOLERANCE = 0.03
"""Relative difference of two values that belong to one level (chosen)."""
SHARE_OF_ERROR = 0.25
"""Share of the error of leaving a level out that applies halfway between two levels.

The error of interpolation increases with the square of the distance of the levels, and leaving one out doubles this
distance.
"""
MIN_GROUPS = 3
"""Minimum number of levels or lengths; the lowest and the highest are in every fit."""


@dataclasses.dataclass(frozen=True)
class ErrorBand:
    """Half width [N] of the band that contains 95 % of the measured forces of rows that were left out of the fit.

    The groups are the inner levels or lengths, each left out in turn, so that the law is evaluated by interpolation. A
    quarter of the change of a residual by leaving its level out is added to the residual of the complete fit, because
    levels that are measured later lie at half the distance.
    The band contains the noise of the sensors, the error of the law and that of the friction (cross-conformal
    prediction: Vovk, Ann. Math. Artif. Intell. 74:9 (2015)).
    """

    purpose: str
    half_width: float
    rmse: float
    rows: int
    groups: int

    def __str__(self) -> str:
        if not self.groups:
            return (
                f"95 % band of the force for {self.purpose}: ±{self.half_width:.3g} N, from the residuals of the fit "
                "itself, because there are fewer than three levels; it is too narrow for other levels."
            )
        return (
            f"95 % band of the force for {self.purpose}: ±{self.half_width:.3g} N, from {self.rows} rows of "
            f"{self.groups} {'group' if self.groups == 1 else 'groups'} left out in turn (rms error "
            f"{self.rmse:.3g} N)."
        )


def calibrate(fit: Fit, points: Sequence[Recording], records: Sequence[CampaignRecord]) -> tuple[ErrorBand, ...]:
    """The band for further runs of the measured muscles, and that for other lengths if there are three or more."""
    max_force = FORCE_MARGIN * max(float(np.nanmax(run["force"])) for run in points)
    lengths = [_length(run) for run in points]
    levels = [_level_name(record) for record in records]
    bands: list[ErrorBand] = []
    for purpose, labels in (
        ("further pressures and speeds of the measured muscles", _inner(levels)),
        ("other lengths of the same type", _inner(lengths)),
    ):
        residuals, groups = _left_out_residuals(fit, points, labels, max_force)
        if groups:
            band = _band(purpose, residuals, groups)
            widest = max(
                [band.half_width, *(other.half_width for other in bands)]
            )  # other lengths are further runs too
            bands.append(dataclasses.replace(band, half_width=widest))
    if not bands:
        bands.append(_band("the rows of the fit", force_residuals(fit.model, points, max_force), 0))
    return tuple(bands)


def calibrate_held(
    fit: Fit, points: Sequence[Recording], records: Sequence[CampaignRecord], band: ErrorBand
) -> ErrorBand | None:
    """The band for further isometric runs, from all of them left out at once; not narrower than `band`.

    A ramp of the pressure at a held length has no friction, and another history of creep than a sweep of the length, so
    that its residuals are of one sign. None where there is no isometric run, or the others do not determine the law.
    """
    labels = [("kind", 0) if record.kind is RecordKind.ISOMETRIC else None for record in records]
    if None not in labels or ("kind", 0) not in labels:
        return None
    max_force = FORCE_MARGIN * max(float(np.nanmax(run["force"])) for run in points)
    residuals, groups = _left_out_residuals(fit, points, labels, max_force, share=1.0)
    if not groups:
        return None
    own = _band("further isometric runs", residuals, groups)
    return dataclasses.replace(own, half_width=max(own.half_width, band.half_width))


def _band(purpose: str, residuals: Array, groups: int) -> ErrorBand:
    size = residuals.size
    share = min(np.ceil((size + 1) * LEVEL) / size, 1.0)
    half = float(np.quantile(np.abs(residuals), share))
    return ErrorBand(purpose, half, float(np.sqrt(np.mean(residuals**2))), size, groups)


def _length(run: Recording) -> tuple[str, float] | None:
    length = run.constants.get("resting_length")
    return None if length is None else ("resting length", float(length))


def _level_name(record: CampaignRecord) -> tuple[str, float] | None:
    return record.level


def _inner(values: Sequence[tuple[str, float] | None]) -> list[tuple[str, int] | None]:
    """The number of the level of each value, counted by quantity; None for the lowest, the highest and no level."""
    labels: list[tuple[str, int] | None] = [None] * len(values)
    for name in {value[0] for value in values if value is not None}:
        own = [(value[1], i) for i, value in enumerate(values) if value is not None and value[0] == name]
        ordered = sorted(own)
        scale = max(abs(value) for value, _ in ordered) or 1.0
        number, numbers, last = 0, {}, ordered[0][0]
        for value, i in ordered:
            number += value - last > LEVEL_TOLERANCE * scale
            numbers[i], last = number, value
        if number + 1 >= MIN_GROUPS:
            for i, k in numbers.items():
                labels[i] = (name, k) if 0 < k < number else None
    return labels


def _left_out_residuals(
    fit: Fit, points: Sequence[Recording], labels: Sequence[tuple[str, int] | None], max_force: float,
    share: float = SHARE_OF_ERROR,
) -> tuple[Array, int]:  # fmt: skip
    """The residuals [N] at the rows of each group, with the share of the error without it; and the number of groups."""
    residuals, count = [np.zeros(0)], 0
    fixed = tuple(leaf.path for i, leaf in enumerate(fit.problem.leaves) if i not in set(fit.problem.free))
    for label in dict.fromkeys(label for label in labels if label is not None):
        training = [run for run, own in zip(points, labels, strict=True) if own != label]
        others = [run for run, own in zip(points, labels, strict=True) if own == label]
        try:
            model = refit(fit.model, FitPoints.from_recordings(training), fixed=fixed)
        except AirmuscleError:
            continue  # the others do not determine the law, so that this group cannot judge it
        inside = force_residuals(fit.model, others, max_force)
        residuals.append(inside + share * (force_residuals(model, others, max_force) - inside))
        count += 1
    return np.concatenate(residuals), count
