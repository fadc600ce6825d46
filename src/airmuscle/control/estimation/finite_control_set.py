"""FiniteControlSet: model predictive control that chooses among the modes of on/off valves."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, NamedTuple

import numpy as np

from ...core import Array, ParameterError, Reference, ShortRepr, SolveError, Status, check_field_types, published
from ...core.declaration import forwarded
from ...core.errors import check_known
from ...engine.compile.cache.kernel import Kernel
from ...engine.compile.function import augmented_rates
from ...engine.compile.program import compile_system
from ...engine.loop.controller import Controller, Measurement
from .estimates import StateEstimate
from .linear_design import check_numbers, check_sample_time
from .state_estimator import StateEstimator

MAX_SEQUENCES = 1_000_000
"""Maximum number of sequences of modes (chosen)."""
_choose = Kernel("choose_mode", "best_mode_sequence")


class FiniteSetMemory(NamedTuple):
    """Memory of the controller: the predicted estimate, the mode of the last sample, and the number of samples."""

    estimate: StateEstimate
    mode: int
    samples: int


class BoundSearch(NamedTuple):
    """The compiled search with the arrays that it reads and writes."""

    states: Array
    wanted: Array
    sequence: Any
    best: Array
    count: Any
    run: Any


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class FiniteControlSet(ShortRepr, Controller):
    """Finite control set model predictive control: the mode of the valves from the best of all short sequences.

        min over m_1 ... m_N   sum_k  sum_i ((y_i(k) - r_i)/d_i)^2  +  c s(m_(k-1), m_k)

    m modes, each a value of every commanded input; y predicted columns, r their set points, d `permitted` deviations, s
    number of inputs that change, c `switching_cost`. The plant is predicted from the state of an estimator, a filter
    with its own model of the plant, by the compiled exponential Euler step of a sample. The estimator's columns are
    measured, and its parameters and disturbances are included in the prediction. All sequences are enumerated; one
    whose cost exceeds the best so far is left. The first mode of the best sequence is applied, and of equal sequences
    the first in the order of `modes`. Set points are held over the horizon, delays of valves are not predicted.

    estimator       ExtendedKalmanFilter or UnscentedKalmanFilter, with the sample time of the loop
    first           estimate before the first sample, as `estimator.start` gives
    modes           inputs by name, such as ({"fill": 0, "discharge": 0}, {"fill": 1, "discharge": 0}, ...)
    permitted       permitted deviation of every controlled column, which is the set point's name
    switching_cost  cost of the change of one input relative to one sample with the permitted deviation (chosen)
    horizon         number N of samples

    Raises ParameterError for unknown names, modes without a common set of inputs, or too many sequences.
    Reference: Qi, Bone and Zhang (2019).
    """

    references: ClassVar[tuple[Reference, ...]] = (published("qi-2019"),)

    estimator: StateEstimator
    first: StateEstimate = dataclasses.field(repr=False)
    modes: tuple[Mapping[str, float], ...]
    permitted: Mapping[str, float]
    switching_cost: float = 0.1
    horizon: int = 4
    _searches: list[BoundSearch] = dataclasses.field(init=False, repr=False, default_factory=list)

    def __post_init__(self) -> None:
        check_field_types(self)
        owner, known = "FiniteControlSet", compile_system(self.estimator.plant).description
        check_numbers(owner, "permitted", self.permitted, self.estimator.plant_columns, ())
        if not self.permitted or not self.modes:
            raise ParameterError(f"{owner}: give one mode or more, and the permitted deviation of one column or more.")
        for mode in self.modes:
            check_known(f"{owner}: modes names", mode, known.input_names)
            if set(mode) != set(self.modes[0]) or not np.isfinite(list(mode.values())).all():
                raise ParameterError(
                    f"{owner}: the mode {dict(mode)} must have a finite number for each of {', '.join(self.modes[0])}."
                )
        if not 0.0 <= self.switching_cost < float("inf"):
            raise ParameterError(f"{owner}: switching_cost is {self.switching_cost!r}; allowed range: 0 and above.")
        if not (self.horizon >= 1 and len(self.modes) ** self.horizon <= MAX_SEQUENCES):
            raise ParameterError(
                f"{owner}: {len(self.modes)} modes over a horizon of {self.horizon} samples; the horizon must be 1 or "
                f"more and the number of sequences at most {MAX_SEQUENCES}. Shorten the horizon."
            )

    def __getstate__(self) -> dict[str, Any]:
        """The fields without the arrays of the compiled search, which belong to one process."""
        return {**self.__dict__, "_searches": []}

    measured_columns = forwarded("estimator.measured")

    @property
    def setpoints(self) -> tuple[str, ...]:
        return tuple(self.permitted)

    @property
    def inputs(self) -> tuple[str, ...]:
        return tuple(self.modes[0])

    def init(self) -> FiniteSetMemory:
        return FiniteSetMemory(self.first, 0, 0)

    def step(
        self, memory: FiniteSetMemory, measurement: Measurement, dt: float
    ) -> tuple[Mapping[str, float], FiniteSetMemory]:
        check_sample_time("FiniteControlSet", dt, self.estimator.sample_time)
        table = self._mode_table
        values = [float(measurement.columns[name]) for name in self.measured_columns]
        estimate, _ = self.estimator.correct(memory.estimate, values, table[memory.mode])
        wanted = [float(measurement.setpoints[name]) for name in self.setpoints]
        mode = self.best_sequence(estimate.mean, wanted, memory.mode)[0]
        later = self.estimator.predict(estimate, table[mode])
        return dict(self.modes[mode]), FiniteSetMemory(later, mode, memory.samples + 1)

    def best_sequence(self, state: Array, wanted: Sequence[float], mode: int) -> tuple[int, ...]:
        """The modes (N,) with the least cost from an estimated state, for set points and the mode before.

        Raises SolveError where no prediction is finite.
        """
        search = self._searches.pop() if self._searches else self._bind()
        search.states[0], search.wanted[:], search.sequence[0] = state, wanted, mode
        status = Status(search.run())
        sequence = tuple(int(k) for k in search.best[1:])
        self._searches.append(search)
        if status is not Status.DONE:
            raise SolveError(f"FiniteControlSet: all predictions fail, because {status.message}. Check the estimate.")
        return sequence

    @property
    def _mode_table(self) -> Array:
        """Inputs (M, m) of the plant in every mode; others are 0."""
        names = compile_system(self.estimator.plant).description.input_names
        return np.array([[float(mode.get(name, 0.0)) for name in names] for mode in self.modes])

    def _bind(self) -> BoundSearch:
        filter_, ready = self.estimator, compile_system(self.estimator.plant)
        total, p = len(filter_.states), len(self.permitted)
        columns = filter_.plant_columns
        functions = augmented_rates(ready, [columns.index(name) for name in self.permitted], *filter_.places)
        table, n = self._mode_table, ready.sizes.states
        changes = self.switching_cost * np.count_nonzero(table[:, None] != table, axis=2)
        weights = np.array([1.0 / deviation**2 for deviation in self.permitted.values()])
        states, wanted = np.zeros((self.horizon + 1, total)), np.zeros(p)
        sequence, count = np.zeros(self.horizon + 1, dtype=np.int64), np.zeros(2, dtype=np.int64)
        best = np.zeros(self.horizon + 1)
        run = _choose.bind(
            functions.rates, functions.measured, functions.constants, filter_.magnitudes, float(filter_.sample_time),
            table, changes, wanted, weights, states, np.zeros(self.horizon + 1), sequence, best, count, np.zeros(n),
            np.zeros((n, total)), np.zeros((5, n, total + 1)), np.zeros(p), np.zeros((p, total)),
        )  # fmt: skip
        return BoundSearch(states, wanted, sequence, best, (count, functions), run)
