"""Creep elements of a muscle from the holds of any recordings, at a held length or under a constant load."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from ....core import AirmuscleError, Array, IdentificationError, ShortRepr
from ....physics.muscle import CreepElements
from ....physics.muscle.characteristic.base import ForceLaw
from ....recording import Recording
from ...segment.runs import CONTRACTION_BAND
from ..hysteresis import Hold, creep_elements, find_holds, fit_creep
from .creep_stage import CreepStage, HeldRows, creep_force, describe_elements, fit_held_rows
from .transient import with_force

MAX_MOTION = 0.3
"""Maximum duration of the motion before a hold under a load, by its shortest time constant (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class HeldCreep(ShortRepr):
    """The creep of the longest hold of each recording as sentences, and the elements of the muscle."""

    sentences: tuple[str, ...]
    elements: CreepElements
    """No element where the holds determine none."""
    verdict: str
    """The elements and the holds they are from, or the reason for none."""
    standard_errors: Array
    """Of the stiffnesses [N/m], then of the relaxation times [s], shape (2 E,); NaN for a hold under a load."""


def fit_held_creep(recordings: Sequence[Recording], *, law: ForceLaw | None = None) -> HeldCreep:
    """Fit creep to the longest hold of each recording, and the Maxwell elements that the holds have in common.

    law  the static characteristic, whose stiffness a hold under a constant load needs

    Holds at a constant length are fitted together along the recorded motion; without any, the longest hold under a
    constant load gives the elements. A hold without a motion before it has a course but no stiffness.
    """
    sentences, reasons = [], list[str]()
    held, loaded = list[tuple[str, HeldRows]](), list[tuple[float, str, CreepElements]]()
    for recording in recordings:
        hold = max(find_holds(recording), key=lambda each: len(each.interval), default=None)
        sentences.append(_sentence(recording, hold))
        if hold is None:
            continue
        try:
            if not _has_path(recording):
                raise IdentificationError(
                    f"{recording.origin}: creep elements need the resting length and the time; the contraction alone "
                    "gives no stiffness."
                )
            if hold.quantity == "force":
                held.append((recording.origin, _held_rows(recording, hold)))
            else:
                loaded.append(_elements_under_load(recording, hold, law))
        except AirmuscleError as error:
            reasons.append(error.message)
    stage = fit_held_rows(held) if held else None
    if isinstance(stage, CreepStage) and stage.elements.stiffnesses:
        return HeldCreep(tuple(sentences), stage.elements, stage.verdict, stage.standard_errors)
    usable = [each for each in loaded if each[2].stiffnesses]
    if usable:
        _, origin, elements = max(usable, key=lambda each: each[0])
        verdict = f"{describe_elements(elements)}, from the hold of {origin} under a constant load."
        return HeldCreep(tuple(sentences), elements, verdict, np.full(2 * len(elements.stiffnesses), np.nan))
    causes = [*([stage.verdict] if stage is not None else []), *reasons]
    none = "The holds under a constant load justify no creep." if loaded else "There is no hold."
    return HeldCreep(tuple(sentences), CreepElements(), " ".join(causes or [none]), np.zeros(0))


def free_of_creep(elements: CreepElements, recordings: Sequence[Recording]) -> list[Recording]:
    """The recordings with the force of the creep elements along their motion added to the measured force."""
    return [
        with_force(each, creep_force(elements, each)) if elements.stiffnesses and _has_path(each) else each
        for each in recordings
    ]


def _has_path(recording: Recording) -> bool:
    return "time" in recording and isinstance(recording.constants.get("resting_length"), float | int)


def _sentence(recording: Recording, hold: Hold | None) -> str:
    """The course of the hold of a recording."""
    if hold is None:
        needed = "12 rows or more, with constant pressure and constant force or length"
        return f"{recording.origin}: no hold phase of {needed}."
    rows = f"{hold.interval.start + 1} to {hold.interval.stop}"
    verdict = fit_creep(recording.rows(hold.interval.rows), hold.quantity).verdict
    return f"{recording.origin}, {hold.quantity} in rows {rows}: {verdict}"


def _held_rows(recording: Recording, hold: Hold) -> HeldRows:
    """The rows up to the end of the hold. Raises IdentificationError without a motion before it."""
    before = recording["contraction"][: hold.interval.start + 1]
    if float(np.ptp(before)) <= CONTRACTION_BAND:
        raise IdentificationError(
            f"{recording.origin}: the length does not change before the hold, so its creep determines no stiffness. "
            "Move the muscle at constant pressure by a few per cent of its length, then hold it."
        )
    start = float(recording["time"][hold.interval.start])
    return HeldRows.after(recording.rows(slice(0, hold.interval.stop)), start)


def _elements_under_load(recording: Recording, hold: Hold, law: ForceLaw | None) -> tuple[float, str, CreepElements]:
    """Duration [s], origin and elements of a hold under a constant load."""
    if law is None:
        raise IdentificationError(
            f"{recording.origin}: the creep under a constant load needs the stiffness of the muscle, that is, its "
            "static characteristic; give the muscle, or hold the length."
        )
    length, rows = float(recording.constants["resting_length"]), recording.rows(hold.interval.rows)
    fit = fit_creep(rows, hold.quantity)
    step = _single_motion(recording, hold, min(fit.creep.time_constants, default=np.inf)) * length
    pressure, contraction = (float(np.median(rows[name])) for name in ("pressure", "contraction"))
    stiffness = float(law.stiffness(pressure, contraction)) / length
    elements = creep_elements(fit, step=step, stiffness=stiffness, resting_length=length)
    return fit.duration, recording.origin, elements


def _single_motion(recording: Recording, hold: Hold, shortest: float) -> float:
    """Change of the contraction by the one quick motion before a hold. Raises IdentificationError for another one."""
    contraction, start = recording["contraction"], hold.interval.start
    first, last = float(contraction[0]), float(np.median(contraction[start : start + 3]))
    change, origin = last - first, recording.origin
    remedy = "Record one quick change of the load or the pressure, then hold both."
    if abs(change) <= CONTRACTION_BAND:
        raise IdentificationError(f"{origin}: the length does not change before the hold. {remedy}")
    share = (contraction[: start + 1] - first) / change
    if share.min() < -0.1 or share.max() > 1.1:
        raise IdentificationError(f"{origin}: the muscle moves in both directions before the hold. {remedy}")
    duration = float(recording["time"][start] - recording["time"][int(np.argmax(share > 0.02))])
    if duration > MAX_MOTION * shortest:
        raise IdentificationError(
            f"{origin}: the motion before the hold takes {duration:.3g} s, which is not short compared with the time "
            f"constant of {shortest:.3g} s. {remedy}"
        )
    return change
