"""MATLAB tables and timetables in MAT files are read with the package mat-io; other objects are
named with their export.
"""

from __future__ import annotations

import struct
import warnings
import zlib
from pathlib import Path

import numpy as np
import pytest

from airmuscle.bench import ColumnMapping, read
from airmuscle.bench.readers import MatlabObject, find_objects, read_mat_tables
from airmuscle.bench.readers.formats import mat_contents
from airmuscle.errors import FileError

scipy_io = pytest.importorskip("scipy.io")
FORCE = np.linspace(10.0, 20.0, 12)


def text_element(text: str) -> bytes:
    """A text as the format stores it: in the tag if it has at most four bytes."""
    data = text.encode()
    if len(data) <= 4:
        return struct.pack("<I", len(data) << 16 | 1) + data.ljust(4, b"\0")
    return struct.pack("<2I", 1, len(data)) + data.ljust((len(data) + 7) // 8 * 8, b"\0")


def opaque(name: str, class_name: str, *, compressed: bool) -> bytes:
    """An opaque variable as MATLAB writes it, with the identifiers of the object in place of its
    values.
    """
    head = (
        struct.pack("<4I", 6, 8, 17, 0)
        + text_element(name)
        + text_element("MCOS")
        + text_element(class_name)
    )
    values = (
        struct.pack("<4I", 6, 8, 13, 0) + struct.pack("<4I", 5, 8, 6, 1) + struct.pack("<2I", 1, 0)
    )
    values += struct.pack("<2I", 6, 24) + struct.pack("<6I", 0xDD000000, 2, 1, 1, 1, 1)
    body = head + struct.pack("<2I", 14, len(values)) + values
    element = struct.pack("<2I", 14, len(body)) + body
    if not compressed:
        return element
    packed = zlib.compress(element)
    return struct.pack("<2I", 15, len(packed)) + packed


def with_objects(
    path: Path, objects: dict[str, str], content: dict[str, object], *, compressed: bool = False
) -> Path:
    """A file of version 5 or 7 with numeric variables and objects."""
    scipy_io.savemat(path, content)
    with path.open("ab") as file:
        for name, class_name in objects.items():
            file.write(opaque(name, class_name, compressed=compressed))
    return path


@pytest.fixture
def without_package(monkeypatch):
    """The reader as it is where mat-io is not installed."""
    known = mat_contents.is_installed
    monkeypatch.setattr(mat_contents, "is_installed", lambda name: name != "matio" and known(name))


@pytest.mark.parametrize("compressed", [False, True])
def test_objects_are_found_by_name_and_class(tmp_path, compressed):
    stored = {"T": "table", "bench_run": "timetable", "ts": "timeseries"}
    path = with_objects(tmp_path / "run.mat", stored, {"x": FORCE}, compressed=compressed)
    assert find_objects(path) == tuple(MatlabObject(*pair) for pair in stored.items())


def test_a_damaged_file_has_no_objects(tmp_path):
    path = with_objects(tmp_path / "run.mat", {"T": "table"}, {"x": FORCE}, compressed=True)
    path.write_bytes(path.read_bytes()[:-40])
    assert find_objects(path) == ()
    (tmp_path / "text.mat").write_bytes(b"no MAT file")
    assert find_objects(tmp_path / "text.mat") == ()


@pytest.mark.usefixtures("without_package")
@pytest.mark.parametrize(
    ("class_name", "export"),
    [
        (
            "table",
            r"S = table2struct\(T, 'ToScalar', true\); save\('data.mat', 'S'\).*pip install mat-io",
        ),
        ("timetable", r"S = table2struct\(timetable2table\(T\), 'ToScalar', true\)"),
        ("timeseries", r"S = struct\('time', T.Time, 'force', T.Data\)"),
    ],
)
def test_an_object_alone_is_named_with_the_command_that_exports_it(tmp_path, class_name, export):
    path = with_objects(tmp_path / "run.mat", {"T": class_name}, {})
    with pytest.raises(FileError, match=rf"T is a MATLAB {class_name}\).*{export}"):
        read_mat_tables(path)


@pytest.mark.usefixtures("without_package")
def test_an_object_beside_vectors_is_a_note_and_no_column(tmp_path):
    path = with_objects(
        tmp_path / "run.mat", {"T": "table"}, {"force_N": FORCE, "pressure_kPa": 10 * FORCE}
    )
    (table,) = read_mat_tables(path)
    assert table.headings == ("force_N", "pressure_kPa")
    assert "Not read: T is a MATLAB table." in table.notes[-1]


@pytest.mark.tool
@pytest.mark.parametrize("version", ["v7", "v7.3"])
def test_tables_are_read_with_their_units(tmp_path, version):
    matio = pytest.importorskip("matio", reason="mat-io is not installed")
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame(
        {"time": 0.1 * np.arange(12), "pressure": 10.0 * FORCE, "force": FORCE, "rig": ["a"] * 12}
    )
    frame.attrs["VariableUnits"] = ["s", "kPa", "N", ""]
    path = tmp_path / "run.mat"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        matio.save_to_mat(str(path), {"T": frame}, version=version)
    (recording,) = read(path, ColumnMapping(units={"time": "s", "pressure": "kPa", "force": "N"}))
    assert recording["pressure"] == pytest.approx(1e4 * FORCE)
    assert recording["force"] == pytest.approx(FORCE)
    (alone,) = read(
        path, ColumnMapping(units={"time": "s", "pressure": "kPa", "force": "N"}, group="T")
    )
    assert len(alone) == 12
