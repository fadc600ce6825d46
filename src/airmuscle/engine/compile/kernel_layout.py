"""Layout of arrays that kernels share with their callers."""

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
    """What is awaited from Python in the present interval: a member of `Waiting`."""
    RESULT = 10
    """The status of an integration that was awaited."""


class Waiting(enum.IntEnum):
    """What the kernel `sampled_loop` awaits from its caller where it paused."""

    NOTHING = 0
    COMMANDS = 1
    """The commands of a controller that is called."""
    DRIVERS = 2
    """The signals of the inputs behind drivers that are called; the first of `kinds` is then
    negative.
    """
    INTEGRATION = 3
    """The end of an interval, where the integrator has no machine code; its address is then 0."""
