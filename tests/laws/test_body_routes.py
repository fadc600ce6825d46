"""Routes of a body: lengths and moment arms follow closed forms, torques the laws of a pendulum, and
each fault is named on a body that has it alone.
"""

from __future__ import annotations

import importlib.util
import re
from dataclasses import dataclass
from pathlib import Path

import bodies
import numpy as np
import pytest
from bodies import arm, chain, legs, written

import airmuscle
from airmuscle.design import (
    Poses,
    balance,
    gravity_demand,
    motion_demand,
    read_body,
    sample_routes,
    study_body,
    sweep_routes,
    table_demand,
)
from airmuscle.errors import FileError, ParameterError

pytestmark = pytest.mark.tool
TENTH = 1e-4
"""Accuracy [m] that is asked of a length."""


@pytest.fixture(scope="module", autouse=True)
def mujoco():
    return bodies.require_mujoco()


def only_sweep(folder: Path, text: str, route: str = ""):
    body = read_body(written(folder, text))
    sweeps = {sweep.route.name: sweep for sweep in sweep_routes(body)}
    return sweeps[route] if route else next(iter(sweeps.values()))


def law_of_cosines(angle):
    """Length of the front route of `arm` at an angle [rad]: both ends as vectors of the plane."""
    radius = np.hypot(0.05, 0.3)
    lever = np.hypot(0.04, 0.1)
    between = np.arctan2(0.3, 0.05) - np.arctan2(-0.1, 0.04) + angle
    return np.sqrt(radius**2 + lever**2 - 2.0 * radius * lever * np.cos(between))


def test_length_and_moment_arm_over_a_hinge_are_those_of_the_law_of_cosines(tmp_path):
    sweep = only_sweep(tmp_path, arm(), "arm_flexor")
    angle = sweep.poses.positions[:, 0]
    assert np.abs(sweep.length - law_of_cosines(angle)).max() <= 1e-12
    step = 1e-6
    slope = (law_of_cosines(angle + step) - law_of_cosines(angle - step)) / (2.0 * step)
    assert np.abs(sweep.moment_arm[:, 0] + slope).max() <= 1e-8


@pytest.mark.parametrize("limits", ["-30 60", "-100 100", "-20.3 91.7"])
def test_extreme_lengths_are_within_a_tenth_of_a_millimetre_also_inside_the_range(tmp_path, limits):
    """Beyond 100 degrees the path passes the hinge, where the length is extreme inside the range."""
    sweep = only_sweep(tmp_path, arm(limits=limits), "arm_flexor")
    fine = law_of_cosines(np.radians(np.linspace(*map(float, limits.split()), 200_001)))
    assert sweep.shortest.length == pytest.approx(fine.min(), abs=TENTH)
    assert sweep.longest.length == pytest.approx(fine.max(), abs=TENTH)
    assert law_of_cosines(sweep.longest.positions[0]) == pytest.approx(sweep.longest.length)


@pytest.mark.parametrize("count", [1, 2, 3, 5])
def test_a_chain_is_longest_straight_and_shortest_bent_to_one_side(tmp_path, count):
    """The chord of a chain is greatest at 0, inside the ranges, and least with all hinges but the
    first at 40 degrees: by grids up to three joints, by a Sobol sequence from four."""
    sweep = only_sweep(tmp_path, chain(count))
    headings = np.radians(40.0) * np.arange(count)
    chord = 0.1 * abs(np.exp(1j * headings).sum())
    assert sweep.longest.length == pytest.approx(0.1 * count, abs=TENTH)
    assert sweep.shortest.length == pytest.approx(chord, abs=TENTH)


def test_a_route_around_a_pulley_has_its_radius_as_moment_arm(tmp_path):
    wrapped = arm(
        front="0.05 0 0.3",
        insertion="0.04 0 -0.2",
        further='<geom name="pulley" type="cylinder" size="0.05 0.02" euler="90 0 0" mass="0"/>'
        '<site name="side" pos="0.1 0 0"/>',
    ).replace('<site site="front"/>', '<site site="front"/><geom geom="pulley" sidesite="side"/>')
    sweep = only_sweep(tmp_path, wrapped, "arm_flexor")
    bent = sweep.poses.positions[:, 0] > 0.1
    assert sweep.moment_arm[bent, 0] == pytest.approx(-0.05, abs=1e-9)
    assert not sweep.jumps


def test_a_joint_that_follows_another_one_adds_to_the_moment_arm(tmp_path):
    """j1 = 0.5 j0 + 0.2 j0^2 by an equality constraint: the derivative is that of both."""
    text = chain(2).replace(
        "<tendon>",
        '<equality><joint joint1="j1" joint2="j0" polycoef="0 0.5 0.2 0 0"/></equality><tendon>',
    )
    sweep = only_sweep(tmp_path, text)
    assert sweep.route.joints == ("j0",)
    angle = sweep.poses.positions[:, 0]
    follower = 0.5 * angle + 0.2 * angle**2
    assert sweep.length == pytest.approx(0.2 * np.cos(0.5 * follower), abs=1e-12)
    slope = -0.1 * np.sin(0.5 * follower) * (0.5 + 0.4 * angle)
    assert sweep.slope[:, 0] == pytest.approx(slope, abs=1e-12)


def test_lengths_equal_those_of_mujoco_in_random_poses(tmp_path, mujoco):
    """An independent path: mj_forward and MuJoCo's actuators on the same tendons."""
    actuators = '<actuator><muscle tendon="arm_flexor"/><muscle tendon="arm_extensor"/></actuator>'
    path = written(tmp_path, arm(after=actuators))
    body = read_body(path)
    poses = Poses(("arm",), np.random.default_rng(1).uniform(-0.5, 1.0, (50, 1)))
    samples = sample_routes(body, poses)
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    for row, angle in enumerate(poses.positions[:, 0]):
        data.qpos[0] = angle
        mujoco.mj_forward(model, data)
        assert samples.length[row] == pytest.approx(data.actuator_length, abs=1e-12)
        assert samples.slope[row, :, 0] == pytest.approx(data.actuator_moment, abs=1e-12)


def test_gravity_asks_for_the_torque_of_a_pendulum_and_the_route_that_lifts_it_gives_it(tmp_path):
    body = read_body(written(tmp_path, arm()))
    demand = gravity_demand(body)
    angle = demand.poses.positions[:, 0]
    weight = 9.81 * 0.2  # MuJoCo's default gravity
    assert demand.torque[:, 0] == pytest.approx(weight * np.sin(angle), abs=1e-9)
    tensions = balance(body, demand)
    assert not tensions.is_unmet.any()
    lifting = np.where(angle > 0.0, 1, 0)
    arms = np.abs(tensions.moment_arm[:, 0, :])
    rows = np.arange(len(angle))
    expected = np.abs(demand.torque[:, 0]) / arms[rows, lifting]
    assert tensions.tension[rows, lifting] == pytest.approx(expected, rel=1e-3, abs=1e-3)
    assert tensions.tension[rows, 1 - lifting] == pytest.approx(0.0, abs=1e-9)


def test_a_motion_asks_for_inertia_and_weight(tmp_path):
    """A sine of 20 degrees at 1 Hz: J a + m g l sin q, with J about the hinge."""
    body = read_body(written(tmp_path, arm()))
    time = np.linspace(0.0, 2.0, 401)
    angle = np.radians(20.0) * np.sin(2.0 * np.pi * time)
    rows = "".join(f"{t},{a}\n" for t, a in zip(time, np.degrees(angle), strict=True))
    demand = motion_demand(body, written(tmp_path, f"time [s],arm [deg]\n{rows}", "motion.csv"))
    inertia = 0.0133333 + 0.2**2
    expected = -inertia * (2.0 * np.pi) ** 2 * angle + 9.81 * 0.2 * np.sin(angle)
    inside = slice(5, -5)  # the ends of a spline have no curvature of their own
    assert demand.torque[inside, 0] == pytest.approx(expected[inside], abs=2e-3)
    assert demand.speed is not None
    assert np.abs(demand.speed).max() == pytest.approx(np.radians(20.0) * 2.0 * np.pi, rel=1e-3)


def test_a_table_of_torques_is_given_by_the_route_on_its_side(tmp_path):
    body = read_body(written(tmp_path, arm()))
    table = "joint,angle [deg],torque [N m]\narm,-20,-3\narm,30,2\n"
    tensions = balance(body, table_demand(body, written(tmp_path, table, "torques.csv")))
    assert (tensions.tension > 1.0).tolist() == [[True, False], [False, True]]
    assert not tensions.is_unmet.any()


def test_poses_of_a_file_replace_the_ranges(tmp_path):
    body = read_body(written(tmp_path, arm(limits="")))
    path = written(tmp_path, "arm [deg]\n-10\n0\n25\n", "poses.csv")
    study = study_body(body, poses=path)
    expected = law_of_cosines(np.radians([-10.0, 0.0, 25.0]))
    assert study.sweep("arm_flexor").length == pytest.approx(expected, abs=1e-12)


def test_a_urdf_with_named_routes_is_read(tmp_path):
    routes = written(tmp_path, bodies.URDF_ROUTES, "routes.toml")
    body = read_body(written(tmp_path, bodies.URDF, "robot.urdf"), routes=routes)
    sweep = sweep_routes(body)[0]
    assert sweep.length == pytest.approx(law_of_cosines(sweep.poses.positions[:, 0]), abs=1e-12)
    assert study_body(body).clearances == (None,)  # of a body without geoms


def test_an_included_body_with_defaults_has_the_same_routes(tmp_path):
    text = arm()
    start = text.index("<worldbody>")
    end = text.index("<tendon>")
    inner = text[start:end]
    default = '<default><joint axis="0 1 0"/><site size="0.002"/></default>'
    written(tmp_path, f"<mujocoinclude>{inner}</mujocoinclude>", "world.xml")
    main = text[:start] + default + '<include file="world.xml"/>' + text[end:]
    main = main.replace("<mujoco", "<!-- two -- hyphens -->\n<mujoco", 1)
    whole = only_sweep(tmp_path, text, "arm_flexor")
    included = read_body(written(tmp_path, main, "main.xml"))
    sweep = sweep_routes(included)[0]
    assert sweep.longest.length == pytest.approx(whole.longest.length, abs=1e-12)
    assert "world.xml" in included.joints["arm"].place


@dataclass(frozen=True)
class FaultyBody:
    """A body with one fault, what the message must contain, and the body without."""

    faulty: str
    words: tuple[str, ...]
    repaired: str
    options: dict
    fault_of: str


SHORT = arm(front="0.06 0 0.06", insertion="0.06 0 -0.06", limits="-60 60")
THROUGH = '<geom name="block" type="box" size="0.02 0.02 0.02" pos="0.05 0 0.15"/>'
ASIDE = '<geom name="block" type="box" size="0.02 0.02 0.02" pos="0.15 0 0.15"/>'
STRONG = {"max_contraction": 0.9}
FAULTS = {
    "stroke": FaultyBody(SHORT, ("25 %", "exceeds this by", "slack in"), arm(), {}, "arm_flexor"),
    "wrong sign": FaultyBody(
        legs(("hip_R_extensor", "hip_R_flexor")),
        ("its twin hip_L_flexor", "one of the names is wrong"),
        legs(),
        {},
        "hip_R_flexor",
    ),
    "sign change": FaultyBody(
        arm(limits="-90 150", insertion="0 0 -0.1"),
        ("changes its sign",),
        arm(),
        STRONG,
        "arm_flexor",
    ),
    "singular pose": FaultyBody(
        arm(limits="0 99", insertion="0 0 -0.1", front="0.0001 0 0.3"),
        ("a singular pose",),
        arm(),
        STRONG,
        "arm_flexor",
    ),
    "contact": FaultyBody(
        arm(geoms=THROUGH), ("mm inside block",), arm(geoms=ASIDE), {}, "arm_flexor"
    ),
    "not held": FaultyBody(
        arm().replace(
            '<spatial name="arm_extensor"><site site="back"/><site site="back_insertion"/></spatial>',
            "",
        ),
        ("no route pulls it towards greater positions",),
        arm(),
        {},
        "arm",
    ),
    "force": FaultyBody(
        arm().replace('mass="1"', 'mass="600"'),
        ("is permitted 6000 N",),
        arm(),
        STRONG,
        "arm_flexor",
    ),
    "wrapping": FaultyBody(
        arm(
            limits="-150 150",
            insertion="0 0 -0.1",
            front="0.001 0 0.3",
            further='<geom name="ball" type="sphere" size="0.03" mass="0"/>'
            '<site name="side" pos="0.08 0 0"/>',
        ).replace(
            '<site site="front"/>', '<site site="front"/><geom geom="ball" sidesite="side"/>', 1
        ),
        ("jumps by", "sidesite"),
        arm(),
        STRONG,
        "arm_flexor",
    ),
}


@pytest.mark.parametrize("kind", FAULTS)
def test_each_fault_is_named_and_gone_after_the_repair(kind, tmp_path):
    case = FAULTS[kind]
    study = study_body(read_body(written(tmp_path, case.faulty)), **case.options)
    texts = [fault.text for fault in study.faults_of(kind) if fault.name == case.fault_of]
    assert texts, [fault.text for fault in study.faults]
    for words in case.words:
        assert words in texts[0]
    repaired = study_body(read_body(written(tmp_path, case.repaired)))
    assert repaired.faults == ()


def test_every_kind_of_fault_has_its_case():
    """The kinds that the program can name are those of the table above."""
    source = Path(airmuscle.__file__).parent / "design" / "body" / "faults.py"
    named = re.findall(r'RouteFault\(\s*"([\w ]+)"', source.read_text(encoding="utf-8"))
    assert set(named) == set(FAULTS)


@pytest.mark.parametrize(
    ("names", "options", "words"),
    [
        (("arm_extensor", "arm_flexor"), {"positive": {"arm": "extension"}}, "as stated"),
        (("arm_flexor", "arm_extensor"), {"positive": {"arm": "flexion"}}, "as stated"),
    ],
)
def test_a_route_against_its_stated_direction_is_named(tmp_path, names, options, words):
    """The front route pulls the rod towards lesser angles, the back one towards greater ones."""
    body = read_body(written(tmp_path, arm(names=names)))
    assert study_body(body).faults == ()
    faults = study_body(body, **options).faults_of("wrong sign")
    assert [fault.name for fault in faults] == list(names)
    assert words in faults[0].text


def test_extension_of_a_knee_is_towards_the_straight_pose(tmp_path):
    """A knee that bends to one side needs no statement; neither sign of the joint matters."""
    for limits, names in (
        ("0 30", ("knee_extensor", "knee_flexor")),
        ("-30 0", ("knee_flexor", "knee_extensor")),
    ):
        right = arm(limits=limits, names=names).replace('"arm"', '"knee"')
        wrong = arm(limits=limits, names=names[::-1]).replace('"arm"', '"knee"')
        study = study_body(read_body(written(tmp_path, right)), max_contraction=0.9)
        assert study.faults_of("wrong sign") == ()
        study = study_body(read_body(written(tmp_path, wrong)), max_contraction=0.9)
        assert len(study.faults_of("wrong sign")) == 2


def test_antagonists_that_pull_in_the_same_direction_are_named(tmp_path):
    same = arm().replace(
        '<site site="back"/><site site="back_insertion"/>',
        '<site site="front"/><site site="front_insertion"/>',
    )
    study = study_body(read_body(written(tmp_path, same)))
    assert "in the same direction as its antagonist" in study.faults_of("wrong sign")[0].text


@dataclass(frozen=True)
class RefusedBody:
    """A body that is refused, what the message must contain, and arguments with which it is read."""

    text: str
    words: tuple[str, ...]
    remedy: dict | None = None


DANGEROUS = '<!DOCTYPE m [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;">]>\n'
FREE = "<freejoint/>" + '<geom size="0.01" mass="1"/>'
REFUSED = {
    "XML bomb": RefusedBody(DANGEROUS + arm(), ("body.xml:1", "document type")),
    "include outside": RefusedBody(
        arm(after='<include file="../outside.xml"/>'),
        ("include", "is outside", "--folder"),
        {"folder": ".."},
    ),
    "missing include": RefusedBody(arm(after='<include file="none.xml"/>'), ("there is no file",)),
    "include of itself": RefusedBody(arm(after='<include file="body.xml"/>'), ("includes itself",)),
    "not XML": RefusedBody("<mujoco><worldbody></mujoco>", ("body.xml:1", "not valid XML")),
    "another root": RefusedBody("<svg/>", ("<svg>", "<mujoco>", "<robot>")),
    "without routes": RefusedBody(
        arm().replace("<tendon>", "<custom/><tendon>").split("<tendon>")[0] + "</mujoco>",
        ("has no route", "--routes"),
        {"routes": "routes.toml"},
    ),
    "without limits": RefusedBody(
        arm(limits=""),
        ("body.xml:9: joint 'arm'", "--range 'arm=-30 deg..60 deg'"),
        {"ranges": {"arm": (-0.5, 1.0)}},
    ),
    "missing mesh": RefusedBody(
        arm(
            after='<asset><mesh name="bone" file="bone.stl"/></asset>',
            further='<geom type="mesh" mesh="bone"/>',
        ),
        ("mesh 'bone'", "bone.stl", "--without-meshes"),
        {"without_meshes": True},
    ),
    "millimetres": RefusedBody(
        arm(front="50 0 300", insertion="40 0 -100"), ("probably in mm", "0.001")
    ),
    "a free joint across": RefusedBody(
        arm(limits="-30 60")
        .replace('<joint name="arm" axis="0 1 0" range="-30 60"/>', "<freejoint/>")
        .replace('<body name="stand" pos="0 0 1">', "")
        .replace("</body>\n    </body>", "</body>"),
        ("the route crosses", "--leave-out"),
    ),
    "closed loop": RefusedBody(
        arm(after='<equality><weld name="held" body1="rod" body2="stand"/></equality>'),
        ("weld 'held'", "closes a loop", "--poses"),
        {"poses": "poses.csv"},
    ),
    "unknown joint": RefusedBody(arm(), ()),
}


def read_and_study(place: Path, text: str, **options):
    poses = options.pop("poses", None)
    for name in ("folder", "routes"):
        if name in options:
            options[name] = place / options[name]
    body = read_body(written(place, text), **options)
    return study_body(body, poses=None if poses is None else place / poses)


@pytest.mark.parametrize("name", [name for name in REFUSED if REFUSED[name].words])
def test_a_refused_body_is_named_with_its_element_and_the_remedy_works(name, tmp_path):
    folder = tmp_path / "bodies"
    folder.mkdir()
    written(tmp_path, "<mujocoinclude><custom/></mujocoinclude>", "outside.xml")
    written(folder, "arm [deg]\n0\n10\n", "poses.csv")
    route = '[[route]]\nname = "made"\npoints = ["front", "front_insertion"]\n'
    written(folder, route, "routes.toml")
    case = REFUSED[name]
    with pytest.raises((FileError, ParameterError)) as caught:
        read_and_study(folder, case.text)
    for words in case.words:
        assert words in str(caught.value)
    if case.remedy is not None:
        assert read_and_study(folder, case.text, **case.remedy).sweeps


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ("arm [deg]\nx\n", "row 2"),
        ("arm [deg]\n1,2\n", "row 2 has 2 cells"),
        ("leg [deg]\n1\n", "there is no joint"),
        ("arm [kg]\n1\n", "kg"),
        ("arm\n", "at least one row"),
    ],
)
def test_a_wrong_table_of_poses_is_named(table, words, tmp_path):
    body = read_body(written(tmp_path, arm()))
    with pytest.raises((FileError, ParameterError), match=words):
        study_body(body, poses=written(tmp_path, table, "poses.csv"))


def test_springs_free_bases_and_motors_are_remarked_with_their_line(tmp_path):
    text = arm(
        after='<actuator><motor name="drive" joint="arm"/></actuator>',
    ).replace(
        "</tendon>",
        '<spatial name="spring" stiffness="200"><site site="front"/><site site="back"/></spatial></tendon>',
    )
    text = text.replace('<body name="stand" pos="0 0 1">', '<body name="stand" pos="0 0 1">' + FREE)
    body = read_body(written(tmp_path, text))
    remarks = " ".join(body.remarks)
    assert "spring of 200 N/m" in remarks
    assert "a free joint" in remarks
    assert "drive" in remarks
    assert len(body.routes) == 2


PUBLIC = (
    "legacy/elbow/myoelbow_1dof6muscles_1dofSoftexo_Ideal.xml",
    "legacy/finger/myofinger_v0.xml",
    "legacy/osl/myolegs_osl.xml",
)


@pytest.mark.parametrize("name", PUBLIC)
def test_anatomical_bodies_of_myosuite_raise_no_false_alarm(name):
    """Their muscles are named by anatomy and lie outside the bones: no wrong sign, no jump, no
    contact but with the bones of the hand, which the elbow has at a wrong place, beside its hinge,
    and with the parts of a prosthesis where the legs are crossed; strokes that are named exceed
    25 % on a dense sample, too."""
    found = importlib.util.find_spec("myo_sim")
    if found is None or found.origin is None:
        pytest.skip("needs the package myo-sim")
    models = Path(found.origin).parent / "models"
    body = read_body(models / name, folder=models)
    study = study_body(body)
    for kind in ("wrong sign", "wrapping"):
        assert study.faults_of(kind) == ()
    for fault in study.faults_of("contact"):
        assert re.search("inside (arm_r_[24](mc|proxph)|prosthetic_|osl_)", fault.text)
    for fault in study.faults_of("stroke"):
        sweep = study.sweep(fault.name)
        lengths = np.sort(sweep.length)
        assert 1.0 - lengths[5] / lengths[-5] > 0.22
