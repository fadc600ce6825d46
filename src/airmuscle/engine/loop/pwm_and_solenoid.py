"""Drivers between the command of an input and the opening of its valve: solenoids and pulse width
modulation.

A driver has a state, a named tuple of numbers, because what was switched may still be pending:
carried along, a run in many steps equals the run in one. A run starts at rest: no current, valve
closed, carrier at the start of a period.
"""

import abc
import dataclasses
import math
import operator
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from ...core import INFINITY, ParameterError, ShortRepr, abridged, model, parameter
from ...core.declaration import forwarded
from ..compile.kernel_text.source import plain_kernels
from .inputs import (
    InputSignal,
    PiecewiseLinear,
    Segment,
    check_input_names,
    check_input_signal,
    merge_columns,
)

MAX_PERIODS = 10_000_000
"""Periods of a carrier in one run."""
_ROUNDING = 1e-9
"""How far a command may exceed 0 to 1 through rounding."""
_FULL = 1 + _ROUNDING


class Driver(abc.ABC):
    """Conversion of the command of one input into the opening of its valve."""

    @abc.abstractmethod
    def init(self, start: float) -> Any:
        """The state of a driver at rest at `start` [s]."""

    @abc.abstractmethod
    def step(
        self, state: Any, command: Sequence[Segment], start: float
    ) -> tuple[list[Segment], Any]:
        """The opening for a command from `start` [s] to its end, and the state there.

        The opening at an instant does not depend on later commands: split at any instant, the
        result is the same.
        """


class SolenoidState(NamedTuple):
    """A solenoid valve at one instant: current in the coil 0 or 1, the instant [s] at which the
    plunger will respond (infinite when nothing is pending), the target of the plunger, 0 or 1, and
    the opening."""

    coil: float
    pending: float
    target: float
    opening: float


@model
class SolenoidDriver(Driver):
    """A solenoid valve with dead times and a finite speed of the plunger.

    The coil carries current while the command is at least 0.5 (chosen). The plunger follows the
    coil after the delay of the new direction, if the coil is still in that state: a pulse no longer
    than the opening delay never opens the valve, a gap no longer than the closing delay never
    closes it. It then moves at constant speed, 1/ramp, until it arrives or is reversed, which again
    takes the delay: a pulse a little longer than the opening delay opens partly. The magnetic field
    is assumed to decay at once, so that a pulse that was too short has no effect.
    """

    opening_delay: float = parameter(
        "s", "t_on", "from current to the first motion", bounds=(0.0, 10.0), default=0.0
    )
    closing_delay: float = parameter(
        "s", "t_off", "from no current to motion", bounds=(0.0, 10.0), default=0.0
    )
    opening_ramp: float = parameter(
        "s", "T_on", "from closed to open, in motion", bounds=(0.0, 10.0), default=0.0
    )
    closing_ramp: float = parameter(
        "s", "T_off", "from open to closed, in motion", bounds=(0.0, 10.0), default=0.0
    )

    def init(self, start: float) -> SolenoidState:
        return SolenoidState(coil=0.0, pending=INFINITY, target=0.0, opening=0.0)

    settings = property(
        operator.attrgetter("opening_delay", "closing_delay", "opening_ramp", "closing_ramp")
    )
    """The parameters, in the order of the kernel."""

    def step(
        self, state: SolenoidState, command: Sequence[Segment], start: float
    ) -> tuple[list[Segment], SolenoidState]:
        openings, later = _driven("delayed_switch", self.settings, state, command, start, ({}, {}))
        return openings, SolenoidState(*later)


class PwmState(NamedTuple):
    """A pulse width modulator at one instant: start of its carrier [s], number of periods that have
    begun, and the end of the pulse of the last of them [s] (infinite when it fills its period,
    minus infinite when there is none).
    """

    origin: float
    begun: float
    pulse_end: float


@model
class PWM(Driver):
    """Pulse width modulation: the command at the start of a period is the part of the period that
    is on.

    A pulse shorter than the smallest pulse is omitted, and a gap shorter than it is filled, so that
    the mean of a period differs from the command by at most the smallest pulse times the frequency.
    """

    frequency: float = parameter("Hz", "f_c", "frequency of the carrier", bounds=(1e-3, 1e6))
    smallest_pulse: float = parameter(
        "s", "t_min", "shortest pulse and gap", bounds=(0.0, 1e3), default=0.0
    )

    def check(self) -> None:
        if self.smallest_pulse * self.frequency > 0.5:
            raise ParameterError(
                f"PWM.smallest_pulse is {self.smallest_pulse:g} s, more than half of the carrier's"
                f" period of {1 / self.frequency:g} s: no pulse would leave time for a gap. Lower"
                " the frequency."
            )

    def init(self, start: float) -> PwmState:
        return PwmState(origin=start, begun=0.0, pulse_end=-INFINITY)

    settings = property(operator.attrgetter("frequency", "smallest_pulse"))
    """The parameters, in the order of the kernel."""

    def step(
        self, state: PwmState, command: Sequence[Segment], start: float
    ) -> tuple[list[Segment], PwmState]:
        end = command[-1][0]
        count = (end - state.origin) * self.frequency - state.begun
        if count > MAX_PERIODS:
            raise ParameterError(
                f"a carrier of {self.frequency:g} Hz has {count:.3g} periods in {end - start:g} s;"
                f" {MAX_PERIODS} are allowed. Simulate a shorter time, or the mean of the pulses."
            )
        ulp = math.ulp(end)
        openings, later = _driven(
            "pulse_width_modulation", self.settings, state, command, start, ulp
        )
        return openings, PwmState(*later)


def _driven(
    kernel: str,
    settings: tuple[float, ...],
    state: tuple[float, ...],
    command: Sequence[Segment],
    start: float,
    last: Any,
) -> tuple[list[Segment], list[float]]:
    """The opening and the state that a kernel makes of a command, with its `last` argument before
    the result.
    """
    ends: dict[int, float] = {}
    values: dict[int, float] = {}
    slopes: dict[int, float] = {}
    later = [*state]
    signal = list(zip(*command, strict=True))
    function = plain_kernels("drivers")[kernel]
    count = function(
        settings, state, later, signal, len(signal[0]), start, last, (ends, values, slopes)
    )
    return [(ends[i], values[i], slopes[i]) for i in range(count)], later


@dataclasses.dataclass(frozen=True, repr=False)
class WithDrivers(ShortRepr, InputSignal):
    """An input signal whose inputs, some or all, pass through drivers: one each, or several in the
    order of the signal.

    `WithDrivers(SampledSignal({"fill": ...}), {"fill": (PWM(50),
    SolenoidDriver(opening_delay=5e-3))})`. Inputs without a driver are applied without delay.
    Raises ParameterError where the command of a driver leaves 0 to 1.
    """

    inner: InputSignal
    drivers: Mapping[str, Driver | tuple[Driver, ...]]

    names = forwarded("inner.names")

    def __post_init__(self) -> None:
        check_input_signal(self.inner)
        if not isinstance(self.drivers, Mapping):
            raise ParameterError(
                f"the drivers are {abridged(self.drivers)}; name the inputs: {{'fill':"
                " SolenoidDriver(...)}."
            )
        for name, chain in self.chains.items():
            for driver in chain:
                if not isinstance(driver, Driver):
                    raise ParameterError(
                        f"the driver of '{name}' is {abridged(driver)}; write SolenoidDriver(...),"
                        " PWM(...) or several."
                    )

    @property
    def chains(self) -> dict[str, tuple[Driver, ...]]:
        """The drivers of each input, in the order of the signal."""
        return {
            name: chain if isinstance(chain, tuple) else (chain,)
            for name, chain in self.drivers.items()
        }

    def init(self, start: float) -> dict[str, tuple[Any, ...]]:
        """The states of the drivers of each input, at rest at `start` [s]."""
        return {
            name: tuple(driver.init(start) for driver in chain)
            for name, chain in self.chains.items()
        }

    def step(
        self,
        states: Mapping[str, tuple[Any, ...]],
        inputs: Sequence[str],
        start: float,
        duration: float,
    ) -> tuple[PiecewiseLinear, dict[str, tuple[Any, ...]]]:
        """The inputs from `start` [s] on for `duration` [s], and the drivers' states then, for the
        next step.
        """
        check_input_names(list(self.drivers), inputs)
        command = self.inner.segments(inputs, start, duration)
        columns = [command.column(i) for i in range(len(inputs))]
        later = apply_drivers(
            self.chains, states, columns, {name: inputs.index(name) for name in self.drivers}, start
        )
        return merge_columns(columns, start) if self.drivers else command, later

    def segments(self, inputs: Sequence[str], start: float, duration: float) -> PiecewiseLinear:
        return self.step(self.init(start), inputs, start, duration)[0]


def apply_drivers(
    chains: Mapping[str, tuple[Driver, ...]],
    states: Mapping[str, tuple[Any, ...]],
    columns: list[list[Segment]],
    indices: Mapping[str, int],
    start: float,
) -> dict[str, tuple[Any, ...]]:
    """Replace the commands of inputs by the openings that their drivers make of them; the drivers'
    states at the end.

    `columns` holds the segments of every input from `start` [s] on, `indices` says which input has
    which drivers.
    """
    later = {}
    for name, chain in chains.items():
        column = indices[name]
        before = states[name]
        signal = columns[column]
        check_command_range(name, signal, start)
        after = []
        for i, driver in enumerate(chain):
            signal, state = driver.step(before[i], signal, start)
            after.append(state)
        columns[column], later[name] = signal, tuple(after)
    return later


def check_command_range(name: str, command: Sequence[Segment], start: float) -> None:
    """Raise ParameterError where the command of a driver leaves 0 to 1."""
    begin = start
    for end, value, slope in command:
        for at in (value, value + slope * (end - begin)) if slope else (value,):
            if not -_ROUNDING <= at <= _FULL:
                raise ParameterError(
                    f"the command of the driver of '{name}' is {at:g} before {end:g} s; allowed"
                    " range: 0 to 1."
                )
        begin = end
