"""Scaling of library entries to another resting length or, for McKibben muscles, to another diameter."""

from __future__ import annotations

import dataclasses

from ...core import leaves
from ...core.errors import ParameterError
from ...core.units import quantity
from ...physics.muscle.characteristic import ChouHannaford1996, TonduLopez2000, VirtualWork
from ...physics.muscle.geometry import Braid
from .entry import OPTIONAL_PARTS, Entry
from .length_scaling import scale_to_length

_BRAID_LAWS = (ChouHannaford1996, TonduLopez2000, VirtualWork)
"""Laws of a braid without wall, whose force at a braid angle is proportional to the square of the diameter."""


def scale_entry(
    entry: Entry, *, resting_length: float | str | None = None, diameter: float | str | None = None
) -> Entry:
    """The entry of a muscle of the same type with another resting length [m], or another braid diameter at rest [m].

    A text has a unit, such as "200 mm". At equal pressure and contraction the force does not depend on the length,
    unless the law contains an effect of the length; it grows with the square of the diameter. The checks of the entry,
    which hold for its own size, are left out, as are the uncertainty of parameters that change, and with the diameter
    the ratings and the error band. The note states the scaling, which is not a measurement, and which optional parts
    of the muscle (spring, damper, friction, wall, creep) remain those of the original size. Raises ParameterError for
    an entry that cannot be scaled, or a length that the maker does not supply; UnitError.
    """
    if resting_length is None and diameter is None:
        return entry
    original = entry
    if not isinstance(entry, Entry):  # a valve or a product
        raise ParameterError(f"{getattr(entry, 'name', entry)!s:.80} has no law to scale; give a muscle or a law.")
    sizes = []
    if diameter is not None:
        size = _positive(diameter, f"{entry.name}, diameter")
        entry = _with_diameter(entry, size)
        sizes.append(f"a diameter of {1e3 * size:.4g} mm")
    if resting_length is not None:
        size = _positive(resting_length, f"{entry.name}, resting length")
        entry = _with_resting_length(entry, size)
        sizes.append(f"a resting length of {1e3 * size:.4g} mm")
    parts = [part for part in OPTIONAL_PARTS if getattr(entry, part) is not None]
    texts = (
        entry.note,
        f"Scaled to {' and '.join(sizes)}; not measured at this size.",
        f"Not scaled, but as at the original size: {', '.join(parts)}." if parts else "",
    )
    changed = _fitted_values(entry) != _fitted_values(original)
    return dataclasses.replace(
        entry, checks=(), note=" ".join(filter(None, texts)), uncertainty=None if changed else entry.uncertainty
    )


def _fitted_values(entry: Entry) -> list[float]:
    """The values of the parameters of which the uncertainty is stated."""
    names = () if entry.uncertainty is None else entry.uncertainty.parameters
    values = {f"characteristic.{leaf.path}": leaf.value for leaf in leaves(entry.characteristic)}
    return [values[name] for name in names if name in values]


def _positive(value: float | str, where: str) -> float:
    size = quantity(value, "m", where=where) if isinstance(value, str) else float(value)
    if not size > 0.0:
        raise ParameterError(f"{where} is {value}; it must be greater than zero.")
    return size


def _with_resting_length(entry: Entry, length: float) -> Entry:
    lengths = [leaf for part in (entry.characteristic, entry.geometry) if part is not None for leaf in leaves(part)
               if leaf.declared.name == "resting_length"]  # fmt: skip
    if not lengths:
        raise ParameterError(
            f"{entry.name} has no resting length: its force depends on pressure and contraction alone. Omit the "
            "resting length, or give the file of a muscle with a geometry."
        )
    excesses = entry.ratings.excesses(length=length) if entry.ratings is not None else ()
    if excesses:
        raise ParameterError(f"{entry.name}: {excesses[0]}. Choose a nominal length that the maker supplies.")
    where = f"{entry.name}, resting length"
    return dataclasses.replace(
        entry,
        characteristic=scale_to_length(entry.characteristic, length, where),
        geometry=None if entry.geometry is None else scale_to_length(entry.geometry, length, where),
    )


def _with_diameter(entry: Entry, diameter: float) -> Entry:
    law, geometry = entry.characteristic, entry.geometry
    if not isinstance(law, _BRAID_LAWS) or not isinstance(law.geometry, Braid) or not isinstance(geometry, Braid):
        names = ", ".join(cls.__name__ for cls in _BRAID_LAWS)
        raise ParameterError(
            f"{entry.name}: {type(law).__name__} cannot be scaled to another diameter, because the wall does not scale "
            f"with the braid; only {names} with a Braid can. Give an entry of the wanted diameter."
        )
    radius = diameter / 2
    scaled = dataclasses.replace(law, geometry=dataclasses.replace(law.geometry, radius=radius))
    return dataclasses.replace(
        entry,
        characteristic=scaled,
        geometry=dataclasses.replace(geometry, radius=radius),
        ratings=None,
        error_band=None,
    )
