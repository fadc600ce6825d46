"""Where a run of a plant went beyond what the laws of its circuits describe."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from .circuit.ports import by_muscle, by_port
from .plant import Plant
from .variables import outside, within


def beyond_laws(plant: Plant, columns: Mapping[str, Any]) -> list[str]:
    """A note for every part of a circuit that a run, columns (N,) by name, led beyond its law."""
    found: dict[str, str] = {}
    shared = len(plant.circuits) < len(plant.muscles)
    for prefix, circuit in zip(plant.circuit_prefixes, plant.circuits, strict=True):
        own = by_port(plant.prefixes, columns) if shared else within(prefix, columns)
        doubts = circuit.doubts(own, plant.ambient)
        found |= by_muscle(plant.prefixes, doubts) if shared else outside(prefix, doubts)
    return [f"{name.removesuffix('.')}: {words}" for name, words in found.items()]
