"""Where a contraction surface is impossible, and a fit that is possible everywhere on its box.

Under more load a muscle cannot be shorter, and under more pressure it cannot be longer: k must not rise with
F nor fall with p. As k = k_max (1 - exp v) falls with v, and v is linear in its coefficients, that is a set
of linear inequalities; written for the Bernstein coefficients of the slopes of v on a few cells, which
enclose the slopes, they hold at every point of the box and not on a grid alone.
"""

from __future__ import annotations

import dataclasses
import enum
import itertools
import math

import numpy as np
from numpy.polynomial import chebyshev

from .. import trace
from ..characteristic.base import ContractionLaw
from ..errors import IdentificationError
from ..recording import Recording
from .exponential_surface import SurfaceFit, SurfaceProblem
from .places import places
from .surface_basis import Array, LoadBox

MARGIN = 1e-9
"""Least slope of v on the box scaled to -1..1, so that rounding turns no level stretch round; chosen."""


class Rule(enum.Enum):
    """What a possible contraction surface never does."""

    RISES_WITH_FORCE = "contraction rises with force"
    FALLS_WITH_PRESSURE = "contraction falls with pressure"


@dataclasses.dataclass(frozen=True)
class MonotonicityBreak:
    """One connected place of a box where a surface breaks a rule."""

    rule: Rule
    pressure: tuple[float, float]
    """Gauge pressures [Pa] between which it lies."""
    force: tuple[float, float]
    """Forces [N] between which it lies."""
    share: float
    """Its part of the box [1]."""
    worst: tuple[float, float]
    """Gauge pressure [Pa] and force [N] where the rule is broken most."""
    worst_slope: float
    """The slope there [1/N or 1/Pa]."""

    def __str__(self) -> str:
        (p0, p1), (f0, f1) = self.pressure, self.force
        return (
            f"{self.rule.value} between {p0 / 1e5:.2f} and {p1 / 1e5:.2f} bar, {f0:.0f} and {f1:.0f} N "
            f"({self.share:.1%} of the box), most at {self.worst[0] / 1e5:.2f} bar and {self.worst[1]:.0f} N"
        )


def monotonicity_breaks(
    law: ContractionLaw, box: LoadBox | None = None, points: tuple[int, int] = (201, 201)
) -> tuple[MonotonicityBreak, ...]:
    """The places in a box where k rises with F or falls with p, largest first.

    Without a box it is the law's own. Exact slopes are looked at on `points` even pressures and forces, edges included.
    """
    box = box or LoadBox.of_law(law)
    pressure, force = box.grid(*points)
    found: list[MonotonicityBreak] = []
    for rule, argument, sign in ((Rule.RISES_WITH_FORCE, 1, 1.0), (Rule.FALLS_WITH_PRESSURE, 0, -1.0)):
        slope = trace.slope(law, "contraction", pressure, force, wrt=argument)
        found += [
            MonotonicityBreak(rule, p.first, p.second, p.share, p.worst, sign * p.height)
            for p in places(sign * slope, pressure, force)
        ]
    return tuple(sorted(found, key=lambda b: -b.share))


def monotone(
    recording: Recording,
    saturation: float,
    *,
    pressure_degree: int = 4,
    force_degree: int = 2,
    cells: tuple[int, int] = (16, 12),
) -> SurfaceFit:
    """Fit k by least squares among the surfaces that never rise with F nor fall with p.

    `recording` has pressure [Pa], force [N] and contraction [1]; `saturation` is k_max [1]. The slopes are
    enclosed on `cells` parts of the box in pressure and force; more of them cost time and lose less.
    Gauss-Newton steps, each a least-squares problem under linear inequalities. Raises IdentificationError.
    """
    problem = SurfaceProblem.of(recording, saturation, pressure_degree, force_degree)
    constraints = slope_constraints(pressure_degree, force_degree, cells)
    targets, weights = problem.linear_targets()
    found = constrained(weights[:, None] * problem.columns, weights * targets, constraints, MARGIN)
    for _ in range(200):
        errors = problem.modelled(found) - problem.contraction
        slopes = problem.slopes(found)
        step = constrained(slopes, slopes @ found - errors, constraints, MARGIN) - found
        # where no part of the step helps, rounding is all that is left
        shorter = (t * step for t in 0.5 ** np.arange(20))
        step = next((s for s in shorter if _squares(problem, found + s) <= errors @ errors), 0.0 * step)
        found = found + step
        if np.abs(step).max() < 1e-10:
            return problem.fit(found, "nonlinear least squares, monotone on the box")
    raise IdentificationError(
        f"{recording.origin}: the monotone fit did not settle in 200 steps. Lower a degree, or fewer cells."
    )


def _squares(problem: SurfaceProblem, coefficients: Array) -> float:
    errors = problem.modelled(coefficients) - problem.contraction
    return float(errors @ errors)


def slope_constraints(pressure_degree: int, force_degree: int, cells: tuple[int, int]) -> Array:
    """Rows g: v with Chebyshev coefficients c falls with p and rises with F on the box if all g @ c >= 0.

    They are the Bernstein coefficients of -dv/dx and dv/dy on every cell; a polynomial lies between the least
    and the greatest of its Bernstein coefficients, so the condition suffices. It is nearly necessary on small
    cells.
    """
    falls_with_p = -np.kron(
        _enclosure(pressure_degree, cells[0], slope=True), _enclosure(force_degree, cells[1], slope=False)
    )
    rises_with_f = np.kron(
        _enclosure(pressure_degree, cells[0], slope=False), _enclosure(force_degree, cells[1], slope=True)
    )
    return np.vstack([falls_with_p, rises_with_f])


def _enclosure(degree: int, cells: int, *, slope: bool) -> Array:
    """Bernstein coefficients, on even cells of -1..1, of T_0..T_degree or their slopes, one column each."""
    size = degree if slope else degree + 1
    t = np.linspace(0.0, 1.0, size) if size > 1 else np.array([0.5])
    order = np.arange(size)
    binomials = np.array([math.comb(size - 1, int(j)) for j in order])
    bernstein = binomials * t[:, None] ** order * (1.0 - t[:, None]) ** (size - 1 - order)
    edges = np.linspace(-1.0, 1.0, cells + 1)
    blocks = []
    for low, high in itertools.pairwise(edges):
        x = low + (high - low) * t
        if slope:
            unit = np.eye(degree + 1)
            values = np.column_stack([chebyshev.chebval(x, chebyshev.chebder(e)) for e in unit])
        else:
            values = chebyshev.chebvander(x, degree)
        blocks.append(np.linalg.solve(bernstein, values))
    return np.vstack(blocks)


def constrained(matrix: Array, right: Array, rows: Array, least: float) -> Array:
    """The x that minimises |matrix x - right| subject to rows x >= least.

    With matrix = Q R and z = R x - Q^T right it is the shortest z with rows R^-1 z >= least - rows R^-1 Q^T
    right, which Lawson and Hanson, Solving Least Squares Problems (1974), chapter 23, reduce to non-negative
    least squares.
    """
    from scipy.linalg import solve_triangular
    from scipy.optimize import nnls

    q, r = np.linalg.qr(matrix)
    inner = solve_triangular(r, rows.T, trans="T").T
    free = q.T @ right
    bound = least - inner @ free
    target = np.zeros(r.shape[0] + 1)
    target[-1] = 1.0
    dual, remainder = nnls(np.vstack([inner.T, bound]), target, maxiter=50 * len(rows))
    residual = np.vstack([inner.T, bound]) @ dual - target
    if remainder < 1e-12:
        raise IdentificationError("No surface of this degree keeps the inequalities; raise a degree.")
    shortest = -residual[:-1] / residual[-1]
    return np.asarray(solve_triangular(r, shortest + free))
