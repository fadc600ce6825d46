"""Where the one coordinate of a plant is in balance, looked for over the whole reach of its muscles."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from ..errors import NoEquilibrium, OutOfReach
from .static import Static

Array = npt.NDArray[np.float64]
PLACES = 101
"""Places looked at between the ends of the reach."""
GOLDEN = 0.5 * (5.0**0.5 - 1.0)


def places(static: Static) -> list[float]:
    """Every coordinate of balance, rising. Raises NoEquilibrium where the plant is in balance anywhere."""

    def acceleration(x: float) -> float:
        return float(static.accelerations(static.place([x]))[0])

    x = grid(static)
    f = np.array([acceleration(v) for v in x])
    if not f.any():
        kind = type(static.plant.mechanism).__name__
        raise NoEquilibrium(
            f"{kind} rests wherever it is: nothing moves it under these inputs. Choose a start by "
            f"plant.state_at(pressure=..., {static.coordinates[0].name}=...)."
        )
    zero = np.concatenate([[False], f == 0, [False]])
    found = [float(v) for v in x[zero[1:-1] & ~(zero[:-2] & zero[2:])]]  # of a stretch in balance its two ends
    for i in range(x.size - 1):
        if f[i] * f[i + 1] < 0:
            found.append(between(acceleration, float(x[i]), float(x[i + 1])))
    for i in range(1, x.size - 1):
        if _nears_zero(f[i - 1 : i + 2]):
            found += _pair(acceleration, x[i - 1 : i + 2], float(np.sign(f[i])))
    return sorted(found)


def between(function: Callable[[float], float], low: float, high: float) -> float:
    """The root between two places of different sign: false position, the end that stays halved (Illinois).

    SciPy's search would cost the first run a slow import.
    """
    at_low, at_high = function(low), function(high)
    close, last = 1e-15 * (high - low), low
    for _ in range(200):
        middle = low + (high - low) * at_low / (at_low - at_high)
        if not low < middle < high:
            middle = 0.5 * (low + high)
        at = function(middle)
        if at == 0 or abs(middle - last) <= close or not low < middle < high:
            return middle
        if at * at_low > 0:
            low, at_low, at_high = middle, at, at_high * (0.5 if last <= low else 1.0)
        else:
            high, at_high, at_low = middle, at, at_low * (0.5 if last >= high else 1.0)
        last = middle
    return last


def _nears_zero(f: Array) -> bool:
    """Whether the middle of three values of one sign is nearest to zero."""
    a, b, c = np.abs(f)
    return bool((f > 0).all() or (f < 0).all()) and bool(b <= min(a, c)) and bool(b < max(a, c))


def _pair(function: Callable[[float], float], x: Array, sign: float) -> list[float]:
    """The two roots between three places, if the function crosses zero there and comes back: by golden section."""
    low, high = float(x[0]), float(x[2])
    inner = [high - GOLDEN * (high - low), low + GOLDEN * (high - low)]
    values = [sign * function(v) for v in inner]
    for _ in range(50):
        if min(values) < 0:
            turn = inner[int(values[1] < values[0])]
            return [between(function, float(x[0]), turn), between(function, turn, float(x[2]))]
        if values[0] < values[1]:
            high, inner[1], values[1] = inner[1], inner[0], values[0]
            inner[0] = high - GOLDEN * (high - low)
            values[0] = sign * function(inner[0])
        else:
            low, inner[0], values[0] = inner[0], inner[1], values[1]
            inner[1] = low + GOLDEN * (high - low)
            values[1] = sign * function(inner[1])
    return []


def grid(static: Static) -> Array:
    """Coordinates that every muscle can take, rising. Raises OutOfReach where there are none."""
    ends = _ends_of_straight(static)
    if ends is None:
        c = static.coordinates[0]
        x = np.linspace(c.least, c.greatest, PLACES)
        inside = np.array([static.within_reach(static.place([v])) for v in x])
        edges = [_edge(static, *x[i : i + 2]) for i in np.flatnonzero(inside[:-1] != inside[1:])]
        x = np.unique([*x[inside], *edges])
    else:
        x = np.linspace(*ends, PLACES) if ends[0] < ends[1] else np.empty(0)
    if x.size == 0:
        kind, names = type(static.plant.mechanism).__name__, ", ".join(m.name for m in static.plant.muscles)
        raise OutOfReach(f"{kind} has no place that {names} can all take; change offsets, radius or arms.")
    return x


def _ends_of_straight(static: Static) -> tuple[float, float] | None:
    """The reach where contractions are straight lines over the coordinate; None where they are not."""
    c = static.coordinates[0]
    at = [np.array(static.contractions(static.place([k * c.nominal]))) for k in (0.0, 1.0, -3.0)]
    slope = (at[1] - at[0]) / c.nominal
    if not np.allclose(at[2], at[0] - 3.0 * c.nominal * slope, rtol=0.0, atol=1e-12):
        return None
    low, high = c.least, c.greatest
    for zero, rate, reach in zip(at[0], slope, static.reach, strict=True):
        if rate == 0.0:
            continue
        ends = sorted((end - zero) / rate for end in reach)
        low, high = max(low, ends[0]), min(high, ends[1])
    return low, high


def _edge(static: Static, a: float, b: float) -> float:
    """The last place within reach between one that is and one that is not."""
    inside, outside = (a, b) if static.within_reach(static.place([a])) else (b, a)
    for _ in range(60):
        middle = 0.5 * (inside + outside)
        inside, outside = (middle, outside) if static.within_reach(static.place([middle])) else (inside, middle)
    return inside
