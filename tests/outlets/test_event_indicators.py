"""Event indicators: where none changes its sign, the slopes of the rates are continuous.

Along straight lines through the state space the intervals with the greatest change of the Jacobian
are halved. A change that remains although the interval becomes a thousand times shorter is a jump:
an indicator must have another sign beyond.
"""

from __future__ import annotations

import itertools

import numpy as np
import plants
import printed
import pytest

from airmuscle.engine.compile import compile_system
from airmuscle.engine.compile.function import event_indicators

SOME = ("dmsp-20-300", "Serres", "series spring with a stop", "Prandtl-Ishlinskii", "overlap")
"""Plants with jumps on these lines."""
ALL = [
    pytest.param(name, marks=() if name in SOME else pytest.mark.slow) for name in plants.EXAMPLES
]


class Line:
    """A straight line between two states under constant inputs, with slopes and signs of indicators
    at its points.
    """

    def __init__(self, name, seed):
        plant = plants.EXAMPLES[name]
        self.ready = compile_system(plant)
        self.indicators = event_indicators(self.ready.program.traced)
        states, inputs = printed.points_of(plant, 2, seed)
        self.way = 3 * (states[1] - states[0])
        self.input = inputs[0]
        self.start = states[0] - self.way / 3
        self.scale = np.abs(np.array([self.slopes(s) for s in np.linspace(0, 1, 40)])).max(axis=0)
        self.scale[self.scale < printed.ROUNDING] = 1.0

    def slopes(self, s):
        f = np.empty(self.ready.sizes.states)
        j = np.zeros(max(self.ready.sizes.jacobian, 1))
        x = self.start + s * self.way
        self.ready.call("jac", x, np.append(self.input, 0.0), self.ready.precomputed, f, j)
        return j

    def change(self, a, b):
        return np.abs((self.slopes(b) - self.slopes(a)) / self.scale).max()

    def signs(self, s):
        x = self.start + s * self.way
        return [z > 0 for z in self.indicators.values(x, self.input, self.ready.parameters)]

    def halved(self, a, b, width):
        """The part of an interval, not longer than `width`, in which the slopes change most."""
        while b - a > width:
            middle = (a + b) / 2
            a, b = (a, middle) if self.change(a, middle) >= self.change(middle, b) else (middle, b)
        return a, b

    def jumps(self):
        """The sides of jumps of the slopes."""
        parts = np.linspace(0, 1, 61)
        intervals = [i for i in itertools.pairwise(parts) if np.isfinite(self.change(*i))]
        for interval in sorted(intervals, key=lambda ends: -self.change(*ends))[:8]:
            wide = self.halved(*interval, 1e-7)
            low, high = self.halved(*wide, 1e-10)
            if self.change(low, high) > max(1e-4, self.change(*wide) / 2):
                yield low, high


@pytest.mark.parametrize("name", ALL)
def test_slopes_jump_only_where_an_indicator_changes_its_sign(name):
    found = 0
    for line in (Line(name, seed) for seed in range(3)):
        for low, high in line.jumps():
            found += 1
            assert line.signs(low) != line.signs(high), low
    assert found or name not in SOME


def test_a_comparison_of_parameters_alone_has_no_indicator():
    """The ends of a clamp are fixed; only the clamped value can cross them."""
    ready = compile_system(plants.EXAMPLES["dmsp-20-300"])
    indicators = event_indicators(ready.program.traced)
    state, inputs = printed.points_of(plants.EXAMPLES["dmsp-20-300"], 8)
    position = ready.description.state_names.index("position")
    state[:4, position] = [-0.03, -0.01, 0.1, 0.12]  # stretched and slack, beyond the range
    values = np.array(
        [indicators.values(x, u, ready.parameters) for x, u in zip(state, inputs, strict=True)]
    )
    assert values.shape[1] == indicators.count > 0
    assert (np.ptp(values, axis=0) > 0).all()


def test_scales_make_an_indicator_of_order_one():
    """The clearance of a stop [m] is divided by the nominal size of the position."""
    plant = plants.EXAMPLES["pulley with stops"]
    ready = compile_system(plant)
    state = plant.state_at(pressure=1e5)
    x = np.array([state[s.name] for s in plant.states])
    u = np.zeros(len(plant.inputs))
    indicators = event_indicators(ready.program.traced)
    scales = indicators.scales(x, u, ready.parameters, ready.nominal)
    values = indicators.values(x, u, ready.parameters)
    position, nominal = next(
        (state[s.name], s.nominal) for s in plant.states if s.name == "position"
    )
    clearance = (position - plant.mechanism.lower_stop) / nominal
    assert any(
        abs(abs(z / s) - abs(clearance)) < 1e-12 for z, s in zip(values, scales, strict=True)
    )
