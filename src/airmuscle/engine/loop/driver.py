"""Drivers between the command of an input and the opening of its valve: solenoids and pulse width modulation.

A driver has a state, a named tuple of numbers, because what was switched may still be pending: carried along, a run in
many steps equals the run in one. At the start of a run every driver is at rest: no current in the coil, valve closed,
carrier at the start of a period.
"""

from __future__ import annotations

import abc
import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from ...core.declaration import INFINITY, model, parameter
from ...core.errors import ParameterError
from .piecewise_linear import Segment

THRESHOLD = 0.5
"""The coil of a solenoid carries current while its command is at least this (chosen)."""
MAX_PERIODS = 10_000_000
"""Periods of a carrier in one run."""
_ARRIVED = 1e-12
"""An opening this close to its target has reached it: rounding makes no segment of its own."""


class Driver(abc.ABC):
    """Conversion of the command of one input into the opening of its valve."""

    @abc.abstractmethod
    def init(self, start: float) -> Any:
        """The state of a driver at rest at `start` [s]."""

    @abc.abstractmethod
    def step(self, state: Any, command: Sequence[Segment], start: float) -> tuple[list[Segment], Any]:
        """The opening for a command from `start` [s] to its end, and the state there.

        The opening at an instant does not depend on later commands: split at any instant, the result is the same.
        """


class SolenoidState(NamedTuple):
    """A solenoid valve at one instant: current in the coil 0 or 1, the instant [s] at which the plunger will respond
    (infinite when nothing is pending), the target of the plunger, 0 or 1, and the opening."""

    coil: float
    pending: float
    target: float
    opening: float


@model
class SolenoidDriver(Driver):
    """A solenoid valve with dead times and a finite speed of the plunger.

    The coil carries current while the command is at least 0.5 (chosen). The plunger follows the coil after the delay of
    the new direction, if the coil is still in that state: a pulse no longer than the opening delay never opens the
    valve, a gap no longer than the closing delay never closes it. It then moves at constant speed, 1/ramp, until it
    arrives or is reversed, which again takes the delay: a pulse a little longer than the opening delay opens partly.
    The magnetic field is assumed to decay at once, so that a pulse that was too short has no effect.
    """

    opening_delay: float = parameter("s", "t_on", "from current to the first motion", bounds=(0.0, 10.0), default=0.0)
    closing_delay: float = parameter("s", "t_off", "from no current to motion", bounds=(0.0, 10.0), default=0.0)
    opening_ramp: float = parameter("s", "T_on", "from closed to open, in motion", bounds=(0.0, 10.0), default=0.0)
    closing_ramp: float = parameter("s", "T_off", "from open to closed, in motion", bounds=(0.0, 10.0), default=0.0)

    def init(self, start: float) -> SolenoidState:
        return SolenoidState(coil=0.0, pending=INFINITY, target=0.0, opening=0.0)

    def step(
        self, state: SolenoidState, command: Sequence[Segment], start: float
    ) -> tuple[list[Segment], SolenoidState]:
        end = command[-1][0]
        coil, pending, target, opening = state
        openings: list[Segment] = []
        edge = start
        for instant, current in (*_switchings(command, start, coil), (INFINITY, coil)):
            if pending < min(instant, end) and coil != target:  # the plunger responds before the coil switches again
                opening = self._move(openings, edge, pending, target, opening)
                edge, target = pending, coil
            if instant == INFINITY:
                break
            coil = current
            pending = instant + (self.opening_delay if current > 0 else self.closing_delay)
        opening = self._move(openings, edge, end, target, opening)
        return openings, SolenoidState(coil, pending if pending >= end else INFINITY, target, opening)

    def _move(self, openings: list[Segment], begin: float, end: float, target: float, opening: float) -> float:
        """Append the motion towards the target from `begin` to `end` and the rest after it; the opening at the end."""
        if not begin < end:
            return opening
        ramp = self.opening_ramp if target > opening else self.closing_ramp
        distance = abs(target - opening)
        left = distance - ((end - begin) / ramp if ramp > 0 else INFINITY)
        after = target if left <= _ARRIVED else target + math.copysign(left, opening - target)
        arrival = min(begin + (ramp * distance if after == target else INFINITY), end)
        if arrival > begin:
            openings.append((arrival, opening, (after - opening) / (arrival - begin)))
        if end > arrival:
            openings.append((end, after, 0.0))
        return after


class PwmState(NamedTuple):
    """A pulse width modulator at one instant: start of its carrier [s], number of periods that have begun, and the end
    of the pulse of the last of them [s] (infinite when it fills its period, minus infinite when there is none)."""

    origin: float
    begun: float
    pulse_end: float


@model
class PWM(Driver):
    """Pulse width modulation: the command at the start of a period is the part of the period that is on.

    A pulse shorter than the smallest pulse is omitted, and a gap shorter than it is filled, so that the mean of a
    period differs from the command by at most the smallest pulse times the frequency.
    """

    frequency: float = parameter("Hz", "f_c", "frequency of the carrier", bounds=(1e-3, 1e6))
    smallest_pulse: float = parameter("s", "t_min", "shortest pulse and gap", bounds=(0.0, 1e3), default=0.0)

    def check(self) -> None:
        if self.smallest_pulse * self.frequency > 0.5:
            raise ParameterError(
                f"PWM.smallest_pulse is {self.smallest_pulse:g} s, more than half of the carrier's period of "
                f"{1 / self.frequency:g} s: no pulse would leave time for a gap. Lower the frequency."
            )

    def init(self, start: float) -> PwmState:
        return PwmState(origin=start, begun=0.0, pulse_end=-INFINITY)

    def step(self, state: PwmState, command: Sequence[Segment], start: float) -> tuple[list[Segment], PwmState]:
        end, period = command[-1][0], 1.0 / self.frequency
        if state.origin + state.begun / self.frequency >= _last_begin(end):  # no period begins
            return _rest_of_pulse(start, state.pulse_end, end), state
        smallest = max(self.smallest_pulse, 1e-9 * period, 4 * math.ulp(end))
        levels: list[tuple[float, float]] = []  # instant, level from then on
        pulse_end, count = state.pulse_end, 0
        _add_pulse(levels, start, pulse_end, end)
        for begin, duty in _values_at(command, start, self._periods(state, start, end)):
            width = period * min(max(duty, 0.0), 1.0)
            pulse_end = -INFINITY if width < smallest else INFINITY if period - width < smallest else begin + width
            if count == 0 and begin == start:
                levels.clear()
            _add_pulse(levels, begin, pulse_end, end)
            count += 1
        pulses = [(instant, level) for i, (instant, level) in enumerate(levels) if not i or level != levels[i - 1][1]]
        ends = [*(instant for instant, _ in pulses[1:]), end]
        later = PwmState(state.origin, state.begun + count, pulse_end)
        return [(e, level, 0.0) for e, (_, level) in zip(ends, pulses, strict=True)], later

    def _periods(self, state: PwmState, start: float, end: float) -> Iterator[float]:
        """The starts [s] of the periods that begin before `end`."""
        count = (end - state.origin) * self.frequency - state.begun
        if count > MAX_PERIODS:
            raise ParameterError(
                f"a carrier of {self.frequency:g} Hz has {count:.3g} periods in {end - start:g} s; {MAX_PERIODS} are "
                "allowed. Simulate a shorter time, or the mean of the pulses."
            )
        last = _last_begin(end)
        for i in range(max(math.ceil(count) + 1, 0)):
            begin = state.origin + (state.begun + i) / self.frequency
            if begin < last:
                yield max(begin, start)


def _last_begin(end: float) -> float:
    """The instant [s] before which a period begins that belongs to a command until `end` [s].

    One that begins where rounding alone keeps it before the end belongs to the command from there on.
    """
    return end - 4 * math.ulp(abs(end))


def _rest_of_pulse(start: float, pulse_end: float, end: float) -> list[Segment]:
    """The opening from `start` to `end` [s] in which no period begins."""
    if not pulse_end > start:
        return [(end, 0.0, 0.0)]
    return [(pulse_end, 1.0, 0.0), (end, 0.0, 0.0)] if pulse_end < end else [(end, 1.0, 0.0)]


def _add_pulse(levels: list[tuple[float, float]], begin: float, pulse_end: float, end: float) -> None:
    """Append the level at `begin`, and the end of a pulse that ends before `end`."""
    on = pulse_end > begin
    levels.append((begin, 1.0 if on else 0.0))
    if on and pulse_end < end:
        levels.append((pulse_end, 0.0))


def _values_at(command: Sequence[Segment], start: float, times: Iterator[float]) -> Iterator[tuple[float, float]]:
    """Rising times [s] with the value of a command there; where two segments meet, that of the later one."""
    k, last, begin = 0, len(command) - 1, start
    for time in times:
        while k < last and command[k][0] <= time:
            begin = command[k][0]
            k += 1
        _, value, slope = command[k]
        yield time, value + (time - begin) * slope


def _switchings(command: Sequence[Segment], start: float, coil: float) -> Iterator[tuple[float, float]]:
    """Instants [s] at which the current of a coil changes, and the new current; `coil` is the current before."""
    begin = start
    for end, value, slope in command:
        first, last = value >= THRESHOLD, value + slope * (end - begin) >= THRESHOLD
        if first != (coil > 0):
            coil = float(first)
            yield begin, coil
        if last != first:
            coil = float(last)
            yield min(begin + (THRESHOLD - value) / slope, end), coil
        begin = end
