"""Control benchmark: controllers are judged on a plant that is not their model, by metrics that are computed by hand here.

The truth has no class of characteristic, valve and friction in common with the model or with a plant of the family for
which controllers are tuned. Equal seeds give equal results. A user's law takes part as a class with two methods.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from benchmark_contender import JOINT, MINE, SHORT, AngleLaw

import airmuscle as am
from airmuscle.core import model
from airmuscle.design import (
    STANDARD_TASKS,
    Contender,
    ControlTask,
    MinimumJerkMotion,
    RampMotion,
    SineMotion,
    StepMotion,
    StuckValve,
    SumOfMotions,
    benchmark_controllers,
    find_tasks,
    learn,
    on_off_joint,
    standard_contenders,
)
from airmuscle.design.control_benchmark import RATED_STROKES, check_truth_differs, complete, kinds_of, track
from airmuscle.design.control_benchmark.task_signals import task_signals
from airmuscle.errors import ParameterError
from airmuscle.physics import LuGre, NoFriction
from airmuscle.recording import Recording

DEGREE = math.pi / 180
STEP = ControlTask("short step", StepMotion(10 * DEGREE, 0.1), 0.8, begin=0.1, event=0.1)


def chosen(*names):
    return tuple(each for each in standard_contenders(JOINT) if each.name in names)


@pytest.fixture(scope="module")
def result():
    contenders = (*chosen("PID", "feed-forward + PID"), MINE)
    return benchmark_controllers(JOINT, contenders, (SHORT, STEP), budget=0)


# The truth


@pytest.mark.parametrize("joint", [JOINT, on_off_joint()], ids=lambda joint: joint.name)
def test_the_truth_differs_in_kind_from_the_model_and_from_every_tuned_plant(joint):
    for plant in (joint.model, *joint.family.values()):
        ours, theirs = kinds_of(plant), kinds_of(joint.truth)
        for kind in ("characteristic", "valve", "friction"):
            assert ours[kind], kind
            assert theirs[kind], kind
            assert not ours[kind] & theirs[kind], kind


@pytest.mark.parametrize("kind", ["characteristic", "valve", "friction"])
def test_a_truth_of_the_same_kind_is_rejected(kind):
    truth = JOINT.truth
    left, right = truth.muscles
    changed = {
        "characteristic": replace(truth, muscle=tuple(replace(m, contractile=JOINT.model.muscles[0].contractile) for m in (left, right))),
        "valve": replace(truth, circuit=JOINT.model.circuit),
        "friction": replace(truth, muscle=tuple(replace(m, friction=NoFriction()) for m in (left, right))),
    }[kind]  # fmt: skip
    with pytest.raises(ParameterError, match=f"model and truth of the benchmark have the same {kind}"):
        check_truth_differs(JOINT.model, changed)
    with pytest.raises(ParameterError, match=f"the same {kind}"):
        replace(JOINT, truth=changed)


def test_the_truth_has_friction_heat_tubes_and_other_numbers():
    truth = JOINT.truth
    assert all(isinstance(muscle.friction, LuGre) for muscle in truth.muscles)
    names = {state.name for state in truth.states}
    assert {"left.internal_energy", "left.tube.air_mass", "left.bristle"} <= names
    inner, true = JOINT.model.mechanism.inner, truth.mechanism.inner
    assert true.inertia == pytest.approx(1.2 * inner.inertia)
    assert true.weight_torque == pytest.approx(1.3 * inner.weight_torque)
    assert truth.circuits[0].circuit.fill.conductance == pytest.approx(0.8 * JOINT.model.circuits[0].fill.conductance)


# Motions and signals


@pytest.mark.parametrize(
    "motion",
    [SineMotion(0.3, 2.0), MinimumJerkMotion(0.4, 0.2, 0.5), SumOfMotions((SineMotion(0.1, 1.0), MinimumJerkMotion(0.2, 0.0, 0.7)))],
)  # fmt: skip
def test_speed_and_acceleration_are_the_derivatives_of_the_angle(motion):
    time, h = np.linspace(0.0, 1.2, 601), 1e-5
    angle, speed, acceleration = motion.at(time)
    before, after = motion.at(time - h), motion.at(time + h)
    assert speed == pytest.approx((after[0] - before[0]) / (2 * h), abs=1e-4)
    assert acceleration == pytest.approx((after[1] - before[1]) / (2 * h), abs=2e-2)
    assert angle[0] == 0.0
    assert speed[0] == 0.0


def test_a_step_and_a_ramp_reach_their_amplitude():
    time = np.array([0.0, 0.1999999999, 0.2, 0.7, 1.2, 2.0])
    assert StepMotion(0.3, 0.2).at(time)[0] == pytest.approx([0, 0.3, 0.3, 0.3, 0.3, 0.3])
    angle, speed, _ = RampMotion(0.4, 0.2, 1.0).at(time)
    assert angle == pytest.approx([0, 0, 0, 0.2, 0.4, 0.4])
    assert speed == pytest.approx([0, 0, 0, 0.4, 0, 0])


def test_the_feed_forward_holds_the_model_at_the_wanted_angle():
    hold = ControlTask("hold", RampMotion(20 * DEGREE, 0.0, 0.1), 1.0)
    signals = task_signals(JOINT, hold)
    half, mean = float(signals.feed_forward[-1]), float(signals.mean_pressure[-1])
    reached = am.find_equilibrium(JOINT.model, pressure=(mean + half, mean - half))["angle"]
    assert reached == pytest.approx(20 * DEGREE, abs=1e-6)


def test_the_rate_of_the_feed_forward_is_its_derivative():
    signals = task_signals(JOINT, SHORT)
    differences = np.gradient(signals.feed_forward, signals.time)
    assert signals.feed_forward_rate[5:-5] == pytest.approx(differences[5:-5], abs=0.02 * np.abs(differences).max())


# Metrics


def made_record(error, commands=None, flow=0.0, duration=1.0):
    """A record at 500 Hz of SHORT or STEP whose angle differs from the set point by `error` [degree] (N,)."""
    time = np.linspace(0.0, duration, error.size)
    rows = {"time": time, "left.mass_flow": np.full(time.size, flow), "right.mass_flow": np.full(time.size, -flow)}
    rows |= {name: np.full(time.size, 2.5e5) for name in JOINT.pressures}
    for name in JOINT.truth.inputs:
        rows[f"command.{name}"] = np.zeros(time.size) if commands is None else commands(name, time)
    return rows, time


def metrics_of(task, error, **further):
    rows, time = made_record(error, duration=task.duration, **further)
    signals = task_signals(JOINT, task)
    rows["angle"] = np.interp(time, signals.time, signals.angle) - error * DEGREE
    return track(JOINT, task, signals, Recording(rows, "made", {}, ()))


def test_errors_are_judged_from_the_beginning_of_the_task_on():
    time = np.linspace(0.0, 1.0, 501)
    found = metrics_of(SHORT, np.where(time < 0.49, 7.0, 2.0))
    assert (found.rmse, found.max_error) == pytest.approx((2.0, 2.0))
    assert found.itae == pytest.approx(2.0 * 0.5**2 / 2)
    assert math.isnan(found.settling)
    assert math.isnan(found.overshoot)


def test_a_step_settles_when_the_error_remains_in_the_band():
    time = np.linspace(0.0, 0.8, 401)
    error = np.where(time < 0.1, 0.0, np.where(time < 0.4, -1.5, 0.2))
    found = metrics_of(STEP, error)
    assert found.settling == pytest.approx(0.3, abs=2.1e-3)
    assert found.overshoot == pytest.approx(15.0)
    assert found.steady == pytest.approx(0.2)
    assert metrics_of(STEP, np.full(401, 0.6)).settling == math.inf
    assert metrics_of(STEP, np.full(401, 0.4)).settling == 0.0


def test_strokes_air_and_valve_life():
    def commands(name, time):
        """The left fill valve opens and closes ten times a second, the others rest."""
        return np.where((time * 10.0) % 1.0 < 0.499, 1.0, 0.0) if name == "left.fill" else np.zeros(time.size)

    found = metrics_of(SHORT, np.zeros(501), commands=commands, flow=1.185e-3)
    assert found.strokes == pytest.approx(20.0, rel=0.1)
    assert found.valve_life == pytest.approx(2 * RATED_STROKES / found.strokes / 3600)
    assert found.air == pytest.approx(1.0), "only the air that enters a muscle counts"
    assert metrics_of(SHORT, np.zeros(501)).valve_life == math.inf


# Runs


def test_feed_forward_reduces_the_error_of_a_sine_and_a_user_law_takes_part(result):
    names = [each.name for each in result.contenders]
    assert names == ["PID", "feed-forward + PID", "mine"]
    errors = {name: result.metric(name, "short sine", "rmse") for name in names}
    assert errors["feed-forward + PID"] < errors["PID"] < 20
    assert all(run.metrics is not None for run in result.runs.values())
    assert min(result.scores().values()) >= 1.0
    assert list(result.scores().values()) == sorted(result.scores().values())


def test_the_score_is_the_geometric_mean_of_the_ratios(result):
    errors = np.array([[result.metric(c.name, t.name, "rmse") for t in result.tasks] for c in result.contenders])
    expected = np.sqrt(np.prod(errors / errors.min(axis=0), axis=1))
    assert [result.scores()[c.name] for c in result.contenders] == pytest.approx(expected)


def test_equal_seeds_give_equal_runs_and_other_seeds_other_noise(result):
    again, other = (benchmark_controllers(JOINT, [MINE], [SHORT], budget=0, seed=seed) for seed in (1, 2))
    assert again.runs["mine", "short sine"].metrics == result.runs["mine", "short sine"].metrics
    assert other.runs["mine", "short sine"].metrics != result.runs["mine", "short sine"].metrics


def test_tuning_uses_the_family_and_improves_the_objective():
    narrow = replace(JOINT, family={"nominal": JOINT.model})
    found = benchmark_controllers(narrow, [MINE], [SHORT], budget=32)
    (tuned,) = found.contenders
    assert tuned.tuning.simulated_loops <= 32
    assert tuned.tuning.objective <= tuned.tuning.present_objective
    assert {case.plant for case in tuned.tuning.cases} == {JOINT.model}
    assert set(tuned.tuning.gains) == {"law.outer.outer.gain", "law.inner.gain"}
    assert tuned.law.law.outer.outer.gain == tuned.tuning.gains["law.outer.outer.gain"]


def test_a_stuck_valve_ignores_its_command():
    task = replace(SHORT, name="stuck", stuck=StuckValve("left.discharge", 0.4, 0.1))
    record = benchmark_controllers(JOINT, [MINE], [task], budget=0).runs["mine", "stuck"].recording
    opening, time = record["left.discharge"], record["time"]
    assert np.unique(opening[time > 0.401]) == pytest.approx([0.1])
    assert np.unique(opening[time < 0.399]).size > 10


def test_a_torque_disturbs_the_joint():
    torque = ((0.0, 0.0), (0.2, 0.0), (0.21, 3.0))
    task = ControlTask("push", MinimumJerkMotion(1e-9, 0.0, 0.1), 0.6, begin=0.3, event=0.2, torque=torque)
    run = benchmark_controllers(JOINT, [MINE], [task], budget=0).runs["mine", "push"]
    assert run.recording["angle"][-1] > 1 * DEGREE
    assert math.isnan(run.metrics.overshoot)


def test_learning_reduces_the_error_from_trial_to_trial(result):
    tuned = next(each for each in result.contenders if each.name == "feed-forward + PID")
    curve = learn(JOINT, tuned, SHORT, trials=4)
    assert curve.errors.shape == (4,)
    assert curve.is_monotone
    assert curve.errors[-1] < 0.3 * curve.errors[0]


# Refusals


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: benchmark_controllers(JOINT, [], [SHORT]), "there is no contender"),
        (lambda: benchmark_controllers(JOINT, [MINE, MINE], [SHORT]), "two contenders are named 'mine'"),
        (lambda: benchmark_controllers(JOINT, [MINE], []), "there is no task"),
        (lambda: Contender("mine", 3), "its law is a int"),
        (lambda: find_tasks(("sine 1Hz",)), "no task 'sine 1Hz'.*Did you mean 'sine 1 Hz'"),
        (lambda: ControlTask("t", SHORT.motion, math.nan), "duration is nan"),
        (lambda: ControlTask("t", SHORT.motion, 1.0, begin=1.0), "begin is 1 s; allowed range: 0 to 1 s"),
        (lambda: ControlTask("t", SHORT.motion, 1.0, event=2.0), "event is 2 s; allowed range: 0 to 1 s"),
        (lambda: replace(JOINT, family={}), "the family of models is empty"),
    ],
)
def test_impossible_benchmarks_are_rejected(call, message):
    with pytest.raises(ParameterError, match=message):
        call()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"inputs": ("angle",)}, "commands angle; allowed are 'difference'"),
        ({"measured_columns": ("angle", "left.force")}, "measures 'left.force'; the joint has sensors of angle"),
        ({"setpoints": ("angles",)}, "no set point 'angles'.*Did you mean 'angle'"),
    ],
)
def test_a_law_that_does_not_suit_the_joint_is_rejected(change, message):
    law = model(type("Other", (AngleLaw,), {"__annotations__": {}, **change}))(2e5)
    with pytest.raises(ParameterError, match=message):
        benchmark_controllers(JOINT, [Contender("other", law)], [SHORT], budget=0)


def test_learning_needs_a_feed_forward_signal(result):
    mine = next(each for each in result.contenders if each.name == "mine")
    with pytest.raises(ParameterError, match="has no set points 'feed_forward' and 'feed_forward_rate'"):
        learn(JOINT, mine, SHORT)


def test_every_standard_contender_suits_both_joints():
    for joint in (JOINT, on_off_joint()):
        for contender in standard_contenders(joint):
            completed = complete(joint, contender)
            assert set(completed.law.inputs) == set(joint.truth.inputs) - {"external_torque"}
            assert completed.bounds
            assert set(completed.law.setpoints) <= set(task_signals(joint, STANDARD_TASKS[0])._fields)
