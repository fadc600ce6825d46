"""A table is interpolated through its rows without overshoot, and points outside it are refused."""

from __future__ import annotations

import numpy as np
import pytest

from airmuscle.errors import GeometryLimitError, ParameterError, SolveError
from airmuscle.files import library
from airmuscle.physics import Tabulated, TabulatedGeometry

TOOL = ("festo-tool-dmsp-10", "festo-tool-dmsp-20", "festo-tool-dmsp-40")
SMALL = Tabulated(
    (1e5, 1e5, 1e5, 2e5, 2e5), (0.0, 0.05, 0.1, 0.0, 0.2), (100.0, 40.0, 0.0, 200.0, 0.0)
)


@pytest.mark.parametrize("name", TOOL)
def test_the_rows_of_a_table_lie_on_its_surface(name: str):
    law = library.load(name).characteristic
    rows = library.load_data(name)
    force = law.force(rows["pressure"], rows["contraction"])
    np.testing.assert_allclose(force, rows["force"], rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(
        law.contraction(rows["pressure"], rows["force"]), rows["contraction"], atol=1e-12
    )


@pytest.mark.parametrize("name", TOOL)
def test_a_table_increases_with_pressure_and_decreases_with_contraction(name: str):
    entry = library.load(name)
    p, c = np.meshgrid(
        np.linspace(*entry.validity_range.pressure, 101),
        np.linspace(*entry.validity_range.contraction, 101),
    )
    force = entry.characteristic.force(p, c)
    assert (np.diff(force, axis=1) > 0).all()
    assert (np.diff(force, axis=0) < 0).all()


def test_a_table_ends_where_one_of_two_isobars_ends():
    assert SMALL.force(2e5, 0.2) == 0.0
    assert SMALL.force(1.5e5, 0.1) == pytest.approx(SMALL.force(2e5, 0.1) / 2)
    with pytest.raises(
        SolveError, match=r"150 kPa and a contraction of 15 % .* covers 0 to 10 % at this pressure"
    ):
        SMALL.force(1.5e5, 0.15)
    with pytest.raises(
        SolveError, match=r"300 kPa and a contraction of 5 % .* covers 100 to 200 kPa"
    ):
        SMALL.force(3e5, 0.05)


def test_the_slope_on_an_isobar_is_one_sided_where_the_next_isobar_does_not_cover_the_contraction():
    rows = np.array(
        [
            (1e5, 0.0, 100.0),
            (1e5, 0.1, 0.0),
            (2e5, 0.0, 200.0),
            (2e5, 0.1, 80.0),
            (3e5, 0.05, 250.0),
            (3e5, 0.1, 220.0),
        ]
    )
    law = Tabulated(*(tuple(column) for column in rows.T))
    assert law.slopes(2e5, 0.0).by_pressure == pytest.approx(100.0 / 1e5)
    assert law.slopes(2e5, np.array([0.0, 0.1])).by_pressure == pytest.approx([1e-3, 140.0 / 1e5])
    assert law.slopes(3e5, 0.1).by_pressure == pytest.approx(140.0 / 1e5)
    assert law.slopes(1e5, 0.1).by_pressure == pytest.approx(80.0 / 1e5)
    with pytest.raises(
        SolveError, match=r"250 kPa and a contraction of 3 % .* covers 5 to 10 % at this pressure"
    ):
        law.force(2.5e5, 0.03)
    assert law.pressure(0.1, 150.0) == pytest.approx(2e5 + 0.5 * 1e5)


def test_isobars_may_touch_and_the_lowest_pressure_is_the_solution():
    law = Tabulated(
        (1e5, 1e5, 2e5, 2e5, 3e5, 3e5), (0.0, 0.2) * 3, (100.0, 0.0, 150.0, 0.0, 260.0, 60.0)
    )
    assert law.force(1.5e5, 0.2) == 0.0
    assert law.pressure(0.2, 0.0) == 1e5
    assert law.pressure(np.array([0.0, 0.2]), np.array([205.0, 15.0])) == pytest.approx(
        [2.5e5, 2.25e5]
    )


def test_a_point_without_a_solution_states_the_tabulated_range():
    with pytest.raises(
        SolveError, match=r"with 150 N at 100 kPa.*Tabulated forces at this point: 0 to 100 N"
    ):
        SMALL.contraction(1e5, 150.0)
    with pytest.raises(
        SolveError, match=r"gives 250 N .* of 0 %.*Tabulated forces at this point: 100 to 200 N"
    ):
        SMALL.pressure(0.0, 250.0)
    with pytest.raises(
        SolveError, match="no gauge pressure in the range 100 to 200 kPa gives 250 N"
    ):
        SMALL.pressure(0.0, 250.0)
    with pytest.raises(SolveError, match="The table does not cover this point"):
        SMALL.pressure(0.5, 10.0)


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        (((1e5, 1e5), (0.0, 0.1), (1.0, 0.0)), "must contain at least two pressures"),
        (
            ((1e5, 1e5, 2e5), (0.0, 0.1, 0.0), (1.0, 0.0, 2.0)),
            "isobar at 200 kPa must have at least two contractions",
        ),
        (
            ((1e5, 1e5, 2e5, 2e5), (0.0, 0.1, 0.0, 0.1), (1.0, 2.0, 3.0, 2.5)),
            "100 kPa .* does not increase",
        ),
        (
            ((1e5, 1e5, 2e5, 2e5), (0.0, 0.1, 0.0, 0.1), (2.0, 1.0, 3.0, 0.5)),
            "10 % the force decreases with pressure",
        ),
        (((1e5, 1e5), (0.0, 0.1), (1.0,)), "2 pressures, 2 contractions and 1 forces"),
    ],
)
def test_an_invalid_table_is_an_error(rows: tuple[tuple[float, ...], ...], message: str):
    with pytest.raises(ParameterError, match=message):
        Tabulated(*rows)


def test_a_volume_outside_its_table_is_an_error():
    table = TabulatedGeometry((0.0, 0.1), (1e-4, 2e-4), 0.3)
    with pytest.raises(
        GeometryLimitError, match=r"contraction of 20 % is outside its range, 0 to 10 %"
    ):
        table.volume(0.2)
    with pytest.raises(ParameterError, match="2 contractions and 1 volumes"):
        TabulatedGeometry((0.0, 0.1), (1e-4,), 0.3)
