"""MuJoCo plugin: a muscle that MuJoCo integrates moves a load as in the library.

Under Euler, implicit and implicitfast of MuJoCo the muscle is integrated within the step, with the
load that it feels. With RK4 of the same step both programs evaluate the same formulas; against an
accurate solution the error is that of RK4.
"""

from __future__ import annotations

import subprocess
import sys
import types
from dataclasses import replace
from pathlib import Path

import numpy as np
import plants
import printed
import pytest
from command_line import airmuscle
from widths import widened

from airmuscle.engine import Problem, Rodas4, RungeKutta4, Schedule, solve
from airmuscle.errors import AirmuscleWarning, ParameterError
from airmuscle.outlets import write_mujoco_plugin
from airmuscle.outlets.export import compiler, mujoco_plugin
from airmuscle.physics import AntagonisticJoint, FillDischarge, Supply, Valve, find_equilibrium

pytestmark = pytest.mark.tool
VALVE = Valve(2.6167e-9, 0.433)
PLANT = replace(plants.EXAMPLES["dmsp-20-300"], circuit=FillDischarge(Supply(5.5e5), VALVE, VALVE))
SCHEDULE = Schedule(
    {
        "fill": ((0.0, 0.0), (0.1, 1.0), (0.4, 0.0)),
        "discharge": ((0.0, 0.0), (0.5, 1.0), (0.6, 0.0)),
    }
)
ENDS = np.array([0.1, 0.4, 0.5, 0.6, 0.8])


@pytest.fixture(scope="module")
def mujoco():
    module = pytest.importorskip("mujoco", reason="needs the package mujoco")
    try:
        mujoco_plugin.check_mujoco()
    except ParameterError as reason:
        pytest.skip(str(reason))
    printed.require("gcc")
    return module


@pytest.fixture(scope="module")
def actuator(mujoco, tmp_path_factory):
    return write_mujoco_plugin(PLANT, tmp_path_factory.mktemp("plugin"), name="festo")


def hanging_mass(
    mujoco, actuator, integrator="RK4", step=1e-3, transmission="tendon", plant=PLANT, **options
):
    """A mass on a muscle, the position upwards from where the muscle is at rest."""
    rest = plant.muscle.geometry.resting_length
    spec = mujoco.MjSpec()
    spec.option.timestep = step
    spec.option.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
    spec.option.gravity = [0, 0, -9.80665]
    spec.worldbody.add_site(name="top", pos=[0, 0, 1])
    body = spec.worldbody.add_body(name="load", pos=[0, 0, 1 - rest])
    body.add_joint(name="z", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0, 0, 1])
    body.add_geom(size=[0.05, 0, 0], mass=plant.mechanism.mass, contype=0, conaffinity=0)
    body.add_site(name="hook")
    if transmission == "tendon":
        tendon = spec.add_tendon(name="t")
        tendon.wrap_site("top")
        tendon.wrap_site("hook")
        actuator.add_to(spec, name="muscle", tendon="t", **options)
    else:
        actuator.add_to(spec, name="muscle", joint="z", gear=-1.0, rest_length=0.0, **options)
    model = spec.compile()
    data = mujoco.MjData(model)
    state = find_equilibrium(plant, pressure=1e5)
    data.qpos[0] = state["position"]
    actuator.initialise(model, data, "muscle", pressure=1e5)
    return model, data, state


def run(mujoco, model, data):
    """Positions at ENDS."""
    step = model.opt.timestep
    found = []
    for k in range(round(ENDS[-1] / step)):
        t = k * step + 1e-9
        data.ctrl[0] = 1.0 if 0.1 <= t < 0.4 else -1.0 if 0.5 <= t < 0.6 else 0.0
        mujoco.mj_step(model, data)
        if np.abs(ENDS - (k + 1) * step).min() < step / 2:
            found.append(data.qpos[0])
    return np.array(found)


def expected(state, integrator, plant=PLANT):
    problem = Problem(plant, SCHEDULE, ENDS[-1], state, integrator=integrator, output_times=ENDS)
    return solve(problem).recording["position"][-ENDS.size :]


def joint_angle(mujoco, plant, made, step):
    """Angles of an antagonistic joint every 20 ms."""
    spec = mujoco.MjSpec()
    mechanism = plant.mechanism
    spec.option.timestep = step
    spec.option.gravity = [0, 0, 0]
    body = spec.worldbody.add_body(name="arm")
    body.add_joint(
        name="angle", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 1, 0], damping=mechanism.damping
    )
    body.mass = 1.0
    body.inertia = [mechanism.inertia] * 3
    body.explicitinertial = 1
    for muscle, gear in zip(made, (-1.0, 1.0), strict=True):
        rest = mechanism.offset * muscle.plant.muscles[0].geometry.resting_length
        muscle.add_to(
            spec, name=muscle.name, joint="angle", gear=gear * mechanism.radius, rest_length=rest
        )
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[0] = find_equilibrium(plant, pressure=2e5)["angle"]
    for muscle in made:
        muscle.initialise(model, data, muscle.name, pressure=2e5)
    found = []
    for k in range(round(0.5 / step)):
        data.ctrl[0] = 1.0 if 0.1 <= k * step + 1e-9 < 0.3 else 0.0
        mujoco.mj_step(model, data)
        if (k + 1) % round(0.02 / step) == 0:
            found.append(data.qpos[0])
    return np.array(found)


@pytest.mark.parametrize("transmission", ["tendon", "joint"])
def test_a_mass_moves_as_in_the_library(transmission, mujoco, actuator):
    model, data, state = hanging_mass(mujoco, actuator, transmission=transmission)
    found = run(mujoco, model, data)
    assert np.ptp(found) > 0.02
    assert np.abs(found - expected(state, Rodas4(1e-10))).max() <= 1e-8
    assert np.abs(found - expected(state, RungeKutta4(1e-3))).max() <= 1e-12


STIFF = [
    "LuGre",
    "Dahl",
    "Bouc-Wen",
    "Maxwell slip",
    "heat",
    "tube with inertia",
    "pressure damper, creep",
    "real gas",
]


@pytest.mark.parametrize("integrator", ["Euler", "implicitfast"])
def test_at_the_default_step_of_mujoco_a_mass_moves_as_in_the_library(integrator, mujoco, actuator):
    model, data, state = hanging_mass(mujoco, actuator, integrator, 2e-3)
    assert np.abs(run(mujoco, model, data) - expected(state, Rodas4(1e-10))).max() <= 1e-8


@pytest.mark.parametrize(
    "name", widened(STIFF, lambda name: name in ("LuGre", "tube with inertia"))
)
def test_stiff_muscles_move_as_in_the_library_at_the_default_step(name, mujoco, tmp_path):
    plant = plants.EXAMPLES[name]
    made = write_mujoco_plugin(plant, tmp_path, name=f"stiff_{STIFF.index(name)}")
    model, data, state = hanging_mass(mujoco, made, "Euler", 2e-3, plant=plant)
    found = run(mujoco, model, data)
    assert np.ptp(found) > 0.01
    assert np.abs(found - expected(state, Rodas4(1e-10), plant)).max() <= 1e-6


@pytest.mark.parametrize("damping", [0.0, 0.2, pytest.param(1.0, marks=pytest.mark.slow)])
def test_two_muscles_on_a_joint_move_it_as_in_the_library(damping, mujoco, tmp_path):
    """Each muscle knows the force of the other from the step before; the error at 2 ms is of second
    order, also that of the damping [N m s] of the joint, which MuJoCo alone integrates with an
    error of first order."""
    joint = AntagonisticJoint(0.03, 0.05, damping=damping)
    plant = replace(plants.EXAMPLES["joint with an external torque"], mechanism=joint)
    name = f"joint{10 * damping:.0f}"
    made = [
        write_mujoco_plugin(plant, tmp_path / m.name, name=f"{name}_{m.name}", muscle=m.name)
        for m in plant.muscles
    ]
    angles = [joint_angle(mujoco, plant, made, step) for step in (2e-3, 1e-3)]
    state = find_equilibrium(plant, pressure=2e5)
    schedule = Schedule({"m0.fill": ((0.0, 0.0), (0.1, 1.0), (0.3, 0.0))})
    right = solve(
        Problem(plant, schedule, 0.5, state, integrator=Rodas4(1e-10), output_times=2e-2)
    ).recording["angle"]
    errors = [np.abs(found - right[1:]).max() for found in angles]
    assert np.ptp(right) > 0.05
    assert errors[0] * plant.mechanism.radius <= 1e-5
    assert errors[1] <= errors[0] / 3.5


def test_a_step_of_rk4_that_does_not_resolve_the_muscle_is_said(
    mujoco, tmp_path, capfd, monkeypatch
):
    monkeypatch.chdir(tmp_path)  # MuJoCo writes its log into the working folder
    plant = plants.EXAMPLES["LuGre"]
    made = write_mujoco_plugin(plant, tmp_path, name="coarse")
    model, data, _ = hanging_mass(mujoco, made, "RK4", 2e-3, plant=plant)
    run(mujoco, model, data)
    text = "".join(capfd.readouterr())
    assert "does not resolve the muscle under RK4; use Euler or implicitfast" in text


def test_states_that_are_not_physical_stop_the_run(mujoco, actuator, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    model, data, _ = hanging_mass(mujoco, actuator, "Euler", 2e-3)
    data.act[0] = float("nan")
    with pytest.raises(mujoco.FatalError, match=r"actuator 0 cannot be integrated from 0 s on"):
        mujoco.mj_forward(model, data)


def test_two_different_plugins_of_one_name_are_refused(mujoco, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def add(folder, plant):
        made = write_mujoco_plugin(plant, tmp_path / folder, name="twice")
        spec = mujoco.MjSpec()
        spec.worldbody.add_body(name="b").add_joint(name="z")
        made.add_to(spec, name="m", joint="z")

    add("one", PLANT)
    add("same", PLANT)
    with pytest.raises(
        ParameterError, match=r"airmuscle\.twice of this process is another one .* another name"
    ):
        add("other", plants.EXAMPLES["LuGre"])


def test_the_states_are_in_act_and_begin_at_the_pressure(mujoco, actuator):
    model, data, state = hanging_mass(mujoco, actuator)
    assert model.na == len(actuator.plant.states) + 1 == 2
    assert data.act[0] == pytest.approx(state["air_mass"], rel=1e-12)
    mujoco.mj_forward(model, data)
    assert data.actuator_force[0] == pytest.approx(-PLANT.mechanism.mass * 9.80665, rel=1e-9)


def test_several_actuators_of_one_plugin_have_their_own_parameters(mujoco, actuator):
    slow = {"circuit.fill.conductance": VALVE.conductance / 10}
    rates = {}
    for name, parameters in (("slow", slow), ("usual", {})):
        model, data, _ = hanging_mass(mujoco, actuator, parameters=parameters)
        data.ctrl[0] = 1.0
        mujoco.mj_forward(model, data)
        rates[name] = data.act_dot[0]
    assert rates["usual"] == pytest.approx(10 * rates["slow"], rel=1e-12)


def test_the_model_can_be_written_as_mjcf_and_read_again(mujoco, actuator):
    spec = mujoco.MjSpec()
    spec.worldbody.add_body(name="arm").add_joint(name="elbow", type=mujoco.mjtJoint.mjJNT_HINGE)
    spec.body("arm").add_geom(size=[0.02, 0, 0], mass=1.0)
    for name, gear in (("flexor", 0.03), ("extensor", -0.03)):
        actuator.add_to(spec, name=name, joint="elbow", gear=gear, rest_length=0.01)
    spec.compile()
    again = mujoco.MjModel.from_xml_string(spec.to_xml())
    assert (again.nu, again.na) == (2, 4)
    copied = mujoco.MjData(again)
    actuator.initialise(again, copied, "extensor", pressure=2e5)
    assert copied.act[0] == 0.0 < copied.act[2]


def test_a_copied_state_runs_on_by_itself(mujoco, actuator):
    model, data, _ = hanging_mass(mujoco, actuator)
    data.ctrl[0] = 1.0
    other = mujoco.MjData(model)
    mujoco.mj_copyData(other, model, data)
    for _ in range(20):
        mujoco.mj_step(model, data)
    reached = data.qpos[0]
    del data
    for _ in range(20):
        mujoco.mj_step(model, other)
    assert other.qpos[0] == reached


def test_the_source_causes_no_warning(mujoco, actuator):
    include = Path(mujoco.__file__).parent / "include"
    command = [
        "gcc",
        "-std=c99",
        "-Wall",
        "-Wextra",
        "-Wshadow",
        "-Werror",
        "-fsyntax-only",
        "-isystem",
        str(include),
    ]
    done = subprocess.run([*command, str(actuator.source)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[:2000]


# What is refused


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "either a tendon or a joint"),
        ({"tendon": "t", "joint": "z"}, "either a tendon or a joint"),
        ({"joint": "z", "parameters": {"mass": 1.0}}, "there is no parameter 'mass'"),
        (
            {"joint": "z", "parameters": {"muscle.geometry.resting_length": float("nan")}},
            "must be finite",
        ),
        ({"joint": "z", "rest_length": float("inf")}, "must be finite"),
    ],
)
def test_a_wrong_transmission_or_parameter_is_refused(options, message, mujoco, actuator):
    with pytest.raises(ParameterError, match=message):
        actuator.add_to(mujoco.MjSpec(), name="m", **options)


@pytest.mark.parametrize("version", ["3.16.2", "2.3.7"])
def test_an_unsuitable_mujoco_is_refused_and_the_source_is_written(version, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", types.SimpleNamespace(__version__=version))
    with pytest.raises(
        ParameterError, match=rf"MuJoCo {version} is not supported.*install mujoco>=3\.17"
    ):
        mujoco_plugin.check_mujoco()
    made = write_mujoco_plugin(PLANT, tmp_path, name="festo")
    assert made.library is None
    assert f"MuJoCo {version} is not supported" in made.remark
    assert sorted(p.name for p in tmp_path.iterdir()) == ["festo.c", "festo.h", "festo_plugin.c"]


def test_a_newer_mujoco_is_a_warning_and_the_plugin_is_tested_against_the_library(
    mujoco, actuator, monkeypatch
):
    """The version in use, taken for one that was not tried; a wrong rate is found."""
    monkeypatch.setattr(mujoco_plugin, "NEWEST", (3, 16))
    monkeypatch.setattr(mujoco_plugin, "_TESTED", set())
    spec = mujoco.MjSpec()
    spec.worldbody.add_body(mass=1.0, inertia=[1.0, 1.0, 1.0]).add_joint(name="z")
    with pytest.warns(AirmuscleWarning, match="newer than 3.16, the last version with which"):
        actuator.add_to(spec, name="m", joint="z")
    assert {actuator.plugin_name} == mujoco_plugin._TESTED
    assert actuator.self_test() < 1e-5
    wrong = actuator._run_of_library(0.0, 0.04)
    monkeypatch.setattr(type(actuator), "_run_of_library", lambda *arguments: wrong)
    with pytest.raises(ParameterError, match=r"states differ by .* Install mujoco>=3\.17,<=3\.16"):
        actuator.self_test()


def test_without_a_compiler_the_source_is_written_and_the_remedy_stated(
    mujoco, tmp_path, monkeypatch
):
    monkeypatch.setattr(compiler.shutil, "which", lambda name: None)
    made = write_mujoco_plugin(PLANT, tmp_path, name="festo")
    assert made.library is None
    assert (
        "no C compiler (gcc, clang, cc) was found; install the package gcc or clang" in made.remark
    )
    assert sorted(p.name for p in tmp_path.iterdir()) == ["festo.c", "festo.h", "festo_plugin.c"]


def test_without_mujoco_the_remedy_is_stated(monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(ParameterError, match=r"not installed; install mujoco>=3\.17"):
        mujoco_plugin.check_mujoco()


def test_muscles_that_share_a_circuit_are_refused_by_name(tmp_path):
    with pytest.raises(
        ParameterError, match=r"m0, m1 share the circuit .* cannot be separate actuators"
    ):
        write_mujoco_plugin(plants.EXAMPLES["overlap"], tmp_path, muscle="m0")


def test_a_muscle_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(ParameterError, match="there is no muscle 'left'; the plant has"):
        write_mujoco_plugin(PLANT, tmp_path, muscle="left")
    with pytest.raises(ParameterError, match="choose one of the muscles m0, m1"):
        write_mujoco_plugin(plants.EXAMPLES["joint with stops"], tmp_path)


def test_the_command_writes_the_plugin(tmp_path):
    example = Path(__file__).parents[2] / "examples" / "fill_discharge.toml"
    arguments = ["export", str(example), "--to", "mujoco", "--out", str(tmp_path / "plugin")]
    done = airmuscle(*arguments)
    assert done.exit_code == 0, done.output
    assert (tmp_path / "plugin" / "fill_discharge_plugin.c").exists()
    assert "airmuscle.fill_discharge" in done.output


def test_a_circuit_with_more_inputs_than_a_control_can_open_is_refused(tmp_path):
    plant = plants.EXAMPLES["manifold on tank and regulator"]
    with pytest.raises(ParameterError, match="share the circuit Manifold"):
        write_mujoco_plugin(plant, tmp_path, muscle="m0")
