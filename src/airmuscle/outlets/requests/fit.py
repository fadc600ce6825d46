"""Request of a static fit: a law fitted to measured points, or the comparison of all laws, with
what is asked of it.

The geometry of its muscle is a braid, as --braid or as two fields of a form.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

from ...bench.estimation import (
    BlockSplit,
    GroupSplit,
    Huber,
    LeastSquares,
    LevelSplit,
    Loss,
    RunSplit,
    SpecimenSplit,
)
from ...core import ParameterError, quantity, tree
from ...files.library import Entry, located_errors, resting_lengths
from ...physics.muscle.geometry import Braid, Geometry
from ...recording import Recording
from .declaration import RequestError, Where, check_rules, many, option, optional, request


@request
class BraidRequest:
    """The braid in two fields of a form, both or none."""

    braid_radius: float | None = optional(
        "Outer radius of the braid at rest.",
        unit="m",
        label="Radius of the braid, for the geometry of the muscle file",
        example="optional: 10 mm",
    )
    braid_angle: float | None = optional(
        "Angle between threads and axis at rest.",
        unit="rad",
        label="Angle of the braid to the axis at rest",
        example="optional: 24.4 deg",
    )

    def check(self, where: Where) -> None:
        """Raise RequestError for one field without the other, and for a braid that cannot be."""
        missing = [name for name in ("braid_radius", "braid_angle") if getattr(self, name) is None]
        if len(missing) == 1:
            raise RequestError("a braid needs its radius and its angle.", missing[0])
        try:
            _ = self.braid
        except ParameterError as error:
            field = "braid_angle" if "angle" in error.message else "braid_radius"
            raise RequestError(error.message, field) from None

    @property
    def braid(self) -> Braid | None:
        """The braid, of unit length; None if none is stated."""
        if self.braid_radius is None or self.braid_angle is None:
            return None
        return Braid(self.braid_radius, self.braid_angle, 1.0)


def read_braid(text: str, where: str) -> Braid:
    """The braid of unit length that a text describes. Raises RequestError, UnitError or
    ParameterError.
    """
    parts = [
        (name.strip(), value.strip())
        for name, _, value in (part.partition("=") for part in text.split(","))
    ]
    if sorted(name for name, _ in parts) != ["angle", "radius"]:
        raise RequestError(
            f"{where} must give radius and angle once each, such as 'radius=10 mm, angle=24.4 deg',"
            f" not '{text}'"
        )
    units = {"radius": "m", "angle": "rad"}
    size = {name: quantity(value, units[name], where=f"{where}, {name}") for name, value in parts}
    with located_errors("--braid"):  # the bounds are checked before any file is read
        return Braid(size["radius"], size["angle"], 1.0)


def with_braid(entry: Entry, braid: Braid | None, recordings: Sequence[Recording]) -> Entry:
    """The initial entry with the braid of --braid, if any, as its geometry. Raises ParameterError
    if it cannot.
    """
    if braid is None:
        return entry
    law = entry.characteristic
    if isinstance(getattr(law, "geometry", None), Geometry):
        raise ParameterError(
            f"--braid: {type(law).__name__} contains its geometry, which is also that of the"
            " muscle. Omit --braid, or give the geometry in [characteristic.geometry] of a muscle"
            " file, with --characteristic."
        )
    inside = {
        float(leaf.value) for leaf in tree.leaves(law) if leaf.declared.name == "resting_length"
    }
    length = check_one_length(resting_lengths(recordings) or tuple(inside))
    return dataclasses.replace(entry, geometry=braid_of_length(braid, length))


def check_one_length(lengths: Sequence[float], noun: str = "--braid: a braid") -> float:
    """The one resting length [m] of what the noun names. Raises ParameterError unless there is
    exactly one.
    """
    if problem := problem_of_lengths(lengths, noun):
        raise ParameterError(f"{problem} Give --resting-length, or files of one muscle.")
    return lengths[0]


def problem_of_lengths(lengths: Sequence[float], noun: str = "a braid") -> str:
    """What is wrong with the resting lengths [m] of the data of one braid; empty if there is
    exactly one.
    """
    stated = ", ".join(f"{1e3 * length:.4g} mm" for length in lengths) or "none"
    return (
        ""
        if len(lengths) == 1
        else f"{noun} has exactly one resting length; the data state {stated}."
    )


def braid_of_length(braid: Braid, resting_length: float) -> Braid:
    with located_errors("--braid"):
        return dataclasses.replace(braid, resting_length=resting_length)


# The fit

PURPOSES: Mapping[str, GroupSplit | None] = {
    "repeat": RunSplit(),
    "length": SpecimenSplit(),
    "both": None,
}
"""Purposes with the split that serves each: further runs of the measured muscles, other muscles, or
both.
"""
_SPLITS: Mapping[str, tuple[GroupSplit, str]] = {
    "run": (RunSplit(), "one run at a time"),
    "specimen": (SpecimenSplit(), "one specimen at a time"),
    "contraction": (LevelSplit("contraction"), "one level of contraction"),
    "pressure": (LevelSplit("pressure"), "one level of pressure"),
    "block": (BlockSplit(), "blocks within each run"),
}
SPLITS = {name: split for name, (split, _) in _SPLITS.items()}
"""Groups of rows that are left out in turn."""
WEAK = "weak"
"""Name in place of a parameter that stands for all weakly determined ones."""


def read_free_contraction(text: str, where: str) -> tuple[float, float]:
    """A point of zero force: pressure [Pa] and contraction [1]. Raises RequestError or
    UnitError.
    """
    pressure, sign, contraction = text.partition("=")
    if not sign:
        raise RequestError(
            f"{where} must be PRESSURE=CONTRACTION, such as '3 bar=18 %', not '{text}'"
        )
    value = quantity(contraction, "1", where=where)
    if not 0.0 <= value < 1.0:
        raise RequestError(f"{where}: a contraction must be from 0 to 100 %, not '{contraction}'")
    return quantity(pressure, "Pa", where=where), value


@request
class FitRequest:
    """What a static fit is asked for."""

    characteristic: str | None = optional(
        "Initial law: a library entry, a muscle file (TOML), or a model that needs no initial"
        " values, such as ContractileSurface.",
    )
    compare: bool = option(
        "Fit every characteristic that the data determine, and rank them.", default=False
    )
    leave_out: GroupSplit | None = optional(
        "Groups of rows for cross-validation (--compare) and resampling (--bootstrap): run,"
        " specimen, contraction, pressure, block.",
        choices=SPLITS,
        metavar="GROUP",
        label="Cross-validation leaves out",
        offered=(("", "automatic"), *((name, shown) for name, (_, shown) in _SPLITS.items())),
    )
    purpose: str | None = optional(
        "Use of the law that --compare recommends: repeat (further runs of the measured muscles),"
        " length (other muscles of the type), both (one law for both). Default: both, if three"
        " specimens or more were each measured in several runs.",
        choices=tuple(PURPOSES),
        metavar="PURPOSE",
    )
    bootstrap: int | None = optional(
        "Bootstrap with N refits to resampled groups of rows.", bounds=(20, 100_000)
    )
    profile: tuple[str, ...] = many(
        "Profile-likelihood interval of this parameter; 'weak': of all weakly determined ones."
        " Repeatable.",
        metavar="PARAMETER",
    )
    length_error: tuple[str, ...] = many(
        "Estimate the error of the recorded resting length of this specimen together with the law."
        " Repeatable.",
        metavar="SPECIMEN",
    )
    shape: bool = option(
        "Constrain a ContractileSurface: force must not decrease with pressure nor increase with"
        " contraction.",
        default=False,
    )
    free_contraction: tuple[Any, ...] = many(
        "With --shape: a point of zero force (free contraction), such as '3 bar=18 %'. Repeatable.",
        metavar="PRESSURE=CONTRACTION",
        read=read_free_contraction,
    )
    braid: Braid | None = optional(
        "Braid at rest, such as 'radius=10 mm, angle=24.4 deg' (outer radius; angle between threads"
        " and axis): the [geometry] of a muscle whose law contains none. Requires the resting"
        " length.",
        metavar="SIZE",
        read=read_braid,
    )
    degree: int = option("Total degree of a ContractileSurface.", default=5, bounds=(1, 9))
    fix: tuple[str, ...] = many(
        "Keep this parameter at its initial value; repeatable.", metavar="PARAMETER"
    )
    robust: str | None = optional(
        "Threshold of the Huber loss, such as '10 N' or '0.5 %'; default: squared. With --compare:"
        " a force.",
        metavar="QUANTITY",
    )
    uncensored: bool = option(
        "Fit rows at zero force as measured values, not as censored data.", default=False
    )
    accept_misfit: bool = option(
        "Write the muscle although the rms error of its law is more than ten times the scatter of"
        " the data; the file states the misfit.",
        default=False,
    )
    equal_weights: bool = option(
        "Equal weights; default: by the sensor resolution of each test rig.", default=False
    )

    def check(self, where: Where) -> None:
        """Raise RequestError for fields that do not fit together."""
        law = where("characteristic")
        compare = where("compare")
        shape = where("shape")
        check_rules(
            {
                f"give the characteristic to fit with {law}, or rank all with {compare}": (
                    self.characteristic is None and not self.compare
                ),
                f"{where('free_contraction')} requires {shape}": (
                    self.free_contraction and not self.shape
                ),
                f"{shape} is for a ContractileSurface, given with {law}; it excludes {compare}": (
                    self.shape and self.compare
                ),
                f"{where('purpose')} is for {compare}, and excludes {where('leave_out')}": (
                    self.purpose is not None and (not self.compare or self.leave_out is not None)
                ),
                f"{compare} ranks by errors of rows with positive force: {where('uncensored')} and {where('equal_weights')} do not apply": (  # noqa: E501
                    self.compare and (self.uncensored or self.equal_weights)
                ),
            }
        )

    @property
    def split(self) -> GroupSplit | None:
        """The groups of rows that are left out; None for both purposes."""
        return self.leave_out if self.purpose is None else PURPOSES[self.purpose]

    def loss(self, unit: str) -> Loss:
        """The loss, with its threshold in this SI unit. Raises UnitError."""
        return (
            LeastSquares()
            if self.robust is None
            else Huber(quantity(self.robust, unit, where="--robust"))
        )
