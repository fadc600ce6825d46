"""The unknown numbers of a joint of library muscles are found from episodes: a plant of known
numbers makes the record.

The readings of the pressures have zeros of their own, and the search starts from the numbers of the
library.
"""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_line import airmuscle

import airmuscle as am
from airmuscle.bench import Episode, Episodes, fit_known_joint
from airmuscle.core import tree
from airmuscle.engine import RungeKutta4, SampledSignal, simulate_batch
from airmuscle.errors import IdentificationError, ParameterError
from airmuscle.physics import PressureDriven

STEP = 0.01
ROWS = 95
COUNT = 24
TRUTH = {
    "mechanism.inertia": 0.03,
    "mechanism.damping": 0.5,
    "mechanism.offset": 0.12,
    "mechanism.weight_torque": 3.0,
    "lags[0]": 0.04,
    "lags[1]": 0.03,
}
ZEROS = (8e3, -5e3)
JOINT = PressureDriven(
    *((p := am.load("joint-dmsp-20-matrix").plant).muscles, p.mechanism), (0.02, 0.02)
)


def known(**changed):
    """The joint with the true numbers."""
    values = {**TRUTH, **changed}
    return tree.unflatten(JOINT, [values.get(leaf.path, leaf.value) for leaf in tree.leaves(JOINT)])


@pytest.fixture(scope="module")
def episodes():
    rng = np.random.default_rng(0)
    truth = known()
    knots = np.linspace(0.0, STEP * ROWS, 12)
    levels = rng.uniform(1e5, 4e5, (COUNT, 2, len(knots)))
    names = [f"{prefix}measured_pressure" for prefix in truth.prefixes]
    signals = [
        SampledSignal(
            {
                n: tuple(zip(knots.tolist(), p.tolist(), strict=True))
                for n, p in zip(names, each, strict=True)
            }
        )
        for each in levels
    ]
    start = {s.name: np.zeros(COUNT) for s in truth.states}
    start |= {f"{prefix}pressure": levels[:, i, 0] for i, prefix in enumerate(truth.prefixes)}
    times = STEP * np.arange(ROWS)
    run = simulate_batch(
        truth,
        {},
        signals,
        duration=float(times[-1]),
        initial_states=start,
        output_times=times,
        integrator=RungeKutta4(STEP / 10),
        keep=["angle", "angular_speed", *names],
    )
    angle, speed = (run[name][..., None] for name in ("angle", "angular_speed"))
    angle = angle + 5e-4 * rng.standard_normal(angle.shape)
    pressure = np.stack([run[name] for name in names], axis=-1) + ZEROS
    return Episodes(tuple(map(Episode, angle, speed, pressure)), STEP)


def test_the_numbers_of_the_plant_are_found_within_their_standard_errors(episodes):
    lines = []
    fit = fit_known_joint(JOINT, episodes, progress=lines.append)
    found = {each.path: each for each in fit.estimates}
    assert found.keys() == TRUTH.keys()
    for path, value in TRUTH.items():
        assert found[path].value == pytest.approx(value, rel=0.03)
        assert abs(found[path].value - value) < 4.0 * found[path].standard_error
    assert np.degrees(fit.rms[0]) < 0.06  # the noise of the angles is 0.03 deg
    assert fit.skill[0] > 0.9
    zeros = [
        float(remark.partition(": ")[2].split()[0])
        for remark in fit.remarks
        if remark.startswith("zero of")
    ]
    np.testing.assert_allclose(zeros, ZEROS, atol=1500.0)
    assert lines[0].startswith("8 parameters")
    np.testing.assert_allclose(fit.uncertainty().covariance.shape, (6, 6))


def test_numbers_that_no_such_joint_has_are_named(episodes):
    """A sample time of 100 ms in place of 10 ms predicts well (skill 0.95), with a hundred times
    the inertia.
    """
    assert not [r for r in fit_known_joint(JOINT, episodes).remarks if "wrong sample time" in r]
    slow = replace(
        episodes,
        sample_time=10 * STEP,
        runs=tuple(replace(run, speed=run.speed / 10) for run in episodes.runs),
    )
    (remark,) = [r for r in fit_known_joint(JOINT, slow).remarks if "wrong sample time" in r]
    assert re.match(
        r"mechanism.inertia is 3.\d+, 6\d.\d times its first value; mechanism.damping is 1", remark
    )
    assert "lags[0] is 0.39" in remark
    tenth = replace(
        episodes,
        runs=tuple(
            replace(run, angle=run.angle / 10, speed=run.speed / 10) for run in episodes.runs
        ),
    )
    assert any(
        "zeros[1] ends at the limit of its range, -5e+05" in r
        for r in fit_known_joint(JOINT, tenth).remarks
    )


def test_only_the_named_numbers_change(episodes):
    fit = fit_known_joint(
        known(**{"mechanism.inertia": 0.05}), episodes, ("mechanism.inertia", "zeros")
    )
    assert [each.path for each in fit.estimates] == ["mechanism.inertia"]
    assert fit.estimates[0].value == pytest.approx(0.03, rel=0.02)
    assert fit.arm.mechanism.damping == 0.5


def test_the_gains_of_the_readings_are_found_by_the_force_of_the_rubber(episodes):
    """A known force that does not grow with the pressure fixes the scale of pressures and inertia
    together.
    """
    scaled = replace(
        episodes,
        runs=tuple(replace(run, pressure=run.pressure / [1.1, 0.95]) for run in episodes.runs),
    )
    fit = fit_known_joint(
        known(**{"mechanism.inertia": 0.05}), scaled, ("mechanism.inertia", "gains", "zeros")
    )
    gains = [
        float(remark.partition(": ")[2].split()[0])
        for remark in fit.remarks
        if remark.startswith("gain of")
    ]
    np.testing.assert_allclose(gains, [1.1, 0.95], rtol=0.02)
    assert fit.estimates[0].value == pytest.approx(0.03, rel=0.02)


def test_impossible_requests_are_refused(episodes):
    with pytest.raises(ParameterError, match=r"no parameter 'mechanism.inertai'; .* Did you mean"):
        fit_known_joint(JOINT, episodes, ("mechanism.inertai",))
    with pytest.raises(
        ParameterError,
        match="episodes: 24, of which a share of 1 is left out; give 4 episodes or more",
    ):
        fit_known_joint(JOINT, episodes, left_out=1.0)
    twice = replace(
        episodes,
        runs=tuple(replace(run, angle=np.hstack([run.angle] * 2)) for run in episodes.runs),
    )
    with pytest.raises(
        ParameterError, match="have 2 pressures and 2 angles, the arm 2 muscles and 1 coordinates"
    ):
        fit_known_joint(JOINT, twice)
    with pytest.raises(
        ParameterError,
        match=r"the mapping states the pairs \[\(2, 1\)\], the joint has \[\(1, 2\)\]",
    ):
        fit_known_joint(JOINT, episodes, pairs=((2, 1),))


def test_pressures_in_the_order_of_the_other_muscles_are_named(episodes):
    crossed = replace(
        episodes, runs=tuple(replace(run, pressure=run.pressure[:, ::-1]) for run in episodes.runs)
    )
    with pytest.raises(
        IdentificationError,
        match=r"muscles are exchanged: .* pressure 1 raises angle 1, the record that",
    ):
        fit_known_joint(JOINT, crossed)


def test_the_command_takes_the_scenario_of_a_joint(episodes, tmp_path):
    np.savez(
        tmp_path / "all.npz",
        start=np.cumsum([0, *map(len, episodes.runs)]),
        q=episodes.rows("angle"),
        v=episodes.rows("speed"),
        p=episodes.rows("pressure"),
    )
    (tmp_path / "arm.toml").write_text(
        'sample_time = "10 ms"\nstarts = "start"\n[angles]\ncolumns = "q"\n[speeds]\ncolumns ='
        ' "v"\n[pressures]\ncolumns = "p"\n'
    )
    (tmp_path / "joint.toml").write_text(
        '[plant]\nlibrary = "joint-dmsp-20-matrix"\n[run]\nduration = "1 s"\n'
    )
    given = ("fit-joint", tmp_path / "all.npz", "--mapping", tmp_path / "arm.toml")
    done = airmuscle(
        *map(str, (*given, "--known", tmp_path / "joint.toml", "--out", tmp_path / "out"))
    )
    assert done.exit_code == 0, done.output
    scenario = am.files.load_scenario(tmp_path / "out" / "scenario.toml")
    assert scenario.plant.mechanism.inertia == pytest.approx(0.03, rel=0.05)
    varied = am.environments.FitUncertainty(scenario.uncertainty).variations(scenario.plant, 50)[
        "mechanism.inertia"
    ]
    assert 0.0 < varied.std() < 0.003
    controlled = Path(tmp_path / "out" / "controlled.toml")
    done = airmuscle(
        *map(str, ("tune", controlled, "--simulations", "80", "--out", tmp_path / "tuning"))
    )
    assert done.exit_code == 0, done.output
    assert "drawn 4" in done.output  # from the covariance of the fit
    loop = am.files.load_scenario(tmp_path / "out" / "controlled-tuned.toml")
    run = am.solve(loop.problem).recording
    assert run["angle"][-1] == pytest.approx(run["setpoint.angle"][-1], rel=0.1)
    refused = airmuscle(*map(str, (*given, "--free", "mechanism.inertia")))
    assert "--free requires --known, the scenario of the joint" in " ".join(refused.output.split())
