"""EpisodeMapping: what the columns of a file of episodes are, and its columns in SI units."""

import dataclasses

import numpy as np

from ...core import Array, ColumnError, check_known
from ..readers import Arrays


@dataclasses.dataclass(frozen=True)
class Channels:
    """Columns of one quantity, or the name of one array with all of them; value = number * scale /
    divisors.
    """

    columns: tuple[str, ...]
    scale: float = 1.0
    divisors: str | None = None


@dataclasses.dataclass(frozen=True)
class EpisodeMapping:
    """Contents of a file of episodes, as its mapping file states them.

    angles, speeds, pressures, commands  Channels; with `from_commands` the pressures are commands
    time         column of times [s], whose rows are interpolated where they are not even
    sample_time  [s], or None for the median interval of `time`
    starts       array with the first row of every episode, where a file holds all of them
    rests        duration [s] of the rests at which one long record is cut
    pairs        for each joint the numbers, from 1, of the muscle that raises its angle and of its
                 antagonist
    axes         of the joints in the frames of their links
    """

    angles: Channels
    pressures: Channels
    speeds: Channels | None = None
    commands: Channels | None = None
    sample_time: float | None = None
    time: str | None = None
    starts: str | None = None
    rests: float | None = None
    from_commands: bool = False
    pairs: tuple[tuple[int, int], ...] = ()
    axes: tuple[tuple[int, int, int], ...] = ()

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of all columns and arrays that are used."""
        quantities = (self.angles, self.pressures, self.speeds, self.commands)
        named = [
            name for channels in quantities if channels is not None for name in channels.columns
        ]
        return (*named, *(name for name in (self.time, self.starts) if name is not None))


def columns_of(name: str, arrays: Arrays, channels: Channels) -> Array:
    parts = [array_of(name, arrays, column) for column in channels.columns]
    if not all(part.ndim and part.size for part in parts):
        raise ColumnError(
            f"{name}: {', '.join(channels.columns)} has no row; leave the episode out."
        )
    stacked = (
        np.concatenate([part.reshape(len(part), -1) for part in parts], axis=1) * channels.scale
    )
    if channels.divisors is not None:
        stacked = stacked / array_of(name, arrays, channels.divisors).ravel()
    if not np.isfinite(stacked).all():
        row, column = np.argwhere(~np.isfinite(stacked))[0]
        raise ColumnError(
            f"{name}: row {row + 1} of {', '.join(channels.columns)} (column {column + 1}) is not a"
            " finite number; leave the episode out, or split it there."
        )
    return np.asarray(stacked, dtype=float)


def array_of(name: str, arrays: Arrays, column: str) -> Array:
    check_known(f"{name}: no column", column, arrays, error=ColumnError)
    return arrays[column]
