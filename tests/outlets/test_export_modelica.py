"""Modelica package: its equations are the rates and outputs of the library, and rumoca, a Modelica
tool, simulates them.

A run of rumoca differs from that of the library by at most 1e-6 of the greatest value of a column,
with the tolerance 1e-9 of both; contacts amplify this to 1e-5.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import plants
import printed
import pytest
from command_line import airmuscle

from airmuscle.control import PID
from airmuscle.engine import ControlLoop, Problem, Rodas4, Schedule, solve
from airmuscle.engine.compile import compile_system
from airmuscle.errors import ParameterError
from airmuscle.outlets import write_modelica

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
FUNCTIONS = {
    "log1p": math.log1p,
    "expm1": math.expm1,
    "asinh": math.asinh,
    "abs": abs,
    "sqrt": math.sqrt,
    "floor": math.floor,
    "exp": math.exp,
    "log": math.log,
    "sin": math.sin,
    "cos": math.cos,
    "tan": math.tan,
    "atan": math.atan,
    "asin": math.asin,
    "acos": math.acos,
    "tanh": math.tanh,
    "sinh": math.sinh,
    "cosh": math.cosh,
}


def package(name, folder, **options):
    plant = plants.EXAMPLES[name]
    problem = Problem(plant, Schedule({}), 1.0, plant.state_at(pressure=1e5))
    return plant, write_modelica(problem, folder, name="joint", **options)


def equations_of(path):
    """The left and right sides of the equations, in their order, as expressions of Python."""
    text = re.sub(r"/\*.*?\*/", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)
    lines = text[text.index("  equation\n") : text.index("  end Plant;")].splitlines()[1:]
    for line in lines:
        left, _, right = line.partition("//")[0].strip().rstrip(";").partition(" = ")
        choice = re.fullmatch(r"noEvent\(if (.*) then (.*) else (.*)\)", right)
        if choice:
            right = f"(({choice[2]}) if ({choice[1]}) else ({choice[3]}))"
        yield left, right.replace("noEvent", "").replace("^", "**")


@pytest.mark.parametrize("name", ["dmsp-20-300", "overlap", "LuGre"])
def test_its_equations_give_rates_and_outputs_of_the_library(name, tmp_path):
    """Read by an evaluator of this test: each equation defines one variable from those before
    it.
    """
    plant, (path,) = package(name, tmp_path)
    ready = compile_system(plant)
    equations = [(a, compile(b, a, "eval")) for a, b in equations_of(path)]
    words = re.findall(
        r"^    (input Real|Real|parameter Real) (\w+)\(",
        path.read_text(encoding="utf-8"),
        re.MULTILINE,
    )
    names = {
        kind: [word for each, word in words if each == kind]
        for kind in ("input Real", "Real", "parameter Real")
    }
    states, inputs = printed.points_of(plant)
    for x, u in zip(states, inputs, strict=True):
        values = dict(zip(names["parameter Real"], ready.parameters.tolist(), strict=True))
        values |= dict(zip(names["Real"], x.tolist(), strict=True))
        values |= dict(zip(names["input Real"], u.tolist(), strict=True))
        found = {}
        for left, right in equations:
            found[left] = values[left] = eval(right, FUNCTIONS, values)
        expected = np.zeros(ready.sizes.outputs)
        ready.call("outputs", x.copy(), np.append(u, 0.0), ready.precomputed, expected)
        rates = [found[f"der({state})"] for state in names["Real"]]
        np.testing.assert_allclose(rates, ready.rates(x, np.append(u, 0.0)), rtol=1e-11)
        outputs = [v for left, v in found.items() if not re.fullmatch(r"der\(\w+\)|v\d+", left)]
        np.testing.assert_allclose(outputs, expected, rtol=1e-11)


@pytest.mark.tool
@pytest.mark.parametrize("name", PLANTS)
def test_rumoca_simulates_it_to_the_results_of_the_library(name, tmp_path):
    rumoca = pytest.importorskip("rumoca", reason="needs the package rumoca")
    plant = plants.EXAMPLES[name]
    levels = {
        each.name: GIVEN.get(each.unit, 0.3) / (1 + i // 2 if each.unit == "1" else 1)
        for i, each in enumerate(plant.input_variables)
    }
    inputs = Schedule({each: ((0.0, value),) for each, value in levels.items()})
    state = plant.state_at(
        pressure=1e5, **({"position": 0.02} if name in UNBOUNDED_AT_REST else {})
    )
    problem = Problem(plant, inputs, 0.3, state, integrator=Rodas4(1e-9), output_times=0.01)
    expected = solve(problem).raise_if_incomplete().recording
    write_modelica(problem, tmp_path, name="joint")
    given = "".join(
        f"  plant.{re.sub(r'[^a-zA-Z0-9]', '_', each)} = {value!r};\n"
        for each, value in levels.items()
    )
    (tmp_path / "Run.mo").write_text(
        f"model Run\n  joint.Plant plant;\nequation\n{given}end Run;\n"
    )
    model = rumoca.Session(roots=[str(tmp_path)]).load(str(tmp_path / "Run.mo"), model="Run")
    assert len(model.states) == len(plant.states)
    run = model.simulate(
        0.3, dt=0.01, config=rumoca.SimConfig(rtol=1e-9, atol=1e-12, max_wall_seconds=60)
    )
    time = np.asarray(run.time)
    last = len(expected["time"])
    np.testing.assert_allclose(time[:last], expected["time"], atol=1e-12)
    moving = [
        column
        for column in expected
        if column != "time" and np.abs(expected[column]).max(initial=0.0) > 0.0
    ]
    assert {"pressure", "m0.pressure", "one.pressure"} & set(moving)
    for column in moving:
        found = np.asarray(run[f"plant.{re.sub(r'[^a-zA-Z0-9]', '_', column)}"])[:last]
        bar = 1e-5 if name in CONTACTS else 1e-6
        assert np.abs(found - expected[column]).max() <= bar * np.abs(expected[column]).max(), (
            column
        )


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
    assert 'parameter Real p_mechanism_mass(unit = "kg") = 10.0 "p.mechanism.mass";' in text


def test_units_follow_the_grammar_of_modelica_and_a_fractional_power_has_none(tmp_path):
    declared = {}
    for name in ("serres2009", "stop, lagging wall"):
        plant = plants.EXAMPLES[name]
        problem = Problem(plant, Schedule({}), 0.1, plant.state_at(pressure=1e5))
        write_modelica(problem, tmp_path, name="unit_test")
        text = (tmp_path / "unit_test" / "package.mo").read_text()
        declared |= dict(re.findall(r"parameter Real (\w+)\((.*?)\) =", text))
    assert declared["p_muscle_contractile_softening"] == 'unit = "N/(m.Pa)"'
    assert declared["p_muscle_stop_contact_stiffness"] == ""
    factors = r"[A-Za-z]+\d*(\.[A-Za-z]+\d*)*"
    units = {
        found[1] for found in map(re.compile('unit = "(.*)"').fullmatch, declared.values()) if found
    }
    assert len(units) > 8
    assert all(
        re.fullmatch(rf"(1|{factors})(/([A-Za-z]+\d*|\({factors}\)))?", unit) for unit in units
    )
