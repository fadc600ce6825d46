"""Geometry of a muscle to be fitted: its braid, as --braid or as two fields of a form."""

import dataclasses
from collections.abc import Sequence
from typing import NamedTuple

from ...core import ParameterError, quantity, tree
from ...files.library import Entry, resting_lengths
from ...physics.muscle.geometry import Braid, Geometry
from ...recording import Recording
from .declaration import RequestError, Where, option, request

_UNITS = {"radius": "m", "angle": "rad"}


class BraidSize(NamedTuple):
    """Radius [m] and braid angle [rad] at rest."""

    radius: float
    angle: float


@request
class BraidRequest:
    """The braid in two fields of a form, both or none."""

    braid_radius: float | None = option(
        "Outer radius of the braid at rest.",
        unit="m",
        default=None,
        label="Radius of the braid, for the geometry of the muscle file",
        example="optional: 10 mm",
    )
    braid_angle: float | None = option(
        "Angle between threads and axis at rest.",
        unit="rad",
        default=None,
        label="Angle of the braid to the axis at rest",
        example="optional: 24.4 deg",
    )

    def check(self, where: Where) -> None:
        """Raise RequestError for one field without the other, and for a braid that cannot be."""
        missing = [name for name in ("braid_radius", "braid_angle") if getattr(self, name) is None]
        if len(missing) == 1:
            raise RequestError("a braid needs its radius and its angle.", missing[0])
        try:
            if self.size is not None:
                Braid(*self.size, 1.0)
        except ParameterError as error:
            field = "braid_angle" if "angle" in error.message else "braid_radius"
            raise RequestError(error.message, field) from None

    @property
    def size(self) -> BraidSize | None:
        """The size of the braid; None if none is stated."""
        if self.braid_radius is None or self.braid_angle is None:
            return None
        return BraidSize(self.braid_radius, self.braid_angle)


def read_braid(text: str, where: str) -> BraidSize:
    """The braid that a text describes. Raises RequestError, UnitError or ParameterError."""
    parts = [part.partition("=") for part in text.split(",")]
    names = [name.strip() for name, _, _ in parts]
    if sorted(names) != sorted(_UNITS):
        raise RequestError(
            f"{where} must give radius and angle once each, such as 'radius=10 mm, angle=24.4 deg', not '{text}'"
        )
    values = {
        name: quantity(value.strip(), _UNITS[name], where=f"{where}, {name}")
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
    problem = problem_of_lengths(lengths)
    if problem:
        raise ParameterError(f"--braid: {problem} Give --resting-length, or files of one muscle.")


def problem_of_lengths(lengths: Sequence[float]) -> str:
    """What is wrong with the resting lengths [m] of the data of one braid; empty if there is exactly one."""
    stated = ", ".join(f"{1e3 * length:.4g} mm" for length in lengths) or "none"
    return "" if len(lengths) == 1 else f"a braid has exactly one resting length; the data state {stated}."


def _lengths_of(law: object) -> tuple[float, ...]:
    """The resting lengths [m] inside a law."""
    return tuple({float(leaf.value) for leaf in tree.leaves(law) if leaf.declared.name == "resting_length"})


def braid_of_length(size: BraidSize, resting_length: float) -> Braid:
    try:
        return Braid(size.radius, size.angle, resting_length)
    except ParameterError as error:
        raise error.located("--braid") from None
