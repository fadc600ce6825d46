"""Tuning rules: SIMC and AMIGO settings of PI and PID controllers from a process model."""

from __future__ import annotations

import dataclasses
import math
from typing import ClassVar

from ...core.annotation import check_field_types
from ...core.errors import ParameterError
from ...core.reference import Reference
from .process_models import FirstOrderDeadTime, IntegratorDeadTime, ProcessModel

SKOGESTAD2003 = Reference(
    key="skogestad-2003",
    authors="Skogestad, S.",
    title="Simple analytic rules for model reduction and PID controller tuning",
    where="Journal of Process Control 13, 291-309",
    year=2003,
    note="SIMC rules; formulas as quoted in the later literature",
)
ASTROM_HAGGLUND2004 = Reference(
    key="astrom-hagglund-2004",
    authors="Åström, K. J., Hägglund, T.",
    title="Revisiting the Ziegler–Nichols step response method for PID control",
    where="Journal of Process Control 14, 635-650",
    year=2004,
    note="AMIGO rules; formulas as quoted in the later literature",
)


@dataclasses.dataclass(frozen=True)
class RuleSettings:
    """Settings of a PID in standard form by a tuning rule: gain K [u/y], T_i [s], T_d [s] and set-point weight b."""

    rule: str
    gain: float
    integral_time: float
    derivative_time: float = 0.0
    setpoint_weight: float = 1.0
    references: ClassVar[tuple[Reference, ...]] = (SKOGESTAD2003, ASTROM_HAGGLUND2004)

    def __post_init__(self) -> None:
        check_field_types(self)

    @property
    def as_gains(self) -> dict[str, float]:
        """Gain, integral and derivative time under the names of the parameters of PID; without a time that is 0."""
        named = {"gain": self.gain, "integral_time": self.integral_time, "derivative_time": self.derivative_time}
        return {name: value for name, value in named.items() if name == "gain" or value > 0}


def simc(model: ProcessModel, closed_loop_time: float | None = None) -> RuleSettings:
    """SIMC settings of a PI controller (Skogestad 2003), with the closed-loop time constant T_c [s], L by default:

        K = T/(K_p (T_c + L)),    T_i = min(T, 4 (T_c + L))        first order
        K = 1/(K_v (T_c + L)),    T_i = 4 (T_c + L)                integrator

    Raises ParameterError for a model without dead time if no T_c is given, and for a T_c of 0 or less.
    """
    wanted = model.dead_time if closed_loop_time is None else closed_loop_time
    if not 0 < wanted < math.inf:
        raise ParameterError(
            f"simc: the closed-loop time constant is {wanted:g} s; it must be positive. State closed_loop_time for a "
            "model without dead time."
        )
    total = wanted + model.dead_time
    if isinstance(model, IntegratorDeadTime):
        return RuleSettings("SIMC PI", 1 / (model.rate * total), 4 * total)
    return RuleSettings("SIMC PI", model.time_constant / (model.gain * total), min(model.time_constant, 4 * total))


def amigo_pi(model: ProcessModel) -> RuleSettings:
    """AMIGO settings of a PI controller (Åström and Hägglund 2004):

        K = 0.15/K_p + (0.35 - L T/(L + T)^2) T/(K_p L),    T_i = 0.35 L + 13 L T^2/(T^2 + 12 L T + 7 L^2)
        K = 0.35/(K_v L),    T_i = 13.4 L                   integrator

    Raises ParameterError for a model without dead time.
    """
    dead = _dead_time(model)
    if isinstance(model, IntegratorDeadTime):
        return RuleSettings("AMIGO PI", 0.35 / (model.rate * dead), 13.4 * dead)
    gain, constant = model.gain, model.time_constant
    proportional = 0.15 / gain + (0.35 - dead * constant / (dead + constant) ** 2) * constant / (gain * dead)
    integral = 0.35 * dead + 13 * dead * constant**2 / (constant**2 + 12 * dead * constant + 7 * dead**2)
    return RuleSettings("AMIGO PI", proportional, integral)


def amigo_pid(model: ProcessModel) -> RuleSettings:
    """AMIGO settings of a PID controller (Åström and Hägglund 2004):

        K = (0.2 + 0.45 T/L)/K_p,    T_i = (0.4 L + 0.8 T)/(L + 0.1 T) L,    T_d = 0.5 L T/(0.3 L + T)
        K = 0.45/(K_v L),    T_i = 8 L,    T_d = 0.5 L      integrator

    The set-point weight is 0 for L/(L + T) up to 0.5, otherwise 1. Raises ParameterError for a model without dead time.
    """
    dead = _dead_time(model)
    if isinstance(model, IntegratorDeadTime):
        return RuleSettings("AMIGO PID", 0.45 / (model.rate * dead), 8 * dead, 0.5 * dead, 0.0)
    gain, constant = model.gain, model.time_constant
    return RuleSettings(
        "AMIGO PID",
        (0.2 + 0.45 * constant / dead) / gain,
        (0.4 * dead + 0.8 * constant) / (dead + 0.1 * constant) * dead,
        0.5 * dead * constant / (0.3 * dead + constant),
        0.0 if dead <= constant else 1.0,
    )


def _dead_time(model: ProcessModel) -> float:
    if not isinstance(model, FirstOrderDeadTime | IntegratorDeadTime) or not model.dead_time > 0:
        raise ParameterError(f"AMIGO: {model} has no dead time; the rule needs one. Use simc with closed_loop_time.")
    return model.dead_time
