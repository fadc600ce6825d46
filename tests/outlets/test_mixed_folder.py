"""A folder of one rig with files of several formats: one mapping serves all of them, each is named
with what it was taken for, and a broken one does not hinder the others.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from command_line import airmuscle
from field_files import FORCE, LENGTH, PRESSURE, TIME, mat, table

from airmuscle.bench import read
from airmuscle.errors import ColumnError

pytestmark = pytest.mark.filterwarnings("ignore")

RIG = """
resting_length = "200 mm"

[columns]
AI0 = "pressure [bar]"
AI1 = "force [N]"
AI2 = "length [mm]"

["*.mat"]
specimen = "of MATLAB"
["*.mat".columns]
"data(:,1)" = "time [s]"
"data(:,2)" = "pressure [kPa]"
"data(:,3)" = "force [N]"
"data(:,4)" = "length [mm]"

["muscle_b/*"]
specimen = "B"
"""


def write_rig(folder: Path) -> Path:
    """Three formats, of which two need the mapping, and a file of another muscle in a folder."""
    folder.mkdir()
    named = {"Time (s)": TIME, "Pressure (kPa)": PRESSURE / 1e3, "Force (N)": FORCE}
    (folder / "a.csv").write_text(table({**named, "Length (mm)": 1e3 * LENGTH}), "utf-8")
    channels = {"time [s]": TIME, "AI0": PRESSURE / 1e5, "AI1": FORCE, "AI2": 1e3 * LENGTH}
    for name in ("b.txt", "c.txt"):
        (folder / name).write_text(table(channels, "\t", digits=6), "utf-8")
    matrix = np.column_stack([TIME, PRESSURE / 1e3, FORCE, 1e3 * LENGTH])
    (folder / "d.mat").write_bytes(mat(data=matrix))
    return folder


@pytest.fixture
def mapping(tmp_path: Path) -> Path:
    path = tmp_path / "rig.toml"
    path.write_text(RIG, "utf-8")
    return path


def test_one_mapping_serves_a_folder_of_several_formats(tmp_path: Path, mapping: Path):
    recordings = read(write_rig(tmp_path / "rig"), mapping)
    assert len(recordings) == 4
    for recording in recordings:
        np.testing.assert_allclose(recording["pressure"], PRESSURE, atol=20.0)
        np.testing.assert_allclose(recording["contraction"], 1.0 - LENGTH / 0.2, atol=1e-5)
    specimens = [recording.constants.get("specimen") for recording in recordings]
    assert specimens == [None, None, None, "of MATLAB"]


def test_a_section_holds_for_a_folder(tmp_path: Path, mapping: Path):
    rig = write_rig(tmp_path / "muscle_b")
    (recording,) = read(rig / "b.txt", mapping)
    assert recording.constants["specimen"] == "B"


def test_options_precede_the_sections_of_a_mapping(tmp_path: Path, mapping: Path):
    rig = write_rig(tmp_path / "rig")
    said = airmuscle("inspect", rig / "d.mat", "--mapping", mapping, "--constant", "specimen=C")
    assert "specimen" in said.output
    assert "of MATLAB" not in said.output


def test_a_column_that_no_file_has_is_an_error(tmp_path: Path, mapping: Path):
    mapping.write_text(RIG.replace("AI2 =", "AI7 ="), "utf-8")
    with pytest.raises(ColumnError, match="the mapping names column 'AI7'"):
        read(write_rig(tmp_path / "rig"), mapping)


def test_a_broken_file_is_named_with_its_remedy_and_the_others_are_read(tmp_path, mapping):
    rig = write_rig(tmp_path / "rig")
    pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n"
    for name in ("x.csv", "y.mat", "z.tdms"):
        (rig / name).write_text(pointer, "utf-8")
    said = airmuscle("inspect", rig, "--mapping", mapping)
    shown = " ".join(said.output.split())
    assert said.exit_code == 0
    assert "Fetch them in the repository: git lfs pull" in shown
    assert "The same cause in 2 further files: y.mat, z.tdms" in shown
    assert "d.mat" in shown
    assert "4 recordings" in shown


def test_a_folder_without_a_mapping_is_answered_by_one_for_all(tmp_path: Path):
    rig = write_rig(tmp_path / "rig")
    target = tmp_path / "proposed.toml"
    said = airmuscle("inspect", rig, "--save-mapping", target)
    text = target.read_text("utf-8")
    assert '"data(:,2)" = "?"' in text
    assert f"--mapping {target}" in said.output.replace("\n", "")


def test_a_campaign_groups_its_refusals_by_cause(tmp_path: Path):
    rig = tmp_path / "rig"
    rig.mkdir()
    for i in range(5):
        (rig / f"run_{i}.csv").write_text("Weight,Colour\n1,2\n3,4\n", "utf-8")
    said = airmuscle("campaign", rig, "--out", tmp_path / "out")
    assert said.exit_code == 1
    assert "no file of the campaign could be read (5 text)" in said.stderr
    assert said.stderr.count("run_") == 1
