"""Why a plant finds no rest: what each muscle pulls, and what would balance the load."""

from __future__ import annotations

import numpy as np

from ...core.arrays import Array
from .multi_dof import starts
from .single_dof import grid
from .statics import StaticProblem


def explanation(static: StaticProblem) -> str:
    """The forces at both ends of the reach; with several coordinates where the plant is nearest to balance."""
    if len(static.coordinates) == 1:
        x = grid(static)
        ends = [end for way in (x, x[::-1]) if (end := _first_possible(static, way)) is not None]
        if not ends:
            return f"{type(static.plant.mechanism).__name__} finds no rest: no place can hold the given air."
        lines = [_line(static, np.array([x])) for x in ends]
        load = _needed(static, ends[0])
    else:
        tried = list(starts(static))
        sizes = np.array([np.abs(static.accelerations(static.place(x))).max() for x in tried])
        lines, load = [_line(static, tried[int(np.argmin(sizes))])] if tried else ["no place is within reach"], ""
    return (
        f"{type(static.plant.mechanism).__name__} finds no rest: " + "; ".join(lines) + f".{load} "
        "Change the load, the pressure or the parallel spring."
    )


def _first_possible(static: StaticProblem, places: Array) -> float | None:
    """The first of these coordinates at which a pressure holds the air."""
    return next((float(x) for x in places if np.isfinite(static.accelerations(static.place([x]))).all()), None)


def _line(static: StaticProblem, x: Array) -> str:
    place = static.place(x)
    ports = static.plant.muscle_states(static.state(place))
    pulls = ", ".join(
        f"{m.name} pulls {float(port.tension) + 0.0:.6g} N at {round(float(port.pressure) / 1e3, 6) + 0.0:.6g} kPa "
        f"and a contraction of {float(port.contraction):.1%}"
        for m, port in zip(static.plant.muscles, ports, strict=True)
    )
    if len(x) == 1:
        (c,), (acceleration,) = static.coordinates, static.accelerations(place)
        return f"{pulls}, and the load accelerates at {acceleration:+.4g} {c.unit}/s2"
    moving = ", ".join(
        f"{c.name} at {acceleration:+.4g} {c.unit}/s2"
        for c, acceleration in zip(static.coordinates, static.accelerations(place), strict=True)
    )
    return f"{pulls}, and there accelerate {moving}"


def _needed(static: StaticProblem, x: float) -> str:
    """What a single muscle would have to pull to hold the load; nothing for several muscles."""
    if len(static.plant.muscles) > 1:
        return ""
    state, mechanism = static.state(static.place([x])), static.plant.mechanism
    found = []
    for tension in (0.0, 1.0):
        pulls = mechanism.generalised_forces(state, [tension], static.lengths)
        found.append(float(mechanism.acceleration(state, state, pulls, static.inputs)[static.coordinates[0].name]))
    slope = found[1] - found[0]
    return f" The load needs a pull of {-found[0] / slope:.6g} N." if slope else ""
