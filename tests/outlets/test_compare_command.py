"""`airmuscle compare`: report, tables and JSON of controllers on one plant, and one line for what is
impossible.
"""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from command_line import airmuscle

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "pressure_loop.toml"


@pytest.fixture
def files(tmp_path, monkeypatch):
    text = EXAMPLE.read_text("utf-8").replace('duration = "5 s"', 'duration = "0.3 s"')
    (tmp_path / "fast.toml").write_text(text, encoding="utf-8")
    slow = text.replace("1.5 1/bar", "0.3 1/bar")
    (tmp_path / "slow.toml").write_text(slow, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return ["fast.toml", "slow.toml"]


SPREAD = ["--spread", "mechanism.mass=20 %", "--truth-seeds", "1-2", "--workers", "1"]


def test_a_comparison_writes_its_report_tables_and_figures(files, tmp_path):
    result = airmuscle("compare", *files, *SPREAD)
    assert result.exit_code == 0, result.output
    assert "fast has the smallest rms error" in result.stdout
    written = {p.relative_to(tmp_path).as_posix() for p in (tmp_path / "comparison").rglob("*.*")}
    tables = ("ranking", "errors", "costs", "margins", "order", "truths", "metrics")
    assert {f"comparison/data/{name}.csv" for name in tables} <= written
    assert {"comparison/figures/errors.png", "comparison/figures/runs.svg"} <= written
    page = (tmp_path / "comparison" / "report.html").read_text(encoding="utf-8")
    first = page.index("fast has the smallest rms error")
    assert first < page.index("Ranking")


def test_json_contains_every_run_in_si_units(files):
    result = airmuscle("compare", *files, *SPREAD, "--json")
    content = json.loads(result.stdout)["compare"]
    assert [row["controller"] for row in content["ranking"]] == ["fast", "slow"]
    runs = [(row["controller"], row["plant"]) for row in content["metrics"]]
    plants = ("nominal", "truth 1", "truth 2")
    assert set(runs) == {(name, plant) for name in ("fast", "slow") for plant in plants}
    assert all(1e3 < row["rms_error"] < 1e5 for row in content["metrics"])
    assert {row["plant"] for row in content["truths"]} == {"truth 1", "truth 2"}


def test_truths_are_drawn_by_default_where_a_spread_is_stated(files):
    result = airmuscle("compare", "fast.toml", *SPREAD[:2], "--workers", "1", "--json")
    assert len(json.loads(result.stdout)["compare"]["truths"]) == 8


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--truth-seeds", "3"], "To state a range, use --spread 'mechanism.mass=20 %'."),
        (["--truth-seeds", "3-1", *SPREAD[:2]], "'3-1' is no seed and no range"),
        (["--spread", "mechanism.mas=20 %"], "Did you mean 'mechanism.mass'"),
        (["--begin", "1 s"], "begin is 1 s; allowed range: 0 to 0.3 s"),
    ],
)
def test_an_impossible_comparison_is_rejected_in_one_line(arguments, message, files, tmp_path):
    result = airmuscle("compare", *files, *arguments)
    assert result.exit_code == 1
    assert message in result.stderr
    assert result.stderr.count("\n") == 1
    assert not (tmp_path / "comparison").exists()


def test_spreads_without_truths_are_a_contradiction(files):
    result = airmuscle("compare", *files, *SPREAD[:2], "--truth-seeds", "")
    assert result.exit_code == 2
    assert "--spread and --delay need --truth-seeds" in result.stderr


def test_the_remedy_for_another_plant_works(files, tmp_path):
    text = (tmp_path / "slow.toml").read_text("utf-8").replace('"10 kg"', '"12 kg"')
    (tmp_path / "slow.toml").write_text(text, encoding="utf-8")
    refused = airmuscle("compare", *files)
    assert refused.exit_code == 1
    assert refused.stderr.endswith("use --rig SCENARIO.toml.\n")
    assert not (tmp_path / "comparison").exists()
    done = airmuscle("compare", *files, "--rig", "fast.toml")
    assert done.exit_code == 0, done.stderr
    assert "slow was written for another rig" in done.stdout
