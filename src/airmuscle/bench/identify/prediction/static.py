"""Prediction of a slow record by a static law, with friction and creep along the recorded motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from ....core.arrays import Array
from ....core.errors import ColumnError, Hint
from ....physics.muscle import CreepElements
from ....physics.muscle.characteristic.base import Characteristic, ForceLaw
from ....physics.muscle.characteristic.validity_range import ValidityRange
from ....physics.muscle.friction import Friction, NoFriction
from ....recording import Recording
from ..campaign.friction_stage import predicted_force
from ..compared_points import FORCE_MARGIN
from ..problem import FORCE, evaluate, fitted_quantity_of
from .result import (
    QuantityPrediction,
    RecordPrediction,
    ends_of,
    range_notes,
    rate_notes,
    rows_outside,
    with_band_notes,
)

COLUMNS = ("pressure", "contraction", "force")
"""Columns that a static law relates."""
USUAL = "another specimen, a resting length or a zero of a sensor that differs, a muscle that has changed, and outliers"
"""Usual causes of a band that does not hold, where nothing recorded shows one."""


def predict_static(
    law: Characteristic,
    recording: Recording,
    *,
    friction: Friction | None = None,
    creep: CreepElements | None = None,
    half_width: float | None = None,
    validity_range: ValidityRange | None = None,
    rates: Mapping[str, float | None] | None = None,
    band: str = "",
    notes: Sequence[str] = (),
    differences: Sequence[str] = (),
) -> RecordPrediction:
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
    quantity = fitted_quantity_of(law)
    moving = [part for part in (friction, creep) if part not in (None, NoFriction(), CreepElements())]
    remarks, faster = _notes(recording, bool(moving) and quantity == FORCE, validity_range, rates or {})
    pulling = np.zeros(len(recording), dtype=bool)
    if isinstance(law, ForceLaw):
        limit = FORCE_MARGIN * float(np.nanmax(recording["force"]))
        force = predicted_force(law, recording, friction or NoFriction(), creep or CreepElements(), limit)
        predicted = np.maximum(force, 0.0)
        pulling = complete & ~tension & (predicted > (half_width or 0.0))
        remarks += _slack_notes(predicted, pulling, int((complete & ~tension).sum()))
    else:
        predicted = evaluate(law, quantity.method, quantity.arguments, recording)
    known = np.isfinite(predicted)
    if (tension & ~known).any():
        remarks.append(f"the law gives no {quantity.name} at {int((tension & ~known).sum())} rows with tension")
    widths = None if half_width is None else np.full(len(recording), float(half_width))
    measured = recording[quantity.name]
    result = QuantityPrediction(quantity.name, measured, predicted, widths, (tension | pulling) & known, band)
    limits = ends_of(validity_range)
    prediction = RecordPrediction(recording, (result,), (*remarks, *notes), rows_outside(recording, limits))
    return with_band_notes(prediction, [*differences, *faster], USUAL)


def _rows_with_tension(recording: Recording) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
    """Masks (N,) of the complete rows, and of those with tension. Raises ColumnError without columns or tension."""
    missing = [name for name in COLUMNS if name not in recording]
    if missing:
        hint = None
        if missing == ["contraction"]:
            hint = Hint("To compute it from the length", "resting_length", "300 mm")
        raise ColumnError(
            f"{recording.origin}: the prediction of a static law is compared with pressure, contraction and force; "
            f"missing is {', '.join(missing)}.", hint=hint,
        )  # fmt: skip
    complete = np.isfinite(sum(recording[name] for name in COLUMNS))
    tension = (recording["force"] > 0.0) & complete
    if not tension.any():
        raise ColumnError(
            f"{recording.origin}: no row has a positive force, so that no prediction can be compared; a force of "
            "tension is positive."
        )
    return complete, tension


def _notes(
    recording: Recording, moving: bool, limits: ValidityRange | None, rates: Mapping[str, float | None]
) -> tuple[list[str], list[str]]:
    """The notes on what limits the prediction, and those of them that name a faster record as a difference."""
    notes, faster = [], rate_notes(recording, rates)
    if moving and recording.constants.get("resting_length") is None:
        notes.append("friction and creep of the muscle are left out, because the record states no resting length")
    return [*notes, *range_notes(recording, ends_of(limits)), *faster], ["a faster motion"] if faster else []


def _slack_notes(predicted: Array, pulling: npt.NDArray[np.bool_], count: int) -> list[str]:
    """The rows without tension at which the law pulls, which count as outside the band."""
    if not pulling.any():
        return []
    return [
        f"the law pulls at {int(pulling.sum())} of {count} rows without tension, up to "
        f"{float(np.max(predicted[pulling])):.4g} N; these rows count as errors outside the band"
    ]
