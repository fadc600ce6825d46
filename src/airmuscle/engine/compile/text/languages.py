"""Text of printed functions: C99 in double or single precision, ECMAScript modules, MATLAB and Octave; for learning
PyTorch functions of tensors, and Warp kernels, a thread a column."""

import dataclasses
from collections.abc import Sequence

from ..ir.emission import FunctionBlock, nearest_single
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


class CBody(TextBody):
    """The lines of a C function; every value is a constant of the type `number`."""

    language = "C"

    def __init__(self, scalars: Sequence[str] = (), number: str = "double") -> None:
        super().__init__(scalars)
        self.number, self._suffix = number, "f" if number == "float" else ""
        self.defines, self.declares = f"const {number} ", f"{number} "
        self.infinity = "INFINITY" if self._suffix else "HUGE_VAL"  # INFINITY is a float, which clang would promote

    def remark(self, text: str) -> str:
        return f"/* {text} */"

    def literal(self, value: float) -> str:
        """In single precision the nearest number; what is too large for it becomes infinite, as in arithmetic."""
        if not self._suffix:
            return repr(value)
        text = f"{nearest_single(value):.9g}"
        return self.infinity if text == "inf" else text + ("" if set(".e") & set(text) else ".0") + self._suffix

    def call(self, function: str, x: Sequence[str]) -> str:
        name = "fabs" if function == "abs" else function
        return self.put(f"{name}{self._suffix}({', '.join(x)})")


@dataclasses.dataclass(frozen=True)
class CLanguage(TextLanguage):
    """C99 without memory allocation: void functions of arrays.

    number  "double" or "float"
    prefix  beginning of the name of every function
    public  names of the functions that other files may call, without the prefix; None: all
    """

    number: str = "double"
    prefix: str = ""
    public: frozenset[str] | None = frozenset()

    def body(self, scalars: Sequence[str] = ()) -> CBody:
        return CBody(scalars, self.number)

    def signature(self, name: str, inputs: Sequence[str], outputs: Sequence[str], body: FunctionBlock) -> str:
        """The function without its body, as it stands in a header."""
        assert isinstance(body, CBody)
        arrays = [f"const {self.number} *restrict {a}" for a in inputs]
        numbers = [f"{self.number} {a}" for a in inputs]
        given = [numbers[i] if a in body.scalars else arrays[i] for i, a in enumerate(inputs)]
        results = [f"{self.number} *restrict {a}" for a in outputs]
        storage = "" if self.public is None or name in self.public else "static "
        return f"{storage}void {self.prefix}{name}({', '.join([*given, *results])})"

    def function(self, name: str, inputs: Sequence[str], outputs: Sequence[str], body: FunctionBlock) -> str:
        assert isinstance(body, CBody)
        unused = [f"  (void){a};" for a in (*inputs, *outputs) if a not in body.read | body.written]
        return "\n".join([self.signature(name, inputs, outputs, body) + " {", *unused, *body.lines, "}", ""])


class JavaScriptBody(TextBody):
    """The lines of a JavaScript function."""

    language = "JavaScript"
    equal, unequal = "===", "!=="
    infinity, not_a_number = "Infinity", "NaN"

    defines, declares = "const ", "let "

    def remark(self, text: str) -> str:
        return f"// {text}"

    def call(self, function: str, x: Sequence[str]) -> str:
        return self.put(f"Math.{function}({', '.join(x)})")


@dataclasses.dataclass(frozen=True)
class JavaScriptLanguage(TextLanguage):
    """An ECMAScript module whose functions write into the arrays that they are given.

    prefix    beginning of the name of every function
    exported  whether the functions can be imported from the module
    """

    prefix: str = ""
    exported: bool = True

    body_type = JavaScriptBody

    def function(self, name: str, inputs: Sequence[str], outputs: Sequence[str], body: FunctionBlock) -> str:
        head = f"{'export ' if self.exported else ''}function {self.prefix}{name}({', '.join([*inputs, *outputs])}) {{"
        return "\n".join([head, *body.lines, "}", ""])


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

    def conditional(self, test: str, when_true: str, when_false: str) -> str:
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
class MatlabLanguage(TextLanguage):
    """Functions of one MATLAB file; what they compute is returned, `[f, J] = jac(x, u, c)`.

    prefix  beginning of the name of every function
    """

    prefix: str = ""

    body_type = MatlabBody

    def function(self, name: str, inputs: Sequence[str], outputs: Sequence[str], body: FunctionBlock) -> str:
        assert isinstance(body, MatlabBody)
        head = f"function [{', '.join(outputs)}] = {self.prefix}{name}({', '.join(inputs)})"
        arrays = [f"  {a} = zeros({body.sizes.get(a, 0)}, 1);" for a in outputs]
        return "\n".join([head, *arrays, *body.lines, "end", ""])


class TorchBody(TextBody):
    """The lines of a function of tensors; both sides of every choice are computed."""

    language = "PyTorch"
    margin, end = "    ", ""
    infinity, not_a_number = 'float("inf")', 'float("nan")'

    def remark(self, text: str) -> str:
        return f"# {text}"

    def conditional(self, test: str, when_true: str, when_false: str) -> str:
        """A choice; two constants have the type of the tensors, not the default one of PyTorch."""
        if (when_true, when_false) == (self.constant(1.0), self.constant(0.0)):
            return self.put(f"({test}).to(like.dtype)")
        if not (when_true.isidentifier() or when_false.isidentifier()):
            when_true = f"torch.full_like(like, {when_true})"
        return self.put(f"torch.where({test}, {when_true}, {when_false})")

    def call(self, function: str, x: Sequence[str]) -> str:
        return self.put(f"torch.{function}({', '.join(x)})")

    unless_zero = FunctionBlock.unless_zero  # a product with the gate is zero, but its derivative by the gate is not


@dataclasses.dataclass(frozen=True)
class TorchLanguage(TextLanguage):
    """Functions of a Python module in which `torch` and `stacked` are defined; arrays are sequences of tensors.

    A function returns what `stacked` makes of the list of tensors of its array.
    """

    body_type = TorchBody

    def function(self, name: str, inputs: Sequence[str], outputs: Sequence[str], body: FunctionBlock) -> str:
        assert isinstance(body, TorchBody)
        like = next(a for a in inputs if a not in body.scalars)
        lines = [f"def {name}({', '.join(inputs)}):", f"    like = {like}[0]"]
        lines += [f"    {a} = [0.0] * {body.sizes.get(a, 0)}" for a in outputs]
        return "\n".join(
            [*lines, *body.lines, f"    return {', '.join(f'stacked({a}, like)' for a in outputs)}", "", ""]
        )


class WarpBody(TextBody):
    """The lines of a kernel; constants are of the type `real` of the module."""

    language = "Warp"
    margin, end, end_branch, either = "    ", "", "", "or"
    infinity, not_a_number = "real(wp.inf)", "real(wp.nan)"

    def remark(self, text: str) -> str:
        return f"# {text}"

    def literal(self, value: float) -> str:
        return f"real({value!r})"

    def element(self, array: str, index: int) -> str:
        return f"{array}[{index}, column]"

    def conditional(self, test: str, when_true: str, when_false: str) -> str:
        return self.put(f"wp.where({test}, {when_true}, {when_false})")

    def call(self, function: str, x: Sequence[str]) -> str:
        return self.put(f"{'' if function in _OWN else 'wp.'}{function}({', '.join(x)})")

    def begin_branch(self, test: str) -> str:
        return f"    if {test}:"


@dataclasses.dataclass(frozen=True)
class WarpLanguage(TextLanguage):
    """Kernels of a Python module in which `wp`, the type `real` and the functions of _OWN are defined."""

    body_type = WarpBody

    def function(self, name: str, inputs: Sequence[str], outputs: Sequence[str], body: FunctionBlock) -> str:
        assert isinstance(body, WarpBody)
        given = [f"{a}: {'real' if a in body.scalars else 'wp.array2d(dtype=real)'}" for a in (*inputs, *outputs)]
        head = ["@wp.kernel(enable_backward=False)", f"def {name}({', '.join(given)}):", "    column = wp.tid()"]
        return "\n".join([*head, *body.lines, "", ""])
