"""Figures of the chapter on Borzíková et al.: Figs. 2 to 5 of the paper, residuals and monotonicity
violations.
"""

import dataclasses
import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np

import airmuscle as am

from ..bench.estimation.statistics import CorrelationIndex, correlation_index
from ..bench.statics import LoadRange, fit_monotone
from ..core import AirmuscleWarning, Array, autodiff, bar
from ..core.plotting import (
    BLACK,
    BLUE,
    DASHES,
    LINES,
    MARKERS,
    ORANGE,
    RED,
    legend_outside,
    new_figure,
)
from ..files.library.loading import load_law
from ..physics.muscle.characteristic.borzikova import SAM_30X290, PlaneCurves
from ..report.chapter import Plot
from .run import captioned

Laws = Mapping[str, am.characteristic.ContractionLaw]
"""The surfaces of the chapter by name."""

MISPRINT_INDEX = 2
"""Index of a_02, whose exponent is misprinted, in the coefficients."""
CORRECTED_A02 = -7.55e-5

AS_EXPONENT = "printed matrix as exponent of (1)"
PRINTED = "direct, as printed"
MISPRINT_CORRECTED = r"direct, \(a_{02}\) corrected only"
CORRECTED = "direct, corrected"
EXPONENTIAL = "exponential (1), fitted here"
MONOTONE = "exponential (1), monotone"


def surfaces(curves: PlaneCurves = SAM_30X290) -> dict[str, am.characteristic.ContractionLaw]:
    """Return all surfaces of the chapter by name."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)  # the chapter shows the misprint
        printed = load_law("borzikova-direct-printed").characteristic
    corrected = load_law("borzikova-direct-repaired").characteristic
    exponential = load_law("borzikova-exponential").characteristic
    assert isinstance(printed, am.characteristic.BorzikovaDirect)
    assert isinstance(corrected, am.characteristic.BorzikovaDirect)
    assert isinstance(exponential, am.characteristic.BorzikovaExponential)
    k_max = curves.curves[0].saturation
    limits = LoadRange.from_law(printed)
    return {
        AS_EXPONENT: am.characteristic.BorzikovaExponential(
            printed.coefficients, *limits, saturation=k_max
        ),
        PRINTED: printed,
        MISPRINT_CORRECTED: with_a02(printed, CORRECTED_A02),
        CORRECTED: corrected,
        EXPONENTIAL: exponential,
        MONOTONE: fit_monotone(sample(curves), k_max).model,
    }


def sample(curves: PlaneCurves, points: int = 15) -> am.Recording:
    """Return a recording of `points` equidistant pressures from zero on every curve, curve after
    curve.
    """
    pressures = np.linspace(0.0, curves.max_pressure, points)
    return am.Recording(
        {
            "pressure": np.tile(pressures, len(curves.curves)),
            "force": np.repeat([c.force for c in curves.curves], points),
            "contraction": np.concatenate([c.contraction(pressures) for c in curves.curves]),
        },
        origin="plane curves of Borzíková et al., sampled",
        constants={"specimen": "Shadow Air Muscle SAM 30 x 290", "resting_length": 0.29},
        notes=("Curves fitted by the authors; the measured points are lost.",),
    )


def with_a02(
    law: am.characteristic.BorzikovaDirect, a02: float
) -> am.characteristic.BorzikovaDirect:
    """Return the surface with another coefficient of F^2."""
    coefficients = (
        *law.coefficients[:MISPRINT_INDEX],
        a02,
        *law.coefficients[MISPRINT_INDEX + 1 :],
    )
    return dataclasses.replace(law, coefficients=coefficients)


def index_on_curves(law: am.characteristic.ContractionLaw, curves: PlaneCurves) -> CorrelationIndex:
    """Return the correlation index of a surface at 15 evenly spaced pressures of each plane
    curve.
    """
    data = sample(curves)
    return correlation_index(data["contraction"], law.contraction(data["pressure"], data["force"]))


def round_contraction(recording: am.Recording, step: float = 0.005) -> am.Recording:
    """Return the recording with contractions rounded to multiples of `step` [1]."""
    return recording.with_columns(contraction=np.round(recording["contraction"] / step) * step)


def add_noise(recording: am.Recording, seed: int, deviation: float = 0.005) -> am.Recording:
    """Return the recording with normally distributed noise on the contractions, of standard
    deviation [1].
    """
    noise = deviation * np.random.default_rng(seed).standard_normal(len(recording))
    return recording.with_columns(contraction=recording["contraction"] + noise)


PRESSURE = "gauge pressure [bar]"
FORCE = "force [N]"
CONTRACTION = "contraction [%]"


def plots(curves: PlaneCurves, laws: Laws) -> tuple[Plot, ...]:
    """Return all figures of the chapter."""
    pressures = np.linspace(0.0, curves.max_pressure, 351)
    rows = curves.curves
    plane = {
        f"{c.force:g} N, printed index {c.printed_index:g}": c.contraction(pressures) for c in rows
    }
    fitted = {
        f"{c.force:g} N, monotone fit": laws[MONOTONE].contraction(pressures, c.force) for c in rows
    }
    monotone = Plot(
        "borzikova_monotone_fit", _monotone_caption(curves, laws[MONOTONE]), _points(curves, fitted)
    )
    return (
        dead_zone(curves, pressures),
        captioned("borzikova_points", _points(curves, {})),
        captioned("borzikova_plane_curves", _points(curves, plane)),
        surface(curves, laws[EXPONENTIAL], pressures),
        residuals(curves, laws, pressures),
        violations(laws),
        monotone,
    )


def dead_zone(curves: PlaneCurves, pressures: Array) -> Plot:
    """Return Fig. 2: dead zone and saturation."""
    figure, axes = new_figure()
    light = curves.curves[0]
    heavy = curves.curves[-1]
    for curve, colour, dash in ((light, LINES[0], DASHES[0]), (heavy, LINES[1], DASHES[1])):
        axes.plot(
            pressures / bar,
            100 * curve.contraction(pressures),
            dash,
            color=colour,
            label=f"{curve.force:g} N",
        )
    saturation = 100 * light.saturation
    axes.axhline(
        saturation,
        color=BLACK,
        linewidth=0.8,
        linestyle=":",
        label=rf"$k_\mathrm{{max}}$ = {saturation:g} %",
    )
    dead = pressures[np.flatnonzero(heavy.contraction(pressures) > 0.01)[0]] / bar
    axes.axvspan(
        0, dead, color=ORANGE, alpha=0.2, linewidth=0, label=f"dead zone at {heavy.force:g} N"
    )
    axes.set(xlabel=PRESSURE, ylabel=CONTRACTION, xlim=(0, pressures[-1] / bar))
    legend_outside(axes)
    caption = (
        "Dead zone and saturation, as in Fig. 2 of the paper, from its plane curves. The dead zone"
        f" is the pressure range in which the contraction at {heavy.force:g} N is below 1 %"
        f" (chosen): up to {dead:.2f} bar."
    )
    return Plot("borzikova_dead_zone", caption, figure)


def _points(curves: PlaneCurves, lines: Mapping[str, Any]) -> Any:
    """Draw the points of Fig. 3, and a line of contractions over the pressure for each curve, by
    its label.
    """
    figure, axes = new_figure()
    data = sample(curves)
    for curve, colour, marker in zip(curves.curves, LINES, MARKERS, strict=False):
        rows = data.rows(data["force"] == curve.force)
        x = rows["pressure"] / bar
        y = 100 * rows["contraction"]
        axes.plot(x, y, marker, color=colour, label=f"{curve.force:g} N, points of the curve")
    for (label, contraction), colour, dash in zip(lines.items(), LINES, DASHES, strict=False):
        pressures = np.linspace(0.0, curves.max_pressure, len(contraction)) / bar
        axes.plot(
            pressures, 100 * np.asarray(contraction), color=colour, linestyle=dash, label=label
        )
    if lines:
        axes.axhline(0.0, color=BLACK, linewidth=0.6)
    axes.set(xlabel=PRESSURE, ylabel=CONTRACTION)
    legend_outside(axes)
    return figure


def _monotone_caption(curves: PlaneCurves, law: am.characteristic.ContractionLaw) -> str:
    """Return the errors of the monotone fit on the plane curves, and their reason."""
    data = sample(curves)
    errors = np.asarray(law.contraction(data["pressure"], data["force"])) - data["contraction"]
    worst = int(np.abs(errors).argmax())
    return (
        f"Monotone fit and plane curves: rms error {100 * np.sqrt(np.mean(errors**2)):.2f} %,"
        f" maximum error {100 * abs(errors[worst]):.1f} % ({data['pressure'][worst] / bar:.2f} bar,"
        f" {data['force'][worst]:g} N). A polynomial of degree 2 in force cannot follow the curves"
        " from 45 to 130 N and remain monotone up to 260 N; below 0.28 bar the curves themselves"
        " are not monotone."
    )


def surface(curves: PlaneCurves, law: am.characteristic.ContractionLaw, pressures: Array) -> Plot:
    """Return Fig. 5: the surface."""
    figure, axes = new_figure(height=4.4, subplot_kw={"projection": "3d", "computed_zorder": False})
    pressure, force = LoadRange.from_law(law).grid(36, 31)
    contraction = 100 * np.asarray(law.contraction(pressure, force))
    style: dict[str, Any] = {
        "cmap": "cividis",
        "alpha": 0.85,
        "linewidth": 0.15,
        "edgecolor": BLACK,
    }
    axes.plot_surface(pressure / bar, force, contraction, rstride=1, cstride=1, zorder=1, **style)
    for curve in curves.curves:
        # slightly above the surface, which would otherwise hide half of each line
        height = 100 * curve.contraction(pressures) + 0.4
        axes.plot(
            pressures / bar,
            np.full_like(pressures, curve.force),
            height,
            color=RED,
            linewidth=2,
            zorder=2,
        )
    axes.set(xlabel=PRESSURE, ylabel=FORCE, zlabel=CONTRACTION)
    axes.set_box_aspect((1.3, 1.2, 0.9), zoom=0.97)
    axes.view_init(elev=24, azim=-128)
    return captioned("borzikova_surface", figure)


def residuals(curves: PlaneCurves, laws: Laws, pressures: Array) -> Plot:
    """Return the residuals on the curves, and the difference of the two surfaces between them."""
    figure, (left, right) = new_figure(1, 2, width=7.6, height=3.3)
    corrected = laws[CORRECTED]
    misprint = laws[MISPRINT_CORRECTED]
    for curve, colour, dash in zip(curves.curves, LINES, DASHES, strict=False):
        error = corrected.contraction(pressures, curve.force) - curve.contraction(pressures)
        left.plot(
            pressures / bar, 100 * error, color=colour, linestyle=dash, label=f"{curve.force:g} N"
        )
        right.axhline(curve.force, color=BLACK, linewidth=0.8, linestyle=":")
    left.set(xlabel=PRESSURE, ylabel="corrected direct surface $-$ plane curve [%]")
    left.set_title("on the plane curves", fontsize=9)
    left.legend(loc="upper right", frameon=False, fontsize=8)
    pressure, force = LoadRange.from_law(corrected).grid(141, 141)
    difference = 100 * (
        corrected.contraction(pressure, force) - laws[EXPONENTIAL].contraction(pressure, force)
    )
    limit = float(np.ceil(np.abs(difference).max()))
    filled = right.contourf(
        pressure / bar, force, difference, np.linspace(-limit, limit, 17), cmap="PuOr"
    )
    right.set(xlabel=PRESSURE, ylabel=FORCE)
    right.set_title("corrected direct $-$ exponential surface", fontsize=9)
    right.grid(visible=False)
    scale = figure.colorbar(filled, ax=right)
    scale.set_label("difference in contraction [%]", fontsize=9)
    scale.ax.tick_params(labelsize=8)
    errors = misprint.contraction(pressures, 260.0) - curves.curve_at(260.0).contraction(pressures)
    caption = (
        r"Left: error of the corrected direct surface on the plane curves (with only \(a_{02}\)"
        r" corrected, up to "
        f"{100 * np.abs(errors).max():.0f} % at 260 N). Right: difference of the two surfaces;"
        " dotted: loads of the "
        "plane curves."
    )
    return Plot("borzikova_residuals", caption, figure)


def violations(laws: Laws) -> Plot:
    """Return the regions in which the surfaces increase with force or decrease with pressure."""
    from matplotlib.patches import Patch

    figure, panels = new_figure(1, 3, width=7.6, height=3.3, sharey=True)
    for axes, name in zip(panels, (CORRECTED, EXPONENTIAL, MONOTONE), strict=True):
        law = laws[name]
        pressure, force = LoadRange.from_law(law).grid(201, 201)
        contraction = 100 * np.asarray(law.contraction(pressure, force))
        for argument, sign, colour in ((1, 1.0, RED), (0, -1.0, BLUE)):
            slope = sign * autodiff.derivative(law, "contraction", pressure, force, wrt=argument)
            if (slope > 0).any():
                axes.contourf(
                    pressure / bar, force, slope, [0.0, np.inf], colors=[colour], alpha=0.3
                )
        lines = axes.contour(
            pressure / bar, force, contraction, np.arange(-5, 41, 5), colors=BLACK, linewidths=0.7
        )
        axes.clabel(lines, fmt="%g", fontsize=7)
        axes.set(xlabel=PRESSURE)
        axes.set_title(name, fontsize=9)
        axes.grid(visible=False)
    panels[0].set_ylabel(FORCE)
    labels = {RED: "contraction increases with force", BLUE: "contraction decreases with pressure"}
    patches = [Patch(color=colour, alpha=0.3, label=label) for colour, label in labels.items()]
    figure.legend(handles=patches, loc="outside lower center", ncols=2, frameon=False, fontsize=8)
    return captioned("borzikova_monotonicity", figure)
