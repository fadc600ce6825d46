"""Run all benchmarks and write RESULTS.md beside this file; some minutes.

./run python benchmarks/run.py [--rounds-factor 1.0] [--print-only]
"""

from __future__ import annotations

import argparse
import os
import pathlib
import time
from collections.abc import Callable, Sequence

os.environ.setdefault(
    "OPENBLAS_NUM_THREADS", "1"
)  # before NumPy: a second thread that waits for a core slows both sides

import batch
import bootstrap
import components
import derivative
import growth
import identification
import memory
import mujoco_peer
import new_plant
import ode8
import peers
import rodas4
import sensitivities
import startup
import static_fit
from measure import Bar, Section, machine, show, table, today, versions

RESULTS = pathlib.Path(__file__).with_name("RESULTS.md")
SECTIONS: tuple[tuple[Callable[[int], Section], int], ...] = (
    (rodas4.section, 25),
    (peers.section, 9),
    (ode8.section, 15),
    (batch.section, 7),
    (mujoco_peer.section, 5),
    (derivative.section, 25),
    (components.section, 25),
    (growth.section, 7),
    (memory.section, 1),
    (sensitivities.section, 15),
    (identification.section, 3),
    (static_fit.section, 15),
    (bootstrap.section, 5),
    (new_plant.section, 7),
    (startup.section, 7),
)
HEAD = """# Measured

Written by `benchmarks/run.py` on {date}. {machine}. {versions}.

Variants are timed in turn in one process, quick ones several times in a round. Times are medians of the rounds, beside
them the least; ratios are medians of the ratios within a round; bars in seconds are held to the least, because
neighbours can only add. Errors stand beside speed. Linear algebra runs on one thread on all sides.
{seconds:.0f} s in all.
"""


def missed(bars: Sequence[Bar]) -> str:
    """One paragraph a reason, with the bars that it explains."""
    reasons: dict[str, list[str]] = {}
    for bar in bars:
        if not bar.held:
            reasons.setdefault(bar.why or "the reason is not known", []).append(bar.what)
    if not reasons:
        return "No bar was missed.\n"
    return "\n".join(f"Missed: {'; '.join(what)}. Why: {why}.\n" for why, what in reasons.items())


def report(sections: Sequence[Section], seconds: float) -> str:
    """RESULTS.md."""
    bars = [bar for section in sections for bar in section.bars]
    head = HEAD.format(date=today(), machine=machine(), versions=versions(), seconds=seconds)
    summary = table(("what", "measured", "bar", ""), [bar.cells for bar in bars])
    return "\n".join([head, "## Bars\n", summary, "", missed(bars), *(section.markdown() for section in sections)])


def main() -> None:
    """Measure, print as it goes, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds-factor", type=float, default=1.0, help="more rounds where the machine is busy")
    parser.add_argument("--print-only", action="store_true", help="leave RESULTS.md as it is")
    options = parser.parse_args()
    begun, sections = time.perf_counter(), []
    for section, rounds in SECTIONS:
        sections.append(section(max(1, round(rounds * options.rounds_factor))))
        show(sections[-1])
    if not options.print_only:
        RESULTS.write_text(report(sections, time.perf_counter() - begun), encoding="utf-8")


if __name__ == "__main__":
    main()
