"""Every reader, for recordings and for episodes: the same numbers from every format, and one set of
monsters, each of which is refused in airmuscle's own words, within the limits of time and memory,
without reading another file or running code.
"""

from __future__ import annotations

import io
import json
import pickle
import random
import warnings
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from measurement_files import (
    COLUMNS,
    EPISODE_MAPPING,
    FILES,
    MAT_7_3_HEADER,
    ROWS,
    UNITS,
    WRITERS,
)

from airmuscle.bench import ColumnMapping, read, read_csv, read_episodes
from airmuscle.bench.readers.formats import format_table
from airmuscle.bench.readers.tables import separate_process
from airmuscle.errors import AirmuscleError, FileError

SECRET = 77.0
"""A number in files that no measurement file may refer to; in bytes it is the letter M."""
MEMORY = 150
"""Limit of the memory of a reader [MB] in these tests."""
LONGEST = 1200
"""Characters of a message."""
Read = Callable[[Path], list[np.ndarray]]


def recorded(path: Path) -> list[np.ndarray]:
    recordings = read(path, ColumnMapping(units={**UNITS}))
    return [values for recording in recordings for values in recording.columns.values()]


def as_episodes(path: Path) -> list[np.ndarray]:
    mapping = path.parent / "mapping.toml"
    mapping.write_text(EPISODE_MAPPING)
    runs = read_episodes(path, mapping).runs
    return [array for run in runs for array in (run.angle, run.pressure)]


KINDS = pytest.mark.parametrize("reading", [recorded, as_episodes])


def test_every_format_has_a_sample():
    suffixes = {Path(name).suffix for name in WRITERS}
    for form in format_table.FORMATS:
        assert not form.extensions or suffixes & set(form.extensions), form.name


@pytest.mark.parametrize("name", FILES)
def test_every_format_gives_the_same_recording(tmp_path: Path, name: str):
    WRITERS[name](tmp_path / name)
    if format_table.format_of(tmp_path / name).tables is None:
        with pytest.raises(FileError, match="are read as episodes of an arm alone"):
            read(tmp_path / name)
        return
    (recording,) = read(tmp_path / name, ColumnMapping(units=UNITS))
    assert {*COLUMNS} <= {*recording}
    for column, values in COLUMNS.items():
        assert recording[column] == pytest.approx(values, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("name", FILES)
def test_every_format_gives_the_same_episode(tmp_path: Path, name: str):
    WRITERS[name](tmp_path / name)
    angle, pressure = as_episodes(tmp_path / name)
    assert angle[:, 0] == pytest.approx(COLUMNS["angle"], rel=1e-9, abs=1e-9)
    assert pressure[:, 0] == pytest.approx(COLUMNS["p1"], rel=1e-9)
    assert pressure[:, 1] == pytest.approx(COLUMNS["p2"], rel=1e-9)


@pytest.mark.parametrize("form", format_table.FORMATS, ids=lambda form: form.name)
def test_every_format_is_read_in_the_separate_process(form, tmp_path, monkeypatch):
    """Text above the size up to which its time and memory are below the limits of the process."""
    path = tmp_path / "run"
    path.write_bytes(b"1,2\n" * (1 + form.size_here // 4))
    monkeypatch.setattr(format_table, "call_in_separate_process", lambda *given, **_: given[2])
    monkeypatch.setattr(format_table, "check_installed", lambda *_: None)
    assert form.call("raw_csv.read_text_tables", path) == path


def test_only_text_is_read_here_up_to_the_size_of_the_monsters_of_text():
    """Those of test_monstrous_text.py, which are read within a quarter of the memory."""
    here = {form.name: form.size_here for form in format_table.FORMATS if form.size_here}
    assert here == {"text": 4_000_000}
    assert separate_process.CPU_LIMIT >= 15.0
    assert separate_process.MEMORY_LIMIT >= 4 * 5e8


def test_the_limits_hold_for_text(tmp_path, monkeypatch):
    """Lines of one digit need more of a processor than this test allows."""
    path = tmp_path / "run.csv"
    path.write_bytes(b"force [N]\n" + b"1\n" * 2_500_000)
    monkeypatch.setattr(separate_process, "CPU_LIMIT", 0.05)
    separate_process.stop()
    with pytest.raises(FileError, match=r"run\.csv: .* need more than 0 s of a processor"):
        read_csv(path)


def test_a_long_text_states_its_progress(tmp_path):
    path = tmp_path / "run.csv"
    path.write_bytes(b"force [N],pressure [kPa]\n" + b"150.5,225.25\n" * 320_000)
    told = []
    (recording,) = read(path, progress=lambda name, fraction: told.append((name, fraction)))
    assert len(recording) > 1e5
    assert {name for name, _ in told} == {"run.csv"}
    assert [fraction for _, fraction in told] == sorted(fraction for _, fraction in told)
    assert told[-1][1] == 1.0


# Monsters of any format


class RunsCode:
    """A pickle that writes a file when it is loaded."""

    def __init__(self, marker: Path) -> None:
        self.marker = marker

    def __reduce__(self):
        return Path.touch, (self.marker,)


def zeros(size: int) -> Iterator[bytes]:
    block = bytes(1_000_000)
    for _ in range(size // len(block)):
        yield block


def zip_of_zeros(member: str, size: int, head: bytes = b"") -> bytes:
    content = io.BytesIO()
    with (
        zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
        archive.open(member, "w", force_zip64=True) as file,
    ):
        file.write(head)
        for block in zeros(size):
            file.write(block)
    return content.getvalue()


@pytest.fixture(scope="module")
def bomb() -> bytes:
    """A ZIP archive of zeros, of three times the allowed memory."""
    return zip_of_zeros("zeros", 450_000_000)


def of_any_format(good: bytes, bomb: bytes, marker: Path) -> Iterator[tuple[str, bytes]]:
    yield "empty", b""
    yield "one byte", good[:1]
    for share in (0.1, 0.5, 0.9, 0.999):
        yield f"the first {share}", good[: int(share * len(good))]
    draw = random.Random(len(good))
    for number in range(6):
        damaged = bytearray(good)
        for _ in range(draw.choice([1, 5, 50])):
            damaged[draw.randrange(len(damaged))] = draw.randrange(256)
        yield f"damaged {number}", bytes(damaged)
    place = len(good) // 2
    yield "inserted bytes", good[:place] + draw.randbytes(1000) + good[place:]
    yield "bomb", bomb
    yield "pickle", pickle.dumps(RunsCode(marker))
    yield "deep lists", b"[" * 200_000
    yield "deep objects", b'{"a":' * 200_000
    yield "zeros", bytes(100_000)
    yield "noise", draw.randbytes(20_000)
    yield "pointer", b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n"
    yield "page", b"<!DOCTYPE html><html><body>404</body></html>"


@pytest.fixture
def watched(tmp_path: Path, monkeypatch) -> Callable[[Read, Path], str]:
    """A function that reads a monster and returns its message, or an empty text where it is read,
    and checks what it must not do.
    """
    monkeypatch.setenv(separate_process.MEMORY_SETTING, f"{MEMORY} MB")
    monkeypatch.setattr(separate_process, "CPU_LIMIT", 1.5)
    marker = tmp_path / "code ran"

    def call(reading: Read, path: Path) -> str:
        said = ""
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                arrays = reading(path)
        except AirmuscleError as error:
            said = str(error)
            assert 10 < len(said) < LONGEST, (path, said[:300])
        else:
            assert sum(array.size for array in arrays) < 1e7, path
            assert not any(np.any(array == SECRET) for array in arrays), path
        assert not marker.exists(), path
        return said

    return call


@KINDS
@pytest.mark.parametrize("name", FILES)
def test_a_monster_of_any_format_is_refused_or_harmless(
    tmp_path: Path, name: str, reading: Read, bomb: bytes, watched
):
    WRITERS[name](tmp_path / name)
    good = (tmp_path / name).read_bytes()
    path = tmp_path / f"monster{Path(name).suffix}"
    for kind, content in of_any_format(good, bomb, tmp_path / "code ran"):
        path.write_bytes(content)
        said = watched(reading, path)
        if kind in ("empty", "bomb", "pickle", "deep lists", "pointer", "page"):
            assert said, (name, kind)


# Monsters of one format


def external(path: Path, secret: Path, name: str) -> None:
    """HDF5 whose values of `name` are the bytes of another file."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "a") as file:
        del file[name]
        file.create_dataset(name, (ROWS,), dtype="u1", external=[(str(secret), 0, ROWS)])


def linked(path: Path, secret: Path, name: str) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "a") as file:
        del file[name]
        file[name] = h5py.ExternalLink(str(secret.with_suffix(".h5")), "secret")


def soft_linked(path: Path, secret: Path, name: str) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "a") as file:
        del file[name]
        file["other"] = h5py.ExternalLink(str(secret.with_suffix(".h5")), "/")
        file[name] = h5py.SoftLink("/other/secret")


def virtual(path: Path, secret: Path, name: str) -> None:
    h5py = pytest.importorskip("h5py")
    layout = h5py.VirtualLayout((ROWS,), dtype=float)
    layout[:] = h5py.VirtualSource(str(secret.with_suffix(".h5")), "secret", shape=(ROWS,))
    with h5py.File(path, "a") as file:
        del file[name]
        file.create_virtual_dataset(name, layout)


def in_a_group(path: Path, secret: Path, name: str) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "a") as file:
        inner = file.create_group("a/b")
        inner.create_dataset(name, (ROWS,), dtype="u1", external=[(str(secret), 0, ROWS)])


LINKS = (external, linked, soft_linked, virtual, in_a_group)


@KINDS
@pytest.mark.parametrize("link", LINKS)
@pytest.mark.parametrize("name", ["run.h5", "seven.mat"])
def test_values_of_another_file_are_refused(tmp_path, name, reading, link, watched):
    h5py = pytest.importorskip("h5py")
    secret = tmp_path / "secret"
    secret.write_bytes(bytes([int(SECRET)]) * ROWS)
    with h5py.File(tmp_path / "secret.h5", "w") as file:
        file["secret"] = np.full(ROWS, SECRET)
    WRITERS[name](tmp_path / name)
    link(tmp_path / name, secret, "angle")
    said = watched(reading, tmp_path / name)
    left_out = "the columns are force, p1, p2, time" in said
    assert left_out or "another file, which is not read" in said or "no column 'angle'" in said


def test_a_link_to_another_file_that_is_left_out_of_a_recording_is_said(tmp_path):
    WRITERS["run.h5"](tmp_path / "run.h5")
    linked(tmp_path / "run.h5", tmp_path / "secret", "angle")
    mapping = ColumnMapping(units={"time": "s", "force": "N"})
    (recording,) = read(tmp_path / "run.h5", mapping)
    assert "angle" not in recording
    assert "Not read: 'angle', which is a link to another file." in " ".join(recording.notes)


@KINDS
@pytest.mark.parametrize("name", ["run.h5", "seven.mat"])
def test_a_fill_value_of_billions_of_rows_is_refused(tmp_path, name, reading, watched):
    h5py = pytest.importorskip("h5py")
    path = tmp_path / name
    with h5py.File(path, "w", userblock_size=512 if name.endswith("mat") else 0) as file:
        for column in COLUMNS:
            data = file.create_dataset(
                column, (4_000_000_000,), dtype=float, chunks=(1_000_000,), fillvalue=1.0
            )
            data.attrs["MATLAB_class"] = np.bytes_("double")
    if name.endswith("mat"):
        with path.open("r+b") as file:
            file.write(MAT_7_3_HEADER)
    assert "GB of memory" in watched(reading, path)


@KINDS
def test_a_group_inside_itself_is_refused(tmp_path, reading, watched):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "run.h5", "w") as file:
        group = file.create_group("a")
        group["a"] = group
        group["angle"] = np.zeros(ROWS)
    assert watched(reading, tmp_path / "run.h5")


@KINDS
def test_a_parquet_file_of_equal_values_is_refused_or_small(tmp_path, reading, watched):
    pyarrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    index = pyarrow.array(np.zeros(8_000_000, dtype=np.int32))
    column = pyarrow.DictionaryArray.from_arrays(index, pyarrow.array([1.0]))
    parquet.write_table(pyarrow.table(dict.fromkeys(COLUMNS, column)), tmp_path / "run.parquet")
    assert (tmp_path / "run.parquet").stat().st_size < 1e6
    assert watched(reading, tmp_path / "run.parquet")


def npy_head(rows: int) -> bytes:
    content = io.BytesIO()
    shape = {"descr": "<f8", "fortran_order": False, "shape": (rows,)}
    np.lib.format.write_array_header_1_0(content, shape)
    return content.getvalue()


def test_an_archive_of_arrays_of_zeros_or_of_objects_is_refused(tmp_path, watched):
    rows = 40_000_000
    (tmp_path / "run.npz").write_bytes(zip_of_zeros("angle.npy", 8 * rows, npy_head(rows)))
    assert "GB of memory" in watched(as_episodes, tmp_path / "run.npz")
    (tmp_path / "run.npz").write_bytes(zip_of_zeros("angle.npy", 1_000_000, npy_head(10**18)))
    assert watched(as_episodes, tmp_path / "run.npz")
    with (tmp_path / "run.npz").open("wb") as file:
        np.savez(file, angle=np.array([RunsCode(tmp_path / "code ran")], dtype=object))
    assert "cannot be read as NPZ" in watched(as_episodes, tmp_path / "run.npz")


@KINDS
def test_a_workbook_of_millions_of_cells_is_refused(tmp_path, reading, watched):
    openpyxl = pytest.importorskip("openpyxl")
    openpyxl.Workbook().save(tmp_path / "small.xlsx")
    row = b"<row>" + b"<c><v>1</v></c>" * 1000 + b"</row>"
    with (
        zipfile.ZipFile(tmp_path / "small.xlsx") as source,
        zipfile.ZipFile(tmp_path / "run.xlsx", "w", zipfile.ZIP_DEFLATED) as target,
    ):
        for member in source.namelist():
            content = source.read(member)
            if member.endswith("sheet1.xml"):
                content = content.replace(
                    b"<sheetData />", b"<sheetData>" + row * 6_000 + b"</sheetData>"
                ).replace(b"<sheetData/>", b"<sheetData>" + row * 6_000 + b"</sheetData>")
            target.writestr(member, content)
    assert (tmp_path / "run.xlsx").stat().st_size < 3e6
    assert watched(reading, tmp_path / "run.xlsx")


GOOD_JSON = {name: values.tolist() for name, values in COLUMNS.items()}


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (json.dumps(GOOD_JSON).replace('"p2"', '"p1"'), "the name 'p1' occurs twice"),
        (
            json.dumps(GOOD_JSON | {"angle": [str(x) for x in GOOD_JSON["angle"]]}),
            "'angle' contains numbers in quotation marks",
        ),
        (json.dumps(GOOD_JSON | {"angle": [*GOOD_JSON["angle"][:-1], "1"]}), "in quotation marks"),
        (
            json.dumps(GOOD_JSON | {"angle": [*GOOD_JSON["angle"][:-1], [1.0]]}),
            "have the same length",
        ),
        (
            json.dumps(GOOD_JSON | {"angle": [*GOOD_JSON["angle"][:-1], None]}),
            "not a finite number",
        ),
        (json.dumps(GOOD_JSON).replace("0.0,", "1e999,", 1), "do not rise from row to row"),
        (json.dumps(GOOD_JSON).replace("0.0,", "1" * 5000 + ",", 1), "cannot be read as JSON"),
        (json.dumps(GOOD_JSON | {"angle": [10**400] * ROWS}), "is no array of numbers"),
    ],
)
def test_json_that_is_ambiguous_is_refused(tmp_path, content, message):
    (tmp_path / "run.json").write_text(content)
    with pytest.raises(AirmuscleError, match=message.replace(".", r"\.")):
        as_episodes(tmp_path / "run.json")


def test_json_of_windows_and_with_texts_is_read(tmp_path):
    content = json.dumps(GOOD_JSON | {"remarks": ["a", "b"]})
    (tmp_path / "run.json").write_text(content, encoding="utf-8-sig")
    angle, _ = as_episodes(tmp_path / "run.json")
    assert angle[:, 0] == pytest.approx(COLUMNS["angle"])
