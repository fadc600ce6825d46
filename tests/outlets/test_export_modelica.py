"""Modelica package: its C functions give the rates and outputs of the library, and its text declares what it uses.

rumoca and pymoca, where they are installed, parse it; neither executes external C.
"""

from __future__ import annotations

import ctypes
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import plants
import printed
import pytest
from command_line import airmuscle

from airmuscle.control import PID
from airmuscle.engine import ControlLoop, Problem, Schedule
from airmuscle.engine.compile import compile_system
from airmuscle.errors import ParameterError
from airmuscle.outlets import write_modelica


def package(name, folder, **options):
    plant = plants.EXAMPLES[name]
    problem = Problem(plant, Schedule({}), 1.0, plant.state_at(pressure=1e5))
    return plant, write_modelica(problem, folder, name="joint", **options)


@pytest.mark.parametrize("name", ["dmsp-20-300", "overlap"])
def test_its_functions_give_rates_and_outputs_of_the_library(name, tmp_path):
    plant, paths = package(name, tmp_path)
    (wrapper,) = [path for path in paths if path.name == "joint_modelica.c"]
    library = tmp_path / "joint.so"
    command = [printed.require("gcc"), "-std=c99", "-Wall", "-Wextra", "-Werror", "-O1", "-ffp-contract=off", "-fPIC"]
    done = subprocess.run(
        [*command, "-shared", str(wrapper), "-o", str(library), "-lm"], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr[:2000]
    loaded, ready = ctypes.CDLL(str(library)), compile_system(plant)
    states, inputs = printed.points_of(plant)
    for x, u in zip(states, inputs, strict=True):
        f, o, expected = np.zeros(ready.sizes.states), np.zeros(ready.sizes.outputs), np.zeros(ready.sizes.outputs)
        printed.call(loaded.joint_modelica_rates, x, np.append(u, 0.0), ready.parameters, f)
        printed.call(loaded.joint_modelica_outputs, x, np.append(u, 0.0), ready.parameters, o)
        ready.call("outputs", x.copy(), np.append(u, 0.0), ready.precomputed, expected)
        np.testing.assert_allclose(f, ready.rates(x, np.append(u, 0.0)), rtol=1e-12)
        np.testing.assert_allclose(o, expected, rtol=1e-12)


@pytest.mark.parametrize("name", ["dmsp-20-300", "overlap", "closed"])
def test_its_text_declares_what_it_uses(name, tmp_path):
    plant, paths = package(name, tmp_path)
    text = re.sub(r"/\*.*?\*/", "", paths[0].read_text(encoding="utf-8"), flags=re.DOTALL)
    assert paths[0].relative_to(tmp_path) == Path("joint/package.mo")
    declared = re.findall(r"^    (?:input |output |parameter )?Real (\w+)\(", text, flags=re.MULTILINE)
    assert len(declared) == len(set(declared))
    states = re.findall(r"^    (\w+) = x_\[(\d+)\];", text, flags=re.MULTILINE)
    assert [int(i) for _, i in states] == list(range(1, len(plant.states) + 1))
    outputs = re.findall(r"^    (\w+) = o_\[(\d+)\];", text, flags=re.MULTILINE)
    assert {word for word, _ in (*states, *outputs)} <= set(declared)
    for array in ("u_", "p_"):
        (items,) = re.findall(rf"Real {array}\[\d+\] = {{(.*?)}};", text)
        assert set(items.split(", ")) <= {*declared, "0.0"}
    for opening, closing in ("()", "{}", "[]"):
        assert text.count(opening) == text.count(closing)
    words = re.findall(r"^ *(?:block|function|package) (\w+)", text, flags=re.MULTILINE)
    assert sorted(words) == sorted(re.findall(r"^ *end (\w+);", text, flags=re.MULTILINE))


@pytest.mark.tool
@pytest.mark.parametrize("name", ["dmsp-20-300", "overlap", "closed"])
def test_rumoca_resolves_and_flattens_the_package(name, tmp_path):
    rumoca = pytest.importorskip("rumoca", reason="needs the package rumoca")
    plant, paths = package(name, tmp_path)
    model = rumoca.Session(roots=[str(tmp_path)]).load(str(paths[0]), model="joint.Plant")
    assert len(model.states) == 1  # the vector of all states
    assert len(model.inputs) == len(plant.inputs)


@pytest.mark.tool
@pytest.mark.parametrize("name", ["dmsp-20-300", "overlap", "closed"])
def test_pymoca_parses_the_package(name, tmp_path):
    parser = pytest.importorskip("pymoca.parser", reason="needs the package pymoca")
    _, paths = package(name, tmp_path)
    tree = parser.parse(paths[0].read_text(encoding="utf-8"))
    assert "Plant" in tree.classes["joint"].classes


def test_a_controller_is_refused_by_name(tmp_path):
    plant = plants.EXAMPLES["dmsp-20-300"]
    loop = ControlLoop(PID("pressure", "fill", 1e-5), 0.01, Schedule({"pressure": ((0.0, 2e5),)}))
    with pytest.raises(ParameterError, match="the controller PID cannot be exported to this target"):
        write_modelica(Problem(plant, loop, 0.1, plant.state_at(pressure=1e5)), tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_the_command_writes_the_package(tmp_path):
    example = Path(__file__).parents[2] / "examples" / "fill_discharge.toml"
    arguments = ["export", str(example), "--to", "modelica", "--tunable", "mechanism.mass", "--out", str(tmp_path)]
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
        shutil.rmtree(tmp_path / "unit_test")
    assert declared["p_muscle_contractile_softening"] == 'unit = "N/(m.Pa)"'
    assert declared["p_muscle_stop_contact_stiffness"] == ""
    factors = r"[A-Za-z]+\d*(\.[A-Za-z]+\d*)*"
    units = {found[1] for found in map(re.compile('unit = "(.*)"').fullmatch, declared.values()) if found}
    assert len(units) > 8
    assert all(re.fullmatch(rf"(1|{factors})(/([A-Za-z]+\d*|\({factors}\)))?", unit) for unit in units)
