"""Files that are damaged or unusual in their format: a clear error, or the table that they contain."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import numpy as np
import pytest
from command_line import airmuscle

from airmuscle.bench import inspect, read
from airmuscle.errors import FileError

HEAD = "time [s],pressure [kPa],force [N]\n"
ROWS = "".join(f"{i},{100 + i},{50 + i}\n" for i in range(9))


def table(folder: Path, text: str, name: str = "bench.csv") -> Path:
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


@pytest.mark.parametrize(
    "text",
    [HEAD.replace("force [N]", "x" * 140_000) + ROWS, HEAD + ROWS + "9,109," + "x" * 140_000 + "\n"],
    ids=["heading", "cell"],
)
def test_a_cell_of_more_characters_than_the_parser_takes_is_refused(tmp_path, text: str):
    with pytest.raises(FileError, match=r"bench\.csv, line \d+: a cell has more than 131072 characters"):
        read(table(tmp_path, text))


@pytest.mark.parametrize("value", ["[" * 100_000, "9" * 5000], ids=["lists in lists", "digits"])
def test_a_comment_that_is_no_constant_is_a_comment(tmp_path, value: str):
    (recording,) = read(table(tmp_path, f"# x = {value}\n{HEAD}{ROWS}"))
    assert len(recording) == 9
    assert "x" not in recording.constants


def test_time_steps_near_the_smallest_number_are_inspected(tmp_path):
    rows = "".join(f"{i}e-311,{100 + i},{50 + i}\n" for i in range(1, 30))
    (recording,) = read(table(tmp_path, HEAD + rows))
    assert inspect(recording).sampling.rows == 29


@pytest.mark.skipif(sys.platform != "linux", reason="names of files are bytes on Linux only")
def test_a_file_whose_name_is_no_text_is_fitted(tmp_path):
    contraction, pressure = (x.ravel() for x in np.meshgrid(np.linspace(0, 0.2, 6), np.linspace(1e2, 5e2, 5)))
    lines = [f"{p},{e},{1.5 * p * (1 - 4 * e)}" for p, e in zip(pressure, contraction, strict=True)]
    name = os.fsdecode(os.fsencode(tmp_path) + b"/bad\xff.csv")
    try:
        with open(name, "w", encoding="utf-8") as file:
            file.write("\n".join(["pressure [kPa],contraction,force [N]", *lines]))
    except OSError:
        pytest.skip("the file system takes no such name")
    command = ["fit", name, "--characteristic", "ContractileSurface", "--degree", "2", "--out", str(tmp_path / "out")]
    result = airmuscle(*command)
    assert result.exit_code == 0, result.output
    assert r"bad\xff" in (tmp_path / "out" / "muscle.toml").read_text(encoding="utf-8").replace("\\\\", "\\")


def test_an_empty_chart_sheet_is_passed_over(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for row in [["time [s]", "pressure [kPa]"], *([i, 100 + i] for i in range(9))]:
        book.active.append(row)
    book.create_chartsheet("chart")
    book.save(tmp_path / "bench.xlsx")
    (recording,) = read(tmp_path / "bench.xlsx")
    assert len(recording) == 9


@pytest.mark.parametrize("userblock", [0, 512])
def test_hdf5_under_the_name_of_matlab_is_read_as_hdf5(tmp_path, userblock: int):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "bench.mat", "w", userblock_size=userblock) as file:
        for i, name in enumerate(("time_s", "pressure_kPa", "force_N")):
            file[name] = np.arange(9.0) + i
    (recording,) = read(tmp_path / "bench.mat")
    assert recording["force"].tolist() == [*range(2, 11)]
