"""Tables of the chapter on Borzikova et al."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..characteristic.base import ContractionLaw
from ..characteristic.borzikova import PlaneCurves
from ..core.units import bar, percent
from ..identify.surface.basis import Basis, Chebyshev, LoadRange, Monomials, conditioning
from ..identify.surface.exponential import SurfaceFit, linearised, nonlinear
from ..identify.surface.monotone import monotonicity_breaks
from ..recording import Recording
from ..report.chapter import Table
from .borzikova_surfaces import (
    EXPONENTIAL,
    MONOTONE,
    PRINTED,
    CORRECTED,
    index_on_curves,
    add_noise,
    round_contraction,
)

SEEDS = range(100)
"""Of the noise drawn to compare the procedures; the first is the one shown alone."""
USABLE = (CORRECTED, EXPONENTIAL, MONOTONE)
"""The surfaces that one might compute with."""

CATALOGUE_TABLE = {
    "diameter [mm]": [6, 20, 30],
    "length [mm]": [150, 210, 290],
    "mass [g]": [10, 40, 80],
    "load at 3.5 bar [kg]": [3, 12, 35],
    "greatest load [kg]": [7, 20, 70],
}
CATALOGUE_TEXT = {
    "diameter [mm]": [12, 20, 30, 50],
    "length [mm]": [150, 210, 290, 400],
    "contraction [%]": [25, 25, 25, 25],
    "load [kg]": [3, 12, 30, 75],
}


def tables(curves: PlaneCurves, laws: Mapping[str, ContractionLaw]) -> tuple[Table, ...]:
    """All tables of the chapter."""
    data = curves.sample()
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
            "Plane curves, sampled",
            {
                "pressure [bar]": data["pressure"] / bar,
                "force [N]": data["force"],
                "contraction [%]": 100 * data["contraction"],
            },
            shown=False,
        ),
    )


def curve_table(curves: PlaneCurves) -> Table:
    """Where the plane curves start, turn and end."""
    rows = curves.curves
    end = curves.max_pressure
    return Table(
        "borzikova_curves",
        "Plane curves: printed index, ends, and the pressures at which they turn",
        {
            "force [N]": [c.force for c in rows],
            "index, printed [1]": [c.printed_index for c in rows],
            "contraction at 0 bar [%]": [round(100 * float(c.contraction(0.0)), 3) for c in rows],
            f"contraction at {end / bar:g} bar [%]": [round(100 * float(c.contraction(end)), 3) for c in rows],
            "turns at [bar]": [", ".join(f"{p / bar:.3f}" for p in c.turning_pressures()) for c in rows],
        },
        note="Where a curve turns inside 0 to 3.5 bar its contraction falls with pressure, which no muscle does.",
    )


def surface_table(curves: PlaneCurves, laws: Mapping[str, ContractionLaw]) -> Table:
    """Errors and indices of every surface on the plane curves."""
    upper = _sample_above_quarter_bar(curves)
    columns: dict[str, list[Any]] = {"surface": [], **{f"rms at {c.force:g} N [%]": [] for c in curves.curves}}
    columns |= {key: [] for key in ("rms [%]", "greatest error [%]", "1 - SSE/SST [1]", "index [1]")}
    for name, law in laws.items():
        errors = law.contraction(upper["pressure"], upper["force"]) - upper["contraction"]
        index = index_on_curves(law, curves)
        columns["surface"].append(name)
        for curve in curves.curves:
            columns[f"rms at {curve.force:g} N [%]"].append(_rms_text(errors[upper["force"] == curve.force]))
        columns["rms [%]"].append(_rms_text(errors))
        columns["greatest error [%]"].append(f"{100 * np.abs(errors).max():.3g}")
        columns["1 - SSE/SST [1]"].append(f"{index.explained:.5g}")
        columns["index [1]"].append("none" if index.value is None else f"{index.value:.4f}")
    return Table(
        "borzikova_surfaces",
        "Surfaces against the plane curves",
        dict(columns),
        note="Errors over 0.25 to 3.5 bar, where the curves make sense; indices over 0 to 3.5 bar.",
    )


def _sample_above_quarter_bar(curves: PlaneCurves) -> Recording:
    data = curves.sample(141)
    return data.rows(data["pressure"] >= 0.25 * bar)


def _rms_text(errors: np.ndarray) -> str:
    return f"{100 * np.sqrt(np.mean(errors**2)):.3g}"


def exponent_table(curves: PlaneCurves, laws: Mapping[str, ContractionLaw]) -> Table:
    """What the exponent of equation (1) is on the curves, and what the printed matrix would make of it."""
    pressures = np.linspace(0.0, curves.max_pressure, 351)
    printed, mended = laws[PRINTED], laws[CORRECTED]
    # the direct surface is this polynomial in per cent, so its contraction gives the sum
    return Table(
        "borzikova_exponent",
        "The printed matrix cannot be the exponent v: ranges over 0 to 3.5 bar",
        {
            "force [N]": [c.force for c in curves.curves],
            "v of the plane curve [1]": [_range_text(c.exponent(pressures)) for c in curves.curves],
            "v by the printed matrix [1]": [
                _range_text(printed.contraction(pressures, c.force) / percent) for c in curves.curves
            ],
            "v by the repaired matrix [1]": [
                _range_text(mended.contraction(pressures, c.force) / percent) for c in curves.curves
            ],
        },
        note="With v far below zero k is k_max whatever the pressure; with v = 20 it is about -1e10 %.",
    )


def _range_text(values: np.ndarray) -> str:
    return f"{values.min():.2f} to {values.max():.2f}"


def coefficient_table(curves: PlaneCurves) -> Table:
    """The exact coefficients of equation (1), and how far both procedures come from them."""
    exact = curves.interpolated()
    data, saturation = curves.sample(), curves.curves[0].saturation
    fits = [procedure(data, saturation).model.coefficients for procedure in (linearised, nonlinear)]
    powers = [(i, j) for i in range(exact.pressure_degree + 1) for j in range(exact.force_degree + 1)]
    return Table(
        "borzikova_coefficients",
        "Equation (1) through the plane curves: exact coefficients, and how the two fits differ from them",
        {
            "i (p, bar)": [i for i, _ in powers],
            "j (F, N)": [j for _, j in powers],
            "a_ij": [f"{a:.10e}" for a in exact.coefficients],
            "linearised - exact": [f"{a - b:.1e}" for a, b in zip(fits[0], exact.coefficients, strict=True)],
            "least squares - exact": [f"{a - b:.1e}" for a, b in zip(fits[1], exact.coefficients, strict=True)],
        },
    )


def procedure_table(data: Recording, saturation: float) -> Table:
    """The paper's linearisation against least squares on k, on disturbed data."""
    cases = {"undisturbed": data, "rounded to 0.5 %": round_contraction(data), "noise, sd 0.5 %, seed 0": add_noise(data, 0)}
    pairs = {name: _fit_both(recording, saturation) for name, recording in cases.items()}
    drawn = [_fit_both(add_noise(data, seed), saturation) for seed in SEEDS]
    means = [float(np.mean([pair[n].rms for pair in drawn])) for n in (0, 1)]
    names = [*pairs, f"noise, sd 0.5 %, mean of {len(SEEDS)} seeds"]
    rms = [[*(pair[n].rms for pair in pairs.values()), means[n]] for n in (0, 1)]
    return Table(
        "borzikova_procedures",
        "LinearModel fit (the paper's) against least squares on k",
        {
            "data": names,
            "rms, linearised [%]": [f"{100 * r:.4f}" for r in rms[0]],
            "rms, least squares [%]": [f"{100 * r:.4f}" for r in rms[1]],
            "points not used by the linearised fit": [
                *(str(pair[0].dropped) for pair in pairs.values()),
                f"{sum(pair[0].dropped for pair in drawn)} in all",
            ],
        },
        note="15 even pressures on each of three curves; ln(1 - k/k_max) needs k < k_max.",
    )


def _fit_both(recording: Recording, saturation: float) -> tuple[SurfaceFit, SurfaceFit]:
    return linearised(recording, saturation), nonlinear(recording, saturation)


def conditioning_table(data: Recording) -> Table:
    """How well the data determine the 15 coefficients, in four scalings and with a load left out."""
    validity_range = LoadRange.of_recording(data)
    scalings: dict[str, Basis] = {
        "bar, N": Monomials(bar, 1.0),
        "Pa, N": Monomials(1.0, 1.0),
        "p/p_max, F/F_max": Monomials(validity_range.max_pressure, validity_range.max_force),
        "Chebyshev polynomials on the validity range": Chebyshev(validity_range),
    }
    found = {name: conditioning(data, basis) for name, basis in scalings.items()}
    two_loads = data.rows(data["force"] < validity_range.max_force)
    found["the same, without the greatest load"] = conditioning(two_loads, Chebyshev(validity_range))
    return Table(
        "borzikova_conditioning",
        "Rank and condition of the 15 coefficients",
        {
            "scaling": list(found),
            "rank of 15": [c.rank for c in found.values()],
            "condition [1]": ["infinite" if np.isinf(c.condition) else f"{c.condition:.1e}" for c in found.values()],
        },
    )


def violation_table(laws: Mapping[str, ContractionLaw]) -> Table:
    """The places where a surface is impossible."""
    judged = {name: monotonicity_breaks(laws[name]) for name in USABLE}
    found = [(name, b) for name, breaks in judged.items() for b in breaks]
    kept = [name for name, breaks in judged.items() if not breaks]
    return Table(
        "borzikova_breaks",
        "Where a surface breaks monotonicity inside its validity range",
        {
            "surface": [name for name, _ in found],
            "rule broken": [b.rule.words for _, b in found],
            "pressure [bar]": [f"{b.pressure[0] / bar:.2f} to {b.pressure[1] / bar:.2f}" for _, b in found],
            "force [N]": [f"{b.across[0]:.0f} to {b.across[1]:.0f}" for _, b in found],
            "part of the validity range [%]": [f"{100 * b.share:.1f}" for _, b in found],
            "most at [bar]": [f"{b.worst[0] / bar:.2f}" for _, b in found],
            "most at [N]": [f"{b.worst[1]:.0f}" for _, b in found],
        },
        note=f"Nowhere: {', '.join(kept) or 'none of them'}.",
    )


def minimum_table(curves: PlaneCurves, laws: Mapping[str, ContractionLaw]) -> Table:
    """The least contraction that a surface has between the two greater loads."""
    loads = sorted(c.force for c in curves.curves)[-2:]
    pressure, force = LoadRange(0.0, curves.max_pressure, loads[0], loads[1]).grid(351, 651)
    names = list(USABLE)
    depths = [np.asarray(laws[name].contraction(pressure, force)) for name in names]
    places = [np.unravel_index(int(k.argmin()), k.shape) for k in depths]
    return Table(
        "borzikova_dips",
        f"Least contraction between {loads[0]:g} and {loads[1]:g} N",
        {
            "surface": names,
            "contraction [%]": [f"{100 * k.min():.2f}" for k in depths],
            "pressure [bar]": [f"{pressure[at] / bar:.2f}" for at in places],
            "force [N]": [f"{force[at]:.0f}" for at in places],
        },
    )


def catalogue_tables() -> tuple[Table, Table]:
    """The catalogue of Shadow Air Muscles as the paper has it: a table and a text that disagree."""
    note = "Table and text of the same paper disagree on sizes and loads; both are kept."
    table, text = ("Catalogue of Shadow Air Muscles, the paper's " + which for which in ("table", "text"))
    return (
        Table("borzikova_catalogue_table", table, dict(CATALOGUE_TABLE), note=note),
        Table("borzikova_catalogue_text", text, dict(CATALOGUE_TEXT), note=note),
    )
