"""Exchange of recordings with other tools: pandas, xarray, Parquet, HDF5 and plain CSV keep every
number and unit.
"""

from __future__ import annotations

import inspect
import sys

import numpy as np
import pytest
from command_line import airmuscle

from airmuscle.bench import ColumnMapping, Decimation, from_pandas, read, read_csv, to_xarray, write
from airmuscle.bench.readers import read_rig
from airmuscle.bench.readers.formats import raw_csv
from airmuscle.errors import AirmuscleError, ColumnError, FileError, ParameterError
from airmuscle.recording import Recording

pd = pytest.importorskip("pandas", reason="needs the package pandas")
RUN = Recording(
    {
        "time": np.linspace(0.0, 0.2, 5),
        "pressure": np.array([0.0, 1e5, 2e5 / 3, 3e5, 4e5]),
        "contraction": np.linspace(0, 0.2, 5),
        "left.force": np.arange(5.0) / 7,
        "fill": np.array([0.0, 1, 1, 0, 0]),
    },
    "run",
    {"resting_length": 0.3, "specimen": "A"},
)


def check_equal(found, expected=RUN):
    assert list(found) == list(expected)
    for name in expected:
        assert (found[name] == expected[name]).all()


def test_a_data_frame_is_read_back_bit_by_bit():
    check_equal(from_pandas(RUN.to_pandas(), ColumnMapping(constants=RUN.constants)))
    check_equal(from_pandas(RUN.to_pandas().set_index("time [s]")))


def test_units_of_a_data_frame_are_converted():
    frame = pd.DataFrame({"time [ms]": [0, 10], "pressure [bar]": [1.0, 2.0], "force": [3.0, 4.0]})
    found = from_pandas(frame, ColumnMapping(units={"force": "kN"}))
    assert found["time"].tolist() == [0.0, 0.01]
    assert found["pressure"].tolist() == [1e5, 2e5]
    assert found["force"].tolist() == [3000.0, 4000.0]


@pytest.mark.parametrize(
    ("frame", "error", "message"),
    [
        ([1, 2], ParameterError, "list is not a pandas.DataFrame"),
        (pd.DataFrame({}), ParameterError, "no columns or no rows"),
        (pd.DataFrame({"pressure [bar]": []}), ParameterError, "no columns or no rows"),
        (pd.DataFrame({"pressure [mm]": [1.0]}), Exception, "another quantity|pressure"),
        (pd.DataFrame({"pressure [bar]": ["a", "b"]}), ColumnError, "pressure"),
    ],
)
def test_what_is_no_frame_of_measurements_is_refused(frame, error, message):
    with pytest.raises(error, match=message):
        from_pandas(frame)


def test_without_pandas_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(
        AirmuscleError, match=r"needs the package pandas. Install it: pip install .airmuscle\[lab\]"
    ):
        RUN.to_pandas()


@pytest.mark.tool
def test_xarray_has_units_and_constants():
    pytest.importorskip("xarray", reason="needs the package xarray")
    found = to_xarray(RUN)
    assert found["pressure"].attrs["units"] == "Pa"
    assert found.sizes == {"time": 5}
    assert (found["left.force"].values == RUN["left.force"]).all()
    assert found.attrs["resting_length"] == 0.3


def test_pandas_reads_plain_csv_as_it_is(tmp_path):
    frame = pd.read_csv(
        write(RUN, tmp_path / "run.csv", comments=False), float_precision="round_trip"
    )
    assert list(frame) == [
        "time [s]",
        "pressure [Pa]",
        "contraction [1]",
        "left.force [N]",
        "fill [1]",
    ]
    assert (frame["left.force [N]"].to_numpy() == RUN["left.force"]).all()
    check_equal(read_csv(tmp_path / "run.csv"))


@pytest.mark.parametrize("extension", [".csv", ".parquet", ".h5", ".hdf5"])
def test_a_written_file_is_read_back_bit_by_bit(extension, tmp_path):
    pytest.importorskip(
        {".parquet": "pyarrow", ".csv": "csv"}.get(extension, "h5py"), reason="needs the extra lab"
    )
    (found,) = read(write(RUN, tmp_path / f"run{extension}"))
    assert list(found) == list(RUN)
    for name in RUN:
        assert (found[name] == RUN[name]).all()
    assert found.constants["resting_length"] == 0.3


@pytest.mark.parametrize("extension", [".csv", ".parquet", ".h5"])
@pytest.mark.parametrize("specimen", ["007", "12", "nan", "A 3", 'he said "A"', '"A"', "1e5"])
def test_a_specimen_remains_a_text_also_where_it_looks_like_a_number(
    extension: str, specimen: str, tmp_path
):
    pytest.importorskip(
        {".parquet": "pyarrow", ".csv": "csv"}.get(extension, "h5py"), reason="needs the extra lab"
    )
    (found,) = read(write(RUN.with_constants(specimen=specimen), tmp_path / f"run{extension}"))
    assert found.constants["specimen"] == specimen


STAMPS = pd.to_datetime(
    ["2024-05-17 12:00:00.000000", "2024-05-17 12:00:00.000250", "2024-05-17 12:00:01.000000"]
)


@pytest.mark.parametrize("heading", ["time", "time [ms]"])
@pytest.mark.parametrize(
    "stamps", [STAMPS, STAMPS.tz_localize("Europe/Berlin"), STAMPS - STAMPS[0]]
)
def test_dates_and_durations_are_seconds_from_the_first_whatever_the_heading_states(
    heading, stamps, tmp_path
):
    frame = pd.DataFrame({heading: stamps, "pressure [bar]": [1.0, 2.0, 3.0]})
    assert from_pandas(frame)["time"].tolist() == [0.0, 0.00025, 1.0]
    assert from_pandas(frame.set_index(heading))["time"].tolist() == [0.0, 0.00025, 1.0]
    pytest.importorskip("pyarrow", reason="needs the extra lab")
    frame.to_parquet(tmp_path / "run.parquet")
    assert read(tmp_path / "run.parquet")[0]["time"].tolist() == [0.0, 0.00025, 1.0]


def test_each_named_level_of_an_index_is_a_column():
    index = pd.MultiIndex.from_product([[0.0, 0.1], ["a"]], names=["time [s]", "name"])
    assert from_pandas(pd.DataFrame({"pressure [bar]": [1.0, 2.0]}, index=index))[
        "time"
    ].tolist() == [0.0, 0.1]


def test_a_worksheet_of_clock_times_and_numbers_as_texts_is_a_table(tmp_path):
    pytest.importorskip("openpyxl", reason="needs the extra lab")
    cells = {"time": ["12:00:00", "12:00:00.5", "12:00:01"], "pressure [bar]": ["1,5", "2,5", "3"]}
    pd.DataFrame(cells).to_excel(tmp_path / "run.xlsx", index=False)
    (found,) = read(tmp_path / "run.xlsx")
    assert (found["time"].tolist(), found["pressure"].tolist()) == (
        [0.0, 0.5, 1.0],
        [1.5e5, 2.5e5, 3e5],
    )


def test_an_unknown_extension_and_an_unwritable_folder_are_named(tmp_path):
    with pytest.raises(
        FileError, match=r"cannot be written as '\.xyz'; allowed: \.csv, \.parquet, \.h5, \.hdf5"
    ):
        write(RUN, tmp_path / "run.xyz")
    for extension in (".csv", ".parquet", ".h5"):
        with pytest.raises(FileError, match="cannot be written"):
            write(RUN, tmp_path / "no folder" / f"run{extension}")
    assert list(tmp_path.iterdir()) == []


def test_the_command_converts_one_file_and_several(tmp_path):
    for k in range(2):
        write(RUN, tmp_path / f"run{k}.csv")
    done = airmuscle("convert", tmp_path / "run0.csv", tmp_path / "out.parquet")
    assert done.exit_code == 0, done.output
    assert "5 rows of time, pressure" in done.output
    done = airmuscle("convert", tmp_path / "run*.csv", tmp_path / "all.h5", "--json")
    assert done.exit_code == 0, done.output
    assert sorted(p.name for p in tmp_path.glob("all*")) == ["all_001.h5", "all_002.h5"]
    done = airmuscle("convert", tmp_path / "run0.csv", tmp_path / "plain.csv", "--plain")
    assert done.exit_code == 0, done.output
    assert (tmp_path / "plain.csv").read_text().startswith("time [s],")
    assert airmuscle("convert", tmp_path / "run0.csv", tmp_path / "a.h5", "--plain").exit_code == 2
    assert airmuscle("convert", tmp_path / "run0.csv", tmp_path / "a.xyz").exit_code == 1
    (tmp_path / "rounded.csv").write_text(
        "time [s],length [mm]\n" + "".join(f"{i // 2},{290 - i}\n" for i in range(9))
    )
    done = airmuscle("convert", tmp_path / "rounded.csv", tmp_path / "bare.csv")
    assert "For stamps that the logger rounded, use --time uniform." in done.stderr
    options = ("--time", "uniform", "--resting-length", "300 mm")
    done = airmuscle("convert", tmp_path / "rounded.csv", tmp_path / "bare.csv", *options)
    assert done.exit_code == 0, done.output
    (recording,) = read(tmp_path / "bare.csv")
    assert recording["time"][1] == 0.5
    assert recording["contraction"][0] == pytest.approx(1 / 30)
    before = (tmp_path / "run0.csv").read_bytes()
    done = airmuscle("convert", tmp_path / "run0.csv", tmp_path / "run0.csv")
    assert "run0.csv: is a file to be converted and would be lost" in done.stderr
    assert (tmp_path / "run0.csv").read_bytes() == before


# Rows


def reduce_from(rows: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let `read` and `airmuscle inspect` reduce files of more than `rows` rows by default."""
    function = inspect.unwrap(read)  # `read` checks the names of its arguments first
    monkeypatch.setitem(function.__kwdefaults__, "downsampling", Decimation(rows))
    defaults = tuple(
        Decimation(rows) if isinstance(default, Decimation) else default
        for default in read_rig.__defaults__
    )
    monkeypatch.setattr(read_rig, "__defaults__", defaults)


def test_convert_keeps_all_rows_unless_fewer_are_asked_for(tmp_path, monkeypatch):
    """A long file, which `read` reduces: with limits that are a thousandth of the usual ones."""
    monkeypatch.setattr(raw_csv, "LARGE_FILE_BYTES", 20_000)
    reduce_from(2000, monkeypatch)
    path = tmp_path / "long.csv"
    rows = "\n".join(f"{k / 1000},{k % 700}" for k in range(6500))
    path.write_text(f"time [s],pressure [kPa]\n{rows}\n")
    assert len(read(path)[0]) == 1625
    done = airmuscle("convert", path, tmp_path / "all.csv")
    assert done.exit_code == 0, done.output
    assert len(read_csv(tmp_path / "all.csv")) == 6500
    done = airmuscle("convert", path, tmp_path / "few.csv", "--max-rows", 1000)
    assert "note: The file has 6500 rows; one in 7 is kept as measured, 929 in total" in " ".join(
        done.output.split()
    )
    assert len(read_csv(tmp_path / "few.csv")) == 929


def test_the_other_commands_say_that_rows_are_left_out(tmp_path, monkeypatch):
    reduce_from(20, monkeypatch)
    path = tmp_path / "long.csv"
    path.write_text(
        "time [s],pressure [kPa]\n" + "\n".join(f"{k / 1000},{k % 70}" for k in range(100))
    )
    assert "The file has 100 rows; one in 5 is kept" in " ".join(
        airmuscle("inspect", path).output.split()
    )
