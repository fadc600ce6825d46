"""MATLAB text of printed functions, which GNU Octave runs as well: functions that return column vectors."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from ..ir.emission import FunctionBlock, TargetLanguage
from .body import Labels, TextBody

COMPLEX = ("sqrt", "log", "log1p", "asin", "acos", "pow")
"""Functions that return complex numbers outside their real domain; here the result is NaN there."""
REAL = "real_or_nan"
DEFINITION = f"""function y = {REAL}(x)
  y = real(x);
  if imag(x) ~= 0
    y = NaN;
  end
end
"""
"""A function that printed functions call."""


class MatlabBody(TextBody):
    """The lines of a MATLAB function."""

    language = "MATLAB"
    unequal = "~="
    infinity, not_a_number = "Inf", "NaN"
    end_branch = "  end"

    def remark(self, text: str) -> str:
        return f"% {text}"

    def element(self, array: str, index: int) -> str:
        return f"{array}({index + 1})"

    def choose(self, test: str, when_true: str, when_false: str) -> str:
        key = f"({test}) ? {when_true} : {when_false}"
        if key not in self._known:
            name = self.new_name()
            self.lines += [
                f"  if {test}",
                f"    {name} = {when_true};",
                "  else",
                f"    {name} = {when_false};",
                "  end",
            ]
            self._known[key] = name
        return self._known[key]

    def call(self, function: str, x: Sequence[str]) -> str:
        expression = f"{x[0]} ^ {x[1]}" if function == "pow" else f"{function}({', '.join(x)})"
        return self.put(f"{REAL}({expression})" if function in COMPLEX else expression)

    def begin_branch(self, test: str) -> str:
        return f"  if {test}"


@dataclasses.dataclass(frozen=True)
class MatlabLanguage(TargetLanguage):
    """Functions of one MATLAB file; what they compute is returned, `[f, J] = jac(x, u, c)`.

    prefix  beginning of the name of every function
    """

    prefix: str = ""

    labels: Labels = dataclasses.field(default_factory=dict, hash=False)

    def body(self, scalars: Sequence[str] = ()) -> MatlabBody:
        return MatlabBody(scalars)

    def function(self, name: str, inputs: Sequence[str], outputs: Sequence[str], body: FunctionBlock) -> str:
        assert isinstance(body, MatlabBody)
        head = f"function [{', '.join(outputs)}] = {self.prefix}{name}({', '.join(inputs)})"
        arrays = [f"  {a} = zeros({body.sizes.get(a, 0)}, 1);" for a in outputs]
        return "\n".join([head, *arrays, *body.lines, "end", ""])
