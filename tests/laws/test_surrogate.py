"""A polynomial surrogate errs by no more than its estimated maximum error, wherever its law has a
solution.
"""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from widths import widened

from airmuscle.bench import approximate
from airmuscle.core import model, parameter
from airmuscle.errors import AirmuscleWarning, SolveError
from airmuscle.files import library
from airmuscle.physics import (
    Braid,
    ChouHannaford1996,
    ContractileSurface,
    ForceLaw,
    Tabulated,
    ValidityRange,
    as_force_law,
)
from airmuscle.physics.muscle.characteristic.polynomial_surrogate import (
    estimate_maximum,
    values_or_nan,
)

SMALL = Tabulated(
    (1e5, 1e5, 1e5, 2e5, 2e5), (0.0, 0.05, 0.1, 0.0, 0.2), (100.0, 40.0, 0.0, 200.0, 0.0)
)
PARTLY_SOLVED = [(5e4, 4e5, 0.01, 0.12), (1e5, 3.5e5, 0.02, 0.3)]
"""Ranges of borzikova-monotone in which its error is largest at the edge of the region with a
solution.
"""
OTHERS = [
    "festo-tool-dmsp-20",
    "dmsp-20-300",
    "hunt2017-festo-10",
    "festo-tool-dmsp-10",
    "festo-tool-dmsp-40",
    "sarosi-dmsp-10",
]
CASES = [
    *(("borzikova-monotone", limits) for limits in PARTLY_SOLVED),
    *((name, None) for name in OTHERS),
]


@pytest.mark.parametrize(
    ("name", "limits"), widened(CASES, lambda *case: case in (CASES[0], *CASES[2:5]))
)
def test_no_point_errs_by_more_than_the_estimated_maximum_error(name, limits):
    entry = library.load(name)
    validity_range = ValidityRange(*limits) if limits else entry.validity_range
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)
        surrogate = as_force_law(entry.characteristic, validity_range)
    p, c = _points(validity_range)
    error = np.abs(surrogate.force(p, c) - values_or_nan(entry.characteristic.force, p, c))
    assert 0.5 * surrogate.max_error <= np.nanmax(error) <= surrogate.max_error
    assert 1.05 * np.nanmax(error) <= surrogate.max_error * (
        1 + 2e-3
    )  # the margin remains for what is not searched
    assert 1.0 - np.isnan(error).mean() == pytest.approx(surrogate.coverage, abs=0.03)


def test_the_rms_error_is_that_of_other_points():
    entry = library.load("festo-tool-dmsp-20")
    surrogate = as_force_law(entry.characteristic, entry.validity_range)
    p, c = _points(entry.validity_range)
    error = surrogate.force(p, c) - entry.characteristic.force(p, c)
    assert np.sqrt(np.mean(error**2)) == pytest.approx(surrogate.rms_error, rel=0.15)
    assert surrogate.coverage == 1.0


def _points(validity_range: ValidityRange) -> tuple[np.ndarray, ...]:
    """Pressures and contractions of a grid of 101 x 101 points and of 5000 random ones."""
    spans = validity_range.pressure, validity_range.contraction
    grid = np.meshgrid(*(np.linspace(*span, 101) for span in spans))
    generator = np.random.default_rng(8)
    return tuple(
        np.append(g.ravel(), generator.uniform(*span, 5000))
        for g, span in zip(grid, spans, strict=True)
    )


def test_a_law_has_a_solution_at_the_same_points_one_by_one_and_all_at_once():
    law = library.load("borzikova-monotone").characteristic
    p, c = np.meshgrid(np.linspace(5e4, 3.5e5, 5), np.linspace(0.01, 0.3, 5))
    single = [
        values_or_nan(law.force, *(np.array([float(v)]) for v in point))[0]
        for point in zip(p.ravel(), c.ravel(), strict=True)
    ]
    np.testing.assert_allclose(values_or_nan(law.force, p.ravel(), c.ravel()), single, rtol=1e-12)
    with pytest.raises(SolveError, match="no force in the range"):
        law.force(p, c)


def test_a_surrogate_of_a_polynomial_is_exact():
    law = ChouHannaford1996(Braid(0.01, 0.4363, 0.3))
    surrogate = as_force_law(
        law, ValidityRange(5e4, 6e5, 0.0, 0.3), degree=3
    )  # linear in p, quadratic in eps
    assert surrogate.max_error < 1e-9
    assert surrogate.force(3.3e5, 0.123) == pytest.approx(law.force(3.3e5, 0.123), rel=1e-12)


def test_a_surrogate_warns_where_the_model_has_no_solution():
    validity_range = ValidityRange(1e5, 2e5, 0.0, 0.2)
    with pytest.warns(
        AirmuscleWarning, match=r"Tabulated has no solution on \d\d % of the validity range"
    ):
        surrogate = as_force_law(SMALL, validity_range, degree=3)
    assert 0.4 < surrogate.coverage < 0.6
    with pytest.raises(SolveError, match="0 of 400 points of the validity range"):
        as_force_law(SMALL, ValidityRange(3e5, 4e5, 0.0, 0.2), degree=4)


def test_a_surrogate_of_an_unbounded_force_is_refused():
    law = library.load("saga2007").characteristic
    with pytest.raises(
        SolveError, match=r"force of Saga2007 is unbounded at a contraction of 0 % and 50 kPa"
    ):
        as_force_law(law, ValidityRange(5e4, 2e5, 0.0, 0.3))
    assert as_force_law(law, ValidityRange(5e4, 2e5, 0.02, 0.3)).max_error < 5.0


NODES = np.linspace(-1.0, 1.0, 39)


def _estimated(error) -> float:
    y, x = np.meshgrid(NODES, NODES, indexing="ij")
    return estimate_maximum(error, error(x, y), NODES)


def test_the_search_finds_a_peak_between_the_points_of_the_grid():
    def cone(x, y):
        return 1.0 - 12.0 * np.hypot(x - 0.0263, y + 0.4474)

    y, x = np.meshgrid(NODES, NODES)
    assert cone(x, y).max() < 0.75
    assert _estimated(cone) == pytest.approx(1.0, abs=0.01)


def test_the_search_finds_the_maximum_at_the_edge_of_the_region_with_a_solution():
    def steep(x, y):
        return np.where(x <= 0.3423, np.exp(200.0 * (x - 0.3423)), np.nan)

    y, x = np.meshgrid(NODES, NODES)
    assert np.nanmax(steep(x, y)) < 0.1
    assert _estimated(steep) == pytest.approx(1.0, abs=0.01)


@model
class PoleLaw(ForceLaw):
    """A law of a user that is infinite within its range: F = p a/(eps - 0.1)^2."""

    area: float = parameter("m2", "a", "area", bounds=(0.0, 1.0))

    def force(self, pressure, contraction):
        return pressure * self.area / (contraction - 0.1) ** 2


@pytest.mark.parametrize(
    "sample",
    [
        lambda law, known: as_force_law(law, known, degree=3),
        lambda law, known: approximate(law, ContractileSurface.blank(3), known),
    ],
    ids=["as_force_law", "approximate"],
)
def test_what_is_infinite_or_not_approximated_is_refused_by_every_fit_of_a_law(sample):
    law = PoleLaw(1e-4)
    with pytest.raises(SolveError, match=r"does not approximate the law|is unbounded at a"):
        sample(law, ValidityRange(1e5, 6e5, 0.0, 0.2))
    beside = ValidityRange(1e5, 6e5, 0.13, 0.2)  # a smaller range, as the message proposes
    assert sample(law, beside) is not None
    with pytest.raises(SolveError, match=r"is unbounded at a contraction of .* such as"):
        sample(PoleLaw(5e-3), ValidityRange(1e5, 6e5, 0.0, 0.0999))
