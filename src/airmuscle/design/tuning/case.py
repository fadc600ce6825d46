"""Cases of a tuning: loops with gains, and the ranges of the gains."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...core import (
    Array,
    ShortRepr,
    abridged,
    check_field_types,
    leaves,
    structure,
    with_parameters,
)
from ...core.errors import ParameterError, PhysicsError, check_known
from ...engine.loop import Controller, ControlLoop
from ...physics.equilibrium import nearest_equilibrium
from ...physics.plant.plant import Plant

DIGITS = 5
"""Significant digits of a gain, so that a file contains exactly the gains that were simulated
(chosen).
"""


@dataclasses.dataclass(frozen=True)
class GainRange:
    """The range of one gain [SI]: logarithmic where both bounds have the same sign, otherwise
    linear.
    """

    path: str
    low: float
    high: float

    @property
    def logarithmic(self) -> bool:
        """Whether the optimiser varies the logarithm of the gain: neither bound is 0 and their
        signs are equal.
        """
        return self.low * self.high > 0

    def to_unit(self, values: Array) -> Array:
        """Gains (E,) as coordinates within 0 and 1."""
        if not self.logarithmic:
            return (values - self.low) / (self.high - self.low)
        return np.asarray(np.log(values / self.low) / math.log(self.high / self.low))

    def from_unit(self, coordinates: Array) -> Array:
        """Coordinates (E,) within 0 and 1 as gains [SI] with five significant digits."""
        if self.logarithmic:
            inside = self.low * (self.high / self.low) ** coordinates
        else:
            inside = self.low + (self.high - self.low) * coordinates
        rounded = [float(f"{value:.{DIGITS - 1}e}") for value in np.ravel(inside).tolist()]
        # a bound itself may have more digits
        limited = np.clip(rounded, self.low, self.high)
        return np.asarray(limited.reshape(np.shape(inside)))


def gain_ranges(controller: Controller, bounds: Any) -> tuple[GainRange, ...]:
    """The ranges of the tuned gains from bounds [SI] by path.

    Raises ParameterError for an unknown path, for bounds that are not a pair, not finite, not in
    order or outside the declared range of the parameter.
    """
    if not isinstance(bounds, Mapping) or not bounds:
        what = "empty" if isinstance(bounds, Mapping) else abridged(bounds)
        raise ParameterError(
            f'bounds: they are {what}; give a range for each gain, {{"gain": (0.1, 10.0)}}.'
        )
    known = {leaf.path: leaf for leaf in leaves(controller)}
    check_known(f"bounds: {type(controller).__name__} has no parameter", bounds, known)
    ranges = []
    for path, pair in bounds.items():
        declared = known[path].declared
        where = f"bounds: '{path}' ({declared.symbol}, {declared.meaning})"
        smallest, greatest = declared.bounds
        try:
            low, high = (float(bound) for bound in pair)
        except (TypeError, ValueError):
            raise ParameterError(
                f"{where} is {abridged(pair)}; give two numbers, (minimum, maximum), in SI units."
            ) from None
        if not (math.isfinite(low) and math.isfinite(high) and low < high):
            raise ParameterError(
                f"{where} is {low:g} to {high:g}; the minimum must be below the maximum, both"
                " finite."
            )
        if low < smallest or high > greatest:
            raise ParameterError(
                f"{where} is {low:g} to {high:g}; allowed range: {smallest:g} to {greatest:g}."
            )
        ranges.append(GainRange(path, low, high))
    return tuple(ranges)


def to_gains(ranges: Sequence[GainRange], coordinates: Array) -> Array:
    """Coordinates (E, D) within 0 and 1 as gains (E, D) [SI]."""
    return np.column_stack(
        [gain_range.from_unit(coordinates[:, i]) for i, gain_range in enumerate(ranges)]
    )


def to_coordinates(ranges: Sequence[GainRange], gains: Mapping[str, float]) -> Array | None:
    """The coordinates (D,) of a set of gains; None where one of them is outside its range."""
    values = [gains[gain_range.path] for gain_range in ranges]
    if not all(
        gain_range.low <= value <= gain_range.high
        for gain_range, value in zip(ranges, values, strict=True)
    ):
        return None
    return np.array(
        [
            float(gain_range.to_unit(np.array(v)))
            for gain_range, v in zip(ranges, values, strict=True)
        ]
    )


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class LoopCase(ShortRepr):
    """A plant with its control loop and initial state, one of the family for which gains are tuned.

    name             for tables and messages: "nominal", "load x 2"
    plant, loop      any plant, and the loop that closes it
    initial_state    a value for each state [SI]; the equilibrium at ambient pressure unless given
    controller_path  place of the tuned controller within `loop.controller`, such as `law` for a
                     WithSensors around it; empty if it is the controller itself

    Cases with the same loop object and plants of one structure are simulated in one batch.
    """

    name: str
    plant: Plant
    loop: ControlLoop
    initial_state: Mapping[str, float] | None = None
    controller_path: str = ""

    def __post_init__(self) -> None:
        check_field_types(self)

    @property
    def controller(self) -> Controller:
        """The tuned controller. Raises ParameterError where `controller_path` leads to none."""
        part: Any = self.loop.controller
        for name in self.controller_path.split(".") if self.controller_path else ():
            part = getattr(part, name, None)
        if not isinstance(part, Controller):
            raise ParameterError(
                f"case '{self.name}': the controller {type(self.loop.controller).__name__} has no"
                f" controller at '{self.controller_path}'; give the field that contains the tuned"
                " one, such as law."
            )
        return part

    def full_path(self, path: str) -> str:
        """The path of a parameter of the tuned controller within `loop.controller`."""
        return f"{self.controller_path}.{path}" if self.controller_path else path

    def start(self) -> dict[str, float]:
        """The initial state [SI]. Raises PhysicsError where the plant has no equilibrium."""
        if self.initial_state is not None:
            return dict(self.initial_state)
        try:
            return nearest_equilibrium(self.plant, pressure=0.0)
        except PhysicsError as error:
            raise error.located(f"case '{self.name}'") from None


def check_cases(cases: Sequence[LoopCase]) -> tuple[LoopCase, ...]:
    """The cases as a tuple. Raises ParameterError if there are none, or their tuned controllers
    differ.
    """
    family = tuple(cases) if isinstance(cases, Sequence) else (cases,)
    wrong = [case for case in family if not isinstance(case, LoopCase)]
    if wrong or not family:
        what = f"contain {abridged(wrong[0])}" if wrong else "are empty"
        raise ParameterError(f"tune: the cases {what}; give a list of LoopCase.")
    check_names("tune", "case", [case.name for case in family])
    first = family[0].controller
    for case in family[1:]:
        if structure(case.controller) is not structure(first):
            raise ParameterError(
                f"case '{case.name}': its controller is {type(case.controller).__name__}, which is"
                f" not that of case '{family[0].name}', {type(first).__name__}; all cases need the"
                " same controller. If it is enclosed by another law, state controller_path."
            )
    return family


def check_names(where: str, kind: str, names: Sequence[str]) -> None:
    """Raise ParameterError, which begins with `where`, for no name, and for a name that two things
    have.
    """
    if not names:
        raise ParameterError(f"{where}: there is no {kind}; give at least one.")
    if twice := [name for name in names if names.count(name) > 1]:
        raise ParameterError(
            f"{where}: two {kind}s are named '{twice[0]}'; give each its own name."
        )


def with_gains(controller: Any, gains: Mapping[str, float]) -> Any:
    """A controller with other values of some parameters, validated like a new one. Raises
    ParameterError.
    """
    present = {leaf.path: leaf.value for leaf in leaves(controller)}
    check_known(f"{type(controller).__name__} has no parameter", gains, present)
    return with_parameters(controller, list({**present, **gains}.values()))


def loop_with_gains(case: LoopCase, gains: Mapping[str, float]) -> ControlLoop:
    """The loop of a case with other gains of the tuned controller, validated. Raises
    ParameterError.
    """
    within = {case.full_path(path): value for path, value in gains.items()}
    return dataclasses.replace(case.loop, controller=with_gains(case.loop.controller, within))
