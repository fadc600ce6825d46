"""Checks of later episodes against an identified arm: that they are of this arm, in its units and
at its sample time, and why single ones do not fit.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

from ...core import Array, IdentificationError
from .episode_inspection import (
    DEAD,
    PIECES,
    constant_readings,
    exchanged,
    faults_of_readings,
    jumps,
    pressure_actions,
)
from .episodes import HISTORY, Episode, Episodes, Windows
from .identified import IdentifiedArm

SAME_STEP = 0.02
"""Relative difference of two sample times up to which they are the same (chosen)."""
MUCH_GREATER = 3.0
MUCH_SMALLER = 0.12
"""Ratio of ranges above or below which an angle or a pressure has another scale: less than the
smallest factor between two units of pressure, 0.145 of psi and bar (chosen).
"""
FACTORS = {
    "angle": {
        57.29577951308232: "degrees read as radians",
        0.017453292519943295: "radians read as degrees",
    },
    "pressure": {
        1e5: "Pa read as bar",
        1e3: "Pa read as kPa",
        1e-3: "kPa read as Pa",
        1e-5: "bar read as Pa",
        1e-6: "MPa read as Pa",
        0.1: "MPa read as bar",
        10.0: "bar read as MPa",
    },
}
"""Factors of a range that another unit explains, with its words."""
SAME_FACTOR = 1.6
"""Ratio of a range to such a factor up to which the unit explains it (chosen)."""
BEYOND = 0.1
"""Part of a range by which readings may lie beyond the fitted one (chosen)."""
STILL = 0.15
"""Ratio of two motions, root mean square, up to which one is none (chosen)."""


def check_same_arm(arm: IdentifiedArm, episodes: Episodes) -> None:
    """Check that episodes are a record of an arm. Raises IdentificationError, with what differs and
    what to do.
    """
    numbers = (episodes.joints, episodes.muscles)
    of_arm = (arm.joints, len(arm.columns))
    if numbers != of_arm:
        raise IdentificationError(
            f"the episodes have {numbers[0]} angles and {numbers[1]} pressures, the arm"
            f" {of_arm[0]} and {of_arm[1]}: another arm, or other columns. Give episodes of the"
            " same arm, or a mapping file (--mapping) that names its columns in the same order."
        )
    step = episodes.sample_time
    if abs(step / arm.sample_time - 1.0) > SAME_STEP:
        raise IdentificationError(
            f"the episodes have a sample time of {1e3 * step:.4g} ms, those of the fit"
            f" {1e3 * arm.sample_time:.4g} ms. Correct sample_time in the mapping file if it is"
            f' wrong; where the record has a column of times, time = "NAME" with sample_time ='
            f' "{1e3 * arm.sample_time:.6g} ms" interpolates its rows.'
        )
    faults = [*jumps(episodes), *_scales(arm, episodes), *faults_of_readings(episodes)]
    if faults:
        raise IdentificationError(faults[0])
    if len(episodes) >= PIECES:
        _, actions = pressure_actions(episodes)
        if wrong := exchanged(actions, arm.pairs, "the fit"):
            raise IdentificationError(
                f"{wrong[0]} Another arm, or columns of pressures in another order: name them in"
                " the order of the fit in a mapping file (--mapping)."
            )


def _scales(arm: IdentifiedArm, episodes: Episodes) -> list[str]:
    """Angles or pressures whose range is that of another unit, compared with the fit."""
    texts = []
    for name, unit, shown, fitted in (
        ("angle", 1.0, "rad", arm.angles),
        ("pressure", 1e3, "kPa", arm.pressures),
    ):
        later = np.quantile(episodes.rows(name), (0.01, 0.99), axis=0).T
        fitted_size = np.max(np.abs(fitted), axis=1)
        ratios = np.max(np.abs(later), axis=1) / np.maximum(fitted_size, 1e-12)
        ratio = float(np.median(ratios))
        if MUCH_SMALLER < ratio < MUCH_GREATER:
            continue
        known = FACTORS[name]
        nearest = min(known, key=lambda factor: abs(np.log(ratio / factor)))
        cause = f", as {known[nearest]}" if 1 / SAME_FACTOR < ratio / nearest < SAME_FACTOR else ""
        worst = int(np.argmax(np.abs(np.log(np.maximum(ratios, 1e-12)))))
        low, high = later[worst] / unit
        fitted_low, fitted_high = fitted[worst] / unit
        texts.append(
            f"{name} {worst + 1} goes from {low:.4g} to {high:.4g} {shown} in 98 % of the rows, in"
            f" the fit from {fitted_low:.4g} to {fitted_high:.4g} {shown}{cause}: another scale."
            f" State its unit or scale in a mapping file (--mapping), [{name}s]; if the readings"
            " are right, fit the arm anew with episodes of this range."
        )
    return texts


def remarks_on(arm: IdentifiedArm, episodes: Episodes) -> list[str]:
    """What differs from the record of the fit, and does not forbid a prediction."""
    remarks = [
        text.partition(": its sensor")[0] + ": it is held, or its sensor does not record"
        for text in constant_readings(episodes)
    ]
    if len(episodes) >= PIECES:
        delay, _ = pressure_actions(episodes)
        if abs(delay - arm.delay) > 1:
            remarks.append(
                f"the pressures lag by {delay} rows behind the motion, those of the fit by"
                f" {arm.delay}: other sensors, filters or clocks"
            )
    if arm.mapping is None:
        remarks.append("the arm does not state how its record was read")
    return remarks


@dataclasses.dataclass(frozen=True)
class UnfitEpisode:
    """An episode that an arm does not follow: its name, the joint, from 1, the rms error of its
    free run [rad], and the likely cause.
    """

    name: str
    joint: int
    error: float
    cause: str


def unfit_episodes(
    arm: IdentifiedArm, episodes: Episodes, windows: Windows, predicted: Array
) -> tuple[UnfitEpisode, ...]:
    """The episodes whose rms error in a joint exceeds what 95 % of the errors stay below at the end
    of a free run, the greatest excess first.
    """
    measured = windows.angle[:, HISTORY + 1 :]
    squares = np.mean((predicted - measured) ** 2, axis=1)
    limits = arm.band[-1]
    unfit = []
    for number in np.unique(windows.episode):
        of_episode = windows.episode == number
        error = np.sqrt(np.mean(squares[of_episode], axis=0))
        joint = int(np.argmax(error / limits))
        if error[joint] > limits[joint]:
            cause = _cause(
                arm,
                episodes.runs[number],
                joint,
                measured[of_episode, :, joint] - windows.angle[of_episode, HISTORY, joint, None],
                predicted[of_episode, :, joint] - windows.angle[of_episode, HISTORY, joint, None],
            )
            name = episodes.runs[number].name
            unfit.append(UnfitEpisode(name, joint + 1, float(error[joint]), cause))
    return tuple(sorted(unfit, key=lambda episode: -episode.error / limits[episode.joint - 1]))


def _cause(arm: IdentifiedArm, run: Episode, joint: int, moved: Array, expected: Array) -> str:
    """Likely cause of a misfit of a joint, from its readings and from its motion (N, rows) [rad]
    beside the predicted one.
    """
    for column in arm.pairs[joint]:
        readings = run.pressure[:, column - 1]
        low, high = arm.pressures[column - 1]
        if np.ptp(readings) <= DEAD * (high - low):
            return (
                f"pressure {column} stays at {readings[0] / 1e3:.4g} kPa: held, or its sensor does"
                " not record"
            )
        if outside := _outside(readings, low, high, 1e3, "kPa"):
            return f"pressure {column} {outside}"
    low, high = arm.angles[joint]
    if outside := _outside(run.angle[:, joint], low, high, np.pi / 180.0, "deg"):
        return f"angle {joint + 1} {outside}"
    motion, prediction = (float(np.sqrt(np.mean(part**2))) for part in (moved, expected))
    if motion < STILL * prediction:
        return "the joint rests where the model moves: held, blocked, or stiction lasts longer"
    if prediction < STILL * motion:
        return "the joint moves where the model rests: pushed from outside, or it slips earlier"
    if np.sum(moved * expected) < 0.0:
        return "the joint moves against the prediction: pushed from outside, or another load"
    return "no reading is unusual: contact, another load, or slip at another moment"


def _outside(readings: Array, low: float, high: float, unit: float, shown: str) -> str:
    """In words, how far readings lie beyond a fitted range; empty if they do not."""
    margin = BEYOND * (high - low)
    ends: Sequence[tuple[float, bool]] = (
        (float(np.min(readings)), float(np.min(readings)) < low - margin),
        (float(np.max(readings)), float(np.max(readings)) > high + margin),
    )
    for end, is_beyond in ends:
        if is_beyond:
            return (
                f"reaches {end / unit:.4g} {shown}, fitted from {low / unit:.4g} to"
                f" {high / unit:.4g} {shown}"
            )
    return ""
