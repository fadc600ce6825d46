"""Files that are damaged or unusual in their format: a clear error, or the table that they
contain.
"""

from __future__ import annotations

import datetime
import os
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
from command_line import airmuscle

from airmuscle.bench import ColumnMapping, DropMissing, inspect, read
from airmuscle.errors import ColumnError, FileError

HEAD = "time [s],pressure [kPa],force [N]\n"
ROWS = "".join(f"{i},{100 + i},{50 + i}\n" for i in range(9))


def table(folder: Path, text: str, name: str = "bench.csv") -> Path:
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


@pytest.mark.parametrize(
    "text",
    [
        HEAD.replace("force [N]", "x" * 140_000) + ROWS,
        HEAD + ROWS + "9,109," + "x" * 140_000 + "\n",
    ],
    ids=["heading", "cell"],
)
def test_a_cell_of_more_characters_than_the_parser_takes_is_refused(tmp_path, text: str):
    with pytest.raises(
        FileError, match=r"bench\.csv, line \d+: a cell has more than 131072 characters"
    ):
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
    contraction, pressure = (
        x.ravel() for x in np.meshgrid(np.linspace(0, 0.2, 6), np.linspace(1e2, 5e2, 5))
    )
    lines = [f"{p},{e},{1.5 * p * (1 - 4 * e)}" for p, e in zip(pressure, contraction, strict=True)]
    name = os.fsdecode(os.fsencode(tmp_path) + b"/bad\xff.csv")
    try:
        with open(name, "w", encoding="utf-8") as file:
            file.write("\n".join(["pressure [kPa],contraction,force [N]", *lines]))
    except OSError:
        pytest.skip("the file system takes no such name")
    command = [
        "fit",
        name,
        "--characteristic",
        "ContractileSurface",
        "--degree",
        "2",
        "--out",
        str(tmp_path / "out"),
    ]
    result = airmuscle(*command)
    assert result.exit_code == 0, result.output
    assert r"bad\xff" in (tmp_path / "out" / "muscle.toml").read_text(encoding="utf-8").replace(
        "\\\\", "\\"
    )


def test_an_empty_chart_sheet_is_passed_over(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for row in [["time [s]", "pressure [kPa]"], *([i, 100 + i] for i in range(9))]:
        book.active.append(row)
    book.create_chartsheet("chart")
    book.save(tmp_path / "bench.xlsx")
    (recording,) = read(tmp_path / "bench.xlsx")
    assert len(recording) == 9


def with_contents(path: Path, member: str, *changes: tuple[bytes, bytes]) -> Path:
    """The workbook with changes of the contents of a member."""
    with zipfile.ZipFile(path) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    for old, new in changes:
        assert old in members[member], old
        members[member] = members[member].replace(old, new)
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return path


def test_formulas_dates_hidden_sheets_and_merged_cells_of_a_workbook(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    start = datetime.datetime(2024, 5, 17, 12)
    book.active.append(["log of the rig"])
    book.active.merge_cells("A1:C1")
    book.active.append(["time", "pressure [kPa]", "force [N]"])
    for i in range(9):
        book.active.append(
            [start + datetime.timedelta(milliseconds=100 * i), f"={100 + i}*1", 50 + i]
        )
    hidden = book.create_sheet("hidden")
    for row in [["time [s]", "force [N]"], *([i, 2 * i] for i in range(9))]:
        hidden.append(row)
    hidden.sheet_state = "hidden"
    book.save(tmp_path / "bench.xlsx")
    computed = [
        (f"<f>{100 + i}*1</f><v></v>".encode(), f"<f>{100 + i}*1</f><v>{100 + i}</v>".encode())
        for i in range(9)
    ]
    first, second = read(
        with_contents(tmp_path / "bench.xlsx", "xl/worksheets/sheet1.xml", *computed)
    )
    assert first["time"] == pytest.approx(0.1 * np.arange(9), abs=1e-6)
    assert first["pressure"].tolist() == [1e3 * (100 + i) for i in range(9)]
    assert second["force"].tolist() == [2.0 * i for i in range(9)]
    assert [each.origin for each in (first, second)] == [
        "bench.xlsx, sheet 'Sheet'",
        "bench.xlsx, sheet 'hidden'",
    ]


def test_a_formula_that_was_never_computed_and_one_with_an_error_have_no_value(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for row in [
        ["time [s]", "force [N]"],
        *([i, 50 + i] for i in range(7)),
        [7, "=1/0"],
        [8, "#DIV/0!"],
    ]:
        book.active.append(row)
    book.save(tmp_path / "bench.xlsx")
    with pytest.raises(
        ColumnError,
        match=r"2 of 9 cells of 'force \[N\]' .* row 9 \(force empty\), row 10 \(force empty\)",
    ):
        read(tmp_path / "bench.xlsx")
    assert len(read(tmp_path / "bench.xlsx", ColumnMapping(missing=DropMissing()))[0]) == 7


@pytest.mark.parametrize("userblock", [0, 512])
def test_hdf5_under_the_name_of_matlab_is_read_as_hdf5(tmp_path, userblock: int):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "bench.mat", "w", userblock_size=userblock) as file:
        for i, name in enumerate(("time_s", "pressure_kPa", "force_N")):
            file[name] = np.arange(9.0) + i
    (recording,) = read(tmp_path / "bench.mat")
    assert recording["force"].tolist() == [*range(2, 11)]


def cells(*values: object) -> np.ndarray:
    """A cell array of MATLAB."""
    made = np.empty(len(values), dtype=object)
    made[:] = values
    return made


@pytest.mark.parametrize(
    ("value", "what"),
    [
        (np.arange(9) * 1j, "complex numbers"),
        (cells(*"abcdefghi"), "texts"),
        (cells(*([np.ones(2)] * 9)), "cells"),
    ],
    ids=["complex", "texts", "cells"],
)
def test_a_column_of_matlab_that_contains_no_real_numbers_is_left_out_with_a_remark(
    tmp_path, value, what: str
):
    scipy_io = pytest.importorskip("scipy.io")
    scipy_io.savemat(
        tmp_path / "bench.mat",
        {"time_s": np.arange(9.0), "force_N": np.arange(9.0), "state": value},
    )
    (recording,) = read(tmp_path / "bench.mat")
    assert list(recording) == ["time", "force"]
    assert f"Not read, because it contains no real numbers: state ({what})." in recording.notes


def test_complex_numbers_cells_and_a_sparse_matrix_of_version_7_3_are_left_out_with_a_remark(
    tmp_path,
):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "bench.mat", "w", userblock_size=512) as file:
        for name in ("time_s", "force_N"):
            file[name] = np.arange(9.0)[None, :]
        file["z"] = np.zeros((1, 9), dtype=[("real", float), ("imag", float)])
        file["state"] = np.array([[file["force_N"].ref] * 9], dtype=h5py.ref_dtype)
        file.create_group("S").attrs["MATLAB_sparse"] = 9
        for name, kind in {
            "time_s": "double",
            "force_N": "double",
            "z": "double",
            "state": "cell",
            "S": "double",
        }.items():
            file[name].attrs["MATLAB_class"] = np.bytes_(kind)
    with (tmp_path / "bench.mat").open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")
    (recording,) = read(tmp_path / "bench.mat")
    assert recording["force"].tolist() == [*range(9)]
    assert {"Not read: S, a sparse matrix.", "Not read: z, which contains no real numbers."} <= set(
        recording.notes
    )
    assert "Not read, because it contains no real numbers: state (cells)." in recording.notes


@pytest.mark.parametrize("signals", [3.0, np.zeros((0, 0)), {"label": "force"}, "force"])
def test_a_struct_with_time_and_signals_that_simulink_did_not_save(tmp_path, signals):
    scipy_io = pytest.importorskip("scipy.io")
    out = {"time": np.arange(9.0), "force_N": np.arange(9.0), "signals": signals}
    scipy_io.savemat(tmp_path / "bench.mat", {"out": out})
    (recording,) = read(tmp_path / "bench.mat", ColumnMapping(units={"time": "s"}))
    assert recording["force"].tolist() == [*range(9)]


@pytest.mark.parametrize(
    ("heading", "below", "message"),
    [
        (
            "pressure [kPa]",
            "bar",
            r"the heading 'pressure \[kPa\]' states kPa, but the row of units below it bar",
        ),
        ("pressure [kPa(a)]", "kPa(g)", r"states kPa\(a\), but the row of units below it kPa\(g\)"),
        ("pressure [kPa]", "kPa", None),
        ("pressure [kPa]", "kPa(a)", None),
        ("pressure [kPa]", "", None),
        ("pressure", "kPa", None),
    ],
)
def test_a_unit_row_that_contradicts_a_heading_is_refused(
    tmp_path, heading: str, below: str, message: str | None
):
    path = table(tmp_path, f"time [s],{heading},force [N]\ns,{below},N\n{ROWS}")
    if message is None:
        assert len(read(path)[0]) == 9
        return
    with pytest.raises(ColumnError, match=message):
        read(path)
    (recording,) = read(path, ColumnMapping(units={"pressure": "kPa"}))
    assert recording["pressure"][0] == 1e5


@pytest.mark.parametrize("cell", ["25:61:00", "12:00:60", "12:99:10"])
def test_a_clock_time_that_is_none_is_named(tmp_path, cell: str):
    rows = "".join(f"12:00:0{i},{100 + i},{50 + i}\n" for i in range(9))
    path = table(tmp_path, HEAD.replace(" [s]", "") + rows.replace("12:00:04", cell))
    with pytest.raises(
        ColumnError,
        match=rf"line 6: time '{cell}' is not a number or a clock time\. Correct the cell",
    ):
        read(path)
