"""Report chapter of a static fit: equation of its law, isobars, isometric ramps, confidence and
prediction bands.
"""

import contextlib
import dataclasses
from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple, Protocol

import numpy as np

from ...core import (
    AirmuscleError,
    Array,
    IdentificationError,
    Reference,
    cite,
    level_text,
    plotting,
)
from ...physics.muscle.characteristic import PooledLengthLaw, ValidityRange
from ...physics.muscle.characteristic.energy_defect import maxwell_defect
from ...physics.muscle.geometry import Geometry
from ...physics.muscle.isobars import compute_isobars, isobar_figure
from ...recording import Recording
from ...recording.columns import display_scale
from ...report.chapter import (
    BY_ROW,
    Chapter,
    DisplayedEquation,
    NamedValue,
    Plot,
    Table,
    TableColumn,
)
from ...report.equation import LawEquation, law_equation
from ...report.equation.source_code import REMARKS, displayed_lines, source_codes
from ...report.formatting import format_number
from ..estimation import LEVEL_TOLERANCE, MAX_LEVEL_WIDTH, held_levels, is_pressure_ramp, levels_of
from .candidates import evaluate_force
from .energy_defect_values import defect_values
from .fit_problem import with_length
from .intervals import Band, confidence_band
from .static_fit_result import Fit
from .surface_violations import shape_violations_of_fit, violation_table

MAX_ISOBARS = 8
MAX_CURVES = 5
"""Maximum numbers of isobars, and of curves with bands, which would overlap."""
MAX_PANELS = 4
MAX_RAMPS = 6
"""Maximum numbers of resting lengths, and of contractions for each of them; evenly selected if
there are more.
"""
POINTS = 121
LEVEL = 0.95


class MuscleDescription(Protocol):
    """What a chapter states of a fitted muscle beside its law; a library Entry has it."""

    @property
    def title(self) -> str: ...
    @property
    def note(self) -> str: ...
    @property
    def geometry(self) -> Geometry | None: ...
    @property
    def validity_range(self) -> ValidityRange | None: ...


def fit_chapter(
    fit: Fit, entry: MuscleDescription, notes: Sequence[str] = (), of_recordings: Sequence[str] = ()
) -> Chapter:
    """Return the chapter of a fit with its muscle: equation, goodness of fit, parameters, isobars,
    residuals.

    notes          on the fit and the muscle
    of_recordings  notes on the reading of the data, for the page
    """
    chapter = fit.chapter()
    equations, symbols = equation_section(fit)
    data = fit.recording
    swept = is_pressure_ramp(
        data["pressure"], data["contraction"]
    )  # the pressures of isobars are then round
    curves = compute_isobars(
        fit.model,
        entry.validity_range,
        pressures=None if swept else levels_of(data["pressure"], MAX_ISOBARS),
    )
    isobars = Plot(
        "isobars",
        f"{entry.title}: force over contraction at constant gauge pressure.",
        partial(isobar_figure, fit.model, entry.title, curves, entry.validity_range, measured=data),
    )
    plots = (ramp_plot(fit), isobars, *chapter.plots, band_plot(fit))
    parameters, correlations = chapter.tables
    violations = shape_violations_of_fit(fit)
    title = "Monotonicity violations of the fitted law"
    broken = (violation_table(violations, "shape", title),) if violations else ()
    consistency: list[NamedValue] = []  # of the law with the volume of the muscle
    if entry.geometry is not None and entry.validity_range is not None:
        with contextlib.suppress(
            AirmuscleError
        ):  # slack everywhere, or contractions outside the geometry
            consistency = defect_values(
                maxwell_defect(fit.model, entry.geometry, entry.validity_range)
            )
    return dataclasses.replace(
        chapter,
        title=entry.title,
        summary=(*chapter.paragraphs, entry.note, *of_recordings),
        equations=equations,
        values=(
            *chapter.values,
            *(dataclasses.replace(value, brief=False) for value in consistency),
        ),
        tables=(*symbols, parameters, *broken, correlations, _rows(fit)),
        plots=tuple(filter(None, plots)),
        notes=(*chapter.notes, *notes),
        references=tuple(cite(entry)),
    )


def _rows(fit: Fit) -> Table:
    recording = fit.recording
    unit = fit.fitted_quantity.unit
    columns = {
        "pressure": TableColumn(recording["pressure"], "Pa"),
        "contraction": TableColumn(recording["contraction"], "1"),
        "force": TableColumn(recording["force"], "N"),
        f"modelled {fit.fitted_quantity.name}": TableColumn(fit.modelled, unit),
        "residual": TableColumn(fit.residuals, unit),
        "censored": fit.censoring != 0,
    }
    return Table("rows", "Measured and modelled values", columns, series=True)


def equation_section(fit: Fit) -> tuple[tuple[DisplayedEquation, ...], tuple[Table, ...]]:
    """Return the equations of a fitted law within the range of its data, and the table of their
    symbols. The first equation has the parameters as symbols. A polynomial in scaled quantities
    follows in physical quantities. A law without a closed form is represented by the definition in
    its documentation."""
    quantity = fit.fitted_quantity
    equations = law_equation(fit.model, quantity.name, quantity.arguments, fit.data_ranges)
    if not equations:
        law: type[Any] = type(fit.model)
        text = " ".join((law.__doc__ or law.__name__).split("\n\n")[0].split())
        references: tuple[Reference, ...] = getattr(law, "references", ())
        sources = (
            "; ".join(f"{symbol.authors} {symbol.year or ''}".strip() for symbol in references)
            or "none published"
        )
        note = (
            f"{text} The law has no closed form of a length that can be shown. Source: {sources}."
        )
        return (DisplayedEquation("equation-1", "Definition", (), note, {}),), ()
    scales = {"pressure": (1e-3, " kPa"), "contraction": (1.0, ""), "force": (1.0, " N")}
    parts = []
    for name in quantity.arguments:
        factor, unit = scales[name]
        ends = fit.data_ranges[name]
        low, high = (format_number(end * factor) for end in ends)
        parts.append(f"{name} {low} to {high}{unit}")
    validity = (
        f"Valid for {' and '.join(parts)}, the range of the data; outside it the law may be"
        " continued differently."
    )
    shown = tuple(
        _displayed(equation, f"equation-{i}", validity) for i, equation in enumerate(equations, 1)
    )
    effects, tables = _specimen_effects(fit, validity)
    parameters = equations[0].parameters
    columns: dict[str, Any] = {
        "symbol": [symbol.name for symbol in parameters],
        "value": TableColumn([symbol.value for symbol in parameters], BY_ROW),
        "unit": [symbol.unit for symbol in parameters],
        "meaning": [symbol.meaning for symbol in parameters],
    }
    symbols = Table("equation-symbols", "Symbols of the equation", columns)
    return (*shown, *effects), (symbols, *tables)


def _specimen_effects(fit: Fit, validity: str) -> tuple[list[DisplayedEquation], list[Table]]:
    """Return the term that each specimen adds to the law of the population, and a table of the
    coefficients.
    """
    law = fit.model
    effects = fit.effects
    if effects is None or not isinstance(law, PooledLengthLaw):
        return [], []
    shown = []
    quantity = fit.fitted_quantity
    share = ""
    if law.effect_decay:
        limit = f"{format_number(1 / law.effect_decay)} N"
        share = f" (below zero force of the population it decreases to zero within {limit})"
    for i, (name, effect) in enumerate(zip(law.specimens, law.effects, strict=True), 1):
        equations = law_equation(effect, quantity.name, quantity.arguments, fit.data_ranges)
        title = f"Effect of specimen {name}, added to the law of the population{share}"
        titled = dataclasses.replace(equations[-1], title=title)
        shown.append(_displayed(titled, f"effect-{i}", validity))
    surface: Any = law.effects[0]
    columns: dict[str, Any] = {"term": list(surface.term_labels)}
    for name, values, errors in zip(
        law.specimens, effects.coefficients, effects.standard_errors, strict=True
    ):
        columns |= {
            name: TableColumn(values, "N"),
            f"{name}, standard error": TableColumn(errors, "N"),
        }
    title = (
        f"Specimen effects (standard deviation of the prior {format_number(effects.deviation)} N)"
    )
    return shown, [Table("specimen-effects", title, columns)]


def _displayed(equation: LawEquation, name: str, validity: str) -> DisplayedEquation:
    quantities = (equation.result, *equation.arguments)
    unit_of = ", ".join(
        f"{q.meaning} {q.name}{'' if q.unit == '1' else f' [{q.unit}]'}" for q in quantities
    )
    texts = {
        f"{language} ({REMARKS[language]})": text
        for language, text in source_codes(equation, validity).items()
    }
    note = f"{unit_of[0].upper()}{unit_of[1:]}. {validity}"
    return DisplayedEquation(name, equation.title, tuple(displayed_lines(equation)), note, texts)


def ramp_plot(fit: Fit) -> Plot | None:
    """Return measured and modelled force over pressure at the held contractions; None if the
    pressure was not swept at held contractions."""
    data = fit.recording
    if not is_pressure_ramp(data["pressure"], data["contraction"]):
        return None
    lengths = data.columns.get("resting_length")
    panels: list[float | None] = (
        [None] if lengths is None else levels_of(lengths, MAX_PANELS).tolist()
    )
    columns = min(2, len(panels))
    rows = -(-len(panels) // 2)
    width, height = (6.3, 3.6) if len(panels) == 1 else (7.4, 2.9 * rows + 0.4)
    figure, axes = plotting.new_figure(
        rows, columns, width=width, height=height, squeeze=False, sharey=True
    )
    for axis, length in zip(axes.ravel(), panels, strict=False):
        selected = (
            np.full(len(data), True) if lengths is None or length is None else _at(lengths, length)
        )
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
    levels = held_levels(data["contraction"])[0]
    selected = levels[
        np.unique(np.linspace(0, levels.size - 1, min(levels.size, MAX_RAMPS)).astype(int))
    ]
    for i, level in enumerate(selected):
        rows = data.rows(_at(data["contraction"], level) if levels.size > 1 else slice(None))
        pressure = np.linspace(rows["pressure"].min(), rows["pressure"].max(), POINTS)
        force = evaluate_force(
            law, pressure, np.full(POINTS, level), float(fit.recording["force"].max())
        )
        colour = plotting.LINES[i % len(plotting.LINES)]
        marker = plotting.MARKERS[i % len(plotting.MARKERS)]
        points = {
            "linestyle": "none",
            "marker": marker,
            "markersize": 2.2,
            "alpha": 0.45,
            "markeredgewidth": 0.5,
        }
        axes.plot(rows["pressure"] / 1e3, rows["force"], color=colour, **points)
        label = level_text("contraction", float(level), float(np.abs(levels).max()))
        style = {"linestyle": plotting.DASHES[i % len(plotting.DASHES)], "linewidth": 1.6}
        axes.plot(pressure / 1e3, force, color=colour, label=label, **style)
    axes.set(xlabel="gauge pressure [kPa]")
    if length is not None:
        axes.set_title(f"resting length {1e3 * length:.4g} mm", fontsize=9)
    axes.legend(title="contraction", loc="upper left", fontsize=8, title_fontsize=8, frameon=False)


_CURVE_AXES = {
    "force": ("pressure", "contraction"),
    "contraction": ("pressure", "force"),
    "pressure": ("contraction", "force"),
}
"""The quantity that is constant on a curve of the fitted one, and the one that varies along it."""
_CAPTION = (
    "Left: 95 % confidence bands of the mean law (dark) and prediction bands of a further run of"
    " this muscle (light) at measured levels. Right: half width of the confidence bands (thick) and"
    " the prediction bands (thin), for non-negative forces. The variance of the parameters is"
    " estimated "
)


class BandCurve(NamedTuple):
    """A fitted curve at one level of the constant quantity, with both 95 % bands; SI, shape (N,)
    each.
    """

    constant: str
    level: float
    varying: str
    points: Array
    """Values of the varying quantity."""
    confidence: Band
    prediction: Band


def band_curves(fit: Fit) -> list[BandCurve]:
    """Return the fitted curves at measured levels with their bands, for the median resting length;
    none if a band cannot be computed. They are over the pressure if it was swept at held
    contractions."""
    data = fit.recording
    quantity = fit.fitted_quantity.name
    ramp = quantity == "force" and is_pressure_ramp(data["pressure"], data["contraction"])
    constant, varying = ("contraction", "pressure") if ramp else _CURVE_AXES[quantity]
    along = np.linspace(*fit.data_ranges[varying], POINTS)
    lengths = data.columns.get("resting_length")
    curves = []
    constants = {} if lengths is None else {"resting_length": float(np.median(lengths))}
    for level in levels_of(data[constant], MAX_CURVES).tolist():
        points = Recording(
            {varying: along, constant: np.full(POINTS, level)}, data.origin, constants
        )
        try:
            bands = [
                confidence_band(fit, points, level=LEVEL, prediction=further)
                for further in (False, True)
            ]
        except IdentificationError:
            return []
        curves.append(BandCurve(constant, level, varying, along, *bands))
    return curves


def band_plot(fit: Fit) -> Plot | None:
    """Return the fitted curves with 95 % bands and the half width of the bands; None if no band can
    be computed.
    """
    curves = band_curves(fit)
    quantity = fit.fitted_quantity.name
    if not curves:
        return None
    constant = curves[0].constant
    varying = curves[0].varying
    figure, (left, right) = plotting.new_figure(1, 2, width=7.4, height=3.7)
    factor, unit = display_scale(quantity)
    x_factor, x_unit = display_scale(varying)
    for i, each in enumerate(curves):
        confidence = each.confidence
        prediction = each.prediction
        colour = plotting.LINES[i % len(plotting.LINES)]
        x = x_factor * np.where(
            confidence.value < 0 if quantity == "force" else False, np.nan, each.points
        )
        label = level_text(constant, each.level, max(abs(other.level) for other in curves))
        style = {"color": colour, "linestyle": plotting.DASHES[i % 5]}
        left.plot(x, factor * confidence.value, label=label, **style)
        left.fill_between(
            x,
            factor * prediction.low,
            factor * prediction.high,
            color=colour,
            alpha=0.15,
            linewidth=0,
        )
        left.fill_between(
            x,
            factor * confidence.low,
            factor * confidence.high,
            color=colour,
            alpha=0.35,
            linewidth=0,
        )
        right.plot(x, factor * (confidence.high - confidence.value), **style)
        right.plot(
            x, factor * (prediction.high - prediction.value), color=colour, linewidth=0.7, alpha=0.7
        )
    measured = fit.recording.rows(fit.censoring == 0)
    x = x_factor * measured[varying]
    y = factor * measured[quantity]
    left.plot(x, y, ".", markersize=2, color=plotting.BLACK, alpha=0.35, label="measured")
    margin = 0.08 * float(np.ptp(y)) or 1.0
    limits = float(y.min()) - margin, float(y.max()) + margin
    left.set(xlabel=f"{varying} [{x_unit}]", ylabel=f"{quantity} [{unit}]", ylim=limits)
    right.set(
        xlabel=f"{varying} [{x_unit}]", ylabel=f"half width of the band [{unit}]", ylim=(0.0, None)
    )
    plotting.legend_below(figure, left, columns=MAX_CURVES + 1)
    return Plot("bands", f"{_CAPTION}{fit.error_basis}.", figure)
