"""Large binary files are read by pieces: the kept rows are those of the whole file, and what is
requested at once is bounded, of HDF5 and MDF to a piece of a column, of MAT before version 7.3 to a
variable.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from airmuscle.bench import BlockMeans, ColumnMapping, Decimation, read
from airmuscle.bench.readers import Selection, read_contents
from airmuscle.bench.readers.formats import raw_hdf5, raw_mat, raw_mdf
from airmuscle.bench.readers.tables import time_base as pieces
from airmuscle.errors import AirmuscleError, ColumnError

h5py = pytest.importorskip("h5py", reason="h5py is not installed")
ROWS = 10_007
TIME = 0.01 * np.arange(ROWS)
FORCE = 100.0 + 50.0 * np.sin(TIME)


def hdf5(path: Path, rows: int = ROWS) -> Path:
    with h5py.File(path, "w") as file:
        file["time_s"] = TIME[:rows]
        file["force_N"] = FORCE[:rows]
        records = np.zeros(rows, dtype=[("time_s", float), ("force_N", float)])
        records["time_s"] = TIME[:rows]
        records["force_N"] = FORCE[:rows]
        file["log"] = records
    return path


def mat_7_3(path: Path) -> Path:
    """A file as MATLAB writes it: HDF5 after a header, arrays with their axes in reverse order."""
    with h5py.File(path, "w", userblock_size=512) as file:
        run = file.create_group("run")
        run.attrs["MATLAB_class"] = np.bytes_("struct")
        for name, values in (("time_s", TIME), ("force_N", FORCE)):
            data = run.create_dataset(name, data=values[None, :])
            data.attrs["MATLAB_class"] = np.bytes_("double")
        matrix = file.create_dataset("data", data=np.stack([TIME, FORCE]))
        matrix.attrs["MATLAB_class"] = np.bytes_("double")
        length = file.create_dataset("resting_length_mm", data=np.array([[300.0]]))
        length.attrs["MATLAB_class"] = np.bytes_("double")
        text = file.create_dataset("operator", data=np.array([[77], [85]], dtype=np.uint16))
        text.attrs["MATLAB_class"] = np.bytes_("char")
        cell = file.create_dataset("notes", data=np.array([[length.ref]], dtype=h5py.ref_dtype))
        cell.attrs["MATLAB_class"] = np.bytes_("cell")
    content = bytearray(path.read_bytes())
    content[:128] = b"MATLAB 7.3 MAT-file".ljust(116) + bytes(8) + b"\x00\x02IM"
    path.write_bytes(content)
    return path


def mat_5(path: Path) -> Path:
    scipy_io = pytest.importorskip("scipy.io")
    run = {"time_s": TIME, "force_N": FORCE}
    scipy_io.savemat(
        path, {"run": run, "pressure_kPa": FORCE, "resting_length_mm": 300.0}, do_compression=True
    )
    return path


def mdf(path: Path) -> Path:
    asammdf = pytest.importorskip("asammdf", reason="asammdf is not installed")
    with asammdf.MDF(version="4.10") as file:
        file.append(
            [
                asammdf.Signal(FORCE, TIME, name="force", unit="N"),
                asammdf.Signal((FORCE > 100.0).astype(int), TIME, name="fill", unit="1"),
            ]
        )
        file.save(path, overwrite=True)
    return path


@pytest.fixture
def small_pieces(monkeypatch):
    monkeypatch.setattr(pieces, "PIECE_ROWS", 900)


@pytest.mark.parametrize("size", [1, 100, 2000, ROWS, 20_000])
@pytest.mark.parametrize("downsampling", [Decimation, BlockMeans])
def test_the_pieces_of_a_column_give_the_rows_of_the_whole(small_pieces, size, downsampling):
    step = downsampling(size).step(ROWS)
    requested = []

    def get(first, end):
        requested.append(end - first)
        return FORCE[first:end]

    np.testing.assert_allclose(
        pieces.Reduction(downsampling(size), ROWS).read(get, ROWS),
        downsampling().reduce(FORCE, step),
        rtol=1e-12,
    )
    assert step == 1 or max(requested) <= max(900, step)


@pytest.mark.parametrize(
    ("name", "write", "reader"),
    [
        (
            "run.h5",
            hdf5,
            lambda path, d: raw_hdf5.read_hdf5_tables(path, Selection("/log", downsampling=d)),
        ),
        (
            "run.h5",
            hdf5,
            lambda path, d: raw_hdf5.read_hdf5_tables(path, Selection("/", downsampling=d)),
        ),
        (
            "run.mat",
            mat_7_3,
            lambda path, d: raw_mat.read_mat_tables(path, Selection("run", downsampling=d)),
        ),
        (
            "run.mat",
            mat_5,
            lambda path, d: raw_mat.read_mat_tables(path, Selection("run", downsampling=d)),
        ),
        (
            "run.mf4",
            mdf,
            lambda path, d: raw_mdf.read_mdf_tables(path, Selection(downsampling=d)),
        ),
    ],
)
def test_a_large_file_gives_every_nth_row_as_measured_with_a_note(
    tmp_path, small_pieces, name, write, reader
):
    (table,) = reader(write(tmp_path / name), Decimation(1000))
    columns = dict(
        zip([heading.partition(" ")[0] for heading in table.headings], table.columns, strict=True)
    )
    step = 11
    force = next(values for key, values in columns.items() if key.startswith("force"))
    np.testing.assert_array_equal(force, FORCE[::step])
    np.testing.assert_allclose(
        next(v for key, v in columns.items() if key.startswith("time")), TIME[::step], atol=1e-12
    )
    assert len(force) == len(table.rows) <= 1000
    assert f"The file has {ROWS} rows; one in {step} is kept" in " ".join(table.notes)


def test_a_reading_of_the_user_is_reduced_as_well(tmp_path):
    (recording,) = read(
        hdf5(tmp_path / "run.h5"), ColumnMapping(group="/log"), downsampling=Decimation(500)
    )
    assert len(recording) == 477
    assert recording["force"][1] == FORCE[21]
    assert recording["time"][-1] == TIME[::21][-1]


def test_a_matrix_texts_and_constants_and_cells_of_a_large_matlab_file_are_kept(
    tmp_path, small_pieces
):
    large = read_contents(mat_7_3(tmp_path / "run.mat"), Decimation(1000))
    np.testing.assert_array_equal(large.variables["data"], np.stack([TIME, FORCE]).T[::11])
    assert large.variables["resting_length_mm"] == 300.0
    assert large.variables["operator"] == "MU"
    assert large.variables["notes"] == [300.0]
    assert large.notes == ()
    assert large.reductions["run"].rows == ROWS


def test_no_more_than_a_piece_of_a_dataset_is_requested(tmp_path, monkeypatch, small_pieces):
    requested = []
    original = h5py.Dataset.__getitem__

    def spied(self, key, **options):
        result = original(self, key, **options)
        requested.append(np.size(result))
        return result

    path = mat_7_3(tmp_path / "run.mat")
    monkeypatch.setattr(h5py.Dataset, "__getitem__", spied)
    read_contents(path, Decimation(1000))
    assert 0 < max(requested) <= 2 * 900


def test_a_file_of_fewer_rows_is_read_as_a_whole(tmp_path):
    whole = read_contents(mat_7_3(tmp_path / "run.mat"), Decimation(ROWS))
    np.testing.assert_array_equal(whole.variables["run"]["force_N"], FORCE)
    assert whole.reductions["run"].step == 1


def test_lengths_that_the_reduction_would_hide_are_refused(tmp_path):
    with h5py.File(tmp_path / "run.h5", "w") as file:
        file["time_s"] = TIME[:10_000]
        file["force_N"] = FORCE[:9_999]
    with pytest.raises(ColumnError, match=r"different lengths \(9999, 10000 rows\)"):
        raw_hdf5.read_hdf5_tables(
            tmp_path / "run.h5", Selection(None, downsampling=Decimation(1000))
        )


@pytest.mark.parametrize("write", [mat_7_3, mat_5])
def test_a_damaged_large_file_is_an_error_and_no_crash(tmp_path, write):
    path = write(tmp_path / "run.mat")
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.raises(AirmuscleError, match=r"run\.mat"):
        read(path, downsampling=Decimation(1000))


MEASURE = """
import sys, resource, pathlib
from airmuscle.bench import Decimation
from airmuscle.bench.readers import Selection, read_mat_tables
path = pathlib.Path(sys.argv[1])
read_mat_tables(pathlib.Path(sys.argv[2]), Selection(downsampling=Decimation(1000)))
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
(table,) = read_mat_tables(path, Selection(downsampling=Decimation(10_000)))
print(len(table.rows), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
"""


@pytest.mark.slow
def test_the_memory_for_a_matlab_file_of_320_megabytes_is_that_of_a_piece(tmp_path):
    """In a process of its own, after a small file, so that the packages are loaded: resident memory
    grows by less than a quarter of the file."""
    small = mat_7_3(tmp_path / "small.mat")
    path = tmp_path / "large.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        for name in ("time_s", "force_N"):
            data = file.create_dataset(name, shape=(1, 20_000_000), dtype=float)
            data.attrs["MATLAB_class"] = np.bytes_("double")
            for first in range(0, 20_000_000, 1_000_000):
                data[0, first : first + 1_000_000] = np.arange(first, first + 1_000_000) * 1e-3
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(116) + bytes(8) + b"\x00\x02IM")
    done = subprocess.run(
        [sys.executable, "-c", MEASURE, path, small], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    rows, grown = map(int, done.stdout.split())
    assert rows == 10_000
    assert grown * 1024 < 0.25 * path.stat().st_size
