"""Function body in a language of expressions: each value is named once, choices are conditional expressions."""

import abc
import dataclasses
import math
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import ClassVar, NamedTuple

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


class TextBody(FunctionBlock, abc.ABC):
    """The lines of one function in a language with infix operators; a subclass states what its language writes.

    `read` and `written` are the arrays that the function uses so far, `loaded` and `stored` the places of their values
    by name, `sizes` the lengths of the arrays that are written.
    """

    equal, unequal, either = "==", "!=", "||"
    margin, end = "  ", ";"
    """What stands before and after every statement."""
    defines, declares = "", ""
    """What stands before the name of a value at its definition, and of one that a branch may change."""
    infinity, not_a_number = "INFINITY", "NAN"

    def __init__(self, scalars: Sequence[str] = ()) -> None:
        super().__init__(scalars)
        self.read: set[str] = set()
        self.written: set[str] = set()
        self.loaded: dict[str, tuple[str, int]] = {}
        self.stored: dict[str, tuple[str, int]] = {}
        self.sizes: dict[str, int] = {}

    def element(self, array: str, index: int) -> str:
        """An array element as an expression."""
        return f"{array}[{index}]"

    def arithmetic(self, operator: str, a: str, b: str) -> str:
        return self.put(f"{a} {operator} {b}")

    def negative(self, a: str) -> str:
        return self.put(f"-{a}")

    def choose(self, comparison: str, a: str, b: str, when_true: str, when_false: str) -> str:
        relation = {"==": self.equal, "!=": self.unequal}.get(comparison, comparison)
        return self.conditional(f"{a} {relation} {b}", when_true, when_false)

    def conditional(self, test: str, when_true: str, when_false: str) -> str:
        """The name of one of two values, by a test."""
        return self.put(f"({test}) ? {when_true} : {when_false}")

    @abc.abstractmethod
    def remark(self, text: str) -> str:
        """A comment at the end of a line."""

    def begin_branch(self, test: str) -> str:
        """The line that opens a branch."""
        return f"  if ({test}) {{"

    end_branch = "  }"

    def literal(self, value: float) -> str:
        """A finite number; it is read back as the same number."""
        return repr(value)

    def constant(self, value: float) -> str:
        if math.isnan(value):
            return self.not_a_number
        text = self.infinity if math.isinf(value) else self.literal(abs(value))
        return f"(-{text})" if math.copysign(1.0, value) < 0 else text

    def load(self, array: str, index: int) -> str:
        self.read.add(array)
        if array in self.scalars:
            return array
        value = self.put(self.element(array, index))
        self.loaded[value] = array, index
        return value

    def store(self, array: str, index: int, value: str) -> None:
        self.written.add(array)
        self.sizes[array] = max(self.sizes.get(array, 0), index + 1)
        self.stored.setdefault(value, (array, index))
        self.lines.append(self.assigned(self.element(array, index), value))

    def assignment(self, name: str, expression: str) -> str:
        return self.assigned(f"{self.defines}{name}", expression)

    def assigned(self, variable: str, value: str) -> str:
        """The line that assigns a value to a variable or an element."""
        return f"{self.margin}{variable} = {value}{self.end}"

    def name_values(self, labels: Labels, named: Mapping[str, tuple[str, int]], taken: Collection[str]) -> None:
        """Give the values that stand in arrays with labels the names of these, unless a name is taken.

        `named` are the places of further values.
        """
        names: dict[str, Label] = {}
        places = {**named, **self.stored, **self.loaded}
        used = {"", *taken}
        for value, (array, index) in sorted(places.items(), key=lambda item: item[0] in self.stored):
            label = labels[array][index] if index < len(labels.get(array, ())) else None
            if label and _NUMBERED.fullmatch(value) and label.name not in used and not _NUMBERED.fullmatch(label.name):
                names[value] = label
                used.add(label.name)
        self.lines = [self._with_names(line, names) for line in self.lines]

    def _with_names(self, line: str, names: Mapping[str, Label]) -> str:
        found = _DEFINED.match(line)
        remark = names[found[1]].remark if found and found[1] in names else ""
        text = _NUMBERED.sub(lambda value: names[value[0]].name if value[0] in names else value[0], line)
        return f"{text}  {self.remark(remark)}" if remark else text

    def unless_zero(
        self, gates: Sequence[str], compute: Callable[[], dict[Operand, str]], instead: Mapping[Operand, str]
    ) -> dict[Operand, str]:
        joined = {operand: self.new_name() for operand in instead}
        self.lines += [self.assigned(f"{self.declares}{joined[operand]}", value) for operand, value in instead.items()]
        tests = f" {self.either} ".join(f"{gate} {self.unequal} {self.constant(0.0)}" for gate in gates)
        self.lines.append(self.begin_branch(tests))
        outside, self._known = self._known, dict(self._known)  # values of the block are not available after it
        begin, inside = len(self.lines), compute()
        self._known = outside
        self.lines += [self.assigned(name, inside[operand]) for operand, name in joined.items()]
        self.lines[begin:] = [f"  {line}" for line in self.lines[begin:]]
        self.lines += [self.end_branch] if self.end_branch else []
        return joined


@dataclasses.dataclass(frozen=True)
class TextLanguage(TargetLanguage):
    """A language of expressions, whose functions have bodies of one class."""

    body_type: ClassVar[Callable[[Sequence[str]], TextBody]]
    labels: Labels = dataclasses.field(default_factory=dict, hash=False, kw_only=True)

    def body(self, scalars: Sequence[str] = ()) -> TextBody:
        return type(self).body_type(scalars)
