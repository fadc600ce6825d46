"""Tables of the chapter on Borzíková et al."""

from typing import Any

import numpy as np

import airmuscle as am

from ..bench.statics import (
    Chebyshev,
    LoadRange,
    Monomials,
    conditioning,
    find_monotonicity_violations,
)
from ..bench.statics.exponential_surface import SurfaceFit, fit_linearised, fit_nonlinear
from ..core import bar, percent
from ..physics.muscle.characteristic.borzikova import PlaneCurves
from ..report.chapter import Table
from . import borzikova_surfaces as surfaces
from .borzikova_surfaces import Laws, add_noise, index_on_curves, round_contraction, sample
from .run import titled

SEEDS = range(100)
"""Seeds of the noise in the comparison of the fitting procedures; the first one is also shown
separately.
"""
USABLE = (surfaces.CORRECTED, surfaces.EXPONENTIAL, surfaces.MONOTONE)
"""Surfaces that are suitable for computations."""

CATALOGUE_TABLE = titled("borzikova_catalogue_table")
CATALOGUE_TEXT = titled("borzikova_catalogue_text")
"""Catalogue of the paper as its table and as its text print it."""


def tables(curves: PlaneCurves, laws: Laws) -> tuple[Table, ...]:
    """Return all tables of the chapter."""
    data = sample(curves)
    points = {
        "pressure [bar]": data["pressure"] / bar,
        "force [N]": data["force"],
        "contraction [%]": 100 * data["contraction"],
    }
    return (
        curve_table(curves),
        surface_table(curves, laws),
        exponent_table(curves, laws),
        coefficient_table(curves),
        procedure_table(data, curves.curves[0].saturation),
        conditioning_table(data),
        violation_table(laws),
        minimum_table(curves, laws),
        CATALOGUE_TABLE,
        CATALOGUE_TEXT,
        titled("borzikova_points", points, shown=False),
    )


def curve_table(curves: PlaneCurves) -> Table:
    """Return the end points and turning points of the plane curves."""
    rows = curves.curves
    end = curves.max_pressure
    columns = {
        "force [N]": [c.force for c in rows],
        "printed index [1]": [c.printed_index for c in rows],
        "contraction at 0 bar [%]": [round(100 * float(c.contraction(0.0)), 3) for c in rows],
        f"contraction at {end / bar:g} bar [%]": [
            round(100 * float(c.contraction(end)), 3) for c in rows
        ],
        "turning points [bar]": [
            ", ".join(f"{p / bar:.3f}" for p in c.turning_pressures()) for c in rows
        ],
    }
    return titled("borzikova_curves", columns)


EXPLAINED = r"\(1 - \text{SSE}/\text{SST}\) [1]"


def surface_table(curves: PlaneCurves, laws: Laws) -> Table:
    """Return the errors and correlation indices of all surfaces on the plane curves."""
    data = sample(curves, 141)
    upper = data.rows(data["pressure"] >= 0.25 * bar)
    errors = [
        law.contraction(upper["pressure"], upper["force"]) - upper["contraction"]
        for law in laws.values()
    ]
    indices = [index_on_curves(law, curves) for law in laws.values()]
    at_load = {f"rms error at {c.force:g} N [%]": upper["force"] == c.force for c in curves.curves}
    columns = {
        "surface": list(laws),
        **{
            heading: [_rms_text(error[rows]) for error in errors]
            for heading, rows in at_load.items()
        },
        "rms error [%]": [_rms_text(error) for error in errors],
        "maximum error [%]": [f"{100 * np.abs(error).max():.3g}" for error in errors],
        EXPLAINED: [f"{index.r_squared:.5g}" for index in indices],
        "index [1]": [None if index.value is None else f"{index.value:.4f}" for index in indices],
    }
    return titled("borzikova_surfaces", columns)


def _rms_text(errors: np.ndarray) -> str:
    return f"{100 * np.sqrt(np.mean(errors**2)):.3g}"


def exponent_table(curves: PlaneCurves, laws: Laws) -> Table:
    """Return the range of the exponent of equation (1) on the curves, and its range by the printed
    matrix.
    """
    pressures = np.linspace(0.0, curves.max_pressure, 351)
    columns: dict[str, Any] = {
        "force [N]": [c.force for c in curves.curves],
        r"\(v\) of the plane curve [1]": [
            _range_text(c.exponent(pressures)) for c in curves.curves
        ],
    }
    # the direct surface is this polynomial in per cent, so its contraction in per cent is the sum
    for matrix, law in (
        ("printed", laws[surfaces.PRINTED]),
        ("corrected", laws[surfaces.CORRECTED]),
    ):
        exponents = [law.contraction(pressures, c.force) / percent for c in curves.curves]
        columns[rf"\(v\) by the {matrix} matrix [1]"] = list(map(_range_text, exponents))
    return titled("borzikova_exponent", columns)


def _range_text(values: np.ndarray) -> str:
    return f"{values.min():.2f} to {values.max():.2f}"


def coefficient_table(curves: PlaneCurves) -> Table:
    """Return the exact coefficients of equation (1), and the deviations of both fitting procedures
    from them.
    """
    exact = curves.interpolate()
    fits = [
        surface_fit.model.coefficients
        for surface_fit in _fit_both(sample(curves), curves.curves[0].saturation)
    ]
    powers = [
        (i, j) for i in range(exact.pressure_degree + 1) for j in range(exact.force_degree + 1)
    ]
    columns = {
        r"\(i\) (power of \(p\) in bar)": [i for i, _ in powers],
        r"\(j\) (power of \(F\) in N)": [j for _, j in powers],
        r"\(a_{ij}\)": [f"{a:.10e}" for a in exact.coefficients],
        "linearised fit minus exact": [
            f"{a - b:.1e}" for a, b in zip(fits[0], exact.coefficients, strict=True)
        ],
        "least squares minus exact": [
            f"{a - b:.1e}" for a, b in zip(fits[1], exact.coefficients, strict=True)
        ],
    }
    return titled("borzikova_coefficients", columns)


def procedure_table(data: am.Recording, saturation: float) -> Table:
    """Return the errors of the paper's linearised fit and of least squares on k, for disturbed
    data.
    """
    cases = {
        "undisturbed": data,
        "rounded to 0.5 %": round_contraction(data),
        "noise 0.5 %, seed 0": add_noise(data, 0),
    }
    pairs = {name: _fit_both(recording, saturation) for name, recording in cases.items()}
    noise_fits = [_fit_both(add_noise(data, seed), saturation) for seed in SEEDS]
    means = [float(np.mean([pair[n].rmse for pair in noise_fits])) for n in (0, 1)]
    rms = [[*(pair[n].rmse for pair in pairs.values()), means[n]] for n in (0, 1)]
    dropped = [str(pair[0].points_dropped) for pair in pairs.values()]
    columns = {
        "data": [*pairs, f"noise 0.5 %, mean of {len(SEEDS)} seeds"],
        "rms error, linearised [%]": [f"{100 * r:.4f}" for r in rms[0]],
        "rms error, least squares [%]": [f"{100 * r:.4f}" for r in rms[1]],
        "points excluded from the linearised fit": [
            *dropped,
            f"{sum(pair[0].points_dropped for pair in noise_fits)} in total",
        ],
    }
    return titled("borzikova_procedures", columns)


def _fit_both(recording: am.Recording, saturation: float) -> tuple[SurfaceFit, SurfaceFit]:
    return fit_linearised(recording, saturation), fit_nonlinear(recording, saturation)


def conditioning_table(data: am.Recording) -> Table:
    """Return the rank and condition number of the 15 coefficients, in four scalings and without the
    largest load.
    """
    limits = LoadRange.from_recording(data)
    scalings: dict[str, Monomials | Chebyshev] = {
        "bar, N": Monomials(bar, 1.0),
        "Pa, N": Monomials(1.0, 1.0),
        r"\(p/p_\text{max}\), \(F/F_\text{max}\)": Monomials(limits.max_pressure, limits.max_force),
        "Chebyshev polynomials on the validity range": Chebyshev(limits),
    }
    designs = {name: conditioning(data, basis) for name, basis in scalings.items()}
    two_loads = data.rows(data["force"] < limits.max_force)
    designs["Chebyshev polynomials, without the largest load"] = conditioning(
        two_loads, Chebyshev(limits)
    )
    numbers = [design.condition for design in designs.values()]
    columns: dict[str, Any] = {
        "scaling": list(designs),
        "rank of 15": [design.rank for design in designs.values()],
    }
    columns["condition number [1]"] = [
        "infinite" if np.isinf(number) else f"{number:.1e}" for number in numbers
    ]
    return titled("borzikova_conditioning", columns)


def violation_table(laws: Laws) -> Table:
    """Return the regions in which a surface violates monotonicity."""
    by_surface = {name: find_monotonicity_violations(laws[name]) for name in USABLE}
    violated = [
        (name, violation) for name, violations in by_surface.items() for violation in violations
    ]
    columns = {
        "surface": [name for name, _ in violated],
        "violated constraint": [b.rule.description for _, b in violated],
        "pressure [bar]": [
            f"{b.pressure[0] / bar:.2f} to {b.pressure[1] / bar:.2f}" for _, b in violated
        ],
        "force [N]": [
            f"{b.second_argument[0]:.0f} to {b.second_argument[1]:.0f}" for _, b in violated
        ],
        "fraction of the validity range [%]": [f"{100 * b.area_fraction:.1f}" for _, b in violated],
        "worst point [bar]": [f"{b.worst_point[0] / bar:.2f}" for _, b in violated],
        "worst point [N]": [f"{b.worst_point[1]:.0f}" for _, b in violated],
    }
    monotone = ", ".join(name for name, violations in by_surface.items() if not violations)
    return titled("borzikova_breaks", columns, note=f"Without violations: {monotone or 'none'}.")


def minimum_table(curves: PlaneCurves, laws: Laws) -> Table:
    """Return the minimum contraction of the surfaces between the two larger loads."""
    low, high = sorted(c.force for c in curves.curves)[-2:]
    pressure, force = LoadRange(0.0, curves.max_pressure, low, high).grid(351, 651)
    contractions = [np.asarray(laws[name].contraction(pressure, force)) for name in USABLE]
    points = [np.unravel_index(int(k.argmin()), k.shape) for k in contractions]
    columns = {
        "surface": list(USABLE),
        "contraction [%]": [f"{100 * k.min():.2f}" for k in contractions],
        "pressure [bar]": [f"{pressure[at] / bar:.2f}" for at in points],
        "force [N]": [f"{force[at]:.0f}" for at in points],
    }
    return Table("borzikova_dips", f"Minimum contraction between {low:g} and {high:g} N", columns)
