"""Printed law: the characteristic of a muscle and its outline as JavaScript functions of arrays, parameters as inputs.

The functions write into arrays that they are given; x are the arguments, c is what `prepare(p, c)` made of the
parameters:

    force(x, c, f)          x = (p, eps), f = (F, dF/dp, dF/deps)
    contraction(x, c, f)    x = (p, F),   f = (eps, deps/dp, deps/dF)
    pressure(x, c, f)       x = (eps, F), f = (p, dp/deps, dp/dF)
    limits(c, f)            f = search ranges of pressure, contraction and force
    outline(x, c, f)        x = (eps, t), f = (axial position, radius), t from -1 to 1 along a segment
    volume(x, c, f)         x = (eps),    f = (V, dV/deps)

A direction that the law does not give in closed form is missing; the page searches for its root.
"""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import airmuscle as am

from ...core import AirmuscleError, TraceError, autodiff
from ...engine.compile.functions import Printer
from ...engine.compile.text.programs import JavaScriptLanguage
from ...physics.muscle.geometry.straight_fibre import FibreTube

DIRECTIONS = ("force", "contraction", "pressure")
_UNTRACEABLE = (AirmuscleError, RuntimeError, TypeError, ValueError)
"""Errors of a direction that needs numbers, as a root search does."""


@dataclasses.dataclass(frozen=True)
class LawProgram:
    """JavaScript text of a law: the names of its functions, the length of `c`, and fixed search ranges.

    `limits` are the six limits at the given parameters; the function of this name returns those of others.
    """

    text: str
    functions: tuple[str, ...]
    held: int
    limits: tuple[float, ...]


def print_law(law: am.characteristic.Characteristic, geometry: am.geometry.Geometry | None) -> LawProgram:
    """The program of a traceable law, and of the outline where the geometry is in closed form.

    Parameters are the leaves of the law, then those of the geometry unless it is part of the law. Raises TraceError
    for a law without a closed form.
    """
    model, p = autodiff.symbolic(parameter_model(law, geometry))
    model, shape = law_and_geometry(model, geometry)
    printer, names = Printer(JavaScriptLanguage(exported=False)), []
    for name, inputs, outputs in _functions(model, shape):
        printer.add(name, {**inputs, "p": p}, {"f": outputs})
        names.append(name)
    if not set(names) & set(DIRECTIONS):
        raise TraceError(f"{type(law).__name__} has no direction in closed form.")
    return LawProgram(printer.module(), tuple(names), printer.held, tuple(map(float, _limits(law))))


def parameter_model(law: am.characteristic.Characteristic, geometry: am.geometry.Geometry | None) -> Any:
    """What has the parameters of the page as leaves: the law, or the pair with a geometry that is not part of it."""
    return law if geometry is None or geometry == getattr(law, "geometry", None) else (law, geometry)


def law_and_geometry(model: Any, geometry: am.geometry.Geometry | None) -> tuple[Any, Any]:
    """The law and its geometry in what `parameter_model` has made of them."""
    return model if isinstance(model, tuple) else (model, None if geometry is None else model.geometry)


def _functions(model: Any, shape: Any) -> list[tuple[str, dict[str, Any], Any]]:
    """Name, arguments and results of every function that can be traced."""
    import casadi

    functions = []
    a, b = casadi.SX.sym("a"), casadi.SX.sym("b")
    for name in DIRECTIONS:
        value = _traced(getattr(model, name), a, b)
        if value is not None:
            x = casadi.vertcat(a, b)
            functions.append((name, {"x": x}, casadi.vertcat(value, casadi.jacobian(value, x).T)))
    limits = _traced(lambda: casadi.vertcat(*_limits(model)))
    if limits is not None:
        functions.append(("limits", {}, limits))
    volume = _traced(shape.volume, a) if shape is not None and shape.traceable else None
    if volume is not None:
        functions.append(("volume", {"x": a}, casadi.vertcat(volume, casadi.jacobian(volume, a))))
    outline = _traced(lambda: casadi.vertcat(*_outline(shape, a, b))) if shape is not None else None
    if outline is not None:
        functions.append(("outline", {"x": casadi.vertcat(a, b)}, outline))
    return [(name, inputs, casadi.densify(casadi.cse(outputs))) for name, inputs, outputs in functions]


def _traced(function: Callable[..., Any], *arguments: Any) -> Any:
    """The expression of a function, None where it needs numbers."""
    import casadi

    try:
        value = casadi.SX(function(*arguments))
        autodiff.check_finite(value, "law")
    except _UNTRACEABLE:
        return None
    return value


def _limits(model: Any) -> Sequence[Any]:
    return (*model.pressure_range, *model.contraction_range, *model.force_range)


def _outline(shape: Any, contraction: Any, t: Any) -> tuple[Any, Any]:
    """Axial position from the middle of a segment [m] and radius [m]. Raises TraceError for another geometry."""
    if isinstance(shape, am.geometry.Braid):
        return t * shape.resting_length * (1.0 - contraction) / 2, shape.radius_at(contraction)
    if isinstance(shape, FibreTube) and shape.traceable:
        axial, radius = shape.profile(contraction, t)
        return axial, radius
    raise TraceError(f"{type(shape).__name__}: the outline is not in closed form.")
