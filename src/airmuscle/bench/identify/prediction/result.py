"""Predicted quantities of a record beside the measured ones, with errors and 95 % bands, and where the record leaves
the ranges of those of the fit: pressure, contraction, resting length and rates."""

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from ....core import Array, ColumnError, Hint, ShortRepr
from ....physics import Characteristic, CreepElements, ForceLaw, Friction, NoFriction, ValidityRange
from ....recording import Recording
from ....recording.columns import displayed
from ...segment import Mask, rate_of_change
from ..campaign.friction_and_release import predicted_force
from ..compared_points import FORCE_MARGIN
from ..problem import FORCE, evaluate, fitted_quantity_of

COLUMNS = ("pressure", "contraction", "force")
"""Columns that a static law relates."""
USUAL = "another specimen, a resting length or a zero of a sensor that differs, a muscle that has changed, and outliers"
"""Usual causes of a band that does not hold, where nothing recorded shows one."""


def predict_static(
    law: Characteristic, recording: Recording, *, friction: Friction | None = None, creep: CreepElements | None = None,
    half_width: float | None = None, validity_range: ValidityRange | None = None,
    rates: Mapping[str, float | None] | None = None, band: str = "", notes: Sequence[str] = (),
    differences: Sequence[str] = (),
) -> "RecordPrediction":  # fmt: skip
    """Predict the quantity that a law gives at the rows of a recording with pressure, contraction and force.

    law             the static law of the muscle of this recording
    friction, creep subtracted from the force along the recorded motion, relaxed at the first row; they need time and
                    the constant `resting_length`
    half_width      half width of the stated 95 % band of the quantity [SI]
    validity_range  range of the measurements of the law; rows outside it are counted in a note
    rates           maximum rates of contraction [1/s] and pressure [Pa/s] of these measurements, by quantity; a record
                    that is faster is named in a note
    band            where the band comes from, or why there is none
    notes           further notes on the record
    differences     what differs from the muscle of the fit, such as "another specimen": named as likely reason where
                    far fewer than 95 % of the rows are within the band

    Rows without tension are compared where the predicted force exceeds the half width, or 0 without one. Raises
    ColumnError for a recording without these columns or without tension.
    """
    complete, tension = _rows_with_tension(recording)
    quantity, remarks = fitted_quantity_of(law), list[str]()
    moving = [part for part in (friction, creep) if part not in (None, NoFriction(), CreepElements())]
    if moving and quantity == FORCE and recording.constants.get("resting_length") is None:
        remarks = ["friction and creep of the muscle are left out, because the record states no resting length"]
    limits, faster = dict[str, tuple[float, float]](), rate_notes(recording, rates or {})
    if validity_range is not None:
        limits = {"pressure": validity_range.pressure, "contraction": validity_range.contraction}
    remarks += [*range_notes(recording, limits), *faster]
    pulling = np.zeros(len(recording), dtype=bool)
    if isinstance(law, ForceLaw):
        limit = FORCE_MARGIN * float(np.nanmax(recording["force"]))
        force = predicted_force(law, recording, friction or NoFriction(), creep or CreepElements(), limit)
        predicted, slack = np.maximum(force, 0.0), complete & ~tension
        pulling = slack & (predicted > (half_width or 0.0))
        if pulling.any():
            remarks.append(
                f"the law pulls at {int(pulling.sum())} of {int(slack.sum())} rows without tension, up to "
                f"{float(np.max(predicted[pulling])):.4g} N; these rows count as errors outside the band"
            )
    else:
        predicted = evaluate(law, quantity.method, quantity.arguments, recording)
    known = np.isfinite(predicted)
    if (tension & ~known).any():
        remarks.append(f"the law gives no {quantity.name} at {int((tension & ~known).sum())} rows with tension")
    widths = None if half_width is None else np.full(len(recording), float(half_width))
    measured = recording[quantity.name]
    result = QuantityPrediction(quantity.name, measured, predicted, widths, (tension | pulling) & known, band)
    driving = np.column_stack([recording[name] for name in COLUMNS if name != quantity.name])
    prediction = RecordPrediction(recording, (result,), (*remarks, *notes), rows_outside(recording, limits), driving)
    return with_band_notes(prediction, [*differences, *(["a faster motion"] if faster else [])], USUAL)


def _rows_with_tension(recording: Recording) -> tuple[Mask, Mask]:
    """Masks (N,) of the complete rows, and of those with tension. Raises ColumnError without columns or tension."""
    missing = [name for name in COLUMNS if name not in recording]
    if missing:
        by_length = Hint("To compute it from the length", "resting_length", "300 mm")
        raise ColumnError(
            f"{recording.origin}: the prediction of a static law is compared with pressure, contraction and force; "
            f"missing is {', '.join(missing)}.", hint=by_length if missing == ["contraction"] else None,
        )  # fmt: skip
    complete = np.isfinite(sum(recording[name] for name in COLUMNS))
    tension = (recording["force"] > 0.0) & complete
    if not tension.any():
        raise ColumnError(
            f"{recording.origin}: no row has a positive force, so that no prediction can be compared; a force of "
            "tension is positive."
        )
    return complete, tension


LIMIT_MARGIN, NOISY_MARGIN = 1e-3, 0.05
"""Noise of the sensors at the limits of the range of a law, relative to the range, and of a noisy quantity (chosen)."""
RATE_MARGIN = 1.25
"""Ratio of the rate of a record to that of the fit from which it is outside (chosen)."""
LENGTH_MARGIN = 1e-3
"""Relative difference of two resting lengths that are the same (chosen)."""
Ends = Mapping[str, tuple[float, float]]
"""Lower and upper end of quantities [SI], by name."""
NOT_THERE = "the stated band does not apply there"
MIN_SHARE, MIN_ROWS = 0.8, 5
"""Share of the rows within a 95 % band below which the band does not hold for a record, and minimum number of compared
rows for that statement (chosen)."""


def rows_outside(recording: Recording, ends: Ends, margin: float = LIMIT_MARGIN) -> Mask | None:
    """The mask (N,) of the rows with a quantity outside its ends; None without ends."""
    masks = [_beyond(recording[name], *each, margin) for name, each in ends.items() if name in recording]
    return np.asarray(np.logical_or.reduce(masks)) if masks else None


def range_notes(recording: Recording, ends: Ends, margin: float = LIMIT_MARGIN) -> list[str]:
    """The number of rows outside the range of the fit, with both ranges of each quantity that leaves it."""
    outside = rows_outside(recording, ends, margin)
    if outside is None or not outside.any():
        return []
    parts = [
        f"{name} {_span(name, np.nanmin(recording[name]), np.nanmax(recording[name]))}, fitted {_span(name, *each)}"
        for name, each in ends.items()
        if name in recording and _beyond(recording[name], *each, margin).any()
    ]
    rows = f"{int(outside.sum())} of {len(recording)} rows are outside the range of the measurements of the fit"
    return [f"{rows} ({'; '.join(parts)}); {NOT_THERE}"]


def rate_notes(recording: Recording, fitted: Mapping[str, float | None]) -> list[str]:
    """The rates of change that exceed those of the fit [SI per s], by quantity; None where the fit has none."""
    parts = []
    for name, rate in fitted.items():
        own = rate_of_change(recording, name)
        if rate is not None and own > RATE_MARGIN * rate:
            parts.append(f"{name} changes by up to {displayed(name, own)}/s, in the fit by {displayed(name, rate)}/s")
    return [f"the record is faster than those of the fit: {'; '.join(parts)}; {NOT_THERE}"] if parts else []


def length_notes(length: float | None, fitted: Sequence[float]) -> list[str]:
    """A resting length [m] outside the range of those of the fit [m]."""
    if length is None or not fitted:
        return []
    low, high = min(fitted), max(fitted)
    if low * (1 - LENGTH_MARGIN) <= length <= high * (1 + LENGTH_MARGIN):
        return []
    span = displayed("length", low) if low == high else f"{displayed('length', low)} to {displayed('length', high)}"
    return [f"the resting length, {displayed('length', length)}, is outside that of the fit, {span}; {NOT_THERE}"]


def with_band_notes(prediction: "RecordPrediction", differences: Sequence[str], usual: str) -> "RecordPrediction":
    """The prediction with a note for each quantity whose band does not hold: by how much, and the likely reason.

    `differences` name what of the record lies outside the fit; where there are none, `usual` names the usual causes.
    """
    notes = []
    for each in prediction.quantities:
        if each.share is None or each.share >= MIN_SHARE or each.compared.sum() < MIN_ROWS:
            continue
        mean, known = float(np.mean(each.errors[each.compared])), [*differences]
        if prediction.outside is not None and (each.compared & prediction.outside).any():
            inside = each.share_of(each.compared & ~prediction.outside)
            text = "" if inside is None else f" (inside it {100 * inside:.3g} % are within the band)"
            known.insert(0, f"rows outside the range of the fit{text}")
        reason = f"likely because of {', '.join(known)}"
        reason = reason if known else f"nothing recorded explains it; usual are {usual}"
        notes.append(
            f"the 95 % band of the {each.name} does not hold for this record: {100 * each.share:.3g} % of the rows are "
            f"within it, and the predicted {each.name} is {displayed(each.name, abs(mean))} too "
            f"{'high' if mean > 0 else 'low'} on average; {reason}"
        )
    return dataclasses.replace(prediction, notes=(*prediction.notes, *notes))


def _beyond(values: Array, low: float, high: float, margin: float) -> Mask:
    allowed = margin * (high - low)
    return np.asarray((values < low - allowed) | (values > high + allowed))


def _span(name: str, low: float, high: float) -> str:
    return f"{displayed(name, float(low))} to {displayed(name, float(high))}"


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class QuantityPrediction(ShortRepr):
    """One quantity of a record, measured and predicted [SI], shape (N,) each.

    `half_width` (N,) is that of the 95 % band, None where the model states none. `compared` (N,) marks the rows that
    are compared: a finite measured value, and for a static law tension, or no tension where the law pulls by more than
    the half width. `band` says where the band comes from, or why there is none.
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
        """Share of some rows, a mask (N,), within the 95 % band; None without a band or such a row."""
        if self.half_width is None or not rows.any():
            return None
        return float(np.mean(np.abs(self.errors[rows]) <= self.half_width[rows]))

    @property
    def share(self) -> float | None:
        """Share of the compared rows within the 95 % band; None without a band."""
        return self.share_of(self.compared)


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class RecordPrediction(ShortRepr):
    """The prediction of one record: its recording, the predicted quantities, and notes on what limits them."""

    recording: Recording
    quantities: tuple[QuantityPrediction, ...]
    notes: tuple[str, ...] = ()
    outside: Mask | None = None
    """Mask (N,) of the rows outside the range of the fit; None where the range is not known."""
    inputs: Array | None = None
    """What drives the quantities at the rows (N, K) [SI]: commands of a plant, arguments of a law."""

    @property
    def origin(self) -> str:
        """Name of the record."""
        return self.recording.origin
