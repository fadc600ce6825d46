"""Text of printed functions: C99 in double or single precision, ECMAScript modules, MATLAB and
Octave; for learning PyTorch functions of tensors, and Warp kernels, a thread a column."""

import dataclasses
import math
from collections.abc import Sequence

from ..ir.emission import nearest_single
from .body import TextBody, TextLanguage

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
_OWN = ("asinh", "log1p", "expm1")
"""Functions that Warp does not have; the module defines them."""


@dataclasses.dataclass(frozen=True)
class CLanguage(TextLanguage):
    """C99 without memory allocation: void functions of arrays, in which every value is a constant.

    number  "double" or "float"
    prefix  beginning of the name of every function
    public  names of the functions that other files may call, without the prefix; None: all
    """

    number: str = "double"
    prefix: str = ""
    public: frozenset[str] | None = frozenset()

    language = "C"
    remark = "/* {} */"

    def defines(self) -> tuple[str, str]:
        return f"const {self.number} ", f"{self.number} "

    def literal(self, value: float) -> str:
        """In single precision the nearest number; what is too large for it becomes infinite, as in
        arithmetic.
        """
        if self.number == "double":  # INFINITY is a float, which clang would promote
            return "HUGE_VAL" if math.isinf(value) else repr(value)
        text = f"{nearest_single(value):.9g}"
        return (
            self.infinity if text == "inf" else text + ("" if set(".e") & set(text) else ".0") + "f"
        )

    def constant(self, value: float) -> str:
        """A number; NAN is a float, too."""
        return f"({self.number})NAN" if math.isnan(value) else super().constant(value)

    def call(self, function: str, x: Sequence[str]) -> str:
        suffix = "f" if self.number == "float" else ""
        return f"{'fabs' if function == 'abs' else function}{suffix}({', '.join(x)})"

    def function(
        self, name: str, inputs: Sequence[str], outputs: Sequence[str], body: TextBody
    ) -> str:
        number = self.number
        declarations = [
            f"{number} {a}" if a in body.scalars else f"const {number} *restrict {a}"
            for a in inputs
        ]
        results = [f"{number} *restrict {a}" for a in outputs]
        storage = "" if self.public is None or name in self.public else "static "
        head = f"{storage}void {self.prefix}{name}({', '.join([*declarations, *results])}) {{"
        unused = [f"  (void){a};" for a in (*inputs, *outputs) if a not in body.read | body.written]
        return "\n".join([head, *unused, *body.lines, "}", ""])


@dataclasses.dataclass(frozen=True)
class JavaScriptLanguage(TextLanguage):
    """An ECMAScript module whose functions write into the arrays that they are given.

    prefix    beginning of the name of every function
    exported  whether the functions can be imported from the module
    """

    prefix: str = ""
    exported: bool = True

    language = "JavaScript"
    equal = "==="
    unequal = "!=="
    infinity = "Infinity"
    not_a_number = "NaN"

    def defines(self) -> tuple[str, str]:
        return "const ", "let "

    def call(self, function: str, x: Sequence[str]) -> str:
        return f"Math.{function}({', '.join(x)})"

    def function(
        self, name: str, inputs: Sequence[str], outputs: Sequence[str], body: TextBody
    ) -> str:
        head = (
            f"{'export ' if self.exported else ''}function"
            f" {self.prefix}{name}({', '.join([*inputs, *outputs])}) {{"
        )
        return "\n".join([head, *body.lines, "}", ""])


@dataclasses.dataclass(frozen=True)
class MatlabLanguage(TextLanguage):
    """Functions of one MATLAB file; what they compute is returned, `[f, J] = jac(x, u, c)`.

    prefix  beginning of the name of every function
    """

    prefix: str = ""

    language = "MATLAB"
    unequal = "~="
    infinity = "Inf"
    not_a_number = "NaN"
    remark = "% {}"
    begin_branch = "  if {}"
    end_branch = "  end"

    def element(self, array: str, index: int) -> str:
        return f"{array}({index + 1})"

    def conditional(self, body: TextBody, test: str, when_true: str, when_false: str) -> str:
        key = f"{test} ? {when_true} : {when_false}"
        if key not in body.known:
            name = body.known[key] = body.new_name()
            body.lines += [
                f"  if {test}",
                f"    {name} = {when_true};",
                "  else",
                f"    {name} = {when_false};",
                "  end",
            ]
        return body.known[key]

    def call(self, function: str, x: Sequence[str]) -> str:
        expression = f"{x[0]} ^ {x[1]}" if function == "pow" else f"{function}({', '.join(x)})"
        return f"{REAL}({expression})" if function in COMPLEX else expression

    def function(
        self, name: str, inputs: Sequence[str], outputs: Sequence[str], body: TextBody
    ) -> str:
        results = ", ".join(outputs)
        arguments = ", ".join(inputs)
        lines = [f"function [{results}] = {self.prefix}{name}({arguments})"]
        for array in outputs:
            size = body.sizes.get(array, 0)
            lines.append(f"  {array} = zeros({size}, 1);")
        return "\n".join([*lines, *body.lines, "end", ""])


@dataclasses.dataclass(frozen=True)
class TorchLanguage(TextLanguage):
    """Functions of a Python module in which `torch` and `stacked` are defined; arrays are sequences
    of tensors.

    A function returns what `stacked` makes of the list of tensors of its array. Every choice
    computes both sides.
    """

    language = "PyTorch"
    margin = "    "
    end = ""
    infinity = 'float("inf")'
    not_a_number = 'float("nan")'
    remark = "# {}"
    branches = False  # a product with the gate is zero, but its derivative by the gate is not

    def conditional(self, body: TextBody, test: str, when_true: str, when_false: str) -> str:
        """A choice; two constants have the type of the tensors, not the default one of PyTorch."""
        if (when_true, when_false) == (self.constant(1.0), self.constant(0.0)):
            return body.put(f"({test}).to(like.dtype)")
        if not (when_true.isidentifier() or when_false.isidentifier()):
            when_true = f"torch.full_like(like, {when_true})"
        return body.put(f"torch.where({test}, {when_true}, {when_false})")

    def call(self, function: str, x: Sequence[str]) -> str:
        return f"torch.{function}({', '.join(x)})"

    def function(
        self, name: str, inputs: Sequence[str], outputs: Sequence[str], body: TextBody
    ) -> str:
        arguments = ", ".join(inputs)
        like = next(array for array in inputs if array not in body.scalars)
        lines = [f"def {name}({arguments}):", f"    like = {like}[0]"]
        for array in outputs:
            size = body.sizes.get(array, 0)
            lines.append(f"    {array} = [0.0] * {size}")
        lines += body.lines
        returned = ", ".join(f"stacked({array}, like)" for array in outputs)
        lines.append(f"    return {returned}")
        return "\n".join([*lines, "", ""])


@dataclasses.dataclass(frozen=True)
class WarpLanguage(TextLanguage):
    """Kernels of a Python module in which `wp`, the type `real` and the functions of _OWN are
    defined.
    """

    language = "Warp"
    margin = "    "
    end = ""
    either = "or"
    infinity = "real(wp.inf)"
    not_a_number = "real(wp.nan)"
    remark = "# {}"
    begin_branch = "    if {}:"
    end_branch = ""

    def literal(self, value: float) -> str:
        return self.infinity if math.isinf(value) else f"real({value!r})"

    def element(self, array: str, index: int) -> str:
        return f"{array}[{index}, column]"

    def conditional(self, body: TextBody, test: str, when_true: str, when_false: str) -> str:
        return body.put(f"wp.where({test}, {when_true}, {when_false})")

    def call(self, function: str, x: Sequence[str]) -> str:
        return f"{'' if function in _OWN else 'wp.'}{function}({', '.join(x)})"

    def function(
        self, name: str, inputs: Sequence[str], outputs: Sequence[str], body: TextBody
    ) -> str:
        declarations = [
            f"{a}: {'real' if a in body.scalars else 'wp.array2d(dtype=real)'}"
            for a in (*inputs, *outputs)
        ]
        head = [
            "@wp.kernel(enable_backward=False)",
            f"def {name}({', '.join(declarations)}):",
            "    column = wp.tid()",
        ]
        return "\n".join([*head, *body.lines, "", ""])
