"""Every search of the bench reports its progress, ends with a budget of time at the best values
found, and, where it has a checkpoint, goes on after a kill to the same values, to the last bit.
"""

from __future__ import annotations

import ast
import warnings
from pathlib import Path

import numpy as np
import pytest

import airmuscle
from airmuscle.bench import fit
from airmuscle.bench.estimation import (
    Checkpoint,
    Evaluations,
    FreeParameter,
    LevenbergMarquardt,
    Linearisation,
    Modelled,
    SampledDescent,
    SampledProblem,
    SearchStage,
    watched_searches,
)
from airmuscle.engine.result_store import result_store
from airmuscle.errors import AirmuscleWarning, ParameterError
from airmuscle.physics import Braid, TonduLopez2000
from airmuscle.recording import Recording

BENCH = Path(airmuscle.__file__).parent / "bench"
START = np.array([-1.2, 1.0])
LOW = np.array([-3.0, -3.0])
HIGH = np.array([3.0, 3.0])


def rosenbrock(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Residuals and Jacobian of Rosenbrock's function, with the minimum 0 at (1, 1)."""
    residuals = np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0]])
    return residuals, np.array([[-20.0 * x[0], 10.0], [-1.0, 0.0]])


class Rosenbrock(Evaluations):
    """The sum of squares of Rosenbrock's function."""

    def cost(self, x):
        self._x = x
        return float(np.sum(rosenbrock(x)[0] ** 2))

    def linearise(self):
        return Linearisation(*rosenbrock(self._x))


class Exponentials(SampledProblem):
    """Amplitude and rate of a decay, of which each group has the noise of its own."""

    clip = 1.0

    def __init__(self) -> None:
        self._time = np.linspace(0.0, 2.0, 20)
        noise = 0.01 * np.random.default_rng(1).standard_normal((200, 20))
        self._measured = 2.0 * np.exp(-1.5 * self._time) + noise

    name = "decays"
    origin = "made"
    quantity = "level"
    parameters = tuple(
        FreeParameter(path, path, first, (0.0, 9.0), "1", path)
        for path, first in (("amplitude", 1.0), ("rate", 0.5))
    )

    @property
    def target(self):
        return self._measured.ravel()

    def evaluate(self, values, guard=None):
        errors, gradient = self.linearise(values, np.arange(self.group_count), 20)
        return Modelled((errors + self._measured).ravel(), gradient.reshape(-1, 2))

    @property
    def group_count(self) -> int:
        return len(self._measured)

    def linearise(self, values, groups, rows):
        decay = np.exp(-values[1] * self._time[:rows])
        errors = values[0] * decay - self._measured[groups, :rows]
        gradient = np.stack([decay, -values[0] * self._time[:rows] * decay], axis=-1)
        return errors, np.broadcast_to(gradient, (*errors.shape, 2))

    def cost(self, values, rows):
        errors, _ = self.linearise(values, np.arange(self.group_count), rows)
        return float(np.mean(errors**2))


def run_marquardt() -> np.ndarray:
    content = "rosenbrock", START
    search = LevenbergMarquardt(
        Rosenbrock(), START, LOW, HIGH, name="valley", checkpoint=Checkpoint(__name__, content)
    )
    return search.run(500).x


def run_descent() -> np.ndarray:
    search = SampledDescent(Exponentials().initial_values, seed=3)
    for number, stage in enumerate((SearchStage(10, 30, 20), SearchStage(20, 60, 20))):
        search.run(Exponentials(), stage, f"stage {number}")
    return search.values


SEARCHES = {
    "Levenberg-Marquardt": (run_marquardt, np.ones(2), 1e-6),
    "sampled descent": (run_descent, np.array([2.0, 1.5]), 1e-2),
}


@pytest.mark.parametrize("name", SEARCHES)
def test_a_search_reports_its_progress_and_finds_the_minimum(name: str):
    run, minimum, tolerance = SEARCHES[name]
    fractions: list[float] = []
    with watched_searches(lambda _, fraction: fractions.append(fraction)):
        watched = run()
    assert watched == pytest.approx(minimum, abs=tolerance)
    assert len(fractions) >= 5
    assert all(0.0 <= fraction <= 1.0 for fraction in fractions)
    np.testing.assert_array_equal(watched, run(), "watching changes nothing")


@pytest.mark.parametrize("name", SEARCHES)
def test_a_budget_ends_a_search_at_values_no_worse_than_its_start_and_says_so(name: str):
    run, *_ = SEARCHES[name]
    with (
        pytest.warns(AirmuscleWarning, match="ended a search before convergence|ended 2 searches"),
        watched_searches(budget=1e-9),
    ):
        ended = run()
    if name == "sampled descent":
        costs = [Exponentials().cost(values, 20) for values in (ended, np.array([1.0, 0.5]))]
    else:
        costs = [float(np.sum(rosenbrock(values)[0] ** 2)) for values in (ended, START)]
    assert costs[0] <= costs[1]


class KilledError(Exception):
    """A search that is ended from outside."""


@pytest.mark.parametrize("name", ["Levenberg-Marquardt", "sampled descent"])
@pytest.mark.parametrize("after", [8, 15, 47])
def test_a_killed_search_goes_on_from_its_checkpoint_to_the_same_bits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, after: int
):
    monkeypatch.setattr("airmuscle.bench.estimation.search.CHECKPOINT_INTERVAL", 0.0)
    run, *_ = SEARCHES[name]
    undisturbed = run()
    steps = {"before": 0, "after": 0, "alone": 0}

    def killing(_: str, fraction: float) -> None:
        steps["before"] += 1
        if steps["before"] > after:
            raise KilledError

    def counting(which: str):
        def count(_: str, fraction: float) -> None:
            steps[which] += 1

        return count

    with watched_searches(counting("alone")):
        run()
    with result_store(tmp_path):
        if steps["alone"] > after:
            with pytest.raises(KilledError), watched_searches(killing):
                run()
        with watched_searches(counting("after")):
            resumed = run()
    np.testing.assert_array_equal(resumed, undisturbed)
    if steps["alone"] > after > 10:
        assert steps["after"] < steps["alone"], "it did not begin anew"


def test_a_fit_with_a_budget_states_that_it_has_not_converged():
    pressure, contraction = (
        axis.ravel() for axis in np.meshgrid(np.linspace(1e5, 6e5, 8), np.linspace(0.0, 0.2, 8))
    )
    force = TonduLopez2000(Braid(0.0095, 0.42, 0.3), 1.3).force(pressure, contraction)
    force = force + np.random.default_rng(0).standard_normal(force.size)
    recording = Recording(
        {"pressure": pressure, "contraction": contraction, "force": force}, "grid"
    )
    law = TonduLopez2000(Braid(0.012, 0.5, 0.3), 1.1)
    names: set[str] = set()
    with watched_searches(lambda name, fraction: names.add(name)):
        complete = fit(law, recording, fixed=("geometry.radius",))
    assert "TonduLopez2000" in names
    with (
        pytest.warns(AirmuscleWarning, match="Give a longer budget"),
        watched_searches(budget=1e-9),
    ):
        ended = fit(law, recording, fixed=("geometry.radius",))
    assert complete.rmse <= ended.rmse


def test_a_budget_that_suffices_is_not_mentioned():
    with warnings.catch_warnings():
        warnings.simplefilter("error", AirmuscleWarning)
        with watched_searches(budget=1e3):
            run_marquardt()


@pytest.mark.parametrize("budget", [0.0, -1.0, float("nan")])
def test_an_impossible_budget_is_refused(budget: float):
    with pytest.raises(ParameterError, match="positive time"), watched_searches(budget=budget):
        pass


def test_every_search_of_the_bench_is_watched():
    """No fit calls a search of SciPy: none of them reports, ends with a budget or goes on."""
    callers = []
    for path in sorted(BENCH.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.ImportFrom) else []
            if "least_squares" in names or "minimize" in names:
                callers.append(path.relative_to(BENCH).as_posix())
    assert not callers, "a search of its own: bring a LeastSquaresProblem"
