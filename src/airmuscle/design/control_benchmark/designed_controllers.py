"""Controllers of the benchmark that are designed for the linearised model: LQG, ADRC and model predictive."""

import functools
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, NamedTuple

import numpy as np

from ...control.estimation.lqg import GAO2003, HAN2009, design_adrc, design_lqg
from ...control.estimation.predictive_design import design_predictive
from ...control.laws.linear_model_predictive import RAWLINGS2017, LinearModelPredictive
from ...control.laws.pressures import DIFFERENCE
from ...control.laws.state_feedback import FRANKLIN1998, StateFeedback
from ...core import Reference, Value, model, parameter, within
from ...engine.loop import ControlLaw, Controller, EnclosingLaw, LawDesign, Measurement, Memory, Sampled
from ...physics.analysis.linear_model import LinearModel
from .joints import ENCODER_STEP, BenchmarkJoint
from .signals import angular_acceleration

READING = "reading"
"""Name of the delayed angle, the measured column of a design."""
PERMITTED_DIFFERENCE, PRESSURE_SPREAD = 1e5, 1e3
"""Permitted deviation of the command [Pa], to which the permitted errors are relative, and deviation of the present
pressure difference after 1 s [Pa] (chosen)."""
RESERVE = 8e-3
"""Dead time [s] beyond the stated one with which a design reckons (chosen): the hold of a sample, 1 m of tube and two
samples that nobody knows. Without it the loop amplifies errors near its bandwidth."""
HORIZON, MAX_RATE = 40, 6e6
"""Samples of the horizon of the predictive controller, and greatest rate [Pa/s] of the half pressure difference that it
plans, about that of the model with its valves fully open (chosen)."""
STEPS = (1e-3, 1e-2, 1e3)
"""Steps of angle [rad], speed [rad/s] and half pressure difference [Pa] of the linearisation (chosen)."""


@model
class JointDesignModel:
    """Linear model of a joint about an angle of 0: theta'' = -k theta - c theta' + g d,  T d' = u - d,  with dead time.

    u commanded and d present half pressure difference. The dead time of the encoder is approximated by two lags of half
    of it.
    """

    from_file: ClassVar[bool] = False

    stiffness: float = parameter("1/s2", "k", "stiffness over inertia", fitted=False)
    damping: float = parameter("1/s", "c", "damping over inertia", fitted=False)
    gain: float = parameter("rad/(Pa s2)", "g", "acceleration by half the pressure difference", fitted=False)
    dead_time: float = parameter("s", "T_s", "dead time of the encoder", bounds=(1e-6, 1.0), fitted=False)
    sample_time: float = parameter("s", "h", "sample time", bounds=(1e-6, 1.0), fitted=False)

    def linear_model(self, pressure_time: float) -> LinearModel:
        """The model with a lag of the pressures of this time constant [s]."""
        lag = 2.0 / self.dead_time
        a = np.zeros((5, 5))
        a[0, 1] = 1.0
        a[1, :3] = -self.stiffness, -self.damping, self.gain
        a[2, 2] = -1.0 / pressure_time
        a[3, [0, 3]] = lag, -lag
        a[4, [3, 4]] = lag, -lag
        b = np.zeros((5, 1))
        b[2] = 1.0 / pressure_time
        states = ("angle", "angular_speed", "half_difference", "delayed", READING)
        zeros = dict.fromkeys(states, 0.0)
        return LinearModel(
            a, b, np.eye(5), np.zeros((5, 1)), states, (DIFFERENCE,), states, {}, zeros, {DIFFERENCE: 0.0},
            np.zeros(5), output_values=zeros,
        )  # fmt: skip


def joint_design_model(joint: BenchmarkJoint) -> JointDesignModel:
    """The linear model of a joint, from its nominal model without friction at the mean pressure, with RESERVE."""
    slopes = []
    for i, step in enumerate(STEPS):
        point = np.zeros(3)
        point[i] = step
        above, below = (angular_acceleration(joint, joint.model, *(sign * point)) for sign in (1.0, -1.0))
        slopes.append((above - below) / (2.0 * step))
    delay = next(sensor.delay for sensor in joint.sensors if sensor.column == "angle")
    dead_time = max(delay, 1) * joint.sample_time + RESERVE
    return JointDesignModel(-slopes[0], -slopes[1], slopes[2], dead_time, joint.sample_time)


@model
class JointDesign(LawDesign):
    """Design of a controller of the reading with an observer of a disturbance torque, from weights.

    `law` is that of `control.design_lqg`, `predictive` that of `control.design_predictive` with the same weights and
    the range and the rate of the command as limits; references there.
    """

    references: ClassVar[tuple[Reference, ...]] = (FRANKLIN1998, RAWLINGS2017)
    from_file: ClassVar[bool] = False

    plant: JointDesignModel
    permitted_angle: float = parameter("rad", "d_theta", "permitted error", bounds=(1e-5, 10.0))
    speed_noise: float = parameter("rad/s", "q_omega", "deviation of the speed after 1 s", bounds=(1e-4, 1e4))
    disturbance_noise: float = parameter("rad/s2", "q_d", "deviation of the disturbance after 1 s", bounds=(1e-2, 1e6))
    pressure_time: float = parameter("s", "T", "time constant of the pressures", bounds=(1e-4, 1.0))

    @functools.cached_property
    def law(self) -> ControlLaw:
        """The state feedback with its observer."""
        return _quadratic(self)

    @functools.cached_property
    def predictive(self) -> LinearModelPredictive:
        """The predictive controller with its observer."""
        controller: LinearModelPredictive = self.designed(
            design_predictive, horizon=HORIZON, max_rate={DIFFERENCE: MAX_RATE}
        )
        return controller

    def designed(self, design: Callable[..., Any], **further: Any) -> Any:
        """What a function of `control` designs with these weights."""
        noise = {
            "angular_speed": self.speed_noise, "half_difference": PRESSURE_SPREAD,
            "angular_speed.disturbance": self.disturbance_noise,
        }  # fmt: skip
        return design(
            self.plant.linear_model(self.pressure_time), self.plant.sample_time, measured=(READING,),
            controlled=(READING,), disturbed=("angular_speed",), process_noise=noise,
            permitted={"angle": self.permitted_angle, DIFFERENCE: PERMITTED_DIFFERENCE},
            measurement_noise={READING: ENCODER_STEP}, **further,
        )  # fmt: skip


@functools.lru_cache(maxsize=64)
def _quadratic(design: JointDesign) -> StateFeedback:
    """Equal designs, which a search makes once for each of its tasks and models, are computed once."""
    feedback: StateFeedback = design.designed(design_lqg)
    return feedback


@model
class RejectionDesign(LawDesign):
    """Active disturbance rejection by `control.design_adrc`: theta'' = g d + f, with f estimated; references there."""

    references: ClassVar[tuple[Reference, ...]] = (HAN2009, GAO2003)
    from_file: ClassVar[bool] = False

    plant: JointDesignModel
    bandwidth: float = parameter("rad/s", "omega_c", "bandwidth of the controller", bounds=(0.1, 1e4))
    observer_bandwidth: float = parameter("rad/s", "omega_o", "bandwidth of the observer", bounds=(0.1, 1e4))

    @functools.cached_property
    def law(self) -> ControlLaw:
        """The state feedback with its observer."""
        return design_adrc(
            READING, DIFFERENCE, self.plant.sample_time, order=2, gain=self.plant.gain, bandwidth=self.bandwidth,
            observer_bandwidth=self.observer_bandwidth,
        )  # fmt: skip


@model
class DeviationLaw(EnclosingLaw):
    """u = law(y - r; 0): the law receives the deviation of the angle from its set point, and 0 as its own set point.

    The deviation from a motion that the model can follow obeys the linearised model, whatever the motion.
    """

    from_file: ClassVar[bool] = False

    law: ControlLaw

    @property
    def measured_columns(self) -> tuple[str, ...]:
        return ("angle",)

    @property
    def setpoints(self) -> tuple[str, ...]:
        return ("angle",)

    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        deviation = measurement.columns["angle"] - measurement.setpoints["angle"]
        return self.law.step(memory, Measurement({READING: deviation}, {READING: 0.0}, measurement.ranges), dt)


class MotionMemory(NamedTuple):
    """Memories of the feed-forward and of the designed controller, and the angles on their way, the oldest first."""

    feed_forward: Any
    controller: Any
    angles: tuple[float, ...]


@model
class AlongMotion(Controller):
    """u = u_ff + u_c:  predictive control u_c of the deviation y - r(t - T_s) beside the feed-forward of the model.

    It is the sum of a law and a `DeviationLaw` for a controller that is called at each sample. The designed controller
    sees the range of the command less the feed-forward: the sum keeps it. `delay` [samples] is that of the encoder.
    """

    from_file: ClassVar[bool] = False

    feed_forward: ControlLaw
    design: JointDesign
    delay: int = within(0, 1000)

    @property
    def measured_columns(self) -> tuple[str, ...]:
        return ("angle",)

    @property
    def setpoints(self) -> tuple[str, ...]:
        return ("angle", *self.feed_forward.setpoints)

    @property
    def inputs(self) -> tuple[str, ...]:
        return self.feed_forward.inputs

    def init(self) -> MotionMemory:
        return MotionMemory(self.feed_forward.init(), self.design.predictive.init(), ())

    def step(
        self, memory: MotionMemory, measurement: Measurement, dt: float
    ) -> tuple[Mapping[str, float], MotionMemory]:
        ahead, forward = self.feed_forward.step(memory.feed_forward, measurement, dt)
        angles = (*memory.angles, measurement.setpoints["angle"])[-self.delay - 1 :]
        deviation = measurement.columns["angle"] - angles[0]
        low, high = measurement.ranges[DIFFERENCE]
        command = float(ahead[DIFFERENCE])
        seen = Measurement({READING: deviation}, {READING: 0.0}, {DIFFERENCE: (low - command, high - command)})
        back, later = self.design.predictive.step(memory.controller, seen, dt)
        return {DIFFERENCE: command + back[DIFFERENCE]}, MotionMemory(forward, later, angles)

    def notes(self, memory: MotionMemory) -> tuple[str, ...]:
        """The remarks of the designed controller."""
        return self.design.predictive.notes(memory.controller)
