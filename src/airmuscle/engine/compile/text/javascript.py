"""JavaScript text of printed functions: an ECMAScript module of functions of arrays."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from ..ir.emission import FunctionBlock, TargetLanguage
from .body import Labels, TextBody


class JavaScriptBody(TextBody):
    """The lines of a JavaScript function."""

    language = "JavaScript"
    equal, unequal = "===", "!=="
    infinity, not_a_number = "Infinity", "NaN"

    defines, declares = "const ", "let "

    def remark(self, text: str) -> str:
        return f"// {text}"

    def element(self, array: str, index: int) -> str:
        return f"{array}[{index}]"

    def choose(self, test: str, when_true: str, when_false: str) -> str:
        return self.put(f"({test}) ? {when_true} : {when_false}")

    def call(self, function: str, x: Sequence[str]) -> str:
        return self.put(f"Math.{function}({', '.join(x)})")

    def begin_branch(self, test: str) -> str:
        return f"  if ({test}) {{"


@dataclasses.dataclass(frozen=True)
class JavaScriptLanguage(TargetLanguage):
    """An ECMAScript module whose functions write into the arrays that they are given.

    prefix    beginning of the name of every function
    exported  whether the functions can be imported from the module
    """

    prefix: str = ""
    exported: bool = True

    labels: Labels = dataclasses.field(default_factory=dict, hash=False)

    def body(self, scalars: Sequence[str] = ()) -> JavaScriptBody:
        return JavaScriptBody(scalars)

    def function(self, name: str, inputs: Sequence[str], outputs: Sequence[str], body: FunctionBlock) -> str:
        head = f"{'export ' if self.exported else ''}function {self.prefix}{name}({', '.join([*inputs, *outputs])}) {{"
        return "\n".join([head, *body.lines, "}", ""])
