"""Calls of a law with numbers: its formula inside its range; outside the extended force, with a
warning, and the directions and slopes of that force.
"""

import contextlib
import contextvars
import copy
import functools
import inspect
import sys
import warnings
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple, TypeVar

import numpy as np  # noqa: TID251  (calls with numbers are not traced)

from ....core import AirmuscleWarning, Array, PhysicsError, Value, contraction_text, ops
from .beyond_range import ForceRange, extended_force
from .modes import formula_alone, is_formula_alone, is_unsolved_nan, values_or_nan
from .solve import solve_direction
from .validity_range import ValidityRange


class Slopes(NamedTuple):
    """Partial derivatives of the tension at a point of the surface."""

    by_pressure: Value
    """dF/dp at constant contraction [N/Pa]."""
    by_contraction: Value
    """dF/deps at constant pressure [N]; its negative is the stiffness per unit of contraction."""


_STATED = "_stated_range"
_OWN = "_own_range"
_REPORTED = "_reported_range"
"""What is stored with a law: range and permitted force that its muscle states, the range in calls,
and that a call outside was told."""
_SEARCH_MARGIN = 0.05
"""Contraction [1] below the range down to which a stretched sleeve is searched for (chosen)."""
_PRESSURE_STEP = 10.0
"""Step of the derivative of a sleeve's force by pressure [Pa] (chosen)."""
Method = Callable[..., Any]
Law = TypeVar("Law")


_SILENT = contextvars.ContextVar("silent_beyond_range", default=False)


@contextlib.contextmanager
def silent_beyond_range() -> Iterator[None]:
    """Within it, calls outside the range do not warn: the caller reports the range himself."""
    token = _SILENT.set(True)
    try:
        yield
    finally:
        _SILENT.reset(token)


def with_stated_range(law: Law, stated: ValidityRange | None, permitted_force: Any = None) -> Law:
    """The law with the validity range and the permitted force [N] of its muscle, which calls with
    numbers respect; an equal object. A variant by `replace` is another law, of which they are not
    known.
    """
    if stated is None and permitted_force is None:
        return law
    known = copy.copy(law)
    known.__dict__[_STATED] = stated, permitted_force
    for derived in (_OWN, _REPORTED):
        known.__dict__.pop(derived, None)
    return known


def stated_range(law: Any) -> ForceRange:
    """The range of a law in calls: that of its muscle, or its own."""
    own: ForceRange | None = law.__dict__.get(_OWN)
    if own is None:
        own = law.__dict__[_OWN] = ForceRange.of(law, *law.__dict__.get(_STATED, ()))
    return own


def searched_contractions(law: Any, limits: ForceRange) -> tuple[float, float]:
    """Contractions [1] between which a solution of the extended force is searched for."""
    low, high = law.contraction_range
    return min(low, limits.min_contraction - _SEARCH_MARGIN), high


def recorded_force(law: Any, model: Any, pressure: Value, contraction: Value) -> Value:
    """The expression of what `law.force` answers at symbols; `model` is the law with symbols for
    its parameters. A law that refuses what lies beyond its range is its formula.
    """
    if law.refuses_beyond:
        return model.force(pressure, contraction)
    limits = stated_range(law) if _STATED in law.__dict__ else ForceRange.of(model)
    extended = extended_force(model, limits, pressure, contraction)
    inside = _contains_traced(limits, pressure, contraction)
    return ops.where(inside, extended, ops.maximum(extended, 0.0))


def in_range(name: str, method: Method) -> Method:
    """A method of a law, `force`, `contraction`, `pressure` or `slopes`, with the behaviour of this
    module; symbols are passed on to the formula.
    """
    answer = _ANSWERS[name]
    signature = inspect.signature(method)

    @functools.wraps(method)
    def called(self: Any, *given: Any, **named: Any) -> Any:
        if named:
            given = signature.bind(self, *given, **named).args[1:]
        if len(given) != 2 or is_formula_alone() or str in map(type, given):
            return method(self, *given)
        if _is_of_jax(*given):
            return _answer_jax(name, self, method, *given)
        if ops.is_traced(*given):
            return method(self, *given)
        return answer(self, method, *given)

    return called


def _is_of_jax(*values: Any) -> bool:
    return any(type(x).__module__.partition(".")[0] in ("jax", "jaxlib") for x in values)


def _answer_jax(name: str, law: Any, method: Method, first: Value, second: Value) -> Any:
    """The answer to arrays of JAX: that to their numbers; within `jit` and `grad`, which have none,
    the recorded force, and NaN where another direction would have to be searched.
    """
    jax = sys.modules["jax"]
    traced = any(isinstance(x, jax.core.Tracer) for x in (first, second))
    if not traced:
        numbers = (np.asarray(x, dtype=float) for x in (first, second))
        return jax.tree.map(jax.numpy.asarray, _ANSWERS[name](law, method, *numbers))
    if law.refuses_beyond:
        return method(law, first, second)
    if name == "force":
        return recorded_force(law, law, first, second)
    answer = method(law, first, second)
    limits = stated_range(law)
    if name == "slopes":
        known = _contains_traced(limits, first, second)
    else:
        contraction = answer if name == "contraction" else first
        known = ops.both(contraction >= limits.min_contraction, contraction <= limits.end)
        known = ops.both(known, second <= _greatest_limit(law, limits))
    return jax.tree.map(lambda value: jax.numpy.where(known, value, np.nan), answer)


def _contains_traced(limits: ForceRange, pressure: Value, contraction: Value) -> Value:
    """Whether points of a traced program are inside a range."""
    inside = ops.both(contraction >= limits.min_contraction, contraction <= limits.max_contraction)
    if limits.pressure is None:
        return inside
    low, high = limits.pressure
    return ops.both(inside, ops.both(pressure >= low, pressure <= high))


def _force(law: Any, method: Method, pressure: Value, contraction: Value) -> Value:
    limits = stated_range(law)
    if limits.limits_inside and not law.refuses_beyond:
        method = functools.partial(_limited, method=method)
    is_number = type(pressure) is float and type(contraction) is float
    if is_number and limits.contains(pressure, contraction):  # the usual call, a short way
        return method(law, pressure, contraction)
    p, c, outside = _outside(limits, pressure, contraction)
    if not outside.any():
        return method(law, pressure, contraction)
    if law.refuses_beyond:
        value = method(law, pressure, contraction)
    else:
        inside = np.equal(outside, False)
        value = np.maximum(extended_force(law, limits, p, c), 0.0)
        if inside.any():
            inner = np.clip(c, limits.min_contraction, limits.end)
            with formula_alone():
                value = np.where(inside, method(law, p, inner), value)
        value = float(value) if np.ndim(value) == 0 else value
    _report(law, limits, p, c, outside)
    return value


def _limited(law: Any, pressure: Value, contraction: Value, method: Method) -> Value:
    """The force of the formula up to the limit of a rating."""
    limits = stated_range(law)
    with formula_alone():
        greatest = limits.greatest_force(law)
    force = method(law, pressure, contraction)
    return limits.limited(force, limits.rated_force(greatest), greatest)


def _contraction(law: Any, method: Method, pressure: Value, force: Value) -> Value:
    limits = stated_range(law)
    solution = _solution(law, method, pressure, force)
    p, c, outside = _outside(limits, pressure, solution, missing=not law.refuses_beyond)
    if not outside.any():
        return solution
    if not law.refuses_beyond:
        bounds = searched_contractions(law, limits)
        message = law._no_contraction_message
        beyond = np.logical_and(outside, _needs_search(law, limits, c, force))
        found = _search(law, limits, bounds, (p, force), beyond, message, wanted="contraction")
        c = np.where(beyond, found, c)
        solution = float(c) if c.ndim == 0 else c
    _report(law, limits, p, c, outside)
    return solution


def _pressure(law: Any, method: Method, contraction: Value, force: Value) -> Value:
    limits = stated_range(law)
    solution = _solution(law, method, contraction, force)
    p, c, outside = _outside(limits, solution, contraction, missing=not law.refuses_beyond)
    if not outside.any():
        return solution
    if not law.refuses_beyond:
        bounds = law.pressure_range
        message = law._no_pressure_message
        unsolved = np.logical_or(np.isnan(p), _needs_search(law, limits, c, force))
        beyond = np.logical_and(outside, unsolved)
        found = _search(law, limits, bounds, (c, force), beyond, message, wanted="pressure")
        p = np.where(beyond, found, p)
        solution = float(p) if p.ndim == 0 else p
    _report(law, limits, p, c, outside)
    return solution


def _slopes(law: Any, method: Method, pressure: Value, contraction: Value) -> Any:
    limits = stated_range(law)
    p, c, outside = _outside(limits, pressure, contraction)
    if not outside.any() or law.refuses_beyond or law.begins_at_straight_fibres:
        return method(law, pressure, contraction)
    _report(law, limits, p, c, outside)
    inner = np.clip(c, limits.min_contraction, limits.end)
    with formula_alone():
        try:
            formula = method(law, p, inner)
        except PhysicsError:  # beyond the end the law has no solution, because the muscle is slack
            if not (c > limits.end).all():
                raise
            zero = np.zeros(p.shape)
            formula = Slopes(zero, zero)
    stretched = c < limits.min_contraction

    def force_at(pressure: Array, contraction: Array) -> Array:
        extended: Array = np.maximum(extended_force(law, limits, pressure, contraction), 0.0)
        return extended

    # the extended force is linear in contraction beyond an end, and flat where it is limited
    step = np.where(stretched, -1e-7, 1e-7)
    force = force_at(p, c)
    wide = _PRESSURE_STEP
    above = force_at(p + wide, c)
    beyond = inner != c
    flat = ~beyond & (above == force)
    by_contraction = np.where(
        beyond, (force_at(p, c + step) - force) / step, formula.by_contraction
    )
    by_pressure = (above - force_at(p - wide, c)) / (2.0 * wide)
    slopes = (
        np.where(outside & (beyond | flat), by_pressure, formula.by_pressure),
        np.where(outside & flat, 0.0, by_contraction),
    )
    return Slopes(*(float(s) if np.ndim(s) == 0 else s for s in slopes))


_ANSWERS = {
    "force": _force,
    "contraction": _contraction,
    "pressure": _pressure,
    "slopes": _slopes,
}


def _outside(
    limits: ForceRange, pressure: Value, contraction: Value, missing: bool = False
) -> tuple[Array, Array, Array]:
    """Pressures and contractions as arrays of one shape, and which points are outside the range;
    `missing` ones count as outside, too."""
    p, c = np.broadcast_arrays(
        np.asarray(pressure, dtype=float), np.asarray(contraction, dtype=float)
    )
    outside = ~limits.contains(p, c)
    return p, c, outside if missing else outside & ~(np.isnan(p) | np.isnan(c))


def _solution(law: Any, method: Method, first: Value, second: Value) -> Value:
    """The solution of the formula; NaN where it has none and the law is extended."""
    if law.refuses_beyond:
        return method(law, first, second)
    with formula_alone():
        with contextlib.suppress(PhysicsError):
            return method(law, first, second)
        a, b = np.broadcast_arrays(np.asarray(first, float), np.asarray(second, float))
        solved = values_or_nan(functools.partial(method, law), a.ravel(), b.ravel())
    return solved.reshape(a.shape)


def _needs_search(law: Any, limits: ForceRange, contraction: Array, force: Value) -> Array:
    """Whether the solution of the formula is not that of the extended force: no contraction of the
    formula, or a force above the limit."""
    too_great = np.asarray(force, dtype=float) > _greatest_limit(law, limits)
    missed = np.logical_or(contraction < limits.min_contraction, contraction > limits.end)
    needed: Array = np.logical_or(np.logical_or(missed, too_great), np.isnan(contraction))
    return needed


def _greatest_limit(law: Any, limits: ForceRange) -> Value:
    """The force above which there is no solution [N], as a number."""
    with formula_alone():
        greatest = limits.greatest_force(law)
        return limits.limited(np.asarray(np.inf), limits.rated_force(greatest), greatest)


def _search(
    law: Any,
    limits: ForceRange,
    bounds: tuple[float, float],
    known_values: tuple[Array, Value],
    outside: Array,
    message: Callable[[float, float], str],
    wanted: str,
) -> Array:
    """The contraction or pressure at which the extended force is the given one, at the points
    outside; raises SolveError."""

    def response(x: Any, argument: Any, _: Any) -> Any:
        point = (argument, x) if wanted == "contraction" else (x, argument)
        return np.maximum(extended_force(law, limits, *point), 0.0)

    argument, force = np.broadcast_arrays(
        *(np.asarray(value, dtype=float) for value in known_values)
    )
    known = ~(np.isnan(argument) | np.isnan(force))
    sought = outside & known
    solved = np.full(argument.shape, np.nan)
    if sought.any():
        with formula_alone():
            solved[sought] = solve_direction(
                response,
                bounds,
                (argument[sought], force[sought]),
                1,
                message,
                "Available force",
                "N",
                falling=wanted == "contraction",
            )
    return solved


def _report(
    law: Any, limits: ForceRange, pressure: Array, contraction: Array, outside: Array
) -> None:
    """Warn of the first call of a law outside its range, with the place and the excess."""
    if not outside.any() or _REPORTED in law.__dict__ or is_unsolved_nan() or _SILENT.get():
        return
    law.__dict__[_REPORTED] = True
    text = "; ".join(excesses(limits, pressure[outside], contraction[outside]))
    warnings.warn(
        f"{type(law).__name__}: {text}. Beyond the range the force is that of a stretched sleeve,"
        " of a slack muscle, or extrapolated in pressure (docs: muscles, beyond the range)."
        " Later calls of this law outside are not reported.",
        AirmuscleWarning,
        stacklevel=5,
    )


def excesses(limits: ForceRange, pressure: Value, contraction: Value) -> list[str]:
    """Texts on the quantities outside a range, with the worst value and its excess."""
    texts = []
    bounds = (limits.min_contraction, limits.max_contraction)
    for name, values, (low, high), text in (
        ("contraction", contraction, bounds, _per_cent),
        ("pressure", pressure, limits.pressure or (-np.inf, np.inf), _kilopascal),
    ):
        excess = np.maximum(low - np.ravel(values), np.ravel(values) - high)
        worst = int(np.nanargmax(excess))
        if excess[worst] > 0.0:
            texts.append(
                f"the {name} {text(np.ravel(values)[worst])} is {text(excess[worst])} outside the"
                f" range {text(low)} to {text(high)}"
            )
    return texts


def _per_cent(value: float) -> str:
    return contraction_text(float(value))


def _kilopascal(value: float) -> str:
    return f"{value / 1e3:.4g} kPa"
