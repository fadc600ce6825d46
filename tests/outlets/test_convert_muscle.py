"""A muscle in another form has the same numbers: JSON by its tables, a force map by its cells."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from command_line import airmuscle

from airmuscle.bench import read
from airmuscle.files import list_laws, load_law, to_toml

GRID = "force [N] over contraction [%], pressure [kPa]"
FORCE_LAWS = ("dmsp-20-300", "festo-tool-dmsp-10", "chou-hannaford", "sarosi-dmsp-20-200n")


@pytest.mark.parametrize("name", FORCE_LAWS)
def test_a_force_map_is_read_back_to_the_forces_of_the_law(name: str, tmp_path: Path):
    target = tmp_path / "map.csv"
    result = airmuscle("convert", name, target, "--to", "csv-map")
    assert result.exit_code == 0, result.output
    assert GRID in result.output
    (record,) = read(target, grid=GRID)
    entry = load_law(name)
    assert len(record) == 13 * 27
    expected = entry.characteristic.force(record["pressure"], record["contraction"])
    assert record["force"] == pytest.approx(expected.clip(0.0), rel=1e-7, abs=1e-6)
    for quantity in ("pressure", "contraction"):
        low, high = getattr(entry.validity_range, quantity)
        assert record[quantity].min() == pytest.approx(low)
        assert record[quantity].max() == pytest.approx(high)


@pytest.mark.filterwarnings("ignore::airmuscle.errors.AirmuscleWarning")
@pytest.mark.parametrize("name", list_laws())
def test_json_has_every_number_of_the_file_and_a_unit_of_each_parameter(name: str, tmp_path: Path):
    import tomlkit

    target = tmp_path / "muscle.json"
    assert airmuscle("convert", name, target, "--to", "json").exit_code == 0
    content = json.loads(target.read_text(encoding="utf-8"))
    path = tmp_path / f"{name}.toml"
    path.write_text(tomlkit.dumps(content["muscle"]), encoding="utf-8")
    assert to_toml(load_law(path)) == to_toml(load_law(name))
    shown = json.loads(airmuscle("show", name, "--json").stdout)["entry"]["parameters"]
    stated = {row["parameter"]: row["unit"] for row in shown if "ratings" not in row["parameter"]}
    assert stated.items() <= content["units"].items()


def test_a_muscle_is_not_written_over_itself(tmp_path: Path):
    path = tmp_path / "muscle.toml"
    path.write_text(to_toml(load_law("chou-hannaford")), encoding="utf-8")
    before = path.read_bytes()
    result = airmuscle("convert", path, path, "--to", "json")
    assert result.exit_code == 1
    assert "Choose another target" in result.stderr
    assert path.read_bytes() == before


def test_an_unknown_form_names_the_known_ones(tmp_path: Path):
    result = airmuscle("convert", "dmsp-20-300", tmp_path / "a", "--to", "opensim")
    assert result.exit_code != 0
    assert "json" in result.stderr
    assert "csv-map" in result.stderr
