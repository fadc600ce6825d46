"""A bootstrap of the 21-coefficient surface by runs: 1000 refits by the library and by a loop over SciPy."""

from __future__ import annotations

import numpy as np
from measure import Bar, Section, interleaved, of_time, show
from static_fit import matrix, points

from airmuscle.characteristic.contractile_surface import ContractileSurface
from airmuscle.identify.bootstrapping import bootstrap
from airmuscle.identify.censoring import UNCENSORED
from airmuscle.identify.cross_validation import RunSplit
from airmuscle.identify.static_fit import fit
from airmuscle.recording import Recording

REFITS = 1000
RUNS = 20
HEADING = ("variant", "median", "least", "times the library", "greatest difference of a standard deviation")
TEXT = (
    f"The points of the static fit cut into {RUNS} runs, {REFITS} draws of as many runs with replacement. SciPy's loop "
    "calls `scipy.linalg.lstsq` on the rows of each draw, the matrix of scaled powers made once. Both draw the same "
    "runs. The library sums one normal matrix a run, in an orthonormal basis, and takes all draws in one product."
)


def by_library(runs: list[Recording]) -> np.ndarray:
    """Coefficients of every refit; the fit itself is not counted as saved."""
    found = fit(ContractileSurface.blank(), runs, censoring=UNCENSORED)
    return bootstrap(found, runs, refits=REFITS, by=RunSplit(), seed=0).values


def by_scipy(columns: np.ndarray, force: np.ndarray) -> np.ndarray:
    """The same by a loop."""
    from scipy.linalg import lstsq

    drawn = np.random.default_rng(0).multinomial(RUNS, np.full(RUNS, 1 / RUNS), size=REFITS)
    # np.unique sorts the runs' names, as the library does
    blocks = np.array_split(np.arange(force.size), RUNS)
    found = []
    for counts in drawn:
        rows = np.concatenate([block for block, n in zip(blocks, counts, strict=True) for _ in range(n)])
        found.append(lstsq(columns[rows], force[rows], check_finite=False)[0])
    return np.array(found)


def section(rounds: int = 5) -> Section:
    """The whole comparison."""
    whole = points()
    parts = np.array_split(np.arange(len(whole)), RUNS)
    runs = [Recording(whole.rows(rows).columns, f"run {i:02d}") for i, rows in enumerate(parts)]
    columns, force = matrix(whole), whole["force"]
    variants = {
        "`bootstrap`, its fit included": lambda: by_library(runs),
        "SciPy in a loop": lambda: by_scipy(columns, force),
    }
    times = interleaved(variants, rounds)
    scatter = {name: call().std(axis=0) for name, call in variants.items()}
    (first, ours), (second, theirs) = scatter.items()
    apart = {first: 0.0, second: float(np.abs(theirs / ours - 1).max())}
    rows = tuple(
        (name, of_time(t.median), of_time(t.least), f"{t.ratio_to(times[first]):.3g}", f"{apart[name]:.0e}")
        for name, t in times.items()
    )
    bars = (
        Bar(
            "bootstrap, 1000 refits: library against a SciPy loop",
            times[second].ratio_to(times[first]),
            15,
            "times",
            True,
        ),
        Bar("bootstrap: standard deviations agree", apart[second], 1e-6, "relative"),
    )
    return Section("Bootstrap of the surface, 1000 refits", TEXT, HEADING, rows, bars)


if __name__ == "__main__":
    show(section())
