"""`airmuscle route`: the body with moved points, its report, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path

import bodies
import numpy as np
import pytest
from bodies import arm, written
from command_line import airmuscle

pytestmark = pytest.mark.tool
MOVE = "front_insertion within box 20 mm..60 mm, 0 mm..0 mm, -140 mm..-60 mm"
CURVE = "joint,angle [deg],torque [N m]\narm,-20,-8\narm,0,-10\narm,20,-7\n"


@pytest.fixture(scope="module", autouse=True)
def mujoco():
    return bodies.require_mujoco()


@pytest.fixture
def inputs(tmp_path: Path) -> tuple[Path, Path]:
    """A body and a curve."""
    curve = tmp_path / "curve.csv"
    curve.write_text(CURVE, encoding="utf-8")
    return written(tmp_path, arm()), curve


def route(inputs, *options):
    body, curve = inputs
    basic = ("--curves", curve, "--supply", "6 bar", "--muscle", "dmsp-20-300", "--starts", 2)
    return airmuscle("route", body, *basic, "--max-count", 1, *options)


def test_the_moved_body_has_the_points_of_the_table_and_its_torques(mujoco, inputs, tmp_path):
    out = tmp_path / "out"
    answer = route(inputs, "--move", MOVE, "--out", out, "--json")
    assert answer.exit_code == 0, answer.output
    chapter = json.loads(answer.stdout)["route"]
    (moved,) = chapter["moves"]
    model = mujoco.MjModel.from_xml_path(str(out / "body.xml"))
    data = mujoco.MjData(model)
    position = [moved[f"{axis}_after"] for axis in "xyz"]
    assert model.site("front_insertion").pos == pytest.approx(position, abs=1e-6)
    assert model.site("back_insertion").pos == pytest.approx([-0.04, 0.0, -0.1])
    for row in chapter["curves"]:
        data.qpos[0] = np.radians(float(row["angle"].removesuffix("°")))
        mujoco.mj_fwdPosition(model, data)
        assert -data.ten_J[0] == pytest.approx(row["moment_arm"], rel=1e-4)
        assert row["after"] <= row["demand"] + 1e-2
    for name in ("body.png", "torque_arm_flexor.svg"):
        assert (out / "figures" / name).exists()
    assert not (out / "tasks").exists()


def test_an_interrupted_command_goes_on_from_its_searches(inputs, tmp_path, monkeypatch):
    module = "airmuscle.design.body.moving._front"

    def interrupted(routes):
        raise KeyboardInterrupt

    out = tmp_path / "out"
    whole = tmp_path / "whole"
    with monkeypatch.context() as patch:
        patch.setattr(module, interrupted)
        answer = route(inputs, "--move", MOVE, "--out", out)
    assert answer.exit_code != 0
    assert "the same command resumes from there" in answer.stderr
    answer = route(inputs, "--move", MOVE, "--out", out)
    assert answer.exit_code == 0
    assert "resuming from the results" in answer.stderr
    assert route(inputs, "--move", MOVE, "--out", whole).exit_code == 0
    assert (out / "body.xml").read_bytes() == (whole / "body.xml").read_bytes()
    assert (out / "data" / "curves.csv").read_bytes() == (whole / "data/curves.csv").read_bytes()


@pytest.mark.parametrize(
    ("options", "code", "message"),
    [
        ((), 2, "--move or --moves"),
        (("--move", "front within 20"), 1, "has no unit"),
        (("--move", "nowhere within 20 mm"), 1, "no route has a site"),
        (("--move", MOVE.replace("20 mm..60", "50 mm..60")), 1, "excludes the present position"),
    ],
)
def test_a_wrong_request_writes_nothing(inputs, tmp_path, options, code, message):
    out = tmp_path / "out"
    answer = route(inputs, *options, "--out", out)
    assert answer.exit_code == code, answer.output
    assert message in answer.stderr
    assert not out.exists()


@pytest.mark.slow
def test_a_cluster_gives_what_one_process_gives(inputs, tmp_path):
    distributed = pytest.importorskip("distributed")
    quiet = {"dashboard_address": None, "worker_dashboard_address": None}
    options = ("--move", MOVE, "--out")
    assert route(inputs, *options, tmp_path / "one").exit_code == 0
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, **quiet) as cluster:
        address = cluster.scheduler_address
        assert route(inputs, *options, tmp_path / "many", "--cluster", address).exit_code == 0
    for name in ("body.xml", "data/curves.csv", "data/moves.csv"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "many" / name).read_bytes()
