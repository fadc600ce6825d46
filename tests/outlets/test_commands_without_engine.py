"""Without numba and llvmlite, the extra `sim`, a bench does all its work: it reads, checks, fits,
compares, predicts, sizes and reports. Whatever needs the engine ends with the sentence that
installs it, never with a traceback.

The example lines of the help texts run in one process, and its workers, in which neither package
can be imported or is installed.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest
from example_lines import LINES, prepare, shortened, words_of
from user_files import write_user_files

ROOT = Path(__file__).resolve().parents[2]
ENGINE = ("numba", "llvmlite")
SENTENCE = re.compile(
    r'^error: (simulation needs|the package mujoco).*: pip install "airmuscle\[(sim|mujoco)\]"\Z',
    re.MULTILINE,
)
"""The last line; a body needs MuJoCo before it needs the engine."""
BENCH = (
    *("list", "show", "diff", "cite", "evaluate", "inspect", "check", "recipe", "fit"),
    *("approximate", "convert", "hysteresis", "fit-volume", "campaign", "size", "cam", "schema"),
)
"""Commands that need no engine, whatever they are asked for."""
ENGINE_COMMANDS = ("fit-dynamic", "fit-regulator", "simulate", "study", "tune", "compare")
"""Commands that always simulate."""
SELECTED = (
    *("list", "show matrix-821", "diff dmsp-20-300 festo", "evaluate dmsp-20-300 --con"),
    *(
        "inspect log",
        "check run_07",
        "recipe --bore",
        "fit bench.csv --characteristic ContractileSurface --r",
    ),
    *(
        "fit runs/*.xlsx",
        "hysteresis loop1",
        "predict identified",
        "size --torque",
        "convert bench",
    ),
    *("fit-dynamic study.toml --out", "fit-joint episodes.npz", "plan vessel", "simulate joint"),
    *("study study.toml --w", "tune lift.toml --b", "compare pid.toml cascade.toml --rig"),
    *("export examples/fill_discharge.toml --to c", "fit-regulator", "export dmsp-20-300 --law"),
)
"""Beginnings of the lines that run by default: each command of a bench, and each of the engine."""
OMITTED = ("studio", "play", "route", "predict joint/")
"""Servers, and lines whose files no test makes."""
BLOCK = f"""
import importlib.metadata, sys
for name in {ENGINE}:
    sys.modules[name] = None  # an import of it is then a ModuleNotFoundError
packages = importlib.metadata.distributions
importlib.metadata.distributions = lambda **query: (
    package for package in packages(**query) if package.name not in {ENGINE}
)
"""
RUN = """
import json, os, shlex, shutil, sys
sys.path[:0] = [sys.argv[1]]
from command_line import airmuscle
if __name__ == "__main__":
    outcomes = {}
    for folder, line, words in json.load(sys.stdin):
        os.chdir(folder)
        result = airmuscle(*words, input="")
        failure = None if isinstance(result.exception, SystemExit) else repr(result.exception)
        outcomes[line] = [result.exit_code, failure or result.stderr]
    print(json.dumps(outcomes), file=sys.__stdout__)
"""


class Outcome(NamedTuple):
    """How a line ended: its exit code, and what it said on stderr."""

    exit_code: int
    said: str


def is_selected(line: str) -> bool:
    return line.startswith(tuple(f"airmuscle {beginning}" for beginning in SELECTED))


TRIED = [
    line
    for line in LINES
    if not line.startswith(tuple(f"airmuscle {beginning}" for beginning in OMITTED))
    and not any(word in line for word in ("cluster", "--follow", "inspect -"))
]


@pytest.fixture(scope="module")
def outcomes(
    tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest
) -> dict[str, Outcome]:
    """The outcome of each line that a test of this run asks for."""
    lines = [
        item.callspec.params["line"]
        for item in request.session.items
        if item.path == request.path and hasattr(item, "callspec")
    ]
    return run_without_engine(lines, tmp_path_factory.mktemp("blocked"))


def run_without_engine(lines: list[str], folder: Path) -> dict[str, Outcome]:
    (folder / "start").mkdir()
    (folder / "start" / "sitecustomize.py").write_text(BLOCK, encoding="utf-8")
    (folder / "run_lines.py").write_text(RUN, encoding="utf-8")
    made = folder / "made"
    made.mkdir()
    write_user_files(made)
    tasks = []
    for number, line in enumerate(lines):
        bench = folder / str(number)
        shutil.copytree(made, bench)
        prepare(line, bench)
        tasks.append((str(bench), line, words_of(shortened(line))))
    paths = [str(folder / "start"), *sys.path]
    done = subprocess.run(
        [sys.executable, folder / "run_lines.py", ROOT / "tests"],
        input=json.dumps(tasks),
        env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    outcomes = json.loads(done.stdout.splitlines()[-1])
    return {line: Outcome(*outcome) for line, outcome in outcomes.items()}


@pytest.mark.parametrize(
    "line",
    [pytest.param(line, marks=[] if is_selected(line) else pytest.mark.slow) for line in TRIED],
)
def test_a_command_works_or_says_what_to_install(line: str, outcomes: dict[str, Outcome]):
    outcome = outcomes[line]
    command = words_of(line)[0]
    if outcome.exit_code == 0:
        assert command not in ENGINE_COMMANDS
        return
    assert command not in BENCH, outcome.said
    assert outcome.exit_code == 1
    assert SENTENCE.search(outcome.said.strip()), outcome.said


def test_the_lines_of_the_default_run_have_all_commands_of_a_bench_and_of_the_engine():
    commands = {words_of(line)[0] for line in TRIED if is_selected(line)}
    slow_alone = {"cite", "approximate", "fit-volume", "campaign", "cam", "schema"}
    assert commands >= {*BENCH, *ENGINE_COMMANDS, "predict"} - slow_alone
