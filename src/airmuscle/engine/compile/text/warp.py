"""Warp text of printed functions: kernels of arrays (elements, count), one thread for each column."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from ..ir.emission import FunctionBlock, TargetLanguage
from .body import Labels, TextBody

_OWN = ("asinh", "log1p", "expm1")
"""Functions that Warp does not have; the module defines them."""


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

    def choose(self, test: str, when_true: str, when_false: str) -> str:
        return self.put(f"wp.where({test}, {when_true}, {when_false})")

    def call(self, function: str, x: Sequence[str]) -> str:
        return self.put(f"{'' if function in _OWN else 'wp.'}{function}({', '.join(x)})")

    def begin_branch(self, test: str) -> str:
        return f"    if {test}:"


@dataclasses.dataclass(frozen=True)
class WarpLanguage(TargetLanguage):
    """Kernels of a Python module in which `wp`, the type `real` and the functions of _OWN are defined."""

    labels: Labels = dataclasses.field(default_factory=dict, hash=False)

    def body(self, scalars: Sequence[str] = ()) -> WarpBody:
        return WarpBody(scalars)

    def function(self, name: str, inputs: Sequence[str], outputs: Sequence[str], body: FunctionBlock) -> str:
        assert isinstance(body, WarpBody)
        given = [f"{a}: {'real' if a in body.scalars else 'wp.array2d(dtype=real)'}" for a in (*inputs, *outputs)]
        head = ["@wp.kernel(enable_backward=False)", f"def {name}({', '.join(given)}):", "    column = wp.tid()"]
        return "\n".join([*head, *body.lines, "", ""])
