"""Where the one coordinate of a plant is in balance, looked for over the whole reach of its muscles."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

from ...core.arrays import Array
from ...core.errors import EquilibriumError, GeometryLimitError
from .roots import balances
from .statics import StaticProblem

PLACES = 101
"""Places looked at between the ends of the reach."""


def places(static: StaticProblem) -> list[float]:
    """Every coordinate of balance, rising. Raises NoEquilibrium where the plant is in balance anywhere."""
    alone, x = _Alone(static), grid(static)[None, :]
    f = alone.accelerations(x)
    if not f.any():
        kind = type(static.plant.mechanism).__name__
        raise EquilibriumError(
            f"{kind} rests wherever it is: nothing moves it under these inputs. Choose a start by "
            f"plant.state_at(pressure=..., {static.coordinates[0].name}=...)."
        )
    _, found = balances(alone, x, f)
    return [float(v) for v in found]


@dataclasses.dataclass(frozen=True, eq=False)
class _Alone:
    """One plant as a table of plants, place by place: its laws may be such as take no arrays, or its air be shut in."""

    static: StaticProblem

    def of(self, rows: npt.NDArray[np.intp]) -> _Alone:
        return self

    def accelerations(self, x: Array) -> Array:
        """As those of `SideBySide`."""
        found = [self.static.accelerations(self.static.place([v]))[0] for v in x.ravel()]
        return np.array(found).reshape(x.shape)


def grid(static: StaticProblem) -> Array:
    """Coordinates that every muscle can take, rising. Raises OutOfReach where there are none."""
    ends = _ends_of_straight(static)
    if ends is None:
        c = static.coordinates[0]
        x = np.linspace(c.lower_limit, c.upper_limit, PLACES)
        inside = np.array([static.within_reach(static.place([v])) for v in x])
        edges = [_edge(static, *x[i : i + 2]) for i in np.flatnonzero(inside[:-1] != inside[1:])]
        x = np.unique([*x[inside], *edges])
    else:
        x = np.linspace(*ends, PLACES) if ends[0] < ends[1] else np.empty(0)
    if x.size == 0:
        kind, names = type(static.plant.mechanism).__name__, ", ".join(m.name for m in static.plant.muscles)
        raise GeometryLimitError(f"{kind} has no place that {names} can all take; change offsets, radius or arms.")
    return x


def _ends_of_straight(static: StaticProblem) -> tuple[float, float] | None:
    """The reach where contractions are straight lines over the coordinate; None where they are not."""
    c = static.coordinates[0]
    at = [np.array(static.contractions(static.place([k * c.nominal]))) for k in (0.0, 1.0, -3.0)]
    slope = (at[1] - at[0]) / c.nominal
    if not np.allclose(at[2], at[0] - 3.0 * c.nominal * slope, rtol=0.0, atol=1e-12):
        return None
    low, high = c.lower_limit, c.upper_limit
    for zero, rate, reach in zip(at[0], slope, static.reach, strict=True):
        if rate == 0.0:
            continue
        ends = sorted((end - zero) / rate for end in reach)
        low, high = max(low, ends[0]), min(high, ends[1])
    return low, high


def _edge(static: StaticProblem, a: float, b: float) -> float:
    """The last place within reach between one that is and one that is not."""
    inside, outside = (a, b) if static.within_reach(static.place([a])) else (b, a)
    for _ in range(60):
        middle = 0.5 * (inside + outside)
        inside, outside = (middle, outside) if static.within_reach(static.place([middle])) else (inside, middle)
    return inside
