"""The 21 coefficients of a contractile surface, fitted by the library and by lmfit from the same points."""

from __future__ import annotations

import numpy as np
from filling import BOX, Array, measured_force
from measure import Bar, Section, interleaved, of_time, show

from airmuscle.characteristic.contractile_surface import ContractileSurface, exponents
from airmuscle.identify.censoring import UNCENSORED
from airmuscle.identify.static_fit import fit
from airmuscle.recording import Recording

POINTS = 1000
NOISE = 2.0
HEADING = ("variant", "median", "least", "times the library", "greatest difference of a coefficient")
TEXT = (
    f"{POINTS} points of a chosen muscle (see `filling.py`) with Gaussian noise of {NOISE:g} N; both scale contraction "
    "and pressure alike. Both give standard deviations and correlations, the library also rank and condition. lmfit is "
    "given the residual as a matrix product, the quickest form a user could write, "
    "and once also that matrix as its derivative. Differences are from the library's answer, relative to its greatest "
    "coefficient."
)


def points() -> Recording:
    """Noisy forces at random points of the validity range."""
    rng = np.random.default_rng(5)
    p, eps = (rng.uniform(*ends, POINTS) for ends in BOX)
    force = measured_force(p, eps) + NOISE * rng.standard_normal(POINTS)
    return Recording({"pressure": p, "contraction": eps, "force": force}, "benchmark")


def matrix(data: Recording) -> Array:
    """The powers of contraction and pressure, scaled to -1..1, as a user of lmfit writes them once."""
    x, q = (2 * (v - v.min()) / np.ptp(v) - 1 for v in (data["contraction"], data["pressure"]))
    return np.column_stack([x**i * q**j for i, j in exponents(5)])


def by_library(data: Recording) -> Array:
    """The coefficients that `fit` finds; every row counts."""
    model = fit(ContractileSurface.blank(), data, censoring=UNCENSORED).model
    assert isinstance(model, ContractileSurface)
    return np.array(model.coefficients)


def by_lmfit(data: Recording, columns: Array, derivative: bool) -> Array:
    """The coefficients that lmfit finds by Levenberg and Marquardt from zero."""
    import lmfit

    names = [f"a{i}" for i in range(columns.shape[1])]
    parameters = lmfit.Parameters()
    parameters.add_many(*((name, 0.0) for name in names))
    force = data["force"]

    def residual(values: lmfit.Parameters) -> Array:
        return np.asarray(columns @ [values[name].value for name in names] - force)

    settings = {"Dfun": lambda values: columns} if derivative else {}
    found = lmfit.minimize(residual, parameters, **settings)
    return np.array([found.params[name].value for name in names])


def section(rounds: int = 9) -> Section:
    """The whole comparison."""
    data = points()
    columns = matrix(data)
    variants = {
        "`fit`": lambda: by_library(data),
        "lmfit": lambda: by_lmfit(data, columns, False),
        "lmfit with the derivative": lambda: by_lmfit(data, columns, True),
    }
    times = interleaved(variants, rounds)
    answers = {name: call() for name, call in variants.items()}
    ours = answers["`fit`"]
    apart = {name: float(np.abs(found - ours).max() / np.abs(ours).max()) for name, found in answers.items()}
    rows = tuple(
        (name, of_time(t.median), of_time(t.least), f"{t.ratio_to(times['`fit`']):.3g}", f"{apart[name]:.0e}")
        for name, t in times.items()
    )
    bar = Bar("21 coefficients: library and lmfit agree", max(apart.values()), 1e-8, "of the greatest")
    return Section("Static fit of 21 coefficients against lmfit", TEXT, HEADING, rows, (bar,))


if __name__ == "__main__":
    show(section())
