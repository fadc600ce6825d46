"""ComputedTorque: exact linearisation of an antagonistic joint by the pressures of its two muscles."""

from collections.abc import Mapping
from typing import ClassVar

from ...core import ParameterError, Reference, Value, model, parameter
from ...engine.loop import ControlLaw, Measurement, Memory, Sampled
from .angle_and_stiffness import AntagonisticInverse

SPONG2020 = Reference(
    key="spong-2020",
    authors="Spong, M. W., Hutchinson, S., Vidyasagar, M.",
    title="Robot Modeling and Control",
    where="2nd edition, Wiley, Hoboken, chapter 9",
    year=2020,
    note="inverse dynamics control (computed torque)",
)
FLIESS1995 = Reference(
    key="fliess-1995",
    authors="Fliess, M., Lévine, J., Martin, P., Rouchon, P.",
    title="Flatness and defect of non-linear systems: introductory theory and examples",
    where="International Journal of Control 61(6), 1327-1361",
    year=1995,
    doi="10.1080/00207179508921959",
    note="flat outputs",
)


@model
class ComputedTorque(ControlLaw):
    """tau = tau_m(theta, omega, a),   a = a_r + 2 zeta w_0 (omega_r - omega) + w_0^2 (theta_r - theta).

    tau_m torque of the muscles for the acceleration a in the model, with weight, friction of the mechanism and the
    dampers of the muscles at the measured angle and speed; the pressures follow from the inverse for tau and for the
    wanted stiffness. Angle and stiffness are flat outputs of the joint: with them, speed and acceleration both
    pressures are given without integration. Where the model is exact and the pressures are reached at once, the error
    obeys e'' + 2 zeta w_0 e' + w_0^2 e = 0. The dynamics of the pressures are left to pressure regulators or to the
    inner law of a `Cascade`, whose bandwidth must exceed w_0: a delay T of the pressures leaves an error of about
    k omega T/(J w_0^2), k stiffness and J inertia of the joint. A damper that depends on the pressure is taken at the
    middle of the range. Set points: angle and speed by their names, `acceleration` and `stiffness`.
    References: Spong, Hutchinson and Vidyasagar (2020), chapter 9; Fliess et al. (1995).
    """

    references: ClassVar[tuple[Reference, ...]] = (SPONG2020, FLIESS1995)

    inverse: AntagonisticInverse
    commanded: tuple[str, ...]
    frequency: float = parameter("rad/s", "w_0", "natural frequency of the error", bounds=(0.0, 1e4))
    damping_ratio: float = parameter(
        "1", "zeta", "damping ratio of the error (default chosen)", bounds=(0.0, 10.0), default=1.0
    )

    initial_memory: ClassVar[Mapping[str, float]] = {}

    def check(self) -> None:
        if len(self.commanded) != 2:
            raise ParameterError(
                f"ComputedTorque: {len(self.commanded)} commanded pressures; name two, such as ('left.pressure', "
                "'right.pressure')."
            )

    @property
    def measured_columns(self) -> tuple[str, ...]:
        return (self.inverse.coordinate, self._speed)

    @property
    def setpoints(self) -> tuple[str, ...]:
        return (self.inverse.coordinate, self._speed, "acceleration", "stiffness")

    @property
    def signal_units(self) -> dict[str, str]:
        return {"acceleration": "rad/s2", "stiffness": "N m/rad"}

    @property
    def inputs(self) -> tuple[str, ...]:
        return self.commanded

    @property
    def _speed(self) -> str:
        return self.inverse.mechanism.coordinates[0].speed

    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        wanted, columns, name = measurement.setpoints, measurement.columns, self.inverse.coordinate
        angle, speed = columns[name], columns[self._speed]
        acceleration = (
            wanted["acceleration"]
            + 2.0 * self.damping_ratio * self.frequency * (wanted[self._speed] - speed)
            + self.frequency**2 * (wanted[name] - angle)
        )
        torque = self.torque(angle, speed, acceleration)
        pressures = self.inverse.pressures(angle, torque, wanted["stiffness"])
        return dict(zip(self.commanded, pressures, strict=True)), {}

    def torque(self, angle: Value, speed: Value, acceleration: Value) -> Value:
        """Static torque of the muscles [N m] for an acceleration [rad/s2] at an angle [rad] and a speed [rad/s]."""
        inverse, mechanism, name = self.inverse, self.inverse.mechanism, self.inverse.coordinate
        q, v, inputs = {name: angle}, {self._speed: speed}, {each.name: 0.0 for each in mechanism.inputs}
        free, driven = (mechanism.acceleration(q, v, {name: torque}, inputs)[name] for torque in (0.0, 1.0))
        lengths = [muscle.geometry.resting_length for muscle in inverse.muscles]
        contractions, middle = mechanism.contractions(q, lengths), 0.5 * (inverse.min_pressure + inverse.max_pressure)
        damping: Value = 0.0
        for i, (muscle, contraction) in enumerate(zip(inverse.muscles, contractions, strict=True)):
            unit = [1.0 if k == i else 0.0 for k in range(len(lengths))]
            arm = mechanism.generalised_forces(q, unit, lengths)[name]
            damping = damping + arm * muscle.damper.force(middle, contraction, arm * speed)
        return (acceleration - free) / (driven - free) + damping
