"""Timing of benchmark variants, targets, and Markdown output.

All variants are timed in one process, in each round once and in random order. A ratio is the median
of the ratios of each round, because a change of the machine load affects all variants of a round
alike. Each timing follows a call that is not timed: the first call after another variant fills the
caches of the processor again, which takes a call of 0.2 ms half of its time.
"""

from __future__ import annotations

import dataclasses
import datetime
import functools
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


def time_variants(
    variants: Mapping[str, Callable[[], Any]],
    rounds: int,
    clock: Callable[[], float] = time.perf_counter,
) -> dict[str, Times]:
    """Time the variants, after one warm-up call each, in an order that is the same in each
    process.
    """
    once = {name: _seconds(run, 1, True, clock) for name, run in variants.items()}
    calls = {name: max(1, round(MIN_DURATION / seconds)) for name, seconds in once.items()}
    durations: dict[str, list[float]] = {name: [] for name in variants}
    order = list(variants)
    shuffle = random.Random(0).shuffle
    for _ in range(rounds):
        shuffle(order)
        for name in order:
            warm = once[name] < MAX_WARM_UP
            durations[name].append(_seconds(variants[name], calls[name], warm, clock))
    return {name: Times(tuple(times)) for name, times in durations.items()}


def _seconds(
    run: Callable[[], Any],
    calls: int,
    warm: bool,
    clock: Callable[[], float] = time.perf_counter,
) -> float:
    if warm:
        run()
    start = clock()
    for _ in range(calls):
        run()
    return max((clock() - start) / calls, 1e-9)


SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6}
PER_SECOND = {"M steps/s": 1e6}
NOMINAL = 0.2e-6
"""Duration [s] of the yardstick by which limits in seconds become limits in yardsticks (chosen)."""
YARDSTICK_STEPS = 20_000


def oscillate(steps: int) -> dict[str, float]:
    """The state of an oscillator after so many steps, in Python."""
    state = {"position": 0.0, "speed": 1.0}
    for _ in range(steps):
        force = -4.0 * state["position"] - 0.1 * state["speed"]
        state = {
            "position": state["position"] + 1e-3 * state["speed"],
            "speed": state["speed"] + 1e-3 * force,
        }
    return state


@functools.cache
def yardstick() -> float:
    """Duration of a step of `oscillate` in this run [s], the least of many."""
    return min(_seconds(lambda: oscillate(YARDSTICK_STEPS), 1, warm=False) for _ in range(60)) / (
        YARDSTICK_STEPS
    )


@dataclasses.dataclass(frozen=True)
class Target:
    """Target of a benchmark: a measured value with an upper limit or, if `at_least`, a lower
    limit.

    A time or a rate is compared as a ratio to the yardstick of the same run, so that a slower
    processor has the same targets; its limit is given for a yardstick of NOMINAL.
    """

    name: str
    measured: float
    limit: float
    unit: str
    at_least: bool = False
    reason: str = ""
    """Known reason, printed if the target is missed."""

    @property
    def ratio(self) -> float:
        """The measured value; of a time or a rate, in yardsticks."""
        return self._in_yardsticks(self.measured, yardstick) if self.absolute else self.measured

    @property
    def bar(self) -> float:
        """The limit; of a time or a rate, in yardsticks."""
        return self._in_yardsticks(self.limit, lambda: NOMINAL) if self.absolute else self.limit

    @property
    def absolute(self) -> bool:
        """Whether a time or a rate is measured."""
        return self.unit in {*SECONDS, *PER_SECOND}

    @property
    def met(self) -> bool:
        return self.ratio >= self.bar if self.at_least else self.ratio <= self.bar

    @property
    def cells(self) -> tuple[str, ...]:
        measured = f"{self.measured:.3g} {self.unit}"
        unit = self.unit
        if self.absolute:
            unit = "y" if self.unit in SECONDS else "a y"
            measured = f"{measured} = {self.ratio:.3g} {unit}"
        target = f"{'>=' if self.at_least else '<='} {self.bar:.3g} {unit}"
        return self.name, measured, target, "met" if self.met else "**missed**"

    def _in_yardsticks(self, value: float, duration: Callable[[], float]) -> float:
        if self.unit in SECONDS:
            return value * SECONDS[self.unit] / duration()
        return value * PER_SECOND[self.unit] * duration()


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
