"""Stated 95 % intervals of static fits to two repeats of a measurement: how often they hold their difference.

    python benchmarks/real_intervals.py FOLDER

FOLDER is that of `real_data.py`. A surface is fitted to repeat 8 and to repeat 9 of each length; at points of the
measured range, an interval of the difference has the half width sqrt(h8^2 + h9^2) of the two confidence bands.
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
    return am.Recording({"pressure": pressure.ravel(), "contraction": contraction.ravel()}, "points")


def main() -> None:
    """Print a row for each length and degree."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    first, second = repeats(parser.parse_args().folder)
    inside = []
    print(f"{'length':<8}{'degree':>7}{'rms':>7}{'half width':>12}{'difference':>12}{'held':>8}  standard errors")
    for name in sorted({str(run.constants["specimen"]) for run in first}):
        pair = [select_specimen(runs, name) for runs in (first, second)]
        points = grid([*pair[0], *pair[1]])
        for degree in DEGREES:
            surface = am.characteristic.ContractileSurface.blank(degree, max_force=UNREACHED)
            fits = [am.fit(surface, runs) for runs in pair]
            bands = [am.bench.confidence_band(each, points) for each in fits]
            half = np.hypot(*((band.high - band.low) / 2 for band in bands))
            pulls = bands[0].value > LEAST_FORCE
            difference = (bands[0].value - bands[1].value)[pulls]
            held = np.abs(difference) < half[pulls]
            inside.append(held)
            width = np.median((bands[0].high - bands[0].low)[pulls]) / 2
            numbers = f"{fits[0].rmse:>7.1f}{width:>12.1f}{rms(difference):>12.1f}{100 * np.mean(held):>7.0f}%"
            print(f"{name:<8}{degree:>7}{numbers}  {fits[0].error_basis}", flush=True)
    print(f"all points: {100 * np.mean(np.concatenate(inside)):.0f} %")


if __name__ == "__main__":
    main()
