"""A law that is linear in some of its parameters is fitted from far starts: the others alone are
searched for.

What made the data comes back from starts a factor away; on measured maps with a level left out a
fit ends, with values or with the names of the parameters that nothing tells apart, and never for
want of steps. Where nothing but the linear parameters is free, the projected start is the
least-squares solution itself.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import airmuscle
from airmuscle import read_csv
from airmuscle.bench import (
    UNCENSORED,
    Candidate,
    Censoring,
    LevelSplit,
    compare,
    fit,
    standard_candidates,
)
from airmuscle.bench.estimation import (
    find_initial_values,
    label_folds,
    shortened_step,
    solve_censored_least_squares,
)
from airmuscle.bench.statics import blank_surface, make_problem
from airmuscle.core import leaves
from airmuscle.errors import IdentificationError
from airmuscle.physics import (
    Braid,
    ContractileSurface,
    EffectiveLength,
    Hunt2017,
    InverseLength,
    Sarosi2012,
    TonduLopez2000,
)
from airmuscle.recording import Recording

DATA = Path(airmuscle.__file__).parent / "files" / "library" / "data"
SAROSI = Sarosi2012(1.2e-4, 420.0, -40.0, -8.7e-3, 2.7e-3, -310.0)
HUNT = Hunt2017(0.17)
MAPS = (
    "dmsp-10-250",
    "dmsp-20-300",
    "festo-tool-dmsp-10",
    "festo-tool-dmsp-20",
    "festo-tool-dmsp-40",
)


def pulled(law: Sarosi2012) -> Recording:
    random = np.random.default_rng(1)
    pressure = random.uniform(1e5, 6e5, 120)
    contraction = random.uniform(-0.02, 0.2, 120)
    force = law.force(pressure, contraction)
    return Recording({"pressure": pressure, "contraction": contraction, "force": force}, "bench")


def pressed(law: Hunt2017) -> Recording:
    random = np.random.default_rng(2)
    contraction = random.uniform(0.0, 0.13, 120)
    force = random.uniform(0.0, 120.0, 120)
    pressure = law.pressure(contraction, force)
    return Recording({"pressure": pressure, "contraction": contraction, "force": force}, "bench")


@pytest.mark.parametrize("decay", [-8.0, -25.0, -90.0, -300.0])
def test_sarosi_comes_back_from_a_start_far_away(decay: float):
    found = fit(Sarosi2012(0.0, 1.0, decay, 0.0, 0.0, 0.0), pulled(SAROSI), censoring=UNCENSORED)
    assert found["a3"].value == pytest.approx(-40.0, rel=1e-6)
    assert found["a1"].value == pytest.approx(1.2e-4, rel=1e-5)


@pytest.mark.parametrize("steepness", [0.6, 1.2, 2.7])
def test_hunt_comes_back_from_a_start_far_away(steepness: float):
    found = fit(
        Hunt2017(0.17, offset=1e5, scale=1e5, steepness=steepness, centre=0.3, by_force=10.0),
        pressed(HUNT),
    )
    for name in ("steepness", "centre", "span_by_force", "offset", "scale", "by_force"):
        assert found[name].value == pytest.approx(getattr(HUNT, name), rel=1e-5), name


@pytest.mark.parametrize("name", MAPS)
@pytest.mark.slow
def test_with_any_level_left_out_a_fit_settles_or_names_what_nothing_tells_apart(name: str):
    recording = read_csv(DATA / f"{name}.csv")
    candidates = [
        c for c in standard_candidates([recording]) if isinstance(c.law, Sarosi2012 | Hunt2017)
    ]
    assert len(candidates) == 2
    (labels,), names = label_folds([recording], LevelSplit("contraction"))
    reasons = []
    for candidate in candidates:
        for left_out in names:
            try:
                assert np.isfinite(
                    fit(candidate.law, recording.rows(labels != left_out)).values
                ).all()
            except IdentificationError as error:
                reasons.append(str(error))
    assert [r for r in reasons if "cannot separate" not in r and "do not depend on" not in r] == []


def test_the_better_of_two_optima_is_found():
    """From the printed values of another muscle the search alone ends at 116 kPa on this map."""
    recording = read_csv(DATA / "festo-tool-dmsp-10.csv")
    (candidate,) = (c for c in standard_candidates([recording]) if isinstance(c.law, Hunt2017))
    assert fit(candidate.law, recording).rmse < 25e3


def lengths(inner: ContractileSurface, dead_length: float, noise: float = 0.0) -> list[Recording]:
    runs = []
    for i, length in enumerate((0.08, 0.12, 0.2, 0.4)):
        random = np.random.default_rng(i)
        pressure = random.uniform(3e5, 6e5, 150)
        contraction = random.uniform(0.0, 0.12, 150)
        force = EffectiveLength(inner, length, dead_length, 1e-3).unclamped_force(
            pressure, contraction
        )
        columns = {
            "pressure": pressure,
            "contraction": contraction,
            "force": force + noise * random.standard_normal(150),
        }
        runs.append(Recording(columns, f"{length:.2f} m", {"resting_length": length}))
    return runs


@pytest.mark.parametrize("start", [(0.005, 0.0), (0.078, 0.0), (0.005, 0.02), (-0.1, 0.05)])
@pytest.mark.slow
def test_the_ends_of_a_family_of_degree_five_are_found_from_any_start(start: tuple[float, float]):
    random = np.random.default_rng(4)
    coefficients = random.normal(0, 20, 21)
    coefficients[:2] = (300.0, -250.0)
    coefficients[6] = 200.0
    inner = ContractileSurface(tuple(coefficients), 3e5, 6e5, -0.06, 0.18, -1e6, 1e6, 5)
    found = fit(EffectiveLength(blank_surface(5), 0.4, *start), lengths(inner, 0.02))
    assert found["dead_length"].value == pytest.approx(0.02, abs=1e-5)
    assert found["end_shift"].value == pytest.approx(1e-3, abs=1e-5)


def test_slack_rows_take_part_in_the_projection():
    """The start is the least over the linear parameters of the whole sum, rows that are cut off
    among them.
    """
    recording = pulled(SAROSI)
    slack = recording.with_columns(force=np.maximum(recording["force"], 0.0))
    problem = make_problem(
        Sarosi2012(0.0, 1.0, -10.0, 0.0, 0.0, 0.0), slack, Censoring(), np.ones(120), ()
    )
    assert problem.censoring.any()
    start = find_initial_values(problem)
    assert start[2] == pytest.approx(-40.0, rel=1e-4)
    linear = problem.is_linear_parameter
    assert linear.tolist() == [True, True, False, True, True, True]
    again = start.copy()
    again[linear] = 0.0
    slopes = problem.jacobian(again)[:, linear]
    solution = solve_censored_least_squares(problem, slopes, problem.predict(again))
    assert solution == pytest.approx(start[linear], rel=1e-6)
    active = problem.active_rows(slopes @ solution + problem.predict(again))
    for first in (active, ~active, problem.censoring == 0):  # of the first step alone
        found = solve_censored_least_squares(problem, slopes, problem.predict(again), first)
        assert found == pytest.approx(solution, rel=1e-9)


def test_a_step_is_halved_until_the_sum_of_squares_is_at_most_the_limit():
    """From x = 1 a step of -4 ends at 9, half of it at 1, a quarter at 0."""

    def square(x):
        return float(x @ x)

    x, step = np.array([1.0]), np.array([-4.0])
    assert [shortened_step(square, x, step, limit).item() for limit in (9.0, 1.0, 0.9)] == [
        -4.0,
        -2.0,
        -1.0,
    ]
    assert shortened_step(square, x, step, 0.9, halvings=2).item() == 0.0


def test_what_is_linear_alone_is_solved_at_once():
    found = fit(
        Sarosi2012(0.0, 0.0, -40.0, 0.0, 0.0, 0.0),
        pulled(SAROSI),
        censoring=UNCENSORED,
        fixed=("a3",),
    )
    assert found["a2"].value == pytest.approx(420.0, rel=1e-9)


def test_a_fold_that_leaves_the_exponential_open_is_excluded_by_name():
    """On this map one level alone lies where the exponential acts."""
    recording = read_csv(DATA / "dmsp-20-300.csv")
    (candidate,) = (c for c in standard_candidates([recording]) if isinstance(c.law, Sarosi2012))
    found = compare(
        recording,
        [candidate, Candidate("plane", blank_surface(1, 4e3))],
        leave_out=LevelSplit("contraction"),
    )
    (excluded,) = found.excluded
    assert "cannot separate a_1, a_2, a_3" in excluded.reason


def test_a_family_of_lengths_names_the_linear_parameters_of_both_its_models():
    for law, linear in (
        (InverseLength(SAROSI, blank_surface(2), 0.2, 0.3), 5 + 6),
        (InverseLength(EffectiveLength(blank_surface(2), 0.2, 0.02), SAROSI, 0.2, 0.3), 6 + 5),
        (InverseLength(SAROSI, TonduLopez2000(Braid(0.01, 0.4363, 0.2)), 0.2, 0.3), 0),
    ):
        paths = [leaf.path.partition("[")[0] for leaf in leaves(law)]
        assert sum(path in law.linear_in for path in paths) == linear
