"""Laws at the ends of their ranges and beyond: an error, infinity or a continued force, never an
arbitrary number.

Straight fibres have an infinite dV/deps at zero contraction; a geometry states its limits to every
call with numbers, of whatever type; beyond the contractions for which it was identified no law
pulls harder than at their end. A contraction above 1, probably in per cent, is named.
"""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from airmuscle.core import autodiff
from airmuscle.errors import (
    AirmuscleWarning,
    GeometryLimitError,
    ParameterError,
    PhysicsError,
    SolveError,
)
from airmuscle.files import library, list_laws
from airmuscle.physics import (
    Braid,
    Catenary,
    Characteristic,
    ChebyshevGeometry,
    ChouHannaford1996,
    CircleVirtualWork,
    CircularArc,
    Clamped,
    ContractileSurface,
    EffectiveLength,
    ExactMeridian,
    Hunt2017,
    InverseLength,
    Muscle,
    Parabola,
    PleatedTube,
    PooledLengthLaw,
    RubberLine,
    StraightFibre,
    TonduLopez2000,
    TrueArcParabola,
    ValidityRange,
    Vessel,
    VirtualWork,
    as_force_law,
)
from airmuscle.physics.muscle.characteristic import maxwell_defect, virtual_work_defect
from airmuscle.physics.muscle.geometry import as_polynomial

BRAID = Braid(0.01, 0.4363, 0.2)
RUBBER = RubberLine(3e5, 1e5)
TUBES = {
    **{
        type(m).__name__: StraightFibre(0.2, 0.02, 1, m)
        for m in (CircularArc(), Catenary(), Parabola(), TrueArcParabola())
    },
    "PleatedTube": PleatedTube(0.2, 0.02, 1),
}
SURFACE = ContractileSurface((300.0, -200.0, 40.0), 0.0, 6e5, 0.0, 0.25, 0.0, 1200.0, 1)
EXACT = ExactMeridian(PleatedTube(0.2, 0.02), RUBBER, 2e-3)


def law_of(name: str) -> Characteristic:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)
        return library.load(name).characteristic


@pytest.mark.parametrize("name", TUBES)
def test_the_volume_of_straight_fibres_increases_infinitely_fast_at_zero_contraction(name: str):
    assert TUBES[name].volume_derivative(0.0) == np.inf
    nearly_straight = (
        TUBES[name].segments * np.pi * 0.01 * TUBES[name].fibre_length ** 2 / np.sqrt(6 * 1e-8)
    )
    assert TUBES[name].volume_derivative(np.array([0.0, 1e-8])) == pytest.approx(
        [np.inf, nearly_straight], rel=1e-3
    )


@pytest.mark.parametrize("method", ["volume", "volume_derivative"])
@pytest.mark.parametrize("name", TUBES)
@pytest.mark.parametrize("kind", [float, np.array, pd.Series])
def test_a_contraction_beyond_the_geometry_is_refused_whatever_its_type(
    method: str, name: str, kind
):
    values = 0.7 if kind is float else kind([0.1, 0.7])
    with pytest.raises(
        GeometryLimitError, match="a contraction of 70 % is outside its range, 0 to 50 %"
    ):
        getattr(TUBES[name], method)(values)


def test_a_list_or_a_column_beyond_the_exact_meridian_is_refused():
    for contraction in ([0.1, 0.7], pd.Series([0.1, 0.7])):
        with pytest.raises(GeometryLimitError, match="a contraction of 70 % is outside"):
            EXACT.force([2e5, 2e5], contraction)


@pytest.mark.parametrize("name", ["dmsp-10-250", "dmsp-20-300"])
def test_beyond_the_contractions_of_its_modulus_a_festo_muscle_does_not_pull_again(name: str):
    law = law_of(name)
    contraction = np.linspace(0.4, 0.9, 51)
    for pressure in (0.0, 3e5, 6e5):
        assert (law.force(pressure, contraction) == 0.0).all()
        assert law.unclamped_force(pressure, contraction) == pytest.approx(
            law.unclamped_force(pressure, 0.4)
        )


def test_derivatives_at_no_points_are_no_derivatives():
    none = np.zeros((0, 3))
    law = law_of("dmsp-20-300")
    assert law.slopes(none, none).by_pressure.shape == BRAID.volume_derivative(none).shape == (0, 3)
    values, by_parameters = autodiff.jacobian(BRAID, "volume", none)
    assert (values.shape, by_parameters.shape) == ((0,), (0, 3))


def test_a_derivative_at_a_missing_value_is_missing():
    law = law_of("sarosi-dmsp-20-400n")
    for point in ((np.nan, 0.05), (2e5, np.nan), (np.array([np.nan]), 0.05)):
        assert np.isnan([*law.slopes(*point)]).all()
    stiffness = law.stiffness(2e5, np.array([0.05, np.nan]))
    assert np.isnan(stiffness).tolist() == [False, True]


def test_energy_defects_leave_out_straight_fibres():
    law = CircleVirtualWork(StraightFibre(0.2, 0.02), RUBBER, 2e-3)
    known = ValidityRange(0.0, 6e5, 0.0, 0.25)
    assert maxwell_defect(law, law.geometry, known).relative < 1e-12
    assert virtual_work_defect(law, law.geometry, known).contraction > 0.0


def test_an_energy_defect_with_a_constant_volume_has_no_relative_size():
    law = law_of("sarosi-dmsp-20-400n")
    known = ValidityRange(1e5, 4e5, 0.0, 0.2)
    for defect, worst in (
        (maxwell_defect(law, Vessel(2e-4), known), float(law.slopes(4e5, 0.0).by_pressure)),
        (virtual_work_defect(law, Vessel(2e-4), known), law.force(4e5, 0.0)),
    ):
        assert defect.worst == pytest.approx(worst, rel=1e-9)
        assert " (– %) at " in str(defect)


@pytest.mark.parametrize("name", list_laws())
@pytest.mark.parametrize(
    "contraction",
    [10.0, 10, np.array([0.1, np.nan, 10.0]), pd.Series([10.0])],
    ids=lambda c: type(c).__name__,
)
def test_no_law_gives_a_force_without_a_word_for_a_contraction_in_per_cent(name: str, contraction):
    law = law_of(name)
    with warnings.catch_warnings(record=True) as issued:
        warnings.simplefilter("always")
        try:
            law.force(3e5, contraction)
        except PhysicsError:
            return
    assert "per cent? As a ratio it is 0.1" in str(issued[0].message)


@pytest.mark.parametrize(
    "law",
    [
        SURFACE,
        InverseLength(SURFACE, SURFACE, 0.2, 0.3),
        EffectiveLength(SURFACE, 0.2, 0.0),
        PooledLengthLaw(SURFACE, (SURFACE,)),
        Clamped(VirtualWork(BRAID)),
    ],
)
def test_a_law_with_a_limited_force_names_the_unit_of_a_contraction_in_per_cent(law):
    with pytest.warns(
        AirmuscleWarning, match=r"contraction of 10 exceeds .* As a ratio it is 0\.1\."
    ):
        law.force(3e5, 10.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        law.force(np.array([3e5, 4e5]), np.array([[1.0], [-0.05]]))
    with pytest.warns(AirmuscleWarning, match=r"contraction of 1\.5 exceeds"):
        law.slopes(3e5, 1.5)
    with pytest.warns(AirmuscleWarning, match="contraction of 500 exceeds .* a ratio of lengths.$"):
        law.force(3e5, 500)


def test_a_pressure_for_a_contraction_in_per_cent_is_not_given_without_a_word():
    for law in (ChouHannaford1996(BRAID), TonduLopez2000(BRAID), Hunt2017(0.2)):
        with (
            pytest.warns(AirmuscleWarning, match="Is it in per cent"),
            pytest.raises(SolveError, match="50 N at a contraction of 1000 %"),
        ):
            law.pressure(10.0, 50.0)


def test_a_slack_muscle_has_the_stiffness_zero_without_a_sign():
    law = law_of("sarosi-dmsp-10")
    for thing in (law, Muscle(law, BRAID)):
        assert not np.signbit(thing.stiffness(1e5, 0.2))
        assert not np.signbit(thing.stiffness(1e5, np.array([0.2])))


@pytest.mark.parametrize("name", ["saga2007", "saga2007-circle"])
def test_straight_fibres_at_zero_contraction_have_the_slopes_of_an_array(name: str):
    law = law_of(name)
    try:
        with np.errstate(all="ignore"):
            column = law.slopes(1e5, np.array([0.0]))
    except GeometryLimitError:  # those of the force, which is infinite
        with pytest.raises(GeometryLimitError, match="the fibres are straight"):
            law.slopes(1e5, 0.0)
        return
    np.testing.assert_array_equal(law.slopes(1e5, 0.0), np.ravel(column))
    assert np.isnan(law.stiffness("1 bar", "0 %"))


def test_four_fibres_are_the_fewest_and_the_contraction_ends_below_the_pole():
    law = law_of("saga2007")
    law = replace(law, fibres=4, projection_factor=1.0, geometry=replace(law.geometry, rings=2))
    end = law.contraction_range[1]
    assert end == pytest.approx(law.pole, rel=2e-9)
    assert end < law.pole < 0.5
    assert (
        law.equilibrium_pressure(end, 100.0)
        > 1e9
        > 0.0
        > law.equilibrium_pressure(law.pole * 1.001, 100.0)
    )
    for fibres in (3, 2, 5):
        with pytest.raises(ParameterError, match="it must be an even integer, 4 or more"):
            replace(law, fibres=fibres)


@pytest.mark.parametrize("degree", [-1, 2.5, "3", True])
def test_the_degree_of_a_polynomial_is_a_whole_number(degree):
    known = ValidityRange(0.0, 6e5, 0.0, 0.2)
    for call in (
        lambda: as_force_law(SURFACE, known, degree=degree),
        lambda: as_polynomial(BRAID, degree, (0.0, 0.2)),
        lambda: ContractileSurface.blank(degree),
        lambda: ContractileSurface((), 0.0, 1.0, 0.0, 1.0, degree=degree),
    ):
        with pytest.raises(ParameterError, match=r"degree .*must be an integer"):
            call()


def test_a_polynomial_volume_has_a_range_without_infinite_slopes_and_without_zero_length():
    for tube in (StraightFibre(0.2, 0.02), PleatedTube(0.2, 0.02)):
        with pytest.raises(
            GeometryLimitError,
            match=r"is infinite at a contraction of 0 %. .* such as \(0.01, 0.5\)",
        ):
            as_polynomial(tube)
    with pytest.raises(
        ParameterError, match="max_contraction must be less than 1, where the length is zero"
    ):
        as_polynomial(Braid(0.01, 0.43632, 0.2))
    with pytest.raises(ParameterError, match="1 coefficients; at least two are required"):
        ChebyshevGeometry((1e-4,), 0.0, 0.2, 0.2)


def test_equilibria_and_fibre_tensions_at_the_ends():
    law = law_of("saga2007")
    for point in ((np.nan, 100.0), (1e5, np.inf)):
        with pytest.raises(ParameterError, match=r"Saga2007.equilibria: .* must be finite"):
            law.equilibria(*point)
    assert law.shell_tension(1e5, 0.0) > 1e100


def test_the_range_of_a_short_pleated_tube_ends_where_the_search_for_its_outline_ends():
    tube = PleatedTube(0.02, 0.1)
    end = tube.contraction_range[1]
    assert tube.free_contraction < end < 0.5
    assert tube.elliptic_outline(end).parameter == pytest.approx(0.81, rel=1e-9)


def test_the_contraction_of_a_circle_by_virtual_work_ends_below_its_maximum_volume():
    law = CircleVirtualWork(StraightFibre(0.2, 0.02), RUBBER, 2e-3)
    end = law.contraction_range[1]
    assert (
        law.geometry.volume_derivative(end) > 0.0 > law.geometry.volume_derivative(end * (1 + 3e-9))
    )


def test_an_energy_defect_states_the_share_of_slack_states():
    law = VirtualWork(BRAID)  # it pushes above its maximum volume
    end = 1.0 - 1.0 / (np.sqrt(3.0) * np.cos(BRAID.braid_angle))
    known = ValidityRange(1e5, 2e5, 0.0, 2 * end)
    assert virtual_work_defect(law, BRAID, known).slack == pytest.approx(20 / 41, abs=1 / 40)
    assert virtual_work_defect(law, BRAID, ValidityRange(1e5, 2e5, 0.0, end)).slack < 1 / 40
    assert f"slack on {100 * maxwell_defect(law, BRAID, known).slack:.0f} %" in str(
        maxwell_defect(law, BRAID, known)
    )


def test_rigid_ends_end_where_the_active_length_ends():
    law = EffectiveLength(SURFACE, 0.2, 0.04, 0.002)
    low, high = law.contraction_range
    assert [(c * 0.2 + 0.002) / 0.16 for c in (low, high)] == pytest.approx(
        SURFACE.contraction_range
    )
    wider = law.with_validity_range((1e5, 5e5), (0.0, 0.2)).inner
    assert wider.validity_range.pressure == (1e5, 5e5)
    assert wider.validity_range.contraction == pytest.approx((-0.1, 0.3))
    same = law.rescaled((1e5, 5e5), (0.0, 0.2))
    assert same.inner.validity_range == wider.validity_range
    assert same.unclamped_force(2e5, 0.1) == pytest.approx(law.unclamped_force(2e5, 0.1), rel=1e-12)
