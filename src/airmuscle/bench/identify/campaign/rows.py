"""Common parts of the stages of a campaign: rows of a record for fits, thinned along the time, with steps of the
displacement beyond its noise; a stage without a result."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from ....core.arrays import Array
from ....recording import Recording
from ...segment.runs import CONTRACTION_BAND
from ...segment.sensor import estimate_noise


@dataclasses.dataclass(frozen=True)
class LeftOutStage:
    """A stage without a result: its name, the reason, and what to measure, as phrases."""

    name: str
    reason: str
    remedy: str

    @property
    def verdict(self) -> str:
        """The reason and what to measure, as sentences."""
        return f"Not identified: {self.reason.rstrip('.')}. To identify it, {self.remedy.rstrip('.')}."


MAX_ROWS = 1000
"""Maximum number of rows of a record for a fit of friction (chosen)."""
PREDICTED_ROWS = 3000
"""Maximum number of rows of a record for which the friction is computed (chosen)."""
NOISE_STEPS = 4.0
"""Mean step of the displacement between two rows, in standard deviations of its noise (chosen)."""
NOISE_RANGE = 8.0
"""Range of the noise of a held contraction, in its standard deviations (chosen)."""
DEAD_BAND = 4.0
"""Half width of the dead band of the motion, in standard deviations of the noise of the displacement (chosen)."""


def thin(recording: Recording, count: int) -> Recording:
    """The recording reduced to at most `count` rows, evenly spaced by number."""
    return recording if len(recording) <= count else recording.rows(thinned_rows(len(recording), count))


def thinned_rows(size: int, count: int) -> Array:
    """The numbers of at most `count` rows of `size`, evenly spaced."""
    return np.unique(np.linspace(0, size - 1, min(count, size)).round().astype(int))


def displacement(recording: Recording) -> Array:
    """Displacement eps L0 [m] at every row, shape (N,)."""
    return np.asarray(recording["contraction"] * float(recording.constants["resting_length"]))


def path_rows(recording: Recording, max_rows: int = MAX_ROWS) -> Array:
    """The numbers of at most `max_rows` rows that follow the motion without that of the noise."""
    path = displacement(recording)
    noise = estimate_noise(path)
    span = float(np.ptp(path))
    count = max_rows if noise == 0.0 else int(min(max_rows, max(2.0 * span / (NOISE_STEPS * noise), 20)))
    return thinned_rows(len(recording), count)


def held_steady(path: Array, noise: float) -> Array:
    """The motion without its noise: the output of a play operator, which rests while the path [m] stays within a dead
    band of `DEAD_BAND` standard deviations of the noise [m]; shape (N,).

    The noise of a held length would otherwise unload the friction: cycles within the presliding distance relax the
    force of most friction laws towards zero.
    """
    if noise == 0.0:
        return path
    half, output, current = DEAD_BAND * noise, np.empty(path.size), float(path[0])
    for i, value in enumerate(path.tolist()):
        current = min(max(current, value - half), value + half)
        output[i] = current
    return output


def is_held(recording: Recording) -> bool:
    """Whether the length of a recording is held: its contraction stays within the band of an isometric run."""
    path = recording["contraction"]
    return float(np.nanmax(path) - np.nanmin(path)) <= CONTRACTION_BAND + NOISE_RANGE * estimate_noise(path)


def with_force(recording: Recording, added: Array) -> Recording:
    """The recording with a force added to the measured one; rows without tension stay at zero."""
    force = recording["force"]
    return recording.with_columns(force=np.where(force > 0.0, force + added, force))


def named(recordings: Sequence[Recording]) -> tuple[Recording, ...]:
    """The recordings with different origins: repeated names are numbered."""
    names = [recording.origin for recording in recordings]
    return tuple(
        each if names.count(each.origin) == 1 else dataclasses.replace(each, origin=f"{each.origin} ({i + 1})")
        for i, each in enumerate(recordings)
    )
