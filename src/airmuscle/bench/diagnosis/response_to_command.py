"""Response of a pressure to its command: delay, dead time, agreement in settled rows."""

import dataclasses

import numpy as np

from ...core import Array

MAX_LAG = 2.0
"""Greatest delay that is sought [s] (chosen)."""
MIN_ROWS = 20
"""Least number of rows that are judged (chosen)."""
MAX_LAGS = 400
"""Greatest number of delays that are tried (chosen)."""
SETTLED_TIME = 0.5
"""Time since the last change of the command after which a pressure counts as settled [s] (chosen;
published regulators need 0.05 to 0.3 s)."""
COMMAND_BAND = 0.01
STEP = 0.1
MOVED = 0.05
"""Change of a command that counts as none, that of a step, and the change of the pressure that
shows a response, as fractions of the range of the command (chosen)."""

MIN_STEP = 4e4
"""Least step of a command whose dead time is judged [Pa] (chosen): regulators leave smaller ones
inside their dead band."""


@dataclasses.dataclass(frozen=True, eq=False)
class CommandResponse:
    """The response of a pressure to its command.

    delay        [s] of the pressure, at which both agree best; negative where it precedes
    correlation  at this delay; lead_gain: by how much it exceeds that without delay
    dead_time    [s] shortest time from a step of the command to the first motion; None without
                 steps
    settled      rows (N,) whose command has not changed for a while
    """

    delay: float
    correlation: float
    lead_gain: float
    dead_time: float | None
    settled: Array


def command_response(time: Array, command: Array, pressure: Array) -> CommandResponse | None:
    """The response of a pressure [Pa] to its command [Pa], each (N,) at times [s]; None where the
    command or the pressure does not vary, or time does not rise.
    """
    steps = np.diff(time)
    if len(time) < MIN_ROWS or not np.all(steps > 0.0):
        return None
    if not (np.ptp(command) > 0.0 and np.ptp(pressure) > 0.0):
        return None
    step = float(np.median(steps))
    uniform = np.arange(time[0], time[-1], step)
    rows = np.searchsorted(time, uniform, side="right") - 1
    held = command[np.clip(rows, 0, None)]
    response = np.interp(uniform, time, pressure)
    most = min(int(MAX_LAG / step), len(uniform) // 3)
    stride = max(1, most // MAX_LAGS)
    count = most // stride
    lags = stride * np.arange(-count, count + 1)
    values = np.array([_correlation(held, response, int(lag)) for lag in lags])
    best = int(np.argmax(values))
    without_delay = float(values[count])
    return CommandResponse(
        delay=float(lags[best] * step),
        correlation=float(values[best]),
        lead_gain=float(values[best]) - without_delay,
        dead_time=_dead_time(time, command, pressure),
        settled=_settled(time, command),
    )


def _correlation(command: Array, response: Array, lag: int) -> float:
    """Correlation of a response that is shifted by a number of rows."""
    if lag >= 0:
        before, after = command[: len(command) - lag], response[lag:]
    else:
        before, after = command[-lag:], response[:lag]
    if np.ptp(before) == 0.0 or np.ptp(after) == 0.0:
        return -1.0
    return float(np.corrcoef(before, after)[0, 1])


def _settled(time: Array, command: Array) -> Array:
    """Rows whose command has been constant for the time of settling."""
    band = COMMAND_BAND * float(np.ptp(command))
    is_change = np.abs(np.diff(command)) > band
    last_change = np.full(len(time), time[0])
    changes = np.flatnonzero(is_change) + 1
    last_change[changes] = time[changes]
    since = time - np.maximum.accumulate(last_change)
    before = np.searchsorted(time, time - SETTLED_TIME)
    is_slow = np.abs(command - command[before]) <= band
    return np.asarray((since > SETTLED_TIME) & is_slow)


def _dead_time(time: Array, command: Array, pressure: Array) -> float | None:
    """The shortest time from a step of the command until the pressure moves towards it: other
    muscles of a joint may delay it, nothing hastens it.
    """
    span = float(np.ptp(command))
    jumps = np.diff(command)
    rows = np.flatnonzero(np.abs(jumps) > STEP * span) + 1
    ends = [*rows[1:], len(time)][: len(rows)]
    times = []
    for row, end in zip(rows, ends, strict=True):
        jump = float(jumps[row - 1])
        if abs(jump) < MIN_STEP:
            continue
        motion = np.sign(jump) * (pressure[row:end] - pressure[row - 1])
        goal = max(MOVED * span, STEP * abs(jump))
        late = np.flatnonzero(motion > goal)
        if late.size:
            first = row + late[0]
            times.append(float(time[first] - time[row]))
    if not times:
        return None
    return min(times)
