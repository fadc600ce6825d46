"""Reader of text files: the same table gives the same Recording in every text format, or an error
with a remedy.

Delimiter, decimal sign, encoding and the position of the units do not matter. The unit states
whether a pressure is gauge or absolute. An error message names file, line, value and remedy.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from airmuscle.bench import ColumnMapping, read_csv
from airmuscle.errors import AirmuscleWarning, ColumnError, FileError, InputError, UnitError
from airmuscle.recording import Recording

PLAIN = (
    "time [s],pressure [kPa],length [mm],force"
    " [N]\n0,100,300,0.5\n0.1,200.5,290,120\n0.2,300,280,240.25\n"
)
EXPECTED = {
    "time": [0.0, 0.1, 0.2],
    "pressure": [1e5, 2.005e5, 3e5],
    "length": [0.3, 0.29, 0.28],
    "force": [0.5, 120.0, 240.25],
}


@pytest.fixture
def bench(tmp_path: Path):
    """A function that writes bench.csv."""

    def write(content: str | bytes) -> Path:
        path = tmp_path / "bench.csv"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


def same(recording: Recording, expected: dict[str, list[float]] = EXPECTED) -> None:
    assert list(recording) == list(expected)
    for name, values in expected.items():
        assert recording[name] == pytest.approx(values, rel=1e-12), name


def refusal(path: Path, kind: type[InputError], **options) -> str:
    with pytest.raises(kind) as caught:
        read_csv(path, ColumnMapping(**options))
    return str(caught.value)


# Formats of the same table

GERMAN = PLAIN.replace(",", ";").replace("0.", "0,").replace("200.5", "200,5")
FORMS = {
    "plain": PLAIN,
    "semicolons": PLAIN.replace(",", ";"),
    "tabs": PLAIN.replace(",", "\t"),
    "decimal comma": GERMAN,
    "decimal comma, tabs": GERMAN.replace(";", "\t"),
    "carriage returns": PLAIN.replace("\n", "\r\n"),
    "BOM": "\ufeff" + PLAIN,
    "UTF-16": PLAIN.encode("utf-16"),
    "UTF-32": PLAIN.encode("utf-32"),
    "UTF-32, big-endian": b"\0\0\xfe\xff" + PLAIN.encode("utf-32-be"),
    "comments and empty lines": (
        "# rig 3\n% calibrated\n\n" + PLAIN.replace("\n0.1,", "\n\n# pause\n0.1,") + "\n\n"
    ),
    "heading in a comment": "# rig 3\n# " + PLAIN,
    "parentheses": PLAIN.replace("[", "(").replace("]", ")"),
    "slashes": "Time / s,Pressure / kPa,L/mm,F/N\n" + PLAIN.partition("\n")[2],
    "underscores": "t_s,pressure_kPa,length_mm,Force_N\n" + PLAIN.partition("\n")[2],
    "blanks": "t s,p kPa,length mm,load N\n" + PLAIN.partition("\n")[2],
    "unit row": "time,pressure,length,force\ns,kPa,mm,N\n" + PLAIN.partition("\n")[2],
    "unit row in brackets": "Zeit,Druck,L,Kraft\n[s],[kPa],[mm],[N]\n" + PLAIN.partition("\n")[2],
    "quotes": (
        '"time [s]","pressure [kPa]","length [mm]","force [N]"\n"0","100","300","0.5"\n'
        + PLAIN.partition("\n")[2].partition("\n")[2]
    ),
    "spaces": PLAIN.replace(",", " , "),
    "a delimiter at each end": PLAIN.replace("\n", ",\n"),
    "blanks between numbers": (
        PLAIN.partition("\n")[0].replace(",", "   ")
        + "\n"
        + PLAIN.partition("\n")[2].replace(",", "  ")
    ),
    "blanks, unit row and margin": (
        "time pressure length force\n[s] [kPa] [mm] [N]\n"
        + "\n".join(
            f"   {line}" for line in PLAIN.partition("\n")[2].replace(",", " ").splitlines()
        )
    ),
    "blanks and decimal comma": (
        GERMAN.partition("\n")[0].replace(";", " ")
        + "\n"
        + GERMAN.partition("\n")[2].replace(";", " ")
    ),
    "blanks and a commented heading": (
        "% rig 3\n% time [s] pressure [kPa] length [mm] force [N]\n"
        + PLAIN.partition("\n")[2].replace(",", " ")
    ),
    "rows of nothing": PLAIN + ",,,\n,,,\n",
    "title above the headings": "Run of 12.03.2026\n" + PLAIN,
    "settings above headings and unit row": (
        "Rig,3\nSensor,1,2\noperator\n\ntime,pressure,length,force\ns,kPa,mm,N\n"
        + PLAIN.partition("\n")[2]
    ),
    "padded title": "Messung vom 12.03.2026;;;\nPrüfstand 3;;;\n" + GERMAN,
    "separator line of Excel": "sep=;\n" + GERMAN,
}


@pytest.mark.parametrize("form", FORMS)
def test_every_format_gives_the_same_recording(bench, form: str):
    same(read_csv(bench(FORMS[form])))


@pytest.mark.parametrize(
    "line", ["Ruhelänge;250 mm", "Resting length;250;mm", "resting_length: 250 mm", "L0 [mm];250"]
)
def test_a_constant_above_the_headings_is_read(bench, line: str):
    recording = read_csv(bench(f"Rig 3\n{line}\n" + GERMAN))
    same(recording)
    assert recording.constants["resting_length"] == pytest.approx(0.25)


def test_rows_of_numbers_are_never_taken_for_lines_above_the_headings(bench):
    said = refusal(bench("pressure [kPa],force [N]\n1,2,3\n4,5,6\nbad,row,x\n7,8,9\n"), ColumnError)
    assert "bench.csv, line 2: the line must have 2 cells" in said


def test_latin_1_is_read(bench):
    path = bench(
        "time [s],pressure [kPa],Prüfer °,temperature [°C]\n0,100,1,20\n1,200,2,21\n".encode(
            "latin-1"
        )
    )
    recording = read_csv(path)
    assert list(recording) == ["time", "pressure", "Prüfer °", "temperature"]
    assert recording["temperature"] == pytest.approx([293.15, 294.15])


def test_the_symbols_t_and_v_are_case_sensitive(bench):
    recording = read_csv(bench("t [s],T [K],v [mm/s],V [m3]\n0,293,1,0.001\n1,294,2,0.002\n"))
    same(
        recording,
        {"time": [0, 1], "temperature": [293, 294], "speed": [1e-3, 2e-3], "volume": [1e-3, 2e-3]},
    )


@pytest.mark.parametrize(
    "text", ["k [%]", "eps [%]", "Epsilon [%]", "contraction_%", "CONTRACTION (%)", "ε / %"]
)
def test_synonyms_of_contraction(bench, text: str):
    assert read_csv(bench(f"{text}\n-2\n25\n"))["contraction"] == pytest.approx([-0.02, 0.25])


def test_columns_of_several_muscles_keep_their_prefix(bench):
    recording = read_csv(bench("left.p [bar],right.p [bar]\n1,2\n3,4\n"))
    same(recording, {"left.pressure": [1e5, 3e5], "right.pressure": [2e5, 4e5]})


# Gauge or absolute pressure, notes and constants


@pytest.mark.parametrize("unit", ["bara", "bar(a)", "bar abs"])
def test_absolute_pressure_becomes_gauge(bench, unit: str):
    path = bench(f"p [{unit}]\n3\n4\n")
    assert read_csv(path)["pressure"] == pytest.approx([3e5 - 101325, 4e5 - 101325])
    recording = read_csv(path, ColumnMapping(ambient="950 mbar"))
    assert recording["pressure"] == pytest.approx([3e5 - 95000, 4e5 - 95000])
    assert recording.constants["ambient"] == 95000.0
    assert not recording.notes


@pytest.mark.parametrize(
    ("heading", "factor"),
    [
        ("p [psig]", 6894.757293168361),
        ("p_kPag", 1e3),
        ("pressure [kPa(g)]", 1e3),
        ("p / barg", 1e5),
    ],
)
def test_a_gauge_unit_needs_no_note(bench, heading: str, factor: float):
    recording = read_csv(bench(f"{heading}\n3\n4\n"))
    assert recording["pressure"] == pytest.approx([3 * factor, 4 * factor])
    assert recording.notes == ()


@pytest.mark.parametrize(
    "heading", ["pressure_kPa(a)", "pressure [kPa(a)]", "pressure (kPa(a))", "p / kPa(a)", "p kPaa"]
)
def test_absolute_units_are_recognised_in_every_format(bench, heading: str):
    assert read_csv(bench(f"{heading}\n300\n400\n"))["pressure"] == pytest.approx(
        [3e5 - 101325, 4e5 - 101325]
    )


def test_an_unspecified_unit_is_read_as_gauge_with_a_note(bench):
    recording = read_csv(bench(PLAIN))
    assert recording.notes == (
        (
            "The pressure is read as gauge: the unit 'kPa' does not state it. Write bara or kPa(a)"
            " for an absolute pressure."
        ),
    )


def test_unknown_numeric_columns_are_kept_and_texts_ignored_with_a_note(bench):
    recording = read_csv(
        bench("pressure [barg],presure [bar],valve,operator\n1,2,3,Bob\n4,5,6,Eve\n")
    )
    same(recording, {"pressure": [1e5, 4e5], "presure [bar]": [2, 5], "valve": [3, 6]})
    notes = " ".join(recording.notes)
    assert (
        "'presure [bar]' is not a known quantity and is kept without conversion. Did you mean"
        " 'pressure'?" in notes
    )
    assert "Column 'operator' contains text and is ignored." in notes


def test_all_unknown_columns_of_which_nothing_more_is_known_have_one_note(bench):
    heads = [f"adc{i}" for i in range(200)]
    recording = read_csv(
        bench(f"pressure [barg],{','.join(heads)},Weg\n" + 2 * f"{','.join(['0.5'] * 202)}\n")
    )
    kept = [note for note in recording.notes if "kept without conversion" in note]
    assert len(kept) == 2
    assert kept[0].startswith(
        "Column 'Weg' is not a known quantity and is kept without conversion. If it is the"
    )
    assert re.fullmatch(
        r"Columns 'adc0', 'adc1', .* and \d+ more are not known quantities and are kept .*", kept[1]
    )


def test_a_resting_length_gives_the_contraction(bench):
    path = bench(PLAIN)
    assert read_csv(path, ColumnMapping(resting_length="300 mm"))["contraction"] == pytest.approx(
        [0, 1 / 30, 2 / 30]
    )
    assert read_csv(path, ColumnMapping(resting_length=0.4))["contraction"] == pytest.approx(
        [0.25, 0.275, 0.3]
    )
    with pytest.raises(ColumnError, match="Specify the resting length"):
        read_csv(path)["contraction"]


@pytest.mark.parametrize(
    "remark", ["# resting_length [mm] = 300", "% resting_length: 300 mm", "#resting_length = 0.3"]
)
def test_the_file_may_state_the_resting_length(bench, remark: str):
    recording = read_csv(
        bench(f'{remark}\n# specimen = "DMSP-20"\n# by: Bob = the operator\n{PLAIN}')
    )
    assert recording.constants == {"resting_length": 0.3, "specimen": "DMSP-20"}
    assert (
        read_csv(bench(f"{remark}\n{PLAIN}"), ColumnMapping(resting_length=0.4)).constants[
            "resting_length"
        ]
        == 0.4
    )


@pytest.mark.parametrize("number", ["1013.", "+1013", "01013", "1013"])
def test_the_unit_of_a_constant_counts_however_its_number_is_written(bench, number: str):
    assert read_csv(bench(f"# ambient [mbar] = {number}\n{PLAIN}")).constants[
        "ambient"
    ] == pytest.approx(101_300.0)


def test_missing_units_may_be_given(bench):
    path = bench("p,eps,F\n1,0,3\n2,0.1,4\n")
    recording = read_csv(
        path, ColumnMapping(units={"pressure": "bar", "F": "kN"}, specimen="old one")
    )
    same(recording, {"pressure": [1e5, 2e5], "contraction": [0, 0.1], "force": [3e3, 4e3]})
    assert recording.constants == {"specimen": "old one"}
    assert "The contraction has no unit and is read as a ratio." in recording.notes
    said = refusal(path, ColumnError, units={"presure": "bar"})
    assert "a unit is given for 'presure'" in said
    assert "Did you mean 'pressure'?" in said


# Errors


def test_a_missing_file(tmp_path: Path):
    said = refusal(tmp_path / "none.csv", FileError)
    assert "none.csv: cannot be read (No such file or directory). Check the name" in said


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ("", "the file is empty"),
        (" \n\n", "the file is empty"),
        ("# nothing but this\n", "the file contains no table"),
        (
            "time [s],force [N]\n",
            "bench.csv: no rows of numbers below the headings (time [s], force [N])",
        ),
        ("time,force\ns,N\n", "no rows of numbers below the headings (time, force)"),
    ],
)
def test_a_file_without_rows(bench, content: str, expected: str):
    assert expected in refusal(bench(content), FileError)


def test_numbers_without_headings(bench):
    said = refusal(bench("1,2\n3,4\n"), ColumnError)
    assert "bench.csv, line 1: the heading row is missing" in said
    assert "pressure [kPa]" in said


def test_a_column_without_unit(bench):
    said = refusal(bench("pressure,force [N]\n1,2\n"), UnitError)
    assert "bench.csv, column 'pressure': no unit is stated" in said
    assert "'pressure [kPa]'" in said
    assert "units={'pressure': ...}" in said


@pytest.mark.parametrize("cell", ["n/a", "12,5,3", "0x10", "--", "1.2.3"])
def test_text_in_a_column_of_numbers(bench, cell: str):
    rows = "".join(f"{i};{i}\n" for i in range(39))
    said = refusal(bench(f"time [s];pressure [kPa]\n{rows}39;{cell}\n40;40\n"), ColumnError)
    assert said.startswith(
        f"bench.csv, line 41: pressure '{cell}' is not a number. Correct the cell or delete the"
        " line."
    )
    assert ("missing=DropMissing() of ColumnMapping" in said) == (cell in ("n/a", "--"))


def test_an_empty_cell_is_named_with_its_line_in_the_file(bench):
    said = refusal(bench("# rig\n\ntime [s],force [N]\n0,1\n# pause\n1,\n2,3\n"), ColumnError)
    assert said.startswith(
        "bench.csv, line 6: force has an empty cell. Correct the cell or delete the line."
    )


@pytest.mark.parametrize("cell", ["nan", "NaN", "inf", "-inf"])
def test_a_value_that_is_not_finite(bench, cell: str):
    said = refusal(bench(f"time [s],force [N]\n0,1\n1,{cell}\n2,3\n"), ColumnError)
    assert said.startswith(
        f"bench.csv, line 3: force is {float(cell)}; it must be finite. Correct the cell or delete"
    )
    said = refusal(bench(f"time [s],force [N]\n0,1\n1,{cell}\n2,3\n3,nan\n"), ColumnError)
    assert (
        f"2 of 4 cells of 'force [N]' are no finite numbers: line 3 (force {float(cell):g}), line 5"
        " (force nan)" in said
    )


def test_a_decimal_comma_between_commas_is_explained(bench):
    said = refusal(bench("time [s],force [N]\n0,1,5\n0,1,2,5\n"), ColumnError)
    assert "bench.csv, line 2: the line must have 2 cells (time [s], force [N]); it has 3." in said
    assert "If the comma is a decimal comma, separate the columns by ';' or tab" in said


@pytest.mark.parametrize("row", ["1", "1;2;3", "1;2;x"])
def test_ragged_rows(bench, row: str):
    said = refusal(bench(f"time [s];force [N]\n0;1\n{row}\n"), ColumnError)
    assert "bench.csv, line 3:" in said
    assert "the line must have 2 cells" in said
    assert "decimal comma" not in said


def test_two_decimal_signs_are_rejected(bench):
    said = refusal(bench("time [s];force [N]\n0;1,234\n1;0.5\n"), ColumnError)
    assert (
        "bench.csv, line 2: the comma in '1,234' is ambiguous, because line 3 contains a decimal"
        " point ('0.5')" in said
    )


@pytest.mark.parametrize(
    ("times", "expected"),
    [
        (
            "0 0.2 0.1",
            "bench.csv, line 4: time 0.1 s is less than the time of the previous row (0.2 s)",
        ),
        ("0 0.1 0.1", "bench.csv, line 4: time 0.1 s repeats the time of the previous row (0.1 s)"),
    ],
)
def test_time_that_does_not_increase(bench, times: str, expected: str):
    said = refusal(
        bench("time [s],force [N]\n" + "".join(f"{t},1\n" for t in times.split())), ColumnError
    )
    assert expected in said
    assert "sort the rows" in said


@pytest.mark.parametrize(
    ("unit", "meant"), [("kpa", "kPa"), ("KPA", "kPa"), ("Bar", "bar"), ("kPaaa", "kPaa")]
)
def test_an_unknown_unit(bench, unit: str, meant: str):
    said = refusal(bench(f"pressure [{unit}]\n1\n"), UnitError)
    assert f"bench.csv, column 'pressure [{unit}]': '{unit}' is not a known unit" in said
    assert f"Did you mean '{meant}'?" in said


def test_an_unknown_unit_in_the_row_of_units(bench):
    assert "'kNN' is not a known unit" in refusal(bench("time,force\ns,kNN\n1,2\n"), UnitError)


def test_a_unit_of_the_wrong_kind(bench):
    said = refusal(bench("pressure [mm]\n1\n"), UnitError)
    assert "unit 'mm' cannot be converted to 'Pa': it measures another quantity" in said
    assert "kPa" in said


def test_no_known_column_at_all(bench):
    said = refusal(bench("presure [kPa],foo\n1,2\n"), ColumnError)
    assert "no column is a known quantity (presure [kPa], foo)" in said
    assert "Did you mean 'pressure'?" in said


@pytest.mark.parametrize(
    "headings", ["pressure [kPa],p [bar]", "force [N],Load [N]", "valve,valve,force [N]"]
)
def test_two_columns_of_one_quantity(bench, headings: str):
    said = refusal(
        bench(f"{headings}\n{','.join('123'[: len(headings.split(','))])}\n"), ColumnError
    )
    assert "both contain the" in said
    assert "Rename or delete one" in said


def test_a_pressure_below_absolute_zero(bench):
    said = refusal(bench("time [s],pressure [kPa]\n0,100\n1,-150\n"), ColumnError)
    assert (
        "bench.csv, line 3: a gauge pressure of -150 kPa is not above absolute vacuum (-101.3 kPa"
        " gauge)" in said
    )
    assert "Check the unit" in said
    assert read_csv(bench("pressure [kPa]\n-90\n"))["pressure"] == pytest.approx([-9e4])


def test_percent_read_as_a_ratio(bench):
    said = refusal(bench("contraction [1]\n0\n12.5\n"), ColumnError)
    assert "bench.csv, line 3: contraction 12.5 is outside the plausible range -0.5 to 1" in said
    assert "'contraction [%]'" in said


def test_a_length_in_the_wrong_unit(bench):
    said = refusal(bench(PLAIN.replace("[mm]", "[m]")), ColumnError, resting_length=0.3)
    assert "bench.csv, line 2" in said
    assert "resting length of 0.3 m" in said
    assert "line 3: length is -1 m; it must be positive" in refusal(
        bench("length [m]\n1\n-1\n"), ColumnError
    )


def test_an_invalid_resting_length(bench):
    assert "resting_length is -1 m; it must be positive" in refusal(
        bench(PLAIN), ColumnError, resting_length=-1.0
    )
    assert "has no unit" in refusal(bench(PLAIN), UnitError, resting_length="300")


def test_a_resting_length_in_millimetres_and_an_ambient_pressure_in_kilopascals_without_a_unit_are_refused(
    bench,
):
    message = refusal(bench(PLAIN), ColumnError, resting_length=250)
    assert (
        "resting_length is 250 m; allowed range: 0.001 to 20 m. Check the unit; a number without a"
        " unit" in message
    )
    message = refusal(bench(PLAIN), ColumnError, ambient=98)
    assert "ambient is 98 Pa; allowed range: 1000 to 200000 Pa" in message


def test_a_missing_column(bench):
    with pytest.raises(
        ColumnError,
        match=r"bench\.csv: no column 'presure'; the columns are .*Did you mean 'pressure'\?",
    ):
        read_csv(bench(PLAIN))["presure"]


def test_the_fast_parser_equals_the_parser_by_cell(bench):
    """A numeric table is parsed by NumPy, a table with texts cell by cell."""
    values = np.random.default_rng(1).normal(0, 100, (20_000, 3))
    values[:, 0] = np.arange(20_000)
    rows = [",".join(map(repr, row)) for row in values.tolist()]
    fast = read_csv(bench("time [s],force [N],position [m]\n" + "\n".join(rows)))
    careful = read_csv(
        bench("time [s],force [N],position [m],who\n" + ",Bob\n".join(rows) + ",Bob")
    )
    for i, name in enumerate(("time", "force", "position")):
        assert np.array_equal(fast[name], values[:, i])
        assert np.array_equal(careful[name], values[:, i])


@pytest.mark.parametrize("text", ["pressure [bar],force [N]\n", "pressure,force\nbar,N\n"])
def test_a_given_unit_overrides_that_of_the_file_with_a_warning(tmp_path, text):
    path = tmp_path / "bench.csv"
    path.write_text(f"{text}30,1\n60,2\n", encoding="utf-8")
    with pytest.warns(AirmuscleWarning, match=r"bench.csv: The pressure is read in psig, as spec"):
        recording = read_csv(path, ColumnMapping(units={"pressure": "psig"}))
    assert recording["pressure"][0] == pytest.approx(30 * 6894.757293168361)
    assert (
        "The pressure is read in psig, as specified by the user; the file states bar."
        in recording.notes
    )
    assert not any(
        "specified by the user" in note
        for note in read_csv(path, ColumnMapping(units={"pressure": "bar"})).notes
    )


@pytest.mark.parametrize(
    ("unit", "factor"), [("Hz", 2 * np.pi), ("rpm", np.pi / 30), ("deg/s", np.pi / 180)]
)
def test_an_angular_speed_in_turns_is_in_rad_per_second(bench, unit: str, factor: float):
    recording = read_csv(bench(f"time [s],angular_speed [{unit}]\n0,1\n1,2\n2,3\n"))
    assert recording["angular_speed"] == pytest.approx(factor * np.array([1.0, 2.0, 3.0]))
