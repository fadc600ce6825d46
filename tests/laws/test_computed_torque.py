"""Computed torque: at the pressures of the law the plant has the wanted acceleration and stiffness;
the error of a tracked joint then obeys the chosen linear equation.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from control_plants import CIRCUIT, MECHANISM, MUSCLES

import airmuscle as am
from airmuscle.control import AntagonisticInverse, ComputedTorque
from airmuscle.engine import ControlLoop, Measurement
from airmuscle.errors import ParameterError
from airmuscle.physics import LinearDamper, stiffness

DAMPED = tuple(replace(muscle, damper=LinearDamper(150.0)) for muscle in MUSCLES)
PLANT = am.Plant(DAMPED, (CIRCUIT, CIRCUIT), MECHANISM)
LAW = ComputedTorque(
    AntagonisticInverse(DAMPED, MECHANISM, 0.2e5, 5e5),
    ("left.pressure", "right.pressure"),
    12.0,
    0.8,
)


def measurement(angle, speed, wanted):
    columns = {"angle": angle, "angular_speed": speed}
    return Measurement(columns, wanted, dict.fromkeys(LAW.commanded, (0.0, 5e5)))


@pytest.mark.parametrize(("angle", "speed"), [(0.0, 0.0), (0.2, 0.4), (-0.15, -0.8)])
def test_the_plant_has_the_wanted_acceleration_and_stiffness(angle, speed):
    wanted = {"angle": angle + 0.01, "angular_speed": 0.3, "acceleration": 2.0, "stiffness": 12.0}
    pressures, _ = LAW.step({}, measurement(angle, speed, wanted), 0.01)
    state = PLANT.state_at(pressure=tuple(pressures.values()), angle=angle, angular_speed=speed)
    rates = PLANT.rates(state, dict.fromkeys(PLANT.inputs, 0.0))
    assert rates["angular_speed"] == pytest.approx(
        2.0 + 2 * 0.8 * 12.0 * (0.3 - speed) + 144.0 * 0.01, rel=1e-9
    )
    still = PLANT.state_at(pressure=tuple(pressures.values()), angle=angle)
    assert stiffness(PLANT, still).coordinates["angle"].constant_pressure == pytest.approx(
        12.0, rel=1e-9
    )


def test_a_joint_with_fast_regulators_follows_a_sine():
    """The error stays below 5 % of the amplitude; with the compiled loop."""
    valve = am.Valve(5e-8, 0.4)
    regulator = replace(
        am.load("joint-dmsp-20-regulators").plant.circuits[0], fill=valve, discharge=valve
    )
    fast = replace(
        regulator, lag=replace(regulator.lag, frequency=80.0), max_setpoint=5e5, band=2e3
    )
    plant = am.Plant(DAMPED, (fast, fast), MECHANISM)
    law = replace(LAW, commanded=("left.setpoint", "right.setpoint"), frequency=25.0)
    h = 5e-3
    w = 2 * np.pi * 0.5
    size = 0.15
    time = h * np.arange(601)
    wanted = {
        "angle": size * (1 - np.cos(w * time)),
        "angular_speed": size * w * np.sin(w * time),
        "acceleration": size * w**2 * np.cos(w * time),
        "stiffness": np.full(time.size, 12.0),
    }
    signal = am.SampledSignal(
        {n: tuple(zip(time.tolist(), v.tolist(), strict=True)) for n, v in wanted.items()}
    )
    first = measurement(0.0, 0.0, {name: float(values[0]) for name, values in wanted.items()})
    pressures = tuple(float(p) for p in LAW.step({}, first, h)[0].values())
    start = plant.state_at(pressure=pressures, angle=0.0, angular_speed=0.0)
    run = am.simulate(
        plant, ControlLoop(law, h, signal), duration=3.0, initial_state=start, output_times=h
    )
    assert "compiled with the plant" in " ".join(run.notes)
    assert np.abs(run["angle"] - run["setpoint.angle"])[run["time"] > 0.5].max() < 0.05 * size


def test_two_pressures_are_commanded():
    with pytest.raises(ParameterError, match="ComputedTorque: 1 commanded pressures; name two"):
        replace(LAW, commanded=("left.pressure",))
