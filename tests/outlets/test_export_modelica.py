"""Modelica package: its equations are the rates and outputs of the library, and rumoca, a Modelica
tool, simulates them.

A run of rumoca differs from that of the library by at most 1e-6 of the greatest value of a column,
with the tolerance 1e-9 of both; contacts amplify this to 1e-5.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import plants
import printed
import pytest
from command_line import airmuscle
from modelica_block import ModelicaBlock

from airmuscle.control import PID
from airmuscle.engine import ControlLoop, Problem, Rodas4, Schedule, solve
from airmuscle.engine.compile import compile_system
from airmuscle.errors import ParameterError
from airmuscle.outlets import write_modelica
from airmuscle.physics import ValidityRange

SOME = ("dmsp-20-300", "overlap", "arm")
CONTACTS = ("stop, lagging wall", "pulley with stops", "joint with stops")
GIVEN = {"1": 0.3, "Pa": 2e5, "m": 0.01, "m/s": 0.02}
"""Values of inputs by their units (chosen); of a second muscle the valves open half as far, so that
no joint rests.
"""
UNBOUNDED_AT_REST = ("circle", "Catenary", "Parabola", "TrueArcParabola")
"""Plants with fibres that are straight at zero contraction, where their force is unbounded; they
begin contracted.
"""
PLANTS = [
    pytest.param(name, marks=() if name in SOME else pytest.mark.slow) for name in plants.EXAMPLES
]


def package(name, folder, **options):
    plant = plants.EXAMPLES[name]
    problem = Problem(plant, Schedule({}), 1.0, plant.state_at(pressure=1e5))
    return plant, write_modelica(problem, folder, name="joint", **options)


@pytest.mark.parametrize("name", ["dmsp-20-300", "overlap", "LuGre"])
def test_its_equations_give_rates_and_outputs_of_the_library(name, tmp_path):
    """Read by an evaluator of the tests: each equation defines one variable from those before it."""
    plant, (path,) = package(name, tmp_path)
    ready = compile_system(plant)
    block = ModelicaBlock(path)
    states, inputs = printed.points_of(plant)
    for x, u in zip(states, inputs, strict=True):
        found = block.values(ready.parameters.tolist(), x.tolist(), u.tolist())
        expected = np.zeros(ready.sizes.outputs)
        ready.call("outputs", x.copy(), np.append(u, 0.0), ready.precomputed, expected)
        rates = [found[f"der({state})"] for state in block.states]
        np.testing.assert_allclose(rates, ready.rates(x, np.append(u, 0.0)), rtol=1e-11)
        outputs = [v for left, v in found.items() if not re.fullmatch(r"der\(\w+\)|v\d+", left)]
        np.testing.assert_allclose(outputs, expected, rtol=1e-11)


def check_rumoca(problem, levels, folder, bar):
    """A run of rumoca has the columns of the library; `levels` are the constant inputs."""
    rumoca = pytest.importorskip("rumoca", reason="needs the package rumoca")
    expected = solve(problem).raise_if_incomplete().recording
    write_modelica(problem, folder, name="joint")
    given = "".join(
        f"  plant.{re.sub(r'[^a-zA-Z0-9]', '_', name)} = {value!r};\n"
        for name, value in levels.items()
    )
    (folder / "Run.mo").write_text(f"model Run\n  joint.Plant plant;\nequation\n{given}end Run;\n")
    model = rumoca.Session(roots=[str(folder)]).load(str(folder / "Run.mo"), model="Run")
    assert len(model.states) == len(problem.system.states)
    config = rumoca.SimConfig(rtol=1e-9, atol=1e-12, max_wall_seconds=60)
    run = model.simulate(problem.duration, dt=0.01, config=config)
    time = np.asarray(run.time)
    last = len(expected["time"])
    np.testing.assert_allclose(time[:last], expected["time"], atol=1e-12)
    moving = [
        column
        for column in expected
        if column != "time" and np.abs(expected[column]).max(initial=0.0) > 0.0
    ]
    for column in moving:
        values = np.asarray(run[f"plant.{re.sub(r'[^a-zA-Z0-9]', '_', column)}"])[:last]
        deviation = np.abs(values - expected[column]).max()
        assert deviation <= bar * np.abs(expected[column]).max(), column
    return expected, moving


@pytest.mark.tool
@pytest.mark.parametrize("name", PLANTS)
def test_rumoca_simulates_it_to_the_results_of_the_library(name, tmp_path):
    plant = plants.EXAMPLES[name]
    levels = {
        variable.name: GIVEN.get(variable.unit, 0.3) / (1 + i // 2 if variable.unit == "1" else 1)
        for i, variable in enumerate(plant.input_variables)
    }
    inputs = Schedule({name: ((0.0, value),) for name, value in levels.items()})
    state = plant.state_at(
        pressure=1e5, **({"position": 0.02} if name in UNBOUNDED_AT_REST else {})
    )
    problem = Problem(plant, inputs, 0.3, state, integrator=Rodas4(1e-9), output_times=0.01)
    _, moving = check_rumoca(problem, levels, tmp_path, 1e-5 if name in CONTACTS else 1e-6)
    assert {"pressure", "m0.pressure", "one.pressure"} & set(moving)


@pytest.mark.tool
def test_rumoca_moves_a_muscle_through_the_ends_of_its_range(tmp_path):
    """A muscle of 200 mm that is stretched by 5 %, let go, and thrown until it is slack."""
    plant = plants.EXAMPLES["dmsp-20-300"]
    muscle = replace(plant.muscle, validity_range=ValidityRange(0.5e5, 6e5, 0.0, 0.1))
    plant = replace(plant, muscle=muscle)
    levels = dict.fromkeys(plant.inputs, 0.0)
    inputs = Schedule(dict.fromkeys(plant.inputs, ((0.0, 0.0),)))
    state = plant.state_at(pressure=3e5, position=-0.01)
    problem = Problem(plant, inputs, 0.3, state, integrator=Rodas4(1e-9), output_times=0.01)
    expected, _ = check_rumoca(problem, levels, tmp_path, 1e-6)
    assert expected["contraction"].min() < -0.04
    assert expected["contraction"].max() > 0.11
    assert expected["force"].min() == 0.0


@pytest.mark.tool
@pytest.mark.parametrize("name", ["dmsp-20-300", "overlap", "closed"])
def test_pymoca_parses_the_package(name, tmp_path):
    parser = pytest.importorskip("pymoca.parser", reason="needs the package pymoca")
    _, paths = package(name, tmp_path)
    tree = parser.parse(paths[0].read_text(encoding="utf-8"))
    assert {"Plant", "log1p", "expm1", "asinh"} == set(tree.classes["joint"].classes)


def test_a_controller_is_refused_by_name(tmp_path):
    plant = plants.EXAMPLES["dmsp-20-300"]
    loop = ControlLoop(PID("pressure", "fill", 1e-5), 0.01, Schedule({"pressure": ((0.0, 2e5),)}))
    with pytest.raises(
        ParameterError, match="the controller PID cannot be exported to this target"
    ):
        write_modelica(Problem(plant, loop, 0.1, plant.state_at(pressure=1e5)), tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_the_command_writes_the_package(tmp_path):
    example = Path(__file__).parents[2] / "examples" / "fill_discharge.toml"
    arguments = [
        "export",
        str(example),
        "--to",
        "modelica",
        "--tunable",
        "mechanism.mass",
        "--out",
        str(tmp_path),
    ]
    done = airmuscle(*arguments)
    assert done.exit_code == 0, done.output
    text = (tmp_path / "fill_discharge" / "package.mo").read_text(encoding="utf-8")
    declared = (
        'p_mechanism_mass(unit = "kg", min = 0.0001, max = 100000.0) = 10.0 "p.mechanism.mass"'
    )
    assert f"parameter Real {declared};" in text


def test_units_follow_the_grammar_of_modelica_and_a_fractional_power_has_none(tmp_path):
    declared: dict[str, str] = {}
    for name in ("serres2009", "stop, lagging wall"):
        plant = plants.EXAMPLES[name]
        problem = Problem(plant, Schedule({}), 0.1, plant.state_at(pressure=1e5))
        write_modelica(problem, tmp_path, name="unit_test")
        text = (tmp_path / "unit_test" / "package.mo").read_text()
        for word, attributes in re.findall(r"parameter Real (\w+)\((.*?)\) =", text):
            unit = re.search('unit = "(.*?)"', attributes)
            declared[word] = unit[1] if unit else ""
    assert declared["p_muscle_contractile_softening"] == "N/(m.Pa)"
    assert declared["p_muscle_stop_contact_stiffness"] == ""
    factors = r"[A-Za-z]+\d*(\.[A-Za-z]+\d*)*"
    units = {unit for unit in declared.values() if unit}
    assert len(units) > 8
    assert all(
        re.fullmatch(rf"(1|{factors})(/([A-Za-z]+\d*|\({factors}\)))?", unit) for unit in units
    )
