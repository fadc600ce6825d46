"""Prediction of a slow record by a static law, with friction and creep along the recorded motion."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ...core.arrays import Array
from ...core.errors import ColumnError
from ...core.hints import Hint
from ...muscle import CreepElements
from ...muscle.characteristic.base import Characteristic, ForceLaw
from ...muscle.characteristic.validity_range import ValidityRange
from ...muscle.friction import Friction, NoFriction
from ...recording import Recording
from ..campaign.predicted_force import predicted_force
from ..compared_points import FORCE_MARGIN
from ..problem import FORCE, evaluate, fitted_quantity_of
from .result import QuantityPrediction, RecordPrediction

COLUMNS = ("pressure", "contraction", "force")
"""Columns that a static law relates."""
LIMIT_MARGIN = 1e-3
"""Noise of the sensors at the limits of the range of a law, relative to the range (chosen)."""


def predict_static(
    law: Characteristic,
    recording: Recording,
    *,
    friction: Friction | None = None,
    creep: CreepElements | None = None,
    half_width: float | None = None,
    validity_range: ValidityRange | None = None,
) -> RecordPrediction:
    """Predict the quantity that a law gives at the rows of a recording with pressure, contraction and force.

    law             the static law of the muscle of this recording
    friction, creep subtracted from the force along the recorded motion, relaxed at the first row; they need time and
                    the constant `resting_length`
    half_width      half width of the stated 95 % band of the quantity [SI]
    validity_range  range of the measurements of the law; rows outside it are counted in a note

    Rows without tension are not compared. Raises ColumnError for a recording without these columns or without tension.
    """
    _check_columns(recording)
    quantity = fitted_quantity_of(law)
    compared = (recording["force"] > 0.0) & np.isfinite(sum(recording[name] for name in COLUMNS))
    if not compared.any():
        raise ColumnError(
            f"{recording.origin}: no row has a positive force, so that no prediction can be compared; a force of "
            "tension is positive."
        )
    moving = [part for part in (friction, creep) if part not in (None, NoFriction(), CreepElements())]
    notes = _notes(recording, bool(moving) and quantity == FORCE, validity_range)
    if isinstance(law, ForceLaw):
        limit = FORCE_MARGIN * float(np.nanmax(recording["force"]))
        predicted = predicted_force(law, recording, friction or NoFriction(), creep or CreepElements(), limit)
        predicted = np.maximum(predicted, 0.0)
    else:
        predicted = evaluate(law, quantity.method, quantity.arguments, recording)
    band = None if half_width is None else np.full(len(recording), float(half_width))
    measured = recording[quantity.name]
    result = QuantityPrediction(quantity.name, measured, predicted, band, compared & np.isfinite(predicted))
    return RecordPrediction(recording, (result,), tuple(notes))


def _check_columns(recording: Recording) -> None:
    missing = [name for name in COLUMNS if name not in recording]
    if not missing:
        return
    hint = None
    if missing == ["contraction"]:
        hint = Hint("To compute it from the length", "resting_length", "300 mm")
    raise ColumnError(
        f"{recording.origin}: the prediction of a static law is compared with pressure, contraction and force; missing "
        f"is {', '.join(missing)}.", hint=hint,
    )  # fmt: skip


def _notes(recording: Recording, moving: bool, validity_range: ValidityRange | None) -> list[str]:
    notes = []
    if moving and recording.constants.get("resting_length") is None:
        notes.append("friction and creep of the muscle are left out, because the record states no resting length")
    outside = _rows_outside(recording, validity_range)
    if outside:
        notes.append(
            f"{outside} of {len(recording)} rows are outside the range of the measurements of the law; the stated band "
            "does not apply there"
        )
    return notes


def _rows_outside(recording: Recording, limits: ValidityRange | None) -> int:
    if limits is None:
        return 0

    def beyond(values: Array, low: Any, high: Any) -> npt.NDArray[np.bool_]:
        margin = LIMIT_MARGIN * (high - low)
        return np.asarray((values < low - margin) | (values > high + margin))

    rows = beyond(recording["pressure"], limits.min_pressure, limits.max_pressure)
    return int((rows | beyond(recording["contraction"], limits.min_contraction, limits.max_contraction)).sum())
