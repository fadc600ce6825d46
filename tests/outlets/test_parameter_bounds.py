"""Parameters beyond their bounds, and such that are not finite, are refused by every target as in
Python; in C, whose functions check nothing, by the function that its header names.

Every target is asked whether it takes a value of one parameter; the bounds themselves are taken.
"""

from __future__ import annotations

import ctypes
import importlib.util
import json
import math
import re
import sys
from collections.abc import Callable

import numpy as np
import printed
import pytest

from airmuscle.control import PID
from airmuscle.core import leaves, with_parameters
from airmuscle.engine import ControlLoop, Problem, SampledSignal, Schedule, SplitRange
from airmuscle.errors import AirmuscleError
from airmuscle.files import load_law, load_scenario
from airmuscle.outlets import (
    C99,
    JavaScript,
    Octave,
    OnnxStack,
    TorchStack,
    WarpStack,
    write_actuator,
    write_controller,
    write_fmu,
    write_law,
    write_modelica,
    write_mujoco_plugin,
    write_program,
)

PLANT = load_scenario("lift-dmsp-20").plant
LAW = load_law("tondu-lopez").characteristic
PATH = "circuit.fill.critical_ratio"
OF_LAW = "end_correction"
OF_CONTROLLER = "setpoint_weight"

Takes = Callable[[float], bool]
"""Whether a target takes this value of its parameter."""


def bounds_of(model, path):
    (leaf,) = (leaf for leaf in leaves(model) if leaf.path == path)
    return leaf.declared.bounds


def problem(loop=None):
    closed = SampledSignal(dict.fromkeys(PLANT.inputs, ((0.0, 0.0),)))
    return Problem(PLANT, loop or closed, 0.01, PLANT.state_at(pressure=2e5))


def control_loop():
    law = PID("pressure", SplitRange("fill", "discharge"), gain=1e-5)
    return ControlLoop(law, 5e-3, Schedule({"pressure": ((0.0, 2.5e5),)}))


def raising(change: Callable[[float], object], *errors) -> Takes:
    """Of a target that refuses by raising."""

    def takes(value):
        try:
            change(value)
        except errors:
            return False
        return True

    return takes


def of_python(folder):
    paths = [leaf.path for leaf in leaves(PLANT)]
    values = [float(leaf.value) for leaf in leaves(PLANT)]
    place = paths.index(PATH)

    def change(value):
        with_parameters(PLANT, [*values[:place], value, *values[place + 1 :]])

    return raising(change, AirmuscleError)


def check_of_c(folder, name, path):
    """The function of a C source that checks parameters, with one of its defaults changed."""
    text = "\n".join(f'#include "{source.name}"' for source in sorted(folder.glob("*.c")))
    library = printed.shared_library(text + "\n", folder, "all")
    count = int(re.search(r"_PARAMETERS (\d+)", (folder / f"{name}.h").read_text())[1])
    names = (ctypes.c_char_p * count).in_dll(library, f"{name}_parameter_names")
    place = names[:].index(path.encode())
    stated = f"{name}_parameters" if hasattr(library, f"{name}_parameters") else f"{name}_defaults"
    values = (ctypes.c_double * count).in_dll(library, stated)[:]

    def takes(value):
        row = (ctypes.c_double * count)(*values[:place], value, *values[place + 1 :])
        answer = getattr(library, f"{name}_check_parameters")(row)
        assert answer in (-1, place)
        return answer == -1

    return takes


def of_c(folder):
    write_program(problem(), folder, C99(), name="lift", tunable=[PATH])
    (folder / "main.c").unlink()
    return check_of_c(folder, "lift", PATH)


def of_law_in_c(folder):
    write_law(LAW, folder, C99(), name="lift")
    return check_of_c(folder, "lift", OF_LAW)


def of_controller_in_c(folder):
    write_controller(problem(control_loop()), folder, name="lift", tunable=[OF_CONTROLLER])
    (folder / "main.c").unlink()
    return check_of_c(folder, "lift", OF_CONTROLLER)


def by_node(folder, call):
    """Whether a call of the module in Node throws no RangeError."""
    script = f"""
import * as M from "./lift.mjs";
const value = Number(process.argv[2]);
try {{ {call}; console.log("taken"); }}
catch (error) {{ if (!(error instanceof RangeError)) throw error; console.log(error.message); }}
"""
    (folder / "driver.mjs").write_text(script)

    def takes(value):
        words = {math.inf: "Infinity", -math.inf: "-Infinity"}
        word = "NaN" if value != value else words.get(value, repr(value))
        _, text = printed.finished([printed.require("node"), "driver.mjs", word], folder)
        return text.strip() == "taken"

    return takes


def of_javascript(folder):
    write_program(problem(), folder, JavaScript(), name="lift", tunable=[PATH])
    return by_node(folder, f"M.simulate({{parameters: {{{json.dumps(PATH)}: value}}}})")


def of_law_in_javascript(folder):
    write_law(LAW, folder, JavaScript(), name="lift")
    place = [leaf.path for leaf in leaves(LAW)].index(OF_LAW)
    changed = f"M.defaults.map((other, i) => i === {place} ? value : other)"
    return by_node(folder, f"M.law(3e5, 0.1, {changed})")


def of_controller_in_javascript(folder):
    loop = problem(control_loop())
    write_program(loop, folder, JavaScript(), name="lift", tunable=[f"controller.{OF_CONTROLLER}"])
    return by_node(folder, f"M.simulate({{controllerParameters: {{{OF_CONTROLLER}: value}}}})")


def by_octave(folder, call):
    octave = [printed.require("octave-cli"), "--no-init-file", "--quiet", "--eval"]

    def takes(value):
        words = {math.inf: "Inf", -math.inf: "-Inf"}
        word = "NaN" if value != value else words.get(value, repr(value))
        script = (
            f"value = {word}; try; {call}; printf('taken'); catch error;"
            " assert(any(strfind(error.message, 'allowed are'))); end"
        )
        return printed.finished([*octave, script], folder)[1] == "taken"

    return takes


def of_octave(folder):
    write_program(problem(), folder, Octave(), name="lift", tunable=[PATH])
    return by_octave(folder, "m = lift(); m.simulate(struct('parameters', value));")


def of_law_in_octave(folder):
    write_law(LAW, folder, Octave(), name="lift")
    values = [float(leaf.value) for leaf in leaves(LAW)]
    place = [leaf.path for leaf in leaves(LAW)].index(OF_LAW) + 1
    return by_octave(folder, f"p = {values}; p({place}) = value; lift(3e5, 0.1, p);")


def of_modelica(folder):
    """The attributes of the parameter, which tools compare with its value."""
    (path,) = write_modelica(problem(), folder, name="lift", tunable=[PATH])
    word = "p_" + PATH.replace(".", "_")
    (attributes,) = re.findall(rf"parameter Real {word}\((.*?)\) =", path.read_text())
    low, high = (float(re.search(rf"{name} = ([^,)]+)", attributes)[1]) for name in ("min", "max"))
    return lambda value: low <= value <= high


def module_of(path):
    """A written module, imported."""
    spec = importlib.util.spec_from_file_location(f"bounds_{path.stem}", path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def of_torch(folder):
    pytest.importorskip("torch", reason="needs the package torch")
    write_actuator(PLANT, folder, TorchStack(), name="muscle")
    actuator = module_of(folder / "muscle.py").Muscle((2,))
    return raising(lambda value: actuator.set_parameters({PATH: value}), ValueError)


def of_warp(folder):
    warp = pytest.importorskip("warp", reason="needs the package warp-lang")
    warp.config.quiet = True
    write_actuator(PLANT, folder, WarpStack(), name="muscle")
    actuator = module_of(folder / "muscle_warp.py").Muscle(2, device="cpu")
    return raising(lambda value: actuator.set_parameters({PATH: value}), ValueError)


def of_onnx(folder):
    runtime = pytest.importorskip("onnxruntime", reason="needs the package onnxruntime")
    pytest.importorskip("onnx", reason="needs the package onnx")
    runtime.set_default_logger_severity(3)
    write_actuator(PLANT, folder, OnnxStack(tunable=True), name="muscle")
    begin, step = (
        runtime.InferenceSession(str(folder / f"{file}.onnx"), providers=["CPUExecutionProvider"])
        for file in ("muscle_start", "muscle")
    )
    paths = step.get_modelmeta().custom_metadata_map["parameters"].split(", ")
    usual = {leaf.path: float(leaf.value) for leaf in leaves(PLANT)}
    defaults = np.array([[usual.get(path, 0.0)] for path in paths])

    def takes(value):
        parameters = np.tile(defaults, 2)
        parameters[paths.index(PATH), 1] = value
        at = {"pressure": np.full(2, 2e5), "length": np.full(2, 0.28)}
        (state,) = begin.run(["state"], {**at, "parameters": np.tile(defaults, 2)})
        given = {"command": np.zeros(2), "length": at["length"], "speed": np.zeros(2)}
        given |= {"dt": np.array(1e-3), "state": state, "parameters": parameters}
        tension, valid = step.run(["tension", "valid"], given)
        assert valid[0]
        np.testing.assert_array_equal(np.isfinite(tension), valid)
        return bool(valid[1])

    return takes


def of_fmu(folder):
    fmpy = pytest.importorskip("fmpy", reason="needs the package fmpy")
    printed.require("gcc")
    path = write_fmu(problem(), folder / "lift.fmu", name="lift", tunable=[PATH]).path
    about = fmpy.read_model_description(str(path), validate=False)
    number = {variable.name: variable.valueReference for variable in about.modelVariables}
    fmu = fmpy.instantiate_fmu(fmpy.extract(str(path), folder / "u"), about, "CoSimulation")
    place = [number[f"parameters.{PATH}"]]
    return raising(lambda value: fmu.setFloat64(place, [value]), Exception)


def of_mujoco(folder):
    """The attribute of a model that is not written by `add_to`, which refuses by itself."""
    mujoco = pytest.importorskip("mujoco", reason="needs the package mujoco")
    printed.require("gcc")
    try:
        made = write_mujoco_plugin(PLANT, folder, name="bounds")
    except AirmuscleError as reason:
        pytest.skip(str(reason))

    def model(value, checked):
        spec = mujoco.MjSpec()
        body = spec.worldbody.add_body(name="load")
        body.add_joint(name="z", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0, 0, 1])
        body.add_geom(size=[0.05, 0, 0], mass=10.0, contype=0, conaffinity=0)
        given = {"parameters": {PATH: value}} if checked else {}
        made.add_to(spec, name="muscle", joint="z", gear=-1.0, rest_length=0.0, **given)
        if not checked:
            spec.plugins[0].config = {PATH: repr(value), "rest_length": "0.0"}
        mujoco.MjData(spec.compile())

    by_plugin = raising(lambda value: model(value, False), Exception)
    by_python = raising(lambda value: model(value, True), AirmuscleError)

    def takes(value):
        answers = {by_plugin(value), by_python(value)}
        assert len(answers) == 1
        return answers.pop()

    return takes


TARGETS = {
    "Python": of_python,
    "C": of_c,
    "law in C": of_law_in_c,
    "controller in C": of_controller_in_c,
    "JavaScript": of_javascript,
    "law in JavaScript": of_law_in_javascript,
    "controller in JavaScript": of_controller_in_javascript,
    "Octave": of_octave,
    "law in Octave": of_law_in_octave,
    "Modelica": of_modelica,
    "PyTorch": of_torch,
    "Warp": of_warp,
    "ONNX": of_onnx,
    "FMU": of_fmu,
    "MuJoCo": of_mujoco,
}
TOOLS = ("PyTorch", "Warp", "ONNX", "FMU", "MuJoCo")


def bounds_of_target(target):
    if target.startswith("law"):
        return bounds_of(LAW, OF_LAW)
    if target.startswith("controller"):
        return bounds_of(control_loop().controller, OF_CONTROLLER)
    return bounds_of(PLANT, PATH)


@pytest.mark.parametrize(
    "target",
    [pytest.param(name, marks=[pytest.mark.tool] if name in TOOLS else []) for name in TARGETS],
)
def test_a_parameter_beyond_its_bounds_is_refused(target, tmp_path):
    takes = TARGETS[target](tmp_path)
    low, high = bounds_of_target(target)
    width = high - low
    for value in (low, 0.5 * (low + high), high):
        assert takes(value), value
    for value in (low - 0.01 * width, high + 0.01 * width, -5e9, 5e9, math.nan, math.inf):
        assert not takes(value), value
