"""`airmuscle fit-out`: muscles that hold every pose, and a body whose actuators never exceed what
its muscles are permitted.
"""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import bodies
import numpy as np
import printed
import pytest
from bodies import arm, written
from command_line import airmuscle

from airmuscle import files
from airmuscle.design import (
    MotionOfRoute,
    Poses,
    SizingConditions,
    by_number,
    fit_out,
    read_body,
    route_flow,
    sample_routes,
    study_body,
)
from airmuscle.errors import ParameterError
from airmuscle.outlets import fitted_body
from airmuscle.physics import Valve
from airmuscle.units import bar

pytestmark = pytest.mark.tool
LEG = Path(__file__).parents[2] / "examples" / "air_leg.xml"
SUPPLY = SizingConditions(6 * bar, 1.5)


@pytest.fixture(scope="module")
def mujoco():
    return bodies.require_mujoco()


def require_plugins(mujoco):
    """Skip a test that builds plugins, without a compiler or with a MuJoCo that has none."""
    printed.require("gcc")


@pytest.fixture(scope="module")
def result(mujoco):
    """The muscles of the leg of the examples."""
    return fit_out(study_body(read_body(LEG)), SUPPLY)


def test_every_route_of_the_leg_is_served_and_fills_its_path(result):
    assert not result.unserved
    assert len(result.muscles) == 6
    for choice in result.muscles:
        taken = choice.length * (1.0 - choice.contraction[0]) + choice.tendon + choice.fittings
        assert taken == pytest.approx(choice.sweep.longest.length)
        assert choice.tendon >= 0.0


def test_no_pose_leaves_the_contraction_and_the_demand_has_its_reserve(result):
    """10 000 random poses, against the lengths that MuJoCo gives there."""
    body = result.study.body
    ranges = np.array([(body.joints[name].low, body.joints[name].high) for name in body.moving])
    positions = np.random.default_rng(3).uniform(*ranges.T, (10_000, len(ranges)))
    lengths = sample_routes(body, Poses(body.moving, positions)).length
    for column, choice in enumerate(result.muscles):
        contraction = choice.contraction_at(lengths[:, column])
        low, high = choice.muscle.contraction_range
        assert contraction.min() >= low - 1e-6
        assert contraction.max() <= high + 1e-6
        demand = result.demands[choice.name]
        assert (choice.capacity(demand.length) >= 1.499 * demand.tension).all()


def test_a_shorter_muscle_or_one_fewer_does_not_serve(result):
    """The choice is the least: with 2 % less length the contraction or the reserve is missed."""
    for choice in result.muscles:
        length = 0.98 * choice.length
        last = choice.contraction[0] + choice.sweep.stroke / (choice.tackle * length)
        demand = result.demands[choice.name]
        taken = (choice.sweep.longest.length - demand.length) / (choice.tackle * length)
        force = choice.muscle.capacity(choice.contraction[0] + taken)
        capacity = choice.count / choice.tackle * force
        least = choice.muscle.entry.ratings.min_length
        assert (
            last > choice.muscle.contraction_range[1]
            or (capacity < 1.5 * demand.tension).any()
            or length < max(least, 3.0 * choice.muscle.entry.ratings.diameter)
        )


def test_the_number_of_muscles_is_least_where_it_is_asked_for(result):
    fewest = fit_out(result.study, SUPPLY, criterion=by_number)
    count = sum(choice.count for choice in fewest.muscles)
    assert not fewest.unserved
    assert count < sum(choice.count for choice in result.muscles)


def test_no_actuator_exceeds_the_permitted_force_and_each_keeps_its_stated_error(result, mujoco):
    """10 000 random poses and pressures of the written body: forces are pulls within the permitted
    ones, and those of the law within the greatest deviation that the file states."""
    fitted = fitted_body(result)
    model = mujoco.MjModel.from_xml_string(fitted.text)
    data = mujoco.MjData(model)
    generator = np.random.default_rng(4)
    low, high = model.jnt_range.T
    forces = np.empty((10_000, model.nu))
    lengths = np.empty_like(forces)
    pressures = generator.uniform(0.5 * bar, 6 * bar, forces.shape)
    for row in range(len(forces)):
        data.qpos[:] = generator.uniform(low, high)
        data.act[:] = pressures[row]
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        mujoco.mj_fwdActuation(model, data)
        forces[row] = data.actuator_force
        lengths[row] = data.actuator_length
    for column, choice in enumerate(result.muscles):
        rated = choice.count / choice.tackle * choice.muscle.entry.ratings.max_force
        pull = -forces[:, column]
        assert pull.min() >= 0.0
        assert pull.max() <= rated + 1e-9
        table = fitted.tables[choice.name]
        within = pressures[:, column] >= choice.muscle.pressure_range[0]
        law = np.minimum(choice.tension(pressures[:, column], lengths[:, column]), table.permitted)
        deviation = np.abs(pull - law)[within]
        assert deviation.max() <= 1.05 * table.greatest  # between the points of the table


@pytest.mark.parametrize("as_plugins", [False, True], ids=["tables", "plugins"])
def test_five_seconds_with_a_controller_at_each_joint_are_stable(
    as_plugins, result, mujoco, tmp_path
):
    """Pressures by PD control of the angles, at MuJoCo's default step."""
    if as_plugins:
        require_plugins(mujoco)
    fitted = fitted_body(result, tmp_path if as_plugins else None)
    model = mujoco.MjModel.from_xml_string(fitted.text)
    assert model.opt.timestep == 0.002
    data = mujoco.MjData(model)
    for route in fitted.plugins.values():
        for name in route.names:
            route.plugin.initialise(model, data, name, pressure=1 * bar)
    target = np.radians([-20.0, 40.0, 5.0])
    angles = []
    for _ in range(2500):
        mujoco.mj_step1(model, data)
        moment = np.zeros((model.nu, model.nv))
        mujoco.mju_sparse2dense(
            moment,
            data.actuator_moment,
            data.moment_rownnz,
            data.moment_rowadr,
            data.moment_colind,
        )
        wanted = 12.0 * (target - data.qpos) - 1.5 * data.qvel + data.qfrc_bias
        pull = -(moment @ wanted)  # an actuator that helps has the sign of -dL/dq
        data.ctrl[:] = 1.5 * bar + 6e4 * pull
        mujoco.mj_step2(model, data)
        angles.append(data.qpos.copy())
    angles = np.array(angles)
    assert np.isfinite(angles).all()
    assert not any(warning.number for warning in data.warning)
    assert np.abs(np.ptp(angles[-500:], axis=0)).max() <= np.radians(2.0)
    assert np.abs(angles[-1] - target).max() <= np.radians(15.0)


def test_a_route_that_no_muscle_serves_is_named_with_what_would(mujoco, tmp_path):
    short = arm(front="0.06 0 0.06", insertion="0.06 0 -0.06", limits="-60 60")
    result = fit_out(study_body(read_body(written(tmp_path, short))), SUPPLY)
    assert not result.muscles
    assert "A lever of" in result.unserved[0].reason
    heavy = arm().replace('mass="1"', 'mass="900"')
    result = fit_out(study_body(read_body(written(tmp_path, heavy))), SUPPLY)
    assert "or more muscles" in result.unserved[0].reason


def test_the_command_writes_the_body_the_choice_and_a_page_for_each_route(mujoco, tmp_path):
    body = written(
        tmp_path, arm(after='<actuator><motor name="old" tendon="arm_flexor"/></actuator>')
    )
    out = tmp_path / "out"
    answer = airmuscle("fit-out", body, "--supply", "6 bar", "--out", out, "--json")
    assert answer.exit_code == 0, answer.output
    chapter = json.loads(answer.stdout)["fit_out"]
    assert [row["route"] for row in chapter["muscles"]] == ["old", "arm_extensor"]
    choice = tomllib.loads((out / "muscles.toml").read_text(encoding="utf-8"))
    assert [row["number"] for row in choice["muscle"]] == [
        row["number"] for row in chapter["muscles"]
    ]
    model = mujoco.MjModel.from_xml_path(str(out / "body.xml"))
    assert [model.actuator(index).name for index in range(model.nu)] == ["old", "arm_extensor"]
    assert (out / "figures" / "route_arm_extensor.svg").exists()
    assert (out / "data" / "order.csv").exists()


def test_plugins_are_refused_with_a_mujoco_in_which_they_do_not_work(mujoco, tmp_path, monkeypatch):
    """No table stands silently for the plugins that are asked for."""
    path = written(tmp_path, arm())
    fitted = fit_out(study_body(read_body(path)), SUPPLY)
    monkeypatch.setattr(mujoco, "__version__", "3.16.0")
    with pytest.raises(ParameterError, match=r"3\.16\.0"):
        fitted_body(fitted, tmp_path / "plugins")
    assert not (tmp_path / "plugins").exists()


def test_nothing_is_written_without_a_body(mujoco, tmp_path):
    answer = airmuscle(
        "fit-out", tmp_path / "none.xml", "--supply", "6 bar", "--out", tmp_path / "out"
    )
    assert answer.exit_code == 1
    assert "there is no such file" in answer.stderr
    assert not (tmp_path / "out").exists()


def test_plugins_have_the_torque_of_the_muscles_of_the_library(result, mujoco, tmp_path):
    """The static torque of each route at random pressures and poses equals that of the law times
    number and moment arm, within 1e-6; laws that give no force have a table."""
    require_plugins(mujoco)
    fitted = fitted_body(result, tmp_path)
    assert set(fitted.plugins) | set(fitted.tables) == {choice.name for choice in result.muscles}
    assert len(fitted.plugins) >= 4
    spec = mujoco.MjSpec.from_string(fitted.text)
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4  # forces at the instant
    model = spec.compile()
    data = mujoco.MjData(model)
    generator = np.random.default_rng(5)
    for _ in range(40):
        data.qpos[:] = generator.uniform(*model.jnt_range.T)
        for choice in result.muscles:
            route = fitted.plugins.get(choice.name)
            for name in () if route is None else route.names:
                pressure = float(generator.uniform(1 * bar, 5.9 * bar))
                route.plugin.initialise(model, data, name, pressure=pressure)
                mujoco.mj_forward(model, data)
                force = -data.actuator(name).force[0]
                length = data.ten_length[choice.sweep.route.index]
                law = float(choice.muscle.force(pressure, choice.contraction_at(length)))
                assert force == pytest.approx(max(law, 0.0), rel=1e-6, abs=1e-6)


def motion_file(folder, period):
    """A motion of the rod on its hinge: a sine of 15 degrees."""
    time = np.linspace(0.0, period, 81)
    angle = 15.0 * np.sin(2.0 * np.pi * time / period)
    rows = "".join(f"{t:.9g},{q:.9g}\n" for t, q in zip(time, angle, strict=True))
    path = folder / f"motion_{period:.4g}.csv"
    path.write_text(f"time [s],arm [deg]\n{rows}", encoding="utf-8")
    return path


def test_the_flow_of_a_motion_is_the_change_of_the_air_of_the_muscles(mujoco, tmp_path):
    """Slow motions of twice the speed have twice the flow; the air is p V/(R T) at the pressure
    that gives the tension, and a valve of the stated conductance is just enough."""
    body = read_body(written(tmp_path, arm()))
    flows = {}
    for period in (40.0, 80.0):
        study = study_body(body, motion=motion_file(tmp_path, period))
        fitted = fit_out(study, SUPPLY)
        flows[period] = {flow.route: flow for flow in fitted.flows}
        assert set(flows[period]) == {choice.name for choice in fitted.muscles}
    for name, flow in flows[40.0].items():
        assert flow.fill == pytest.approx(2.0 * flows[80.0][name].fill, rel=0.02)
        assert flow.fill > 0.0
        enough = Valve(flow.conductance, 0.3)
        study = study_body(body, motion=motion_file(tmp_path, 40.0))
        for valve, use in ((enough, 1.0), (Valve(0.5 * flow.conductance, 0.3), 2.0)):
            compared = {item.route: item for item in fit_out(study, SUPPLY, valve=valve).flows}
            assert compared[name].use == pytest.approx(use, rel=1e-6)
    choice = next(item for item in fitted.muscles if item.muscle.entry.geometry is not None)
    motion = MotionOfRoute(
        np.array([0.0, 1.0, 2.0]),
        np.array([1.0, 0.995, 0.99]) * choice.sweep.longest.length,
        np.full(3, choice.count / choice.tackle * 100.0),
    )
    flow = route_flow(choice, motion, SUPPLY)
    air = []
    for contraction in choice.contraction_at(motion.length):
        end = choice.muscle.end_point(float(contraction), 100.0)
        volume = choice.muscle.entry.geometry.volume(float(contraction))
        air.append((end.pressure + 1.0e5) * float(volume))
    ambient = SUPPLY.ambient
    steps = np.gradient(np.array(air) / (287.0 * ambient.temperature))
    assert max(flow.fill, flow.discharge) == pytest.approx(np.abs(steps).max(), rel=0.02)


def test_a_valve_that_is_too_small_for_a_motion_is_named(mujoco, tmp_path):
    path = written(tmp_path, arm())
    motion = motion_file(tmp_path, 0.2)
    options = ("--supply", "6 bar", "--motion", motion, "--valve", "matrix-821")
    answer = airmuscle("fit-out", path, *options, "--json")
    assert answer.exit_code == 0, answer.output
    chapter = json.loads(answer.stdout)["fit_out"]
    small = [row["route"] for row in chapter["flows"] if row["part_of_the_valve"] > 1.0]
    texts = " ".join(chapter["problems"])
    for name in ("arm_flexor", "arm_extensor"):
        assert (f"{name}: the motion demands" in texts) == (name in small)
    assert small
    assert "would serve" in texts


def test_an_own_muscle_file_serves_as_a_muscle_of_the_library(mujoco, tmp_path):
    source = Path(files.__file__).parent / "library" / "dmsp-20-300.toml"
    own = tmp_path / "muscle.toml"
    own.write_text(source.read_text(encoding="utf-8"), encoding="utf-8")
    path = written(tmp_path, arm())
    rows = []
    for muscle in ("dmsp-20-300", own):
        answer = airmuscle("fit-out", path, "--supply", "6 bar", "--muscle", muscle, "--json")
        assert answer.exit_code == 0, answer.output
        rows.append(json.loads(answer.stdout)["fit_out"]["muscles"])
    for listed, read in zip(*rows, strict=True):
        assert read["nominal_length"] == pytest.approx(listed["nominal_length"])
        assert read["number"] == listed["number"]
