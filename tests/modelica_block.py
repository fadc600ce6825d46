"""The equations of an exported Modelica block, evaluated by Python: each defines one variable from
those before it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path

FUNCTIONS = {
    "log1p": math.log1p,
    "expm1": math.expm1,
    "asinh": math.asinh,
    "abs": abs,
    "sqrt": math.sqrt,
    "floor": math.floor,
    "exp": math.exp,
    "log": math.log,
    "sin": math.sin,
    "cos": math.cos,
    "tan": math.tan,
    "atan": math.atan,
    "asin": math.asin,
    "acos": math.acos,
    "tanh": math.tanh,
    "sinh": math.sinh,
    "cosh": math.cosh,
}


def equations_of(text: str):
    """The left and right sides of the equations, in their order, as expressions of Python."""
    text = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
    lines = text[text.index("  equation\n") : text.index("  end Plant;")].splitlines()[1:]
    for line in lines:
        left, _, right = line.partition("//")[0].strip().rstrip(";").partition(" = ")
        choice = re.fullmatch(r"noEvent\(if (.*) then (.*) else (.*)\)", right)
        if choice:
            right = f"(({choice[2]}) if ({choice[1]}) else ({choice[3]}))"
        yield left, right.replace("noEvent", "").replace("^", "**")


class ModelicaBlock:
    """The block of a package, with the names of its states, inputs and parameters."""

    def __init__(self, path: Path):
        text = path.read_text(encoding="utf-8")
        self._equations = [
            (left, compile(right, left, "eval")) for left, right in equations_of(text)
        ]
        words = re.findall(r"^    (input Real|Real|parameter Real) (\w+)\(", text, re.MULTILINE)
        names = {
            kind: [word for found, word in words if found == kind]
            for kind in ("Real", "input Real", "parameter Real")
        }
        self.states, self.inputs, self.parameters = names.values()

    def values(
        self, parameters: Sequence[float], states: Sequence[float], inputs: Sequence[float]
    ) -> dict[str, float]:
        """What the equations define, by name, in their order."""
        values = dict(zip(self.parameters, parameters, strict=True))
        values |= dict(zip(self.states, states, strict=True))
        values |= dict(zip(self.inputs, inputs, strict=True))
        defined = {}
        for left, right in self._equations:
            defined[left] = values[left] = eval(right, FUNCTIONS, values)
        return defined
