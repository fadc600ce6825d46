"""Design of linear model predictive control for a linearised plant."""

import functools
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from ...core import Array, Parameter, ParameterError, Reference, model, parameter
from ...engine.loop.controller import Measurement, MultivariableController, relative_unit
from ...physics.analysis.linear_model import LinearModel, linearise
from ...physics.equilibrium import nearest_equilibrium
from ...physics.plant.plant import Plant
from ..laws import CHISCI2001, RAWLINGS2017, LinearLaw, LinearModelPredictive
from ..laws.linear_model_predictive import (
    CondensedProblem,
    ObservedModel,
    PredictiveDesign,
    PredictiveMemory,
)
from .lqg_and_adrc import (
    DISTURBANCE,
    check_numbers,
    check_sample_time,
    checked_scale,
    disturbance_observer,
    regulator,
    sampled_plant,
    steady_target,
)
from .predictive_program import MAX_HORIZON, check_limits

SLACK_WEIGHT = 1e4
"""Weight of the slack of a limited column, relative to the permitted deviation of 1 (chosen)."""


def design_predictive(
    model: LinearModel,
    sample_time: float,
    *,
    measured: Sequence[str],
    controlled: Sequence[str],
    disturbed: Sequence[str],
    permitted: Mapping[str, float],
    process_noise: Mapping[str, float],
    measurement_noise: Mapping[str, float],
    horizon: int = 20,
    limits: Mapping[str, tuple[float, float]] | None = None,
    slack_weight: float = SLACK_WEIGHT,
    blocks: Sequence[int] = (),
    max_rate: Mapping[str, float] | None = None,
    bounded: Mapping[str, float] | None = None,
) -> LinearModelPredictive:
    """Model predictive control of a linearised plant, at a sample time [s] with a horizon of
    samples.

    measured, controlled    columns that the observer uses, and those with a set point; controlled
                            ones are measured
    disturbed               states to whose rate an unknown disturbance is added: as many as
                            measured columns
    permitted               maximum permitted deviation of states and inputs, for Bryson's rule:
                            weight 1/d^2; every input needs one, a state without one has the weight
                            0
    process_noise           standard deviation of states after 1 s of noise, also of disturbances
                            ("speed.disturbance")
    measurement_noise       standard deviation of every measured column
    limits                  minimum and maximum of columns without direct feedthrough, such as
                            {"pressure": (0, 5e5)}
    slack_weight            weight of the squared violation of a limit relative to the size of its
                            range; infinity makes the limits hard
    blocks                  numbers of samples over which the planned inputs are held, one after the
                            other (move blocking); together the horizon, which is their sum where
                            they are given
    max_rate                maximum rate of inputs, in their units over 1 s
    bounded                 greatest size of a disturbance of the rates of states, any value at each
                            sample: all limits are narrowed by what it reaches under the regulator
                            until then, so that a plan that keeps them is followed by another one.
                            Errors of the observer and a terminal set are left out

    Plant and disturbances are discretised exactly for held inputs. Raises ParameterError for an
    unknown name, a number that is not positive, set points that the inputs cannot keep, columns
    that do not detect the disturbances, or bounded disturbances that leave no room within a limit.
    References: Rawlings, Mayne and Diehl (2017), chapters 1, 2 and 8; Chisci, Rossiter and Zappa
    (2001).
    """
    where = "design_predictive"
    limits = limits or {}
    max_rate = max_rate or {}
    bounded = bounded or {}
    states = model.states
    blocks = tuple(blocks) or (1,) * horizon
    check_limits(where, limits, slack_weight)
    _check(measured, disturbed, blocks)
    names, scale = checked_scale(
        where,
        model,
        {"measured": measured, "controlled": controlled, "limits": tuple(limits)},
        disturbed,
        permitted,
        (process_noise, measurement_noise),
    )
    check_numbers(where, "max_rate", max_rate, model.inputs, ())
    check_numbers(where, "bounded", bounded, states, ())
    sizes = np.array([permitted[name] for name in model.inputs])
    a, b, by_disturbance = sampled_plant(model, sample_time, scale, sizes, disturbed)
    c, z, limited = (
        model.select(outputs=list(part)).C * scale for part in (measured, controlled, limits)
    )
    weights = np.diag(
        [
            (s / permitted[i]) ** 2 if i in permitted else 0.0
            for i, s in zip(states, scale, strict=True)
        ]
    )
    costs = np.eye(sizes.size)
    gain, terminal = regulator(where, a, b, weights, costs)
    noise = np.array([process_noise.get(i, 0.0) for i in names]) / np.append(
        scale, np.ones(len(disturbed))
    )
    deviations = np.array([measurement_noise[name] for name in measured])
    at = [
        np.array([model.output_values[name] for name in part])
        for part in (measured, controlled, limits)
    ]
    ranges = np.array([high - low for low, high in limits.values()])
    columns = limited / ranges[:, None]
    entering = sampled_plant(model, sample_time, scale, sizes, tuple(bounded))[2] * list(
        bounded.values()
    )
    reach = _reach(limits, a - b @ gain, entering, gain, columns, sum(blocks))
    change = sample_time * np.array([max_rate.get(name, np.inf) for name in model.inputs]) / sizes
    problem = condense(
        (a, b), weights, costs, terminal, columns, slack_weight, blocks, change, reach
    )
    ends = [(np.array([pair[i] for pair in limits.values()]) - at[2]) / ranges for i in (0, 1)]
    observed = ObservedModel(
        *disturbance_observer(
            where, (a, b, by_disturbance, c), np.diag(noise**2) * sample_time, deviations
        ),
        at[0],
        np.array([model.input_values[name] for name in model.inputs]),
        sizes,
        *steady_target(where, a, b, by_disturbance, z),
        at[1],
        columns,
        *ends,
    )
    design = PredictiveDesign(
        sample_time,
        blocks,
        dict(model.state),
        dict(model.input_values),
        tuple(disturbed),
        dict(permitted),
        dict(process_noise),
        dict(measurement_noise),
        dict(limits),
        dict(max_rate),
        dict(bounded),
        slack_weight,
    )
    return LinearModelPredictive(
        tuple(measured), tuple(controlled), model.inputs, observed, problem, design
    )


@model
class PredictiveControl(MultivariableController):
    """Linear model predictive control as declared: `law` is what `design_predictive` designs from
    these numbers.

    The plant is linearised at the equilibrium at `pressures`, with the commanded inputs
    `operating_inputs` and 0 for the others. Numbers are in the order of the names to which they
    belong: `permitted` of the states and inputs `weighted`, `process_noise` of the states and
    disturbances `noisy` ("speed.disturbance"), the limits of the columns `limited`, `bounds` of the
    disturbances of the rates of the states `bounded`; they are those of `design_predictive`. In a
    file, plant and sample time are those of the scenario.
    """

    references: ClassVar[tuple[Reference, ...]] = (RAWLINGS2017, CHISCI2001)
    named: ClassVar[Mapping[str, str]] = {
        "operating_inputs": "commanded",
        "permitted": "weighted",
        "process_noise": "noisy",
        "measurement_noise": "measured",
        "minimum": "limited",
        "maximum": "limited",
        "max_rate": "commanded",
        "bounds": "bounded",
    }

    plant: Plant
    measured: tuple[str, ...]
    controlled: tuple[str, ...]
    commanded: tuple[str, ...]
    disturbed: tuple[str, ...]
    weighted: tuple[str, ...]
    noisy: tuple[str, ...]
    pressures: tuple[float, ...] = parameter(
        "Pa", "p_0", "gauge pressure of each muscle there", fitted=False
    )
    operating_inputs: tuple[float, ...] = parameter(
        "SI", "u_0", "commanded inputs there", fitted=False
    )
    permitted: tuple[float, ...] = parameter("SI", "d", "permitted deviations of states and inputs")
    process_noise: tuple[float, ...] = parameter(
        "SI", "q", "standard deviations after 1 s of noise"
    )
    measurement_noise: tuple[float, ...] = parameter(
        "SI", "r", "standard deviations of the measured columns"
    )
    sample_time: float = parameter("s", "h", "sample time", bounds=(1e-6, 10.0), fitted=False)
    limited: tuple[str, ...] = ()
    bounded: tuple[str, ...] = ()
    minimum: tuple[float, ...] = parameter("SI", "z_min", "lower limits of columns", default=())
    maximum: tuple[float, ...] = parameter("SI", "z_max", "upper limits of columns", default=())
    max_rate: tuple[float, ...] = parameter(
        "SI", "R", "maximum rate of each input; empty: no limit", default=()
    )
    bounds: tuple[float, ...] = parameter("SI", "w", "greatest disturbances of rates", default=())
    slack_weight: float = parameter(
        "1", "rho", "weight of a violated limit", bounds=(1e-6, 1e12), default=SLACK_WEIGHT
    )
    horizon: int = 20
    blocks: tuple[int, ...] = ()

    def check(self) -> None:
        for name in self.named:
            self._names(name, len(getattr(self, name)))
        assert self.law

    def _names(self, numbers: str, count: int) -> tuple[str, ...]:
        """The names to which so many numbers belong. Raises ParameterError where there is not one
        for each.
        """
        names: tuple[str, ...] = getattr(self, self.named[numbers])
        if count != len(names) and (count or numbers != "max_rate"):
            raise ParameterError(
                f"PredictiveControl: {numbers} has {count} numbers; it must have {len(names)}, one"
                f" for each of '{self.named[numbers]}': {', '.join(names) or 'none'}."
            )
        return names

    @functools.cached_property
    def law(self) -> LinearModelPredictive:
        """The designed law."""
        numbers: dict[str, Any] = {
            name: dict(zip(getattr(self, names), getattr(self, name), strict=False))
            for name, names in self.named.items()
        }
        lower = numbers["minimum"]
        upper = numbers["maximum"]
        state = nearest_equilibrium(
            self.plant, pressure=self.pressures, inputs=numbers["operating_inputs"]
        )
        linear = linearise(self.plant, state, numbers["operating_inputs"]).select(
            inputs=self.commanded
        )
        return design_predictive(
            linear,
            self.sample_time,
            measured=self.measured,
            controlled=self.controlled,
            disturbed=self.disturbed,
            limits={name: (lower[name], upper[name]) for name in self.limited},
            horizon=self.horizon,
            blocks=self.blocks,
            slack_weight=self.slack_weight,
            bounded=numbers["bounds"],
            **{
                name: numbers[name]
                for name in ("permitted", "process_noise", "measurement_noise", "max_rate")
            },
        )

    def unit_of(self, declared: Parameter, index: int, units: Mapping[str, str]) -> str:
        if declared.unit != "SI":
            return declared.unit
        names = getattr(self, self.named[declared.name])
        name = names[index] if index < len(names) else self._names(declared.name, index + 1)[0]
        unit = units[name.removesuffix(DISTURBANCE)] or "1"
        rate = declared.name in ("max_rate", "bounds") or name.endswith(DISTURBANCE)
        return relative_unit("u/s", "", unit) if rate else unit

    def linear_law(self) -> LinearLaw:
        """The designed law while no limit acts."""
        return self.law.linear_law()

    def init(self) -> PredictiveMemory:
        return self.law.init()

    def notes(self, memory: PredictiveMemory) -> tuple[str, ...]:
        return self.law.notes(memory)

    def step(
        self, memory: PredictiveMemory, measurement: Measurement, dt: float
    ) -> tuple[Mapping[str, float], PredictiveMemory]:
        check_sample_time("PredictiveControl", dt, self.sample_time)
        return self.law.step(memory, measurement, dt)


def _check(measured: Sequence[str], disturbed: Sequence[str], blocks: Sequence[int]) -> None:
    """Raise ParameterError for a number of disturbances, or samples of a horizon, that make no
    problem.
    """
    if len(disturbed) != len(measured):
        raise ParameterError(
            f"design_predictive: {len(disturbed)} states are disturbed and {len(measured)} columns"
            " measured; there must be as many, so that no offset remains."
        )
    if not (1 <= sum(blocks) <= MAX_HORIZON and min(blocks) >= 1):
        raise ParameterError(
            f"design_predictive: horizon is {sum(blocks)}; allowed range: 1 to {MAX_HORIZON}"
            " samples, and blocks of one or more."
        )


def _reach(
    limits: Mapping[str, tuple[float, float]],
    closed: Array,
    entering: Array,
    gain: Array,
    columns: Array,
    horizon: int,
) -> tuple[Array, Array]:
    """How far disturbances move the inputs (N, m) and, one sample later, the columns (N, l) under
    the regulator.
    """
    inputs = [np.zeros(len(gain))]
    limited = list[Array]()
    moved = entering
    for _ in range(horizon):
        limited.append((limited[-1] if limited else 0.0) + np.abs(columns @ moved).sum(axis=1))
        inputs.append(inputs[-1] + np.abs(gain @ moved).sum(axis=1))
        moved = closed @ moved
    for (name, (low, high)), part in zip(limits.items(), limited[-1], strict=True):
        if part >= 0.5:
            raise ParameterError(
                f"design_predictive: the bounded disturbances move '{name}' by"
                f" {part * (high - low):.4g} within the horizon, which leaves no room within its"
                f" limits {low:g} and {high:g}. Widen them, or shorten the horizon."
            )
    return np.array(inputs[:-1]), np.array(limited).reshape(horizon, len(columns))


def condense(
    sampled: tuple[Array, Array],
    weights: Array,
    costs: Array,
    terminal: Array,
    columns: Array,
    slack_weight: float,
    blocks: Sequence[int],
    max_change: Array,
    reach: tuple[Array, Array],
) -> CondensedProblem:
    """The problem of x_(k+1) = a x_k + b v_k with the cost sum x^T W x + v^T R v, and the terminal
    cost x_N^T P x_N.

    columns (l, n) are limited at every sample from the next one on; their slack s costs
    slack_weight s^2, and there is none where slack_weight is infinite. blocks: numbers of samples
    over which the inputs are held, one after the other. reach: of disturbances in the inputs (N, m)
    and in the columns (N, l), by which their limits are narrower. Reference: Rawlings, Mayne and
    Diehl (2017), chapter 8.
    """
    a, b = sampled
    n, m = b.shape
    horizon = sum(blocks)
    powers = [np.eye(n)]
    for _ in range(horizon):
        powers.append(a @ powers[-1])
    forced = np.zeros((horizon, n, horizon, m))
    for k in range(horizon):
        for j in range(k + 1):
            forced[k, :, j] = powers[k - j] @ b
    moves = np.asarray(
        np.kron(np.repeat(np.eye(len(blocks)), blocks, axis=0), np.eye(m)), dtype=float
    )
    by_input = forced.reshape(horizon * n, horizon * m) @ moves
    by_state = np.concatenate(powers[1:])
    each = np.kron(np.eye(horizon), weights)
    each[-n:, -n:] = terminal
    soft = len(columns) if np.isfinite(slack_weight) else 0
    count = moves.shape[1]
    hessian = np.zeros((count + soft, count + soft))
    gradient = np.zeros((count + soft, n))
    inner = by_input.T @ each @ by_input + moves.T @ np.kron(np.eye(horizon), costs) @ moves
    hessian[:count, :count] = inner + inner.T
    gradient[:count] = 2.0 * by_input.T @ each @ by_state
    hessian[range(count, count + soft), range(count, count + soft)] = (
        2.0 * slack_weight if soft else 0.0
    )
    limited = np.kron(np.eye(horizon), columns)
    rows = np.hstack([limited @ by_input, np.zeros((len(limited), soft))])
    upper = rows.copy()
    lower = rows.copy()
    index = np.tile(np.arange(len(columns)), horizon)
    if soft:
        upper[np.arange(len(rows)), count + index] = -1.0
        lower[np.arange(len(rows)), count + index] = 1.0
    ahead = limited @ by_state
    last = np.cumsum(blocks) - 1
    return CondensedProblem(
        horizon,
        m,
        soft,
        hessian,
        gradient,
        moves,
        np.vstack([upper, lower]),
        np.vstack([ahead, ahead]),
        np.concatenate([index, index]),
        np.arange(2 * len(rows)) < len(rows),
        (reach[0][last].ravel(), np.tile(reach[1].ravel(), 2)),
        max_change,
    )
