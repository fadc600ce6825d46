"""Figures 2 to 5 of Borzikova et al. again, and what their paper does not show: residuals and impossible places."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..characteristic.base import ContractionLaw
from ..characteristic.borzikova import PlaneCurves
from ..core import autodiff
from ..core.plotting import BLACK, BLUE, DASHES, LINES, MARKERS, ORANGE, RED, legend_outside, new_figure
from ..core.units import bar
from ..identify.surface.basis import LoadRange
from ..report.chapter import Plot
from .borzikova_surfaces import EXPONENTIAL, MISPRINT_CORRECTED, MONOTONE, CORRECTED

PRESSURE, FORCE, CONTRACTION = "gauge pressure [bar]", "force [N]", "contraction [%]"


def plots(curves: PlaneCurves, laws: Mapping[str, ContractionLaw]) -> tuple[Plot, ...]:
    """All figures of the chapter."""
    return (
        dead_zone(curves),
        points(curves),
        plane_curves(curves),
        surface(curves, laws[EXPONENTIAL]),
        residuals(curves, laws),
        violations(laws),
        monotone_fit(curves, laws[MONOTONE]),
    )


def dead_zone(curves: PlaneCurves) -> Plot:
    """Figure 2: nothing happens at first, and in the end the muscle saturates."""
    figure, axes = new_figure()
    pressures = _pressures(curves)
    least, greatest = curves.curves[0], curves.curves[-1]
    for curve, colour, dash in ((least, LINES[0], DASHES[0]), (greatest, LINES[1], DASHES[1])):
        axes.plot(pressures / bar, 100 * curve.contraction(pressures), dash, color=colour, label=f"{curve.force:g} N")
    saturation = 100 * least.saturation
    axes.axhline(saturation, color=BLACK, linewidth=0.8, linestyle=":", label=f"$k_{{max}}$ = {saturation:g} %")
    dead = pressures[np.flatnonzero(greatest.contraction(pressures) > 0.01)[0]] / bar
    axes.axvspan(0, dead, color=ORANGE, alpha=0.2, linewidth=0, label=f"dead zone under {greatest.force:g} N")
    axes.set(xlabel=PRESSURE, ylabel=CONTRACTION, xlim=(0, pressures[-1] / bar))
    legend_outside(axes)
    caption = (
        "Dead zone and saturation, as in Fig. 2 of the paper (drawn from its plane curves). The dead zone is where "
        f"the contraction under {greatest.force:g} N stays below 1 %, a limit chosen here: up to {dead:.2f} bar."
    )
    return Plot("borzikova_dead_zone", caption, figure)


def points(curves: PlaneCurves) -> Plot:
    """Figure 3: the points."""
    figure, axes = new_figure()
    _draw_points(axes, curves)
    axes.set(xlabel=PRESSURE, ylabel=CONTRACTION)
    legend_outside(axes)
    caption = (
        "Points on the plane curves, in place of the measured points of Fig. 3 of the paper, which are lost: 15 even "
        "pressures under each load."
    )
    return Plot("borzikova_points", caption, figure)


def plane_curves(curves: PlaneCurves) -> Plot:
    """Figure 4: the plane curves."""
    figure, axes = new_figure()
    pressures = _pressures(curves)
    _draw_points(axes, curves)
    for curve, colour, dash in zip(curves.curves, LINES, DASHES, strict=False):
        label = f"{curve.force:g} N, printed index {curve.printed_index:g}"
        axes.plot(pressures / bar, 100 * curve.contraction(pressures), color=colour, linestyle=dash, label=label)
    axes.axhline(0.0, color=BLACK, linewidth=0.6)
    axes.set(xlabel=PRESSURE, ylabel=CONTRACTION)
    legend_outside(axes)
    caption = (
        "The plane characteristics of the paper, as in its Fig. 4. The curve under 45 N starts below zero, that under "
        "130 N turns over at 3.28 bar: traits of the fits, not of the muscle."
    )
    return Plot("borzikova_plane_curves", caption, figure)


def surface(curves: PlaneCurves, law: ContractionLaw) -> Plot:
    """Figure 5: the surface."""
    figure, axes = new_figure(height=4.4, subplot_kw={"projection": "3d", "computed_zorder": False})
    pressure, force = LoadRange.of_law(law).grid(36, 31)
    contraction = 100 * np.asarray(law.contraction(pressure, force))
    axes.plot_surface(
        pressure / bar, force, contraction, cmap="cividis", alpha=0.85, rstride=1, cstride=1,
        linewidth=0.15, edgecolor=BLACK, zorder=1,
    )  # fmt: skip
    pressures = _pressures(curves)
    for curve in curves.curves:
        # a little above the surface, which would hide the half of every line otherwise
        height = 100 * curve.contraction(pressures) + 0.4
        axes.plot(pressures / bar, np.full_like(pressures, curve.force), height, color=RED, linewidth=2, zorder=2)
    axes.set(xlabel=PRESSURE, ylabel=FORCE, zlabel=CONTRACTION)
    axes.set_box_aspect((1.3, 1.2, 0.9), zoom=0.97)
    axes.view_init(elev=24, azim=-128)
    caption = (
        "The exponential surface of equation (1), as in Fig. 5 of the paper, with its three plane curves (red): the "
        "coefficients behind the paper's own figure are not printed, these are the exact ones through its curves."
    )
    return Plot("borzikova_surface", caption, figure)


def residuals(curves: PlaneCurves, laws: Mapping[str, ContractionLaw]) -> Plot:
    """What is left on the curves, and how two surfaces that agree on them differ between."""
    figure, (left, right) = new_figure(1, 2, width=7.6, height=3.3)
    pressures = _pressures(curves)
    for curve, colour, dash in zip(curves.curves, LINES, DASHES, strict=False):
        error = laws[CORRECTED].contraction(pressures, curve.force) - curve.contraction(pressures)
        left.plot(pressures / bar, 100 * error, color=colour, linestyle=dash, label=f"{curve.force:g} N")
    left.set(xlabel=PRESSURE, ylabel="repaired direct - plane curve [%]")
    left.set_title("on the plane curves", fontsize=9)
    left.legend(loc="upper right", frameon=False, fontsize=8)
    pressure, force = LoadRange.of_law(laws[CORRECTED]).grid(141, 141)
    difference = 100 * (laws[CORRECTED].contraction(pressure, force) - laws[EXPONENTIAL].contraction(pressure, force))
    limit = float(np.ceil(np.abs(difference).max()))
    filled = right.contourf(pressure / bar, force, difference, np.linspace(-limit, limit, 17), cmap="PuOr")
    for curve in curves.curves:
        right.axhline(curve.force, color=BLACK, linewidth=0.8, linestyle=":")
    right.set(xlabel=PRESSURE, ylabel=FORCE)
    right.set_title("repaired direct - exponential", fontsize=9)
    right.grid(visible=False)
    scale = figure.colorbar(filled, ax=right)
    scale.set_label("difference in contraction [%]", fontsize=9)
    scale.ax.tick_params(labelsize=8)
    worst = np.abs(laws[MISPRINT_CORRECTED].contraction(pressures, 260.0) - curves.at(260.0).contraction(pressures)).max()
    caption = (
        "Left: the repaired direct surface against the plane curves (with a_02 mended alone it is off by up to "
        f"{100 * worst:.0f} % under 260 N). Right: the two surfaces against each other; dotted, the loads at which "
        "they were determined."
    )
    return Plot("borzikova_residuals", caption, figure)


def violations(laws: Mapping[str, ContractionLaw]) -> Plot:
    """Where surfaces rise with force or fall with pressure."""
    names = (CORRECTED, EXPONENTIAL, MONOTONE)
    figure, panels = new_figure(1, 3, width=7.6, height=3.3, sharey=True)
    levels = np.arange(-5, 41, 5)
    for axes, name in zip(panels, names, strict=True):
        law = laws[name]
        pressure, force = LoadRange.of_law(law).grid(201, 201)
        contraction = 100 * np.asarray(law.contraction(pressure, force))
        for argument, sign, colour in ((1, 1.0, RED), (0, -1.0, BLUE)):
            slope = sign * autodiff.derivative(law, "contraction", pressure, force, wrt=argument)
            if (slope > 0).any():
                axes.contourf(pressure / bar, force, slope, [0.0, np.inf], colors=[colour], alpha=0.3)
        lines = axes.contour(pressure / bar, force, contraction, levels, colors=BLACK, linewidths=0.7)
        axes.clabel(lines, fmt="%g", fontsize=7)
        axes.set(xlabel=PRESSURE)
        axes.set_title(name, fontsize=9)
        axes.grid(visible=False)
    panels[0].set_ylabel(FORCE)
    _violation_legend(figure)
    caption = (
        "Contraction in per cent (lines) inside the validity range, and where a surface is impossible: red, contraction rises "
        "with force; blue, it falls with pressure. The monotone fit has no such place."
    )
    return Plot("borzikova_monotonicity", caption, figure)


def _violation_legend(figure: Any) -> None:
    from matplotlib.patches import Patch

    shown = [
        Patch(color=RED, alpha=0.3, label="contraction rises with force"),
        Patch(color=BLUE, alpha=0.3, label="contraction falls with pressure"),
    ]
    figure.legend(handles=shown, loc="outside lower center", ncols=2, frameon=False, fontsize=8)


def monotone_fit(curves: PlaneCurves, law: ContractionLaw) -> Plot:
    """What it costs to be possible."""
    figure, axes = new_figure()
    pressures = _pressures(curves)
    _draw_points(axes, curves)
    for curve, colour, dash in zip(curves.curves, LINES, DASHES, strict=False):
        fitted = 100 * np.asarray(law.contraction(pressures, curve.force))
        axes.plot(pressures / bar, fitted, color=colour, linestyle=dash, label=f"{curve.force:g} N, monotone fit")
    axes.axhline(0.0, color=BLACK, linewidth=0.6)
    axes.set(xlabel=PRESSURE, ylabel=CONTRACTION)
    legend_outside(axes)
    data = curves.sample()
    errors = np.asarray(law.contraction(data["pressure"], data["force"])) - data["contraction"]
    worst = int(np.abs(errors).argmax())
    caption = (
        f"The monotone fit against the plane curves: rms {100 * np.sqrt(np.mean(errors**2)):.2f} %, at most "
        f"{100 * abs(errors[worst]):.1f} % ({data['pressure'][worst] / bar:.2f} bar, {data['force'][worst]:g} N). Its "
        "second degree in force cannot bend from 45 to 130 N as the curves do without turning over before 260 N; "
        "below 0.28 bar the curves themselves break what it keeps."
    )
    return Plot("borzikova_monotone_fit", caption, figure)


def _pressures(curves: PlaneCurves) -> np.ndarray:
    return np.linspace(0.0, curves.max_pressure, 351)


def _draw_points(axes: Any, curves: PlaneCurves) -> None:
    data = curves.sample()
    for curve, colour, marker in zip(curves.curves, LINES, MARKERS, strict=False):
        rows = data.rows(data["force"] == curve.force)
        x, y = rows["pressure"] / bar, 100 * rows["contraction"]
        axes.plot(x, y, marker, color=colour, label=f"{curve.force:g} N, points of the curve")
