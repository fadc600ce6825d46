"""Timing of benchmark variants, targets, and Markdown output.

All variants are timed in one process, in each round once and in random order. A ratio is the median
of the ratios of each round, because a change of the machine load affects all variants of a round
alike. Each timing follows a call that is not timed: the first call after another variant fills the
caches of the processor again, which takes a call of 0.2 ms half of its time.
"""

from __future__ import annotations

import dataclasses
import datetime
import os
import platform
import random
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from importlib import metadata
from typing import Any

PACKAGES = (
    *("numpy", "scipy", "numba", "llvmlite", "casadi", "lmfit"),
    *("scikit-sundae", "diffrax", "jax", "control", "mujoco", "gymnasium"),
)
MIN_DURATION = 0.004
"""Minimum duration [s] of a timing: faster variants are called several times per round, because of
clock resolution.
"""
MAX_WARM_UP = 0.05
"""Duration [s] of a call from which on the state of the caches before it no longer matters."""

PRINT_PEAK_MEMORY = """
import pathlib, sys
status = pathlib.Path("/proc/self/status")
if status.exists():  # getrusage also counts the parent process before the fork
    print(next(int(line.split()[1]) for line in status.read_text().splitlines() if line.startswith("VmHWM")) / 1e3)
else:
    import resource
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1e6 if sys.platform == "darwin" else 1e3))
"""  # noqa: E501
"""Python code that prints the peak memory of its own process [MB]."""


@dataclasses.dataclass(frozen=True)
class Times:
    """Duration of one call of a variant [s], one value per round."""

    rounds: tuple[float, ...]

    @property
    def median(self) -> float:
        return statistics.median(self.rounds)

    @property
    def minimum(self) -> float:
        return min(self.rounds)

    def ratio_to(self, other: Times) -> float:
        """Median over the rounds of the ratio to the duration of the other variant."""
        return statistics.median(a / b for a, b in zip(self.rounds, other.rounds, strict=True))


def time_variants(variants: Mapping[str, Callable[[], Any]], rounds: int) -> dict[str, Times]:
    """Time the variants, after one warm-up call each, in an order that is the same in each
    process.
    """
    once = {name: _seconds(run, 1, warm=True) for name, run in variants.items()}
    calls = {name: max(1, round(MIN_DURATION / seconds)) for name, seconds in once.items()}
    durations: dict[str, list[float]] = {name: [] for name in variants}
    order = list(variants)
    shuffle = random.Random(0).shuffle
    for _ in range(rounds):
        shuffle(order)
        for name in order:
            durations[name].append(_seconds(variants[name], calls[name], once[name] < MAX_WARM_UP))
    return {name: Times(tuple(times)) for name, times in durations.items()}


def _seconds(run: Callable[[], Any], calls: int, warm: bool) -> float:
    if warm:
        run()
    start = time.perf_counter()
    for _ in range(calls):
        run()
    return max((time.perf_counter() - start) / calls, 1e-9)


@dataclasses.dataclass(frozen=True)
class Target:
    """Target of a benchmark: a measured value with an upper limit or, if `at_least`, a lower
    limit.
    """

    name: str
    measured: float
    limit: float
    unit: str
    at_least: bool = False
    reason: str = ""
    """Known reason, printed if the target is missed."""

    @property
    def met(self) -> bool:
        return self.measured >= self.limit if self.at_least else self.measured <= self.limit

    @property
    def cells(self) -> tuple[str, ...]:
        target = f"{'>=' if self.at_least else '<='} {self.limit:g} {self.unit}"
        return (
            self.name,
            f"{self.measured:.3g} {self.unit}",
            target,
            "met" if self.met else "**missed**",
        )


@dataclasses.dataclass(frozen=True)
class Section:
    """Section of the results: title, description, table and targets of one benchmark."""

    title: str
    text: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    targets: tuple[Target, ...] = ()

    def markdown(self) -> str:
        return f"## {self.title}\n\n{self.text}\n\n{table(self.header, self.rows)}\n"


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = ["| " + " | ".join(row) + " |" for row in (header, *rows)]
    return "\n".join([lines[0], "|" + "---|" * len(header), *lines[1:]])


def print_section(section: Section) -> None:
    """Print a section and its targets."""
    print(section.markdown())
    for target in section.targets:
        print("  ".join(target.cells))


def format_time(seconds: float) -> str:
    """A time with three significant digits and a suitable unit: 0.136 ms, 1.24 s."""
    for scale, unit in ((1.0, "s"), (1e-3, "ms"), (1e-6, "us")):
        if seconds >= scale:
            return f"{seconds / scale:.3g} {unit}"
    return f"{seconds / 1e-9:.3g} ns"


def package_versions() -> str:
    """Versions of Python and of the packages that are compared."""
    texts = []
    for name in PACKAGES:
        try:
            texts.append(f"{name} {metadata.version(name)}")
        except metadata.PackageNotFoundError:
            texts.append(f"{name} not installed")
    return f"Python {platform.python_version()}, " + ", ".join(texts)


def describe_machine() -> str:
    """Processor, number of cores, operating system and load."""
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
    cores = os.cpu_count() or 1
    busy = (
        "; under other load, so that times are too long and only ratios are valid"
        if load > cores / 2 + 1
        else ""
    )
    return (
        f"{_processor()}, {cores} cores, {platform.system()}, load average at the end"
        f" {load:.1f}{busy}"
    )


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
            f"{known.get('vendor_id', platform.machine())} family {known.get('cpu family')} model"
            f" {known.get('model')}"
        )
    wide = " with AVX-512" if "avx512f" in known.get("flags", "") else ""
    return f"{name}{wide}"


def today() -> str:
    return datetime.datetime.now(tz=datetime.UTC).date().isoformat()
