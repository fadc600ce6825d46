"""Memory: what a process holds at its peak after each of a few tasks, one after the other."""

from __future__ import annotations

import importlib.util

from measure import PEAK, Section, show
from new_plant import MUSCLES, process

HEADING = ("after", "peak so far [MB]")
TEXT = (
    "Resident memory of one process at its peak, as the system tells it. A run keeps its rows, eight bytes a state, "
    "and makes from them the columns of its Recording: time, states, outputs and inputs."
)
TASKS = {
    "Python and NumPy": "import numpy",
    "import airmuscle": "import airmuscle",
    "a run of 25 s, three states, 2501 rows": """
from filling import hanging, FILL_DISCHARGE
from airmuscle import simulate
run = lambda output: simulate(hanging(), FILL_DISCHARGE, duration=25.0, output=output)
run(0.01)""",
    "the same with 1 000 000 rows": "long = run(25e-6)",
    f"a new plant of {MUSCLES} muscles": "from new_plant import fresh, many_muscles\nplant = fresh(many_muscles())",
}


def section(rounds: int = 1) -> Section:
    """All tasks, in one process."""
    title = "Memory"
    if importlib.util.find_spec("resource") is None:
        return Section(title, "This system does not tell a process what it holds.", HEADING, ())
    code = "".join(f"{task}\n{PEAK}" for task in TASKS.values())
    peaks = [float(line) for line in process(["-c", code]).split()]
    rows = tuple((name, f"{peak:.0f}") for name, peak in zip(TASKS, peaks, strict=True))
    return Section(title, TEXT, HEADING, rows)


if __name__ == "__main__":
    show(section())
