"""A muscle file states the version of its form, and what differs between two muscles is said."""

from __future__ import annotations

import importlib.util
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_line import airmuscle

import airmuscle as am
from airmuscle.errors import FileError, ParameterError
from airmuscle.files import compare_entries, load_law, save, to_toml
from airmuscle.physics import ValidityRange

ROOT = Path(__file__).resolve().parents[2]


def test_a_written_file_states_its_format_and_one_without_is_read_as_the_first(tmp_path):
    entry = load_law("tondu-lopez")
    text = to_toml(entry)
    assert text.startswith("format = 1\n")
    older = tmp_path / "older.toml"
    older.write_text(text.removeprefix("format = 1\n"), encoding="utf-8")
    assert load_law(str(older)).characteristic == entry.characteristic


@pytest.mark.parametrize(
    ("version", "message"),
    [
        ("2", r"the file has format 2, and this program reads up to format 1\. Install a newer"),
        ("0", r"format is 0; it must be the version of the muscle file, an integer: format = 1"),
        ("true", r"format is True; it must be the version"),
        ('"1"', r"format is '1'; it must be the version"),
    ],
)
def test_an_unknown_format_is_refused_and_the_remedy_works(tmp_path, version, message):
    file = tmp_path / "muscle.toml"
    text = to_toml(load_law("tondu-lopez"))
    file.write_text(text.replace("format = 1", f"format = {version}"), encoding="utf-8")
    with pytest.raises(FileError, match=message):
        load_law(str(file))
    file.write_text(text, encoding="utf-8")
    assert load_law(str(file)).characteristic.force(5e5, 0.0) > 0.0


def test_the_published_schema_is_that_of_the_program():
    spec = importlib.util.spec_from_file_location(
        "make_muscle_schema", ROOT / "release" / "make_muscle_schema.py"
    )
    maker = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(maker)
    assert maker.PATH.read_text(encoding="utf-8") == maker.text(), f"run {spec.origin}"


def test_equal_entries_do_not_differ():
    entry = load_law("dmsp-20-300")
    difference = compare_entries(entry, entry)
    assert difference.parameters == ()
    assert not difference.force_difference.any()
    assert difference.chapter().paragraphs == ("Both laws give the same forces.",)


def test_a_changed_parameter_and_its_effect_on_the_force_are_found():
    entry = load_law("tondu-lopez")
    law = entry.characteristic
    stronger = replace(law, geometry=replace(law.geometry, radius=1.1 * law.geometry.radius))
    difference = compare_entries(entry, replace(entry, characteristic=stronger))
    paths = {item.path: item.ratio for item in difference.parameters}
    assert paths["characteristic.geometry.radius"] == pytest.approx(1.1)
    row, column = difference.greatest_place
    assert difference.pressures[row] == pytest.approx(6e5)
    assert difference.contractions[column] == 0.0
    gained = difference.forces[1] / np.maximum(difference.forces[0], 1e-9)
    assert gained[row, column] == pytest.approx(1.21)


def test_parts_of_other_models_are_named_by_their_models():
    difference = compare_entries(load_law("dmsp-20-300"), load_law("festo-tool-dmsp-20"))
    models = {item.path: (item.first, item.second) for item in difference.parameters}
    assert models["characteristic"] == ("MartensBoblan2017", "Tabulated")
    assert (difference.forces >= 0.0).all()


def test_ranges_without_a_common_part_are_refused():
    entry = load_law("tondu-lopez")
    low = replace(entry, validity_range=ValidityRange(0.0, 1e5, 0.0, 0.2))
    high = replace(entry, validity_range=ValidityRange(2e5, 6e5, 0.0, 0.2))
    with pytest.raises(
        ParameterError, match=r"valid from 0 kPa to 100 kPa .* no pressure in common"
    ):
        compare_entries(low, high)


def test_the_command_prints_the_place_of_the_greatest_difference(tmp_path):
    save(am.load("tondu-lopez"), tmp_path / "mine.toml")
    answer = airmuscle("diff", "dmsp-20-300", str(tmp_path / "mine.toml"), "--json")
    chapter = json.loads(answer.stdout)["difference"]
    assert chapter["summary"][0].startswith("The force of mine differs most at ")
    assert airmuscle("diff", "dmsp-20-300", "nothing.toml").exit_code == 1
