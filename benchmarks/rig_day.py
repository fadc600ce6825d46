"""Time of `airmuscle inspect` and `airmuscle check` at the command, on records of one day."""

from __future__ import annotations

import pathlib
import sys
import tempfile

import numpy as np
from measure import Section, Target, format_time, print_section, time_variants
from new_plant import run_python
from startup import program

HEADER = ("command", "median", "minimum")
TEXT = (
    "Complete processes of the installed command, with cached bytecode. A record has 20 s at 200 Hz"
    " of a set point, the pressure behind it (a lag of 60 ms) and the noise of the sensor, as CSV;"
    " the folder has ten of them, the long record 200 s at 1 kHz. `check` is to say within 2 s"
    " after a record whether it is usable."
)
LAG = 0.06
NOISE = 300.0
"""Lag of the pressure [s] and standard deviation of the sensor [Pa] (chosen)."""


def write_record(path: pathlib.Path, duration: float, rate: float, seed: int) -> None:
    """A record of random steps, each held for 0.5 s."""
    rng = np.random.default_rng(seed)
    time = np.arange(round(duration * rate)) / rate
    levels = rng.uniform(5e4, 5e5, int(duration / 0.5) + 1)
    command = levels[(time / 0.5).astype(int)]
    pressure = np.empty_like(command)
    pressure[0] = command[0]
    share = 1.0 - np.exp(-1.0 / (rate * LAG))
    for row in range(1, len(time)):
        pressure[row] = pressure[row - 1] + share * (command[row - 1] - pressure[row - 1])
    pressure += rng.normal(0.0, NOISE, len(time))
    table = np.column_stack([time, command / 1e3, pressure / 1e3])
    heading = "time [s],setpoint [kPa],pressure [kPa]"
    np.savetxt(
        path, table, fmt=("%.4f", "%.3f", "%.3f"), delimiter=",", header=heading, comments=""
    )


def section(rounds: int = 5) -> Section:
    """The complete benchmark."""
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        day = folder / "day"
        day.mkdir()
        for number in range(10):
            write_record(day / f"run_{number:02}.csv", 20.0, 200.0, number)
        long = folder / "long.csv"
        write_record(long, 200.0, 1000.0, 10)
        record = day / "run_00.csv"
        variants = {
            "airmuscle check RECORD": lambda: run_python([*program(), "check", str(record)]),
            "airmuscle inspect RECORD": lambda: run_python([*program(), "inspect", str(record)]),
            "airmuscle check FOLDER, 10 records": lambda: run_python(
                [*program(), "check", str(day)]
            ),
            "airmuscle inspect FOLDER, 10 records": lambda: run_python(
                [*program(), "inspect", str(day)]
            ),
            "airmuscle check, 200 000 rows": lambda: run_python([*program(), "check", str(long)]),
        }
        times = time_variants(variants, rounds)
    check, inspect, *_ = [timing.minimum for timing in times.values()]
    targets = (
        Target("`airmuscle check` of a record", check, 2.0, "s"),
        Target("`airmuscle inspect` of a record", inspect, 2.0, "s"),
    )
    rows = tuple((name, format_time(t.median), format_time(t.minimum)) for name, t in times.items())
    return Section("A record is inspected and checked", TEXT, HEADER, rows, targets)


if __name__ == "__main__":
    print_section(section())
    sys.exit()
