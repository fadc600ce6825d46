"""State estimators of a plant: estimates, innovations, and the interface of the nonlinear Kalman
filters.
"""

import abc
import dataclasses
import functools
import math
import warnings
from collections.abc import Iterator, Mapping, Sequence
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ...core import (
    AirmuscleWarning,
    Array,
    ParameterError,
    ShortRepr,
    SolveError,
    Status,
    System,
    check_field_types,
    check_known,
    tree,
)
from ...core.system import check_system, state_vector
from ...engine.compile import (
    AugmentedRates,
    CompiledSystem,
    augmented_rates,
    compile_system,
    states_and_outputs,
)
from ...engine.loop import COMMAND
from ...recording.recording import Recording
from .lqg_and_adrc import DISTURBANCE, check_count, check_numbers

UNKNOWN = 1e30
"""Factor of the variance of a missing measurement."""
UNDEFINED = "the covariance is not positive definite"
"""Why a correction fails."""


class StateEstimate(NamedTuple):
    """Mean (n,) and covariance (n, n) of the estimated states of a plant."""

    mean: Array
    covariance: Array


REJECTED = "rejected"
LOCKED_OUT = 10
"""Name of the column that states what a gate has rejected; rows that it rejects one after another
before it warns (chosen)."""


class Innovation(NamedTuple):
    """Measured minus predicted columns (p,) and their covariance (p, p)."""

    difference: Array
    covariance: Array

    @property
    def normalised_square(self) -> float:
        """nu^T S^-1 nu [1]; its mean is p for a consistent filter."""
        return float(self.difference @ np.linalg.solve(self.covariance, self.difference))


class MeasuredRows(NamedTuple):
    """Times (N,) [s], measured columns (N, p), inputs held before each row (N, m), samples between
    rows (N - 1,).
    """

    time: Array
    measured: Array
    held: Array
    counts: npt.NDArray[np.int64]


class Pass(NamedTuple):
    """A sample of a filter: its row, None where it was lost, the estimate before and after its
    correction, inputs.
    """

    row: int | None
    predicted: StateEstimate
    corrected: StateEstimate
    inputs: Array


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class StateEstimator(ShortRepr, abc.ABC):
    """Interface of the filters that estimate a plant's states from columns that are measured every
    `sample_time` [s].

    measured           columns of the plant, such as ("left.pressure", "right.pressure")
    process_noise      standard deviation of estimated states after 1 s of white noise; others have
                       none
    measurement_noise  standard deviation of every measured column
    parameters         parameters of the plant that are estimated as further states, such as
                       "mechanism.mass"
    disturbances       states to whose rate an unknown constant is added and estimated, such as
                       "speed"; the estimated state is "speed.disturbance", in the unit of the rate
    gate               probability with which a true measurement is used; beyond that quantile of
                       the chi-squared distribution of its normalised square an innovation is an
                       outlier, which corrects nothing

    Parameters and disturbances follow a random walk by their process noise. Calls from several
    threads are permitted. Raises ParameterError for an unknown name or a number that is not
    positive.
    """

    plant: System
    measured: tuple[str, ...]
    sample_time: float
    process_noise: Mapping[str, float]
    measurement_noise: Mapping[str, float]
    parameters: tuple[str, ...] = ()
    disturbances: tuple[str, ...] = ()
    gate: float = 1.0
    _compiled: CompiledSystem = dataclasses.field(init=False, repr=False)
    _functions: AugmentedRates = dataclasses.field(init=False, repr=False)
    _idle: list[SimpleNamespace] = dataclasses.field(init=False, repr=False)

    def __post_init__(self) -> None:
        owner = type(self).__name__
        check_field_types(self)
        check_system(owner, self.plant)
        compiled = compile_system(self.plant)
        object.__setattr__(self, "_compiled", compiled)
        states = compiled.description.state_names
        leaves = [leaf.path for leaf in tree.leaves(self.plant)]
        columns = self.plant_columns
        for argument, names, known in (
            ("measured", self.measured, columns),
            ("parameters", self.parameters, leaves),
            ("disturbances", self.disturbances, states),
        ):
            check_known(f"{owner}: {argument} names", names, known)
        check_numbers(owner, "process_noise", self.process_noise, self.states, ())
        check_numbers(
            owner, "measurement_noise", self.measurement_noise, self.measured, self.measured
        )
        if not 0 < self.sample_time < float("inf"):
            raise ParameterError(
                f"{owner}: 'sample_time' is {self.sample_time!r}; it must be positive and finite."
            )
        if not 0.0 < self.gate <= 1.0:
            raise ParameterError(
                f"{owner}: gate is {self.gate!r}; allowed range: above 0, 1 (no gate) at most."
            )
        seen = [columns.index(name) for name in self.measured]
        object.__setattr__(self, "_functions", augmented_rates(compiled, seen, *self.places))
        object.__setattr__(self, "_idle", [])

    def __getstate__(self) -> dict[str, Any]:
        """The fields that were given; machine code and arrays belong to one process."""
        return {
            field.name: getattr(self, field.name)
            for field in dataclasses.fields(self)
            if field.init
        }

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(**state)  # type: ignore[misc]

    @abc.abstractmethod
    def _kernels(self, at: SimpleNamespace) -> tuple[Any, Any]:
        """The compiled prediction and correction, bound to arrays."""

    def _bind(self) -> SimpleNamespace:
        """The compiled prediction and correction of the filter with the arrays that they read and
        write.
        """
        n = len(self.states)
        p = len(self.measured)
        bound = SimpleNamespace(
            mean=np.zeros(n),
            covariance=np.zeros((n, n)),
            inputs=np.zeros(self._compiled.sizes.inputs),
            values=np.zeros(p),
            variances=self.variances.copy(),
            difference=np.zeros(p),
            slopes=np.zeros((p, n)),
            difference_covariance=np.zeros((p, p)),
            transition=np.zeros((n, n)),
        )
        bound.predict, bound.correct = self._kernels(bound)
        return bound

    @property
    def states(self) -> tuple[str, ...]:
        """The names of the estimated states: those of the plant, then parameters and
        disturbances.
        """
        return (
            *self._compiled.description.state_names,
            *self.parameters,
            *(f"{name}{DISTURBANCE}" for name in self.disturbances),
        )

    @property
    def plant_columns(self) -> tuple[str, ...]:
        """The names of the states and outputs of the plant."""
        return (*self._compiled.description.state_names, *self._compiled.output_names)

    @property
    def places(self) -> tuple[list[int], list[int]]:
        """Indices of the estimated parameters among the leaves, and of the disturbed states."""
        leaves = [leaf.path for leaf in tree.leaves(self.plant)]
        states = self._compiled.description.state_names
        return [leaves.index(name) for name in self.parameters], [
            states.index(name) for name in self.disturbances
        ]

    @property
    def noise(self) -> Array:
        """Covariance (n, n) of the process noise of one sample."""
        return np.diag(
            [self.process_noise.get(name, 0.0) ** 2 * self.sample_time for name in self.states]
        )

    @functools.cached_property
    def variances(self) -> Array:
        """Variances (p,) of the measured columns; not to be changed."""
        variances = np.array([self.measurement_noise[name] ** 2 for name in self.measured])
        variances.flags.writeable = False
        return variances

    @property
    def magnitudes(self) -> Array:
        """Magnitudes (n,) of the estimated states, by which the equations are scaled."""
        nominal = dict(
            zip(
                self._compiled.description.state_names, self._compiled.nominal.tolist(), strict=True
            )
        )
        further = [abs(self._parameter_values[name]) or 1.0 for name in self.parameters]
        return np.array(
            [*nominal.values(), *further, *(nominal[name] for name in self.disturbances)]
        )

    def start(self, state: Mapping[str, float], deviations: Mapping[str, float]) -> StateEstimate:
        """The first estimate: a state, and the standard deviations of its values; 0 unless given.

        Parameters start at those of the plant and disturbances at 0, unless the state contains
        them.
        """
        check_known(f"{type(self).__name__}: deviations names", deviations, self.states)
        count = len(self._compiled.description.state_names)
        further = {name: self._parameter_values.get(name, 0.0) for name in self.states[count:]}
        own = {name: value for name, value in state.items() if name not in further}
        values = [float(state.get(name, value)) for name, value in further.items()]
        spread = [deviations.get(name, 0.0) ** 2 for name in self.states]
        return StateEstimate(np.array([*state_vector(self.plant, own), *values]), np.diag(spread))

    def predict(self, estimate: StateEstimate, inputs: Sequence[float]) -> StateEstimate:
        """The estimate one sample later, under inputs (m,) that are held.

        Raises SolveError where the rates are not finite.
        """
        bound = self._filled(estimate, inputs)
        return self._taken(bound, bound.predict())

    def correct(
        self, estimate: StateEstimate, values: Sequence[float], inputs: Sequence[float]
    ) -> tuple[StateEstimate, Innovation]:
        """The estimate after a measurement (p,) under the inputs (m,) at that instant, and the
        innovation.

        A value that is NaN is missing: the others correct the estimate, and the innovation has as
        many (p' <= p). An innovation beyond the gate leaves the estimate as it was. Raises
        SolveError for an infinite value, and where the innovation has no positive definite
        covariance.
        """
        corrected, innovation = self.corrected_by_all(estimate, values, inputs)
        return (estimate if self.rejects(innovation) else corrected), innovation

    def rejects(self, innovation: Innovation) -> bool:
        """Whether an innovation is beyond the gate, so that its measurement is an outlier."""
        count = innovation.difference.size
        if self.gate >= 1.0 or not count:
            return False
        from scipy.special import chdtri

        return innovation.normalised_square > float(chdtri(count, 1.0 - self.gate))

    def corrected_by_all(
        self, estimate: StateEstimate, values: Sequence[float], inputs: Sequence[float]
    ) -> tuple[StateEstimate, Innovation]:
        """The result of `correct` without its gate."""
        check_count(type(self).__name__, "measured values", values, self.measured)
        if not all(map(math.isfinite, values)):
            return self._corrected_by_some(estimate, values, inputs)
        bound = self._filled(estimate, inputs)
        bound.values[:] = values
        bound.variances[:] = self.variances
        status = bound.correct()
        innovation = Innovation(bound.difference.copy(), bound.difference_covariance.copy())
        return self._taken(bound, status, UNDEFINED), innovation

    def _corrected_by_some(
        self, estimate: StateEstimate, values: Sequence[float], inputs: Sequence[float]
    ) -> tuple[StateEstimate, Innovation]:
        """The estimate after the values that are not missing, and their innovation. Raises
        SolveError for an infinite value.
        """
        readings = np.asarray(values, dtype=float)
        if np.isinf(readings).any():
            raise SolveError(
                f"{type(self).__name__}: the measured values must be finite, or NaN where one is"
                f" missing; {', '.join(self.measured)} are {values}."
            )
        here = ~np.isnan(readings)
        bound = self._filled(estimate, inputs)
        # a missing value counts with a variance beside which nothing is known
        bound.values[:] = np.where(here, readings, 0.0)
        bound.variances[:] = np.where(here, 1.0, UNKNOWN) * self.variances
        status = bound.correct()
        innovation = Innovation(
            bound.difference[here], bound.difference_covariance[np.ix_(here, here)]
        )
        return self._taken(bound, status, UNDEFINED), innovation

    def columns(self, estimate: StateEstimate, inputs: Sequence[float]) -> dict[str, float]:
        """All states and outputs of the plant at an estimate, such as contraction and force."""
        check_count(type(self).__name__, "states", estimate.mean.tolist(), self.states)
        check_count(type(self).__name__, "inputs", inputs, self._compiled.description.input_names)
        table = self.table(estimate.mean[None, :], np.array([inputs], dtype=float))
        return {name: float(column[0]) for name, column in table.items()}

    def estimate(self, recording: Recording, first: StateEstimate) -> dict[str, Array]:
        """Columns (N,) that are estimated from a recording, row by row, and `time` [s].

        The rows are whole multiples of `sample_time` apart: where samples are lost, nothing
        corrects the estimate between them, nor does a value that is NaN. Inputs are the columns of
        their names, or the commands of a controller; an input without a column is 0. With a gate,
        `rejected` is 1 in the rows that it has rejected. Raises ParameterError for other times.
        """
        rows = self.rows(recording)
        passes = [step for step in self._passes(rows, first) if step.row is not None]
        return {
            "time": rows.time,
            **self.table(np.array([step.corrected.mean for step in passes]), rows.held),
            **self.rejected_rows(rows, [step.corrected is step.predicted for step in passes]),
        }

    def rejected_rows(self, rows: MeasuredRows, rejected: Sequence[bool]) -> dict[str, Array]:
        """The column `rejected` (N,) of an estimator with a gate: 1 where the gate has rejected the
        measurements of a row, else 0.

        Warns where it has rejected many rows one after another, as it does after a wrong start.
        """
        if self.gate >= 1.0:
            return {}
        longest = 0
        run = 0
        last = 0
        for k, refused in enumerate(rejected):
            run = run + 1 if refused else 0
            if run > longest:
                longest = run
                last = k
        if longest >= LOCKED_OUT:
            time = float(rows.time[last - longest + 1])
            warnings.warn(
                f"{type(self).__name__}: the gate has rejected {sum(rejected)} of"
                f" {len(rejected)} rows, {longest} of them one after another from"
                f" {time:.4g} s on: the estimate was wrong there rather than the measurements."
                " Give `start` larger deviations, states more process_noise, or a gate nearer to"
                " 1.",
                AirmuscleWarning,
                stacklevel=3,
            )
        return {REJECTED: np.array(rejected, dtype=float)}

    def rows(self, recording: Recording) -> MeasuredRows:
        """The rows of a recording. Raises ParameterError for times that are no multiples of the
        sample time apart.
        """
        time = np.asarray(recording["time"], dtype=float)
        rounding = 1e-6 * self.sample_time + 2.0 * np.spacing(np.abs(time).max(initial=0.0))
        counts = np.round(np.diff(time) / self.sample_time)
        if (
            time.size < 2
            or (counts < 1).any()
            or np.abs(np.diff(time) - counts * self.sample_time).max() > rounding
        ):
            raise ParameterError(
                f"{type(self).__name__}.estimate: the rows must be {self.sample_time:g} s apart, or"
                " whole multiples of it; simulate or resample with this interval."
            )
        inputs = np.zeros((time.size, self._compiled.sizes.inputs))
        for i, name in enumerate(self._compiled.description.input_names):
            known = [column for column in (f"{COMMAND}{name}", name) if column in recording]
            if known:
                inputs[:, i] = recording[known[0]]
        measured = np.column_stack([recording[name] for name in self.measured])
        return MeasuredRows(
            time, measured, np.vstack([inputs[:1], inputs[:-1]]), counts.astype(int)
        )

    def _passes(self, rows: MeasuredRows, first: StateEstimate) -> Iterator[Pass]:
        """Prediction and correction of every sample, also of those without a row."""
        predicted = first
        for k, inputs in enumerate(rows.held):
            for lost in range(rows.counts[k - 1] - 1 if k else 0, -1, -1):
                before = predicted
                predicted = self.predict(before, inputs) if k else first
                if lost:
                    yield Pass(None, predicted, predicted, inputs)
            corrected, _ = self.correct(predicted, rows.measured[k], inputs)
            yield Pass(k, predicted, corrected, inputs)
            predicted = corrected

    def table(self, means: Array, inputs: Array) -> dict[str, Array]:
        """All states and outputs of the plant at estimates (N, n) and inputs (N, m), by name."""
        known = self._compiled.description
        count = len(self._compiled.description.state_names)
        values = states_and_outputs(self._functions, count, means, inputs, len(known.output_names))
        further = dict(zip(self.states[count:], means[:, count:].T, strict=True))
        return {
            **dict(zip((*known.state_names, *known.output_names), values.T, strict=True)),
            **further,
        }

    @property
    def _parameter_values(self) -> dict[str, float]:
        return {
            leaf.path: float(leaf.value)
            for leaf in tree.leaves(self.plant)
            if leaf.path in self.parameters
        }

    def _filled(self, estimate: StateEstimate, inputs: Sequence[float]) -> SimpleNamespace:
        """A bound filter that no other thread uses, at an estimate."""
        check_count(type(self).__name__, "inputs", inputs, self._compiled.description.input_names)
        bound = self._idle.pop() if self._idle else self._bind()
        bound.mean[:] = estimate.mean
        bound.covariance[:] = estimate.covariance
        bound.inputs[:] = inputs
        return bound

    def _taken(self, bound: SimpleNamespace, status: int, reason: str = "") -> StateEstimate:
        """The estimate that a bound filter has computed; it is free again. Raises SolveError with a
        reason.
        """
        estimate = StateEstimate(bound.mean.copy(), bound.covariance.copy())
        self._idle.append(bound)
        if status != Status.DONE:
            raise SolveError(
                f"{type(self).__name__}: the step failed, because"
                f" {reason or Status(status).message}. Check the measured values, the first"
                " estimate and the noise."
            )
        return estimate
