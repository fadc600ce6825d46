"""Request of a sizing: a lift or a joint, and the conditions of operation."""

import contextlib
from collections.abc import Callable, Mapping

from ...core import UnitError, quantity
from ...design.sizing import (
    JointRequirement,
    LiftRequirement,
    SizingConditions,
    SizingResult,
    size_muscles,
)
from ...design.sizing.requirement_and_choice import SORT_KEYS, Requirement
from ...engine.processes import Workers
from ...files.library import load_law
from .declaration import RequestError, Where, many, option, optional, request

LIFT = ("load", "stroke", "stiffness")
JOINT = ("torque", "angle", "inertia")
"""Fields of either requirement; the first two are needed."""


def read_load(text: str, where: str) -> dict[str, float]:
    """Mass [kg] or force [N] of a load. Raises UnitError."""
    with contextlib.suppress(UnitError):
        return {"mass": quantity(text, "kg", where=where)}
    try:
        return {"force": quantity(text, "N", where=where)}
    except UnitError as error:
        raise UnitError(f"{error} A load is a mass or a force: '20 kg' or '200 N'.") from None


@request
class SizeRequest:
    """What a sizing is asked for."""

    supply: float = option(
        "Supply pressure: '6 bar' (gauge).",
        unit="Pa",
        label="Supply pressure",
        hint="gauge",
        filled="6 bar",
    )
    load: Mapping[str, float] | None = optional(
        "Lift: mass or force of the load, '20 kg' or '200 N'.",
        metavar="QUANTITY",
        read=read_load,
        label="Load",
        hint="mass or force",
        filled="20 kg",
    )
    stroke: float | None = optional(
        "Lift: stroke, such as '40 mm'.", unit="m", label="Stroke", filled="40 mm"
    )
    stiffness: float | None = optional(
        "Lift: stiffness of a spring, relaxed at the start: '2 N/mm'.",
        unit="N/m",
        label="Stiffness of a spring",
        hint="optional: 2 N/mm",
    )
    torque: float | None = optional(
        "Joint: torque in either direction, such as '5 N m'.",
        unit="N m",
        label="Torque in either direction",
        filled="5 N m",
    )
    angle: float | None = optional(
        "Joint: range of the angle, such as '60 deg'.",
        unit="rad",
        label="Range of the angle",
        filled="60 deg",
    )
    inertia: float | None = optional(
        "Joint: inertia, such as '0.05 kg m^2'.",
        unit="kg m^2",
        label="Moment of inertia",
        hint="optional: 0.05 kg m^2",
    )
    safety: float = option(
        "Factor on the load that is held.",
        unit="1",
        metavar="NUMBER",
        default="1.5",
        label="Safety factor",
        hint="on the load",
        filled="1.5",
    )
    cycle_time: float = option(
        "Time of a cycle, there and back.",
        unit="s",
        default="2 s",
        label="Cycle time",
        hint="there and back",
        filled="2 s",
    )
    max_length: float | None = optional(
        "Maximum nominal length.",
        unit="m",
        label="Maximum length",
        hint="optional",
        filled="400 mm",
    )
    max_diameter: float | None = optional(
        "Maximum outer diameter.", unit="m", label="Maximum diameter", hint="optional: 60 mm"
    )
    max_count: int = option(
        "Maximum number of muscles in parallel.",
        default=3,
        label="Maximum number in parallel",
        filled="3",
    )
    count: int | None = optional("Exact number of muscles in parallel.")
    muscle: tuple[str, ...] = many(
        "Muscle or file instead of the catalogue; repeatable.", metavar="NAME"
    )
    sort: str = option(
        f"Criterion of ranking: {', '.join(SORT_KEYS)}.",
        choices=SORT_KEYS,
        default="area",
        metavar="KEY",
        label="Rank by",
        offered=(
            ("area", "mounting area"),
            ("air", "air of a cycle"),
            ("length", "length"),
            ("count", "number of muscles"),
            ("reserve", "force reserve"),
            ("diameter", "diameter"),
        ),
    )

    def check(self, where: Where) -> None:
        """Raise RequestError unless a lift or a joint is given."""
        lift, joint = (
            [getattr(self, name) is not None for name in names] for names in (LIFT, JOINT)
        )
        if (
            any(lift) == any(joint)
            or (any(lift) and not all(lift[:2]))
            or (any(joint) and not all(joint[:2]))
        ):
            load, stroke, torque, angle = map(where, (*LIFT[:2], *JOINT[:2]))
            raise RequestError(
                f"give {load} and {stroke} for a lift, or {torque} and {angle} for a joint"
            )

    def evaluate(
        self, progress: Callable[[float], None] | None = None, workers: Workers = 1
    ) -> SizingResult:
        """The sizing, with at least one choice. Raises ParameterError, and SolveError with what is
        reachable.
        """
        requirement: Requirement
        if self.load is not None and self.stroke is not None:
            requirement = LiftRequirement(self.stroke, stiffness=self.stiffness or 0.0, **self.load)
        else:
            requirement = JointRequirement(
                self.angle or 0.0, self.torque or 0.0, self.inertia or 0.0
            )
        limits = {name: getattr(self, name) for name in ("max_length", "max_diameter")}
        limits = {name: limit for name, limit in limits.items() if limit is not None}
        low, high = (1, self.max_count) if self.count is None else (self.count, self.count)
        conditions = SizingConditions(
            self.supply, self.safety, self.cycle_time, min_count=low, max_count=high, **limits
        )
        entries = tuple(map(load_law, self.muscle)) or None
        sort = self.sort
        result = size_muscles(
            requirement,
            conditions,
            entries,
            sort,  # type: ignore[arg-type]
            progress,
            workers,
        )
        result.check_reachable()
        return result
