"""Declaration of requests: frozen dataclasses whose fields state meaning, unit and bounds of what a
user may give.

The options of a command, the form of the page and the tables of a file are derived from the fields,
and so are the conversion of texts to SI units and the messages. A request may define `check(where)`
for conditions on several fields.
"""

import dataclasses
import math
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar, dataclass_transform

from ...core import Hint, HintedText, InputError, quantity, suggestion
from ...core.annotation_parts import alternatives, item_type, type_hints

T = TypeVar("T")
Where = Callable[[str], str]
"""The name of a field in the words of an outlet, such as --max-length."""
_KEY = "option"
YES = "yes"
"""Text of a form for a box that is marked."""


class RequestError(InputError):
    """Texts that are no request: a missing or contradictory field. `field` is the field of a page
    that it concerns.
    """

    def __init__(self, message: str, field: str = "") -> None:
        super().__init__(message)
        self.field = field


Instruction = Callable[[Hint], str]
"""The end of a sentence that states what to do in the words of an outlet."""


def reworded(text: str, instructions: Mapping[str, Instruction]) -> str:
    """The text with its hints in the words of an outlet, by argument or function; a hint without a
    remedy there is omitted."""
    if not isinstance(text, HintedText):
        return text

    def sentence(hint: Hint) -> str:
        instruction = instructions.get(hint.argument or hint.function)
        return f"{hint.purpose}, {instruction(hint)}." if instruction else ""

    return text.written(sentence)


def read_pair(text: str, where: str) -> tuple[str, str]:
    """Name and text of a value such as COLUMN=UNIT. Raises RequestError."""
    name, sign, value = text.partition("=")
    if not (name.strip() and sign):
        raise RequestError(f"{where} must be NAME=TEXT, not {text}")
    return name.strip(), value.strip()


def check_rules(rules: Mapping[str, Any]) -> None:
    """Raise RequestError with the first message whose condition applies."""
    for message, applies in rules.items():
        if applies:
            raise RequestError(message)


@dataclasses.dataclass(frozen=True)
class Option:
    """Declaration of one field of a request.

    name      of the field
    kind      bool, int, float, str or Path
    repeated  whether several values may be given
    meaning   help text: what it is, with an example
    unit      SI unit into which a text is converted; empty for other fields
    bounds    closed range [SI]
    choices   allowed texts with their values; empty if any is allowed
    read      conversion of a text, given the name of the field for messages
    metavar   placeholder of the value in a help text
    flag      name on the command line, if it is not that of the field
    label     name in a form, with a hint beside its field and an example in it
    filled    text in the field of a form at first
    offered   values that a form offers, with their names
    default   as text, None without
    empty     whether an empty text is a value
    complete  completion of a text on the command line
    """

    name: str
    kind: type[Any]
    repeated: bool
    meaning: str
    unit: str = ""
    bounds: tuple[float, float] = (-math.inf, math.inf)
    choices: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    read: Callable[[str, str], Any] | None = None
    metavar: str = ""
    flag: str = ""
    label: str = ""
    hint: str = ""
    example: str = ""
    filled: str = ""
    offered: Sequence[tuple[str, str]] = ()
    default: Any = None
    needed: bool = False
    empty: bool = False
    complete: Callable[[str], list[str]] | None = None

    def convert(self, value: Any, where: str) -> Any:
        """A value as given, a text or what a parser has made of it, as that of the field. Raises
        InputError.
        """
        if self.choices:
            if value not in self.choices:
                allowed = ", ".join(filter(None, self.choices))
                similar = suggestion(str(value), self.choices)
                raise RequestError(
                    f"{where} is '{value}'; allowed range: {allowed}.{similar}", self.name
                )
            return self.choices[value]
        if self.read is not None:
            return self.read(value, where) if isinstance(value, str) else value
        if self.unit and isinstance(value, str):
            value = quantity(value, self.unit, where=where)
        elif self.kind is int and isinstance(value, str):
            if not re.fullmatch(r"\s*(-[0-9]{1,8}|[0-9]{1,9})\s*", value):
                raise RequestError(f"{where} is '{value}'; give a whole number.")
            value = int(value)
        elif self.kind is bool and isinstance(value, str):
            if value != YES:
                raise RequestError(f"{where} is '{value}'; give {YES}, or nothing.", self.name)
            value = True
        self._check_bounds(value, where)
        return value

    def _check_bounds(self, value: Any, where: str) -> None:
        low, high = self.bounds
        if (
            isinstance(value, int | float)
            and not isinstance(value, bool)
            and not low <= value <= high
        ):
            unit = "" if self.unit in ("", "1") else f" {self.unit}"
            allowed = f"{low:g} to {high:g}{unit}"
            raise RequestError(f"{where} is {value:g}{unit}; allowed range: {allowed}.", self.name)


def option(
    meaning: str, *, default: Any = dataclasses.MISSING, choices: Any = None, **declared: Any
) -> Any:
    """Declare a field; the keywords are those of `Option`. A default text is converted as a given
    one.
    """
    names = choices if isinstance(choices, Mapping) else {name: name for name in choices or ()}
    metadata = {"meaning": meaning, "default": default, "choices": names, **declared}
    value = default
    if isinstance(default, str):
        value = Option("default", str, False, **{**metadata, "default": None}).convert(
            default, "default"
        )
    return dataclasses.field(metadata={_KEY: metadata}, default=value)


def optional(meaning: str, **declared: Any) -> Any:
    """Declare a field that is None unless it is given."""
    return option(meaning, default=None, **declared)


def many(meaning: str, **declared: Any) -> Any:
    """Declare a field that may be given several times."""
    return option(meaning, default=(), **declared)


@dataclass_transform(frozen_default=True, kw_only_default=True, field_specifiers=(option,))
def request(cls: type[T]) -> type[T]:
    """Make a class a request: a frozen dataclass of declared fields."""
    return dataclasses.dataclass(frozen=True, kw_only=True, eq=False)(cls)


def options_of(cls: Any) -> tuple[Option, ...]:
    """The declared fields of a request, in order."""
    hints = type_hints(cls)
    options = []
    for field in dataclasses.fields(cls):
        if _KEY not in field.metadata:
            continue
        declared = dict(field.metadata[_KEY])
        hint = hints[field.name]
        default = declared.pop("default")
        needed = default is dataclasses.MISSING
        repeated = item_type(hint)
        kinds = alternatives(hint) if repeated is None else (repeated,)
        kind = next(kind for kind in kinds if kind is not type(None))
        options.append(
            Option(
                field.name,
                kind if kind in (bool, int, float, str, Path) else str,
                repeated is not None,
                needed=needed,
                default=None if needed or default in ((), None) else default,
                **declared,
            )
        )
    return tuple(options)


def form_fields(cls: type[Any]) -> list[dict[str, Any]]:
    """The fields of a form: name, label, hint, example, text at first, offered values with their
    names, and the text of a box that may be marked."""
    names = ("name", "label", "hint", "example", "filled")
    return [
        {
            **{name: getattr(option, name) for name in names},
            "offered": list(map(list, option.offered)),
            "mark": YES if option.kind is bool else "",
        }
        for option in options_of(cls)
        if option.label
    ]


def build(cls: type[T], given: Mapping[str, Any], where: Where) -> T:
    """The request of the values that a user has given; None and empty texts stand for the default.

    In the text of a form the values of a repeated field stand between commas, spaces or lines.
    Raises InputError, with the name of the field in the words of the outlet.
    """
    values: dict[str, Any] = {}
    for option in options_of(cls):
        value = given.get(option.name)
        if value is None or value in ((), []) or (value == "" and not option.empty):
            if option.needed:
                demand = "give a number with its unit" if option.unit else "give it"
                raise RequestError(f"{where(option.name)} is missing; {demand}.", option.name)
            continue
        label = where(option.name)
        if option.repeated:
            value = re.split(r"[,;\s]+", value.strip(",; \n")) if isinstance(value, str) else value
            values[option.name] = tuple(option.convert(item, label) for item in value)
        else:
            values[option.name] = option.convert(value, label)
    made = cls(**values)
    if hasattr(made, "check"):
        made.check(where)
    return made
