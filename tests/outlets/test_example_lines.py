"""The example lines of every `--help`: each is understood by its command and runs, with files that
the test makes and with smaller numbers where it would take long.
"""

from __future__ import annotations

import inspect
import json
import re
import shlex
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import bodies
import pytest
from command_line import airmuscle, command_names
from user_files import serial_rows, write_study, write_user_files

from airmuscle.outlets.cli import app

COMPARED = "--characteristic Sarosi2012 --characteristic Hunt2017"
SHORTER = {
    "--bootstrap 1000": "--bootstrap 20",
    "--starts 20": "--starts 2",
    "--simulations 20000": "--simulations 24",
    "--compare": f"--compare {COMPARED}",
    "--rules": "--rules --simulations 24",
    "--cluster scheduler.json": "--cluster scheduler.json --simulations 24",
    "--workers 8": "--workers 2",
    "--truth-seeds 101-108": "--truth-seeds 101",
    "--truth-seeds 1-200": "--truth-seeds 1-2 --spread 'mechanism.mass=20 %'",
    "fit-live": "fit-live --idle 0 --degree 2 --max-contraction 0.15",
    "--plugins": "",
}
"""Parts of lines, and what takes their place so that a line takes seconds."""
FURTHER = {
    "tune": "--draws 0 --loads '' --supplies ''",
    "fit-regulator": "--starts 1",
}
"""Further options of a command whose lines contain none of its shorter parts."""
CLUSTER = "tcp://head-node:8786"
SLOW = re.compile(
    r"reproduce|--cluster|campaign bench|fit-regulator|--to (?:fmu|ssp)|--build"
    r"|--starts 20|--workers|--rules|valve_study|--known|--separate|muscles/\*|site page"
)
QUICK = (
    "airmuscle reproduce saga hosovsky --out report",
    "airmuscle campaign bench --out identified",
    "airmuscle fit-regulator steps.csv sines.csv --supply",
    "airmuscle study examples/valve_study.toml --out study",
)
"""Beginnings of lines that would be slow by their command, of which one runs by default."""
SERVERS = ("airmuscle studio", "airmuscle studio dmsp-20-300 my/muscle.toml")
"""Lines that run until they are stopped."""

NOT_MADE = ("compare", "play", "route", "predict joint/")
"""Beginnings of lines whose files `user_files` does not make; tests of their commands run them."""


def example_lines() -> list[str]:
    lines = []
    for command in command_names():
        text = airmuscle(command, "--help", width=100).output.partition("Examples:")[2]
        block = text.strip("\n").partition("\n\n")[0]
        joined = re.sub(r"\n(?: +|(?=--))", " ", inspect.cleandoc(block))
        for line in joined.splitlines():
            lines += re.findall(r"airmuscle .*", line.partition("    (")[0].rstrip())
    return lines


def words_of(line: str) -> list[str]:
    """The arguments of the command of a line, without what a shell does with its output."""
    return shlex.split(re.split(r" >> ", line)[0])[1:]


LINES = example_lines()


def marks_of(line: str) -> list[pytest.MarkDecorator]:
    needs_mujoco = words_of(line)[0] in ("body", "fit-out")
    is_slow = SLOW.search(line) and not line.startswith(QUICK)
    marks = [pytest.mark.tool] if needs_mujoco or "--processor" in line else []
    return [*marks, pytest.mark.slow] if is_slow else marks


def shortened(line: str) -> str:
    """The line with smaller numbers, and with further options of its command."""
    for part, shorter in SHORTER.items():
        if part in line:
            return line.replace(part, shorter) + further(line)
    return line + further(line)


def further(line: str) -> str:
    command = words_of(line)[0]
    names = re.findall(r"--[\w-]+", FURTHER.get(command, ""))
    return "" if any(name in line for name in names) else f" {FURTHER.get(command, '')}"


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


def in_bar(text: str) -> str:
    """A record with its pressures [bar] under a heading without unit."""
    notes = [line for line in text.splitlines() if line.startswith("#")]
    heading, *rows = text.splitlines()[len(notes) :]
    names = heading.split(",")
    (place,) = (i for i, name in enumerate(names) if name.startswith("pressure"))
    names[place] = "pressure"
    cells = [row.split(",") for row in rows]
    for row in cells:
        row[place] = f"{float(row[place]) / 1e5:.9g}"
    return "\n".join([*notes, *map(",".join, [names, *cells])])


def prepare(line: str, folder: Path) -> None:
    """Write what a line needs beside the common files."""
    if "--unit pressure=bar" in line:  # the heading of this one names no unit
        path = folder / "bench.csv"
        path.write_text(in_bar(path.read_text(encoding="utf-8")), encoding="utf-8")
    write_study(words_of(line)[0], folder)


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
