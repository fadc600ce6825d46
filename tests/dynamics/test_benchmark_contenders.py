"""Contenders of the control benchmark that are called from Python, and gains that are commissioned
on a truth.

A controller that is no control law meets the same sensors and the same actuation as one that is
compiled. Gains are sought by runs of a motion on the truth, judged by the encoder alone, with the
same number of runs for all.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from benchmark_contender import JOINT, MINE, SHORT
from called_controller import Called
from contender_set import standard_contenders
from joint_models import on_off_joint

from airmuscle.control import WithStuckValve
from airmuscle.core import leaves
from airmuscle.design import (
    STANDARD_TASKS,
    Contender,
    Group,
    RunKey,
    SineMotion,
    StuckValve,
    commission,
    compare_controllers,
    find_tasks,
)
from airmuscle.design.control_comparison import (
    PassedSignals,
    alike,
    complete,
    run_task,
    tracking_errors,
)
from airmuscle.design.tuning import with_gains
from airmuscle.engine import Measurement
from airmuscle.errors import ParameterError


def test_a_controller_that_is_called_meets_the_same_sensors_and_the_same_actuation():
    """The same law, called from Python at each sample: the same run, also with a valve that
    sticks.
    """
    called = Contender("called", Called(MINE.law))
    again = compare_controllers(JOINT, [called], [SHORT], sets_per_gain=10, commissioning_runs=0)
    assert again.results[0].tuning is None
    found = again.metric("called", "short sine", "rmse").median
    mine = compare_controllers(JOINT, [MINE], [SHORT], sets_per_gain=0, commissioning_runs=0)
    assert found == pytest.approx(mine.metric("mine", "short sine", "rmse").median, rel=1e-3)
    stuck = replace(SHORT, name="stuck", stuck=StuckValve("left.discharge", 0.4, 0.1))
    (result,) = compare_controllers(
        JOINT, [called], [stuck], sets_per_gain=0, commissioning_runs=0
    ).results
    record = result.runs[RunKey(Group.MODELS, JOINT.truths[0].name, "stuck")].recording
    assert np.unique(record["left.discharge"][record["time"] > 0.401]) == pytest.approx([0.1])
    with pytest.raises(
        ParameterError,
        match=r"Called has no declared parameter 'gain' to be tuned; there are inner\.gain",
    ):
        replace(called, bounds={"gain": (1e5, 5e5)})
    with pytest.raises(ParameterError, match="commands angle; allowed are 'difference'"):
        complete(JOINT, Contender("wrong", Called(PassedSignals(("angle",)))))
    with pytest.raises(
        ParameterError,
        match=(
            r"measures 'left\.force'; the joint has sensors of .* airmuscle tune FILE.toml, whose"
            r" table"
        ),
    ):
        complete(JOINT, Contender("wrong", Called(PassedSignals(("left.force",)))))


@pytest.mark.parametrize(("late", "samples"), [(3.0, 3), (3.2, 4), (3.5, 4)])
def test_a_valve_sticks_at_the_first_sample_at_or_after_its_time(late, samples):
    """Also behind a called controller; `late` is the time in samples."""
    law = complete(JOINT, Contender("called", Called(MINE.law))).law
    dt = JOINT.sample_time
    stuck = replace(
        law, actuation=WithStuckValve(law.actuation, "left.discharge", late * dt, 0.123)
    )
    zeros = [dict.fromkeys(names, 0.0) for names in (stuck.measured_columns, stuck.setpoints)]
    measurement = Measurement(*zeros, dict.fromkeys(stuck.inputs, (0.0, 1.0)))
    memory = stuck.init()
    found = []
    for _ in range(6):
        commands, memory = stuck.step(memory, measurement, dt)
        found.append(commands["left.discharge"] == 0.123)
    assert found == [False] * samples + [True] * (6 - samples)


def test_commissioned_gains_follow_the_truth_better_than_those_before_and_the_ends_of_their_ranges():
    contender = next(
        each for each in standard_contenders(JOINT) if each.name == "feed-forward + PID"
    )
    completed = complete(JOINT, contender)
    truth = JOINT.truths[0]
    task = replace(SHORT, begin=0.0, duration=1.2)
    found = commission(JOINT, truth, completed.law, completed.commissioned, [task], runs=25)
    assert [path.rpartition(".")[2] for path in found.gains] == [
        "lead_time",
        "amplitude",
        "position_gain",
        "speed_gain",
        "acceleration_gain",
    ]
    assert found.runs <= 25
    assert found.after < 0.5 * found.before

    def error(gains):
        errors = tracking_errors(JOINT, truth, with_gains(completed.law, gains), task)
        return np.sqrt(np.mean(errors**2))

    assert error(found.gains) == pytest.approx(found.after)
    for path, (low, high) in completed.commissioned.items():
        assert low <= found.gains[path] <= high
        assert found.after < min(error({**found.gains, path: value}) for value in (low, high)), path


def test_a_commissioning_counts_the_strokes_of_the_valves_as_the_tuning_does():
    """As one more error, so that the mean square of all is that of the error and of the weighted
    strokes together.
    """
    completed = complete(JOINT, MINE)
    truth = JOINT.truths[0]
    task = replace(SHORT, begin=0.7)  # from which on a commissioning judges
    errors = tracking_errors(JOINT, truth, completed.law, task)
    strokes = run_task(JOINT, truth, completed.law, task).metrics.strokes
    weighted = np.radians(JOINT.objective.travel_weight * strokes)
    assert strokes > 1.0
    assert errors[-1] == pytest.approx(weighted * np.sqrt(errors.size - 1), rel=1e-3)
    careless = replace(JOINT, objective=replace(JOINT.objective, travel_weight=0.0))
    np.testing.assert_array_equal(
        tracking_errors(careless, truth, completed.law, task), [*errors[:-1], 0.0]
    )
    switched = on_off_joint((11,))
    law = complete(
        switched, next(each for each in standard_contenders(switched) if each.name == "PID")
    ).law
    assert tracking_errors(switched, switched.truths[0], law, task)[-1] == 0.0


def test_a_commissioning_has_no_more_runs_than_it_is_given():
    contender = next(each for each in standard_contenders(JOINT) if each.name == "PID")
    completed = complete(JOINT, contender)
    task = replace(SHORT, begin=0.0, duration=0.9)
    for runs in (1, 3, 7):
        found = commission(
            JOINT, JOINT.truths[0], completed.law, completed.commissioned, [task], runs=runs
        )
        assert found.runs == runs
        assert found.after <= found.before


def test_a_contender_takes_the_gains_of_another_one_by_the_ends_of_their_paths():
    by_name = {each.name: complete(JOINT, each).law for each in standard_contenders(JOINT)}
    lqg = by_name["feed-forward + LQG"]
    mpc = by_name["feed-forward + MPC"]
    tuned = complete(
        JOINT,
        next(each for each in standard_contenders(JOINT) if each.name == "feed-forward + LQG"),
    ).bounds
    paths = dict(zip(tuned, alike(mpc, dict.fromkeys(tuned, 1.0)), strict=True))
    assert {path.rpartition(".")[2]: other for path, other in paths.items()} == {
        "lead_time": "controller.feed_forward.feed_forward.lead_time",
        "amplitude": "controller.feed_forward.feedback.feed_forward.amplitude",
        "permitted_angle": "controller.design.permitted_angle",
        "speed_noise": "controller.design.speed_noise",
        "disturbance_noise": "controller.design.disturbance_noise",
        "pressure_time": "controller.design.pressure_time",
        "speed_deviation": "controller.design.speed_deviation",
        "gain": "actuation.inner.gain",
    }
    assert {leaf.path for leaf in leaves(lqg)} >= set(tuned)


def test_super_twisting_follows_with_the_limit_of_the_flow():
    """Where its integral took up what the valves attain, its error was 6 degrees in every task."""
    twisting = next(each for each in standard_contenders(JOINT) if "twisting" in each.name)
    law = complete(JOINT, twisting, 1).law
    assert "tracking=True" in repr(law)
    (task,) = find_tasks(("ramp",))
    assert run_task(JOINT, JOINT.truths[0], law, task).metrics.rmse < 1.0


def test_a_commissioning_corrects_its_derivatives_by_its_steps(monkeypatch):
    """A quadratic error of five gains: with 10 runs, five of which are the first derivatives, 0.02
    % of it are left.

    With derivatives measured anew after each step there would be one step, and 9 % would be left.
    """
    completed = complete(
        JOINT, next(each for each in standard_contenders(JOINT) if each.name == "feed-forward")
    )
    paths, rng = list(completed.commissioned), np.random.default_rng(4)
    matrix = rng.normal(size=(40, 5))
    ends = [completed.commissioned[path] for path in paths]

    def errors(joint, truth, law, task):
        known = {leaf.path: leaf.value for leaf in leaves(law)}
        x = np.array(
            [
                (known[path] - low) / (high - low) - 0.6
                for path, (low, high) in zip(paths, ends, strict=True)
            ]
        )
        return matrix @ (x + 0.3 * x**2)

    monkeypatch.setattr("airmuscle.design.control_comparison.commissioning.tracking_errors", errors)
    found = commission(
        JOINT, JOINT.truths[0], completed.law, completed.commissioned, [SHORT], runs=10
    )
    assert found.after < 1e-3 * found.before


def test_a_commissioning_covers_the_frequencies_that_are_judged_and_no_gain_is_misused_against_its_torque():
    """The torque is not in the task of the motions, and its mean over the judged time of the other
    one, from 0.7 s on, is 0.
    """
    motions, step = JOINT.commissioning_tasks
    judged = {
        task.motion.frequency for task in STANDARD_TASKS if isinstance(task.motion, SineMotion)
    }
    sines = {part.frequency for part in motions.motion.parts if isinstance(part, SineMotion)}
    assert max(sines) > max(judged)
    assert not sines & judged
    assert not motions.torque
    time = np.linspace(0.7, step.duration, 100_001)
    torque = np.interp(time, *np.array(step.torque).T)
    assert torque.max() == -torque.min() == 1.0
    assert torque.mean() == pytest.approx(0.0, abs=0.01)
    switched = on_off_joint((11,))
    assert switched.commissioning_tasks == switched.tuning_tasks
