"""Fit of a contractile surface with 21 coefficients: the library and lmfit."""

from __future__ import annotations

import numpy as np
from filling import BOX, Array, measured_force
from measure import Section, Target, format_time, print_section, time_variants

import airmuscle as am

POINTS = 1000
NOISE = 2.0
HEADER = ("variant", "median", "minimum", "ratio to library", "maximum difference of a coefficient")
TEXT = (
    f"{POINTS} points of a synthetic muscle (see `filling.py`) with Gaussian noise of {NOISE:g} N;"
    " both scale contraction and pressure in the same way. Both compute standard errors and"
    " correlations, the library also rank and condition number. The residual for lmfit is a matrix"
    " product, the fastest form; one variant also gives this matrix as its derivative. Differences"
    " are relative to the largest coefficient of the library."
)


def make_points() -> am.Recording:
    """Forces with noise at random points of the validity range."""
    rng = np.random.default_rng(5)
    p, eps = (rng.uniform(*ends, POINTS) for ends in BOX)
    force = measured_force(p, eps) + NOISE * rng.standard_normal(POINTS)
    return am.Recording({"pressure": p, "contraction": eps, "force": force}, "benchmark")


def design_matrix(data: am.Recording) -> Array:
    """The powers of contraction and pressure, scaled to -1 to 1."""
    x, q = (2 * (v - v.min()) / np.ptp(v) - 1 for v in (data["contraction"], data["pressure"]))
    return np.column_stack([x**i * q**j for j in range(6) for i in range(6 - j)])


def fit_library(data: am.Recording) -> Array:
    """The coefficients fitted by the library, without censoring."""
    model = am.fit(
        am.characteristic.ContractileSurface.blank(), data, censoring=am.bench.UNCENSORED
    ).model
    assert isinstance(model, am.characteristic.ContractileSurface)
    return np.array(model.coefficients)


def fit_lmfit(data: am.Recording, columns: Array, derivative: bool) -> Array:
    """The coefficients fitted by lmfit (Levenberg-Marquardt from zero)."""
    import lmfit

    names = [f"a{i}" for i in range(columns.shape[1])]
    parameters = lmfit.Parameters()
    parameters.add_many(*((name, 0.0) for name in names))
    force = data["force"]

    def residual(values: lmfit.Parameters) -> Array:
        return np.asarray(columns @ [values[name].value for name in names] - force)

    settings = {"Dfun": lambda values: columns} if derivative else {}
    result = lmfit.minimize(residual, parameters, **settings)
    return np.array([result.params[name].value for name in names])


def section(rounds: int = 9) -> Section:
    """The complete benchmark."""
    data = make_points()
    columns = design_matrix(data)
    variants = {
        "`fit`": lambda: fit_library(data),
        "lmfit": lambda: fit_lmfit(data, columns, False),
        "lmfit with the derivative": lambda: fit_lmfit(data, columns, True),
    }
    times = time_variants(variants, rounds)
    coefficients = {name: call() for name, call in variants.items()}
    expected = coefficients["`fit`"]
    differences = {
        n: float(np.abs(c - expected).max() / np.abs(expected).max())
        for n, c in coefficients.items()
    }
    rows = tuple(
        (
            name,
            format_time(t.median),
            format_time(t.minimum),
            f"{t.ratio_to(times['`fit`']):.3g}",
            f"{differences[name]:.0e}",
        )
        for name, t in times.items()
    )
    target = Target(
        "21 coefficients: difference between library and lmfit",
        max(differences.values()),
        1e-8,
        "relative",
    )
    return Section(
        "Static fit of 21 coefficients, library and lmfit", TEXT, HEADER, rows, (target,)
    )


if __name__ == "__main__":
    print_section(section())
