"""Every command prints to every output: a character that its encoding lacks becomes a plain one,
and a closed output takes nothing; never a traceback.
"""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from command_line import command_names

from airmuscle import __main__ as entry_point
from airmuscle.outlets.cli.streams import plain

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
ENCODINGS = ("ascii", "latin-1", "cp1252", "cp932", "utf-8")
OUTPUTS = ("terminal", "file", "closed")
PRINTING = {
    "list": ("list",),
    "show": ("show", "borzikova-exponential"),
    "cite": ("cite", "borzikova-exponential"),
    "evaluate": ("evaluate", "dmsp-20-300", "--pressure", "3 bar", "--force", "100 N"),
    "evaluate in JSON": ("show", "borzikova-exponential", "--json"),
    "inspect": ("inspect", "bench.csv"),
    "size": ("size", "lift", "--mass", "10 kg", "--stroke", "20 mm", "--max-pressure", "6 bar"),
    "schema": ("schema",),
    "wrong usage": ("evaluate", "dmsp-20-300", "--presure", "1 µbar"),
    "refused": ("inspect", "Überlast – μ.csv"),
    **{
        f"{command}, refused": (command, "α–β≤γ.csv")
        for command in command_names()
        if command != "studio"
    },
}
BENCH = "time [s];pressure [kPa];Kraft Δ µ [N];length [mm]\n" + "".join(
    f"{0.1 * i:.1f};{100 + i};{50 + i};{300 - i}\n" for i in range(12)
)


class Terminal(io.TextIOWrapper):
    """A text stream that says it is a terminal."""

    def isatty(self) -> bool:
        return True


class Run:
    """A command in this process, with outputs of one kind and encoding."""

    def __init__(self, patch: pytest.MonkeyPatch, encoding: str, kind: str) -> None:
        self.written = {name: io.BytesIO() for name in ("stdout", "stderr")}
        self.encoding = encoding
        make = Terminal if kind == "terminal" else io.TextIOWrapper
        for name, written in self.written.items():
            stream = None if kind == "closed" else make(written, encoding=encoding)
            patch.setattr(sys, name, stream)

    def __call__(self, patch: pytest.MonkeyPatch, arguments: tuple[str, ...]) -> int:
        patch.setattr(sys, "argv", ["airmuscle", *arguments])
        with pytest.raises(SystemExit) as ended:
            entry_point.main()
        for name in self.written:
            getattr(sys, name).flush()
        return int(ended.value.code or 0)

    def text(self, name: str) -> str:
        return self.written[name].getvalue().decode(self.encoding)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a record, in which the commands run."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "nonsense")
    monkeypatch.setenv("COLUMNS", "100")
    (tmp_path / "bench.csv").write_text(BENCH, encoding="utf-8")
    return tmp_path


def lines_of(arguments: tuple[str, ...], encoding: str, kind: str) -> tuple[int, str, str]:
    with pytest.MonkeyPatch.context() as patch:
        run = Run(patch, encoding, kind)
        code = run(patch, arguments)
        written = {name: run.text(name) for name in run.written}
        return code, written["stdout"], written["stderr"]


@pytest.mark.parametrize("arguments", PRINTING.values(), ids=PRINTING)
def test_a_command_prints_the_same_to_every_output(arguments: tuple[str, ...]):
    """In ASCII all that is printed is the plain form of the text in UTF-8; other encodings lie
    between; a closed output changes no exit code.
    """
    code, text, messages = lines_of(arguments, "utf-8", "file")
    for encoding in ENCODINGS:
        for kind in OUTPUTS:
            said = lines_of(arguments, encoding, kind)
            assert said[0] == code
            if kind == "closed":
                assert said[1:] == ("", "")
            elif text.startswith("{"):
                assert json.loads(said[1]) == json.loads(text)
            elif kind == "file":
                assert plain(said[1]) == plain(text)
                assert plain(said[2]) == plain(messages)
                assert encoding != "ascii" or (said[1] + said[2]).isascii()


@pytest.mark.parametrize("command", command_names())
def test_a_help_text_is_ascii(command: str):
    """Typer prints it, in UTF-8 where ASCII is asked for."""
    code, text, _ = lines_of((command, "--help"), "ascii", "file")
    assert (code, text.isascii()) == (0, True)


def test_symbols_become_similar_ones():
    assert (
        plain("─── 5 µm ± 2 °, Δα ≤ 3 N·s·m⁻¹, x² – ½")
        == "--- 5 um +/- 2 deg, Deltaalpha <= 3 N*s*m^-1, x^2 - 1/2"
    )
    assert plain("Borzíková, Größe, 中") == "Borzikova, Grosse, \\u4e2d"


def environment(**variables: str) -> dict[str, str]:
    return {**os.environ, "PYTHONUTF8": "0", "MPLBACKEND": "nonsense", **variables}


def test_processes_with_another_encoding_and_without_output(tmp_path: Path):
    command: list[Any] = [sys.executable, "-m", "airmuscle", "list"]
    encoded = subprocess.run(
        command, env=environment(PYTHONIOENCODING="cp1252"), capture_output=True
    )
    assert (encoded.returncode, encoded.stderr) == (0, b"")
    assert "Borzíková" in encoded.stdout.decode("cp1252")
    if os.name != "nt":
        closed = subprocess.run(
            ["sh", "-c", '"$0" "$@" >&-', sys.executable, "-m", "airmuscle", "evaluate",
             "dmsp-20-300", "--pressure", "3 bar", "--force", "100 N", "--out", "chart"],
            env=environment(), stderr=subprocess.PIPE, cwd=tmp_path,
        )  # fmt: skip
        assert (closed.returncode, closed.stderr) == (0, b"")
        assert (tmp_path / "chart" / "isobars.png").stat().st_size > 1000
