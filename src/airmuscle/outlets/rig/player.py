"""Player of planned signals on a rig, with its limits, its watchdog and its safe state."""

import contextlib
import dataclasses
import math
import signal
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from types import FrameType
from typing import Any

import numpy as np

from ...bench import SignalLimits
from ...core import AirmuscleError, ParameterError, ShortRepr, counted, listed, plotting
from ...recording import Recording
from ...report.chapter import Chapter, NamedValue, Plot
from .protocol import Rig

OVERSHOOT = 3e4
"""Overshoot of a measured pressure beyond the greatest command that is allowed [Pa] (chosen)."""
MAX_LATE = 0.1
"""Lateness of a row at which the player vents [s] (chosen)."""
SLICE = 0.02
"""Longest sleep of the player [s] (chosen), after which it looks for a request to stop."""
STOP_TRIALS = 3
"""Number of trials to vent a rig that does not confirm it (chosen)."""
RATE_TOLERANCE = 1e-6
"""Relative excess of the rate of a command by rounding of a file (chosen)."""
SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT")
"""Signals of the operating system that vent, as far as it has them."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class PlayedRecord(ShortRepr):
    """What was played and measured until the end.

    recording   time, commands and readings of the rows [SI]
    reason      why it ended early; empty if all rows were played
    late_rows   number of rows that were later than half a sample time
    worst_delay the greatest lateness of a row [s]
    is_vented   whether the rig has confirmed that it vents
    """

    recording: Recording
    reason: str
    late_rows: int
    worst_delay: float
    is_vented: bool

    def chapter(self) -> Chapter:
        """The description of the record."""
        rows = len(self.recording["time"])
        summary = f"{counted(rows, 'row')} played to the end; the rig is vented."
        if self.reason:
            summary = f"Ended early after {counted(rows, 'row')}: {self.reason}."
        problems: tuple[str, ...] = ()
        if not self.is_vented:
            problems = ("the rig has not confirmed that it vents: cut its supply of air",)
        values = (
            NamedValue("rows", rows),
            NamedValue("late rows", self.late_rows),
            NamedValue("worst delay", self.worst_delay, "s", "ms", 3),
        )
        plots = (Plot("played", "Commands and readings", self._figure),) if rows > 1 else ()
        return Chapter(
            "play", "Played signals", summary, values=values, problems=problems, plots=plots
        )

    def _figure(self) -> Any:
        figure, axes = plotting.new_figure()
        for name in self.recording:
            if name.rpartition(".")[2] in ("pressure", "setpoint"):
                pressure = self.recording[name] / 1e3
                axes.plot(self.recording["time"], pressure, label=name, linewidth=0.8)
        axes.set(xlabel="time [s]", ylabel="gauge pressure [kPa]")
        axes.legend()
        return figure


def play(
    rig: Rig,
    signals: Recording,
    limits: SignalLimits,
    *,
    start: bool = False,
    max_late: float = MAX_LATE,
    clock: Callable[[], float] = time.monotonic,
    pause: Callable[[float], Any] = time.sleep,
) -> PlayedRecord:
    """Play signals on a rig and record its readings.

    signals   `time` [s] and set points [Pa], as of `SignalPlan.recording()`
    limits    of the commands and of the measured coordinates
    start     must be True: nothing moves otherwise
    max_late  lateness of a row at which the rig is vented [s]

    The rig is vented at the end and whatever ends the run: a reading that is beyond the limits or
    no number, a lost connection, an exception of the rig, a late row, SIGINT, SIGTERM, SIGHUP and
    SIGQUIT. These give a record with its reason. Raises ParameterError before the start for
    commands beyond the limits, and without `start`.
    """
    if not start:
        raise ParameterError("play: nothing moves without start=True.")
    check_commands(signals, limits)
    run = _Run(rig, signals, limits, max_late, clock, pause)
    try:
        with _stop_requests(run):
            run.play()
    finally:
        run.vent()
    return run.record()


def check_commands(signals: Recording, limits: SignalLimits) -> None:
    """Raise ParameterError for signals without set points or time, or beyond the limits."""
    names = _commands(signals)
    if not names or "time" not in signals:
        raise ParameterError(
            f"{signals.origin}: signals need the columns time and setpoint; there are"
            f" {listed(list(signals))}. Give the plan.csv of airmuscle plan."
        )
    steps = np.diff(signals["time"])
    if len(steps) == 0 or not np.all(steps > 0.0):
        raise ParameterError(f"{signals.origin}: time must rise over two rows at least.")
    for name in names:
        column = signals[name]
        lowest = float(np.min(column))
        highest = float(np.max(column))
        if not limits.min_pressure - 1.0 <= lowest <= highest <= limits.max_pressure + 1.0:
            raise ParameterError(
                f"{signals.origin}: {name} is {lowest / 1e3:.4g} to {highest / 1e3:.4g} kPa; the"
                f" limits are {limits.min_pressure / 1e3:.4g} to {limits.max_pressure / 1e3:.4g}"
                " kPa. Plan signals for these limits, or change them."
            )
        fastest = float(np.max(np.abs(np.diff(column)) / steps))
        if fastest > limits.max_rate * (1.0 + RATE_TOLERANCE):
            raise ParameterError(
                f"{signals.origin}: {name} changes by {fastest / 1e5:.4g} bar/s; the limit is"
                f" {limits.max_rate / 1e5:.4g} bar/s. Plan signals for this limit, or change it."
            )


def _commands(signals: Recording) -> list[str]:
    return [name for name in signals if name.rpartition(".")[2] == "setpoint"]


@dataclasses.dataclass(eq=False)
class _Run:
    """The state of a run; `request` is the name of a signal that asks to stop."""

    rig: Rig
    signals: Recording
    limits: SignalLimits
    max_late: float
    clock: Callable[[], float]
    pause: Callable[[float], Any]
    request: str = ""
    reason: str = ""
    is_vented: bool = False
    late_rows: int = 0
    worst_delay: float = 0.0
    rows: list[dict[str, float]] = dataclasses.field(default_factory=list)

    def play(self) -> None:
        """Play row after row until the end, or until there is a reason to end early."""
        names = _commands(self.signals)
        times = self.signals["time"] - self.signals["time"][0]
        sample_time = float(np.min(np.diff(times)))
        table = np.column_stack([self.signals[name] for name in names]).tolist()
        begin = self.clock()
        try:
            for instant, values in zip(times.tolist(), table, strict=True):
                self._wait(begin + instant)
                late = self.clock() - begin - instant
                self.worst_delay = max(self.worst_delay, late)
                self.late_rows += late > 0.5 * sample_time
                if late > self.max_late:
                    self.reason = f"a row was {1e3 * late:.0f} ms late, beyond the watchdog"
                elif self.request:
                    self.reason = f"stopped by {self.request}"
                else:
                    self.reason = self._exchange(instant, dict(zip(names, values, strict=True)))
                if self.reason:
                    return
        except KeyboardInterrupt:
            self.reason = "stopped by SIGINT"
        except Exception as error:  # whatever a driver raises ends in the safe state
            text = error.message if isinstance(error, AirmuscleError) else repr(error)
            self.reason = " ".join(text.split()).rstrip(".")

    def _wait(self, instant: float) -> None:
        while not self.request:
            remaining = instant - self.clock()
            if remaining <= 0.0:
                return
            self.pause(min(remaining, SLICE))

    def _exchange(self, instant: float, commands: Mapping[str, float]) -> str:
        """Write and read one row; the reason to end, or an empty text."""
        self.rig.write(commands)
        readings = dict(self.rig.read())
        self.rows.append({"time": instant, **commands, **readings})
        for name, value in readings.items():
            low, high = self._allowed(name)
            if not low <= value <= high:
                return f"{name} is {value:.4g}, beyond its limits of {low:.4g} to {high:.4g}"
        missing = sorted(set(self.limits.travel) - set(readings))
        if missing:
            return f"there is no reading of {listed(missing)}, which has limits"
        return ""

    def _allowed(self, name: str) -> tuple[float, float]:
        """The range of a reading; infinite readings and such that are no numbers are beyond
        every range.
        """
        if name in self.limits.travel:
            return self.limits.travel[name]
        largest = float(np.finfo(float).max)
        if name.rpartition(".")[2] == "pressure":
            return -largest, self.limits.max_pressure + OVERSHOOT
        return -largest, largest

    def vent(self) -> None:
        """Stop the rig, with some trials; no exception of its driver prevents the next one."""
        for _ in range(STOP_TRIALS):
            with contextlib.suppress(Exception):
                self.rig.stop()
                self.is_vented = True
                return

    def record(self) -> PlayedRecord:
        """The rows so far."""
        names = list(dict.fromkeys(name for row in self.rows for name in row)) or ["time"]
        columns = {}
        for name in names:
            values = [row.get(name, math.nan) for row in self.rows]
            columns[name] = np.array(values, dtype=float)
        note = f"Ended early: {self.reason}." if self.reason else ""
        recording = Recording(columns, "record of planned signals", notes=(note,) if note else ())
        return PlayedRecord(
            recording, self.reason, self.late_rows, self.worst_delay, self.is_vented
        )


@contextlib.contextmanager
def _stop_requests(run: _Run) -> Iterator[None]:
    """Within the block, signals of the operating system ask the run to stop, in the main thread."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def ask(number: int, frame: FrameType | None) -> None:
        run.request = signal.Signals(number).name

    numbers = [getattr(signal, name) for name in SIGNALS if hasattr(signal, name)]
    before = {number: signal.signal(number, ask) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
