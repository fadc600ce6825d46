"""Input of any size and depth costs a bounded time, and a message quotes at most 200 characters of
it.
"""

from __future__ import annotations

import time
from pathlib import Path

import pytest
from command_line import airmuscle

from airmuscle.bench import read
from airmuscle.core import leaves
from airmuscle.engine import WithSensitivities
from airmuscle.errors import ColumnError, FileError, ParameterError, UnknownNameError
from airmuscle.files import load, load_scenario
from airmuscle.files.library import read_toml
from airmuscle.outlets import C99, write_program

LIMIT = 5.0
"""Time [s of the processor] that no refusal takes."""


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x." * 20_000 + "y = 1", "a key has more than 50 parts between dots"),
        ("[" + "x." * 20_000 + "y]", "a key has more than 50 parts between dots"),
        ("x = {" + "a . " * 60 + "b = 1}", "a key has more than 50 parts between dots"),
        (
            "x = [" + "1," * 2_500_000 + "]",
            r"more than 4000000 bytes\. Write its numbers to a data file",
        ),
        ("x = " + "[" * 100_000 + "]" * 100_000, "cannot be read"),
        ("x = " + "1" * 5000, "cannot be read"),
    ],
    ids=[
        "dotted key",
        "dotted table",
        "dotted key in a table",
        "numbers",
        "lists in lists",
        "digits",
    ],
)
def test_a_toml_file_that_would_take_minutes_is_refused(tmp_path: Path, text: str, message: str):
    (tmp_path / "m.toml").write_text(text, encoding="utf-8")
    start = time.process_time()
    with pytest.raises(FileError, match=rf"m\.toml: .*{message}"):
        read_toml(tmp_path / "m.toml")
    assert time.process_time() - start < LIMIT


def test_a_key_of_fifty_parts_is_read(tmp_path: Path):
    (tmp_path / "m.toml").write_text("a." * 49 + "b = 1\n# " + "dots . . ." * 50, encoding="utf-8")
    assert list(read_toml(tmp_path / "m.toml")) == ["a"]


@pytest.mark.parametrize("text", ["a" * 20_000, "1, " * 7000], ids=["a word", "many words"])
def test_a_message_quotes_at_most_200_characters_of_a_value(tmp_path: Path, text: str):
    head = 'title = "t"\nprovenance = "chosen"\n[characteristic]\nmodel = "ChouHannaford1996"\n'
    (tmp_path / "m.toml").write_text(f'{head}geometry = "{text}"', encoding="utf-8")
    with pytest.raises(
        UnknownNameError, match=r"m\.toml, \[characteristic\.geometry\], model: no model"
    ) as raised:
        load(tmp_path / "m.toml")
    assert len(str(raised.value)) < len(str(tmp_path)) + 400
    (tmp_path / "s.toml").write_text(
        f'run = {{ duration = "1 s" }}\n[plant]\nmuscle = [{text!r}]', encoding="utf-8"
    )
    with pytest.raises((UnknownNameError, ParameterError)) as raised:
        load_scenario(tmp_path / "s.toml")
    assert text[:500] not in str(raised.value)


def test_a_path_that_is_longer_than_any_name_is_quoted_by_its_ends():
    with pytest.raises(FileError, match=r"^aaaa.*…a*\.toml: ") as raised:
        load("a" * 5000 + ".toml")
    assert len(str(raised.value)) < 300


def wide(folder: Path, columns: int) -> Path:
    """A text of many columns and three rows."""
    head = ",".join(["time [s]", "pressure [kPa]", *(f"channel {i}" for i in range(columns - 2))])
    rows = "".join(",".join([str(i)] * columns) + "\n" for i in range(3))
    (folder / "wide.csv").write_text(f"{head}\n{rows}", encoding="utf-8")
    return folder / "wide.csv"


def test_a_table_of_more_columns_than_any_test_rig_has_is_refused(tmp_path: Path):
    start = time.process_time()
    with pytest.raises(
        ColumnError, match=r"wide\.csv: the table has 50000 columns; at most 5000 are read\. Export"
    ):
        read(wide(tmp_path, 50_000))
    assert len(list(read(wide(tmp_path, 2000))[0])) == 2000
    assert time.process_time() - start < LIMIT


def test_a_run_of_more_rows_than_a_command_writes_is_refused(tmp_path: Path):
    text = (Path(__file__).parents[2] / "examples" / "fill_discharge.toml").read_text(
        encoding="utf-8"
    )
    (tmp_path / "s.toml").write_text(text.replace('"10 ms"', '"0.11 us"'), encoding="utf-8")
    with pytest.raises(
        ParameterError,
        match=r"s\.toml, \[run\]: output_times of 1\.1e-07 s gives 2\.27e\+08 rows in 25 s",
    ):
        load_scenario(tmp_path / "s.toml")


def test_a_message_lists_the_first_columns_of_a_wide_table(tmp_path: Path):
    head = ",".join(f"channel number {i} of the {'long ' * 20} test rig" for i in range(500))
    (tmp_path / "wide.csv").write_text(f"{head}\n" + ",".join(["1"] * 500) + "\n", encoding="utf-8")
    with pytest.raises(ColumnError, match=r"channel number 1 .*…, and 498 more\)") as raised:
        read(tmp_path / "wide.csv")
    assert len(str(raised.value)) < 700


def test_a_message_on_an_unknown_parameter_shows_the_first_of_hundreds_and_the_closest_one(
    tmp_path: Path,
):
    scenario = load_scenario("joint-dmsp-20-matrix")
    plant = scenario.plant
    paths = [leaf.path for leaf in leaves(plant)]
    assert len(", ".join(paths)) > 2000
    wrong = f"{paths[-1]}e"
    refused = (
        lambda: WithSensitivities(plant, ((wrong,),), (1.0,)),
        lambda: write_program(scenario.problem, tmp_path / "c", C99(), tunable=[wrong]),
    )
    for call in refused:
        with pytest.raises(
            ParameterError, match=r"has no parameter .*, and \d+ more\. Did you mean "
        ) as raised:
            call()
        assert len(str(raised.value)) < 700
        assert str(raised.value).endswith(f"Did you mean '{paths[-1]}'?")


def test_a_message_quotes_200_characters_of_a_long_path_with_spaces():
    with pytest.raises(ParameterError, match=r"no parameter 'ab ab .*…") as raised:
        WithSensitivities(load_scenario("joint-dmsp-20-matrix").plant, (("ab " * 2000,),), (1.0,))
    assert len(str(raised.value)) < 900


@pytest.mark.parametrize("name", ["x", "x ", "a b"])
def test_what_stands_between_two_quotations_is_not_cut(name: str):
    between = "; there are " + ", ".join(["sixteen letters."] * 15)
    assert (
        str(ParameterError(f"no key '{name}'{between}. Did you mean 'y'?"))
        == f"no key '{name}'{between}. Did you mean 'y'?"
    )


def test_a_message_quotes_little_of_a_path_of_thousands_of_characters(tmp_path: Path):
    with pytest.raises(FileError, match=r"….*: cannot be written to: File name too long") as raised:
        write_program(
            load_scenario("joint-dmsp-20-matrix").problem, tmp_path / ("a b " * 1500), C99()
        )
    assert len(str(raised.value)) < 400


def test_a_command_quotes_little_of_a_folder_that_the_system_refuses():
    refused = airmuscle("export", "saga2007", "--to", "fmu", "--out", "a b " * 1500)
    assert refused.exit_code == 1
    assert "File name too long" in refused.stderr
    assert len(refused.stderr) < 400


def test_a_text_of_a_page_is_not_proposed_as_the_code_of_a_missing_value(tmp_path: Path):
    (tmp_path / "a.csv").write_text(
        "force [N],pressure [kPa]\n" + f"{'a' * 3000},1\n" * 3, encoding="utf-8"
    )
    with pytest.raises(ColumnError, match=r"3 of 3 cells of .* are no finite numbers") as raised:
        read(tmp_path / "a.csv")
    assert len(str(raised.value)) < 1000
    assert "missing" not in str(raised.value)


def test_a_heading_of_100_000_brackets_is_read_at_once(tmp_path: Path):
    start = time.process_time()
    (tmp_path / "a.csv").write_text(
        f"x = {'[' * 100_000}\nforce [N],pressure [kPa]\n1,2\n2,3\n", encoding="utf-8"
    )
    assert len(read(tmp_path / "a.csv")[0]) == 2
    assert time.process_time() - start < LIMIT
