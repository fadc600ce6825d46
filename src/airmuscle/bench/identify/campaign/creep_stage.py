"""Creep of holds after a motion, as Maxwell elements that all holds share."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from ....core import AirmuscleError, Array, IdentificationError, ShortRepr
from ....physics.muscle import CreepElements
from ....recording import Recording
from ..hysteresis import fit_creep
from ..hysteresis.creep import MIN_RATIO, CreepFit
from .record import CampaignRecord
from .transient import LeftOutStage, displacement, find_motion, thinned_rows

NAME = "creep"
FIT_ROWS = 400
"""Maximum number of rows of a hold (chosen)."""
DEADTIME = 0.2
"""Time after the end of the motion that is not fitted [s] (chosen): the load cell and the frame settle."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class CreepStage(ShortRepr):
    """Maxwell elements fitted to the force of all holds together, with the result for each hold alone."""

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
        holds, slowest = (
            f"{len(self.holds)} holds; rms residual {self.rmse:.3g} N.",
            max(self.elements.relaxation_times),
        )
        further = (
            f" The holds of {self.longest:.4g} s are too short for the longest relaxation time; hold for "
            f"{6 * slowest:.2g} s to determine it."
        )
        return f"{describe_elements(self.elements)}, from {holds}{further if slowest > self.longest / 2 else ''}"


def describe_elements(elements: CreepElements) -> str:
    """Stiffness and relaxation time of each element, as a phrase."""
    pairs = zip(elements.stiffnesses, elements.relaxation_times, strict=True)
    return f"Maxwell elements of {' and '.join(f'{k:.4g} N/m with {tau:.4g} s' for k, tau in pairs)}"


def fit_creep_stage(records: Sequence[CampaignRecord]) -> CreepStage | LeftOutStage:
    """Fit Maxwell elements to the holds at constant length and pressure.

    The number of elements is the largest that the F test justifies in a hold. Relaxation times and stiffnesses are
    common to all holds, each hold has its own initial force.
    """
    if not records:
        remedy = (
            "move the muscle by a few per cent of its length within a second at constant pressure, hold the length for "
            "two minutes or more, and record the force"
        )
        return LeftOutStage(NAME, "no record is a hold after a motion", remedy)
    motions = [(record, find_motion(record.recording)) for record in records]
    return fit_held_rows(
        [(each.origin, HeldRows.after(each.recording, motion.end)) for each, motion in motions if motion]
    )


def fit_held_rows(named_holds: "Sequence[tuple[str, HeldRows]]") -> CreepStage | LeftOutStage:
    """Fit Maxwell elements to named holds, as `fit_creep_stage`."""
    holds = [hold for _, hold in named_holds]
    try:
        fits = [fit_creep(hold.recording, "force") for hold in holds]
    except AirmuscleError as error:
        return LeftOutStage(NAME, str(error.message), "record holds of 12 rows or more with increasing time")
    count = max(len(fit.creep.amplitudes) for fit in fits)
    return _fit_elements(holds, count, tuple((name, fit) for (name, _), fit in zip(named_holds, fits, strict=True)))


@dataclasses.dataclass(frozen=True, eq=False)
class HeldRows:
    """The held rows of a record, and the path of its displacement from the first row."""

    recording: Recording
    time: Array
    path: Array
    held: Array

    @classmethod
    def after(cls, whole: Recording, end_of_motion: float) -> "HeldRows":
        """The rows after a dead time from the end of the motion [s] to the end of the recording.

        Raises IdentificationError where there are none.
        """
        later = whole["time"] > end_of_motion + DEADTIME
        if not later.any():
            raise IdentificationError(
                f"{whole.origin}: the hold ends {whole['time'][-1] - end_of_motion:.2g} s after the motion, within the "
                f"{DEADTIME:g} s in which load cell and frame settle; hold longer."
            )
        start = int(np.argmax(later))
        kept, path = start + thinned_rows(len(whole) - start, FIT_ROWS), displacement(whole)
        path = np.where(np.arange(path.size) < start, path, np.median(path[start:]))  # no motion by the noise
        return cls(whole.rows(kept), whole["time"], path, kept)

    def stretches(self, times: Array) -> Array:
        """Stretch [m] of the spring of each element at the held rows, shape (N, E)."""
        return np.asarray(creep_stretches(self.time, self.path, times)[self.held])


def creep_stretches(time: Array, path: Array, relaxation_times: Array) -> Array:
    """Stretch z [m] of each Maxwell element along a path x [m], z' = x' - z/tau, exact for linear motion; (N, E)."""
    steps, durations = np.diff(path, prepend=path[:1]), np.diff(time, prepend=time[:1])
    decay = np.exp(-durations[:, None] / relaxation_times)
    ratio = durations[:, None] / relaxation_times
    gain = np.where(ratio > 1e-9, -np.expm1(-ratio) / np.maximum(ratio, 1e-300), 1.0) * steps[:, None]
    stretches = np.zeros((time.size, relaxation_times.size))
    for i in range(1, time.size):
        stretches[i] = stretches[i - 1] * decay[i] + gain[i]
    return stretches


def creep_force(elements: CreepElements, recording: Recording) -> Array:
    """Force of the elements against contraction [N] along the motion of a recording, relaxed at its start; (N,)."""
    if not elements.stiffnesses or "time" not in recording:
        return np.zeros(len(recording))
    stretches = creep_stretches(recording["time"], displacement(recording), np.array(elements.relaxation_times))
    return np.asarray(stretches @ np.array(elements.stiffnesses))


def _fit_elements(
    holds: Sequence[HeldRows], count: int, fits: tuple[tuple[str, CreepFit], ...]
) -> CreepStage | LeftOutStage:
    from scipy.optimize import least_squares

    if count == 0:
        constant = [np.full(len(hold.recording), hold.recording["force"].mean()) for hold in holds]
        return _build(holds, CreepElements(), np.zeros(0), fits, constant)
    longest = max(float(hold.recording["time"][-1] - hold.recording["time"][0]) for hold in holds)
    best = max((fit.creep.time_constants for _, fit in fits), key=len)
    ordered = np.clip(np.sort(np.array(best)), 0.1, 2.0 * longest)
    steps = np.log(np.concatenate([ordered[:1], np.maximum(ordered[1:] / ordered[:-1], 1.05 * MIN_RATIO)]))
    low, high = np.log([0.1, *[MIN_RATIO] * (count - 1)]), np.log([2.0 * longest, *[2.0 * longest] * (count - 1)])

    start = np.clip(steps, low + 1e-6, high - 1e-6)
    result = least_squares(lambda x: _linear_part(holds, np.exp(np.cumsum(x)))[1], start, bounds=(low, high))
    times = np.exp(np.cumsum(result.x))
    coefficients, rest = _linear_part(holds, times)
    stiffnesses = coefficients[:count]
    if not (stiffnesses > 0).all():
        reason = "the force of the holds does not relax towards the value before the motion"
        remedy = (
            "hold the pressure constant during the motion and after it, because a pressure step also changes the force"
        )
        return LeftOutStage(NAME, reason, remedy)
    elements = CreepElements(tuple(stiffnesses.tolist()), tuple(times.tolist()))
    modelled = [matrix @ coefficients for matrix in _matrices(holds, times)]
    return _build(holds, elements, _standard_errors(holds, times, coefficients, rest), fits, modelled)


def _matrices(holds: Sequence[HeldRows], times: Array) -> list[Array]:
    """Columns of each hold: minus the stretches, then the initial force of each hold."""
    own = np.eye(len(holds))
    return [np.hstack([-hold.stretches(times), np.tile(own[i], (hold.held.size, 1))]) for i, hold in enumerate(holds)]


def _linear_part(holds: Sequence[HeldRows], times: Array) -> tuple[Array, Array]:
    matrix = np.vstack(_matrices(holds, times))
    target = np.concatenate([hold.recording["force"] for hold in holds])
    coefficients = np.linalg.lstsq(matrix, target, rcond=None)[0]
    return coefficients, matrix @ coefficients - target


def _standard_errors(holds: Sequence[HeldRows], times: Array, coefficients: Array, residuals: Array) -> Array:
    """Standard errors of the stiffnesses and the relaxation times from the Jacobian at the solution."""
    base = np.vstack(_matrices(holds, times))
    slopes = []
    for i in range(times.size):
        changed = times.copy()
        changed[i] *= 1.0 + 1e-4
        slopes.append((np.vstack(_matrices(holds, changed)) - base) @ coefficients / (1e-4 * times[i]))
    jacobian = np.hstack([base, np.column_stack(slopes)])
    variance = float(residuals @ residuals) / max(residuals.size - jacobian.shape[1], 1)
    deviations = np.sqrt(np.maximum(np.diag(np.linalg.pinv(jacobian.T @ jacobian)), 0.0) * variance)
    return np.concatenate([deviations[: times.size], deviations[-times.size :]])


def _build(
    holds: Sequence[HeldRows], elements: CreepElements, standard_errors: Array, fits: tuple[tuple[str, CreepFit], ...],
    modelled: Sequence[Array],
) -> CreepStage:  # fmt: skip
    measured = [hold.recording["force"] for hold in holds]
    residuals = np.concatenate([a - b for a, b in zip(modelled, measured, strict=True)])
    times = [hold.recording["time"] - hold.recording["time"][0] for hold in holds]
    return CreepStage(
        elements, standard_errors, fits, tuple(times), tuple(measured), tuple(modelled),
        float(np.sqrt(np.mean(residuals**2))), max(float(t[-1]) for t in times),
    )  # fmt: skip
