"""One contract of all targets for an input beyond its range and for one that is not finite
(docs/reference/input-contract.md): it is refused, which is told and leaves the state, or it is limited to its
range; never does another number take its place silently.

Every target is driven by the same openings of a valve, one a step, with one that is wrong among
them. What was refused costs no more than its step: the further steps are those of the run without
it, to the last bit.
"""

from __future__ import annotations

import contextlib
import ctypes
import dataclasses
import importlib.util
import json
import math
import subprocess
import sys
import zipfile
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import plants
import printed
import pytest

from airmuscle.control import PID
from airmuscle.engine import (
    ControlLoop,
    Problem,
    RungeKutta4,
    SampledSignal,
    Schedule,
    SplitRange,
    Stepper,
    simulate,
    simulate_batch,
)
from airmuscle.errors import AirmuscleError
from airmuscle.files import load_scenario
from airmuscle.outlets import (
    C99,
    JavaScript,
    Octave,
    OnnxStack,
    TorchStack,
    WarpStack,
    write_actuator,
    write_fmu,
    write_mujoco_plugin,
    write_program,
)

LIFT = load_scenario("lift-dmsp-20").plant
START = LIFT.state_at(pressure=2e5)
STEP = 5e-3
OPENINGS = (0.3, 0.5, 0.2, 0.4)
"""Openings of the fill valve, one a step; the range is 0 to 1."""
AT = 2
"""The step that is inserted with a wrong opening."""
NOT_FINITE = (math.nan, math.inf, -math.inf)
LENGTH = 0.28


class Response(NamedTuple):
    """What a target does in a step: whether it tells that the input was refused, and its state
    after it.
    """

    refused: bool
    state: tuple[float, ...]


Drive = Callable[[list[float]], list[Response]]
"""Responses to openings, one a step."""


@dataclasses.dataclass(frozen=True)
class Target:
    """A target, by a function that prepares it in a folder.

    limits     whether an input beyond its range is limited, in place of refused
    continues  whether a step that was refused takes no time
    """

    prepare: Callable[..., Drive]
    limits: bool = False
    continues: bool = True


def by_exceptions(step: Callable[[float], None], state: Callable[[], tuple[float, ...]]) -> Drive:
    """Of a target that refuses by raising."""

    def drive(openings):
        responses = []
        for opening in openings:
            try:
                step(opening)
                refused = False
            except (AirmuscleError, ValueError):
                refused = True
            responses.append(Response(refused, state()))
        return responses

    return drive


def anew(make: Callable[[], Drive]) -> Drive:
    """A target that begins anew with every series of openings."""

    def drive(openings):
        return make()(openings)

    return drive


def problem(integrator=RungeKutta4(1e-3)):
    names = dict.fromkeys(LIFT.inputs, ((0.0, 0.0),))
    return Problem(LIFT, SampledSignal(names), STEP, START, integrator=integrator)


def of_stepper(folder):
    def make():
        stepper = Stepper(LIFT, START, integrator=RungeKutta4(1e-3))
        return by_exceptions(
            lambda opening: stepper.step({"fill": opening}, STEP),
            lambda: tuple(stepper.state.tolist()),
        )

    return anew(make)


def of_simulate(folder):
    def make():
        state = dict(START)

        def step(opening):
            signal = SampledSignal({"fill": ((0.0, opening),), "discharge": ((0.0, 0.0),)})
            run = simulate(
                LIFT, signal, duration=STEP, initial_state=state, integrator=RungeKutta4(1e-3)
            )
            state.update({name: float(run[name][-1]) for name in state})

        return by_exceptions(step, lambda: tuple(state.values()))

    return anew(make)


def of_batch(folder):
    def make():
        states = dict(START)

        def step(opening):
            signal = SampledSignal({"fill": ((0.0, opening),), "discharge": ((0.0, 0.0),)})
            batch = simulate_batch(
                LIFT,
                {"mechanism.mass": np.array([LIFT.mechanism.mass])},
                signal,
                duration=STEP,
                initial_states=states,
                integrator=RungeKutta4(1e-3),
                keep=(),
            )
            states.update({name: float(batch.final[name][0]) for name in states})

        return by_exceptions(step, lambda: tuple(states.values()))

    return anew(make)


def of_environment(folder, count=0):
    gymnasium = pytest.importorskip("gymnasium", reason="needs the package gymnasium")
    from airmuscle.outlets import register_environments

    register_environments()

    def make():
        name = "airmuscle/Lift-v0"
        if count:
            env = gymnasium.make_vec(name, count, vectorization_mode="vector_entry_point", cores=1)
        else:
            env = gymnasium.make(name, disable_env_checker=True).unwrapped
        seen = [env.reset(seed=1)[0]]

        def step(opening):
            action = np.full(env.action_space.shape, opening, np.float32)
            seen.append(env.step(action)[0])

        return by_exceptions(step, lambda: tuple(np.ravel(seen[-1]).tolist()))

    return anew(make)


C_DRIVER = r"""
#include "lift.h"
int drive(const double *openings, int count, const double *initial, double *states, int *refused);
int drive(const double *openings, int count, const double *initial, double *states, int *refused)
{
  lift_solver s;
  double c[LIFT_PRECOMPUTED + 1];
  const double still[LIFT_INPUTS + 1] = {0.0};
  int i, k;
  lift_prepare(lift_defaults, c);
  lift_begin(&s, 0.0, initial);
  for (k = 0; k < count; k++) {
    double u[LIFT_INPUTS + 1] = {0.0};
    const double end = s.t + 5e-3;
    u[LIFT_INPUT_FILL] = openings[k];
    lift_set_segment(&s, end, u, still);
    s.h = LIFT_FIRST_STEP;
    refused[k] = LIFT_DONE;
    while (s.t < end && refused[k] == LIFT_DONE) refused[k] = lift_step(&s, c);
    for (i = 0; i < LIFT_STATES; i++) states[k * LIFT_STATES + i] = s.x[i];
  }
  return LIFT_OUT_OF_RANGE;
}
"""


def of_c(folder):
    write_program(problem(), folder / "c", C99(), name="lift")
    (folder / "c" / "main.c").unlink()
    (folder / "c" / "driver.c").write_text(C_DRIVER)
    sources = [str(path) for path in (folder / "c").glob("*.c")]
    target = folder / "c" / "lift.so"
    options = [*printed.STRICT, "-O1", "-fPIC", "-shared", "-o", str(target)]
    subprocess.run([printed.require("gcc"), *options, *sources, "-lm"], check=True)
    library = ctypes.CDLL(str(target))

    def drive(openings):
        states = np.zeros((len(openings), len(START)))
        refused = np.zeros(len(openings), np.int32)
        given = np.array(openings), np.array(list(START.values()))
        pointer = lambda array: array.ctypes.data_as(ctypes.c_void_p)  # noqa: E731
        library.drive(
            pointer(given[0]), len(openings), pointer(given[1]), pointer(states), pointer(refused)
        )
        return [
            Response(bool(status), tuple(row))
            for status, row in zip(refused.tolist(), states.tolist(), strict=True)
        ]

    return drive


JS_DRIVER = """
import * as lift from "./lift.mjs";
const {openings, initial} = JSON.parse(process.argv[2], (key, value) =>
  ({nan: NaN, inf: Infinity, "-inf": -Infinity})[value] ?? value);
const responses = [];
let state = initial;
for (const opening of openings) {
  const values = [lift.inputs.map((name) => (name === "fill" ? opening : 0))];
  const segments = {ends: [5e-3], values, slopes: [lift.inputs.map(() => 0)]};
  let refused = false;
  try {
    const run = lift.simulate({initial: state, segments, times: [5e-3]});
    refused = run.status !== lift.status.done;
    if (!refused) state = lift.states.map((name) => run.columns[name].at(-1));
  } catch (error) {
    if (!(error instanceof RangeError)) throw error;
    refused = true;
  }
  responses.push([refused, state]);
}
console.log(JSON.stringify(responses));
"""


def of_javascript(folder):
    write_program(problem(), folder / "js", JavaScript(), name="lift")
    (folder / "js" / "driver.mjs").write_text(JS_DRIVER)

    def drive(openings):
        given = [one if math.isfinite(one) else str(one) for one in openings]
        argument = json.dumps({"openings": given, "initial": list(START.values())})
        command = [printed.require("node"), "driver.mjs", argument]
        _, output = printed.finished(command, folder / "js")
        return [Response(refused, tuple(state)) for refused, state in json.loads(output)]

    return drive


OCTAVE_DRIVER = """
model = lift();
x = [{initial}];
for opening = [{openings}]
  u = double(strcmp(model.inputs, 'fill')) * 0;
  u(strcmp(model.inputs, 'fill')) = opening;
  r = model.simulate(struct('initial', x, 'ends', 5e-3, 'values', u, 'slopes', 0 * (u == u), ...
    'times', 5e-3));
  if r.status == 0
    x = r.data(end, 2:1 + numel(model.states));
  end
  printf('%d', r.status);
  printf(' %.17g', x);
  printf('\\n');
end
"""


def of_octave(folder):
    write_program(problem(), folder / "m", Octave(), name="lift")
    words = {math.inf: "Inf", -math.inf: "-Inf"}

    def drive(openings):
        texts = ["NaN" if one != one else words.get(one, repr(one)) for one in openings]
        script = OCTAVE_DRIVER.format(
            openings=" ".join(texts), initial=" ".join(map(repr, START.values()))
        )
        command = [printed.require("octave-cli"), "--no-init-file", "--quiet", "--eval", script]
        _, output = printed.finished(command, folder / "m")
        rows = [list(map(float, line.split())) for line in output.splitlines()]
        return [Response(row[0] != 0.0, tuple(row[1:])) for row in rows]

    return drive


class Fmu:
    """An FMU of the lift for Co-Simulation, of FMI 2.0 or 3.0, instances of which begin at 0 s."""

    def __init__(self, folder, version):
        self.fmpy = pytest.importorskip("fmpy", reason="needs the package fmpy")
        printed.require("gcc")
        path = write_fmu(problem(), folder / "lift.fmu", fmi=version, name="lift").path
        self.version, self.folder = version, folder / "fmu"
        with zipfile.ZipFile(path) as archive:
            archive.extractall(self.folder)
        self.about = self.fmpy.read_model_description(str(path), validate=False)
        self.number = {v.name: v.valueReference for v in self.about.modelVariables}
        self.time = 0.0

    def begin(self):
        from fmpy.fmi2 import FMU2Slave
        from fmpy.fmi3 import FMU3Slave

        fmu = (FMU2Slave if self.version == 2 else FMU3Slave)(
            guid=self.about.guid,
            unzipDirectory=str(self.folder),
            instanceName="test",
            modelIdentifier=self.about.coSimulation.modelIdentifier,
        )
        fmu.instantiate()
        if self.version == 2:
            fmu.setupExperiment(startTime=0.0)
            fmu.enterInitializationMode()
        else:
            fmu.enterInitializationMode(startTime=0.0)
        fmu.exitInitializationMode()
        self.time, self.fmu = 0.0, fmu

    def set(self, opening, slope=0.0):
        setter = self.fmu.setReal if self.version == 2 else self.fmu.setFloat64
        try:
            setter([self.number["fill"]], [opening])
        except Exception as error:
            raise ValueError(str(error)) from None
        if slope:
            self.fmu.setRealInputDerivatives([self.number["fill"]], [1], [slope])

    def step(self):
        self.fmu.doStep(currentCommunicationPoint=self.time, communicationStepSize=STEP)
        self.time += STEP

    def state(self):
        getter = self.fmu.getReal if self.version == 2 else self.fmu.getFloat64
        return tuple(getter([self.number[name] for name in START]))


def of_fmu(folder, version=3):
    fmu = Fmu(folder, version)

    def make():
        fmu.begin()

        def step(opening):
            fmu.set(opening)
            fmu.step()

        return by_exceptions(step, fmu.state)

    return anew(make)


def module_of(path):
    """A written module, imported."""
    spec = importlib.util.spec_from_file_location(f"contract_{path.stem}", path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def of_torch(folder):
    torch = pytest.importorskip("torch", reason="needs the package torch")
    write_actuator(LIFT, folder, TorchStack(), name="muscle")
    module = module_of(folder / "muscle.py")

    def drive(openings):
        actuator = module.Muscle((2,), dtype=torch.float64)
        state = actuator.start(2e5, LENGTH)
        responses = []
        for opening in openings:
            command = torch.tensor([0.1, opening], dtype=torch.float64)
            tension, pressure, valid, state = actuator.compute(state, command, LENGTH, 0.0, STEP)
            check_outputs(tension.numpy(), pressure.numpy(), valid.numpy())
            responses.append(Response(not valid[1], tuple(state.values[:, 1].tolist())))
        return responses

    return drive


def check_outputs(tension, pressure, valid):
    """An invalid muscle has no number, and its neighbour is not concerned."""
    assert valid[0]
    np.testing.assert_array_equal(np.isfinite([tension, pressure]), [valid, valid])


def of_warp(folder):
    warp = pytest.importorskip("warp", reason="needs the package warp-lang")
    warp.config.quiet = True
    write_actuator(LIFT, folder, WarpStack(), name="muscle")
    module = module_of(folder / "muscle_warp.py")

    def drive(openings):
        actuator = module.Muscle(2, device="cpu")
        actuator.start(2e5, LENGTH)
        array = lambda values: warp.array(values, dtype=module.real, device="cpu")  # noqa: E731
        motion = array([LENGTH] * 2), array([0.0] * 2)
        responses = []
        for opening in openings:
            actuator.compute(array([0.1, opening]), *motion, STEP)
            valid = actuator.valid.numpy() > 0.5
            check_outputs(actuator.tension.numpy(), actuator.pressure.numpy(), valid)
            responses.append(Response(not valid[1], tuple(actuator.states.numpy()[:, 1].tolist())))
        return responses

    return drive


def of_onnx(folder):
    runtime = pytest.importorskip("onnxruntime", reason="needs the package onnxruntime")
    pytest.importorskip("onnx", reason="needs the package onnx")
    runtime.set_default_logger_severity(3)
    write_actuator(LIFT, folder / "onnx", OnnxStack(substeps=5), name="muscle")
    begin, step = (
        runtime.InferenceSession(
            str(folder / "onnx" / f"{file}.onnx"), providers=["CPUExecutionProvider"]
        )
        for file in ("muscle_start", "muscle")
    )

    def drive(openings):
        (state,) = begin.run(["state"], {"pressure": np.full(2, 2e5), "length": np.full(2, LENGTH)})
        responses = []
        for opening in openings:
            given = {"command": np.array([0.1, opening]), "length": np.full(2, LENGTH)}
            given |= {"speed": np.zeros(2), "dt": np.array(STEP), "state": state}
            names = ["tension", "pressure", "valid", "next_state"]
            tension, pressure, valid, state = step.run(names, given)
            check_outputs(tension, pressure, valid)
            responses.append(Response(not valid[1], tuple(state[:, 1].tolist())))
        return responses

    return drive


def of_mujoco(folder):
    mujoco = pytest.importorskip("mujoco", reason="needs the package mujoco")
    printed.require("gcc")
    try:
        actuator = write_mujoco_plugin(LIFT, folder / "plugin", name="contract")
    except AirmuscleError as reason:
        pytest.skip(str(reason))

    def drive(openings):
        spec = mujoco.MjSpec()
        spec.option.timestep = STEP
        body = spec.worldbody.add_body(name="load")
        body.add_joint(name="z", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0, 0, 1])
        body.add_geom(size=[0.05, 0, 0], mass=LIFT.mechanism.mass, contype=0, conaffinity=0)
        actuator.add_to(spec, name="muscle", joint="z", gear=-1.0, rest_length=0.0)
        model = spec.compile()
        data = mujoco.MjData(model)
        actuator.initialise(model, data, "muscle", pressure=2e5)
        warning = data.warning[mujoco.mjtWarning.mjWARN_BADCTRL]
        responses = []
        for opening in openings:
            before = warning.number
            data.ctrl[0] = opening
            with contextlib.chdir(folder):  # where MuJoCo writes MUJOCO_LOG.TXT on a warning
                mujoco.mj_step(model, data)
            responses.append(Response(warning.number > before, tuple(data.act.tolist())))
        return responses

    return drive


TARGETS = {
    "Stepper": Target(of_stepper),
    "simulate": Target(of_simulate),
    "simulate_batch": Target(of_batch),
    "environment": Target(of_environment, limits=True),
    "vector environment": Target(lambda folder: of_environment(folder, 3), limits=True),
    "C": Target(of_c),
    "JavaScript": Target(of_javascript),
    "Octave": Target(of_octave),
    "FMU": Target(of_fmu, limits=True),
    "FMU of FMI 2.0": Target(lambda folder: of_fmu(folder, 2), limits=True),
    "PyTorch": Target(of_torch, limits=True),
    "Warp": Target(of_warp, limits=True),
    "ONNX": Target(of_onnx, limits=True),
    "MuJoCo": Target(of_mujoco, limits=True, continues=False),
}
TOOLS = ("FMU", "FMU of FMI 2.0", "PyTorch", "Warp", "ONNX", "MuJoCo")


class Driven(NamedTuple):
    target: Target
    drive: Drive


@pytest.fixture(
    scope="module",
    params=[
        pytest.param(name, marks=[pytest.mark.tool] if name in TOOLS else []) for name in TARGETS
    ],
)
def driven(request, tmp_path_factory):
    target = TARGETS[request.param]
    return Driven(target, target.prepare(tmp_path_factory.mktemp("contract")))


def with_wrong(opening):
    return [*OPENINGS[:AT], opening, *OPENINGS[AT:]]


def check_refused(driven, opening):
    usual = driven.drive(list(OPENINGS))
    responses = driven.drive(with_wrong(opening))
    assert [response.refused for response in usual] == [False] * len(OPENINGS)
    assert [k for k, response in enumerate(responses) if response.refused] == [AT]
    assert responses[AT].state == responses[AT - 1].state
    if driven.target.continues:
        assert responses[:AT] + responses[AT + 1 :] == usual
    assert len({response.state for response in usual}) == len(usual), "each step moves the state"


@pytest.mark.parametrize("opening", NOT_FINITE, ids=str)
def test_an_input_that_is_not_finite_is_refused_and_leaves_the_state(driven, opening):
    check_refused(driven, opening)


@pytest.mark.parametrize("opening", [1.5, 1e6], ids=str)
def test_an_input_beyond_its_range_is_limited_or_refused(driven, opening):
    if not driven.target.limits:
        check_refused(driven, opening)
    else:
        limited = driven.drive(with_wrong(1.0))
        assert driven.drive(with_wrong(opening)) == limited
        assert limited != driven.drive(with_wrong(0.9))


@pytest.mark.tool
def test_an_input_of_an_fmu_that_would_leave_its_range_goes_to_its_limit(tmp_path):
    """A ramp from 0.5 to 1.5 within a step is that to 1; then the input is held there."""
    fmu = Fmu(tmp_path, 2)
    states = []
    for slope in (1.0 / STEP, 0.5 / STEP):
        fmu.begin()
        fmu.set(0.5, slope)
        fmu.step()
        states.append([fmu.state()])
        fmu.set(1.0)
        fmu.step()
        states[-1].append(fmu.state())
    assert states[0] == states[1]


LOOP = Problem(
    LIFT,
    ControlLoop(
        PID("pressure", SplitRange("fill", "discharge"), gain=1e-5),
        STEP,
        Schedule({"pressure": ((0.0, 2.5e5),)}),
    ),
    4 * STEP,
    START,
)


@pytest.mark.parametrize("setpoint", NOT_FINITE, ids=str)
def test_an_exported_loop_refuses_a_set_point_that_is_not_finite(setpoint, tmp_path):
    """Its program in C has the set points of the scenario, which are finite."""
    write_program(LOOP, tmp_path / "m", Octave(), name="lift")
    text = {math.inf: "Inf", -math.inf: "-Inf"}.get(setpoint, "NaN")
    script = (
        "model = lift(); loop = model.loop.setpoint; "
        f"loop.values(:) = {text}; r = model.simulate(struct('setpoint', loop)); "
        "printf('%d %d', r.status, r.samples)"
    )
    octave = [printed.require("octave-cli"), "--no-init-file", "--quiet", "--eval", script]
    assert printed.finished(octave, tmp_path / "m")[1] == "3 0"


def of_python_start(folder):
    def status(start):
        closed = SampledSignal(dict.fromkeys(LIFT.inputs, ((0.0, 0.0),)))
        state = dict(zip(START, start, strict=True))
        try:
            simulate(LIFT, closed, duration=STEP, initial_state=state)
        except AirmuscleError:
            return 3
        return 0

    return status


C_START = r"""
#include <math.h>
#include <stdio.h>
#include "lift.h"
int main(void)
{
  lift_solver s;
  double c[LIFT_PRECOMPUTED + 1];
  const double still[LIFT_INPUTS + 1] = {0.0}, x[] = {@};
  lift_prepare(lift_defaults, c);
  lift_begin(&s, 0.0, x);
  lift_set_segment(&s, 5e-3, still, still);
  printf("%d", lift_step(&s, c));
  return 0;
}
"""


def of_c_start(folder):
    write_program(problem(), folder, C99(), name="lift")

    def status(start):
        words = {math.inf: "INFINITY", -math.inf: "-INFINITY"}
        values = ["NAN" if x != x else words.get(x, repr(x)) for x in start]
        (folder / "main.c").write_text(C_START.replace("@", ", ".join(values)))
        return int(printed.finished([printed.built(folder)], folder)[1])

    return status


JS_START = """
import * as lift from "./lift.mjs";
const initial = JSON.parse(process.argv[2]).map((text) => Number(text));
try {
  console.log(lift.simulate({initial}).status);
} catch (error) {
  if (!(error instanceof RangeError)) throw error;
  console.log(3);
}
"""


def of_javascript_start(folder):
    write_program(problem(), folder, JavaScript(), name="lift")
    (folder / "driver.mjs").write_text(JS_START)

    def status(start):
        words = {math.inf: "Infinity", -math.inf: "-Infinity"}
        texts = ["NaN" if x != x else words.get(x, repr(x)) for x in start]
        command = [printed.require("node"), "driver.mjs", json.dumps(texts)]
        return int(printed.finished(command, folder)[1])

    return status


def of_octave_start(folder):
    octave = printed.require("octave-cli")
    write_program(problem(), folder, Octave(), name="lift")

    def status(start):
        words = {math.inf: "Inf", -math.inf: "-Inf"}
        texts = ["NaN" if x != x else words.get(x, repr(x)) for x in start]
        script = (
            f"model = lift(); r = model.simulate(struct('initial', [{' '.join(texts)}]));"
            " printf('%d', r.status)"
        )
        command = [octave, "--no-init-file", "--quiet", "--eval", script]
        return int(printed.finished(command, folder)[1])

    return status


STARTS = {
    "simulate": of_python_start,
    "C": of_c_start,
    "JavaScript": of_javascript_start,
    "Octave": of_octave_start,
}


@pytest.mark.parametrize("target", STARTS)
def test_a_run_refuses_a_start_that_is_not_finite(target, tmp_path):
    status = STARTS[target](tmp_path)
    usual = tuple(START.values())
    assert status(usual) == 0
    for k, wrong in ((0, math.nan), (2, math.nan), (2, math.inf), (3, -math.inf)):
        assert status((*usual[:k], wrong, *usual[k + 1 :])) == 3


@pytest.mark.tool
@pytest.mark.parametrize(
    ("name", "control"),
    [
        ("dmsp-20-300", "fill"),
        ("check valve and cracking pressure", "fill"),
        ("three positions through a tube", "valve"),
        ("manifold on tank and regulator", "two.valve"),
    ],
)
def test_in_jax_an_input_that_is_not_a_number_gives_no_number(name, control):
    """A program of JAX cannot refuse: NaN passes through the limits of valves."""
    jax = pytest.importorskip("jax", reason="needs the package jax")
    jax.config.update("jax_enable_x64", True)
    plant = plants.EXAMPLES[name]
    state = {key: jax.numpy.asarray(value) for key, value in plant.state_at(pressure=2e5).items()}
    closed = {key: jax.numpy.asarray(0.0) for key in plant.inputs}
    usual = plant.rates(state, closed)
    assert all(math.isfinite(float(rate)) for rate in usual.values())
    wrong = plant.rates(state, {**closed, control: jax.numpy.asarray(math.nan)})
    assert any(math.isnan(float(rate)) for rate in wrong.values())
