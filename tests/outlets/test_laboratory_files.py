"""Files as a laboratory has them: lines above the headings, displacements, missing values and
outliers.

Every command that reads measurement files takes the same options for them, and says which rows it
leaves out.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import airmuscle
from dynamic_study import plant_table

import airmuscle as am
from airmuscle.bench import (
    ColumnMapping,
    DropMissing,
    Huber,
    InterpolateMissing,
    LevelSplit,
    RefuseMissing,
    RowReader,
    compare,
    fit,
    read,
)
from airmuscle.bench.readers import mapping_of_tables
from airmuscle.core import STANDARD_GRAVITY
from airmuscle.errors import ColumnError, FileError, IdentificationError, ParameterError
from airmuscle.files import load_dynamic_fit
from airmuscle.outlets.cli import COMMANDS
from airmuscle.physics import ContractileSurface
from airmuscle.recording import Recording
from airmuscle.recording.recording import row_notes

PREAMBLE = (
    "Prüfstand 3 (Zwick Z010)",
    "Prüfer;Müller",
    "Datum;12.03.2026;14:05",
    "Kanal;1;2;3",
    "Verstärkung;1;10;1",
)
HEADINGS = "Zeit;Druck (rel.);Kraft;Weg;Bemerkung"
UNITS = "s;bar;N;mm;"
ROWS = (
    "0,00;2,0;120,5;0,0;Start",
    "0,05;2,0;118,2;0,5;",
    "0,10;2,1;116,0;1,0;Öl",
    "0,15;2,0;113,9;1,5;",
)
SHORTENING = {"Weg": "shortening [mm]"}
READING = (
    "check",
    "watch",
    "inspect",
    "fit",
    "hysteresis",
    "campaign",
    "fit-volume",
    "predict",
    "convert",
    "fit-regulator",
)
OPTIONS = (
    "--resting-length",
    "--ambient",
    "--unit",
    "--mapping",
    "--column",
    "--constant",
    "--file-name",
    "--time",
    "--displacement-zero",
    "--skip-rows",
    "--missing",
    "--missing-code",
    "--outliers",
    "--delimiter",
    "--decimal",
    "--sheet",
    "--group",
)


def text(folder: Path, lines: Sequence[str], name: str = "bench.csv", separator: str = ";") -> Path:
    path = folder / name
    path.write_bytes("\r\n".join([*lines, ""]).replace(";", separator).encode("cp1252"))
    return path


def workbook(folder: Path, lines: Sequence[str], name: str = "bench.xlsx") -> Path:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for line in lines:
        book.active.append([_cell(cell) for cell in line.split(";")])
    book.save(folder / name)
    return folder / name


def _cell(cell: str) -> float | str | None:
    number = cell.replace(",", ".")
    return (
        float(number)
        if re.fullmatch(r"-?[\d.]+", number) and number.count(".") < 2
        else cell or None
    )


def only(source: Path, mapping: Any = None, **options: Any) -> Recording:
    (recording,) = read(source, mapping or ColumnMapping(**options))
    return recording


# Headings below other lines


@pytest.mark.parametrize("separator", [";", "\t"])
@pytest.mark.parametrize("above", [1, len(PREAMBLE)])
def test_headings_are_found_below_lines_of_other_width_with_a_column_of_remarks(
    tmp_path, above: int, separator: str
):
    recording = only(
        text(tmp_path, [*PREAMBLE[:above], HEADINGS, UNITS, *ROWS], separator=separator)
    )
    assert {"time", "pressure", "force"} <= set(recording)
    assert recording["force"] == pytest.approx([120.5, 118.2, 116.0, 113.9])


def test_lines_above_the_headings_may_be_filled_up_with_separators(tmp_path):
    padded = [f"{line};;;;" for line in PREAMBLE[:2]]
    assert only(text(tmp_path, [*padded, HEADINGS, UNITS, *ROWS]))["pressure"][2] == pytest.approx(
        2.1e5
    )


NUMBERED = ("1;2;3;4;5", "10;10;1;1;1", "Zeit;p1;F1;Weg;Bemerkung", *ROWS)
MAPPED = {"p1": "pressure [bar]", "F1": "force [N]", "Zeit": "time [s]"}


@pytest.mark.parametrize("write", [text, workbook])
def test_headings_that_the_mapping_names_are_found_below_rows_of_numbers(tmp_path, write):
    with pytest.raises(ColumnError):
        read(write(tmp_path, NUMBERED))
    recording = only(write(tmp_path, NUMBERED), columns=MAPPED)
    assert recording["force"] == pytest.approx([120.5, 118.2, 116.0, 113.9])
    assert only(write(tmp_path, NUMBERED), columns={**MAPPED, "Weg": ""})["time"][
        -1
    ] == pytest.approx(0.15)


@pytest.mark.parametrize("write", [text, workbook])
def test_the_number_of_lines_above_the_headings_may_be_stated(tmp_path, write):
    path = write(tmp_path, ("1;2;3;4;5", "a;b;c;d;e", *ROWS[1:3], HEADINGS, UNITS, *ROWS))
    recording = only(path, skip_rows=4)
    assert len(recording) == 4
    assert recording["pressure"][0] == pytest.approx(2e5)
    assert (
        only(path, mapping=ColumnMapping(skip_rows=4))["pressure"].tolist()
        == recording["pressure"].tolist()
    )
    with pytest.raises(FileError, match=r"no table below the 99 (lines|rows)"):
        read(path, ColumnMapping(skip_rows=99))


def test_the_heading_row_of_a_large_file_is_found_in_the_same_way(tmp_path, monkeypatch):
    monkeypatch.setattr("airmuscle.bench.readers.formats.raw_csv.LARGE_FILE_BYTES", 10)
    assert len(only(text(tmp_path, [*PREAMBLE, HEADINGS, UNITS, *ROWS]))) == 4
    assert len(only(text(tmp_path, NUMBERED), columns=MAPPED)) == 4


# Displacements


@pytest.mark.parametrize("write", [text, workbook])
def test_a_shortening_becomes_a_contraction(tmp_path, write):
    recording = only(
        write(tmp_path, [HEADINGS, UNITS, *ROWS]), columns=SHORTENING, resting_length="200 mm"
    )
    assert recording["contraction"] == pytest.approx([0.0, 0.0025, 0.005, 0.0075], abs=1e-12)
    assert recording["length"] == pytest.approx([0.2, 0.1995, 0.199, 0.1985])


def test_the_zero_and_the_direction_of_a_displacement_are_stated(tmp_path):
    path = text(tmp_path, [HEADINGS, UNITS, *ROWS])
    contraction = pytest.approx((np.array([0.0, 0.5, 1.0, 1.5]) - 2.0) / 200.0)
    stated = {"displacement_zero": "2 mm", "resting_length": "200 mm"}
    assert only(path, columns=SHORTENING, **stated)["contraction"] == contraction
    assert -only(path, columns={"Weg": "elongation [mm]"}, **stated)["contraction"] == contraction
    measured = only(path, columns={"Weg": "displacement [mm]"}, **stated)
    assert measured["contraction"] == contraction
    assert measured["position"][1] == pytest.approx(5e-4)


def test_a_shortening_without_resting_length_is_converted_when_it_is_known(tmp_path):
    recording = only(text(tmp_path, [HEADINGS, UNITS, *ROWS]), columns=SHORTENING)
    assert recording["shortening"][3] == pytest.approx(1.5e-3)
    with pytest.raises(ColumnError, match="Specify the resting length to convert the shortening"):
        recording["contraction"]
    assert recording.with_constants(resting_length=0.3)["contraction"][3] == pytest.approx(0.005)
    assert recording.with_constants(resting_length=0.3)["length"][3] == pytest.approx(0.2985)


def test_the_zero_of_a_displacement_may_stand_in_the_file_or_its_name(tmp_path):
    table = ("time [s];shortening [mm];force [N]", "0;5;3", "1;7;2")
    inside = text(tmp_path, ("# displacement_zero [mm] = 5", "# resting_length: 100 mm", *table))
    assert only(inside)["contraction"] == pytest.approx([0.0, 0.02])
    named = text(tmp_path, table, "zero_5mm.csv")
    pattern = {"file_name": "zero_{displacement_zero [mm]}mm", "resting_length": 0.1}
    assert only(named, **pattern)["contraction"] == pytest.approx([0.0, 0.02])


@pytest.mark.parametrize("zero", ["5", "2 kg", "30 m"])
def test_an_impossible_zero_of_a_displacement_is_refused(tmp_path, zero: str):
    with pytest.raises(am.AirmuscleError, match="displacement_zero"):
        read(
            text(tmp_path, [HEADINGS, UNITS, *ROWS]),
            ColumnMapping(columns=SHORTENING, displacement_zero=zero),
        )


@pytest.mark.parametrize("heading", ["Weg", "Hub", "Stroke", "Traversenweg"])
def test_quantities_are_proposed_for_headings_of_displacements(tmp_path, heading: str):
    notes = " ".join(only(text(tmp_path, [HEADINGS.replace("Weg", heading), UNITS, *ROWS])).notes)
    assert ("map it to 'shortening [mm]'" in notes) == (
        heading != "Traversenweg" or "traverse" in heading.lower()
    )


def test_inspect_says_that_a_fit_will_refuse_a_displacement(tmp_path):
    path = text(tmp_path, [HEADINGS, UNITS, *ROWS])
    said = airmuscle("inspect", path, "--column", "Weg=displacement [mm]").output
    assert "will refuse this recording. A displacement has no stated zero and direction." in said
    assert '--column "displacement=shortening [mm]"' in said
    said = airmuscle("inspect", path, "--column", "Weg=shortening [mm]").output
    assert 'To convert the shortening, use --resting-length "..."' in said
    said = airmuscle(
        "inspect", path, "--column", "Weg=shortening [mm]", "--resting-length", "200 mm"
    ).output
    assert "will refuse" not in said


# Missing values

GAPS = (
    "time [s];pressure [kPa];force [N]",
    "0;100;10",
    "1;---;11",
    "2;102;",
    "3;#N/A;-999",
    "4;104;14",
    "5;105;15",
    "6;;16",
    "7;;17",
    "8;;18",
    "9;;19",
    "10;;20",
    "11;111;21",
)


def test_all_missing_values_are_reported_at_once(tmp_path):
    with pytest.raises(ColumnError) as caught:
        read(text(tmp_path, GAPS))
    said = str(caught.value)
    assert (
        "of 12 cells of 'pressure [kPa]' and 1 of 12 cells of 'force [N]' are no finite numbers"
        in said
    )
    assert "line 3 (pressure '---'), line 4 (force empty), line 5 (pressure '#N/A')" in said
    assert "use missing=DropMissing() of ColumnMapping" in said
    assert "use missing=InterpolateMissing() of ColumnMapping" in said


def test_many_missing_values_are_counted(tmp_path):
    rows = [f"{i};100;" for i in range(50)]
    with pytest.raises(
        ColumnError,
        match=r"50 of 50 cells of 'force \[N\]' .* line 9 \(force empty\) and 42 more\.",
    ):
        read(text(tmp_path, [GAPS[0], *rows]))


def test_rows_with_missing_values_are_left_out_and_named(tmp_path):
    recording = only(text(tmp_path, GAPS), missing=DropMissing())
    assert recording["time"].tolist() == [0, 4, 5, 11]
    (note,) = [note for note in recording.notes if "left out" in note]
    assert (
        note
        == "bench.csv: rows left out, because a value is missing: 8 of 12 (lines 3, 4, 5, 8, 9, 10,"
        " 11 and 12)."
    )


def test_short_gaps_are_interpolated_in_time_and_long_ones_are_left_out(tmp_path):
    recording = only(text(tmp_path, GAPS), missing=InterpolateMissing((-999.0,)))
    assert recording["time"].tolist() == [0, 1, 2, 3, 4, 5, 11]
    assert recording["pressure"][:5] == pytest.approx([100e3, 101e3, 102e3, 103e3, 104e3])
    assert recording["force"][:5] == pytest.approx([10, 11, 12, 13, 14])
    assert any(
        "rows with values interpolated in time: 3 of 12 (lines 3, 4 and 5)" in note
        for note in recording.notes
    )


def test_a_valve_command_keeps_its_value_in_a_gap(tmp_path):
    path = text(tmp_path, ("time [s];pressure [kPa];fill", "0;1;1", "1;2;", "2;3;0"))
    assert only(path, missing=InterpolateMissing())["fill"].tolist() == [1, 1, 0]


def test_the_ends_of_a_recording_are_not_extrapolated(tmp_path):
    path = text(tmp_path, ("time [s];force [N]", "0;", "1;2", "2;3", "3;"))
    assert only(path, missing=InterpolateMissing())["time"].tolist() == [1, 2]


def test_missing_times_are_never_interpolated(tmp_path):
    path = text(tmp_path, ("time [s];force [N]", "0;1", ";2", "2;", "3;4"))
    recording = only(path, missing=InterpolateMissing())
    assert recording["time"].tolist() == [0, 2, 3]
    assert recording["force"] == pytest.approx([1, 3, 4])
    untimed = text(tmp_path, ("pressure [kPa];force [N]", "0;1", "1;", "2;3"))
    with pytest.raises(
        ColumnError, match=r"interpolated in time, but there is no time column\. .*DropMissing"
    ):
        read(untimed, ColumnMapping(missing=InterpolateMissing()))


def test_clock_times_may_be_missing(tmp_path):
    path = text(tmp_path, ("time;force [N]", "12:00:00;1", ";2", "12:00:02;3"))
    assert only(path, missing=DropMissing())["time"].tolist() == [0, 2]
    path = text(tmp_path, ("time;force [N]", "12:00:00;1", "12:00:01;", "12:00:02;3"))
    assert only(path, missing=InterpolateMissing())["force"].tolist() == [1, 2, 3]


@pytest.mark.parametrize("code", [-999.0, "-999", "OL"])
def test_codes_stand_for_missing_values(tmp_path, code: float | str):
    cell = "OL" if code == "OL" else "-999"
    path = text(tmp_path, ("time [s];force [N];remark", "0;1;a", f"1;{cell};b", "2;3;c"))
    assert only(path, missing=DropMissing((code,)))["force"].tolist() == [1, 3]
    with pytest.raises(ColumnError, match=r"line 3: force "):
        read(path, ColumnMapping(missing=RefuseMissing((code,))))


def test_a_text_that_is_no_marker_is_refused_with_the_code_as_its_remedy(tmp_path):
    path = text(tmp_path, ("time [s];force [N]", "0;1", "1;OL", "2;OL"))
    with pytest.raises(
        ColumnError,
        match=r"2 of 3 cells .* use missing=DropMissing\(codes=\('OL',\)\) of ColumnMapping",
    ):
        read(path, ColumnMapping(missing=DropMissing()))
    said = airmuscle("inspect", path).stderr
    assert "use --missing drop --missing-code 'OL'" in " ".join(said.split())


def test_numbers_with_separated_thousands_are_reported_at_once(tmp_path):
    path = text(tmp_path, ("time [s];force [N]", "0;1.300,00", "1;1.301,50", "2;3"))
    assert only(path)["force"].tolist() == [1300, 1301.5, 3]
    path = text(tmp_path, ("time [s];force [N]", "0;1.300,00", "1;1.301,50", "2.5;3"))
    with pytest.raises(ColumnError, match=r"use decimal=',' of ColumnMapping"):
        read(path)


def test_a_recording_without_a_complete_row_is_refused(tmp_path):
    path = text(tmp_path, ("time [s];force [N]", "0;", "1;---"))
    with pytest.raises(ColumnError, match="every row contains a missing value"):
        read(path, ColumnMapping(missing=DropMissing()))


@pytest.mark.parametrize("write", [text, workbook])
def test_cells_of_remarks_are_not_missing_values(tmp_path, write):
    recording = only(write(tmp_path, [HEADINGS, UNITS, *ROWS]), missing=DropMissing())
    assert len(recording) == 4


def test_values_that_are_not_numbers_are_missing_in_a_workbook_and_in_matlab(tmp_path):
    path = workbook(tmp_path, GAPS)
    assert only(path, missing=DropMissing())["time"].tolist() == [0, 4, 5, 11]
    scipy_io = pytest.importorskip("scipy.io")
    force = np.array([1.0, np.nan, -999.0, 4.0])
    scipy_io.savemat(tmp_path / "bench.mat", {"time_s": np.arange(4.0), "force_N": force})
    assert only(tmp_path / "bench.mat", missing=DropMissing((-999,)))["force"].tolist() == [1, 4]
    assert only(tmp_path / "bench.mat", missing=InterpolateMissing((-999,)))["force"].tolist() == [
        1,
        2,
        3,
        4,
    ]


# Outliers


def ramp(folder: Path, name: str = "ramp.csv", spike: float = 9999.0) -> Path:
    time = np.arange(400) * 0.05
    noise = np.random.default_rng(1).normal(0.0, 0.5, 400)
    force = 200.0 - 6.0 * time + noise
    force[120] = spike
    rows = [f"{t:.2f};{100 + t:.3f};{f:.2f}" for t, f in zip(time, force, strict=True)]
    return text(folder, ["time [s];pressure [kPa];force [N]", *rows], name)


def test_suspected_outliers_are_left_out_on_request_and_named(tmp_path):
    assert only(ramp(tmp_path))["force"].max() == 9999.0
    recording = only(ramp(tmp_path), drop_outliers=True)
    assert len(recording) == 399
    assert recording["force"].max() < 202.0
    (note,) = [note for note in recording.notes if "outlier" in note]
    assert re.fullmatch(
        r"ramp\.csv: rows left out as suspected outliers: 1 of 400: force in row 121 \(9999 N,"
        r" neighbours 16\d\.?\d* N\)\.",
        note,
    )


def test_rows_without_time_have_no_outliers_which_is_said(tmp_path):
    path = text(tmp_path, ("pressure [kPa];force [N]", "0;1", "1;2"))
    assert any(
        "without time, rows are no neighbours" in note
        for note in only(path, drop_outliers=True).notes
    )


# Loads in names


@pytest.mark.parametrize(
    ("unit", "newton"), [("g", STANDARD_GRAVITY / 2), ("kg", 500 * STANDARD_GRAVITY), ("N", 500)]
)
def test_a_load_in_the_name_of_a_file_is_a_force(tmp_path, unit: str, newton: float):
    path = text(tmp_path, ("time [s];pressure [kPa]", "0;300", "1;400"), "load500.csv")
    assert only(path, file_name=f"load{{force [{unit}]}}")["force"] == pytest.approx([newton] * 2)
    assert only(path, constants={"force": f"500 {unit}"})["force"] == pytest.approx([newton] * 2)


# Mapping files


def test_a_mapping_file_states_all_of_it(tmp_path):
    rig = tmp_path / "rig.toml"
    rig.write_text(
        'skip_rows = 2\nmissing = "drop"\nmissing_codes = [-999, "OL"]\noutliers = "drop"\n'
        'displacement_zero = "5 mm"\nresting_length = "100 mm"\n'
    )
    path = text(
        tmp_path,
        (
            "a;1;2",
            "b;2;3",
            "time [s];shortening [mm];force [N]",
            "0;5;1",
            "1;-999;2",
            "2;7;OL",
            "3;8;1",
        ),
    )
    assert only(path, rig)["contraction"] == pytest.approx([0.0, 0.03])


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("skip_rows", "7"),
        ("skip_rows", -1),
        ("skip_rows", True),
        ("missing", "fill"),
        ("missing", 3),
        ("missing_codes", -999),
        ("missing_codes", [True]),
        ("outliers", "delete"),
        ("displacement_zero", [1]),
    ],
)
def test_an_impossible_value_in_a_mapping_is_refused(key: str, value: Any):
    with pytest.raises((ParameterError, ColumnError), match=key):
        mapping_of_tables({key: value}, "rig.toml")


# Commands


@pytest.mark.parametrize("command", READING)
def test_every_command_that_reads_has_every_option(command: str):
    options = set(re.findall(r"--[a-z-]+", airmuscle(command, "--help").output))
    assert set(OPTIONS) <= options


def test_the_commands_that_name_columns_are_those_with_all_options_and_the_follower_of_a_stream():
    naming = {row.name for row in COMMANDS if "--column" in airmuscle(row.name, "--help").output}
    assert naming == {*READING, "fit-live"}


def test_a_stream_has_lines_above_its_headings_and_a_displacement():
    reader = RowReader(
        "stream",
        ColumnMapping(
            constants={"resting_length": "100 mm", "displacement_zero": "5 mm"}, skip_rows=2
        ),
    )
    lines = ("1;2;3", "4;5;6", "pressure [kPa];shortening [mm];force [N]", "100;7;20")
    (row,) = [row for row in map(reader.read, lines) if row]
    assert row["contraction"] == pytest.approx(0.02)
    assert row["force"] == 20.0


def test_the_mapping_of_a_record_may_be_a_table(tmp_path):
    """The rows that a record of a dynamic fit leaves out are named."""
    rows = [f"{0.01 * i:.2f};{'---' if i == 7 else 100 + i};{30 + 0.01 * i:.3f}" for i in range(60)]
    text(tmp_path, ("logger", "time [s];pressure [kPa];position [mm]", *rows), "run.csv")
    weight = 'model = "HangingMass"\nmass = "10 kg"'
    study = (
        plant_table(weight, exponent=1.2, conductance=3e-9)
        + '[input]\nfill = [["0.1 s", 1]]\n[observed]\npressure = "500 Pa"\n[fit]\nfree ='
        ' ["gas.exponent"]\n[[record]]\nfile = "run.csv"\nmapping = { missing = "drop", skip_rows'
        " = 1 }\n"
    )
    (tmp_path / "study.toml").write_text(study, encoding="utf-8")
    (experiment,) = load_dynamic_fit(tmp_path / "study.toml").experiments
    assert len(experiment.recording) == 59
    assert row_notes([experiment.recording]) == [
        "run.csv: rows left out, because a value is missing: 1 of 60 (line 10)."
    ]
    (tmp_path / "study.toml").write_text(study.replace('"drop"', '"fill"'), encoding="utf-8")
    with pytest.raises(
        am.AirmuscleError, match="missing is 'fill'; allowed range: error, drop, interpolate"
    ):
        load_dynamic_fit(tmp_path / "study.toml")


@pytest.mark.parametrize("command", ["hysteresis", "predict"])
def test_reports_name_the_rows_that_were_left_out(tmp_path, command: str):
    am.write(loops(spike=True), tmp_path / "loops.csv")
    model = ("dmsp-20-300",) if command == "predict" else ()
    result = airmuscle(
        command, *model, tmp_path / "loops.csv", "--outliers", "drop", "--out", tmp_path / "out"
    )
    assert result.exit_code == 0, result.output
    said = "rows left out as suspected outliers: 1 of 240"
    assert said in result.stderr
    assert said in (tmp_path / "out" / "report.html").read_text()


@pytest.mark.parametrize("arguments", [("inspect",), ("convert", "out.csv"), ("fit", "--compare")])
@pytest.mark.parametrize(
    "bad", [("--missing", "fill"), ("--outliers", "maybe"), ("--skip-rows", "-1")]
)
def test_an_unknown_treatment_is_refused_by_every_command(
    tmp_path, arguments: tuple[str, ...], bad: tuple[str, str]
):
    command, *more = arguments
    result = airmuscle(
        command, ramp(tmp_path), *(tmp_path / m if m.endswith("csv") else m for m in more), *bad
    )
    assert result.exit_code in (1, 2)
    assert not isinstance(result.exception, ValueError)


def test_inspect_and_convert_say_what_they_left_out(tmp_path):
    path = ramp(tmp_path)
    shown = json.loads(airmuscle("inspect", path, "--outliers", "drop", "--json").stdout)
    assert shown["inspection"]["rows"] == 399
    converted = airmuscle("convert", path, tmp_path / "plain.csv", "--plain", "--outliers", "drop")
    assert "note: ramp.csv: rows left out as suspected outliers: 1 of 400" in " ".join(
        converted.stderr.split()
    )


# Robust comparisons


def loops(*, spike: bool) -> Recording:
    """Three isobaric ramps of a Gaylord muscle with loads of friction and noise; one force may be
    9999 N.
    """
    contraction = np.concatenate([np.linspace(0.0, 0.2, 40), np.linspace(0.2, 0.0, 40)])
    pressure = np.repeat([2e5, 3.5e5, 5e5], 80)
    contraction = np.tile(contraction, 3)
    noise = np.random.default_rng(3).normal(0.0, 5.0, 240)
    force = pressure * 4e-4 * (2.2 * (1.0 - contraction) ** 2 - 1.0) + noise
    force[100] = 9999.0 if spike else force[100]
    columns = {
        "time": np.arange(240) * 0.1,
        "pressure": pressure,
        "contraction": contraction,
        "force": force,
    }
    return Recording(columns, "loops", {"resting_length": 0.3})


@pytest.fixture(scope="module")
def clean():
    return compare(loops(spike=False), leave_out=LevelSplit("pressure"))


def test_one_wrong_reading_does_not_spoil_a_robust_comparison(clean):
    leave_out = LevelSplit("pressure")
    spoilt = compare(loops(spike=True), leave_out=leave_out)
    robust = compare(loops(spike=True), leave_out=leave_out, loss=Huber(15.0))
    name = clean.recommended.candidate.name
    assert spoilt[name].cross_validated_rmse > 600.0
    assert robust[name].cross_validated_rmse == pytest.approx(
        clean[name].cross_validated_rmse, rel=0.1
    )
    assert robust[name].limited_rows == 1
    assert not any("Robust loss" in note for note in clean.notes)
    assert any("limits 1 of 240 rows" in note for note in robust.notes)


def test_without_outliers_the_errors_of_a_robust_comparison_are_hardly_changed(clean):
    robust = compare(loops(spike=False), leave_out=LevelSplit("pressure"), loss=Huber(15.0))
    for model in robust.ranking[:3]:
        assert model.limited_rows == 0
        assert model.cross_validated_rmse == pytest.approx(
            clean[model.candidate.name].cross_validated_rmse, rel=0.05
        )


def test_fit_compares_with_a_robust_loss_and_without_outliers(tmp_path):
    am.write(loops(spike=True), tmp_path / "loops.csv")
    command = (
        "fit",
        tmp_path / "loops.csv",
        "--compare",
        "--leave-out",
        "pressure",
        "--json",
        "--out",
        tmp_path / "o",
    )
    errors = {}
    for name, more in {
        "plain": (),
        "robust": ("--robust", "15 N"),
        "dropped": ("--outliers", "drop"),
    }.items():
        result = airmuscle(*command, *more)
        assert result.exit_code == 0, result.stderr
        errors[name] = json.loads(result.stdout)["comparison"]["ranking"][0][
            "cross_validation_rms_error"
        ]
        assert ("rows left out as suspected outliers: 1 of 240" in result.stderr) == (
            name == "dropped"
        )
    assert errors["plain"] > 600.0 > 10.0 > max(errors["robust"], errors["dropped"])
    report = (tmp_path / "o" / "report.html").read_text()
    assert "rows left out as suspected outliers: 1 of 240" in report


def test_a_robust_fit_states_its_error_without_the_limited_rows():
    found = fit(ContractileSurface.blank(2), loops(spike=True), loss=Huber(15.0))
    assert re.search(r"rms error +6\d\d\.?\d* N +\(\d\d?\.?\d* N with 1 row limited to", str(found))


# Degree of a surface


def test_the_greatest_degree_of_a_surface_is_proposed(tmp_path):
    with pytest.raises(IdentificationError) as caught:
        fit(ContractileSurface.blank(5), loops(spike=False))
    said = str(caught.value)
    assert re.search(
        r"cannot separate a\([^ ]+, a\([^)]+\), a\([^)]+\) and \d+ other parameters", said
    )
    assert "the coefficient of the powers i of the contraction and j of the pressure" in said
    assert said.endswith("use degree=2 of characteristic.ContractileSurface.blank.")
    assert fit(ContractileSurface.blank(2), loops(spike=False)).rank == 6
    am.write(loops(spike=False), tmp_path / "loops.csv")
    result = airmuscle(
        "fit",
        tmp_path / "loops.csv",
        "--characteristic",
        "ContractileSurface",
        "--out",
        tmp_path / "o",
    )
    assert "use --degree 2." in " ".join(result.stderr.split())


@pytest.mark.parametrize(
    ("decimal", "cells"), [(None, ("1,234", "1,5", "0.5")), (".", ("1,23", "1,5", "0.5"))]
)
def test_all_cells_with_an_ambiguous_comma_are_named(
    tmp_path, decimal: str | None, cells: tuple[str, ...]
):
    rows = [f"{i};{cell}" for i, cell in enumerate(cells)]
    with pytest.raises(ColumnError, match=r"line 2: .*there are 2 such cells \(lines 2 and 3\)"):
        read(text(tmp_path, ("time [s];force [N]", *rows)), ColumnMapping(decimal=decimal))


def test_the_file_of_the_guide_is_read_as_the_guide_says(tmp_path):
    guide = (Path(am.__file__).parents[2] / "docs" / "guides/reading.md").read_text(
        encoding="utf-8"
    )
    block = guide.partition("    Prüfstand 3")[2].partition("\n\n")[0]
    path = text(
        tmp_path, ("Prüfstand 3" + block).replace("\n    ", "\n").split("\n"), "Messung.csv"
    )
    rig = tmp_path / "rig.toml"
    toml = guide.partition('    resting_length = "173 mm"\n    missing = "drop"')[2].partition(
        "\n\n### "
    )[0]
    rig.write_text(
        ('resting_length = "173 mm"\nmissing = "drop"' + toml).replace("\n    ", "\n"),
        encoding="utf-8",
    )
    recording = only(path, rig)
    assert recording["force"].tolist() == [61.2, 60.8, 9999.0]
    assert recording["contraction"] == pytest.approx(np.array([0.0, 0.04, 0.13]) / 173.0)
    asked = ("--column", "Weg=shortening [mm]", "--resting-length", "173 mm")
    assert "line 7: force '---' is not a number" in airmuscle("inspect", path, *asked).stderr
    assert airmuscle("inspect", path, *asked, "--missing", "drop").exit_code == 0
