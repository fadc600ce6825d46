"""Stated 95 % intervals of static fits to two repeats of a measurement: how often they hold their
difference.

    python benchmarks/real_intervals.py FOLDER

FOLDER is that of `real_data.py`. A surface is fitted to repeat 8 and to repeat 9 of each length,
and each pooled law to all lengths of a repeat; at points of the measured range of each length, an
interval of the difference has the half width sqrt(h8^2 + h9^2) of the two confidence bands.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from real_data import repeats, rms, select_specimen

import airmuscle as am

DEGREES = (2, 3)
LEAST_FORCE = 5.0
UNREACHED = 1e4


def grid(runs: list[am.Recording]) -> am.Recording:
    """Points at 200 to 600 kPa and up to three quarters of the greatest measured contraction."""
    greatest = 0.75 * max(run["contraction"].max() for run in runs)
    pressure, contraction = np.meshgrid(np.linspace(2e5, 6e5, 9), np.linspace(0.0, greatest, 7))
    return am.Recording(
        {"pressure": pressure.ravel(), "contraction": contraction.ravel()}, "points"
    )


def compare_fits(
    fits: list[am.bench.Fit], points: am.Recording
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """At the points that pull: half widths of the first band and of the difference, and the
    differences [N].
    """
    bands = [am.bench.confidence_band(each, points) for each in fits]
    widths = [(band.high - band.low) / 2 for band in bands]
    pulls = bands[0].value > LEAST_FORCE
    return widths[0][pulls], np.hypot(*widths)[pulls], (bands[0].value - bands[1].value)[pulls]


def print_row(name: str, fits: list[am.bench.Fit], places: list[am.Recording]) -> np.ndarray:
    """One row of the table; mask of the points whose interval holds the difference."""
    width, half, difference = (
        np.concatenate(x) for x in zip(*(compare_fits(fits, p) for p in places), strict=True)
    )
    held = np.abs(difference) < half
    numbers = f"{fits[0].rmse:>7.1f}{np.median(width):>12.1f}{rms(difference):>12.1f}{100 * np.mean(held):>7.0f}%"  # noqa: E501
    print(f"{name:<67}{numbers}  {fits[0].error_basis}", flush=True)
    return held


def held_points(
    repeated: tuple[list[am.Recording], list[am.Recording]],
) -> tuple[np.ndarray, np.ndarray]:
    """Masks of the points of all surfaces and of all pooled laws; a row is printed for each."""
    print(f"{'law':<67}{'rms':>7}{'half width':>12}{'difference':>12}{'held':>8}  standard errors")
    surfaces = []
    pooled = []
    places = []
    for name in sorted({str(run.constants["specimen"]) for run in repeated[0]}):
        pair = [select_specimen(runs, name) for runs in repeated]
        constants = {n: pair[0][0].constants[n] for n in ("specimen", "resting_length")}
        places.append(grid([*pair[0], *pair[1]]).with_constants(**constants))
        for degree in DEGREES:
            surface = am.characteristic.ContractileSurface.blank(degree, max_force=UNREACHED)
            surfaces.append(
                print_row(
                    f"{name}, degree {degree}",
                    [am.fit(surface, runs) for runs in pair],
                    places[-1:],
                )
            )
    for candidate in am.bench.standard_candidates(repeated[0]):
        if isinstance(candidate.law, am.characteristic.PooledLengthLaw):
            fits = [am.fit(candidate.law, runs) for runs in repeated]
            pooled.append(print_row(candidate.name, fits, places))
    return np.concatenate(surfaces), np.concatenate(pooled)


def main() -> None:
    """Print a row for each length and degree, and for each pooled law."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    for kind, held in zip(
        ("surfaces", "pooled laws"), held_points(repeats(parser.parse_args().folder)), strict=True
    ):
        print(f"all points of {kind}: {100 * np.mean(held):.0f} %")


if __name__ == "__main__":
    main()
