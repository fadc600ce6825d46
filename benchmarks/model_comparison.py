"""Model comparison, bootstrap and friction identification on synthetic measurements of a rig."""

from __future__ import annotations

import os
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from measure import Section, Target, format_time, print_section
from new_plant import run_python
from rig_files import write_files
from startup import program

import airmuscle as am
from airmuscle.bench import find_loops, fit_loop
from airmuscle.bench.statics.candidates import blank_surface

LENGTHS = (0.15, 0.2, 0.3)
"""Resting lengths [m] of the muscles (chosen)."""
END_LENGTH = 0.02
"""Length [m] of the ends of every muscle, which do not contract (chosen)."""
POINTS = tuple((length, held) for length in (0.2, 0.3) for held in (0.0, 0.06, 0.12, 0.18))
"""Resting length [m] and held contraction of the runs of the bootstrap (chosen)."""
MAX_PRESSURE = 6e5
NOISE = {"pressure": 300.0, "contraction": 2e-4, "force": 2.0}
"""Standard deviations of the sensors [SI] (chosen)."""
TWO = "two processes"
REASON = (
    "the comparison fits 17 laws to up to seven groups of files, of which the command shares the"
    " work among the cores"
)
HEADER = ("task", "time", "CPU time", "result")
TEXT = (
    "Synthetic sweeps of pressure, up and down, of braided muscles by Tondu and Lopez (2000) with"
    " rigid ends, with noise of the sensors (2 N, 300 Pa, 0.02 % contraction). 24 files: three"
    " resting lengths, four held contractions, two repeats, 500 rows each. Six sweeps: one muscle,"
    " 800 rows each. Comparison: all standard candidates, reading of the files not included."
    " Hysteresis: three isobaric loops of 2000 rows with Dahl friction, all friction laws."
    " Bootstrap: 4000 rows in eight runs, 1000 refits of a surface of degree 3, 100 of a braided"
    " muscle, which is nonlinear in its parameters. `airmuscle fit --compare` uses one process for"
    " each core: a task of two processes is judged by its time, including their start, any other by"
    " its CPU time. Median of the rounds, the first of which includes the tracing of the laws; the"
    " CPU time is of all threads and processes. The last row is one run of the installed command,"
    " with reading, two purposes, report and figures, on 24 files like those of a laboratory"
    " (benchmarks/rig_files.py): muscles of 10, 20 and 40 cm, of no law of the library, that are"
    " slack up to a threshold of pressure, at the lower limit of the force sensor; loops of"
    " inflating and deflating of 5 to 10 % of the greatest force; unequal speeds and pressures,"
    " noise, resolution and zeros that differ between runs."
)
COMMAND = "airmuscle fit --compare, 24 files with slack rows and loops"


class Timing(NamedTuple):
    """Median time and CPU time [s] of a call, and its last result."""

    wall: float
    cpu: float
    result: Any


def muscle(length: float) -> am.characteristic.TonduLopez2000:
    """The law of the active part of a muscle between its ends."""
    return am.characteristic.TonduLopez2000(
        am.geometry.Braid(0.01, 0.45, length - END_LENGTH), 1.15
    )


def add_noise(columns: dict[str, np.ndarray], seed: int) -> dict[str, np.ndarray]:
    """The columns as the sensors give them; a force sensor in tension does not read below zero."""
    random = np.random.default_rng(seed)
    noisy = {
        n: x + NOISE[n] * random.standard_normal(x.size) if n in NOISE else x
        for n, x in columns.items()
    }
    noisy["force"] = np.maximum(noisy["force"], 0.0)
    return noisy


def make_sweep(length: float, contraction: float, rows: int, seed: int) -> am.Recording:
    """A triangular sweep of pressure at constant length."""
    seconds = np.linspace(0.0, 60.0, rows)
    pressure = MAX_PRESSURE * (1 - np.abs(seconds / 30.0 - 1))
    held = np.full(rows, contraction)
    force = muscle(length).force(pressure, held * length / (length - END_LENGTH))
    columns = add_noise(
        {"time": seconds, "pressure": pressure, "contraction": held, "force": force}, seed
    )
    return am.Recording(
        columns, f"{length * 1e3:.0f} mm, {contraction:.0%}, {seed}", {"resting_length": length}
    )


def make_family(rows: int = 500) -> list[am.Recording]:
    """24 sweeps: three muscles, four held lengths, two repeats."""
    points = [(length, held) for length in LENGTHS for held in (0.0, 0.06, 0.12, 0.18)]
    return [
        make_sweep(*point, rows, 2 * i + repeat)
        for i, point in enumerate(points)
        for repeat in range(2)
    ]


def make_sweeps(count: int = 6, rows: int = 800) -> list[am.Recording]:
    """Sweeps of one muscle at several held lengths."""
    return [
        make_sweep(0.3, held, rows, 100 + i) for i, held in enumerate(np.linspace(0.0, 0.2, count))
    ]


def make_loops(rows: int = 2000) -> list[am.Recording]:
    """Three isobaric loops with friction against shortening: lengthening and shortening in cycles
    of two strokes.
    """
    loops = []
    for i, pressure in enumerate((2e5, 3.5e5, 5e5)):
        seconds = np.linspace(0.0, 120.0, rows)
        stroke = np.where(seconds < 60.0, 0.06, 0.03)
        contraction = 0.08 - stroke * np.cos(2 * np.pi * seconds / 30.0) * 0.9
        held = np.full(rows, pressure)
        friction = am.friction.Dahl(2e4, 12.0).force_along(contraction * 0.3, seconds)
        force = muscle(0.3).force(held, contraction * 0.3 / (0.3 - END_LENGTH)) - friction
        columns = add_noise(
            {"time": seconds, "pressure": held, "contraction": contraction, "force": force}, 200 + i
        )
        loops.append(
            am.Recording(columns, f"loop at {pressure / 1e3:.0f} kPa", {"resting_length": 0.3})
        )
    return loops


def processor_time() -> float:
    """CPU time [s] of this process and of its processes that have ended."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def timed(task: Callable[[], Any], rounds: int) -> Timing:
    """Median times of a task; the first round includes the tracing of the laws."""
    walls = []
    processors = []
    for _ in range(rounds):
        wall = time.perf_counter()
        processor = processor_time()
        result = task()
        walls.append(time.perf_counter() - wall)
        processors.append(processor_time() - processor)
    return Timing(statistics.median(walls), statistics.median(processors), result)


def compare_by_command() -> str:
    """The recommendation of `airmuscle fit --compare` for the synthetic files of a laboratory."""
    with tempfile.TemporaryDirectory() as name:
        paths = [str(path) for path in write_files(Path(name))]
        printed = run_python([*program(), "fit", *paths, "--compare", "--out", f"{name}/fit"])
    found = next(
        line for line in printed.splitlines() if line.startswith("One law for all purposes: ")
    )
    return found.partition(": ")[2].partition(" with ")[0]


def describe(result: Any) -> str:
    """The outcome of a task in a few words."""
    if isinstance(result, str):
        return f"recommended: {result}"
    if isinstance(result, am.bench.Comparison):
        return f"recommended: {result.recommended.candidate.name}; {len(result.excluded)} excluded"
    if isinstance(result, am.bench.Bootstrap):
        return f"{result.failed_refits} of {len(result.values)} refits not determined"
    return ", ".join(
        type(each.recommended.friction).__name__ for each in result if each.recommended is not None
    )


def section(rounds: int = 3) -> Section:
    """The complete benchmark."""
    family, sweeps, loops = make_family(), make_sweeps(), find_loops(make_loops())
    runs = [make_sweep(length, held, 500, 300 + i) for i, (length, held) in enumerate(POINTS)]
    surface, braid = am.fit(blank_surface(3), runs), am.fit(muscle(0.3), runs)
    tasks: dict[str, tuple[Callable[[], Any], float]] = {
        "comparison of 24 files, by specimen": (lambda: am.bench.compare(family), 10.0),
        "comparison of 24 files, by run": (
            lambda: am.bench.compare(family, leave_out=am.bench.RunSplit()),
            10.0,
        ),
        f"the same by specimen, {TWO}": (lambda: am.bench.compare(family, workers=2), 10.0),
        f"the same by run, {TWO}": (
            lambda: am.bench.compare(family, leave_out=am.bench.RunSplit(), workers=2),
            10.0,
        ),
        "comparison of six sweeps": (lambda: am.bench.compare(sweeps), 10.0),
        "friction of three loops": (lambda: [fit_loop(loop) for loop in loops], 10.0),
        "bootstrap, surface": (
            lambda: am.bench.bootstrap(surface, runs, by=am.bench.RunSplit()),
            3.0,
        ),
        "bootstrap, braid, 100 refits": (
            lambda: am.bench.bootstrap(braid, runs, refits=100, by=am.bench.RunSplit()),
            3.0,
        ),
    }
    rows = []
    targets = []
    for name, (task, limit) in tasks.items():
        timing = timed(task, rounds)
        rows.append(
            (name, format_time(timing.wall), format_time(timing.cpu), describe(timing.result))
        )
        if name.endswith(TWO):
            targets.append(Target(f"{name}, time", timing.wall, limit, "s", reason=REASON))
        else:
            targets.append(Target(f"{name}, CPU time", timing.cpu, limit, "s", reason=REASON))
    command = timed(compare_by_command, 1)
    rows.append(
        (COMMAND, format_time(command.wall), format_time(command.cpu), describe(command.result))
    )
    targets.append(Target(f"{COMMAND}, time", command.wall, 20.0, "s"))
    return Section("Model comparison", TEXT, HEADER, tuple(rows), tuple(targets))


if __name__ == "__main__":
    print_section(section())
