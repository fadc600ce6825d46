"""The chosen mode of the valves is that of the best of all sequences, found independently by trying
each; a lifted load is held with few switchings, which a cost of switching reduces.
"""

from __future__ import annotations

import itertools
import pickle

import numpy as np
import pytest
from control_plants import LIFT

import airmuscle as am
from airmuscle.control import ExtendedKalmanFilter, FiniteControlSet, StateEstimate
from airmuscle.engine import ControlLoop, Problem, solve
from airmuscle.errors import ParameterError

H = 0.01
MODES = tuple({"fill": a, "discharge": b} for a, b in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)))
START = am.find_equilibrium(LIFT, pressure=2e5)
FILTER = ExtendedKalmanFilter(
    LIFT,
    ("pressure", "position"),
    H,
    {"air_mass": 2e-6, "speed": 0.02, "speed.disturbance": 1.0},
    {"pressure": 500.0, "position": 2e-5},
    disturbances=("speed",),
)
FIRST = FILTER.start(
    START, {"air_mass": 2e-6, "position": 1e-4, "speed": 1e-3, "speed.disturbance": 0.5}
)


def law(**changes):
    return FiniteControlSet(FILTER, FIRST, MODES, {"position": 1e-3}, **changes)


def cost_of(sequence, state, wanted, before, switching_cost):
    cost = 0.0
    estimate = StateEstimate(state, np.zeros((4, 4)))
    for mode in sequence:
        inputs = list(MODES[mode].values())
        estimate = FILTER.predict(estimate, inputs)
        cost += ((estimate.mean[FILTER.states.index("position")] - wanted) / 1e-3) ** 2
        cost += switching_cost * sum(MODES[before][name] != MODES[mode][name] for name in MODES[0])
        before = mode
    return cost


@pytest.mark.parametrize("switching_cost", [0.0, 0.3])
def test_the_sequence_is_the_best_of_all(switching_cost):
    judged = law(switching_cost=switching_cost, horizon=3)
    rng = np.random.default_rng(1)
    chosen = set()
    for _ in range(12):
        state = FIRST.mean * (1.0 + 0.02 * rng.normal(size=4)) + np.array(
            [0.0, 0.0, 0.02, 0.5]
        ) * rng.normal(size=4)
        wanted = START["position"] + 3e-3 * rng.normal()
        before = int(rng.integers(3))
        every = {
            s: cost_of(s, state, wanted, before, switching_cost)
            for s in itertools.product(range(3), repeat=3)
        }
        found = judged.best_sequence(state, [wanted], before)
        assert every[found] == pytest.approx(min(every.values()), rel=1e-9)
        chosen.add(found[0])
    assert len(chosen) == 3


def run(judged, duration=2.0):
    wanted = am.Schedule({"position": ((0.0, START["position"]), (0.2, START["position"] + 5e-3))})
    return solve(Problem(LIFT, ControlLoop(judged, H, wanted), duration, START))


def switchings(record, begin):
    late = record["time"] >= begin
    return sum(int(np.count_nonzero(np.diff(record[f"command.{name}"][late]))) for name in MODES[0])


def test_a_load_is_lifted_and_held_with_few_switchings():
    record = run(law()).recording
    late = record["time"] > 1.0
    assert np.abs(record["position"] - record["setpoint.position"])[late].max() < 0.5e-3
    assert switchings(record, 1.0) <= 10


def test_a_cost_of_switching_reduces_the_switchings():
    assert switchings(run(law(switching_cost=0.3)).recording, 0.0) < switchings(
        run(law(switching_cost=0.0)).recording, 0.0
    )


def test_a_continued_run_is_the_undivided_run():
    first = solve(Problem(LIFT, run(law(), 0.4).problem.input, 0.4, START))
    assert solve(first.continuation(0.4)).final_state == run(law(), 0.8).final_state


def test_another_sample_time_is_refused():
    loop = ControlLoop(law(), 0.02, am.Schedule({"position": ((0.0, 0.0),)}))
    with pytest.raises(
        ParameterError,
        match=r"the sample time of the loop is 0\.02 s and that of the estimator 0\.01 s",
    ):
        am.simulate(LIFT, loop, duration=0.1, initial_state=START)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"modes": ({"fil": 1.0},)}, "modes names 'fil'.*Did you mean 'fill'"),
        (
            {"modes": ({"fill": 1.0}, {"discharge": 1.0})},
            "must have a finite number for each of fill",
        ),
        ({"modes": ()}, "give one mode or more"),
        ({"permitted": {"positon": 1.0}}, "permitted names 'positon'"),
        (
            {"permitted": {"position": float("nan")}},
            "permitted of 'position' is nan; it must be positive and finite",
        ),
        ({"switching_cost": -1.0}, "switching_cost is -1.0; allowed range: 0 and above"),
        ({"horizon": 30}, "3 modes over a horizon of 30 samples"),
    ],
)
def test_an_impossible_law_is_refused(changes, message):
    given = {"modes": MODES, "permitted": {"position": 1e-3}, **changes}
    with pytest.raises(ParameterError, match=message):
        FiniteControlSet(FILTER, FIRST, **given)


@pytest.mark.parametrize("mode", [-1, 3])
def test_a_mode_beyond_the_last_one_is_refused(mode):
    with pytest.raises(
        ParameterError, match=f"FiniteControlSet: mode is {mode}; allowed range: 0 to 2"
    ):
        law().best_sequence(FIRST.mean, [START["position"]], mode)


def test_a_controller_with_a_filter_can_be_sent_to_another_process():
    """Also after it has run, when it holds machine code and arrays."""
    judged = law(horizon=2)
    first = judged.best_sequence(FIRST.mean, [START["position"] + 2e-3], 0)
    again = pickle.loads(pickle.dumps(judged))
    assert again.best_sequence(FIRST.mean, [START["position"] + 2e-3], 0) == first
    inputs = list(MODES[1].values())
    ours, theirs = (each.predict(FIRST, inputs) for each in (FILTER, again.estimator))
    assert np.array_equal(ours.mean, theirs.mean)
    assert np.array_equal(ours.covariance, theirs.covariance)
