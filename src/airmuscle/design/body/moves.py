"""Moves: the points of routes that may be moved, and the bounds within which they may be."""

import dataclasses
import math
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...core import (
    Array,
    InputError,
    ParameterError,
    ShortRepr,
    check_known,
    quantity,
    quotable,
)
from ...files.library import read_toml
from .body import WRAPS, Body, BodyRoute
from .simulator import load_simulator

MOVE_KEYS = ("route", "site", "box", "within", "on", "clearance", "from")
SIGN = re.compile(r"\s*(?:(?P<route>[^:]+):)?\s*(?P<site>\S+)\s+(?P<bounds>(?:within|on)\s.+)")
ROUNDING = 1e-9
"""Length [m] by which the present position may be outside its box."""
AROUND_SURFACE = 1e-3
"""Room [m] of the box about a geom on whose surface a point is moved, beyond the clearance
(chosen)."""
STEP = 1e-7
"""Step [m] of the derivative of a distance from a geom."""
EXAMPLE = "'knee_insertion within box 10 mm..40 mm, -40 mm..-20 mm, -100 mm..-50 mm'"


class MoveRequest(NamedTuple):
    """A move as it is asked for, before a body is known.

    route      name of the route; empty where the site tells it
    site       name of the site that is moved
    box        bounds (low, high) [m] of x, y, z in the frame of the body of the site; None without
    within     half width [m] of a cube about the present position; None without
    surface    name of the geom on whose surface the site stays; empty without
    clearance  least distance [m] from a geom; of a surface the distance
    obstacle   name of the geom of the clearance; empty without
    where      place of the request, for messages
    """

    route: str
    site: str
    box: tuple[tuple[float, float], ...] | None
    within: float | None
    surface: str
    clearance: float
    obstacle: str
    where: str


class GeomDistance(NamedTuple):
    """Distance of a point from a sphere, capsule, cylinder or box of the same body.

    kind      name of the shape
    size      MuJoCo's sizes [m]
    position  centre in the frame of the body [m]
    frame     rotation of the geom (3, 3)
    """

    kind: str
    size: tuple[float, ...]
    position: Array
    frame: Array

    def of(self, point: Array) -> float:
        """Signed distance [m], negative inside."""
        local = self.frame.T @ (point - self.position)
        return DISTANCES[self.kind](local, self.size)

    def gradient(self, point: Array) -> Array:
        """Derivative of the distance by the position (3,)."""
        steps = STEP * np.eye(3)
        return np.array([(self.of(point + step) - self.of(point - step)) for step in steps]) / (
            2.0 * STEP
        )


def _from_sphere(point: Array, size: tuple[float, ...]) -> float:
    return float(np.linalg.norm(point)) - size[0]


def _from_capsule(point: Array, size: tuple[float, ...]) -> float:
    along = float(np.clip(point[2], -size[1], size[1]))
    return float(np.linalg.norm(point - [0.0, 0.0, along])) - size[0]


def _from_box(point: Array, size: tuple[float, ...]) -> float:
    return _outside(np.abs(point) - np.asarray(size[:3]))


def _from_cylinder(point: Array, size: tuple[float, ...]) -> float:
    radial = math.hypot(float(point[0]), float(point[1])) - size[0]
    return _outside(np.array([radial, abs(float(point[2])) - size[1]]))


def _outside(excess: Array) -> float:
    """Distance from a shape by what a point exceeds each of its faces."""
    return float(np.linalg.norm(np.maximum(excess, 0.0)) + min(float(excess.max()), 0.0))


DISTANCES: Mapping[str, Callable[[Array, tuple[float, ...]], float]] = {
    "sphere": _from_sphere,
    "capsule": _from_capsule,
    "cylinder": _from_cylinder,
    "box": _from_box,
}
"""Signed distance of a point in the frame of a geom, by its shape."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class PointMove(ShortRepr):
    """A point of a route that may be moved.

    route      name of the route
    site       name of the site
    index      of the site in MuJoCo's model
    present    position in the frame of its body [m] (3,)
    low, high  bounds of the position [m] (3,)
    surface    whether the point stays at the clearance from the geom, in place of at least there
    clearance  distance from the geom [m]
    geom       the geom; None without
    """

    route: str
    site: str
    index: int
    present: Array
    low: Array
    high: Array
    surface: bool = False
    clearance: float = 0.0
    geom: GeomDistance | None = None


def read_move(text: str, where: str) -> MoveRequest:
    """The move of a text: 'ROUTE: SITE within box X, Y, Z', 'SITE within 20 mm', 'SITE on GEOM',
    each with ', clearance 5 mm from GEOM'. Raises InputError.
    """
    match = SIGN.fullmatch(text)
    if match is None:
        raise InputError(f"{where} is {quotable(text)!r}; write it as {EXAMPLE}.")
    parts = [part.strip() for part in match["bounds"].split(",")]
    table: dict[str, Any] = {"site": match["site"]}
    if match["route"]:
        table["route"] = match["route"].strip()
    if parts[-1].startswith("clearance"):
        distance, _, geom = parts.pop().removeprefix("clearance").partition(" from ")
        table["clearance"] = distance.strip()
        if geom:
            table["from"] = geom.strip()
    kind, _, rest = parts[0].partition(" ")
    rest = rest.strip()
    if kind == "on":
        table["on"] = rest
    elif rest.startswith("box"):
        table["box"] = [rest.removeprefix("box").strip(), *parts[1:]]
    else:
        table["within"] = rest
    return _request(table, where)


def read_moves(path: Path) -> tuple[MoveRequest, ...]:
    """The moves of a TOML file, [[move]] with site, and box, within or on. Raises FileError and
    InputError.
    """
    tables = read_toml(path)
    check_known(f"{path}: unknown key", tables, ("move",))
    moves = []
    for number, table in enumerate(tables.get("move", []), 1):
        where = f"{path}: move {number}"
        if not isinstance(table, dict) or not isinstance(table.get("site"), str):
            raise ParameterError(f"{where}: 'site' is missing; it must be a text in quotes.")
        check_known(f"{where}: unknown key", table, MOVE_KEYS)
        moves.append(_request(table, where))
    if not moves:
        raise ParameterError(f"{path}: has no move; add [[move]] with site and box.")
    return tuple(moves)


def _request(table: Mapping[str, Any], where: str) -> MoveRequest:
    """The request of a table of texts. Raises InputError."""
    stated = [key for key in ("box", "within", "on") if key in table]
    if len(stated) != 1:
        raise InputError(
            f"{where}: states {' and '.join(stated) or 'no bounds'}; give one of box (three ranges"
            " such as '10 mm..40 mm'), within (such as '20 mm') and on (the name of a geom)."
        )
    box = None
    if "box" in table:
        ranges = table["box"]
        if not isinstance(ranges, list) or len(ranges) != 3:
            raise InputError(
                f"{where}: box needs three ranges, of x, y and z in the frame of the body of the"
                f" site: {EXAMPLE}."
            )
        box = tuple(
            _range(text, f"{where}: {axis}") for text, axis in zip(ranges, "xyz", strict=True)
        )
    within = _length(table["within"], f"{where}: within") if "within" in table else None
    clearance = _length(table.get("clearance", "0 mm"), f"{where}: clearance")
    surface = str(table.get("on", ""))
    obstacle = str(table.get("from", surface))
    if "clearance" in table and not obstacle:
        raise InputError(f"{where}: the clearance has no geom; write 'clearance 5 mm from GEOM'.")
    if surface and obstacle != surface:
        raise InputError(
            f"{where}: the clearance of a point on {surface} is that from {surface}, not from"
            f" {obstacle}."
        )
    route = str(table.get("route", ""))
    return MoveRequest(route, str(table["site"]), box, within, surface, clearance, obstacle, where)


def _range(text: Any, where: str) -> tuple[float, float]:
    """A range of lengths [m]. Raises InputError."""
    low, separator, high = str(text).partition("..")
    if not separator:
        raise InputError(f"{where} is {quotable(str(text))!r}; give two lengths: '10 mm..40 mm'.")
    limits = _length(low, where), _length(high, where)
    if not limits[0] <= limits[1]:
        raise InputError(f"{where}: {low.strip()} is greater than {high.strip()}.")
    return limits


def _length(text: Any, where: str) -> float:
    return quantity(str(text).strip(), "m", where=where)


def resolved_moves(body: Body, requests: Sequence[MoveRequest]) -> tuple[PointMove, ...]:
    """The moves of a body. Raises ParameterError for unknown names, for a site that two routes
    share, and for bounds that exclude the present position.
    """
    moves = tuple(_resolved(body, request) for request in requests)
    for number, move in enumerate(moves):
        if move.site in [other.site for other in moves[:number]]:
            raise ParameterError(f"{requests[number].where}: the site {move.site} is moved twice.")
    return moves


def _resolved(body: Body, request: MoveRequest) -> PointMove:
    where = request.where
    using = [route for route in body.routes if request.site in route.points]
    points = dict.fromkeys(point for route in body.routes for point in route.points)
    known = [point for point in points if not point.startswith(WRAPS)]
    check_known(f"{where}: no route has a site", [request.site], known)
    if len(using) > 1:
        names = ", ".join(route.name for route in using)
        raise ParameterError(
            f"{where}: the site {request.site} belongs to {len(using)} routes ({names}), which"
            " would all be changed; give each route a site of its own."
        )
    route = _checked_route(body, request, using[0])
    model = body.model
    index = int(model.site(request.site).id)
    present = np.array(model.site_pos[index])
    geom = _geom(body, request, int(model.site_bodyid[index])) if request.obstacle else None
    low, high = _bounds(request, present, geom)
    return PointMove(
        route.name,
        request.site,
        index,
        present,
        low,
        high,
        bool(request.surface),
        request.clearance,
        geom,
    )


def _checked_route(body: Body, request: MoveRequest, route: BodyRoute) -> BodyRoute:
    if request.route and body.route(request.route).name != route.name:
        raise ParameterError(
            f"{request.where}: the site {request.site} belongs to the route {route.name}, not to"
            f" {request.route}."
        )
    return route


def _bounds(request: MoveRequest, present: Array, geom: GeomDistance | None) -> tuple[Array, Array]:
    """Bounds [m] of a position. Raises ParameterError where they exclude the present one."""
    if request.within is not None:
        return present - request.within, present + request.within
    if request.box is None:
        assert geom is not None
        reach = float(np.linalg.norm(geom.size)) + abs(request.clearance) + AROUND_SURFACE
        return geom.position - reach, geom.position + reach
    low, high = np.transpose(request.box)
    if (present < low - ROUNDING).any() or (present > high + ROUNDING).any():
        shown = ", ".join(f"{1e3 * value:.4g} mm" for value in present)
        raise ParameterError(
            f"{request.where}: the box excludes the present position of {request.site}, {shown} in"
            " the frame of its body; widen the box, or move the site into it first."
        )
    return low, high


def _geom(body: Body, request: MoveRequest, owner: int) -> GeomDistance:
    """The geom of a clearance. Raises ParameterError for an unknown one, one of another body or of
    another shape.
    """
    mujoco = load_simulator()
    model = body.model
    names = {model.geom(number).name: number for number in range(model.ngeom)}
    check_known(f"{request.where}: there is no geom", [request.obstacle], names)
    index = names[request.obstacle]
    if int(model.geom_bodyid[index]) != owner:
        raise ParameterError(
            f"{request.where}: the geom {request.obstacle} belongs to the body"
            f" {model.body(int(model.geom_bodyid[index])).name}, the site to"
            f" {model.body(owner).name}; give a geom of the same body."
        )
    kind = mujoco.mjtGeom(int(model.geom_type[index])).name.removeprefix("mjGEOM_").lower()
    if kind not in DISTANCES:
        raise ParameterError(
            f"{request.where}: the geom {request.obstacle} is a {kind}; a clearance is measured"
            f" from {', '.join(DISTANCES)}. Give a box instead."
        )
    frame = np.zeros(9)
    mujoco.mju_quat2Mat(frame, model.geom_quat[index])
    size = tuple(float(value) for value in model.geom_size[index])
    return GeomDistance(kind, size, np.array(model.geom_pos[index]), frame.reshape(3, 3))
