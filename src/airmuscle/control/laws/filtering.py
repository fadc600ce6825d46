"""Laws around another one that filter its signals: by a notch, the model of a dead time, or that of
a period.
"""

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from ...core import (
    Parameter,
    ParameterError,
    Reference,
    Value,
    check_known,
    model,
    ops,
    parameter,
    published,
    within,
)
from ...core.system import select_prefix, with_prefix
from ...engine.loop import (
    Commanded,
    ControlLaw,
    EnclosingLaw,
    Measurement,
    Memory,
    Sampled,
    inputs_of,
    relative_unit,
)
from .enclosing import MAX_SAMPLES
from .state_feedback import FRANKLIN1998


@model
class WithFilter(EnclosingLaw):
    """y_f = F(s) y,  F = (b_2 s^2 + b_1 s + 1)/(a_2 s^2 + a_1 s + 1): the law receives y_f for a
    measured column y.

    b `numerator` (b_1, b_2) and a `denominator` (a_1, a_2) in [s] and [s^2]. F is made discrete by
    Tustin's rule, s = k (z - 1)/(z + 1), with k = 2/h, or so that F is exact at the frequency f_0
    [Hz] if that is not 0. It starts in the steady state of the first value. `notch` and `lead_lag`
    are the usual filters. Reference: Franklin, Powell and Workman (1998), chapter 6.
    """

    references: ClassVar[tuple[Reference, ...]] = (FRANKLIN1998,)

    law: ControlLaw
    column: str
    numerator: tuple[float, ...] = parameter(
        "SI", "b", "coefficients of s and s^2 above the line", fitted=False
    )
    denominator: tuple[float, ...] = parameter(
        "SI", "a", "coefficients of s and s^2 below the line", fitted=False
    )
    exact_frequency: float = parameter(
        "Hz",
        "f_0",
        "frequency at which the filter is exact; 0: none",
        bounds=(0.0, 1e6),
        fitted=False,
        default=0.0,
    )

    @classmethod
    def notch(
        cls,
        law: ControlLaw,
        column: str,
        frequency: float,
        *,
        depth: float = 0.1,
        damping: float = 0.5,
    ) -> "WithFilter":
        """A notch at a frequency [Hz], with the gain `depth` there and the damping ratio of its
        poles [1].
        """
        omega = 2.0 * math.pi * frequency
        poles = (2.0 * damping / omega, 1.0 / omega**2)
        return cls(law, column, (depth * poles[0], poles[1]), poles, frequency)

    @classmethod
    def lead_lag(
        cls, law: ControlLaw, column: str, lead_time: float, lag_time: float
    ) -> "WithFilter":
        """(T_1 s + 1)/(T_2 s + 1) with the lead time T_1 and the lag time T_2 [s]."""
        return cls(law, column, (lead_time, 0.0), (lag_time, 0.0))

    def check(self) -> None:
        check_known(
            "WithFilter: the law does not measure",
            self.column,
            self.law.measured_columns,
            "it measures",
        )
        if len(self.numerator) != 2 or len(self.denominator) != 2 or min(self.denominator) < 0:
            raise ParameterError(
                f"WithFilter: numerator {self.numerator} and denominator {self.denominator}; give"
                " two coefficients each, of s and s^2, those of the denominator from 0 on."
            )

    @property
    def initial_memory(self) -> dict[str, float]:
        """Whether it has started, two values of the filter, and the values of the law."""
        return {
            "started": 0.0,
            "first": 0.0,
            "second": 0.0,
            **with_prefix("law.", self.law.initial_memory),
        }

    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        x = measurement.columns[self.column]
        f = self.exact_frequency
        angle = ops.pi * ops.where(f > 0.0, f, 1.0) * dt
        k = ops.where(f > 0.0, 2.0 * ops.pi * f * ops.cos(angle) / ops.sin(angle), 2.0 / dt)
        (b0, b1, b2), (a0, a1, a2) = (
            _tustin(each, k) for each in (self.numerator, self.denominator)
        )
        started = memory["started"] > 0
        second = ops.where(started, memory["second"], (b2 - a2) * x)
        first = ops.where(started, memory["first"], (b1 - a1 + b2 - a2) * x)
        y = (b0 * x + first) / a0
        columns = {**measurement.columns, self.column: y}
        commands, law = self.law.step(
            select_prefix("law.", memory), measurement._replace(columns=columns), dt
        )
        own = {"started": 1.0, "first": b1 * x - a1 * y + second, "second": b2 * x - a2 * y}
        return commands, {**own, **with_prefix("law.", law)}


def _tustin(coefficients: tuple[Value, ...], k: Value) -> tuple[Value, Value, Value]:
    """Coefficients of 1, z^-1 and z^-2 of c_2 s^2 + c_1 s + 1, times (1 + z^-1)^2."""
    first = coefficients[0] * k
    second = coefficients[1] * k * k
    return second + first + 1.0, 2.0 - 2.0 * second, second - first + 1.0


@model
class SmithPredictor(EnclosingLaw):
    """u = law(y_k + x_k - x_(k-n)),   x_(k+1) = a x_k + (1 - a) K u_k,   a = exp(-h/T): feedback
    without the dead time.

    y measured column, x response of the model K/(1 + T s) without the dead time of n samples, u the
    command of the law, of two inputs in split range positive less negative. Where the model is
    right, the response is that of the law without dead time, n samples later. The plant must be
    stable: the error of an integrating one does not vanish after a disturbance. The model starts at
    rest with the command that the law gives without an error, such as the initial output of a PID.
    Reference: Smith (1957).
    """

    references: ClassVar[tuple[Reference, ...]] = (published("smith-1957"),)

    law: ControlLaw
    column: str
    commanded: Commanded
    samples: int = within(0, MAX_SAMPLES)
    static_gain: float = parameter(
        "y/u", "K", "change of the column by the command", bounds=(-1e12, 1e12)
    )
    time_constant: float = parameter("s", "T", "time constant of the model", bounds=(1e-6, 1e6))

    def check(self) -> None:
        check_known(
            "SmithPredictor: the law does not measure",
            self.column,
            self.law.measured_columns,
            "it measures",
        )
        if set(inputs_of(self.commanded)) != set(self.law.inputs):
            raise ParameterError(
                f"SmithPredictor: the model has the inputs {', '.join(inputs_of(self.commanded))};"
                f" the law commands {', '.join(self.law.inputs)}. Name the inputs of the law."
            )

    def unit_of(self, declared: Parameter, index: int, units: Mapping[str, str]) -> str:
        """The unit of the gain: that of the column over that of the command."""
        if declared.name != "static_gain":
            return declared.unit
        return relative_unit(
            "u/y", units[inputs_of(self.commanded)[0]] or "1", units[self.column] or "1"
        )

    @property
    def initial_memory(self) -> dict[str, float]:
        """Whether it has started (0 or 1), the response of the model now and up to n samples ago
        (the newest first), and the values of the law.
        """
        response = {f"response{age}": 0.0 for age in range(self.samples + 1)}
        return {"started": 0.0, **response, **with_prefix("law.", self.law.initial_memory)}

    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        inner = select_prefix("law.", memory)
        resting = self._output(self.law.commands_at_rest(inner, measurement, dt))
        past = [
            ops.where(memory["started"] > 0, memory[f"response{age}"], self.static_gain * resting)
            for age in range(self.samples + 1)
        ]
        now = past[0]
        columns = {
            **measurement.columns,
            self.column: measurement.columns[self.column] + now - past[-1],
        }
        commands, law = self.law.step(inner, measurement._replace(columns=columns), dt)
        applied = self._output(
            {name: ops.clip(commands[name], *measurement.ranges[name]) for name in commands}
        )
        kept = ops.exp(-dt / self.time_constant)
        later = {f"response{age + 1}": value for age, value in enumerate(past[:-1])}
        response = {"response0": kept * now + (1.0 - kept) * self.static_gain * applied}
        own = {"started": 1.0, **response, **later}
        return commands, {**own, **with_prefix("law.", law)}

    def _output(self, commands: Mapping[str, Value]) -> Value:
        """The input of the model: of two inputs in split range positive less negative."""
        positive, *negative = inputs_of(self.commanded)
        return commands[positive] - sum(commands[name] for name in negative)


@model
class RepetitiveControl(EnclosingLaw):
    """law(y, r + w),   w_k = Q (w_(k-N) + k_r e_(k-N+m)),   e = r - y,   Q = 1 - 2 q + q (z + 1/z):
    periodic motion.

    N `period_samples`, m `lead_samples`, k_r `gain`, r set point and y measured column of one name.
    Q is a low-pass filter without phase shift: its gain 1 - 2 q (1 - cos(omega h)) falls to 1 - 4 q
    at the Nyquist frequency. For a stable loop from the set point to y with the response T the
    error converges from period to period if
    |Q (1 - k_r z^m T)| < 1 at all frequencies: `convergence_rate` computes the greatest value. Where Q = 1 no error is
    left at the multiples of 1/(N h). While the inputs are limited the signal still learns.
    References: Hara et al. (1988); Tomizuka, Tsao and Chew (1989).
    """  # noqa: E501

    references: ClassVar[tuple[Reference, ...]] = (
        published("hara-1988"),
        published("tomizuka-1989"),
    )

    law: ControlLaw
    column: str
    period_samples: int
    lead_samples: int = 0
    gain: float = parameter(
        "1", "k_r", "part of the error that is learnt", bounds=(0.0, 10.0), default=0.5
    )
    filter_weight: float = parameter(
        "1", "q", "weight of both neighbours in Q", bounds=(0.0, 0.25), default=0.1
    )

    def check(self) -> None:
        if not (
            4 <= self.period_samples <= MAX_SAMPLES
            and 0 <= self.lead_samples <= self.period_samples - 2
        ):
            raise ParameterError(
                f"RepetitiveControl: period and lead are {self.period_samples} and"
                f" {self.lead_samples} samples; allowed range: a period of 4 to {MAX_SAMPLES}, a"
                " lead from 0 to two less than that."
            )
        check_known(
            "RepetitiveControl: the law does not measure",
            self.column,
            self.law.measured_columns,
            "it measures",
        )
        check_known("RepetitiveControl: the law has no set point", self.column, self.law.setpoints)

    @property
    def initial_memory(self) -> dict[str, float]:
        """Signal and error up to N + 1 samples ago (the newest first), and the values of the
        law.
        """
        past = {
            f"{kind}{age}": 0.0
            for kind in ("signal", "error")
            for age in range(1, self.period_samples + 2)
        }
        return {**past, **with_prefix("law.", self.law.initial_memory)}

    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        wanted = measurement.setpoints[self.column]
        error = wanted - measurement.columns[self.column]
        errors = {
            0: error,
            **{age: memory[f"error{age}"] for age in range(1, self.period_samples + 2)},
        }
        ages = (self.period_samples + 1, self.period_samples, self.period_samples - 1)
        older, middle, newer = (
            memory[f"signal{age}"] + self.gain * errors[age - self.lead_samples] for age in ages
        )
        signal = (1.0 - 2.0 * self.filter_weight) * middle + self.filter_weight * (older + newer)
        setpoints = {**measurement.setpoints, self.column: wanted + signal}
        commands, law = self.law.step(
            select_prefix("law.", memory), measurement._replace(setpoints=setpoints), dt
        )
        later = {"signal1": signal, "error1": error}
        for kind in ("signal", "error"):
            later |= {
                f"{kind}{age + 1}": memory[f"{kind}{age}"]
                for age in range(1, self.period_samples + 1)
            }
        return commands, {**later, **with_prefix("law.", law)}

    def convergence_rate(self, linear_loop: Any) -> float:
        """The greatest |Q (1 - k_r z^m T)| up to the Nyquist frequency [1]; below 1 the error
        converges.

        linear_loop  of the enclosed `law` at the working point, with the same sample time

        Raises ParameterError where that loop is not stable, and where its law is periodic.
        """
        if len(linear_loop.laws) > 1:
            raise ParameterError(
                f"RepetitiveControl: the law of this loop has a period of {len(linear_loop.laws)}"
                " samples, its response is not that of one sample. Put RepetitiveControl inside"
                " Multirate, and linearise its law alone at that sample time."
            )
        if not linear_loop.is_stable:
            raise ParameterError(
                "RepetitiveControl: the loop of the law is not stable, its pole of the greatest"
                f" magnitude is {linear_loop.poles[0]:.4g}. Stabilise it first; repetitive control"
                " needs a stable loop."
            )
        closed = linear_loop.closed
        omega = np.linspace(0.0, math.pi, 4001)[1:]  # their number is chosen
        response = closed.frequency_response(omega / (2.0 * math.pi * linear_loop.sample_time))
        t = response[:, closed.outputs.index(self.column), closed.inputs.index(self.column)]
        q = 1.0 - 2.0 * self.filter_weight * (1.0 - np.cos(omega))
        return float(
            np.abs(q * (1.0 - self.gain * np.exp(1j * self.lead_samples * omega) * t)).max()
        )
