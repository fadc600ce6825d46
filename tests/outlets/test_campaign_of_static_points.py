"""`airmuscle campaign` on a force map without time: its pressures are the levels of the band, and the braid that is given
is that of the muscle that is written, although there is no fill.
"""

from __future__ import annotations

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from airmuscle import load, load_data, write_csv
from airmuscle.cli.app import app
from airmuscle.muscle.geometry import Braid


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    folder = tmp_path_factory.mktemp("map")
    whole = load_data("dmsp-20-300")
    write_csv(whole.rows(np.isin(whole["pressure"], np.unique(whole["pressure"])[4::4])), folder / "bench.csv")
    words = [
        "campaign",
        folder / "bench.csv",
        "--braid",
        "radius=10 mm, angle=24.8 deg",
        "--out",
        folder / "out",
        "--json",
    ]
    done = CliRunner().invoke(app, [*map(str, words)])
    assert done.exit_code == 0, done.stderr
    return folder / "out", json.loads(done.stdout)


def test_the_braid_is_that_of_the_muscle_also_without_a_fill(written):
    out, _ = written
    muscle = load(out / "muscle.toml").muscle
    assert isinstance(muscle.geometry, Braid)
    assert (muscle.geometry.radius, muscle.geometry.resting_length) == pytest.approx((0.01, 0.3))


def test_the_map_is_one_static_record_with_a_band_of_its_levels(written):
    _, data = written
    assert [record["kind"] for record in data["records"]] == ["static"]
    static = next(stage for stage in data["stages"] if stage["stage"] == "static characteristic")
    assert static["bands"][0]["groups"] >= 2
