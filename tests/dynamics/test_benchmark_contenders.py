"""Contenders of the control benchmark that are called from Python, and a gain that is identified on the truth.

A controller that is no control law meets the same sensors and the same actuation as one that is compiled. A gain is
identified by runs of a motion on the truth, judged by the encoder alone.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from benchmark_contender import JOINT, MINE, SHORT
from called_controller import Called

from airmuscle.design import Contender, StuckValve, benchmark_controllers, standard_contenders
from airmuscle.design.control_benchmark import Readings, complete, identify_gains, tracking_error
from airmuscle.design.tuning import with_gains
from airmuscle.engine import Measurement
from airmuscle.errors import ParameterError


def test_a_controller_that_is_called_meets_the_same_sensors_and_the_same_actuation():
    """The same law, called from Python at each sample: the same run, also with a valve that sticks."""
    called = Contender("called", Called(MINE.law))
    again = benchmark_controllers(JOINT, [called], [SHORT], budget=10)
    assert again.contenders[0].tuning is None
    found = again.metric("called", "short sine", "rmse")
    mine = benchmark_controllers(JOINT, [MINE], [SHORT], budget=0)
    assert found == pytest.approx(mine.metric("mine", "short sine", "rmse"), rel=1e-3)
    stuck = replace(SHORT, name="stuck", stuck=StuckValve("left.discharge", 0.4, 0.1))
    record = benchmark_controllers(JOINT, [called], [stuck], budget=0).runs["called", "stuck"].recording
    assert np.unique(record["left.discharge"][record["time"] > 0.401]) == pytest.approx([0.1])
    with pytest.raises(
        ParameterError, match=r"Called has no declared parameter 'gain' to be tuned; there are inner\.gain"
    ):
        replace(called, bounds={"gain": (1e5, 5e5)})
    with pytest.raises(ParameterError, match="commands angle; allowed are 'difference'"):
        complete(JOINT, Contender("wrong", Called(Readings(("angle",)))))
    with pytest.raises(ParameterError, match=r"measures 'left\.force'; the joint has sensors of"):
        complete(JOINT, Contender("wrong", Called(Readings(("left.force",)))))


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


def test_the_gains_that_are_identified_follow_the_truth_better_than_the_ends_of_their_ranges():
    contender = next(each for each in standard_contenders(JOINT) if "compensated" in each.name)
    law = complete(JOINT, contender).law
    task = replace(SHORT, begin=0.0, duration=1.2)
    bounds = {"lead_time": (0.001, 0.1), "amplitude": (10.0, 5e4), "acceleration_gain": (-500.0, 500.0)}
    assert [(path.rsplit(".", 1)[1], pair) for path, pair in contender.identified.items()] == list(bounds.items())
    gains, runs = identify_gains(JOINT, law, bounds, task)
    assert [path.rsplit(".", 1)[1] for path in gains] == list(bounds)
    assert 6 < runs <= 72
    best = tracking_error(JOINT, with_gains(law, gains), task)
    for path, (low, high) in zip(gains, bounds.values(), strict=True):
        assert low < gains[path] < high
        ends = [tracking_error(JOINT, with_gains(law, {**gains, path: value}), task) for value in (low, high)]
        assert best < min(ends), path
    with pytest.raises(ParameterError, match="no declared parameter 'lag' to be identified; there are gain"):
        replace(MINE, identified={"lag": (0.0, 1.0)})
    with pytest.raises(ParameterError, match="0 gains end with 'lead'; give the end of exactly one path"):
        identify_gains(JOINT, law, {"lead": (0.0, 1.0)}, task)
