"""Contractile surface: powers, force limits, monomial coefficients, and extrapolation outside the
validity range.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from airmuscle.errors import ParameterError
from airmuscle.physics import ContractileSurface
from airmuscle.physics.muscle.characteristic import exponents

BOX = (50e3, 650e3), (0.0, 0.25)


def surface(seed, degree=5, **clamp):
    coefficients = np.random.default_rng(seed).normal(0.0, 200.0, len(exponents(degree)))
    limits = {"min_force": -1e9, "max_force": 1e9} | clamp
    return ContractileSurface(tuple(coefficients), *BOX[0], *BOX[1], degree=degree, **limits)


@pytest.mark.parametrize("degree", [1, 2, 3, 5, 7])
def test_a_polynomial_of_total_degree_n_has_its_powers_and_no_others(degree):
    assert len(exponents(degree)) == (degree + 1) * (degree + 2) // 2
    assert {i + j for i, j in exponents(degree)} == set(range(degree + 1))


@given(st.integers(0, 99), st.floats(*BOX[0]), st.floats(*BOX[1]))
def test_inside_the_validity_range_it_is_the_sum_of_its_powers(seed, pressure, contraction):
    law = surface(seed)
    x = 2 * contraction / 0.25 - 1
    q = 2 * (pressure - 50e3) / 600e3 - 1
    expected = sum(
        a * x**i * q**j for a, (i, j) in zip(law.coefficients, exponents(5), strict=True)
    )
    assert law.force(pressure, contraction) == pytest.approx(expected, abs=1e-8)
    plain = law.monomial_coefficients(1e5)
    exported = sum(a * contraction**i * (pressure / 1e5) ** j for (i, j), a in plain.items())
    assert exported == pytest.approx(expected, abs=1e-6)


@given(st.integers(0, 99), st.floats(-1e5, 9e5), st.floats(-0.05, 0.4))
def test_outside_the_validity_range_it_neither_increases_with_contraction_nor_decreases_with_pressure(
    seed, pressure, contraction
):
    law = surface(seed)
    if contraction > 0.25 or contraction < 0.0:
        out = contraction + 0.01 * np.sign(contraction)
        further = max(out, contraction)
        nearer = min(out, contraction)
        assert law.force(pressure, further) <= law.force(pressure, nearer) + 1e-9
    if not 50e3 <= pressure <= 650e3:
        out = pressure + 1e4 * np.sign(pressure - 300e3)
        assert (
            law.force(max(out, pressure), contraction)
            >= law.force(min(out, pressure), contraction) - 1e-9
        )


@given(st.integers(0, 99), st.floats(*BOX[0]))
def test_it_is_continuous_at_the_edge_of_the_validity_range(seed, pressure):
    law = surface(seed)
    full, here = (max(law.force(p, edge) for edge in BOX[1]) for p in (BOX[0][1], pressure))
    assume(full > here)  # a muscle pulls most at its maximum pressure
    for edge in BOX[1]:
        # a surface that pushes inside is slack outside
        below, above = (max(law.force(pressure, edge + h), 0.0) for h in (-1e-9, 1e-9))
        assert below == pytest.approx(above, abs=1e-3)


def test_a_physical_slope_is_extrapolated_linearly():
    falling = ContractileSurface((300.0, -100.0, 200.0), *BOX[0], *BOX[1], degree=1)
    slopes = falling.slopes(300e3, 0.1)
    expected = (
        falling.force(650e3, 0.25) + slopes.by_pressure * 100e3 + slopes.by_contraction * 0.02
    )
    assert falling.unclamped_force(750e3, 0.27) == pytest.approx(expected)


def test_it_stays_within_its_force_limits():
    law = surface(3, min_force=0.0, max_force=1200.0)
    force = law.force(np.linspace(-1e5, 1e6, 50)[:, None], np.linspace(-0.05, 0.4, 50)[None, :])
    assert force.min() == 0.0
    assert force.max() == 1200.0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"coefficients": (1.0, 2.0)}, "degree 5 requires 21 coefficients, not 2"),
        ({"max_pressure": 1e3}, "min_pressure 50000 must be less than max_pressure 1000"),
        ({"max_contraction": -0.1}, "min_contraction 0 must be less than max_contraction -0.1"),
        ({"min_force": 1e10}, "min_force 1e\\+10 must be less than max_force"),
    ],
)
def test_invalid_surfaces_are_errors(change, message):
    with pytest.raises(ParameterError, match=message):
        dataclasses.replace(surface(0), **change)


def test_the_labels_of_the_terms_follow_the_order_of_the_coefficients():
    assert ContractileSurface.blank(2).term_labels == ("1", "x", "x^2", "q", "x q", "q^2")
