"""Valve schedule of Fig. 3 of Hošovský et al., as printed."""

from __future__ import annotations

import airmuscle as am

SCHEDULE = am.Schedule({"fill": ((5.0, 1.0), (15.0, 0.0)), "discharge": ((19.0, 1.0), (25.0, 0.0))})
"""The fill valve opens at 5 s and closes at 15 s, the discharge valve opens at 19 s and closes at 25 s."""
DURATION = 25.0
"""Duration of the experiment [s]."""
FILLING, DISCHARGING = (5.0, 15.0), (19.0, 25.0)
"""Beginning and end of both phases [s]."""
