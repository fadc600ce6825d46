"""Whether a plant returns to a rest after a small push."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from .static import Static

MARGIN = 1e-9
"""Greatest real part of an eigenvalue, as a share of the greatest eigenvalue, that counts as none."""


def is_stable(static: Static, state: Mapping[str, float]) -> bool:
    """Whether no eigenvalue of the motion has a positive real part.

    The motion is that of coordinates, series springs, creep and walls. With given pressures the air follows the
    volume, m = m_0 V/V_0; with given masses it stays as it is, at its temperature. Friction is left out, as it would
    hold any place.
    """
    from ..program.derivatives import derivatives  # CasADi, which describing a plant does not need

    plant = static.plant
    air, friction = set[str](), set[str]()
    for prefix, muscle in zip(plant.prefixes, plant.muscles, strict=True):
        air |= {prefix + s.name for s in plant.gas.states(muscle.geometry.volume(0.05), plant.ambient)}
        friction |= {prefix + s.name for s in muscle.friction.states}
    moving = {n for c in static.coordinates for n in (c.name, c.speed)}
    moving |= {p + s.name for p, m in zip(plant.prefixes, plant.muscles, strict=True) for s in m.states}
    free = [i for i, n in enumerate(static.names) if n in moving - friction]
    if not free:
        return True
    x = np.array([state[n] for n in static.names])
    at = derivatives(static.ready, x.tolist(), list(static.inputs.values()))
    matrix = at.rates_by_state[np.ix_(free, free)]
    if not static.shut:
        outputs = static.ready.output_names
        for prefix in plant.prefixes:
            volume = outputs.index(f"{prefix}volume")
            growth = at.outputs_by_state[volume, free] / at.outputs[volume]
            held = [i for i, n in enumerate(static.names) if n in air and n.startswith(prefix)]
            matrix = matrix + np.outer(at.rates_by_state[np.ix_(free, held)] @ x[held], growth)
    found = np.linalg.eigvals(matrix)
    return bool(found.real.max() <= MARGIN * np.abs(found).max())
