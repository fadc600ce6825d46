"""A refit to a part of the data is the fit to that part: what is faster about it does not change
the result.

Folds of a comparison and samples of a bootstrap start at the parameters of all rows and take
Gauss-Newton steps; their minimum is that of a fit with its own search. Derivatives on whole arrays
are those of the traced function.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from widths import widened

import airmuscle as am
from airmuscle.bench import Candidate, RunSplit, bootstrap, compare
from airmuscle.bench.estimation import (
    GroupRefits,
    KnownMinima,
    LeastSquaresSolution,
    find_initial_values,
    gauss_newton,
    resampling,
    solve_iteratively,
    solve_least_squares,
)
from airmuscle.bench.statics import (
    FitPoints,
    blank_surface,
    fitted_quantity_of,
    refit,
)
from airmuscle.core import autodiff, tree
from airmuscle.physics import (
    Braid,
    ContractileSurface,
    EffectiveLength,
    Hunt2017,
    InverseLength,
    TonduLopez2000,
)
from airmuscle.recording import Recording

LAWS = {
    "surface": ContractileSurface.blank(3, max_force=1e4),
    "family": InverseLength(blank_surface(3), blank_surface(2), 0.3, 0.3),
    "effective length": EffectiveLength(blank_surface(3), 0.3, 0.005),
    "braid": TonduLopez2000(Braid(0.012, 0.4, 0.3), 1.0),
    "pressure": Hunt2017(0.25),
}


def run(length: float, contraction: float, seed: int, rows: int = 60) -> Recording:
    random = np.random.default_rng(seed)
    pressure = np.linspace(0.2e5, 6e5, rows)
    held = contraction + 1e-3 * random.standard_normal(rows)
    law = TonduLopez2000(Braid(0.01, 0.45, length - 0.02), 1.2)
    force = law.force(pressure, held * length / (length - 0.02)) + 2 * random.standard_normal(rows)
    columns = {"pressure": pressure, "contraction": held, "force": np.maximum(force, 0.0)}
    return Recording(
        columns, f"{length * 1e3:.0f} mm, {contraction:.2f}", {"resting_length": length}
    )


def bench(rows: int = 60) -> list[Recording]:
    points = [(length, held) for length in (0.15, 0.3) for held in (0.0, 0.06, 0.12, 0.18)]
    return [run(*point, seed, rows) for seed, point in enumerate(points)]


# Linear in all parameters, in some, in none; the pressure as the fitted quantity.


@pytest.mark.parametrize("name", widened(LAWS, lambda name: name not in ("family", "braid")))
def test_a_refit_to_the_training_rows_is_the_fit_to_them(name):
    runs = bench()
    law = LAWS[name]
    full = am.fit(law, runs)
    for left_out in (0, 5):
        training = [r for i, r in enumerate(runs) if i != left_out]
        fast = refit(full.model, FitPoints.from_recordings(training))
        plain = am.fit(law, training).model
        method = fitted_quantity_of(law)
        test = training[0]
        arguments = [test[column] for column in method.arguments]
        expected = getattr(plain, method.name)(*arguments)
        assert getattr(fast, method.name)(*arguments) == pytest.approx(
            expected, rel=1e-6, abs=1e-6 * expected.max()
        )


@pytest.mark.parametrize("name", ["effective length", "braid"])
def test_gauss_newton_steps_end_where_the_trust_region_search_ends(name):
    fit = am.fit(LAWS[name], bench())
    moved = fit.values + 0.2 * np.nan_to_num(fit.standard_errors)
    found = gauss_newton(fit.problem, moved)
    assert found is not None
    assert (found[0] - fit.values) / fit.standard_errors == pytest.approx(0.0, abs=1e-4)


def test_gauss_newton_steps_give_up_where_a_parameter_is_on_its_bound():
    fit = am.fit(LAWS["braid"], bench())
    assert (
        gauss_newton(fit.problem, np.array([b[0] for b in np.array(fit.problem.bounds).T])) is None
    )


@pytest.mark.parametrize("name", LAWS)
def test_derivatives_on_arrays_are_those_of_the_traced_function(name):
    law = tree.unflatten(LAWS[name], [leaf.value or 0.3 for leaf in tree.leaves(LAWS[name])])
    quantity = fitted_quantity_of(law)
    data = bench()[2]
    arguments = [data[column] for column in quantity.arguments]
    leaves = [1, 0]
    exact = autodiff.jacobian(law, quantity.method, *arguments)[1][:, leaves]
    assert autodiff.parameter_derivatives(law, quantity.method, arguments, leaves) == pytest.approx(
        exact, rel=1e-12
    )


def test_a_search_over_a_part_of_the_rows_finds_the_minimum_of_all():
    """With more rows than the search takes, the initial values are as good as the optimum
    itself.
    """
    fit = am.fit(LAWS["effective length"], bench(rows=400))
    values = find_initial_values(fit.problem)
    optimum, found = (
        np.sum(fit.problem.residuals(fit.problem.predict(v)) ** 2) for v in (fit.values, values)
    )
    assert found == pytest.approx(optimum, rel=1e-4)


def test_samples_of_a_bootstrap_are_fits_to_the_drawn_runs():
    runs = bench()
    fit = am.fit(LAWS["braid"], runs)
    drawn = bootstrap(fit, runs, refits=5, by=RunSplit(), seed=3)
    counts = np.random.default_rng(3).multinomial(8, np.full(8, 1 / 8), size=5)
    # the groups are numbered in the order of their names
    names = sorted(r.origin for r in runs)
    repeats = dict(zip(names, counts[0].tolist(), strict=True))
    sample = [r for r in runs if repeats[r.origin]]
    sigma = np.concatenate([np.full(len(r), repeats[r.origin] ** -0.5) for r in sample])
    assert drawn.values[0] == pytest.approx(am.fit(fit.model, sample, sigma=sigma).values, rel=1e-5)


def test_samples_far_along_a_valley_and_on_bounds_are_refitted_without_a_search(monkeypatch):
    """Radius and angle of the braid change together by a factor of 10, up to the lower bound of the
    angle and k = 1.
    """
    runs = bench()
    fit = am.fit(LAWS["braid"], runs)
    monkeypatch.setattr(
        resampling, "solve_iteratively", lambda *_: pytest.fail("a search of its own")
    )
    drawn = bootstrap(fit, runs, refits=20, by=RunSplit(), seed=1).values
    assert (drawn[:, 1] < 0.0501).mean() > 0.2 < (drawn[:, 2] < 1.0001).mean()
    counts = np.random.default_rng(1).multinomial(8, np.full(8, 1 / 8), size=20)
    group = np.unique(np.repeat([r.origin for r in runs], 60), return_inverse=True)[1]
    for repeats, values in list(zip(counts, drawn, strict=True))[::4]:
        problem = dataclasses.replace(
            fit.problem, weights=fit.problem.weights * np.sqrt(repeats[group])
        )
        plain = solve_iteratively(problem, fit.loss, fit.values)
        squares, expected = (
            np.sum(problem.residuals(m) ** 2) for m in (problem.predict(values), plain.modelled)
        )
        assert squares == pytest.approx(expected, rel=1e-9)


def test_a_sample_starts_at_the_known_parameters_with_its_least_sum_of_squares():
    runs = bench()
    fit = am.fit(LAWS["braid"], runs)
    group = np.repeat(np.arange(8), 60)
    known = KnownMinima(fit.problem, fit.values, group, 8)
    repeats = np.repeat([1.0, 0.0], 4)
    assert known.best(repeats) is None
    of_short = am.fit(fit.model, runs[:4]).values
    known.add(2 * fit.values)
    known.add(of_short)
    assert known.best(repeats) is of_short
    assert known.best(np.ones(8)) is None


def test_a_comparison_states_the_errors_of_plain_fits():
    runs = bench()
    found = compare(
        runs, [Candidate("family", LAWS["effective length"])], leave_out=RunSplit()
    ).recommended
    model = am.fit(LAWS["effective length"], runs[1:]).model.with_resting_length(0.15)
    error = model.force(runs[0]["pressure"], runs[0]["contraction"]) - runs[0]["force"]
    rows = runs[0]["force"] > 0
    assert found.fold_scores[0].rmse == pytest.approx(
        float(np.sqrt(np.mean(error[rows] ** 2))), rel=1e-6
    )


@pytest.mark.parametrize(
    "name", widened(LAWS, lambda name: name in ("surface", "braid", "pressure"))
)
def test_refits_without_a_group_are_searches_on_the_other_rows(name):
    """All folds from one Jacobian: the minimum of each is that of a search of its own."""
    runs = bench()
    fit = am.fit(LAWS[name], runs)
    problem = fit.problem
    values = fit.values
    solution = LeastSquaresSolution(values, problem.predict(values), problem.jacobian(values))
    group = np.repeat(np.arange(8), [len(each) for each in runs])
    refits = GroupRefits(problem, solution, group, 8)
    for left_out in (1, 6):
        found = refits.refit(1.0 - np.eye(8)[left_out])
        training = problem.rows(group != left_out)
        plain = solve_least_squares(training, fit.loss).values
        assert found is not None
        assert training.predict(found) == pytest.approx(
            training.predict(plain), rel=1e-5, abs=1e-5 * problem.target.max()
        )


def test_a_refit_follows_the_rows_whose_bound_becomes_violated_or_kept():
    """Slack rows, of which the force is at most zero, count only where the surface predicts a
    tension.
    """
    runs = [
        run(0.3, held, seed)
        for seed, held in enumerate((0.0, 0.06, 0.12, 0.18, 0.22, 0.25, 0.28, 0.31))
    ]
    fit = am.fit(blank_surface(2), runs)
    modelled = fit.problem.predict(fit.values)
    solution = LeastSquaresSolution(fit.values, modelled, fit.problem.jacobian(fit.values))
    group = np.repeat(np.arange(8), 60)
    before = fit.problem.active_rows(modelled)
    refits = GroupRefits(fit.problem, solution, group, 8)
    gained = 0
    lost = 0
    for repeats in np.random.default_rng(2).multinomial(8, np.full(8, 1 / 8), size=24):
        drawn = fit.problem.rows(np.repeat(np.arange(480), repeats[group]))
        refitted = refits.refit(repeats.astype(float))
        plain = solve_least_squares(drawn, fit.loss).values
        assert refitted is not None
        assert drawn.predict(refitted) == pytest.approx(
            drawn.predict(plain), abs=1e-6 * fit.problem.target.max()
        )
        after = fit.problem.active_rows(fit.problem.predict(plain))[repeats[group] > 0]
        gained += np.count_nonzero(after & ~before[repeats[group] > 0])
        lost += np.count_nonzero(~after & before[repeats[group] > 0])
    assert gained > 5
    assert lost > 5


def test_a_group_that_alone_determines_a_parameter_has_no_certain_refit():
    runs = [each for each in bench() if each.constants["resting_length"] == 0.3][:2]
    fit = am.fit(blank_surface(1), runs)
    solution = LeastSquaresSolution(
        fit.values, fit.problem.predict(fit.values), fit.problem.jacobian(fit.values)
    )
    held = dataclasses.replace(
        fit.problem, data=fit.problem.data.with_columns(contraction=np.repeat([0.0, 0.06], 60))
    )
    exact = LeastSquaresSolution(fit.values, held.predict(fit.values), held.jacobian(fit.values))
    assert (
        GroupRefits(fit.problem, solution, np.repeat([0, 1], 60), 2).refit(np.ones(2)) is not None
    )
    assert GroupRefits(held, exact, np.repeat([0, 1], 60), 2).refit(np.array([1.0, 0.0])) is None


def test_a_curved_valley_with_a_bound_is_followed_to_its_minimum():
    """Two lengths and a law of one: radius, angle and end correction change together, until k
    reaches 1.
    """
    runs = bench(rows=200)
    fit = am.fit(LAWS["braid"], runs)
    chosen = fit.problem.rows(np.repeat(np.array([1, 1, 0, 1, 0, 1, 0, 1], dtype=bool), 200))
    plain = solve_iteratively(chosen, fit.loss, fit.values)
    found = gauss_newton(chosen, fit.values)
    assert found is not None
    assert float(np.sum(chosen.residuals(found[1]) ** 2)) == pytest.approx(
        float(np.sum(chosen.residuals(plain.modelled) ** 2)), rel=1e-6
    )


@pytest.mark.parametrize("name", ["surface", "family", "effective length"])
def test_a_rescaled_surface_is_the_same_law_on_another_validity_range(name):
    law = am.fit(LAWS[name], bench()).model
    smaller = law.rescaled((1e5, 5e5), (0.03, 0.15))
    pressure, contraction = np.meshgrid(np.linspace(1e5, 5e5, 7), np.linspace(0.04, 0.14, 7))
    expected = law.unclamped_force(pressure, contraction)
    assert smaller.unclamped_force(pressure, contraction) == pytest.approx(
        expected, rel=1e-9, abs=1e-9 * expected.max()
    )
    assert smaller.unclamped_force(8e5, 0.0) != pytest.approx(float(law.unclamped_force(8e5, 0.0)))
