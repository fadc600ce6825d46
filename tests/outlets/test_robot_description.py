"""Robot descriptions: MuJoCo computes from MJCF and URDF the accelerations and the motion of the
library.
"""

from __future__ import annotations

import dataclasses
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from command_line import airmuscle

import airmuscle as am
from airmuscle.engine import Problem, Rodas4, Schedule, solve
from airmuscle.errors import ParameterError
from airmuscle.outlets import write_mjcf, write_urdf
from airmuscle.outlets.export import compiler, mujoco_plugin
from airmuscle.physics import (
    AntagonisticJoint,
    ArmLink,
    FillDischarge,
    HangingMass,
    MuscleRoute,
    PlanarArm,
    Plant,
    PolynomialProfile,
    SerialArm,
    SpatialLink,
    StickSlip,
    Supply,
    Valve,
    WithStickSlip,
    find_equilibrium,
)

VALVE = Valve(2.6167e-9, 0.433)
CIRCUIT = FillDischarge(Supply(5.5e5), VALVE, VALVE)
MUSCLE = am.load("dmsp-20-300").muscle
JOINT = AntagonisticJoint(0.03, 0.05, damping=0.2, weight_torque=1.7, weight_angle=0.4, offset=0.1)
ROUTES = (
    MuscleRoute((1,), (0.03,), 0.1),
    MuscleRoute((1,), (-0.03,), 0.1),
    MuscleRoute((1, 2), (0.02, 0.025), 0.12),
    MuscleRoute((2,), (-0.025,), 0.08),
)
PLANAR = PlanarArm(
    (ArmLink(0.3, 1.2, 0.14, 0.01, 0.2), ArmLink(0.25, 0.8, 0.1, 0.006, 0.1)),
    ROUTES,
    payload=0.5,
    gravity=9.0,
)
SERIAL = SerialArm(
    (
        SpatialLink((0, 0, 1), (0.0, 0.0, 0.4), 1.0, (0.02, 0.0, 0.1), 0.01, 0.02, 0.3),
        SpatialLink((0, -1, 0), (0.05, 0.0, 0.2), 0.7, (0.1, 0.03, 0.0), 0.004, 0.0, 0.2, 0.3),
    ),
    ROUTES,
)
MECHANISMS = {"joint": JOINT, "planar arm": PLANAR, "serial arm": SERIAL}


def plant_of(mechanism) -> Plant:
    muscles = tuple(
        dataclasses.replace(MUSCLE, name=f"m{k}") for k in range(mechanism.muscle_count or 1)
    )
    several = len(muscles) > 1
    return Plant(
        muscles if several else muscles[0],
        (CIRCUIT,) * len(muscles) if several else CIRCUIT,
        mechanism,
    )


@pytest.fixture
def unbuilt(monkeypatch):
    """Plugins whose sources are written only."""

    def refuse(*given):
        raise ParameterError("not built in this test")

    monkeypatch.setattr(mujoco_plugin, "compile_library", refuse)
    monkeypatch.setattr(mujoco_plugin, "check_mujoco", lambda: compiler)


@pytest.mark.tool
@pytest.mark.parametrize("writer", [write_mjcf, write_urdf])
@pytest.mark.parametrize("name", MECHANISMS)
def test_accelerations_are_those_of_the_library(name, writer, tmp_path, monkeypatch):
    """At 20 random positions, speeds and torques: inertia, gravity, centrifugal torques and damping
    are all there.
    """
    mujoco = pytest.importorskip("mujoco")
    mechanism = MECHANISMS[name]
    written = writer(plant_of(mechanism), tmp_path, name="robot")
    text = written.path.read_text(encoding="utf-8")
    if writer is write_mjcf:
        root = ET.fromstring(text)
        for part in ("extension", "actuator", "keyframe"):
            root.remove(root.find(part))
        text = ET.tostring(root, encoding="unicode")
    model = mujoco.MjModel.from_xml_string(text)
    if writer is write_urdf:
        model.opt.gravity[2] = -getattr(mechanism, "gravity", 9.80665)
    data = mujoco.MjData(model)
    random = np.random.default_rng(1)
    coordinates = mechanism.coordinates
    assert [model.joint(c.name).qposadr[0] for c in coordinates] == list(range(len(coordinates)))
    for _ in range(20):
        angles, speeds, torques = random.uniform(-1.5, 1.5, (3, len(coordinates)))
        data.qpos[:] = angles
        data.qvel[:] = speeds
        data.qfrc_applied[:] = torques
        mujoco.mj_forward(model, data)
        q = dict(zip((c.name for c in coordinates), angles, strict=True))
        v = dict(zip((c.speed for c in coordinates), speeds, strict=True))
        found = mechanism.acceleration(q, v, dict(zip(q, torques, strict=True)), {})
        np.testing.assert_allclose(
            data.qacc, [found[c.name] for c in coordinates], rtol=1e-7, atol=1e-7
        )


@pytest.mark.tool
def test_the_keyframe_of_an_mjcf_begins_at_ambient_pressure_and_runs(tmp_path):
    mujoco = pytest.importorskip("mujoco")
    written = write_mjcf(plant_of(SERIAL), tmp_path, name="beginning_arm")
    for plugin in written.plugins:
        mujoco.mj_loadPluginLibrary(str(plugin.library))
    model = mujoco.MjModel.from_xml_path(str(written.path))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("ambient").id)
    begin = data.act.copy()
    for k, plugin in enumerate(written.plugins):
        plugin.initialise(model, data, f"m{k}", pressure=0.0)
    np.testing.assert_allclose(data.act, begin, rtol=1e-12)
    data.ctrl[0] = 1.0
    for _ in range(100):
        mujoco.mj_step(model, data)
    assert np.ptp(data.qpos) > 1e-3


@pytest.mark.tool
def test_a_joint_from_its_mjcf_moves_as_in_the_library(tmp_path):
    mujoco = pytest.importorskip("mujoco")
    plant = plant_of(JOINT)
    written = write_mjcf(plant, tmp_path, name="moving_joint")
    for plugin in written.plugins:
        assert plugin.library is not None, plugin.remark
        mujoco.mj_loadPluginLibrary(str(plugin.library))
    model = mujoco.MjModel.from_xml_path(str(written.path))
    data = mujoco.MjData(model)
    state = find_equilibrium(plant, pressure=2e5)
    data.qpos[0] = state["angle"]
    for plugin, muscle in zip(written.plugins, plant.muscles, strict=True):
        plugin.initialise(model, data, muscle.name, pressure=2e5)
    step = model.opt.timestep
    found = []
    for k in range(round(0.5 / step)):
        data.ctrl[0] = 1.0 if 0.1 <= k * step + 1e-9 < 0.3 else 0.0
        mujoco.mj_step(model, data)
        if (k + 1) % round(0.02 / step) == 0:
            found.append(data.qpos[0])
    schedule = Schedule({"m0.fill": ((0.0, 0.0), (0.1, 1.0), (0.3, 0.0))})
    right = solve(
        Problem(plant, schedule, 0.5, state, integrator=Rodas4(1e-10), output_times=2e-2)
    ).recording["angle"]
    assert np.ptp(right) > 0.05
    assert np.abs(np.array(found) - right[1:]).max() * JOINT.radius <= 1e-5


def test_urdf_states_links_joints_and_the_muscles_in_a_comment(tmp_path):
    written = write_urdf(plant_of(PLANAR), tmp_path, name="two_links")
    text = written.path.read_text(encoding="utf-8")
    root = ET.fromstring(text)
    assert [joint.get("name") for joint in root.iter("joint")] == ["joint1.angle", "joint2.angle"]
    assert [link.get("name") for link in root.iter("link")] == ["base", "link1", "link2"]
    masses = [float(each.get("value")) for each in root.iter("mass")]
    assert masses == pytest.approx([1.2, 0.8 + 0.5])
    assert "muscle m2: resting length" in text
    assert "about joint1.angle, 0.025 m about joint2.angle" in " ".join(text.split())


@pytest.mark.parametrize("writer", [write_mjcf, write_urdf])
def test_of_stick_slip_the_constant_friction_is_written_and_the_rest_is_named(
    writer, tmp_path, unbuilt
):
    elements = (
        StickSlip(0.4, static_excess=0.5),
        StickSlip(0.7, (1e-3,) * 4, bearing_arms=(0.02,)),
    )
    written = writer(plant_of(WithStickSlip(SERIAL, elements)), tmp_path, name="sticking")
    root = ET.parse(written.path).getroot()
    if writer is write_mjcf:
        frictions = [each.get("frictionloss") for each in root.find("worldbody").iter("joint")]
    else:
        frictions = [each.get("friction") for each in root.iter("dynamics")]
    assert list(map(float, frictions)) == [0.4, 0.7]
    libraries = [text for text in written.left_out if text.startswith("the library of the plugin")]
    assert len(libraries) == (len(written.plugins) if writer is write_mjcf else 0)
    assert all("not built in this test" in text for text in libraries)
    assert tuple(text for text in written.left_out if text not in libraries) == (
        "the friction by the tensions of the muscles, at 100 N each: 0.4 N m (joint2.angle)",
        "the friction by the load of a bearing, at 100 N: 2 N m (joint2.angle)",
        "stiction above the friction in sliding: 0.2 N m (joint1.angle)",
        "the deflection before sliding: 0.115 deg (joint1.angle), 0.115 deg (joint2.angle)",
    )
    assert all(
        f"left out: {text}" in written.path.read_text(encoding="utf-8")
        for text in written.left_out
        if text not in libraries
    )


def test_urdf_names_a_rotor_inertia_beyond_the_first_joint(tmp_path):
    links = (SERIAL.links[0], dataclasses.replace(SERIAL.links[1], rotor_inertia=0.1))
    written = write_urdf(plant_of(dataclasses.replace(SERIAL, links=links)), tmp_path)
    assert written.left_out == ("the rotor inertia of joint2.angle, 0.1 kg m2",)


@pytest.mark.parametrize(
    ("mechanism", "writer", "message"),
    [
        (HangingMass(1.0), write_urdf, "HangingMass has no robot description"),
        (
            dataclasses.replace(JOINT, profile=PolynomialProfile((0.1,))),
            write_urdf,
            "is not circular",
        ),
    ],
)
def test_what_a_description_cannot_state_is_refused(mechanism, writer, message, tmp_path):
    plant = plant_of(mechanism)
    with pytest.raises(ParameterError, match=message):
        writer(plant, tmp_path)
    assert not list(tmp_path.iterdir())


def test_the_command_writes_both(tmp_path, unbuilt):
    for to, suffix in (("mjcf", "xml"), ("urdf", "urdf")):
        done = airmuscle("export", "joint-dmsp-20-matrix", "--to", to, "--out", str(tmp_path))
        assert done.exit_code == 0, done.output
        (path,) = tmp_path.glob(f"*.{suffix}")
        assert f"file: {path}" in done.stdout
    root = ET.parse(next(tmp_path.glob("*.xml"))).getroot()
    plugins = [each.get("plugin") for each in root.iter("plugin") if each.get("tendon")]
    assert len(set(plugins)) == 2
    assert {f"{each.removeprefix('airmuscle.')}_plugin.c" for each in plugins} <= {
        p.name for p in tmp_path.iterdir()
    }
    assert (
        airmuscle("export", "joint-dmsp-20-matrix", "--to", "urdf", "--tunable", "x").exit_code == 2
    )


@pytest.mark.tool
def test_the_wrist_of_the_examples_drums_with_its_beat():
    """160 beats a minute are 10.7 in 4 s; the stick rebounds once at most."""
    pytest.importorskip("mujoco")
    example = Path(__file__).parents[2] / "examples" / "drumming_wrist.py"
    said = subprocess.run(
        [sys.executable, example], capture_output=True, text=True, check=True
    ).stdout
    assert 10 <= int(said.split()[0]) <= 12
