"""Plane curves k(p) under 45, 130 and 260 N, and the surfaces over them, as defined by Borzíková et
al.:

k = k_max (1 - exp v) with v = Sum a_ij p^i F^j, or directly k[%] = Sum a_ij p^i F^j; p in bar, F in
N. Solutions are searched within the validity range; outside it a surface is flagged and
extrapolated linearly.
"""

import contextlib
import dataclasses

import numpy as np
import pytest

from airmuscle.core import autodiff
from airmuscle.errors import GeometryLimitError, ParameterError, SolveError
from airmuscle.files import load
from airmuscle.papers.borzikova_surfaces import sample
from airmuscle.physics import BorzikovaDirect, BorzikovaExponential
from airmuscle.physics.muscle.characteristic import SAM_30X290

# Coefficients of the exponent that the three printed curves determine, by Lagrange interpolation in
# F; rows by power of p in bar, columns by power of F in N. Ten decimals were computed apart from
# this program.
EXACT = """
     1.6846648427e-01  -2.0969209723e-03   5.6765232032e-06
    -2.4200192886e+00   2.9208299484e-02  -7.6323055877e-05
     6.3570889193e-01  -1.3148179522e-02   4.1115647690e-05
    -9.1269357045e-02   2.4281079659e-03  -8.8866673682e-06
     2.6581395349e-03  -7.9516994633e-05   4.5438282648e-07
"""
EXPONENTIAL = SAM_30X290.interpolate()


@pytest.fixture(scope="module")
def repaired() -> BorzikovaDirect:
    return load("borzikova-direct-repaired").characteristic


@pytest.mark.parametrize(
    ("force", "bar", "contraction"),
    [
        (45.0, 0.0, 0.40 - 0.40 * np.exp(0.0856)),
        (45.0, 2.0, 0.40 - 0.40 * np.exp(0.1273 * 4 - 1.2602 * 2 + 0.0856)),
        (130.0, 2.0, 0.40 - 0.40 * np.exp(0.0742 * 8 - 0.3787 * 4 + 0.0872 * 2 - 0.0082)),
        (
            260.0,
            2.0,
            0.40 - 0.40 * np.exp(0.0127 * 16 - 0.0607 * 8 - 0.0034 * 4 + 0.0147 * 2 + 0.007),
        ),
    ],
)
def test_a_plane_curve_is_the_printed_formula(force, bar, contraction):
    assert SAM_30X290.curve_at(force).contraction(bar * 1e5) == pytest.approx(
        contraction, abs=1e-15
    )


@pytest.mark.parametrize(
    ("force", "turns"), [(45.0, [4.950]), (130.0, [0.119, 3.283]), (260.0, [0.276, 3.600])]
)
def test_extrema_of_the_plane_curves(force, turns):
    found = SAM_30X290.curve_at(force).turning_pressures()
    assert [p / 1e5 for p in found] == pytest.approx(turns, abs=6e-4)


def test_between_the_loads_there_is_no_plane_curve():
    with pytest.raises(
        GeometryLimitError, match=r"at 200 N; curves exist at 45, 130, 260 N\. Use a surface"
    ):
        SAM_30X290.curve_at(200.0)


def test_the_surface_through_the_curves_has_the_known_coefficients():
    assert EXPONENTIAL.coefficients == pytest.approx([float(a) for a in EXACT.split()], rel=1e-10)
    assert load("borzikova-exponential").characteristic.coefficients == pytest.approx(
        EXPONENTIAL.coefficients, rel=1e-12
    )


def test_a_sample_of_the_curves_lies_on_the_surface_through_them():
    data = sample(SAM_30X290, 36)
    assert len(data) == 108
    found = EXPONENTIAL.contraction(data["pressure"], data["force"])
    assert np.abs(found - data["contraction"]).max() < 2e-15


def test_direct_contraction_is_in_per_cent_of_bar_and_newton():
    law = BorzikovaDirect((1.0, 0.0, 0.0, 0.0, 2.0, 0.5), 0.0, 3e5, 10.0, 100.0, 1, 2)
    # 1 + 2 p F + 0.5 p F^2 at 3 bar and 10 N is 1 + 60 + 150 per cent
    assert law.contraction(3e5, 10.0) == pytest.approx(2.11, abs=1e-14)


def test_exponential_contraction_saturates_from_its_exponent():
    law = BorzikovaExponential((0.1, 0.0, -0.5, 0.001), 0.0, 3e5, 10.0, 100.0, 1, 1, saturation=0.3)
    exponent = 0.1 - 0.5 * 2 + 0.001 * 2 * 50
    assert law.contraction(2e5, 50.0) == pytest.approx(0.3 * (1 - np.exp(exponent)), abs=1e-15)


@pytest.mark.parametrize("force", [60.0, 130.0, 180.0])
def test_force_and_pressure_invert_contraction(force, repaired):
    for law in (EXPONENTIAL, repaired):
        contraction = law.contraction(2e5, force)
        assert law.force(2e5, contraction) == pytest.approx(force, abs=1e-9)
        assert law.pressure(contraction, force) == pytest.approx(2e5, rel=1e-12)


def test_slopes_follow_from_contraction():
    force = 120.0
    step = 1e-3
    slopes = EXPONENTIAL.slopes(2e5, EXPONENTIAL.contraction(2e5, force))
    by_force = EXPONENTIAL.contraction(2e5, force + step) - EXPONENTIAL.contraction(
        2e5, force - step
    )
    assert slopes.by_contraction == pytest.approx(2 * step / by_force, rel=1e-6)


def test_solutions_are_searched_within_the_validity_range():
    with pytest.raises(
        SolveError, match=r"range 45 to 260 N gives a contraction of 39 % at 200 kPa"
    ):
        EXPONENTIAL.force(2e5, 0.39)
    with pytest.raises(
        SolveError, match=r"range 0 to 350 kPa gives 260 N at a contraction of 25 %"
    ):
        EXPONENTIAL.pressure(0.25, 260.0)


def test_points_outside_the_validity_range_are_flagged():
    pressure = np.array([-1.0, 0.0, 2e5, 3.5e5, 3.6e5, 2e5])
    force = np.array([100, 45, 44, 260, 100, 261.0])
    assert EXPONENTIAL.inside_validity_range(pressure, force).tolist() == [
        False,
        True,
        False,
        True,
        False,
        False,
    ]


def test_outside_the_validity_range_the_exponent_is_extrapolated_linearly():
    at_edge = EXPONENTIAL.polynomial(3.5e5, 150.0)
    slope = autodiff.derivative(EXPONENTIAL, "polynomial", 3.5e5 - 1e-6, 150.0, wrt=0)
    assert EXPONENTIAL.polynomial(5e5, 150.0) == pytest.approx(at_edge + 1.5e5 * slope, rel=1e-9)
    at_edge = EXPONENTIAL.polynomial(2e5, 260.0)
    slope = autodiff.derivative(EXPONENTIAL, "polynomial", 2e5, 260.0 - 1e-9, wrt=1)
    assert EXPONENTIAL.polynomial(2e5, 500.0) == pytest.approx(at_edge + 240.0 * slope, rel=1e-9)


def test_the_traced_model_gives_the_numeric_values():
    pressure = np.linspace(-1e5, 5e5, 30)
    force = np.linspace(0.0, 400.0, 30)
    values, by_parameters = autodiff.jacobian(EXPONENTIAL, "contraction", pressure, force)
    assert values == pytest.approx(EXPONENTIAL.surface(pressure, force), abs=1e-14)
    assert by_parameters.shape == (30, 15 + 4 + 1)


@pytest.mark.parametrize(
    ("pressure", "force"), [(6e5, 200.0), (3e5, 300.0), (3e5, 20.0), (-1e4, 200.0)]
)
@pytest.mark.parametrize(
    "law",
    [EXPONENTIAL, load("borzikova-direct-repaired").characteristic],
    ids=lambda law: type(law).__name__,
)
def test_no_direction_answers_outside_the_range_of_the_surface(law, pressure, force):
    with pytest.raises(SolveError, match=r"outside the validity range of the surface, 0 to 350"):
        law.contraction(pressure, force)
    contraction = float(law.surface(pressure, force))
    for direction, argument, (low, high) in (
        (law.force, pressure, law.force_range),
        (law.pressure, force, law.pressure_range),
    ):
        given = (argument, contraction) if direction == law.force else (contraction, argument)
        with contextlib.suppress(SolveError):  # another point of the surface, which is inside
            assert low <= direction(*given) <= high


def test_the_misprinted_surface_loads_with_a_warning():
    with pytest.warns(UserWarning, match="contains misprints"):
        printed = load("borzikova-direct-printed").characteristic
    assert printed.contraction(1e5, 260.0) < -5.0


def test_a_wrong_number_of_coefficients_is_an_error():
    with pytest.raises(
        ParameterError,
        match=r"with pressure_degree 4 and force_degree 2 needs 15 coefficients, not 14",
    ):
        dataclasses.replace(EXPONENTIAL, coefficients=EXPONENTIAL.coefficients[:14])


def test_an_empty_validity_range_is_an_error():
    with pytest.raises(ParameterError, match="min_force 260 must be less than max_force 260"):
        dataclasses.replace(EXPONENTIAL, min_force=260.0)
