"""Contenders of the control benchmark: control laws with the ranges of their gains, and the standard ones."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import NamedTuple

from ...control.laws.angle_and_stiffness import AngleAndStiffness
from ...control.laws.antagonistic_inverse import AntagonisticInverse
from ...control.laws.cascade import Cascade
from ...control.laws.co_contraction import DIFFERENCE, CoContraction
from ...control.laws.friction_feed_forward import FrictionFeedForward
from ...control.laws.motion_feed_forward import MotionFeedForward
from ...control.laws.pid import PID
from ...control.laws.proportional_feedback import ProportionalFeedback
from ...control.laws.setpoint_command import SetpointCommand
from ...control.laws.setpoint_delay import WithSetpointDelay
from ...control.laws.setpoint_lead import SetpointLead
from ...control.laws.sliding_mode import SlidingMode
from ...control.laws.super_twisting import SuperTwisting
from ...control.laws.with_feed_forward import WithFeedForward
from ...core.annotation import check_field_types, one_line
from ...core.errors import ParameterError
from ...core.tree import leaves
from ...engine.loop.control_law import ControlLaw, SigmaDelta, SplitRange
from ...engine.loop.controller import Controller
from ...engine.loop.sensors import WithSensors
from .called_contender import COMMANDED, SensedController, sensed
from .designed_controllers import AlongMotion, DeviationLaw, PredictiveDesign, QuadraticDesign, joint_design_model
from .joints import SIDES, BenchmarkJoint

BAR = 1e5
Bounds = Mapping[str, tuple[float, float]]
PRESSURE_GAIN, ZONE = (1.0 / BAR, 60.0 / BAR), (0.005 * BAR, 0.2 * BAR)
"""Ranges of the gain and of the dead zone of the inner pressure control (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False)
class Contender:
    """A controller that takes part in the benchmark.

    name     for tables
    law      a ControlLaw, which is compiled with the plant, or another Controller, which is called at each sample. It
             commands half the pressure difference (`difference`), both pressures (`left.pressure`,
             `right.pressure`) or the valves. It may measure the angle, the angular speed and both pressures. Its set
             points are names of
             TaskSignals: `angle`, `angular_speed`, `angular_acceleration`, `mean_pressure`, `stiffness`,
             `feed_forward`, `feed_forward_rate`
    bounds   minimum and maximum [SI] of the gains of the law that are tuned, by path. Without bounds, and with a law
             that commands the valves, nothing is tuned
    identified  minimum and maximum [SI] of gains that are identified after the tuning, by runs on the truth with its
             sensors; none unless given
    """

    name: str
    law: Controller
    bounds: Bounds = dataclasses.field(default_factory=dict)
    identified: Bounds = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        if not isinstance(self.law, Controller):
            raise ParameterError(
                f"Contender '{one_line(self.name)}': its law is a {type(self.law).__name__}; give a ControlLaw or "
                "another Controller."
            )
        check_field_types(self)
        known = [leaf.path for leaf in leaves(self.law)]
        for purpose, bounds in (("tuned", self.bounds), ("identified", self.identified)):
            if unknown := [path for path in bounds if path not in known]:
                raise ParameterError(
                    f"contender '{self.name}': {type(self.law).__name__} has no declared parameter '{unknown[0]}' to "
                    f"be {purpose}; there are {', '.join(known) or 'none'}. Omit its bounds."
                )


class CompleteLaw(NamedTuple):
    """A law that commands the valves of a joint through its sensors, and the ranges of all gains that are tuned."""

    law: WithSensors | SensedController
    bounds: dict[str, tuple[float, float]]


def complete(joint: BenchmarkJoint, contender: Contender, seed: int = 1) -> CompleteLaw:
    """The law of a contender with the parts that it lacks: co-contraction, pressure control, modulation, sensors.

    Raises ParameterError for a law that commands other inputs, or measures a column without a sensor.
    """
    _check_columns(joint, contender)
    if isinstance(contender.law, ControlLaw):
        law, bounds = _actuated(joint, contender.law, dict(contender.bounds), contender.name)
        known = {sensor.column: sensor for sensor in joint.sensors}
        sensors = tuple(known[name] for name in law.measured_columns)
        return CompleteLaw(WithSensors(law, sensors, float(seed)), _within("law.", bounds))
    inputs = contender.law.inputs
    stand_in = SetpointCommand(inputs, tuple(f"{COMMANDED}{name}" for name in inputs))
    law, own = _actuated(joint, stand_in, {}, contender.name)
    bounds = {**_within("controller.", contender.bounds), **_within("actuation.", own)} if contender.bounds else {}
    span = joint.pressure_span
    limits = dict.fromkeys(joint.pressures, (joint.min_pressure, joint.max_pressure)) | {DIFFERENCE: (-span, span)}
    ranges = {name: limits[name] for name in inputs if name in limits}
    return CompleteLaw(sensed(contender.law, law, ranges, joint.sensors, seed), bounds)


def _check_columns(joint: BenchmarkJoint, contender: Contender) -> None:
    """Raise ParameterError where a law measures a column without a sensor."""
    known = [sensor.column for sensor in joint.sensors]
    if without := [name for name in contender.law.measured_columns if name not in known]:
        raise ParameterError(
            f"contender '{contender.name}' measures '{without[0]}'; the joint has sensors of {', '.join(known)}."
        )


def _actuated(
    joint: BenchmarkJoint, law: ControlLaw, bounds: dict[str, tuple[float, float]], name: str
) -> tuple[ControlLaw, dict[str, tuple[float, float]]]:
    """A law with the parts from its commands to the valves, and its ranges."""
    if law.inputs == (DIFFERENCE,):
        span = (joint.pressure_span,)
        law = Cascade(law, CoContraction(joint.pressures, 0.0, "mean_pressure"), (-span[0],), span)
        bounds = _within("outer.", bounds)
    if set(law.inputs) == set(joint.pressures):
        law, bounds = _with_pressure_control(joint, law, bounds)
    if set(law.inputs) != set(joint.model.inputs) - {"external_torque"}:
        raise ParameterError(
            f"contender '{name}' commands {', '.join(law.inputs)}; allowed are '{DIFFERENCE}', the pressures "
            f"{', '.join(joint.pressures)}, or all valves."
        )
    return law, bounds


def _with_pressure_control(
    joint: BenchmarkJoint, law: ControlLaw, bounds: dict[str, tuple[float, float]]
) -> tuple[ControlLaw, dict[str, tuple[float, float]]]:
    """A law that commands pressures with the inner pressure control of a joint, and its ranges."""
    valves = tuple(SplitRange(f"{side}.fill", f"{side}.discharge") for side in SIDES)
    inner = ProportionalFeedback(joint.pressures, valves, 10.0 / BAR, 0.02 * BAR if joint.switching else 0.0)
    limits = (joint.min_pressure,) * 2, (joint.max_pressure,) * 2
    cascade = Cascade(law, inner, *limits)
    bounds = {**_within("outer.", bounds), "inner.gain": PRESSURE_GAIN}
    if not joint.switching:
        return cascade, bounds
    return SigmaDelta(cascade), _within("law.", {**bounds, "inner.zone": ZONE})


def _within(prefix: str, bounds: Bounds) -> dict[str, tuple[float, float]]:
    return {f"{prefix}{path}": pair for path, pair in bounds.items()}


_GAIN, _INTEGRAL, _DERIVATIVE, _LEAD = (2e4, 2e6), (0.02, 3.0), (1e-3, 0.2), (1e-3, 0.1)
_FRICTION, _INERTIA = (10.0, 5e4), (-500.0, 500.0)
PID_BOUNDS: Bounds = {"gain": _GAIN, "integral_time": _INTEGRAL, "derivative_time": _DERIVATIVE}


def _pid() -> PID:
    return PID("angle", DIFFERENCE, gain=2e5, integral_time=0.3, derivative_time=0.02, derivative_filter=5.0)


def _feed_forward() -> SetpointLead:
    return SetpointLead("feed_forward", "feed_forward_rate", DIFFERENCE, 0.02)


def _friction() -> FrictionFeedForward:
    return FrictionFeedForward("angular_speed", DIFFERENCE, 1e3, boundary_speed=0.1)


def _compensated() -> WithFeedForward:
    """Feed-forward of the model with compensation of friction and of inertia."""
    inertia = MotionFeedForward("angular_speed", "angular_acceleration", DIFFERENCE)
    return WithFeedForward(_feed_forward(), WithFeedForward(_friction(), inertia))


_COMPENSATION: Bounds = {
    "feed_forward.feed_forward.lead_time": _LEAD,
    "feed_forward.feedback.feed_forward.amplitude": _FRICTION,
}
_IDENTIFIED: Bounds = {**_COMPENSATION, "feed_forward.feedback.feedback.acceleration_gain": _INERTIA}
"""Gains of the compensated feed-forward that are tuned, and those that are identified."""


def pid_contender() -> Contender:
    """PID of the angle without a model of the muscles."""
    return Contender("PID", _pid(), PID_BOUNDS)


def open_loop_contender() -> Contender:
    """Feed-forward by the static inverse of the model, without feedback of the angle."""
    without = WithFeedForward(_feed_forward(), PID("angle", DIFFERENCE, gain=0.0))
    return Contender("feed-forward", without, {"feed_forward.lead_time": _LEAD})


def feed_forward_contender() -> Contender:
    """Feed-forward by the static inverse of the model, and PID."""
    bounds = {"feed_forward.lead_time": _LEAD, **_within("feedback.", PID_BOUNDS)}
    return Contender("feed-forward + PID", WithFeedForward(_feed_forward(), _pid()), bounds)


def compensated_contender(joint: BenchmarkJoint) -> Contender:
    """Feed-forward with compensation of friction and inertia, and PID whose set point has the dead time of the encoder.

    The PID differentiates the error. The dead time is that of the data sheet of the sensors, the same for model and
    truth.
    """
    feedback = WithSetpointDelay(dataclasses.replace(_pid(), derivative_weight=1.0), _delay(joint))
    bounds = {**_COMPENSATION, **_within("feedback.law.", PID_BOUNDS)}
    law = WithFeedForward(_compensated(), feedback)
    return Contender("feed-forward + PID, compensated", law, bounds, _IDENTIFIED)


def _delay(joint: BenchmarkJoint) -> int:
    """Dead time of the encoder [samples]."""
    return next(sensor.delay for sensor in joint.sensors if sensor.column == "angle")


def sliding_mode_contender() -> Contender:
    """Sliding mode with a boundary layer beside the feed-forward."""
    law = SlidingMode("angle", DIFFERENCE, 5e4, sliding_time=0.05, boundary_layer=0.1, filter_time=0.004)
    bounds = {
        "feed_forward.lead_time": _LEAD, "feedback.amplitude": (5e3, 2e5), "feedback.sliding_time": (3e-3, 0.3),
        "feedback.boundary_layer": (3e-3, 1.0),
    }  # fmt: skip
    return Contender("feed-forward + sliding mode", WithFeedForward(_feed_forward(), law), bounds)


def super_twisting_contender() -> Contender:
    """Super-twisting beside the feed-forward."""
    law = SuperTwisting("angle", DIFFERENCE, 1e5, 1e5, sliding_time=0.05, filter_time=0.004)
    bounds = {
        "feed_forward.lead_time": _LEAD, "feedback.proportional": (1e4, 1e6), "feedback.integral": (1e4, 3e6),
        "feedback.sliding_time": (3e-3, 0.3),
    }  # fmt: skip
    return Contender("feed-forward + super-twisting", WithFeedForward(_feed_forward(), law), bounds)


def angle_and_stiffness_contender(joint: BenchmarkJoint) -> Contender:
    """Angle and stiffness by the inverse of the model for torque and stiffness."""
    inverse = AntagonisticInverse(
        joint.model.muscles, joint.model.mechanism, joint.min_pressure, joint.max_pressure, steps=2
    )
    law = AngleAndStiffness(
        inverse, joint.pressures, gain=20.0, integral_time=0.3, speed_gain=0.3, speed_column="angular_speed",
        acceleration_setpoint="angular_acceleration",
    )  # fmt: skip
    bounds = {"gain": (2.0, 300.0), "integral_time": (0.01, 3.0), "speed_gain": (0.01, 10.0)}
    return Contender("angle and stiffness", law, bounds)


_DESIGN: Bounds = {"permitted_angle": (2e-3, 0.2), "speed_noise": (0.1, 100.0), "pressure_time": (3e-3, 0.1)}


def quadratic_contender(joint: BenchmarkJoint) -> Contender:
    """Linear-quadratic Gaussian control (LQG) of the deviation beside the feed-forward; its weights are tuned."""
    design = QuadraticDesign(joint_design_model(joint), 0.02, 0.005, 5.0, 0.01)
    law = WithFeedForward(_compensated(), WithSetpointDelay(DeviationLaw(design), _delay(joint)))
    weights = _within("feedback.law.law.", {**_DESIGN, "permitted_integral": (5e-4, 0.5)})
    return Contender("feed-forward + LQG, compensated", law, {**_COMPENSATION, **weights}, _IDENTIFIED)


def predictive_contender(joint: BenchmarkJoint) -> Contender:
    """Linear model predictive control (MPC) of the deviation beside the feed-forward; its weights are tuned."""
    design = PredictiveDesign(joint_design_model(joint), 0.02, 5.0, 200.0, 0.01)
    law = AlongMotion(_compensated(), design, _delay(joint))
    weights = _within("design.", {**_DESIGN, "disturbance_noise": (10.0, 1e4)})
    return Contender("feed-forward + MPC, compensated", law, {**_COMPENSATION, **weights}, _IDENTIFIED)


def standard_contenders(joint: BenchmarkJoint) -> tuple[Contender, ...]:
    """The contenders of the package for a joint; all ranges of gains are chosen."""
    return (
        pid_contender(), open_loop_contender(), feed_forward_contender(), compensated_contender(joint),
        sliding_mode_contender(), super_twisting_contender(), angle_and_stiffness_contender(joint),
        quadratic_contender(joint), predictive_contender(joint),
    )  # fmt: skip
