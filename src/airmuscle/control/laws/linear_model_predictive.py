"""Linear model predictive control: a quadratic program in the inputs alone, solved at each
sample.
"""

import dataclasses
import functools
from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple

import numpy as np
import numpy.typing as npt

from ...core import Array, Reference, ShortRepr, Status, published
from ...engine.compile.cache.kernel import Kernel
from ...engine.loop.controller import Measurement, MultivariableController, failure_notes
from .linear_law import LinearLaw

RAWLINGS2017 = published("rawlings-2017")
CHISCI2001 = published("chisci-2001")
_sample = Kernel("predictive_sample", "predictive")
UNLIMITED = 1e30
TOLERANCES = (1e-9, 1e-6, 1e-12, 1e-9)
"""A limit that nothing reaches; tolerances of the quadratic program, by their places in the kernel
(chosen).
"""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class CondensedProblem(ShortRepr):
    """min 1/2 z^T H z + (f e)^T z  with limits of z_0 + z, of A z + A_e e and of the changes of z.

    z = (v_1, ..., v_B, s): deviations of the inputs from their target, each held over a block of
    samples, and one slack variable s >= 0 for each limited column. e: deviation (n,) of the state
    from its target.

    horizon, inputs, slacks    number of samples, inputs and slack variables
    hessian      H (z, z)
    gradient     f (z, n)
    moves        (N m, B m): inputs of the samples by those of the blocks
    rows         A (r, z): limited columns minus or plus their slack
    rows_by_state    A_e (r, n)
    limited      (r,) index of the limited column of each row
    upper        (r,) whether a row is an upper limit
    narrowed     (B m,) and (r,): by how much the limits of inputs and of rows are narrower
    max_change   (m,) of the inputs from one sample to the next; infinite where there is no limit
    """

    horizon: int
    inputs: int
    slacks: int
    hessian: Array
    gradient: Array
    moves: Array
    rows: Array
    rows_by_state: Array
    limited: npt.NDArray[np.intp]
    upper: npt.NDArray[np.bool_]
    narrowed: tuple[Array, Array]
    max_change: Array


class PredictiveMemory(NamedTuple):
    """Memory of the controller: predicted deviation of states and disturbances (n + d,), planned
    inputs (N m,) of the last solution, inputs (m,) of the last sample, limits (r,) that were
    active, and two numbers: how many samples ago the solution was, -1 without one, and the number
    of failures so far."""

    predicted: Array
    plan: Array
    inputs: Array
    active: Array
    counts: npt.NDArray[np.int64]

    @property
    def failures(self) -> int:
        """The number of samples without a solution so far."""
        return int(self.counts[1])


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class ObservedModel(ShortRepr):
    """Model x_(k+1) = A x_k + B u_k of states and disturbances (n + d,), y = C x, with its observer
    and steady state.

    Deviations from an operating point, where the measured columns are `measured` (p,), the inputs
    `inputs` (m,) and the controlled columns `controlled` (q,); inputs in units of `input_sizes`
    (m,).

    gain    of the observer
    by_disturbance, by_setpoint    (n + m, d) and (n + m, q): steady state and its inputs
    columns, lower, upper    (l, n) of the limited columns, and their limits (l,)
    """

    transition: Array
    input_matrix: Array
    output_matrix: Array
    gain: Array
    measured: Array
    inputs: Array
    input_sizes: Array
    by_disturbance: Array
    by_setpoint: Array
    controlled: Array
    columns: Array
    lower: Array
    upper: Array


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class PredictiveDesign(ShortRepr):
    """The numbers from which a controller was designed, by names of signals, in SI units.

    sample_time    [s]
    blocks         samples over which the planned inputs are held, one after the other
    state, inputs  the operating point
    permitted, process_noise, measurement_noise, limits, max_rate, bounded, slack_weight
                   as of `design_predictive`
    disturbed      states with a disturbance
    """

    sample_time: float
    blocks: tuple[int, ...]
    state: Mapping[str, float]
    inputs: Mapping[str, float]
    disturbed: tuple[str, ...]
    permitted: Mapping[str, float]
    process_noise: Mapping[str, float]
    measurement_noise: Mapping[str, float]
    limits: Mapping[str, tuple[float, float]]
    max_rate: Mapping[str, float]
    bounded: Mapping[str, float]
    slack_weight: float

    def lines(self) -> list[str]:
        """The numbers as lines of a text, for the header of a program."""
        horizon = sum(self.blocks)
        lines = [
            f"Horizon: {horizon} samples of {self.sample_time:g} s; inputs are held over"
            f" {', '.join(map(str, self.blocks))} samples.",
            f"Model: linear, states {', '.join(self.state)}; disturbances of the rates of"
            f" {', '.join(self.disturbed)}.",
        ]
        for heading, numbers in (
            ("Operating point, states", self.state),
            ("Operating point, inputs", self.inputs),
            ("Permitted deviations (weight 1/d^2)", self.permitted),
            ("Process noise, deviation after 1 s", self.process_noise),
            ("Measurement noise", self.measurement_noise),
            ("Greatest rates of inputs, over 1 s", self.max_rate),
            ("Bounded disturbances", self.bounded),
        ):
            texts = [f"{name} {value:.6g}" for name, value in numbers.items()]
            lines.append(f"{heading} (SI): {', '.join(texts) or 'none'}.")
        limits = [f"{name} {low:.6g} to {high:.6g}" for name, (low, high) in self.limits.items()]
        weight = f", weight of a violation {self.slack_weight:g}" if limits else ""
        lines.append(f"Limits of columns (SI): {', '.join(limits) or 'none'}{weight}.")
        return lines


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class LinearModelPredictive(ShortRepr, MultivariableController):
    """Linear model predictive control (MPC): the first input of the plan that minimises a quadratic
    cost.

        x^_k = x^-_k + L (y_k - y_0 - C x^-_k),   x^ = (x, d)                      observer with
                                                  disturbances d
        x_s = A x_s + B u_s + B_d d,   C_z x_s = r - z_0                            target, the
                                       smallest one
        min  sum |x_k - x_s|_Q^2 + |u_k - u_s|_R^2 + |x_N - x_s|_P^2 + rho |s|^2    over u_0 ...
             u_(N-1) and s >= 0
             u_min + b_k <= u_k <= u_max - b_k,   z_min + c_k - s <= C_l x_k <= z_max - c_k + s,
             |u_k - u_(k-1)| <= R h,   u_k constant over each block of samples

    P is the solution of the discrete Riccati equation, so that the law is the linear-quadratic
    regulator while no limit is active. There are as many disturbances as measured columns,
    therefore measured and controlled columns have no offset at rest (Rawlings et al. 2017, chapter
    1). Limits of inputs are the ranges of the loop. b_k and c_k are the reach of bounded
    disturbances under the regulator until sample k (Chisci et al. 2001); 0 without them. The input
    before the first sample is that of the operating point.

    The quadratic program is condensed to the inputs and solved by a compiled dual active-set method
    (Goldfarb and Idnani 1983), which starts from the limits that were active at the last sample;
    the export prints the same one in C. If there is no solution, which is possible with hard limits
    only, the next input of the last plan is applied, after its end the target; `notes` states how
    often. `design_predictive` designs it for a linearised plant.
    """

    references: ClassVar[tuple[Reference, ...]] = (
        RAWLINGS2017,
        published("goldfarb-idnani-1983"),
        CHISCI2001,
    )

    measured: tuple[str, ...]
    controlled: tuple[str, ...]
    commanded: tuple[str, ...]
    model: ObservedModel
    problem: CondensedProblem
    design: PredictiveDesign | None = None
    """From what it was designed, for reports and exported programs."""

    def linear_law(self) -> LinearLaw:
        """The controller while no limit acts: observer and linear-quadratic regulator.

        Its memory is the predicted deviation of states and disturbances.
        """
        model = self.model
        constants = self.constants
        states = len(model.transition)
        inputs = len(self.commanded)
        points = len(self.controlled)
        correction = model.gain
        corrected = np.eye(states) - correction @ model.output_matrix
        by_point = constants["plan_by_point"][:inputs]
        by_state = by_point[:, :states]
        by_setpoint = by_point[:, states : states + points]
        closed = model.transition + model.input_matrix @ by_state
        sizes = model.input_sizes[:, None]
        return LinearLaw(
            A=closed @ corrected,
            B=closed @ correction,
            E=model.input_matrix @ by_setpoint,
            C=sizes * (by_state @ corrected),
            D=sizes * (by_state @ correction),
            F=sizes * by_setpoint,
            memory=tuple(f"predicted{i}" for i in range(states)),
            measured=self.measured,
            setpoints=self.controlled,
            inputs=self.commanded,
        )

    @functools.cached_property
    def _idle(self) -> list[Any]:
        """Arrays and compiled samples that no thread uses."""
        return []

    def __getstate__(self) -> dict[str, Any]:
        """The fields without compiled samples, which belong to one process."""
        return {
            key: value for key, value in self.__dict__.items() if key not in ("constants", "_idle")
        }

    def init(self) -> PredictiveMemory:
        problem = self.problem
        m = len(self.commanded)
        return PredictiveMemory(
            np.zeros(len(self.model.transition)),
            np.zeros(problem.horizon * m),
            np.zeros(m),
            np.zeros(len(self.constants["scale"])),
            np.array([-1, 0]),
        )

    def notes(self, memory: PredictiveMemory) -> tuple[str, ...]:
        return failure_notes("LinearModelPredictive", "quadratic program", memory.failures)

    def step(
        self, memory: PredictiveMemory, measurement: Measurement, dt: float
    ) -> tuple[Mapping[str, float], PredictiveMemory]:
        model = self.model
        ranges = measurement.ranges
        low, high = np.array([ranges[name] for name in self.commanded]).T
        _, later = self._sample(
            memory,
            np.array([measurement.columns[name] for name in self.measured]) - model.measured,
            np.array([measurement.setpoints[name] for name in self.controlled])
            - self.model.controlled,
            ((low - model.inputs) / model.input_sizes, (high - model.inputs) / model.input_sizes),
        )
        commands = (model.inputs + model.input_sizes * later.inputs).tolist()
        return dict(zip(self.commanded, commands, strict=True)), later

    def plan(
        self,
        estimate: Array,
        setpoint: Array,
        low: Array,
        high: Array,
        memory: PredictiveMemory | None = None,
    ) -> Array | None:
        """The planned inputs (N, m), or None where the program has no solution.

        Everything is a deviation from the operating point, scaled: states and disturbances (n +
        d,), set points (q,), limits of the inputs (m,). `memory` has the inputs of the last sample
        and the limits to start from.
        """
        before = (memory or self.init())._replace(predicted=estimate)
        status, later = self._sample(
            before, self.model.output_matrix @ estimate, setpoint, (low, high)
        )
        return later.plan.reshape(self.problem.horizon, -1) if status is Status.DONE else None

    def _sample(
        self, memory: PredictiveMemory, y: Array, r: Array, limits: tuple[Array, Array]
    ) -> tuple[Status, PredictiveMemory]:
        """The status of the program and the memory after a sample, of scaled deviations."""
        if not self._idle:
            arrays = self.arrays()
            self._idle.append((arrays, _sample.bind(**arrays)))
        arrays, run = self._idle.pop()
        for name, value in {
            "y": y,
            "r": r,
            "low": limits[0],
            "high": limits[1],
            **memory._asdict(),
        }.items():
            arrays[name][:] = value
        status = Status(run())
        later = PredictiveMemory(*[arrays[name].copy() for name in memory._fields])
        self._idle.append((arrays, run))
        return status, later

    @property
    def initial_memory(self) -> dict[str, float]:
        """All values of the memory before the first sample, by name: `predicted0` and so on."""
        return {
            f"{key}{i}": float(v)
            for key, values in self.init()._asdict().items()
            for i, v in enumerate(values)
        }

    def arrays(self) -> dict[str, Array]:
        """New arrays of all arguments of `predictive_sample`, by name: signals, constants, memory
        and workspace.
        """
        known = self.constants
        memory = self.init()
        m = len(self.commanded)
        p, _ = self.model.output_matrix.shape
        r, n = known["m"].shape
        q = len(self.controlled)
        return {
            **{
                name: np.zeros(size) for name, size in (("y", p), ("r", q), ("low", m), ("high", m))
            },
            **known,
            **memory._asdict(),
            "innovation": np.zeros(p),
            "point": np.zeros(known["rest"].shape[1]),
            "lower": np.zeros(r),
            "upper": np.zeros(r),
            "order": np.zeros(n, dtype=np.int64),
            "factor": np.zeros((n, n)),
            **{name: np.zeros(n) for name in ("multipliers", "change", "spare", "w")},
        }

    @functools.cached_property
    def constants(self) -> dict[str, Array]:
        """The constant arrays of `predictive_sample`, by the names of its arguments.

        The program is the shortest vector w = L^T z + L^-1 f e with limits of its rows, H = L L^T.
        """
        problem = self.problem
        model = self.model
        n = problem.gradient.shape[1]
        m = problem.inputs
        count = problem.moves.shape[1]
        steady = np.hstack([self.model.by_disturbance, self.model.by_setpoint])
        width = n + steady.shape[1] + m
        at_rest = np.zeros((n + m, width))
        at_rest[:, n : width - m] = steady
        error = np.eye(n, width) - at_rest[:n]
        rest = at_rest[n:]
        rows, shift, low, high, of_input = self._limits(error, at_rest)
        factor = np.linalg.cholesky(problem.hessian)
        free = np.linalg.solve(factor, problem.gradient @ error)
        matrix = np.linalg.solve(factor, rows.T).T
        length = np.linalg.norm(matrix, axis=1)
        used = length > 1e-9 * length.max()  # no input changes the column of another row
        scale = 1.0 / length[used]
        matrix = matrix[used] * scale[:, None]
        held = np.linalg.inv(factor.T)[:count]
        arrays = {
            "by_output": model.output_matrix,
            "gain": model.gain,
            "transition": model.transition,
            "by_input": model.input_matrix,
            "rest": rest,
            "m": matrix,
            "of_input": of_input[used],
            "scale": scale,
            "fixed_low": np.maximum(low[used] * scale, -UNLIMITED),
            "fixed_high": np.minimum(high[used] * scale, UNLIMITED),
            "by_point": shift[used] * scale[:, None] + matrix @ free,
            "plan_by_w": problem.moves @ held,
            "plan_by_point": np.tile(rest, (problem.horizon, 1)) - problem.moves @ held @ free,
            "tolerances": np.array(TOLERANCES),
        }
        return {name: np.ascontiguousarray(array) for name, array in arrays.items()}

    def _limits(self, error: Array, at_rest: Array) -> tuple[Array, Array, Array, Array, Array]:
        """All rows (r, z), what the point adds to their limits (r, N), the limits (r,), and their
        inputs (r,) or -1.
        """
        problem = self.problem
        model = self.model
        m = self.problem.inputs
        n = len(error)
        count = problem.moves.shape[1]
        size = len(problem.hessian)
        own = np.eye(size)[:count]
        slack = np.eye(size)[count:]
        rest = np.tile(at_rest[n:], (count // m, 1))
        columns = (model.columns @ at_rest[:n])[problem.limited] + problem.rows_by_state @ error
        narrow_inputs, narrow_rows = problem.narrowed
        top = np.where(problem.upper, model.upper[problem.limited] - narrow_rows, np.inf)
        bottom = np.where(problem.upper, -np.inf, model.lower[problem.limited] + narrow_rows)
        changing = np.tile(np.isfinite(problem.max_change), count // m)
        change = own - np.eye(size, k=-m)[:count]
        largest = np.tile(problem.max_change, count // m)
        first = np.zeros_like(rest)
        first[:m] = np.eye(m, rest.shape[1], k=rest.shape[1] - m) - rest[:m]
        kinds = np.concatenate(
            [np.tile(np.arange(m), count // m), np.full(len(slack) + len(columns), -1)]
        )
        return (
            np.vstack([own, slack, problem.rows, change[changing]]),
            np.vstack([-rest, np.zeros((len(slack), rest.shape[1])), -columns, first[changing]]),
            np.concatenate([narrow_inputs, np.zeros(len(slack)), bottom, -largest[changing]]),
            np.concatenate([-narrow_inputs, np.full(len(slack), np.inf), top, largest[changing]]),
            np.append(kinds, np.full(int(changing.sum()), -1)),
        )
