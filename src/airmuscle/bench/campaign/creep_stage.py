"""Creep as Maxwell elements: of all holds of a campaign together, and of any holds, also under a
constant load.
"""

import dataclasses
import functools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...core import AirmuscleError, Array, IdentificationError, ShortRepr
from ...physics import CreepElements, ForceLaw
from ...recording import Recording
from ..estimation import Runs
from ..hysteresis import (
    MIN_RATIO,
    CreepFit,
    Hold,
    TimeConstantProblem,
    creep_elements,
    find_holds,
    fit_creep,
)
from ..inspection import CONTRACTION_BAND, EDGE
from ..prediction import creep_stretches, displacement, has_path, thinned_rows
from .record import CampaignRecord
from .transient import LeftOutStage, find_motion

NAME = "creep"
FIT_ROWS = 400
"""Maximum number of rows of a hold (chosen)."""
DEADTIME = 0.2
"""Time after the end of the motion that is not fitted [s] (chosen): the load cell and the frame
settle.
"""
MAX_MOTION = 0.3
"""Maximum duration of the motion before a hold under a load, by its shortest time constant
(chosen).
"""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class CreepStage(ShortRepr):
    """Maxwell elements fitted to the force of all holds together, with the result for each hold
    alone.
    """

    elements: CreepElements
    standard_errors: Array
    """Of the stiffnesses [N/m], then of the relaxation times [s]; shape (2 E,)."""
    holds: tuple[tuple[str, CreepFit], ...]
    times: tuple[Array, ...]
    measured: tuple[Array, ...]
    modelled: tuple[Array, ...]
    rmse: float
    """Root mean square residual of the force over all holds [N]."""
    longest: float
    """Duration of the longest hold [s]."""

    @property
    def verdict(self) -> str:
        """The elements and their agreement with the holds, as sentences."""
        if not self.elements.stiffnesses:
            return "The holds justify no creep."
        holds = f"{len(self.holds)} holds; rms residual {self.rmse:.3g} N."
        slowest = max(self.elements.relaxation_times)
        further = (
            f" The holds of {self.longest:.4g} s are too short for the longest relaxation time;"
            f" hold for {6 * slowest:.2g} s to determine it."
        )
        return (
            f"{describe_elements(self.elements)}, from"
            f" {holds}{further if slowest > self.longest / 2 else ''}"
        )


def describe_elements(elements: CreepElements) -> str:
    """Stiffness and relaxation time of each element, as a phrase."""
    pairs = zip(elements.stiffnesses, elements.relaxation_times, strict=True)
    return (
        f"Maxwell elements of {' and '.join(f'{k:.4g} N/m with {tau:.4g} s' for k, tau in pairs)}"
    )


@dataclasses.dataclass(frozen=True, eq=False)
class HeldRows:
    """The held rows of a record, and the path of its displacement from the first row."""

    recording: Recording
    time: Array
    path: Array
    held: Array

    @classmethod
    def after(cls, recording: Recording, end_of_motion: float) -> "HeldRows":
        """The rows after a dead time from the end of the motion [s] on. Raises IdentificationError
        without any.
        """
        later = recording["time"] > end_of_motion + DEADTIME * (1.0 + EDGE)
        if not later.any():
            raise IdentificationError(
                f"{recording.origin}: the hold ends {recording['time'][-1] - end_of_motion:.2g} s"
                f" after the motion, within the {DEADTIME:g} s in which load cell and frame"
                " settle; hold longer."
            )
        start = int(np.argmax(later))
        rows = start + thinned_rows(len(recording) - start, FIT_ROWS)
        path = displacement(recording)
        rows = rows[np.isfinite(recording["force"][rows])]
        path = np.where(
            np.arange(path.size) < start, path, np.median(path[start:])
        )  # no motion by the noise
        return cls(recording.rows(rows), recording["time"], path, rows)

    def stretches(self, times: Array) -> Array:
        """Stretch [m] of the spring of each element at the held rows, shape (N, E)."""
        return np.asarray(creep_stretches(self.time, self.path, times)[self.held])


def fit_creep_stage(records: Sequence[CampaignRecord]) -> CreepStage | LeftOutStage:
    """Fit Maxwell elements to the holds at constant length and pressure. The number of elements is
    the largest that the F test justifies in a hold. Relaxation times and stiffnesses are common to
    all holds, each hold has its own initial force."""
    recordings = [record.recording for record in records if "force" in record.recording]
    if not recordings:
        remedy = (
            "move the muscle by a few per cent of its length within a second at constant pressure,"
            " hold the length for two minutes or more, and record the force"
        )
        return LeftOutStage(
            NAME, "no record contains a hold after a motion with measured force", remedy
        )
    motions = zip(recordings, map(find_motion, recordings), strict=True)
    return fit_held_rows(
        [HeldRows.after(recording, motion.end) for recording, motion in motions if motion]
    )


def fit_held_rows(holds: Sequence[HeldRows]) -> CreepStage | LeftOutStage:
    """Fit Maxwell elements to holds, as `fit_creep_stage`."""
    try:
        fits = [fit_creep(hold.recording, "force") for hold in holds]
    except AirmuscleError as error:
        return LeftOutStage(
            NAME, str(error.message), "record holds of 12 rows or more with increasing time"
        )
    elements = CreepElements()
    errors = np.zeros(0)
    measured = [hold.recording["force"] for hold in holds]
    modelled = [np.full(force.size, force.mean()) for force in measured]
    count = max(len(fit.creep.amplitudes) for fit in fits)
    if count:
        times = _common_times(holds, max((fit.creep.time_constants for fit in fits), key=len))
        coefficients, rest = _linear_part(holds, times)
        if not (coefficients[:count] > 0).all():
            reason = "the force of the holds does not relax towards the value before the motion"
            because = "because a pressure step also changes the force"
            return LeftOutStage(
                NAME,
                reason,
                f"hold the pressure constant during the motion and after it, {because}",
            )
        elements = CreepElements(tuple(coefficients[:count].tolist()), tuple(times.tolist()))
        modelled = [matrix @ coefficients for matrix in _matrices(holds, times)]
        errors = _standard_errors(holds, times, coefficients, rest)
    elapsed = [hold.recording["time"] - hold.recording["time"][0] for hold in holds]
    residuals = np.concatenate([a - b for a, b in zip(modelled, measured, strict=True)])
    return CreepStage(
        elements,
        errors,
        tuple((hold.recording.origin, fit) for hold, fit in zip(holds, fits, strict=True)),
        tuple(elapsed),
        tuple(measured),
        tuple(modelled),
        float(np.sqrt(np.mean(residuals**2))),
        max(float(t[-1]) for t in elapsed),
    )


def _common_times(holds: Sequence[HeldRows], initial: Sequence[float]) -> Array:
    """The relaxation times of all holds [s] from initial ones, for which the linear unknowns are
    solved.
    """
    longest = max(float(h.recording["time"][-1] - h.recording["time"][0]) for h in holds)
    count = len(initial)
    ordered = np.clip(np.sort(np.array(initial)), 0.1, 2.0 * longest)
    steps = np.log(
        np.concatenate([ordered[:1], np.maximum(ordered[1:] / ordered[:-1], 1.05 * MIN_RATIO)])
    )
    low = np.log([0.1, *[MIN_RATIO] * (count - 1)])
    high = np.log([2.0 * longest] * count)
    start = np.exp(np.clip(steps, low + 1e-6, high - 1e-6))
    limits = np.exp(np.column_stack([low, high]))
    target = np.concatenate([hold.recording["force"] for hold in holds])
    problem = HeldForceProblem(target, tuple(start), tuple(map(tuple, limits)), tuple(holds))
    return np.asarray(np.cumprod(problem.solve().values))


@dataclasses.dataclass(frozen=True, eq=False)
class HeldForceProblem(TimeConstantProblem):
    """The forces of several holds, with the stretches of the elements along their paths."""

    holds: tuple[HeldRows, ...]
    quantity = "force"

    @property
    def origin(self) -> str:  # type: ignore[override]
        return " + ".join(hold.recording.origin for hold in self.holds)

    @functools.cached_property
    def runs(self) -> Runs:
        hold = np.repeat(np.arange(len(self.holds)), [hold.held.size for hold in self.holds])
        return Runs(hold, np.zeros(hold.size, dtype=np.intp), in_time=True)

    def columns(self, times: Array) -> Array:
        return np.vstack(_matrices(self.holds, times))


def _matrices(holds: Sequence[HeldRows], times: Array) -> list[Array]:
    """Columns of each hold: minus the stretches, then the initial force of each hold."""
    unit = np.eye(len(holds))
    return [
        np.hstack([-hold.stretches(times), np.tile(unit[i], (hold.held.size, 1))])
        for i, hold in enumerate(holds)
    ]


def _linear_part(holds: Sequence[HeldRows], times: Array) -> tuple[Array, Array]:
    matrix = np.vstack(_matrices(holds, times))
    target = np.concatenate([hold.recording["force"] for hold in holds])
    coefficients = np.linalg.lstsq(matrix, target, rcond=None)[0]
    return coefficients, matrix @ coefficients - target


def _standard_errors(
    holds: Sequence[HeldRows], times: Array, coefficients: Array, residuals: Array
) -> Array:
    """Standard errors of the stiffnesses and the relaxation times from the Jacobian at the
    solution.
    """
    base = np.vstack(_matrices(holds, times))
    changed = np.where(np.eye(times.size) > 0, times * (1.0 + 1e-4), times)
    steps = [np.vstack(_matrices(holds, shifted)) - base for shifted in changed]
    slopes = [step @ coefficients / (1e-4 * time) for step, time in zip(steps, times, strict=True)]
    jacobian = np.hstack([base, np.column_stack(slopes)])
    degrees_of_freedom = max(residuals.size - jacobian.shape[1], 1)
    variance = float(residuals @ residuals) / degrees_of_freedom
    inverse = np.linalg.pinv(jacobian.T @ jacobian)
    deviations = np.sqrt(np.maximum(np.diag(inverse), 0.0) * variance)
    of_stiffnesses = deviations[: times.size]
    of_times = deviations[-times.size :]
    return np.concatenate([of_stiffnesses, of_times])


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class HeldCreep(ShortRepr):
    """The creep of the longest hold of each recording as sentences, and the elements of the
    muscle.
    """

    sentences: tuple[str, ...]
    elements: CreepElements
    """No element where the holds determine none."""
    verdict: str
    """The elements and the holds they are from, or the reason for none."""
    standard_errors: Array
    """Of the stiffnesses [N/m], then of the relaxation times [s], shape (2 E,); NaN for a hold
    under a load.
    """


def fit_held_creep(recordings: Sequence[Recording], *, law: ForceLaw | None = None) -> HeldCreep:
    """Fit creep to the longest hold of each recording, and the Maxwell elements that the holds have
    in common.

    law  the static characteristic, whose stiffness a hold under a constant load needs

    Holds at a constant length are fitted together along the recorded motion; without any, the
    longest hold under a constant load gives the elements. A hold without a motion before it has a
    course but no stiffness.
    """
    sentences = []
    reasons = list[str]()
    holds = list[HeldRows]()
    loaded = list[_LoadedHold]()
    for recording in recordings:
        hold = max(
            find_holds(recording), key=lambda candidate: len(candidate.interval), default=None
        )
        sentences.append(_sentence(recording, hold))
        if hold is None:
            continue
        try:
            if not has_path(recording):
                needed = "the resting length and the time; the contraction alone gives no stiffness"
                raise IdentificationError(f"{recording.origin}: creep elements need {needed}.")
            if hold.quantity == "force":
                holds.append(_held_rows(recording, hold))
            else:
                loaded.append(_elements_under_load(recording, hold, law))
        except AirmuscleError as error:
            reasons.append(error.message)
    stage = fit_held_rows(holds) if holds else None
    if isinstance(stage, CreepStage) and stage.elements.stiffnesses:
        return HeldCreep(tuple(sentences), stage.elements, stage.verdict, stage.standard_errors)
    usable = [loaded_hold for loaded_hold in loaded if loaded_hold.elements.stiffnesses]
    if usable:
        longest = max(usable, key=lambda loaded_hold: loaded_hold.duration)
        origin = longest.origin
        elements = longest.elements
        verdict = f"{describe_elements(elements)}, from the hold of {origin} under a constant load."
        return HeldCreep(
            tuple(sentences), elements, verdict, np.full(2 * len(elements.stiffnesses), np.nan)
        )
    causes = [*([stage.verdict] if stage is not None else []), *reasons]
    none = "The holds under a constant load justify no creep." if loaded else "There is no hold."
    return HeldCreep(tuple(sentences), CreepElements(), " ".join(causes or [none]), np.zeros(0))


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
            f"{recording.origin}: the length does not change before the hold, so its creep"
            " determines no stiffness. Move the muscle at constant pressure by a few per cent of"
            " its length, then hold it."
        )
    start = float(recording["time"][hold.interval.start])
    return HeldRows.after(recording.rows(slice(0, hold.interval.stop)), start)


class _LoadedHold(NamedTuple):
    """Duration [s], origin and creep elements of a hold under a constant load."""

    duration: float
    origin: str
    elements: CreepElements


def _elements_under_load(recording: Recording, hold: Hold, law: ForceLaw | None) -> _LoadedHold:
    """The creep elements of a hold under a constant load."""
    if law is None:
        raise IdentificationError(
            f"{recording.origin}: the creep under a constant load needs the stiffness of the"
            " muscle, that is, its static characteristic; give the muscle, or hold the length."
        )
    length = float(recording.constants["resting_length"])
    rows = recording.rows(hold.interval.rows)
    fit = fit_creep(rows, hold.quantity)
    change = _single_motion(
        recording, hold.interval.start, min(fit.creep.time_constants, default=np.inf)
    )
    pressure, contraction = (float(np.median(rows[name])) for name in ("pressure", "contraction"))
    stiffness = float(law.stiffness(pressure, contraction)) / length
    elements = creep_elements(fit, step=change * length, stiffness=stiffness, resting_length=length)
    return _LoadedHold(fit.duration, recording.origin, elements)


def _single_motion(recording: Recording, start: int, shortest: float) -> float:
    """Change of the contraction by the one quick motion before a hold. Raises IdentificationError
    for another one.
    """
    contraction = recording["contraction"]
    first = float(contraction[0])
    last = float(np.median(contraction[start : start + 3]))
    change = last - first
    origin = recording.origin
    remedy = "Record one quick change of the load or the pressure, then hold both."
    if abs(change) <= CONTRACTION_BAND:
        raise IdentificationError(f"{origin}: the length does not change before the hold. {remedy}")
    share = (contraction[: start + 1] - first) / change
    if share.min() < -0.1 or share.max() > 1.1:
        raise IdentificationError(
            f"{origin}: the muscle moves in both directions before the hold. {remedy}"
        )
    duration = float(recording["time"][start] - recording["time"][int(np.argmax(share > 0.02))])
    if duration > MAX_MOTION * shortest:
        raise IdentificationError(
            f"{origin}: the motion before the hold takes {duration:.3g} s, which is not short"
            f" compared with the time constant of {shortest:.3g} s. {remedy}"
        )
    return change
