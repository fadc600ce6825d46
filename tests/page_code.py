"""Code of a documentation page, run in order as a reader does: files, Python, commands, and the
output that the page shows.

A `toml` block whose first line is a comment with a file name becomes that file. A `text` block
behind Python is the output of it, a `text` block behind commands is a part of theirs.
"""

from __future__ import annotations

import contextlib
import io
import re
import shlex
import shutil
import subprocess
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from command_line import airmuscle

from airmuscle.errors import AirmuscleWarning

DOCS = Path(__file__).parents[1] / "docs"
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


class PageRun(NamedTuple):
    """Result of the code of a page: the names that its Python leaves, and (expected, found) of each
    shown output.
    """

    names: dict[str, Any]
    outputs: list[tuple[str, str]]


def blocks(page: str) -> list[tuple[str, str]]:
    """(language, text) of all blocks of a page."""
    return BLOCK.findall((DOCS / page).read_text(encoding="utf-8"))


def run_page(page: str, folder: Path, **names: Any) -> PageRun:
    """Run all blocks of a page in a folder, which must be the working directory."""
    found: dict[str, Any] = {"__name__": "__main__", **names}
    outputs: list[tuple[str, str]] = []
    printed = ""
    for language, text in blocks(page):
        if language == "python":
            printed = run_python(text, page, found)
        elif language == "toml":
            write_file(text, folder)
        elif language == "sh":
            printed = "".join(run_command(line) for line in command_lines(text))
        elif language == "text":
            outputs.append((text.strip(), printed))
    return PageRun(found, outputs)


def run_python(text: str, page: str, names: dict[str, Any]) -> str:
    """Run a block of Python; returns what it prints."""
    output = io.StringIO()
    with contextlib.redirect_stdout(output), warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)
        exec(compile(text, page, "exec", dont_inherit=True), names)
    return output.getvalue()


def write_file(text: str, folder: Path) -> None:
    """Write a block whose first line names a file; other blocks are parts of files."""
    named = re.match(r"# (\w[\w./-]*\.toml)\n", text)
    if named:
        (folder / named[1]).write_text(text, encoding="utf-8")


def command_lines(text: str) -> Iterator[str]:
    """Commands of a block without their comments; a backslash continues a line."""
    for line in text.replace("\\\n", " ").splitlines():
        command = re.sub(r"\s+# .*$", "", line).strip()
        if command:
            yield command


def run_command(line: str) -> str:
    """Run a command; those of airmuscle in this process, others in a shell if their program is
    installed.
    """
    words = shlex.split(line)
    if words[0] == "airmuscle":
        done = airmuscle(*words[1:])
        assert done.exit_code == 0, f"{line}: {done.stderr}"
        return done.stdout
    if "cc " in line and shutil.which("cc") is None:
        return ""
    finished = subprocess.run(line, shell=True, capture_output=True, text=True)
    assert finished.returncode == 0, f"{line}: {finished.stderr}"
    return finished.stdout
