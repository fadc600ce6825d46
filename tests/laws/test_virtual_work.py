"""The tension of an ideal muscle follows from its volume by virtual work: F = -p dV/dL.

This is exact to 1e-9 for Chou and Hannaford, and for Tondu and Lopez with end correction 1, on
their braid. With an end correction or a wall it is not; the tests quantify the difference. A model
that adds a wall to the braid still conserves energy, dF/dp = -dV/dL; a model with an end correction
does not.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from airmuscle.errors import SolveError, TraceError
from airmuscle.files import library
from airmuscle.physics import (
    Braid,
    ChouHannaford1996,
    TabulatedGeometry,
    TonduLopez2000,
    ValidityRange,
    VirtualWork,
)
from airmuscle.physics.muscle.characteristic import maxwell_defect, virtual_work_defect
from airmuscle.physics.muscle.geometry import as_polynomial

BRAID = Braid(0.01, np.radians(25.0), 0.3)
BOX = ValidityRange(5e4, 6e5, 0.0, 0.28)
braids = st.builds(Braid, st.floats(2e-3, 0.05), st.floats(0.2, 0.8), st.floats(0.05, 2.0))


@given(braid=braids, pressure=st.floats(1e3, 8e5), place=st.floats(0.01, 0.95))
def test_the_braid_gives_the_force_of_chou_and_hannaford(
    braid: Braid, pressure: float, place: float
):
    law = ChouHannaford1996(braid)
    contraction = place * law.contraction_range[1]
    ideal = VirtualWork(braid).force(pressure, contraction)
    assert law.force(pressure, contraction) == pytest.approx(ideal, rel=1e-9)


def test_without_end_correction_the_force_of_tondu_and_lopez_is_the_same():
    assert virtual_work_defect(TonduLopez2000(BRAID, 1.0), BRAID, BOX).relative < 1e-9
    assert virtual_work_defect(ChouHannaford1996(BRAID), BRAID, BOX).relative < 1e-9


def test_an_end_correction_differs_from_virtual_work_by_a_sixth_at_the_end_of_the_stroke():
    law = TonduLopez2000(BRAID, 1.25)
    work = virtual_work_defect(law, BRAID, BOX)
    maxwell = maxwell_defect(law, BRAID, BOX)
    assert work.contraction == maxwell.contraction == 0.28
    # F/p of both at 28 %: pi r0^2 a ((1 - 0.28)^2 - (1 - 1.25 0.28)^2), over pi r0^2 (a - b)
    expected = 13.796730 * (0.72**2 - 0.65**2) / (13.796730 - 5.598910)
    assert work.relative == pytest.approx(expected, rel=1e-6)
    assert maxwell.relative == pytest.approx(expected, rel=1e-6)
    assert work.worst == pytest.approx(249.4, abs=0.05)


@pytest.mark.parametrize(("name", "newtons"), [("dmsp-20-300", 418.4), ("dmsp-10-250", 199.5)])
def test_a_rubber_wall_takes_hundreds_of_newtons_and_conserves_energy(name: str, newtons: float):
    muscle = library.load(name)
    assert virtual_work_defect(
        muscle.characteristic, muscle.geometry, muscle.validity_range
    ).worst == pytest.approx(newtons, abs=0.05)
    assert (
        maxwell_defect(muscle.characteristic, muscle.geometry, muscle.validity_range).relative
        < 1e-9
    )


def test_another_volume_gives_a_maxwell_defect_of_its_size():
    thicker = replace(BRAID, radius=BRAID.radius * 1.1)
    defect = maxwell_defect(ChouHannaford1996(BRAID), thicker, BOX)
    assert defect.relative == pytest.approx(1 - 1 / 1.21, rel=1e-9)


def test_a_muscle_without_tension_has_no_defect():
    with pytest.raises(SolveError, match="is slack in its whole validity range"):
        maxwell_defect(ChouHannaford1996(BRAID), BRAID, ValidityRange(1e5, 2e5, 0.5, 0.6))


def test_a_tabulated_volume_gives_its_force_but_no_second_derivative():
    contraction = np.linspace(0.0, 0.35, 71)
    table = TabulatedGeometry(
        tuple(contraction), tuple(BRAID.volume(contraction)), BRAID.resting_length
    )
    inside = np.linspace(0.0125, 0.3375, 9)
    ideal = VirtualWork(BRAID).force(4e5, inside)
    np.testing.assert_allclose(
        VirtualWork(table).force(4e5, inside), ideal, atol=0.01 * ideal.max()
    )
    with pytest.raises(TraceError, match=r"TabulatedGeometry is not in closed form.*as_polynomial"):
        VirtualWork(table).slopes(4e5, 0.1)


def test_the_stated_errors_of_a_polynomial_geometry_are_bounds():
    replaced = as_polynomial(BRAID, degree=3, contraction_range=(0.0, 0.35))
    assert replaced.volume_error < 1e-18  # the volume of a braid is a cubic
    contraction = np.linspace(0.0, 0.35, 201)
    table = TabulatedGeometry(tuple(contraction[::10]), tuple(BRAID.volume(contraction[::10])), 0.3)
    coarse = as_polynomial(table, degree=6)
    error = np.abs(coarse.volume(contraction) - table.volume(contraction)).max()
    assert 0.5 * error <= coarse.volume_error <= 1.05 * error
    slope_error = np.abs(
        coarse.volume_derivative(contraction) - table.volume_derivative(contraction)
    ).max()
    assert coarse.derivative_error == pytest.approx(slope_error, rel=0.1)


def test_outside_its_range_a_polynomial_geometry_is_extrapolated_linearly():
    replaced = as_polynomial(BRAID, degree=5, contraction_range=(0.0, 0.3))
    beyond = replaced.volume(0.3) + 0.1 * BRAID.volume_derivative(0.3)
    assert replaced.volume(0.4) == pytest.approx(beyond, rel=1e-9)
