"""Result of moved routes: places, muscles, torques before and after, and the front of deficit and
number of muscles.
"""

import dataclasses
import functools
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ...bench.reported import Reported
from ...core import Array, ShortRepr, plotting
from ...report.chapter import Chapter, NamedValue, Plot, Table, TableColumn
from ..sizing import SizingConditions
from .body import Body
from .clearance import Clearance
from .faults import INSIDE
from .moves import PointMove
from .picture import body_figure
from .route_muscle import RouteMuscle
from .torque_curve import TorqueRows

AT_BOUND = 1e-6
"""Distance [m] from a bound within which a point is at it."""
MET = 1e-3
"""Deficit up to which a curve is met, of its greatest torque (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class TorqueAnswer(ShortRepr):
    """Torques of a route with its points at some places.

    sites     positions of the points that move [m] (3,), by name
    choice    muscles of the route
    pressure  gauge pressure [Pa]
    arm       moment arms of a pull [m or 1] at the rows of the curves (N,)
    torque    torques [N m or N] (N,)
    deficit   greatest missing part of a torque, of the greatest one of its configuration
    contact   least distance from a geom of the body; None where none comes near
    """

    sites: Mapping[str, Array]
    choice: RouteMuscle
    pressure: float
    arm: Array
    torque: Array
    deficit: float
    contact: Clearance | None


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class MovedRoute(ShortRepr):
    """A route with moved points.

    rows      the torques that are demanded, with the factor
    muscle    name of the library entry
    count     number side by side
    tackle    motion of the route over that of the muscle
    after     torques at the new places
    before    torques at the present places of the same muscles, their length and pressure chosen as
              well; None where they have no room or stroke there
    deficits  deficit for each number of muscles
    """

    rows: TorqueRows
    muscle: str
    count: int
    tackle: int
    after: TorqueAnswer
    before: TorqueAnswer | None
    deficits: Mapping[int, float]

    @property
    def name(self) -> str:
        """Name of the route."""
        return self.rows.route

    @property
    def sites(self) -> Iterator[tuple[str, Array]]:
        """Names and new positions [m] of the points that move."""
        return iter(self.after.sites.items())


class FrontPoint(NamedTuple):
    """A point of the front: number of all muscles, and the greatest deficit that it leaves."""

    number: int
    deficit: float


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class MovedRoutes(Reported):
    """Routes whose points have been moved to meet curves of torque.

    body        the body as it was
    moved       the body with the new places
    conditions  supply, numbers and lengths of the muscles
    factor      on the torques
    moves       the points that may be moved, with their bounds
    routes      of the curves
    front       least number of all muscles for each greatest deficit
    refused     muscles that have no working range, with the reason
    """

    body: Body
    moved: Body
    conditions: SizingConditions
    factor: float
    moves: tuple[PointMove, ...]
    routes: tuple[MovedRoute, ...]
    front: tuple[FrontPoint, ...]
    refused: Mapping[str, str]

    def route(self, name: str) -> MovedRoute:
        """The moved route of a name. Raises ParameterError."""
        self.body.route(name)
        return next(route for route in self.routes if route.name == name)

    @property
    def deficit(self) -> float:
        """The greatest deficit of all routes."""
        return max(route.after.deficit for route in self.routes)

    @property
    def number(self) -> int:
        """The number of all muscles."""
        return sum(route.count for route in self.routes)

    def text(self) -> str:
        """The moved body as MJCF, with absolute folders of meshes and textures."""
        file = self.moved.file
        spec = file.specification()
        if len(spec.meshes) or len(spec.textures) or len(spec.hfields):
            folder = file.path.parent.resolve()
            spec.meshdir = str(folder / spec.meshdir)
            spec.texturedir = str(folder / spec.texturedir)
        file.compiled(spec)
        text: str = spec.to_xml()
        return text

    def chapter(self) -> Chapter:
        """The description of the moves."""
        deficits = {route.name: route.after.deficit for route in self.routes}
        shares = [deficits.get(route.name, 0.0) for route in self.body.routes]
        picture = functools.partial(
            body_figure, self.moved, shares, "missing part of the demanded torque"
        )
        plots = [Plot("body", "The body with its moved routes.", picture)]
        if len(self.front) > 1:
            caption = "Greatest missing part of a torque over the number of all muscles."
            plots.append(Plot("front", caption, functools.partial(front_figure, self)))
        for route in self.routes:
            caption = (
                f"{route.name}: torque over the angle, demanded, at the present places and at the"
                " new ones."
            )
            name = "".join(letter if letter.isalnum() else "_" for letter in route.name)
            draw = functools.partial(curve_figure, self.body, route)
            plots.append(Plot(f"torque_{name}", caption, draw))
        return Chapter(
            "route",
            f"Moved routes of {self.body.name}, supply {self.conditions.supply / 1e5:.4g} bar",
            self._summary(),
            values=(
                NamedValue("greatest deficit", self.deficit, "1", "%", 3),
                NamedValue("number of muscles", self.number),
                NamedValue(
                    "greatest pressure",
                    max(route.after.pressure for route in self.routes),
                    "Pa",
                    "bar",
                ),
            ),
            tables=(
                self._route_table(),
                *self._move_tables(),
                self._front_table(),
                self._curve_table(),
            ),
            plots=tuple(plots),
            problems=tuple(self._problems()),
            notes=self._notes(),
            chosen=(("factor on the torques", f"{self.factor:.4g}", "given"),),
        )

    def _summary(self) -> str:
        met = [route.name for route in self.routes if route.after.deficit <= MET]
        return (
            f"{len(met)} of {len(self.routes)} routes meet their torques, with {self.number}"
            f" muscles; the greatest missing part of a torque is {100 * self.deficit:.3g} %. Of"
            " each route the missing part is least, and where nothing is missing the pressure."
            " Lengths and moment arms are those of MuJoCo, forces those of the laws. Of muscles"
            " that meet the same torques those without a tackle and of the least volume are chosen."
        )

    def _problems(self) -> Iterator[str]:
        for route in self.routes:
            answer = route.after
            if (np.sign(route.rows.torque) * answer.arm < 0.0).any():
                yield (
                    f"{route.name}: where torques are demanded it pulls the joint in the other"
                    " direction, at every place that was found. Exchange the sign of the torques,"
                    " or give the rows to its antagonist."
                )
            if answer.deficit > MET:
                yield (
                    f"{route.name}: {100 * answer.deficit:.3g} % of its greatest torque is missing"
                    f" in the worst row, with {route.count} x {answer.choice.product} at"
                    f" {answer.pressure / 1e5:.3g} bar. Wider bounds, more muscles or a higher"
                    " supply would give more."
                )
            if answer.contact is not None and answer.contact.distance < -INSIDE:
                yield (
                    f"{route.name}: at every place that was found the route goes"
                    f" {-1e3 * answer.contact.distance:.3g} mm into {answer.contact.geom}. Give it"
                    " a clearance, or narrower bounds."
                )

    def _notes(self) -> tuple[str, ...]:
        """Points at their bounds, and remarks on the body."""
        notes = []
        for move in self.moves:
            if move.surface:
                continue
            point = self.route(move.route).after.sites[move.site]
            below = point - move.low
            above = move.high - point
            room = np.minimum(below, above)
            ended = [axis for axis, left in zip("xyz", room, strict=True) if left < AT_BOUND]
            if ended:
                notes.append(f"{move.site} is at its bounds in {' and '.join(ended)}.")
        return (*notes, *self.body.remarks)

    def _route_table(self) -> Table:
        routes = self.routes
        befores = [route.before for route in routes]
        answers = [route.after for route in routes]
        columns: dict[str, Any] = {
            "route": [route.name for route in routes],
            "number": [route.count for route in routes],
            "product": [route.after.choice.product for route in routes],
            "nominal length": TableColumn(
                [route.after.choice.length for route in routes], "m", "mm"
            ),
            "tackle": [f"{route.tackle}:1" for route in routes],
            "pressure": TableColumn([item.pressure for item in answers], "Pa", "bar", 3),
            "deficit": TableColumn([item.deficit for item in answers], "1", "%", 3),
            "pressure before": TableColumn(_of_each(befores, "pressure"), "Pa", "bar", 3),
            "deficit before": TableColumn(_of_each(befores, "deficit"), "1", "%", 3),
            "contraction": TableColumn(
                [route.after.choice.contraction for route in routes], "1", "%", 3
            ),
            "tendon": TableColumn([route.after.choice.tendon for route in routes], "m", "mm"),
            "law": TableColumn([route.muscle for route in routes], brief=False),
        }
        note = (
            "Deficit: greatest missing part of a torque, of the greatest one of its configuration."
            " Before: the same muscles at the present places, with the best length and pressure;"
            " none where they have no room or stroke there."
        )
        return Table("routes", "Moved routes", columns, note, brief=len(routes))

    def _move_tables(self) -> tuple[Table, ...]:
        if not self.moves:
            return ()
        after = []
        for move in self.moves:
            places = self.route(move.route).after.sites
            after.append(places[move.site])
        before = [move.present for move in self.moves]
        columns: dict[str, Any] = {
            "site": [move.site for move in self.moves],
            "route": [move.route for move in self.moves],
        }
        for axis, name in enumerate("xyz"):
            columns[f"{name} before"] = TableColumn([point[axis] for point in before], "m", "mm")
            columns[f"{name} after"] = TableColumn([point[axis] for point in after], "m", "mm")
        distances = np.linalg.norm(np.subtract(after, before), axis=1)
        columns["distance"] = TableColumn(distances, "m", "mm", 3)
        note = "Positions in the frame of the body of each site."
        return (Table("moves", "Moved points", columns, note, brief=len(self.moves)),)

    def _front_table(self) -> Table:
        columns: dict[str, Any] = {
            "number of muscles": [point.number for point in self.front],
            "greatest deficit": TableColumn([point.deficit for point in self.front], "1", "%", 3),
        }
        title = "Least number of muscles for each deficit"
        return Table("front", title, columns, brief=len(self.front))

    def _curve_table(self) -> Table:
        """The rows of all curves."""
        columns: dict[str, list[Any]] = {
            name: []
            for name in ("route", "configuration", "joint", "angle", "demand", "before", "after")
        }
        moment_arms: list[float] = []
        for route in self.routes:
            rows = route.rows
            for row in range(len(rows.torque)):
                joint = rows.poses.joints[rows.joint[row]]
                columns["route"].append(route.name)
                columns["configuration"].append(rows.configuration[row])
                columns["joint"].append(joint)
                angle = float(rows.poses.positions[row, rows.joint[row]])
                columns["angle"].append(self.body.joints[joint].shown(angle))
                columns["demand"].append(float(rows.torque[row]))
                before = route.before
                columns["before"].append(None if before is None else float(before.torque[row]))
                columns["after"].append(float(route.after.torque[row]))
                moment_arms.append(float(route.after.arm[row]))
        declared: dict[str, Any] = dict(columns)
        for name in ("demand", "before", "after"):
            declared[name] = TableColumn(columns[name], "N m")
        declared["moment arm"] = TableColumn(moment_arms, "m", "mm")
        return Table("curves", "Torques over the angles", declared, head=20)


def _of_each(answers: Sequence[TorqueAnswer | None], name: str) -> list[float | None]:
    """A quantity of answers; None where there is none."""
    return [None if answer is None else float(getattr(answer, name)) for answer in answers]


def curve_figure(body: Body, route: MovedRoute) -> Any:
    """Torque over the angle of each joint and configuration: demand, before, after."""
    figure, axes = plotting.new_figure()
    rows = route.rows
    groups = list(dict.fromkeys(zip(rows.joint.tolist(), rows.configuration, strict=True)))
    for number, (joint, configuration) in enumerate(groups):
        chosen = np.array(
            [
                place == (joint, configuration)
                for place in zip(rows.joint.tolist(), rows.configuration, strict=True)
            ]
        )
        angle = rows.poses.positions[chosen, joint]
        order = np.argsort(angle)
        name = rows.poses.joints[joint]
        is_hinge = body.joints[name].is_hinge
        shown = np.degrees(angle[order]) if is_hinge else 1e3 * angle[order]
        is_first = number == 0
        parts = [("demanded", rows.torque, plotting.BLACK)]
        if route.before is not None:
            parts.append(("present places", route.before.torque, plotting.ORANGE))
        parts.append(("new places", route.after.torque, plotting.BLUE))
        dashes = plotting.DASHES[number % len(plotting.DASHES)]
        for label, torque, colour in parts:
            axes.plot(
                shown,
                torque[chosen][order],
                color=colour,
                linestyle=dashes,
                label=label if is_first else None,
            )
        if len(groups) > 1:
            text = configuration or name
            axes.annotate(
                text,
                (shown[0], rows.torque[chosen][order][0]),
                (6, -11),
                textcoords="offset points",
                fontsize="small",
            )
    first = body.joints[rows.poses.joints[groups[0][0]]]
    axes.set_xlabel(f"{first.name} in degrees" if first.is_hinge else f"{first.name} in mm")
    axes.set_ylabel("torque in N m" if first.is_hinge else "force in N")
    pressures = f"{route.after.pressure / 1e5:.3g} bar"
    if route.before is not None:
        pressures = f"{route.before.pressure / 1e5:.3g} bar before, {pressures} after"
    axes.set_title(f"{route.name}: {route.count} x {route.after.choice.product}, {pressures}")
    plotting.legend_outside(axes)
    return figure


def front_figure(result: MovedRoutes) -> Any:
    """Greatest deficit over the number of all muscles."""
    figure, axes = plotting.new_figure()
    numbers = [point.number for point in result.front]
    axes.step(
        numbers,
        [100 * point.deficit for point in result.front],
        where="post",
        marker="o",
        color=plotting.BLUE,
    )
    axes.set_xlabel("number of muscles")
    axes.set_ylabel("greatest missing part of a torque in %")
    return figure
