"""Linear model predictive control: a quadratic program in the inputs alone, solved at each sample."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple

import numpy as np
import numpy.typing as npt

from ...core.arrays import Array
from ...core.errors import AirmuscleError
from ...core.reference import Reference
from ...core.short_repr import ShortRepr
from ...engine.loop.controller import Measurement, MultivariableController, failure_notes


@dataclasses.dataclass(frozen=True, eq=False)
class CondensedProblem:
    """min 1/2 z^T H z + (f e)^T z  with  l - z_0 <= z <= u - z_0,  l_A - A_e e <= A z <= u_A - A_e e.

    z = (v_0, ..., v_(N-1), s): deviations of the inputs from their target over N samples, and one slack variable s >= 0
    for each limited column. e: deviation (n,) of the state from its target.

    hessian      H (z, z)
    gradient     f (z, n)
    rows         A (r, z): limited columns minus or plus their slack
    rows_by_state    A_e (r, n)
    limited      (r,) index of the limited column of each row
    upper        (r,) whether a row is an upper limit
    """

    horizon: int
    inputs: int
    slacks: int
    hessian: Array
    gradient: Array
    rows: Array
    rows_by_state: Array
    limited: npt.NDArray[np.intp]
    upper: npt.NDArray[np.bool_]

    def __repr__(self) -> str:
        return f"CondensedProblem({self.horizon} samples, {self.inputs} inputs, {len(self.rows)} limits of columns)"


def condense(
    a: Array, b: Array, weights: Array, costs: Array, terminal: Array, horizon: int, columns: Array, slack_weight: float
) -> CondensedProblem:
    """The problem of x_(k+1) = a x_k + b v_k with the cost sum x^T W x + v^T R v, and the terminal cost x_N^T P x_N.

    columns (l, n) are limited at every sample from the next one on; their slack s costs slack_weight s^2, and there is
    none where slack_weight is infinite. Reference: Rawlings, Mayne and Diehl (2017), chapter 8.
    """
    n, m = b.shape
    powers = [np.eye(n)]
    for _ in range(horizon):
        powers.append(a @ powers[-1])
    forced = np.zeros((horizon, n, horizon, m))
    for k in range(horizon):
        for j in range(k + 1):
            forced[k, :, j] = powers[k - j] @ b
    by_input, by_state = forced.reshape(horizon * n, horizon * m), np.concatenate(powers[1:])
    each = np.kron(np.eye(horizon), weights)
    each[-n:, -n:] = terminal
    soft = len(columns) if np.isfinite(slack_weight) else 0
    size = horizon * m + soft
    hessian, gradient = np.zeros((size, size)), np.zeros((size, n))
    inner = by_input.T @ each @ by_input + np.kron(np.eye(horizon), costs)
    hessian[: horizon * m, : horizon * m] = inner + inner.T
    gradient[: horizon * m] = 2.0 * by_input.T @ each @ by_state
    for i in range(soft):
        hessian[horizon * m + i, horizon * m + i] = 2.0 * slack_weight
    limited = np.kron(np.eye(horizon), columns)
    rows = np.hstack([limited @ by_input, np.zeros((len(limited), soft))])
    upper, lower, index = rows.copy(), rows.copy(), np.tile(np.arange(len(columns)), horizon)
    if soft:
        upper[np.arange(len(rows)), horizon * m + index] = -1.0
        lower[np.arange(len(rows)), horizon * m + index] = 1.0
    ahead = limited @ by_state
    return CondensedProblem(
        horizon, m, soft, hessian, gradient, np.vstack([upper, lower]), np.vstack([ahead, ahead]),
        np.concatenate([index, index]), np.arange(2 * len(rows)) < len(rows),
    )  # fmt: skip


RAWLINGS2017 = Reference(
    key="rawlings-2017",
    authors="Rawlings, J. B., Mayne, D. Q., Diehl, M. M.",
    title="Model Predictive Control: Theory, Computation, and Design",
    where="2nd edition, Nob Hill Publishing, Madison, chapters 1, 2 and 8",
    year=2017,
    note="target calculation, disturbance model for offset-free control, condensed quadratic program",
)
ARNSTROM2022 = Reference(
    key="arnstrom-2022",
    authors="Arnström, D., Bemporad, A., Axehill, D.",
    title="A dual active-set solver for embedded quadratic programming using recursive LDL^T updates",
    where="IEEE Transactions on Automatic Control 67(8):4362-4369",
    year=2022,
    doi="10.1109/TAC.2022.3176430",
    note="the solver DAQP",
)


class PredictiveMemory(NamedTuple):
    """Memory of the controller: predicted deviation of states and disturbances (n + d,), planned inputs (N, m) of the
    last solution, how many samples ago that was, active limits (z + r,) of it, and the number of failures so far."""

    predicted: Array
    plan: Array
    age: int
    active: npt.NDArray[np.int32]
    failures: int


@dataclasses.dataclass(frozen=True, eq=False)
class ObserverModel:
    """Model x_(k+1) = A x_k + B u_k of states and disturbances (n + d,), y = C x, and the gain of its observer.

    Deviations from an operating point, where the measured columns are `measured` (p,) and the inputs `inputs` (m,);
    inputs in units of `input_sizes` (m,).
    """

    transition: Array
    input_matrix: Array
    output_matrix: Array
    gain: Array
    measured: Array
    inputs: Array
    input_sizes: Array

    def __repr__(self) -> str:
        return f"ObserverModel({len(self.transition)} states)"


@dataclasses.dataclass(frozen=True, eq=False)
class TargetMap:
    """Linear maps (n + m, d) and (n + m, q) from disturbances and set points to the steady state and its inputs.

    The set points are deviations from `controlled` (q,); `columns` (l, n) are the limited columns, with their limits
    `lower` and `upper` (l,) as deviations from the operating point.
    """

    by_disturbance: Array
    by_setpoint: Array
    controlled: Array
    columns: Array
    lower: Array
    upper: Array

    def __repr__(self) -> str:
        return f"TargetMap({len(self.controlled)} set points, {len(self.columns)} limited columns)"


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class LinearModelPredictive(ShortRepr, MultivariableController):
    """Linear model predictive control (MPC): the first input of the plan that minimises a quadratic cost.

        x^_k = x^-_k + L (y_k - y_0 - C x^-_k),   x^ = (x, d)                      observer with disturbances d
        x_s = A x_s + B u_s + B_d d,   C_z x_s = r - z_0                            target, the smallest one
        min  sum |x_k - x_s|_Q^2 + |u_k - u_s|_R^2 + |x_N - x_s|_P^2 + rho |s|^2    over u_0 ... u_(N-1) and s >= 0
             u_min <= u_k <= u_max,   z_min - s <= C_l x_k <= z_max + s

    P is the solution of the discrete Riccati equation, so that the law is the linear-quadratic regulator while no limit
    is active. There are as many disturbances as measured columns, therefore measured and controlled columns have no
    offset at rest (Rawlings et al. 2017, chapter 1). Limits of inputs are the ranges of the loop.

    The quadratic program is condensed to the inputs and solved by DAQP (package `daqp`, extra `control`), which starts
    from the limits that were active at the last sample. If there is no solution, which is possible with hard limits
    only, the next input of the last plan is applied, after its end the target; `notes` states how often.
    `airmuscle.control.design_predictive` designs it for a linearised plant.
    References: Rawlings, Mayne and Diehl (2017); Arnström, Bemporad and Axehill (2022).
    """

    references: ClassVar[tuple[Reference, ...]] = (RAWLINGS2017, ARNSTROM2022)

    measured: tuple[str, ...]
    controlled: tuple[str, ...]
    commanded: tuple[str, ...]
    observer: ObserverModel
    target: TargetMap
    problem: CondensedProblem
    _solvers: list[Any] = dataclasses.field(init=False, repr=False, default_factory=list)

    def __getstate__(self) -> dict[str, Any]:
        """The fields without the workspaces of the solver, which belong to one process."""
        return {**self.__dict__, "_solvers": []}

    def init(self) -> PredictiveMemory:
        problem, count = self.problem, len(self.problem.hessian) + len(self.problem.rows)
        empty, free = np.zeros((0, problem.inputs)), np.zeros(count, dtype=np.int32)
        return PredictiveMemory(np.zeros(len(self.observer.transition)), empty, 0, free, 0)

    def notes(self, memory: PredictiveMemory) -> tuple[str, ...]:
        return failure_notes("LinearModelPredictive", "quadratic program", memory.failures)

    def step(
        self, memory: PredictiveMemory, measurement: Measurement, dt: float
    ) -> tuple[Mapping[str, float], PredictiveMemory]:
        model, columns, ranges = self.observer, measurement.columns, measurement.ranges
        innovation = np.array([columns[name] for name in self.measured]) - model.measured
        innovation -= model.output_matrix @ memory.predicted
        estimate = memory.predicted + model.gain @ innovation
        setpoint = np.array([measurement.setpoints[name] for name in self.controlled]) - self.target.controlled
        low, high = np.array([ranges[name] for name in self.commanded]).T
        low, high = (low - model.inputs) / model.input_sizes, (high - model.inputs) / model.input_sizes
        plan, active = self.plan(estimate, setpoint, low, high, memory.active)
        if plan is None:
            age, plan = memory.age + 1, memory.plan
            deviation = plan[age] if age < len(plan) else self._target_inputs @ np.concatenate([estimate, setpoint])
            following = memory._replace(age=age, failures=memory.failures + 1)
        else:
            deviation = plan[0]
            following = PredictiveMemory(memory.predicted, plan, 0, active, memory.failures)
        applied = np.minimum(np.maximum(deviation, low), high)
        predicted = model.transition @ estimate + model.input_matrix @ applied
        commands = dict(zip(self.commanded, (model.inputs + model.input_sizes * applied).tolist(), strict=True))
        return commands, following._replace(predicted=predicted)

    def plan(
        self, estimate: Array, setpoint: Array, low: Array, high: Array, active: npt.NDArray[np.int32]
    ) -> tuple[Array | None, npt.NDArray[np.int32]]:
        """The planned inputs (N, m), or None where the program has no solution, and the active limits.

        Everything is a deviation from the operating point, scaled: states and disturbances (n + d,), set points (q,),
        limits of the inputs (m,). `active` (z + r,) are the limits from which the solver starts.
        """
        problem, (terms, target_inputs) = self.problem, (self._terms, self._target_inputs)
        size, count = problem.horizon * problem.inputs, len(problem.hessian)
        point = np.concatenate([estimate, setpoint])
        values = terms @ point
        gradient, shift = values[:count], values[count:]
        upper, lower = self._limits
        upper[:size].reshape(-1, problem.inputs)[:] = high
        lower[:size].reshape(-1, problem.inputs)[:] = low
        solver = self._solvers.pop() if self._solvers else None
        if solver is None:
            solver = _new_solver()
            solver.setup(problem.hessian, gradient, problem.rows, upper - shift, lower - shift, active.copy())
        else:
            solver.update(f=gradient, bupper=upper - shift, blower=lower - shift, sense=active.copy())
        z, _, flag, info = solver.solve()
        self._solvers.append(solver)
        if flag < 1 or not np.isfinite(z).all():
            return None, active
        return z[:size].reshape(problem.horizon, -1) + target_inputs @ point, _active(info["lam"])

    @functools.cached_property
    def _terms(self) -> Array:
        """Gradient and shift of all limits, linear in estimate and set points: (2 z + r, n + d + q)."""
        problem, target, n = self.problem, self.target, self.problem.gradient.shape[1]
        steady = np.hstack([np.zeros((n, n)), target.by_disturbance[:n], target.by_setpoint[:n]])
        error = np.eye(n, steady.shape[1]) - steady
        shift = (target.columns @ steady)[problem.limited] + problem.rows_by_state @ error
        free = np.zeros((problem.slacks, steady.shape[1]))
        return np.vstack([problem.gradient @ error, *[self._target_inputs] * problem.horizon, free, shift])

    @functools.cached_property
    def _target_inputs(self) -> Array:
        """Inputs of the target, linear in estimate and set points: (m, n + d + q)."""
        n, m = self.problem.gradient.shape[1], self.problem.inputs
        return np.hstack([np.zeros((m, n)), self.target.by_disturbance[n:], self.target.by_setpoint[n:]])

    @property
    def _limits(self) -> tuple[Array, Array]:
        """Upper and lower limits (z + r,), with 0 in place of those of the inputs."""
        return self._constant_limits[0].copy(), self._constant_limits[1].copy()

    @functools.cached_property
    def _constant_limits(self) -> tuple[Array, Array]:
        problem, target = self.problem, self.target
        inputs = np.zeros(problem.horizon * problem.inputs)
        top = np.where(problem.upper, target.upper[problem.limited], np.inf)
        bottom = np.where(problem.upper, -np.inf, target.lower[problem.limited])
        upper = np.concatenate([inputs, np.full(problem.slacks, np.inf), top])
        return upper, np.concatenate([inputs, np.zeros(problem.slacks), bottom])


def _active(multipliers: Array) -> npt.NDArray[np.int32]:
    """Flags of DAQP for the limits with a multiplier: 1 active, 2 more at the lower limit."""
    return (multipliers > 0.0).astype(np.int32) + 3 * (multipliers < 0.0).astype(np.int32)


def _new_solver() -> Any:
    try:
        import daqp
    except ImportError:
        raise AirmuscleError(
            "LinearModelPredictive needs the package 'daqp'; pip install airmuscle[control], or use StateFeedback."
        ) from None
    return daqp.Model()
