"""Contenders of the control benchmark that are called from Python, and gains that are commissioned on a truth.

A controller that is no control law meets the same sensors and the same actuation as one that is compiled. Gains are
sought by runs of a motion on the truth, judged by the encoder alone, with the same number of runs for all.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from benchmark_contender import JOINT, MINE, SHORT
from called_controller import Called

from airmuscle.core import leaves
from airmuscle.design import (
    Contender,
    Group,
    RunKey,
    StuckValve,
    benchmark_controllers,
    commission,
    standard_contenders,
)
from airmuscle.design.control_benchmark import PassedSignals, alike, complete, tracking_errors
from airmuscle.design.tuning import with_gains
from airmuscle.engine import Measurement
from airmuscle.errors import ParameterError


def test_a_controller_that_is_called_meets_the_same_sensors_and_the_same_actuation():
    """The same law, called from Python at each sample: the same run, also with a valve that sticks."""
    called = Contender("called", Called(MINE.law))
    again = benchmark_controllers(JOINT, [called], [SHORT], sets_per_gain=10, commissioning_runs=0)
    assert again.results[0].tuning is None
    found = again.metric("called", "short sine", "rmse").median
    mine = benchmark_controllers(JOINT, [MINE], [SHORT], sets_per_gain=0, commissioning_runs=0)
    assert found == pytest.approx(mine.metric("mine", "short sine", "rmse").median, rel=1e-3)
    stuck = replace(SHORT, name="stuck", stuck=StuckValve("left.discharge", 0.4, 0.1))
    (result,) = benchmark_controllers(JOINT, [called], [stuck], sets_per_gain=0, commissioning_runs=0).results
    record = result.runs[RunKey(Group.MODELS, JOINT.truths[0].name, "stuck")].recording
    assert np.unique(record["left.discharge"][record["time"] > 0.401]) == pytest.approx([0.1])
    with pytest.raises(
        ParameterError, match=r"Called has no declared parameter 'gain' to be tuned; there are inner\.gain"
    ):
        replace(called, bounds={"gain": (1e5, 5e5)})
    with pytest.raises(ParameterError, match="commands angle; allowed are 'difference'"):
        complete(JOINT, Contender("wrong", Called(PassedSignals(("angle",)))))
    with pytest.raises(
        ParameterError, match=r"measures 'left\.force'; the joint has sensors of .* with tune and simulate"
    ):
        complete(JOINT, Contender("wrong", Called(PassedSignals(("left.force",)))))


@pytest.mark.parametrize(("late", "samples"), [(3.0, 3), (3.2, 4), (3.5, 4)])
def test_a_valve_sticks_at_the_first_sample_at_or_after_its_time(late, samples):
    """As `WithStuckValve` does; `late` is the time in samples."""
    law, dt = complete(JOINT, Contender("called", Called(MINE.law))).law, JOINT.sample_time
    stuck = replace(law, stuck=StuckValve("left.discharge", late * dt, 0.123))
    zeros = [dict.fromkeys(names, 0.0) for names in (stuck.measured_columns, stuck.setpoints)]
    measurement, memory, found = Measurement(*zeros, dict.fromkeys(stuck.inputs, (0.0, 1.0))), stuck.init(), []
    for _ in range(6):
        commands, memory = stuck.step(memory, measurement, dt)
        found.append(commands["left.discharge"] == 0.123)
    assert found == [False] * samples + [True] * (6 - samples)


def test_commissioned_gains_follow_the_truth_better_than_those_before_and_the_ends_of_their_ranges():
    contender = next(each for each in standard_contenders(JOINT) if each.name == "feed-forward + PID")
    completed, truth = complete(JOINT, contender), JOINT.truths[0]
    task = replace(SHORT, begin=0.0, duration=1.2)
    found = commission(JOINT, truth, completed.law, completed.commissioned, [task], runs=25)
    assert [path.rpartition(".")[2] for path in found.gains] == [
        "lead_time", "amplitude", "position_gain", "speed_gain", "acceleration_gain",
    ]  # fmt: skip
    assert found.runs <= 25
    assert found.after < 0.5 * found.before

    def error(gains):
        errors = tracking_errors(JOINT, truth, with_gains(completed.law, gains), task)
        return np.sqrt(np.mean(errors**2))

    assert error(found.gains) == pytest.approx(found.after)
    for path, (low, high) in completed.commissioned.items():
        assert low <= found.gains[path] <= high
        assert found.after < min(error({**found.gains, path: value}) for value in (low, high)), path


def test_a_commissioning_has_no_more_runs_than_it_is_given():
    contender = next(each for each in standard_contenders(JOINT) if each.name == "PID")
    completed = complete(JOINT, contender)
    task = replace(SHORT, begin=0.0, duration=0.9)
    for runs in (1, 3, 7):
        found = commission(JOINT, JOINT.truths[0], completed.law, completed.commissioned, [task], runs=runs)
        assert found.runs == runs
        assert found.after <= found.before


def test_a_contender_takes_the_gains_of_another_one_by_the_ends_of_their_paths():
    by_name = {each.name: complete(JOINT, each).law for each in standard_contenders(JOINT)}
    lqg, mpc = by_name["feed-forward + LQG"], by_name["feed-forward + MPC"]
    tuned = complete(
        JOINT, next(each for each in standard_contenders(JOINT) if each.name == "feed-forward + LQG")
    ).bounds
    paths = dict(zip(tuned, alike(mpc, dict.fromkeys(tuned, 1.0)), strict=True))
    assert {path.rpartition(".")[2]: other for path, other in paths.items()} == {
        "lead_time": "controller.feed_forward.feed_forward.lead_time",
        "amplitude": "controller.feed_forward.feedback.feed_forward.amplitude",
        "permitted_angle": "controller.design.permitted_angle",
        "speed_noise": "controller.design.speed_noise",
        "disturbance_noise": "controller.design.disturbance_noise",
        "pressure_time": "controller.design.pressure_time",
        "gain": "actuation.inner.gain",
    }  # fmt: skip
    assert {leaf.path for leaf in leaves(lqg)} >= set(tuned)


def test_the_integral_of_super_twisting_does_not_take_up_what_the_valves_attain():
    """With tracking the integral becomes the whole command at each saturation, and the loop oscillates."""
    followed = {each.name: each.tracking for each in standard_contenders(JOINT)}
    assert not followed.pop("feed-forward + super-twisting")
    assert all(followed.values())
    twisting = next(each for each in standard_contenders(JOINT) if "twisting" in each.name)
    assert "tracking=True" not in repr(complete(JOINT, twisting, 1).law)
