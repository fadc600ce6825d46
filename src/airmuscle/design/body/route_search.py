"""Search of the places of the points of a route, with length and pressure of its muscles, that meet
torques over angles at the least pressure.

    minimise p/p_s + w_d max_i d_i + w_h max_j h_j
    d_i = (|tau_i| - r_i (n/k) F(p, eps_i))/tau_max,    eps_i = eps_1 + (a - L_i)/(k L_0)

d deficits, h violations (0 where none): contraction beyond its range, no room for the muscle,
clearance. L length of the route, a its greatest one, L_0 nominal length, r moment arm in the
direction of the torque, n number, k tackle, p pressure, p_s that of the supply. Each step solves
the linear problem of all deficits and violations within a trust region (sequential linear
programming), once more with the curvature that its trial has shown where the gain falls short.
"""

import dataclasses
from typing import NamedTuple

import numpy as np

from ...core import Array, ShortRepr
from .moves import PointMove
from .muscle_table import ForceSplines, MuscleTable
from .route_geometry import RouteGeometry

DEFICIT_WEIGHT = 10.0
VIOLATION_WEIGHT = 1e3
"""Weights of the greatest deficit and violation beside the pressure (chosen): greater than what a
deficit saves of pressure, and a violation of deficit."""
FIRST_RADIUS = 0.25
LAST_RADIUS = 1e-4
"""First and last half width of the trust region, in parts of the ranges (chosen)."""
MOST_STEPS = 60
"""Steps of a search (chosen)."""
SMALL_GAIN = 1e-6
"""Predicted gain at which a search ends (chosen)."""
LEAST_RATIO = 0.05
POOR_RATIO = 0.3
GOOD_RATIO = 0.7
"""Gain over that predicted from which on a step is taken, below which the trust region shrinks, and
above which it grows (chosen)."""
LEAST_LENGTH = 1e-3
"""Least length [m] of a route (chosen)."""
FREE_VARIABLES = 3
"""Nominal length, greatest length of the route, and pressure."""
MARGIN = 1e-6
"""Length [m] that a point on a surface may leave it."""


@dataclasses.dataclass(frozen=True, eq=False)
class RouteTarget(ShortRepr):
    """A route whose points move, and the torques that it must give.

    route     its name
    geometry  lengths and moment arms; the poses of the torques first
    moves     the points that may be moved
    torque    torques [N m] (N,), with the factor on the demand
    scale     greatest torque of the configuration of each row (N,)
    present   present least and greatest length [m]
    reach     greatest change of the length by the moves [m]
    """

    route: str
    geometry: RouteGeometry
    moves: tuple[PointMove, ...]
    torque: Array
    scale: Array
    present: tuple[float, float]
    reach: float


class RouteTask(NamedTuple):
    """A search: route, muscle, number side by side, tackle, and whether the points stay."""

    route: str
    muscle: str
    number: int
    tackle: int
    fixed: bool = False


class RoutePlace(NamedTuple):
    """A result of a search.

    points     positions of the points that move [m] (M, 3)
    length     nominal length of the muscles [m]
    pressure   least pressure [Pa] that gives the torques; that of the supply where none does
    deficit    greatest missing part of a torque, of the greatest one of its configuration
    violation  greatest violation, 0 for a place that is permitted
    merit      what is made least
    """

    points: Array
    length: float
    pressure: float
    deficit: float
    violation: float
    merit: float


class SearchSettings(NamedTuple):
    """What all searches share: the routes and tables by name, and the number of starts."""

    targets: dict[str, RouteTarget]
    muscles: dict[str, MuscleTable]
    starts: int


class _Values(NamedTuple):
    """Deficits (N,) and violations (H,) with their derivatives by the scaled variables."""

    deficit: Array
    deficit_slope: Array
    violation: Array
    violation_slope: Array

    @property
    def residuals(self) -> Array:
        """Deficits and violations (N + H,)."""
        return np.concatenate([self.deficit, self.violation])

    @property
    def slopes(self) -> Array:
        """Derivatives of all residuals."""
        return np.concatenate([self.deficit_slope, self.violation_slope])


class _Trial(NamedTuple):
    """A point of a search with its values and its merit."""

    scaled: Array
    values: _Values
    merit: float


def search_route(settings: SearchSettings, task: RouteTask) -> tuple[RoutePlace, ...]:
    """The results of all starts of a search, the best first."""
    problem = _RouteProblem(settings.targets[task.route], settings.muscles[task.muscle], task)
    places = [problem.descend(start) for start in problem.starts(settings.starts)]
    return tuple(sorted(places, key=lambda place: place.merit))


class _RouteProblem:
    """Deficits and violations of a route over scaled variables, 0 to 1: positions of the points,
    nominal length, greatest length of the route, pressure.
    """

    def __init__(self, target: RouteTarget, table: MuscleTable, task: RouteTask) -> None:
        self.target = target
        self.table = table
        self.force = ForceSplines(table)
        self.share = task.number / task.tackle
        self.tackle = task.tackle
        self.moves = () if task.fixed else target.moves
        self.first = float(table.contraction[0])
        self.last = float(table.contraction[-1])
        least, greatest = table.length_range
        present = target.present[1]
        longest = present + target.reach
        low = [
            least,
            max(present - target.reach, LEAST_LENGTH),
            float(table.pressure[0]),
        ]
        high = [
            max(least, min(greatest, longest)),
            longest + table.fittings + LEAST_LENGTH,
            float(table.pressure[-1]),
        ]
        self.low = np.concatenate([*(move.low for move in self.moves), low])
        self.high = np.concatenate([*(move.high for move in self.moves), high])
        self.span = self.high - self.low

    def starts(self, count: int) -> list[Array]:
        """Scaled starting points: the present positions, then those of a Sobol sequence."""
        from scipy.stats import qmc

        width = 3 * len(self.moves)
        if width == 0:
            return [self._completed(np.zeros(0))]
        present = np.concatenate([move.present for move in self.moves])
        starts = [self._completed(present)]
        power = int(np.ceil(np.log2(max(count, 2))))
        sampler = qmc.Sobol(width, scramble=False)
        sequence = sampler.random_base2(power)
        for scaled in sequence[1:count]:
            places = self.low[:width] + self.span[:width] * scaled
            starts.append(self._completed(places))
        return starts

    def _completed(self, places: Array) -> Array:
        """A scaled start at positions (3 M,), with the longest muscle that has room, at the
        greatest pressure.
        """
        points = self._points(places)
        longest = float(self.target.geometry.at(points).length.max())
        room = (longest - self.table.fittings) / (1.0 - self.first)
        pressure = float(self.table.pressure[-1])
        real = np.concatenate([places, [room, longest, pressure]])
        real = np.clip(real, self.low, self.high)
        # a variable without a range has the scaled value 0
        span = np.where(self.span > 0.0, self.span, 1.0)
        return np.asarray((real - self.low) / span)

    def _points(self, places: Array) -> Array:
        """Positions of all points that may move; the present ones where they stay."""
        if self.moves or not self.target.moves:
            return places.reshape(-1, 3)
        return np.array([move.present for move in self.target.moves])

    def values(self, scaled: Array) -> _Values:
        """Deficits and violations."""
        real = self.low + self.span * scaled
        width = 3 * len(self.moves)
        length, longest, pressure = (float(value) for value in real[width:])
        geometry = self.target.geometry.at(self._points(real[:width]))
        route = geometry.length
        route_slope = self._embedded(geometry.length_slope, width)
        route_slope[:, width + 1] = -1.0  # of L - a
        arm_slope = self._embedded(geometry.arm_slope, width)
        stretch = self.tackle * length
        contraction = self.first + (longest - route) / stretch
        contraction_slope = -route_slope / stretch
        contraction_slope[:, width] -= (longest - route) / (stretch * length)
        count = len(self.target.torque)
        force = self.force.at(length, pressure, contraction[:count])
        force_slope = force.by_contraction[:, None] * contraction_slope[:count]
        force_slope[:, width] += force.by_length
        force_slope[:, width + 2] += force.by_pressure
        sign = np.sign(self.target.torque)
        factor = self.share * sign / self.target.scale
        deficit = np.abs(self.target.torque) / self.target.scale - factor * (
            geometry.arm * force.force
        )
        deficit_slope = -factor[:, None] * (
            arm_slope * force.force[:, None] + geometry.arm[:, None] * force_slope
        )
        room_slope = np.zeros(len(self.low))
        room_slope[width] = 1.0 - self.first
        room_slope[width + 1] = -1.0
        room = (1.0 - self.first) * length + self.table.fittings - longest
        reference = self.target.present[1]
        near, near_slope = self._clearances(real[:width])
        violation = np.concatenate(
            [
                (route - longest) / reference,
                contraction - self.last,
                [room / reference],
                near / reference,
            ]
        )
        violation_slope = np.concatenate(
            [
                route_slope / reference,
                contraction_slope,
                room_slope[None, :] / reference,
                near_slope / reference,
            ]
        )
        return _Values(deficit, deficit_slope * self.span, violation, violation_slope * self.span)

    def _embedded(self, slope: Array, width: int) -> Array:
        """Derivatives by the positions among those by all variables."""
        whole = np.zeros((len(slope), len(self.low)))
        whole[:, :width] = slope[:, :width]
        return whole

    def _clearances(self, places: Array) -> tuple[Array, Array]:
        """Missing clearance [m] of the points, and of those on a surface also what they are beyond
        it.
        """
        missing = []
        slopes = []
        for number, move in enumerate(self.moves):
            if move.geom is None:
                continue
            point = places[3 * number : 3 * number + 3]
            slope = np.zeros(len(self.low))
            slope[3 * number : 3 * number + 3] = move.geom.gradient(point)
            distance = move.geom.of(point)
            missing.append(move.clearance - distance)
            slopes.append(-slope)
            if move.surface:
                missing.append(distance - move.clearance - MARGIN)
                slopes.append(slope)
        return np.array(missing), np.reshape(slopes, (len(missing), len(self.low)))

    def merit(self, scaled: Array, values: _Values) -> float:
        """Pressure, deficit and violation in one number."""
        real = self.low[-1] + self.span[-1] * scaled[-1]
        return float(
            real / self.table.pressure[-1]
            + DEFICIT_WEIGHT * max(values.deficit.max(initial=0.0), 0.0)
            + VIOLATION_WEIGHT * max(values.violation.max(initial=0.0), 0.0)
        )

    def descend(self, start: Array) -> RoutePlace:
        """The result from a start."""
        here = self._trial(start)
        radius = FIRST_RADIUS
        for _ in range(MOST_STEPS):
            step, predicted = self._step(here, here.values.residuals, radius)
            if predicted < SMALL_GAIN:
                break
            trial = self._trial(np.clip(here.scaled + step, 0.0, 1.0))
            ratio = (here.merit - trial.merit) / predicted
            if ratio < GOOD_RATIO:
                # the same step with the curvature that the trial has shown
                curved = trial.values.residuals - here.values.slopes @ (trial.scaled - here.scaled)
                step, _ = self._step(here, curved, radius)
                corrected = self._trial(np.clip(here.scaled + step, 0.0, 1.0))
                if corrected.merit < trial.merit:
                    trial = corrected
                    ratio = (here.merit - trial.merit) / predicted
            if ratio > LEAST_RATIO:
                here = trial
            if ratio > GOOD_RATIO:
                radius = min(2.0 * radius, 1.0)
            elif ratio < POOR_RATIO:
                radius *= 0.4
            if radius < LAST_RADIUS:
                break
        return self._place(self._mounted(here.scaled))

    def _mounted(self, scaled: Array) -> _Trial:
        """The point whose muscles are at their least contraction in the longest pose, as they are
        mounted.
        """
        real = self.low + self.span * scaled
        longest = self.target.geometry.at(self._points(real[:-FREE_VARIABLES])).length.max()
        mounted = scaled.copy()
        mounted[-2] = (float(longest) - self.low[-2]) / self.span[-2]
        return self._trial(mounted)

    def _place(self, trial: _Trial) -> RoutePlace:
        real = self.low + self.span * trial.scaled
        values = trial.values
        return RoutePlace(
            self._points(real[:-FREE_VARIABLES]),
            float(real[-FREE_VARIABLES]),
            float(real[-1]),
            max(float(values.deficit.max(initial=0.0)), 0.0),
            max(float(values.violation.max(initial=0.0)), 0.0),
            trial.merit,
        )

    def _trial(self, scaled: Array) -> _Trial:
        values = self.values(scaled)
        return _Trial(scaled, values, self.merit(scaled, values))

    def _step(self, here: _Trial, residuals: Array, radius: float) -> tuple[Array, float]:
        """The step of the linear problem with residuals (N + H,), and the gain that it predicts."""
        from scipy.optimize import linprog

        scaled = here.scaled
        slopes = here.values.slopes
        count = len(scaled)
        demands = len(here.values.deficit)
        supply = self.table.pressure[-1]
        # the variables: the step, the greatest deficit, the greatest violation
        cost = np.zeros(count + 2)
        cost[count - 1] = self.span[-1] / supply
        cost[count] = DEFICIT_WEIGHT
        cost[count + 1] = VIOLATION_WEIGHT
        rows = np.zeros((len(residuals), count + 2))
        rows[:, :count] = slopes
        rows[:demands, count] = -1.0
        rows[demands:, count + 1] = -1.0
        low = np.maximum(-radius, -scaled)
        high = np.minimum(radius, 1.0 - scaled)
        bounds = [*zip(low, high, strict=True), (0.0, None), (0.0, None)]
        solution = linprog(cost, A_ub=rows, b_ub=-residuals, bounds=bounds, method="highs")
        if solution.x is None:
            return np.zeros(count), 0.0
        step = np.asarray(solution.x[:count])
        pressure = self.low[-1] + self.span[-1] * scaled[-1]
        reached = pressure / supply + float(solution.fun)
        return step, here.merit - reached
