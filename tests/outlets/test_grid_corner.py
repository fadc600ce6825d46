"""A grid whose corner is empty: a map of rising or falling numbers above numbers, and no record."""

from __future__ import annotations

import numpy as np
import pytest

from airmuscle.bench import read
from airmuscle.errors import AirmuscleError, ColumnError

GRID = "force [N] over contraction [%], pressure [kPa]"


def written(tmp_path, text):
    path = tmp_path / "map.csv"
    path.write_text(text)
    return path


@pytest.mark.parametrize("across", ["100,200,300", "300,200,100"])
def test_each_cell_is_a_row(tmp_path, across):
    text = f",{across}\n0,50,100,150\n5,40,90,140\n10,30,,130\n"
    (run,) = read(written(tmp_path, text), grid=GRID)
    assert len(run) == 8
    pressures = 1e3 * np.array(across.split(","), float)
    assert run["pressure"] == pytest.approx([*pressures, *pressures, pressures[0], pressures[2]])
    assert run["force"] == pytest.approx([50, 100, 150, 40, 90, 140, 30, 130])
    assert run["contraction"] == pytest.approx([0, 0, 0, 0.05, 0.05, 0.05, 0.1, 0.1])


def test_without_its_quantities_the_grid_is_a_question(tmp_path):
    path = written(tmp_path, ",100,200,300\n0,50,100,150\n5,40,90,140\n")
    with pytest.raises(AirmuscleError, match="is a grid of numbers"):
        read(path)


@pytest.mark.parametrize("first", [",200,100,300", ",100,100,200", "1,100,200,300"])
def test_numbers_that_are_no_headings_of_a_grid_are_still_refused(tmp_path, first):
    path = written(tmp_path, f"{first}\n0,50,100,150\n5,40,90,140\n")
    with pytest.raises(ColumnError, match="heading row is missing"):
        read(path)
