"""C99 text of printed functions, in double or single precision."""

from __future__ import annotations

import dataclasses
import struct
from collections.abc import Sequence

from ..ir.emission import FunctionBlock, TargetLanguage
from .body import Labels, TextBody


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
        try:
            single: float = struct.unpack("<f", struct.pack("<f", value))[0]
        except OverflowError:
            return self.infinity
        return f"{single:.9g}" + ("" if any(c in f"{single:.9g}" for c in ".e") else ".0") + self._suffix

    def element(self, array: str, index: int) -> str:
        return f"{array}[{index}]"

    def choose(self, test: str, when_true: str, when_false: str) -> str:
        return self.put(f"({test}) ? {when_true} : {when_false}")

    def call(self, function: str, x: Sequence[str]) -> str:
        name = "fabs" if function == "abs" else function
        return self.put(f"{name}{self._suffix}({', '.join(x)})")

    def begin_branch(self, test: str) -> str:
        return f"  if ({test}) {{"


@dataclasses.dataclass(frozen=True)
class CLanguage(TargetLanguage):
    """C99 without memory allocation: void functions of arrays.

    number  "double" or "float"
    prefix  beginning of the name of every function
    public  names of the functions that other files may call, without the prefix; None: all
    """

    number: str = "double"
    prefix: str = ""
    public: frozenset[str] | None = frozenset()

    labels: Labels = dataclasses.field(default_factory=dict, hash=False)

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
