"""What the README and the page of commands show is what runs; the files that the README points to are there."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from command_line import airmuscle

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


COMMANDS = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")


def blocks(language, text=README):
    return re.findall(rf"```{language}\n(.*?)```", text, flags=re.DOTALL)


def test_the_python_runs_and_is_ten_lines(tmp_path):
    (block,) = blocks("python")
    statements = [line for line in block.splitlines() if line and not line.startswith(("import", "from"))]
    assert len(statements) <= 10
    done = subprocess.run([sys.executable, "-c", block], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "rms error" in done.stdout
    assert "ISO 6358" in done.stdout


def commands():
    lines = [line.partition("#")[0].strip() for block in blocks("sh", COMMANDS) for line in block.splitlines()]
    served = "./run airmuscle studio"  # a server, which the tests of the studio start
    return [line for line in lines if line.startswith("./run airmuscle") and line != served]


@pytest.mark.parametrize(
    "command",
    [pytest.param(each, marks=[pytest.mark.slow] * (" study " in each)) for each in commands()],
    ids=lambda words: words,
)
def test_the_commands_run(command, tmp_path, monkeypatch):
    words = shlex.split(command)[2:]
    words = [str(ROOT / word) if word.startswith("examples/") else word for word in words]
    monkeypatch.chdir(tmp_path)
    done = airmuscle(*words)
    assert done.exit_code == 0, done.stderr


def test_the_files_it_points_to_are_there():
    for target in re.findall(r"\]\(([^)]+)\)", README):
        assert (ROOT / target).exists(), target
