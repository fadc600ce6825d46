"""Text of printed functions for learning: PyTorch functions of tensors, and Warp kernels, a thread a column."""

import dataclasses
from collections.abc import Sequence

from ..ir.emission import FunctionBlock
from .body import TextBody, TextLanguage

_OWN = ("asinh", "log1p", "expm1")
"""Functions that Warp does not have; the module defines them."""


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

    def begin_branch(self, test: str) -> str:
        return f"    if {test}:"

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
