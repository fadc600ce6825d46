"""WithDrivers: an input signal whose inputs, some or all, pass through drivers."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...core.annotation import abridged
from ...core.errors import ParameterError
from ...core.short_repr import ShortRepr
from .driver import Driver
from .inputs import InputSignal, check_input_names, check_input_signal
from .piecewise_linear import PiecewiseLinear, Segment, merge_columns

_ROUNDING = 1e-9
"""How far a command may exceed 0 to 1 through rounding."""
_FULL = 1 + _ROUNDING


@dataclasses.dataclass(frozen=True, repr=False)
class WithDrivers(ShortRepr, InputSignal):
    """An input signal whose inputs, some or all, pass through drivers: one each, or several in the order of the signal.

    `WithDrivers(SampledSignal({"fill": ...}), {"fill": (PWM(50), SolenoidDriver(opening_delay=5e-3))})`. Inputs without
    a driver are applied without delay. Raises ParameterError where the command of a driver leaves 0 to 1.
    """

    inner: InputSignal
    drivers: Mapping[str, Driver | tuple[Driver, ...]]

    def __post_init__(self) -> None:
        check_input_signal(self.inner)
        if not isinstance(self.drivers, Mapping):
            raise ParameterError(
                f"the drivers are {abridged(self.drivers)}; name the inputs: {{'fill': SolenoidDriver(...)}}."
            )
        for name, chain in self.chains.items():
            for driver in chain:
                if not isinstance(driver, Driver):
                    raise ParameterError(
                        f"the driver of '{name}' is {abridged(driver)}; write SolenoidDriver(...), PWM(...) or several."
                    )

    @property
    def names(self) -> tuple[str, ...] | None:
        return self.inner.names

    @property
    def chains(self) -> dict[str, tuple[Driver, ...]]:
        """The drivers of each input, in the order of the signal."""
        return {name: given if isinstance(given, tuple) else (given,) for name, given in self.drivers.items()}

    def init(self, start: float) -> dict[str, tuple[Any, ...]]:
        """The states of the drivers of each input, at rest at `start` [s]."""
        return {name: tuple(driver.init(start) for driver in chain) for name, chain in self.chains.items()}

    def step(
        self, states: Mapping[str, tuple[Any, ...]], inputs: Sequence[str], start: float, duration: float
    ) -> tuple[PiecewiseLinear, dict[str, tuple[Any, ...]]]:
        """The inputs from `start` [s] on for `duration` [s], and the drivers' states then, for the next step."""
        check_input_names(list(self.drivers), inputs)
        command = self.inner.segments(inputs, start, duration)
        columns = [command.column(i) for i in range(len(inputs))]
        later = apply_drivers(self.chains, states, columns, {name: inputs.index(name) for name in self.drivers}, start)
        if not self.drivers:
            return command, later
        ends, values, slopes = merge_columns(columns, start)
        shape = (len(ends), len(inputs))
        return PiecewiseLinear(np.array(ends), np.array(values).reshape(shape), np.array(slopes).reshape(shape)), later

    def segments(self, inputs: Sequence[str], start: float, duration: float) -> PiecewiseLinear:
        return self.step(self.init(start), inputs, start, duration)[0]


def apply_drivers(
    chains: Mapping[str, tuple[Driver, ...]], states: Mapping[str, tuple[Any, ...]], columns: list[list[Segment]],
    indices: Mapping[str, int], start: float,
) -> dict[str, tuple[Any, ...]]:  # fmt: skip
    """Replace the commands of inputs by the openings that their drivers make of them; the drivers' states at the end.

    `columns` holds the segments of every input from `start` [s] on, `indices` says which input has which drivers.
    """
    later = {}
    for name, chain in chains.items():
        column, before = indices[name], states[name]
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
                    f"the command of the driver of '{name}' is {at:g} before {end:g} s; allowed range: 0 to 1."
                )
        begin = end
