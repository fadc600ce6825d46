"""The tutorials and explanations are true: their code runs from an empty folder, and shows the
printed output.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from page_code import PageRun, run_page


def is_shown(expected: str, found: str) -> bool:
    """Whether every line of a shown output is in what was printed, in order; an ellipsis stands for
    other lines, or for a part of one."""
    lines = iter(line.strip() for line in found.splitlines())
    shown = [
        ".*".join(map(re.escape, line.strip().split("...")))
        for line in expected.splitlines()
        if line.strip() != "..."
    ]
    return all(any(re.fullmatch(pattern, each) for each in lines) for pattern in shown)


def check(run: PageRun) -> None:
    assert run.outputs
    for expected, found in run.outputs:
        assert is_shown(expected, found), (
            f"the page shows\n{expected}\nand the code prints\n{found}"
        )


@pytest.mark.parametrize(
    "page",
    ["explanation/air-mass.md", "explanation/stiffness.md", "explanation/where-papers-err.md"],
)
def test_an_explanation_shows_the_numbers_that_its_code_prints(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)
    check(run_page(page, tmp_path))


def test_the_first_muscle(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    run = run_page("tutorials/first-muscle.md", tmp_path)
    check(run)
    assert (tmp_path / "chart" / "isobars.png").stat().st_size > 0


@pytest.mark.slow
def test_from_bench_to_report(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    check(run_page("tutorials/bench-to-report.md", tmp_path))
    assert (tmp_path / "fit" / "report.html").stat().st_size > 0
    assert (tmp_path / "lift" / "recording.csv").stat().st_size > 0


def test_the_first_joint(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    run = run_page("tutorials/joint.md", tmp_path)
    check(run)
    assert abs(run.names["controlled"]["angle"][-1] - 0.3) < 0.01


@pytest.mark.slow
def test_the_controller_on_a_microcontroller(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    run_page("tutorials/microcontroller.md", tmp_path)
    assert (tmp_path / "controller" / "pressure.h").stat().st_size > 0


@pytest.mark.slow
def test_from_episodes_to_a_controller(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    check(run_page("tutorials/episodes.md", tmp_path))
