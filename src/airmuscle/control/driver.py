"""Drivers: what stands between a command and an opening. Dead times, ramps and pulses become instants beforehand.

A driver has a memory, a named tuple of numbers, because what was switched may still be on its way: carried along, a
run in many steps is the run in one. At the start of a run every driver is at rest: coil without current, valve shut,
carrier at the beginning of a period.
"""

from __future__ import annotations

import abc
import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ..core.arrays import Array
from ..core.declaration import INFINITY, model, parameter
from ..core.errors import ParameterError
from .inputs import InputSignal, PiecewiseLinear, check_input_names, check_input_signal

THRESHOLD = 0.5
"""A coil carries current while its command is at least this (chosen)."""
MOST_PERIODS = 10_000_000
"""Periods of a carrier in one run that fit a usual memory."""
_SAME = 1e-12
"""An opening this near its end has reached it: what rounding leaves makes no segment of its own."""


class Driver(abc.ABC):
    """What turns one input's command into what its valve does."""

    @abc.abstractmethod
    def init(self, start: float) -> Any:
        """The memory of a driver at rest at `start` [s]."""

    @abc.abstractmethod
    def step(self, memory: Any, signal: PiecewiseLinear, start: float) -> tuple[PiecewiseLinear, Any]:
        """What comes out for a signal of one input from `start` to its end, and the memory there.

        Nothing depends on what the signal does later: cut at any instant, it gives the same course.
        """


class SolenoidState(NamedTuple):
    """An on/off valve at one moment: current in the coil 0 or 1, the instant [s] at which the plunger will follow it
    (infinite when nothing is pending), where the plunger is heading, 0 or 1, and the opening it has."""

    coil: float
    pending: float
    heading: float
    opening: float


@model
class SolenoidDriver(Driver):
    """A solenoid valve that answers late and moves at a finite speed.

    The coil carries current while the command is at least 0.5 (chosen). The plunger follows the coil after the delay of
    the new direction, if the coil still holds it then: a pulse no longer than the opening delay never opens the valve,
    a gap no longer than the closing delay never shuts it. It then moves at constant speed, 1/ramp, until it arrives or
    is called back, which again takes the delay: a pulse a little longer than the opening delay opens in part. The
    field of a coil is taken to be gone at once, so that a swallowed pulse leaves nothing behind.
    """

    opening_delay: float = parameter("s", "t_on", "from current to the first motion", bounds=(0.0, 10.0), default=0.0)
    closing_delay: float = parameter("s", "t_off", "from no current to motion", bounds=(0.0, 10.0), default=0.0)
    opening_ramp: float = parameter("s", "T_on", "from shut to open, in motion", bounds=(0.0, 10.0), default=0.0)
    closing_ramp: float = parameter("s", "T_off", "from open to shut, in motion", bounds=(0.0, 10.0), default=0.0)

    def init(self, start: float) -> SolenoidState:
        return SolenoidState(coil=0.0, pending=INFINITY, heading=0.0, opening=0.0)

    def step(
        self, memory: SolenoidState, signal: PiecewiseLinear, start: float
    ) -> tuple[PiecewiseLinear, SolenoidState]:
        end = float(signal.ends[-1])
        switched, currents = _switchings(signal, start, memory.coil)
        coil = float(currents[-1]) if currents.size else memory.coil
        due = np.append(memory.pending, switched + np.where(currents > 0, self.opening_delay, self.closing_delay))
        held = np.append(switched, INFINITY) > due
        pending = float(due[-1]) if due[-1] >= end else INFINITY
        moves = held & (due < end)
        instants, headings = _changes(due[moves], np.append(memory.coil, currents)[moves], memory.heading)
        heading = float(headings[-1]) if headings.size else memory.heading
        edges, targets = np.concatenate([[start], instants, [end]]), np.append(memory.heading, headings)
        openings = self._openings(edges, targets, memory.opening)
        return self._motion(edges, targets, openings), SolenoidState(coil, pending, heading, float(openings[-1]))

    def _openings(self, edges: Array, targets: Array, opening: float) -> Array:
        """The opening at every edge, a target being held between two."""
        found = [opening]
        for length, target in zip(np.diff(edges).tolist(), targets.tolist(), strict=True):
            ramp = self.opening_ramp if target > opening else self.closing_ramp
            left = abs(target - opening) - (length / ramp if ramp > 0 else INFINITY)
            opening = target if left <= _SAME else target + math.copysign(left, opening - target)
            found.append(opening)
        return np.array(found)

    def _motion(self, edges: Array, targets: Array, openings: Array) -> PiecewiseLinear:
        """Straight lines through the openings at the edges: from each a motion, then rest where it arrived."""
        before, after, begins = openings[:-1], openings[1:], edges[:-1]
        ramps = np.where(targets > before, self.opening_ramp, self.closing_ramp)
        lasts = np.where(after == targets, ramps * np.abs(targets - before), INFINITY)
        arrivals = np.minimum(begins + lasts, edges[1:])
        moving, resting = arrivals > begins, edges[1:] > arrivals
        slopes = np.zeros_like(before)
        np.divide(after - before, arrivals - begins, out=slopes, where=moving)
        starts = np.column_stack([begins, arrivals])[kept := np.column_stack([moving, resting])]
        values, rates = np.column_stack([before, after])[kept], np.column_stack([slopes, np.zeros_like(slopes)])[kept]
        return PiecewiseLinear(np.append(starts[1:], edges[-1]), values[:, None], rates[:, None])


class PwmState(NamedTuple):
    """A pulse width modulator at one moment: when its carrier began [s], how many periods have begun since, and when
    the pulse of the last of them ends [s] (infinite when it fills its period, minus infinite when it has none)."""

    origin: float
    begun: float
    pulse_end: float


@model
class PWM(Driver):
    """Pulse width modulation: the command at the beginning of a period is the part of the period that is on.

    What would be shorter than the smallest pulse is left out, and a gap that would be shorter is filled, so that the
    mean of a period differs from the command by at most smallest pulse times frequency.
    """

    frequency: float = parameter("1/s", "f_c", "frequency of the carrier", bounds=(1e-3, 1e6))
    smallest_pulse: float = parameter("s", "t_min", "shortest pulse and gap", bounds=(0.0, 1e3), default=0.0)

    def check(self) -> None:
        if self.smallest_pulse * self.frequency > 0.5:
            raise ParameterError(
                f"PWM.smallest_pulse is {self.smallest_pulse:g} s, more than half of the carrier's period of "
                f"{1 / self.frequency:g} s: no pulse would leave room for a gap. Lower the frequency."
            )

    def init(self, start: float) -> PwmState:
        return PwmState(origin=start, begun=0.0, pulse_end=-INFINITY)

    def step(self, memory: PwmState, signal: PiecewiseLinear, start: float) -> tuple[PiecewiseLinear, PwmState]:
        end, period = float(signal.ends[-1]), 1.0 / self.frequency
        starts = self._periods(memory, start, end)
        widths = period * np.clip(signal.inputs_at(starts, start)[:, 0], 0.0, 1.0)
        least = max(self.smallest_pulse, 1e-9 * period, 4 * float(np.spacing(end)))
        pulse_ends = np.where(widths < least, -INFINITY, np.where(period - widths < least, INFINITY, starts + widths))
        later = PwmState(memory.origin, memory.begun + starts.size, float(np.append(memory.pulse_end, pulse_ends)[-1]))
        if starts.size == 0 or starts[0] > start:  # the rest of a period that began earlier
            starts, pulse_ends = np.append(start, starts), np.append(memory.pulse_end, pulse_ends)
        on = pulse_ends > starts
        kept = np.column_stack([np.ones_like(on), on & (pulse_ends < end)])
        instants = np.column_stack([starts, pulse_ends])[kept]
        levels = np.column_stack([on, np.zeros_like(on)])[kept].astype(float)
        instants, levels = _changes(instants, levels, before=-1.0)
        ends = np.append(instants[1:], end)
        return PiecewiseLinear(ends, levels[:, None], np.zeros((ends.size, 1))), later

    def _periods(self, memory: PwmState, start: float, end: float) -> Array:
        """The beginnings [s] of the periods that begin before `end`."""
        count = (end - memory.origin) * self.frequency - memory.begun
        if count > MOST_PERIODS:
            raise ParameterError(
                f"a carrier of {self.frequency:g} Hz has {count:.3g} periods in {end - start:g} s; {MOST_PERIODS} are "
                "allowed. Simulate a shorter time, or the mean of the pulses."
            )
        starts = memory.origin + (memory.begun + np.arange(max(math.ceil(count) + 1, 0))) / self.frequency
        # one that begins where rounding alone keeps it before the end belongs to what is commanded from there on
        return np.asarray(np.maximum(starts[starts < end - 4 * np.spacing(abs(end))], start))


def _switchings(signal: PiecewiseLinear, start: float, coil: float) -> tuple[Array, Array]:
    """When the current of a coil changes [s], and to what; `coil` is what it was before."""
    begins, value, slope = signal.starts(start), signal.values[:, 0], signal.slopes[:, 0]
    first, last = value >= THRESHOLD, value + slope * (signal.ends - begins) >= THRESHOLD
    crossings = begins + np.divide(THRESHOLD - value, slope, out=np.zeros_like(value), where=first != last)
    crossings = np.minimum(crossings, signal.ends)
    return _changes(np.column_stack([begins, crossings]).ravel(), np.column_stack([first, last]).ravel(), coil)


def _changes(instants: Array, levels: npt.NDArray[Any], before: float) -> tuple[Array, Array]:
    """Only those instants at which the level becomes another one; `before` is the level until the first."""
    levels = np.asarray(levels, dtype=float)
    kept = np.diff(levels, prepend=before) != 0
    return instants[kept], levels[kept]


@dataclasses.dataclass(frozen=True)
class WithDrivers(InputSignal):
    """A command whose inputs, some or all, pass through drivers: one each, or several in the order of the signal.

    `WithDrivers(Signal({"fill": ...}), {"fill": (PWM(50), SolenoidDriver(opening_delay=5e-3))})`. Inputs
    without a driver follow the command at once. Raises ParameterError where the command of a driver leaves 0 to 1.
    """

    inner: InputSignal
    drivers: Mapping[str, Driver | tuple[Driver, ...]]

    def __post_init__(self) -> None:
        check_input_signal(self.inner)
        if not isinstance(self.drivers, Mapping):
            raise ParameterError(f"the drivers are {self.drivers!r}; name the inputs: {{'fill': SolenoidDriver(...)}}.")
        for name, chain in self.chains.items():
            for driver in chain:
                if not isinstance(driver, Driver):
                    raise ParameterError(
                        f"the driver of '{name}' is {driver!r}; write SolenoidDriver(...), PWM(...) or several."
                    )

    @property
    def names(self) -> tuple[str, ...] | None:
        return self.inner.names

    @property
    def chains(self) -> dict[str, tuple[Driver, ...]]:
        """The drivers of each input, in the order of the signal."""
        return {name: given if isinstance(given, tuple) else (given,) for name, given in self.drivers.items()}

    def init(self, start: float) -> dict[str, tuple[Any, ...]]:
        """The memories of the drivers of each input, at rest at `start` [s]."""
        return {name: tuple(driver.init(start) for driver in chain) for name, chain in self.chains.items()}

    def step(
        self, memory: Mapping[str, tuple[Any, ...]], inputs: Sequence[str], start: float, duration: float
    ) -> tuple[PiecewiseLinear, dict[str, tuple[Any, ...]]]:
        """The command from `start` on for `duration` [s], and the memories then: give them to the next step."""
        check_input_names(list(self.drivers), inputs)
        return self.apply_drivers(memory, self.inner.segments(inputs, start, duration), inputs, start)

    def apply_drivers(
        self, memory: Mapping[str, tuple[Any, ...]], told: PiecewiseLinear, inputs: Sequence[str], start: float
    ) -> tuple[PiecewiseLinear, dict[str, tuple[Any, ...]]]:
        """What the drivers make of a course of all inputs that is told from `start` on, and the memories at its end."""
        columns, later = {}, {}
        for name, chain in self.chains.items():
            signal, memories = column(told, inputs.index(name)), []
            _check_command_range(name, signal, start)
            for driver, remembered in zip(chain, memory[name], strict=True):
                signal, now = driver.step(remembered, signal, start)
                memories.append(now)
            columns[inputs.index(name)], later[name] = signal, tuple(memories)
        return merge_inputs(told, columns, start), later

    def segments(self, inputs: Sequence[str], start: float, duration: float) -> PiecewiseLinear:
        return self.step(self.init(start), inputs, start, duration)[0]


def column(segments: PiecewiseLinear, i: int) -> PiecewiseLinear:
    """The course of one input alone."""
    return PiecewiseLinear(segments.ends, segments.values[:, i : i + 1], segments.slopes[:, i : i + 1])


def _check_command_range(name: str, signal: PiecewiseLinear, start: float) -> None:
    last = signal.values + signal.slopes * (signal.ends - signal.starts(start))[:, None]
    for values in (signal.values[:, 0], last[:, 0]):
        beyond = (values < -1e-9) | (values > 1 + 1e-9)
        if beyond.any():
            row = int(np.argmax(beyond))
            raise ParameterError(
                f"the driver of '{name}' is told {values[row]:g} before {signal.ends[row]:g} s; allowed range: 0 to 1."
            )


def merge_inputs(told: PiecewiseLinear, columns: Mapping[int, PiecewiseLinear], start: float) -> PiecewiseLinear:
    """One course of all inputs, those in `columns` replaced, cut wherever any of them is."""
    if not columns:
        return told
    courses = [columns.get(i) or column(told, i) for i in range(told.values.shape[1])]
    starts = np.unique(np.concatenate([np.array([start]), *(course.starts(start) for course in courses)]))
    cut = [course.cut_at(starts, start) for course in courses]
    ends = np.append(starts[1:], told.ends[-1])
    return PiecewiseLinear(ends, np.hstack([c.values for c in cut]), np.hstack([c.slopes for c in cut]))
