"""Scaling of laws and geometries to another resting length, for initial laws of a fit."""

from __future__ import annotations

import dataclasses
from typing import Any, TypeVar

from ...core import tree
from ...core.errors import ParameterError
from ...physics.muscle.characteristic import MartensBoblan2017, Reynolds2003, Serres2009
from ...physics.muscle.geometry import Braid, Geometry
from ...physics.muscle.muscle import LENGTH_TOLERANCE

T = TypeVar("T")
_STIFFNESSES: dict[type[Any], tuple[str, ...]] = {
    Reynolds2003: ("stiffness_offset", "stiffness_by_pressure"),
    Serres2009: ("softening_offset", "softening", "stiffening_offset", "stiffening"),
}
"""Parameters in N/m of one specimen, by law: a spring of twice the length has half the stiffness."""


def scale_to_length(thing: T, resting_length: float, where: str) -> T:
    """The law or geometry of a muscle of the same type with this resting length [m].

    Radius and braid angle of a Braid do not change; a modulus that is a polynomial in the length keeps its values at
    the same contraction, and so does the force of a spring with a stiffness in N/m. What does not depend on the resting
    length is returned unchanged. Raises ParameterError, which begins with `where`, for a law or geometry that is not of
    this length and cannot be scaled.
    """
    different = _different_lengths(thing, resting_length)
    if not different:
        return thing
    scaled = _scale(thing, resting_length)
    remaining = _different_lengths(scaled, resting_length)
    if remaining:
        path, length = next(iter(remaining.items()))
        raise ParameterError(
            f"{where}: {path} of {type(thing).__name__} is {length:.4g} m, but the resting length of the data is "
            f"{resting_length:.4g} m, and {type(thing).__name__} cannot be scaled to another length: only laws with a "
            "Braid, or with a resting length of their own, can. Give a muscle file with the geometry of the measured "
            "muscle, or correct the resting length."
        )
    result: T = scaled
    return result


def _different_lengths(thing: Any, resting_length: float) -> dict[str, float]:
    """The resting lengths [m] in a model that differ from this one, by path."""
    return {
        leaf.path: float(leaf.value)
        for leaf in tree.leaves(thing)
        if leaf.declared.name == "resting_length" and abs(leaf.value - resting_length) > LENGTH_TOLERANCE
    }


def _scale(thing: Any, resting_length: float) -> Any:
    if hasattr(thing, "with_resting_length"):
        return thing.with_resting_length(resting_length)
    has_length = "resting_length" in {field.name for field in dataclasses.fields(thing)}
    if isinstance(thing, Braid) or (has_length and not isinstance(thing, Geometry)):
        ratio = thing.resting_length / resting_length
        stiffnesses = {name: getattr(thing, name) * ratio for name in _STIFFNESSES.get(type(thing), ())}
        return dataclasses.replace(thing, resting_length=resting_length, **stiffnesses)
    geometry = getattr(thing, "geometry", None)
    if not isinstance(geometry, Braid):
        return thing
    changes: dict[str, Any] = {"geometry": dataclasses.replace(geometry, resting_length=resting_length)}
    if isinstance(thing, MartensBoblan2017):
        ratio = geometry.resting_length / resting_length
        changes |= {f"c{power}": getattr(thing, f"c{power}") * ratio**power for power in range(4)}
    return dataclasses.replace(thing, **changes)
