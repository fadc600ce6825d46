"""Plants of the library: each is loaded, listed, shown and simulated by its name, and each number
has its source.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from command_line import airmuscle

import airmuscle as am
from airmuscle.errors import ParameterError, UnknownNameError
from airmuscle.files import PlantEntry, list_plants, load_law, load_plant_model, load_scenario
from airmuscle.files.library import PLANTS

pytestmark = pytest.mark.filterwarnings("ignore::airmuscle.core.errors.AirmuscleWarning")
each = pytest.mark.parametrize("name", list_plants())
MINIMUM = """
title = "A joint of my own"
[plant]
library = "joint-dmsp-20-matrix"
mechanism = { model = "AntagonisticJoint", radius = "30 mm", inertia = 0.1, damping = 1.0, offset = 0.11 }
[input]
"left.fill" = [["0.1 s", 1]]
[run]
duration = "0.3 s"
initial_state = { pressure = "2 bar" }
"""


def numbers(table: Any, path: str = "") -> Iterator[str]:
    """Paths of all values of tables that are not names."""
    if isinstance(table, dict):
        for key, value in table.items():
            if key not in ("model", "library", "name"):
                yield from numbers(value, f"{path}.{key}" if path else key)
    elif isinstance(table, list):
        for value in table:
            yield from numbers(value, path)
    else:
        yield path


@each
def test_every_number_of_a_plant_has_its_source_or_is_labelled_chosen(name):
    tables = tomllib.loads((PLANTS / f"{name}.toml").read_text(encoding="utf-8"))
    paths = {
        *numbers(tables["plant"]),
        *(f"{key}.{p}" for key in ("input", "run") for p in numbers(tables[key])),
    }
    sources = tables["sources"]
    missing = [p for p in paths if not any(p == s or p.startswith(f"{s}.") for s in sources)]
    assert missing == []
    unused = [s for s in sources if not any(p == s or p.startswith(f"{s}.") for p in paths)]
    assert unused == []
    assert all(text.strip() for text in sources.values())


def test_a_copied_file_of_a_plant_is_a_scenario_and_remains_an_entry(tmp_path):
    """Its provenance, sources and references stand in the file and do not disturb a run or a
    prediction.
    """
    path = tmp_path / "mine.toml"
    path.write_bytes((PLANTS / "joint-dmsp-20-itv2050.toml").read_bytes())
    scenario = load_scenario(path)
    own = load_scenario("joint-dmsp-20-itv2050")
    assert (scenario.plant, scenario.initial_state) == (own.plant, own.initial_state)
    assert am.load(path).references == am.load("joint-dmsp-20-itv2050").references != ()
    assert load_plant_model(path).scenario.plant == own.plant
    path.write_text(
        path.read_text(encoding="utf-8").replace("provenance =", "provenence ="), encoding="utf-8"
    )
    with pytest.raises(
        ParameterError, match=r"unknown key 'provenence'.*Did you mean 'provenance'"
    ):
        load_scenario(path)


@each
def test_a_plant_is_loaded_by_name_and_its_example_moves_within_its_range_of_angles(name):
    entry = am.load(name)
    scenario = load_scenario(name)
    assert isinstance(entry, PlantEntry)
    assert scenario.plant == entry.plant
    assert scenario.title == entry.title
    run = scenario.simulate()
    for c in entry.plant.mechanism.coordinates:
        assert np.ptp(run[c.name]) > 0.02
        assert c.lower_limit < run[c.name].min() < run[c.name].max() < c.upper_limit
    assert not [note for note in run.notes if "geometry" in note]


@each
def test_a_plant_is_listed_and_shown_with_its_sources(name):
    listed = json.loads(airmuscle("list", "--json").stdout)
    (row,) = [r for r in listed if r["name"] == name]
    assert row["kind"].startswith("plant, ")
    shown = airmuscle("show", name)
    assert shown.exit_code == 0
    assert "chosen" in shown.output
    assert json.loads(airmuscle("show", name, "--json").stdout)["entry"]["sources"]


def test_simulate_takes_the_name_of_a_plant(tmp_path):
    done = airmuscle("simulate", "joint-dmsp-20-regulators", "--out", tmp_path / "run")
    assert done.exit_code == 0, done.output
    assert (tmp_path / "run" / "recording.csv").exists()


def test_a_scenario_replaces_parts_of_a_library_plant(tmp_path):
    (tmp_path / "mine.toml").write_text(MINIMUM)
    plant = load_scenario(tmp_path / "mine.toml").plant
    library = am.load("joint-dmsp-20-matrix").plant
    assert plant.mechanism.radius == 0.03
    assert (plant.muscle, plant.circuit) == (library.muscle, library.circuit)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            '"joint-dmsp-20-matrix"',
            '"joint-nothing"',
            r"plant.library\]: no plant 'joint-nothing'.*joint-sam-30x290",
        ),
        ('"joint-dmsp-20-matrix"', '"joint-dmsp"', "'joint-dmsp' is ambiguous"),
        ('"joint-dmsp-20-matrix"', "3", "name a library plant"),
    ],
)
def test_a_library_plant_that_does_not_exist_is_refused(tmp_path, old, new, message):
    (tmp_path / "mine.toml").write_text(MINIMUM.replace(old, new))
    with pytest.raises((UnknownNameError, ParameterError), match=message):
        load_scenario(tmp_path / "mine.toml")


def test_a_plant_is_no_muscle():
    with pytest.raises(
        UnknownNameError, match="'joint-sam-30x290' is a plant; a muscle or a law is required"
    ):
        load_law("joint-sam-30x290")
    with pytest.raises(ParameterError, match="describes a plant; a muscle or a law is required"):
        load_law(PLANTS / "joint-sam-30x290.toml")
