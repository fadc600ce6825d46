"""RecordModel: modelled outputs of one record, with their derivatives by every unknown."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ...core import Array, IdentificationError, ParameterError, Status, System, tree
from ...engine import InputSignal, Integrator, WithSensitivities
from ...engine.compile.cache.kernel import evaluate
from ...engine.compile.program import CompiledSystem, compile_system
from ...engine.run.integrators import BoundIntegrator
from .experiment import (
    CommandInstant,
    Experiment,
    InitialValue,
    StartTime,
    Unknown,
    with_command_instants,
)
from .initial_conditions import TimeGrid, compile_conditions, make_time_grid, solve_initial_state

MAX_STEPS = 1_000_000
"""Maximum number of steps of one simulation."""


class RecordModel:
    """The model of one record, compiled once with its sensitivities.

    names                the observed quantities, Q of them
    times                of the rows on the clock of the recording [s], shape (N,)
    measured             their measured values [SI], shape (N, Q)
    valid                mask of the finite measured values, shape (N, Q)
    unknown_indices      indices of the unknowns of the fit that affect this record
    sensitivity_indices  those of them that are integrated as sensitivities; a start time is not
    """

    def __init__(
        self,
        plant: System,
        experiment: Experiment,
        number: int,
        unknowns: Sequence[Unknown],
        observed: Mapping[str, float],
        method: Integrator,
    ) -> None:
        self._arguments = plant, experiment, number, unknowns, dict(observed), method
        self.plant = experiment.plant or plant
        self.experiment = experiment
        self.method = method
        self.unknowns = unknowns
        self.unknown_indices = [k for k, u in enumerate(unknowns) if u.record in (None, number)]
        self.sensitivity_indices = [
            k for k in self.unknown_indices if not isinstance(unknowns[k].target, StartTime)
        ]
        self.names = tuple(observed)
        self.times = _check_times(experiment)
        self.measured = np.column_stack([experiment.recording[name] for name in self.names])
        self.valid = np.isfinite(self.measured)
        self.all_valid = bool(self.valid.all())
        groups = tuple(unknowns[k].paths for k in self.sensitivity_indices) or ((),)
        scales = tuple(unknowns[k].scale for k in self.sensitivity_indices) or (1.0,)
        try:
            self._system = compile_system(WithSensitivities(self.plant, groups, scales, self.names))
        except ParameterError as error:
            raise error.located(experiment.recording.origin) from None
        self._nominal = self._system.nominal
        leaf_index = {leaf.path: i for i, leaf in enumerate(tree.leaves(self.plant))}
        changed_leaves = []
        changing_unknowns = []
        for k in self.unknown_indices:
            for path in unknowns[k].paths:
                changed_leaves.append(leaf_index[path])
                changing_unknowns.append(k)
        self._changed = np.array(changed_leaves, dtype=int), np.array(changing_unknowns, dtype=int)
        self._leaves = tree.flatten(self.plant)
        self._conditions = compile_conditions(self.plant, experiment.initial_conditions)
        known = experiment.initial_conditions.known
        known_names = list(known)
        self._known = np.array(list(known.values()), dtype=float)
        self._initial_values = list[tuple[int, int]]()
        self._instant_columns = list[tuple[int, CommandInstant]]()
        self._leaf_by_column = np.zeros((self._leaves.size, len(self.sensitivity_indices)))
        for column, k in enumerate(self.sensitivity_indices):
            target = unknowns[k].target
            if isinstance(target, InitialValue):
                self._initial_values.append((column, known_names.index(target.name)))
            elif isinstance(target, CommandInstant):
                self._instant_columns.append((column, target))
            changed = [leaf_index[path] for path in unknowns[k].paths]
            self._leaf_by_column[changed, column] = 1.0
        guess = experiment.initial_conditions.guess
        self._state_nominal = np.array([state.nominal for state in self.plant.states])
        self._guess = np.array([guess[state.name] for state in self.plant.states])
        self._last_grid: TimeGrid | None = None
        self._idle: list[BoundIntegrator] = []
        """Bound integrators that no simulation uses at present."""

    def __reduce__(self) -> "tuple[type[RecordModel], tuple[Any, ...]]":
        """Compiled functions are not stored; a loaded model compiles them again."""
        return RecordModel, self._arguments

    def leaves(self, values: Array) -> Array:
        """The leaves of the plant with the unknowns at `values` (P,) [SI]."""
        leaves = self._leaves.copy()
        indices, unknowns = self._changed
        leaves[indices] = values[unknowns]
        return leaves

    def initial_state(self, values: Array) -> tuple[Array, Array]:
        """The initial state (n,) and its derivatives by every sensitivity column (n, K)."""
        known = self._known.copy()
        conditions = self.experiment.initial_conditions
        for j, i in self._initial_values:
            known[i] = values[self.sensitivity_indices[j]]
        state, by_known, by_leaf = solve_initial_state(
            self._conditions,
            conditions,
            self.leaves(values),
            known,
            self._guess,
            self._state_nominal,
        )
        derivatives = by_leaf @ self._leaf_by_column
        for j, i in self._initial_values:
            derivatives[:, j] = by_known[:, i]
        return state, derivatives

    def start_time(self, values: Array) -> float:
        """The start of the run on the clock of the recording [s]."""
        times = [
            values[k]
            for k in self.unknown_indices
            if isinstance(self.unknowns[k].target, StartTime)
        ]
        return float(times[0]) if times else self.experiment.start_time

    def command(self, values: Array) -> InputSignal:
        """The command of the run with its estimated instants."""
        return with_command_instants(self.experiment.command, self._instants(values))

    def _instants(self, values: Array) -> dict[float, float]:
        """The estimated instants [s] by those of the command of the experiment."""
        return {
            target.instant: float(values[self.sensitivity_indices[j]])
            for j, target in self._instant_columns
        }

    def evaluate(self, values: Array, max_steps: int = MAX_STEPS) -> "ModelOutputs":
        """The modelled outputs at the rows for unknowns at `values` (P,) [SI]. Raises
        IdentificationError.
        """
        state, derivatives = self.initial_state(values)
        grid = self._time_grid(values)
        leaves = self._system.parameters.copy()
        leaves[: self._leaves.size] = self.leaves(values)
        system = self._system.at(leaves, self._nominal)
        full_state = np.zeros(self._nominal.size)
        full_state[: state.size] = state
        if self.sensitivity_indices:
            full_state[state.size :] = derivatives.ravel()
        try:  # an idle integrator, because binding takes a twentieth of a simulation
            bound = self._idle.pop()
        except IndexError:  # none, or another thread was quicker
            bound = self.method.bind(system)
        else:
            bound.rebind(self.method.binding(system))
        rows, steps = self._integrate(bound, system, full_state, grid, max_steps)
        outputs = np.empty((grid.times.size, system.sizes.outputs))
        evaluate(
            function=system.address["outputs"],
            c=system.precomputed,
            states=rows,
            inputs=grid.inputs,
            results=outputs,
        )
        self._idle.append(
            bound
        )  # only now: another thread that takes it overwrites the precomputed values
        count = len(self.names)
        columns = self._system.sizes.outputs // len(self.names) - 2
        by_column = outputs[:, count:-count].reshape(-1, count, columns)
        if len(self.sensitivity_indices) == len(self.unknowns):
            return ModelOutputs(outputs[:, :count], by_column, steps)
        jacobian = np.zeros((*self.measured.shape, len(self.unknowns)))
        jacobian[:, :, self.sensitivity_indices] = by_column[:, :, : len(self.sensitivity_indices)]
        for k in self.unknown_indices:
            if isinstance(self.unknowns[k].target, StartTime):
                jacobian[:, :, k] = np.where(grid.before_start[:, None], 0.0, -outputs[:, -count:])
        return ModelOutputs(outputs[:, :count], jacobian, steps)

    def _integrate(
        self,
        bound: BoundIntegrator,
        system: CompiledSystem,
        state: Array,
        grid: TimeGrid,
        max_steps: int,
    ) -> tuple[Array, int]:
        """The states with their sensitivities at the rows, and the steps; the sensitivity to an
        instant of the command begins there with the difference of the rates before and after it."""
        rows = list[Array]()
        steps = 0
        last_input = grid.intervals[0].segments.values[0]
        for interval in grid.intervals:
            if interval.column is not None:
                size = self._guess.size
                before, after = (
                    system.rates(state.tolist(), u)[:size]
                    for u in (last_input, interval.segments.values[0])
                )
                state[size:].reshape(size, -1)[:, interval.column] += before - after
            solution = bound.run(
                interval.segments, interval.begin, state, interval.times, max_steps - steps
            )
            if solution.status == Status.INTERRUPTED:
                raise KeyboardInterrupt
            if solution.status != Status.DONE:
                raise IdentificationError(
                    f"{self.experiment.recording.origin}: the simulation ended early, at"
                    f" {solution.time:.4g} s."
                )
            rows.append(solution.rows)
            state = solution.state
            last_input = interval.segments.values[-1]
            steps = steps + solution.steps
        return rows[0] if len(rows) == 1 else np.concatenate(rows), steps

    def _time_grid(self, values: Array) -> TimeGrid:
        """The rows relative to the start of the run; the last result is kept, as the instants
        rarely change.
        """
        grid = self._last_grid
        start_time = self.start_time(values)
        instants = self._instants(values)
        if grid is None or (grid.start_time, grid.instants) != (start_time, instants):
            command = with_command_instants(self.experiment.command, instants)
            columns = {target.instant: j for j, target in self._instant_columns}
            grid = make_time_grid(
                self.times, start_time, command, self.plant.inputs, instants, columns
            )
            self._last_grid = grid
        return grid


class ModelOutputs(NamedTuple):
    """Modelled outputs (N, Q), their derivatives by all unknowns (N, Q, P), and the steps of the
    simulation.
    """

    values: Array
    jacobian: Array
    steps: int


def _check_times(experiment: Experiment) -> Array:
    """The times of a record [s]. Raises IdentificationError where they decrease or there are
    none.
    """
    times = experiment.recording["time"]
    origin = experiment.recording.origin
    bad = np.flatnonzero(~(np.diff(times) >= 0))
    if bad.size:
        raise IdentificationError(
            f"{origin}: time must not decrease, but row {bad[0] + 2} is at {times[bad[0] + 1]:g} s."
            " Correct the record or use a part of it."
        )
    if not times.size:
        raise IdentificationError(
            f"{origin}: the record has no rows. Give another one, or use a longer part of it."
        )
    return times


def separate_residuals(models: Sequence[RecordModel], residuals: Array) -> list[Array]:
    """The stacked residuals (R,) of each quantity of each record in order of time, missing values
    omitted.
    """
    series = []
    begin = 0
    for model in models:
        rows = residuals[begin : begin + int(model.valid.sum())]
        quantity = np.nonzero(model.valid)[1]
        series += [rows[quantity == q] for q in range(len(model.names))]
        begin += rows.size
    return series


def count_readings(models: Sequence[RecordModel]) -> int:
    """The number of finite measured values."""
    return sum(int(model.valid.sum()) for model in models)


def commands_at(plant: System, command: InputSignal, times: Array) -> Array:
    """The inputs of the plant (N, m) at times [s] from the start of the run (N,); 0 before it."""
    segments = command.segments(plant.inputs, 0.0, max(float(times[-1]), 1e-9))
    return np.where(times[:, None] < 0.0, 0.0, segments.inputs_at(np.maximum(times, 0.0), 0.0))
