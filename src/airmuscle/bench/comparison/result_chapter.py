"""First chapter of the report of a static fit: the result in a sentence, points and law, the
numbers that a thesis states, what the law is good for, and what to measure next.
"""

import dataclasses
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...recording import Recording
from ...report.chapter import Chapter, NamedValue, Plot
from ...report.formatting import format_number
from .. import comparison
from ..estimation import is_pressure_ramp, levels_of, specimen_name
from ..statics import Fit

MIN_LEVELS = 4
"""Levels of a quantity below which more are proposed (chosen): a curvature is then determined by a
single level.
"""
MIN_FOLDS = 4
"""Parts left out below which the scatter of their errors states no interval (chosen)."""
RESAMPLES = 2000
"""Resamples of the parts for the interval of an error (chosen)."""
SCATTER_SEED = 1
FIGURES = ("ramps", "isobars")
"""Figures of points and law, the first that a fit has; the second for levels of pressure."""


class LeftOutError(NamedTuple):
    """The error of a law on what was left out of its fit [N], with its 95 % interval."""

    purpose: str
    value: float
    interval: tuple[float, float] | None
    """None if too few parts were left out."""

    def __str__(self) -> str:
        if self.interval is None:
            return ""
        low, high = (format_number(end, 3) for end in self.interval)
        return f"95 % interval: {low} to {high}"


def result_chapter(
    title: str,
    fit: Fit,
    fitted: Chapter,
    recordings: Sequence[Recording],
    selection: "comparison.LawSelection | None" = None,
) -> Chapter:
    """The chapter that begins the report of a static fit.

    title        what was measured, the heading of the chapter
    fit, fitted  the fit and its chapter, whose figure of points and law is shown here
    recordings   those that were fitted
    selection    the comparison that recommended the law; None if the law was named
    """
    errors = [] if selection is None else left_out_errors(selection)
    values = [
        NamedValue("rms error, rows of the fit", fit.rmse, fit.fitted_quantity.unit, digits=3),
        *(
            NamedValue(f"rms error, {error.purpose}", error.value, "N", digits=3, remark=str(error))
            for error in errors
        ),
    ]
    branches = _branch_distance(fit)
    if branches > 0.0:
        remark = "half of the distance of the branches"
        values.append(NamedValue("friction or lag", branches / 2, "N", digits=3, remark=remark))
    low, high = fit.data_ranges["pressure"]
    pressures = f"{format_number(low / 1e3)} to {format_number(high / 1e3)} kPa"
    low, high = fit.data_ranges["contraction"]
    contractions = f"{format_number(100 * low)} to {format_number(100 * high)} %"
    values.append(NamedValue("gauge pressures of the data", pressures))
    values.append(NamedValue("contractions of the data", contractions))
    return Chapter(
        name="result",
        title=title,
        summary=(_sentence(fit, selection), *_misfit(fit)),
        answers=(
            ("Use it for", _use(fit, errors, pressures, contractions)),
            ("Measure next", " ".join(next_measurements(fit, recordings))),
        ),
        values=tuple(dataclasses.replace(value, brief=False) for value in values),
        plots=_points_and_law(fit, fitted),
        brief=False,
        opening=True,
    )


def left_out_errors(selection: "comparison.LawSelection") -> list[LeftOutError]:
    """The cross-validation errors of the recommended law, one for each purpose."""
    return [
        LeftOutError(comparison.purpose, model.cross_validated_rmse, error_interval(model))
        for comparison, model in zip(selection.comparisons, selection.recommended, strict=True)
    ]


def error_interval(model: "comparison.RankedModel") -> tuple[float, float] | None:
    """The 95 % interval [N] of a cross-validation error from the scatter of its parts: percentiles
    of the bootstrap that draws whole parts (Efron, Tibshirani 1993, chapter 13). None below
    MIN_FOLDS parts.
    """
    parts = [part for part in model.fold_scores if part.rows]
    if len(parts) < MIN_FOLDS:
        return None
    squares = np.array([part.rows * part.rmse**2 for part in parts])
    rows = np.array([part.rows for part in parts])
    generator = np.random.default_rng(SCATTER_SEED)
    drawn = generator.integers(len(parts), size=(RESAMPLES, len(parts)))
    errors = np.sqrt(squares[drawn].sum(axis=1) / rows[drawn].sum(axis=1))
    low, high = np.quantile(errors, (0.025, 0.975))
    return float(low), float(high)


def _sentence(fit: Fit, selection: "comparison.LawSelection | None") -> str:
    name = (
        type(fit.model).__name__ if selection is None else selection.recommended[0].candidate.name
    )
    measured = fit.recording.rows(fit.censoring == 0)
    quantity = fit.fitted_quantity
    greatest = float(np.abs(measured[quantity.name]).max())
    share = 100 * fit.rmse / greatest
    chosen = "" if selection is None else _rank(fit)
    unit = "" if quantity.unit == "1" else f" {quantity.unit}"
    return (
        f"The law {name} with {len(fit.estimates)} parameters{chosen} has an rms error of"
        f" {format_number(fit.rmse, 3)}{unit} on {len(measured)} measured rows:"
        f" {format_number(share, 2)} % of the greatest {quantity.name}."
    )


def _rank(fit: Fit) -> str:
    """The words on a law that a comparison chose: one that misses the data is not recommended."""
    if fit.misfit is None:
        return ", recommended by cross-validation,"
    return ", the best of those compared by cross-validation,"


def _misfit(fit: Fit) -> tuple[str, ...]:
    return () if fit.misfit is None else (str(fit.misfit),)


def _use(fit: Fit, errors: Sequence[LeftOutError], pressures: str, contractions: str) -> str:
    purposes = " and ".join(error.purpose for error in errors)
    judged = (
        f" Its error was judged for {purposes}."
        if errors
        else (" Its error on further data was not judged: --compare does so.")
    )
    return (
        f"The {fit.fitted_quantity.name} at gauge pressures of {pressures} and contractions of"
        f" {contractions}, the range of the data.{judged}"
    )


def _branch_distance(fit: Fit) -> float:
    """The average distance [N] of the two branches that the residuals follow; 0 if none."""
    return 0.0 if fit.scatter is None else fit.scatter.branches


def next_measurements(fit: Fit, recordings: Sequence[Recording]) -> list[str]:
    """Sentences with the measurements that the data lack, the most useful one first."""
    proposals = []
    data = fit.recording
    swept = is_pressure_ramp(data["pressure"], data["contraction"])
    held = "contraction" if swept else "pressure"
    levels = levels_of(data[held], MIN_LEVELS).size
    if levels < MIN_LEVELS:
        proposals.append(f"More levels of {held}: the data contain {levels}.")
    if _branch_distance(fit) > 0.0:
        proposals.append(
            "A run at another speed, which separates friction from the lag of a sensor and from"
            " creep; `airmuscle hysteresis` identifies the friction."
        )
    if len({specimen_name(recording) for recording in recordings}) < 2:
        proposals.append(
            "A second muscle of the same type: the scatter between muscles is unknown."
        )
    if len(recordings) < 2:
        proposals.append("A repeated run: the scatter between runs is unknown.")
    return proposals or [
        "Fills, discharges and releases: `airmuscle campaign` identifies valves and damping from"
        " them."
    ]


def _points_and_law(fit: Fit, fitted: Chapter) -> tuple[Plot, ...]:
    plots = {plot.name: plot for plot in fitted.plots}
    name = next((name for name in FIGURES if name in plots), None)
    if name is None:
        return ()
    return (plots[name],)


def without_opening_figures(fitted: Chapter, opening: Chapter) -> Chapter:
    """The chapter of a fit without the figures that the opening chapter shows."""
    shown = {plot.name for plot in opening.plots}
    plots = tuple(plot for plot in fitted.plots if plot.name not in shown)
    return dataclasses.replace(fitted, plots=plots)
