"""Request of a sizing: a lift, a joint or a gripper, and the conditions of operation."""

import contextlib
from collections.abc import Callable, Mapping

from ...core import UnitError, quantity
from ...design.sizing import (
    GripperRequirement,
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

KINDS = {
    "lift": ("load", "stroke", "stiffness"),
    "joint": ("torque", "angle", "inertia"),
    "gripper": ("grip", "opening", "fingers"),
}
"""Fields of each kind of requirement; the first two are needed."""


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
    grip: float | None = optional(
        "Gripper: grip force of each finger, such as '50 N'.",
        unit="N",
        label="Grip force of each finger",
        filled="50 N",
    )
    opening: float | None = optional(
        "Gripper: travel of each finger, such as '20 mm'.",
        unit="m",
        label="Travel of each finger",
        filled="20 mm",
    )
    fingers: int | None = optional(
        "Gripper: number of fingers; 2 by default.",
        label="Number of fingers",
        hint="optional: 2",
        bounds=(1, 20),
    )
    lever: float | None = optional(
        "Lift or gripper: lever ratio, motion of the load or finger over that of the muscles.",
        unit="1",
        metavar="RATIO",
        label="Lever ratio",
        hint="optional: motion of the load over that of the muscles",
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
        """Raise RequestError unless one kind of requirement is given."""
        stated = {
            kind: [name for name in names if getattr(self, name) is not None]
            for kind, names in KINDS.items()
        }
        kinds = [kind for kind, names in stated.items() if names]
        complete = [kind for kind in kinds if set(KINDS[kind][:2]) <= set(stated[kind])]
        if len(kinds) != 1 or not complete:
            alternatives = ", or ".join(
                f"{where(names[0])} and {where(names[1])} for a {kind}"
                for kind, names in KINDS.items()
            )
            raise RequestError(f"give {alternatives}")
        if kinds == ["joint"] and self.lever is not None:
            raise RequestError(
                f"{where('lever')} is of a lift or a gripper; the pulley of a joint is a result"
            )

    def _requirement(self) -> Requirement:
        if self.load is not None and self.stroke is not None:
            return LiftRequirement(
                self.stroke,
                stiffness=self.stiffness or 0.0,
                lever=self.lever or 1.0,
                **self.load,
            )
        if self.grip is not None and self.opening is not None:
            return GripperRequirement(
                self.opening, self.grip, float(self.fingers or 2), self.lever or 1.0
            )
        return JointRequirement(self.angle or 0.0, self.torque or 0.0, self.inertia or 0.0)

    def evaluate(
        self, progress: Callable[[float], None] | None = None, workers: Workers = 1
    ) -> SizingResult:
        """The sizing, with at least one choice. Raises ParameterError, and SolveError with what is
        reachable.
        """
        requirement = self._requirement()
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
