"""Traced law as an expression of its arguments and parameters."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any

from ...core import autodiff
from .expression import FUNCTIONS, Expressions, Node


def traced_expression(law: Any, method: str, expressions: Expressions, arguments: Sequence[Node],
                      parameters: Sequence[Node]) -> Node | None:  # fmt: skip
    """A method of a law at these arguments, with these nodes in place of its parameters, in the order of the leaves.

    None if the law cannot be traced, or contains an operation without a notation.
    """
    import casadi

    if not law.traceable:
        return None
    model, vector = autodiff.symbolic(law)
    symbols = [casadi.SX.sym(f"x{i}") for i in range(len(arguments))]
    value = casadi.SX(getattr(model, method)(*symbols))
    autodiff.check_finite(value, f"{type(law).__name__}.{method}")
    function = casadi.Function("law", [*symbols, vector], casadi.cse([value]))
    return _read(function, expressions, arguments, parameters)


def _read(function: Any, new: Expressions, arguments: Sequence[Node], parameters: Sequence[Node]) -> Node | None:
    """The output of a CasADi function from its list of instructions."""
    import casadi

    kinds, current, result = _kinds(), dict[int, Node](), new.number(0.0)
    for k in range(function.n_instructions()):
        code, target, source = (
            function.instruction_id(k),
            function.instruction_output(k),
            function.instruction_input(k),
        )
        if code == casadi.OP_OUTPUT:
            result = current[source[0]]
        elif code == casadi.OP_CONST:
            current[target[0]] = new.number(function.instruction_constant(k))
        elif code == casadi.OP_INPUT:
            inputs = arguments[source[0]] if source[0] < len(arguments) else parameters[source[1]]
            current[target[0]] = inputs
        elif code in kinds:
            current[target[0]] = _apply(new, kinds[code], [current[i] for i in source])
        else:
            return None
    return result


def _apply(new: Expressions, kind: str, values: list[Node]) -> Node:
    match kind:
        case "assign":
            return values[0]
        case "sub":
            return new.add(values[0], new.negative(values[1]))
        case "sq":
            return new.product(values[0], values[0])
        case "twice":
            return new.product(new.number(2.0), values[0])
        case "inv":
            return new.quotient(new.number(1.0), values[0])
    return new.apply(kind, *values)


@functools.cache
def _kinds() -> dict[int, str]:
    """Kinds of nodes by CasADi's number of the operation."""
    import casadi

    named = {
        "ASSIGN": "assign", "ADD": "add", "SUB": "sub", "MUL": "mul", "DIV": "div", "NEG": "neg", "SQ": "sq",
        "TWICE": "twice", "INV": "inv", "FABS": "abs", "POW": "pow", "CONSTPOW": "pow", "FMIN": "min", "FMAX": "max",
        "LT": "lt", "LE": "le", "EQ": "eq", "NE": "ne", "NOT": "not", "AND": "and", "OR": "or", "IF_ELSE_ZERO": "if",
        **{name.upper(): name for name in FUNCTIONS if name != "abs"},
    }  # fmt: skip
    return {getattr(casadi, f"OP_{name}"): kind for name, kind in named.items()}
