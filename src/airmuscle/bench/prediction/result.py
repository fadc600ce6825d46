"""Predicted quantities of a record beside the measured ones, with errors and 95 % bands, and their
report chapters.
"""

import dataclasses
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from ...core import RED, Array, ShortRepr, cite, counted, legend_below
from ...recording import Recording
from ...recording.columns import display_scale, displayed
from ...report.chapter import BY_ROW, Chapter, Plot, Table, TableColumn
from ..diagnosis import Diagnosis, DiagnosisRule, LawMisfit, Subject, apply_rules
from ..dynamics import draw_residuals, residual_panels, running_extreme
from ..inspection import CONTRACTION_BAND, Mask
from ..reported import Reported, unit_column
from .baselines import ARX, PERSISTENCE, TimedRecord, baseline_errors, skill

MIN_SHARE = 0.8
MIN_ROWS = 5
"""Share of the rows within a 95 % band below which the band does not hold for a record, and minimum
number of compared rows for that statement (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class QuantityPrediction(ShortRepr):
    """One quantity of a record, measured and predicted [SI], shape (N,) each.

    `half_width` (N,) is that of the 95 % band, None where the model states none. `compared` (N,)
    marks the rows that are compared: a finite measured value, and for a static law tension, or no
    tension where the law pulls by more than the half width. `band` says where the band comes from,
    or why there is none.
    """

    name: str
    measured: Array
    predicted: Array
    half_width: Array | None
    compared: Mask
    band: str = ""

    @property
    def errors(self) -> Array:
        """Predicted minus measured value at every row [SI], shape (N,)."""
        return self.predicted - self.measured

    @property
    def rms(self) -> float:
        """Root mean square error over the compared rows [SI]."""
        return float(np.sqrt(np.mean(self.errors[self.compared] ** 2)))

    @property
    def worst_row(self) -> int:
        """Index of the compared row with the maximum error."""
        return int(np.argmax(np.where(self.compared, np.abs(self.errors), -1.0)))

    @property
    def max_error(self) -> float:
        """Predicted minus measured value of largest magnitude [SI]."""
        return float(self.errors[self.worst_row])

    def share_of(self, rows: Mask) -> float | None:
        """Share of some rows, a mask (N,), within the 95 % band; None without a band or such a
        row.
        """
        if self.half_width is None or not rows.any():
            return None
        return float(np.mean(np.abs(self.errors[rows]) <= self.half_width[rows]))

    @property
    def median_half_width(self) -> float | None:
        """Median half width of the 95 % band over the compared rows [SI]; None without a band."""
        if self.half_width is None:
            return None
        return float(np.median(self.half_width[self.compared]))

    @property
    def share(self) -> float | None:
        """Share of the compared rows within the 95 % band; None without a band."""
        return self.share_of(self.compared)


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class RecordPrediction(Reported):
    """The prediction of one record: its recording, the predicted quantities, and notes on what
    limits them.
    """

    recording: Recording
    quantities: tuple[QuantityPrediction, ...]
    remarks: tuple[str, ...] = ()
    """What limits the comparison with the record."""
    outside: Mask | None = None
    """Mask (N,) of the rows outside the range of the fit; None where the range is not known."""
    inputs: Array | None = None
    """What drives the quantities at the rows (N, K) [SI]: commands of a plant, arguments of a
    law.
    """
    misfit: LawMisfit | None = None
    """That a static law does not follow the record, by the rule of a fit; None if it does."""
    differences: tuple[str, ...] = ()
    """What differs from the records of the fit, such as "another specimen": likely reasons of an
    error."""
    usual_causes: str = ""
    """Usual causes of an error that nothing recorded explains, as a phrase."""

    @property
    def diagnoses(self) -> tuple[Diagnosis, ...]:
        """The findings of the rules of predictions."""
        return apply_rules(PREDICTION_RULES, self)

    @property
    def notes(self) -> tuple[str, ...]:
        """The remarks, and the bands that do not hold; the misfit is told before them."""
        return (*self.remarks, *_bands_that_do_not_hold(self))

    @property
    def origin(self) -> str:
        """Name of the record."""
        return self.recording.origin

    def chapter(self) -> Chapter:
        """The description of the prediction: errors and shares within the bands, and the values at
        the rows.
        """
        of_rows = _record(self)
        return dataclasses.replace(of_rows, tables=(_error_table([self]), *of_rows.tables))


def _misfit(prediction: RecordPrediction) -> list[str]:
    """The misfit of a record with its causes, as a text; none without one."""
    return [] if prediction.misfit is None else [str(prediction.misfit)]


def _bands_that_do_not_hold(prediction: RecordPrediction) -> Iterator[str]:
    """For each quantity whose band does not hold: by how much, and the likely reason, which is what
    lies outside the fit, or one of the usual causes."""
    for quantity in prediction.quantities:
        compared = quantity.compared
        if quantity.share is None or quantity.share >= MIN_SHARE or compared.sum() < MIN_ROWS:
            continue
        mean = float(np.mean(quantity.errors[compared]))
        known = [*prediction.differences]
        if prediction.outside is not None and (compared & prediction.outside).any():
            inside = quantity.share_of(compared & ~prediction.outside)
            text = (
                "" if inside is None else f" (inside it {100 * inside:.3g} % are within the band)"
            )
            known.insert(0, f"rows outside the range of the fit{text}")
        reason = f"nothing recorded explains it; usual are {prediction.usual_causes}"
        if known:
            reason = f"likely because of {', '.join(known)}"
        yield (
            f"the 95 % band of the {quantity.name} does not hold for this record:"
            f" {100 * quantity.share:.3g} % of the rows are within it, and the predicted"
            f" {quantity.name} is {displayed(quantity.name, abs(mean))} too"
            f" {'high' if mean > 0 else 'low'} on average; {reason}"
        )


PREDICTION_RULES = (
    DiagnosisRule(
        "a law that does not follow the record",
        Subject.PREDICTION,
        _misfit,
        "remove its cause, or fit the law to records of this kind",
    ),
    DiagnosisRule(
        "a band that does not hold",
        Subject.PREDICTION,
        _bands_that_do_not_hold,
        "measure what differs from the records of the fit",
    ),
)
"""The rules of predictions, in the order in which they are told."""

BASELINES = (
    "Skill: 1 - error/error of the better baseline. Persistence keeps the first value; the ARX"
    " model is fitted to the other records, or to the other half of a single one, and runs freely"
    " from the first rows."
)
NO_BAND = "the model states no band"
MAX_BRIEF = 15
"""Maximum number of predicted quantities in the brief view (chosen)."""
STEADY_PRESSURE = 0.03
"""Variation of a constant pressure relative to its maximum, without the extreme 4 % of the rows
(chosen).
"""


def prediction_chapters(
    model: str, thing: Any, predictions: Sequence[RecordPrediction]
) -> list[Chapter]:
    """Return the chapters of predicted records, the errors of all and one for each; `model` names
    the file of the muscle or plant `thing`, whose references are cited."""
    records = [
        dataclasses.replace(
            _record(prediction).among(suffix=f"-{i}"),
            title=f"Record {i}: {prediction.origin}",
            brief=False,
        )
        for i, prediction in enumerate(predictions, 1)
    ]
    return [_overview(model, thing, predictions), *records]


def _error_table(predictions: Sequence[RecordPrediction]) -> Table:
    """Return the errors of every quantity of every record, beside those of the baselines."""
    quantities = [quantity for prediction in predictions for quantity in prediction.quantities]
    records = [prediction for prediction in predictions for _ in prediction.quantities]

    def all_of(name: str) -> list[Any]:
        return [getattr(quantity, name) for quantity in quantities]

    names = all_of("name")
    columns: dict[str, Any] = {
        "record": [prediction.origin for prediction in records],
        "quantity": names,
        "rows": [int(quantity.compared.sum()) for quantity in quantities],
        "rms error": TableColumn(all_of("rms"), BY_ROW),
        "maximum error": TableColumn(all_of("max_error"), BY_ROW),
        "in row": TableColumn([quantity.worst_row + 1 for quantity in quantities], brief=False),
        "half width of the 95 % band": TableColumn(
            all_of("median_half_width"), BY_ROW, short="95 % band ±"
        ),
        "unit": unit_column(names),
        **_baseline_columns(predictions),
        "rows within the band": TableColumn(all_of("share"), "1", "%", digits=3, short="within"),
        "band": TableColumn([quantity.band or NO_BAND for quantity in quantities], brief=False),
        "notes": TableColumn(["; ".join(prediction.notes) for prediction in records], brief=False),
    }
    caption = "Errors: predicted minus measured." + (f" {BASELINES}" if "skill" in columns else "")
    return Table("predictions", "Errors of the predicted values", columns, caption, brief=MAX_BRIEF)


def _overview(model: str, thing: Any, predictions: Sequence[RecordPrediction]) -> Chapter:
    quantities = [quantity for prediction in predictions for quantity in prediction.quantities]
    number = counted(len(predictions), "record")
    sentences = [
        f"{number} that {model} was not fitted to, predicted and compared with the measured values."
    ]
    sentences = [*_missed(model, predictions), *sentences]
    sources = list(
        filter(None, dict.fromkeys(q.band for q in quantities if q.half_width is not None))
    )
    sentences += [f"Band: {source.rstrip('.')}." for source in sources]
    if not sources and all(quantity.share is None for quantity in quantities):
        reasons = dict.fromkeys(quantity.band or NO_BAND for quantity in quantities)
        sentences.append(f"No share of rows within a band is given: {'; '.join(reasons)}.")
    warning = getattr(thing, "warning", "")
    title = f"Prediction by {model}"
    references = tuple(cite(thing))
    tables = (_error_table(predictions),)
    return Chapter(
        "prediction",
        title,
        " ".join(sentences),
        tables=tables,
        problems=tuple(filter(None, [warning])),
        notes=_notes(predictions),
        references=references,
    )


def _missed(model: str, predictions: Sequence[RecordPrediction]) -> list[str]:
    """The sentence on the records that the model does not follow; empty without any."""
    ratios = [f"{p.origin} {p.misfit.ratio:.2g}" for p in predictions if p.misfit is not None]
    text = (
        f"{model} does not follow {len(ratios)} of {counted(len(predictions), 'record')}: rms error"
        f" over the scatter of the data, {', '.join(ratios)}."
    )
    return [text] if ratios else []


def _notes(predictions: Sequence[RecordPrediction]) -> tuple[str, ...]:
    """The notes of all records with their names, misfits first."""
    return tuple(
        f"{prediction.origin}: {note}"
        for prediction in predictions
        for note in (*_misfit(prediction), *prediction.notes)
    )


def _baseline_columns(predictions: Sequence[RecordPrediction]) -> dict[str, Any]:
    """The rms errors of the baselines of all quantities, and the skill of the model; empty without
    records in time.
    """
    errors = _baseline_errors(predictions)
    if not any(errors.values()):
        return {}
    persistence, arx = (
        [of_baselines.get(name) for of_baselines in errors.values()] for name in (PERSISTENCE, ARX)
    )
    skills = [skill(quantity.rms, of_baselines) for quantity, of_baselines in errors.items()]
    return {
        f"rms error of {PERSISTENCE}": TableColumn(persistence, BY_ROW, short=PERSISTENCE),
        f"rms error of an {ARX}": TableColumn(arx, BY_ROW, short="ARX"),
        "skill": TableColumn(skills, "1", digits=2),
    }


def _baseline_errors(
    predictions: Sequence[RecordPrediction],
) -> dict[QuantityPrediction, dict[str, float]]:
    """The rms errors of the baselines by name, for each predicted quantity; empty without time.

    The ARX model is fitted to the records with the same quantities.
    """
    errors: dict[QuantityPrediction, dict[str, float]] = {}
    alike: dict[tuple[str, ...], list[tuple[RecordPrediction, TimedRecord]]] = {}
    for prediction in predictions:
        errors |= {quantity: {} for quantity in prediction.quantities}
        record = _timed(prediction)
        if record is not None:
            names = tuple(quantity.name for quantity in prediction.quantities)
            alike.setdefault(names, []).append((prediction, record))
    for timed in alike.values():
        of_records = baseline_errors([record for _, record in timed])
        for (prediction, _), of_baselines in zip(timed, of_records, strict=True):
            for k, quantity in enumerate(prediction.quantities):
                errors[quantity] = {name: float(rms[k]) for name, rms in of_baselines.items()}
    return errors


def _timed(prediction: RecordPrediction) -> TimedRecord | None:
    """The record of a prediction for the baselines; None without inputs or without times that
    rise.
    """
    time = prediction.recording["time"] if "time" in prediction.recording else np.zeros(0)
    if prediction.inputs is None or time.size < 2 or not np.all(np.diff(time) > 0.0):
        return None
    quantities = prediction.quantities
    measured, compared = (
        np.column_stack([getattr(q, name) for q in quantities]) for name in ("measured", "compared")
    )
    return TimedRecord(time, measured, prediction.inputs, compared)


def _record(prediction: RecordPrediction) -> Chapter:
    """Return the description of one record without the table of its errors."""
    columns: dict[str, Any] = {}
    if "time" in prediction.recording:
        columns["time"] = TableColumn(prediction.recording["time"], "s")
    for quantity in prediction.quantities:
        name = quantity.name
        unit = unit_column([quantity.name]).values[0]
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
    title = f"Prediction of {prediction.origin}"
    summary = f"{errors[:1].upper()}{errors[1:]}."
    tables = (Table("prediction", "Measured and predicted values", columns, series=True),)
    plots = (Plot("prediction", caption, partial(_figure, prediction)),)
    notes = (*_misfit(prediction), *prediction.notes)
    return Chapter("prediction", title, summary, tables=tables, plots=plots, notes=notes)


def _figure(prediction: RecordPrediction) -> Any:
    """Return a figure with measured and predicted values above the errors, for every quantity."""
    figure, axes = residual_panels(len(prediction.quantities))
    for (upper, lower), quantity in zip(axes.T, prediction.quantities, strict=True):
        x, label = _abscissa(prediction, quantity)
        factor, unit = display_scale(quantity.name)
        predicted = factor * quantity.predicted
        draw_residuals(
            (upper, lower), x, factor * quantity.measured, predicted, "predicted", quantity.compared
        )
        if quantity.half_width is not None:
            order = np.argsort(x, kind="stable")
            half = factor * quantity.half_width[order]
            low = predicted[order] - half
            high = predicted[order] + half
            if np.any(np.diff(x) < 0.0):  # two branches over one abscissa
                low = running_extreme(low, np.minimum)
                high = running_extreme(high, np.maximum)
            style = {"color": RED, "alpha": 0.18, "linewidth": 0}
            upper.fill_between(x[order], low, high, label="95 % band", **style)
            lower.fill_between(x[order], -half, half, **style)
        upper.set_ylabel(f"{quantity.name} [{unit}]")
        lower.set(xlabel=label, ylabel=f"error [{unit}]")
    legend_below(figure, axes[0, 0], columns=3)
    return figure


def _abscissa(prediction: RecordPrediction, quantity: QuantityPrediction) -> tuple[Array, str]:
    """Return the contraction or the pressure of a slow run in which the other is constant, else the
    time or the row.
    """
    recording = prediction.recording
    if quantity.name == "force" and "contraction" in recording and "pressure" in recording:
        pressure = recording["pressure"]
        contraction = recording["contraction"]
        moved = float(np.nanmax(contraction) - np.nanmin(contraction))
        steady = float(np.nanquantile(pressure, 0.98) - np.nanquantile(pressure, 0.02))
        if moved <= CONTRACTION_BAND:
            return 1e-3 * pressure, "pressure [kPa]"
        if steady <= STEADY_PRESSURE * float(np.nanmax(np.abs(pressure))):
            return 100.0 * contraction, "contraction [%]"
    if "time" in recording:
        return recording["time"], "time [s]"
    return np.arange(1.0, len(recording) + 1.0), "row"
