"""Prediction of a record by the muscle of an entry, at the resting length of the record."""

from __future__ import annotations

import dataclasses

import numpy as np

from ...bench.identify.campaign.rows import is_held
from ...bench.identify.compared_points import law_of_length
from ...bench.identify.cross_validation import specimen_name
from ...bench.identify.left_out import widening
from ...bench.identify.prediction import RecordPrediction, predict_static
from ...bench.identify.prediction.result import length_notes
from ...bench.identify.problem import fitted_quantity_of
from ...bench.readers.plausibility import CONTRACTION_RANGE
from ...core.errors import ColumnError, Hint, ParameterError
from ...physics.muscle.characteristic.base import ForceLaw
from ...physics.muscle.muscle import LENGTH_TOLERANCE
from ...recording import Recording
from .entry import Entry
from .scaling import scale_to_length

UNKNOWN = "not known for a specimen that was not measured"
"""Words in place of a band that no specimens left out of the fit give."""
MAX_NAMES = 6
"""Maximum number of measured specimens in a note (chosen)."""
UNUSED_PARTS = ("damper", "wall", "series", "stop")
"""Elements of a muscle that a static prediction leaves out."""


def predict_with_entry(entry: Entry, recording: Recording) -> RecordPrediction:
    """Predict a slow record by the law of an entry, its friction and its creep elements, with its stated 95 % band.

    Law and geometry are scaled to the resting length that the record states; without one, that of the geometry is used.
    Raises ParameterError for an entry that cannot be scaled or has a spring, and ColumnError for a record without
    pressure, contraction and force, or whose contractions are impossible with the resting length of the geometry.
    """
    if entry.spring is not None:
        raise ParameterError(
            f"{entry.name}: a parallel spring is not part of a static prediction. Give a muscle whose law contains the "
            "force of the spring, or a scenario with the muscle."
        )
    stated = recording.constants.get("resting_length")
    length = None if stated is None else float(stated)
    law = law_of_length(entry.characteristic, length, specimen_name(recording))
    notes, differences = [], []
    if length is None and entry.geometry is not None:
        recording, remarks = _with_resting_length(recording, float(entry.geometry.resting_length))
        notes += remarks
    elif length is not None:
        law = scale_to_length(law, length, f"{recording.origin}, resting length")
    left_out = [part for part in UNUSED_PARTS if getattr(entry, part) is not None]
    if left_out and isinstance(law, ForceLaw):
        notes.append(f"left out of the static prediction: {', '.join(left_out)}")
    own = None if entry.geometry is None else float(entry.geometry.resting_length)
    if None not in (own, length) and abs((own or 0.0) - (length or 0.0)) > LENGTH_TOLERANCE:
        differences.append("another resting length")
        notes.append(f"the law was scaled from {1e3 * (own or 0.0):.4g} mm to {1e3 * (length or 0.0):.4g} mm")
    half, source, remarks = _band(entry, fitted_quantity_of(law).name, recording)
    limits = entry.error_band
    rates = {} if limits is None else {"contraction": limits.max_contraction_rate, "pressure": limits.max_pressure_rate}
    if any(note.startswith("specimen ") for note in remarks):
        differences.append("another specimen")
    return predict_static(
        law, recording, friction=entry.friction, creep=entry.creep, half_width=half,
        validity_range=entry.validity_range, rates=rates, band=source,
        notes=(*notes, *remarks), differences=differences,
    )  # fmt: skip


def _with_resting_length(recording: Recording, length: float) -> tuple[Recording, list[str]]:
    """The recording with the resting length of the muscle, and a note if its contraction depends on it."""
    constants = {**recording.constants, "resting_length": length}
    completed = dataclasses.replace(recording, constants=constants)
    if "contraction" in recording or "length" not in recording:
        return completed, []
    what = f"the record states no resting length; with that of the muscle, {1e3 * length:.4g} mm"
    low, high = (float(f(completed["contraction"])) for f in (np.nanmin, np.nanmax))
    if not CONTRACTION_RANGE[0] < low <= high < CONTRACTION_RANGE[1]:
        raise ColumnError(
            f"{recording.origin}: {what}, its contraction is {100 * low:.4g} to {100 * high:.4g} %, which is "
            "impossible.",
            hint=Hint("To state the length", "resting_length", "400 mm"),
        )
    return completed, [f"{what}, its contraction is {100 * low:.4g} to {100 * high:.4g} %"]


def _band(entry: Entry, quantity: str, recording: Recording) -> tuple[float | None, str, list[str]]:
    """The half width of the band of a record [SI], None if it is not known; its source or why not; and notes.

    It is that of the measured specimens, of isometric runs for a held length, or that of other specimens.
    """
    band = entry.error_band
    if band is None or band.quantity != quantity:
        return None, "", []
    held = band.held_half_width is not None and "contraction" in recording and is_held(recording)
    own = (band.held_half_width or band.half_width) if held else band.half_width
    name, length = specimen_name(recording), recording.constants.get("resting_length")
    if not band.specimens or name in band.specimens:
        return own, band.source, []
    notes = length_notes(None if length is None else float(length), band.resting_lengths)
    measured = ", ".join(band.specimens[:MAX_NAMES]) + (", ..." if len(band.specimens) > MAX_NAMES else "")
    which = f"specimen {name} was not measured (measured: {measured})"
    if band.new_specimen_half_width is None:
        return None, UNKNOWN, [f"{which}; the band is {UNKNOWN}", *notes]
    new = band.new_specimen_half_width
    if length is not None and band.resting_lengths and hasattr(entry.characteristic, "with_resting_length"):
        new *= widening(band.resting_lengths, float(length))
    source = f"for a specimen that was not measured: {band.new_specimen_source}"
    return max(new, own), source, [f"{which}; the band is that of other specimens", *notes]
