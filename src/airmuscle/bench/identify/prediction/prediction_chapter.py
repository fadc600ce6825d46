"""Report chapters: predicted records with errors, shares within the 95 % band, and measured and predicted values."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ....core.arrays import Array
from ....core.plotting import BLACK, BLUE, RED, legend_below, new_figure
from ....core.reference import cite
from ....recording.display_units import display_scale, displayed
from ....recording.recording import column_heading
from ....report.chapter import Chapter, Plot, Table
from ...segment.runs import CONTRACTION_BAND
from . import QuantityPrediction, RecordPrediction

NO_BAND = "the model states no band"
STEADY_PRESSURE = 0.03
"""Variation of a constant pressure relative to its maximum, without the extreme 4 % of the rows (chosen)."""


def prediction_chapters(model: str, thing: Any, predictions: Sequence[RecordPrediction]) -> list[Chapter]:
    """Return the chapters of predicted records: the errors of all records, then one chapter for each.

    `model` names the file of the muscle or plant, and `thing` is the muscle or plant, for its references.
    """
    return [_overview(model, thing, predictions), *(_record(i, each) for i, each in enumerate(predictions, 1))]


def band_sources(predictions: Sequence[RecordPrediction]) -> list[str]:
    """The sources of the bands of all records, each once."""
    stated = [quantity for each in predictions for quantity in each.quantities if quantity.half_width is not None]
    return [source for source in dict.fromkeys(quantity.band for quantity in stated) if source]


def describe_band(quantity: QuantityPrediction) -> str:
    """The median half width of the band with its unit, or that there is none."""
    if quantity.half_width is None:
        return quantity.band or NO_BAND
    return f"±{with_unit(float(np.median(quantity.half_width[quantity.compared])), quantity.name)}"


def with_unit(value: float, name: str) -> str:
    """A value of a quantity in its display unit; a ratio has none."""
    return displayed(name, value)


def _overview(model: str, thing: Any, predictions: Sequence[RecordPrediction]) -> Chapter:
    pairs = [(each, quantity) for each in predictions for quantity in each.quantities]
    shares = [quantity.share for _, quantity in pairs]
    columns: dict[str, Any] = {
        "record": [each.origin for each, _ in pairs],
        "quantity": [quantity.name for _, quantity in pairs],
        "rows": [int(quantity.compared.sum()) for _, quantity in pairs],
        "rms error": [with_unit(quantity.rms, quantity.name) for _, quantity in pairs],
        "maximum error": [with_unit(quantity.max_error, quantity.name) for _, quantity in pairs],
        "95 % band": [describe_band(quantity) for _, quantity in pairs],
        "rows within the band [%]": [None if share is None else 100.0 * share for share in shares],
        "notes": ["; ".join(each.notes) for each, _ in pairs],
    }
    number = f"{len(predictions)} {'record' if len(predictions) == 1 else 'records'}"
    sentences = [f"{number} that {model} was not fitted to, predicted and compared with the measured values."]
    sources = band_sources(predictions)
    sentences += [f"Band: {source.rstrip('.')}." for source in sources]
    if not sources and all(share is None for share in shares):
        sentences.append(f"No share of rows within a band is given, because {NO_BAND}.")
    return Chapter(
        paper="prediction",
        title=f"Prediction by {model}",
        summary=" ".join(sentences),
        tables=(Table("predictions", "Errors of the predicted values", columns, "Errors: predicted minus measured."),),
        references=tuple(cite(thing)),
    )


def _record(number: int, prediction: RecordPrediction) -> Chapter:
    stem = f"prediction-{number}"
    columns: dict[str, Any] = {}
    if "time" in prediction.recording:
        columns["time [s]"] = prediction.recording["time"]
    for quantity in prediction.quantities:
        heading = column_heading(quantity.name)
        columns[f"measured {heading}"] = quantity.measured
        columns[f"predicted {heading}"] = quantity.predicted
        if quantity.half_width is not None:
            columns[f"half width of the band of {heading}"] = quantity.half_width
        columns[f"compared {quantity.name}"] = quantity.compared.astype(int)
    if prediction.outside is not None:
        columns["outside the range of the fit"] = prediction.outside.astype(int)
    errors = "; ".join(
        f"{quantity.name}: rms error {with_unit(quantity.rms, quantity.name)}, maximum error "
        f"{with_unit(quantity.max_error, quantity.name)} in row {quantity.worst_row + 1}"
        for quantity in prediction.quantities
    )
    notes = [f"{note[:1].upper()}{note[1:].rstrip('.')}." for note in prediction.notes]
    caption = f"{prediction.origin}: measured and predicted values with the 95 % band, and errors."
    return Chapter(
        paper=stem,
        title=f"Record {number}: {prediction.origin}",
        summary="\n\n".join([f"{errors[:1].upper()}{errors[1:]}.", *notes]),
        tables=(Table(stem, "Measured and predicted values", columns, shown=False),),
        plots=(Plot(stem, caption, _figure(prediction)),),
    )


def _figure(prediction: RecordPrediction) -> Any:
    """Return a figure with measured and predicted values above the errors, for every quantity."""
    count = len(prediction.quantities)
    figure, axes = new_figure(
        2, count, width=2.2 + 4.2 * count if count > 1 else 6.4, height=4.6, sharex="col", squeeze=False,
        height_ratios=(2, 1),
    )  # fmt: skip
    for (upper, lower), quantity in zip(axes.T, prediction.quantities, strict=True):
        x, label = _abscissa(prediction, quantity)
        (factor, unit), order = display_scale(quantity.name), np.argsort(x, kind="stable")
        dots = {"linestyle": "none", "marker": ".", "markersize": 3, "color": BLUE}
        rows = quantity.compared
        upper.plot(x[rows], factor * quantity.measured[rows], label="measured", **dots)
        upper.plot(x, factor * quantity.predicted, color=RED, linewidth=1.0, label="predicted")
        if quantity.half_width is not None:
            half = factor * quantity.half_width
            low, high = (factor * quantity.predicted + sign * half for sign in (-1.0, 1.0))
            style = {"color": RED, "alpha": 0.18, "linewidth": 0, "label": "95 % band"}
            if np.all(np.diff(x) >= 0.0):
                upper.fill_between(x, low, high, **style)
            else:  # two branches over one abscissa
                upper.fill_between(
                    x[order], _running(low[order], np.minimum), _running(high[order], np.maximum), **style
                )
            lower.fill_between(x[order], -half[order], half[order], **{**style, "label": None})
        lower.plot(x[rows], factor * quantity.errors[rows], **dots)
        lower.axhline(0.0, color=BLACK, linewidth=0.8)
        upper.set_ylabel(f"{quantity.name} [{unit}]")
        lower.set(xlabel=label, ylabel=f"error [{unit}]")
    legend_below(figure, axes[0, 0], columns=3)
    return figure


def _running(values: Array, extreme: Any, width: int = 9) -> Array:
    """Return the running extreme over `width` rows (chosen)."""
    padded = np.pad(values, width // 2, mode="edge")
    return np.asarray(extreme.reduce([padded[i : i + values.size] for i in range(width)]))


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
