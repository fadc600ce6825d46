"""Plots of a fit as curves: isometric ramps at the held contractions, and confidence and prediction bands."""

import dataclasses
from typing import Any, NamedTuple

import numpy as np

from ...core import Array, IdentificationError, level_text, plotting
from ...recording import Recording
from ...recording.columns import display_scale
from ...report.chapter import Plot
from . import Band, Fit, confidence_band
from .candidates import evaluate_force
from .cross_validation import LEVEL_TOLERANCE, MAX_LEVEL_WIDTH, held_levels, is_pressure_ramp, levels_of
from .problem import with_length

MAX_PANELS, MAX_RAMPS = 4, 6
"""Maximum numbers of resting lengths, and of contractions for each of them; evenly selected if there are more."""
POINTS = 121
LEVEL = 0.95
MAX_CURVES = 5
"""Maximum number of curves: more bands would overlap."""


def ramp_plot(fit: Fit) -> Plot | None:
    """Return measured and modelled force over pressure at the held contractions; None if the pressure was not swept
    at held contractions."""
    data = fit.recording
    if not is_pressure_ramp(data["pressure"], data["contraction"]):
        return None
    lengths = data.columns.get("resting_length")
    panels: list[float | None] = [None] if lengths is None else [float(x) for x in levels_of(lengths, MAX_PANELS)]
    columns = min(2, len(panels))
    rows = -(-len(panels) // columns)
    width, height = (6.3, 3.6) if len(panels) == 1 else (7.4, 2.9 * rows + 0.4)
    figure, axes = plotting.new_figure(rows, columns, width=width, height=height, squeeze=False, sharey=True)
    for axis, length in zip(axes.ravel(), panels, strict=False):
        selected = np.full(len(data), True) if lengths is None or length is None else _at(lengths, length)
        _draw_panel(axis, fit, data.rows(selected), length)
    for axis in axes.ravel()[len(panels) :]:
        axis.set_visible(False)
    for axis in axes[:, 0]:
        axis.set_ylabel("force [N]")
    caption = "Force over gauge pressure at the held contractions; points: measured, lines: model."
    return Plot("ramps", caption, figure)


def _at(values: Array, level: float) -> Any:
    return np.abs(values - level) <= MAX_LEVEL_WIDTH * LEVEL_TOLERANCE * np.abs(values).max()


def _draw_panel(axes: Any, fit: Fit, data: Recording, length: float | None) -> None:
    """Draw the ramps of one resting length [m]."""
    law = with_length(fit.model, length)
    levels = held_levels(data["contraction"]).values
    selected = levels[np.unique(np.linspace(0, levels.size - 1, min(levels.size, MAX_RAMPS)).astype(int))]
    for i, level in enumerate(selected):
        rows = data.rows(_at(data["contraction"], level) if levels.size > 1 else slice(None))
        pressure = np.linspace(rows["pressure"].min(), rows["pressure"].max(), POINTS)
        force = evaluate_force(law, pressure, np.full(POINTS, level), float(fit.recording["force"].max()))
        colour, marker = plotting.LINES[i % len(plotting.LINES)], plotting.MARKERS[i % len(plotting.MARKERS)]
        points = {"linestyle": "none", "marker": marker, "markersize": 2.2, "alpha": 0.45, "markeredgewidth": 0.5}
        axes.plot(rows["pressure"] / 1e3, rows["force"], color=colour, **points)
        label = level_text("contraction", float(level), float(np.abs(levels).max()))
        style = {"linestyle": plotting.DASHES[i % len(plotting.DASHES)], "linewidth": 1.6}
        axes.plot(pressure / 1e3, force, color=colour, label=label, **style)
    axes.set(xlabel="gauge pressure [kPa]")
    if length is not None:
        axes.set_title(f"resting length {1e3 * length:.4g} mm", fontsize=9)
    axes.legend(title="contraction", loc="upper left", fontsize=8, title_fontsize=8, frameon=False)


class CurveAxes(NamedTuple):
    """The quantity that is constant on a curve, and the one that varies along it."""

    constant: str
    varying: str


_CURVE_AXES = {
    "force": CurveAxes("pressure", "contraction"),
    "contraction": CurveAxes("pressure", "force"),
    "pressure": CurveAxes("contraction", "force"),
}

_CAPTION = (
    "Left: 95 % confidence bands (dark) and prediction bands of one further measurement (light) at measured levels. "
    "Right: half width of the confidence bands (thick) and the prediction bands (thin), for non-negative forces. The "
    "variance of the parameters is estimated "
)


@dataclasses.dataclass(frozen=True, eq=False)
class BandCurve:
    """A fitted curve at one level of the held quantity, with both 95 % bands; SI, shape (N,) each."""

    level: float
    points: Array
    """Values of the quantity along the curve."""
    confidence: Band
    prediction: Band


def band_curves(fit: Fit) -> tuple[CurveAxes, tuple[BandCurve, ...]] | None:
    """Return the fitted curves at measured levels with their bands; None if no band can be computed.

    They are over the pressure if it was swept at held contractions.
    """
    data, quantity = fit.recording, fit.fitted_quantity.name
    ramp = quantity == "force" and is_pressure_ramp(data["pressure"], data["contraction"])
    curve, curves = CurveAxes("contraction", "pressure") if ramp else _CURVE_AXES[quantity], []
    for level in levels_of(fit.recording[curve.constant], MAX_CURVES):
        points = _curve_points(fit, curve, float(level))
        try:
            bands = [confidence_band(fit, points, level=LEVEL, prediction=further) for further in (False, True)]
        except IdentificationError:
            return None
        curves.append(BandCurve(float(level), points[curve.varying], *bands))
    return curve, tuple(curves)


def band_plot(fit: Fit) -> Plot | None:
    """Return the fitted curves with 95 % bands and the half width of the bands; None if no band can be computed."""
    computed, quantity = band_curves(fit), fit.fitted_quantity.name
    if computed is None:
        return None
    curve, curves = computed
    figure, (left, right) = plotting.new_figure(1, 2, width=7.4, height=3.7)
    (factor, unit), (x_factor, x_unit) = display_scale(quantity), display_scale(curve.varying)
    for i, each in enumerate(curves):
        confidence, prediction = each.confidence, each.prediction
        colour = plotting.LINES[i % len(plotting.LINES)]
        x = x_factor * np.where(confidence.value < 0 if quantity == "force" else False, np.nan, each.points)
        label = level_text(curve.constant, each.level, max(abs(other.level) for other in curves))
        style = {"color": colour, "linestyle": plotting.DASHES[i % 5]}
        left.plot(x, factor * confidence.value, label=label, **style)
        left.fill_between(x, factor * prediction.low, factor * prediction.high, color=colour, alpha=0.15, linewidth=0)
        left.fill_between(x, factor * confidence.low, factor * confidence.high, color=colour, alpha=0.35, linewidth=0)
        right.plot(x, factor * (confidence.high - confidence.value), **style)
        right.plot(x, factor * (prediction.high - prediction.value), color=colour, linewidth=0.7, alpha=0.7)
    _draw_measured(left, fit, curve, factor, x_factor)
    left.set(xlabel=f"{curve.varying} [{x_unit}]", ylabel=f"{quantity} [{unit}]")
    right.set(xlabel=f"{curve.varying} [{x_unit}]", ylabel=f"half width of the band [{unit}]", ylim=(0.0, None))
    plotting.legend_below(figure, left, columns=MAX_CURVES + 1)
    return Plot("bands", f"{_CAPTION}{fit.error_basis}.", figure)


def _curve_points(fit: Fit, curve: CurveAxes, level: float) -> Recording:
    """Return points over the range of the data at one level, for the median resting length."""
    low, high = fit.data_ranges[curve.varying]
    columns = {curve.varying: np.linspace(low, high, POINTS), curve.constant: np.full(POINTS, level)}
    lengths = fit.recording.columns.get("resting_length")
    constants = {} if lengths is None else {"resting_length": float(np.median(lengths))}
    return Recording(columns, fit.recording.origin, constants)


def _draw_measured(axes: Any, fit: Fit, curve: CurveAxes, factor: float, x_factor: float) -> None:
    measured = fit.recording.rows(fit.censoring == 0)
    values = factor * measured[fit.fitted_quantity.name]
    style = {"marker": ".", "linestyle": "none", "markersize": 2, "color": plotting.BLACK, "alpha": 0.35}
    axes.plot(x_factor * measured[curve.varying], values, label="measured", **style)
    margin = 0.08 * float(np.ptp(values)) or 1.0
    axes.set_ylim(float(values.min()) - margin, float(values.max()) + margin)
