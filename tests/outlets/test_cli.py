"""The command line: help, exit codes, output that agrees with the library, messages without raw
bytes.

Exit code 0: success. 1: failure (one line on stderr, no traceback, no partial files). 2: wrong
usage. 130: interrupted, also while modules are imported. `list` and `--help` import no more than
they need.
"""

from __future__ import annotations

import csv
import dataclasses
import json
import os
import re
import signal
import subprocess
import sys
import tomllib
import types
from pathlib import Path

import numpy as np
import pytest
from click.testing import Result
from command_line import airmuscle
from scenario_files import BRAID, CIRCUIT
from widths import SAME_LAW, widened

import airmuscle as airmuscle_package
from airmuscle.bench import read_csv
from airmuscle.core import Reference, printable
from airmuscle.errors import UnknownNameError
from airmuscle.files import list_laws, list_plants, list_products, list_valves, load
from airmuscle.outlets.cli import COMMANDS, as_bibtex, print_json, print_table
from airmuscle.papers import run
from airmuscle.physics import ContractileSurface
from airmuscle.report import Chapter, Claim, Equal

MUSCLE = "dmsp-20-300"
SCENARIO = f"""
title = "Fill and discharge"
[plant.muscle.contractile]
model = "ChouHannaford1996"
geometry = {BRAID}
[plant.muscle]
geometry = {BRAID}
damper = {{ model = "LinearDamper", damping = 100.0 }}
{CIRCUIT}
[plant.mechanism]
model = "HangingMass"
mass = "5 kg"
[input]
fill = [["0.1 s", 1], ["0.3 s", 0]]
[run]
duration = "0.5 s"
initial_state = {{ pressure = "1 bar" }}
"""


def shell(*arguments: object, **options: object) -> subprocess.CompletedProcess[str]:
    """The command in a process of its own."""
    command = [sys.executable, "-m", "airmuscle", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, **options)  # type: ignore[call-overload, no-any-return]


def assert_failed(result: Result, message: str) -> None:
    """Exit code 1 and one clear line."""
    assert result.exit_code == 1, result.output
    errors = [line for line in result.stderr.splitlines() if not line.startswith("warning: ")]
    assert len(errors) == 1
    assert re.match(f"error: .*{message}", errors[0]), errors[0]


# Help and usage

NAMES = (
    "reproduce",
    "list",
    "show",
    "diff",
    "cite",
    "evaluate",
    "inspect",
    "check",
    "audit",
    "recipe",
    "fit",
    "approximate",
    "convert",
    "hysteresis",
    "fit-dynamic",
    "fit-regulator",
    "fit-joint",
    "campaign",
    "predict",
    "fit-volume",
    "plan",
    "play",
    "watch",
    "fit-live",
    "size",
    "body",
    "fit-out",
    "route",
    "cam",
    "simulate",
    "study",
    "tune",
    "compare",
    "export",
    "submit",
    "studio",
    "site",
    "schema",
)


def test_the_help_lists_the_commands_in_the_order_of_use():
    listed = re.findall(
        r"^  ([\w-]+)  +(.*)$", airmuscle("--help").output.partition("Commands:")[2], re.MULTILINE
    )
    assert listed == [(row.name, row.summary) for row in COMMANDS]
    assert tuple(row.name for row in COMMANDS) == NAMES


@pytest.mark.parametrize("row", COMMANDS, ids=NAMES)
def test_every_command_has_its_summary_and_examples_in_its_help(row):
    function = row.load()
    assert function.__doc__.splitlines()[0] == row.summary
    result = airmuscle(row.name, "--help")
    assert result.exit_code == 0
    assert row.summary in " ".join(result.output.split())
    assert not re.search(r"<(str|path|int|float|list|int range)\b", result.output), (
        "a type of Python"
    )
    assert re.search(rf"^ +airmuscle {row.name}", result.output, re.MULTILINE)


@pytest.mark.parametrize(
    "arguments",
    widened([["--help"], ["--version"], ["list"]], lambda arguments: arguments != ["--version"]),
)
def test_a_command_module_is_imported_only_when_it_is_called(arguments: list[str]):
    called = {row.module_name for row in COMMANDS if row.name in arguments}
    modules = {row.module_name for row in COMMANDS} - called
    code = (
        f"from airmuscle.outlets.cli import app; app({arguments!r}, standalone_mode=False); import"
        " sys; print(*sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    assert not {f"airmuscle.outlets.cli.{name}" for name in modules} & set(
        done.stdout.splitlines()[-1].split()
    )


def test_an_unknown_command_names_the_nearest_one():
    assert "No such command 'evalute'. Did you mean 'evaluate'?" in airmuscle("evalute").stderr


@pytest.mark.parametrize(
    "arguments",
    [
        ("evalute",),
        ("evaluate",),
        ("evaluate", MUSCLE, "--presure", "3 bar"),
        ("evaluate", MUSCLE, "--pressure", "3 bar"),
        ("evaluate", MUSCLE, "--pressure", "3 bar", "--force", "1 N", "--contraction", "0.1"),
        ("fit", "bench.csv"),
        ("fit", "bench.csv", "--characteristic", "ContractileSurface", "--unit", "bar"),
        ("fit", "bench.csv", "--characteristic", "ContractileSurface", "--degree", "0"),
        ("simulate",),
        ("cite", MUSCLE, "--json", "--bibtex"),
    ],
)
def test_wrong_usage_is_exit_code_2(arguments: tuple[str, ...]):
    result = airmuscle(*arguments)
    assert result.exit_code == 2
    assert "Usage: " in result.stderr


# list, show, cite


def test_list_names_every_entry_with_title_kind_and_trust():
    found = json.loads(airmuscle("list", "--json").output)
    listed = {entry["name"]: entry for entry in found if entry["kind"] != "data set"}
    assert tuple(listed) == (*list_laws(), *list_valves(), *list_plants(), *list_products())
    entry = load(MUSCLE)
    assert listed[MUSCLE] == {
        "name": MUSCLE,
        "title": entry.title,
        "kind": f"muscle, {type(entry.characteristic).__name__}; data set",
        "provenance": f"{entry.provenance}; measured",
        "grade": "measured by Martens and Boblan 2017",
    }
    table = airmuscle("list").output
    assert all(name in table for name in list_laws())


@pytest.mark.filterwarnings("ignore::airmuscle.core.errors.AirmuscleWarning")
def test_list_calls_a_muscle_what_can_be_simulated():
    for entry in json.loads(airmuscle("list", "--json").output):
        if entry["kind"].startswith("muscle"):
            assert load(entry["name"]).muscle.geometry.resting_length > 0
        elif entry["kind"].startswith("characteristic"):
            with pytest.raises(
                UnknownNameError,
                match=(
                    r"is a characteristic, not a muscle; it lacks a (\[geometry\]|law solved for"
                    r" the force)"
                ),
            ):
                _ = load(entry["name"]).muscle


def test_list_names_the_data_sets_that_fit_takes():
    found = json.loads(airmuscle("list", "--json").output)
    data = {
        entry["name"]: entry["provenance"] for entry in found if entry["kind"].endswith("data set")
    }
    assert data[MUSCLE] == "printed; measured"
    assert data["festo-tool-dmsp-20"] == "secondary source"


def test_show_gives_parameters_sources_and_checks():
    shown = json.loads(airmuscle("show", MUSCLE, "--json").output)["entry"]
    parameters = {p["parameter"]: p for p in shown["parameters"]}
    length = parameters["characteristic.geometry.resting_length"]
    assert (length["value"], length["unit"], length["symbol"]) == (0.3, "m", "L_0")
    assert shown["checks"][0]["source"]
    assert any("Martens" in reference for reference in shown["references"])
    text = airmuscle("show", MUSCLE).output
    assert all(
        word in text
        for word in ("L_0", "0.3", "length between the fittings", "Martens", "Provenance: printed")
    )


def test_show_leaves_out_the_middle_of_long_lists():
    long = next(
        n
        for n in list_laws()
        if len(json.loads(airmuscle("show", n, "--json").stdout)["entry"]["parameters"]) > 60
    )
    text = airmuscle("show", long).output
    assert re.search(r"^\.\.\. \d+ more *$", text, re.MULTILINE)
    assert len(text.splitlines()) < 60


def test_a_unique_beginning_of_a_name_is_enough_and_others_are_refused():
    assert airmuscle("show", "dmsp-20").output == airmuscle("show", MUSCLE).output
    assert_failed(airmuscle("show", "dmsp"), "'dmsp' is ambiguous: dmsp-10-250, dmsp-20-300")
    assert_failed(airmuscle("show", "dmps-20-300"), r".*Did you mean 'dmsp-20-300'\?")
    assert_failed(airmuscle("show", "no/such.toml"), "no/such.toml: there is no such file")


def test_a_folder_in_the_place_of_its_muscle_file_names_the_file(tmp_path: Path, monkeypatch):
    (tmp_path / "fit").mkdir()
    (tmp_path / "fit" / "muscle.toml").touch()
    monkeypatch.chdir(tmp_path)
    assert_failed(airmuscle("show", "fit"), ".* 'fit' is a folder; write fit/muscle.toml")
    assert_failed(airmuscle("predict", "fit", "x.csv"), "fit: is a folder; write fit/muscle.toml")
    assert_failed(
        airmuscle("show", tmp_path),
        ".*is a folder; it contains neither muscle.toml nor scenario.toml",
    )
    assert_failed(
        airmuscle("export", "dmsp-20-300", "--to", "c"),
        "dmsp-20-300: there is no such file, .* plants are arm-",
    )


def test_cite_prints_each_source_in_three_ways():
    found = json.loads(airmuscle("cite", MUSCLE, "--json").output)
    assert "martens-boblan-2017" in [source["key"] for source in found]
    assert "doi:10.3390/act6040033" in airmuscle("cite", MUSCLE).output
    assert airmuscle("cite", MUSCLE, "--bibtex").output.count("@misc{") == len(found)


def test_bibtex_joins_authors_and_escapes_what_tex_would_take():
    source = Reference(
        "a b", "Chou, C.-P., Hannaford, B. et al.", "p & q_1 at 5 %", "J. X", 1996, "10.1/x"
    )
    assert (
        as_bibtex(source)
        == "@misc{a-b,\n  author = {Chou, C.-P. and Hannaford, B. and others},\n  title = {{p \\&"
        " q\\_1 at 5 \\%}},\n  howpublished = {J. X},\n  year = {1996},\n  doi = {10.1/x},\n}"
    )


# solve


@pytest.mark.parametrize("wanted", ["pressure", "contraction", "force"])
def test_any_two_give_the_third(wanted: str):
    law = load(MUSCLE).characteristic
    point = {"pressure": 3e5, "contraction": 0.12, "force": float(law.force(3e5, 0.12))}
    texts = {
        "pressure": "300 kPa",
        "contraction": "12 %",
        "force": f"{point['force'] / 1e3!r} kN",
    }
    given = [f"--{name}={text}" for name, text in texts.items() if name != wanted]
    solved = json.loads(airmuscle("evaluate", MUSCLE, *given, "--json").output)["evaluation"]
    assert solved["solved"] == wanted
    assert {name: solved[name] for name in point} == pytest.approx(point, rel=1e-9)
    assert solved["inside_the_validity_range"] is True
    assert solved["stiffness_per_contraction"] == pytest.approx(
        float(law.stiffness(3e5, 0.12)), rel=1e-6
    )
    assert solved["stiffness"] == pytest.approx(float(law.stiffness(3e5, 0.12)) / 0.3, rel=1e-6)
    assert (solved["units"]["stiffness"], solved["units"]["force"]) == ("N/m", "N")


def test_another_value_of_a_parameter_is_set_by_its_path():
    given = ("saga2007", "--pressure=1 bar", "--contraction=10 %")
    changed = airmuscle("evaluate", *given, "--set", "characteristic.slope_factor=2", "--json")
    law = dataclasses.replace(load("saga2007").characteristic, slope_factor=2.0)
    assert json.loads(changed.stdout)["evaluation"]["force"] == pytest.approx(
        float(law.force(1e5, 0.1)), rel=1e-12
    )
    refused = airmuscle("evaluate", *given, "--set", "characteristic.slope=2")
    assert refused.exit_code == 1
    error = refused.stderr.splitlines()[-1]
    assert error.startswith(
        "error: saga2007 has no parameter 'characteristic.slope'; its parameters are"
        " characteristic."
    )
    assert error.endswith("Did you mean 'characteristic.slope_factor'?")
    wrong = airmuscle(
        "evaluate", MUSCLE, "--pressure=1 bar", "--contraction=.1", "--set", "geometry.radius=2 bar"
    )
    assert "geometry.radius" in wrong.stderr.splitlines()[-1], wrong.stderr


def test_plain_bar_is_gauge_and_bara_is_absolute():
    gauge, absolute = (
        json.loads(
            airmuscle(
                "evaluate", MUSCLE, "--pressure", text, "--contraction", "0.1", "--json"
            ).output
        )["evaluation"]["pressure"]
        for text in ("3 bar", "3 bara")
    )
    assert (gauge, absolute) == (3e5, 3e5 - 101_325.0)
    assert re.search(
        r"pressure +300 kPa +gauge",
        airmuscle("evaluate", MUSCLE, "--pressure=3 bar", "--contraction=.1").output,
    )


def test_the_chart_and_its_data_stand_in_the_folder(tmp_path: Path):
    text = airmuscle("evaluate", MUSCLE, "--pressure=3.00125 bar", "--contraction=.1").output
    assert "300.125 kPa" in text
    assert re.search(r"force +\d{3}(\.\d)? N +solved", text), text
    result = airmuscle(
        "evaluate", MUSCLE, "--pressure=3 bar", "--force=100 N", "--out", tmp_path / "chart"
    )
    assert result.exit_code == 0
    assert sorted(path.name for path in (tmp_path / "chart").iterdir()) == [
        "isobars.csv",
        "isobars.png",
    ]
    assert (tmp_path / "chart" / "isobars.png").read_bytes().startswith(b"\x89PNG")
    with (tmp_path / "chart" / "isobars.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    law = load(MUSCLE).characteristic
    for row in rows[::40]:
        wanted = law.force(4e5, float(row["contraction [1]"]))
        assert float(row["force at 400 kPa [N]"]) == pytest.approx(float(wanted), abs=1e-9)


@pytest.mark.filterwarnings("ignore::airmuscle.core.errors.AirmuscleWarning")
@pytest.mark.parametrize(
    "name",
    widened(list_laws(), lambda name: name not in {*SAME_LAW, "saga2007-exact"}),
    ids=list_laws(),
)
def test_every_entry_has_a_chart(tmp_path: Path, name: str):
    entry = load(name)
    low, high = (
        entry.validity_range.pressure
        if entry.validity_range
        else entry.characteristic.pressure_range
    )
    pressure = 0.5 * (low + high)
    contraction = (
        sum(entry.validity_range.contraction) / 2
        if entry.validity_range
        else entry.characteristic.contraction(pressure, 100.0)
    )
    given = (f"--pressure={pressure} Pa", f"--contraction={contraction!r}")
    result = airmuscle("evaluate", name, *given, "--out", tmp_path)
    assert result.exit_code == 0, result.stderr
    with (tmp_path / "isobars.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    forces = [
        float(cell) for row in rows for key, cell in row.items() if key.startswith("force") and cell
    ]
    assert len(rows) >= 61
    assert len(forces) > len(rows), "more than one isobar has values"
    assert min(forces) >= 0.0, "a muscle pulls"


def test_a_point_outside_the_data_is_a_warning():
    inside, outside = (
        airmuscle("evaluate", "tondu-lopez", f"--pressure={p} kPa", "--contraction=0.1", "--json")
        for p in (300, 750)
    )
    assert inside.stderr == ""
    assert re.match(
        r"warning: the operating point is outside the validity range .*50 to 600 kPa",
        outside.stderr,
    )
    assert json.loads(outside.stdout)["evaluation"]["inside_the_validity_range"] is False


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (("--pressure=3 kg", "--force=1 N"), "--pressure: unit 'kg' cannot be converted to 'Pa'"),
        (("--pressure=3", "--force=1 N"), "--pressure: '3' has no unit; write it like '3 bar'"),
        (
            ("--pressure=-2 bar", "--contraction=0.1"),
            "a gauge pressure of -200 kPa is not above absolute vacuum",
        ),
        (
            ("--pressure=3 bar", "--force=9 kN"),
            "no contraction in the range .* is in equilibrium with 9000 N at 300 kPa",
        ),
    ],
)
def test_a_request_without_an_answer_says_why_and_writes_nothing(
    tmp_path: Path, given: tuple[str, ...], message: str
):
    assert_failed(airmuscle("evaluate", MUSCLE, *given, "--out", tmp_path / "chart"), message)
    assert list(tmp_path.iterdir()) == []


# fit


def a_bench_file(path: Path) -> ContractileSurface:
    """Writes points of a known surface of degree 2 on a grid, lengths in mm, pressures in bar,
    absolute.
    """
    known = ContractileSurface(
        (300.0, -250.0, 40.0, 200.0, -60.0, 10.0), 1e5, 5e5, 0.0, 0.2, 0.0, 5000.0, 2
    )
    pressures, contractions = (
        g.ravel() for g in np.meshgrid(np.linspace(1e5, 5e5, 5), np.linspace(0.0, 0.2, 7))
    )
    forces = known.force(pressures, contractions)
    lines = [
        f"{p / 1e5 + 1.01325!r},{300.0 * (1.0 - c)!r},{f!r}"
        for p, c, f in zip(pressures.tolist(), contractions.tolist(), forces.tolist(), strict=True)
    ]
    path.write_text("\n".join(["pressure [bara],length [mm],force [N]", *lines]), encoding="utf-8")
    return known


def test_fit_finds_the_muscle_that_made_the_data_and_writes_it(tmp_path: Path):
    known = a_bench_file(tmp_path / "bench.csv")
    law = ("--characteristic", "ContractileSurface", "--degree", 2, "--resting-length", "300 mm")
    result = airmuscle("fit", tmp_path / "bench.csv", *law, "--out", tmp_path / "fit")
    assert result.exit_code == 0, result.output
    assert result.stdout.splitlines()[-1] == f"report: {tmp_path / 'fit' / 'report.html'}"
    entry = load(tmp_path / "fit" / "muscle.toml")
    assert entry.provenance == "fitted"
    assert entry.characteristic.coefficients == pytest.approx(known.coefficients, abs=1e-6)
    assert entry.validity_range is not None
    assert entry.validity_range.pressure == pytest.approx((1e5, 5e5))
    written = {
        p.relative_to(tmp_path / "fit").as_posix()
        for p in (tmp_path / "fit").rglob("*")
        if p.is_file()
    }
    assert {
        "report.html",
        "muscle.toml",
        "figures/isobars.svg",
        "figures/errors.png",
        "data/rows.csv",
    } <= written
    solved = airmuscle(
        "evaluate",
        tmp_path / "fit" / "muscle.toml",
        "--pressure=3 bar",
        "--contraction=0.1",
        "--json",
    )
    assert json.loads(solved.stdout)["evaluation"]["force"] == pytest.approx(
        float(known.force(3e5, 0.1))
    )


def test_fit_starts_from_a_library_entry_and_keeps_what_is_fixed(tmp_path: Path):
    held = ("--fix", "c0", "--fix", "c3", "--robust", "10 N")
    result = airmuscle(
        "fit", MUSCLE, "--characteristic", MUSCLE, *held, "--out", tmp_path, "--json"
    )
    fitted = json.loads(result.stdout)["fit"]
    assert {p["parameter"] for p in fitted["parameters"]}.isdisjoint({"c0", "c3"})
    assert 0.99 < fitted["R2"] <= 1.0
    before = load(MUSCLE).characteristic
    after = load(tmp_path / "muscle.toml").characteristic
    assert (after.c0, after.c3) == (before.c0, before.c3)
    assert after.c1 != before.c1


@pytest.mark.parametrize(
    ("rows", "options", "message"),
    [
        (36, ("--characteristic", "Saga2007"), "--characteristic: Saga2007 needs initial values"),
        (
            36,
            ("--characteristic", "ContractileSurfac"),
            (
                "no muscle or law 'ContractileSurfac'.* Or name a law: Borz.*, TonduLopez2000,"
                " .*mean 'ContractileSurface'"
            ),
        ),
        (
            36,
            ("--characteristic", "Braid"),
            "--characteristic: Braid is not a characteristic; there are Borz",
        ),
        (
            20,
            ("--characteristic", "ContractileSurface"),
            ".*has 21 free parameters, but only 19 rows are measured values",
        ),
        (
            36,
            ("--characteristic", "ContractileSurface", "--robust", "5 mm"),
            "--robust: unit 'mm' cannot be converted to 'N'",
        ),
        (
            36,
            ("--characteristic", "ContractileSurface", "--resting-length", "3 N"),
            ".*resting_length.*'N'",
        ),
    ],
)
def test_a_fit_that_cannot_be_says_why_and_writes_nothing(
    tmp_path: Path, rows: int, options: tuple[str, ...], message: str
):
    bench = tmp_path / "bench.csv"
    a_bench_file(bench)
    bench.write_text(
        "\n".join(bench.read_text(encoding="utf-8").splitlines()[:rows]), encoding="utf-8"
    )
    length = () if "--resting-length" in options else ("--resting-length", "300 mm")
    assert_failed(airmuscle("fit", bench, *options, *length, "--out", tmp_path / "fit"), message)
    assert list(tmp_path.iterdir()) == [bench]


def test_a_missing_file_is_named(tmp_path: Path):
    result = airmuscle(
        "fit",
        tmp_path / "none.csv",
        "--characteristic",
        "ContractileSurface",
        "--out",
        tmp_path / "fit",
    )
    assert_failed(result, r".*none\.csv")


# simulate


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    path = tmp_path / "scenario.toml"
    path.write_text(SCENARIO, encoding="utf-8")
    return path


def test_simulate_writes_a_recording_that_reads_back(scenario: Path, tmp_path: Path):
    result = airmuscle("simulate", scenario, "--out", tmp_path / "run")
    assert result.exit_code == 0, result.output
    assert result.stdout.splitlines()[-1] == f"report: {tmp_path / 'run' / 'report.html'}"
    assert "[1]" not in result.stdout, "a unit of a ratio"
    recording = read_csv(tmp_path / "run" / "recording.csv")
    assert recording["time"][-1] == 0.5
    assert recording["pressure"][0] == pytest.approx(1e5, rel=1e-9)
    assert recording["pressure"].max() > 1.2e5, "the fill valve was open"
    shut = recording["time"] > 0.31
    assert np.ptp(recording["air_mass"][shut]) < 1e-12, "and then shut"
    assert (tmp_path / "run" / "figures" / "run.svg").exists()


def test_a_run_that_fails_keeps_what_it_has_and_says_why(scenario: Path, tmp_path: Path):
    """A valve of half a metre fills the muscle in a millisecond and throws a light load by the
    length of the muscle.
    """
    example = (Path(__file__).resolve().parents[2] / "examples" / "fill_discharge.toml").read_text(
        encoding="utf-8"
    )
    torn = (
        example.replace("2.6167e-9", "9e-6")
        .replace('gas = "Isothermal"', "")
        .replace('"10 kg"', '"5 kg"')
    )
    scenario.write_text(torn, encoding="utf-8")
    result = airmuscle("simulate", scenario, "--out", tmp_path / "run")
    assert result.exit_code == 1
    kept, error = result.stderr.splitlines()[-2:]
    assert kept == f"partial results were written to {tmp_path / 'run'}"
    found = re.fullmatch(
        r"error: the run ended at (\S+) of 25 s because .* steps, at air_mass .* kg, .*\. \S+ .*\.",
        error,
    )
    assert found, error
    lines = (tmp_path / "run" / "recording.csv").read_text(encoding="utf-8").splitlines()
    rows = np.array(
        [[float(cell) for cell in line.split(",")] for line in lines if line[0].isdigit()]
    )
    assert 5.0 < rows[-1, 0] <= float(found[1])
    assert np.isfinite(rows).all()
    page = (tmp_path / "run" / "report.html").read_text(encoding="utf-8").replace("\u00a0", " ")
    assert "Simulation of 25 s, ended early at " in page
    assert f"<p>{error.removeprefix('error: ').capitalize()[:30]}" in page, "the last note says why"


def test_the_report_of_a_run_shows_inputs_parameters_sources_and_notes(
    scenario: Path, tmp_path: Path
):
    named = re.sub(
        r"\[plant.muscle.contractile\](.|\n)*?damper",
        '[plant.muscle]\nlibrary = "dmsp-20"\ndamper',
        SCENARIO,
    )
    driver = (
        '[input.drivers]\nfill = [{ model = "PWM", frequency = "50 Hz" }, { model ='
        ' "SolenoidDriver", opening_delay = "1 ms" }]'
    )
    named = named.replace('pressure = "1 bar" }', 'pressure = "0 bar" }')
    scenario.write_text(f"{named}\n{driver}\n[output]\ncolumns = ['force']", encoding="utf-8")
    result = airmuscle("simulate", scenario, "--out", tmp_path / "run")
    assert result.exit_code == 0, result.output
    page = (tmp_path / "run" / "report.html").read_text(encoding="utf-8").replace("\u00a0", " ")
    for text in (
        "Simulation of 0.5 s. ",
        " rows; recording.csv has all columns.",
        "was outside the validity range of its characteristic in pressure",
        "Inputs applied to the plant; dashed: commands to the drivers.",
        (
            "fill 0 before 0.1 s, 1 from 0.1 s, 0 from 0.3 s; drivers: fill: PWM(frequency=50.0,"
            " smallest_pulse=0.0), SolenoidDriver(opening_delay="
        ),
        "<td>muscle.contractile.wall_thickness</td>",
        "Rodas4(rtol=1e-06)",
        "Martens",
    ):
        assert text in page, text
    assert list(read_csv(tmp_path / "run" / "recording.csv")) == ["time", "force"]
    assert {p.name for p in (tmp_path / "run" / "figures").iterdir()} == {
        "run.svg",
        "run.png",
        "inputs.svg",
        "inputs.png",
    }


def test_simulate_prints_json(scenario: Path, tmp_path: Path):
    found = json.loads(airmuscle("simulate", scenario, "--out", tmp_path / "run", "--json").stdout)[
        "simulation"
    ]
    assert found["title"] == "Fill and discharge"
    assert found["ranges"][0] == {
        "column": "time",
        "min": 0.0,
        "max": 0.5,
        "last": 0.5,
        "unit": "s",
    }


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('duration = "0.5 s"', "", ".*duration"),
        ("critical_ratio", "critical_ration", ".*critical_ration"),
        ('mass = "5 kg"', 'mass = "5 N"', ".*unit 'N' cannot be converted to 'kg'"),
        ("fill = [[", "fil = [[", r".*no input 'fil'.*Did you mean 'fill'\?"),
        ('mass = "5 kg"', 'mass = "5000 kg"', ".*"),
    ],
)
def test_a_bad_scenario_says_where_and_writes_nothing(
    scenario: Path, tmp_path: Path, old: str, new: str, message: str
):
    assert old in SCENARIO
    scenario.write_text(SCENARIO.replace(old, new), encoding="utf-8")
    assert_failed(airmuscle("simulate", scenario, "--out", tmp_path / "run"), message)
    assert list(tmp_path.iterdir()) == [scenario]


# reproduce


@pytest.fixture
def one_paper(monkeypatch: pytest.MonkeyPatch) -> types.ModuleType:
    """A paper of one chapter in place of the true ones, which take seconds."""
    module = types.ModuleType("paper_of_a_test")
    rings = [
        Claim("Saga 2007", "rings " * 40, Equal(4.0), value, "mm", case=f"line {value}")
        for value in (5.0, 6.0)
    ]
    claims = (*rings, Claim("Saga 2007", "strain", None, 0.1, "1"))
    answers = (("May I use it?", "No."),)
    module.chapter = lambda: Chapter(
        "Saga 2007", "Straight fibres", "Text.", claims, answers=answers
    )  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.setattr(run, "PAPERS", {"saga2007": module.__name__})
    return module


@pytest.mark.usefixtures("one_paper")
def test_reproduce_prints_the_claims_and_names_the_report_last(tmp_path: Path):
    result = airmuscle("reproduce", "saga", "--out", tmp_path / "report")
    assert result.exit_code == 0, "a claim that differs is a result, not a failure"
    assert result.stdout.splitlines()[-1] == f"report: {tmp_path / 'report' / 'report.html'}"
    assert "Straight fibres\nMay I use it? No.\n" in result.stdout
    lines = [line for line in result.stdout.splitlines() if "rings" in line]
    assert len(lines) == 1, "one line a claim, which is cut"
    assert re.fullmatch(r"(rings )+… +4 +5 to 6 mm +✗ differs *", lines[0])
    assert re.search(r"\nstrain +– +0.1 +– not printed", result.stdout)
    assert "\n2 claims: 1 differs, 1 not printed\n" in result.stdout
    assert [
        c["verdict"] for c in json.loads((tmp_path / "report" / "claims.json").read_text())
    ] == [
        "differs",
        "differs",
        "not printed",
    ]


def test_an_interrupted_reproduction_is_polite(tmp_path: Path, one_paper: types.ModuleType):
    def interrupted() -> Chapter:
        raise KeyboardInterrupt

    one_paper.chapter = interrupted  # type: ignore[attr-defined]
    result = airmuscle("reproduce", "--out", tmp_path / "report")
    assert result.exit_code == 130
    assert result.stderr.endswith("interrupted\n")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.usefixtures("one_paper")
def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path):
    (tmp_path / "taken").write_text("a file")
    result = airmuscle("reproduce", "--out", tmp_path / "taken")
    assert_failed(result, ".*taken: cannot be written to: .*Specify a folder with write permission")
    assert (tmp_path / "taken").read_text() == "a file"


# The command in a process of its own


def test_a_process_ends_with_the_documented_exit_codes():
    well = shell("evaluate", MUSCLE, "--pressure", "3 bar", "--force", "100 N", "--json")
    assert (well.returncode, well.stderr) == (0, "")
    assert json.loads(well.stdout)["evaluation"]["solved"] == "contraction"
    failed = shell("show", "no-such-muscle")
    assert (failed.returncode, failed.stdout) == (1, "")
    assert failed.stderr.startswith("error: no library entry 'no-such-muscle'")
    assert "Traceback" not in failed.stderr
    wrong = shell("evaluate")
    assert wrong.returncode == 2
    assert "Usage: airmuscle evaluate" in wrong.stderr


def test_list_starts_without_what_it_does_not_need():
    code = (
        "import sys; from airmuscle.outlets.cli import app; app(['list', '--json'],"
        " standalone_mode=False)"
    )
    done = subprocess.run(
        [sys.executable, "-c", f"{code}; print(*sys.modules)"],
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.returncode == 0, done.stderr
    loaded = {name.partition(".")[0] for name in done.stdout.splitlines()[-1].split()}
    assert not loaded & {"matplotlib", "scipy", "numba", "pandas", "jinja2", "pint", "rich"}


def test_every_example_of_the_help_is_valid_toml_where_it_names_a_file():
    root = Path(__file__).resolve().parents[2]
    named = re.findall(r"simulate (examples/\S+\.toml)", airmuscle("simulate", "--help").output)
    assert named
    for name in named:
        assert "plant" in tomllib.loads((root / name).read_text(encoding="utf-8"))


# Interruptions

PATHS = {**os.environ, "PYTHONPATH": str(Path(airmuscle_package.__file__).parents[1])}

SLOW_IMPORT = """
import importlib.abc, signal, sys, time
from airmuscle.__main__ import main

def wait_for_the_signal():
    print("importing", flush=True)
    for _ in range(6000):  # one long sleep would miss a signal that arrives just before it
        time.sleep(0.01)

class Destroyed:
    def __del__(self):
        wait_for_the_signal()

class SlowFinder(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path, target=None):
        if name == MODULE:
            if KIND == "discarded by a destructor":
                return Destroyed() and None
            try:
                wait_for_the_signal()
            except KeyboardInterrupt:
                if KIND == "extension":
                    raise ImportError("initialization failed") from None
                if KIND == "module":
                    raise

MODULE, KIND = sys.argv[1:]
sys.meta_path.insert(0, SlowFinder())
signal.signal(signal.SIGINT, signal.default_int_handler)  # it is ignored where the tests run in the background
sys.argv[1:] = ["evaluate", "dmsp-20", "--pressure", "3 bar", "--force", "100 N"]
main()
"""


@pytest.mark.skipif(os.name == "nt", reason="SIGINT cannot be sent to one process")
@pytest.mark.parametrize(
    ("module", "kind"),
    [
        pytest.param(module, kind, marks=[] if (i - k) % 4 == 0 else pytest.mark.slow)
        for i, module in enumerate(
            (
                "click",
                "airmuscle.outlets.cli.commands",
                "airmuscle.outlets.cli.evaluate",
                "airmuscle.report.text",
            )
        )
        for k, kind in enumerate(
            ("module", "extension", "exception discarded", "discarded by a destructor")
        )
    ],
)
def test_an_interrupted_import_is_one_line_and_exit_code_130(module: str, kind: str):
    assert_interrupted(module, kind)


@pytest.mark.skipif(os.name == "nt", reason="SIGINT cannot be sent to one process")
@pytest.mark.parametrize("module", ["airmuscle.outlets.cli", "airmuscle.outlets.cli.interruption"])
def test_an_interruption_before_the_handler_is_installed_is_no_traceback(module: str):
    assert_interrupted(module, "module")


def test_the_entry_point_imports_nothing_before_interruptions_are_handled():
    code = (
        "import sys; before = set(sys.modules); import airmuscle.__main__; print(*(set(sys.modules)"
        " - before))"
    )
    done = subprocess.run(
        [sys.executable, "-S", "-c", code], capture_output=True, text=True, timeout=60, env=PATHS
    )
    assert done.returncode == 0, done.stderr
    loaded = set(done.stdout.split())
    assert {name for name in loaded if name.startswith("airmuscle")} == {
        "airmuscle",
        "airmuscle.__main__",
        "airmuscle.core",
        "airmuscle.core.stubs",
    }
    assert not loaded & {"typing", "re", "signal", "enum", "contextlib", "threading"}


def test_the_console_script_calls_this_entry_point():
    project = tomllib.loads(
        (Path(__file__).resolve().parents[2] / "pyproject.toml").read_text(encoding="utf-8")
    )
    assert project["project"]["scripts"] == {"airmuscle": "airmuscle.__main__:main"}


def assert_interrupted(module: str, kind: str) -> None:
    command = [sys.executable, "-c", SLOW_IMPORT, module, kind]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert "importing\n" in iter(process.stdout.readline, "")
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)
    assert (process.returncode, errors) == (130, "interrupted\n")


# Messages without raw bytes


def assert_printable(text: str) -> None:
    assert [c for c in text if not c.isprintable() and c != "\n"] == []


@pytest.mark.parametrize(
    ("command", "suffix"),
    [
        ("fit --characteristic ContractileSurface", "csv"),
        ("inspect", "csv"),
        ("inspect", "txt"),
        ("hysteresis", "tdms"),
        ("show", "toml"),
        ("simulate", "toml"),
        ("study", "toml"),
        ("tune", "toml"),
        ("fit-dynamic", "toml"),
    ],
)
@pytest.mark.parametrize(
    "content",
    [bytes(range(256)) * 8, b"\x1b[2J\x07 = \x1b]0;title\x07\n" * 20],
    ids=["all", "escapes"],
)
def test_binary_input_is_not_printed_raw(tmp_path: Path, command: str, suffix: str, content: bytes):
    file = tmp_path / f"input\x1b[31m.{suffix}"
    file.write_bytes(content)
    result = airmuscle(*command.split(), file)
    assert result.exit_code == 1, result.output
    assert result.stderr.startswith("error: ")
    assert_printable(result.output)


def test_control_characters_of_a_file_that_can_be_read_are_escaped_in_tables_json_and_progress(
    tmp_path: Path,
):
    rows = [f"{t},{t}" for t in range(10)]
    (tmp_path / "x.csv").write_text(
        "\n".join(["time [s],my\x1b[2J\x9b [kPa]", *rows]), encoding="utf-8"
    )
    options = ("--column", "2=pressure [kPa]")
    for arguments in ((), options, (*options, "--json")):
        assert_printable(airmuscle("inspect", tmp_path / "x.csv", *arguments).output)


@pytest.mark.parametrize(
    "arguments",
    [
        ["\x1b[31mlist"],
        ["list", "\x1b[31m"],
        ["list", "--\x1b[31m"],
        ["show", "\x1b[31m"],
        ["plan", "x", "--max-pressure", "\x1b"],
    ],
)
def test_control_characters_of_arguments_are_escaped(arguments: list[str]):
    result = airmuscle(*arguments)
    assert result.exit_code in (1, 2)
    assert_printable(result.output)


@pytest.mark.skipif(os.name == "nt", reason="arguments are bytes on POSIX only")
@pytest.mark.parametrize(
    "command",
    [[b"show"], *(pytest.param([name], marks=pytest.mark.slow) for name in (b"simulate", b"list"))],
)
def test_an_argument_that_cannot_be_decoded_is_shown_with_its_bytes(command: list[bytes]):
    done = subprocess.run(
        [sys.executable, "-m", "airmuscle", *command, b"no\xffname"],
        capture_output=True,
        timeout=60,
    )
    assert done.returncode in (1, 2)
    assert b"no\\xffname" in done.stderr
    assert b"Traceback" not in done.stderr


def test_printable_keeps_text_and_escapes_the_rest(capsys: pytest.CaptureFixture[str]):
    assert printable("Hošovský, 5 °C\u202f\t½\n") == "Hošovský, 5 °C\u202f\t½\n"
    assert printable("a\x1b[0m\r\x7f\x9b\udcff\u202e") == "a\\x1b[0m\\r\\x7f\\x9b\\xff\\u202e"
    print_json({"a": "\x1b\x9b\udcff\u202e", "b": float("nan")})
    printed = capsys.readouterr().out
    assert_printable(printed)
    assert json.loads(printed) == {"a": "\x1b\x9b\udcff\u202e", "b": None}
    print_table({"p [kPa]": ["\x1b[2J"], ":smile:": ["[red]x[/red]"]})
    printed = capsys.readouterr().out
    assert_printable(printed)
    assert all(text in printed for text in ("p [kPa]", ":smile:", "\\x1b[2J", "[red]x[/red]"))
