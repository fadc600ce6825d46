"""Peak memory of a process after each of several tasks."""

from __future__ import annotations

import importlib.util

from measure import PRINT_PEAK_MEMORY, Section, print_section
from new_plant import MUSCLES, run_python

HEADER = ("after", "peak memory [MB]")
TEXT = (
    "Peak resident memory of one process, as reported by the operating system. A run stores its"
    " rows, eight bytes per state, and computes from them the columns of its Recording: time,"
    " states, outputs and inputs."
)
TASKS = {
    "Python and NumPy": "import numpy",
    "import airmuscle": "import airmuscle",
    "a run of 25 s, three states, 2501 rows": (
        """
from filling import hanging, FILL_DISCHARGE
from airmuscle import simulate
run = lambda output: simulate(hanging(), FILL_DISCHARGE, duration=25.0, output_times=output)
run(0.01)"""
    ),
    "the same with 1 000 000 rows": "long = run(25e-6)",
    f"a new plant of {MUSCLES} muscles": (
        """
from new_plant import compile_anew, many_muscles
plant = compile_anew(many_muscles())"""
    ),
}


def section(rounds: int = 1) -> Section:
    """The complete benchmark: all tasks in one process."""
    title = "Memory"
    if importlib.util.find_spec("resource") is None:
        return Section(
            title, "The operating system does not report the memory of a process.", HEADER, ()
        )
    code = "".join(f"{task}\n{PRINT_PEAK_MEMORY}" for task in TASKS.values())
    peaks = [float(line) for line in run_python(["-c", code]).split()]
    rows = tuple((name, f"{peak:.0f}") for name, peak in zip(TASKS, peaks, strict=True))
    return Section(title, TEXT, HEADER, rows)


if __name__ == "__main__":
    print_section(section())
