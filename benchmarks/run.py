"""Run of all benchmarks, which takes some minutes; writes RESULTS.md to this folder.

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
)  # must precede the import of NumPy; a second thread that waits for a core slows all variants

import batch
import body_sweep
import bootstrap
import calls
import components
import control_tools
import controllers
import derivative
import environments
import growth
import identification
import learning
import live
import loops
import memory
import model_comparison
import mujoco_peer
import new_plant
import ode8
import outlets
import peers
import rig_day
import rodas4
import sensitivities
import startup
import static_fit
import studio_latency
from measure import (
    Section,
    Target,
    describe_machine,
    package_versions,
    print_section,
    table,
    today,
    yardstick,
)

RESULTS = pathlib.Path(__file__).with_name("RESULTS.md")
SECTIONS: tuple[tuple[Callable[[int], Section], int], ...] = (
    (calls.section, 25),
    (rodas4.section, 25),
    (peers.section, 9),
    (ode8.section, 15),
    (batch.section, 7),
    (batch.section_of_widths, 7),
    (loops.section, 3),
    (mujoco_peer.section, 5),
    (derivative.section, 25),
    (components.section, 25),
    (growth.section, 7),
    (memory.section, 1),
    (sensitivities.section, 15),
    (identification.section, 3),
    (static_fit.section, 15),
    (live.section, 1),
    (controllers.section, 20),
    (control_tools.section, 5),
    (environments.section, 9),
    (learning.section, 9),
    (bootstrap.section, 5),
    (body_sweep.section, 1),
    (model_comparison.section, 3),
    (outlets.section, 1),
    (new_plant.section, 7),
    (startup.section, 7),
    (rig_day.section, 5),
    (studio_latency.section, 1),
)
HEAD = """# Benchmark results

Written by `benchmarks/run.py` on {date}. {machine}. {versions}.

All variants are timed in one process, in each round once and in random order, fast ones several times per round and
after a call that is not timed: the first call after another variant takes up to half longer, because it fills the
caches of the processor again. The tables state the median and the minimum of the rounds; ratios are medians of the
ratios within a round. Times of targets are minima, because other load can only increase a time, and are compared in
yardsticks: y is a step of an oscillator in Python, the least of this run, {yardstick:.3g} us. Each table also states the
errors. Linear algebra uses one thread in all variants.
Total time {seconds:.0f} s.
"""  # noqa: E501


def describe_missed(targets: Sequence[Target]) -> str:
    """The missed targets, one paragraph per reason."""
    reasons: dict[str, list[str]] = {}
    for target in targets:
        if not target.met:
            reasons.setdefault(target.reason or "not known", []).append(target.name)
    if not reasons:
        return "No target was missed.\n"
    return "\n".join(
        f"Missed: {'; '.join(names)}. Reason: {reason}.\n" for reason, names in reasons.items()
    )


def report(sections: Sequence[Section], seconds: float) -> str:
    """The text of RESULTS.md."""
    targets = [target for section in sections for target in section.targets]
    head = HEAD.format(
        date=today(),
        machine=describe_machine(),
        versions=package_versions(),
        yardstick=yardstick() * 1e6,
        seconds=seconds,
    )
    summary = table(("quantity", "measured", "target", ""), [target.cells for target in targets])
    return "\n".join(
        [
            head,
            "## Targets\n",
            summary,
            "",
            describe_missed(targets),
            *(section.markdown() for section in sections),
        ]
    )


def main() -> None:
    """Run and print each benchmark, then write RESULTS.md."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--rounds-factor",
        type=float,
        default=1.0,
        help="factor of the number of rounds, for a busy machine",
    )
    parser.add_argument("--print-only", action="store_true", help="do not write RESULTS.md")
    options = parser.parse_args()
    start = time.perf_counter()
    sections = []
    for section, rounds in SECTIONS:
        sections.append(section(max(1, round(rounds * options.rounds_factor))))
        print_section(sections[-1])
    if not options.print_only:
        RESULTS.write_text(report(sections, time.perf_counter() - start), encoding="utf-8")


if __name__ == "__main__":
    main()
