"""Next record to measure: the Fisher information of a record adds to that of the fit, so that the
expected standard errors are those of a joint fit with it, and a record that responds to one of two
parameters alone separates them.
"""

from __future__ import annotations

import dataclasses
import json
import math

import numpy as np
import pytest
from command_line import airmuscle
from joints import chosen_muscle

from airmuscle.bench import Experiment, InitialConditions, StartTime, fit_dynamic, rank_records
from airmuscle.bench.dynamics.candidate_records import candidate_records
from airmuscle.engine import Schedule, simulate
from airmuscle.errors import IdentificationError, ParameterError
from airmuscle.files import load
from airmuscle.physics import (
    EnergyBalance,
    FillDischarge,
    HangingMass,
    Isometric,
    Muscle,
    Plant,
    Polytropic,
    Supply,
    Valve,
    Vessel,
)
from airmuscle.recording import Recording

NOISE = 500.0
FILL = Schedule({"fill": ((0.0, 1.0),)})
VALVE = "circuit.fill.critical_ratio"
WALL = "gas.heat_transfer"


def rig(muscle=None, gas=None):
    valve = Valve(4e-9, 0.3)
    circuit = FillDischarge(Supply(5e5), valve, valve)
    return Plant(
        muscle or load("dmsp-20-300").muscle,
        circuit,
        Isometric(0.05),
        gas=gas or EnergyBalance(1.0),
    )


def measured(plant, command, times, initial_pressure, seed):
    """A record of the plant with noise, as an experiment."""
    state = plant.state_at(pressure=initial_pressure)
    step = float(times[1] - times[0])
    run = simulate(
        plant, command, duration=float(times[-1]), initial_state=state, output_times=step
    )
    noise = NOISE * np.random.default_rng(seed).standard_normal(times.size)
    columns = {"time": times, "pressure": np.interp(times, run["time"], run["pressure"]) + noise}
    conditions = InitialConditions.at_rest(plant, initial_pressure)
    return Experiment(Recording(columns, f"record {seed}"), command, conditions, 0.0, plant)


def fitted(plant, free, *more):
    records = [measured(plant, FILL, np.arange(0.0, 2.0, 0.01), 0.0, 1), *more]
    return fit_dynamic(
        plant, records, free=free, observed={"pressure": NOISE}, per_record=(StartTime(0.02),)
    )


@pytest.fixture(scope="module")
def fill():
    return fitted(rig(), ("circuit.fill.conductance", VALVE, WALL))


def test_the_pair_of_valve_and_wall_with_the_greatest_correlation_is_separated(fill):
    ranking = rank_records(fill)
    assert ranking.pair == (VALVE, WALL)
    standard_errors, correlation = ranking.now
    assert abs(correlation) > 0.7
    assert ranking.now.worst == max(standard_errors)
    best = ranking.ranking[0]
    assert "whose valve is closed" in best.description
    assert abs(best.precision.correlation) < 0.5
    assert best.gain > 3.0
    assert f"To separate them, measure {best.description}" in ranking.verdict
    assert [each.gain for each in ranking.ranking] == sorted(
        (each.gain for each in ranking.ranking), reverse=True
    )


def test_the_precision_does_not_depend_on_the_zero_of_the_clock():
    """A start time that is estimated as nearly zero is not known more closely than another one."""
    plant = rig()
    free = ("circuit.fill.conductance", VALVE, WALL)
    record = measured(plant, FILL, np.arange(0.0, 2.0, 0.01), 0.0, 1)
    late = fitted(plant, free).estimates[-1].value
    shifted = record.recording.with_columns(time=record.recording["time"] - late + 1e-9)
    near_zero = dataclasses.replace(record, recording=shifted, start_time=-late)
    sensor = {"pressure": NOISE}
    own = (StartTime(0.02),)
    fit = fit_dynamic(plant, [near_zero], free=free, observed=sensor, per_record=own)
    now = rank_records(fit, (VALVE, WALL)).now
    assert abs(fit.estimates[-1].value) < 1e-8
    for name, error in zip((VALVE, WALL), now.standard_errors, strict=True):
        assert error == pytest.approx(fit[name].stderr / fit[name].value, rel=0.01)


def test_the_present_precision_is_that_of_the_fit(fill):
    now = rank_records(fill, (VALVE, WALL)).now
    for name, error in zip((VALVE, WALL), now.standard_errors, strict=True):
        assert error == pytest.approx(fill[name].stderr / fill[name].value, rel=0.01)


def test_a_repeat_divides_the_standard_errors_by_the_root_of_two(fill):
    (again,) = (
        each for each in rank_records(fill).ranking if each.description == "a repeat of the record"
    )
    assert again.gain == pytest.approx(math.sqrt(2.0), rel=0.05)


def test_the_expected_standard_errors_are_those_of_a_joint_fit_with_the_record(fill):
    best = rank_records(fill).ranking[0]
    (candidate,) = (
        each for each in candidate_records(fill) if each.description == best.description
    )
    planned = candidate.experiment
    initial = planned.initial_conditions.known["pressure"]
    further = measured(planned.plant, planned.command, planned.recording["time"], initial, 2)
    joint = fitted(rig(), ("circuit.fill.conductance", VALVE, WALL), further)
    for name, expected in zip((VALVE, WALL), best.precision.standard_errors, strict=True):
        assert joint[name].stderr / joint[name].value == pytest.approx(expected, rel=0.2)


def test_a_load_that_does_not_rest_at_ambient_pressure_leaves_the_other_records():
    plant = dataclasses.replace(rig(chosen_muscle(), Polytropic(1.2)), mechanism=HangingMass(20.0))
    start = InitialConditions.at_rest(plant, 3e5)
    run = simulate(plant, FILL, duration=1.0, initial_state=start.guess, output_times=0.01)
    fit = fit_dynamic(
        plant,
        [Experiment(run, FILL, start)],
        free=("circuit.fill.conductance", "gas.exponent"),
        observed={"pressure": NOISE},
    )
    compared = [each.description for each in rank_records(fit).ranking]
    assert compared.count("a repeat of the record") == 1
    assert any("rigid tank of known volume" in each for each in compared)
    assert not any("throttle" in each for each in compared)


def test_a_tank_of_known_volume_separates_conductance_and_volume():
    """One fill determines their ratio only: C/V."""
    plant = rig(Muscle.ideal(Vessel(1e-4, 0.3)), Polytropic(1.2))
    fit = fitted(plant, ("circuit.fill.conductance", "muscle.geometry.enclosed_volume"))
    ranking = rank_records(fit)
    assert ranking.now.worst > 1.0
    assert ranking.now.correlation > 0.99
    assert "rigid tank of known volume" in ranking.ranking[0].description
    assert ranking.ranking[0].precision.worst < 0.02


@pytest.mark.parametrize(
    ("pair", "message"),
    [
        ((VALVE, "gas.heat"), r"'gas.heat' is no common unknown of the fit.*gas.heat_transfer"),
        ((VALVE, VALVE), "is named twice"),
    ],
)
def test_a_pair_that_is_none_is_refused(fill, pair, message):
    with pytest.raises(ParameterError, match=message):
        rank_records(fill, pair)


def test_a_fit_of_one_parameter_has_no_pair():
    with pytest.raises(IdentificationError, match="1 common unknowns"):
        rank_records(fitted(rig(), ("circuit.fill.conductance",)))


STUDY = """
[plant]
gas = { model = "EnergyBalance", heat_transfer = 1.2 }
[plant.muscle]
library = "dmsp-20-300"
[plant.circuit]
model = "FillDischarge"
supply = { model = "Supply", pressure = "5 bar" }
fill = { model = "Valve", conductance = 4e-9, critical_ratio = 0.3 }
discharge = { model = "Valve", conductance = 4e-9, critical_ratio = 0.3 }
[plant.mechanism]
model = "Isometric"
contraction = 0.05
[input]
fill = [["0 s", 1]]
[observed]
pressure = "500 Pa"
[fit]
free = ["circuit.fill.conductance", "circuit.fill.critical_ratio", "gas.heat_transfer"]
[[record]]
file = "fill.csv"
initial_state = { pressure = "0 bar" }
"""


def test_the_command_ranks_the_records_of_a_study(fill, tmp_path):
    recording = fill.problem.record_models[0].experiment.recording
    rows = zip(recording["time"], recording["pressure"], strict=True)
    lines = ["time [s],pressure [Pa]", *(f"{t:.9g},{p:.9g}" for t, p in rows)]
    (tmp_path / "fill.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (tmp_path / "study.toml").write_text(STUDY, encoding="utf-8")
    call = ["plan", str(tmp_path / "study.toml")]
    done = airmuscle(*call, "--out", tmp_path / "plan", "--json")
    assert done.exit_code == 0, done.stderr
    said = json.loads(done.stdout)
    named = [key for key in said["ranking"]["ranking"][0] if key.startswith("standard_error_of_")]
    assert named == [f"standard_error_of_{VALVE}", f"standard_error_of_{WALL}"]
    assert said["ranking"]["ranking"][0]["record_in_addition"] == "none"
    assert any(
        "whose valve is closed" in row["record_in_addition"] for row in said["ranking"]["ranking"]
    )
    text = (tmp_path / "plan" / "plan.csv").read_text(encoding="utf-8")
    assert text.splitlines()[1].startswith("none,1.0,")
    assert "To separate them" in (tmp_path / "plan" / "report.html").read_text(encoding="utf-8")
    assert airmuscle(*call, "--separate", VALVE).exit_code == 2
    assert airmuscle("plan", "dmsp-20-300", "--separate", VALVE).exit_code == 2
    assert airmuscle("plan", "dmsp-20-300").exit_code == 2
