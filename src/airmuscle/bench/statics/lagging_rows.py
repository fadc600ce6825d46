"""Slack rows within the lag of the rig after a jump of the pressure: the force has not yet
followed, so that they are no evidence against a law.

The lag is that of the measured force: the steps of the force are regressed on the present and the
last steps of the pressure, after jumps at rows that pull; it ends with the row at which the force
has made the settled share of its response.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ...core import Array
from ...recording import Recording
from ..inspection import remembered

Rows = npt.NDArray[np.bool_]
MIN_JUMP = 0.04
JUMP_RATIO = 4.0
"""Step of the pressure from one row to the next that is a jump: as a fraction of its maximum, and
in median steps of the run, so that the rows of a coarse ramp are none (chosen)."""
MAX_LAG_ROWS = 6
MIN_JUMPS = 8
"""Maximum lag in rows, and minimum number of jumps at rows that pull from which it is measured
(chosen).
"""
SETTLED = 0.9
"""Share of the response of the force at which it has followed (chosen)."""
MIN_PULL = 0.02
"""Force of a row that pulls, as a fraction of the maximum force (chosen)."""


class LaggingRows(NamedTuple):
    """Masks of the slack rows of each recording that the force of the rig has not yet reached, and
    the lag [s]; 0 where none is known.
    """

    masks: tuple[Rows, ...]
    lag: float = 0.0

    @property
    def joined(self) -> Rows:
        """The masks below each other."""
        return np.concatenate([np.zeros(0, dtype=bool), *self.masks])

    def notes(self) -> list[str]:
        """The remark that rows were left out; empty without such rows."""
        count = int(np.count_nonzero(self.joined))
        if not count:
            return []
        rows = "1 row without tension is" if count == 1 else f"{count} rows without tension are"
        return [
            f"{rows} left out, because the pressure jumped and the force has not yet followed,"
            f" which it does within {1e3 * self.lag:.3g} ms."
        ]


@remembered
def find_lagging_rows(recordings: Sequence[Recording]) -> LaggingRows:
    """The slack rows within the lag of a jump of the pressure; none where no lag is measured."""
    jumps = [_jumps(run) for run in recordings]
    lag_rows = _lag_rows(recordings, jumps)
    masks = tuple(
        _rows_after(jump, lag_rows) & _is_slack(run)
        for run, jump in zip(recordings, jumps, strict=True)
    )
    sample_times = [float(np.median(np.diff(run["time"]))) for run in recordings if _is_timed(run)]
    sample_time = float(np.median(sample_times)) if sample_times else 0.0
    return LaggingRows(masks, lag_rows * sample_time)


def _rows_after(jumps: Rows, count: int) -> Rows:
    """The rows (N,) from each jump on, this number of them."""
    late = np.zeros(jumps.size, dtype=bool)
    for lag in range(count):
        late[lag:] |= jumps[: jumps.size - lag]
    return late


def _is_slack(run: Recording) -> Rows:
    """The rows (N,) without tension."""
    if "force" not in run:
        return np.zeros(len(run), dtype=bool)
    return np.asarray(run["force"] <= 0.0)


def _is_timed(run: Recording) -> bool:
    return "time" in run and len(run) > MAX_LAG_ROWS + 1


def _jumps(run: Recording) -> Rows:
    """The rows (N,) to which the pressure jumps from the row before."""
    jumps = np.zeros(len(run), dtype=bool)
    if not _is_timed(run) or "pressure" not in run or not np.isfinite(run["pressure"]).any():
        return jumps
    pressure = run["pressure"]
    steps = np.abs(np.diff(pressure))
    least = max(MIN_JUMP * float(np.nanmax(pressure)), JUMP_RATIO * float(np.nanmedian(steps)))
    jumps[1:] = np.nan_to_num(steps) > least
    return jumps


def _lag_rows(recordings: Sequence[Recording], jumps: Sequence[Rows]) -> int:
    """The number of rows that the force needs to follow a jump of the pressure; 0 where this is not
    known.
    """
    tables = [np.zeros((0, MAX_LAG_ROWS + 2))]
    for run, jump in zip(recordings, jumps, strict=True):
        if jump.any():
            tables.append(_responses(run, jump))
    table = np.concatenate(tables)
    if len(table) < MIN_JUMPS * (MAX_LAG_ROWS + 1):
        return 0
    force_steps = table[:, 0]
    pressure_steps = table[:, 1:]
    scale = float(np.max(np.abs(pressure_steps))) or 1.0
    solution = np.linalg.lstsq(pressure_steps / scale, force_steps, rcond=1e-9)
    response = np.cumsum(solution[0])
    total = float(response[-1])
    if total <= 0.0:
        return 0
    settled = response >= SETTLED * total
    return int(np.argmax(settled)) + 1


def _responses(run: Recording, jumps: Rows) -> Array:
    """The steps of the force at the rows from each jump on that pull, and the present and the last
    steps of the pressure; shape (M, 2 + `MAX_LAG_ROWS`).
    """
    force = run["force"]
    pulls = force > MIN_PULL * float(np.nanmax(force))
    pressure_steps = np.diff(run["pressure"], prepend=run["pressure"][0])
    near = _rows_after(jumps, MAX_LAG_ROWS + 1)
    near[: MAX_LAG_ROWS + 1] = False
    near[1:] &= pulls[1:] & pulls[:-1]
    rows = np.flatnonzero(near)
    columns = [force[rows] - force[rows - 1]]
    for lag in range(MAX_LAG_ROWS + 1):
        columns.append(pressure_steps[rows - lag])
    table = np.stack(columns, axis=1)
    complete = np.isfinite(table).all(axis=1)
    return np.asarray(table[complete])
