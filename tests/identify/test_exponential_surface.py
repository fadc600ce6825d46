"""Fitting k = k_max (1 - exp v(p, F)) returns the surface behind the data, by logarithm and by
least squares on k.

What the data cannot determine is refused with the rank; a monotone fit never rises with F nor falls
with p, between the points as on them; the correlation index exists or says that it does not.
"""

import dataclasses
import math

import numpy as np
import pytest

from airmuscle.bench.estimation.statistics import correlation_index
from airmuscle.bench.statics import (
    CONTRACTION_FALLS,
    RISES_WITH_FORCE,
    Chebyshev,
    LoadRange,
    Monomials,
    SurfaceProblem,
    conditioning,
    find_monotonicity_violations,
    fit_linearised,
    fit_monotone,
    fit_nonlinear,
    slope_constraints,
)
from airmuscle.core import autodiff
from airmuscle.errors import IdentificationError
from airmuscle.papers.borzikova_surfaces import sample
from airmuscle.physics import BorzikovaExponential
from airmuscle.physics.muscle.characteristic import SAM_30X290
from airmuscle.recording import Recording

CURVES = sample(SAM_30X290)
EXACT = SAM_30X290.interpolate()
FITS = [fit_linearised, fit_nonlinear]


def other_muscle(points: int = 400, seed: int = 1) -> Recording:
    """A muscle of the user: other sizes, other k_max, scattered points, noise."""
    rng = np.random.default_rng(seed)
    pressure = rng.uniform(0, 6e5, points)
    force = rng.uniform(0, 1500, points)
    contraction = (
        0.3 * (1 - np.exp(-((pressure / 1e5) ** 1.5) / (4 + force / 150))) - 0.02 * force / 1500
    )
    noise = 0.004 * rng.standard_normal(points)
    return Recording(
        {"pressure": pressure, "force": force, "contraction": contraction + noise}, origin="bench"
    )


@pytest.mark.parametrize("procedure", FITS)
def test_undisturbed_curves_give_back_the_exact_surface(procedure):
    found = procedure(CURVES, 0.40)
    assert found.model.coefficients == pytest.approx(EXACT.coefficients, rel=1e-9)
    assert found.max_error < 1e-13
    assert (found.points, found.points_dropped, found.conditioning.rank) == (45, 0, 15)
    assert found.model.pressure_range == (0.0, 3.5e5)
    assert found.model.force_range == (45.0, 260.0)


# Plane curves rounded to 0.5 %, and with normal noise of 0.5 % (numpy's default generator, seed 0):
# rms in per cent of contraction, computed apart from this program.
@pytest.mark.parametrize(
    ("disturbance", "by_log", "by_k"), [("rounded", 0.1118, 0.1076), ("noise", 0.322, 0.319)]
)
def test_disturbed_curves_tell_the_procedures_apart(disturbance, by_log, by_k):
    k = CURVES["contraction"]
    noise = 0.005 * np.random.default_rng(0).standard_normal(45)
    data = CURVES.with_columns(
        contraction=np.round(k * 200) / 200 if disturbance == "rounded" else k + noise
    )
    digits = 0.00005 if disturbance == "rounded" else 0.0005
    assert 100 * fit_linearised(data, 0.40).rmse == pytest.approx(by_log, abs=digits)
    assert 100 * fit_nonlinear(data, 0.40).rmse == pytest.approx(by_k, abs=digits)


def test_least_squares_on_k_has_no_slope_left_in_any_coefficient():
    data = other_muscle()
    found = fit_nonlinear(data, 0.3)
    errors = found.model.contraction(data["pressure"], data["force"]) - data["contraction"]
    _, by_parameters = autodiff.jacobian(
        found.model, "contraction", data["pressure"], data["force"]
    )
    by_coefficients = by_parameters[:, :15]
    cosines = (
        errors
        @ by_coefficients
        / (np.linalg.norm(errors) * np.linalg.norm(by_coefficients, axis=0))
    )
    assert np.abs(cosines).max() < 1e-7
    assert found.rmse < fit_linearised(data, 0.3).rmse


def test_the_derivatives_by_the_coefficients_are_exact():
    problem = SurfaceProblem.from_recording(CURVES, 0.40, 4, 2)
    start = np.linspace(-0.5, 0.5, 15)
    step = 1e-6
    differences = [
        (problem.predict(start + step * e) - problem.predict(start - step * e)) / (2 * step)
        for e in np.eye(15)
    ]
    assert problem.jacobian(start) == pytest.approx(
        np.column_stack(differences), rel=1e-7, abs=1e-8
    )


@pytest.mark.parametrize("procedure", FITS)
def test_any_degrees_and_any_saturation_are_returned(procedure):
    rng = np.random.default_rng(3)
    validity_range = LoadRange(0.5e5, 6e5, 100.0, 900.0)
    chebyshev = 0.1 * rng.standard_normal(24)
    chebyshev[0] -= 1.0
    plain = Chebyshev(validity_range).to_bar_and_newton(chebyshev, 5, 3)
    law = BorzikovaExponential(tuple(plain), *validity_range, 5, 3, saturation=0.28)
    pressure, force = (v.ravel() for v in validity_range.grid(12, 7))
    data = Recording(
        {"pressure": pressure, "force": force, "contraction": law.contraction(pressure, force)},
        origin="law",
    )
    found = procedure(data, 0.28, pressure_degree=5, force_degree=3)
    assert found.max_error < 1e-12
    assert found.model.saturation == 0.28
    middle = (3.3e5, 444.0)
    assert found.model.contraction(*middle) == pytest.approx(law.contraction(*middle), abs=1e-12)


def test_points_without_a_logarithm_are_left_out_and_counted():
    k = CURVES["contraction"].copy()
    k[[13, 14]] = 0.40, 0.41
    data = CURVES.with_columns(contraction=k)
    found = fit_linearised(data, 0.40)
    assert found.points_dropped == 2
    assert found.model.coefficients == pytest.approx(EXACT.coefficients, rel=1e-8)
    assert found.max_error == pytest.approx(0.41 - EXACT.contraction(3.5e5, 45.0), abs=1e-10)
    assert "45 points, 2 of them not used (k >= k_max)" in str(found)
    assert fit_nonlinear(data, 0.40).points_dropped == 0


def test_two_loads_determine_ten_of_fifteen_coefficients():
    two = CURVES.rows(CURVES["force"] < 200)
    assert conditioning(two, Chebyshev(LoadRange.from_recording(two))).rank == 10
    for procedure in (*FITS, fit_monotone):
        with pytest.raises(
            IdentificationError,
            match=r"at loads of 45, 130 N determine 10 of the 15 .* Measure at 3 or more loads",
        ):
            procedure(two, 0.40)
    assert fit_linearised(two, 0.40, force_degree=1).max_error < 1e-13


def test_too_few_points_below_saturation_are_refused():
    with pytest.raises(
        IdentificationError, match="9 points at loads of 45, 130, 260 N determine 9 of the 15"
    ):
        fit_linearised(CURVES, 0.02)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda r: r.rows(slice(0, 14)), "14 points cannot determine 15 coefficients"),
        (lambda r: r.with_columns(force=np.full(45, 45.0)), "force is 45 N in every row"),
        (
            lambda r: r.with_columns(contraction=np.where(np.arange(45) == 6, np.nan, 0.1)),
            "row 7: contraction is not",
        ),
    ],
)
def test_unusable_recordings_are_refused(change, message):
    with pytest.raises(IdentificationError, match=message):
        fit_nonlinear(change(CURVES), 0.40)


# Condition numbers of the 15 coefficients on 15 even pressures and three loads, to the digits
# given; that in pascal and newton was computed with 150 decimal digits, where double precision
# alone finds 1.6e27.
@pytest.mark.parametrize(
    ("basis", "condition", "digit"),
    [
        (Monomials(1e5, 1.0), 2.2e8, 0.05e8),
        (Monomials(1.0, 1.0), 2.9560487788e27, 1e20),
        (Monomials(3.5e5, 260.0), 1.5e4, 0.05e4),
        (Chebyshev(LoadRange(0.0, 3.5e5, 45.0, 260.0)), 2.9, 0.05),
    ],
)
def test_conditioning_of_the_plane_curves(basis, condition, digit):
    found = conditioning(CURVES, basis)
    assert found.rank == 15
    assert found.condition == pytest.approx(condition, abs=digit)


# Places of the surface through the curves, read off its slopes on a grid of 201 x 201.
def test_breaks_are_named_with_their_places():
    rises, falls, falls_at_the_end, rises_at_the_start = find_monotonicity_violations(EXACT)
    assert (rises.rule, rises_at_the_start.rule) == (RISES_WITH_FORCE,) * 2
    assert (falls.rule, falls_at_the_end.rule) == (CONTRACTION_FALLS,) * 2
    assert rises.second_argument == pytest.approx((202, 260), abs=1)
    assert rises.pressure == pytest.approx((0.09e5, 3.5e5), abs=0.02e5)
    assert rises.area_fraction + rises_at_the_start.area_fraction == pytest.approx(0.17, abs=0.01)
    assert falls.pressure == pytest.approx((0.0, 0.61e5), abs=0.02e5)
    assert falls_at_the_end.second_argument == pytest.approx((94, 249), abs=1.5)
    assert falls_at_the_end.pressure == pytest.approx((3.22e5, 3.5e5), abs=0.02e5)
    assert rises.worst_slope > 0 > falls.worst_slope
    assert (
        "rises with force between 8.75 and 350 kPa, 202 N and 260 N (16.1 % of the validity range)"
        in str(rises)
    )
    assert "(less than 0.1 % of the validity range)" in str(
        dataclasses.replace(rises, area_fraction=1e-4)
    )


def test_a_box_without_a_break_has_none():
    assert find_monotonicity_violations(EXACT, LoadRange(1e5, 3e5, 45.0, 180.0)) == ()


@pytest.mark.parametrize("degrees", [(4, 2), pytest.param((6, 3), marks=pytest.mark.slow)])
def test_the_monotone_fit_holds_between_its_cells(degrees):
    data = CURVES if degrees == (4, 2) else other_muscle()
    saturation = 0.40 if degrees == (4, 2) else 0.3
    settings = {"pressure_degree": degrees[0], "force_degree": degrees[1]}
    free = fit_nonlinear(data, saturation, **settings)
    found = fit_monotone(data, saturation, cells=(8, 6), **settings)
    assert find_monotonicity_violations(free.model) != ()
    # ten times finer than the 8 x 6 cells, each with the degree + 1 points that enclose it
    assert find_monotonicity_violations(found.model, points=(401, 301)) == ()
    assert found.rmse >= free.rmse


def test_the_monotone_fit_is_the_best_of_the_monotone():
    """Nothing gains that a general solver finds with the slopes on a grid, where it is freer than
    on all the validity range.
    """
    from scipy.optimize import minimize

    found = fit_monotone(CURVES, 0.40, cells=(32, 24))
    assert 100 * found.rmse == pytest.approx(1.472, abs=0.0005)
    validity_range = LoadRange.from_recording(CURVES)
    columns = Chebyshev(validity_range).design_matrix(CURVES["pressure"], CURVES["force"], 4, 2)
    rows = slope_constraints(4, 2, (20, 15))
    start = np.linalg.lstsq(columns, -CURVES["pressure"] / 2e5, rcond=None)[0]

    def mean_square(c):  # held where a search that strays far would overflow
        remaining = np.exp(np.minimum(columns @ c, 50.0))
        errors = 100 * (0.40 * (1 - remaining) - CURVES["contraction"])
        return errors @ errors / 45, 2 / 45 * errors @ (-40 * remaining[:, None] * columns)

    peer = minimize(
        mean_square,
        start,
        jac=True,
        constraints={"type": "ineq", "fun": lambda c: rows @ c, "jac": lambda c: rows},
        method="SLSQP",
        options={"ftol": 1e-12, "maxiter": 300},
    )
    assert math.sqrt(peer.fun) == pytest.approx(100 * found.rmse, abs=1e-3)


@pytest.mark.parametrize("degrees", [(1, 0), (0, 1), (0, 0)])
def test_a_surface_that_does_not_depend_on_an_argument_is_monotone_in_it(degrees):
    settings = dict(zip(("pressure_degree", "force_degree"), degrees, strict=True))
    free = fit_nonlinear(CURVES, 0.40, **settings)
    found = fit_monotone(CURVES, 0.40, **settings)
    assert found.rmse == pytest.approx(free.rmse, rel=1e-6)


def test_data_that_are_monotone_are_fitted_as_if_free():
    pressure, force = (v.ravel() for v in LoadRange(0.0, 3e5, 50.0, 250.0).grid(9, 5))
    exponent = -1e-5 * pressure * (1 - force / 500)
    data = Recording(
        {"pressure": pressure, "force": force, "contraction": 0.3 * (1 - np.exp(exponent))},
        origin="law",
    )
    # level at zero pressure, so the margin of the monotone fit costs its 1e-9
    assert fit_monotone(data, 0.3).max_error < 1e-8


def test_the_index_is_the_root_of_the_explained_part():
    measured = np.array([0.0, 1.0, 2.0, 3.0])
    assert correlation_index(measured, measured).value == 1.0
    # SSE = 4 * 0.25, SST = 2.25 + 0.25 + 0.25 + 2.25
    assert correlation_index(measured, measured + 0.5).value == pytest.approx(
        math.sqrt(1 - 1.0 / 5.0)
    )


def test_the_mean_is_that_of_the_measured_values():
    assert correlation_index([0.0, 2.0], [5.0, 7.0]).r_squared == pytest.approx(1 - 50 / 2)


def test_where_there_is_no_index_it_is_said():
    found = correlation_index([0.0, 1.0, 2.0], [10.0, 10.0, 10.0])
    assert found.value is None
    assert found.r_squared == pytest.approx(1 - 245 / 2)
    assert str(found) == "undefined, because 1 - SSE/SST = -121.5 is negative"


@pytest.mark.parametrize(
    ("measured", "modelled", "message"),
    [
        ([1.0, 2.0], [1.0], "2 measured and 1 modelled"),
        ([1.0, np.nan], [1.0, 2.0], "not finite"),
        ([1.0, 1.0], [1.0, 2.0], "all measured values are equal"),
    ],
)
def test_an_undefined_index_is_refused(measured, modelled, message):
    with pytest.raises(IdentificationError, match=message):
        correlation_index(measured, modelled)
