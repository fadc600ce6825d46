"""NonlinearModelPredictive: model predictive control with the equations of the plant, solved by CasADi."""

import dataclasses
from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple

import numpy as np

from ...core import Array, ParameterError, Reference, ShortRepr, check_field_types, check_known, within
from ...engine.compile.program import compile_system
from ...engine.loop.controller import Measurement, MultivariableController, failure_notes
from ...physics.analysis.linear_model import linearise
from ...physics.analysis.sampled_model import held
from ..laws.linear_model_predictive import RAWLINGS2017
from .estimates import StateEstimate
from .linear_design import check_numbers, check_sample_time, regulator
from .predictive_program import MAX_HORIZON, PredictiveProgram, check_limits
from .state_estimator import StateEstimator


class NonlinearMemory(NamedTuple):
    """Memory of the controller: the predicted estimate, the inputs (m,) of the last sample, planned inputs (N, m) of
    the last solution, how many samples ago that was, all variables of it, and the number of failures so far."""

    estimate: StateEstimate
    applied: Array
    plan: Array
    age: int
    variables: Array | None
    failures: int


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class NonlinearModelPredictive(ShortRepr, MultivariableController):
    """Nonlinear model predictive control: the first input of the best plan under the equations of the plant.

        f(x_s, u_s, d) = 0,   min |z(x_s) - r|^2 w + |u_s - u_0|_R^2                       target
        min  sum |x_k - x_s|_Q^2 + |u_k - u_s|_R^2 + |x_N - x_s|_P^2 + rho |s|^2           over u_0 ... u_(N-1), s >= 0
             x_(k+1) = Phi(x_k, u_k, d),   u_min <= u_k <= u_max,   y_min - s <= y(x_k) <= y_max + s

    f rates of the plant with the estimated disturbances d, Phi classical Runge-Kutta steps over a sample with held
    inputs; Q and R by Bryson's rule, weight 1/d^2 of a permitted deviation; P of the discrete Riccati equation for the
    plant linearised at the first estimate, so that near it the law is that of `LinearModelPredictive`. State and
    disturbances are estimated by a Kalman filter with its own model of the plant. Set points are held over the
    horizon; w is large, so that a set point beyond reach gives the nearest steady state.

    The nonlinear programs are solved by Ipopt in CasADi by multiple shooting, started from the last plan moved by one
    sample. If there is no solution, the next input of the last plan is applied, after its end the present input;
    `notes` states how often.

    estimator    ExtendedKalmanFilter or UnscentedKalmanFilter without parameters, with the sample time of the loop
    first        estimate before the first sample, as `estimator.start` gives
    operating_inputs   values of all inputs of the plant at the first estimate; those not commanded are held there
    controlled   columns with a set point
    commanded    inputs that the controller commands
    permitted    maximum permitted deviation of states and commanded inputs; every commanded input needs one
    limits       minimum and maximum of columns, such as {"pressure": (0, 5e5)}
    slack_weight weight of the squared violation relative to the size of its range; infinity makes the limits hard
    horizon      number N of samples
    substeps     Runge-Kutta steps of a sample

    Raises ParameterError for unknown names, numbers that are not positive, or limits without a range.
    Reference: Rawlings, Mayne and Diehl (2017), chapters 1, 2 and 8.
    """

    references: ClassVar[tuple[Reference, ...]] = (RAWLINGS2017,)

    estimator: StateEstimator
    first: StateEstimate = dataclasses.field(repr=False)
    operating_inputs: Mapping[str, float]
    controlled: tuple[str, ...]
    commanded: tuple[str, ...]
    permitted: Mapping[str, float]
    limits: Mapping[str, tuple[float, float]] = dataclasses.field(default_factory=dict)
    slack_weight: float = 1e4
    horizon: int = within(1, MAX_HORIZON, default=20)
    substeps: int = within(1, MAX_HORIZON, default=2)
    _programs: list[PredictiveProgram] = dataclasses.field(init=False, repr=False, default_factory=list)

    def __post_init__(self) -> None:
        check_field_types(self)
        owner, known = "NonlinearModelPredictive", compile_system(self.estimator.plant).description
        columns = self.estimator.plant_columns
        for argument, names, allowed in (
            ("controlled", self.controlled, columns), ("commanded", self.commanded, known.input_names),
            ("limits", self.limits, columns), ("operating_inputs", self.operating_inputs, known.input_names),
        ):  # fmt: skip
            check_known(f"{owner}: {argument} names", names, allowed)
        check_numbers(owner, "permitted", self.permitted, (*known.state_names, *self.commanded), self.commanded)
        if self.estimator.parameters:
            estimated = ", ".join(self.estimator.parameters)
            raise ParameterError(f"{owner}: the estimator has the parameters {estimated}; give one without parameters.")
        check_limits(owner, self.limits, self.slack_weight)

    def __getstate__(self) -> dict[str, Any]:
        """The fields without the programs of the solver, which belong to one process."""
        return {**self.__dict__, "_programs": []}

    @property
    def measured(self) -> tuple[str, ...]:  # type: ignore[override]
        """The columns that the estimator receives."""
        return self.estimator.measured

    def init(self) -> NonlinearMemory:
        start = np.array([float(self.operating_inputs.get(name, 0.0)) for name in self.commanded])
        return NonlinearMemory(self.first, start, np.zeros((0, start.size)), 0, None, 0)

    def notes(self, memory: NonlinearMemory) -> tuple[str, ...]:
        return failure_notes("NonlinearModelPredictive", "nonlinear program", memory.failures)

    def step(
        self, memory: NonlinearMemory, measurement: Measurement, dt: float
    ) -> tuple[Mapping[str, float], NonlinearMemory]:
        check_sample_time("NonlinearModelPredictive", dt, self.estimator.sample_time)
        values = [float(measurement.columns[name]) for name in self.measured_columns]
        estimate, _ = self.estimator.correct(memory.estimate, values, self._all_inputs(memory.applied))
        wanted = np.array([float(measurement.setpoints[name]) for name in self.controlled])
        low, high = np.array([measurement.ranges[name] for name in self.commanded], dtype=float).T
        plan, variables = self.plan(estimate.mean, wanted, low, high, memory.variables)
        if plan is None:
            age, failures, plan = memory.age + 1, memory.failures + 1, memory.plan
            chosen = plan[age] if age < len(plan) else memory.applied
        else:
            age, failures, chosen = 0, memory.failures, plan[0]
        applied = np.clip(chosen, low, high)
        later = self.estimator.predict(estimate, self._all_inputs(applied))
        commands = dict(zip(self.commanded, applied.tolist(), strict=True))
        return commands, NonlinearMemory(later, applied, plan, age, variables, failures)

    def plan(
        self, state: Array, wanted: Array, low: Array, high: Array, variables: Array | None = None
    ) -> tuple[Array | None, Array | None]:
        """The planned inputs (N, m) [SI], or None where there is no solution, and the variables of the solution.

        state      estimated states and disturbances (n + d,) [SI]
        wanted     set points (q,), `low` and `high` limits of the commanded inputs (m,) [SI]
        variables  those of the last solution, from which the search starts
        """
        programs = self._programs.pop() if self._programs else self._built()
        solution = programs.solve(state, wanted, low, high, variables)
        self._programs.append(programs)
        return solution

    def _all_inputs(self, commanded: Array) -> list[float]:
        """The inputs of the plant in its order."""
        names = compile_system(self.estimator.plant).description.input_names
        values = {**self.operating_inputs, **dict(zip(self.commanded, commanded.tolist(), strict=True))}
        return [float(values.get(name, 0.0)) for name in names]

    def _built(self) -> PredictiveProgram:
        estimator, ready = self.estimator, compile_system(self.estimator.plant)
        states = ready.description.state_names
        inputs = dict(zip(ready.description.input_names, self._all_inputs(self.init().applied), strict=True))
        magnitudes = dict(zip(states, estimator.magnitudes.tolist(), strict=False))
        scale = np.array([self.permitted.get(name, size) for name, size in magnitudes.items()])
        sizes = np.array([self.permitted[name] for name in self.commanded])
        point = dict(zip(states, self.first.mean.tolist(), strict=False))
        linear = linearise(estimator.plant, point, inputs).select(inputs=list(self.commanded))
        a, b = held(linear.A * scale / scale[:, None], linear.B * sizes / scale[:, None], estimator.sample_time)
        weights = np.diag([1.0 if name in self.permitted else 0.0 for name in states])
        _, terminal = regulator("NonlinearModelPredictive", a, b, weights, np.eye(sizes.size))
        return PredictiveProgram(
            estimator.plant, estimator.places[1], inputs, self.controlled, self.commanded, scale, sizes, weights,
            terminal, dict(self.limits), float(self.slack_weight), self.horizon, self.substeps, estimator.sample_time,
        )  # fmt: skip
