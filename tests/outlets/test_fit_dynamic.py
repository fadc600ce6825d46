"""A dynamic fit from a file: what a simulated record was made with is found, printed, drawn and
written as a scenario.

What the records cannot tell is named with the experiment that would; a study that cannot be is
refused by its place.
"""

from __future__ import annotations

import dataclasses
import json
import pickle
import re
from pathlib import Path

import numpy as np
import pytest
from command_line import airmuscle
from dynamic_study import HELD, STUDY, VALVES, noisy_run, plant_table, run_table, variant

from airmuscle.bench import (
    CrossPrediction,
    InitialValue,
    StartTime,
    describe_cross_predictions,
    read_csv,
    write,
)
from airmuscle.core import leaves
from airmuscle.files import load_dynamic_fit, load_scenario
from airmuscle.physics import HangingMass
from airmuscle.recording import Recording

INPUT = '[input]\nfill = [["0.1 s", 1], ["1 s", 0]]\ndischarge = [["1.3 s", 1]]\n'
WEIGHT = 'model = "HangingMass"\nmass = "10 kg"'
TRUE = {"exponent": 1.25, "damping": 200.0, "conductance": 3e-9}
START = {"exponent": 1.1, "damping": 100.0, "conductance": 4e-9}
ASKED = f"""
[observed]
pressure = "500 Pa"
position = {{ deviation = "50 um", column = "height" }}
[fit]
free = [{VALVES}, "gas.exponent", "muscle.damper.damping"]
own = ["circuit.supply.pressure"]
start_time = "50 ms"
starts = 2
[fit.bounds]
"gas.exponent" = [1.01, 1.4]
"""
RECORD = (
    '[[record]]\nfile = "{}"\nstart_time = "0.2 s"\ninitial_state = {{ pressure = "0.6 bar" }}\n'
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """Two noisy records of one plant, begun 13 ms after and 4 ms before what the study says; the
    second's height is in millimetres, as its heading says."""
    place = tmp_path_factory.mktemp("study")
    truth = plant_table(WEIGHT, **TRUE) + INPUT + run_table("0.6 bar")
    (place / "truth.toml").write_text(truth, encoding="utf-8")
    rng = np.random.default_rng(1)
    for name, shift, heading, factor in (
        ("run1", 0.213, "height", 1.0),
        ("run2", 0.196, "height [mm]", 1e3),
    ):
        run = noisy_run(place / "truth.toml", rng, {"pressure": 500.0, "position": 5e-5})
        columns = {
            "time": run["time"] + shift,
            "pressure": run["pressure"],
            heading: factor * run["position"],
        }
        write(Recording(columns, name), place / f"{name}.csv")
    study = (
        plant_table(WEIGHT, **START)
        + INPUT
        + ASKED
        + RECORD.format("run1.csv")
        + RECORD.format("run2.csv")
    )
    (place / "study.toml").write_text(study, encoding="utf-8")
    return place


def test_what_the_records_were_made_with_is_found_written_and_simulated(folder, tmp_path):
    out = tmp_path / "out"
    result = airmuscle(
        "fit-dynamic", folder / "study.toml", "--profile", "gas.exponent", "--out", out, "--json"
    )
    assert result.exit_code == 0, result.stderr
    said = json.loads(result.stdout)
    found = {
        e["parameter"]: (e["value"], e["standard_error"]) for e in said["dynamic"]["estimates"]
    }
    for name, true in (
        ("circuit.fill.conductance", 3e-9),
        ("gas.exponent", 1.25),
        ("muscle.damper.damping", 200.0),
        ("circuit.supply.pressure of record 2", 5e5),
        ("start time of record 1", 0.213),
        ("start time of record 2", 0.196),
    ):
        value, deviation = found[name]
        assert abs(value - true) < 3.5 * deviation, name
    (row,) = said["profiles"]["profiles"]
    assert row["parameter"] == "gas.exponent"
    low, high = row["95_interval"]
    value, deviation = found["gas.exponent"]
    assert (low, high) == pytest.approx(
        (value - 1.96 * deviation, value + 1.96 * deviation), abs=0.15 * deviation
    )
    positions = [row for row in said["dynamic"]["rms"] if row["quantity"] == "position"]
    assert [(row["record"], row["unit"]) for row in positions] == [
        ("run1.csv", "m"),
        ("run2.csv", "m"),
    ]
    assert [row["rms_residual"] for row in positions] == pytest.approx([5e-5, 5e-5], rel=0.15)
    crossed = [row for row in said["dynamic"]["cross_predictions"] if row["quantity"] == "pressure"]
    assert [row["record"] for row in crossed] == ["run1.csv", "run2.csv"]
    assert all(
        row["rms_error_predicted_by_the_others"] < 2.0 * row["rms_residual_of_the_joint_fit"]
        for row in crossed
    )
    page = (out / "report.html").read_text(encoding="utf-8").replace("\u00a0", " ")
    assert "The records predict each other" in page
    assert all(
        word in page
        for word in ("Record 2: run2.csv", "Profile likelihood", "may be shorter than the dynamics")
    )
    assert {"record-1.svg", "record-2.png", "profiles.svg"} <= {
        p.name for p in (out / "figures").iterdir()
    }
    again = load_scenario(out / "scenario-1.toml")
    assert again.initial_state["position"] == pytest.approx(
        load_scenario(folder / "truth.toml").initial_state["position"], abs=1e-5
    )
    written = {leaf.path: leaf.value for leaf in leaves(again.plant)}
    assert written["circuit.discharge.conductance"] == found["circuit.fill.conductance"][0]
    assert written["circuit.supply.pressure"] == found["circuit.supply.pressure of record 1"][0]
    run = again.simulate()
    measured = read_csv(folder / "run1.csv")
    height = np.interp(
        measured["time"] - found["start time of record 1"][0], run["time"], run["position"]
    )
    assert np.sqrt(np.mean((height - measured["height"]) ** 2)) == pytest.approx(5e-5, rel=0.2)


def test_a_fit_can_be_stored_and_loaded_by_another_process(folder):
    """A campaign keeps the fits of its finished stages; what was compiled is compiled again."""
    study = load_dynamic_fit(folder / "study.toml")
    fit = dataclasses.replace(study, search=dataclasses.replace(study.search, starts=1)).fit()
    again = pickle.loads(pickle.dumps(fit))
    assert again.rms("pressure", 1) == fit.rms("pressure", 1)
    assert again.plant(1) == fit.plant(1)


def prediction(ratio: float) -> CrossPrediction:
    return CrossPrediction("run1.csv", {"pressure": 500.0 * ratio}, {"pressure": 500.0})


def test_cross_predictions_say_whether_the_plant_is_identified():
    assert describe_cross_predictions(()) == ""
    assert "The records predict each other" in describe_cross_predictions([prediction(1.1)])
    said = describe_cross_predictions([prediction(1.1), prediction(4.0)])
    assert "run1.csv is 4 times the residual of the joint fit" in said
    assert "do not identify the plant" in said


def test_three_records_whose_valves_differ_have_standard_errors_of_their_scatter(tmp_path):
    rng = np.random.default_rng(2)
    files = ("a.csv", "b.csv", "c.csv")
    for file, conductance in zip(files, (2.9e-9, 3e-9, 3.1e-9), strict=True):
        (tmp_path / "truth.toml").write_text(
            plant_table(HELD, exponent=1.2, conductance=conductance) + INPUT + run_table("0 bar"),
            encoding="utf-8",
        )
        write(
            Recording(noisy_run(tmp_path / "truth.toml", rng, {"pressure": 500.0}), file),
            tmp_path / file,
        )
    start = plant_table(HELD, exponent=1.2, conductance=4e-9) + STUDY.replace(
        ', "gas.exponent"', ""
    )
    records = "".join(
        f'[[record]]\nfile = "{file}"\ninitial_state = {{ pressure = "0 bar" }}\n' for file in files
    )
    (tmp_path / "study.toml").write_text(start + records, encoding="utf-8")
    done = airmuscle("fit-dynamic", tmp_path / "study.toml", "--out", tmp_path / "fit", "--json")
    result = json.loads(done.stdout)["dynamic"]
    (conductance,) = result["estimates"]
    assert conductance["standard_error"] == pytest.approx(1e-10 / np.sqrt(3.0), rel=0.1)
    assert any("scatter between 3 records" in note for note in result["notes"])


def test_what_cannot_be_told_apart_is_printed_with_its_experiment(folder, tmp_path):
    path = variant(
        folder,
        held=('"HangingMass"\nmass = "10 kg"', '"Isometric"\ncontraction = 0.05'),
        free=(
            f'free = [{VALVES}, "gas.exponent", "muscle.damper.damping"]',
            f'free = [{VALVES}, "muscle.geometry.resting_length"]',
        ),
        bounds=('[fit.bounds]\n"gas.exponent" = [1.01, 1.4]\n', ""),
        observed=('position = { deviation = "50 um", column = "height" }\n', ""),
        one=(RECORD.format("run2.csv"), ""),
    )
    result = airmuscle(
        "fit-dynamic",
        path,
        "--profile",
        "weak",
        "--points",
        2,
        "--starts",
        1,
        "--out",
        tmp_path / "o",
    )
    assert result.exit_code == 0, result.stderr
    assert "rigid vessel of known volume" in " ".join(result.stdout.split())
    assert re.search(r"95 % interval(.|\n)*muscle.geometry.resting_length", result.stdout)
    assert "Parameter combinations that the records do not determine" in (
        tmp_path / "o" / "report.html"
    ).read_text(encoding="utf-8")
    assert (tmp_path / "o" / "scenario.toml").exists()


def test_a_study_says_what_it_was_told(folder):
    path = variant(
        folder,
        start=(
            'start_time = "50 ms"',
            'start_time = "50 ms"\ninitial_state = { pressure = "2 kPa" }\nseed = 3',
        ),
        method=("starts = 2", 'starts = 2\nintegrator = { model = "Rodas4", rtol = 1e-7 }'),
        load=(
            RECORD.format("run2.csv"),
            (
                '[[record]]\nfile = "run2.csv"\nfirst = "0.3 s"\nlast = "1 s"\n[record.input]\nfill'
                ' = [[0, 1]]\n[record.plant.mechanism]\nmodel = "HangingMass"\nmass = "12 kg"\n'
            ),
        ),
    )
    study = load_dynamic_fit(path)
    first, second = study.experiments
    assert study.search.unknowns(study.plant) == (
        "circuit.supply.pressure",
        StartTime(0.05),
        InitialValue("pressure", 2e3),
    )
    assert (study.search.seed, study.search.starts, study.search.bounds) == (
        3,
        2,
        {"gas.exponent": (1.01, 1.4)},
    )
    assert study.search.integrator.rtol == 1e-7
    deviations = {name: deviation for name, (deviation, _) in study.observed.items()}
    assert deviations == pytest.approx({"pressure": 500.0, "position": 5e-5})
    assert (first.plant.mechanism, second.plant.mechanism) == (HangingMass(10.0), HangingMass(12.0))
    assert (second.recording["time"].min(), second.recording["time"].max()) == pytest.approx(
        (0.3, 1.0), abs=0.011
    )
    assert second.initial_conditions.known["pressure"] == pytest.approx(
        np.median(second.recording["pressure"][:3])
    )
    assert first.initial_conditions.known["pressure"] == 6e4
    assert second.command.segments(("fill", "discharge"), 0.0, 1.0).values.tolist() == [[1.0, 0.0]]


UNLOADED = """
[plant]
[plant.muscle.contractile]
model = "VirtualWork"
geometry = { model = "Vessel", enclosed_volume = "100 mL" }
[plant.muscle]
geometry = { model = "Vessel", enclosed_volume = "100 mL" }
wall = { model = "SwellingWall", growth_volume = 1e-4, midpoint_pressure = "150 kPa", pressure_width = "50 kPa", time_constant = "0.2 s" }
[plant.circuit]
model = "WithTubes"
[plant.circuit.circuit]
model = "FillDischarge"
supply = { model = "Supply", pressure = "6 bar" }
fill = { model = "Valve", conductance = 5e-10, critical_ratio = 0.4 }
discharge = { model = "Valve", conductance = 0.0, critical_ratio = 0.3 }
[plant.circuit.tube]
model = "Tube"
volume = 2e-5
orifice = { model = "Valve", conductance = 1.3e-9, critical_ratio = 0.3 }
[plant.mechanism]
model = "Isometric"
contraction = 0.0
[input]
fill = [[0, 1]]
[observed]
"tube.pressure" = { deviation = "500 Pa", column = "pressure" }
[fit]
free = ["circuit.circuit.fill.conductance"]
[[record]]
file = "run1.csv"
"""


def test_an_unloaded_muscle_behind_a_tube_is_fitted_and_written_too(folder, tmp_path):
    (folder / "fill.toml").write_text(UNLOADED, encoding="utf-8")
    study = load_dynamic_fit(folder / "fill.toml")
    (experiment,) = study.experiments
    assert experiment.initial_conditions.known["pressure"] == pytest.approx(
        np.median(experiment.recording["pressure"][:3])
    )
    result = airmuscle("fit-dynamic", folder / "fill.toml", "--out", tmp_path / "out", "--json")
    assert result.exit_code == 0, result.stderr
    (found,) = json.loads(result.stdout)["dynamic"]["estimates"]
    plant = load_scenario(tmp_path / "out" / "scenario.toml").plant
    assert plant.circuit.circuit.fill.conductance == found["value"]
    assert plant.muscle.wall == study.plant.muscle.wall


def test_a_command_may_stand_in_a_file_and_is_found_from_the_written_scenario(folder, tmp_path):
    (folder / "valve.csv").write_text(
        "time [s],fill [1],discharge"
        " [1]\n0,0,0\n0.1,0,0\n0.11,1,0\n1,1,0\n1.01,0,0\n1.3,0,0\n1.31,0,1\n",
        encoding="utf-8",
    )
    path = variant(
        folder,
        file=(
            'fill = [["0.1 s", 1], ["1 s", 0]]\ndischarge = [["1.3 s", 1]]',
            'file = "valve.csv"',
        ),
        once=(RECORD.format("run2.csv"), ""),
        few=("starts = 2", "starts = 1"),
    )
    result = airmuscle("fit-dynamic", path, "--out", tmp_path / "out")
    assert result.exit_code == 0, result.stderr
    command = load_scenario(tmp_path / "out" / "scenario.toml").problem.input
    found = command.segments(("fill", "discharge"), 0.0, 2.0).inputs_at(
        np.array([0.05, 0.5, 1.5]), 0.0
    )
    assert found[:, 0].tolist() == [0.0, 1.0, 0.0]


REFUSED = {
    "no record": ('[[record]]\nfile = "run1.csv"', "[[recor]]", "unknown key 'recor'"),
    "a file that is not there": ('"run1.csv"', '"run3.csv"', "run3.csv"),
    "an unknown path": ('"gas.exponent", "m', '"gas.exponen", "m', "no parameter 'gas.exponen'"),
    "an unknown path in bounds": (
        '"gas.exponent" =',
        '"gas.exponen" =',
        "Did you mean 'gas.exponent'",
    ),
    "bounds upside down": (
        "[1.01, 1.4]",
        "[1.4, 1.01]",
        "the minimum must be less than the maximum",
    ),
    "bounds beyond what can be": ("[1.01, 1.4]", "[1.0, 1.4]", "allowed range: 1.001 to 1.667"),
    "one bound": ("[1.01, 1.4]", "1.4", "it must be [minimum, maximum]"),
    "bounds of another kind": ("[1.01, 1.4]", '["1 m", 1.4]', "unit 'm' cannot be converted to"),
    "a start beyond its bounds": (
        "[1.01, 1.4]",
        "[1.2, 1.4]",
        "the initial value of gas.exponent is 1.1, outside its bounds 1.2 to 1.4",
    ),
    "a deviation of zero": (
        '"500 Pa"',
        '"0 Pa"',
        "[observed], pressure is '0 Pa'; it must be greater than zero",
    ),
    "a deviation of another kind": (
        '"500 Pa"',
        '"500 mm"',
        "[observed], pressure: unit 'mm' cannot be converted to 'Pa'",
    ),
    "a column that is not there": (
        '"height"',
        '"heigth"',
        "no column 'heigth'; the columns are time, pressure, height",
    ),
    "no such output": (
        'position = { deviation = "50 um"',
        "heading = { deviation = 5e-5",
        "Plant has no state or output 'heading'",
    ),
    "a margin of zero": ('"50 ms"', '"0 ms"', "start_time is '0 ms'; it must be greater than zero"),
    "no whole number": ("starts = 2", "starts = 2.5", "starts is 2.5; it must be an integer"),
    "a command of no input": ("discharge = [[", "exhaust = [[", "no input 'exhaust'"),
    "no list": (
        'own = ["circuit.supply.pressure"]',
        'own = "circuit.supply.pressure"',
        "it must be a list of paths",
    ),
    "nothing observed": (
        'pressure = "500 Pa"\nposition = { deviation = "50 um", column = "height" }',
        "",
        "observed",
    ),
    "an empty stretch": (
        'start_time = "0.2 s"',
        'start_time = "0.2 s"\nfirst = "9 s"',
        "no row from first, 9 s, to last",
    ),
    "a key without meaning": ('start_time = "0.2 s"', 'star = "0.2 s"', "unknown key 'star'"),
    "nothing free": (
        (
            f'free = [{VALVES}, "gas.exponent", "muscle.damper.damping"]\nown ='
            ' ["circuit.supply.pressure"]\nstart_time = "50 ms"\n'
        ),
        "",
        (
            "no parameter is free; at least one is required. To name one, for example, write free ="
            ' ["circuit.fill.conductance"] under [fit].'
        ),
    ),
}


@pytest.mark.parametrize(("was", "becomes", "message"), REFUSED.values(), ids=REFUSED.keys())
def test_a_study_that_cannot_be_is_refused(folder, tmp_path, was, becomes, message):
    result = airmuscle(
        "fit-dynamic", variant(folder, change=(was, becomes)), "--out", tmp_path / "out"
    )
    assert result.exit_code == 1, result.stdout
    assert message in result.stderr
    assert not (tmp_path / "out").exists()


def test_an_unknown_profile_is_refused(folder, tmp_path):
    result = airmuscle(
        "fit-dynamic", folder / "study.toml", "--profile", "gas.exponen", "--out", tmp_path / "out"
    )
    assert "the fit has no unknown 'gas.exponen'" in result.stderr
    assert not (tmp_path / "out").exists()


def test_a_record_whose_time_repeats_is_refused(folder, tmp_path):
    lines = (folder / "run1.csv").read_text(encoding="utf-8").splitlines()
    (folder / "run3.csv").write_text(
        "\n".join([*lines[:30], lines[29], *lines[30:]]) + "\n", encoding="utf-8"
    )
    result = airmuscle(
        "fit-dynamic", variant(folder, file=('"run1.csv"', '"run3.csv"')), "--out", tmp_path / "out"
    )
    assert "repeats the time of the previous row" in result.stderr


def test_the_page_on_dynamic_identification_holds_a_study_that_loads(folder):
    page = (Path(__file__).parents[2] / "docs" / "guides/dynamic-identification.md").read_text(
        encoding="utf-8"
    )
    (text,) = re.findall(r"```toml\n(.*?)```", page, flags=re.DOTALL)
    (folder / "page.toml").write_text(text, encoding="utf-8")
    study = load_dynamic_fit(folder / "page.toml")
    assert [e.plant.mechanism.mass for e in study.experiments] == [10.0, 12.0]
    assert study.search.free[0] == ("circuit.fill.conductance", "circuit.discharge.conductance")


def test_a_start_that_was_found_begins_the_written_scenario(folder, tmp_path):
    path = variant(
        folder,
        start=(
            'initial_state = { pressure = "0.6 bar" }',
            'initial_state = { pressure = "0.62 bar" }',
        ),
        nuisance=(
            'start_time = "50 ms"',
            'start_time = "50 ms"\ninitial_state = { pressure = "5 kPa" }',
        ),
        one=(RECORD.format("run2.csv").replace("0.6 bar", "0.62 bar"), ""),
        quick=("starts = 2", "starts = 1"),
    )
    result = airmuscle("fit-dynamic", path, "--out", tmp_path / "out", "--json")
    estimates = {e["parameter"]: e for e in json.loads(result.stdout)["dynamic"]["estimates"]}
    found = estimates["initial pressure of record 1"]
    assert found["value"] == pytest.approx(6e4, abs=4 * found["standard_error"])
    assert found["standard_error"] < 300.0
    text = (tmp_path / "out" / "scenario.toml").read_text(encoding="utf-8")
    assert float(re.search(r"\[run\.initial_state\]\npressure = (\S+)", text)[1]) == found["value"]
