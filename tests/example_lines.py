"""Example lines of every `--help`, and how a test runs them: with files of its own and with smaller
numbers where a line would take long.
"""

from __future__ import annotations

import inspect
import re
import shlex
from pathlib import Path

from command_line import airmuscle, command_names
from user_files import write_study

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
    "watch": "--idle '0.1 s'",
}
"""Further options of a command whose lines contain none of its shorter parts."""
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
