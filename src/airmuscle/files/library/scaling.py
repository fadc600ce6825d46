"""Scaling of entries, laws and geometries to another resting length or, for McKibben muscles, to
another diameter.
"""

import dataclasses
from typing import Any, TypeVar, cast

from ... import physics
from ...core import ParameterError, leaves, quantity
from ...physics.muscle.geometry import Braid, Geometry
from ...physics.muscle.geometry.base import LENGTH_TOLERANCE
from .entry import OPTIONAL_PARTS, Entry, own_length, resting_lengths_in

T = TypeVar("T")
_BRAID_LAWS = ("ChouHannaford1996", "TonduLopez2000", "VirtualWork")
"""Laws of a braid without wall, whose force at a braid angle is proportional to the square of the
diameter.
"""
_STIFFNESSES = {
    "Reynolds2003": ("stiffness_offset", "stiffness_by_pressure"),
    "Serres2009": ("softening_offset", "softening", "stiffening_offset", "stiffening"),
}
"""Parameters in N/m of one specimen, by law: a spring of twice the length has half the
stiffness.
"""


def scale_entry(
    entry: Entry, *, resting_length: float | str | None = None, diameter: float | str | None = None
) -> Entry:
    """The entry of a muscle of the same type with another resting length [m], or another braid
    diameter at rest [m].

    A text has a unit, such as "200 mm". At equal pressure and contraction the force does not depend
    on the length, unless the law contains an effect of the length; it grows with the square of the
    diameter. The checks of the entry, which hold for its own size, are left out, as are the
    uncertainty of parameters that change, and with the diameter the ratings and the error band. The
    note states the scaling, which is not a measurement, and which optional parts of the muscle
    (spring, damper, friction, wall, creep) remain those of the original size. Raises ParameterError
    for an entry that cannot be scaled, or a length that the maker does not supply; UnitError.
    """
    if resting_length is None and diameter is None:
        return entry
    original = entry
    if not isinstance(entry, Entry):  # a valve or a product
        raise ParameterError(
            f"{getattr(entry, 'name', entry)!s:.80} has no law to scale; give a muscle or a law."
        )
    sizes = []
    for what, value, scaled in (
        ("diameter", diameter, _with_diameter),
        ("resting length", resting_length, _with_resting_length),
    ):
        if value is not None:
            where = f"{entry.name}, {what}"
            size = quantity(value, "m", where=where) if isinstance(value, str) else float(value)
            if not size > 0.0:
                raise ParameterError(f"{where} is {value}; it must be greater than zero.")
            entry = scaled(entry, size)
            sizes.append(f"a {what} of {1e3 * size:.4g} mm")
    parts = [part for part in OPTIONAL_PARTS if getattr(entry, part) is not None]
    texts = (
        entry.note,
        f"Scaled to {' and '.join(sizes)}; not measured at this size.",
        f"Not scaled, but as at the original size: {', '.join(parts)}." if parts else "",
    )
    old, new = (
        {f"characteristic.{leaf.path}": leaf.value for leaf in leaves(muscle_entry.characteristic)}
        for muscle_entry in (original, entry)
    )
    fitted = () if entry.uncertainty is None else entry.uncertainty.parameters
    uncertainty = (
        entry.uncertainty if all(old.get(name) == new.get(name) for name in fitted) else None
    )
    return dataclasses.replace(
        entry, checks=(), note=" ".join(filter(None, texts)), uncertainty=uncertainty
    )


def _with_resting_length(entry: Entry, length: float) -> Entry:
    if own_length(entry) is None:
        raise ParameterError(
            f"{entry.name} has no resting length: its force depends on pressure and contraction"
            " alone. Omit the resting length, or give the file of a muscle with a geometry."
        )
    excesses = entry.ratings.excesses(length=length) if entry.ratings is not None else ()
    if excesses:
        raise ParameterError(
            f"{entry.name}: {excesses[0]}. Choose a nominal length that the maker supplies."
        )
    return entry_at_length(entry, length, f"{entry.name}, resting length")


def entry_at_length(entry: Entry, length: float, where: str) -> Entry:
    """The entry with law and geometry at a resting length [m]. Raises ParameterError as
    `scale_to_length`.
    """
    law = scale_to_length(entry.characteristic, length, where)
    geometry = None if entry.geometry is None else scale_to_length(entry.geometry, length, where)
    return dataclasses.replace(entry, characteristic=law, geometry=geometry)


def _with_diameter(entry: Entry, diameter: float) -> Entry:
    law: Any = entry.characteristic
    geometry = entry.geometry
    if (
        type(law).__name__ not in _BRAID_LAWS
        or not isinstance(law.geometry, Braid)
        or not isinstance(geometry, Braid)
    ):
        names = ", ".join(_BRAID_LAWS)
        raise ParameterError(
            f"{entry.name}: {type(law).__name__} cannot be scaled to another diameter, because the"
            f" wall does not scale with the braid; only {names} with a Braid can. Give an entry of"
            " the wanted diameter."
        )
    scaled = dataclasses.replace(
        law, geometry=dataclasses.replace(law.geometry, radius=diameter / 2)
    )
    geometry = dataclasses.replace(geometry, radius=diameter / 2)
    return dataclasses.replace(
        entry, characteristic=scaled, geometry=geometry, ratings=None, error_band=None
    )


def scale_to_length(thing: T, resting_length: float, where: str) -> T:
    """The law or geometry of a muscle of the same type with this resting length [m].

    Radius and braid angle of a Braid do not change; a modulus that is a polynomial in the length
    keeps its values at the same contraction, and so does the force of a spring with a stiffness in
    N/m. What does not depend on the resting length is returned unchanged. Raises ParameterError,
    which begins with `where`, for a law or geometry that is not of this length and cannot be
    scaled.
    """
    if all(
        abs(length - resting_length) <= LENGTH_TOLERANCE
        for length in resting_lengths_in(thing).values()
    ):
        return thing
    scaled = _scale(thing, resting_length)
    for path, length in resting_lengths_in(scaled).items():
        if abs(length - resting_length) > LENGTH_TOLERANCE:
            raise ParameterError(
                f"{where}: {path} of {type(thing).__name__} is {length:.4g} m, but the resting"
                f" length of the data is {resting_length:.4g} m, and {type(thing).__name__} cannot"
                " be scaled to another length: only laws with a Braid, or with a resting length of"
                " their own, can. Give a muscle file with the geometry of the measured muscle, or"
                " correct the resting length."
            )
    return cast(T, scaled)


def _scale(thing: Any, resting_length: float) -> Any:
    if hasattr(thing, "with_resting_length"):
        return thing.with_resting_length(resting_length)
    has_length = "resting_length" in {field.name for field in dataclasses.fields(thing)}
    if isinstance(thing, Braid) or (has_length and not isinstance(thing, Geometry)):
        ratio = thing.resting_length / resting_length
        stiffnesses = {
            name: getattr(thing, name) * ratio
            for name in _STIFFNESSES.get(type(thing).__name__, ())
        }
        return dataclasses.replace(thing, resting_length=resting_length, **stiffnesses)
    geometry = getattr(thing, "geometry", None)
    if not isinstance(geometry, Braid):
        return thing
    changes: dict[str, Any] = {
        "geometry": dataclasses.replace(geometry, resting_length=resting_length)
    }
    if isinstance(thing, physics.MartensBoblan2017):
        ratio = geometry.resting_length / resting_length
        changes |= {f"c{power}": getattr(thing, f"c{power}") * ratio**power for power in range(4)}
    return dataclasses.replace(thing, **changes)
