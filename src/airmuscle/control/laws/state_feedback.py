"""Laws from a model of the plant: linear state feedback with an observer, and computed torque of a
joint.
"""

from collections.abc import Mapping
from typing import ClassVar

from ...core import (
    ParameterError,
    Reference,
    Value,
    model,
    ops,
    parameter,
    published,
    select_prefix,
    with_prefix,
)
from ...core.errors import check_known
from ...engine.loop import (
    ControlLaw,
    Measurement,
    Memory,
    MultivariableController,
    Sampled,
    named_in,
)
from .open_loop import check_pair
from .pressures import AntagonisticInverse

FRANKLIN1998 = published("franklin-1998")


@model
class StateFeedback(MultivariableController, ControlLaw):
    """u_k = u_0 + N (r_k - z_0) - L x_k - L_I w_k,   x_k = x^-_k + K (y_k - y_0 - C x^-_k),   w' =
    z - r.

    x deviation of the states from the operating point, y measured columns, z controlled ones, r
    their set points. The prediction is x^-_(k+1) = A x_k + B (u_k - u_0) with the command as
    limited to the range of the inputs, which is the anti-windup of the observer; w_k is held while
    a command is limited. The observer starts at the first measurement. Some of the states may be
    disturbances that the observer estimates: then no integral action is needed, and `integral_gain`
    is empty. An empty `setpoint_gain` is 0. Matrices are given row by row; `design_lqg` and
    `design_adrc` of `airmuscle.control` design them. Reference: Franklin, Powell and Workman
    (1998), chapters 8 and 9.
    """

    references: ClassVar[tuple[Reference, ...]] = (FRANKLIN1998,)

    measured: tuple[str, ...]
    controlled: tuple[str, ...]
    commanded: tuple[str, ...]
    state_names: tuple[str, ...]
    transition: tuple[float, ...] = parameter(
        "SI", "A", "state matrix, discrete (n, n)", fitted=False
    )
    input_matrix: tuple[float, ...] = parameter(
        "SI", "B", "input matrix, discrete (n, m)", fitted=False
    )
    output_matrix: tuple[float, ...] = parameter(
        "SI", "C", "matrix of the measured columns (p, n)", fitted=False
    )
    observer_gain: tuple[float, ...] = parameter("SI", "K", "gain of the observer (n, p)")
    feedback_gain: tuple[float, ...] = parameter("SI", "L", "gain of the state feedback (m, n)")
    integral_gain: tuple[float, ...] = parameter(
        "SI", "L_I", "gain of the integral action (m, q); empty: none"
    )
    measured_offset: tuple[float, ...] = parameter(
        "SI", "y_0", "measured columns at the operating point", fitted=False
    )
    input_offset: tuple[float, ...] = parameter(
        "SI", "u_0", "inputs at the operating point", fitted=False
    )
    setpoint_gain: tuple[float, ...] = parameter(
        "SI", "N", "gain of the set points (m, q); empty: 0", default=()
    )

    def check(self) -> None:
        n, m, p, q = map(len, (self.state_names, self.commanded, self.measured, self.controlled))
        optional = {
            name: m * q for name in ("integral_gain", "setpoint_gain") if getattr(self, name)
        }
        sizes = {
            "transition": n * n,
            "input_matrix": n * m,
            "output_matrix": p * n,
            "observer_gain": n * p,
            "feedback_gain": m * n,
            "measured_offset": p,
            "input_offset": m,
            **optional,
        }
        for name, size in sizes.items():
            if len(getattr(self, name)) != size:
                raise ParameterError(
                    f"StateFeedback: {name} has {len(getattr(self, name))} numbers; for {n} states,"
                    f" {m} inputs, {p} measured and {q} controlled columns it must have {size}, row"
                    " by row."
                )
        check_known(
            "StateFeedback: no measured column is the controlled", self.controlled, self.measured
        )

    @property
    def initial_memory(self) -> dict[str, float]:
        """The predicted deviation of each state, `state.pressure`, and the integral of each
        controlled column.
        """
        states = with_prefix("state.", dict.fromkeys(self.state_names, 0.0))
        return {**states, **with_prefix("integral.", dict.fromkeys(self._integrated, 0.0))}

    @property
    def _integrated(self) -> tuple[str, ...]:
        """The controlled columns whose error is integrated."""
        return self.controlled if self.integral_gain else ()

    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        predicted = list(select_prefix("state.", memory).values())
        integrals = select_prefix("integral.", memory)
        deviations = zip(self.measured, self.measured_offset, strict=True)
        y = [measurement.columns[name] - offset for name, offset in deviations]
        innovation = [a - b for a, b in zip(y, product(self.output_matrix, predicted), strict=True)]
        x = [a + b for a, b in zip(predicted, product(self.observer_gain, innovation), strict=True)]
        by_state = product(self.feedback_gain, x)
        by_integral = product(self.integral_gain, list(integrals.values()), len(self.commanded))
        at = [self.measured_offset[self.measured.index(name)] for name in self.controlled]
        aims = [
            measurement.setpoints[name] - z for name, z in zip(self.controlled, at, strict=True)
        ]
        by_setpoint = product(
            self.setpoint_gain, aims if self.setpoint_gain else [], len(self.commanded)
        )
        parts = zip(
            self.commanded, self.input_offset, by_setpoint, by_state, by_integral, strict=True
        )
        wanted = {name: offset + n - a - b for name, offset, n, a, b in parts}
        commands = {
            name: ops.clip(value, *measurement.ranges[name]) for name, value in wanted.items()
        }
        limited = sum(
            (ops.absolute_value(commands[name] - value) for name, value in wanted.items()), 0.0
        )
        applied = [
            commands[name] - offset
            for name, offset in zip(self.commanded, self.input_offset, strict=True)
        ]
        by_input = product(self.input_matrix, applied, len(x))
        later = [a + b for a, b in zip(product(self.transition, x), by_input, strict=True)]
        errors = {
            name: measurement.columns[name] - measurement.setpoints[name]
            for name in self._integrated
        }
        kept = {
            name: w + ops.where(limited > 0.0, 0.0, dt * errors[name])
            for name, w in integrals.items()
        }
        states = dict(zip(self.state_names, later, strict=True))
        return commands, {**with_prefix("state.", states), **with_prefix("integral.", kept)}


def product(matrix: tuple[Value, ...], vector: list[Value], rows: int = 0) -> list[Value]:
    """Matrix, given row by row, times vector; `rows` is needed for an empty vector."""
    width = len(vector)
    rows = rows or len(matrix) // width
    return [
        sum((matrix[i * width + j] * vector[j] for j in range(width)), 0.0) for i in range(rows)
    ]


@model
class ComputedTorque(ControlLaw):
    """tau = tau_m(theta, omega, a),   a = a_r + 2 zeta w_0 (omega_r - omega) + w_0^2 (theta_r -
    theta).

    tau_m torque of the muscles for the acceleration a in the model, with weight, friction of the
    mechanism and the dampers of the muscles at the measured angle and speed; the pressures follow
    from the inverse for tau and for the wanted stiffness. Angle and stiffness are flat outputs of
    the joint: with them, speed and acceleration both pressures are given without integration. Where
    the model is exact and the pressures are reached at once, the error obeys e'' + 2 zeta w_0 e' +
    w_0^2 e = 0. The dynamics of the pressures are left to pressure regulators or to the inner law
    of a `Cascade`, whose bandwidth must exceed w_0: a delay T of the pressures leaves an error of
    about k omega T/(J w_0^2), k stiffness and J inertia of the joint. A damper that depends on the
    pressure is taken at the middle of the range. Set points: angle and speed by their names,
    `acceleration` and `stiffness`. References: Spong, Hutchinson and Vidyasagar (2020), chapter 9;
    Fliess et al. (1995).
    """

    references: ClassVar[tuple[Reference, ...]] = (
        published("spong-2020"),
        published("fliess-1995"),
    )

    inverse: AntagonisticInverse
    commanded: tuple[str, ...]
    frequency: float = parameter(
        "rad/s", "w_0", "natural frequency of the error", bounds=(0.0, 1e4)
    )
    damping_ratio: float = parameter(
        "1", "zeta", "damping ratio of the error (default chosen)", bounds=(0.0, 10.0), default=1.0
    )

    initial_memory: ClassVar[Mapping[str, float]] = {}

    def check(self) -> None:
        check_pair(self, self.commanded)

    measured_columns = named_in("inverse.coordinate", "_speed")
    signal_units: ClassVar[Mapping[str, str]] = {"acceleration": "rad/s2", "stiffness": "N m/rad"}

    @property
    def setpoints(self) -> tuple[str, ...]:
        return (self.inverse.coordinate, self._speed, "acceleration", "stiffness")

    @property
    def _speed(self) -> str:
        return self.inverse.mechanism.coordinates[0].speed

    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        wanted = measurement.setpoints
        columns = measurement.columns
        name = self.inverse.coordinate
        angle = columns[name]
        speed = columns[self._speed]
        acceleration = (
            wanted["acceleration"]
            + 2.0 * self.damping_ratio * self.frequency * (wanted[self._speed] - speed)
            + self.frequency**2 * (wanted[name] - angle)
        )
        pressures = self.inverse.pressures(
            angle, self.torque(angle, speed, acceleration), wanted["stiffness"]
        )
        return dict(zip(self.commanded, pressures, strict=True)), {}

    def torque(self, angle: Value, speed: Value, acceleration: Value) -> Value:
        """Static torque of the muscles [N m] for an acceleration [rad/s2] at an angle [rad] and a
        speed [rad/s].
        """
        inverse = self.inverse
        mechanism = self.inverse.mechanism
        name = self.inverse.coordinate
        q = {name: angle}
        lengths = [muscle.geometry.resting_length for muscle in inverse.muscles]
        contractions = mechanism.contractions(q, lengths)
        middle = 0.5 * (inverse.min_pressure + inverse.max_pressure)
        damping: Value = 0.0
        for i, (muscle, contraction) in enumerate(zip(inverse.muscles, contractions, strict=True)):
            unit = [1.0 if k == i else 0.0 for k in range(len(lengths))]
            arm = mechanism.generalised_forces(q, unit, lengths)[name]
            damping = damping + arm * muscle.damper.force(middle, contraction, arm * speed)
        return mechanism.driving_force(q, {self._speed: speed}, acceleration) + damping
