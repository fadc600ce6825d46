"""Straight fibres: the integrals of every meridian are those of its curve, and its arc is the fibre
length.

Reference values are of the muscle of Table 1 of Saga et al. 2007 (l0 = 72 mm, r0 = 6 mm), computed
from the closed forms independently of this code. dV/deps is exact, and the tension of the ideal
muscle is (p dV/deps)/L0.
"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

from airmuscle.core import autodiff
from airmuscle.errors import GeometryLimitError, ParameterError
from airmuscle.physics import (
    Catenary,
    CircularArc,
    HalfShellFibreSum,
    Parabola,
    PleatedTube,
    PrintedFibreSum,
    StraightFibre,
    TrueArcParabola,
    UniformFibreSum,
    UserDefinedFibreSum,
)
from airmuscle.physics.muscle.geometry.meridian import stumpff

L0 = 0.072
D0 = 0.012
CIRCLE = CircularArc()
CATENARY = Catenary()
TRUE_ARC = TrueArcParabola()
PARABOLA = Parabola()
MERIDIANS = (CIRCLE, CATENARY, TRUE_ARC, PARABOLA)
KEEP_THEIR_ARC = (CIRCLE, CATENARY, TRUE_ARC)
CONTRACTIONS = np.array([0.01, 0.05, 0.10, 0.20, 0.30, 0.40])

# contraction %, meridian, psi or u, largest radius mm, tan phi0, V mm3, Int r dx mm2, G mm2
OUTLINES = """
1 circle 0.245318 10.39362 0.250360 18271.92 637.0980 210.6818
1 catenary 0.245811 10.40246 0.248294 18274.43 637.0951 210.6847
1 true-arc 0.247296 10.40681 0.247296 18275.55 637.0916 210.6840
1 parabola 0.246183 10.38698 0.246183 18219.20 636.1493 209.7247
5 circle 0.551911 15.68477 0.615738 35641.26 859.0294 462.4831
5 catenary 0.557602 15.78462 0.586949 35695.37 858.8654 462.6477
5 true-arc 0.574893 15.83067 0.574893 35711.27 858.6787 462.6125
5 parabola 0.561951 15.60937 0.561951 34837.78 848.5873 451.5932
10 circle 0.786683 19.44491 1.002573 50527.50 989.1575 638.5491
10 catenary 0.803436 19.73105 0.892707 50706.48 988.2190 639.4942
10 true-arc 0.855116 19.85288 0.855116 50725.03 987.2445 639.3213
10 parabola 0.816497 19.22724 0.816497 47866.63 960.2170 607.1925
20 circle 1.131103 24.27965 2.125821 70741.88 1101.2107 857.8207
20 catenary 1.182726 25.11150 1.478407 71179.31 1095.7747 863.3379
20 true-arc 1.348122 25.41295 1.348122 70988.41 1091.0574 862.5954
20 parabola 1.224745 23.63633 1.224745 62063.95 1022.8349 766.8873
30 circle 1.410185 27.44600 6.172596 82565.99 1118.5476 992.6950
30 catenary 1.514455 29.01988 2.163507 82946.75 1103.1853 1008.4237
30 true-arc 1.865228 29.50188 1.865228 82112.45 1092.0630 1006.8806
30 parabola 1.603567 26.20495 1.603567 65767.76 981.2863 823.3567
40 circle 1.660035 29.61898 -11.176165 88092.27 1081.6525 1076.0011
40 catenary 1.838593 32.12032 3.064321 87710.97 1049.2520 1109.5043
40 true-arc 2.477670 32.75884 2.477670 85767.09 1029.8546 1107.1592
40 parabola 2.000000 27.60000 2.000000 62108.35 881.2800 814.2457
"""
NAMES = {"circle": CIRCLE, "catenary": CATENARY, "true-arc": TRUE_ARC, "parabola": PARABOLA}
ROWS = [line.split() for line in OUTLINES.strip().splitlines()]

# exact outline: contraction %, mu, theta0, R mm, phi0 deg, F/p mm2, V mm3, Int r dx mm2, G mm2, Q
# mm3
EXACT = """
1 0.0195524 0.959971 10.46128 13.1548 8448.226 18282.69 636.9107 210.5410 746.089
5 0.0703416 1.184359 15.91973 28.4419 4863.313 35726.51 857.9861 462.2634 3623.047
10 0.127583 1.263487 19.83501 39.8090 3607.872 50727.40 987.1396 639.2751 6962.182
20 0.235296 1.327764 24.93277 56.1748 2197.041 71206.80 1097.393 863.1376 12786.48
30 0.337519 1.357539 28.34943 69.1943 1215.470 83333.92 1112.949 1005.834 17487.03
40 0.435248 1.374635 30.78419 80.6438 442.9129 89202.69 1074.167 1100.274 21083.56
"""
EXACT_ROWS = [[float(x) for x in line.split()] for line in EXACT.strip().splitlines()]
# rings: F/p mm2, R mm, V mm3 of the whole muscle at CONTRACTIONS
RINGS = {
    1: (
        (3367.080, 1652.497, 1119.792, 590.2175, 255.5324, 5.5180),
        (8.21766, 10.92490, 12.86758, 15.39587, 17.08670, 18.28629),
        (12589.51, 18955.02, 23822.83, 29781.45, 32759.09, 33660.06),
    ),
    2: (
        (2029.565, 903.7548, 569.6729, 255.6515, 67.2107, -69.1688),
        (7.47458, 9.27061, 10.55857, 12.23340, 13.35127, 14.14154),
        (10951.00, 14599.81, 17170.72, 20012.84, 21133.07, 21102.78),
    ),
}


def printed(text, value):
    """Agreement to the last printed digit of a table."""
    digits = text.partition(".")[2]
    return abs(float(text) - value) <= 0.51 * 10.0 ** -len(digits)


def tube(meridian, rings=0):
    return StraightFibre(L0, D0, rings, meridian)


@pytest.mark.parametrize("row", ROWS, ids=lambda r: f"{r[1]}-{r[0]}")
def test_outlines_agree_with_the_reference_table(row):
    percent, name, shape, radius, slope, volume, section, arc_excess = row
    contraction = float(percent) / 100
    meridian = NAMES[name]
    segment = tube(meridian).segment(contraction)
    found = {
        "circle": lambda: np.sqrt(meridian.angle_squared(contraction)),
        "catenary": lambda: np.sqrt(meridian.shape_squared(contraction)),
        "true-arc": lambda: np.sqrt(meridian.slope_squared(contraction)),
        "parabola": lambda: segment.end_slope,
    }[name]()
    assert printed(shape, found)
    assert printed(radius, 1e3 * segment.max_radius)
    assert printed(slope, segment.end_slope)
    assert printed(volume, 1e9 * segment.volume)
    assert printed(section, 1e6 * segment.half_section)
    assert printed(arc_excess, 1e6 * segment.arc_excess)


@pytest.mark.parametrize("meridian", MERIDIANS, ids=lambda m: type(m).__name__)
@pytest.mark.parametrize("contraction", [1e-6, 0.1, 0.35, 0.45])
def test_integrals_are_those_of_the_profile(meridian, contraction):
    segment = tube(meridian).segment(contraction)
    points = 20001
    x, r = meridian.profile(contraction, L0, D0 / 2, np.linspace(-1, 1, points))
    dx = np.diff(x)
    dr = np.diff(r)
    ds = np.hypot(dx, dr)
    middle = (r[1:] + r[:-1]) / 2
    rise = middle - D0 / 2
    assert segment.length == pytest.approx(dx.sum(), rel=1e-12)
    assert segment.arc == pytest.approx(ds.sum(), rel=1e-7)
    assert segment.max_radius == pytest.approx(r.max(), rel=1e-9)
    assert segment.half_section == pytest.approx((middle * dx).sum(), rel=1e-7)
    assert segment.arc_excess == pytest.approx((rise * ds).sum(), rel=1e-6)
    assert segment.arc_excess_squared == pytest.approx((rise**2 * ds).sum(), rel=1e-6)
    assert segment.volume == pytest.approx((np.pi * middle**2 * dx).sum(), rel=1e-6)
    assert np.arctan2(segment.end_sine, segment.end_cosine) == pytest.approx(
        np.arctan2(dr[0], dx[0]), abs=2e-4
    )


@pytest.mark.parametrize("meridian", KEEP_THEIR_ARC, ids=lambda m: type(m).__name__)
def test_newton_solves_the_shape_equation_to_rounding_over_its_whole_range(meridian):
    contraction = np.concatenate([np.geomspace(1e-12, 0.01, 40), np.linspace(0.011, 0.5, 200)])
    if meridian is CIRCLE:
        z = meridian.angle_squared(contraction)
        solved = [
            brentq(lambda a, c=c: np.sin(a) / a - (1 - c), 0.05, 2.0, xtol=1e-15)
            for c in (0.1, 0.3, 0.45)
        ]
        error = z * stumpff(3, -z) / contraction - 1
    elif meridian is CATENARY:
        z = meridian.shape_squared(contraction)
        solved = [
            brentq(lambda u, c=c: u / np.sinh(u) - (1 - c), 0.05, 3.0, xtol=1e-15)
            for c in (0.1, 0.3, 0.45)
        ]
        error = z * stumpff(3, z) / (contraction / (1 - contraction)) - 1
    else:
        z = meridian.slope_squared(contraction)
        solved = [brentq(_true_arc, 0.05, 5.0, args=(c,), xtol=1e-15) for c in (0.1, 0.3, 0.45)]
        arc = np.array(
            [quad(lambda t, a=a: a * t * t / (1 + np.sqrt(1 + a * t * t)), 0, 1)[0] for a in z]
        )
        error = arc / (contraction / (1 - contraction)) - 1
    assert np.abs(error).max() < 5e-15
    method = {CIRCLE: "angle_squared", CATENARY: "shape_squared", TRUE_ARC: "slope_squared"}[
        meridian
    ]
    assert [np.sqrt(getattr(meridian, method)(c)) for c in (0.1, 0.3, 0.45)] == pytest.approx(
        solved, rel=3e-15
    )


def _true_arc(u, contraction):
    return (np.sqrt(1 + u * u) + np.arcsinh(u) / u) / 2 - 1 / (1 - contraction)


@pytest.mark.parametrize("meridian", MERIDIANS, ids=lambda m: type(m).__name__)
@given(contraction=st.floats(1e-4, 0.44))
def test_the_volume_derivative_is_exact_with_unrolled_newton_steps(meridian, contraction):
    shape = tube(meridian)
    step = 2e-3 * contraction
    ends = [shape.volume(contraction + n * step) for n in (-2, -1, 1, 2)]
    by_difference = (ends[0] - 8 * ends[1] + 8 * ends[2] - ends[3]) / (12 * step)
    assert shape.volume_derivative(contraction) == pytest.approx(by_difference, rel=2e-8, abs=1e-12)


def test_the_closed_form_derivatives_of_the_circle_are_those_of_its_integrals():
    contraction = np.array([1e-9, 1e-4, 0.03, 0.2, 0.4, 0.49])
    shape = tube(CIRCLE)
    z = CIRCLE.angle_squared(contraction)
    growth = CIRCLE.derivatives_times_angle(z, L0, D0 / 2)
    assert growth.volume / np.sqrt(z) == pytest.approx(
        autodiff.derivative(shape, "volume", contraction), rel=1e-12
    )
    step = 1e-3 * contraction
    for name in ("arc_excess", "arc_excess_squared"):
        ends = [getattr(shape.segment(contraction + n * step), name) for n in (-2, -1, 1, 2)]
        by_difference = (ends[0] - 8 * ends[1] + 8 * ends[2] - ends[3]) / (12 * step)
        assert getattr(growth, name) / np.sqrt(z) == pytest.approx(by_difference, rel=1e-10)


@pytest.mark.parametrize("meridian", MERIDIANS, ids=lambda m: type(m).__name__)
def test_small_contractions_are_accurate(meridian):
    """To first order in sqrt(eps): tan(phi0) = sqrt(6 eps), G = l0^2 sqrt(6 eps)/6, Q = l0^3 6
    eps/30.
    """
    for contraction in (1e-14, 1e-10, 1e-8):
        u = np.sqrt(6 * contraction)
        segment = tube(meridian).segment(contraction)
        assert segment.end_slope == pytest.approx(u, rel=20 * u + 1e-15)
        assert segment.arc_excess == pytest.approx(L0**2 * u / 6, rel=20 * u**2 + 1e-15)
        assert segment.arc_excess_squared == pytest.approx(
            L0**3 * u**2 * 8 / 15 / 16, rel=20 * u**2 + 1e-15
        )


def test_rest_is_a_cylinder():
    for shape in (*(tube(m) for m in MERIDIANS), PleatedTube(L0, D0)):
        assert shape.volume(0.0) == pytest.approx(np.pi * (D0 / 2) ** 2 * L0, rel=1e-15)
        assert shape.outline(0.0)[1] == pytest.approx(D0 / 2, rel=1e-15)


def test_the_parabola_3_is_too_short_by_what_the_reference_says():
    contraction = np.array([0.01, 0.05, 0.10, 0.20, 0.25, 0.30, 0.40])
    arcs = 1e3 * tube(PARABOLA).segment(contraction).arc
    assert np.round(arcs, 3).tolist() == [71.994, 71.846, 71.411, 69.798, 68.649, 67.281, 63.890]
    assert tube(TRUE_ARC).segment(contraction).arc == pytest.approx(L0, rel=1e-14)


@pytest.mark.parametrize(
    ("shape", "percent"),
    [
        (PleatedTube(L0, D0), 46.88),
        (tube(CIRCLE), 45.98),
        (tube(CATENARY), 42.61),
        (tube(TRUE_ARC), 40.40),
        (tube(PARABOLA), 29.47),
    ],
)
def test_contractions_of_maximum_volume_agree_with_the_reference(shape, percent):
    found = 100 * brentq(lambda c: float(shape.volume_derivative(c)), 0.2, 0.49, xtol=1e-9)
    assert round(found, 2) == percent


@pytest.mark.parametrize("row", EXACT_ROWS, ids=lambda r: f"{r[0]:g}%")
def test_the_exact_outline_agrees_with_its_reference_table(row):
    contraction = row[0] / 100
    shape = PleatedTube(L0, D0)
    ellipse = shape.elliptic_outline(contraction)
    segment = shape.segment(contraction)
    found = (
        ellipse.parameter,
        ellipse.angle,
        1e3 * segment.max_radius,
        np.degrees(np.arctan2(segment.end_sine, segment.end_cosine)),
        1e6 * shape.effective_area(contraction),
        1e9 * segment.volume,
        1e6 * segment.half_section,
        1e6 * segment.arc_excess,
        1e9 * segment.arc_excess_squared,
    )
    assert found == pytest.approx(row[1:], rel=6e-7 * 10)


@pytest.mark.parametrize("rings", RINGS)
def test_rings_divide_the_exact_muscle(rings):
    areas, radii, volumes = RINGS[rings]
    shape = PleatedTube(L0, D0, rings)
    assert 1e6 * shape.effective_area(CONTRACTIONS) == pytest.approx(areas, rel=1e-5, abs=1e-4)
    assert 1e3 * shape.segment(CONTRACTIONS).max_radius == pytest.approx(radii, abs=6e-6)
    assert 1e9 * shape.volume(CONTRACTIONS) == pytest.approx(volumes, abs=6e-3)


def test_free_contraction_with_rings_and_of_a_slender_muscle():
    assert [round(100 * PleatedTube(L0, D0, n).free_contraction, 4) for n in (0, 1, 2)] == [
        46.8835,
        40.2520,
        34.5741,
    ]
    slender = PleatedTube(20.0, 2e-4)
    assert 100 * slender.free_contraction == pytest.approx(54.3053, abs=2e-3)
    ends = [
        1e3 * PleatedTube(L0, D0, n).segment(PleatedTube(L0, D0, n).free_contraction).max_radius
        for n in (0, 1, 2)
    ]
    assert np.round(ends, 4).tolist() == [32.0365, 18.3115, 13.7465]


@given(contraction=st.floats(1e-3, 0.49), rings=st.integers(0, 2))
@pytest.mark.slow
def test_virtual_work_gives_the_tension_of_the_exact_outline(contraction, rings):
    """F/p = dV/deps / L0 to 1e-9, the volume differentiated numerically."""
    shape = PleatedTube(L0, D0, rings)
    step = 2e-3 * contraction if contraction < 0.45 else 1e-3
    ends = shape.volume(contraction + step * np.array([-4, -3, -2, -1, 1, 2, 3, 4]))
    weights = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 4 / 5, -1 / 5, 4 / 105, -1 / 280])
    growth = ends @ weights / step
    scale = np.pi * shape.end_radius**2
    assert shape.effective_area(contraction) == pytest.approx(
        growth / L0, rel=1e-9, abs=1e-8 * scale
    )
    assert shape.volume_derivative(contraction) == pytest.approx(
        growth, rel=1e-9, abs=1e-8 * scale * L0
    )


@given(contraction=st.floats(1e-6, 0.49))
@pytest.mark.slow
def test_the_exact_half_shell_balances(contraction):
    """N sin(phi0) = pi p Int r dx with N/(pi p) = R^2/(2 mu): the pressure on a half shell is
    balanced at its ends.
    """
    shape = PleatedTube(L0, D0)
    segment, mu = shape.segment(contraction), shape.elliptic_outline(contraction).parameter
    fibre = segment.max_radius**2 / (2 * mu)
    assert fibre * segment.end_sine == pytest.approx(segment.half_section, rel=1e-12)
    axial = shape.effective_area(contraction) / np.pi + shape.end_radius**2
    assert fibre * segment.end_cosine == pytest.approx(axial, rel=1e-10, abs=1e-9 * fibre)


@pytest.mark.parametrize("contraction", [0.01, 0.2, 0.45])
def test_the_exact_outline_solves_its_differential_equation(contraction):
    """N dphi/ds = -2 pi r p with N constant, integrated from the end: middle, chord and volume."""
    shape = PleatedTube(L0, D0)
    segment, mu = shape.segment(contraction), shape.elliptic_outline(contraction).parameter
    curvature = 4 * mu / segment.max_radius**2
    start = (D0 / 2, np.arctan2(segment.end_sine, segment.end_cosine), 0.0, 0.0)

    def along(s, state):
        r, phi, _, _ = state
        return [np.sin(phi), -curvature * r, np.cos(phi), np.pi * r**2 * np.cos(phi)]

    end = solve_ivp(along, (0, L0 / 2), start, rtol=1e-12, atol=1e-15, method="DOP853").y[:, -1]
    assert end[1] == pytest.approx(0, abs=1e-9)
    assert end[0] == pytest.approx(segment.max_radius, rel=1e-10)
    assert 2 * end[2] == pytest.approx(segment.length, rel=1e-10)
    assert 2 * end[3] == pytest.approx(segment.volume, rel=1e-10)
    x, r = shape.outline(contraction, 4001)
    assert np.interp(0.0, x, r) == pytest.approx(segment.max_radius, rel=1e-6)
    assert np.hypot(np.diff(x), np.diff(r)).sum() == pytest.approx(L0, rel=1e-5)


def test_small_contraction_of_the_exact_outline_follows_its_limit():
    """F/p -> pi r0 l0/sqrt(6 eps) + pi (l0^2/5 - r0^2): too large by 2.6e-4, 2.6e-3, 2.7e-2 at
    1e-4, 1e-3, 1e-2.
    """
    contraction = np.array([1e-4, 1e-3, 1e-2])
    r0 = D0 / 2
    limit = np.pi * r0 * L0 / np.sqrt(6 * contraction) + np.pi * (L0**2 / 5 - r0**2)
    surplus = 1 - PleatedTube(L0, D0).effective_area(contraction) / limit
    assert [f"{s:.1e}" for s in surplus] == ["2.6e-04", "2.6e-03", "2.7e-02"]


@given(contraction=st.floats(0.02, 0.44), rings=st.integers(1, 4))
def test_rings_are_segments_in_series(contraction, rings):
    whole = tube(CIRCLE, rings)
    part = StraightFibre(L0 / (rings + 1), D0, 0, CIRCLE)
    assert whole.volume(contraction) == pytest.approx(
        (rings + 1) * part.volume(contraction), rel=1e-14
    )
    x, r = whole.outline(contraction, 601)
    assert x[-1] - x[0] == pytest.approx(L0 * (1 - contraction), rel=1e-12)
    assert r.max() <= part.segment(contraction).max_radius * (1 + 1e-12)
    assert x == pytest.approx(-x[::-1], abs=1e-12)
    assert r == pytest.approx(r[::-1], abs=1e-12)


def test_fibre_sums():
    assert [round(s.sum_of_sines(16), 5) for s in (PrintedFibreSum(), HalfShellFibreSum())] == [
        4.93074,
        5.12583,
    ]
    assert UniformFibreSum().sum_of_sines(16) == pytest.approx(5.092958, abs=5e-7)
    assert UserDefinedFibreSum(5.0).sum_of_sines(16) == 5.0
    angles = np.pi / 16 * (2 * np.arange(9) + 1)
    assert PrintedFibreSum().sum_of_sines(16) == pytest.approx(np.sin(angles).sum(), rel=1e-14)
    assert HalfShellFibreSum().sum_of_sines(16) == pytest.approx(
        np.sin(angles[:-1]).sum(), rel=1e-14
    )
    assert HalfShellFibreSum().sum_of_sines(4000) == pytest.approx(
        UniformFibreSum().sum_of_sines(4000), rel=1e-6
    )


def test_impossible_values_are_errors():
    with pytest.raises(
        GeometryLimitError,
        match=r"StraightFibre: a contraction of 60 % is outside its range, 0 to 50 %",
    ):
        tube(CIRCLE).volume(0.6)
    with pytest.raises(GeometryLimitError, match=r"contraction of -1 % is outside its range"):
        tube(PARABOLA).volume(np.array([0.1, -0.01]))
    with pytest.raises(
        GeometryLimitError, match="PleatedTube: a contraction of 51 % is outside its range"
    ):
        PleatedTube(L0, D0).volume(0.51)
    with pytest.raises(ParameterError, match="StraightFibre: rings is -1; allowed range: 0 to"):
        tube(CIRCLE, -1)
    with pytest.raises(
        ParameterError, match=r"end_diameter \(d_0, diameter at the ends and rings\) is 12 m"
    ):
        StraightFibre(L0, 12.0)
