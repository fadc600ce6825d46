"""The example lines of every `--help`: each is understood by its command; each whose files are
those of the project, or a muscle and a record, runs.
"""

from __future__ import annotations

import inspect
import re
import shlex
import shutil
from pathlib import Path

import pytest
from command_line import airmuscle, command_names

from airmuscle import load as load_muscle
from airmuscle import load_data, save, write
from airmuscle.outlets.cli import app

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
LONG = ("reproduce", "benchmark", "study", "tune", "campaign")
"""Commands whose examples take minutes; their own tests run them with smaller numbers."""
COMPILED = ("--build", "--to fmu", "--to ssp")
"""Parts of lines that need a compiler, which tests of exports have."""
WAITING = ("fit-live", "studio")
"""Commands that run until they are stopped."""
MADE = ("bench.csv", "my/muscle.toml", "fit/muscle.toml", "dmsp-20-300")
"""Files of a user that the fixture makes, and entries of the library. Bodies (.xml) need MuJoCo: the
tests of the body run them."""


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


def is_run(line: str) -> bool:
    command = words_of(line)[0]
    if command in WAITING:
        return "--export" in line
    if command in LONG or any(part in line for part in COMPILED):
        return False
    files = [
        word
        for word in words_of(line)
        if re.search(r"\*|/$|\.(csv|toml|mat|npz|tdms|h5|xml)$", word)
    ]
    return all(
        word in MADE or word.startswith("examples/") or line.endswith(f"--out {word}")
        for word in files
    ) and not (command.startswith("fit-") or command == "hysteresis")


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the files of a user."""
    folder = tmp_path_factory.mktemp("bench")
    shutil.copytree(EXAMPLES, folder / "examples")
    write(load_data("dmsp-20-300"), folder / "bench.csv")
    for name in ("my", "fit"):
        (folder / name).mkdir()
        save(load_muscle("dmsp-20-300").muscle, folder / name / "muscle.toml")
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


def test_there_are_example_lines_of_every_command():
    assert {words_of(line)[0] for line in LINES} >= set(command_names())


@pytest.mark.parametrize("line", LINES)
def test_an_example_line_is_understood(line: str):
    """By the parser of its command, whose options it names."""
    command, *words = words_of(line)
    context = app.make_context("airmuscle", [command], resilient_parsing=True)
    parsed = app.get_command(context, command).make_context(command, list(words))
    assert parsed.args == []


@pytest.mark.parametrize("line", [line for line in LINES if is_run(line)])
def test_an_example_line_runs(line: str, bench: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(bench)
    text = (bench / "bench.csv").read_text(encoding="utf-8")
    if "--unit pressure=bar" in line:  # the heading of this one names no unit
        (bench / "plain.csv").write_text(in_bar(text), encoding="utf-8")
        line = line.replace("bench.csv", "plain.csv")
    result = airmuscle(*words_of(line), input=text)
    assert result.exit_code == 0, result.output
