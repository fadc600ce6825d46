"""What physics leaves is found in made episodes: a torque that the physics does not know, and
nothing where there is none.
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass, replace

import numpy as np
import pytest
from arm_episodes import known_arm, made_episodes

from airmuscle.bench import ResidualGain, fit_residual

ARM = known_arm()


def pulled_arm():
    """The joint whose first muscle pulls with 20 N and 360 N per contraction more than the physics
    of ARM knows.
    """
    law = replace(ARM.muscle[0].contractile, passive_force=(8.0, 400.0))
    return replace(ARM, muscle=(replace(ARM.muscle[0], contractile=law), ARM.muscle[1]))


def test_an_unmodelled_torque_is_found():
    """0.03 m times the force that the physics lacks, at 1.5 bar, where the record has been."""
    lines = []
    found, joints = fit_residual(
        ARM, made_episodes(24, arm=pulled_arm()), centres=8, progress=lines.append
    )
    assert joints == [1]
    assert lines[0].startswith("residual of joint 1, ridge of 50: -")
    for angle in (0.2, 0.5, 0.8):
        forces = [
            arm.muscle[0].contractile.force(1.5e5, 0.03 / 0.3 * angle)
            for arm in (pulled_arm(), ARM)
        ]
        place = {"m0.pressure": 1.5e5, "m1.pressure": 1.5e5}
        torque = found.mechanism.residual.evaluate([angle], place)[0][0]
        assert torque == pytest.approx(0.03 * (forces[0] - forces[1]), rel=0.3)


def test_physics_suffices_where_it_is_the_truth():
    found, joints = fit_residual(ARM, made_episodes(24), centres=8)
    assert joints == []
    assert set(found.mechanism.residual.energies) == {0.0}


def test_a_weight_that_is_confirmed_comes_before_one_with_a_smaller_error(monkeypatch):
    """Of a measured arm the weak ridge improved a joint by 32 % and spoilt another by 9 %, the
    strong one by 25 and 0 %: the joint had no residual."""
    module = importlib.import_module("airmuscle.bench.joint.free_run")
    errors = {50.0: (0.75, 1.0), 5.0: (0.68, 1.09)}

    @dataclass
    class Trial:
        arm: object
        windows: object
        joint: int
        paths: tuple
        seed: int
        prior: dict
        ridge: float = 0.0
        initial_values = np.zeros(1)

        def descend(self, search, stage, number):
            lags = (self.ridge / 1e3, *self.arm.lags[1:])
            return 1.0, self.arm if self.joint else replace(self.arm, lags=lags)

    monkeypatch.setattr(module, "JointProblem", Trial)
    monkeypatch.setattr(
        module,
        "run_errors",
        lambda arm, w: np.ones((len(w), 40, 2)) * errors.get(1e3 * arm.lags[0], (1.0, 1.0)),
    )
    found, joints = fit_residual(known_arm(2), made_episodes(20, joints=2), centres=2)
    assert (joints, found.lags[0]) == ([1], 0.05)


def test_a_joint_has_a_residual_only_with_a_gain_near_the_data_and_no_loss_far_from_it():
    physics = np.ones((40, 5, 2))
    hybrid = physics * [0.8, 1.0]
    distance = np.arange(40.0)
    assert [ResidualGain(physics, hybrid, distance).accepts(joint) for joint in (0, 1)] == [
        True,
        False,
    ]
    hybrid[37:] = [1.2, 1.0]
    gain = ResidualGain(physics, hybrid, distance)
    assert not gain.accepts(0)
    assert gain.change(far=True) == pytest.approx([0.2, 0.0])
    assert (
        str(gain)
        == "-20, +0 % of the rms error of joints 1 to 2 near the data, +20, +0 % far from it"
    )
