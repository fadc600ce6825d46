"""Targets of the identification on measured recordings, each with the value of today.

    python benchmarks/real_bars.py FOLDER

FOLDER holds the files of `real_data.py` and `*fill*.csv` of `real_fills.py`. The law is the one
that the command recommends for repeats 8 and 9 together; a run that is left out stands for a
further repeat.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
from real_data import CEILING, NAME, pulling, repeats, rms, slack_force
from real_fills import fit_divided, read_record
from real_intervals import held_points
from startup import program

import airmuscle as am
from airmuscle.bench.comparison.compared_points import force_residuals


class Bar(NamedTuple):
    """A value with its limit (chosen), from above unless `least`."""

    name: str
    value: float
    limit: float
    unit: str
    least: bool = False

    def __str__(self) -> str:
        met = self.value >= self.limit if self.least else self.value <= self.limit
        sign = ">=" if self.least else "<="
        return (
            f"{self.name:<75}{self.value:>8.3g} {self.unit:<4}{sign} {self.limit:g} "
            f" {'met' if met else 'MISSED'}"
        )


def law_bars(train: list[am.Recording], test: list[am.Recording]) -> list[Bar]:
    """One law for further runs and other lengths: its errors on rows left out, and its force at
    slack rows.
    """
    joint = am.bench.select_for_both([*train, *test], workers=2)
    by_run, by_length = joint.recommended
    candidate = joint.recommended[0].candidate
    first = am.fit(candidate.law, train).model
    lengths = {
        str(run.constants["specimen"]): float(run.constants["resting_length"]) for run in train
    }
    middle = sorted(lengths, key=lambda name: lengths[name])[1]
    between = next(each.rmse for each in by_length.fold_scores if each.fold == middle)
    repeated = rms(force_residuals(first, pulling(test), CEILING))
    slack = slack_force(by_run.fit.model, [*train, *test])
    return [
        Bar(f"{candidate.name}: one run left out", by_run.cross_validated_rmse, 7.0, "N"),
        Bar("the same law fitted to repeat 8: rms error on repeat 9", repeated, 7.5, "N"),
        Bar("greatest force of a specimen's law at its slack rows", slack, 20.0, "N"),
        Bar("a length between the others left out, slack rows included", between, 14.0, "N"),
    ]


def command_bars(folder: Path) -> list[Bar]:
    """Wall time of `airmuscle fit --compare` with all ramps, and its CPU time."""
    files = sorted(str(path) for path in folder.glob("*.csv") if NAME.search(path.name))
    before = os.times()
    begin = time.perf_counter()
    with tempfile.TemporaryDirectory() as out:
        subprocess.run(
            [*program(), "fit", *files, "--compare", "--out", f"{out}/fit"],
            check=True,
            capture_output=True,
        )
    after = os.times()
    used = (
        after.children_user + after.children_system - before.children_user - before.children_system
    )
    seconds = time.perf_counter() - begin
    return [
        Bar("airmuscle fit --compare, wall time", seconds, 20.0, "s"),
        Bar("the same, CPU time", used, 28.0, "s"),
    ]


def main() -> None:
    """Print the targets."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args().folder
    train, test = repeats(folder)
    surfaces, pooled = held_points((train, test))
    print()
    fits = [fit_divided(read_record(path), 16) for path in sorted(folder.glob("*fill*.csv"))]
    fills = [fit.rms(model.sensor) / 1e3 for model, fit in fits]
    bars = [
        *law_bars(train, test),
        Bar(
            "stated 95 % intervals of surfaces, repeat 8 against 9",
            100 * float(np.mean(surfaces)),
            85.0,
            "%",
            True,
        ),
        Bar("the same of pooled laws", 100 * float(np.mean(pooled)), 85.0, "%", True),
        *(Bar(f"fill {i + 1}: rms residual", error, 0.5, "kPa") for i, error in enumerate(fills)),
        *command_bars(folder),
    ]
    print(*bars, sep="\n")


if __name__ == "__main__":
    main()
