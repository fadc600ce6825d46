"""One record of a dynamic fit: what the model gives at its rows, and the derivatives by every unknown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ...compile import System
from ...control.inputs import PiecewiseLinear
from ...core import tree
from ...core.arrays import Array
from ...core.errors import IdentificationError, ParameterError
from ...simulation.integrators import INTERRUPTED, Integrator
from ...simulation.sensitivity import WithSensitivities
from .experiment import Experiment, InitialValue, StartTime, Unknown
from .initial_conditions import compile_conditions, solve_initial_state

MAX_STEPS = 1_000_000
"""Steps after which a run is given up."""


class RecordModel:
    """The model of one record, compiled once with its sensitivities; `unknowns` are all of the fit."""

    def __init__(
        self, plant: System, experiment: Experiment, number: int, unknowns: Sequence[Unknown],
        observed: Mapping[str, float], method: Integrator,
    ) -> None:  # fmt: skip
        from ...compile.program import compile_system  # CasADi, which describing a fit does not need

        self.plant, self.experiment, self.method = experiment.plant or plant, experiment, method
        self.unknowns = unknowns
        self.mine = [k for k, u in enumerate(unknowns) if u.record in (None, number)]
        self.columns = [k for k in self.mine if not isinstance(unknowns[k].target, StartTime)]
        self.names = tuple(observed)
        self.times = _check_times(experiment)
        self.measured = np.column_stack([experiment.recording[name] for name in self.names])
        self.kept = np.isfinite(self.measured)
        self.whole = bool(self.kept.all())
        groups = tuple(unknowns[k].paths for k in self.columns) or ((),)
        scales = tuple(unknowns[k].scale for k in self.columns) or (1.0,)
        self.ready = compile_system(_add_sensitivities(self.plant, groups, scales, self.names, experiment))
        self._nominal = self.ready.nominal()
        place = {leaf.path: i for i, leaf in enumerate(tree.leaves(self.plant))}
        moved = [(place[path], k) for k in self.mine for path in unknowns[k].paths]
        self._moved = np.array([i for i, _ in moved], dtype=int), np.array([k for _, k in moved], dtype=int)
        self._leaves = tree.flatten(self.plant)
        self._conditions = compile_conditions(self.plant, experiment.initial_conditions)
        self._known = np.array(list(experiment.initial_conditions.known.values()), dtype=float)
        self._own_values = [(j, i) for j, k in enumerate(self.columns) for i in _known_index(unknowns[k], experiment)]
        self._shares = np.zeros((self._leaves.size, len(self.columns)))
        for j, k in enumerate(self.columns):
            self._shares[[place[path] for path in unknowns[k].paths], j] = 1.0
        self._sizes = np.array([s.nominal for s in self.plant.states])
        self._guess = np.array([experiment.initial_conditions.guess[s.name] for s in self.plant.states])
        self._last_clock: _TimeGrid | None = None

    def leaves(self, values: Array) -> Array:
        """The plant's leaves with the unknowns at `values`."""
        found = self._leaves.copy()
        places, unknowns = self._moved
        found[places] = values[unknowns]
        return found

    def initial_state(self, values: Array) -> tuple[Array, Array]:
        """The state at the start (n,) and its derivatives by every column (n, K)."""
        known = self._known.copy()
        for j, i in self._own_values:
            known[i] = values[self.columns[j]]
        state, by_known, by_leaf = solve_initial_state(
            self._conditions, self.experiment.initial_conditions, self.leaves(values), known, self._guess, self._sizes
        )
        slopes = by_leaf @ self._shares
        for j, i in self._own_values:
            slopes[:, j] = by_known[:, i]
        return state, slopes

    def start_time(self, values: Array) -> float:
        """Where the run begins on the record's clock [s]."""
        shifts = [values[k] for k in self.mine if isinstance(self.unknowns[k].target, StartTime)]
        return float(shifts[0]) if shifts else self.experiment.start_time

    def evaluate(self, values: Array, most_steps: int = MAX_STEPS) -> ModelOutputs:
        """What the model gives at the record's rows.

        Raises IdentificationError where the run fails or its start does not exist.
        """
        outputs, before, steps = self._outputs(values, most_steps)
        count, columns = len(self.names), self.ready.sizes.outputs // len(self.names) - 2
        by_column = outputs[:, count:-count].reshape(-1, count, columns)
        if len(self.columns) == len(self.unknowns):
            return ModelOutputs(outputs[:, :count], by_column, steps)
        slopes = np.zeros((*self.measured.shape, len(self.unknowns)))
        slopes[:, :, self.columns] = by_column[:, :, : len(self.columns)]
        for k in self.mine:
            if isinstance(self.unknowns[k].target, StartTime):
                slopes[:, :, k] = np.where(before[:, None], 0.0, -outputs[:, -count:])
        return ModelOutputs(outputs[:, :count], slopes, steps)

    def _outputs(self, values: Array, most_steps: int) -> tuple[Array, npt.NDArray[np.bool_], int]:
        from ...compile.cache.kernel import evaluate

        state, slopes = self.initial_state(values)
        clock = self._time_grid(self.start_time(values))
        leaves = self.ready.parameters.copy()
        leaves[: self._leaves.size] = self.leaves(values)
        ready = self.ready.at(leaves, self._nominal)
        full = np.zeros(self._nominal.size)
        full[: state.size] = state
        if self.columns:
            full[state.size :] = slopes.ravel()
        course = self.method.run(ready, clock.segments, 0.0, full, clock.times, most_steps)
        if course.status == INTERRUPTED:
            raise KeyboardInterrupt
        if course.status != 0:
            raise IdentificationError(
                f"{self.experiment.recording.origin}: the run ended early, at {course.time:.4g} s."
            )
        results = np.empty((clock.times.size, ready.sizes.outputs))
        evaluate(ready.address["outputs"], ready.precomputed, course.rows, clock.inputs, results)
        return results, clock.before_start, course.steps

    def _time_grid(self, begin: float) -> _TimeGrid:
        """The record seen from where the run begins; the last one is kept, as most fits ask for one alone."""
        known = self._last_clock
        if known is None or known.start_time != begin:
            clock = self.times - begin
            times, inputs = np.maximum(clock, 0.0), self.plant.inputs
            segments = self.experiment.command.segments(inputs, 0.0, max(float(clock[-1]), 1e-9))
            under = np.ascontiguousarray(segments.inputs_at(times, 0.0))
            self._last_clock = known = _TimeGrid(begin, times, clock < 0, segments, under)
        return known


class ModelOutputs(NamedTuple):
    """What the model gives at the rows (N, Q), its derivatives by all unknowns (N, Q, P), and the steps of the run."""

    values: Array
    jacobian: Array
    steps: int


class _TimeGrid(NamedTuple):
    """Rows of a record counted from the start of the run, and the command there."""

    start_time: float
    times: Array
    before_start: npt.NDArray[np.bool_]
    segments: PiecewiseLinear
    inputs: Array


def _known_index(unknown: Unknown, experiment: Experiment) -> list[int]:
    """Where among the start's known values an unknown stands, if it is one of them."""
    known, what = list(experiment.initial_conditions.known), unknown.target
    return [known.index(what.name)] if isinstance(what, InitialValue) else []


def _check_times(experiment: Experiment) -> Array:
    times = experiment.recording["time"]
    bad = np.flatnonzero(~(np.diff(times) >= 0))
    if bad.size or not times.size:
        where = f"row {bad[0] + 2} stands at {times[bad[0] + 1]:g} s" if bad.size else "it has no rows"
        raise IdentificationError(f"{experiment.recording.origin}: time must rise; {where}. Mend or cut the record.")
    return times


def _add_sensitivities(
    plant: System, groups: tuple[tuple[str, ...], ...], scales: tuple[float, ...], names: tuple[str, ...],
    experiment: Experiment,
) -> WithSensitivities:  # fmt: skip
    try:
        return WithSensitivities(plant, groups, scales, names)
    except ParameterError as error:
        raise ParameterError(f"{experiment.recording.origin}: {error}") from None


def stack_residuals(
    courses: Sequence[RecordModel], values: Array, deviations: Array, scales: Array, most_steps: int = MAX_STEPS
) -> tuple[Array, Array, int]:
    """Residuals (R,) in standard deviations, model less measured, rows without a reading left out.

    And their slopes (R, P) by the unknowns in units of their scales, and the steps of the longest run.
    """
    errors, slopes, longest = [], [], 0
    for course in courses:
        modelled, by, steps = course.evaluate(values, most_steps)
        error, by = (modelled - course.measured) / deviations, by * (scales / deviations[:, None])
        whole, longest = course.whole, max(longest, steps)
        errors.append(error.ravel() if whole else error[course.kept])
        slopes.append(by.reshape(-1, scales.size) if whole else by[course.kept])
    joined = (errors[0], slopes[0]) if len(errors) == 1 else (np.concatenate(errors), np.concatenate(slopes))
    return *joined, longest


def count_readings(courses: Sequence[RecordModel]) -> Any:
    """How many readings take part."""
    return sum(int(course.kept.sum()) for course in courses)
