"""Report chapters: predicted records with errors, shares within the 95 % band, and measured and predicted values."""

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from ....core import RED, Array, cite, counted, legend_below
from ....recording.columns import display_scale, displayed
from ....report.chapter import BY_ROW, Chapter, Plot, Table, TableColumn
from ...baselines import ARX, PERSISTENCE, TimedRecord, baseline_errors, skill
from ...reported import unit_column
from ...segment.runs import CONTRACTION_BAND
from ..dynamic.dynamic_chapter import draw_residuals, residual_panels, running_extreme
from . import QuantityPrediction, RecordPrediction

BASELINES = (
    "Skill: 1 - error/error of the better baseline. Persistence keeps the first value; the ARX model is fitted to the "
    "other records, or to the other half of a single one, and runs freely from the first rows."
)
NO_BAND = "the model states no band"
MAX_BRIEF = 15
"""Maximum number of predicted quantities in the brief view (chosen)."""
STEADY_PRESSURE = 0.03
"""Variation of a constant pressure relative to its maximum, without the extreme 4 % of the rows (chosen)."""


def prediction_chapters(model: str, thing: Any, predictions: Sequence[RecordPrediction]) -> list[Chapter]:
    """Return the chapters of predicted records: the errors of all records, then one chapter for each.

    `model` names the file of the muscle or plant, and `thing` is the muscle or plant, for its references.
    """
    return [_overview(model, thing, predictions), *(_record(i, each) for i, each in enumerate(predictions, 1))]


def _overview(model: str, thing: Any, predictions: Sequence[RecordPrediction]) -> Chapter:
    quantities = [quantity for each in predictions for quantity in each.quantities]
    records = [each for each in predictions for _ in each.quantities]
    names = [quantity.name for quantity in quantities]
    half_widths = [None if q.half_width is None else float(np.median(q.half_width[q.compared])) for q in quantities]
    columns: dict[str, Any] = {
        "record": [each.origin for each in records],
        "quantity": names,
        "rows": [int(quantity.compared.sum()) for quantity in quantities],
        "rms error": TableColumn([quantity.rms for quantity in quantities], BY_ROW),
        "maximum error": TableColumn([quantity.max_error for quantity in quantities], BY_ROW),
        "in row": TableColumn([quantity.worst_row + 1 for quantity in quantities], brief=False),
        "half width of the 95 % band": TableColumn(half_widths, BY_ROW, short="95 % band ±"),
        "unit": unit_column(names),
        **_baseline_columns(predictions),
        "rows within the band": TableColumn([q.share for q in quantities], "1", "%", digits=3, short="within"),
        "band": TableColumn([quantity.band or NO_BAND for quantity in quantities], brief=False),
        "notes": TableColumn(["; ".join(each.notes) for each in records], brief=False),
    }
    number = counted(len(predictions), "record")
    sentences = [f"{number} that {model} was not fitted to, predicted and compared with the measured values."]
    sources = list(filter(None, dict.fromkeys(q.band for q in quantities if q.half_width is not None)))
    sentences += [f"Band: {source.rstrip('.')}." for source in sources]
    if not sources and all(quantity.share is None for quantity in quantities):
        reasons = dict.fromkeys(quantity.band or NO_BAND for quantity in quantities)
        sentences.append(f"No share of rows within a band is given: {'; '.join(reasons)}.")
    caption = "Errors: predicted minus measured." + (f" {BASELINES}" if "skill" in columns else "")
    table = Table("predictions", "Errors of the predicted values", columns, caption, brief=MAX_BRIEF)
    notes = tuple(f"{each.origin}: {note}" for each in predictions for note in each.notes)
    title, references = f"Prediction by {model}", tuple(cite(thing))
    return Chapter("prediction", title, " ".join(sentences), tables=(table,), notes=notes, references=references)


def _baseline_columns(predictions: Sequence[RecordPrediction]) -> dict[str, Any]:
    """The rms errors of the baselines of all quantities, and the skill of the model; empty without records in time."""
    timed = {each: record for each in predictions if (record := _timed(each)) is not None}
    names = {each: tuple(quantity.name for quantity in each.quantities) for each in predictions}
    errors: dict[QuantityPrediction, dict[str, float]] = {q: {} for each in predictions for q in each.quantities}
    for kind in dict.fromkeys(names.values()):  # the ARX model is fitted to the records with the same quantities
        alike = [each for each in timed if names[each] == kind]
        for each, found in zip(alike, baseline_errors([timed[other] for other in alike]), strict=True):
            for k, quantity in enumerate(each.quantities):
                errors[quantity] = {name: float(values[k]) for name, values in found.items()}
    if not any(errors.values()):
        return {}
    persistence, arx = ([each.get(name) for each in errors.values()] for name in (PERSISTENCE, ARX))
    skills = [skill(quantity.rms, each) for quantity, each in errors.items()]
    return {
        f"rms error of {PERSISTENCE}": TableColumn(persistence, BY_ROW, short=PERSISTENCE),
        f"rms error of an {ARX}": TableColumn(arx, BY_ROW, short="ARX"),
        "skill": TableColumn(skills, "1", digits=2),
    }


def _timed(prediction: RecordPrediction) -> TimedRecord | None:
    """The record of a prediction for the baselines; None without inputs or without times that rise."""
    time = prediction.recording["time"] if "time" in prediction.recording else np.zeros(0)
    if prediction.inputs is None or time.size < 2 or not np.all(np.diff(time) > 0.0):
        return None
    quantities = prediction.quantities
    measured, compared = (np.column_stack([getattr(q, name) for q in quantities]) for name in ("measured", "compared"))
    return TimedRecord(time, measured, prediction.inputs, compared)


def _record(number: int, prediction: RecordPrediction) -> Chapter:
    stem = f"prediction-{number}"
    columns: dict[str, Any] = {}
    if "time" in prediction.recording:
        columns["time"] = TableColumn(prediction.recording["time"], "s")
    for quantity in prediction.quantities:
        name, unit = quantity.name, unit_column([quantity.name]).values[0]
        columns[f"measured {name}"] = TableColumn(quantity.measured, unit)
        columns[f"predicted {name}"] = TableColumn(quantity.predicted, unit)
        if quantity.half_width is not None:
            columns[f"half width of the band of {name}"] = TableColumn(quantity.half_width, unit)
        columns[f"compared {name}"] = quantity.compared
    if prediction.outside is not None:
        columns["outside the range of the fit"] = prediction.outside
    errors = "; ".join(
        f"{quantity.name}: rms error {displayed(quantity.name, quantity.rms)}, maximum error "
        f"{displayed(quantity.name, quantity.max_error)} in row {quantity.worst_row + 1}"
        for quantity in prediction.quantities
    )
    caption = f"{prediction.origin}: measured and predicted values with the 95 % band, and errors."
    title, summary = f"Record {number}: {prediction.origin}", f"{errors[:1].upper()}{errors[1:]}."
    tables = (Table(stem, "Measured and predicted values", columns, series=True),)
    plots = (Plot(stem, caption, partial(_figure, prediction)),)
    return Chapter(stem, title, summary, tables=tables, plots=plots, notes=prediction.notes, brief=False)


def _figure(prediction: RecordPrediction) -> Any:
    """Return a figure with measured and predicted values above the errors, for every quantity."""
    figure, axes = residual_panels(len(prediction.quantities))
    for (upper, lower), quantity in zip(axes.T, prediction.quantities, strict=True):
        (x, label), (factor, unit) = _abscissa(prediction, quantity), display_scale(quantity.name)
        predicted = factor * quantity.predicted
        draw_residuals((upper, lower), x, factor * quantity.measured, predicted, "predicted", quantity.compared)
        if quantity.half_width is not None:
            order = np.argsort(x, kind="stable")
            half = factor * quantity.half_width[order]
            low, high = predicted[order] - half, predicted[order] + half
            if np.any(np.diff(x) < 0.0):  # two branches over one abscissa
                low, high = running_extreme(low, np.minimum), running_extreme(high, np.maximum)
            style = {"color": RED, "alpha": 0.18, "linewidth": 0}
            upper.fill_between(x[order], low, high, label="95 % band", **style)
            lower.fill_between(x[order], -half, half, **style)
        upper.set_ylabel(f"{quantity.name} [{unit}]")
        lower.set(xlabel=label, ylabel=f"error [{unit}]")
    legend_below(figure, axes[0, 0], columns=3)
    return figure


def _abscissa(prediction: RecordPrediction, quantity: QuantityPrediction) -> tuple[Array, str]:
    """Return the contraction or the pressure of a slow run in which the other is constant, else the time or the row."""
    recording = prediction.recording
    if quantity.name == "force" and "contraction" in recording and "pressure" in recording:
        pressure, contraction = recording["pressure"], recording["contraction"]
        moved = float(np.nanmax(contraction) - np.nanmin(contraction))
        steady = float(np.nanquantile(pressure, 0.98) - np.nanquantile(pressure, 0.02))
        if moved <= CONTRACTION_BAND:
            return 1e-3 * pressure, "pressure [kPa]"
        if steady <= STEADY_PRESSURE * float(np.nanmax(np.abs(pressure))):
            return 100.0 * contraction, "contraction [%]"
    if "time" in recording:
        return recording["time"], "time [s]"
    return np.arange(1.0, len(recording) + 1.0), "row"
