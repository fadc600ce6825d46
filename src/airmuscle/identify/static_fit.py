"""A static characteristic from measured points: `fit`."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ..characteristic.base import Characteristic
from ..core import tree
from ..core.arrays import Array
from ..core.errors import IdentificationError, ParameterError
from ..recording import Recording
from .censoring import Censoring, default_censoring, narrow_to_sensor
from .correlation_index import correlation_index
from .loss import LeastSquares, Loss
from .problem import RESTING_LENGTH, FitProblem, evaluate, fitted_quantity_of, make_problem
from .result import Estimate, Fit, WorstPoint
from .solver import Solution, solve
from .statistics import FitStatistics, compute_statistics
from .weights import sensor_deviations

POINT_COLUMNS = ("pressure", "contraction", "force")
ILL_CONDITIONED = 1e5
"""Condition of the scaled design above which a note is made (chosen): half of the digits of a float are lost."""


def fit(
    characteristic: Characteristic,
    recording: Recording | Sequence[Recording],
    *,
    loss: Loss = LeastSquares(),
    censoring: Censoring | None = None,
    sigma: npt.ArrayLike | None = None,
    fixed: Collection[str] = (),
) -> Fit:
    """The parameters of a characteristic that meet measured points best.

    `characteristic` gives the structure and the start values; its parameters that are declared as not fitted, and
    those named in `fixed`, stay. Errors are taken in the direction that the law gives (force, contraction or
    pressure), within the declared bounds. Rows at zero or full force, or where the force sensor shows that it is cut
    off, count only where the law contradicts them; `censoring` states another range, `UNCENSORED` takes every row as
    it stands.
    `sigma` are the standard deviations of the rows, of which only the ratios matter; without it recordings from
    several rigs weigh by what their sensors resolve, and `sigma=1.0` weighs all alike. `loss` is LeastSquares(),
    Huber(scale) or SoftL1(scale), the scale in the unit of the fitted quantity.

    Raises IdentificationError where the points cannot determine the parameters, and says which.
    """
    _check_types(characteristic, recording)
    data, dropped = _join_recordings(recording)
    by_rig = None if sigma is not None else _deviations_by_recording(characteristic, recording)
    weights = _row_weights(data, dropped, sigma if by_rig is None else _repeat_by_row(by_rig, recording))
    data, weights = data.rows(~dropped), weights[~dropped]
    law = _with_validity_range(_with_length(characteristic, data), data)
    runs = [recording] if isinstance(recording, Recording) else list(recording)
    problem = make_problem(law, data, censoring or narrow_to_sensor(default_censoring(law), law, runs), weights, fixed)
    solution = solve(problem, loss)
    found = compute_statistics(problem, solution, loss)
    notes = (*_collect_notes(problem, found, loss, int(np.count_nonzero(dropped))), *_weighting_notes(by_rig, problem))
    notes += _loss_scale_notes(problem, solution, loss)
    return _build_result(problem, solution, found, loss, int(np.count_nonzero(dropped)), notes)


def _check_types(characteristic: object, recording: object) -> None:
    if not isinstance(characteristic, Characteristic):
        raise ParameterError(f"fit: {str(characteristic)[:80]} is no characteristic, as load(...).characteristic is.")
    runs = recording if isinstance(recording, Sequence) else [recording]
    for run in runs:
        if not isinstance(run, Recording):
            raise ParameterError(f"fit: {str(run)[:80]} is no Recording, as read, read_csv and simulate return it.")


def _join_recordings(recording: Recording | Sequence[Recording]) -> tuple[Recording, npt.NDArray[np.bool_]]:
    """Pressure, contraction and force of one or several recordings, and the rows where one of them is missing."""
    runs = [recording] if isinstance(recording, Recording) else list(recording)
    columns = {name: np.concatenate([run[name] for run in runs]) for name in POINT_COLUMNS} if runs else {}
    origins = list(dict.fromkeys(run.origin for run in runs))
    few = len(origins) <= 3
    origin = " + ".join(origins if few else [*origins[:2], f"{len(origins) - 2} more"]) or "no recording"
    for name, values in columns.items():
        if np.isinf(values).any():
            row = int(np.argmax(np.isinf(values)))
            raise IdentificationError(
                f"{origin}, row {row + 1}: {name} is {values[row]}. Leave such rows out, as with "
                f"recording.rows(np.isfinite(recording['{name}']))."
            )
    missing = np.isnan(np.stack(list(columns.values()))).any(axis=0) if columns else np.zeros(0, dtype=bool)
    lengths = {run.constants.get(RESTING_LENGTH) for run in runs} - {None}
    if len(lengths) > 1 and all(RESTING_LENGTH in run.constants for run in runs):
        by_row = [np.full(len(run), float(run.constants[RESTING_LENGTH])) for run in runs]
        columns[RESTING_LENGTH] = np.concatenate(by_row)
    rest = lengths.pop() if len(lengths) == 1 else None
    return Recording(columns, origin, {} if rest is None else {"resting_length": rest}), missing


def _row_weights(data: Recording, dropped: npt.NDArray[np.bool_], sigma: npt.ArrayLike | None) -> Array:
    if sigma is None:
        return np.ones(len(data))
    deviations = np.broadcast_to(np.asarray(sigma, dtype=float), (len(data),))
    if not (np.isfinite(deviations) & (deviations > 0))[~dropped].all():
        raise IdentificationError(f"{data.origin}: every sigma must be finite and greater than zero.")
    weights = 1.0 / deviations
    return np.asarray(weights / np.sqrt(np.mean(weights[~dropped] ** 2)))


def _deviations_by_recording(law: Characteristic, recording: Recording | Sequence[Recording]) -> Array | None:
    """The sensors' deviations by recording, where there are several that differ."""
    if isinstance(recording, Recording) or len(recording) < 2:
        return None
    return sensor_deviations(recording, fitted_quantity_of(law).name)


def _repeat_by_row(by_rig: Array, recording: Any) -> Array:
    return np.repeat(by_rig, [len(run) for run in recording])


def _weighting_notes(by_rig: Array | None, problem: FitProblem) -> list[str]:
    if by_rig is None:
        return []
    return [
        "The recordings come from rigs whose sensors differ: rows weigh by standard deviations of "
        f"{min(by_rig):.3g} to {max(by_rig):.3g} {problem.fitted_quantity.unit}; sigma=1.0 counts all alike."
    ]


def _with_length(law: Any, data: Recording) -> Any:
    """A law for muscles of any length as that of the muscle in the data, where there is one."""
    rest = data.constants.get(RESTING_LENGTH)
    return law.of_length(float(rest)) if rest is not None and hasattr(law, "of_length") else law


def _with_validity_range(law: Characteristic, data: Recording) -> Characteristic:
    """The law on the validity range of the data, where it has one."""
    with_validity_range = getattr(law, "with_validity_range", None)
    if with_validity_range is None or not len(data):
        return law
    for name, unit in (("pressure", "Pa"), ("contraction", "1")):
        if np.ptp(data[name]) == 0:
            raise IdentificationError(
                f"{data.origin}: {name} is {data[name][0]:g} {unit} in every row, so no surface over it can be fitted. "
                f"Measure at several levels of {name}."
            )
    boxed: Characteristic = with_validity_range(
        *((float(data[n].min()), float(data[n].max())) for n in ("pressure", "contraction"))
    )
    return boxed


def _build_result(
    problem: FitProblem, solution: Solution, found: FitStatistics, loss: Loss, dropped: int, notes: tuple[str, ...]
) -> Fit:
    data, quantity = problem.data, problem.fitted_quantity.name
    model = tree.with_parameters(problem.law, problem.leaf_values(solution.values))
    clamped = evaluate(model, quantity, problem.fitted_quantity.arguments, data)
    measured = problem.censoring == 0
    errors = clamped - data[quantity]
    # a row cut off is wrong only where the law contradicts it; what it reads is not what was there
    contradicted = np.where(measured, errors, problem.residuals(clamped) / problem.weights)
    worst = int(np.argmax(np.abs(contradicted)))
    varies = bool(np.ptp(data[quantity][measured]) > 0)
    return Fit(
        model=model,
        estimates=_build_estimates(problem, solution, found),
        correlations=found.correlations,
        rank=found.rank,
        condition=found.condition,
        sigma=found.sigma,
        rmse=float(np.sqrt(np.mean(errors[measured] ** 2))),
        max_error=WorstPoint(float(contradicted[worst]), *(float(data[name][worst]) for name in POINT_COLUMNS)),
        correlation_index=correlation_index(data[quantity][measured], clamped[measured]) if varies else None,
        rows_censored=int(np.count_nonzero(~measured)),
        rows_dropped=dropped,
        recording=data,
        fitted_quantity=problem.fitted_quantity,
        censoring=problem.censoring,
        problem=dataclasses.replace(problem, law=model, leaves=tuple(tree.leaves(model))),
        loss=loss,
        notes=notes,
    )


def _build_estimates(problem: FitProblem, solution: Solution, found: FitStatistics) -> tuple[Estimate, ...]:
    leaves = (problem.leaves[i] for i in problem.free)
    columns = zip(
        leaves,
        problem.labels,
        solution.values.tolist(),
        found.standard_errors.tolist(),
        found.on_bound.tolist(),
        strict=True,
    )
    return tuple(
        Estimate(leaf.path, label, value, deviation, leaf.declared.unit, leaf.declared.meaning, bound)
        for leaf, label, value, deviation, bound in columns
    )


def _collect_notes(problem: FitProblem, found: FitStatistics, loss: Loss, dropped: int) -> tuple[str, ...]:
    """What a reader of the fit must know, in sentences."""
    notes = []
    cut_off = int(np.count_nonzero(problem.censoring))
    at_zero = int(np.count_nonzero((problem.data["force"] <= 0) & (problem.censoring == 0)))
    if dropped:
        notes.append(f"{dropped} rows with a missing value (NaN) were left out.")
    if cut_off:
        notes.append(
            f"{cut_off} rows are cut off at the ends of the range of force and count only where the law contradicts "
            "them; censoring=UNCENSORED fits them as they stand."
        )
    if found.uncensored_rank < found.rank:
        notes.append(
            f"The measured rows determine {found.uncensored_rank} of {found.rank} parameters; the others only have "
            "bounds, where the rows are cut off, and stand as near to these as they can."
        )
    if at_zero:
        notes.append(
            f"{at_zero} rows at zero force or below are fitted as they stand; give censoring=Censoring() if the muscle "
            "was slack there."
        )
    notes += _length_notes(problem)
    notes += [
        f"{name} stopped at its bound; the value is not a measured one."
        for name in _parameters_on_bound(problem, found)
    ]
    if not np.isfinite(found.sigma):
        notes.append("As many points as parameters: the standard deviations are unknown.")
    if found.condition > ILL_CONDITIONED:
        notes.append(f"The parameters are nearly indistinct (condition {found.condition:.2g}).")
    if not isinstance(loss, LeastSquares):
        notes.append(f"Robust: {loss}, in {problem.fitted_quantity.unit}.")
    return tuple(notes)


def _loss_scale_notes(problem: FitProblem, solution: Solution, loss: Loss) -> tuple[str, ...]:
    """A robust loss so narrow that nearly every row is an outlier to it."""
    measured = problem.censoring == 0
    errors = np.abs(problem.residuals(solution.modelled))[measured]
    inside = int(np.count_nonzero(errors <= loss.scale))
    if isinstance(loss, LeastSquares) or inside >= errors.size / 2:
        return ()
    return (
        f"Only {inside} of {errors.size} rows lie within the scale of {loss}: the standard deviations come out too "
        "small. A scale of about three times the noise gives ones to be trusted.",
    )


def _length_notes(problem: FitProblem) -> list[str]:
    """A law made for another specimen: its contraction, and so its parameters, mean something else."""
    rest = problem.data.constants.get("resting_length")
    return [
        f"The recording is of a muscle of {rest:.6g} m, {leaf.path} is {leaf.value:.6g} m."
        for leaf in problem.leaves
        if leaf.declared.name == "resting_length" and rest is not None and abs(leaf.value - float(rest)) > 1e-6
    ]


def _parameters_on_bound(problem: FitProblem, found: FitStatistics) -> list[str]:
    return [problem.leaves[i].path for i, bound in zip(problem.free, found.on_bound, strict=True) if bound]
