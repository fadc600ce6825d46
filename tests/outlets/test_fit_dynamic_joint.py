"""A joint of two muscles is identified and predicted by the command line: every muscle has an
initial pressure of its own, and the measured columns of the study are kept in the scenario.
"""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
from command_line import airmuscle
from dynamic_study import noisy_run, variant

import airmuscle as am
from airmuscle.bench import InitialConditions, write
from airmuscle.errors import EquilibriumError, ParameterError
from airmuscle.files import load_dynamic_fit, load_scenario
from airmuscle.files.library import Location
from airmuscle.files.scenario import build_initial_conditions
from airmuscle.physics import HangingMass
from airmuscle.recording import Recording

MUSCLE = """
[[plant.muscle]]
library = "dmsp-20-300"
name = "{}"
damper = {{ model = "LinearDamper", damping = "200 N s/m" }}
"""
CIRCUIT = """
[[plant.circuit]]
model = "FillDischarge"
supply = {{ model = "Supply", pressure = "6 bar" }}
fill = {{ model = "Valve", conductance = {fill}, critical_ratio = 0.35 }}
discharge = {{ model = "Valve", conductance = {discharge}, critical_ratio = 0.35 }}
"""
JOINT = """
[plant.mechanism]
model = "AntagonisticJoint"
radius = "40 mm"
inertia = {inertia}
damping = {damping}
weight_torque = "2 N m"
offset = 0.11
"""
TRUE = {"fill": 2.5e-9, "discharge": 3.5e-9, "inertia": 0.05, "damping": 0.3}
START = {"fill": 4e-9, "discharge": 2.5e-9, "inertia": 0.08, "damping": 0.15}
INPUT = """
[input]
"left.fill" = [["0.1 s", 1], ["0.35 s", 0], ["1.2 s", 1], ["1.35 s", 0]]
"right.discharge" = [["0.2 s", 1], ["0.4 s", 0]]
"left.discharge" = [["0.8 s", 1], ["1 s", 0]]
"right.fill" = [["0.9 s", 1], ["1.1 s", 0]]
"""
LATER_INPUT = """
[input]
"left.discharge" = [["0.1 s", 1], ["0.3 s", 0]]
"right.fill" = [["0.15 s", 1], ["0.5 s", 0]]
"left.fill" = [["0.9 s", 1], ["1.15 s", 0]]
"""
RUN = '[run]\nduration = "2 s"\noutput_times = "5 ms"\n'
STATE = 'initial_state = {{ "left.pressure" = "{} bar", "right.pressure" = "{} bar" }}\n'
NOISE = {"left.pressure": 500.0, "right.pressure": 500.0, "angle": 1e-3}
STUDY = """
[observed]
"left.pressure" = { deviation = "500 Pa", column = "p1" }
"right.pressure" = { deviation = "500 Pa", column = "p2" }
angle = "1 mrad"
[fit]
free = [["circuit[0].fill.conductance", "circuit[1].fill.conductance"],
        ["circuit[0].discharge.conductance", "circuit[1].discharge.conductance"],
        "mechanism.inertia", "mechanism.damping"]
initial_state = { pressure = "3 kPa" }
"""
ANSWERS = {
    "circuit[0].fill.conductance": 2.5e-9,
    "circuit[0].discharge.conductance": 3.5e-9,
    "mechanism.inertia": 0.05,
    "mechanism.damping": 0.3,
    "initial left.pressure of record 1": 1.5e5,
    "initial right.pressure of record 1": 3e5,
}


def joint(**numbers: float) -> str:
    """The table of a joint whose two circuits have the same valves."""
    circuits = 2 * CIRCUIT.format(**{name: numbers[name] for name in ("fill", "discharge")})
    return MUSCLE.format("left") + MUSCLE.format("right") + circuits + JOINT.format(**numbers)


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """Two noisy records of one joint from unequal pressures, one to fit and one with another input
    to predict.
    """
    place = tmp_path_factory.mktemp("joint")
    rng = np.random.default_rng(3)
    for name, command, left, right in (
        ("first", INPUT, 1.5, 3.0),
        ("later", LATER_INPUT, 2.8, 1.8),
    ):
        text = joint(**TRUE) + command + RUN + STATE.format(left, right)
        (place / "truth.toml").write_text(text, encoding="utf-8")
        run = noisy_run(place / "truth.toml", rng, NOISE)
        exact = load_scenario(place / "truth.toml").simulate()
        noise = {each: float(np.std(run[each] - exact[each])) for each in NOISE}
        (place / f"{name}.json").write_text(json.dumps(noise), encoding="utf-8")
        columns = {
            "time": run["time"],
            "p1 [kPa]": 1e-3 * run["left.pressure"],
            "p2 [bar]": 1e-5 * run["right.pressure"],
        }
        write(Recording({**columns, "angle": run["angle"]}, name), place / f"{name}.csv")
    study = joint(**START) + INPUT + STUDY + '[[record]]\nfile = "first.csv"\n'
    (place / "study.toml").write_text(study, encoding="utf-8")
    later = (
        f'{LATER_INPUT}[fit]\ninitial_state = {{ pressure = "3 kPa" }}\n[[record]]\nfile ='
        ' "later.csv"\n'
    )
    (place / "later.toml").write_text(later, encoding="utf-8")
    return place


def noise_of(folder: Path, record: str) -> dict[str, float]:
    """The standard deviation of the noise in the columns of a record."""
    noise: dict[str, float] = json.loads((folder / f"{record}.json").read_text(encoding="utf-8"))
    return noise


@pytest.fixture(scope="module")
def fitted(folder) -> dict:
    """The result of fit-dynamic, in the folder `fit`."""
    done = airmuscle("fit-dynamic", folder / "study.toml", "--out", folder / "fit", "--json")
    assert done.exit_code == 0, done.stderr
    return json.loads(done.stdout)["dynamic"]


def test_a_joint_is_identified_to_the_noise_from_its_measured_initial_pressures(folder, fitted):
    found = {
        each["parameter"]: (each["value"], each["standard_error"]) for each in fitted["estimates"]
    }
    for name, true in ANSWERS.items():
        assert abs(found[name][0] - true) < 3.0 * found[name][1], name
    rms = {each["quantity"]: each["rms_residual"] for each in fitted["rms"]}
    assert rms == pytest.approx(noise_of(folder, "first"), rel=0.05)


def test_another_record_of_the_joint_is_predicted_to_the_noise(folder, fitted, tmp_path):
    done = airmuscle(
        "predict",
        folder / "fit" / "scenario.toml",
        folder / "later.toml",
        "--out",
        tmp_path,
        "--json",
    )
    assert done.exit_code == 0, done.stderr
    rms = {
        each["quantity"]: each["rms_error"]
        for each in json.loads(done.stdout)["prediction"]["predictions"]
    }
    assert rms == pytest.approx(noise_of(folder, "later"), rel=0.05)


def test_the_scenario_keeps_the_measured_columns_so_that_a_file_is_predicted_without_a_table(
    folder, fitted, tmp_path
):
    done = airmuscle(
        "predict",
        folder / "fit" / "scenario.toml",
        folder / "first.csv",
        "--out",
        tmp_path,
        "--json",
    )
    assert done.exit_code == 0, done.stderr
    rms = {
        each["quantity"]: each["rms_error"]
        for each in json.loads(done.stdout)["prediction"]["predictions"]
    }
    assert set(rms) == set(NOISE)
    assert rms["left.pressure"] < 1.5 * NOISE["left.pressure"]


def test_the_scenario_begins_at_the_initial_pressure_of_each_muscle(folder, fitted):
    scenario = load_scenario(folder / "fit" / "scenario.toml")
    found = {each["parameter"]: each["value"] for each in fitted["estimates"]}
    outputs = scenario.plant.outputs(
        scenario.initial_state, dict.fromkeys(scenario.plant.inputs, 0.0)
    )
    assert outputs["left.pressure"] == pytest.approx(found["initial left.pressure of record 1"])
    assert outputs["right.pressure"] == pytest.approx(found["initial right.pressure of record 1"])


def test_every_muscle_begins_at_its_own_recorded_pressure_unless_its_own_is_stated(folder):
    (default,) = load_dynamic_fit(folder / "study.toml").experiments
    known = default.initial_conditions.known
    assert known["left.pressure"] == pytest.approx(1.5e5, abs=1500.0)
    assert known["right.pressure"] == pytest.approx(3e5, abs=1500.0)
    state = '"first.csv"\ninitial_state = { "left.pressure" = "1.4 bar", angle = "5 deg" }'
    (stated,) = load_dynamic_fit(variant(folder, state=('"first.csv"', state))).experiments
    assert stated.initial_conditions.known["left.pressure"] == 1.4e5
    assert stated.initial_conditions.known["right.pressure"] == known["right.pressure"]
    assert stated.initial_conditions.known["angle"] == pytest.approx(np.radians(5.0))
    both = '"first.csv"\ninitial_state = { pressure = "2 bar" }'
    (equal,) = load_dynamic_fit(variant(folder, state=('"first.csv"', both))).experiments
    assert [equal.initial_conditions.known[f"{side}.pressure"] for side in ("left", "right")] == [
        2e5,
        2e5,
    ]


@pytest.mark.parametrize(
    ("was", "becomes", "message"),
    [
        (
            '"first.csv"',
            '"first.csv"\ninitial_state = { "lefd.pressure" = "2 bar" }',
            "Did you mean 'left.pressure'",
        ),
        ('"first.csv"', '"first.csv"\ninitial_state = { "left.pressure" = nan }', "left.pressure"),
        ('"first.csv"', '"first.csv"\ninitial_state = { "left.pressure" = "-3 bar" }', "-300"),
        (
            '"first.csv"',
            '"first.csv"\ninitial_state = { "left.pressure" = "3 mm" }',
            "cannot be converted to 'Pa'",
        ),
        (
            '"right.pressure" = { deviation = "500 Pa", column = "p2" }\n',
            "",
            "the initial value of right.pressure is neither stated nor recorded",
        ),
    ],
)
def test_an_initial_state_that_is_none_is_refused(folder, tmp_path, was, becomes, message):
    done = airmuscle("fit-dynamic", variant(folder, it=(was, becomes)), "--out", tmp_path / "out")
    assert done.exit_code == 1
    assert message in " ".join(done.stderr.split())
    assert not (tmp_path / "out").exists()


def test_an_empty_first_column_is_refused_and_missing_first_rows_are_passed_over(folder):
    plant = load_scenario(folder / "truth.toml").plant
    pressure = np.array([np.nan, np.nan, 1e5, 1e5, 1e5])
    record = Recording({"left.pressure": pressure, "right.pressure": 2.0 * pressure}, "run")
    place = Location("study.toml", "", folder)
    conditions = build_initial_conditions({}, plant, record, place)
    assert (conditions.known["left.pressure"], conditions.known["right.pressure"]) == (1e5, 2e5)
    with pytest.raises(ParameterError, match=r"run: the column left\.pressure has no value"):
        build_initial_conditions(
            {}, plant, record.with_columns(**{"left.pressure": np.full(5, np.nan)}), place
        )


def test_a_plant_without_equilibrium_at_the_recorded_pressures_begins_at_the_recorded_position(
    folder,
):
    plant = load_scenario(folder / "truth.toml").plant
    bare = am.load("chou-hannaford").muscle
    muscles = tuple(dataclasses.replace(bare, name=name) for name in ("left", "right"))
    slack = dataclasses.replace(plant, muscle=muscles, mechanism=HangingMass(20.0))
    pressures = {f"{side}.pressure": np.zeros(5) for side in ("left", "right")}
    place = Location("study.toml", "", folder)
    record = Recording({**pressures, "position": np.full(5, 0.004)}, "run")
    assert build_initial_conditions({}, slack, record, place).known["position"] == 0.004
    with pytest.raises(EquilibriumError, match="no stable equilibrium"):
        build_initial_conditions({}, slack, Recording(pressures, "run"), place)


def test_a_joint_whose_slack_muscles_leave_it_at_rest_anywhere_begins_at_the_recorded_angle(folder):
    """Two unequal muscles without a weight, at pressures at which neither pulls; at higher ones
    they hold an angle.
    """
    plant = load_scenario(folder / "truth.toml").plant
    other = am.load("dmsp-10-250").muscle
    muscles = plant.muscles[0], dataclasses.replace(other, name="right")
    loose = dataclasses.replace(
        plant, muscle=muscles, mechanism=dataclasses.replace(plant.mechanism, weight_torque=0.0)
    )
    place = Location("study.toml", "", folder)
    for pressures, stationary in (((5e4, 1e5), False), ((1.6e5, 4e5), True)):
        columns = {
            f"{side}.pressure": np.full(5, value)
            for side, value in zip(("left", "right"), pressures, strict=True)
        }
        begun = build_initial_conditions(
            {}, loose, Recording({**columns, "angle": np.full(5, 0.02)}, "run"), place
        )
        assert begun.known.get("angle") == (None if stationary else 0.02)
        assert ("angular_speed" in begun.stationary) is stationary
    slack = Recording({"left.pressure": np.full(5, 5e4), "right.pressure": np.full(5, 1e5)}, "run")
    with pytest.raises(
        EquilibriumError,
        match=r"every angle near \S+ rad is an equilibrium: no muscle pulls\. Record",
    ):
        build_initial_conditions({}, loose, slack, place)


def test_two_muscles_that_lift_one_load_begin_at_their_own_pressures(folder):
    plant = load_scenario(folder / "truth.toml").plant
    lift = dataclasses.replace(plant, mechanism=HangingMass(20.0))
    conditions = InitialConditions.at_rest(lift, (1e5, "2 bar"))
    assert (conditions.known["left.pressure"], conditions.known["right.pressure"]) == (1e5, 2e5)
    outputs = lift.outputs(conditions.guess, dict.fromkeys(lift.inputs, 0.0))
    assert outputs["left.force"] + outputs["right.force"] == pytest.approx(20.0 * 9.80665, rel=1e-6)
    with pytest.raises(ParameterError, match="3 pressures are given for 2 muscles"):
        InitialConditions.at_coordinates(lift, (1e5, 2e5, 3e5))


def test_an_unknown_of_a_record_on_its_bound_is_noted_in_the_fit_and_in_the_prediction(
    folder, fitted, tmp_path
):
    narrow = variant(
        folder,
        margin=('"3 kPa"', '"0.2 kPa"'),
        state=('"first.csv"', '"first.csv"\ninitial_state = { "left.pressure" = "1.45 bar" }'),
    )
    done = airmuscle("fit-dynamic", narrow, "--out", tmp_path / "fit", "--json")
    (said,) = [
        note
        for note in json.loads(done.stdout)["dynamic"]["notes"]
        if note.startswith("initial left.pressure")
    ]
    assert "is on its bound" in said
    assert "give a wider margin" in said
    later = ("--start-margin", "2 ms", "--start-time", "50 ms", "--out", tmp_path / "p", "--json")
    done = airmuscle("predict", folder / "fit" / "scenario.toml", folder / "first.csv", *later)
    notes = " ".join(json.loads(done.stdout)["prediction_1"]["notes"])
    assert "on its bound: start time 0.048 s" in notes
    assert "give a wider margin" in notes
