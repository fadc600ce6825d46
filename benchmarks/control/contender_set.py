"""Standard contenders of the control benchmark: feedback laws beside one feed-forward, and two
without it.
"""

import dataclasses
import functools

import designed_controllers as designed

from airmuscle.control import (
    PID,
    AngleAndStiffness,
    AntagonisticInverse,
    FrictionFeedForward,
    MotionFeedForward,
    SetpointLead,
    SlidingMode,
    SuperTwisting,
    WithFeedForward,
    WithSetpointDelay,
)
from airmuscle.core import with_prefix
from airmuscle.design import Contender, JointRig
from airmuscle.design.control_comparison.contenders import Bounds, PassedSignals
from airmuscle.engine import ControlLaw

DIFFERENCE = designed.DIFFERENCE
MAX_LEAD = 0.03
"""Greatest lead time [s] of a feed-forward (chosen): it replaces the lag of the pressures, never
damping or inertia.
"""
PID_BOUNDS: Bounds = {
    "gain": (2e4, 2e6),
    "integral_time": (0.02, 3.0),
    "derivative_time": (1e-3, 0.2),
}
PERMITTED_ANGLE = (2e-3, 0.2)
BANDWIDTH = (3.0, 100.0)
"""Ranges of the permitted error [rad] of LQG and MPC, from which their bandwidth follows, and of
the bandwidth [rad/s] of ADRC, which are also sought on a truth."""
_SLIDING = (3e-3, 0.3)
FEED_FORWARD: Bounds = {
    "feed_forward.lead_time": (0.0, MAX_LEAD),
    "feedback.feed_forward.amplitude": (0.0, 3e4),
}
"""Gains of the feed-forward that are tuned for the models."""
COMMISSIONED: Bounds = {
    **FEED_FORWARD,
    "feedback.feedback.position_gain": (-1e5, 1e5),
    "feedback.feedback.speed_gain": (-1e4, 3e4),
    "feedback.feedback.acceleration_gain": (-1e3, 1e3),
}
"""Gains of the feed-forward that are sought on a truth."""


def _feed_forward() -> WithFeedForward:
    """Inverse of the model with a lead, and compensation of friction, stiffness, damping and
    inertia that it lacks.
    """
    lead = SetpointLead("feed_forward", "feed_forward_rate", DIFFERENCE, 0.02)
    friction = FrictionFeedForward("angular_speed", DIFFERENCE, 1e3, boundary_speed=0.1)
    motion = MotionFeedForward(
        "angular_speed", "angular_acceleration", DIFFERENCE, position="angle"
    )
    return WithFeedForward(lead, WithFeedForward(friction, motion))


def _beside_feed_forward(
    joint: JointRig,
    name: str,
    feedback: ControlLaw,
    bounds: Bounds,
    commissioned: Bounds | None = None,
) -> Contender:
    """A feedback beside the feed-forward, with set points as late as the encoder, and its gains
    sought on a truth.
    """
    law = WithFeedForward(_feed_forward(), WithSetpointDelay(feedback, _delay(joint)))
    known = {**with_prefix("feed_forward.", FEED_FORWARD), **with_prefix("feedback.law.", bounds)}
    sought = {
        **with_prefix("feed_forward.", COMMISSIONED),
        **with_prefix("feedback.law.", commissioned or {}),
    }
    return Contender(name, law, known, sought)


def _delay(joint: JointRig) -> int:
    """Stated dead time of the encoder [samples]."""
    return next(sensor.delay for sensor in joint.sensors if sensor.column == "angle")


def _angle_and_stiffness(joint: JointRig) -> Contender:
    """Angle and stiffness by the inverse of the model for torque and stiffness."""
    plant = joint.model
    inverse = AntagonisticInverse(
        plant.muscles, plant.mechanism, joint.min_pressure, joint.max_pressure, steps=2
    )
    law = AngleAndStiffness(
        inverse,
        joint.pressures,
        gain=20.0,
        integral_time=0.3,
        speed_gain=0.3,
        speed_column="angular_speed",
        acceleration_setpoint="angular_acceleration",
    )
    bounds = {"gain": (2.0, 300.0), "integral_time": (0.01, 3.0), "speed_gain": (0.01, 10.0)}
    return Contender("angle and stiffness", law, bounds, bounds)


def standard_contenders(joint: JointRig) -> tuple[Contender, ...]:
    """The contenders of the package for a joint; all ranges of gains are chosen."""
    pid = PID(
        "angle",
        DIFFERENCE,
        gain=2e5,
        integral_time=0.3,
        derivative_time=0.02,
        derivative_filter=5.0,
    )
    sliding = SlidingMode(
        "angle", DIFFERENCE, 5e4, sliding_time=0.05, boundary_layer=0.1, filter_time=0.004
    )
    twisting = SuperTwisting("angle", DIFFERENCE, 1e5, 1e5, sliding_time=0.05, filter_time=0.004)
    model = designed.joint_design_model(joint)
    ours = functools.partial(_beside_feed_forward, joint)
    design = designed.JointDesign(model, 0.1, 7.0, 200.0, 0.005, 0.05)
    passed = designed.DeviationLaw(
        PassedSignals((designed.READING, designed.SPEED_READING)), model.speed_lag
    )
    readings = WithSetpointDelay(passed, _delay(joint))
    quadratic = ours(
        "feed-forward + LQG",
        designed.DeviationLaw(design, model.speed_lag),
        with_prefix(
            "law.",
            {
                "permitted_angle": PERMITTED_ANGLE,
                "speed_noise": (0.1, 100.0),
                "disturbance_noise": (10.0, 1e4),
                "pressure_time": (3e-3, 0.1),
                "speed_deviation": (1e-3, 1.0),
            },
        ),
        {"law.permitted_angle": PERMITTED_ANGLE},
    )
    return (
        Contender("PID", pid, PID_BOUNDS, PID_BOUNDS),
        ours("feed-forward", PID("angle", DIFFERENCE, gain=0.0), {}),
        ours("feed-forward + PID", dataclasses.replace(pid, derivative_weight=1.0), PID_BOUNDS),
        ours(
            "feed-forward + sliding mode",
            sliding,
            {"amplitude": (5e3, 2e5), "sliding_time": _SLIDING, "boundary_layer": (3e-3, 1.0)},
        ),
        ours(
            "feed-forward + super-twisting",
            twisting,
            {"proportional": (1e4, 1e6), "integral": (1e4, 3e6), "sliding_time": _SLIDING},
        ),
        ours(
            "feed-forward + ADRC",
            designed.DeviationLaw(designed.RejectionDesign(model, 20.0, 60.0), model.speed_lag),
            with_prefix("law.", {"bandwidth": BANDWIDTH, "observer_bandwidth": (10.0, 500.0)}),
            {"law.bandwidth": BANDWIDTH},
        ),
        quadratic,
        Contender(
            "feed-forward + MPC",
            designed.AlongMotion(_feed_forward(), readings, design),
            {},
            {
                **with_prefix("feed_forward.", COMMISSIONED),
                "design.permitted_angle": PERMITTED_ANGLE,
            },
            quadratic,
        ),
        _angle_and_stiffness(joint),
    )
