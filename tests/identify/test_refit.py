"""A refit to a part of the data is the fit to that part: what is faster about it does not change the result.

Folds of a comparison and samples of a bootstrap start at the parameters of all rows and take Gauss-Newton steps; their
minimum is that of a fit with its own search. Derivatives on whole arrays are those of the traced function.
"""

from __future__ import annotations

import numpy as np
import pytest

import airmuscle as am
from airmuscle.characteristic import ContractileSurface, EffectiveLength, Hunt2017, InverseLength, TonduLopez2000
from airmuscle.core import autodiff, tree
from airmuscle.geometry.braid import Braid
from airmuscle.identify import Candidate, RunSplit, bootstrap, compare
from airmuscle.identify.candidates import blank_surface
from airmuscle.identify.fit_points import FitPoints
from airmuscle.identify.gauss_newton import gauss_newton
from airmuscle.identify.problem import fitted_quantity_of
from airmuscle.identify.static_fit import refit
from airmuscle.identify.variable_projection import find_initial_values
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
    return Recording(columns, f"{length * 1e3:.0f} mm, {contraction:.2f}", {"resting_length": length})


def bench(rows: int = 60) -> list[Recording]:
    points = [(length, held) for length in (0.15, 0.3) for held in (0.0, 0.06, 0.12, 0.18)]
    return [run(*point, seed, rows) for seed, point in enumerate(points)]


@pytest.mark.parametrize("name", LAWS)
def test_a_refit_to_the_training_rows_is_the_fit_to_them(name):
    runs, law = bench(), LAWS[name]
    full = am.fit(law, runs)
    for left_out in (0, 5):
        training = [r for i, r in enumerate(runs) if i != left_out]
        fast, plain = refit(full.model, FitPoints.from_recordings(training)), am.fit(law, training).model
        method = fitted_quantity_of(law)
        test = training[0]
        arguments = [test[column] for column in method.arguments]
        expected = getattr(plain, method.name)(*arguments)
        assert getattr(fast, method.name)(*arguments) == pytest.approx(expected, rel=1e-6, abs=1e-6 * expected.max())


@pytest.mark.parametrize("name", ["effective length", "braid"])
def test_gauss_newton_steps_end_where_the_trust_region_search_ends(name):
    fit = am.fit(LAWS[name], bench())
    moved = fit.values + 0.5 * np.nan_to_num(fit.standard_errors)
    found = gauss_newton(fit.problem, moved)
    assert found is not None
    assert (found[0] - fit.values) / fit.standard_errors == pytest.approx(0.0, abs=1e-4)


def test_gauss_newton_steps_give_up_where_a_parameter_is_on_its_bound():
    fit = am.fit(LAWS["braid"], bench())
    assert gauss_newton(fit.problem, np.array([b[0] for b in np.array(fit.problem.bounds).T])) is None


@pytest.mark.parametrize("name", LAWS)
def test_derivatives_on_arrays_are_those_of_the_traced_function(name):
    law = tree.unflatten(LAWS[name], [leaf.value or 0.3 for leaf in tree.leaves(LAWS[name])])
    quantity, data = fitted_quantity_of(law), bench()[2]
    arguments = [data[column] for column in quantity.arguments]
    leaves = [1, 0]
    exact = autodiff.jacobian(law, quantity.method, *arguments)[1][:, leaves]
    assert autodiff.parameter_derivatives(law, quantity.method, arguments, leaves) == pytest.approx(exact, rel=1e-12)


def test_a_search_over_a_part_of_the_rows_finds_the_minimum_of_all():
    """With more rows than the search takes, the initial values are as good as the optimum itself."""
    fit = am.fit(LAWS["effective length"], bench(rows=400))
    values = find_initial_values(fit.problem)
    optimum, found = (np.sum(fit.problem.residuals(fit.problem.predict(v)) ** 2) for v in (fit.values, values))
    assert found == pytest.approx(optimum, rel=1e-4)


def test_samples_of_a_bootstrap_are_fits_to_the_drawn_runs():
    runs = bench()
    fit = am.fit(LAWS["braid"], runs)
    drawn = bootstrap(fit, runs, refits=5, by=RunSplit(), seed=3)
    counts = np.random.default_rng(3).multinomial(8, np.full(8, 1 / 8), size=5)
    # the groups are numbered in the order of their names
    names = sorted(r.origin for r in runs)
    by_name = {r.origin: r for r in runs}
    sample = [by_name[names[i]] for i, n in enumerate(counts[0]) for _ in range(n)]
    assert drawn.values[0] == pytest.approx(am.fit(fit.model, sample).values, rel=1e-5)


def test_a_comparison_states_the_errors_of_plain_fits():
    runs = bench()
    found = compare(runs, [Candidate("family", LAWS["effective length"])], leave_out=RunSplit()).recommended
    model = am.fit(LAWS["effective length"], runs[1:]).model.with_resting_length(0.15)
    error = model.force(runs[0]["pressure"], runs[0]["contraction"]) - runs[0]["force"]
    rows = runs[0]["force"] > 0
    assert found.fold_scores[0].rmse == pytest.approx(float(np.sqrt(np.mean(error[rows] ** 2))), rel=1e-6)
