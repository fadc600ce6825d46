"""The example lines of every `--help`: each is understood by its command and runs, with files that
the test makes and with smaller numbers where it would take long.
"""

from __future__ import annotations

import json
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import bodies
import pytest
from command_line import airmuscle, command_names
from example_lines import LINES, NOT_MADE, SERVERS, prepare, shortened, words_of
from user_files import serial_rows, write_user_files

from airmuscle.outlets.cli import app

CLUSTER = "tcp://head-node:8786"
SLOW = re.compile(
    r"reproduce|--cluster|campaign bench|fit-regulator|--to (?:fmu|ssp)|--build"
    r"|--starts 20|--workers|--rules|valve_study|--known|--separate|muscles/\*|site page my"
)
QUICK = (
    "airmuscle reproduce saga hosovsky --out report",
    "airmuscle campaign bench --out identified",
    "airmuscle fit-regulator steps.csv sines.csv --supply",
    "airmuscle study examples/valve_study.toml --out study",
)
"""Beginnings of lines that would be slow by their command, of which one runs by default."""


def marks_of(line: str) -> list[pytest.MarkDecorator]:
    needs_mujoco = words_of(line)[0] in ("body", "fit-out")
    is_slow = SLOW.search(line) and not line.startswith(QUICK)
    marks = [pytest.mark.tool] if needs_mujoco or "--processor" in line else []
    return [*marks, pytest.mark.slow] if is_slow else marks


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the files of a user."""
    folder = tmp_path_factory.mktemp("made")
    write_user_files(folder)
    return folder


@pytest.fixture(scope="module")
def cluster() -> Iterator[str]:
    """The address of a cluster of one worker."""
    distributed = pytest.importorskip("distributed")
    quiet = {"dashboard_address": None, "worker_dashboard_address": None}
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, **quiet) as local:
        yield local.scheduler_address


@pytest.fixture
def bench(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the files, in which a line runs."""
    folder = tmp_path / "bench"
    shutil.copytree(made, folder)
    monkeypatch.chdir(folder)
    return folder


def test_there_are_example_lines_of_every_command():
    assert {words_of(line)[0] for line in LINES} >= set(command_names())


def test_every_command_has_a_line_that_runs_by_default():
    by_default = {
        words_of(line)[0]
        for line in LINES
        if not any(mark.name == "slow" for mark in marks_of(line))
    }
    assert by_default >= set(command_names())


@pytest.mark.parametrize("line", LINES)
def test_an_example_line_is_understood(line: str):
    """By the parser of its command, whose options it names."""
    command, *words = words_of(line)
    context = app.make_context("airmuscle", [command], resilient_parsing=True)
    parsed = app.get_command(context, command).make_context(command, list(words))
    assert parsed.args == []


@pytest.mark.filterwarnings("ignore::airmuscle.errors.AirmuscleWarning")
@pytest.mark.parametrize(
    "line",
    [
        pytest.param(line, marks=marks_of(line))
        for line in LINES
        if line not in SERVERS and not line.startswith(tuple(f"airmuscle {x}" for x in NOT_MADE))
    ],
)
def test_an_example_line_runs(line: str, bench: Path, request: pytest.FixtureRequest):
    if words_of(line)[0] in ("body", "fit-out"):
        bodies.require_mujoco()
    if "--processor" in line and shutil.which("qemu-system-arm") is None:
        pytest.skip("needs the emulator QEMU")
    prepare(line, bench)
    if CLUSTER in line or "scheduler.json" in line:
        address = request.getfixturevalue("cluster")
        (bench / "scheduler.json").write_text(json.dumps({"address": address}), encoding="utf-8")
        line = line.replace(CLUSTER, address)
    record = (bench / "bench.csv").read_text(encoding="utf-8")
    standard_input = serial_rows() if "--follow -" in line else record
    result = airmuscle(*words_of(shortened(line)), input=standard_input)
    assert result.exit_code == 0, result.output


@pytest.mark.parametrize("line", SERVERS)
def test_the_studio_runs_until_it_is_stopped(line: str, bench: Path):
    words = [*words_of(line), "--port", "0", "--no-browser"]
    command = [sys.executable, "-m", "airmuscle", *words]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT) as server:
        assert server.stdout is not None
        assert b"http://" in server.stdout.readline()
        server.send_signal(signal.SIGINT)
        server.communicate(timeout=30)
    assert server.returncode in (0, 130)
