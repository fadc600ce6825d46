"""Laws of the joint's benchmark by hand: co-contraction, proportional feedback, set-point lead,
stuck valve.

p_1 = p_0 + d, p_2 = p_0 - d;  u_i = K (r_i - y_i) outside the dead zone;  u = K_f (r + T r');  u_i
                               = u_f from t_f on.
"""

from __future__ import annotations

import dataclasses

import pytest

from airmuscle.control import (
    PID,
    CoContraction,
    FrictionFeedForward,
    MotionFeedForward,
    ProportionalFeedback,
    SetpointLead,
    WithSetpointDelay,
    WithStuckValve,
)
from airmuscle.engine import ColumnSensor, Measurement, SplitRange, WithSensors
from airmuscle.errors import ParameterError
from airmuscle.physics import AntagonisticJoint, HangingMass, JointWithExternalTorque

PRESSURES = ("left.pressure", "right.pressure")
RANGES = dict.fromkeys(("left.fill", "left.discharge", "right.fill", "right.discharge"), (0.0, 1.0))
VALVES = (SplitRange("left.fill", "left.discharge"), SplitRange("right.fill", "right.discharge"))


def stepped(law, setpoints=None, columns=None, ranges=RANGES, memory=None):
    return law.step(
        law.init() if memory is None else memory,
        Measurement(columns or {}, setpoints or {}, ranges),
        0.01,
    )


def test_the_pressures_are_the_mean_and_half_the_difference():
    told, _ = stepped(CoContraction(PRESSURES, 2e5), {"difference": 3e4})
    assert told == {"left.pressure": 2.3e5, "right.pressure": 1.7e5}
    law = CoContraction(PRESSURES, 2e5, "mean_pressure")
    assert law.setpoints == ("difference", "mean_pressure")
    told, _ = stepped(law, {"difference": 3e4, "mean_pressure": 1e5})
    assert told == {"left.pressure": 1.3e5, "right.pressure": 0.7e5}


def test_proportional_feedback_opens_one_valve_of_each_pair_and_none_in_the_dead_zone():
    law = ProportionalFeedback(PRESSURES, VALVES, gain=2e-5, zone=1e3)
    wanted = dict.fromkeys(PRESSURES, 2e5)
    measured = {"left.pressure": 1.8e5, "right.pressure": 2.1e5}
    told, _ = stepped(law, wanted, measured)
    assert told == {
        "left.fill": pytest.approx(0.4),
        "left.discharge": 0.0,
        "right.fill": 0.0,
        "right.discharge": pytest.approx(0.2),
    }
    told, _ = stepped(law, wanted, {"left.pressure": 2e5 - 999.0, "right.pressure": 1e5})
    assert told["left.fill"] == told["left.discharge"] == 0.0, "within the dead zone"
    assert told["right.fill"] == 1.0, "limited to the range of the valve"


def test_a_set_point_is_advanced_by_the_lead_time():
    law = SetpointLead("r", "r_rate", "u", lead_time=0.02, share=0.5)
    told, _ = stepped(law, {"r": 4.0, "r_rate": 10.0})
    assert told == {"u": 0.5 * (4.0 + 0.02 * 10.0)}


def test_a_law_sees_the_set_point_of_the_instant_that_a_delayed_sensor_measured():
    """A set point that moves like the measurement leaves no error, whatever the speed."""
    inner = PID("y", "u", 2.0)
    sensed = WithSensors(WithSetpointDelay(inner, 3), (ColumnSensor("y", delay=3),))
    memory = None
    told = []
    for k in range(8):
        commands, memory = stepped(
            sensed, {"y": 0.1 * k}, {"y": 0.1 * k}, {"u": (-9.0, 9.0)}, memory
        )
        told.append(commands["u"])
    assert told == [0.0] * 8
    plain = WithSetpointDelay(inner, 2)
    memory = None
    told = []
    for value in (1.0, 2.0, 3.0, 4.0):
        commands, memory = stepped(plain, {"y": value}, {"y": 0.0}, {"u": (-9.0, 9.0)}, memory)
        told.append(commands["u"])
    assert told == [2.0, 2.0, 2.0, 4.0], "the first set point until the delay is over"


@pytest.mark.parametrize(
    ("samples", "message"),
    [
        (-1, "allowed range: 0 to 1000"),
        (1001, "allowed range: 0 to 1000"),
        (1.5, "must be an integer"),
        (True, "must be an integer"),
    ],
)
def test_a_set_point_is_delayed_by_whole_samples(samples, message):
    with pytest.raises(ParameterError, match=f"samples .*{message}"):
        WithSetpointDelay(PID("y", "u", 2.0), samples)


def test_friction_is_balanced_along_the_wanted_motion():
    law = FrictionFeedForward("r_rate", "u", amplitude=3.0, boundary_speed=0.1)
    told = [stepped(law, {"r_rate": rate})[0]["u"] for rate in (-5.0, -0.05, 0.0, 0.1, 2.0)]
    assert told == pytest.approx([-3.0, -1.5, 0.0, 3.0, 3.0])
    with pytest.raises(ParameterError, match="boundary_speed"):
        FrictionFeedForward("r_rate", "u", amplitude=3.0, boundary_speed=0.0)


def test_damping_and_inertia_are_balanced_along_the_wanted_motion():
    law = MotionFeedForward("r_rate", "r_acceleration", "u", speed_gain=2.0, acceleration_gain=-0.5)
    assert stepped(law, {"r_rate": 3.0, "r_acceleration": 4.0})[0]["u"] == 2.0 * 3.0 - 0.5 * 4.0
    assert stepped(
        MotionFeedForward("r_rate", "r_acceleration", "u"), {"r_rate": 3.0, "r_acceleration": 4.0}
    )[0] == {"u": 0.0}


@pytest.mark.parametrize(
    ("stuck_time", "samples"), [(0.0, 0), (0.03, 3), (0.032, 4), (0.035, 4), (0.07, 7)]
)
def test_a_valve_sticks_from_its_time_on(stuck_time, samples):
    law = WithStuckValve(ProportionalFeedback(("y",), ("u",), 1.0), "u", stuck_time, 0.25)
    memory = None
    told = []
    for _ in range(10):
        commands, memory = stepped(law, {"y": 1.0}, {"y": 0.0}, {"u": (0.0, 1.0)}, memory)
        told.append(commands["u"])
    assert told == [1.0] * samples + [0.25] * (10 - samples)


def test_the_other_valves_and_the_memory_of_the_law_are_untouched():
    inner = PID("y", SplitRange("u", "v"), 2.0, 0.5)
    plain = WithSensors(inner, (ColumnSensor("y", noise=0.1),))
    stuck = None
    stuck = WithStuckValve(plain, "u", 0.0, 0.0)
    ranges = {"u": (0.0, 1.0), "v": (0.0, 1.0)}
    memory = None
    other = None
    for y in (0.0, 0.4, 1.5, 0.9):
        a, memory = stepped(plain, {"y": 1.0}, {"y": y}, ranges, memory)
        b, other = stepped(stuck, {"y": 1.0}, {"y": y}, ranges, other)
        assert b == {"u": 0.0, "v": a["v"]}
        assert {name: other[f"law.{name}"] for name in memory} == memory


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: CoContraction(("left.pressure",), 2e5), "1 commanded pressures; name two"),
        (lambda: ProportionalFeedback(PRESSURES, ("u",), 1.0), "2 columns and 1 commanded inputs"),
        (lambda: ProportionalFeedback((), (), 1.0), "0 columns and 0 commanded inputs"),
        (
            lambda: WithStuckValve(PID("y", "fill", 1.0), "fil", 0.0),
            "does not command 'fil'.*Did you mean 'fill'",
        ),
        (
            lambda: ProportionalFeedback(("y",), ("u",), float("nan")),
            "gain .* is nan; it must be finite",
        ),
        (lambda: JointWithExternalTorque(HangingMass(5.0)), "needs a mechanism with one angle"),
    ],
)
def test_impossible_laws_are_rejected(make, message):
    with pytest.raises(ParameterError, match=message):
        make()


def test_an_external_torque_adds_to_that_of_the_muscles():
    inner = AntagonisticJoint(0.03, 0.05, 0.2, 2.0, 0.1)
    joint = JointWithExternalTorque(inner)
    q = {"angle": 0.3}
    v = {"angular_speed": 0.5}
    with_torque = joint.acceleration(q, v, {"angle": 1.0}, {"external_torque": 0.7})["angle"]
    assert with_torque == pytest.approx(inner.acceleration(q, v, {"angle": 1.7}, {})["angle"])
    lost = joint.dissipated_power(q, v, {"angle": 1.0}, {"external_torque": 0.7})
    assert lost == pytest.approx(inner.dissipated_power(q, v, {"angle": 1.7}, {}) - 0.7 * 0.5)
    assert [each.name for each in joint.inputs] == ["external_torque"]
    assert dataclasses.asdict(joint.inputs[0])["unit"] == "N m"
