"""Whatever executor computes its parts, a result is that of this process alone: tuning, bootstrap,
benchmark, joint friction and rollouts."""

from __future__ import annotations

from concurrent.futures import Executor, Future, ThreadPoolExecutor

import numpy as np
import pytest
from benchmark_contender import JOINT, MINE, SHORT

from airmuscle import load_data
from airmuscle.bench import bootstrap, fit
from airmuscle.design import Contender, compare_controllers
from airmuscle.errors import ParameterError
from airmuscle.files import load_law
from airmuscle.outlets import roll_out


class Counting(ThreadPoolExecutor):
    """Threads that count their tasks and send them as to another machine."""

    def __init__(self) -> None:
        super().__init__(2)
        self.count = 0

    def submit(self, *task, **named) -> Future:
        self.count += 1
        return super().submit(*task, **named)


@pytest.fixture
def executor():
    with Counting() as threads:
        yield threads


def test_a_bootstrap_does_not_depend_on_its_executor(
    executor: Executor, monkeypatch: pytest.MonkeyPatch
):
    """A first block, and two that start at what it has found."""
    monkeypatch.setattr("airmuscle.bench.estimation.resampling.REFITS_OF_A_TASK", 10)
    runs = load_data("dmsp-20-300")
    found = fit(load_law("dmsp-20-300").characteristic, runs)
    alone, shared = (
        bootstrap(found, runs, refits=25, seed=2, workers=each) for each in (1, executor)
    )
    assert executor.count == 2
    assert np.array_equal(alone.values, shared.values, equal_nan=True)
    assert alone.failed_refits < 3


@pytest.mark.parametrize("sets", [0, pytest.param(8, marks=pytest.mark.slow)])
def test_a_benchmark_does_not_depend_on_its_executor(executor: Executor, sets: int):
    """A contender that takes the gains of another one comes after it, also if it is named first."""
    follower = Contender("follower", MINE.law, {}, tuned_as=MINE)
    options = {"sets_per_gain": sets, "commissioning_runs": 0}
    alone, shared = (
        compare_controllers(JOINT, [follower, MINE], [SHORT], workers=each, **options)
        for each in (1, executor)
    )
    assert executor.count == 2
    assert shared.results[0].contender is follower
    for one, other in zip(alone.results, shared.results, strict=True):
        assert one.name == other.name
        assert (one.tuning is None) == (sets == 0)
        if sets:
            assert one.tuning.gains == other.tuning.gains == alone.results[1].tuning.gains
        assert [run.metrics for run in one.runs.values()] == [
            run.metrics for run in other.runs.values()
        ]


def track(observations):
    """Act against the error of the angle."""
    return np.clip(np.stack([-observations[:, 0], observations[:, 0]], axis=1), -1, 1)


def test_rollouts_do_not_depend_on_their_executor_and_are_those_of_an_environment(
    executor: Executor,
):
    environments = pytest.importorskip("airmuscle.outlets.environments")
    gymnasium = pytest.importorskip("gymnasium")
    task, randomisation = environments.joint_task()
    options = {"seed": 5, "max_episode_steps": 20}
    alone, shared = (
        roll_out(task, track, 260, randomisation, workers=each, **options) for each in (1, executor)
    )
    assert executor.count == 2
    assert np.array_equal(alone.returns, shared.returns)
    assert np.array_equal(alone.periods, shared.periods)
    single = gymnasium.make("airmuscle/Joint-v0", max_episode_steps=20)
    observation, _ = single.reset(seed=5 + 259)
    total = 0.0
    periods = 0
    over = False
    while not over:
        observation, reward, terminated, truncated, _ = single.step(track(observation[None])[0])
        total = total + reward
        periods = periods + 1
        over = terminated or truncated
    assert alone.returns[259] == pytest.approx(total, rel=1e-5)
    assert (alone.periods[259], alone.terminated[259]) == (periods, terminated)
    with pytest.raises(ParameterError, match="episodes is 0"):
        roll_out(task, track, 0)
