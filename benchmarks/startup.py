"""Time from process start to the first result: library and command line, with warm and cold
cache.
"""

from __future__ import annotations

import pathlib
import sys
import sysconfig
import tempfile
from collections.abc import Callable

from measure import Section, Target, format_time, print_section, time_variants
from new_plant import run_python

HEADER = ("process", "median", "minimum")
TEXT = (
    "Complete processes from start to end, with cached bytecode as after an installation. Warm: the"
    " machine code of the kernels is cached. Cold: the cache is empty, and a message on stderr"
    " announces the compilation of the kernels. The library builds a plant with three states from a"
    " muscle of its library, computes its equilibrium and simulates 25 s. `airmuscle` is the"
    " installed entry point."
)
SIMULATE = """
import airmuscle as am
valve = am.Valve(conductance=2.6167e-9, critical_ratio=0.433)
circuit = am.FillDischarge(am.Supply(548675.0), valve, valve)
plant = am.Plant(am.load("dmsp-20-300").muscle, circuit, am.HangingMass(10.0))
am.simulate(plant, am.Schedule({"fill": ((5, 1), (15, 0)), "discharge": ((19, 1),)}), duration=25.0)
"""
REASON = (
    "import of NumPy (0.1 s), declaration of the models (0.1 s), import of LLVM,"
    " compilation of the plant (0.15 s)"
)
EVALUATE = ["evaluate", "chou-hannaford", "--pressure", "3 bar", "--force", "100 N"]


def program() -> list[str]:
    """The installed program, or its module if the package is not installed."""
    script = pathlib.Path(sysconfig.get_path("scripts")) / "airmuscle"
    return [str(script)] if script.exists() else ["-m", "airmuscle"]


def simulate_cold() -> None:
    """Run a simulation with an empty cache."""
    with tempfile.TemporaryDirectory() as folder:
        run_python(["-c", SIMULATE], folder)


def section(rounds: int = 7, cold_rounds: int = 3) -> Section:
    """The complete benchmark."""
    variants: dict[str, Callable[[], None]] = {
        "python -c pass": lambda: run_python(["-c", "pass"]),
        "import numpy": lambda: run_python(["-c", "import numpy"]),
        "import airmuscle": lambda: run_python(["-c", "import airmuscle"]),
        "import airmuscle, simulate 25 s, warm": lambda: run_python(["-c", SIMULATE]),
        "airmuscle list": lambda: run_python([*program(), "list"]),
        f"airmuscle {' '.join(EVALUATE)}": lambda: run_python([*program(), *EVALUATE]),
    }
    times = time_variants(variants, rounds)
    times |= time_variants({"import airmuscle, simulate 25 s, cold": simulate_cold}, cold_rounds)
    start, _, importing, library, listing, solving, compiling = [t.minimum for t in times.values()]
    targets = (
        Target("`import airmuscle` beyond an interpreter", importing - start, 0.005, "s"),
        Target("first result, library, warm", library, 0.7, "s", reason=REASON),
        Target("first result, `airmuscle list`", listing, 0.2, "s"),
        Target("first result, `airmuscle evaluate`", solving, 0.3, "s"),
        Target("first result, library, cold", compiling, 5.0, "s"),
    )
    rows = tuple((name, format_time(t.median), format_time(t.minimum)) for name, t in times.items())
    return Section("Process start to first result", TEXT, HEADER, rows, targets)


if __name__ == "__main__":
    print_section(section())
    sys.exit()
