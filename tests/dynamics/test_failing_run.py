"""A run that fails returns what it has, with the reason, the time, the state and the remedy; never NaN as a result."""

from __future__ import annotations

import numpy as np
import pytest
from joints import chosen_muscle

from airmuscle.circuit import FillDischarge, Supply, Valve
from airmuscle.command import Schedule
from airmuscle.errors import SimulationError
from airmuscle.mechanism import HangingMass
from airmuscle.method import RungeKutta4
from airmuscle.plant import Plant
from airmuscle.simulate import simulate

HUGE = Valve(9e-6, 0.3)
FILL = Schedule({"fill": ((0.05, 1.0),)})


def test_a_fixed_step_that_is_too_long_is_not_called_a_result():
    """A huge valve empties and overfills the muscle within one step; polytropic air of negative mass has no pressure."""
    plant = Plant(chosen_muscle(), FillDischarge(Supply(5e5), HUGE, HUGE), HangingMass(10.0))
    start = plant.state_at(pressure=1e5)
    with pytest.raises(
        SimulationError, match=r"ended at .* because .*not finite.*air_mass .*fixed step too long"
    ) as caught:
        simulate(plant, FILL, duration=1.0, start=start, method=RungeKutta4(0.01))
    part = caught.value.recording
    assert 3 <= len(part) < 101
    for name in part:
        assert np.isfinite(part[name]).all(), name
    kept = simulate(plant, FILL, duration=1.0, start=start, method=RungeKutta4(0.01), complete=False)
    assert len(kept) == len(part)
    assert "not finite" in kept.notes[-1]
