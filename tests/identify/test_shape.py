"""A shaped surface never loses force with pressure nor gains it with contraction, at any point of
its validity range.

The conditions hold between the points of any grid; where data keep them anyway they change nothing;
where the free surface breaks them the place is named. A conversion of one law into another says how
far the two are apart.
"""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from airmuscle.bench import approximate, find_shape_violations, fit, fit_shape_constrained
from airmuscle.bench.statics import (
    FORCE_FALLS,
    RISES_WITH_CONTRACTION,
    blank_surface,
    shape_constraints,
)
from airmuscle.errors import IdentificationError, SolveError
from airmuscle.physics import Braid, ContractileSurface, Sarosi2012, TonduLopez2000, ValidityRange
from airmuscle.recording import Recording

MUSCLE = TonduLopez2000(Braid(0.01, 0.45, 0.3), 1.2)
BOX = ValidityRange(1e5, 6e5, 0.0, 0.2)


def points(n: int, noise: float, seed: int = 2) -> Recording:
    random = np.random.default_rng(seed)
    pressure = random.uniform(*BOX.pressure, n)
    contraction = random.uniform(*BOX.contraction, n)
    force = MUSCLE.force(pressure, contraction) + noise * random.standard_normal(n)
    return Recording({"pressure": pressure, "contraction": contraction, "force": force}, "bench")


def test_few_and_noisy_points_bend_a_free_surface_and_not_a_shaped_one():
    data = points(40, 60.0)
    found = fit_shape_constrained(blank_surface(4), data)
    assert {b.rule for b in found.unconstrained_violations} == {FORCE_FALLS, RISES_WITH_CONTRACTION}
    assert find_shape_violations(found.model, found.model.validity_range, points=201) == ()
    assert found.rmse > found.unconstrained_rmse
    grid = np.meshgrid(
        np.linspace(*found.model.validity_range.pressure, 60),
        np.linspace(*found.model.validity_range.contraction, 60),
    )

    def distance(law):
        return float(np.sqrt(np.mean((law.force(*grid) - MUSCLE.force(*grid)) ** 2)))

    assert distance(found.model) < distance(fit(blank_surface(4), data).model)


def test_a_shaped_surface_is_shown_by_print_and_in_a_notebook_also_after_it_was_sent():
    found = pickle.loads(pickle.dumps(fit_shape_constrained(blank_surface(4), points(40, 60.0))))
    text = " ".join(str(found).split())
    assert f"{found.rmse:.4g} N with constraints, {found.unconstrained_rmse:.4g} N without" in text
    assert str(found.unconstrained_violations[0])[:40] in text
    assert "<img" in found._repr_html_()


def test_conditions_that_hold_anyway_change_nothing():
    data = points(200, 0.5)
    found = fit_shape_constrained(blank_surface(2), data)
    free = fit(blank_surface(2), data).model
    assert found.unconstrained_violations == ()
    assert found.model.coefficients == pytest.approx(free.coefficients, abs=1e-6)
    assert found.rmse == pytest.approx(found.unconstrained_rmse, rel=1e-9)


@pytest.mark.slow
def test_the_conditions_are_those_of_the_slopes():
    """Enough: where all hold, both slopes have their sign everywhere. Nearly necessary: a plain
    slope passes.
    """
    rows = shape_constraints(3, (5, 4))
    random = np.random.default_rng(1)
    q, x = (v.ravel() for v in np.meshgrid(np.linspace(-1, 1, 41), np.linspace(-1, 1, 41)))
    tried = 0
    for _ in range(400):
        a = random.normal(size=10) * np.array([1, 1, 0.2, 0.1, 1, 0.2, 0.1, 0.2, 0.1, 0.1])
        a[1], a[4] = a[1] - 1.5, a[4] + 1.5
        law = ContractileSurface(tuple(a), -1.0, 1.0, -1.0, 1.0, -1e6, 1e6, 3)
        by_p, by_c = law.slopes(q, x)
        if (rows @ a >= 0).all():
            tried += 1
            assert by_p.min() > -1e-12
            assert by_c.max() < 1e-12
    assert tried > 40
    assert (rows @ np.array([0, -1.0, 0, 0, 1.0, 0, 0, 0, 0, 0]) >= -1e-12).all()


def test_at_points_of_free_contraction_the_force_is_zero():
    data = points(150, 5.0)
    pressure = np.array([2e5, 4e5, 6e5])
    free = Recording({"pressure": pressure, "contraction": np.full(3, 0.2)}, "hung free")
    found = fit_shape_constrained(blank_surface(4), data, free=free)
    assert found.model.unclamped_force(pressure, free["contraction"]) == pytest.approx(
        np.zeros(3), abs=1e-8
    )
    assert find_shape_violations(found.model, found.model.validity_range) == ()
    none = fit_shape_constrained(blank_surface(4), data, free=free.rows(slice(0, 0)))
    assert none.rmse == pytest.approx(fit_shape_constrained(blank_surface(4), data).rmse, rel=1e-6)
    many = Recording(
        {"pressure": np.linspace(1e5, 6e5, 9), "contraction": np.linspace(0.05, 0.2, 9) ** 2},
        "too many",
    )
    with pytest.raises(
        IdentificationError, match="3 points of free contraction determine all 3 coefficients"
    ):
        fit_shape_constrained(blank_surface(1), data, free=many)


def test_the_place_of_a_break_is_named():
    law = Sarosi2012(0.0, 0.0, -1.0, 4e-3, 1e-3, 50.0)  # gains force with contraction everywhere
    (found,) = find_shape_violations(law, BOX)
    assert found.rule is RISES_WITH_CONTRACTION
    assert found.area_fraction == 1.0
    assert found.worst_point[0] == 6e5
    assert found.worst_slope == pytest.approx(4e-3 * 6e5)
    assert "600 kPa" in str(found)


def test_a_conversion_finds_the_same_law_in_another_form():
    """F = p (A eps^2 + B eps + C) is a surface of degree three, exactly."""
    found = approximate(MUSCLE, blank_surface(3), BOX)
    assert found.rmse < 1e-9
    assert approximate(found.model, TonduLopez2000(Braid(0.012, 0.4, 0.3), 1.0), BOX).rmse < 1e-6


def test_a_conversion_says_how_far_it_is_off():
    found = approximate(MUSCLE, blank_surface(1), BOX)
    grid = np.meshgrid(np.linspace(*BOX.pressure, 300), np.linspace(*BOX.contraction, 300))
    difference = found.model.force(*grid) - MUSCLE.force(*grid)
    worst = found.max_error
    assert np.abs(worst.error) == pytest.approx(np.abs(difference).max(), rel=0.02)
    denser = (
        1 - np.cos(np.pi * np.linspace(0, 1, 300))
    ) / 2  # as the conversion judges: denser towards the edges
    grid = np.meshgrid(1e5 + 5e5 * denser, 0.2 * denser)
    difference = found.model.force(*grid) - MUSCLE.force(*grid)
    assert found.rmse == pytest.approx(np.sqrt(np.mean(difference**2)), rel=0.1)
    at = (worst.pressure, worst.contraction)
    assert found.model.force(*at) - MUSCLE.force(*at) == pytest.approx(worst.error, rel=1e-9)
    assert f"{worst.error:.4g} N" in str(found)
    with pytest.raises(SolveError, match="gives no positive force on the validity range"):
        approximate(MUSCLE, blank_surface(1), ValidityRange(1e5, 6e5, 0.5, 0.55))
