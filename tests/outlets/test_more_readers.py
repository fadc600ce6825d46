"""Workbooks of other programs, Parquet and HDF5 give the recording of the same table as text."""

from __future__ import annotations

import base64
import sys
import zipfile
import zlib
from pathlib import Path

import numpy as np
import pytest

from airmuscle.bench import ColumnMapping, read
from airmuscle.errors import ColumnError, FileError, InputError
from airmuscle.recording import Recording

TIME = np.linspace(0.0, 2.0, 41)
COLUMNS = {
    "time": TIME,
    "pressure": 100.0 + 50.0 * TIME,
    "length": 300.0 - 10.0 * TIME,
    "force": 50.0 + np.sin(TIME),
}
UNITS = {"time": "s", "pressure": "kPa", "length": "mm", "force": "N"}
XLS = (
    "eNrtWE1IFGEYfr75WXdF113TQAMRISvzEl266JZUntqsSyGBrTrZoq4yux3qUJZ5CYKoUxGB4KWL/RyyqKBuQYFRh0AIduvoqSjooE7v++7Mpr"
    "YHF0wq5hnmme973+955535fubn7Ww0O/mgPodVaIeOJSeEwDKboj3kVSIgv+Nw0TsGaXd8/FMIBakjAyaeVr4p4z7k/s5Bw33jJTHwifYTGEV8"
    "JGU1biA6JIeE4hzaiBVukyWMOsmqWrhPeJPwPWn5THivWK4Kt1HbrOrGbCzesscdxce1JvGFwXFnRDMnll2oxSsexReuqXxbE/vsZGLo73Q0GB"
    "WYAvVbp5Wy7MRQFjXUgVP47jQC37yZ+qLRt2+sXYHsP1bay4rYb2gGMAbnpAzwCVTgq84eA/sTmcQCDqPcXXLDgG2lM8nUQM+QlRrInKbROjxM"
    "6kxy2KJ1d5S86TO2RdM37zeBUyN2n0UDJk0xB7sSVIpLOJnxkRUzvlJmQgVxP6qkHJX5EKE1feHul3eHertiPWIZk1U+/yzYyunDwUVWkDgsHg"
    "kK9rSIYqfwJYm6Rcr1wjU0iunY3FXrFg6OS5vL4m2m8+wWvI9tW1beTuWJ+SOPGyY+x3ZQebozd65m+kNsEk10o/pJz9s4WlWrunWT8STmHZW7"
    "bnwUrvttDQlqEcldh+M+8KqwKF0Auh+M81q5XHsUc3SBeZ9GNeWqNbnylWpN1Mz5Gqv1Qo3VRqGmU810Y+lFYukSK+C21yVWWaHmZZKvcaygG8"
    "tYFes5GsQWdbO7rpgfGszzcb4DrDKLqExp/1q4W2O+I6qZHk8VKKIKFPKOoklnviKqDsWqdq0ajzgRWrl/oRw+fPjw4cOHDx8+1h9K3mDhvm1C"
    "3u8C7ls8/9dZpH3J/03y3+IoRmjL0IfpAaToaONsSeNnM0zlxVJr1Hj/CxnH6Ow2BtEreQyWPH7pi04tv541CyPrN4VKPf9SKXn+4fP/BOFZ5S"
    "c="
)
"""A workbook of Excel 97 with seven rows, compressed."""


def same(recording: Recording) -> None:
    assert recording["pressure"] == pytest.approx(1e3 * COLUMNS["pressure"])
    assert recording["length"] == pytest.approx(1e-3 * COLUMNS["length"])
    assert recording["force"] == pytest.approx(COLUMNS["force"])
    assert recording["contraction"] == pytest.approx(1 - COLUMNS["length"] / 310.0)


def refusal(kind: type[InputError], path: Path, **options) -> str:
    with pytest.raises(kind) as caught:
        read(path, ColumnMapping(**options))
    return str(caught.value)


def ods(path: Path, sheets: dict[str, list[list[object]]]) -> Path:
    """A minimal OpenDocument spreadsheet."""
    namespaces = " ".join(
        f'xmlns:{p}="urn:oasis:names:tc:opendocument:xmlns:{p}:1.0"'
        for p in ("office", "table", "text")
    )

    def cell(value: object) -> str:
        if isinstance(value, str):
            return (
                "<table:table-cell"
                f' office:value-type="string"><text:p>{value}</text:p></table:table-cell>'
            )
        return f'<table:table-cell office:value-type="float" office:value="{value}"/>'

    tables = "".join(
        f'<table:table table:name="{name}">'
        + "".join(f"<table:table-row>{''.join(map(cell, row))}</table:table-row>" for row in rows)
        + "</table:table>"
        for name, rows in sheets.items()
    )
    body = f"<office:body><office:spreadsheet>{tables}</office:spreadsheet></office:body>"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("mimetype", "application/vnd.oasis.opendocument.spreadsheet")
        archive.writestr(
            "content.xml",
            '<?xml version="1.0"?><office:document-content'
            f" {namespaces}>{body}</office:document-content>",
        )
        archive.writestr("META-INF/manifest.xml", "<manifest/>")
    return path


def rows() -> list[list[object]]:
    numbers = np.column_stack(list(COLUMNS.values())).tolist()
    return [["resting_length", 310, "mm"], list(COLUMNS), list(UNITS.values()), *numbers]


def test_an_ods_spreadsheet_gives_each_sheet_with_a_table(tmp_path: Path):
    pytest.importorskip("python_calamine")
    path = ods(tmp_path / "runs.ods", {"Notes": [["by Ada"]], "First": rows(), "Second": rows()})
    first, second = read(path)
    same(first)
    assert (first.origin, len(second)) == ("runs.ods, sheet 'First'", 41)
    same(read(path, ColumnMapping(sheet="Second"))[0])
    assert "no sheet 'Third'; the sheets are Notes, First, Second" in refusal(
        FileError, path, sheet="Third"
    )


def test_an_ods_spreadsheet_names_the_row_of_a_bad_cell(tmp_path: Path):
    pytest.importorskip("python_calamine")
    table = rows()
    table[5][3] = "n/a"
    assert "run.ods, row 6: force 'n/a' is not a number" in refusal(
        ColumnError, ods(tmp_path / "run.ods", {"A": table})
    )


def test_an_old_excel_workbook_is_read(tmp_path: Path):
    pytest.importorskip("python_calamine")
    (tmp_path / "run.xls").write_bytes(zlib.decompress(base64.b64decode("".join(XLS))))
    (recording,) = read(tmp_path / "run.xls")
    assert recording["pressure"] == pytest.approx([1e5, 1.5e5, 2e5])
    assert recording["force"] == pytest.approx([50.5, 61.25, 80.0])
    assert recording.constants == {"resting_length": pytest.approx(0.31)}


def test_parquet_with_units_in_the_metadata_or_in_the_names(tmp_path: Path):
    pyarrow = pytest.importorskip("pyarrow")
    from pyarrow import parquet

    fields = [pyarrow.field(n, pyarrow.float64(), metadata={"unit": UNITS[n]}) for n in COLUMNS]
    schema = pyarrow.schema(fields, metadata={"resting_length": "310 mm"})
    parquet.write_table(
        pyarrow.table(list(COLUMNS.values()), schema=schema), tmp_path / "run.parquet"
    )
    same(read(tmp_path / "run.parquet")[0])
    named = pyarrow.table({f"{n} [{UNITS[n]}]": values for n, values in COLUMNS.items()})
    parquet.write_table(named, tmp_path / "named.parquet")
    same(read(tmp_path / "named.parquet", ColumnMapping(resting_length="310 mm"))[0])


def hdf5(path: Path) -> Path:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        group = file.create_group("rig/run1")
        group.attrs["resting_length"] = "310 mm"
        for name, values in COLUMNS.items():
            group.create_dataset(name, data=values).attrs["unit"] = UNITS[name]
        matrix = file.create_dataset("matrix", data=np.column_stack(list(COLUMNS.values())))
        matrix.attrs["columns"], matrix.attrs["units"] = list(COLUMNS), list(UNITS.values())
        record = np.rec.fromarrays(list(COLUMNS.values()), names=list(COLUMNS))
        file.create_dataset("records", data=record).attrs["units"] = list(UNITS.values())
        file["loop"] = h5py.SoftLink("/")
    return path


def test_hdf5_groups_matrices_and_records_are_runs(tmp_path: Path):
    path = hdf5(tmp_path / "runs.h5")
    recordings = read(path, ColumnMapping(resting_length="310 mm"))
    assert sorted(r.origin for r in recordings) == [
        f"runs.h5, group '{n}'" for n in ("/matrix", "/records", "/rig/run1")
    ]
    for recording in recordings:
        same(recording)
    same(read(path, ColumnMapping(group="/rig/run1"))[0])
    assert "no group 'rig/run2'" in refusal(FileError, path, group="/rig/run2")


@pytest.mark.parametrize(
    ("ending", "package"),
    [
        (".ods", "python_calamine"),
        (".xls", "python_calamine"),
        (".parquet", "pyarrow"),
        (".h5", "h5py"),
    ],
)
def test_a_damaged_file_and_a_missing_package_are_one_error_each(
    tmp_path: Path, monkeypatch, ending: str, package: str
):
    pytest.importorskip(package)
    path = tmp_path / f"broken{ending}"
    path.write_bytes(b"this is no measurement at all" * 50)
    assert f"broken{ending}: cannot be read as" in refusal(FileError, path)
    assert "No such file or directory" in refusal(FileError, tmp_path / f"none{ending}")
    monkeypatch.setitem(sys.modules, package, None)
    assert f'needs the package {package}. Install it: pip install "airmuscle[lab]"' in refusal(
        FileError, path
    )


def test_attributes_of_an_hdf5_file_count_in_its_groups_unless_these_state_others(tmp_path: Path):
    h5py = pytest.importorskip("h5py", reason="needs the extra lab")
    with h5py.File(tmp_path / "rig.h5", "w") as file:
        file.attrs["ambient"] = "950 hPa"
        file.attrs["specimen"] = "A"
        for name in ("first", "second"):
            group = file.create_group(f"day/{name}")
            group["time [s]"] = [0.0, 1.0]
            group["pressure [bara]"] = [1.0, 2.0]
        group.attrs["ambient"] = "900 hPa"
    first, second = read(tmp_path / "rig.h5")
    assert first["pressure"] == pytest.approx([5e3, 1.05e5])
    assert second["pressure"] == pytest.approx([1e4, 1.1e5])
    assert first.constants == {"ambient": 95e3, "specimen": "A"}
