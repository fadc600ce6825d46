"""Study of a body: what its routes ask of muscles, and their faults."""

import contextlib
import dataclasses
import functools
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from ...bench.reported import Reported
from ...core import ParameterError, check_known, counted, listed
from ...report.chapter import Chapter, NamedValue, Plot
from ..sizing import SizingConditions, StaticMuscle, catalogue, working_muscle
from .body import Body, check_limits
from .clearance import Clearance, clearances
from .demand import TensionBalance, balance, gravity_demand, motion_demand, table_demand
from .faults import CatalogueLimits, RouteFault, find_faults
from .kinematics import Poses
from .picture import body_figure
from .poses import read_poses
from .signs import OPPOSITES
from .study_tables import (
    arm_table,
    arms_figure,
    fault_table,
    joint_table,
    route_table,
    stroke_figure,
)
from .sweep import RouteSweep, sweep_routes

MOST_SENTENCES = 15
"""Greatest number of faults that are sentences; the others are in the table alone (chosen)."""
SUPPLY = 6e5
"""Gauge pressure [Pa] at which the muscles of the catalogue are compared (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class BodyStudy(Reported):
    """What the routes of a body ask of muscles.

    sweeps      lengths and moment arms of each route
    clearances  least distance of each route from the geoms of the body; None where none can collide
    balances    tensions for each demand, gravity first
    limits      what the muscles of the catalogue can do
    faults      of the routes, in words with numbers
    """

    body: Body
    sweeps: tuple[RouteSweep, ...]
    clearances: tuple[Clearance | None, ...]
    balances: tuple[TensionBalance, ...]
    limits: CatalogueLimits
    faults: tuple[RouteFault, ...]

    def sweep(self, route: str) -> RouteSweep:
        """The sweep of a route by its name. Raises ParameterError."""
        self.body.route(route)
        return next(sweep for sweep in self.sweeps if sweep.route.name == route)

    def faults_of(self, kind: str) -> tuple[RouteFault, ...]:
        """The faults of a kind, such as "stroke" or "wrong sign"."""
        return tuple(fault for fault in self.faults if fault.kind == kind)

    def chapter(self) -> Chapter:
        """The description of the study."""
        body = self.body
        shares = [
            0.0 if sweep.stroke_share is None else sweep.stroke_share / self.limits.contraction
            for sweep in self.sweeps
        ]
        picture = functools.partial(
            body_figure, body, shares, "stroke over what a muscle of the greatest length contracts"
        )
        caption = "The body in the middle of its ranges, with its routes."
        tables = (
            *fault_table(self.faults),
            route_table(body, self.sweeps, self.clearances, self.balances[0]),
            arm_table(body, self.sweeps),
            joint_table(body, self.balances),
        )
        return Chapter(
            "body",
            f"Routes of {body.name}",
            self._summary(),
            values=(
                NamedValue("number of routes", len(body.routes)),
                NamedValue("number of joints", len(body.moving)),
                NamedValue("number of faults", len(self.faults)),
            ),
            tables=tables,
            plots=(
                Plot("body", caption, picture),
                Plot(
                    "strokes",
                    "Stroke of each route over its greatest length, and the greatest contraction of"
                    f" the catalogue, {100 * self.limits.contraction:.4g} %.",
                    functools.partial(stroke_figure, self.sweeps, self.limits.contraction),
                ),
                Plot(
                    "moment_arms",
                    "Moment arms of a pull over the joint that each route moves most; a band where"
                    " other joints change them.",
                    functools.partial(arms_figure, body, self.sweeps),
                ),
            ),
            problems=self._problems(),
            notes=self._notes(),
        )

    def _summary(self) -> tuple[str, ...]:
        body = self.body
        routes = counted(len(body.routes), "route")
        joints = counted(len(body.moving), "joint")
        if not self.faults:
            text = f"The {routes} over {joints} have no fault that the study knows."
        else:
            kinds = list(dict.fromkeys(fault.kind for fault in self.faults))
            parts = []
            for kind in kinds:
                names = dict.fromkeys(fault.name for fault in self.faults_of(kind))
                parts.append(f"{kind} ({listed(names)})")
            text = f"Of the {routes} over {joints}, these have faults: {'; '.join(parts)}."
        convention = (
            "A moment arm is that of a pull, -dL/dq: positive if the route pulls the joint towards"
            " greater positions. The force of a MuJoCo actuator that pulls is negative, and its"
            " moment dL/dq has the opposite sign: a program that applies +F dL/dq lets muscles"
            " push."
        )
        return text, convention

    def _problems(self) -> tuple[str, ...]:
        """The faults in words; the first ones, if they are many."""
        texts = [fault.text for fault in self.faults]
        if len(texts) > MOST_SENTENCES:
            rest = len(texts) - MOST_SENTENCES
            texts = [*texts[:MOST_SENTENCES], f"And {rest} more, in the table of faults."]
        return tuple(texts)

    def _notes(self) -> tuple[str, ...]:
        notes = list(self.body.remarks)
        for sweep in self.sweeps:
            stated = sweep.route.stated_range
            if stated is None or not sweep.route.is_path:
                continue
            low, high = stated
            if (
                low <= 0.0
                or low > sweep.shortest.length + 1e-3
                or high < sweep.longest.length - 1e-3
            ):
                notes.append(
                    f"{sweep.route.name}: its actuator states lengths of {1e3 * low:.4g} to"
                    f" {1e3 * high:.4g} mm; the sweep gives {1e3 * sweep.shortest.length:.4g} to"
                    f" {1e3 * sweep.longest.length:.4g} mm."
                )
        if all(clearance is None for clearance in self.clearances):
            notes.append(
                "No geom of the body can collide (contype, conaffinity), so that contact of the"
                " routes with the body is not measured."
            )
        notes.append(
            "Torques of gravity: at rest in the air, the base held, without contact with the"
            " ground."
        )
        return tuple(notes)


def study_body(
    body: Body,
    *,
    poses: Path | str | None = None,
    motion: Path | str | None = None,
    torques: Path | str | None = None,
    positive: Mapping[str, str] = MappingProxyType({}),
    max_contraction: float | None = None,
    progress: Callable[[float], None] = lambda fraction: None,
) -> BodyStudy:
    """What the routes of a body ask of muscles.

    poses            CSV file of the poses that the body reaches, in place of the ranges of its
                     joints
    motion           CSV file of a motion whose torques are demanded
    torques          CSV file of torques over angles that are demanded
    positive         function of the positive direction of joints by name, {"knee": "extension"}
    max_contraction  greatest contraction of a muscle [1]; by default that of the catalogue
    progress         called with the fraction done

    Raises ParameterError for joints of routes without a range, FileError for a closed loop without
    poses.
    """
    check_known(f"{body.file.path}: there is no joint", positive, body.joints)
    check_known("positive: there is no direction", positive.values(), OPPOSITES)
    stated: Poses | None = None
    if poses is None:
        check_limits(body)
    else:
        stated = read_poses(Path(poses), body).poses
    sweeps = sweep_routes(body, stated, lambda fraction: progress(0.6 * fraction))
    demands = [gravity_demand(body, stated)]
    if motion is not None:
        demands.append(motion_demand(body, Path(motion)))
    if torques is not None:
        demands.append(table_demand(body, Path(torques)))
    balances = []
    for number, demand in enumerate(demands):
        balances.append(balance(body, demand))
        progress(0.6 + 0.2 * (number + 1) / len(demands))
    distances = clearances(body, sweeps)
    progress(1.0)
    limits = catalogue_limits(max_contraction)
    faults = find_faults(body, sweeps, distances, balances, limits, positive)
    return BodyStudy(body, sweeps, tuple(distances), tuple(balances), limits, faults)


def catalogue_limits(max_contraction: float | None = None) -> CatalogueLimits:
    """The greatest contraction and permitted force of the muscles of the catalogue. Raises
    ParameterError for a contraction that no muscle has.
    """
    if max_contraction is not None and not 0.0 < max_contraction < 1.0:
        raise ParameterError(
            f"max_contraction is {max_contraction:.4g}; allowed range: above 0 to below 1."
        )
    muscles = usable_muscles()
    contraction = max(muscle.contraction_range[1] for muscle in muscles)
    contracting = _names_of(
        [muscle for muscle in muscles if muscle.contraction_range[1] == contraction]
    )
    if max_contraction is not None:
        contraction = max_contraction
        contracting = "the stated muscle"
    force = max(muscle.max_force for muscle in muscles)
    pulling = _names_of([muscle for muscle in muscles if muscle.max_force == force])
    return CatalogueLimits(contraction, contracting, force, pulling)


@functools.cache
def usable_muscles() -> tuple[StaticMuscle, ...]:
    """The muscles of the catalogue whose law has a validity range."""
    muscles = []
    for entry in catalogue():
        with contextlib.suppress(ParameterError):
            muscles.append(working_muscle(entry, SizingConditions(SUPPLY)))
    return tuple(muscles)


def _names_of(muscles: Sequence[StaticMuscle]) -> str:
    """The muscles in words."""
    if len(muscles) == 1:
        return muscles[0].entry.name
    return "the best muscle of the catalogue"
