"""Tables of the chapter on Borzíková et al."""

from collections.abc import Mapping
from typing import Any

import numpy as np

import airmuscle as am

from ..bench.identify.surface.basis import Basis, Chebyshev, LoadRange, Monomials, conditioning
from ..bench.identify.surface.exponential import SurfaceFit, fit_linearised, fit_nonlinear
from ..bench.identify.surface.monotonicity import find_monotonicity_violations
from ..core import bar, percent
from ..physics.muscle.characteristic.borzikova import PlaneCurves
from ..report.chapter import Table
from .borzikova_surfaces import (
    CORRECTED,
    EXPONENTIAL,
    MONOTONE,
    PRINTED,
    add_noise,
    index_on_curves,
    round_contraction,
    sample,
)

SEEDS = range(100)
"""Seeds of the noise in the comparison of the fitting procedures; the first one is also shown separately."""
USABLE = (CORRECTED, EXPONENTIAL, MONOTONE)
"""Surfaces that are suitable for computations."""

CATALOGUE_TABLE = {
    "diameter [mm]": [6, 20, 30],
    "length [mm]": [150, 210, 290],
    "mass [g]": [10, 40, 80],
    "load at 3.5 bar [kg]": [3, 12, 35],
    "maximum load [kg]": [7, 20, 70],
}
CATALOGUE_TEXT = {
    "diameter [mm]": [12, 20, 30, 50],
    "length [mm]": [150, 210, 290, 400],
    "contraction [%]": [25, 25, 25, 25],
    "load [kg]": [3, 12, 30, 75],
}


def tables(curves: PlaneCurves, laws: Mapping[str, am.characteristic.ContractionLaw]) -> tuple[Table, ...]:
    """Return all tables of the chapter."""
    data = sample(curves)
    saturation = curves.curves[0].saturation
    return (
        curve_table(curves),
        surface_table(curves, laws),
        exponent_table(curves, laws),
        coefficient_table(curves),
        procedure_table(data, saturation),
        conditioning_table(data),
        violation_table(laws),
        minimum_table(curves, laws),
        *catalogue_tables(),
        Table(
            "borzikova_points",
            "Sampled plane curves",
            {
                "pressure [bar]": data["pressure"] / bar,
                "force [N]": data["force"],
                "contraction [%]": 100 * data["contraction"],
            },
            shown=False,
        ),
    )


def curve_table(curves: PlaneCurves) -> Table:
    """Return the end points and turning points of the plane curves."""
    rows = curves.curves
    end = curves.max_pressure
    return Table(
        "borzikova_curves",
        "Plane curves: printed index, end points and turning points",
        {
            "force [N]": [c.force for c in rows],
            "printed index [1]": [c.printed_index for c in rows],
            "contraction at 0 bar [%]": [round(100 * float(c.contraction(0.0)), 3) for c in rows],
            f"contraction at {end / bar:g} bar [%]": [round(100 * float(c.contraction(end)), 3) for c in rows],
            "turning points [bar]": [", ".join(f"{p / bar:.3f}" for p in c.turning_pressures()) for c in rows],
        },
        note="Next to a turning point within 0 to 3.5 bar the contraction falls with pressure, which is not physical.",
    )


EXPLAINED = r"\(1 - \text{SSE}/\text{SST}\) [1]"


def surface_table(curves: PlaneCurves, laws: Mapping[str, am.characteristic.ContractionLaw]) -> Table:
    """Return the errors and correlation indices of all surfaces on the plane curves."""
    upper = _sample_above_quarter_bar(curves)
    columns: dict[str, list[Any]] = {"surface": [], **{f"rms error at {c.force:g} N [%]": [] for c in curves.curves}}
    columns |= {key: [] for key in ("rms error [%]", "maximum error [%]", EXPLAINED, "index [1]")}
    for name, law in laws.items():
        errors = law.contraction(upper["pressure"], upper["force"]) - upper["contraction"]
        index = index_on_curves(law, curves)
        columns["surface"].append(name)
        for curve in curves.curves:
            columns[f"rms error at {curve.force:g} N [%]"].append(_rms_text(errors[upper["force"] == curve.force]))
        columns["rms error [%]"].append(_rms_text(errors))
        columns["maximum error [%]"].append(f"{100 * np.abs(errors).max():.3g}")
        columns[EXPLAINED].append(f"{index.r_squared:.5g}")
        columns["index [1]"].append(None if index.value is None else f"{index.value:.4f}")
    return Table(
        "borzikova_surfaces",
        "Errors of the surfaces on the plane curves",
        dict(columns),
        note="Errors over 0.25 to 3.5 bar, where the curves are plausible; indices over 0 to 3.5 bar.",
    )


def _sample_above_quarter_bar(curves: PlaneCurves) -> am.Recording:
    data = sample(curves, 141)
    return data.rows(data["pressure"] >= 0.25 * bar)


def _rms_text(errors: np.ndarray) -> str:
    return f"{100 * np.sqrt(np.mean(errors**2)):.3g}"


def exponent_table(curves: PlaneCurves, laws: Mapping[str, am.characteristic.ContractionLaw]) -> Table:
    """Return the range of the exponent of equation (1) on the curves, and its range by the printed matrix."""
    pressures = np.linspace(0.0, curves.max_pressure, 351)
    printed, corrected = laws[PRINTED], laws[CORRECTED]
    # the direct surface is this polynomial in per cent, so its contraction in per cent is the sum
    return Table(
        "borzikova_exponent",
        r"Range of the exponent \(v\) over 0 to 3.5 bar",
        {
            "force [N]": [c.force for c in curves.curves],
            r"\(v\) of the plane curve [1]": [_range_text(c.exponent(pressures)) for c in curves.curves],
            r"\(v\) by the printed matrix [1]": [
                _range_text(printed.contraction(pressures, c.force) / percent) for c in curves.curves
            ],
            r"\(v\) by the corrected matrix [1]": [
                _range_text(corrected.contraction(pressures, c.force) / percent) for c in curves.curves
            ],
        },
        note=r"The printed matrix cannot be the exponent: for \(v \ll 0\), \(k = k_\text{max}\) at any pressure; for "
        r"\(v = 20\), \(k \approx -10^{10}\) %.",
    )


def _range_text(values: np.ndarray) -> str:
    return f"{values.min():.2f} to {values.max():.2f}"


def coefficient_table(curves: PlaneCurves) -> Table:
    """Return the exact coefficients of equation (1), and the deviations of both fitting procedures from them."""
    exact = curves.interpolate()
    data, saturation = sample(curves), curves.curves[0].saturation
    fits = [procedure(data, saturation).model.coefficients for procedure in (fit_linearised, fit_nonlinear)]
    powers = [(i, j) for i in range(exact.pressure_degree + 1) for j in range(exact.force_degree + 1)]
    return Table(
        "borzikova_coefficients",
        "Equation (1) through the plane curves: exact coefficients and deviations of the two fits",
        {
            r"\(i\) (power of \(p\) in bar)": [i for i, _ in powers],
            r"\(j\) (power of \(F\) in N)": [j for _, j in powers],
            r"\(a_{ij}\)": [f"{a:.10e}" for a in exact.coefficients],
            "linearised fit minus exact": [f"{a - b:.1e}" for a, b in zip(fits[0], exact.coefficients, strict=True)],
            "least squares minus exact": [f"{a - b:.1e}" for a, b in zip(fits[1], exact.coefficients, strict=True)],
        },
    )


def procedure_table(data: am.Recording, saturation: float) -> Table:
    """Return the errors of the paper's linearised fit and of least squares on k, for disturbed data."""
    cases = {
        "undisturbed": data,
        "rounded to 0.5 %": round_contraction(data),
        "noise 0.5 %, seed 0": add_noise(data, 0),
    }
    pairs = {name: _fit_both(recording, saturation) for name, recording in cases.items()}
    noise_fits = [_fit_both(add_noise(data, seed), saturation) for seed in SEEDS]
    means = [float(np.mean([pair[n].rmse for pair in noise_fits])) for n in (0, 1)]
    names = [*pairs, f"noise 0.5 %, mean of {len(SEEDS)} seeds"]
    rms = [[*(pair[n].rmse for pair in pairs.values()), means[n]] for n in (0, 1)]
    return Table(
        "borzikova_procedures",
        r"Linearised fit of the paper and least squares on \(k\)",
        {
            "data": names,
            "rms error, linearised [%]": [f"{100 * r:.4f}" for r in rms[0]],
            "rms error, least squares [%]": [f"{100 * r:.4f}" for r in rms[1]],
            "points excluded from the linearised fit": [
                *(str(pair[0].points_dropped) for pair in pairs.values()),
                f"{sum(pair[0].points_dropped for pair in noise_fits)} in total",
            ],
        },
        note=r"15 evenly spaced pressures on each of the three curves; noise: standard deviation. "
        r"\(\ln(1 - k/k_\text{max})\) requires \(k < k_\text{max}\).",
    )


def _fit_both(recording: am.Recording, saturation: float) -> tuple[SurfaceFit, SurfaceFit]:
    return fit_linearised(recording, saturation), fit_nonlinear(recording, saturation)


def conditioning_table(data: am.Recording) -> Table:
    """Return the rank and condition number of the 15 coefficients, in four scalings and without the largest load."""
    validity_range = LoadRange.from_recording(data)
    scalings: dict[str, Basis] = {
        "bar, N": Monomials(bar, 1.0),
        "Pa, N": Monomials(1.0, 1.0),
        r"\(p/p_\text{max}\), \(F/F_\text{max}\)": Monomials(validity_range.max_pressure, validity_range.max_force),
        "Chebyshev polynomials on the validity range": Chebyshev(validity_range),
    }
    designs = {name: conditioning(data, basis) for name, basis in scalings.items()}
    two_loads = data.rows(data["force"] < validity_range.max_force)
    designs["Chebyshev polynomials, without the largest load"] = conditioning(two_loads, Chebyshev(validity_range))
    return Table(
        "borzikova_conditioning",
        "Rank and condition number of the 15 coefficients",
        {
            "scaling": list(designs),
            "rank of 15": [c.rank for c in designs.values()],
            "condition number [1]": [
                "infinite" if np.isinf(c.condition) else f"{c.condition:.1e}" for c in designs.values()
            ],
        },
    )


def violation_table(laws: Mapping[str, am.characteristic.ContractionLaw]) -> Table:
    """Return the regions in which a surface violates monotonicity."""
    by_surface = {name: find_monotonicity_violations(laws[name]) for name in USABLE}
    violations = [(name, b) for name, breaks in by_surface.items() for b in breaks]
    monotone = [name for name, breaks in by_surface.items() if not breaks]
    return Table(
        "borzikova_breaks",
        "Monotonicity violations within the validity range",
        {
            "surface": [name for name, _ in violations],
            "violated constraint": [b.rule.description for _, b in violations],
            "pressure [bar]": [f"{b.pressure[0] / bar:.2f} to {b.pressure[1] / bar:.2f}" for _, b in violations],
            "force [N]": [f"{b.second_argument[0]:.0f} to {b.second_argument[1]:.0f}" for _, b in violations],
            "fraction of the validity range [%]": [f"{100 * b.area_fraction:.1f}" for _, b in violations],
            "worst point [bar]": [f"{b.worst_point[0] / bar:.2f}" for _, b in violations],
            "worst point [N]": [f"{b.worst_point[1]:.0f}" for _, b in violations],
        },
        note=f"Without violations: {', '.join(monotone) or 'none'}.",
    )


def minimum_table(curves: PlaneCurves, laws: Mapping[str, am.characteristic.ContractionLaw]) -> Table:
    """Return the minimum contraction of the surfaces between the two larger loads."""
    loads = sorted(c.force for c in curves.curves)[-2:]
    pressure, force = LoadRange(0.0, curves.max_pressure, loads[0], loads[1]).grid(351, 651)
    names = list(USABLE)
    contractions = [np.asarray(laws[name].contraction(pressure, force)) for name in names]
    points = [np.unravel_index(int(k.argmin()), k.shape) for k in contractions]
    return Table(
        "borzikova_dips",
        f"Minimum contraction between {loads[0]:g} and {loads[1]:g} N",
        {
            "surface": names,
            "contraction [%]": [f"{100 * k.min():.2f}" for k in contractions],
            "pressure [bar]": [f"{pressure[at] / bar:.2f}" for at in points],
            "force [N]": [f"{force[at]:.0f}" for at in points],
        },
    )


def catalogue_tables() -> tuple[Table, Table]:
    """Return the catalogue of Shadow Air Muscles as printed: the table and the text of the paper, which disagree."""
    note = "The table and the text of the paper disagree on sizes and loads."
    table, text = (f"Catalogue of Shadow Air Muscles, {source} of the paper" for source in ("table", "text"))
    return (
        Table("borzikova_catalogue_table", table, dict(CATALOGUE_TABLE), note=note),
        Table("borzikova_catalogue_text", text, dict(CATALOGUE_TEXT), note=note),
    )
