"""Bootstrap of a surface with 21 coefficients, resampled by runs: the library and a loop over
SciPy.
"""

from __future__ import annotations

import numpy as np
from measure import Section, Target, format_time, print_section, time_variants
from static_fit import design_matrix, make_points

import airmuscle as am

REFITS = 1000
RUNS = 20
HEADER = (
    "variant",
    "median",
    "minimum",
    "ratio to library",
    "maximum difference of a standard deviation",
)
TEXT = (
    f"The points of the static fit in {RUNS} runs; {REFITS} bootstrap samples of as many runs,"
    " drawn with replacement. The SciPy loop calls `scipy.linalg.lstsq` on the rows of each"
    " sample; its design matrix is computed once. Both use the same samples. The library sums one"
    " normal matrix per run, in an orthonormal basis, for all samples in one matrix product."
)


def refit_library(runs: list[am.Recording]) -> np.ndarray:
    """Coefficients of every refit with the library, including the initial fit."""
    initial = am.fit(
        am.characteristic.ContractileSurface.blank(), runs, censoring=am.bench.UNCENSORED
    )
    return am.bench.bootstrap(initial, runs, refits=REFITS, by=am.bench.RunSplit(), seed=0).values


def refit_scipy(columns: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Coefficients of every refit with a loop over SciPy."""
    from scipy.linalg import lstsq

    samples = np.random.default_rng(0).multinomial(RUNS, np.full(RUNS, 1 / RUNS), size=REFITS)
    blocks = np.array_split(np.arange(force.size), RUNS)
    coefficients = []
    for counts in samples:
        rows = np.concatenate(
            [block for block, n in zip(blocks, counts, strict=True) for _ in range(n)]
        )
        coefficients.append(lstsq(columns[rows], force[rows], check_finite=False)[0])
    return np.array(coefficients)


def section(rounds: int = 5) -> Section:
    """The complete benchmark."""
    data = make_points()
    parts = np.array_split(np.arange(len(data)), RUNS)
    runs = [am.Recording(data.rows(rows).columns, f"run {i:02d}") for i, rows in enumerate(parts)]
    columns = design_matrix(data)
    force = data["force"]
    variants = {
        "`bootstrap`, including the fit": lambda: refit_library(runs),
        "loop over SciPy": lambda: refit_scipy(columns, force),
    }
    times = time_variants(variants, rounds)
    deviations = {name: call().std(axis=0) for name, call in variants.items()}
    (first, ours), (second, theirs) = deviations.items()
    differences = {first: 0.0, second: float(np.abs(theirs / ours - 1).max())}
    rows = tuple(
        (
            name,
            format_time(t.median),
            format_time(t.minimum),
            f"{t.ratio_to(times[first]):.3g}",
            f"{differences[name]:.0e}",
        )
        for name, t in times.items()
    )
    targets = (
        Target(
            "bootstrap, 1000 refits: loop over SciPy / library",
            times[second].ratio_to(times[first]),
            15,
            "x",
            True,
        ),
        Target(
            "bootstrap: difference of the standard deviations",
            differences[second],
            1e-6,
            "relative",
        ),
    )
    return Section("Bootstrap of the surface, 1000 refits", TEXT, HEADER, rows, targets)


if __name__ == "__main__":
    print_section(section())
