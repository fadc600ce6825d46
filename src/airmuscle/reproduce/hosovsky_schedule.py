"""When the valves of Fig. 3 of the third paper open and shut, as printed."""

from __future__ import annotations

from ..control.inputs import Schedule

SCHEDULE = Schedule({"fill": ((5.0, 1.0), (15.0, 0.0)), "discharge": ((19.0, 1.0), (25.0, 0.0))})
"""Fill valve open at 5 s and shut at 15 s, discharge valve open at 19 s and shut at 25 s."""
DURATION = 25.0
FILLING, DISCHARGING = (5.0, 15.0), (19.0, 25.0)
