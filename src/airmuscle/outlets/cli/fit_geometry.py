"""Geometry of a muscle to be fitted: the braid of --braid."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import NamedTuple

import typer

from ...core import tree
from ...core.errors import ParameterError
from ...core.units import quantity
from ...files.library.entry import Entry
from ...files.library.initial_law import resting_lengths
from ...physics.muscle.geometry import Braid, Geometry
from ...recording import Recording

_UNITS = {"radius": "m", "angle": "rad"}


class BraidSize(NamedTuple):
    """Radius [m] and braid angle [rad] at rest."""

    radius: float
    angle: float


def parse_braid(text: str | None) -> BraidSize | None:
    """The braid that --braid describes; None without it. Raises BadParameter, UnitError or ParameterError."""
    if text is None:
        return None
    parts = [part.partition("=") for part in text.split(",")]
    names = [name.strip() for name, _, _ in parts]
    if sorted(names) != sorted(_UNITS):
        raise typer.BadParameter(
            f"--braid must give radius and angle once each, such as 'radius=10 mm, angle=24.4 deg', not '{text}'"
        )
    values = {
        name: quantity(value.strip(), _UNITS[name], where=f"--braid, {name}")
        for name, (_, _, value) in zip(names, parts, strict=True)
    }
    size = BraidSize(**values)
    braid_of_length(size, 1.0)  # the bounds are checked before any file is read
    return size


def with_braid(entry: Entry, size: BraidSize | None, recordings: Sequence[Recording]) -> Entry:
    """The entry of an initial law with the braid of --braid as its geometry; unchanged without it.

    Raises ParameterError for a law with a geometry of its own, and where the resting length is not known.
    """
    if size is None:
        return entry
    law = entry.characteristic
    if isinstance(getattr(law, "geometry", None), Geometry):
        raise ParameterError(
            f"--braid: {type(law).__name__} contains its geometry, which is also that of the muscle. Omit --braid, or "
            "give the geometry in [characteristic.geometry] of a muscle file, with --characteristic."
        )
    lengths = resting_lengths(recordings) or _lengths_of(law)
    check_one_length(lengths)
    return dataclasses.replace(entry, geometry=braid_of_length(size, lengths[0]))


def check_one_length(lengths: Sequence[float]) -> None:
    """Raise ParameterError unless there is exactly one resting length [m] for the braid of --braid."""
    if len(lengths) != 1:
        stated = ", ".join(f"{length:.4g} m" for length in lengths) or "none"
        raise ParameterError(
            f"--braid: a braid has exactly one resting length; the data state {stated}. Give --resting-length, or "
            "files of one muscle."
        )


def _lengths_of(law: object) -> tuple[float, ...]:
    """The resting lengths [m] inside a law."""
    return tuple({float(leaf.value) for leaf in tree.leaves(law) if leaf.declared.name == "resting_length"})


def braid_of_length(size: BraidSize, resting_length: float) -> Braid:
    try:
        return Braid(size.radius, size.angle, resting_length)
    except ParameterError as error:
        raise error.located("--braid") from None
