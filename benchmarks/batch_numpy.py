"""Vectorised NumPy code of the equations of batch.c; each row of an array is one quantity of all
plants.
"""

from __future__ import annotations

import numpy as np
from filling import Array


def rk4(
    p: Array, start: Array, switched: tuple[float, float, float, float], step: float, count: int
) -> Array:
    """The states (3, N) after `count` steps; parameters `p` (46, N) as in batch.c, the same
    switching times for all.
    """
    state = start
    for i in range(count):
        now = (i + 0.5) * step
        fill = p[8] if switched[0] < now < switched[1] else 0.0
        discharge = p[12] if switched[2] < now < switched[3] else 0.0
        k1 = rates(p, state, fill, discharge)
        k2 = rates(p, state + step / 2 * k1, fill, discharge)
        k3 = rates(p, state + step / 2 * k2, fill, discharge)
        k4 = rates(p, state + step * k3, fill, discharge)
        state = state + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return state


def rates(p: Array, state: Array, fill: Array | float, discharge: Array | float) -> Array:
    """Rates (3, N) of air mass, position and speed."""
    inverse_mass, gravity, inverse_length, volume_factor, cc, rt, ambient, supply = p[:8]
    low_x, scale_x, low_q, scale_q, min_force, max_force, stiffness, damping, growth = p[16:25]
    air, position, speed = state
    contraction = position * inverse_length
    s = 1.0 - contraction
    pressure = air * rt / (volume_factor * s * (1.0 - cc * s * s))
    gauge = pressure - ambient
    x = (contraction - low_x) * scale_x - 1.0
    q = (gauge - low_q) * scale_q - 1.0
    force = np.clip(surface(p[25:], x, q), min_force, max_force)
    tension = np.maximum(force - stiffness * position - (damping + growth * gauge) * speed, 0.0)
    air_rate = fill * flow(p[9:12], supply, pressure) - discharge * flow(
        p[13:16], pressure, ambient
    )
    return np.array([air_rate, speed, tension * inverse_mass - gravity])


def flow(valve: Array, up: Array, down: Array) -> Array:
    """Mass flow between two pressures: the ISO 6358 ellipse with a laminar chord."""
    critical, subsonic, laminar = valve
    high = np.maximum(up, down)
    low = np.minimum(up, down)
    beyond = np.maximum(low - critical * high, 0.0) * subsonic
    q = np.minimum(np.sqrt(np.maximum(high * high - beyond * beyond, 1.0)), laminar * (high - low))
    return np.where(up >= down, q, -q)


def surface(a: Array, x: Array, q: Array) -> Array:
    """The polynomial of degree five, extrapolated by its tangent beyond the validity range."""
    xi = np.clip(x, -1.0, 1.0)
    qi = np.clip(q, -1.0, 1.0)
    r0 = a[0] + xi * (a[1] + xi * (a[2] + xi * (a[3] + xi * (a[4] + xi * a[5]))))
    r1 = a[6] + xi * (a[7] + xi * (a[8] + xi * (a[9] + xi * a[10])))
    r2 = a[11] + xi * (a[12] + xi * (a[13] + xi * a[14]))
    r3 = a[15] + xi * (a[16] + xi * a[17])
    r4 = a[18] + xi * a[19]
    d0 = a[1] + xi * (2 * a[2] + xi * (3 * a[3] + xi * (4 * a[4] + xi * 5 * a[5])))
    d1 = a[7] + xi * (2 * a[8] + xi * (3 * a[9] + xi * 4 * a[10]))
    d2 = a[12] + xi * (2 * a[13] + xi * 3 * a[14])
    d3 = a[16] + xi * 2 * a[17]
    value = r0 + qi * (r1 + qi * (r2 + qi * (r3 + qi * (r4 + qi * a[20]))))
    by_x = d0 + qi * (d1 + qi * (d2 + qi * (d3 + qi * a[19])))
    by_q = r1 + qi * (2 * r2 + qi * (3 * r3 + qi * (4 * r4 + qi * 5 * a[20])))
    return value + np.minimum(by_x, 0.0) * (x - xi) + np.maximum(by_q, 0.0) * (q - qi)
