"""Tuning rules of PID controllers, and the sets of gains that they start a search with."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import ClassVar, NamedTuple

import numpy as np

from ...control.laws.pid_and_sliding_mode import PID
from ...core import AirmuscleError, Array, ParameterError, Reference, check_field_types, published
from ...engine.loop import Schedule, WithDrivers, commands, range_of
from ...engine.run import Integrator, simulate
from . import (
    FirstOrderDeadTime,
    IntegratorDeadTime,
    UltimatePoint,
    first_order_of_step,
    integrator_of_step,
)
from .case import LoopCase
from .process_models import ProcessModel


@dataclasses.dataclass(frozen=True)
class RuleSettings:
    """Settings of a PID in standard form by a tuning rule: gain K [u/y], T_i [s], T_d [s] and
    set-point weight b.
    """

    rule: str
    gain: float
    integral_time: float
    derivative_time: float = 0.0
    setpoint_weight: float = 1.0
    references: ClassVar[tuple[Reference, ...]] = (
        published("skogestad-2003"),
        published("astrom-hagglund-2004"),
        published("ziegler-nichols-1942"),
        published("tyreus-luyben-1992"),
    )

    def __post_init__(self) -> None:
        check_field_types(self)


def ziegler_nichols(point: UltimatePoint, *, derivative: bool = True) -> RuleSettings:
    """Settings of a PID or PI controller from the ultimate point (Ziegler and Nichols 1942):

        K = 0.6 K_u,  T_i = T_u/2,  T_d = T_u/8      PID;        K = 0.45 K_u,  T_i = T_u/1.2
                      PI

    They aim at a decay of 1/4 for each period, and are the fastest and least damped of the rules.
    """
    if derivative:
        return RuleSettings(
            "Ziegler-Nichols PID", 0.6 * point.gain, point.period / 2, point.period / 8
        )
    return RuleSettings("Ziegler-Nichols PI", 0.45 * point.gain, point.period / 1.2)


def tyreus_luyben(point: UltimatePoint, *, derivative: bool = True) -> RuleSettings:
    """Settings of a PID or PI controller from the ultimate point (Tyreus and Luyben 1992):

        K = K_u/2.2,  T_i = 2.2 T_u,  T_d = T_u/6.3      PID;        K = K_u/3.2,  T_i = 2.2 T_u
                      PI

    They are slower and better damped than those of Ziegler and Nichols.
    """
    if derivative:
        return RuleSettings(
            "Tyreus-Luyben PID", point.gain / 2.2, 2.2 * point.period, point.period / 6.3
        )
    return RuleSettings("Tyreus-Luyben PI", point.gain / 3.2, 2.2 * point.period)


def simc(model: ProcessModel, closed_loop_time: float | None = None) -> RuleSettings:
    """SIMC settings of a PI controller (Skogestad 2003), with the closed-loop time constant T_c
    [s], L by default:

        K = T/(K_p (T_c + L)),    T_i = min(T, 4 (T_c + L))        first order
        K = 1/(K_v (T_c + L)),    T_i = 4 (T_c + L)                integrator

    Raises ParameterError for a model without dead time if no T_c is given, and for a T_c of 0 or
    less.
    """
    wanted = model.dead_time if closed_loop_time is None else closed_loop_time
    if not 0 < wanted < math.inf:
        raise ParameterError(
            f"simc: the closed-loop time constant is {wanted:g} s; it must be positive. State"
            " closed_loop_time for a model without dead time."
        )
    total = wanted + model.dead_time
    if isinstance(model, IntegratorDeadTime):
        return RuleSettings("SIMC PI", 1 / (model.rate * total), 4 * total)
    return RuleSettings(
        "SIMC PI", model.time_constant / (model.gain * total), min(model.time_constant, 4 * total)
    )


def amigo_pi(model: ProcessModel) -> RuleSettings:
    """AMIGO settings of a PI controller (Åström and Hägglund 2004):

        K = 0.15/K_p + (0.35 - L T/(L + T)^2) T/(K_p L),    T_i = 0.35 L + 13 L T^2/(T^2 + 12 L T +
                                                            7 L^2)
        K = 0.35/(K_v L),    T_i = 13.4 L                   integrator

    Raises ParameterError for a model without dead time.
    """
    dead = _dead_time(model)
    if isinstance(model, IntegratorDeadTime):
        return RuleSettings("AMIGO PI", 0.35 / (model.rate * dead), 13.4 * dead)
    gain = model.gain
    constant = model.time_constant
    proportional = 0.15 / gain + (0.35 - dead * constant / (dead + constant) ** 2) * constant / (
        gain * dead
    )
    integral = 0.35 * dead + 13 * dead * constant**2 / (
        constant**2 + 12 * dead * constant + 7 * dead**2
    )
    return RuleSettings("AMIGO PI", proportional, integral)


def amigo_pid(model: ProcessModel) -> RuleSettings:
    """AMIGO settings of a PID controller (Åström and Hägglund 2004):

        K = (0.2 + 0.45 T/L)/K_p,    T_i = (0.4 L + 0.8 T)/(L + 0.1 T) L,    T_d = 0.5 L T/(0.3 L +
                                     T)
        K = 0.45/(K_v L),    T_i = 8 L,    T_d = 0.5 L      integrator

    The set-point weight is 0 for L/(L + T) up to 0.5, otherwise 1. Raises ParameterError for a
    model without dead time.
    """
    dead = _dead_time(model)
    if isinstance(model, IntegratorDeadTime):
        return RuleSettings("AMIGO PID", 0.45 / (model.rate * dead), 8 * dead, 0.5 * dead, 0.0)
    gain = model.gain
    constant = model.time_constant
    return RuleSettings(
        "AMIGO PID",
        (0.2 + 0.45 * constant / dead) / gain,
        (0.4 * dead + 0.8 * constant) / (dead + 0.1 * constant) * dead,
        0.5 * dead * constant / (0.3 * dead + constant),
        0.0 if dead <= constant else 1.0,
    )


def _dead_time(model: ProcessModel) -> float:
    if not isinstance(model, FirstOrderDeadTime | IntegratorDeadTime) or not model.dead_time > 0:
        raise ParameterError(
            f"AMIGO: {model} has no dead time; the rule needs one. Use simc with closed_loop_time."
        )
    return model.dead_time


STEP = 0.1
"""Step of the command, as a share of its range (chosen)."""
ROWS = 400
"""Rows of the simulated experiment (chosen)."""


class StepExperiment(NamedTuple):
    """A simulated step of the command at time 0: times (N,) [s], measured column (N,), size of the
    step, its model.
    """

    time: Array
    output: Array
    step: float
    model: ProcessModel


def step_experiment(
    case: LoopCase,
    duration: float,
    *,
    step: float | None = None,
    integrator: Integrator | None = None,
) -> StepExperiment:
    """The response of the plant of a case to a step of the command of its PID, and the model that
    fits it best.

    step  size [u]; a tenth of the range of the command unless given

    The command before the step is `initial_output`. Half a sample time is added to the dead time of
    the model, the mean delay of a held command. Raises ParameterError for another controller,
    SimulationError if the run fails.
    """
    pid = case.controller
    if not isinstance(pid, PID):
        raise ParameterError(
            f"step_experiment: the controller is {type(pid).__name__}; rules are for a PID alone."
        )
    low, high = map(float, range_of(pid.commanded, case.loop.command_ranges(case.plant)))
    size = STEP * (high - low) if step is None else step
    value = pid.initial_output + size
    if not low <= value <= high:
        raise ParameterError(
            f"step_experiment: the command would be {value:g}; allowed range: {low:g} to {high:g}."
        )
    stepped = Schedule(
        {name: ((0.0, float(command)),) for name, command in commands(pid.commanded, value).items()}
    )
    run = simulate(
        case.plant,
        WithDrivers(stepped, case.loop.drivers),
        duration=duration,
        initial_state=case.start(),
        output_times=duration / ROWS,
        integrator=integrator,
    )
    time, first = np.unique(run["time"], return_index=True)
    output = run[pid.measured][first]
    models = list[tuple[float, ProcessModel]]()
    reasons = list[str]()
    for identify in (first_order_of_step, integrator_of_step):
        try:
            model = identify(time, output, size)
        except AirmuscleError as error:
            reasons.append(str(error))
        else:
            models.append(
                (float(np.sum((output[0] + size * model.step_response(time) - output) ** 2)), model)
            )
    if not models:
        raise ParameterError(f"step_experiment: {' '.join(reasons)}")
    best = min(models, key=lambda pair: pair[0])[1]  # with the smaller sum of squared residuals
    delayed = dataclasses.replace(best, dead_time=best.dead_time + case.loop.sample_time / 2)
    return StepExperiment(time, output, size, delayed)


def rule_settings(model: ProcessModel) -> tuple[RuleSettings, ...]:
    """The settings of all rules for a model: SIMC PI, AMIGO PI, AMIGO PID."""
    return simc(model), amigo_pi(model), amigo_pid(model)


def rule_starts(
    settings: Sequence[RuleSettings], bounds: Mapping[str, tuple[float, float]]
) -> tuple[dict[str, float], ...]:
    """The settings of rules as starts of a search: tuned gains and times other than 0, within their
    bounds.
    """
    starts = []
    for rule in settings:
        times = {"integral_time": rule.integral_time, "derivative_time": rule.derivative_time}
        gains = {"gain": rule.gain, **{name: time for name, time in times.items() if time > 0}}
        starts.append(
            {name: float(np.clip(gains[name], *bounds[name])) for name in gains if name in bounds}
        )
    return tuple(starts)
