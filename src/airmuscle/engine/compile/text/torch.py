"""PyTorch text of printed functions: functions of tensors whose first dimension is that of the array's elements."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence

from ..ir.emission import FunctionBlock, TargetLanguage
from ..ir.instructions import Operand
from .body import Labels, TextBody


class TorchBody(TextBody):
    """The lines of a function of tensors; both sides of every choice are computed."""

    language = "PyTorch"
    margin, end = "    ", ""
    infinity, not_a_number = 'float("inf")', 'float("nan")'

    def remark(self, text: str) -> str:
        return f"# {text}"

    def element(self, array: str, index: int) -> str:
        return f"{array}[{index}]"

    def choose(self, test: str, when_true: str, when_false: str) -> str:
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

    def unless_zero(
        self, gates: Sequence[str], compute: Callable[[], dict[Operand, str]], instead: Mapping[Operand, str]
    ) -> dict[Operand, str]:
        inside = compute()  # without a branch: a product with the gate is zero, but its derivative by the gate is not
        return {operand: inside[operand] for operand in instead}


@dataclasses.dataclass(frozen=True)
class TorchLanguage(TargetLanguage):
    """Functions of a Python module in which `torch` and `stacked` are defined; arrays are sequences of tensors.

    A function returns what `stacked` makes of the list of tensors of its array.
    """

    labels: Labels = dataclasses.field(default_factory=dict, hash=False)

    def body(self, scalars: Sequence[str] = ()) -> TorchBody:
        return TorchBody(scalars)

    def function(self, name: str, inputs: Sequence[str], outputs: Sequence[str], body: FunctionBlock) -> str:
        assert isinstance(body, TorchBody)
        like = next(a for a in inputs if a not in body.scalars)
        lines = [f"def {name}({', '.join(inputs)}):", f"    like = {like}[0]"]
        lines += [f"    {a} = [0.0] * {body.sizes.get(a, 0)}" for a in outputs]
        return "\n".join(
            [*lines, *body.lines, f"    return {', '.join(f'stacked({a}, like)' for a in outputs)}", "", ""]
        )
