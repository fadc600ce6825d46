"""Identification while a measurement runs: time for a row, from its text to the surface and the
next point.
"""

from __future__ import annotations

import time

import numpy as np
from measure import Section, Target, format_time, print_section

import airmuscle as am

ROWS = 5000
HEADER = ("step", "median", "99 % quantile")
TEXT = (
    f"{ROWS} rows of a log at 1 kHz, with 21 coefficients; a row is read from its text, the surface"
    " is updated, and the next point is selected from 169. A rate of 1 kHz leaves 1 ms for a row."
    " The quantile contains the other load of the machine."
)


def log_lines() -> list[str]:
    """Lines of a log with made rows."""
    rng = np.random.default_rng(4)
    pressure = rng.uniform(0, 600, ROWS)
    contraction = rng.uniform(0, 25, ROWS)
    force = 2.2 * pressure * (1 - 0.035 * contraction) + rng.normal(0, 2, ROWS)
    rows = zip(pressure, contraction, force, strict=True)
    return [
        "pressure [kPa],contraction [%],force [N]",
        *(f"{p:.3f},{c:.3f},{f:.2f}" for p, c, f in rows),
    ]


def measure() -> dict[str, np.ndarray]:
    """Times [s] of each step, shape (ROWS,)."""
    fit = am.bench.RecursiveFit(
        am.bench.BenchLimits(am.characteristic.ValidityRange(0.0, 6e5, 0.0, 0.25), 1500.0)
    )
    reader = am.bench.RowReader("log")
    times: dict[str, list[float]] = {"row read": [], "surface updated": [], "next point": []}
    for line in log_lines():
        start = time.perf_counter()
        row = reader.read(line)
        if row is None:
            continue
        marks = [start, time.perf_counter()]
        fit = fit.updated(row["pressure"], row["contraction"], row["force"])
        marks.append(time.perf_counter())
        fit.next_point()
        marks.append(time.perf_counter())
        for name, duration in zip(times, np.diff(marks), strict=True):
            times[name].append(duration)
    arrays = {name: np.array(values) for name, values in times.items()}
    return {**arrays, "all": np.sum(list(arrays.values()), axis=0)}


def section(rounds: int = 1) -> Section:
    """The complete benchmark."""
    times = measure()
    rows = tuple(
        (name, format_time(float(np.median(t))), format_time(float(np.quantile(t, 0.99))))
        for name, t in times.items()
    )
    target = Target(
        "a row at 1 kHz: reading, recursive fit and next point",
        float(np.median(times["all"])),
        1e-3,
        "s",
    )
    return Section("Identification while a measurement runs", TEXT, HEADER, rows, (target,))


if __name__ == "__main__":
    print_section(section())
