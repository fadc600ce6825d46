"""Drivers of a loop as arrays, for the kernel that passes commands through them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from ...core.arrays import Array
from ..compile.kernel_layout import DriverKind
from ..loop.control_loop import ControlLoop, ControlLoopState
from ..loop.driver import MAX_PERIODS, PWM, Driver, PwmState, SolenoidDriver, SolenoidState
from ..loop.with_drivers import WithDrivers, check_command_range
from .sampled_loop import SampledLoop

MAX_CAPACITY = 1_000_000
"""Segments of an input within an interval up to which a kernel computes them."""
WIDTH = 4
"""Numbers of the settings and of the state of a driver."""
KINDS: dict[type, DriverKind] = {PWM: DriverKind.MODULATOR, SolenoidDriver: DriverKind.SWITCH}
"""The drivers that kernels and exported programs implement."""
_STATES: dict[type, Any] = {PWM: PwmState, SolenoidDriver: SolenoidState}


def are_known(loop: ControlLoop) -> bool:
    """Whether the kernel implements all drivers of a loop."""
    return all(type(driver) in KINDS for chain in _chains(loop).values() for driver in chain)


def greatest_capacity(prepared: SampledLoop) -> int:
    """The maximum number of segments of an input within an interval, before and after each of its drivers."""
    duration = float(np.diff(prepared.instants).max())
    pieces = int(np.diff(prepared.first_segments).max())
    return max((_capacity(chain, pieces, duration) for chain in _chains(prepared.loop).values()), default=pieces)


class DriverTable:
    """The drivers (D,) of all inputs as arrays, in the order in which a signal passes through them.

    kinds (D, 2)      index of the input, and DriverKind
    settings, states, kept (D, 4)   settings; states at the end of the present and of the last completed interval
    columns, scratch, counts, begins    workspace of the kernel
    """

    def __init__(self, prepared: SampledLoop, state: ControlLoopState, capacity: int) -> None:
        loop, inputs, names = prepared.loop, prepared.inputs, prepared.input_names
        chains = _chains(loop)
        self._order = [(name, driver) for name, chain in chains.items() for driver in chain]
        for name in chains:
            if name not in loop.controller.inputs:
                check_command_range(name, inputs.column(names.index(name)), float(prepared.instants[0]))
        m = inputs.values.shape[1]
        self.kinds = np.array([(names.index(n), KINDS[type(d)]) for n, d in self._order], np.int64).reshape(-1, 2)
        self.settings = _table([d.settings for _, d in self._order if isinstance(d, PWM | SolenoidDriver)])
        self.kept = _table([tuple(one) for name in chains for one in state.drivers[name]])
        self.states, self._first = self.kept.copy(), self.kept.copy()
        self.columns, self.scratch = np.empty((m, 3, capacity)), np.empty((2, 3, capacity))
        self.counts, self.begins = np.zeros((2, m), dtype=np.int64), np.empty(m)

    def restart(self) -> None:
        """The states at the beginning of the loop."""
        self.states[:] = self.kept[:] = self._first

    def as_mapping(self) -> Mapping[str, tuple[Any, ...]]:
        """The drivers' states at the end of the last completed interval, by input."""
        by_name: dict[str, tuple[Any, ...]] = {name: () for name, _ in self._order}
        for (name, driver), row in zip(self._order, self.kept.tolist(), strict=True):
            kind = _STATES[type(driver)]
            by_name[name] = (*by_name[name], kind(*row[: len(kind._fields)]))
        return by_name


def _chains(loop: ControlLoop) -> dict[str, tuple[Driver, ...]]:
    return WithDrivers(loop.other_inputs, loop.drivers).chains


def _table(rows: list[tuple[float, ...]]) -> Array:
    return np.array([(*row, *[0.0] * (WIDTH - len(row))) for row in rows], dtype=float).reshape(-1, WIDTH)


def _capacity(chain: tuple[Driver, ...], pieces: int, duration: float) -> int:
    greatest = pieces
    for driver in chain:
        if isinstance(driver, PWM):
            pieces = 2 * (math.ceil(min(duration * driver.frequency, MAX_PERIODS)) + 4)
        else:
            pieces = 4 * pieces + 4
        greatest = max(greatest, pieces)
    return greatest
