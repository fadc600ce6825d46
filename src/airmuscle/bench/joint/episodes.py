"""Episodes: short records of an arm, each with its own initial state, in SI units."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from ...core.arrays import Array
from ...core.errors import ParameterError
from ...core.short_repr import ShortRepr


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Episode(ShortRepr):
    """One run of an arm, n rows at one sample time.

    angle (n, J) [rad] and speed (n, J) [rad/s] of the joints, pressure (n, M) of the muscles [Pa, or counts times a
    scale], command (n, M) in any unit or None, name of its file or place in the file.
    """

    angle: Array
    speed: Array
    pressure: Array
    command: Array | None = None
    name: str = ""

    def __len__(self) -> int:
        return len(self.angle)


@dataclasses.dataclass(frozen=True, eq=False)
class Episodes:
    """Episodes of one arm with a common sample time [s]; `notes` state what the reader has found or corrected.

    A slice of it is again an Episodes: `episodes[:2400]`.
    """

    runs: tuple[Episode, ...]
    sample_time: float
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not self.runs or not self.sample_time > 0.0:
            raise ParameterError(
                f"Episodes: {len(self.runs)} runs at a sample time of {self.sample_time:g} s are given; give one run "
                "at least and a sample time above 0."
            )
        shapes = {(each.angle.shape[1], each.pressure.shape[1]) for each in self.runs}
        if len(shapes) > 1:
            raise ParameterError(
                f"Episodes: runs have different numbers of joints and muscles, {sorted(shapes)}; fit each arm alone."
            )

    def __len__(self) -> int:
        return len(self.runs)

    def __getitem__(self, part: slice) -> Episodes:
        return dataclasses.replace(self, runs=self.runs[part])

    @property
    def joints(self) -> int:
        """Number of joints."""
        return int(self.runs[0].angle.shape[1])

    @property
    def muscles(self) -> int:
        """Number of muscles."""
        return int(self.runs[0].pressure.shape[1])

    def rows(self, name: str) -> Array:
        """The rows of all runs of one quantity: angle, speed, pressure or command."""
        return np.concatenate([getattr(each, name) for each in self.runs])


def speed_of(angle: Array, sample_time: float) -> Array:
    """Speed [rad/s] from angles (n, J): slope of a parabola through five rows."""
    if len(angle) < 5:
        return np.asarray(np.gradient(angle, sample_time, axis=0))
    weights = np.array([2.0, 1.0, 0.0, -1.0, -2.0]) / (10.0 * sample_time)
    inner = np.stack([np.convolve(column, weights, "valid") for column in angle.T], axis=1)
    ends = np.gradient(angle, sample_time, axis=0)
    return np.concatenate([ends[:2], inner, ends[-2:]])


def join(parts: Sequence[Episodes]) -> Episodes:
    """Episodes of several files as one. Raises ParameterError for different sample times."""
    times = {round(each.sample_time, 6) for each in parts}
    if len(times) > 1:
        raise ParameterError(f"Episodes: files have different sample times [s], {sorted(times)}; fit each alone.")
    notes = tuple(dict.fromkeys(note for each in parts for note in each.notes))
    return Episodes(tuple(run for each in parts for run in each.runs), parts[0].sample_time, notes)
