"""Text files that are no tables, or monstrous ones, are read or refused within the limits of other
formats, also without the separate process in which larger files are read.

Each file of the greatest size for which this holds is read in a process of its own, with a quarter
of the memory and the time that the separate process has.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from widths import widened

SIZE = 4_000_000
"""Size [bytes] above which text is read in the separate process (test_every_reader.py)."""
MEMORY = 500_000_000
CPU_SECONDS = 15
"""Time of a processor, twice what the slowest takes on a slow core."""
MONSTERS = {
    "lines of one digit": "force [N]\n" + "1\n" * (SIZE // 2 - 5),
    "lines of one letter": "x\n" * (SIZE // 2),
    "an open quotation mark": 'time,force\n"' + "x\n" * (SIZE // 2),
    "one line": "a" * SIZE,
    "one row of commas": "time,force\n" + "," * SIZE,
    "a wide table": ",".join("c" * 9 for _ in range(100_000)) + "\n" + ",1.5" * (SIZE // 4),
    "lines of blanks": "time,force\n" + "\n" * SIZE,
    "comments": "time,force\n" + "#\n" * (SIZE // 2),
    "binary": "\x00\x01" * (SIZE // 2),
}
LONGEST = ("lines of one digit", "lines of one letter", "an open quotation mark")
"""Files of 2 million lines, whose reading takes some seconds."""
READ = """
import resource, sys, warnings
import airmuscle as am
from airmuscle.errors import AirmuscleError
warnings.simplefilter("ignore")
am.bench.read_csv  # imported before the limits
seconds, memory = map(int, sys.argv[2:])
used = resource.getrusage(resource.RUSAGE_SELF)
present = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (present + memory, present + memory))
resource.setrlimit(resource.RLIMIT_CPU, (int(used.ru_utime) + 1 + seconds,) * 2)
try:
    print(len(am.bench.read(sys.argv[1])), "rows")
except AirmuscleError as error:
    print(type(error).__name__, error)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="limits of memory as Linux has them")
@pytest.mark.parametrize("name", widened(MONSTERS, lambda name: name not in LONGEST))
def test_a_monstrous_text_is_read_or_refused_within_its_limits(name: str, tmp_path: Path):
    path = tmp_path / "monster.csv"
    path.write_text(MONSTERS[name][:SIZE], encoding="utf-8")
    command = [sys.executable, "-c", READ, str(path), str(CPU_SECONDS), str(MEMORY)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-500:]
    if name == "lines of one digit":
        assert "rows" in done.stdout
    else:
        assert "Error monster.csv" in done.stdout
