"""Drivers of a loop as arrays, for the kernel that passes commands through them."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from ...core import Array
from ..compile.kernel_layout import DriverKind
from ..loop import PWM, ControlLoopState, Driver, PwmState, SolenoidDriver
from ..loop.pwm_and_solenoid import MAX_PERIODS, SolenoidState, apply_drivers, check_command_range
from .sampled_loop import SampledLoop

MAX_CAPACITY = 1_000_000
"""Segments of an input within an interval up to which a kernel computes them."""
WIDTH = 4
"""Numbers of the settings and of the state of a driver."""
KINDS: dict[type, DriverKind] = {PWM: DriverKind.MODULATOR, SolenoidDriver: DriverKind.SWITCH}
"""The drivers that kernels and exported programs implement."""
_STATES: dict[type, Any] = {PWM: PwmState, SolenoidDriver: SolenoidState}


def are_called(prepared: SampledLoop) -> bool:
    """Whether a driver of a loop must be called from Python, because the kernel does not implement it."""
    known = all(type(driver) in KINDS for chain in prepared.loop.driven_inputs.chains.values() for driver in chain)
    return not known or greatest_capacity(prepared) > MAX_CAPACITY


def greatest_capacity(prepared: SampledLoop) -> int:
    """The maximum number of segments of an input within an interval, before and after each of its drivers."""
    duration = float(np.diff(prepared.instants).max())
    pieces = int(np.diff(prepared.first_segments).max())
    chains = prepared.loop.driven_inputs.chains.values()
    return max((_capacity(chain, pieces, duration) for chain in chains), default=pieces)


class DriverTable:
    """The drivers (D,) of all inputs as arrays, in the order in which a signal passes through them.

    kinds (D, 2)      index of the input, and DriverKind
    settings, states, kept (D, 4)   settings; states at the end of the present and of the last completed interval
    columns, scratch, counts, begins    workspace of the kernel
    called  whether the drivers are called from Python, in the signals of the kernel
    """

    def __init__(self, prepared: SampledLoop, state: ControlLoopState, capacity: int, called: bool = False) -> None:
        loop, inputs, names = prepared.loop, prepared.inputs, prepared.input_names
        chains = loop.driven_inputs.chains
        self.called, self._chains = called, chains
        self._indices = {name: names.index(name) for name in chains}
        self._order = [(name, driver) for name, chain in chains.items() for driver in chain if not called]
        for name in chains:
            if name not in loop.controller.inputs:
                check_command_range(name, inputs.column(names.index(name)), float(prepared.instants[0]))
        m = inputs.values.shape[1]
        self.kinds = np.array([(names.index(n), KINDS[type(d)]) for n, d in self._order], np.int64).reshape(-1, 2)
        if called:
            self.kinds = np.array([(-1, -1)])
        self.settings = _table([d.settings for _, d in self._order if isinstance(d, PWM | SolenoidDriver)])
        self.kept = _table([tuple(one) for name in chains for one in state.drivers[name] if not called])
        self.states, self._first = self.kept.copy(), self.kept.copy()
        self.columns, self.scratch = np.empty((m, 3, capacity)), np.empty((2, 3, capacity))
        self.counts, self.begins = np.zeros((2, m), dtype=np.int64), np.empty(m)

        self._first_called = state.drivers
        self.restart()

    def restart(self) -> None:
        """The states at the beginning of the loop."""
        self.states[:] = self.kept[:] = self._first
        self._before = self._after = self._first_called
        self._called_at = -1

    def call(self, interval: int, begin: float) -> int:
        """Replace the signals of an interval by those behind the drivers; how many segments they have together."""
        counts = self.counts[0].tolist()
        signals = [list(zip(*self.columns[i, :, :count].tolist(), strict=True)) for i, count in enumerate(counts)]
        self._before, self._called_at = self._after, interval
        self._after = apply_drivers(self._chains, self._before, signals, self._indices, begin)
        counts = list(map(len, signals))
        if max(counts) > self.columns.shape[2]:
            self.columns = np.empty((*self.columns.shape[:2], 2 * max(counts)))
        for i, signal in enumerate(signals):
            self.columns[i, :, : counts[i]] = np.array(signal).T
        self.counts[0] = counts
        return sum(counts)

    def as_mapping(self, done: int) -> Mapping[str, tuple[Any, ...]]:
        """The drivers' states at the end of the last of so many completed intervals, by input."""
        if self.called:  # the last call may be that of an interval that was not completed
            return self._after if done > self._called_at else self._before
        by_name: dict[str, tuple[Any, ...]] = {name: () for name, _ in self._order}
        for (name, driver), row in zip(self._order, self.kept.tolist(), strict=True):
            kind = _STATES[type(driver)]
            by_name[name] = (*by_name[name], kind(*row[: len(kind._fields)]))
        return by_name


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
