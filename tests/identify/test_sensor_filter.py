"""A low-pass filter of a sensor opens the loop of a ramp as a delay does, and rounds its maximum,
which neither a delay nor friction does. Each is told by its own name, with and without friction.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from laboratories import FORCE, LENGTH, MUSCLE, PRESSURE, RESTING_LENGTH, TIME, filtered, ramps

from airmuscle.bench.diagnosis import DELAY, EITHER, FILTER, delay_notes, find_delay
from airmuscle.recording import Recording

SPEEDS = {2.0: 0.01, 10.0: 0.05}
"""Sample time [s] of ramps by their duration [s]."""


def loop_of(tables):
    runs = [
        Recording(
            {
                "time": table[TIME],
                "pressure": 1e3 * table[PRESSURE],
                "contraction": 1.0 - table[LENGTH] / (1e3 * RESTING_LENGTH),
                "force": table[FORCE],
            },
            name,
        )
        for name, table in tables.items()
    ]
    return find_delay(runs)


def tables(friction: float, duration: float, delay: float = 0.0):
    muscle = dataclasses.replace(MUSCLE, friction=friction)
    return ramps(muscle, duration=duration, sample_time=SPEEDS[duration], delay=delay)


@pytest.mark.parametrize("friction", [0.0, 8.0])
@pytest.mark.parametrize("duration", SPEEDS)
@pytest.mark.parametrize("column", [FORCE, PRESSURE])
def test_a_low_pass_filter_is_told_with_its_sensor_and_time_constant(friction, duration, column):
    found = loop_of(filtered(tables(friction, duration), column, 0.4))
    assert found.kind == FILTER
    assert np.sign(found.loop) == (1.0 if column == FORCE else -1.0)
    assert abs(found.loop) == pytest.approx(0.4, rel=0.3)
    (note,) = delay_notes(found)
    assert f"a low-pass filter of the {column.partition(' ')[0]}" in note
    assert "A shift in time does not undo it" in note


@pytest.mark.parametrize("friction", [0.0, 8.0])
@pytest.mark.parametrize("duration", SPEEDS)
def test_a_delay_is_a_delay(friction, duration):
    found = loop_of(tables(friction, duration, delay=0.4))
    assert found.kind == DELAY
    assert found.loop == pytest.approx(0.4, rel=0.3)
    assert "shift the force by this time" in delay_notes(found)[0]


@pytest.mark.parametrize("friction", [0.0, 8.0, 30.0])
@pytest.mark.parametrize("duration", SPEEDS)
def test_friction_is_neither(friction, duration):
    assert loop_of(tables(friction, duration)) is None


def test_with_few_rows_at_the_maximum_neither_is_claimed():
    coarse = ramps(MUSCLE, duration=2.0, sample_time=0.05, delay=0.4)
    found = loop_of(coarse)
    assert found.kind == EITHER
    assert "sample faster to tell" in delay_notes(found)[0]
