"""Function body in a language of expressions: each value is named once, choices are conditional
expressions.
"""

import abc
import dataclasses
import math
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import NamedTuple

from ..ir.emission import FunctionBlock, TargetLanguage
from ..ir.instructions import Operand

_NUMBERED = re.compile(r"\bv\d+\b")
_DEFINED = re.compile(r"^\s*(?:const )?(?:\w+ )?(v\d+) = ")


class Label(NamedTuple):
    """The name of a quantity as an identifier, and its unit and meaning."""

    name: str
    remark: str = ""


NO_LABEL = Label("")
Labels = Mapping[str, Sequence[Label]]
"""The labels of the elements of arrays, by the name of the array."""


@dataclasses.dataclass(frozen=True)
class TextLanguage(TargetLanguage):
    """A language with infix operators; a subclass states what it writes."""

    labels: Labels = dataclasses.field(default_factory=dict, hash=False, kw_only=True)

    language = ""
    """Name in messages."""
    equal = "=="
    unequal = "!="
    either = "||"
    margin = "  "
    end = ";"
    """What stands before and after every statement."""
    infinity = "INFINITY"
    not_a_number = "NAN"
    remark = "// {}"
    """A comment at the end of a line."""
    begin_branch = "  if ({}) {{"
    end_branch = "  }"
    branches = True
    """Whether functions have branches."""

    def body(self, scalars: Sequence[str] = ()) -> "TextBody":
        return TextBody(self, scalars)

    def literal(self, value: float) -> str:
        """A number that is not negative; it is read back as the same number."""
        return self.infinity if math.isinf(value) else repr(value)

    def constant(self, value: float) -> str:
        """A number."""
        if math.isnan(value):
            return self.not_a_number
        text = self.literal(abs(value))
        return f"(-{text})" if math.copysign(1.0, value) < 0 else text

    def defines(self) -> tuple[str, str]:
        """What stands before the name of a value at its definition, and of one that a branch may
        change.
        """
        return "", ""

    def element(self, array: str, index: int) -> str:
        """An array element as an expression."""
        return f"{array}[{index}]"

    @abc.abstractmethod
    def call(self, function: str, x: Sequence[str]) -> str:
        """A function, by its name in C, as an expression."""

    def conditional(self, body: "TextBody", test: str, when_true: str, when_false: str) -> str:
        """The name of one of two values, by a test."""
        return body.put(f"({test}) ? {when_true} : {when_false}")


class TextBody(FunctionBlock):
    """The lines of one function in a language `syntax`.

    `read` and `written` are the arrays that the function uses so far, `loaded` and `stored` the
    places of their values by name, `sizes` the lengths of the arrays that are written.
    """

    def __init__(self, syntax: TextLanguage, scalars: Sequence[str] = ()) -> None:
        super().__init__(scalars)
        self.syntax = syntax
        self.language = syntax.language
        self.read: set[str] = set()
        self.written: set[str] = set()
        self.loaded: dict[str, tuple[str, int]] = {}
        self.stored: dict[str, tuple[str, int]] = {}
        self.sizes: dict[str, int] = {}
        self._defines, self._declares = syntax.defines()

    def constant(self, value: float) -> str:
        return self.syntax.constant(value)

    def arithmetic(self, operator: str, a: str, b: str) -> str:
        return self.put(f"{a} {operator} {b}")

    def negative(self, a: str) -> str:
        return self.put(f"-{a}")

    def call(self, function: str, x: Sequence[str]) -> str:
        return self.put(self.syntax.call(function, x))

    def choose(self, comparison: str, a: str, b: str, when_true: str, when_false: str) -> str:
        relation = {"==": self.syntax.equal, "!=": self.syntax.unequal}.get(comparison, comparison)
        return self.syntax.conditional(self, f"{a} {relation} {b}", when_true, when_false)

    def load(self, array: str, index: int) -> str:
        self.read.add(array)
        if array in self.scalars:
            return array
        value = self.put(self.syntax.element(array, index))
        self.loaded[value] = array, index
        return value

    def store(self, array: str, index: int, value: str) -> None:
        self.written.add(array)
        self.sizes[array] = max(self.sizes.get(array, 0), index + 1)
        self.stored.setdefault(value, (array, index))
        self.lines.append(self._assigned(self.syntax.element(array, index), value))

    def assignment(self, name: str, expression: str) -> str:
        return self._assigned(f"{self._defines}{name}", expression)

    def _assigned(self, variable: str, value: str) -> str:
        return f"{self.syntax.margin}{variable} = {value}{self.syntax.end}"

    def name_values(
        self, labels: Labels, named: Mapping[str, tuple[str, int]], taken: Collection[str]
    ) -> None:
        """Give the values that stand in arrays with labels the names of these, unless a name is
        taken.

        `named` are the places of further values.
        """
        names: dict[str, Label] = {}
        places = {**named, **self.stored, **self.loaded}
        used = {"", *taken}
        for value, (array, index) in sorted(
            places.items(), key=lambda item: item[0] in self.stored
        ):
            label = labels[array][index] if index < len(labels.get(array, ())) else None
            if (
                label
                and _NUMBERED.fullmatch(value)
                and label.name not in used
                and not _NUMBERED.fullmatch(label.name)
            ):
                names[value] = label
                used.add(label.name)
        for number, line in enumerate(self.lines):
            definition = _DEFINED.match(line)
            remark = names[definition[1]].remark if definition and definition[1] in names else ""
            text = _NUMBERED.sub(
                lambda value: names[value[0]].name if value[0] in names else value[0], line
            )
            self.lines[number] = f"{text}  {self.syntax.remark.format(remark)}" if remark else text

    def unless_zero(
        self,
        gates: Sequence[str],
        compute: Callable[[], dict[Operand, str]],
        instead: Mapping[Operand, str],
    ) -> dict[Operand, str]:
        if not self.syntax.branches:
            return super().unless_zero(gates, compute, instead)
        syntax = self.syntax
        joined = {operand: self.new_name() for operand in instead}
        self.lines += [
            self._assigned(f"{self._declares}{joined[o]}", value) for o, value in instead.items()
        ]
        tests = f" {syntax.either} ".join(
            f"{gate} {syntax.unequal} {self.constant(0.0)}" for gate in gates
        )
        self.lines.append(syntax.begin_branch.format(tests))
        # values of the block are not available after it
        outside = self.known
        self.known = dict(self.known)
        begin = len(self.lines)
        inside = compute()
        self.known = outside
        self.lines += [self._assigned(name, inside[operand]) for operand, name in joined.items()]
        self.lines[begin:] = [f"  {line}" for line in self.lines[begin:]]
        self.lines += [syntax.end_branch] if syntax.end_branch else []
        return joined
