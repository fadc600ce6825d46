"""`airmuscle body`: table, JSON, report with the picture of the body, and messages of one line."""

from __future__ import annotations

import json
from pathlib import Path

import bodies
import pytest
from bodies import arm, written
from command_line import airmuscle

LEG = Path(__file__).parents[2] / "examples" / "air_leg.xml"


@pytest.fixture
def mujoco():
    return bodies.require_mujoco()


def test_without_mujoco_the_message_says_how_to_install_it(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "mujoco", None)
    result = airmuscle("body", written(tmp_path, arm()))
    assert result.exit_code == 1
    assert 'pip install "airmuscle[mujoco]"' in result.stderr


def test_a_dangerous_file_is_refused_before_mujoco_is_needed(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "mujoco", None)
    bomb = '<!DOCTYPE m [<!ENTITY a "ha">]><mujoco/>'
    result = airmuscle("body", written(tmp_path, bomb), "--out", tmp_path / "out")
    assert result.exit_code == 1
    assert "body.xml:1: the file has a document type" in result.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.tool
def test_the_leg_of_the_examples_has_no_fault_and_a_report(mujoco, tmp_path):
    result = airmuscle("body", LEG, "--out", tmp_path / "leg", "--json")
    assert result.exit_code == 0, result.output
    answer = json.loads(result.stdout)["body"]
    assert answer["number_of_faults"] == 0
    assert [row["route"] for row in answer["routes"]][:2] == ["hip_flexor", "hip_extensor"]
    page = (tmp_path / "leg" / "report.html").read_text(encoding="utf-8")
    assert "hip_extensor" in page
    assert (tmp_path / "leg" / "figures" / "body.png").stat().st_size > 10_000


@pytest.mark.tool
def test_faults_are_sentences_and_rows(mujoco, tmp_path):
    body = written(tmp_path, arm())
    result = airmuscle("body", body, "--positive", "arm=flexion", "--max-contraction", "2 %")
    assert result.exit_code == 0, result.output
    assert "wrong sign" in result.output
    assert "PROBLEM: arm_flexor: no muscle serves its stroke" in result.output


@pytest.mark.tool
@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--positive", "arm"), "'knee_R=extension'"),
        (("--positive", "leg=flexion"), "there is no joint"),
        (("--range", "arm"), "'knee=-60 deg..0 deg'"),
        (("--range", "arm=30 deg..10 deg"), "is not less than"),
        (("--range", "leg=0 deg..10 deg"), "there is no joint"),
        (("--leave-out", "arm_flexer"), "arm_flexor"),
        (("--max-contraction", "200 %"), "allowed range"),
        (("--routes", "none.toml"), "there is no such file"),
    ],
)
def test_wrong_options_are_named(arguments, words, mujoco, tmp_path):
    result = airmuscle("body", written(tmp_path, arm()), *arguments)
    assert result.exit_code in (1, 2)
    assert words in " ".join(result.output.split())


@pytest.mark.tool
def test_the_range_that_a_message_proposes_works(mujoco, tmp_path):
    body = written(tmp_path, arm(limits=""))
    result = airmuscle("body", body)
    assert result.exit_code == 1
    assert "--range 'arm=-30 deg..60 deg'" in result.stderr
    assert airmuscle("body", body, "--range", "arm=-20 deg..15 deg").exit_code == 0


@pytest.mark.tool
@pytest.mark.drawn
def test_the_body_is_drawn_where_mujoco_cannot_render(mujoco, tmp_path, monkeypatch):
    monkeypatch.setattr("airmuscle.design.body.picture._backend", lambda: "")
    result = airmuscle("body", LEG, "--out", tmp_path / "leg")
    assert result.exit_code == 0, result.output
    drawn = (tmp_path / "leg" / "figures" / "body.svg").read_text(encoding="utf-8")
    assert drawn.count("<path") > 20
