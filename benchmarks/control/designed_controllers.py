"""Controllers of the benchmark that are designed for the linearised model: LQG, ADRC and model
predictive.
"""

import functools
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, TypeVar

import numpy as np
from joint_models import ENCODER_STEP

from airmuscle.control import (
    LinearModelPredictive,
    StateFeedback,
    design_adrc,
    design_lqg,
    design_predictive,
)
from airmuscle.core import (
    Reference,
    Value,
    model,
    ops,
    parameter,
    published,
    select_prefix,
    united,
    with_prefix,
)
from airmuscle.core.declaration import forwarded
from airmuscle.design import JointRig
from airmuscle.design.control_comparison.contenders import Memories
from airmuscle.design.control_comparison.signals import angular_acceleration
from airmuscle.engine import ControlLaw, Controller, LawDesign, Measurement
from airmuscle.engine.loop import EnclosingLaw, Memory, Sampled
from airmuscle.physics import LinearModel

Law = TypeVar("Law")
DIFFERENCE = "difference"
READING = "reading"
SPEED_READING = "speed_reading"
"""Names of the delayed angle and of the lagged and delayed speed, the measured columns of a
design.
"""
PERMITTED_DIFFERENCE = 1e5
PRESSURE_SPREAD = 1e3
"""Permitted deviation of the command [Pa], to which the permitted errors are relative, and
deviation of the present pressure difference after 1 s [Pa] (chosen)."""
RESERVE = 8e-3
"""Dead time [s] beyond the stated one with which a design reckons (chosen): the hold of a sample, 1
m of tube and two samples that nobody knows. Without it the loop amplifies errors near its
bandwidth."""
HORIZON = 40
"""Samples of the horizon of the predictive controller (chosen). Its command has a range and no
limit of the rate: what the valves permit depends on the pressures and on the feed-forward beside
it, and is told to it by the command that was attained."""
ZERO_DRIFT = 1.0
"""Deviation of the rate of a reading's zero error after 1 s [rad/s2] (chosen): 7 mrad/s of the
speed, as predictive control needs an unknown disturbance for each reading."""
STEPS = (1e-3, 1e-2, 1e3)
"""Steps of angle [rad], speed [rad/s] and half pressure difference [Pa] of the linearisation
(chosen).
"""


@model
class JointDesignModel:
    """Linear model of a joint about an angle of 0: theta'' = -k theta - c theta' + g d,  T d' = u -
    d,  with dead time.

    u commanded and d present half pressure difference. The dead time of both sensors is
    approximated by two lags of half of it; that of the speed has a lag of its own before.
    """

    from_file: ClassVar[bool] = False

    stiffness: float = parameter("1/s2", "k", "stiffness over inertia", fitted=False)
    damping: float = parameter("1/s", "c", "damping over inertia", fitted=False)
    gain: float = parameter(
        "rad/(Pa s2)", "g", "acceleration by half the pressure difference", fitted=False
    )
    dead_time: float = parameter(
        "s", "T_s", "dead time of the sensors", bounds=(1e-6, 1.0), fitted=False
    )
    speed_lag: float = parameter(
        "s", "T_omega", "lag of the speed sensor", bounds=(1e-6, 1.0), fitted=False
    )
    sample_time: float = parameter("s", "h", "sample time", bounds=(1e-6, 1.0), fitted=False)

    def linear_model(self, pressure_time: float) -> LinearModel:
        """The model with a lag of the pressures of this time constant [s]."""
        late = 0.5 * self.dead_time
        lags = {
            "delayed": ("angle", late),
            READING: ("delayed", late),
            "lagged": ("angular_speed", self.speed_lag),
            "lagged_delayed": ("lagged", late),
            SPEED_READING: ("lagged_delayed", late),
        }
        states = ("angle", "angular_speed", "half_difference", *lags)
        a = np.zeros((8, 8))
        b = np.zeros((8, 1))
        a[0, 1] = 1.0
        a[1, :3] = (-self.stiffness, -self.damping, self.gain)
        a[2, 2] = -1.0 / pressure_time
        b[2] = 1.0 / pressure_time
        for i, (source, lag) in enumerate(lags.values(), 3):
            a[i, [states.index(source), i]] = 1.0 / lag, -1.0 / lag
        zeros = dict.fromkeys(states, 0.0)
        return LinearModel(
            a,
            b,
            np.eye(8),
            np.zeros((8, 1)),
            states,
            (DIFFERENCE,),
            states,
            {},
            zeros,
            {DIFFERENCE: 0.0},
            np.zeros(8),
            output_values=zeros,
        )


def joint_design_model(joint: JointRig) -> JointDesignModel:
    """The linear model of a joint, from its nominal model without friction at the mean pressure,
    with RESERVE.
    """
    slopes = []
    for i, step in enumerate(STEPS):
        point = np.zeros(3)
        point[i] = step
        above, below = (
            angular_acceleration(joint, joint.model, *(sign * point)) for sign in (1.0, -1.0)
        )
        slopes.append((above - below) / (2.0 * step))
    sensors = {sensor.column: sensor for sensor in joint.sensors}
    dead_time = max(sensors["angle"].delay, 1) * joint.sample_time + RESERVE
    lag = max(sensors["angular_speed"].lag, 0.5 * joint.sample_time)
    return JointDesignModel(-slopes[0], -slopes[1], slopes[2], dead_time, lag, joint.sample_time)


@model
class JointDesign(LawDesign):
    """Design of a controller of the reading with an observer of a disturbance torque, from weights.

    The observer measures angle and speed: between the steps of the encoder, the speed damps the
    joint.

    `law` is that of `control.design_lqg`, `predictive` that of `control.design_predictive` with the
    same weights and the range of the command as its limit; references there.
    """

    references: ClassVar[tuple[Reference, ...]] = (
        published("franklin-1998"),
        published("rawlings-2017"),
    )
    from_file: ClassVar[bool] = False

    plant: JointDesignModel
    permitted_angle: float = parameter("rad", "d_theta", "permitted error", bounds=(1e-5, 10.0))
    speed_noise: float = parameter(
        "rad/s", "q_omega", "deviation of the speed after 1 s", bounds=(1e-4, 1e4)
    )
    disturbance_noise: float = parameter(
        "rad/s2", "q_d", "deviation of the disturbance after 1 s", bounds=(1e-2, 1e6)
    )
    pressure_time: float = parameter("s", "T", "time constant of the pressures", bounds=(1e-4, 1.0))
    speed_deviation: float = parameter(
        "rad/s", "r_omega", "deviation of the speed sensor", bounds=(1e-5, 1e3)
    )

    @functools.cached_property
    def law(self) -> ControlLaw:
        """The state feedback with its observer."""
        return _quadratic(self)

    @functools.cached_property
    def predictive(self) -> LinearModelPredictive:
        """The predictive controller with its observer."""
        return self.designed(design_predictive, (SPEED_READING,), horizon=HORIZON)

    def designed(
        self, design: Callable[..., Law], drifting: tuple[str, ...] = (), **further: Any
    ) -> Law:
        """What a function of `control` designs with these weights; `drifting` readings have an
        unknown zero error.
        """
        noise = {
            "angular_speed": self.speed_noise,
            "half_difference": PRESSURE_SPREAD,
            "angular_speed.disturbance": self.disturbance_noise,
            **{f"{name}.disturbance": ZERO_DRIFT for name in drifting},
        }
        return design(
            self.plant.linear_model(self.pressure_time),
            self.plant.sample_time,
            measured=(READING, SPEED_READING),
            controlled=(READING,),
            disturbed=("angular_speed", *drifting),
            process_noise=noise,
            permitted={"angle": self.permitted_angle, DIFFERENCE: PERMITTED_DIFFERENCE},
            measurement_noise={READING: ENCODER_STEP, SPEED_READING: self.speed_deviation},
            **further,
        )


@functools.lru_cache(maxsize=64)
def _quadratic(design: JointDesign) -> StateFeedback:
    """Equal designs, which a search makes once for each of its tasks and models, are computed
    once.
    """
    return design.designed(design_lqg)


@model
class RejectionDesign(LawDesign):
    """Active disturbance rejection by `control.design_adrc`: theta'' = g d + f, with f estimated;
    references there.
    """

    references: ClassVar[tuple[Reference, ...]] = (published("han-2009"), published("gao-2003"))
    from_file: ClassVar[bool] = False

    plant: JointDesignModel
    bandwidth: float = parameter(
        "rad/s", "omega_c", "bandwidth of the controller", bounds=(0.1, 1e4)
    )
    observer_bandwidth: float = parameter(
        "rad/s", "omega_o", "bandwidth of the observer", bounds=(0.1, 1e4)
    )

    @functools.cached_property
    def law(self) -> ControlLaw:
        """The state feedback with its observer."""
        return design_adrc(
            READING,
            DIFFERENCE,
            self.plant.sample_time,
            order=2,
            gain=self.plant.gain,
            bandwidth=self.bandwidth,
            observer_bandwidth=self.observer_bandwidth,
        )


@model
class DeviationLaw(EnclosingLaw):
    """u = law(y - r, v - v_r; 0): the law receives the deviations of its columns from the motion, 0
    as its set point.

    The deviation from a motion that the model can follow obeys the linearised model, whatever the
    motion. y reading of the angle, v that of the speed if the law measures it; the speed v_r of the
    motion passes the lag of its sensor.
    """

    from_file: ClassVar[bool] = False

    law: ControlLaw
    speed_lag: float = parameter(
        "s", "T_omega", "lag of the speed sensor", bounds=(1e-6, 1.0), fitted=False
    )

    @property
    def measured_columns(self) -> tuple[str, ...]:
        return ("angle", "angular_speed")[: len(self.law.measured_columns)]

    setpoints = measured_columns

    @property
    def initial_memory(self) -> Mapping[str, float]:
        """Whether it has started (0 or 1), the lagged speed of the motion, and the values of the
        law.
        """
        return {"started": 0.0, "speed": 0.0, **with_prefix("law.", dict(self.law.initial_memory))}

    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        columns = measurement.columns
        points = measurement.setpoints
        speed = memory["speed"]
        deviations = {READING: columns["angle"] - points["angle"]}
        if SPEED_READING in self.law.measured_columns:
            wanted = points["angular_speed"]
            share = 1.0 - ops.exp(-dt / self.speed_lag)
            lagged = speed + share * (wanted - speed)
            # the first sample starts at the speed of the motion
            speed = ops.where(memory["started"] > 0, lagged, wanted)
            deviations[SPEED_READING] = columns["angular_speed"] - speed
        seen = Measurement(deviations, {READING: 0.0}, measurement.ranges)
        command, later = self.law.step(select_prefix("law.", memory), seen, dt)
        return command, {"started": 1.0, "speed": speed, **with_prefix("law.", later)}


@model
class AlongMotion(Controller):
    """u = u_ff + u_c:  predictive control u_c of the deviation from the motion beside the
    feed-forward of the model.

    It is the sum of a law and a `DeviationLaw` for a controller that is called at each sample:
    `deviation` delivers the deviations of the readings. The designed controller sees the range of
    the command less the feed-forward: the sum keeps it.
    """

    from_file: ClassVar[bool] = False

    feed_forward: ControlLaw
    deviation: ControlLaw
    design: JointDesign

    measured_columns = forwarded("deviation.measured_columns")

    @property
    def setpoints(self) -> tuple[str, ...]:
        return united(self.deviation.setpoints, self.feed_forward.setpoints)

    inputs = forwarded("feed_forward.inputs")

    def init(self) -> Memories:
        return self.feed_forward.init(), self.deviation.init(), self.design.predictive.init()

    def step(
        self, memory: Memories, measurement: Measurement, dt: float
    ) -> tuple[Mapping[str, float], Memories]:
        forward, passed, design_memory = memory
        ahead, forward = self.feed_forward.step(forward, measurement, dt)
        deviations, passed = self.deviation.step(passed, measurement, dt)
        low, high = measurement.ranges[DIFFERENCE]
        command = float(ahead[DIFFERENCE])
        # what the feed-forward leaves of the range
        ranges = {DIFFERENCE: (low - command, high - command)}
        seen = Measurement(deviations, {READING: 0.0}, ranges)
        back, design_memory = self.design.predictive.step(design_memory, seen, dt)
        total = command + back[DIFFERENCE]
        return {DIFFERENCE: total}, (forward, passed, design_memory)

    def notes(self, memory: Memories) -> tuple[str, ...]:
        """The remarks of the designed controller."""
        *_, design_memory = memory
        return self.design.predictive.notes(design_memory)
