"""Control of angle and stiffness: the pressures give tau = tau_0(theta_r) + J a_r + K e + I - D
omega and k_r, I' = K/T_i e.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from control_plants import INVERSE, MECHANISM

from airmuscle.control import AngleAndStiffness
from airmuscle.engine import Measurement

NAMES = ("left.pressure", "right.pressure")
LAW = AngleAndStiffness(INVERSE, NAMES)
WANTED = 0.2
STIFFNESS = 7.0
H = 0.01
WEIGHT = MECHANISM.weight_torque * np.sin(WANTED)


def sampled(law, angle, memory=None, speed=0.0, acceleration=0.0):
    """Torque and stiffness of the commanded pressures at the wanted angle, and the memory for the
    next sample.
    """
    columns = {"angle": angle, "angular_speed": speed}
    setpoints = {"angle": WANTED, "stiffness": STIFFNESS, "acceleration": acceleration}
    ranges = dict.fromkeys(NAMES, (0.0, 5e5))
    commands, later = law.step(
        memory or dict(law.initial_memory), Measurement(columns, setpoints, ranges), H
    )
    first, second = (commands[name] for name in NAMES)
    return (INVERSE.torque(first, second, WANTED), INVERSE.stiffness(first, second, WANTED)), later


def test_at_the_wanted_angle_the_pressures_hold_the_weight_with_the_wanted_stiffness():
    found, later = sampled(replace(LAW, gain=3.0, integral_time=0.5), WANTED)
    assert found == pytest.approx((WEIGHT, STIFFNESS), rel=1e-6)
    assert later == {"integral": 0.0}


@pytest.mark.parametrize("error", [-0.1, 0.05])
def test_an_error_and_a_speed_change_the_torque_by_their_gains_and_not_the_stiffness(error):
    law = replace(LAW, gain=3.0, speed_gain=0.2, speed_column="angular_speed")
    found, later = sampled(law, WANTED - error, speed=0.7)
    assert found == pytest.approx((WEIGHT + 3.0 * error - 0.2 * 0.7, STIFFNESS), rel=1e-6)
    assert later == {"integral": 0.0}  # without an integral time there is no integral


def test_a_wanted_acceleration_adds_the_torque_of_the_inertia():
    found, _ = sampled(replace(LAW, acceleration_setpoint="acceleration"), WANTED, acceleration=4.0)
    assert found[0] == pytest.approx(WEIGHT + MECHANISM.inertia * 4.0, rel=1e-6)
    assert sampled(LAW, WANTED, acceleration=4.0)[0][0] == pytest.approx(WEIGHT, rel=1e-6)


def test_the_integral_of_the_error_is_added_from_the_next_sample_on_up_to_its_limit():
    law = replace(LAW, gain=3.0, integral_time=0.5, max_integral=0.0145)
    memory = None
    integrals = []
    for _ in range(7):
        found, memory = sampled(law, WANTED - 0.05, memory)
        integrals.append(found[0] - WEIGHT - 3.0 * 0.05)
    assert integrals == pytest.approx([min(0.003 * k, 0.0145) for k in range(7)], abs=1e-7)
    assert sampled(law, WANTED + 0.5, memory)[1]["integral"] == -0.0145
