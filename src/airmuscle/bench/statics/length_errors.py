"""Error of a recorded resting length, estimated as a nuisance parameter of a fit to several
specimens.

The shortening L_0 - L of a specimen is taken as measured, and its resting length as wrong by d: its
contraction is then (L_0 - L)/(L_0 + d). Such an error leaves no residual at rest and residuals of
one sign elsewhere.
"""

import dataclasses
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ...core import IdentificationError, ParameterError, ShortRepr
from ...physics.muscle.characteristic.base import Characteristic
from ...recording import Recording
from ...report.chapter import Chapter, Table, TableColumn
from ..estimation import LeastSquares, effective_sample_size, solve_least_squares, specimen_name
from .candidates import blank_surface
from .fit_points import FitPoints
from .fit_problem import evaluate, population_of
from .static_fit import refit

PRIOR_STD = 2e-3
"""Standard deviation [m] of the error of a resting length before the fit (chosen: a ruler between
two fittings).
"""
MIN_STANDARD_ERRORS = 3.0
"""Standard errors above which an error of a length is reported (chosen)."""
MIN_EXPLAINED = 0.9
"""Minimum share of the misfit that the correction of one length must explain to be reported
(chosen).
"""
MIN_MISFIT = 1.1
"""Ratio of the rms residual to that of separate fits of the specimens below which there is no
misfit (chosen).
"""
_SEPARATE_DEGREE = 4
"""Degree of the surfaces that are fitted to each specimen alone (chosen)."""
_STEP = 1e-4
"""Change of length [m] for the derivative (chosen)."""
_ITERATIONS = 6


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class LengthError(ShortRepr):
    """The estimated error of the resting length of one specimen; all SI."""

    specimen: str
    resting_length: float
    """The recorded resting length [m]."""
    offset: float
    """Correction of the resting length [m]: negative where the specimen behaves as if it were
    shorter.
    """
    standard_error: float
    rmse_before: float
    """Root mean square residual of all specimens with the recorded length, in the fitted
    quantity.
    """
    rmse_after: float
    """The same with the corrected length."""
    model: Characteristic
    """The law fitted with the corrected length."""

    def __str__(self) -> str:
        change = "less" if self.offset < 0 else "more"
        return (
            f"that of {self.specimen} were {abs(self.offset) * 1e3:.2g} mm {change} (standard error"
            f" {self.standard_error * 1e3:.1g} mm)"
        )


def length_notes(errors: Sequence[LengthError]) -> tuple[str, ...]:
    """The remark that one recorded resting length is probably wrong; empty without errors."""
    if not errors:
        return ()
    before = errors[0].rmse_before
    after = max(error.rmse_after for error in errors)
    several = " The data do not decide between these." if len(errors) > 1 else ""
    return (
        (
            "One resting length is probably recorded wrongly, which leaves no residual at rest and"
            f" residuals of one sign elsewhere: as if {', or '.join(map(str, errors))}. The rms"
            f" residual falls from {before:.3g} to {after:.3g} with this correction.{several}"
            " Measure the length again."
        ),
    )


def corrected_length(run: Recording, offset: float) -> Recording:
    """The recording with a resting length that is greater by `offset` [m] at the same shortening.
    Raises ParameterError where the recording states no resting length, or the corrected one is not
    positive."""
    length = run.constants.get("resting_length")
    if length is None or not float(length) + offset > 0:
        raise ParameterError(
            f"{run.origin}: the resting length"
            f" {'is not stated' if length is None else f'{float(length):g} m'}, so it cannot be"
            f" corrected by {offset:g} m; allowed: a sum greater than 0."
        )
    corrected = float(length) + offset
    columns = {
        name: run[name] for name in ("pressure", "force", "contraction", "time") if name in run
    }
    columns["contraction"] = run["contraction"] * float(length) / corrected
    return Recording(
        columns,
        run.origin,
        {**run.constants, "resting_length": corrected},
        references=run.references,
    )


def estimate_length_error(
    law: Characteristic,
    recordings: Sequence[Recording],
    specimen: str,
    prior_std: float = PRIOR_STD,
    min_reduction: float = 0.0,
) -> LengthError:
    """The error of the resting length of one specimen, estimated together with the parameters of a
    law.

    law            fitted to all recordings, as initial values; of a PooledLengthLaw its population
                   law, because effects of the specimens take up an error of their length
    specimen       name as SpecimenSplit gives it: the constant `specimen`, or the resting length in
                   mm
    prior_std      standard deviation [m] of the normal prior of the error, whose mean is 0
    min_reduction  reduction of the mean square residual below half of which, by its derivative, the
                   search is ended

    Rows are correlated, so that the squares are divided by the ratio of rows to effective rows.
    Raises IdentificationError where the corrected data do not determine the law, ParameterError for
    an unknown specimen.
    """
    members = [specimen_name(run) == specimen for run in recordings]
    if not any(members):
        known = ", ".join(dict.fromkeys(specimen_name(run) for run in recordings))
        raise ParameterError(
            f"no recording is of specimen '{specimen}'; the specimens are {known}."
        )
    recorded = float(recordings[members.index(True)].constants["resting_length"])
    model = population_of(law)
    offset = 0.0
    before = 0.0
    for iteration in range(_ITERATIONS):
        step = _newton_step(model, recordings, members, offset, prior_std)
        model = step.model
        if iteration == 0:
            before = step.rmse
            if step.reduction < 0.5 * min_reduction:
                break
        offset = float(np.clip(offset + step.change, -0.2 * recorded, 0.2 * recorded))
        if abs(step.change) < 1e-3 * step.standard_error:
            break
    return LengthError(specimen, recorded, offset, step.standard_error, before, step.rmse, model)


def find_length_errors(
    law: Characteristic, recordings: Sequence[Recording]
) -> tuple[LengthError, ...]:
    """The errors of one resting length that explain why one law does not fit all specimens; the
    smallest first.

    Each specimen is corrected alone. Several entries are alternatives: a law with free parameters
    for the effect of the length explains an error in one of three lengths by an error in either of
    the others. Empty unless there are three specimens with resting lengths or more.
    """
    names = list(dict.fromkeys(specimen_name(run) for run in recordings))
    model = population_of(law)
    complete = all("resting_length" in run.constants for run in recordings)
    if len(names) < 3 or not complete or not hasattr(model, "with_resting_length"):
        return ()
    try:
        alone = []  # the residuals of surfaces that are fitted to each specimen alone
        for name in names:
            points = FitPoints.from_recordings(
                [run for run in recordings if specimen_name(run) == name]
            )
            problem = points.problem(blank_surface(_SEPARATE_DEGREE))
            alone.append(problem.residuals(solve_least_squares(problem, LeastSquares()).modelled))
        separate = float(np.sqrt(np.mean(np.concatenate(alone) ** 2)))
        problem = FitPoints.from_recordings(recordings).problem(model)
        rmse = float(
            np.sqrt(np.mean(problem.residuals(problem.predict(problem.initial_values)) ** 2))
        )
        if rmse <= MIN_MISFIT * separate:
            return ()
        least = MIN_EXPLAINED * (rmse**2 - separate**2)
        estimates = [
            estimate_length_error(model, recordings, name, min_reduction=least) for name in names
        ]
    except IdentificationError:
        return ()
    errors = []
    for estimate in estimates:
        explained = estimate.rmse_before**2 - estimate.rmse_after**2 >= MIN_EXPLAINED * (
            estimate.rmse_before**2 - separate**2
        )
        significant = abs(estimate.offset) > MIN_STANDARD_ERRORS * estimate.standard_error
        if estimate.rmse_before > MIN_MISFIT * separate and explained and significant:
            errors.append(estimate)
    return tuple(sorted(errors, key=lambda estimate: abs(estimate.offset)))


class _Step(NamedTuple):
    """The fit with one correction, and the Newton step from it: reduction of the mean square
    residual by the best correction, if the law is linear in it; change of the correction [m] that
    minimises the squares and the prior, with its standard error [m]."""

    model: Characteristic
    rmse: float
    reduction: float
    change: float
    standard_error: float


def _newton_step(
    start: Characteristic,
    runs: Sequence[Recording],
    members: Sequence[bool],
    offset: float,
    prior_std: float,
) -> _Step:
    low, here, high = (
        FitPoints.from_recordings(
            [corrected_length(r, d) if m else r for r, m in zip(runs, members, strict=True)]
        )
        for d in (offset - _STEP, offset, offset + _STEP)
    )
    model = refit(start, here)
    problem = here.problem(model)
    quantity = problem.fitted_quantity
    below, above = (
        evaluate(model, quantity.method, quantity.arguments, points.data) for points in (low, high)
    )
    modelled = problem.predict(problem.initial_values)
    weights = problem.weights * problem.active_rows(modelled)
    matrix = weights[:, None] * problem.jacobian(problem.initial_values)
    basis = np.linalg.qr(matrix / np.maximum(np.linalg.norm(matrix, axis=0), 1e-300))[0]
    slopes = weights * (above - below) / (2 * _STEP)
    slopes = slopes - basis @ (basis.T @ slopes)
    residuals = problem.residuals(modelled)
    share = effective_sample_size(residuals) / residuals.size
    variance = float(residuals @ residuals) / max(residuals.size - matrix.shape[1], 1) / share
    gradient = float(slopes @ residuals)
    square = float(slopes @ slopes)
    curvature = square + variance / prior_std**2
    return _Step(
        model,
        rmse=float(np.sqrt(np.mean(residuals**2))),
        reduction=gradient**2 / max(square, 1e-300) / residuals.size,
        change=-(gradient + variance * offset / prior_std**2) / curvature,
        standard_error=float(np.sqrt(variance / curvature)),
    )


def length_error_chapter(errors: Sequence[LengthError]) -> Chapter:
    """Return the chapter of the estimated errors of recorded resting lengths."""
    columns: dict[str, Any] = {
        "specimen": [error.specimen for error in errors],
        "resting length": TableColumn([error.resting_length for error in errors], "m", "mm"),
        "offset": TableColumn([error.offset for error in errors], "m", "mm", digits=2),
        "standard error": TableColumn(
            [error.standard_error for error in errors], "m", "mm", digits=1
        ),
        "rms residual before": [error.rmse_before for error in errors],
        "rms residual after": [error.rmse_after for error in errors],
    }
    return Chapter(
        "length-errors",
        "Errors of recorded resting lengths",
        summary=(
            f"As if {', or '.join(map(str, errors))}. Normal prior with a standard deviation of "
            f"{PRIOR_STD * 1e3:g} mm (chosen)."
        ),
        tables=(
            Table(
                "resting-lengths",
                "Resting lengths",
                columns,
                "Residuals in SI units.",
                brief=len(errors),
            ),
        ),
    )
