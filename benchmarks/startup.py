"""From the start of a process to its first result: the library and the command line, with a full and an empty cache."""

from __future__ import annotations

import pathlib
import sys
import sysconfig
import tempfile
from collections.abc import Callable

from measure import Bar, Section, interleaved, of_time, show
from new_plant import process

HEADING = ("what", "median", "least")
TEXT = (
    "Whole processes, from their start to their end, with Python's own bytecode kept as after an installation. Warm: "
    "the kernels' machine code is kept. Cold: its folder is empty, and a line on stderr says that kernels are being "
    "compiled. The library makes a plant of three states around one of its muscles, finds its rest and simulates 25 s. "
    "`airmuscle` is the entry point as installed."
)
SIMULATE = """
import airmuscle as am
valve = am.Valve(conductance=2.6167e-9, critical_ratio=0.433)
circuit = am.FillDischarge(am.Supply(548675.0), valve, valve)
plant = am.Plant(am.load("dmsp-20-300").muscle, circuit, am.HangingMass(10.0))
am.simulate(plant, am.Schedule({"fill": ((5, 1), (15, 0)), "discharge": ((19, 1),)}), duration=25.0)
"""
WHY = "NumPy starts (0.1 s), the models are declared (0.1 s), CasADi and LLVM start and the plant is compiled (0.15 s)"
SOLVE = ["solve", "chou-hannaford", "--pressure", "3 bar", "--force", "100 N"]


def command() -> list[str]:
    """The installed program, or its module where the package is only on the path."""
    script = pathlib.Path(sysconfig.get_path("scripts")) / "airmuscle"
    return [str(script)] if script.exists() else ["-m", "airmuscle"]


def cold() -> None:
    """A simulation with an empty cache."""
    with tempfile.TemporaryDirectory() as folder:
        process(["-c", SIMULATE], folder)


def section(rounds: int = 7, cold_rounds: int = 3) -> Section:
    """All of it."""
    variants: dict[str, Callable[[], None]] = {
        "python -c pass": lambda: process(["-c", "pass"]),
        "import airmuscle": lambda: process(["-c", "import airmuscle"]),
        "import airmuscle, simulate 25 s, warm": lambda: process(["-c", SIMULATE]),
        "airmuscle list": lambda: process([*command(), "list"]),
        f"airmuscle {' '.join(SOLVE)}": lambda: process([*command(), *SOLVE]),
    }
    times = interleaved(variants, rounds)
    times |= interleaved({"import airmuscle, simulate 25 s, cold": cold}, cold_rounds)
    library, listing, solving, compiling = [t.least for t in times.values()][2:]
    bars = (
        Bar("first result, library, warm", library, 0.7, "s", why=WHY),
        Bar("first result, `airmuscle list`", listing, 1.0, "s"),
        Bar("first result, `airmuscle solve`", solving, 1.0, "s"),
        Bar("first result, library, cold", compiling, 5.0, "s"),
    )
    rows = tuple((name, of_time(t.median), of_time(t.least)) for name, t in times.items())
    return Section("Process start to first result", TEXT, HEADING, rows, bars)


if __name__ == "__main__":
    show(section())
    sys.exit()
