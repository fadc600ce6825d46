"""Moved routes: places of the points of routes, with their muscles, that meet torques over angles
at the least pressure.
"""

import dataclasses
import itertools
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ...core import Array, ParameterError, ShortRepr, SolveError
from ...engine.distribution import DistributedCalls
from ...engine.processes import Workers, process_pool
from ...files.library import Entry
from ..sizing import SizingConditions, catalogue, working_muscle
from ..sizing.static_muscle import at_length
from .body import Body, check_limits
from .clearance import clearances
from .faults import INSIDE
from .fitting_out import laws_of_products
from .kinematics import BodyKinematics, Poses
from .moved_routes import FrontPoint, MovedRoute, MovedRoutes, TorqueAnswer
from .moves import MoveRequest, PointMove, resolved_moves
from .muscle_table import MuscleTable, muscle_tables
from .poses import sobol_points
from .route_geometry import geometry_of_route
from .route_muscle import TACKLES, RouteMuscle
from .route_search import (
    RoutePlace,
    RouteTarget,
    RouteTask,
    SearchSettings,
    search_route,
)
from .sweep import RouteSweep, sweep_routes
from .torque_curve import TorqueRows

STARTS = 16
"""Starts of each search (chosen)."""
RANGE_POINTS = {1: 17, 2: 9, 3: 5}
"""Poses of each joint over which a route keeps its contraction, by their number (chosen)."""
RANGE_SOBOL = 256
"""Poses of more joints (chosen)."""
PERMITTED = 1e-6
"""Violation up to which a place is permitted (chosen)."""
NO_TENDON = 1e-5
"""Length [m] of a tendon that is none (chosen)."""
NO_DEFICIT = 1e-5
"""Deficit that is none (chosen)."""
LITTLE = 1e-3
"""Deficit that a greater number of muscles must remove to be worth it, of the greatest torque
(chosen)."""


def move_routes(
    body: Body,
    curves: Sequence[TorqueRows],
    moves: Sequence[MoveRequest],
    conditions: SizingConditions,
    muscles: Sequence[Entry] | None = None,
    *,
    factor: float = 1.0,
    starts: int = STARTS,
    workers: Workers = 1,
    progress: Callable[[float], None] = lambda fraction: None,
) -> MovedRoutes:
    """The places of the points of routes, and their muscles, that meet curves of torque.

    curves      torques over angles that each route must give
    moves       points that may be moved, with their bounds
    conditions  supply, numbers of muscles side by side, greatest length
    muscles     library entries; by default those of the catalogue
    factor      on the torques
    starts      starts of each search: the present places and those of a Sobol sequence
    workers     number of processes, or an executor

    For each route, muscle, number and tackle a search minimises the greatest missing part of a
    torque, and among places that miss none the pressure. MuJoCo measures the result. Results of
    searches are taken from `result_store`, if there is one. Raises ParameterError and SolveError.
    """
    if not starts >= 1:
        raise ParameterError(f"move_routes: starts is {starts}; it must be at least 1.")
    if not factor > 0.0:
        raise ParameterError(f"move_routes: factor is {factor:.4g}; it must be greater than 0.")
    check_limits(body)
    resolved = resolved_moves(body, moves)
    _check_demanded(body, curves, resolved)
    demanded = _loaded(curves, factor)
    entries = catalogue() if muscles is None else tuple(muscles)
    laws = laws_of_products(entries, conditions)
    chosen_laws = tuple(entries_of_product[0] for entries_of_product in laws.values())
    tables, refused = muscle_tables(chosen_laws, conditions)
    if not tables:
        reasons = "; ".join(f"{name}: {reason}" for name, reason in refused.items())
        raise ParameterError(f"no muscle can work at this supply: {reasons or 'none is given'}.")
    targets = {
        rows.route: _target(body, rows, [move for move in resolved if move.route == rows.route])
        for rows in demanded
    }
    counts = range(conditions.min_count, conditions.max_count + 1)
    tasks = [
        RouteTask(*parts)
        for parts in itertools.product(targets, tables, counts, TACKLES, (False, True))
    ]
    settings = SearchSettings(targets, tables, starts)
    with process_pool(workers) as executor:
        calls = DistributedCalls(executor, search_route, settings)
        places = calls.results(tasks, lambda count: progress(count / len(tasks)))
    results = dict(zip(tasks, places, strict=True))
    entries_by_name = {entry.name: entry for entry in chosen_laws}
    judge = _Judge(body, resolved, entries_by_name, tables, conditions)
    routes = tuple(judge.moved_route(rows, results, counts) for rows in demanded)
    moved = moved_body(body, {site: point for route in routes for site, point in route.sites})
    return MovedRoutes(
        body, moved, conditions, factor, resolved, routes, tuple(_front(routes)), dict(refused)
    )


def _loaded(curves: Sequence[TorqueRows], factor: float) -> tuple[TorqueRows, ...]:
    """The curves that demand a torque, times the factor."""
    loaded = [rows for rows in curves if np.any(rows.torque)]
    return tuple(rows._replace(torque=factor * rows.torque) for rows in loaded)


def moved_body(body: Body, sites: Mapping[str, Array]) -> Body:
    """The body with sites at positions [m] in the frames of their bodies. Raises ParameterError
    for a site in a frame of the file that its position does not reach.
    """
    positions = {
        name: (float(point[0]), float(point[1]), float(point[2])) for name, point in sites.items()
    }
    file = dataclasses.replace(body.file, sites={**body.file.sites, **positions})
    model = file.compiled(file.specification())
    for name, position in positions.items():
        if not np.allclose(model.site(name).pos, position, rtol=0.0, atol=1e-9):
            raise ParameterError(
                f"{body.source.place(name, 'site')} is inside a <frame>, so that its position in"
                " the file is not that in its body; write the site directly in its body."
            )
    return dataclasses.replace(body, file=file, model=model)


def _check_demanded(body: Body, curves: Sequence[TorqueRows], moves: Sequence[PointMove]) -> None:
    """Raise ParameterError for routes without a path, and for moves of routes without a torque."""
    if not any(np.any(rows.torque) for rows in curves):
        raise ParameterError("the curves demand no torque; give one that is not 0.")
    demanded = {rows.route for rows in curves if np.any(rows.torque)}
    for name in demanded:
        if not body.route(name).is_path:
            raise ParameterError(
                f"{body.route(name).place} is a fixed tendon, which has no points; give the route a"
                " path of sites."
            )
    for move in moves:
        if move.route not in demanded:
            raise ParameterError(
                f"the site {move.site} is moved, but no torque is demanded of its route,"
                f" {move.route}; add rows for it to the curves."
            )


def _target(body: Body, rows: TorqueRows, moves: Sequence[PointMove]) -> RouteTarget:
    """The numerical problem of a route, over its torques and over the ranges of its joints."""
    route = body.route(rows.route)
    loaded = np.flatnonzero(rows.torque)
    rows = TorqueRows(
        rows.route,
        rows.poses.selected(loaded),
        rows.joint[loaded],
        rows.torque[loaded],
        tuple(rows.configuration[row] for row in loaded),
    )
    geometry = geometry_of_route(body, rows, range_poses(body, route.joints), moves)
    present = geometry.at(np.array([move.present for move in moves]).reshape(-1, 3)).length
    reach = 0.0
    for move in moves:
        corner = np.maximum(move.high - move.present, move.present - move.low)
        reach += 2.0 * float(np.linalg.norm(corner))
    ends = float(present.min()), float(present.max())
    return RouteTarget(rows.route, geometry, tuple(moves), rows.torque, rows.scale, ends, reach)


def range_poses(body: Body, joints: Sequence[str]) -> Poses:
    """Poses over the ranges of joints: a grid of up to three, else a Sobol sequence."""
    moved = [body.joints[name] for name in joints]
    ranges = [(joint.low, joint.high) for joint in moved]
    if not ranges:
        return Poses((), np.zeros((1, 0)))
    names = tuple(joints)
    points = RANGE_POINTS.get(len(ranges))
    if points is None:
        return Poses(names, sobol_points(ranges, RANGE_SOBOL))
    axes = [np.linspace(low, high, points) for low, high in ranges]
    grid = np.array(list(itertools.product(*axes)))
    return Poses(names, grid)


class _Judge(ShortRepr):
    """Choice among the results of searches, measured by MuJoCo and the law of the muscle."""

    def __init__(
        self,
        body: Body,
        moves: Sequence[PointMove],
        entries: Mapping[str, Entry],
        tables: Mapping[str, MuscleTable],
        conditions: SizingConditions,
    ) -> None:
        self.body = body
        self.moves = moves
        self.entries = entries
        self.tables = tables
        self.conditions = conditions

    def moved_route(
        self,
        rows: TorqueRows,
        results: Mapping[RouteTask, tuple[RoutePlace, ...]],
        counts: range,
    ) -> MovedRoute:
        """The choice of a route: the least number beyond which the deficit falls no further."""
        best = {count: self._best(rows.route, results, count) for count in counts}
        possible = {count: task for count, task in best.items() if task is not None}
        if not possible:
            raise SolveError(
                f"{rows.route}: no muscle has room and stroke for this route: over the ranges of"
                " its joints the length changes by more than any permits. Lengthen the route,"
                " reduce its lever, or give wider bounds."
            )
        deficits = {count: _shown(results[task][0].deficit) for count, task in possible.items()}
        least = min(deficits.values())
        count = min(count for count, part in deficits.items() if part <= least + LITTLE)
        task = possible[count]
        after = self._clear(rows, task, results[task])
        (present, *_) = results[task._replace(fixed=True)]
        before = None
        if present.violation <= PERMITTED:
            before = self._answer(rows, task, present)
        return MovedRoute(
            rows, task.muscle, task.number, task.tackle, after, before, dict(deficits)
        )

    def _best(
        self, route: str, results: Mapping[RouteTask, tuple[RoutePlace, ...]], count: int
    ) -> RouteTask | None:
        """The search of a number with the least deficit; of equal ones that without a tackle, and
        with the smallest muscles. None if none is permitted.
        """
        tasks = [
            task
            for task, places in results.items()
            if task.route == route
            and task.number == count
            and not task.fixed
            and places[0].violation <= PERMITTED
        ]
        least = min((results[task][0].deficit for task in tasks), default=0.0)

        def cost(task: RouteTask) -> tuple[bool, int, float, str]:
            place = results[task][0]
            volume = place.length * self.tables[task.muscle].fittings ** 2
            return place.deficit > least + LITTLE, task.tackle, volume, task.muscle

        return min(tasks, key=cost, default=None)

    def _clear(
        self, rows: TorqueRows, task: RouteTask, places: Sequence[RoutePlace]
    ) -> TorqueAnswer:
        """The best place at which the route does not go through the body; the best of all if each
        does.
        """
        permitted = [place for place in places if place.violation <= PERMITTED]
        first: TorqueAnswer | None = None
        for place in permitted:
            answer = self._answer(rows, task, place)
            first = answer if first is None else first
            if answer.contact is None or answer.contact.distance >= -INSIDE:
                return answer
        assert first is not None
        return first

    def _answer(self, rows: TorqueRows, task: RouteTask, place: RoutePlace) -> TorqueAnswer:
        """The torques of a place, by MuJoCo's lengths and moment arms and the law."""
        moves = [move for move in self.moves if move.route == rows.route]
        sites = {move.site: point for move, point in zip(moves, place.points, strict=True)}
        moved = moved_body(self.body, sites)
        route = moved.route(rows.route)
        alone = dataclasses.replace(moved, routes=(route,))
        (sweep,) = sweep_routes(alone)
        choice = self._muscles(sweep, task, place)
        samples = BodyKinematics(moved).samples([route], rows.poses)
        length = samples.length[:, 0]
        arm = -samples.slope[np.arange(len(length)), 0, rows.joint]
        torque = arm * np.minimum(
            choice.tension(place.pressure, length),
            task.number / task.tackle * choice.muscle.max_force,
        )
        missing = np.abs(rows.torque) - np.sign(rows.torque) * torque
        scale = np.where(rows.scale > 0.0, rows.scale, 1.0)
        (contact,) = clearances(alone, [sweep])
        return TorqueAnswer(
            sites,
            choice,
            place.pressure,
            arm,
            torque,
            max(float(np.max(missing / scale, where=rows.torque != 0.0, initial=0.0)), 0.0),
            contact,
        )

    def _muscles(self, sweep: RouteSweep, task: RouteTask, place: RoutePlace) -> RouteMuscle:
        """The muscles at a place, mounted at their least contraction in the longest pose."""
        table = self.tables[task.muscle]
        entry = at_length(self.entries[task.muscle], place.length)
        muscle = working_muscle(entry, self.conditions)
        first = float(table.contraction[0])
        last = first + sweep.stroke / (task.tackle * place.length)
        tendon = sweep.longest.length - table.fittings - (1.0 - first) * place.length
        tendon = 0.0 if abs(tendon) < NO_TENDON else tendon
        return RouteMuscle(
            sweep,
            muscle,
            place.length,
            task.number,
            task.tackle,
            tendon,
            table.fittings,
            (first, last),
            np.inf,
            {},
        )


def _shown(deficit: float) -> float:
    """A deficit without what rounding leaves."""
    return 0.0 if deficit < NO_DEFICIT else deficit


def _front(routes: Sequence[MovedRoute]) -> list[FrontPoint]:
    """The Pareto front of the number of all muscles and the greatest deficit: each deficit that a
    number of a route leaves is met by all routes with the least number that does so.
    """
    levels = sorted({part for route in routes for part in route.deficits.values()})
    points: list[FrontPoint] = []
    for level in levels:
        counts = []
        worst = 0.0
        for route in routes:
            sufficient = [(count, part) for count, part in route.deficits.items() if part <= level]
            if not sufficient:
                break
            count, part = min(sufficient)
            counts.append(count)
            worst = max(worst, part)
        if len(counts) < len(routes):
            continue
        total = sum(counts)
        if not points or total < points[-1].number:
            points.append(FrontPoint(total, worst))
    return points[::-1]
