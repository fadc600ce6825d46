"""Layout of arrays that kernels share with their callers."""

from __future__ import annotations

import enum


class DriverKind(enum.IntEnum):
    """Kinds of drivers that kernels implement."""

    MODULATOR = 0
    SWITCH = 1


class Progress(enum.IntEnum):
    """Places in the array `progress` of the kernel `sampled_loop`."""

    INTERVAL = 0
    """Completed intervals."""
    RUNNING = 1
    """1 while an interval is being integrated."""
    SEGMENTS = 2
    ROWS = 3
    """Segments and rows so far."""
    SAMPLES = 4
    """Intervals that have begun."""
    STEPS_BEFORE = 5
    """Steps of the integrator before the present interval."""
    FULL = 6
    """1 if the buffers have no room for another interval."""
    FIRST_SEGMENT = 7
    FIRST_ROW = 8
    """The first segment and row of the present interval."""
    WAITING = 9
    """1 while the commands of the present interval are awaited from a controller that is called from Python."""
