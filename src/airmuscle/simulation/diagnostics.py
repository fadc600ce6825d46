"""Where a run of a plant cannot be, or went beyond what the laws of its parts describe."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.arrays import Array
from ..core.variables import select_prefix, with_prefix
from ..plant.plant import Plant
from ..plant.state import has_negative_mass
from ..pneumatics.ports import key_by_muscle, key_by_port
from .integrators import LESS_THAN_NONE, NO_VOLUME, NOT_FINITE, RawSolution

if TYPE_CHECKING:
    from ..compile.program import CompiledSystem

NEAR = 1e-3
"""Part of a geometry's reach by which a muscle that a run ended on may still lie within it (chosen)."""


def truncate_at_invalid_row(ready: CompiledSystem, course: RawSolution, results: Array, times: Array) -> RawSolution:
    """The course up to the first row that cannot be, by its outputs (N, K): numbers may go on where nothing does.

    A fixed step can end in numbers, and yet far off; isothermal air has a pressure, below vacuum, in a volume below 0.
    """
    names = ready.output_names if isinstance(ready.system, Plant) else ()
    volumes = [i for i, name in enumerate(names) if name.rpartition(".")[2] == "volume"]
    reasons: dict[int, Any] = {
        NOT_FINITE: ~np.isfinite(results).all(axis=1),
        LESS_THAN_NONE: has_negative_mass(ready.system, course.rows[: course.reached]).any(axis=1),
        NO_VOLUME: (results[:, volumes] <= 0.0).any(axis=1),
    }
    bad = np.flatnonzero(np.any(list(reasons.values()), axis=0))
    if not bad.size:
        return course
    row = int(bad[0])
    status = next(status for status, rows in reasons.items() if rows[row])
    return course._replace(reached=row, time=float(times[row]), state=course.rows[row], status=status)


def geometry_limit_hint(plant: Plant, values: Array) -> str | None:
    """What to do about the muscle that stands at the end of what its geometry can take in a state (n,), if one does."""
    state = {s.name: v for s, v in zip(plant.states, values.tolist(), strict=True)}
    contractions = plant.mechanism.contractions(state, plant.resting_lengths)
    for prefix, muscle, contraction in zip(plant.prefixes, plant.muscles, contractions, strict=True):
        inner = float(muscle.inner_contraction(contraction, select_prefix(prefix, state)))
        low, high = muscle.geometry.contraction_range
        if inner <= low + NEAR * (high - low) or inner >= high - NEAR * (high - low):
            return (
                f"{muscle.name} had come to a contraction of {inner:.2%}, where its geometry ends (it reaches from "
                f"{low:.2%} to {high:.2%}). Keep the load from moving it so far: put Stopped around the mechanism, or "
                "choose more pressure or less load."
            )
    return None


def validity_warnings(plant: Plant, columns: Mapping[str, Any]) -> list[str]:
    """A note for every part of a circuit that a run, columns (N,) by name, led beyond its law."""
    found: dict[str, str] = {}
    shared = len(plant.circuits) < len(plant.muscles)
    for prefix, circuit in zip(plant.circuit_prefixes, plant.circuits, strict=True):
        own = key_by_port(plant.prefixes, columns) if shared else select_prefix(prefix, columns)
        doubts = circuit.validity_warnings(own, plant.ambient)
        found |= key_by_muscle(plant.prefixes, doubts) if shared else with_prefix(prefix, doubts)
    return [f"{name.removesuffix('.')}: {words}" for name, words in found.items()]
