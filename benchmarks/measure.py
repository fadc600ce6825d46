"""How the benchmarks measure: variants in turn in one process, medians, ratios within a round, and what is printed.

A machine that is busy slows neighbours in time alike, so a ratio is the median of the ratios of each round.
"""

from __future__ import annotations

import dataclasses
import datetime
import os
import platform
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from importlib import metadata
from typing import Any

PACKAGES = (
    *("numpy", "scipy", "numba", "llvmlite", "casadi", "lmfit"),
    *("scikit-sundae", "diffrax", "jax", "control", "mujoco"),
)
LEAST = 0.004
"""A variant quicker than this [s] is called several times in a round, so that it is timed warm and beyond the clock."""

PEAK = """
import pathlib, sys
status = pathlib.Path("/proc/self/status")
if status.exists():  # getrusage would count the process that this one was forked from
    print(next(int(line.split()[1]) for line in status.read_text().splitlines() if line.startswith("VmHWM")) / 1e3)
else:
    import resource
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1e6 if sys.platform == "darwin" else 1e3))
"""
"""Python that prints the greatest memory of its own process so far [MB]."""


@dataclasses.dataclass(frozen=True)
class Times:
    """Seconds a call of one variant, one number a round."""

    rounds: tuple[float, ...]

    @property
    def median(self) -> float:
        return statistics.median(self.rounds)

    @property
    def least(self) -> float:
        return min(self.rounds)

    def ratio_to(self, other: Times) -> float:
        """How many times longer than the other, round by round."""
        return statistics.median(a / b for a, b in zip(self.rounds, other.rounds, strict=True))


def interleaved(variants: Mapping[str, Callable[[], Any]], rounds: int) -> dict[str, Times]:
    """Time the variants in turn; a call before the first round warms each."""
    calls = {name: max(1, round(LEAST / _seconds(run, 1, warm=True))) for name, run in variants.items()}
    found: dict[str, list[float]] = {name: [] for name in variants}
    for _ in range(rounds):
        for name, run in variants.items():
            found[name].append(_seconds(run, calls[name]))
    return {name: Times(tuple(times)) for name, times in found.items()}


def _seconds(run: Callable[[], Any], calls: int, warm: bool = False) -> float:
    if warm:
        run()
    start = time.perf_counter()
    for _ in range(calls):
        run()
    return max((time.perf_counter() - start) / calls, 1e-9)


@dataclasses.dataclass(frozen=True)
class Bar:
    """What was wanted: a number that must not be more (or, `at_least`, not less) than a limit."""

    what: str
    measured: float
    limit: float
    unit: str
    at_least: bool = False
    why: str = ""
    """What is known of the reason, printed where the bar is missed."""

    @property
    def held(self) -> bool:
        return self.measured >= self.limit if self.at_least else self.measured <= self.limit

    @property
    def cells(self) -> tuple[str, ...]:
        wanted = f"{'>=' if self.at_least else '<='} {self.limit:g} {self.unit}"
        return (self.what, f"{self.measured:.3g} {self.unit}", wanted, "held" if self.held else "**missed**")


@dataclasses.dataclass(frozen=True)
class Section:
    """One benchmark: what it compares, its rows, and the bars it is held to."""

    title: str
    text: str
    heading: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    bars: tuple[Bar, ...] = ()

    def markdown(self) -> str:
        return f"## {self.title}\n\n{self.text}\n\n{table(self.heading, self.rows)}\n"


def table(heading: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = ["| " + " | ".join(row) + " |" for row in (heading, *rows)]
    return "\n".join([lines[0], "|" + "---|" * len(heading), *lines[1:]])


def show(section: Section) -> None:
    """Print a section and its bars."""
    print(section.markdown())
    for bar in section.bars:
        print("  ".join(bar.cells))


def of_time(seconds: float) -> str:
    """A time for people: 0.136 ms, 1.24 s."""
    for scale, unit in ((1.0, "s"), (1e-3, "ms"), (1e-6, "us")):
        if seconds >= scale:
            return f"{seconds / scale:.3g} {unit}"
    return f"{seconds / 1e-9:.3g} ns"


def versions() -> str:
    found = []
    for name in PACKAGES:
        try:
            found.append(f"{name} {metadata.version(name)}")
        except metadata.PackageNotFoundError:
            found.append(f"{name} absent")
    return f"Python {platform.python_version()}, " + ", ".join(found)


def machine() -> str:
    """Processor, cores, system, and how busy it was."""
    load, cores = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan"), os.cpu_count() or 1
    busy = "; others used it too, so that seconds are too long and only ratios hold" if load > cores / 2 + 1 else ""
    return f"{_processor()}, {cores} cores, {platform.system()}, load average {load:.1f} at the end{busy}"


def _processor() -> str:
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            entries = dict(line.split(":", 1) for line in file if line.count(":") == 1)
    except OSError:
        return platform.processor() or platform.machine()
    known = {key.strip(): value.strip() for key, value in entries.items()}
    name = known.get("model name", "")
    if not name or name == "unknown":
        name = (
            f"{known.get('vendor_id', platform.machine())} family {known.get('cpu family')} model {known.get('model')}"
        )
    wide = " with AVX-512" if "avx512f" in known.get("flags", "") else ""
    return f"{name}{wide}"


def today() -> str:
    return datetime.datetime.now(tz=datetime.UTC).date().isoformat()
