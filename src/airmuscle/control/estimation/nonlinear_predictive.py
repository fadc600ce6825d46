"""Model predictive control with the equations of the plant: of continuous inputs, and of the modes
of on/off valves.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, NamedTuple

import numpy as np

from ...core import Array, Reference, ShortRepr, Status, check_field_types, published, within
from ...core.declaration import forwarded
from ...core.errors import ParameterError, SolveError, check_known
from ...engine.compile import Kernel, augmented_rates, compile_system
from ...engine.loop.controller import (
    Controller,
    Measurement,
    MultivariableController,
    failure_notes,
)
from ..laws.linear_model_predictive import RAWLINGS2017
from .lqg_and_adrc import check_numbers, check_sample_time
from .predictive_program import MAX_HORIZON, PredictiveProgram, check_limits
from .state_estimator import StateEstimate, StateEstimator

MAX_SEQUENCES = 1_000_000
"""Maximum number of sequences of modes (chosen)."""
_choose = Kernel("choose_mode", "best_mode_sequence")


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class EstimatingController(ShortRepr, Controller):
    """A controller that estimates the state of its plant, with programs that one thread uses at a
    time.
    """

    estimator: StateEstimator
    first: StateEstimate = dataclasses.field(repr=False)
    _idle: list[Any] = dataclasses.field(init=False, repr=False, default_factory=list)

    measured_columns = forwarded("estimator.measured")

    def __getstate__(self) -> dict[str, Any]:
        """The fields without programs, which belong to one process."""
        return {**self.__dict__, "_idle": []}

    def estimate(
        self, before: StateEstimate, measurement: Measurement, inputs: Any, dt: float
    ) -> StateEstimate:
        """The estimate with a measurement. Raises ParameterError where the loop has another sample
        time.
        """
        check_sample_time(type(self).__name__, dt, self.estimator.sample_time)
        values = [float(measurement.columns[name]) for name in self.measured_columns]
        return self.estimator.correct(before, values, inputs)[0]

    def ordered(self, inputs: Mapping[str, float]) -> list[float]:
        """The inputs of the plant in its order; 0 where none is given."""
        names = compile_system(self.estimator.plant).description.input_names
        return [float(inputs.get(name, 0.0)) for name in names]


class NonlinearMemory(NamedTuple):
    """Memory of the controller: the predicted estimate, the inputs (m,) of the last sample, planned
    inputs (N, m) of the last solution, how many samples ago that was, all variables of it, and the
    number of failures so far.
    """

    estimate: StateEstimate
    applied: Array
    plan: Array
    age: int
    variables: Array | None
    failures: int


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class NonlinearModelPredictive(EstimatingController, MultivariableController):
    """Nonlinear model predictive control: the first input of the best plan under the equations of
    the plant.

        f(x_s, u_s, d) = 0,   min |z(x_s) - r|^2 w + |u_s - u_0|_R^2                       target
        min  sum |x_k - x_s|_Q^2 + |u_k - u_s|_R^2 + |x_N - x_s|_P^2 + rho |s|^2           over u_0
             ... u_(N-1), s >= 0
             x_(k+1) = Phi(x_k, u_k, d),   u_min <= u_k <= u_max,   y_min - s <= y(x_k) <= y_max + s

    f rates of the plant with the estimated disturbances d, Phi classical Runge-Kutta steps over a
    sample with held inputs; Q and R by Bryson's rule, weight 1/d^2 of a permitted deviation; P of
    the discrete Riccati equation for the plant linearised at the first estimate, so that near it
    the law is that of `LinearModelPredictive`. State and disturbances are estimated by a Kalman
    filter with its own model of the plant. Set points are held over the horizon; w is large, so
    that a set point beyond reach gives the nearest steady state.

    The nonlinear programs are solved by Ipopt in CasADi by multiple shooting, started from the last
    plan moved by one sample. If there is no solution, the next input of the last plan is applied,
    after its end the present input; `notes` states how often.

    estimator    ExtendedKalmanFilter or UnscentedKalmanFilter without parameters, with the sample
                 time of the loop
    first        estimate before the first sample, as `estimator.start` gives
    operating_inputs   values of all inputs of the plant at the first estimate; those not commanded
                       are held there
    controlled   columns with a set point
    commanded    inputs that the controller commands
    permitted    maximum permitted deviation of states and commanded inputs; every commanded input
                 needs one
    limits       minimum and maximum of columns, such as {"pressure": (0, 5e5)}
    slack_weight weight of the squared violation relative to the size of its range; infinity makes
    the limits hard
    horizon      number N of samples
    substeps     Runge-Kutta steps of a sample

    Raises ParameterError for unknown names, numbers that are not positive, or limits without a
    range. Reference: Rawlings, Mayne and Diehl (2017), chapters 1, 2 and 8.
    """

    references: ClassVar[tuple[Reference, ...]] = (RAWLINGS2017,)

    operating_inputs: Mapping[str, float]
    controlled: tuple[str, ...]
    commanded: tuple[str, ...]
    permitted: Mapping[str, float]
    limits: Mapping[str, tuple[float, float]] = dataclasses.field(default_factory=dict)
    slack_weight: float = 1e4
    horizon: int = within(1, MAX_HORIZON, default=20)
    substeps: int = within(1, MAX_HORIZON, default=2)

    def __post_init__(self) -> None:
        check_field_types(self)
        owner = "NonlinearModelPredictive"
        known = compile_system(self.estimator.plant).description
        columns = self.estimator.plant_columns
        for argument, names, allowed in (
            ("controlled", self.controlled, columns),
            ("commanded", self.commanded, known.input_names),
            ("limits", self.limits, columns),
            ("operating_inputs", self.operating_inputs, known.input_names),
        ):
            check_known(f"{owner}: {argument} names", names, allowed)
        check_numbers(
            owner,
            "permitted",
            self.permitted,
            (*known.state_names, *self.commanded),
            self.commanded,
        )
        if self.estimator.parameters:
            estimated = ", ".join(self.estimator.parameters)
            raise ParameterError(
                f"{owner}: the estimator has the parameters {estimated}; give one without"
                " parameters."
            )
        check_limits(owner, self.limits, self.slack_weight)

    measured = forwarded("estimator.measured")

    def init(self) -> NonlinearMemory:
        start = np.array([float(self.operating_inputs.get(name, 0.0)) for name in self.commanded])
        return NonlinearMemory(self.first, start, np.zeros((0, start.size)), 0, None, 0)

    def notes(self, memory: NonlinearMemory) -> tuple[str, ...]:
        return failure_notes("NonlinearModelPredictive", "nonlinear program", memory.failures)

    def step(
        self, memory: NonlinearMemory, measurement: Measurement, dt: float
    ) -> tuple[Mapping[str, float], NonlinearMemory]:
        estimate = self.estimate(memory.estimate, measurement, self._all_inputs(memory.applied), dt)
        wanted = np.array([float(measurement.setpoints[name]) for name in self.controlled])
        low, high = np.array([measurement.ranges[name] for name in self.commanded], dtype=float).T
        plan, variables = self.plan(estimate.mean, wanted, low, high, memory.variables)
        if plan is None:
            age = memory.age + 1
            failures = memory.failures + 1
            plan = memory.plan
            chosen = plan[age] if age < len(plan) else memory.applied
        else:
            age = 0
            failures = memory.failures
            chosen = plan[0]
        applied = np.clip(chosen, low, high)
        later = self.estimator.predict(estimate, self._all_inputs(applied))
        commands = dict(zip(self.commanded, applied.tolist(), strict=True))
        return commands, NonlinearMemory(later, applied, plan, age, variables, failures)

    def plan(
        self, state: Array, wanted: Array, low: Array, high: Array, variables: Array | None = None
    ) -> tuple[Array | None, Array | None]:
        """The planned inputs (N, m) [SI], or None where there is no solution, and the variables of
        the solution.

        state      estimated states and disturbances (n + d,) [SI]
        wanted     set points (q,), `low` and `high` limits of the commanded inputs (m,) [SI]
        variables  those of the last solution, from which the search starts
        """
        program = (
            self._idle.pop()
            if self._idle
            else PredictiveProgram(self, self._all_inputs(self.init().applied))
        )
        solution = program.solve(state, wanted, low, high, variables)
        self._idle.append(program)
        return solution

    def _all_inputs(self, commanded: Array) -> list[float]:
        """The inputs of the plant in its order."""
        commands = dict(zip(self.commanded, commanded.tolist(), strict=True))
        return self.ordered({**self.operating_inputs, **commands})


class FiniteSetMemory(NamedTuple):
    """Memory of the controller: the predicted estimate and the mode of the last sample."""

    estimate: StateEstimate
    mode: int


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class FiniteControlSet(EstimatingController):
    """Finite control set model predictive control: the mode of the valves from the best of all
    short sequences.

        min over m_1 ... m_N   sum_k  sum_i ((y_i(k) - r_i)/d_i)^2  +  c s(m_(k-1), m_k)

    m modes, each a value of every commanded input; y predicted columns, r their set points, d
    `permitted` deviations, s number of inputs that change, c `switching_cost`. The plant is
    predicted from the state of an estimator, a filter with its own model of the plant, by the
    compiled exponential Euler step of a sample. The estimator's columns are measured, and its
    parameters and disturbances are included in the prediction. All sequences are enumerated; one
    whose cost exceeds the best so far is left. The first mode of the best sequence is applied, and
    of equal sequences the first in the order of `modes`. Set points are held over the horizon,
    delays of valves are not predicted.

    estimator       ExtendedKalmanFilter or UnscentedKalmanFilter, with the sample time of the loop
    first           estimate before the first sample, as `estimator.start` gives
    modes           inputs by name, such as ({"fill": 0, "discharge": 0}, {"fill": 1, "discharge":
                    0}, ...)
    permitted       permitted deviation of every controlled column, which is the set point's name
    switching_cost  cost of the change of one input relative to one sample with the permitted
                    deviation (chosen)
    horizon         number N of samples

    Raises ParameterError for unknown names, modes without a common set of inputs, or too many
    sequences. Reference: Qi, Bone and Zhang (2019).
    """

    references: ClassVar[tuple[Reference, ...]] = (published("qi-2019"),)

    modes: tuple[Mapping[str, float], ...]
    permitted: Mapping[str, float]
    switching_cost: float = 0.1
    horizon: int = 4

    def __post_init__(self) -> None:
        check_field_types(self)
        owner = "FiniteControlSet"
        known = compile_system(self.estimator.plant).description
        check_numbers(owner, "permitted", self.permitted, self.estimator.plant_columns, ())
        if not self.permitted or not self.modes:
            raise ParameterError(
                f"{owner}: give one mode or more, and the permitted deviation of one column or"
                " more."
            )
        for mode in self.modes:
            check_known(f"{owner}: modes names", mode, known.input_names)
            if set(mode) != set(self.modes[0]) or not np.isfinite(list(mode.values())).all():
                raise ParameterError(
                    f"{owner}: the mode {dict(mode)} must have a finite number for each of"
                    f" {', '.join(self.modes[0])}."
                )
        if not 0.0 <= self.switching_cost < float("inf"):
            raise ParameterError(
                f"{owner}: switching_cost is {self.switching_cost!r}; allowed range: 0 and above."
            )
        if not (self.horizon >= 1 and len(self.modes) ** self.horizon <= MAX_SEQUENCES):
            raise ParameterError(
                f"{owner}: {len(self.modes)} modes over a horizon of {self.horizon} samples; the"
                f" horizon must be 1 or more and the number of sequences at most {MAX_SEQUENCES}."
                " Shorten the horizon."
            )

    @property
    def setpoints(self) -> tuple[str, ...]:
        return tuple(self.permitted)

    @property
    def inputs(self) -> tuple[str, ...]:
        return tuple(self.modes[0])

    def init(self) -> FiniteSetMemory:
        return FiniteSetMemory(self.first, 0)

    def step(
        self, memory: FiniteSetMemory, measurement: Measurement, dt: float
    ) -> tuple[Mapping[str, float], FiniteSetMemory]:
        estimate = self.estimate(
            memory.estimate, measurement, self.ordered(self.modes[memory.mode]), dt
        )
        wanted = [float(measurement.setpoints[name]) for name in self.setpoints]
        mode = self.best_sequence(estimate.mean, wanted, memory.mode)[0]
        applied = self.modes[mode]
        return dict(applied), FiniteSetMemory(
            self.estimator.predict(estimate, self.ordered(applied)), mode
        )

    def best_sequence(self, state: Array, wanted: Sequence[float], mode: int) -> tuple[int, ...]:
        """The modes (N,) with the least cost from an estimated state, for set points and the mode
        before.

        Raises SolveError where no prediction is finite, ParameterError for a mode beyond the last
        one.
        """
        if not 0 <= mode < len(self.modes):
            raise ParameterError(
                f"FiniteControlSet: mode is {mode}; allowed range: 0 to {len(self.modes) - 1}."
            )
        search = self._idle.pop() if self._idle else self._bound()
        _, run, states, aims, modes, best = search
        states[0] = state
        aims[:] = wanted
        modes[0] = mode
        status = Status(run())
        sequence = tuple(int(k) for k in best[1:])
        self._idle.append(search)
        if status is not Status.DONE:
            raise SolveError(
                f"FiniteControlSet: all predictions fail, because {status.message}. Check the"
                " estimate."
            )
        return sequence

    def _bound(self) -> tuple[Any, ...]:
        """The functions, which must live as long as the search, the search, and the arrays that it
        reads and writes.
        """
        filter_ = self.estimator
        ready = compile_system(self.estimator.plant)
        total = len(filter_.states)
        p = len(self.permitted)
        length = self.horizon + 1
        seen = [filter_.plant_columns.index(name) for name in self.permitted]
        functions = augmented_rates(ready, seen, *filter_.places)
        table = np.array([self.ordered(mode) for mode in self.modes])
        n = ready.sizes.states
        changes = self.switching_cost * np.count_nonzero(table[:, None] != table, axis=2)
        weights = np.array([1.0 / deviation**2 for deviation in self.permitted.values()])
        states = np.zeros((length, total))
        wanted = np.zeros(p)
        best = np.zeros(length)
        sequence = np.zeros(length, dtype=np.int64)
        run = _choose.bind(
            rates=functions.rates,
            measured=functions.measured,
            c=functions.constants,
            sizes=filter_.magnitudes,
            h=float(filter_.sample_time),
            modes=table,
            changes=changes,
            wanted=wanted,
            weights=weights,
            states=states,
            costs=np.zeros(length),
            sequence=sequence,
            best=best,
            count=np.zeros(2, dtype=np.int64),
            f=np.zeros(n),
            a=np.zeros((n, total)),
            work=np.zeros((5, n, total + 1)),
            y=np.zeros(p),
            slopes=np.zeros((p, total)),
        )
        return functions, run, states, wanted, sequence, best
