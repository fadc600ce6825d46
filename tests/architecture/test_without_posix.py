"""What Windows lacks is not needed: without fcntl, resource, termios, os.getuid and a console of
UTF-8 the commands of a bench work, and write texts with LF.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import airmuscle as am
from airmuscle.bench import write

WINDOWS = """
import os, sys
for name in ("fcntl", "resource", "termios", "pwd", "grp"):
    sys.modules[name] = None
for name in ("getuid", "geteuid", "fchmod", "O_NOFOLLOW"):
    if hasattr(os, name):
        delattr(os, name)
from airmuscle.__main__ import main
main()
"""


@pytest.mark.parametrize(
    "words",
    [
        "list",
        "evaluate dmsp-20-300 --contraction 0.1 --force 100N",
        "inspect bench.csv --out out",
        "fit bench.csv --characteristic dmsp-20-300 --out out",
    ],
)
def test_a_command_works_without_what_windows_lacks(words: str, tmp_path: Path):
    write(am.load_data("dmsp-20-300"), tmp_path / "bench.csv")
    done = subprocess.run(
        [sys.executable, "-c", WINDOWS, *words.split()],
        cwd=tmp_path,
        env={**os.environ, "PYTHONIOENCODING": "cp1252", "PYTHONUTF8": "0"},
        capture_output=True,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    texts = [path for path in tmp_path.rglob("out/**/*") if path.suffix in (".html", ".toml")]
    assert ("--out" in words) == bool(texts)
    assert not any(b"\r\n" in path.read_bytes() for path in texts)
