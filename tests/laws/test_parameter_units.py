"""Units of the parameters of control laws: a gain relates two signals, and its unit is that of
their ratio.
"""

from __future__ import annotations

import pytest

from airmuscle.control import PID, Cascade, FrictionFeedForward, GainSchedule, SmithPredictor
from airmuscle.engine import ColumnSensor, WithSensors
from airmuscle.engine.loop.controller import parameter_units

UNITS = {
    "position": "m",
    "pressure": "Pa",
    "speed": "rad/s",
    "fill": "1",
    "command": "N m",
    "force": "N",
}
INNER = PID("pressure", "fill", gain=1e-5, integral_time=1.0)
OUTER = PID("position", "pressure", gain=1e6)


@pytest.mark.parametrize(
    ("law", "path", "unit"),
    [
        (OUTER, "gain", "Pa/m"),
        (OUTER, "initial_output", "Pa"),
        (INNER, "gain", "1/Pa"),
        (INNER, "integral_time", "s"),
        (Cascade(OUTER, INNER, (0.0,), (5e5,)), "minimum[0]", "Pa"),
        (Cascade(OUTER, INNER, (0.0,), (5e5,)), "maximum[0]", "Pa"),
        (Cascade(OUTER, INNER, (0.0,), (5e5,)), "outer.gain", "Pa/m"),
        (FrictionFeedForward("speed", "command", 2.0, 0.1), "amplitude", "N m"),
        (FrictionFeedForward("speed", "command", 2.0, 0.1), "boundary_speed", "rad/s"),
        (GainSchedule(INNER, "gain", "force", (0.0, 100.0), (1e-5, 2e-5)), "breakpoints[1]", "N"),
        (
            GainSchedule(INNER, "gain", "force", (0.0, 100.0), (1e-5, 2e-5)),
            "scheduled_values[0]",
            "1/Pa",
        ),
        (SmithPredictor(OUTER, "position", "pressure", 3, 1e-7, 0.1), "static_gain", "m/Pa"),
        (SmithPredictor(OUTER, "position", "pressure", 3, 1e-7, 0.1), "time_constant", "s"),
        (WithSensors(OUTER, (ColumnSensor("position", 1e-5, 2e-5, 0.1),)), "sensors[0].noise", "m"),
        (WithSensors(OUTER, (ColumnSensor("position", 1e-5, 2e-5, 0.1),)), "sensors[0].lag", "s"),
    ],
)
def test_the_unit_of_a_parameter_follows_from_the_signals_of_its_law(law, path, unit):
    assert parameter_units(law, UNITS)[path] == unit


def test_the_unit_is_1_where_that_of_the_signal_is_not_known():
    friction = FrictionFeedForward("speed", "command", 2.0, 0.1)
    assert parameter_units(friction, {"command": "N m", "speed": ""})["boundary_speed"] == "1"
    assert parameter_units(friction, {"command": "N m"})["boundary_speed"] == "1"
