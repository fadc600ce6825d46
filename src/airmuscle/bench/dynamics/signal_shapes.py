"""Shapes of test signals for pressure regulators and joints: small steps after rest, steps, ramps,
sines, random steps, reversals and chirps, as fractions of an amplitude about a level.
"""

import dataclasses
from collections.abc import Iterator

import numpy as np

from ...core import Array

REST = 0.6
"""Rest before a step whose response is that after rest [s] (chosen): a published regulator settles
within 0.3 s."""
LENGTH = 3.0
"""Duration of sines, chirps and random steps [s] (chosen)."""
STEP_HOLD = 0.8
RAMP_TIMES = (0.5, 1.5)
REVERSAL_TIMES = (0.05, 0.1, 0.2)
RANDOM_HOLDS = ((0.03, 0.15), (0.05, 0.4), (0.2, 0.7))
RANDOM_LENGTH = 2.0
"""Time for which a step is held, duration of a ramp, time after which a step is reversed, ranges of
the times for which random steps are held, and their duration [s] (chosen)."""
FREQUENCIES = (0.5, 2.0, 4.0, 8.0)
CHIRP = (0.2, 10.0)
"""Frequencies of the sines, and first and last frequency of a chirp [Hz] (chosen)."""
AMPLITUDES = (0.02, 0.06, 0.2)
LARGE = 0.5
"""Amplitudes, and that of large steps, as fractions of the range of the pressure (chosen)."""
LARGE_RANDOM = 12
"""Number of different sequences of large random steps (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False)
class SignalShape:
    """A shape about rest: `values` (N,) between -1 and 1 at the rows, `amplitude` as a fraction of
    the range of the pressure; rest before and after it is not contained.
    """

    description: str
    amplitude: float
    values: Array
    random: bool = False
    """Whether the values are random, so that muscles may also move independently."""


def independent(sample_time: float, seed: int, count: int) -> Array:
    """Random steps (N, count) of several muscles, each by itself, between -1 and 1."""
    rng = np.random.default_rng([seed, count])
    holds = RANDOM_HOLDS[seed % len(RANDOM_HOLDS)]
    return np.stack([_random_steps(sample_time, rng, holds) for _ in range(count)], axis=1)


def standard_shapes(sample_time: float, seed: int = 0) -> tuple[SignalShape, ...]:
    """The shapes at rows of `sample_time` [s], each with its amplitudes; `seed` is that of the
    random steps.
    """
    return tuple(_shapes(sample_time, np.random.default_rng(seed)))


def _shapes(sample_time: float, rng: np.random.Generator) -> Iterator[SignalShape]:
    rest = np.zeros(_rows(REST, sample_time))
    steps = np.concatenate([rest, _held((1.0, 0.0, -1.0, 0.0), STEP_HOLD, sample_time)])
    for amplitude in AMPLITUDES:
        yield SignalShape("steps after rest", amplitude, steps)
        yield SignalShape(
            "random steps", amplitude, _random_steps(sample_time, rng, RANDOM_HOLDS[1])
        )
        yield SignalShape("chirp from 0.2 to 10 Hz", amplitude, _chirp(sample_time))
        for frequency in _resolved_frequencies(sample_time):
            wave = np.sin(2.0 * np.pi * frequency * _times(sample_time))
            yield SignalShape(f"sine of {frequency:g} Hz", amplitude, wave)
    for amplitude in AMPLITUDES[1:]:
        for hold in REVERSAL_TIMES:
            text = f"steps reversed after {1e3 * hold:g} ms"
            yield SignalShape(text, amplitude, _reversals(hold, sample_time))
    yield SignalShape("large steps", LARGE, steps)
    for number in range(1, LARGE_RANDOM + 1):
        text = f"large random steps {number}"
        values = _random_steps(sample_time, rng, RANDOM_HOLDS[number % len(RANDOM_HOLDS)])
        yield SignalShape(text, LARGE, values, random=True)
    for duration in RAMP_TIMES:
        yield SignalShape(f"ramps of {duration:g} s", LARGE, _ramps(duration, sample_time))


def _rows(duration: float, sample_time: float) -> int:
    return max(1, round(duration / sample_time))


def _resolved_frequencies(sample_time: float) -> list[float]:
    """The frequencies of which a period has eight rows at least."""
    return [frequency for frequency in FREQUENCIES if 8.0 * frequency * sample_time <= 1.0]


def _held(levels: tuple[float, ...], hold: float, sample_time: float) -> Array:
    return np.repeat(np.array(levels), _rows(hold, sample_time))


def _times(sample_time: float) -> Array:
    """Times of the rows of a shape of usual length [s]."""
    return np.asarray(sample_time * np.arange(_rows(LENGTH, sample_time)), dtype=np.float64)


def _chirp(sample_time: float) -> Array:
    """A sine whose frequency rises exponentially, as far as eight rows resolve a period."""
    first, highest = CHIRP
    resolved = 1.0 / (8.0 * sample_time)
    last = min(highest, resolved)
    growth = np.log(last / first) / LENGTH
    time = _times(sample_time)
    periods = first * np.expm1(growth * time) / growth
    return np.asarray(np.sin(2.0 * np.pi * periods), dtype=np.float64)


def _random_steps(
    sample_time: float, rng: np.random.Generator, holds: tuple[float, float]
) -> Array:
    """Uniform levels, each held for a random time."""
    needed = _rows(RANDOM_LENGTH, sample_time)
    values = list[Array]()
    rows = 0
    while rows < needed:
        count = _rows(float(rng.uniform(*holds)), sample_time)
        values.append(np.full(count, rng.uniform(-1.0, 1.0)))
        rows += count
    return np.concatenate(values)[:needed]


def _reversals(hold: float, sample_time: float) -> Array:
    """Rest, a short step up and down, rest, and a short step down and up."""
    up = np.ones(_rows(hold, sample_time))
    rest = np.zeros(_rows(REST, sample_time))
    return np.concatenate([rest, up, -up, rest, -up, up])


def _ramps(duration: float, sample_time: float) -> Array:
    """A triangle from rest to both ends and back."""
    rows = _rows(duration, sample_time)
    corners = np.array([0.0, 1.0, -1.0, 0.0])
    at = rows * np.array([0.0, 0.5, 1.5, 2.0])
    values = np.interp(np.arange(2 * rows), at, corners)
    return np.asarray(values, dtype=np.float64)
