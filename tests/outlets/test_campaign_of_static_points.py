"""`airmuscle campaign` on a force map without time: its pressures are the levels of the band, and
the braid that is given is that of the muscle that is written, although there is no fill. Fills
alone give their scenarios, and the reason why there is no muscle.
"""

from __future__ import annotations

import json
import sys

import numpy as np
import pytest
from command_line import airmuscle
from made_campaign import TrueMuscle

from airmuscle import Recording, load, load_data, write
from airmuscle.files import load_scenario
from airmuscle.physics import Braid


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    folder = tmp_path_factory.mktemp("map")
    whole = load_data("dmsp-20-300")
    write(
        whole.rows(np.isin(whole["pressure"], np.unique(whole["pressure"])[4::4])),
        folder / "bench.csv",
    )
    words = [
        "campaign",
        folder / "bench.csv",
        "--braid",
        "radius=10 mm, angle=24.8 deg",
        "--out",
        folder / "out",
        "--json",
    ]
    done = airmuscle(*map(str, words))
    assert done.exit_code == 0, done.stderr
    return folder / "out", json.loads(done.stdout)


def test_the_braid_is_that_of_the_muscle_also_without_a_fill(written):
    out, _ = written
    muscle = load(out / "muscle.toml").muscle
    assert isinstance(muscle.geometry, Braid)
    assert (muscle.geometry.radius, muscle.geometry.resting_length) == pytest.approx((0.01, 0.3))


def test_the_map_is_one_static_record_with_a_band_of_its_levels(written):
    _, data = written
    assert [record["kind"] for record in data["campaign"]["records"]] == ["static"]
    stages = {stage["stage"]: stage for stage in data["campaign"]["stages"]}
    assert stages["static characteristic"]["identified"] is True
    assert data["campaign"]["bands"][0]["groups_left_out"] >= 2


def test_fills_alone_give_their_scenarios_with_the_braid_and_say_why_there_is_no_muscle(tmp_path):
    columns = TrueMuscle(0.3).fill(0.08, np.random.default_rng(1))
    del columns["force"]
    write(Recording(columns, "fill", {"resting_length": 0.3}), tmp_path / "fill.csv")
    braid = ("--braid", "radius=10 mm, angle=24.4 deg", "--resting-length", "300 mm")
    words = ["campaign", str(tmp_path / "fill.csv"), *braid, "--out", str(tmp_path / "out")]
    done = airmuscle(*words)
    said = " ".join(done.stdout.split())
    assert "static characteristic 0 Not identified: no record is a slow run with force" in said
    assert "muscle: not written, because it needs a static characteristic" in said
    assert "A tube between" not in (tmp_path / "out" / "report.html").read_text(
        encoding="utf-8"
    )  # the model errs
    assert not (tmp_path / "out" / "muscle.toml").exists()
    path = tmp_path / "out" / "scenarios" / "fill.toml"
    assert "because no force was measured" in path.read_text(encoding="utf-8").splitlines()[0]
    assert load_scenario(path).simulate()["pressure"].max() == pytest.approx(6.2e5, rel=0.03)
    alone = airmuscle(*words[:2], *braid[2:], "--out", tmp_path / "none")
    assert "scenarios: not written: the muscle has no enclosed volume" in " ".join(
        alone.stdout.split()
    )


def test_a_map_and_one_loop_are_reported_together(tmp_path):
    """The tables of the law and of the friction have names of their own, also where there is one
    loop.
    """
    write(load_data("dmsp-20-300"), tmp_path / "map.csv")
    time = np.linspace(0.0, 40.0, 401)
    contraction = 0.1 - 0.1 * np.cos(0.1 * np.pi * time)
    force = load("dmsp-20-300").characteristic.force(3e5, contraction) - 8.0 * np.sign(
        np.gradient(contraction)
    )
    columns = {"time": time, "pressure": np.full(401, 3e5), "contraction": contraction}
    rng = np.random.default_rng(1)
    write(
        Recording({**columns, "force": force + rng.standard_normal(401)}, "loop"),
        tmp_path / "loop.csv",
    )
    files = (tmp_path / "map.csv", tmp_path / "loop.csv")
    done = airmuscle("campaign", *files, "--resting-length", "300 mm", "--out", tmp_path / "out")
    assert done.exit_code == 0, done.stderr
    assert {"parameters.csv", "friction-parameters.csv"} <= {
        path.name for path in (tmp_path / "out" / "data").iterdir()
    }


@pytest.mark.skipif(sys.platform != "linux", reason="names of files are bytes on Linux only")
def test_a_file_whose_name_is_no_text_and_that_cannot_be_read_is_named(tmp_path):
    write(load_data("dmsp-20-300"), tmp_path / "map.csv")
    done = airmuscle(
        "campaign", tmp_path / "\udcff.csv", tmp_path / "map.csv", "--out", tmp_path / "out"
    )
    assert done.exit_code == 0, done.stderr
    assert "ff.csv" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
