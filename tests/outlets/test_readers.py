"""Readers of laboratory files: the same run gives the same Recording in every file format.

A mapping states what a file does not. A file that cannot be read, or that contradicts another file,
is rejected with its name. Very long files are downsampled in bounded memory, with a note.
"""

from __future__ import annotations

import contextlib
import inspect
import os
import re
import sys
import tracemalloc
import warnings
from pathlib import Path

import numpy as np
import pytest

import airmuscle as am
from airmuscle.bench import BlockMeans, ColumnMapping, Decimation, RecordedTime, read
from airmuscle.bench.diagnosis import check_bench
from airmuscle.bench.readers import (
    Selection,
    call_in_separate_process,
    mapping_of_tables,
    read_mapping,
    read_mat_tables,
    seconds_from_clock,
)
from airmuscle.bench.readers.formats import raw_csv
from airmuscle.bench.readers.tables import separate_process
from airmuscle.errors import (
    AirmuscleWarning,
    ColumnError,
    FileError,
    InputError,
    ParameterError,
    UnitError,
)
from airmuscle.recording import Recording

TIME = np.arange(40) * 0.05
PRESSURE = 100.0 + 5.0 * np.arange(40.0)  # kPa
LENGTH = 300.0 - 0.5 * np.arange(40.0)  # mm
FORCE = 12.5 * np.sqrt(np.arange(40.0))  # N
TABLE = np.column_stack([TIME, PRESSURE, LENGTH, FORCE])
HEADINGS = ("time [s]", "pressure [kPa]", "length [mm]", "force [N]")


def same(recording: Recording, extra: tuple[str, ...] = ()) -> None:
    assert set(recording) == {"time", "pressure", "length", "force", *extra}
    for name, values in {
        "time": TIME,
        "pressure": PRESSURE * 1e3,
        "length": LENGTH / 1e3,
        "force": FORCE,
    }.items():
        assert recording[name] == pytest.approx(values, rel=1e-12, abs=1e-12), name


def only(recordings: tuple[Recording, ...]) -> Recording:
    assert len(recordings) == 1
    return recordings[0]


def refusal(kind: type[InputError], source, **options) -> str:
    with pytest.raises(kind) as caught:
        read(source, ColumnMapping(**options))
    return str(caught.value)


def csv(path: Path, headings: tuple[str, ...] = HEADINGS, table: np.ndarray = TABLE) -> Path:
    np.savetxt(path, table, delimiter=",", header=",".join(headings), comments="", fmt="%.15g")
    return path


# Formats


def excel(path: Path, sheets: dict[str, list[list[object]]]) -> Path:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.remove(book.active)
    for name, rows in sheets.items():
        sheet = book.create_sheet(name)
        for row in rows:
            sheet.append(row)
    book.save(path)
    return path


def test_excel_with_units_in_the_headings(tmp_path: Path):
    path = excel(tmp_path / "run.xlsx", {"Data": [list(HEADINGS), *TABLE.tolist()]})
    same(only(read(path)))


def test_excel_with_a_preamble_a_unit_row_and_a_sheet_of_texts(tmp_path: Path):
    rows = [
        ["Rig 3, calibrated"],
        ["resting_length", 310, "mm"],
        [],
        ["time", "pressure", "length", "force"],
        ["s", "kPa", "mm", "N"],
        *TABLE.tolist(),
    ]
    path = excel(tmp_path / "run.xlsx", {"Notes": [["by Ada"], ["on Monday"]], "Data": rows})
    recording = only(read(path))
    same(recording)
    assert recording.constants == {"resting_length": pytest.approx(0.31)}
    assert recording.origin == "run.xlsx"


@pytest.mark.parametrize("sign", [".", ","])
def test_numbers_that_a_worksheet_stores_as_texts_are_read(tmp_path: Path, sign: str):
    """As spreadsheets of another language store them; a sheet of them was left out in silence."""
    texts = [[str(value).replace(".", sign) for value in row] for row in TABLE.tolist()]
    same(only(read(excel(tmp_path / "run.xlsx", {"Data": [list(HEADINGS), *texts]}))))
    texts[3][1] = "1.234,5"
    said = refusal(ColumnError, excel(tmp_path / "run.xlsx", {"Data": [list(HEADINGS), *texts]}))
    assert "run.xlsx, row 5: " in said
    assert "is not a number" in said


def test_every_sheet_with_a_table_is_a_run_and_one_can_be_selected(tmp_path: Path):
    rows = [list(HEADINGS), *TABLE.tolist()]
    path = excel(tmp_path / "runs.xlsx", {"First": rows, "Second": [rows[0], *rows[3:]]})
    first, second = read(path)
    assert (first.origin, len(second)) == ("runs.xlsx, sheet 'First'", 38)
    assert len(only(read(path, ColumnMapping(sheet="Second")))) == 38
    assert "no sheet 'Secnd'; the sheets are First, Second. Did you mean 'Second'?" in refusal(
        FileError, path, sheet="Secnd"
    )


def test_excel_names_the_row_of_a_bad_cell(tmp_path: Path):
    rows = [list(HEADINGS), *TABLE.tolist()]
    rows[5][3] = "n/a"
    said = refusal(ColumnError, excel(tmp_path / "run.xlsx", {"Data": rows}))
    assert said.startswith("run.xlsx, row 6: force 'n/a' is not a number")
    rows[5][3] = 1.0
    rows[7] = [*rows[7], 99.0]
    said = refusal(ColumnError, excel(tmp_path / "run.xlsx", {"Data": rows}))
    assert "run.xlsx, row 8: the cell '99' has no heading" in said


def mat_content() -> dict[str, object]:
    return {
        "t": TIME,
        "pressure_kPa": PRESSURE[:, None],
        "length_mm": LENGTH,
        "force_N": FORCE,
        "rest_length_mm": 310.0,
    }


def save_v5(path: Path, content: dict[str, object]) -> Path:
    import scipy.io

    scipy.io.savemat(path, content)
    return path


def save_v73(path: Path, content: dict[str, object]) -> Path:
    """A MATLAB 7.3 file: HDF5 with the class of each variable as an attribute."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in content.items():
            file[name] = np.atleast_2d(np.asarray(value, dtype=float))
            file[name].attrs["MATLAB_class"] = np.bytes_("double")
    head = b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM"
    with path.open("r+b") as file:
        file.write(head)
    return path


@pytest.mark.parametrize("missing", ["pressure", "length", "force"])
@pytest.mark.parametrize("rows", [slice(None), slice(3, 9)])
def test_what_is_missing_in_a_recording_is_no_suspicious_value(missing: str, rows: slice):
    columns = {
        "time": TIME,
        "pressure": 1e3 * PRESSURE,
        "length": 1e-3 * LENGTH,
        "force": 1.0 * FORCE,
    }
    good = Recording(columns, "good")
    gaps = columns[missing].copy()
    gaps[rows] = np.nan
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_bench([good])
        check_bench([good, Recording(columns | {missing: gaps}, "gaps")])


def test_a_code_next_to_missing_values_is_named():
    force = 1.0 * FORCE
    force[3:9] = np.nan
    force[10] = 1e30
    with pytest.warns(AirmuscleWarning, match=r"gaps: the force is 1e\+30 in 1 row"):
        check_bench([Recording({"pressure": 1e3 * PRESSURE, "force": force}, "gaps")])


@pytest.mark.parametrize("save", [save_v5, save_v73])
def test_matlab_vectors(tmp_path: Path, save):
    recording = only(
        read(save(tmp_path / "run.mat", mat_content()), ColumnMapping(units={"time": "s"}))
    )
    same(recording)
    assert recording.constants["resting_length"] == pytest.approx(0.31)


def test_matlab_structs_matrices_and_simulink(tmp_path: Path):
    struct = {"run1": mat_content() | {"units": {"t": "s"}}, "run2": {"force_N": FORCE[:9]}}
    first, second = read(save_v5(tmp_path / "two.mat", struct))
    same(first)
    assert (first.origin, second.origin) == ("two.mat, run1", "two.mat, run2")
    assert len(only(read(tmp_path / "two.mat", ColumnMapping(group="run2")))) == 9
    assert [len(t.rows) for t in read_mat_tables(tmp_path / "two.mat", Selection("run2"))] == [9]
    said = refusal(FileError, tmp_path / "two.mat", group="run3")
    assert "no struct 'run3'; the structs are run1, run2" in said

    named = {"data": TABLE, "colheaders": np.array(HEADINGS, dtype=object)}
    same(only(read(save_v5(tmp_path / "import.mat", named))))
    bare = {f"data(:,{j})": heading for j, heading in enumerate(HEADINGS, 1)}
    same(only(read(save_v5(tmp_path / "bare.mat", {"data": TABLE}), ColumnMapping(columns=bare))))

    signals = [{"values": TABLE[:, j], "label": HEADINGS[j]} for j in (1, 2, 3)]
    simulink = {"out": {"time": TIME, "signals": np.array(signals, dtype=object)}}
    same(only(read(save_v5(tmp_path / "sim.mat", simulink))))


def as_struct_array(runs: list[dict[str, np.ndarray]]) -> object:
    array = np.zeros((1, len(runs)), dtype=[(name, object) for name in runs[0]])
    for i, run in enumerate(runs):
        array[0, i] = tuple(run.values())
    return array


def as_cell(values: list) -> np.ndarray:
    cell = np.empty((1, len(values)), dtype=object)
    cell[0, :] = values
    return cell


@pytest.mark.parametrize(
    "written",
    [
        as_struct_array,
        as_cell,
        lambda runs: {key: as_cell([run[key] for run in runs]) for key in runs[0]},
    ],
    ids=["struct array", "cell array of structs", "struct of cell arrays"],
)
def test_each_struct_of_an_array_of_matlab_is_a_run(tmp_path: Path, written):
    runs = [
        {
            "time_s": TIME[:n],
            "pressure_kPa": PRESSURE[:n],
            "length_mm": LENGTH[:n],
            "force_N": FORCE[:n],
        }
        for n in (TIME.size, 9)
    ]
    first, second = read(save_v5(tmp_path / "bench.mat", {"runs": written(runs), "L0_mm": 310.0}))
    same(first)
    assert (first.origin, second.origin, len(second)) == (
        "bench.mat, runs(1)",
        "bench.mat, runs(2)",
        9,
    )
    assert second.constants["resting_length"] == pytest.approx(0.31)
    assert len(only(read(tmp_path / "bench.mat", ColumnMapping(group="runs(2)")))) == 9


def test_the_struct_array_of_a_file_of_version_7_3_is_a_run_each(tmp_path: Path):
    h5py = pytest.importorskip("h5py")
    path = save_v73(tmp_path / "bench.mat", {"L0_mm": 310.0})
    with h5py.File(path, "r+") as file:
        for name, values in {
            "time_s": TIME,
            "pressure_kPa": PRESSURE,
            "length_mm": LENGTH,
            "force_N": FORCE,
        }.items():
            for n in (TIME.size, 9):
                file[f"#refs#/{name}{n}"] = values[:n].reshape(1, -1)
                file[f"#refs#/{name}{n}"].attrs["MATLAB_class"] = np.bytes_("double")
            places = [[file[f"#refs#/{name}{n}"].ref] for n in (TIME.size, 9)]
            file.create_dataset(f"runs/{name}", data=np.array(places, dtype=h5py.ref_dtype))
        file["runs"].attrs["MATLAB_class"] = np.bytes_("struct")
    first, second = read(path)
    same(first)
    assert (first.origin, second.origin, len(second)) == (
        "bench.mat, runs(1)",
        "bench.mat, runs(2)",
        9,
    )


def test_a_file_of_version_7_3_that_another_program_wrote_is_read(tmp_path: Path):
    """Classes as texts, a stored type and an array without values, none of which MATLAB writes, do
    not stop a reader.
    """
    h5py = pytest.importorskip("h5py")
    path = save_v73(tmp_path / "run.mat", mat_content())
    with h5py.File(path, "r+") as file:
        for item in file.values():
            item.attrs["MATLAB_class"] = "double"
        file["kind"] = np.dtype("f8")
        file["none"] = np.zeros((0, TIME.size))
        file["none"].attrs["MATLAB_class"] = "double"
    (recording,) = read(
        path, ColumnMapping(units={"time": "s"}), downsampling=Decimation(TIME.size - 1)
    )
    assert len(recording) == -(-TIME.size // 2)
    assert recording.constants["resting_length"] == pytest.approx(0.31)
    assert "Not read: kind, which contains no real numbers." in recording.notes


@pytest.mark.parametrize("shape", [(1, -1), (-1, 1)])
def test_a_vector_that_matlab_writes_to_hdf5_has_one_row(tmp_path: Path, shape):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "bench.h5", "w") as file:
        for name, values in {
            "time_s": TIME,
            "pressure_kPa": PRESSURE,
            "length_mm": LENGTH,
            "force_N": FORCE,
        }.items():
            file[name] = values.reshape(shape)
        file.attrs["L0_mm"] = 310.0
    same(only(read(tmp_path / "bench.h5")))
    few = only(read(tmp_path / "bench.h5", downsampling=Decimation(max_rows=5)))
    assert few["force"].tolist() == FORCE[:: -(-TIME.size // 5)].tolist()


def test_the_function_workspace_of_a_matlab_file_is_no_column(tmp_path: Path):
    """MATLAB saves it as a matrix of bytes beside the variables of a file that contains an
    object.
    """
    path = tmp_path / "bench.mat"
    scipy = pytest.importorskip("scipy.io")
    scipy.savemat(
        path,
        {
            "time_s": np.linspace(0.0, 1.0, 5),
            "x_function_workspace__": np.ones((1, 11488), np.uint8),
        },
    )
    path.write_bytes(
        path.read_bytes().replace(b"x_function_workspace__", b"__function_workspace__")
    )
    (recording,) = read(path)
    assert list(recording) == ["time"]
    assert len(recording) == 5


def test_matlab_without_a_vector(tmp_path: Path):
    said = refusal(FileError, save_v5(tmp_path / "run.mat", {"name": "x", "n": 3.0}))
    assert "run.mat: no vector of numbers (the file contains name, n)" in said


def test_tdms_waveforms(tmp_path: Path):
    nptdms = pytest.importorskip("nptdms")
    names = {"Pressure": ("kPa", PRESSURE), "length": ("mm", LENGTH), "F": ("N", FORCE)}
    wave = {"wf_increment": 0.05, "wf_start_offset": 0.0}
    channels = [
        nptdms.ChannelObject(group, name, values, {"unit_string": unit, **wave})
        for group in ("one", "two")
        for name, (unit, values) in names.items()
    ]
    root = nptdms.RootObject({"resting_length": "310 mm", "name": "log"})
    with nptdms.TdmsWriter(tmp_path / "run.tdms") as file:
        file.write_segment([root, *channels])
    one, two = read(tmp_path / "run.tdms")
    same(one)
    same(two)
    assert one.origin == "run.tdms, group 'one'"
    assert one.constants["resting_length"] == pytest.approx(0.31)
    same(only(read(tmp_path / "run.tdms", ColumnMapping(group="two"))))
    assert "no group 'tow'; the groups are one, two. Did you mean 'two'?" in refusal(
        FileError, tmp_path / "run.tdms", group="tow"
    )


def test_tdms_channels_without_a_common_time(tmp_path: Path):
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(tmp_path / "run.tdms") as file:
        parts = {"p [kPa]": PRESSURE, "F [N]": FORCE[:7]}
        file.write_segment(
            [nptdms.ChannelObject("g", name, values) for name, values in parts.items()]
        )
    said = refusal(ColumnError, tmp_path / "run.tdms")
    assert (
        "run.tdms: the channels have different rows (p [kPa] 40, F [N] 7), and no time is stated"
        " for p [kPa]." in said
    )


def test_tdms_channels_with_different_start_times_share_their_common_time(tmp_path: Path):
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(tmp_path / "run.tdms") as file:
        early = nptdms.ChannelObject(
            "g", "p [kPa]", PRESSURE, {"wf_increment": 0.05, "wf_start_offset": 0.0}
        )
        late = nptdms.ChannelObject(
            "g", "L [mm]", LENGTH[4:], {"wf_increment": 0.05, "wf_start_offset": 0.2}
        )
        file.write_segment([early, late])
    recording = only(read(tmp_path / "run.tdms"))
    assert recording["time"] == pytest.approx(TIME[:36])
    assert recording["pressure"] == pytest.approx(PRESSURE[4:] * 1e3)
    assert recording["length"] == pytest.approx(LENGTH[4:] / 1e3)


def test_mdf_groups_with_different_time_vectors_are_resampled_to_common_rows(tmp_path: Path):
    asammdf = pytest.importorskip("asammdf")
    slow = slice(None, None, 3)
    with asammdf.MDF(version="4.10") as file:
        fast = {"pressure": ("kPa", PRESSURE), "F": ("N", FORCE)}
        file.append(
            [
                asammdf.Signal(values, TIME, name=name, unit=unit)
                for name, (unit, values) in fast.items()
            ],
            acq_name="fast",
        )
        valve = (np.arange(40) > 20).astype(np.uint8)
        others = [
            asammdf.Signal(LENGTH[slow], TIME[slow], name="L", unit="mm"),
            asammdf.Signal(valve[slow], TIME[slow], name="valve"),
        ]
        file.append(others, acq_name="slow")
        file.save(tmp_path / "run.mf4")
    recording = only(read(tmp_path / "run.mf4"))
    same(recording, ("valve",))
    expected = valve[3 * (np.arange(40) // 3)]
    assert np.array_equal(recording["valve"], expected), "integers are resampled by zero-order hold"
    assert (
        "Channel 'L' has its own time vector: its 14 rows are interpolated to the 40 rows of"
        " 'pressure'." in recording.notes
    )
    assert len(only(read(tmp_path / "run.mf4", ColumnMapping(group="slow")))) == 14
    assert "no group 'fats'; the groups are fast, slow" in refusal(
        FileError, tmp_path / "run.mf4", group="fats"
    )


@pytest.mark.parametrize("ending", [".xlsx", ".mat", ".tdms", ".mf4"])
def test_a_damaged_file_is_one_error_that_names_it(tmp_path: Path, ending: str):
    path = tmp_path / f"broken{ending}"
    path.write_bytes(b"this is no measurement at all" * 50)
    assert f"broken{ending}: cannot be read as" in refusal(FileError, path)
    assert "No such file or directory" in refusal(FileError, tmp_path / f"none{ending}")


@pytest.mark.parametrize(
    ("ending", "package"),
    [(".xlsx", "python_calamine"), (".h5", "h5py"), (".tdms", "nptdms"), (".mf4", "asammdf")],
)
def test_a_missing_package_is_an_error_with_the_install_command(
    tmp_path: Path, monkeypatch, ending: str, package: str
):
    monkeypatch.setitem(sys.modules, package, None)
    said = refusal(FileError, tmp_path / f"run{ending}")
    assert said.endswith(f'needs the package {package}. Install it: pip install "airmuscle[lab]"')
    assert "\n" not in said


def test_an_unknown_format(tmp_path: Path):
    (tmp_path / "run.bin").write_bytes(b"\0\1\2")
    assert "run.bin: the file is a binary file, not a table of text. Export" in refusal(
        FileError, tmp_path / "run.bin"
    )


# Several files


def test_folders_globs_and_lists_are_read_in_order(tmp_path: Path):
    for name in ("b.csv", "a.csv", ".hidden.csv"):
        csv(tmp_path / name)
    (tmp_path / "readme.md").write_text("not data")
    assert [r.origin for r in read(tmp_path)] == ["a.csv", "b.csv"]
    assert [r.origin for r in read(str(tmp_path / "*.csv"))] == ["a.csv", "b.csv"]
    assert [r.origin for r in read([tmp_path / "b.csv", tmp_path / "a.csv"])] == ["b.csv", "a.csv"]
    assert "no file matches the pattern" in refusal(FileError, str(tmp_path / "*.txt"))
    (tmp_path / "empty").mkdir()
    assert "contains no supported file" in refusal(FileError, tmp_path / "empty")


def test_two_files_with_similar_numbers_under_different_units_are_rejected(tmp_path: Path):
    csv(tmp_path / "a.csv")
    csv(tmp_path / "b.csv", ("time [s]", "pressure [bar]", "length [mm]", "force [N]"))
    said = refusal(UnitError, tmp_path)
    assert said.startswith(
        "a.csv states the pressure in kPa and b.csv in bar, but the numbers have the same magnitude"
    )
    assert "units={'pressure': ...}" in said
    csv(
        tmp_path / "b.csv",
        ("time [s]", "pressure [bar]", "length [mm]", "force [N]"),
        TABLE * [1, 0.01, 1, 1],
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert read(tmp_path)[1]["pressure"] == pytest.approx(PRESSURE * 1e3)


def test_gauge_stated_in_only_one_file_is_a_warning_that_names_both(tmp_path: Path):
    csv(tmp_path / "a.csv")
    csv(tmp_path / "b.csv", ("time [s]", "pressure [kPa(a)]", "length [mm]", "force [N]"))
    with pytest.warns(
        AirmuscleWarning,
        match=r"a\.csv .* and b\.csv .* only one states whether its pressure is gauge",
    ):
        read(tmp_path)


def test_very_different_magnitudes_in_one_unit_are_a_warning(tmp_path: Path):
    csv(tmp_path / "a.csv")
    csv(tmp_path / "b.csv", table=TABLE * [1, 0.01, 1, 1])
    with pytest.warns(
        AirmuscleWarning, match=r"pressure of b\.csv .* and a\.csv .* differs by a factor of 100"
    ):
        read(tmp_path)


# Column mapping


def test_a_mapping_file_names_columns_units_and_constants(tmp_path: Path):
    (tmp_path / "rig.toml").write_text(
        'resting_length = "300 mm"\ndecimal = ","\ndelimiter = ";"\nambient = "100'
        ' kPa"\n[columns]\n"Channel 1" = "time [s]"\n"Channel 2" = { quantity = "pressure", unit ='
        ' "kPa(a)" }\n"Channel 3" = "length [mm]"\n4 = "force [kg]"\nspare = ""\n'
    )
    body = "".join(f"{';'.join(f'{v:.17g}' for v in row)};7\n" for row in TABLE).replace(".", ",")
    (tmp_path / "run.csv").write_text("Channel 1;Channel 2;Channel 3;Channel 4;spare\n" + body)
    recording = only(read(tmp_path / "run.csv", mapping=tmp_path / "rig.toml"))
    assert list(recording) == ["time", "pressure", "length", "force"]
    assert recording["pressure"] == pytest.approx(PRESSURE * 1e3 - 100e3)
    assert recording["force"] == pytest.approx(FORCE * 9.80665)
    assert recording["contraction"] == pytest.approx(1.0 - LENGTH / 300.0)
    assert recording.units["force"] == "kg"
    said = " ".join(recording.notes)
    assert "Column 'Channel 2' is read as pressure [kPa(a)], according to the mapping." in said
    assert "converted with standard gravity, 9.80665 m/s2" in said
    assert "Column 'spare' is ignored, according to the mapping." in said


def test_an_option_overrides_the_mapping_file(tmp_path: Path):
    stated = ColumnMapping(columns={"F": "force [N]"}, constants={"resting_length": "300 mm"})
    mapping = mapping_of_tables(
        {"columns": {"F": "force [kN]"}, "resting_length": 0.4}, "options", stated
    )
    (tmp_path / "run.csv").write_text("F,L [mm]\n1,290\n2,280\n")
    recording = only(read(tmp_path / "run.csv", mapping))
    assert recording["force"] == pytest.approx([1e3, 2e3])
    assert recording.constants["resting_length"] == 0.4


def test_a_mapping_overrides_the_unit_row(tmp_path: Path):
    (tmp_path / "run.csv").write_text("p,F\nbar,N\n1,2\n3,4\n")
    recording = only(
        read(tmp_path / "run.csv", ColumnMapping(columns={"p": "pressure [kPa(g)]", "F": "force"}))
    )
    assert recording["pressure"] == pytest.approx([1e3, 3e3])
    assert recording["force"] == pytest.approx([2.0, 4.0])
    assert recording.units == {"pressure": "kPa(g)", "force": "N"}


def test_a_table_without_headings_is_mapped_by_numbers(tmp_path: Path):
    np.savetxt(tmp_path / "run.txt", TABLE, delimiter="\t")
    assert (
        "To map columns by their numbers, use columns={1: 'pressure [kPa]', 2: 'force [N]'} of"
        " ColumnMapping." in refusal(ColumnError, tmp_path / "run.txt")
    )
    same(only(read(tmp_path / "run.txt", ColumnMapping(columns=dict(enumerate(HEADINGS, 1))))))
    np.savetxt(tmp_path / "blanks.txt", TABLE)
    same(
        only(
            read(
                tmp_path / "blanks.txt",
                ColumnMapping(columns=dict(enumerate(HEADINGS, 1)), delimiter=" "),
            )
        )
    )
    same(only(read(tmp_path / "blanks.txt", ColumnMapping(columns=dict(enumerate(HEADINGS, 1))))))


def test_a_given_decimal_sign_resolves_thousands_separators(tmp_path: Path):
    (tmp_path / "run.csv").write_text("force [N];length [mm]\n1.234,5;290,5\n2.000;280\n")
    for mapping in (ColumnMapping(), ColumnMapping(decimal=",")):  # 1.234,5 shows it
        force = only(read(tmp_path / "run.csv", mapping))["force"]
        assert force == pytest.approx([1234.5, 2000.0])
    (tmp_path / "run.csv").write_text("force [N];length [mm]\n1.234,5;2.905\n2.000;2.800\n")
    assert "decimal=',' of ColumnMapping" in refusal(ColumnError, tmp_path / "run.csv")


def test_points_separate_thousands_next_to_a_given_decimal_comma_also_where_no_comma_occurs(
    tmp_path: Path,
):
    (tmp_path / "run.csv").write_text("force [N];length [mm]\n1.234;290\n2.000;280\n")
    assert only(read(tmp_path / "run.csv", ColumnMapping(decimal=",")))["force"] == pytest.approx(
        [1234.0, 2000.0]
    )


@pytest.mark.parametrize(
    ("decimal", "cells"), [(",", "0.5;1,5"), (".", "0,5;1.5"), (",", "12.5;280"), (".", "0,500;2")]
)
def test_a_sign_that_cannot_separate_thousands_contradicts_the_given_decimal_sign(
    tmp_path: Path, decimal, cells
):
    (tmp_path / "run.csv").write_text(f"force [N];length [mm]\n{cells}\n")
    said = refusal(ColumnError, tmp_path / "run.csv", decimal=decimal)
    assert (
        f"line 2: '{cells.partition(';')[0]}' contradicts the decimal sign '{decimal}', which is"
        " stated" in said
    )


def test_commas_in_quoted_cells_are_ambiguous_next_to_a_decimal_point(tmp_path: Path):
    (tmp_path / "run.csv").write_text('time [s],force [N]\n0.5,"1,234"\n1.5,"2,345"\n')
    assert "the comma in '1,234' is ambiguous" in refusal(ColumnError, tmp_path / "run.csv")
    forces = only(read(tmp_path / "run.csv", ColumnMapping(decimal=".")))["force"]
    assert forces == pytest.approx([1234.0, 2345.0])


@pytest.mark.parametrize(
    ("columns", "kind", "expected"),
    [
        (
            {"presure": "pressure [bar]"},
            ColumnError,
            "the mapping names column 'presure', but the columns are time [s]",
        ),
        ({"presure": "pressure [bar]"}, ColumnError, "Did you mean 'pressure [kPa]'?"),
        ({9: "pressure [bar]"}, ColumnError, "the mapping names column '9'"),
        (
            {"pressure": "presure [bar]"},
            ColumnError,
            "is not a known quantity; known quantities are time, pressure",
        ),
        ({"pressure": "presure [bar]"}, ColumnError, "Did you mean 'pressure'?"),
        ({"pressure": "pressure [mm]"}, UnitError, "unit 'mm' cannot be converted to 'Pa'"),
    ],
)
def test_a_mapping_that_does_not_match_the_file_is_an_error(
    tmp_path: Path, columns, kind, expected: str
):
    assert expected in refusal(kind, csv(tmp_path / "run.csv"), columns=columns)


@pytest.mark.parametrize(
    ("content", "kind", "expected"),
    [
        ("colums = 3", ParameterError, "unknown key 'colums'; allowed are columns"),
        ("[columns]\np = 3", ParameterError, "column 'p' is mapped to 3; write 'pressure [bara]'"),
        ("columns = 3", ParameterError, "columns must be a table"),
        ("sheet = 3", ParameterError, "sheet = 3; it must be a quoted text"),
        ("x = ", FileError, "rig.toml: is not valid TOML"),
        ('delimiter = ","\ndecimal = ","', ParameterError, "are both ','"),
        ('decimal = "x"', ParameterError, "it must be '.' or ','"),
        ('delimiter = "x"', ParameterError, "it must be a comma, semicolon, tab, blank"),
        (
            'ambient = "Rodas4"',
            UnitError,
            "rig.toml: ambient: 'Rodas4' is not a number with a unit",
        ),
        (
            "resting_length = 300",
            ColumnError,
            "rig.toml: resting_length is 300 m; allowed range: 0.001 to 20 m",
        ),
        ('[constants]\nlength = "7 furlong bar"', UnitError, "rig.toml: length: "),
    ],
)
def test_an_invalid_mapping_file(tmp_path: Path, content: str, kind, expected: str):
    (tmp_path / "rig.toml").write_text(content)
    with pytest.raises(kind, match=re.escape(expected)):
        _ = read_mapping(tmp_path / "rig.toml").text_format
    with pytest.raises(FileError, match="cannot be read"):
        read_mapping(tmp_path / "none.toml")


def test_the_force_in_the_name_of_a_file_may_be_a_load_in_grams(tmp_path: Path):
    path = csv(tmp_path / "load_200g.csv", HEADINGS[:3], TABLE[:, :3])
    recording = only(read(path, ColumnMapping(file_name="load_{force [g]}g")))
    assert recording["force"] == pytest.approx(0.2 * 9.80665)


def test_a_constant_column_states_the_resting_length(tmp_path: Path):
    path = csv(
        tmp_path / "a.csv",
        (*HEADINGS, "rest_length [cm]"),
        np.column_stack([TABLE, np.full(40, 31.0)]),
    )
    recording = only(read(path))
    same(recording)
    assert recording.constants["resting_length"] == pytest.approx(0.31)
    assert only(read(path, ColumnMapping(resting_length="32 cm"))).constants[
        "resting_length"
    ] == pytest.approx(0.32)
    csv(
        path,
        (*HEADINGS, "rest_length [cm]"),
        np.column_stack([TABLE, np.where(TIME < 1, 31.0, 32.0)]),
    )
    assert "a.csv, line 22: rest_length [cm] changes from 31 to 32" in refusal(ColumnError, path)


def test_waveforms_of_tdms_that_start_at_different_times_are_aligned(tmp_path: Path):
    nptdms = pytest.importorskip("nptdms")
    begin = np.datetime64("2024-05-17T12:00:00.000000")
    late = np.timedelta64(250, "ms")
    rows = 0.05 * np.arange(40)
    with nptdms.TdmsWriter(tmp_path / "run.tdms") as file:
        file.write_segment(
            [
                nptdms.ChannelObject(
                    "g",
                    "pressure [bar]",
                    1.0 + rows,
                    {"wf_increment": 0.05, "wf_start_time": begin},
                ),
                nptdms.ChannelObject(
                    "g",
                    "force [N]",
                    10.0 * (rows + 0.25),
                    {"wf_increment": 0.05, "wf_start_time": begin + late},
                ),
            ]
        )
    recording = only(read(tmp_path / "run.tdms"))
    assert len(recording) == 35
    assert recording["force"] == pytest.approx(10.0 * (recording["pressure"] / 1e5 - 1.0))


@pytest.mark.parametrize(
    "cells",
    [
        ["2024-05-17 23:59:59.5", "2024-05-18 00:00:00", "2024-05-18T00:00:01"],
        ["17.05.2024 23:59:59,5", "18.05.2024 00:00:00", "18.05.2024 00:00:01"],
        ["23:59:59.5", "0:00:00", "00:00:01"],
    ],
)
def test_the_time_column_may_contain_clock_times(tmp_path: Path, cells: list[str]):
    assert seconds_from_clock(cells) == pytest.approx([0.0, 0.5, 1.5])
    rows = "".join(f"{cell};{i}\n" for i, cell in enumerate(cells))
    (tmp_path / "run.csv").write_text("time;force [N]\n" + rows)
    recording = only(read(tmp_path / "run.csv"))
    assert recording["time"] == pytest.approx([0.0, 0.5, 1.5])
    assert "contains clock times; time is counted from the first" in recording.notes[0]


def test_a_change_to_summer_time_is_no_gap_where_the_offset_from_utc_is_stated():
    cells = [
        "2024-03-31T01:59:59.5+01:00",
        "2024-03-31T03:00:00+02:00",
        "2024-03-31T03:00:01+02:00",
    ]
    assert seconds_from_clock(cells) == pytest.approx([0.0, 0.5, 1.5])


def test_dates_that_decrease_do_not_pass_midnight():
    cells = ["2024-05-17 20:00:00", "2024-05-17 20:00:01", "2024-05-17 06:00:00"]
    assert seconds_from_clock(cells) == pytest.approx([0.0, 1.0, -14 * 3600.0])


def test_clock_times_with_dates_are_exact_to_the_last_bit():
    cells = [f"2024-05-17T12:00:03.{i:06}" for i in range(0, 5000, 100)]
    assert np.asarray(seconds_from_clock(cells)).tolist() == [i / 1e4 for i in range(50)]


def test_other_texts_are_not_clock_times():
    assert seconds_from_clock(["12:00:00", "n/a"]) is None
    assert seconds_from_clock([]) is None


def test_time_out_of_order_is_rejected_unless_ordered_is_false(tmp_path: Path):
    path = csv(tmp_path / "run.csv", table=TABLE[[0, 2, 1, 3]])
    assert "is less than the time of the previous row" in refusal(ColumnError, path)
    assert only(read(path, ColumnMapping(time=RecordedTime(ordered=False))))[
        "time"
    ] == pytest.approx(TIME[[0, 2, 1, 3]])


# Very long files


@pytest.fixture
def long_file(tmp_path: Path, monkeypatch) -> Path:
    """20 000 rows, read in chunks of 1000 like a file that does not fit into memory."""
    monkeypatch.setattr(raw_csv, "LARGE_FILE_BYTES", 10_000)
    monkeypatch.setattr(raw_csv, "_CHUNK_ROWS", 1000)
    rows = "".join(f"{i};{0.5 * i:.1f}\n" for i in range(20_000)).replace(".", ",")
    path = tmp_path / "long.csv"
    path.write_text(f"# resting_length = 300 mm\ntime;force\ns;N\n{rows}")
    return path


def test_reading_in_chunks_gives_the_same_recording(long_file: Path, monkeypatch):
    parts = only(read(long_file))
    monkeypatch.setattr(raw_csv, "LARGE_FILE_BYTES", 1_000_000_000)
    whole = only(read(long_file))
    assert all(np.array_equal(parts[name], whole[name]) for name in whole)
    assert (parts.constants, parts.notes) == (whole.constants, whole.notes)


@pytest.mark.parametrize("most", [20_000, 7_000, 3, 1])
def test_decimation_keeps_rows_as_measured(long_file: Path, most: int):
    recording = only(read(long_file, downsampling=Decimation(most)))
    step = -(-20_000 // most)
    assert np.array_equal(recording["time"], np.arange(0, 20_000, step))
    assert np.array_equal(recording["force"], 0.5 * recording["time"])
    assert len(recording) <= most
    assert (step == 1) == (recording.notes == ())
    table = raw_csv.read_large_csv(long_file, raw_csv.TextFormat(), Decimation(most))
    assert np.array_equal(table.rows, np.arange(4, 20_004, step)), (
        "rows have the line numbers of the file"
    )
    assert step == 1 or recording.notes[0].startswith(
        f"The file has 20000 rows; one in {step} is kept as measured"
    )


def test_block_means_of_clock_times_are_those_of_numbers(tmp_path: Path):
    rows = "".join(f"12:00:{i:02};{i};{i * i}\n" for i in range(20))
    (tmp_path / "run.csv").write_text(f"time;pressure [kPa];force [N]\n{rows}")
    recording = only(read(tmp_path / "run.csv", downsampling=BlockMeans(4)))
    assert recording["time"] == pytest.approx(
        1e-3 * (recording["pressure"] - recording["pressure"][0])
    )
    assert only(read(tmp_path / "run.csv", downsampling=BlockMeans(3)))["time"] == pytest.approx(
        [0.0, 7.0, 13.0]
    )


@pytest.mark.parametrize("most", [7_000, 13, 1])
def test_block_means_are_means(long_file: Path, most: int):
    recording = only(read(long_file, downsampling=BlockMeans(most)))
    step = -(-20_000 // most)
    expected = [np.mean(np.arange(20_000)[i : i + step]) for i in range(0, 20_000, step)]
    assert recording["time"] == pytest.approx(np.array(expected), rel=1e-12)
    assert f"each block of {step} is replaced by its mean" in recording.notes[0]
    table = raw_csv.read_large_csv(long_file, raw_csv.TextFormat(), BlockMeans(most))
    assert np.array_equal(table.rows, np.arange(4, 20_004, step)), (
        "rows have the number of the first line of their block"
    )


def test_a_bad_cell_in_a_long_file_is_named_with_its_line(long_file: Path):
    text = long_file.read_text().replace("\n15000;7500,0\n", "\n15000;broken\n")
    long_file.write_text(text)
    assert refusal(ColumnError, long_file).startswith(
        "long.csv, line 15004: force 'broken' is not a number"
    )


def test_progress_increases_to_one_and_an_interrupt_aborts_reading(long_file: Path):
    parts: list[float] = []
    read(long_file, progress=lambda name, part: parts.append(part))
    assert len(parts) == 20
    assert parts == sorted(parts)
    assert parts[-1] == 1.0

    def interrupted(name: str, part: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        read(long_file, progress=interrupted)


def peak_memory(path: Path, rows: int) -> int:
    with path.open("w") as file:
        file.write("time [s],force [N]\n")
        file.writelines(f"{i},{i % 977}.25\n" for i in range(rows))
    tracemalloc.start()
    table = raw_csv.read_large_csv(path, raw_csv.TextFormat(), Decimation(1000))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert len(table.rows) == 1000
    return peak


def test_memory_depends_on_the_kept_rows_not_on_the_file(tmp_path: Path, monkeypatch):
    monkeypatch.setattr(raw_csv, "LARGE_FILE_BYTES", 10_000)
    peaks = [peak_memory(tmp_path / "long.csv", rows) for rows in (200_000, 500_000)]
    assert peaks[1] < 1.1 * peaks[0]


def test_other_formats_are_downsampled_as_well(tmp_path: Path):
    recording = only(read(csv(tmp_path / "run.csv"), downsampling=Decimation(10)))
    assert np.array_equal(recording["force"], only(read(tmp_path / "run.csv"))["force"][::4])
    assert "one in 4 is kept" in recording.notes[0]
    with pytest.raises(ParameterError, match="max_rows is 0; it must be at least 1"):
        Decimation(0)


# Damaged files and files without end


@pytest.mark.parametrize("ending", [".csv", ".txt", ".xlsx", ".mat", ".tdms", ".mf4"])
def test_only_a_regular_file_is_read(tmp_path: Path, ending: str):
    os.mkfifo(tmp_path / f"pipe{ending}")
    (tmp_path / f"device{ending}").symlink_to("/dev/zero")
    (tmp_path / f"empty{ending}").write_bytes(b"")
    assert "because it is a pipe. Pass a regular file" in refusal(
        FileError, tmp_path / f"pipe{ending}"
    )
    assert "because it is a device. Pass a regular file" in refusal(
        FileError, tmp_path / f"device{ending}"
    )
    assert refusal(FileError, tmp_path / f"empty{ending}").endswith("the file is empty.")
    assert "No such file or directory" in refusal(FileError, tmp_path / f"none{ending}")


def test_a_mapping_is_read_from_a_regular_file_only(tmp_path: Path):
    os.mkfifo(tmp_path / "map.toml")
    with pytest.raises(FileError, match="because it is a pipe"):
        read_mapping(tmp_path / "map.toml")


@pytest.mark.parametrize(
    ("content", "kind"),
    [
        (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\x1b[31m", "a PNG image"),
        (b"%PDF-1.4\n1 0 obj\n", "a PDF document"),
        (b"PK\x03\x04\x14\0\6\0", "a ZIP archive or an Excel workbook"),
        (bytes(range(256)), "a binary file"),
    ],
)
def test_a_binary_file_with_the_name_of_a_text_file(tmp_path: Path, content: bytes, kind: str):
    (tmp_path / "run.csv").write_bytes(content)
    assert refusal(FileError, tmp_path / "run.csv").startswith(
        f"run.csv: the file is {kind}, not a table of text."
    )


def test_an_error_escapes_the_control_characters_of_a_file(tmp_path: Path):
    (tmp_path / "run.csv").write_text("a\x1b[31m,b\n1,2\n")
    assert "(a\\x1b[31m, b)" in refusal(ColumnError, tmp_path / "run.csv")


@pytest.mark.parametrize("save", [save_v5, save_v73])
def test_a_damaged_matlab_file_does_not_end_the_process(tmp_path: Path, save):
    content = save(tmp_path / "run.mat", mat_content()).read_bytes()
    unknown_type = (
        content.index(b"t\0\0\0") + 4
    )  # type of the numbers, for which SciPy has a segmentation fault
    for position in (unknown_type, 130, len(content) // 2, len(content) - 100):
        damaged = bytearray(content)
        damaged[position] ^= 64
        (tmp_path / "damaged.mat").write_bytes(damaged)
        with contextlib.suppress(InputError):  # a flipped bit of a number cannot be detected
            read(tmp_path / "damaged.mat", ColumnMapping(units={"time": "s"}))
    (tmp_path / "damaged.mat").write_bytes(content[: len(content) // 2])
    assert "damaged" in refusal(FileError, tmp_path / "damaged.mat")
    same(only(read(tmp_path / "run.mat", ColumnMapping(units={"time": "s"}))))


def test_a_file_whose_reader_ends_or_takes_too_long_is_damaged(tmp_path: Path, monkeypatch):
    (tmp_path / "bad_reader.py").write_text(
        "import os, time\ndef end(path): os._exit(1)\ndef wait(path): time.sleep(60)\ndef"
        " loop(path):\n    while True: pass\ndef fill(path): bytearray(10**11)\ndef fail(path):"
        " None.get\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    separate_process.stop()
    path = csv(tmp_path / "run.csv")
    monkeypatch.setattr(separate_process, "CPU_LIMIT", 1.0)
    limits = separate_process.TIME_LIMIT
    for function, limit, cause in (
        ("end", limits, "its reader ended without a result, because .*"),
        ("loop", limits, ".* need more than 1 s of a processor or 2 GB of memory"),
        ("fail", limits, "AttributeError: 'NoneType' object has no attribute 'get'"),
        ("wait", 1.0, "its reading takes more than 1 s"),
    ):
        monkeypatch.setattr(separate_process, "TIME_LIMIT", limit)
        with pytest.raises(
            FileError,
            match=rf"run.csv: the file is damaged or too large \({cause}\). Copy it again",
        ):
            call_in_separate_process("bad_reader", function, path)


def test_a_reader_that_needs_more_memory_than_allowed_names_the_setting(
    tmp_path: Path, monkeypatch
):
    (tmp_path / "hungry_reader.py").write_text("def fill(path, size): return len(bytearray(size))")
    monkeypatch.syspath_prepend(tmp_path)
    separate_process.stop()
    path = csv(tmp_path / "run.csv")

    def fill(size: int) -> int:
        return call_in_separate_process("hungry_reader", "fill", path, size)

    with pytest.raises(FileError, match=r"more than 2 GB of memory.*AIRMUSCLE_READER_MEMORY"):
        fill(3 * 10**9)
    monkeypatch.setenv("AIRMUSCLE_READER_MEMORY", "200 MB")
    with pytest.raises(FileError, match=r"more than 0\.2 GB of memory.*, such as '1 GB'"):
        fill(4 * 10**8)
    monkeypatch.setenv("AIRMUSCLE_READER_MEMORY", "1 GB")  # the remedy works
    assert fill(4 * 10**8) == 4 * 10**8
    monkeypatch.setenv("AIRMUSCLE_READER_MEMORY", "much")
    with pytest.raises(ParameterError, match="it must be a size in MB or GB, such as '4 GB'"):
        fill(1)


def test_a_value_that_no_measurement_has(tmp_path: Path):
    (tmp_path / "run.csv").write_text("pressure [bar],force [N]\n1,2\n1e300,3\n")
    assert "line 3: pressure is 1e+305 in SI units; no measurement exceeds 1e+15" in refusal(
        ColumnError, tmp_path / "run.csv"
    )


@pytest.mark.parametrize("cell", ["x" * 3000, "ab " * 1000, "pressure [" + "k" * 3000 + "]"])
@pytest.mark.parametrize("place", ["cell", "column", "headings"])
def test_a_message_quotes_little_of_hostile_text(tmp_path, cell, place):
    rows = [
        ["time [s]", "pressure [kPa]", "force [N]"],
        *([f"{i}", "100", f"{100 + i}"] for i in range(30)),
    ]
    for row in {"cell": [5], "column": range(3, 25), "headings": []}[place]:
        rows[row][1] = cell
    if place == "headings":
        rows[0] = [f"{cell}{i}" for i in range(3)]
    path = tmp_path / "hostile.csv"
    path.write_text("\n".join(map(",".join, rows)), encoding="utf-8")
    with pytest.raises(ColumnError) as caught:
        read(path)
    assert len(str(caught.value)) <= 700


# Fields of a mapping as arguments


def readers_with_a_mapping() -> list[str]:
    """The public functions and classes of the face that take a ColumnMapping."""
    names = []
    for name in am.bench.__all__:
        reader = getattr(am.bench, name)
        if callable(reader):
            mapping = inspect.signature(reader).parameters.get("mapping")
            is_taken = mapping is not None and "ColumnMapping" in str(mapping.annotation)
            names += [name] * is_taken
    return names


def test_every_reader_takes_the_fields_of_a_mapping(tmp_path: Path):
    pandas = pytest.importorskip("pandas")
    path = tmp_path / "bench.csv"
    path.write_text("pressure [kPa],length [mm],force [N]\n100,270,50\n200,260,90\n")
    calls = {
        "read": lambda **fields: am.read(path, **fields)[0]["contraction"],
        "read_csv": lambda **fields: am.read_csv(path, **fields)["contraction"],
        "from_pandas": lambda **fields: am.bench.from_pandas(pandas.read_csv(path), **fields)[
            "contraction"
        ],
        "RowReader": lambda **fields: second_row(path, **fields),
    }
    assert sorted(calls) == sorted(readers_with_a_mapping())
    by_argument = inspect.signature(am.ColumnMapping).parameters
    for call in calls.values():
        expected = call(mapping=am.ColumnMapping(resting_length=0.3))
        assert expected == pytest.approx(call(resting_length="300 mm"))
        stated = am.ColumnMapping(resting_length=0.25)
        assert expected == pytest.approx(call(mapping=stated, resting_length=0.3))
        for name in by_argument:
            call(
                **{"resting_length": 0.3, name: getattr(am.ColumnMapping(resting_length=0.3), name)}
            )
        with pytest.raises(ParameterError, match=r"no field 'resting_lenght'.*'resting_length'"):
            call(resting_lenght=0.3)


def second_row(path: Path, **fields) -> float:
    reader = am.bench.RowReader("bench", **fields)
    rows = [reader.read(line) for line in path.read_text().splitlines(keepends=True)]
    return rows[-1]["contraction"]
