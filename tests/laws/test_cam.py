"""Cams: a joint that turns on one rests where the torque is the one demanded; the cable that lies on
the outline shortens by what the muscle contracts; an outline that is not convex is refused.
"""

from __future__ import annotations

import dataclasses
import json
import math
import re

import numpy as np
import pytest
from command_line import airmuscle

from airmuscle.design import cam_csv, cam_dxf, cam_svg, design_cam, linear_curve, read_cam_curve
from airmuscle.engine import Schedule, simulate
from airmuscle.errors import AirmuscleError, FileError, ParameterError, SolveError
from airmuscle.files import load_law, load_plant
from airmuscle.physics import (
    ArmLink,
    Isothermal,
    JointWithExternalTorque,
    LinearDamper,
    PlanarArm,
    Plant,
)
from airmuscle.units import bar

MUSCLE = load_law("dmsp-20-300")
PRESSURE = 4 * bar
RANGE = (0.0, math.radians(90.0))
STIFF = linear_curve(*RANGE, 10.0, 4.0)


@pytest.fixture(scope="module", params=[math.inf, 0.12], ids=["parallel", "from a point"])
def cam(request):
    """A cam of constant stiffness."""
    return design_cam(STIFF, MUSCLE, PRESSURE, distance=request.param)


def test_the_length_of_the_cable_changes_by_the_shortening(cam):
    """The free part and the part that lies on the outline, by distances of points alone."""
    angle = cam.angle
    points = cam.outline.working
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    arcs = steps.sum() - np.concatenate([[0.0], np.cumsum(steps)])
    x, y = points.T
    world_x = np.cos(angle) * x - np.sin(angle) * y
    world_y = np.sin(angle) * x + np.cos(angle) * y
    if math.isinf(cam.distance):
        free = -world_x
    else:
        free = np.hypot(world_x - cam.distance, world_y)
        # the line through the point and the contact is at the distance of the moment arm
        cross = np.abs(world_y * cam.distance) / free
        assert cross == pytest.approx(cam.arm, rel=1e-6)
    total = free + arcs
    assert total[0] - total == pytest.approx(cam.shortening, abs=2e-7)


def test_the_muscle_gives_the_torque_at_each_contraction(cam):
    force = MUSCLE.muscle.static_force(PRESSURE, cam.contraction)
    assert cam.arm * force == pytest.approx(STIFF.torque(cam.angle), rel=1e-9)
    slope = np.gradient(cam.shortening, cam.angle)
    assert slope[1:-1] == pytest.approx(cam.arm[1:-1], rel=1e-4)


def test_a_simulated_joint_rests_where_the_torque_is_that_of_the_curve():
    """A plant with a regulator at the pressure, and a constant torque against the muscle: constant
    stiffness makes each rest stable. From 20 degrees beside, the joint comes to rest where the
    curve has this torque, within 1 %.
    """
    cam = design_cam(STIFF, MUSCLE, PRESSURE)
    muscle = dataclasses.replace(cam.muscle.muscle, damper=LinearDamper(200.0))
    circuit = load_plant("joint-dmsp-20-regulators").plant.circuits[0]
    arm = PlanarArm((ArmLink(0.2, 0.1, 0.1, 0.02, 0.5),), (cam.route(),), 0.0)
    plant = Plant(muscle, circuit, JointWithExternalTorque(arm), Isothermal())
    for angle in np.radians([20.0, 45.0, 70.0]):
        (load,) = STIFF.torque(np.array([angle]))
        inputs = Schedule({"setpoint": ((0.0, PRESSURE),), "external_torque": ((0.0, -load),)})
        state = {"pressure": PRESSURE, "joint1.angle": angle - cam.middle - 0.35}
        run = simulate(plant, inputs, duration=8.0, initial_state=plant.state_at(**state))
        assert run["pressure"][-1] == pytest.approx(PRESSURE, rel=5e-3)
        assert abs(run["joint1.angular_speed"][-1]) < 1e-3
        (torque,) = STIFF.torque(run["joint1.angle"][-1:] + cam.middle)
        assert torque == pytest.approx(load, rel=0.01)


@pytest.mark.parametrize("distance", [math.inf, 0.15])
def test_the_outline_is_convex_and_has_the_curvature_of_its_support_function(distance):
    cam = design_cam(STIFF, MUSCLE, PRESSURE, distance=distance)
    closed = cam.outline.closed
    edge = np.roll(closed, -1, axis=0) - closed
    turn = edge[:, 0] * np.roll(edge[:, 1], -1) - edge[:, 1] * np.roll(edge[:, 0], -1)
    assert (turn > 0.0).all()
    # the working part belongs to the hull
    assert {tuple(point) for point in cam.outline.working} <= {tuple(point) for point in closed}
    # radius of the circle through three neighbours
    points = cam.outline.working
    first = points[1:-1] - points[:-2]
    second = points[2:] - points[:-2]
    third = points[2:] - points[1:-1]
    area = 0.5 * np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
    sides = [np.linalg.norm(side, axis=1) for side in (first, second, third)]
    radius = np.prod(sides, axis=0) / (4.0 * area)
    assert radius[20:-20] == pytest.approx(cam.curvature[21:-21], rel=1e-2)


def test_the_files_have_the_same_outline_in_mm():
    cam = design_cam(STIFF, MUSCLE, PRESSURE)
    codes = cam_dxf(cam).split("\n")
    pairs = list(zip(codes[::2], codes[1::2], strict=False))
    layers: dict[str, list[list[float]]] = {}
    layer = ""
    kind = ""
    for code, value in pairs:
        if code == "0":
            kind = value
        elif code == "8":
            layer = value
        elif code == "10" and kind == "VERTEX":
            layers.setdefault(layer, []).append([float(value)])
        elif code == "20" and kind == "VERTEX":
            layers[layer][-1].append(float(value))
    assert pairs[-1] == ("0", "EOF")
    assert np.array(layers["CAM"]) == pytest.approx(1e3 * cam.outline.closed, abs=1e-6)
    assert np.array(layers["CABLE"]) == pytest.approx(1e3 * cam.outline.working, abs=1e-6)
    (polygon,) = re.findall(r'id="cam"[^>]* points="([^"]+)"', cam_svg(cam))
    points = np.array([[float(part) for part in pair.split(",")] for pair in polygon.split()])
    assert points * [1, -1] == pytest.approx(1e3 * cam.outline.closed, abs=1e-5)
    rows = np.array([line.split(",") for line in cam_csv(cam).splitlines()[1:]], float)
    assert rows[:, 1] == pytest.approx(cam.torque, rel=1e-8)
    assert rows[:, 7:] == pytest.approx(1e3 * cam.outline.working, rel=1e-7)


def test_a_curve_of_a_file_is_met(tmp_path):
    file = tmp_path / "curve.csv"
    angle = np.linspace(0.0, 60.0, 13)
    torque = 6.0 + 3.0 * np.sin(np.radians(2.0 * angle))
    text = "angle [deg],torque [N m]\n" + "".join(
        f"{q},{value}\n" for q, value in zip(angle, torque, strict=True)
    )
    file.write_text(text, encoding="utf-8")
    cam = design_cam(read_cam_curve(file), MUSCLE, PRESSURE)
    assert np.interp(np.radians(angle), cam.angle, cam.torque) == pytest.approx(torque, rel=1e-3)
    route = cam.route()
    profile = route.profiles[0]
    taken = np.array([profile.integral(q) for q in cam.angle - cam.middle])
    contraction = route.offset + route.radii[0] * taken / cam.length
    assert contraction == pytest.approx(cam.contraction, abs=1e-5)


@pytest.mark.parametrize(
    "text",
    [
        "angle [deg];torque [N m]\n0;10,5\n45;9,25\n90;8\n",
        "angle [deg]\ttorque [N m]\n0\t10.5\n45\t9,25\n90\t8\n",
        "\nangle [deg],torque [N m]\n0,10.5\n45,9.25\n90,8\n",
    ],
    ids=["semicolons", "tabulators", "commas"],
)
def test_a_table_of_any_spreadsheet_is_the_same_curve(tmp_path, text):
    file = tmp_path / "curve.csv"
    file.write_text(text, encoding="utf-8")
    curve = read_cam_curve(file)
    assert (curve.low, curve.high) == (0.0, math.pi / 2)
    angles = np.array([0.0, math.pi / 4, math.pi / 2])
    np.testing.assert_allclose(curve.torque(angles), [10.5, 9.25, 8.0], rtol=1e-12)


def test_a_comma_for_thousands_is_no_decimal_comma(tmp_path):
    file = tmp_path / "curve.csv"
    file.write_text('angle [deg],torque [N m]\n0,"1,000"\n45,9\n90,8\n', encoding="utf-8")
    with pytest.raises(FileError, match="with a decimal point"):
        read_cam_curve(file)


def test_a_reversed_range_is_named_in_degrees():
    with pytest.raises(ParameterError, match="range of the angle is 90 to 0 deg"):
        linear_curve(math.pi / 2, 0.0, 10.0)


REFUSED = {
    "too much work": ({"length": 0.1}, SolveError, r"A length of 2\d\d(\.\d)? mm would serve"),
    "hub": ({"hub": 0.05}, ParameterError, "allowed range: greater than 0 to the least moment"),
    "near": ({"distance": 0.01}, ParameterError, "more than the greatest moment arm"),
    "bent": ({"least_radius": 0.05}, SolveError, r"h \+ h''"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_made_is_named(case):
    arguments, kind, message = REFUSED[case]
    with pytest.raises(kind, match=message):
        design_cam(STIFF, MUSCLE, PRESSURE, **arguments)


def test_the_length_that_a_refusal_names_serves():
    with pytest.raises(SolveError) as caught:
        design_cam(STIFF, MUSCLE, PRESSURE, length=0.1)
    (length,) = re.findall(r"A length of ([\d.]+) mm", str(caught.value))
    assert design_cam(STIFF, MUSCLE, PRESSURE, length=1e-3 * float(length)).arm.min() > 0.0


def test_a_curve_that_needs_a_hollow_cam_is_refused():
    """A torque that dips sharply: h + h'' is negative there."""
    dip = dataclasses.replace(
        STIFF, torque=lambda q: 10.0 - 4.0 * np.exp(-(((q - 0.8) / 0.15) ** 2))
    )
    with pytest.raises(SolveError, match=r"from \d.*° to \d.*°"):
        design_cam(dip, MUSCLE, PRESSURE)
    with pytest.raises(AirmuscleError, match="a muscle only pulls"):
        design_cam(linear_curve(*RANGE, 2.0, 4.0), MUSCLE, PRESSURE)


def test_the_command_writes_its_files_or_nothing(tmp_path):
    out = tmp_path / "out"
    options = ("--pressure", "4 bar", "--torque", "10 N m", "--stiffness", "4 N m/rad")
    answer = airmuscle(
        "cam", "dmsp-20-300", *options, "--angle", "0 deg..90 deg", "--out", out, "--json"
    )
    assert answer.exit_code == 0, answer.output
    chapter = json.loads(answer.stdout)["cam"]
    assert chapter["nominal_length"] == pytest.approx(0.239, abs=0.001)
    for name in ("cam.dxf", "cam.svg", "profile.csv", "report.html", "figures/cam.png"):
        assert (out / name).exists()
    nothing = tmp_path / "nothing"
    answer = airmuscle("cam", "dmsp-20-300", *options, "--out", nothing)
    assert answer.exit_code == 2
    assert "--curve" in answer.stderr
    assert not nothing.exists()
