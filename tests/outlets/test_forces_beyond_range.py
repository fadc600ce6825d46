"""Beyond the range of a law the muscle of every target has the force of NumPy: it falls with the
contraction, is at most 1.5 times the rated force, and is no number where a point is none.

Every target is asked for the force of one muscle at rest at the same points: stretched, slack, and
up to 1.5 times the rated pressure. The laws are those of the example plants, one of each class.
Scale of a deviation: 1.5 times the rated force.
"""

from __future__ import annotations

import ctypes
import importlib.util
import math
import re
import sys
import warnings
import zipfile
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import plants
import printed
import pytest
from modelica_block import ModelicaBlock
from widths import widened

from airmuscle.engine import Double, Problem, Schedule
from airmuscle.engine.compile import compile_system, functions
from airmuscle.engine.compile.text import languages
from airmuscle.errors import AirmuscleError, AirmuscleWarning
from airmuscle.outlets import (
    C99,
    JavaScript,
    Octave,
    OnnxStack,
    TorchStack,
    WarpStack,
    write_actuator,
    write_fmu,
    write_law,
    write_modelica,
    write_mujoco_plugin,
    write_program,
)
from airmuscle.physics import LinearDamper, LinearSpring, Ratings, ValidityRange, Vessel
from airmuscle.physics.muscle.characteristic import calls

RANGE = ValidityRange(0.5e5, 6e5, 0.0, 0.2)
RATED = 1500.0
LIMIT = 1.5
ROUNDING = 1e-11
"""Deviation from NumPy relative to the greatest permitted force."""
PRESSURES = np.array([0.0, *RANGE.pressure, 1.2 * RANGE.max_pressure, 1.5 * RANGE.max_pressure])
CONTRACTIONS = np.array([-0.3, -0.1, -0.02, -1e-3, 0.0, 0.05, 0.12, 0.2, 0.21, 0.3, 0.45, 0.6])
AT_STRAIGHT_FIBRES = np.linspace(1e-4, 0.4, 12)
"""Contractions of a law whose geometry ends at 0."""


class Points(NamedTuple):
    """Gauge pressures [Pa] and contractions [1], (N,)."""

    pressure: np.ndarray
    contraction: np.ndarray


Forces = Callable[[Points], np.ndarray]
"""Forces [N] of a target at points (N,); NaN where it refuses a point."""


def laws():
    """The name of the first example plant with each class of law."""
    names = {}
    for name, plant in plants.EXAMPLES.items():
        names.setdefault(type(plant.muscles[0].contractile), name)
    return list(names.values())


def plant_of(name):
    """A muscle of a law alone, in a vessel, whose volume has no ends, with range and ratings."""
    plant = plants.EXAMPLES[name]
    muscle = plant.muscle
    volume = muscle.geometry if name == "circle" else Vessel(2e-4)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)
        muscle = replace(
            muscle,
            geometry=volume,
            spring=LinearSpring(0.0),
            damper=LinearDamper(100.0),
            validity_range=RANGE,
            ratings=Ratings(max_force=RATED),
        )
        return replace(plant, muscle=muscle)


def points_of(name):
    """The points of a law (pressures, contractions) as a table."""
    contractions = AT_STRAIGHT_FIBRES if name == "circle" else CONTRACTIONS
    pressure, contraction = np.meshgrid(PRESSURES, contractions, indexing="ij")
    return Points(pressure.ravel(), contraction.ravel())


def position_of(plant, contraction):
    return float(contraction * plant.muscle.geometry.resting_length)


def states_of(plant, points):
    """States (N, n) of the plant at rest; NaN where a point is none."""
    rows = []
    for pressure, contraction in zip(*points, strict=True):
        known = [0.0 if math.isnan(value) else value for value in (pressure, contraction)]
        state = plant.state_at(pressure=float(known[0]), position=position_of(plant, known[1]))
        if math.isnan(pressure):
            state["air_mass"] = math.nan
        if math.isnan(contraction):
            state["position"] = math.nan
        rows.append([state[variable.name] for variable in plant.states])
    return np.array(rows)


def problem_of(plant, state=None, duration=0.1, **options):
    state = state or plant.state_at(pressure=1e5, position=position_of(plant, 0.1))
    closed = Schedule(dict.fromkeys(plant.inputs, ((0.0, 0.0),)))
    return Problem(plant, closed, duration, state, **options)


def module_of(path):
    """A written module, imported."""
    spec = importlib.util.spec_from_file_location(f"beyond_{path.stem}", path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def of_machine_code(plant, folder, name):
    ready = compile_system(plant)
    place = ready.description.output_names.index("force")

    def forces(points):
        results = []
        for x in states_of(plant, points):
            outputs = np.zeros(ready.sizes.outputs)
            ready.call("outputs", x, np.zeros(len(plant.inputs) + 1), ready.precomputed, outputs)
            results.append(outputs[place])
        return np.array(results)

    return forces


def of_c(plant, folder, name):
    ready = compile_system(plant)
    place = ready.description.output_names.index("force")
    text, sizes = functions.system_module(ready.program.traced, languages.CLanguage(public=None))
    library = printed.shared_library("#include <math.h>\n" + text, folder, level="-O0")
    prepared = np.zeros(sizes.held + 1)
    printed.call(library.prepare, ready.parameters, prepared)

    def forces(points):
        results = []
        for x in states_of(plant, points):
            outputs = np.zeros(sizes.outputs)
            printed.call(library.outputs, x, np.zeros(len(plant.inputs) + 1), prepared, outputs)
            results.append(outputs[place])
        return np.array(results)

    return forces


JAVASCRIPT = """
import * as M from "./muscle.mjs";
import {readFileSync} from "fs";
const d = JSON.parse(readFileSync("data.json"));
const c = new Float64Array(d.held);
M.prepare(Float64Array.from(M.defaults), c);
console.log(JSON.stringify(d.states.map((row) => {
  const o = new Float64Array(M.outputs.length);
  M.outputsOf(Float64Array.from(row, (x) => x ?? NaN), new Float64Array(M.inputs.length), c, o);
  return o[M.outputs.indexOf("force")];
})));
"""


def of_javascript(plant, folder, name):
    write_program(problem_of(plant), folder, JavaScript(), name="muscle")
    size = compile_system(plant).sizes.held + 1

    def forces(points):
        states = states_of(plant, points).tolist()
        rows = [[None if math.isnan(x) else x for x in row] for row in states]
        found = printed.run_node(JAVASCRIPT, {"held": size, "states": rows}, folder)
        return np.array(found, dtype=float)

    return forces


OCTAVE = """
model = muscle();
c = model.prepare(model.defaults);
place = find(strcmp(model.output_names, 'force'));
states = dlmread('states.txt');
for k = 1:rows(states)
  o = model.outputs(states(k, :)', zeros(numel(model.inputs), 1), c);
  printf('%.17g\\n', o(place));
end
"""


def of_octave(plant, folder, name):
    octave = [printed.require("octave-cli"), "--no-init-file", "--quiet", "--eval", OCTAVE]
    write_program(problem_of(plant), folder, Octave(), name="muscle")

    def forces(points):
        np.savetxt(folder / "states.txt", states_of(plant, points), fmt="%.17g")
        _, text = printed.finished(octave, folder)
        return np.array([float(line) for line in text.split()])

    return forces


def of_modelica(plant, folder, name):
    (path,) = write_modelica(problem_of(plant), folder, name="joint")
    block = ModelicaBlock(path)
    parameters = compile_system(plant).parameters.tolist()
    closed = [0.0] * len(block.inputs)

    def forces(points):
        rows = states_of(plant, points).tolist()
        return np.array([block.values(parameters, row, closed)["force"] for row in rows])

    return forces


def of_jax(plant, folder, name):
    jax = pytest.importorskip("jax", reason="needs the package jax")
    jax.config.update("jax_enable_x64", True)
    closed = dict.fromkeys(plant.inputs, jax.numpy.asarray(0.0))
    names = [variable.name for variable in plant.states]

    def force(row):
        return plant.outputs(dict(zip(names, row, strict=True)), closed)["force"]

    mapped = jax.jit(jax.vmap(force))
    return lambda points: np.asarray(mapped(jax.numpy.asarray(states_of(plant, points))))


def lengths_of(plant, points):
    return plant.muscle.geometry.resting_length * (1.0 - points.contraction)


def of_torch(plant, folder, name):
    torch = pytest.importorskip("torch", reason="needs the package torch")
    write_actuator(plant, folder, TorchStack(), name="muscle")
    module = module_of(folder / "muscle.py")

    def forces(points):
        actuator = module.Muscle((len(points.pressure),), dtype=torch.float64)
        pressure, length = map(torch.tensor, (points.pressure, lengths_of(plant, points)))
        state = actuator.start(pressure, length)
        tension, _, valid, _ = actuator.compute(state, 0.0, length, 0.0, 1e-3)
        check_valid(valid.numpy(), points)
        return tension.numpy()

    return forces


def check_valid(valid, points):
    """The flag of an actuator is that of the range of its muscle, away from its limits."""
    inside = RANGE.contains(points.pressure, points.contraction)
    at_limit = np.isclose(points.contraction[:, None], RANGE.contraction).any(axis=1)
    at_limit |= np.isclose(points.pressure[:, None], RANGE.pressure).any(axis=1)
    np.testing.assert_array_equal(valid[~at_limit], inside[~at_limit])


def of_warp(plant, folder, name):
    warp = pytest.importorskip("warp", reason="needs the package warp-lang")
    warp.config.quiet = True
    write_actuator(plant, folder, WarpStack(Double()), name="muscle")
    module = module_of(folder / "muscle_warp.py")

    def forces(points):
        count = len(points.pressure)
        array = lambda values: warp.array(values, dtype=module.real, device="cpu")  # noqa: E731
        actuator = module.Muscle(count, device="cpu")
        length = array(lengths_of(plant, points))
        still = array(np.zeros(count))
        actuator.start(array(points.pressure), length)
        actuator.compute(still, length, still, 1e-3)
        check_valid(actuator.valid.numpy() > 0.5, points)
        return actuator.tension.numpy()

    return forces


def of_onnx(plant, folder, name):
    runtime = pytest.importorskip("onnxruntime", reason="needs the package onnxruntime")
    pytest.importorskip("onnx", reason="needs the package onnx")
    runtime.set_default_logger_severity(3)
    write_actuator(plant, folder, OnnxStack(), name="muscle")
    begin, step = (
        runtime.InferenceSession(str(folder / f"{file}.onnx"), providers=["CPUExecutionProvider"])
        for file in ("muscle_start", "muscle")
    )

    def forces(points):
        length = lengths_of(plant, points)
        still = np.zeros(len(length))
        (state,) = begin.run(["state"], {"pressure": points.pressure, "length": length})
        given = {"command": still, "length": length, "speed": still, "dt": np.array(1e-3)}
        tension, valid = step.run(["tension", "valid"], {**given, "state": state})
        check_valid(valid, points)
        return tension

    return forces


def of_fmu(plant, folder, name):
    fmpy = pytest.importorskip("fmpy", reason="needs the package fmpy")
    from fmpy.fmi3 import FMU3Slave

    printed.require("gcc")
    path = write_fmu(problem_of(plant), folder / "muscle.fmu", name="muscle").path
    with zipfile.ZipFile(path) as archive:
        archive.extractall(folder / "unzipped")
    about = fmpy.read_model_description(str(path), validate=False)
    number = {variable.name: variable.valueReference for variable in about.modelVariables}
    fmu = FMU3Slave(
        guid=about.guid,
        unzipDirectory=str(folder / "unzipped"),
        instanceName="test",
        modelIdentifier=about.coSimulation.modelIdentifier,
    )
    fmu.instantiate()
    fmu.enterInitializationMode(startTime=0.0)
    fmu.exitInitializationMode()
    names = [number[variable.name] for variable in plant.states]

    def forces(points):
        results = []
        for x in states_of(plant, points):
            try:
                fmu.setFloat64(names, x.tolist())
                results.append(fmu.getFloat64([number["force"]])[0])
            except Exception:  # the error of an FMU
                results.append(math.nan)
        return np.array(results)

    return forces


def of_mujoco(plant, folder, name):
    mujoco = pytest.importorskip("mujoco", reason="needs the package mujoco")
    printed.require("gcc")
    try:
        made = write_mujoco_plugin(plant, folder, name="beyond_" + re.sub(r"\W", "_", name))
    except AirmuscleError as reason:
        pytest.skip(str(reason))
    spec = mujoco.MjSpec()
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4  # the force is not that of a whole step
    body = spec.worldbody.add_body(name="load")
    body.add_joint(name="z", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0, 0, 1])
    body.add_geom(size=[0.05, 0, 0], mass=10.0, contype=0, conaffinity=0)
    made.add_to(spec, name="muscle", joint="z", gear=-1.0, rest_length=0.0)
    model = spec.compile()
    data = mujoco.MjData(model)

    def forces(points):
        results = []
        for pressure, contraction in zip(*points, strict=True):
            data.qpos[0] = position_of(plant, contraction)
            try:
                made.initialise(model, data, "muscle", pressure=float(pressure))
            except AirmuscleError:
                results.append(math.nan)
                continue
            mujoco.mj_forward(model, data)
            results.append(-data.actuator_force[0])
        return np.array(results)

    return forces


def stated(plant):
    """The law of a plant with the range and the ratings of its muscle."""
    muscle = plant.muscle
    return calls.with_stated_range(
        muscle.contractile, muscle.validity_range, muscle.ratings.max_force
    )


def of_law_in_c(plant, folder, name):
    write_law(stated(plant), folder, C99(), name="law")
    library = printed.shared_library('#include "law.c"\n', folder, level="-O0")
    defaults = (ctypes.c_double * 500).in_dll(library, "law_defaults")
    prepared = np.zeros(500)
    library.law_prepare(defaults, ctypes.c_void_p(prepared.ctypes.data))

    def forces(points):
        rows = np.empty((len(points.pressure), 3))
        for row, pressure, contraction in zip(rows, *points, strict=True):
            printed.call(library.law_evaluate, pressure, contraction, prepared, row)
        return rows[:, 0]

    return forces


LAW_IN_JAVASCRIPT = """
import {law, results} from "./law.mjs";
import {readFileSync} from "fs";
const points = JSON.parse(readFileSync("data.json"));
console.log(JSON.stringify(points.map(([a, b]) => law(a, b)[results[0]])));
"""


def of_law_in_javascript(plant, folder, name):
    write_law(stated(plant), folder, JavaScript(), name="law")

    def forces(points):
        rows = np.column_stack(points).tolist()
        return np.array(printed.run_node(LAW_IN_JAVASCRIPT, rows, folder), dtype=float)

    return forces


LAW_IN_OCTAVE = """
points = dlmread('points.txt');
printf('%.17g\\n', law(points(:, 1), points(:, 2)));
"""


def of_law_in_octave(plant, folder, name):
    octave = [printed.require("octave-cli"), "--no-init-file", "--quiet", "--eval", LAW_IN_OCTAVE]
    write_law(stated(plant), folder, Octave(), name="law")

    def forces(points):
        np.savetxt(folder / "points.txt", np.column_stack(points), fmt="%.17g")
        _, text = printed.finished(octave, folder)
        return np.array([float(line) for line in text.split()])

    return forces


PRINTED_LAWS = {
    "C": of_law_in_c,
    "JavaScript": of_law_in_javascript,
    "Octave": of_law_in_octave,
}
TARGETS = {
    "machine code": of_machine_code,
    "C": of_c,
    "JavaScript": of_javascript,
    "Octave": of_octave,
    "equations of Modelica": of_modelica,
    "JAX": of_jax,
    "PyTorch": of_torch,
    "Warp": of_warp,
    "ONNX": of_onnx,
    "FMU": of_fmu,
    "MuJoCo": of_mujoco,
}
TOOLS = ("JAX", "PyTorch", "Warp", "ONNX", "FMU", "MuJoCo")
USUAL = ("dmsp-20-300", "sarosi", "circle")
"""Laws of every target by default: one without limits, one with them, one that begins infinite."""
targets = pytest.mark.parametrize(
    "target",
    [pytest.param(name, marks=[pytest.mark.tool] if name in TOOLS else []) for name in TARGETS],
)


@targets
@pytest.mark.parametrize("name", widened(laws(), lambda name: name in USUAL))
def test_the_force_of_every_target_is_that_of_numpy_and_monotone_and_bounded(
    target, name, tmp_path
):
    plant = plant_of(name)
    points = points_of(name)
    found = TARGETS[target](plant, tmp_path, name)(points)
    expected = plant.muscle.tension(*points)
    assert np.isfinite(found).all()
    assert np.abs(found - expected).max() <= ROUNDING * LIMIT * RATED
    assert (found >= 0.0).all()
    check_contract(points, found, expected)


def check_contract(points, found, expected):
    """Bounded, without push outside the range, and falling with the contraction beyond it."""
    inside = RANGE.contains(*points)
    assert (found[~inside] >= 0.0).all()
    assert found.max() <= max(LIMIT * RATED, expected[inside].max()) * (1.0 + ROUNDING)
    # a formula that pushes inside the range is slack from its end on
    table = np.maximum(found, 0.0).reshape(len(PRESSURES), -1)
    contraction = points.contraction[: table.shape[1]]
    beyond = ~((contraction >= RANGE.min_contraction) & (contraction <= RANGE.max_contraction))
    falls = np.diff(table, axis=1)[:, beyond[1:] | beyond[:-1]]
    assert (falls <= ROUNDING * RATED).all()


@pytest.mark.parametrize("target", PRINTED_LAWS)
@pytest.mark.parametrize("name", widened(laws(), lambda name: name in USUAL))
def test_the_force_of_a_printed_law_is_that_of_python_and_monotone_and_bounded(
    target, name, tmp_path
):
    """A law alone, with the range and the ratings of its muscle; one of straight fibres, whose
    force is infinite at zero contraction, is its formula.
    """
    plant = plant_of(name)
    points = points_of(name)
    found = PRINTED_LAWS[target](plant, tmp_path, name)(points)
    law = stated(plant)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)
        expected = law.force(*points)
    scale = max(LIMIT * RATED, np.abs(expected).max())
    assert np.abs(found - expected).max() <= ROUNDING * scale
    if not law.refuses_beyond:
        check_contract(points, found, expected)


@pytest.mark.tool
@pytest.mark.parametrize("target", TOOLS)
def test_a_point_that_is_no_number_has_no_force(target, tmp_path):
    """The other targets are equations, which check nothing; their runs refuse such a start
    (test_input_contract.py).
    """
    plant = plant_of("dmsp-20-300")
    forces = TARGETS[target](plant, tmp_path, "nan")
    lost = Points(np.array([math.nan, 3e5, 3e5]), np.array([0.1, math.nan, 0.1]))
    found = forces(lost)
    assert np.isnan(found[:2]).all()
    assert found[2] == pytest.approx(plant.muscle.tension(3e5, 0.1))
