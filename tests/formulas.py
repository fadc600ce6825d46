"""Formulas over `ops`, one for each kind of operation, and each of them as a system."""

from __future__ import annotations

from airmuscle.core import StateVariable, System, model, ops, parameter

FORMULAS = {
    "products": lambda x, y: (x + 2 * y) * (x - y) / (4 + y * y) - x,
    "powers": lambda x, y: (
        (2 + ops.absolute_value(x)) ** 1.7
        + x**3
        + y**2
        + (4 + y) ** -1
        + (3 + x) ** (2 + y)
        + (3 + y) ** (3 + y)
    ),
    "roots": lambda x, y: ops.sqrt(x * x + y * y + 1),
    "exponentials": lambda x, y: ops.exp(x / 4) * ops.log(5 + y) + ops.exp(x * y) * ops.exp(y),
    "angles": lambda x, y: ops.sin(x) * ops.cos(y) + ops.tan(x / 4) - ops.arctan(y * x),
    "hyperbolics": (
        lambda x, y: ops.sinh(x / 3) - ops.cosh(y / 3) * x + ops.arcsinh(x * y) * ops.tanh(y)
    ),
    "choices": (
        lambda x, y: (
            ops.where(x >= y, x * y, y * y - 1) + ops.where(ops.both(x > 0, y > 0), x * x, -1.0)
        )
    ),
    "extremes": (
        lambda x, y: (
            ops.maximum(x, y) * 2 - ops.minimum(x * y, 1.0) * y + ops.clip(x, -1.0, 1.0) * x
        )
    ),
    "untaken": (
        lambda x, y: ops.where(x > 0.25, ops.sqrt(ops.maximum(x - 0.25, 0.0)), 0.0 * y) + x * y
    ),
    "tangents": (
        lambda x, y: (
            ops.where(x * y >= 0, 0.0, x * y) * (y - x) + ops.where(y <= 0, 0.0, y * (3 + x)) + x
        )
    ),
}


@model
class Formula(System):
    """One formula of two states and a parameter, as a system."""

    formula: str
    shift: float = parameter("1", "s", "added to the first argument", default=0.25)
    inputs = ()

    @property
    def states(self):
        return StateVariable("x", "1", 1.0), StateVariable("y", "1", 1.0)

    def rates(self, state, inputs):
        value = FORMULAS[self.formula](state["x"] + self.shift, state["y"])
        return {"x": value, "y": value * value - state["y"]}

    def outputs(self, state, inputs):
        return {"double": 2 * FORMULAS[self.formula](state["x"] + self.shift, state["y"])}
