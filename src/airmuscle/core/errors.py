"""Exceptions and warnings. A message states the location, the cause, the allowed values and the
remedy.
"""

import dataclasses
import difflib
import itertools
import re
import unicodedata
from collections.abc import Callable, Collection, Iterable, Mapping
from typing import Any, Self

MAX_LISTED = 40
MAX_LISTED_NAME = 60
MAX_LISTED_TEXT = 400
"""Number of names of a file that a message lists, and of characters of each and of all (chosen)."""
MAX_WORD = 200
"""Maximum number of characters of an argument that a message quotes (chosen)."""
MAX_PLACE = 600
"""Maximum number of characters before the first colon, where the path of a file stands (chosen)."""
_LONG_QUOTATION = re.compile(
    rf"\A[^:\n]{{{MAX_PLACE + 1},}}(?=:)|\S{{{MAX_WORD + 1},}}|(?<![^\s(\[])'(?=[^\s;,.:)])[^'\n]{{{MAX_WORD + 1},}}'"  # noqa: E501
)


@dataclasses.dataclass(frozen=True)
class Hint:
    """A remedy: the argument of a public function that serves a purpose.

    purpose   what the argument is for, as the beginning of a sentence: "To fix one parameter"
    argument  name of the argument; empty if the remedy is the function itself
    value     its value; `...` if the user chooses it
    function  the public function that takes the argument, if it is not the one that was called
    constant  name of the value, if it is a named constant

    `str(hint)` is a sentence in the words of Python: "To fix one parameter, use fixed=('radius',)."
    """

    purpose: str
    argument: str = ""
    value: Any = ...
    function: str = ""
    constant: str = ""

    def __str__(self) -> str:
        if not self.argument:
            return f"{self.purpose}, use {self.function}."
        owner = f" of {self.function}" if self.function else ""
        return (
            f"{self.purpose}, use {self.argument}={self.constant or _notation(self.value)}{owner}."
        )


class HintedText(str):
    """Text with hints, a string in the words of Python; `written` gives it in the words of another
    interface.

    parts  texts, and hints as whole sentences; a hint is separated from the text before it by a
           space
    """

    parts: tuple[str | Hint, ...]

    def __new__(cls, *parts: str | Hint) -> "HintedText":
        """The text of its parts; parts that are hinted texts are merged."""
        merged: list[str | Hint] = []
        for part in parts:
            merged += part.parts if isinstance(part, HintedText) else [part]
        text = super().__new__(cls, _joined(merged, str))
        text.parts = tuple(merged)
        return text

    def __reduce__(self) -> "tuple[type[HintedText], tuple[str | Hint, ...]]":
        return HintedText, self.parts

    @property
    def hints(self) -> tuple[Hint, ...]:
        """The hints, in their order."""
        return tuple(part for part in self.parts if isinstance(part, Hint))

    def written(self, write: Callable[[Hint], str]) -> str:
        """The text with each hint as the sentence that `write` returns; a hint without a sentence
        is omitted.
        """
        return _joined(self.parts, write)

    def changed(self, change: Callable[[str], str]) -> "HintedText":
        """The text with `change` applied to all parts that are not hints."""
        return HintedText(
            *(part if isinstance(part, Hint) else change(part) for part in self.parts)
        )


def _joined(parts: list[str | Hint] | tuple[str | Hint, ...], write: Callable[[Hint], str]) -> str:
    text = ""
    for part in parts:
        if not isinstance(part, Hint):
            text += part
        elif sentence := write(part):
            text += f" {sentence}" if text else sentence
    return text


def _notation(value: Any) -> str:
    """A value as a Python expression; fields of a dataclass that have their default are omitted."""
    if value is ...:
        return "..."
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key!r}: {_notation(item)}" for key, item in value.items()) + "}"
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = [(field, getattr(value, field.name)) for field in dataclasses.fields(value)]
        differing = [
            (
                _notation(item)
                if field.default is dataclasses.MISSING
                else f"{field.name}={_notation(item)}"
            )
            for field, item in fields
            if item != field.default
        ]
        return f"{type(value).__name__}({', '.join(differing)})"
    return repr(value)


def printable(text: str) -> str:
    r"""The text with control characters and undecodable bytes replaced by escapes such as \x1b."""
    return text if text.isprintable() else "".join(map(_escape, text))


def quotable(text: str) -> str:
    """The printable text, without the middle of words, quotations and paths that are too long."""
    return _LONG_QUOTATION.sub(
        lambda part: f"{part[0][: MAX_WORD - 40]}…{part[0][-39:]}", printable(text)
    )


def listed(
    names: Iterable[str], characters: int = MAX_LISTED_TEXT, longest: int = MAX_LISTED_NAME
) -> str:
    """Names of a file, such as its headings, for a message: the first ones in so many characters,
    and how many more.
    """
    all_names = [name if len(name) <= longest else f"{name[: longest - 1]}…" for name in names]
    ends = itertools.accumulate(len(name) + 2 for name in all_names)
    count = min(MAX_LISTED, max(sum(end <= characters for end in ends), 1))
    rest = len(all_names) - count
    return ", ".join(all_names if rest <= 1 else [*all_names[:count], f"and {rest} more"])


def _escape(character: str) -> str:
    """A character, an escape of one that cannot be printed; a byte that could not be decoded
    (U+DC80 to U+DCFF, PEP 383) is written as that byte."""
    if character.isprintable() or character in "\n\t" or unicodedata.category(character) == "Zs":
        return character
    code = ord(character)
    if 0xDC80 <= code <= 0xDCFF:
        return f"\\x{code - 0xDC00:02x}"
    return character.encode("unicode_escape").decode("ascii")


class AirmuscleError(Exception):
    """Base class of all exceptions of airmuscle; a message may quote a file, so control characters
    are escaped.

    message  location, cause and allowed values; a HintedText keeps its hints
    hint     the remedy, if it is an argument of a public function; it becomes the last sentence of
             the message
    """

    def __init__(self, message: str = "", *, hint: Hint | None = None) -> None:
        text = message if isinstance(message, HintedText) else HintedText(str(message))
        super().__init__(HintedText(text, *([] if hint is None else [hint])).changed(quotable))

    @property
    def message(self) -> HintedText:
        """The message with its hints."""
        text = self.args[0]
        return text if isinstance(text, HintedText) else HintedText(str(text))

    @property
    def hint(self) -> Hint | None:
        """The first hint of the message, or None."""
        return next(iter(self.message.hints), None)

    def located(self, location: object) -> Self:
        """The same error, with hints and partial results, whose message begins with a location."""
        error = type(self)(HintedText(f"{location}: ", self.message))
        error.__dict__.update(self.__dict__)
        return error


class AirmuscleWarning(UserWarning):
    """Warning about a result that may differ from what the user expects; the message states the
    cause.
    """


class InputError(AirmuscleError):
    """Invalid input."""


class FileError(InputError):
    """A file or folder cannot be read or written."""


class FolderInUseError(FileError):
    """Another command is writing to the output folder."""


class ColumnError(InputError):
    """A recording lacks a column, or a column contains no numbers."""


class UnitError(InputError):
    """A unit is unknown or of the wrong dimension."""


class ParameterError(InputError):
    """A parameter is missing, misspelt, of the wrong type or physically impossible."""


class UnknownNameError(InputError):
    """No muscle, characteristic, component or paper has that name."""


class PhysicsError(AirmuscleError):
    """The model has no solution."""


class SolveError(PhysicsError):
    """No pressure, contraction or force satisfies the request."""


class GeometryLimitError(PhysicsError):
    """A contraction outside the range of the geometry."""


class RatingError(PhysicsError):
    """An operating point that the maker of the muscle does not permit, outside the range of the
    measurements.
    """


class EquilibriumError(PhysicsError):
    """A plant has no equilibrium; the message names the muscle and the forces."""


class RigError(AirmuscleError):
    """A test rig does not answer, or refuses a command."""


class TraceError(AirmuscleError):
    """A model cannot be traced into a compiled program."""


class IdentificationError(AirmuscleError):
    """The data cannot determine the requested quantities.

    cause  the cause alone, in one phrase for tables; empty if there is none
    """

    def __init__(self, message: str = "", *, hint: Hint | None = None, cause: str = "") -> None:
        super().__init__(message, hint=hint)
        self.cause = printable(cause)


class SimulationError(AirmuscleError):
    """A simulation ended early.

    `solution` is the Solution of the partial results, or None; `interrupted` is true if the user
    stopped the run.
    """

    def __init__(self, message: str, solution: Any = None, *, interrupted: bool = False) -> None:
        super().__init__(message)
        self.solution = solution
        self.interrupted = interrupted

    @property
    def recording(self) -> Any:
        """Recording of the partial results, or None."""
        return None if self.solution is None else self.solution.recording


def alternatives(name: str, known: Iterable[str], introduction: str = "there are") -> str:
    """What follows an unknown name in a message: the known names, abridged if there are many, and
    the closest one.
    """
    names = list(known)
    stems: dict[str, list[str]] = {}
    for path in names:
        stems.setdefault(re.sub(r"\[\d+\]", "[]", path), []).append(path)
    shown = [
        group[0] if len(group) == 1 else f"{group[0]} to {group[-1]}" for group in stems.values()
    ]
    return (
        f"; {introduction}"
        f" {listed(shown, longest=MAX_WORD) or 'none'}.{suggestion(str(name), names)}"
    )


def check_known(
    missing: str,
    names: str | Iterable[str],
    known: Collection[str],
    introduction: str = "there are",
    error: type[AirmuscleError] = ParameterError,
) -> None:
    """Raise an error, "no input 'x'; there are a, b.", with the nearest name, for the first name
    that is not known.
    """
    for name in names if isinstance(names, Iterable) and not isinstance(names, str) else (names,):
        if name not in known:
            raise error(f"{missing} '{name}'{alternatives(str(name), known, introduction)}")


def suggestion(name: str, known: Iterable[str]) -> str:
    """Return a sentence that suggests the closest known name, or a path that ends with the name, or
    an empty string.
    """
    names = list(known)
    matches = difflib.get_close_matches(str(name), names, n=1) or [
        path for path in names if path.endswith(f".{name}")
    ]
    return f" Did you mean '{matches[0]}'?" if matches else ""
