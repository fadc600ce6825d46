"""Polynomial surrogate: a traceable approximation of any characteristic, with the search for its
maximum error.
"""

import warnings
from collections.abc import Callable

import numpy as np

from ....core import AirmuscleWarning, Array, SolveError, Value, model, parameter
from ..geometry.base import check_degree
from .base import Characteristic, ForceLaw
from .contractile_surface import ContractileSurface, exponents
from .modes import values_or_nan
from .sampling import check_approximates, sample_force
from .validity_range import ValidityRange

_STARTS = 40
"""Points from which the search refines, chosen."""
_BISECTIONS = 12
"""Halvings of a grid step towards the edge of the solutions, chosen: 1/4096 of the step."""
_REFINEMENTS = 4
"""Local grids around each start, each three times finer than the one before, chosen: 1/81 of the
step.
"""
_OFFSETS = np.linspace(-1.0, 1.0, 7)
_Error = Callable[[Array, Array], Array]
_NO_CLAMP = 1e6
"""Force limit [N] of the surface, above that of any muscle, so that negative forces are
approximated as well.
"""
_MARGIN = 1.05
"""Factor of the maximum error that the search finds, chosen, for what lies between the points of
its last grids.
"""


@model
class PolynomialSurrogate(ForceLaw):
    """Polynomial surface fitted to another characteristic, with its errors on the validity range.

    `max_error` is estimated: 1.05 times the maximum that a search finds (grid, edge of the region
    with a solution, local refinement). It is no proven bound: a peak of the error narrower than
    1/38 of the range may be missed. `coverage` is the fraction of the validity range in which that
    characteristic has a solution; elsewhere the polynomial is extrapolated.
    """

    surface: ContractileSurface
    max_error: float = parameter(
        "N",
        "dF_max",
        "estimated maximum error on the validity range",
        bounds=(0.0, 1e9),
        fitted=False,
    )
    rms_error: float = parameter(
        "N",
        "dF_rms",
        "root mean square error on the validity range",
        bounds=(0.0, 1e9),
        fitted=False,
    )
    coverage: float = parameter(
        "1", "A", "fraction of the validity range with a solution", bounds=(0.0, 1.0), fitted=False
    )
    surrogate_of: str = ""

    @property
    def contraction_range(self) -> tuple[float, float]:
        return (self.surface.min_contraction, self.surface.max_contraction)

    def force(self, pressure: Value, contraction: Value) -> Value:
        return self.surface.force(pressure, contraction)


def as_force_law(
    law: Characteristic, validity_range: ValidityRange, *, degree: int = 9
) -> PolynomialSurrogate:
    """Return a traceable force law that approximates `law` on a validity range.

    A polynomial of total degree `degree` is fitted by least squares on a dense grid; the errors are
    evaluated on a second grid between its points, from which the search for the maximum error
    starts. Points without a solution are omitted, with an AirmuscleWarning that states their
    fraction. Raises SolveError if too few points have a solution, if the force is unbounded at one
    of them, as that of straight fibres at zero contraction, and if the polynomial does not
    approximate the law; ParameterError for a degree that is not an integer, 0 or more.
    """
    check_degree("as_force_law", degree)
    count = 4 * (degree + 1)
    pressure, contraction = _grid(validity_range, np.cos(np.pi * (np.arange(count) + 0.5) / count))
    force = sample_force("as_force_law", law, validity_range, pressure, contraction)
    known = np.isfinite(force)
    if known.sum() < 2 * len(exponents(degree)):
        raise SolveError(
            f"as_force_law: {type(law).__name__} has a solution at {known.sum()} of {known.size}"
            f" points of the validity range, too few for degree {degree}. Choose a validity range"
            " in which the model has solutions."
        )
    x, q = _scale(validity_range, pressure[known], contraction[known])
    powers = np.stack([x**i * q**j for i, j in exponents(degree)], axis=1)
    coefficients = np.linalg.lstsq(powers, force[known], rcond=None)[0]
    limits = (*validity_range.pressure, *validity_range.contraction, -_NO_CLAMP, _NO_CLAMP)
    return _with_errors(
        law, ContractileSurface(tuple(coefficients.tolist()), *limits, degree), validity_range
    )


def _with_errors(
    law: Characteristic, surface: ContractileSurface, limits: ValidityRange
) -> PolynomialSurrogate:
    """Return the surrogate of a fitted surface with its errors."""
    nodes = np.linspace(-1.0, 1.0, 4 * surface.degree + 3)
    pressure, contraction = _grid(limits, nodes)
    force = sample_force("as_force_law", law, limits, pressure, contraction)
    error = surface.force(pressure, contraction) - force
    known = np.isfinite(error)
    name = f"a polynomial of degree {surface.degree}"
    check_approximates("as_force_law", name, error[known], force[known])
    if not known.all():
        warnings.warn(
            f"{type(law).__name__} has no solution on {100 * (1 - known.mean()):.2g} % of the"
            " validity range; the values of its polynomial surrogate there are meaningless.",
            AirmuscleWarning,
            stacklevel=4,
        )

    def magnitude(x: Array, q: Array) -> Array:
        at = _physical(limits, x, q)
        return np.asarray(np.abs(surface.force(*at) - values_or_nan(law.force, *at)))

    largest = _MARGIN * estimate_maximum(
        magnitude, np.abs(error).reshape(nodes.size, nodes.size), nodes
    )
    rms = float(np.sqrt(np.mean(error[known] ** 2)))
    return PolynomialSurrogate(surface, largest, rms, float(known.mean()), type(law).__name__)


def _grid(validity_range: ValidityRange, nodes: Array) -> tuple[Array, Array]:
    """Pressures [Pa] and contractions [1] of all pairs of scaled nodes in -1..1, as two vectors."""
    q, x = (v.reshape(-1) for v in np.meshgrid(nodes, nodes, indexing="ij"))
    return _physical(validity_range, x, q)


def _physical(validity_range: ValidityRange, x: Array, q: Array) -> tuple[Array, Array]:
    """Pressures [Pa] and contractions [1] of the scaled contraction x and pressure q, -1..1."""
    p_low, p_high = validity_range.pressure
    c_low, c_high = validity_range.contraction
    pressure = np.clip(p_low + (q + 1) / 2 * (p_high - p_low), p_low, p_high)
    return pressure, np.clip(c_low + (x + 1) / 2 * (c_high - c_low), c_low, c_high)


def _scale(
    validity_range: ValidityRange, pressure: Array, contraction: Array
) -> tuple[Array, Array]:
    """Contraction and pressure scaled to -1..1 on the validity range."""
    p_low, p_high = validity_range.pressure
    c_low, c_high = validity_range.contraction
    return (
        2 * (contraction - c_low) / (c_high - c_low) - 1,
        2 * (pressure - p_low) / (p_high - p_low) - 1,
    )


def estimate_maximum(error: _Error, values: Array, nodes: Array) -> float:
    """Return the maximum of `error(x, y)` on -1..1 x -1..1 from its values on a grid, refined
    locally.

    `values[i, j]` is the error at x = nodes[j], y = nodes[i]; NaN marks points without a solution.
    From the greatest local maxima of the grid, and from the last points with a solution between a
    grid point that has one and a neighbour that has none, local grids follow the error to its
    maximum. A peak narrower than the grid step, away from these points, is not found: the result is
    an estimate, from below.
    """
    step = float(nodes[1] - nodes[0])
    starts = [_local_maxima(values, nodes), *_edges(error, values, nodes)]
    x, y, best = (np.concatenate(parts) for parts in zip(*starts, strict=True))
    first = np.argsort(best)[::-1][:_STARTS]
    x = x[first]
    y = y[first]
    best = best[first]
    dx, dy = (offset.reshape(-1) for offset in np.meshgrid(_OFFSETS, _OFFSETS))
    for _ in range(_REFINEMENTS):
        near = [np.clip(at[:, None] + step * d, -1.0, 1.0) for at, d in ((x, dx), (y, dy))]
        errors = np.nan_to_num(error(near[0].reshape(-1), near[1].reshape(-1)), nan=-1.0).reshape(
            near[0].shape
        )
        row = np.arange(len(x))
        column = errors.argmax(axis=1)
        better = errors[row, column] > best
        x, y = (
            np.where(better, points[row, column], at)
            for points, at in zip(near, (x, y), strict=True)
        )
        best = np.maximum(best, errors[row, column])
        step /= 3.0
    return float(best.max())


def _local_maxima(values: Array, nodes: Array) -> tuple[Array, Array, Array]:
    """Grid points with an error not below that of their neighbours, as vectors x, y and error."""
    padded = np.pad(np.nan_to_num(values, nan=-1.0), 1, constant_values=-1.0)
    rows, columns = values.shape
    neighbours = [padded[i : i + rows, j : j + columns] for i in range(3) for j in range(3)]
    i, j = np.nonzero((values >= np.max(neighbours, axis=0)) & np.isfinite(values))
    return nodes[j], nodes[i], values[i, j]


def _edges(error: _Error, values: Array, nodes: Array) -> list[tuple[Array, Array, Array]]:
    """Last points with a solution between neighbours of the grid of which one has none, as vectors
    x, y and error.
    """
    y, x = np.meshgrid(nodes, nodes, indexing="ij")
    edges = []
    for first, second in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:])):
        for inside, outside in ((first, second), (second, first)):
            at_edge = np.isfinite(values[inside]) & np.isnan(values[outside])
            if at_edge.any():
                limits = [(v[inside][at_edge], v[outside][at_edge]) for v in (x, y)]
                edges.append(_bisect(error, values[inside][at_edge], *limits))
    return edges


def _bisect(
    error: _Error, value: Array, x: tuple[Array, Array], y: tuple[Array, Array]
) -> tuple[Array, Array, Array]:
    """Last points with a solution on lines from points with one to points without, and the errors
    there.
    """
    share = np.zeros_like(value)
    width = 1.0
    for _ in range(_BISECTIONS):
        width /= 2.0
        tried = share + width
        at = error(*((1.0 - tried) * low + tried * high for low, high in (x, y)))
        known = np.isfinite(at)
        share = np.where(known, tried, share)
        value = np.where(known, at, value)
    at_x, at_y = ((1.0 - share) * low + share * high for low, high in (x, y))
    return at_x, at_y, value
