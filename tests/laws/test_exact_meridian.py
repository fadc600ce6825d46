"""Exact meridian with rubber: local equilibrium of the fibres, virtual work to 1e-9, and the limit
without rubber.

N cos(phi) = F + pi p r^2 and dN/dr = 2 pi t sigma along the whole fibre. Reference values are of
the muscle of Table 1 of Saga et al. 2007, computed by quadrature independently of this code. The
circular meridian with virtual work is tested as well.
"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from airmuscle.core import autodiff
from airmuscle.errors import GeometryLimitError, ParameterError, SolveError
from airmuscle.physics import (
    Catenary,
    CircleVirtualWork,
    ExactMeridian,
    PleatedTube,
    RubberLine,
    StraightFibre,
)
from airmuscle.physics.muscle.characteristic import LINE_A, LINE_B

L0 = 0.072
D0 = 0.012
WALL = 0.002
CONTRACTIONS = np.array([0.01, 0.05, 0.10, 0.20, 0.30, 0.40])
LINES = {"A": LINE_A, "B": LINE_B}
NONE = RubberLine(0.0, 0.0)
NAN = float("nan")

# line, load N: pressures MPa and largest radii mm at CONTRACTIONS
TABLE = {
    ("A", 0): (
        (NAN, 0.074139, 0.073810, 0.081496, 0.104577, 0.203414),
        (NAN, 15.9422, 19.1173, 23.4654, 26.9933, 30.0950),
    ),
    ("A", 100): (
        (0.092574, 0.094429, 0.102210, 0.129778, 0.191917, 0.436594),
        (10.5826, 15.9214, 19.6521, 24.5072, 27.8942, 30.5215),
    ),
    ("A", 200): (
        (0.104397, 0.114984, 0.130034, 0.175798, 0.275248, 0.664134),
        (10.5292, 15.9201, 19.7278, 24.6770, 28.0701, 30.6203),
    ),
    ("B", 0): (
        (0.061460, 0.078274, 0.089496, 0.112421, 0.155300, 0.317822),
        (8.96310, 13.8541, 17.6033, 22.7920, 26.7310, 30.0281),
    ),
    ("B", 100): (
        (0.076950, 0.102276, 0.121259, 0.163807, 0.245493, 0.553698),
        (10.2436, 15.4920, 19.2317, 24.1577, 27.6501, 30.4122),
    ),
    ("B", 200): (
        (0.088983, 0.123189, 0.149599, 0.210654, 0.329991, 0.782794),
        (10.3457, 15.6785, 19.4779, 24.4463, 27.8939, 30.5352),
    ),
}
# rings, line: pressures MPa at 5, 10, 20, 30 % without load
RINGS = {
    (1, "A"): (0.089172, 0.093035, 0.113817, 0.182999),
    (1, "B"): (0.072796, 0.086803, 0.121850, 0.212722),
    (2, "A"): (0.100755, 0.110640, 0.155867, 0.409263),
    (2, "B"): (0.071452, 0.088688, 0.142607, 0.406196),
}
# the circle with virtual work, the same way
CIRCLE = {
    ("A", 0): (0.080844, 0.073726, 0.074114, 0.083149, 0.106176, 0.201563),
    ("A", 100): (0.092708, 0.094414, 0.102094, 0.129498, 0.191590, 0.456461),
    ("B", 0): (0.065296, 0.081816, 0.093598, 0.117707, 0.159428, 0.316140),
    ("B", 100): (0.077160, 0.102503, 0.121577, 0.164056, 0.244843, 0.571038),
}


def exact(line, rings=0):
    return ExactMeridian(PleatedTube(L0, D0, rings), line, WALL)


def circle(line, rings=0):
    return CircleVirtualWork(StraightFibre(L0, D0, rings), line, WALL)


@pytest.mark.parametrize(("name", "force"), TABLE)
def test_pressures_and_radii_agree_with_the_reference_table(name, force):
    found = exact(LINES[name]).shape_at_force(CONTRACTIONS, float(force))
    pressures, radii = TABLE[name, force]
    assert found.pressure / 1e6 == pytest.approx(pressures, abs=6e-7, nan_ok=True)
    assert 1e3 * found.radius == pytest.approx(radii, abs=6e-5, nan_ok=True)


@pytest.mark.parametrize(("rings", "name"), RINGS)
def test_rings_agree_with_the_reference_table(rings, name):
    found = exact(LINES[name], rings).pressure(CONTRACTIONS[1:5], 0.0)
    assert found / 1e6 == pytest.approx(RINGS[rings, name], abs=6e-7)


@pytest.mark.parametrize(("name", "force"), CIRCLE)
def test_the_circle_agrees_with_its_reference_table(name, force):
    found = circle(LINES[name]).pressure(CONTRACTIONS, float(force))
    assert found / 1e6 == pytest.approx(CIRCLE[name, force], abs=6e-7)


def test_without_rubber_it_is_the_elliptic_outline():
    law, tube = exact(NONE), PleatedTube(L0, D0)
    contraction = np.concatenate([CONTRACTIONS, [2e-4, 0.45]])
    found = law.shape_at_force(contraction, 100.0)
    assert found.pressure == pytest.approx(100.0 / tube.effective_area(contraction), rel=1e-11)
    assert found.radius == pytest.approx(tube.segment(contraction).max_radius, rel=1e-12)
    assert law.force(2e5, contraction) == pytest.approx(
        2e5 * tube.effective_area(contraction), rel=1e-10
    )
    assert law.volume(0.2, 100.0) == pytest.approx(tube.volume(0.2), rel=1e-12)


def integrated(law, contraction, force):
    """Half the meridian from the middle to the end by the differential equations: length, chord,
    volume, end radius.
    """
    found = law.shape_at_force(contraction, force)
    p = found.pressure
    fibre = force + np.pi * found.pressure * found.radius**2
    r0 = law.geometry.end_radius

    def along(s, state):
        r, phi, _, _, n = state
        sigma = law.rubber.stress((r - r0) / r0)
        hoop = 2 * np.pi * WALL * sigma
        turn = (2 * np.pi * r * p - hoop * np.cos(phi)) / n
        return [-np.sin(phi), turn, np.cos(phi), np.pi * r**2 * np.cos(phi), -hoop * np.sin(phi)]

    half = law.geometry.fibre_length / 2
    start = (found.radius, 0.0, 0.0, 0.0, fibre)
    return solve_ivp(along, (0, half), start, rtol=1e-12, atol=1e-15, method="DOP853").y[:, -1]


@pytest.mark.parametrize(
    ("name", "force", "contraction"),
    [("A", 0, 0.05), ("A", 100, 0.2), ("B", 0, 0.4), ("B", 200, 0.01)],
)
def test_an_independent_integration_reaches_the_end_ring(name, force, contraction):
    law = exact(LINES[name])
    radius, _, chord, volume, _ = integrated(law, contraction, float(force))
    assert radius == pytest.approx(D0 / 2, rel=1e-8)
    assert 2 * chord == pytest.approx(L0 * (1 - contraction), rel=1e-9)
    assert 2 * volume == pytest.approx(law.volume(contraction, float(force)), rel=1e-9)
    x, r = law.profile(contraction, float(force), 401)
    assert x[-1] - x[0] == pytest.approx(2 * chord, rel=1e-9)
    assert r.max() == pytest.approx(law.shape_at_force(contraction, float(force)).radius, rel=1e-12)
    assert np.hypot(np.diff(x), np.diff(r)).sum() == pytest.approx(L0, rel=1e-4)


@given(
    contraction=st.floats(0.02, 0.36),
    force=st.floats(20.0, 300.0),
    name=st.sampled_from("AB"),
    rings=st.integers(0, 1),
)
def test_virtual_work_gives_the_tension(contraction, force, name, rings):
    """F = (p dV/deps - dU/deps)/L0 to 1e-9, volume and energy differentiated numerically along a
    loaded path.
    """
    law = exact(LINES[name], rings)
    contraction = min(contraction, law.contraction_range[1] - 0.15)
    step = min(1e-3, contraction / 60)
    weights = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 4 / 5, -1 / 5, 4 / 105, -1 / 280]) / step
    at = contraction + step * np.array([-4, -3, -2, -1, 1, 2, 3, 4])
    growth = weights @ np.array([law.volume(float(c), force) for c in at])
    stored = weights @ np.array([law.rubber_energy(float(c), force) for c in at])
    pressure = law.pressure(contraction, force)
    assert (pressure * growth - stored) / L0 == pytest.approx(
        force, abs=1e-9 * pressure * growth / L0 + 1e-9 * force
    )


@given(contraction=st.floats(0.02, 0.36), force=st.floats(20.0, 300.0), name=st.sampled_from("AB"))
def test_the_half_shell_balances(contraction, force, name):
    """2 N0 sin(phi0)/pi + 2 t Int sigma ds = 2 p Int r dx, all from the profile."""
    law = exact(LINES[name])
    found = law.shape_at_force(contraction, force)
    x, r = law.profile(contraction, force, 8001)
    axial = force + np.pi * found.pressure * (D0 / 2) ** 2
    slope = _end_slope(law, found)
    middle = (r[1:] + r[:-1]) / 2
    ds = np.hypot(np.diff(x), np.diff(r))
    hoop = WALL * (law.rubber.stress(middle / (D0 / 2) - 1) * ds).sum()
    assert axial * slope / np.pi + hoop == pytest.approx(
        found.pressure * (middle * np.diff(x)).sum(), rel=2e-6
    )


def _end_slope(law, found):
    """tan(phi0) from N0^2 = (F + pi p r0^2)^2 + (N0 sin phi0)^2, N0 by the rubber's work from the
    middle.
    """
    r0 = D0 / 2
    rise = found.radius - D0 / 2
    work = law.rubber.slope * rise**2 / (2 * r0) + law.rubber.intercept * rise
    fibre = found.force + np.pi * found.pressure * found.radius**2 - 2 * np.pi * WALL * work
    axial = found.force + np.pi * found.pressure * r0**2
    return np.sqrt(fibre**2 - axial**2) / axial


@given(contraction=st.floats(0.03, 0.36), force=st.floats(150.0, 400.0), name=st.sampled_from("AB"))
def test_the_three_directions_agree(contraction, force, name):
    for law in (exact(LINES[name]), circle(LINES[name])):
        pressure = law.pressure(contraction, force)
        assert law.force(pressure, contraction) == pytest.approx(force, rel=1e-8)
        assert law.contraction(pressure, force) == pytest.approx(contraction, rel=1e-8)


@pytest.mark.parametrize(
    ("pressure", "contraction", "name"), [(1.2e5, 0.05, "A"), (2e5, 0.2, "B"), (3e5, 0.35, "A")]
)
def test_slopes_are_exact(pressure, contraction, name):
    for law in (exact(LINES[name]), circle(LINES[name])):
        slopes = law.slopes(pressure, contraction)
        p = 1e-3 * pressure
        c = 1e-3 * contraction

        def by(step_p, step_c, law=law):
            ends = [
                law.force(pressure + n * step_p, contraction + n * step_c) for n in (-2, -1, 1, 2)
            ]
            return (ends[0] - 8 * ends[1] + 8 * ends[2] - ends[3]) / 12

        assert slopes.by_pressure == pytest.approx(by(p, 0) / p, rel=1e-8)
        assert slopes.by_contraction == pytest.approx(by(0, c) / c, rel=1e-8)


def test_the_circle_is_one_potential():
    """F = (p dV/deps - dU/deps)/L0 with the volume and energy of its own geometry, and dF/dp =
    dV/deps / L0.
    """
    law = circle(LINE_A, 1)
    contraction = np.array([1e-3, 0.05, 0.2, 0.38])
    pressure = 1.5e5
    growth = autodiff.derivative(law.geometry, "volume", contraction)
    step = 1e-3 * contraction
    ends = [_stored(law, contraction + n * step) for n in (-2, -1, 1, 2)]
    energy = (ends[0] - 8 * ends[1] + 8 * ends[2] - ends[3]) / (12 * step)
    assert law.force(pressure, contraction) == pytest.approx(
        (pressure * growth - energy) / L0, rel=1e-9
    )
    assert law.slopes(pressure, contraction).by_pressure == pytest.approx(growth / L0, rel=1e-12)


def _stored(law, contraction):
    segment = law.geometry.segment(contraction)
    per_wall = law.rubber.energy(segment.arc_excess, segment.arc_excess_squared, D0 / 2)
    return law.geometry.segments * WALL * per_wall


def test_the_error_of_the_circle_is_as_documented():
    contraction = np.linspace(0.01, 0.30, 30)
    for name, line in LINES.items():
        for force in (100.0, 150.0, 200.0):
            ratio = (
                circle(line).pressure(contraction, force) / exact(line).pressure(contraction, force)
                - 1
            )
            assert np.abs(ratio).max() < 0.007, (name, force)
        unloaded = (
            circle(line).pressure(contraction[4:], 0.0) / exact(line).pressure(contraction[4:], 0.0)
            - 1
        )
        assert unloaded.min() > -0.01
        assert unloaded.max() < 0.063
    assert 100 * circle(LINE_A).contraction_range[1] == pytest.approx(45.98, abs=0.005)


def test_the_paper_s_working_points():
    """At 0.11 MPa: 31.3 % unloaded and 3.1 % under 200 N with line A, 19.1 % and 3.0 % with line
    B.
    """
    found = [
        round(100 * exact(line).contraction(0.11e6, force), 1)
        for line in LINES.values()
        for force in (0.0, 200.0)
    ]
    assert found == [31.3, 3.1, 19.1, 3.0]


def test_the_end_slope_reaches_zero_where_the_equations_say():
    """Line A, 1 %: from a horizontal end (phi0 = 0) the equations reach the middle at 15.681 N and
    0.0840629 MPa.
    """
    law = exact(LINE_A)
    assert law.pressure(0.01, 15.69) == pytest.approx(84062.9, abs=5.0)
    with pytest.raises(
        SolveError,
        match=r"no equilibrium with 15\.67 N at a contraction of 1 %.*contract the tube below",
    ):
        law.pressure(0.01, 15.67)


def test_errors_state_why_there_is_no_solution():
    law = exact(LINE_A)
    with pytest.raises(
        SolveError,
        match=(
            r"no equilibrium with 0 N at a contraction of 1 %.*increase the contraction or the"
            r" force"
        ),
    ):
        law.pressure(0.01, 0.0)
    with pytest.raises(
        SolveError,
        match=(
            r"ExactMeridian: 20 kPa is below the threshold pressure of 100 kPa, at which"
            r" contraction starts"
        ),
    ):
        law.contraction(2e4, 0.0)
    with pytest.raises(
        SolveError, match=r"no meridian with a contraction of 30 % exists at 10 kPa"
    ):
        law.force(1e4, 0.3)
    with pytest.raises(
        GeometryLimitError,
        match=r"ExactMeridian: a contraction of 60 % is outside its range, 0\.01 to 46\.88 %",
    ):
        law.pressure(0.6, 0.0)
    with pytest.raises(
        SolveError, match=r"CircleVirtualWork: 20 kPa is below the threshold pressure"
    ):
        circle(LINE_A).contraction(2e4, 0.0)
    with pytest.raises(
        GeometryLimitError, match=r"CircleVirtualWork: a contraction of 46 % is outside its range"
    ):
        circle(LINE_A).pressure(0.46, 0.0)
    with pytest.raises(
        ParameterError, match="requires a circular meridian; its geometry has a Catenary"
    ):
        replace(circle(LINE_A), geometry=StraightFibre(L0, D0, meridian=Catenary()))


def test_rest_below_the_threshold_pressure():
    """P -> t beta/r0 as contraction goes to zero, under any load."""
    for line in LINES.values():
        start = WALL * line.intercept / (D0 / 2)
        assert circle(line).pressure(0.0, 80.0) == pytest.approx(start, rel=1e-13)
        near, further = exact(line).pressure(np.array([1e-4, 4e-4]), 80.0)
        assert 2 * near - further == pytest.approx(
            start, rel=0.01
        )  # it leaves the start like sqrt(eps)
    assert circle(LINE_B).contraction(circle(LINE_B).threshold_pressure, 80.0) == 0.0


def test_a_slender_tube_contracts_to_its_maximum_volume_beyond_half_its_length():
    tube = PleatedTube(0.206, 0.017)
    law = ExactMeridian(tube, RubberLine(1.1e4, 0.0), 3.3e-3)
    assert tube.contraction_range[1] == tube.free_contraction > 0.505
    assert tube.effective_area(tube.free_contraction) == pytest.approx(0.0, abs=1e-12)
    for contraction in (0.1, 0.3, 0.5):
        pressure = law.pressure(contraction, 20.0)
        assert law.contraction(pressure, 20.0) == pytest.approx(contraction, abs=1e-10)
