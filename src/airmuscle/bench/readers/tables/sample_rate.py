"""Time by a sample rate: of rows without time, by a counter of samples if there is one, and of
time stamps that jitter.
"""

import re
from collections.abc import Mapping

import numpy as np

from ....core import Array, ColumnError, UnitError, quantity

SAMPLE_RATE = "sample_rate"
"""Name of the constant of a run."""
_RATE_NAME = re.compile(
    r"(fs|f_s|(sample|sampling|scan|acquisition|logging|data)[ _-]*(rate|frequency|freq)"
    r"|abtastrate|abtastfrequenz|messrate)",
    re.IGNORECASE,
)
_RATE_VALUE = re.compile(
    r"\s*(?P<number>\d+(?:[.,]\d+)?(?:e[+-]?\d+)?)\s*[(\[]?\s*(?P<unit>k?hz|1/s|s/s|samples/s|sps)?"
    r"\s*[)\]]?\s*",
    re.IGNORECASE,
)
_COUNTER = re.compile(
    r"(frame|sample|index|count|counter|n|no|nr|row|scan|idx|#|messung)s?"
    r"([ _.-]*(number|no|nr|count|index|id))?\.?",
    re.IGNORECASE,
)
MAX_RATE = 1e7
"""Greatest sample rate [Hz] (chosen)."""


def rate_in_comment(name: str, value: str) -> str | None:
    """The sample rate in a comment, `Fs = 500 (Hz)`, as a text with a unit; None for another
    comment. A number without a unit is in Hz.
    """
    match = _RATE_VALUE.fullmatch(value)
    word = re.split(r"[(\[]", name)[0].strip()
    if not match or not _RATE_NAME.fullmatch(word):
        return None
    unit = "kHz" if (match["unit"] or "").casefold() == "khz" else "Hz"
    return f"{match['number'].replace(',', '.')} {unit}"


def parse_rate(stated: float | str, where: str) -> float:
    """A sample rate [Hz] of a number, of a text such as `500 Hz`, or of a sample time, `2 ms`.
    Raises UnitError or ColumnError.
    """
    try:
        rate = float(quantity(stated, "Hz", where=f"{where}: sample rate"))
    except UnitError:
        step = float(quantity(stated, "s", where=f"{where}: sample rate"))
        rate = 1.0 / step if step > 0.0 else 0.0
    if not 0.0 < rate <= MAX_RATE:
        raise ColumnError(f"{where}: the sample rate is {stated}; it must be positive, '500 Hz'.")
    return rate


def time_of_rows(
    columns: Mapping[str, Array], rows: int, rate: float, source: str
) -> tuple[Array, str]:
    """The time [s] of rows by a rate, shape (N,): of a counter of whole numbers that rises, where
    there is one, so that lost rows are gaps; and a note.
    """
    for name, values in columns.items():
        if not _COUNTER.fullmatch(name.strip()) or len(values) < 2:
            continue
        steps = np.diff(values)
        if np.all(steps >= 1.0) and np.all(values == np.round(values)):
            lost = int(np.sum(steps) - len(steps))
            gaps = f"; {lost} of its numbers are missing, which are gaps" if lost else ""
            note = f"Time is the counter '{name}' at {rate:.6g} Hz, {source}{gaps}."
            return np.asarray((values - values[0]) / rate), note
    return np.arange(rows) / rate, f"Time is the number of the row at {rate:.6g} Hz, {source}."


def resampled(columns: Mapping[str, Array], rate: float) -> tuple[dict[str, Array], str]:
    """The columns (N,) at uniform times of a rate, interpolated linearly, whole numbers held; and a
    note. Raises ColumnError where time does not rise.
    """
    time = columns["time"]
    steps = np.diff(time)
    if len(time) < 2 or not np.all(steps > 0.0):
        raise ColumnError("rows are resampled to a sample rate only where time rises.")
    duration = float(time[-1] - time[0])
    count = int(duration * rate + 1e-6) + 1
    grid = time[0] + np.arange(count) / rate
    before = np.searchsorted(time, grid + 1e-9 / rate, side="right") - 1
    held = np.clip(before, 0, None)
    uniform: dict[str, Array] = {}
    for name, values in columns.items():
        is_held = bool(np.all(values == np.round(values)))
        if is_held:
            uniform[name] = values[held]
        else:
            uniform[name] = np.interp(grid, time, values)
    uniform["time"] = grid
    shortest = 1e3 * float(steps.min())
    longest = 1e3 * float(steps.max())
    note = (
        f"The intervals of the time stamps are {shortest:.4g} to {longest:.4g} ms;"
        f" {len(time)} rows are interpolated to {count} at {rate:.6g} Hz."
    )
    return uniform, note
