"""Moved routes: derivatives are those of the lengths that MuJoCo computes, made problems have their
known optimum, and each bound holds.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path

import bodies
import numpy as np
import pytest
from bodies import arm, written

from airmuscle.design import (
    Poses,
    SizingConditions,
    TorqueRows,
    geometry_of_route,
    move_routes,
    moved_body,
    read_body,
    read_curves,
    read_move,
    read_moves,
    resolved_moves,
    result_store,
    sample_routes,
    sweep_routes,
)
from airmuscle.errors import AirmuscleError, FileError, InputError, ParameterError
from airmuscle.files import load_law
from airmuscle.units import bar

pytestmark = pytest.mark.tool
LEG = Path(__file__).parents[2] / "examples" / "air_leg.xml"
MUSCLE = "dmsp-20-300"
SUPPLY = SizingConditions(6 * bar, max_count=1)
ROD = arm(further='<geom name="bone" type="capsule" size="0.02" fromto="0 0 0 0 0 -0.2" mass="0"/>')
BOX = "front_insertion within box 20 mm..60 mm, 0 mm..0 mm, -140 mm..-60 mm"


@pytest.fixture(scope="module", autouse=True)
def mujoco():
    return bodies.require_mujoco()


@pytest.fixture(scope="module")
def rod(mujoco, tmp_path_factory):
    """The rod on a hinge, with a bone."""
    return read_body(written(tmp_path_factory.mktemp("rod"), ROD))


def curve(body, torque, count=9, name="arm_flexor"):
    """A curve of a function of the angle over the range of the hinge."""
    joint = body.joints["arm"]
    angle = np.linspace(joint.low, joint.high, count)
    values = np.array([torque(float(q)) for q in angle])
    poses = Poses(("arm",), angle[:, None])
    return TorqueRows(name, poses, np.zeros(count, int), values, ("",) * count)


def statics(angle, x, z):
    """Lengths and moment arms of the first route of the rod, in closed form: its origin is at (50,
    300) mm in the plane of the hinge, its point at (x, z) turns about y.
    """
    across = x * np.cos(angle) + z * np.sin(angle)
    along = -x * np.sin(angle) + z * np.cos(angle)
    length = np.hypot(across - 0.05, along - 0.3)
    slope = ((across - 0.05) * along - (along - 0.3) * across) / length
    return length, -slope


# Geometry


@pytest.mark.parametrize(
    ("route", "joint", "sites"),
    [
        ("ankle_dorsal", "ankle", ("ankle_front_origin", "ankle_front_insertion")),
        ("knee_extensor", "knee", ("knee_front_origin", "knee_front_insertion")),
    ],
    ids=["straight", "around a geom"],
)
@pytest.mark.parametrize("place", ["0.03 -0.03 -0.02", "0 0 0"])
def test_derivatives_are_those_of_lengths_and_moment_arms_of_mujoco(
    route, joint, sites, place, tmp_path
):
    """Also of a point at the origin of its body, whose frame MuJoCo takes for that of the point."""
    text = LEG.read_text(encoding="utf-8").replace("0.03 -0.03 -0.02", place)
    body = read_body(written(tmp_path, text))
    moves = resolved_moves(body, [read_move(f"{site} within 10 mm", "move") for site in sites])
    generator = np.random.default_rng(1)
    positions = np.array([-0.2, 0.7, 0.1]) + generator.uniform(-0.1, 0.1, (3, 3))
    poses = Poses(body.moving, positions)
    column = body.moving.index(joint)
    rows = TorqueRows(route, poses, np.full(3, column), np.ones(3), ("",) * 3)
    geometry = geometry_of_route(body, rows, Poses(body.moving, positions + 0.1), moves)
    points = np.array([move.present for move in moves]) + generator.uniform(-3e-3, 3e-3, (2, 3))
    values = geometry.at(points)
    placed = moved_body(body, dict(zip(sites, points, strict=True)))
    samples = sample_routes(placed, poses)
    number = [item.name for item in body.routes].index(route)
    assert values.length[:3] == pytest.approx(samples.length[:, number], abs=1e-12)
    assert values.arm == pytest.approx(-samples.slope[:, number, column], abs=1e-12)
    for place in range(points.size):
        step = np.zeros(points.size)
        step[place] = 1e-6
        further = geometry.at(points + step.reshape(points.shape))
        nearer = geometry.at(points - step.reshape(points.shape))
        slope = (further.length - nearer.length) / 2e-6
        assert values.length_slope[:, place] == pytest.approx(slope, abs=1e-7)
        slope = (further.arm - nearer.arm) / 2e-6
        assert values.arm_slope[:, place] == pytest.approx(slope, abs=1e-6)


def test_distances_from_geoms_are_those_of_mujoco(mujoco, tmp_path):
    shapes = {
        "ball": 'type="sphere" size="0.03"',
        "rod_geom": 'type="capsule" size="0.02 0.05"',
        "can": 'type="cylinder" size="0.02 0.05"',
        "brick": 'type="box" size="0.01 0.02 0.05"',
    }
    geoms = "".join(
        f'<geom name="{name}" {shape} pos="0.01 0.02 -0.1" euler="20 30 0" mass="0"/>'
        for name, shape in shapes.items()
    )
    body = read_body(written(tmp_path, arm(further=geoms)))
    spec = body.file.specification()
    owner = next(item for item in spec.bodies if item.name == "rod")
    probe = owner.add_geom(name="probe", pos=[1.0, 1.0, 1.0], mass=0.0)
    probe.size = [1e-6, 0.0, 0.0]
    probe.type = mujoco.mjtGeom.mjGEOM_SPHERE
    model = spec.compile()
    data = mujoco.MjData(model)
    generator = np.random.default_rng(2)
    for name in shapes:
        request = read_move(f"front_insertion on {name}", "move")
        geom = resolved_moves(body, [request])[0].geom
        for _ in range(20):
            direction = generator.normal(size=3)
            point = np.array([0.01, 0.02, -0.1]) + 0.12 * direction / np.linalg.norm(direction)
            model.geom_pos[model.geom("probe").id] = point
            mujoco.mj_kinematics(model, data)
            distance = mujoco.mj_geomDistance(
                model, data, model.geom("probe").id, model.geom(name).id, 1.0, np.zeros(6)
            )
            assert geom.of(point) == pytest.approx(distance + 1e-6, abs=1e-5)


# Optimum


def test_the_worst_deficit_of_a_made_problem_is_that_of_a_fine_grid(rod):
    """More torque is asked for than any place gives. On a grid of 1 mm over the box, with the
    longest muscle that has room in each place, the least worst deficit is known.
    """
    muscle = load_law(MUSCLE)
    law = muscle.muscle
    first = 0.04 / 3.0  # from the validity range of the law

    def demand(angle):
        return 55.0 - 20.0 * angle

    result = move_routes(
        rod, [curve(rod, lambda q: -demand(q))], [read_move(BOX, "move")], SUPPLY, [muscle]
    )
    (route,) = result.routes
    assert route.after.choice.contraction[0] == pytest.approx(first, abs=1e-6)
    best = np.inf
    angle = np.linspace(rod.joints["arm"].low, rod.joints["arm"].high, 41)
    for x in np.arange(0.020, 0.0601, 0.001):
        for z in np.arange(-0.140, -0.0599, 0.001):
            length, arms = statics(angle, x, z)
            longest = length.max()
            nominal = (longest - 0.1) / (1.0 - first)  # two fittings of 2.5 diameters
            contraction = first + (longest - length) / nominal
            if contraction.max() > 0.25:
                continue
            torque = -arms * law.static_force(6 * bar, contraction)
            missing = demand(angle) - torque
            best = min(best, missing.max() / demand(angle).max())
    assert 0.02 < best < 0.9
    assert route.after.deficit <= best + 0.005
    assert route.after.deficit == pytest.approx(best, rel=0.02)


def test_a_curve_of_a_hidden_place_is_met_at_its_pressure_at_most(rod):
    """The torques of a muscle at 4 bar at a place inside the box: the search needs no more."""
    muscle = load_law(MUSCLE)
    first = 0.04 / 3.0
    angle = np.linspace(rod.joints["arm"].low, rod.joints["arm"].high, 401)
    length, arms = statics(angle, 0.033, -0.09)
    contraction = first + (length.max() - length) / 0.17
    torque = arms * muscle.muscle.static_force(4 * bar, contraction)
    made = curve(rod, lambda q: float(np.interp(q, angle, torque)), count=21)
    result = move_routes(rod, [made], [read_move(BOX, "move")], SUPPLY, [muscle])
    (route,) = result.routes
    assert route.after.deficit <= 1e-3
    assert route.after.pressure <= 1.02 * 4 * bar
    assert route.before is not None
    assert route.before.pressure >= route.after.pressure
    # MuJoCo and the law judge the written body
    body = result.moved
    samples = sample_routes(body, made.poses)
    tension = route.after.choice.tension(route.after.pressure, samples.length[:, 0])
    given = -samples.slope[:, 0, 0] * tension
    assert (given <= made.torque + 1e-3 * np.abs(made.torque).max()).all()


def test_a_repetition_and_a_resumed_search_give_the_same(rod, tmp_path):
    made = curve(rod, lambda q: -12.0 + 3.0 * q)
    muscles = [load_law(MUSCLE)]
    arguments = (rod, [made], [read_move(BOX, "move")], SUPPLY, muscles)
    plain = move_routes(*arguments, starts=3)
    with result_store(tmp_path / "tasks") as store:
        move_routes(*arguments, starts=3)
        saved = store.saved
    with result_store(tmp_path / "tasks") as store:
        resumed = move_routes(*arguments, starts=3)
        assert store.recalled == saved > 0
        assert store.saved == 0
    for result in (resumed, move_routes(*arguments, starts=3)):
        assert result.routes[0].after.pressure == plain.routes[0].after.pressure
        point = plain.routes[0].after.sites["front_insertion"]
        assert (result.routes[0].after.sites["front_insertion"] == point).all()


def test_more_muscles_leave_no_greater_deficit_and_the_front_falls(rod):
    made = [
        curve(rod, lambda q: -90.0),
        curve(rod, lambda q: 40.0, name="arm_extensor"),
    ]
    conditions = dataclasses.replace(SUPPLY, max_count=3)
    result = move_routes(
        rod, made, [read_move(BOX, "move")], conditions, [load_law(MUSCLE)], starts=4
    )
    for route in result.routes:
        deficits = [route.deficits[count] for count in sorted(route.deficits)]
        assert deficits == sorted(deficits, reverse=True)
    numbers = [point.number for point in result.front]
    worst = [point.deficit for point in result.front]
    assert len(numbers) > 1
    assert numbers == sorted(set(numbers))
    assert worst == sorted(set(worst), reverse=True)


# Bounds


@pytest.mark.parametrize(
    "move",
    [
        "front_insertion on bone, clearance 15 mm",
        "front_insertion within 30 mm, clearance 12 mm from bone",
        "arm_flexor: front within 20 mm",
    ],
)
def test_points_stay_within_their_bounds_and_muscles_within_their_contraction(rod, move):
    request = read_move(move, "move")
    made = curve(rod, lambda q: -12.0)
    result = move_routes(rod, [made], [request], SUPPLY, [load_law(MUSCLE)], starts=4)
    (route,) = result.routes
    (bounds,) = result.moves
    point = route.after.sites[bounds.site]
    assert (point >= bounds.low - 1e-9).all()
    assert (point <= bounds.high + 1e-9).all()
    if bounds.geom is not None:
        distance = bounds.geom.of(point)
        assert distance >= bounds.clearance - 1e-6
        assert not bounds.surface or distance <= bounds.clearance + 3e-6
    sweep = next(item for item in sweep_routes(result.moved) if item.route.name == "arm_flexor")
    choice = route.after.choice
    low, high = choice.muscle.contraction_range
    assert choice.contraction_at(sweep.longest.length) >= low - 1e-6
    assert choice.contraction_at(sweep.shortest.length) <= high + 1e-5
    assert choice.tendon >= -1e-6


# Messages

MOVES = {
    "unknown site": ("nowhere within 20 mm", "no route has a site"),
    "excluded": (
        "front_insertion within box 0 mm..10 mm, 0 mm..0 mm, -1 m..0 m",
        "the box excludes the present position of front_insertion, 40 mm, 0 mm, -100 mm",
    ),
    "other route": (
        "arm_extensor: front_insertion within 20 mm",
        "belongs to the route arm_flexor",
    ),
    "unknown geom": ("front_insertion on nothing", "there is no geom"),
    "other body": ("front on bone", "belongs to the body rod, the site to stand"),
    "no demand": ("back_insertion within 20 mm", "no torque is demanded of its route"),
}
TEXTS = {
    "no bounds": ("front_insertion", "write it as 'knee_insertion within box"),
    "two ranges": ("front within box 0 mm..1 mm, 2 mm..3 mm", "box needs three ranges"),
    "no unit": ("front within 20", "unit"),
    "wrong unit": ("front within 20 deg", "deg"),
    "reversed": ("front within box 3 mm..1 mm, 0 mm..1 mm, 0 mm..1 mm", "is greater than"),
    "no geom": ("front within 20 mm, clearance 5 mm", "clearance 5 mm from GEOM"),
}


@pytest.mark.parametrize("case", MOVES)
def test_a_wrong_move_is_named(rod, case):
    text, message = MOVES[case]
    made = [curve(rod, lambda q: -10.0)]
    with pytest.raises(ParameterError, match=message):
        move_routes(rod, made, [read_move(text, "--move")], SUPPLY, [load_law(MUSCLE)])


@pytest.mark.parametrize("case", TEXTS)
def test_a_text_that_is_no_move_is_named(case):
    text, message = TEXTS[case]
    with pytest.raises(InputError, match=message) as caught:
        read_move(text, "--move")
    assert str(caught.value).startswith("--move")


def test_the_sites_that_may_be_moved_are_named_once_and_without_geoms():
    body = read_body(Path(__file__).parents[2] / "examples" / "air_leg.xml")
    move = read_move("nowhere within 20 mm", "--move")
    with pytest.raises(AirmuscleError, match="no route has a site") as caught:
        resolved_moves(body, [move])
    sites = str(caught.value).partition("there are ")[2].rstrip(".").split(", ")
    assert "knee_front_insertion" in sites
    assert not any(site.startswith("around") for site in sites)
    assert len(set(sites)) == len(sites)


def test_a_site_of_two_routes_is_not_moved(tmp_path):
    shared = ROD.replace('<site site="back"/>', '<site site="front"/>')
    body = read_body(written(tmp_path, shared))
    with pytest.raises(ParameterError, match="belongs to 2 routes"):
        resolved_moves(body, [read_move("front within 20 mm", "--move")])


def test_moves_of_a_file_are_those_of_texts(tmp_path):
    file = tmp_path / "moves.toml"
    file.write_text(
        '[[move]]\nsite = "front_insertion"\nbox = ["20 mm..60 mm", "0 mm..0 mm",'
        ' "-140 mm..-60 mm"]\n[[move]]\nroute = "arm_flexor"\nsite = "front"\non = "bone"\n'
        'clearance = "5 mm"\n',
        encoding="utf-8",
    )
    box, surface = read_moves(file)
    assert box._replace(where="") == read_move(BOX, "")
    text = "arm_flexor: front on bone, clearance 5 mm"
    assert surface._replace(where="") == read_move(text, "")
    file.write_text('[[move]]\nsite = "front"\nbocks = []\n', encoding="utf-8")
    with pytest.raises(AirmuscleError, match="bocks"):
        read_moves(file)


CURVES = {
    "outside": ("joint,angle [deg],torque [N m]\narm,50,1\n", "row 2 has arm at 50°, outside"),
    "unknown joint": ("joint,angle [deg],torque [N m]\nleg,5,1\n", "there is no joint"),
    "unit": ("joint,angle [deg],torque [kg]\narm,5,1\n", "kg"),
    "no torque": ("joint,angle [deg]\narm,5\n", "no column 'torque'"),
    "unknown route": ("joint,angle [deg],torque [N m],route\narm,5,1,x\n", "there is no route"),
    "short row": ("joint,angle [deg],torque [N m]\narm,5\n", "row 2 has 2 cells"),
}


@pytest.mark.parametrize("case", CURVES)
def test_a_wrong_curve_is_named(rod, tmp_path, case):
    text, message = CURVES[case]
    file = tmp_path / "curve.csv"
    file.write_text(text, encoding="utf-8")
    with pytest.raises((FileError, ParameterError), match=message):
        read_curves(rod, file)


def test_rows_without_a_route_are_those_of_the_one_that_pulls_there(rod, tmp_path):
    file = tmp_path / "curve.csv"
    file.write_text(
        "joint,angle [rad],torque [N mm],configuration\narm,0.1,900,light\narm,0.2,-500,light\n",
        encoding="utf-8",
    )
    curves = {rows.route: rows for rows in read_curves(rod, file)}
    assert sum(len(rows.torque) for rows in curves.values()) == 2
    (positive,) = (rows for rows in curves.values() if rows.torque[0] > 0.0)
    number = [route.name for route in rod.routes].index(positive.route)
    arms = -sample_routes(rod, positive.poses).slope[:, number, 0]
    assert (arms > 0.0).all()
    assert positive.torque == pytest.approx([0.9])
    assert positive.configuration == ("light",)
