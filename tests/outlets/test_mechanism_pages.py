"""The pages on mechanisms, linearisation, drivers and batches are true: their code runs, tables
name what there is.
"""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from airmuscle.engine import sensitivity
from airmuscle.files import list_plants
from airmuscle.files.library import Location, model_names
from airmuscle.files.library.build import build
from airmuscle.physics import AntagonisticJoint, JointWithEndStops, Mechanism, mechanism

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """The code of a page writes to the folder in which it runs."""
    monkeypatch.chdir(tmp_path)


def blocks(page, language):
    text = (DOCS / page).read_text(encoding="utf-8")
    return re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)


def run(page):
    """What the page's code leaves, all of it in one place as a reader would type it."""
    found: dict[str, object] = {}
    for block in blocks(page, "python"):
        exec(compile(block, page, "exec"), found)
    return found


def test_the_code_on_mechanisms_runs(capsys):
    found = run("guides/mechanisms.md")
    assert found["run"]["angle"][-1] > 0.1
    assert found["pull"]["position"].max() == pytest.approx(0.03, abs=1e-9)
    assert re.fullmatch(r"0\.\d{3} rad\n\d+\.\d N\n", capsys.readouterr().out)


def test_the_code_on_joints_runs(capsys):
    found = run("guides/joints.md")
    assert found["points"].count.tolist() == [1, 1, 1]
    np.testing.assert_allclose(found["back"].angle, found["points"].angle, atol=1e-9)
    assert found["height"] == pytest.approx(-0.55, abs=0.05)
    assert "no pressures give a stiffness of 500 N m/rad" in capsys.readouterr().out


def test_every_plant_of_the_library_is_on_the_page_of_joints():
    text = (DOCS / "guides/joints.md").read_text(encoding="utf-8")
    assert [name for name in list_plants() if f"| `{name}` |" not in text] == []


def test_the_code_on_linearisation_runs(capsys):
    found = run("guides/linearise.md")
    assert found["shut"]["position"] < found["equilibrium"]["position"]
    assert found["small"].outputs == ("position", "pressure")
    stiffnesses = re.match(r"(\d+) and (\d+) N/m\n", capsys.readouterr().out)
    assert int(stiffnesses[2]) > int(stiffnesses[1])


def test_the_code_on_drivers_runs():
    found = run("guides/drivers.md")
    assert found["run"]["position"].max() > 0.03
    assert found["state"]["air_mass"] > 2 * found["plant"].state_at(pressure=0.0)["air_mass"]


def test_the_code_on_batches_runs():
    batch = run("guides/batch.md")["batch"]
    assert not len(batch.failed)
    assert np.all(batch.final[sensitivity("position", 0)] < 0)  # more load, less way


def test_the_table_of_a_scenario_is_built():
    table = tomllib.loads(blocks("guides/mechanisms.md", "toml")[0])["plant"]["mechanism"]
    found = build(table, Location("page", "", DOCS))
    assert isinstance(found, JointWithEndStops)
    assert isinstance(found.inner, AntagonisticJoint)
    assert found.lower_stop == pytest.approx(-0.349066, abs=1e-6)


def test_every_mechanism_is_on_the_page_and_may_stand_in_a_file():
    text = (DOCS / "guides/mechanisms.md").read_text(encoding="utf-8")
    classes = [
        c for c in vars(mechanism).values() if isinstance(c, type) and issubclass(c, Mechanism)
    ]
    final = {c.__name__ for c in classes} - {"Mechanism", "MechanismWrapper"}
    assert final == {name for name in final if f"`{name}`" in text}
    assert final <= set(model_names())
