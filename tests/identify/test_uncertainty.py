"""How sure a fit is: bands hold the truth as often as they say, refits scatter as experiments do,
profiles end where the sum of squares does.

A 95 % band holds the truth in 95 % of experiments. Refits at once are those done one by one. A
profile of a law linear in its parameter is Student's interval; one of a parameter that the data
leave open has no end.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from scipy.stats import t as student
from scipy.stats import truncnorm

from airmuscle.bench import (
    Fit,
    Huber,
    LevelSplit,
    RunSplit,
    bootstrap,
    confidence_band,
    fit,
    profile,
    weakly_determined,
)
from airmuscle.bench.estimation import resampling
from airmuscle.bench.statics import blank_surface
from airmuscle.errors import IdentificationError
from airmuscle.physics import Braid, ContractileSurface, Sarosi2012, TonduLopez2000
from airmuscle.recording import Recording

TRUTH = TonduLopez2000(Braid(0.01, 0.45, 0.3), 1.2)
"""Three parameters: radius, angle of the braid, end correction."""
NOISE = 5.0
EXPONENTIAL = Sarosi2012(0.0, 300.0, -60.0, -8e-3, 2.7e-3, -100.0)
PLACES = Recording(
    {"pressure": np.array([2e5, 4e5, 6e5, 3e5]), "contraction": np.array([0.02, 0.1, 0.18, 0.22])},
    "places",
)


def experiment(seed: int, law=TRUTH, *, shared: float = 0.0) -> list[Recording]:
    """Eight isometric runs with Gaussian noise, and an error that all of a run shares."""
    random = np.random.default_rng(seed)
    runs = []
    for contraction in np.linspace(0.0, 0.22, 8):
        pressure = np.linspace(1e5, 6e5, 8)
        held = np.full(8, contraction)
        errors = NOISE * random.standard_normal(8) + shared * random.standard_normal()
        force = law.unclamped_force(pressure, held) + errors
        columns = {"pressure": pressure, "contraction": held, "force": np.maximum(force, 1e-3)}
        runs.append(Recording(columns, f"run {contraction:.3f}"))
    return runs


def together(runs: list[Recording]) -> Recording:
    """The rows of all runs as points that were taken one by one."""
    return Recording(
        {name: np.concatenate([run[name] for run in runs]) for name in runs[0].columns}, "points"
    )


PLANE = ContractileSurface((600.0, -200.0, 250.0), 1e5, 6e5, 0.0, 0.22, -1e6, 1e6, 1)
"""Three parameters that the runs determine well."""


@pytest.fixture(scope="module")
def experiments():
    return [fit(PLANE, together(experiment(seed, PLANE))) for seed in range(1000)]


def share_held(fits, law, *, prediction: bool = False) -> np.ndarray:
    """In how many of the experiments the band at each place holds the truth, or a new reading."""
    random = np.random.default_rng(5)
    truth = law.unclamped_force(PLACES["pressure"], PLACES["contraction"])
    inside = []
    for found in fits:
        low, high = confidence_band(found, PLACES, prediction=prediction)[1:]
        seen = truth + prediction * NOISE * random.standard_normal(truth.size)
        inside.append((low <= seen) & (seen <= high))
    return np.mean(inside, axis=0)


@pytest.mark.slow
def test_bands_hold_the_truth_in_95_of_100_experiments(experiments):
    held = share_held(experiments, PLANE)
    assert ((held >= 0.93) & (held <= 0.97)).all(), held


@pytest.mark.slow
def test_bands_of_readings_hold_a_new_reading_in_95_of_100_experiments(experiments):
    held = share_held(experiments, PLANE, prediction=True)
    assert ((held >= 0.93) & (held <= 0.97)).all(), held
    assert share_held(experiments[:200], PLANE).min() > 0.9


@pytest.mark.slow
def test_intervals_of_parameters_hold_the_truth_in_95_of_100_experiments(experiments):
    factor = student.ppf(0.975, 64 - 3)
    inside = [
        np.abs(found.values - PLANE.coefficients) <= factor * found.standard_errors
        for found in experiments
    ]
    held = np.mean(inside, axis=0)
    assert ((held >= 0.93) & (held <= 0.97)).all(), held


@pytest.mark.slow
def test_bands_of_a_law_that_is_not_linear_hold_it_as_often():
    """Its three parameters nearly replace each other, so that their own intervals are a little wide
    (97.2 %).
    """
    held = share_held([fit(TRUTH, together(experiment(seed))) for seed in range(1000)], TRUTH)
    assert ((held >= 0.93) & (held <= 0.97)).all(), held


def test_refits_at_once_are_refits_one_by_one():
    runs = experiment(1)
    found = fit(blank_surface(2, 4000), runs)
    drawn = bootstrap(found, runs, refits=40, by=RunSplit(), seed=3)
    names, which = np.unique(np.concatenate(RunSplit().labels(runs)), return_inverse=True)
    count = names.size
    times = (
        np.random.default_rng(3)
        .multinomial(count, np.full(count, 1 / count), size=40)
        .astype(float)
    )
    none_known = np.empty((0, len(found.values)))
    expected = resampling._refit_iteratively(
        ((found.problem, found.values, found.loss, which), none_known, None), times
    )
    assert np.isfinite(expected).all()
    assert drawn.values == pytest.approx(expected, rel=1e-8, abs=1e-6)


def test_refits_by_runs_see_what_a_run_shares():
    """Rows of one run that err together are fewer than they look. The standard errors contain it,
    and Student's factor of few runs: 1.4 at four degrees of freedom."""
    truth = ContractileSurface((300.0, -200.0, 150.0), 1e5, 6e5, 0.0, 0.22, -1e6, 1e6, 1)
    scatter = []
    drawn = []
    claimed = []
    for seed in range(60):
        runs = experiment(seed, truth, shared=20.0)
        found = fit(blank_surface(1, 4000), runs)
        scatter.append(found.values)
        claimed.append(found.standard_errors)
        drawn.append(bootstrap(found, runs, refits=200, by=RunSplit(), seed=seed).standard_errors)
    actual = np.std(scatter, axis=0)[:2]
    assert np.mean(drawn, axis=0)[:2] == pytest.approx(actual, rel=0.35)
    assert np.mean(claimed, axis=0)[:2] == pytest.approx(1.4 * actual, rel=0.2)


def test_a_law_that_is_not_linear_is_refitted_too():
    runs = experiment(2)
    found = fit(TRUTH, runs)
    drawn = bootstrap(found, runs, refits=60, seed=1)
    assert drawn.failed_refits == 0
    ratio = drawn.standard_errors / found.standard_errors  # these contain errors that runs share
    assert ((ratio > 0.3) & (ratio < 1.2)).all()
    low, high = drawn.intervals().T
    assert ((low < found.values) & (found.values < high)).all()
    assert drawn.model(0).end_correction == drawn.values[0, 2]


def test_a_seed_gives_the_same_refits():
    runs = experiment(1)
    found = fit(blank_surface(2, 4000), runs)
    first, again, other = (
        bootstrap(found, runs, refits=20, by=RunSplit(), seed=s).values for s in (1, 1, 2)
    )
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


def test_what_cannot_be_drawn_is_refused():
    runs = experiment(1)
    found = fit(TRUTH, runs)
    with pytest.raises(IdentificationError, match="64 rows, but the recordings have 56"):
        bootstrap(found, runs[1:], by=RunSplit())
    few = fit(blank_surface(1, 4000), runs[:2])
    with pytest.raises(IdentificationError, match="needs 5 runs or more, but the data have 2"):
        bootstrap(few, runs[:2], by=RunSplit())
    assert bootstrap(few, runs[:2], by=LevelSplit("pressure"), refits=10).group_count == 8


def test_refits_that_their_runs_do_not_determine_are_counted():
    runs = experiment(1)
    found = fit(blank_surface(5, 4000), runs)
    drawn = bootstrap(found, runs, by=RunSplit(), refits=100)
    assert drawn.failed_refits > 10
    assert np.isfinite(drawn.standard_errors).all()


@pytest.mark.parametrize("by_runs", [False, True])
def test_the_profile_of_a_linear_parameter_is_students_interval(by_runs):
    found = fit(blank_surface(2, 4000), experiment(1) if by_runs else together(experiment(1)))
    name = found.names[1]
    ends = profile(found, name)
    factor = student.ppf(0.975, math.inf if by_runs else found.rows_used - 6)
    half = factor * found[name].stderr
    assert ends.low == pytest.approx(found[name].value - half, abs=1e-3 * half)
    assert ends.high == pytest.approx(found[name].value + half, abs=1e-3 * half)


def on_its_bound() -> tuple[Fit, Recording]:
    """A fit whose end correction is on its bound 1, and its points."""
    pressure = np.array([2e5, 4e5, 6e5, 3e5, 5e5])
    held = np.array([0.02, 0.06, 0.1, 0.14, 0.18])
    law = TonduLopez2000(Braid(0.01, 0.45, 0.3), 1.0)
    force = law.unclamped_force(pressure, held) * (1.0 + held) + 2.0 * np.array(
        [1.0, -1.0, 1.0, -1.0, 1.0]
    )
    points = Recording({"pressure": pressure, "contraction": held, "force": force}, "bench")
    return fit(law, points, fixed=("geometry.radius",)), points


def test_bands_count_a_parameter_on_a_bound_with_its_error_inside():
    """The error of the others for a known value, and beside it that along their regression on the
    parameter, whose error is that of a normal distribution truncated at the bound."""
    found, _ = on_its_bound()
    assert [estimate.on_bound for estimate in found.estimates] == [False, True]
    jacobian = found.problem.jacobian(found.values)
    errors = found.problem.predict(found.values) - found.problem.target
    variance = errors @ errors / 4  # five rows, one parameter that is not on a bound
    assert found.sigma**2 == pytest.approx(variance, rel=1e-9)
    inverse = np.linalg.inv(jacobian.T @ jacobian)
    own = np.sqrt(variance * inverse[1, 1])
    beyond = float(
        (inverse @ jacobian.T @ errors)[1] / own
    )  # the unconstrained estimate is lower by this
    inside = truncnorm(beyond, np.inf, loc=-beyond)
    slopes = np.append(-np.linalg.lstsq(jacobian[:, :1], jacobian[:, 1], rcond=None)[0], 1.0)
    covariance = own**2 * (inside.var() + inside.mean() ** 2) * np.outer(slopes, slopes)
    covariance[0, 0] += variance / np.sum(jacobian[:, 0] ** 2)
    band = confidence_band(found, PLACES)
    at = dataclasses.replace(found.problem, data=PLACES).jacobian(found.values)
    half = student.ppf(0.975, 4) * np.sqrt(np.einsum("ni,ij,nj->n", at, covariance, at))
    assert band.high - band.value == pytest.approx(half, rel=1e-6)
    assert found.standard_errors[0] == pytest.approx(np.sqrt(covariance[0, 0]), rel=1e-6)
    assert "counts as known" not in found.error_basis


def test_a_parameter_on_a_bound_that_the_rows_do_not_determine_counts_as_known():
    points = on_its_bound()[1].with_columns(
        contraction=np.zeros(5)
    )  # where the end correction has no effect
    law = TonduLopez2000(Braid(0.01, 0.45, 0.3), 1.0)
    found = fit(law, points, fixed=("geometry.braid_angle",))
    known = fit(law, points, fixed=("geometry.braid_angle", "end_correction"))
    assert found.error_basis.endswith("end_correction on the bound counts as known")
    assert found["geometry.radius"].stderr == pytest.approx(
        known["geometry.radius"].stderr, rel=1e-9
    )


def test_the_profile_of_a_parameter_beside_one_on_a_bound_is_that_without_it():
    found, points = on_its_bound()
    known = fit(found.model, points, fixed=("geometry.radius", "end_correction"))
    ends = [profile(each, "geometry.braid_angle") for each in (found, known)]
    assert found.sigma == pytest.approx(known.sigma, rel=1e-6)
    steps = [(each.low - each.value, each.high - each.value) for each in ends]
    assert (
        min(abs(a / b - 1) for a, b in zip(*steps, strict=True)) < 1e-3
    )  # towards the other end it leaves the bound


def short_of_contraction(least: float, seed: int) -> Recording:
    """Points of an exponential muscle, from some contraction on."""
    random = np.random.default_rng(seed)
    pressure = random.uniform(1e5, 6e5, 80)
    contraction = random.uniform(least, 0.2, 80)
    force = EXPONENTIAL.force(pressure, contraction) + 10.0 * random.standard_normal(80)
    return Recording({"pressure": pressure, "contraction": contraction, "force": force}, "bench")


def test_a_parameter_that_the_data_leave_open_has_no_end():
    """Where the exponential has all but decayed, a steep one cannot be told from a steeper one, or
    from none.
    """
    found = fit(EXPONENTIAL, short_of_contraction(0.06, 5), fixed=("a1", "a4", "a5"))
    assert set(weakly_determined(found)) == {"a2", "a3"}
    assert profile(found, "a3").low == -np.inf
    assert "unbounded to unbounded" in str(profile(found, "a3"))


def test_a_profile_is_not_symmetric_where_the_law_is_curved():
    found = fit(EXPONENTIAL, short_of_contraction(0.05, 4), fixed=("a1", "a4", "a5"))
    ends = profile(found, "a2")
    estimate = found["a2"]
    assert ends.low < 300.0 < ends.high
    assert estimate.value - 2 * estimate.stderr < 0.0 < ends.low
    assert ends.high - estimate.value > 5 * (estimate.value - ends.low)


def test_a_well_posed_fit_flags_nothing_loose():
    assert weakly_determined(fit(blank_surface(2, 4000), experiment(1))) == ()


def test_a_robust_fit_has_no_profile():
    found = fit(TRUTH, experiment(1), loss=Huber(15.0))
    with pytest.raises(IdentificationError, match="least squares"):
        profile(found, "end_correction")


def test_a_band_without_a_spare_point_or_with_a_level_of_95_is_refused():
    runs = experiment(1)
    with pytest.raises(IdentificationError, match=r"between 0 and 1"):
        confidence_band(fit(TRUTH, runs), PLACES, level=95)
    three = runs[3].rows([0, 3, 6]).with_columns(contraction=np.array([0.0, 0.1, 0.05]))
    with pytest.raises(IdentificationError, match="no more uncensored rows than parameters"):
        confidence_band(fit(blank_surface(1, 4000), three), PLACES)
