"""The residual of a hybrid law gives no energy at constant pressures and is nothing far from its
data.

It is also among the plants of tests/plants.py, whose compiled and exported equations equal those of
the library.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from arm_episodes import known_arm
from numpy.testing import assert_allclose

from airmuscle.errors import ParameterError
from airmuscle.physics import GaussianResidual, WithStickSlip

COUNT = 8
RNG = np.random.default_rng(0)
PRESSURES = tuple(f"m{i}.pressure" for i in range(4))
RESIDUAL = GaussianResidual(
    PRESSURES,
    (0.5, 0.8),
    (1e5, 8e4, 1e5, 6e4),
    tuple(RNG.normal(0.0, 1.5, 6 * COUNT)),
    tuple(RNG.normal(0.0, 5.0, COUNT)),
    tuple(RNG.normal(0.0, 1.0, 2 * COUNT)),
)
ARM = known_arm(2)
HYBRID = replace(ARM.mechanism, residual=RESIDUAL)


def cycles(count=10_000, points=64):
    """Smooth closed cycles of two angles (points, count) [rad], their slopes along them, and a
    pressure for each.
    """
    s = 2 * np.pi * np.arange(points)[:, None] / points
    q = np.zeros((2, points, count))
    slope = np.zeros((2, points, count))
    for k in (1, 2, 3):
        a, b = RNG.normal(0.0, 0.6 / k, (2, 2, 1, count))
        q += a * np.cos(k * s) + b * np.sin(k * s)
        slope += k * (b * np.cos(k * s) - a * np.sin(k * s))
    return q, slope, dict(zip(PRESSURES, RNG.uniform(0.0, 3e5, (4, count)), strict=True))


def test_no_closed_cycle_at_constant_pressures_gains_energy():
    """Of 10 000: the torques do no work, and the friction, turned over in each direction, takes
    energy in every one.
    """
    q, slope, pressures = cycles()
    torques, factors = RESIDUAL.evaluate(list(q), pressures)
    work = sum(np.mean(torque * w, axis=0) for torque, w in zip(torques, slope, strict=True))
    size = sum(
        np.mean(np.abs(torque * w), axis=0) for torque, w in zip(torques, slope, strict=True)
    )
    assert np.max(np.abs(work)) < 1e-3 * np.median(size)
    friction = [
        np.mean(element.torque(np.sign(w), factor * 1.0, w) * w, axis=0)
        for element, factor, w in zip(ARM.mechanism.elements, factors, slope, strict=True)
    ]
    assert np.max(work + sum(friction)) < 0.0
    assert all(np.min(factor) > 0.0 for factor in factors)


def test_a_closed_cycle_with_shut_air_gives_the_energy_that_the_change_of_pressure_gives_the_potential():
    """The work of the torques is the integral of dV/dp dp: zero at constant pressures, of either
    sign where the pressures follow the angles.
    """
    s = 2 * np.pi * (np.arange(4000) + 0.5) / 4000
    angles = np.array([0.5 * np.cos(s), 0.4 * np.sin(s)])
    slopes = np.array([-0.5 * np.sin(s), 0.4 * np.cos(s)])
    shut = np.array([2e5 * (1 - 0.1 * k + 0.2 * angles[k % 2]) ** -1.4 for k in range(4)])
    torques, _ = RESIDUAL.evaluate(list(angles), dict(zip(PRESSURES, shut, strict=True)))
    work = sum(np.mean(torque * slope) for torque, slope in zip(torques, slopes, strict=True))

    def potential(pressures):
        x = np.array([*angles, *pressures]) / np.array(
            [*RESIDUAL.angle_scales, *RESIDUAL.pressure_scales]
        ).reshape(6, 1)
        centres = np.array(RESIDUAL.centres).reshape(COUNT, 6, 1)
        return np.exp(-np.sum((x - centres) ** 2, axis=1) / 12).T @ RESIDUAL.energies

    given = 0.0
    for k in range(4):
        step = np.zeros((4, 1))
        step[k] = 1.0
        by_pressure = (potential(shut + step) - potential(shut - step)) / 2.0
        rate = np.gradient(np.concatenate([shut[k][-2:], shut[k], shut[k][:2]]), s[1] - s[0])[2:-2]
        given += np.mean(by_pressure * rate)
    assert abs(work) > 1e-3
    assert work == pytest.approx(given, rel=1e-4)


def test_torque_and_friction_are_those_of_the_formula():
    place = {"joint1.angle": 0.3, "joint2.angle": -0.5} | dict.fromkeys(PRESSURES, 1.2e5)
    tensions = (30.0, 20.0, 10.0, 40.0)
    lengths = [0.3] * 4
    with_it, without = (
        m.generalised_forces(place, tensions, lengths) for m in (HYBRID, ARM.mechanism)
    )
    centres = np.array(RESIDUAL.centres).reshape(COUNT, 6)
    scales = np.array([*RESIDUAL.angle_scales, *RESIDUAL.pressure_scales])

    def levels(q1):
        x = np.array([q1, -0.5, *[1.2e5] * 4]) / scales
        return np.exp(-np.sum((x - centres) ** 2, axis=1) / 12)

    potential = lambda q1: np.dot(RESIDUAL.energies, levels(q1))  # noqa: E731
    slope = (potential(0.3 + 1e-5) - potential(0.3 - 1e-5)) / 2e-5
    assert with_it["joint1.angle"] - without["joint1.angle"] == pytest.approx(-slope, rel=1e-6)
    level = [
        f["joint1.angle.friction_load"] + ARM.mechanism.elements[0].coulomb_torque
        for f in (with_it, without)
    ]
    assert level[0] / level[1] == pytest.approx(
        np.exp(np.dot(RESIDUAL.friction_logs[:COUNT], levels(0.3)))
    )


def test_far_from_the_data_it_is_nothing():
    far = {"joint1.angle": 0.3, "joint2.angle": 0.1} | dict.fromkeys(PRESSURES, 4e6)
    with_it, without = (
        m.generalised_forces(far, (1.0,) * 4, [0.3] * 4) for m in (HYBRID, ARM.mechanism)
    )
    assert_allclose([*with_it.values()], [*without.values()], atol=1e-9)


def test_without_pressures_it_is_that_of_the_mean_of_its_centres():
    means = np.array(RESIDUAL.centres).reshape(COUNT, 6).mean(axis=0)[2:] * RESIDUAL.pressure_scales
    angles = [0.2, 0.1]
    known = RESIDUAL.evaluate(angles, dict(zip(PRESSURES, means, strict=True)))
    assert_allclose(RESIDUAL.evaluate(angles, {}), known, rtol=1e-12)


def test_other_numbers_of_values_are_refused():
    with pytest.raises(
        ParameterError,
        match="8 energies, 2 angle_scales and 3 pressures need 3 pressure_scales, 40 c",
    ):
        replace(RESIDUAL, pressures=PRESSURES[:3])
    with pytest.raises(
        ParameterError, match="the residual has 2 angles, SerialArm has 1; give one scale for each"
    ):
        WithStickSlip(known_arm(1).mechanism.inner, known_arm(1).mechanism.elements, RESIDUAL)
