"""Contraction and force of a joint follow from its two pressures alone: within 3 % of their ranges
if the friction is known, and within 8 % if it is 30 % smaller or greater. The muscles have the
friction of a DMSP-20; pressures have noise and the resolution of 12 bits. The air is polytropic.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import airmuscle as am
from airmuscle.control import ExtendedKalmanFilter, UnscentedKalmanFilter
from airmuscle.engine import Schedule
from airmuscle.physics import Dahl, PressureScaledFriction

pytestmark = pytest.mark.slow
H = 5e-3
DURATION = 6.0
RESOLUTION = 6e5 / 4096
QUANTITIES = ("left.contraction", "right.contraction", "left.force", "right.force", "angle")


def joint(scale):
    """The joint of the library with pressure regulators, with the friction of both muscles times
    `scale`.
    """
    friction = PressureScaledFriction(
        Dahl(34e3, 38.0 * scale), ambient_ratio=0.21, reference_pressure=6e5
    )
    plant = replace(am.load("joint-dmsp-20-regulators").plant, gas=am.Polytropic(1.2))
    return replace(
        plant, muscle=tuple(replace(muscle, friction=friction) for muscle in plant.muscles)
    )


@pytest.fixture(scope="module")
def recorded():
    """The initial state, the true columns at the samples, and a recording with measured
    pressures.
    """
    truth = joint(1.0)
    start = am.find_equilibrium(truth, pressure=2.5e5)
    time = H * np.arange(round(DURATION / H) + 1)
    swing = 1.2e5 * np.sin(np.pi * time) * np.minimum(time, 1.0)
    signs = {"left.setpoint": 1.0, "right.setpoint": -1.0}
    command = Schedule(
        {
            name: tuple(zip(time.tolist(), (2.5e5 + sign * swing).tolist(), strict=True))
            for name, sign in signs.items()
        }
    )
    run = am.simulate(truth, command, duration=DURATION, initial_state=start, output_times=H)
    _, rows = np.unique(np.round(run["time"] / H), return_index=True)
    true = {name: run[name][rows] for name in run}
    rng = np.random.default_rng(1)
    measured = dict(true)
    for name in ("left.pressure", "right.pressure"):
        noisy = true[name] + rng.normal(scale=500.0, size=rows.size)
        measured[name] = np.round(noisy / RESOLUTION) * RESOLUTION
    return start, true, am.Recording(measured, "measured")


@pytest.mark.parametrize("kind", [ExtendedKalmanFilter, UnscentedKalmanFilter])
@pytest.mark.parametrize(("scale", "bar"), [(1.0, 0.03), (0.7, 0.08), (1.3, 0.08)])
def test_the_greatest_error_after_one_second_is_within_the_bar(kind, scale, bar, recorded):
    start, true, measured = recorded
    noise = {"left.air_mass": 1e-6, "right.air_mass": 1e-6, "angular_speed": 0.3}
    variances = dict.fromkeys(("left.pressure", "right.pressure"), 520.0)
    judged = kind(joint(scale), tuple(variances), H, noise, variances)
    deviations = {
        "left.air_mass": 2e-6,
        "right.air_mass": 2e-6,
        "angle": 0.05,
        "angular_speed": 0.01,
    }
    first = judged.start(
        {**start, "angle": start["angle"] + 0.02}, {**deviations, "left.bristle": 1e-3}
    )
    estimated = judged.estimate(measured, first)
    late = estimated["time"] > 1.0
    errors = {
        name: np.abs(estimated[name] - true[name])[late].max() / np.ptp(true[name])
        for name in QUANTITIES
    }
    assert max(errors.values()) <= bar, errors
