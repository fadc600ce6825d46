"""Margins of a sampled loop: gain, phase and delay margin and sensitivity peak of an open loop."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import numpy as np

from ...core.arrays import Array
from ...physics.analysis.sampled_model import SampledModel

POINTS, DECADES = 4000, 6
"""Frequencies below the Nyquist frequency between which crossings are sought, and their decades (chosen)."""


@dataclasses.dataclass(frozen=True)
class Margins:
    """Distances of a stable loop from instability; L is the open loop, f frequencies [Hz].

    gain          smallest factor above 1 by which the gain may rise, 1/|L| where L is negative; infinite: any
    lower_gain    greatest factor below 1 to which the gain may fall; 0: any
    gain_frequency    [Hz] of the smallest factor; NaN where there is none
    phase         smallest angle to -1 [rad] where |L| = 1; infinite where there is no such frequency
    phase_frequency   [Hz] of that; NaN where there is none
    delay         smallest further dead time [s] at which the loop becomes unstable, phase/(2 pi f); infinite: any
    peak          sensitivity peak, the greatest |1/(1 + L)|; its reciprocal is the distance of L from -1
    peak_frequency    [Hz]
    """

    gain: float
    lower_gain: float
    gain_frequency: float
    phase: float
    phase_frequency: float
    delay: float
    peak: float
    peak_frequency: float


def frequency_grid(model: SampledModel) -> Array:
    """Frequencies (F,) [Hz] up to the Nyquist frequency, denser at the resonances of a model."""
    top = model.nyquist_frequency
    grid = np.geomspace(top * 10.0**-DECADES, top, POINTS)
    turns = np.abs(np.angle(model.poles)) / (2 * math.pi * model.sample_time)
    near = np.array([f * (1.0 + part) for f in turns if f > grid[0] for part in np.linspace(-0.02, 0.02, 21)])
    found = np.unique(np.concatenate([grid, near]))
    return found[(found > 0) & (found <= top)]


def loop_margins(opened: SampledModel) -> Margins:
    """The margins of an open loop L with one input and one output, whose closed loop 1/(1 + L) is stable.

    Crossings between the frequencies of a grid are refined to rounding; the Nyquist frequency is one of them.
    """
    frequencies = frequency_grid(opened)

    def at(f: float) -> complex:
        return complex(opened.frequency_response([f])[0, 0, 0])

    values = opened.frequency_response(frequencies)[:, 0, 0]
    negative = [f for f in _zeros(frequencies, values.imag, lambda f: at(f).imag) if at(f).real < 0]
    if values[-1].real < 0:
        negative.append(float(frequencies[-1]))
    factors = {1.0 / abs(at(f)): f for f in negative if at(f) != 0}
    above, below = [x for x in factors if x >= 1.0], [x for x in factors if x < 1.0]
    crossings = _zeros(frequencies, np.abs(values) - 1.0, lambda f: abs(at(f)) - 1.0)
    angles = {f: float(np.angle(-at(f))) for f in crossings}
    nearest = min(angles, key=lambda f: abs(angles[f]), default=math.nan)
    delays = [(angle % (2 * math.pi)) / (2 * math.pi * f) for f, angle in angles.items()]
    peak, where = _peak(frequencies, np.abs(1.0 + values), lambda f: abs(1.0 + at(f)))
    gain = min(above, default=math.inf)
    return Margins(
        gain, max(below, default=0.0), factors.get(gain, math.nan), abs(angles.get(nearest, math.inf)), nearest,
        min(delays, default=math.inf), peak, where,
    )  # fmt: skip


def _zeros(grid: Array, values: Array, function: Callable[[float], float]) -> list[float]:
    """The zeros of a function between the points of a grid where it changes its sign, to rounding."""
    from scipy.optimize import brentq

    changes = np.flatnonzero(values[:-1] * values[1:] < 0)
    return [float(brentq(function, grid[i], grid[i + 1], xtol=1e-300, rtol=1e-14)) for i in changes]


def _peak(grid: Array, distances: Array, function: Callable[[float], float]) -> tuple[float, float]:
    """The reciprocal of the smallest distance, and its frequency [Hz]."""
    from scipy.optimize import minimize_scalar

    i = int(np.argmin(distances))
    low, high = grid[max(i - 1, 0)], grid[min(i + 1, grid.size - 1)]
    found = minimize_scalar(function, bounds=(low, high), method="bounded", options={"xatol": 1e-12 * high})
    best, where = min((float(found.fun), float(found.x)), (float(distances[i]), float(grid[i])))
    return (math.inf if best == 0 else 1.0 / best), where
