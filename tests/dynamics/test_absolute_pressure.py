"""Absolute pressures in texts: absolute whatever the ambient pressure of the plant, in objects,
states, files and studies.
"""

from __future__ import annotations

import copy
import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import airmuscle as am
from airmuscle.core import AbsolutePressure, ambient_pressure, tree
from airmuscle.design import load_study
from airmuscle.engine.loop import designed_loop
from airmuscle.errors import ParameterError
from airmuscle.files import load_scenario
from airmuscle.physics import Ambient
from airmuscle.units import quantity

AMBIENT = 8e4
MUSCLE = am.load("dmsp-20-300").muscle
VALVE = am.load("matrix-821").valve
SCENARIO = """
[plant]
[plant.ambient]
pressure = "80 kPa(a)"
model = "Ambient"
[plant.muscle]
library = "dmsp-20-300"
damper = { model = "LinearDamper", damping = "200 N s/m" }
[plant.circuit]
model = "ProportionalRegulator"
supply = { model = "RegulatedSupply", supply = { model = "Supply", pressure = "9 bara" }, valve = { library = "matrix-821" }, pressure = "7 bara" }
fill = { library = "matrix-821" }
discharge = { library = "matrix-821" }
max_setpoint = "7 bara"
lag = { model = "SecondOrderLag", frequency = "20 Hz" }
[plant.mechanism]
model = "HangingMass"
mass = "20 kg"
[input]
setpoint = [["0 s", "3 bara"]]
[run]
duration = "0.2 s"
initial_state = { pressure = "2 bara" }
"""


def plant(supply: object = "7 bara", ambient: float = AMBIENT) -> am.Plant:
    circuit = am.FillDischarge(am.Supply(supply), VALVE, VALVE)  # type: ignore[arg-type]
    return am.Plant(MUSCLE, circuit, am.HangingMass(20.0), ambient=Ambient(ambient))


def absolute_supply(of: am.Plant) -> float:
    return float(of.circuit.supply.air({}, of.ambient).pressure)  # type: ignore[union-attr]


def initial_pressure(of: am.Plant, state: dict[str, float]) -> float:
    return float(of.muscle_states(state)[0].air.pressure)


def test_the_supply_of_a_plant_has_the_absolute_pressure_that_was_stated():
    assert absolute_supply(plant()) == pytest.approx(7e5)
    assert absolute_supply(plant("7 bar")) == pytest.approx(7.8e5)


def test_a_plant_of_another_ambient_pressure_has_the_same_absolute_supply():
    made = replace(plant(), ambient=Ambient(95e3))
    assert absolute_supply(made) == pytest.approx(7e5)
    assert absolute_supply(pickle.loads(pickle.dumps(made))) == pytest.approx(7e5)
    assert absolute_supply(replace(copy.deepcopy(made), ambient=Ambient(7e4))) == pytest.approx(7e5)


def test_supplies_at_any_depth_of_a_circuit_are_converted():
    inner = am.physics.Tank(am.Supply("9 bara"), am.Valve(1e-9, 0.3), 1e-3)
    made = replace(plant(), circuit=am.FillDischarge(inner, VALVE, VALVE))
    assert made.circuit.supply.supply.pressure == pytest.approx(9e5 - AMBIENT)  # type: ignore[union-attr]


def test_a_state_and_an_equilibrium_at_an_absolute_pressure_have_it():
    made = plant()
    assert initial_pressure(made, made.state_at(pressure="3 bara")) == pytest.approx(3e5)
    assert initial_pressure(
        made, am.physics.find_equilibrium(made, pressure="3 bara")
    ) == pytest.approx(3e5)
    stated = quantity("3 bara", "Pa")
    assert initial_pressure(made, made.state_at(pressure=stated)) == pytest.approx(3e5)


def test_the_texts_of_a_scenario_are_converted_with_its_ambient_pressure(tmp_path: Path):
    path = tmp_path / "high.toml"
    path.write_text(SCENARIO)
    scenario = load_scenario(path)
    circuit = scenario.plant.circuit
    pressures = circuit.supply.pressure, circuit.supply.supply.pressure, circuit.max_setpoint  # type: ignore[union-attr]
    assert pressures == pytest.approx((6.2e5, 8.2e5, 6.2e5))
    assert scenario.problem.input.changes["setpoint"] == ((0.0, 2.2e5),)  # type: ignore[union-attr]
    assert initial_pressure(scenario.plant, dict(scenario.initial_state)) == pytest.approx(2e5)


def test_a_study_over_the_ambient_pressure_keeps_absolute_pressures(tmp_path: Path):
    (tmp_path / "high.toml").write_text(SCENARIO)
    study = tmp_path / "study.toml"
    study.write_text(
        'scenario = "high.toml"\n[vary]\n"ambient.pressure" = ["70 kPa(a)", "100'
        ' kPa(a)"]\n[design]\nmodel = "Grid"\n[metrics]\nhighest = { model = "Maximum", column ='
        ' "pressure" }\n'
    )
    template = load_study(study).template
    parameters = load_study(study).parameters
    for ambient in (7e4, 1e5):
        scenario = template.with_values(parameters, [ambient])
        assert scenario.plant.circuit.supply.pressure + ambient == pytest.approx(7e5)  # type: ignore[union-attr]
        assert initial_pressure(scenario.plant, dict(scenario.initial_state)) == pytest.approx(2e5)
        assert scenario.problem.input.changes["setpoint"][0][1] + ambient == pytest.approx(3e5)  # type: ignore[union-attr]
    assert template.initial_states(parameters, np.array([[7e4]])) == [None]


def test_a_range_of_a_study_is_converted_with_the_ambient_pressure_of_the_scenario(tmp_path: Path):
    (tmp_path / "high.toml").write_text(SCENARIO)
    study = tmp_path / "study.toml"
    study.write_text(
        'scenario = "high.toml"\n[vary]\n"circuit.supply.pressure" = ["5 bara", "6'
        ' bara"]\n[design]\nmodel = "Grid"\n[metrics]\nhighest = { model = "Maximum", column ='
        ' "pressure" }\n'
    )
    assert load_study(study).values.ravel() == pytest.approx([4.2e5, 5.2e5])


def test_a_batch_over_the_ambient_pressure_keeps_the_absolute_supply():
    made = plant()
    ambients = np.array([7e4, 9e4])
    filling = am.Schedule({"fill": ((0.0, 1.0),)})
    batch = am.simulate_batch(made, {"ambient.pressure": ambients}, filling, duration=2.0)
    assert batch["pressure"][:, -1] + ambients == pytest.approx([7e5, 7e5], rel=1e-3)


def test_a_control_law_is_converted_with_the_ambient_pressure_of_the_plant():
    law = am.control.CoContraction(("left.pressure", "right.pressure"), mean="2 bara")
    loop = am.ControlLoop(law, 1e-2, am.Schedule({"difference": ((0.0, 1e4),)}))
    assert designed_loop(loop, plant()).controller.mean == pytest.approx(1.2e5)  # type: ignore[attr-defined]


def test_the_context_of_texts_ends_and_nests():
    with ambient_pressure(8e4):
        with ambient_pressure(9e4):
            assert quantity("1 bara", "Pa") == pytest.approx(1e4)
        assert quantity("1 bara", "Pa") == pytest.approx(2e4)
    assert quantity("1 bara", "Pa") == pytest.approx(1e5 - 101_325)
    assert type(quantity("1 barg", "Pa")) is float


def test_a_pressure_below_vacuum_in_this_ambient_air_is_refused():
    with pytest.raises(ParameterError, match="not above absolute vacuum"):
        plant("-0.9 bar")
    assert absolute_supply(plant("0.1 bara")) == pytest.approx(1e4)


def test_an_absolute_pressure_is_a_number_that_keeps_what_was_stated():
    stated = quantity("7 bara", "Pa")
    assert isinstance(stated, AbsolutePressure)
    assert (float(stated), stated.absolute) == pytest.approx((7e5 - 101_325, 7e5))
    assert type(stated + 0.0) is float
    assert tree.with_ambient(am.Supply("7 bara"), 8e4).pressure == pytest.approx(6.2e5)
    supply = am.Supply(7e5)
    assert tree.with_ambient(supply, 8e4) is supply
